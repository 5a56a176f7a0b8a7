"""Files and changes become a checked scenario, or one message that says what is wrong and where."""

import textwrap
from pathlib import Path

import numpy as np
import pytest

from staniel.errors import ScenarioError
from staniel.scenario import load_scenario, preset_names, read_settings
from staniel.scenario.toml import MAX_BYTES


@pytest.fixture
def write(tmp_path):
    def write(text: str, name: str = "mine.toml") -> Path:
        path = tmp_path / name
        path.write_text(textwrap.dedent(text), encoding="utf-8")
        return path

    return write


def refusal(path, **overrides) -> str:
    with pytest.raises(ScenarioError) as caught:
        load_scenario(path, **overrides)
    return str(caught.value)


def test_an_empty_file_is_the_default_mission_under_its_own_name(write):
    scenario = load_scenario(write("", "first try.toml"))
    default = load_scenario("downtown", name="first-try", description="")
    assert scenario == default


def test_overrides_merge_into_the_file(write):
    path = write("""
        seed = 4
        [aircraft]
        count = 7
        speed = 14.0
    """)
    scenario = load_scenario(
        path, minutes=2, aircraft={"count": np.int64(2)}, **{"city.size": [300, np.float64(200.0)]}
    )
    assert (scenario.seed, scenario.minutes) == (4, 2.0)
    assert (scenario.aircraft.count, scenario.aircraft.speed) == (2, 14.0)
    assert scenario.city.size == (300.0, 200.0)


def test_the_last_setting_wins_and_text_needs_no_quotes():
    settings = ["a.b=1", "a.c = carrot", 'a.d="x=y"', "a.b=2", "a.e=[1, 2]", "a.f=1\ng=2"]
    expected = {"b": 2, "c": "carrot", "d": "x=y", "e": (1, 2), "f": "1\ng=2"}
    assert read_settings(settings) == {"a": expected}


@pytest.mark.parametrize("setting", ["aircraft.count", "=3", " = 3", ""])
def test_a_setting_needs_a_key_and_a_value(setting):
    with pytest.raises(ScenarioError, match="expected KEY=VALUE"):
        read_settings([setting])


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("\n[aircraft]\nsped = 3", 3, 'aircraft.sped: unknown key, did you mean "speed"?'),
        ("sed = 3", 1, 'sed: unknown key, did you mean "seed"?'),
        ("[aircraft]\ncount = 0", 2, "aircraft.count = 0: expected at least 1"),
        ("[aircraft]\ncount = 501", 2, "aircraft.count = 501: expected at most 500"),
        ("[aircraft]\ncount = 2.5", 2, "aircraft.count = 2.5: expected a whole number"),
        ("[aircraft]\ncount = true", 2, "aircraft.count = true: expected a whole number"),
        ('[aircraft]\nspeed = "15"', 2, 'aircraft.speed = "15": expected a number'),
        ("[aircraft]\nspeed = 30", 2, "aircraft.speed = 30 must lie between min_speed = 11"),
        ("[camera]\nrange = nan", 2, "camera.range = nan: expected a finite number"),
        ("[camera]\nrange = inf", 2, "camera.range = inf: expected a finite number"),
        ("seed = -1", 1, "seed = -1: expected at least 0"),
        ("seed = 1979-05-27", 1, "seed = 1979-05-27: expected a whole number"),
        ("minutes = 0", 1, "minutes = 0: expected greater than 0"),
        ("minutes = 0.001", 1, "minutes = 0.001 is shorter than one clock.decision_step"),
        ("minutes = 1441", 1, "minutes = 1441: expected at most 1440"),
        ('chart = "partial"', 1, "chart = \"partial\": expected 'known' or 'blank'"),
        ('name = "../up"', 1, 'name = "../up": expected a match of'),
        ("aircraft = 3", 1, "aircraft = 3: expected a table"),
        ("[[aircraft]]\ncount = 2", 1, "aircraft = [{count = 2}]: expected a table"),
        ("[clock]\ndecision_step = 0.35", 2, "clock.decision_step = 0.35 must be a whole multiple"),
        ("[city]\nsize = [\n 600]", 2, "city.size[1]: missing"),
        ("[city]\nsize = [1, 2, 3]", 2, "city.size = [1, 2, 3]: expected 2 values"),
        ("[city]\nsize = [600, 'a']", 2, 'city.size[1] = "a": expected a number'),
        (
            "[city]\nheights = [40, 10]",
            2,
            "city.heights = [40, 10]: expected the lower bound first",
        ),
        ("[city]\ndensity = 1.0", 2, "city.density = 1.0: expected at most 0.8"),
        ('[city]\nsource = "image"', 1, 'city.file is missing: source = "image" needs a file name'),
        ('[city]\nsource = "grid"\nfile = "a.map"', 1, "city.cell is missing"),
        ("[city]\ncell = 3.0", 2, 'city.cell does not belong to source = "generate"'),
        (
            '[city]\nsource = "grid"\nfile = "a.map"\ncell = 3\nsize = [9, 9]',
            5,
            'city.size does not belong to source = "grid": expected only file, cell',
        ),
        ('[guidance]\npursuit = "carot"', 2, 'guidance.pursuit = "carot": unknown policy'),
    ],
)
def test_a_refusal_names_file_line_field_value_and_expectation(write, text, line, message):
    path = write(text)
    found = refusal(path)
    assert found.startswith(f"{path}, line {line}: {message}")
    assert "\n" not in found


def test_several_findings_have_a_line_each(write):
    path = write("""\
        seed = -1
        [aircraft]
        count = 2.5
        sped = 1
    """)
    lines = refusal(path).splitlines()
    assert len(lines) == 3
    assert {line.split(": ")[0] for line in lines} == {f"{path}, line {n}" for n in (1, 3, 4)}


def test_what_an_override_broke_is_not_blamed_on_the_file(write):
    found = refusal(write("[aircraft]\ncount = 2"), **{"aircraft.count": -1})
    assert found.startswith("aircraft.count = -1: expected at least 1")


def test_overrides_are_checked_like_the_file():
    assert 'did you mean "speed"?' in refusal("downtown", **{"aircraft.sped": 3})
    assert "seed = {x = 3}: expected a whole number" in refusal("downtown", **{"seed.x": 3})
    assert 'unknown policy, did you mean "carrot"' in refusal(
        "downtown", **{"guidance.pursuit": "carot"}
    )


@pytest.mark.parametrize(
    ("raw", "message"),
    [
        (b"a = [", "not valid TOML"),
        (b"[a]\n[a]", "not valid TOML"),
        (b"seed = 1\nname = '\xff'", "line 2: not UTF-8"),
        (b"a = " + b"[" * 5000, "nested too deeply"),
        (b"#" * (MAX_BYTES + 1), "longer than 1,000,000 bytes"),
    ],
)
def test_what_is_not_toml_is_refused(tmp_path, raw, message):
    path = tmp_path / "mine.toml"
    path.write_bytes(raw)
    found = refusal(path)
    assert message in found
    assert str(path) in found


def test_a_byte_order_mark_does_no_harm(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_bytes(b"\xef\xbb\xbfseed = 5\n")
    assert load_scenario(path).seed == 5


@pytest.mark.parametrize("name", ["nowhere.toml", "", "a\0b", "x" * 5000, "/nonexistent/a.toml"])
def test_a_missing_file_names_the_packaged_scenarios(name):
    found = refusal(name)
    assert all(preset in found for preset in preset_names())


def test_a_mistyped_name_gets_a_hint():
    assert 'did you mean "downtown"?' in refusal("dontown")


def test_a_folder_is_not_a_scenario(tmp_path):
    assert "is a folder" in refusal(tmp_path)


def test_a_map_named_in_the_file_is_found_beside_it(write, tmp_path):
    path = write('[city]\nsource = "grid"\nfile = "maps/a.map"\ncell = 2.0')
    assert load_scenario(path).city.file == str(tmp_path / "maps/a.map")


def test_a_map_named_by_hand_is_found_from_here(write, tmp_path, monkeypatch):
    path = write('[city]\nsource = "grid"\nfile = "maps/a.map"\ncell = 2.0')
    here = tmp_path / "elsewhere"
    here.mkdir()
    monkeypatch.chdir(here)
    assert load_scenario(path, city={"file": "b.map"}).city.file == str(here / "b.map")


def test_another_kind_of_city_takes_the_place_of_the_old_one():
    city = {"source": "grid", "file": "/a.map", "cell": 3.0}
    scenario = load_scenario("downtown", city=city)
    assert scenario.city.file == "/a.map"
    assert scenario.city.heights == load_scenario("downtown").city.heights
