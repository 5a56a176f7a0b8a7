"""Study files: what they may hold, what they mean, and how bad ones are refused."""

import pytest
from small_study import TEXT, small, written

from staniel.errors import ScenarioError
from staniel.studies import load_study, study_names
from staniel.studies.load import points_of


@pytest.mark.parametrize("name", study_names())
def test_packaged_studies_make_scenarios(name):
    study = load_study(name)
    points = points_of(study)
    assert study.name == name
    assert len(points) == len(study.combinations())
    assert study.seeds >= 50
    assert study.claims
    assert study.question.endswith("?")


def test_the_six_experiments_of_the_thesis_are_there():
    for number in range(1, 7):
        assert load_study(str(number)).name.startswith(f"{number}-")


def test_every_study_pins_the_carrot_but_the_one_that_compares_policies():
    for name in study_names():
        policies = {point.scenario.guidance.pursuit for point in points_of(load_study(name))}
        assert policies == ({"carrot", "orbit", "lookahead"} if name == "pursuit" else {"carrot"})


def test_values_and_scales_reach_the_scenario():
    points = points_of(load_study("4"))
    speeds = [point.scenario.vehicles.speed for point in points]
    assert speeds == pytest.approx([15.0 * point.levels[0].x for point in points])
    assert (min(speeds), max(speeds)) == pytest.approx((1.5, 21.0))
    assert {point.scenario.aircraft.speed for point in points} == {15.0}


def test_grids_are_joined_and_nothing_is_flown_twice():
    study = load_study("6")
    assert len(study.combinations()) == 11
    numbers = {
        (point.scenario.vehicles.count, point.scenario.aircraft.count) for point in points_of(study)
    }
    assert (4, 4) in numbers
    assert (12, 4) in numbers
    assert (4, 12) in numbers
    assert (12, 12) not in numbers


def test_levels_set_several_keys(tmp_path):
    text = (
        TEXT.replace(
            'key = "aircraft.count"\nvalues = [1, 2]',
            'levels = [{label = "alone", set = {"aircraft.count" = 1}}, '
            '{label = "pair", x = 2.0, set = {"aircraft.count" = 2, "aircraft.altitude" = 90.0}}]',
        )
        .replace("aircraft = 2", 'aircraft = "pair"')
        .replace("aircraft = 1", 'aircraft = "alone"')
    )
    first, second = points_of(small(tmp_path, text))
    assert (first.scenario.aircraft.count, second.scenario.aircraft.count) == (1, 2)
    assert second.scenario.aircraft.altitude == 90.0
    assert first.scenario.minutes == 0.15
    assert points_of(small(tmp_path, text), minutes=0.5)[0].scenario.minutes == 0.5


def test_files_are_relative_to_the_study(tmp_path):
    (tmp_path / "mine.toml").write_text("minutes = 0.1\n[aircraft]\ncount = 3\n")
    text = TEXT.replace('base = "village"', 'base = "mine.toml"')
    assert points_of(small(tmp_path, text))[0].scenario.name == "mine"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            '"longest_gap"]',
            '"longest_gab"]',
            r'unknown metric .longest_gab., did you mean "longest_gap"',
        ),
        ("seeds = 2", "seeds = 0", r"line 5: seeds = 0: expected at least 1"),
        ("seeds = 2", 'seeds = "2"', r"seeds = \"2\": expected a whole number"),
        ("seeds = 2", "seed = 2", r"line 5: seed: unknown key, did you mean"),
        ("values = [1, 2]", "values = []", r"values of factor aircraft are missing"),
        ("values = [1, 2]", "values = [1, 1]", r"factor aircraft has a level twice"),
        (
            "values = [1, 2]",
            "values = [1, 2]\nbaseline = 3",
            r"baseline of factor aircraft: no level 3",
        ),
        ('key = "aircraft.count"\n', "", r"either key and values, or levels"),
        (
            "at = { aircraft = 2 }",
            "at = { aircraft = 5 }",
            r"factor aircraft has no level 5, expected one of: 1, 2",
        ),
        (
            "at = { aircraft = 2 }",
            "at = { airplanes = 2 }",
            r"unknown factor 'airplanes', expected one of: aircraft",
        ),
        (
            'expect = "higher"',
            'expect = "more"',
            r"expect = \"more\": expected 'lower' or 'higher'",
        ),
        ('name = "aircraft"', 'name = "seed"', r"the name seed is a column of its own"),
        ("[settings]", "[settings", r"not valid TOML"),
        ("expect", 'along = "aircraft"\nexpect', r"at most one of them"),
    ],
)
def test_what_is_wrong_is_named(tmp_path, old, new, message):
    assert old in TEXT
    with pytest.raises(ScenarioError, match=message):
        small(tmp_path, TEXT.replace(old, new))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            'key = "aircraft.count"',
            'key = "aircraft.cuont"',
            r'point 0 \(aircraft = 1\): aircraft\.cuont: unknown key, did you mean "count"',
        ),
        (
            "values = [1, 2]",
            "values = [1, 2.5]",
            r"point 1 .*aircraft\.count = 2\.5: expected a whole number",
        ),
        ('base = "village"', 'base = "vilage"', r"point 0.*not found"),
    ],
)
def test_a_point_that_cannot_be_flown_is_named(tmp_path, old, new, message):
    text = TEXT.replace(old, new).replace("aircraft = 2", "aircraft = 1")
    with pytest.raises(ScenarioError, match=message):
        points_of(small(tmp_path, text))


def test_unknown_studies_are_refused(tmp_path):
    with pytest.raises(ScenarioError, match=r"study '7' not found: expected .*6-ratios"):
        load_study("7")
    with pytest.raises(ScenarioError, match=r"is a folder"):
        load_study(tmp_path)
    big = written(tmp_path, "#" * 1_000_001, "big.toml")
    with pytest.raises(ScenarioError, match=r"longer than 1,000,000 bytes"):
        load_study(big)


def test_too_many_points_are_refused(tmp_path):
    factors = "".join(
        f'[[factors]]\nname = "f{k}"\nkey = "radio.sigma"\nvalues = {list(range(1, 51))}\n'
        for k in range(2)
    )
    text = TEXT[: TEXT.index("[[factors]]")] + factors
    with pytest.raises(ScenarioError, match=r"factors make 2,500 points: expected at most 2,000"):
        small(tmp_path, text)
