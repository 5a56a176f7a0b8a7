"""The bar is cheap, the text readable, the note on compiling comes only when it takes long."""

import io
import time

import pytest
from rich.console import Console

from staniel.terminal import Reporter
from staniel.terminal import flight as terminal


def reporter(*, tty: bool) -> tuple[Reporter, io.StringIO]:
    stream = io.StringIO()
    made = Reporter(console=Console(file=stream, force_terminal=tty, width=100))
    return made, stream


def tick(made: Reporter, seconds: float) -> None:
    made.on_event("tick", time=seconds, duration=600.0, real_time_factor=300.0)


def test_without_a_terminal_a_line_each_quarter(monkeypatch):
    monkeypatch.setattr(terminal, "REFRESH", 0.0)
    made, stream = reporter(tty=False)
    with made:
        for second in range(601):
            tick(made, float(second))
    lines = stream.getvalue().splitlines()
    assert [line.split(" · ")[0] for line in lines] == [
        f"flying: {t} of 10:00" for t in ("2:30", "5:00", "7:30", "10:00")
    ]
    assert "0:01 left · 300× real time" in lines[1]


def test_on_a_terminal_a_bar_with_the_time_left(monkeypatch):
    monkeypatch.setattr(terminal, "REFRESH", 0.0)
    made, stream = reporter(tty=True)
    with made:
        tick(made, 300.0)
    assert "5:00 of 10:00 · 0:01 left · 300× real time" in stream.getvalue()


def test_the_last_tick_is_always_shown():
    made, stream = reporter(tty=False)
    with made:
        for second in range(601):
            tick(made, float(second))
    assert "flying: 10:00 of 10:00 · 0:00 left" in stream.getvalue()


@pytest.mark.parametrize("tty", [True, False])
def test_what_is_written_is_named(tty):
    made, stream = reporter(tty=tty)
    with made:
        made.on_event("rendering", what="overview.png")
    assert "overview.png" in stream.getvalue()


@pytest.mark.parametrize("tty", [True, False])
def test_a_tick_costs_next_to_nothing(tty):
    made, _ = reporter(tty=tty)
    with made:
        tick(made, 0.0)
        best = min(_seconds_of_ticks(made) for _ in range(5))
    assert best < 10e-6


def _seconds_of_ticks(made: Reporter) -> float:
    before = time.perf_counter()
    for second in range(1000):
        tick(made, float(second) * 0.1)
    return (time.perf_counter() - before) / 1000


@pytest.mark.parametrize(("delay", "noted"), [(0.2, True), (0.0, False)])
def test_the_note_on_compiling_waits_for_a_reason(monkeypatch, delay, noted):
    monkeypatch.setattr(terminal, "PATIENCE", 0.05)
    made, stream = reporter(tty=False)
    with made:
        made.on_event("compiling", done=0, total=2)
        time.sleep(delay)
        made.on_event("compiling", done=2, total=2)
    assert ("only the first time" in stream.getvalue()) == noted


def test_times_of_day_and_unknown_times():
    assert [terminal._clock(t) for t in (0.0, 59.6, 3601.0)] == ["0:00", "1:00", "60:01"]
    assert terminal._clock(float("nan")) == "--:--"


def team(watched, **seconds):
    causes = {"nobody_assigned": 0.0, "outside_footprint": 0.0, "building": 0.0, "track_lost": 0.0}
    return {"watched": watched, "unwatched": causes | seconds}


def test_the_three_largest_causes_of_what_was_unwatched_in_one_line():
    several = team(50.0, building=30.0, nobody_assigned=12.0, track_lost=6.0, outside_footprint=2.0)
    said = terminal._reasons(several)
    assert said == "unwatched 50%: building 30%, nobody assigned 12%, track lost 6%"
    longest = {"outside_footprint": 331.0, "missed_detection": 331.0, "nobody_assigned": 331.0}
    assert len(terminal._reasons(team(7.0, **longest))) <= 80
    assert terminal._reasons(team(99.7, building=0.3)) == "unwatched 0%"
    assert terminal._reasons(team(0.0)) == terminal._reasons({}) == ""
