"""Intervals against coverage and normal theory, claims against results made by hand."""

import math

import numpy as np
import pyarrow as pa
import pytest
from scipy import stats
from small_study import TEXT, small

from staniel.studies.catalogue import CATALOGUE
from staniel.studies.model import Claim, Study
from staniel.studies.results import Results, _schema
from staniel.studies.statistics import (
    baseline_of,
    differences,
    estimate,
    judge,
    matching,
    run_values,
)

METRIC = "visible_fraction_fine"


def made(study, values, metric=METRIC):
    """Results with one vehicle a run; `values[point][seed]`, None for one never detected."""
    rows = [
        {
            "point": point,
            "seed": seed,
            "vehicle": 0,
            "version": "0",
            metric: value,
            **{
                factor.name: factor.steps[step].x if factor.numeric else factor.steps[step].label
                for factor, step in zip(study.factors, study.combinations()[point], strict=True)
            },
        }
        for point, of_point in enumerate(values)
        for seed, value in enumerate(of_point)
    ]
    schema = _schema(study)
    columns = {name: [row.get(name) for row in rows] for name in schema.names}
    return Results(None, study, (600.0,) * len(values), pa.table(columns, schema=schema), [], "0")


def test_intervals_cover_the_mean_as_often_as_they_say():
    """Of skewed samples of 50: the share of intervals that hold the mean is within its own band."""
    rng = np.random.default_rng(1)
    tries = 150
    inside = 0
    for sample in rng.gamma(2.0, 1.0, (tries, 50)):
        found = estimate(sample)
        inside += found.low <= 2.0 <= found.high
    low, high = stats.binom.interval(0.999, tries, 0.94)
    assert low <= inside <= high


def test_of_a_normal_sample_it_is_student_s_interval():
    sample = np.random.default_rng(2).normal(3.0, 2.0, 200)
    found = estimate(sample)
    low, high = stats.t.interval(0.95, 199, sample.mean(), stats.sem(sample))
    assert found.mean == pytest.approx(sample.mean())
    assert (found.low, found.high) == pytest.approx((low, high), abs=0.03)
    assert estimate(sample) == found  # no luck in it


def test_too_few_values_have_no_interval():
    assert math.isnan(estimate([]).mean)
    found = estimate([1.0, math.nan, 2.0])
    assert (found.mean, found.n) == (1.5, 2)
    assert math.isnan(found.low)


def test_pairs_are_taken_by_seed():
    assert differences({1: 5.0, 2: 7.0, 9: 1.0}, {2: 4.0, 1: 1.0, 3: 0.0}).tolist() == [4.0, 3.0]


def test_vehicles_never_detected_have_their_stand_in(tmp_path):
    study = small(tmp_path)
    seen = made(study, [[0.5, None], [0.25, 0.75]])
    assert run_values(seen, METRIC) == [{0: 0.5, 1: 0.0}, {0: 0.25, 1: 0.75}]
    gaps = made(study, [[5.0, None], [None, 3.0]], "longest_gap")
    assert run_values(gaps, "longest_gap") == [{0: 5.0, 1: 600.0}, {0: 600.0, 1: 3.0}]
    errors = made(study, [[5.0, None], [None, 3.0]], "position_rmse")
    assert run_values(errors, "position_rmse") == [{0: 5.0}, {1: 3.0}]
    assert CATALOGUE["position_rmse"].unseen == ""


def grid(claims):
    """Factors a (0, 1, 2) and b ("p", "q"), six points."""
    return Study.model_validate(
        {
            "factors": [
                {"name": "a", "key": "radio.sigma", "values": [1, 2, 3], "baseline": 2},
                {"name": "b", "key": "chart", "values": ["known", "blank"]},
            ],
            "claims": claims,
        }
    )


VALUES = [
    [0.10, 0.20, 0.30, 0.40],  # a = 1, known
    [0.11, 0.22, 0.31, 0.43],  # a = 1, blank
    [0.30, 0.40, 0.50, 0.61],  # a = 2, known
    [0.30, 0.41, 0.50, 0.60],  # a = 2, blank
    [0.50, 0.60, 0.71, 0.80],  # a = 3, known
    [0.40, 0.70, 0.50, 0.82],  # a = 3, blank
]


def claim(expect="higher", **form):
    return Claim(text="so it is", metric=METRIC, expect=expect, **form)


@pytest.mark.parametrize(
    ("form", "mean", "answer"),
    [
        ({"at": {"a": 2}, "than": {"a": 1}}, 0.19375, "supported"),
        ({"at": {"a": 1}, "than": {"a": 2}}, -0.19375, "contradicted"),
        ({"at": {"a": 3, "b": "blank"}, "than": {"a": 3, "b": "known"}}, -0.0475, "open"),
        ({"at": {"a": 1, "b": "known"}, "value": 0.05}, 0.25, "supported"),
        ({"at": {"a": 1, "b": "known"}, "value": 0.9}, 0.25, "contradicted"),
        ({"along": "a", "at": {"b": "known"}}, 0.20125, "supported"),
        ({"along": "a", "at": {"b": "known"}, "within": (1.0, 2.0)}, 0.2025, "supported"),
        (
            {
                "contrast": (
                    {"weight": 1.0, "at": {"a": 3, "b": "known"}},
                    {"weight": -2.0, "at": {"a": 2, "b": "known"}},
                    {"weight": 1.0, "at": {"a": 1, "b": "known"}},
                )
            },
            -0.0025,
            "open",
        ),
    ],
)
def test_claims(form, mean, answer):
    study = grid([claim(**form).model_dump()])
    (verdict,) = judge(made(study, VALUES))
    assert verdict.estimate.mean == pytest.approx(mean)
    assert verdict.answer == answer
    assert verdict.estimate.n == 4


def test_claims_without_enough_runs_are_open():
    study = grid([claim(at={"a": 2}, than={"a": 1}).model_dump()])
    (verdict,) = judge(made(study, [row[:2] for row in VALUES]))
    assert verdict.answer == "open"
    (verdict,) = judge(made(study, [[], *VALUES[1:]]))
    assert (verdict.answer, verdict.estimate.n) == ("open", 0)


def test_baselines_and_places():
    study = grid([])
    assert [baseline_of(study, point) for point in range(6)] == [2, 3, None, None, 2, 3]
    assert matching(study, {"b": "blank"}) == [1, 3, 5]
    assert matching(study, {}) == list(range(6))
    assert TEXT
