"""A study's results as rows for people and programs: each point's means, intervals, differences."""

import math
from typing import Any

from staniel.studies.catalogue import CATALOGUE
from staniel.studies.model import Study
from staniel.studies.results import Results
from staniel.studies.statistics import (
    Estimate,
    Verdict,
    baseline_of,
    differences,
    estimate,
    judge,
    run_values,
)

__all__ = ["format_estimate", "format_number", "summary"]


def summary(results: Results) -> dict[str, Any]:
    """Everything that is said of a study, ready for JSON.

    Parameters
    ----------
    results : Results

    Returns
    -------
    dict
        ``study``, ``title``, ``version``; ``headings`` of the metrics; ``points``, each with its
        ``levels`` and, by metric, ``mean``, ``low``, ``high``, ``n``, ``text`` and ``difference``
        (the same of what it differs from its baseline, whose number is ``baseline``); ``claims``
        and ``failures``. None stands for what is undefined; ``text`` is for people, with shares in
        per cent.
    """
    study = results.study
    values = {metric: run_values(results, metric) for metric in study.metrics}
    points = []
    for number, steps in enumerate(study.combinations()):
        baseline = baseline_of(study, number)
        levels = {
            factor.name: factor.steps[step].label
            for factor, step in zip(study.factors, steps, strict=True)
        }
        shown = {}
        for metric, by_point in values.items():
            own = by_point[number]
            shown[metric] = _plain(estimate(list(own.values())), metric)
            if baseline is not None:
                change = estimate(differences(own, by_point[baseline]))
                shown[metric]["difference"] = _plain(change, metric, signed=True)
        points.append({"point": number, "levels": levels, "baseline": baseline, "metrics": shown})
    return {
        "headings": {metric: _heading(metric) for metric in study.metrics},
        "study": study.name,
        "title": study.title,
        "version": results.version,
        "points": points,
        "claims": [_claim(verdict, study) for verdict in judge(results)],
        "failures": results.failures,
    }


def format_number(value: float | None, metric: str) -> str:
    """A value of a metric as text, shares in per cent; a dash for what is undefined.

    Examples
    --------
    >>> format_number(0.4241, "visible_fraction_fine"), format_number(3.0, "longest_gap")
    ('42.4', '3.0')
    """
    if value is None or math.isnan(value):
        return "–"
    value = 100.0 * value if CATALOGUE[metric].unit == "%" else value
    size = abs(value)
    return f"{value:.0f}" if size >= 1000 else f"{value:.1f}" if size >= 1 else f"{value:.2f}"


def format_estimate(found: dict[str, Any], metric: str, *, signed: bool = False) -> str:
    """A mean and its interval as text, such as ``42.4 [39.0, 45.1]``."""
    texts = [format_number(found[key], metric) for key in ("mean", "low", "high")]
    if signed:
        texts = [text if text.startswith(("-", "–", "0.00")) else f"+{text}" for text in texts]
    mean, low, high = (text.replace("-", "−") for text in texts)
    return mean if low == "–" else f"{mean} [{low}, {high}]"


def _heading(metric: str) -> str:
    about = CATALOGUE[metric]
    return about.label + (f" [{about.unit}]" if about.unit else "")


def _plain(found: Estimate, metric: str, *, signed: bool = False) -> dict[str, Any]:
    values = {"mean": found.mean, "low": found.low, "high": found.high}
    plain: dict[str, Any] = {
        key: None if math.isnan(value) else round(value, 6) for key, value in values.items()
    }
    return {**plain, "n": found.n, "text": format_estimate(plain, metric, signed=signed)}


def _claim(verdict: Verdict, study: Study) -> dict[str, Any]:
    claim = verdict.claim
    unit = CATALOGUE[claim.metric].unit
    found = _plain(verdict.estimate, claim.metric)
    found["text"] += f" {unit}" if unit else ""
    if claim.along is not None:
        factor = study.factor("claims", claim.along)
        found["text"] += f" for each 1 of {factor.label or factor.name}"
    bound = format_number(claim.value, claim.metric) + (f" {unit}" if unit else "")
    return {
        "claim": claim.text,
        "metric": claim.metric,
        "expected": f"{claim.expect} than {bound}",
        "answer": verdict.answer,
        **found,
    }
