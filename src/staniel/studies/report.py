"""A study's report: one HTML page that needs nothing beside it, and the figures as files."""

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any, Final

from staniel.errors import OutputError
from staniel.studies.catalogue import CATALOGUE
from staniel.studies.plots import Curve, curves_of, draw, draw_why, render
from staniel.studies.results import Results
from staniel.studies.tables import summary

__all__ = ["write_report"]

REPORT, FIGURES = "report.html", "figures"

_ANSWERS: Final = {
    "supported": "The interval carries the claim.",
    "contradicted": "The interval says the opposite.",
    "open": "The interval does not decide: not shown by these runs.",
}

_STYLE: Final = """
:root { color-scheme: light dark; --ink: #1b1b1f; --paper: #fff; --soft: #6b6b73; --line: #ddd;
  --good: #00734e; --bad: #b3261e; --open: #8a5a00; }
@media (prefers-color-scheme: dark) { :root { --ink: #ececf0; --paper: #17171a; --soft: #a0a0aa;
  --line: #3a3a40; --good: #4fc79a; --bad: #ff8a80; --open: #ffc46b; } }
body { font: 16px/1.55 system-ui, sans-serif; color: var(--ink); background: var(--paper);
  max-width: 60rem; margin: 3rem auto; padding: 0 1.25rem; }
h1 { line-height: 1.2; margin-bottom: .2rem; } h2 { margin-top: 2.5rem; }
.lead { font-size: 1.1rem; color: var(--soft); margin-top: 0; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: .86rem; font-variant-numeric: tabular-nums; }
th, td { padding: .35rem .8rem; border-bottom: 1px solid var(--line); text-align: right;
  white-space: nowrap; }
th:first-child, td:first-child { text-align: left; }
thead th { border-bottom: 2px solid var(--ink); vertical-align: bottom; }
td small { color: var(--soft); display: block; }
ul.claims { list-style: none; padding: 0; }
ul.claims li { border-left: 4px solid var(--line); padding: .3rem .9rem; margin: .8rem 0; }
li.supported { border-color: var(--good) !important; }
li.contradicted { border-color: var(--bad) !important; }
li.open { border-color: var(--open) !important; }
.answer { font-weight: 600; } .supported .answer { color: var(--good); }
.contradicted .answer { color: var(--bad); } .open .answer { color: var(--open); }
figure { margin: 1.5rem 0; background: #fff; border-radius: 6px; padding: .5rem; }
figure svg { width: 100%; height: auto; }
figcaption { color: #555; font-size: .86rem; padding: 0 .5rem; }
pre, code { font-size: .86rem; } pre { overflow-x: auto; padding: .8rem; border: 1px solid
  var(--line); border-radius: 6px; }
"""


def write_report(results: Results) -> list[Path]:
    """Write ``report.html`` and the figures, as PNG and SVG, into the study's folder.

    Parameters
    ----------
    results : Results

    Returns
    -------
    list of Path
        What was written, the report first.

    Raises
    ------
    OutputError
        They cannot be written.
    """
    folder = results.folder
    files: dict[str, bytes] = {}
    parts: list[str] = []
    for group, curves in enumerate(curves_of(results.study)):
        for metric in results.study.metrics:
            figure = draw(results, curves, metric)
            name = f"{metric}-{curves[0].factor.name}" + (f"-{group}" if group else "")
            svg = render(figure, "svg")
            files[f"{FIGURES}/{name}.svg"] = svg
            files[f"{FIGURES}/{name}.png"] = render(figure, "png")
            parts.append(_figure(svg, curves, metric))
    svg = render(draw_why(results), "svg")
    files[f"{FIGURES}/why-unseen.svg"] = svg
    files[f"{FIGURES}/why-unseen.png"] = render(draw_why(results), "png")
    page = _page(results, summary(results), parts, svg)
    return _write(folder, {REPORT: page.encode(), **files})


def _page(results: Results, about: Mapping[str, Any], figures: Sequence[str], causes: bytes) -> str:
    study = results.study
    title = escape(study.title or study.name)
    seeds = sorted(set(results.table["seed"].to_pylist()))
    span = f"seeds {seeds[0]}–{seeds[-1]}" if seeds else "no runs"
    head = (
        f'<h1>{title}</h1><p class="lead">{escape(study.question)}</p>'
        f"<p>{len(about['points'])} points, {len(seeds)} seeds each ({span}), "
        f"{_minutes(results.duration)} of mission time a run, staniel {escape(results.version)}. "
        "Every seed is flown at every point, in the same city with the same luck where the "
        "settings allow; intervals are 95 % bootstrap intervals of the mean over runs "
        "(bias-corrected and accelerated), differences are taken seed by seed.</p>"
    )
    claims = "".join(map(_claim, about["claims"]))
    sections = [
        head,
        f'<h2>Claims</h2><ul class="claims">{claims}</ul>' if claims else "",
        "<h2>Figures</h2>" + "".join(figures) if figures else "",
        "<h2>Why unseen</h2><p>Each second of each vehicle is watched, that is visible and with a "
        "track within 10 m, or it has the first of these causes that holds (order and tests: "
        "docs/metrics.md).</p>"
        + _embedded(causes, "what each second of the vehicles was, at each point"),
        _table(results, about),
        _failures(about["failures"]),
        _how(results, len(seeds)),
    ]
    return (
        '<!doctype html><html lang="en"><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{title}</title><style>{_STYLE}</style><body>{''.join(sections)}</body></html>\n"
    )


def _claim(claim: Mapping[str, Any]) -> str:
    answer = claim["answer"]
    return (
        f'<li class="{answer}">{escape(claim["claim"])}<br><span class="answer">{answer}</span>: '
        f"{escape(CATALOGUE[claim['metric']].label)} {escape(claim['text'])}, expected "
        f"{escape(claim['expected'])} (n = {claim['n']}). {_ANSWERS[answer]}</li>"
    )


def _figure(svg: bytes, curves: Sequence[Curve], metric: str) -> str:
    factor = curves[0].factor
    label = f"{CATALOGUE[metric].label} over {factor.label or factor.name}"
    return _embedded(svg, f"{label}: means and 95 % intervals")


def _embedded(svg: bytes, caption: str) -> str:
    text = svg.decode()
    text = text[text.index("<svg") :]
    return (
        f'<figure role="img" aria-label="{escape(caption)}">{text}'
        f"<figcaption>{escape(caption)}.</figcaption></figure>"
    )


def _table(results: Results, about: Mapping[str, Any]) -> str:
    study = results.study
    heads = [escape(factor.label or factor.name) for factor in study.factors] or ["point"]
    heads += map(escape, about["headings"].values())
    rows = []
    for point in about["points"]:
        cells = [escape(label) for label in point["levels"].values()] or ["all"]
        for metric in study.metrics:
            found = point["metrics"][metric]
            text = found["text"]
            if "difference" in found:
                text += f"<small>{found['difference']['text']}</small>"
            cells.append(text)
        rows.append("<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>")
    return (
        "<h2>All points</h2><p>Means with intervals; below them, in grey, the difference to the "
        'baseline, seed by seed.</p><div class="wide"><table><thead><tr>'
        + "".join(f"<th>{head}</th>" for head in heads)
        + f"</tr></thead><tbody>{''.join(rows)}</tbody></table></div>"
    )


def _failures(failures: Sequence[Mapping[str, Any]]) -> str:
    if not failures:
        return ""
    items = "".join(
        f"<li>point {failure['point']}, seed {failure['seed']}: "
        f"<code>{escape(_reason(failure))}</code></li>"
        for failure in failures[:50]
    )
    return (
        f"<h2>Runs that failed: {len(failures)}</h2><p>They count nowhere above.</p>"
        f"<ul>{items}</ul>"
    )


def _reason(failure: Mapping[str, Any]) -> str:
    lines = str(failure.get("error") or failure.get("died")).strip().splitlines()
    return lines[-1][:300] if lines else ""


def _how(results: Results, seeds: int) -> str:
    minutes = _minutes(results.duration).split(" ")[0]
    command = (
        f"staniel study run {results.study.name} --seeds {seeds} --minutes {minutes} --out DIR\n"
        "staniel study report DIR"
    )
    return (
        "<h2>Do it again</h2><p>The same study, seeds and version give the same "
        f"<code>results.parquet</code>, byte for byte.</p><pre>{escape(command)}</pre>"
    )


def _minutes(durations: Sequence[float]) -> str:
    shortest, longest = min(durations), max(durations)
    span = f"{shortest / 60.0:g}"
    return (span if shortest == longest else f"{span}–{longest / 60.0:g}") + " minutes"


def _write(folder: Path, files: Mapping[str, bytes]) -> list[Path]:
    written = []
    for name, data in files.items():
        path = folder / name
        partial = path.with_name(path.name + ".part")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            partial.write_bytes(data)
            partial.replace(path)
        except OSError as error:
            partial.unlink(missing_ok=True)
            raise OutputError(f"{path}: cannot be written ({error.strerror or error})") from error
        written.append(path)
    return written
