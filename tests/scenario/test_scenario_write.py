"""What is written is valid TOML, and the same scenario comes back from it."""

import json
import tomllib
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from staniel.scenario import Scenario, dump_scenario, load_scenario, preset_names
from staniel.scenario.lines import key_lines

positive = st.floats(min_value=1e-300, max_value=1e300, allow_subnormal=False)
metres = st.floats(min_value=1e-3, max_value=1e5)
pair = st.tuples(metres, metres)
ordered = pair.map(lambda p: (min(p), max(p)))
city_seed = st.none() | st.integers(0, 10**30)

cities = st.one_of(
    st.fixed_dictionaries(
        {"source": st.just("generate")},
        optional={
            "size": pair,
            "density": st.floats(0.01, 0.8),
            "block": ordered,
            "heights": ordered,
            "seed": city_seed,
        },
    ),
    st.fixed_dictionaries(
        {
            "source": st.sampled_from(["image", "grid"]),
            # An absolute name: a relative one would be looked for beside the file.
            "file": st.text(
                st.characters(blacklist_categories=["Cs"], blacklist_characters="/."), min_size=1
            ).map(lambda name: f"/maps/{name}"),
            "cell": metres,
        },
        optional={"heights": ordered, "seed": city_seed},
    ),
)
scenarios = st.fixed_dictionaries(
    {},
    optional={
        "name": st.from_regex(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}", fullmatch=True),
        "description": st.text(st.characters(blacklist_categories=["Cs"]), max_size=200),
        "seed": st.integers(0, 2**63 - 1),
        "minutes": st.floats(0.1, 1440.0),
        "chart": st.sampled_from(["known", "blank"]),
        "city": cities,
        "aircraft": st.fixed_dictionaries(
            {}, optional={"count": st.integers(1, 500), "altitude": positive}
        ),
        "camera": st.fixed_dictionaries({}, optional={"range": positive, "noise": positive}),
        "clock": st.sampled_from([{"decision_step": 2.0}, {"dynamics_step": 0.05}]),
    },
)


@settings(max_examples=100, deadline=None)
@given(scenarios)
def test_what_is_written_reads_back_as_the_same_scenario(tmp_path_factory, data):
    scenario = Scenario.model_validate(data)
    path = tmp_path_factory.getbasetemp() / "round trip.toml"
    path.write_text(dump_scenario(scenario, "9.9"), encoding="utf-8", newline="")
    assert load_scenario(path) == scenario


@settings(max_examples=50, deadline=None)
@given(scenarios)
def test_the_text_holds_what_pydantic_serialises(data):
    scenario = Scenario.model_validate(data)
    written = tomllib.loads(dump_scenario(scenario, "9.9"))
    serialised = json.loads(scenario.model_dump_json(exclude_none=True))
    assert written == serialised


@settings(max_examples=50, deadline=None)
@given(scenarios)
def test_a_model_survives_its_own_dump(data):
    scenario = Scenario.model_validate(data)
    assert Scenario.model_validate(scenario.model_dump()) == scenario


@pytest.mark.parametrize("name", preset_names())
def test_the_first_line_names_scenario_and_version(name):
    text = dump_scenario(load_scenario(name), "1.2.3")
    assert text.splitlines()[0] == f"# {name}: a scenario of staniel 1.2.3"


def test_key_lines_finds_every_written_key():
    text = dump_scenario(load_scenario("downtown"), "1.2.3")
    lines = text.splitlines()
    found = key_lines(text)
    data = tomllib.loads(text)
    for section, value in data.items():
        keys = [(section, key) for key in value] if isinstance(value, dict) else [(section,)]
        for path in keys:
            assert lines[found[path] - 1].startswith((f"{path[-1]} ", f"[{'.'.join(path)}]"))


def test_key_lines_is_not_misled_by_texts_and_comments():
    text = Path(__file__).with_name("tricky.toml").read_text(encoding="utf-8")
    lines = text.splitlines()
    found = key_lines(text)
    marked = {number for number, line in enumerate(lines, 1) if line.rstrip().endswith("# HERE")}
    assert {found[("seed",)], found[("city", "size")], found[("a b", "c.d")]} == marked
    assert lines[found[("aircraft", "camera", "range")] - 1].startswith("aircraft.camera.range")
    # What tomllib finds and what the scanner finds are the same keys, inline tables aside.
    flat = set(_flat(tomllib.loads(text)))
    assert {path for path in flat if path[0] != "inline"} <= set(found)


def _flat(data, path=()):
    for key, value in data.items():
        if isinstance(value, dict):
            yield from _flat(value, (*path, key))
        else:
            yield (*path, key)
