"""`staniel study ...`, as a person types it."""

import io
import json
import xml.etree.ElementTree as ET
from html.parser import HTMLParser

import pytest
from rich.console import Console
from typer.testing import CliRunner

from staniel.cli import app
from staniel.studies import workers
from staniel.terminal import StudyReporter

TEXT = """
name = "small"
title = "A & B <small>"
question = "Does it work?"
base = "village"
seeds = 3
metrics = ["visible_fraction_fine", "longest_gap"]
[settings]
minutes = 0.2
"vehicles.count" = 1
[[factors]]
name = "aircraft"
label = "aircraft"
key = "aircraft.count"
values = [1, 2]
[[factors]]
name = "chart"
key = "chart"
values = ["known", "blank"]
[[claims]]
text = "Two see more than one"
metric = "visible_fraction_fine"
at = { aircraft = 2 }
than = { aircraft = 1 }
expect = "higher"
[[claims]]
text = "Pigs fly"
metric = "longest_gap"
value = 1e9
expect = "higher"
"""


def call(*arguments):
    return CliRunner().invoke(app, ["study", *map(str, arguments)])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("study")
    (place / "small.toml").write_text(TEXT, encoding="utf-8")
    done = call("run", place / "small.toml", "--out", place / "out", "--workers", 1)
    assert done.exit_code == 0, done.output
    assert "12 of 12 runs" in done.stderr
    assert "Two see more than one" in done.stderr
    assert done.stdout == ""
    return place / "out"


def test_list_names_the_six_experiments():
    done = call("list")
    assert done.exit_code == 0
    lines = done.stdout.splitlines()
    assert [line[0] for line in lines[:6]] == list("123456")
    assert "14 points" in next(line for line in lines if line.startswith("4-speed"))


def test_show_prints_tables_and_json(folder):
    shown = call("show", folder).stdout
    assert "longest time out of sight [s]" in shown
    assert "contradicted" in shown
    about = json.loads(call("show", folder, "--json").stdout)
    assert [point["levels"] for point in about["points"]] == [
        {"aircraft": a, "chart": c} for a in "12" for c in ("known", "blank")
    ]
    found = about["points"][2]["metrics"]["longest_gap"]
    assert about["points"][2]["baseline"] == 0
    assert {"mean", "low", "high", "n", "difference"} < set(found)
    assert [claim["answer"] for claim in about["claims"]][1] == "contradicted"


class Tags(HTMLParser):
    """Counts tags, and holds that every one is closed."""

    def __init__(self):
        super().__init__()
        self.open, self.seen = [], []

    def handle_starttag(self, tag, attributes):
        self.seen.append(tag)
        if tag not in ("meta", "br"):
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.seen.append(tag)

    def handle_endtag(self, tag):
        while self.open.pop() != tag:
            pass


def test_report_is_one_page_with_its_figures(folder):
    done = call("report", folder)
    assert done.exit_code == 0
    files = done.stdout.split()
    assert files[0].endswith("report.html")
    page = (folder / "report.html").read_text()
    tags = Tags()
    tags.feed(page)
    assert tags.seen.count("svg") == 3
    assert tags.seen.count("li") == 2
    assert "A &amp; B &lt;small&gt;" in page
    assert "http" not in page.replace("http://www.w3.org", "").replace("http://purl", "").replace(
        "http://creativecommons", ""
    ).replace("https://matplotlib.org", "")
    for name in files[1:]:
        data = (folder / name).read_bytes()
        assert data.startswith(b"\x89PNG") or ET.fromstring(data).tag.endswith("svg")
    again = {name: (folder / name).read_bytes() for name in files}
    call("report", folder)
    assert again == {name: (folder / name).read_bytes() for name in files}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("run", "9-nothing"), "study '9-nothing' not found: expected a TOML file or a packaged"),
        (("run", "3", "--minutes", "-1"), "minutes = -1.0: expected greater than 0"),
        (("show", "."), "holds no study.json"),
        (("report", "."), "holds no study.json"),
        (("run", "3", "--scheduler", "tcp://127.0.0.1:9"), "cannot be reached"),
    ],
)
def test_mistakes_are_named_and_nothing_is_written(tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(workers, "CONNECT_WITHIN", 1)
    done = call(*arguments)
    assert done.exit_code == 2
    assert message in done.stderr
    assert "Traceback" not in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_seeds_and_workers_are_bounded():
    assert call("run", "3", "--seeds", "0").exit_code == 2
    assert call("run", "3", "--workers", "0").exit_code == 2


def reporter(**options):
    stream = io.StringIO()
    console = Console(file=stream, width=100, highlight=False, **options)
    return stream, StudyReporter("small", console=console)


def test_on_a_terminal_there_is_a_bar_with_the_time_left(monkeypatch):
    now = [0.0]
    monkeypatch.setattr("staniel.terminal.study.time.monotonic", lambda: now[0])
    stream, made = reporter(force_terminal=True)
    with made:
        made.on_event("runs", done=10, total=50, failed=0)
        now[0] = 20.0
        made.on_event("runs", done=20, total=50, failed=1)
    text = stream.getvalue()
    assert "10 of 50 runs are there already" in text
    # 10 runs in 20 s: 30 more take a minute.
    assert "20 of 50 runs · 1:00 left · 1 failed" in text


def test_elsewhere_a_line_now_and_then(monkeypatch):
    now = [0.0]
    monkeypatch.setattr("staniel.terminal.study.time.monotonic", lambda: now[0])
    stream, made = reporter()
    with made:
        for done in range(101):
            now[0] += 10.0
            made.on_event("runs", done=done, total=100, failed=0)
            made.on_event("wait")
    lines = stream.getvalue().splitlines()
    assert 30 <= len(lines) <= 40
    assert lines[-1] == "small: 100 of 100 runs · 0:00 left"
