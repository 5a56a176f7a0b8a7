"""Means with bootstrap intervals, paired differences, and whether claims hold.

The unit is the run: the vehicles of a run are not independent of one another, so their mean is one
value. Runs of the same seed at different points share their city and their draws, so differences
are taken seed by seed.
"""

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

import numpy as np
from numpy.typing import NDArray

from staniel.studies.catalogue import CATALOGUE
from staniel.studies.journal import Journal
from staniel.studies.load import Point
from staniel.studies.model import Claim, Place, Study
from staniel.studies.results import Results

if TYPE_CHECKING:
    import pyarrow as pa

__all__ = [
    "Estimate",
    "Verdict",
    "baseline_of",
    "differences",
    "estimate",
    "judge",
    "matching",
    "narrow_enough",
    "run_values",
]

Floats = NDArray[np.float64]
BySeed = dict[int, float]

RESAMPLES: Final = 9999
_SEED: Final = 20_240_229  # of the resampling: the same results give the same intervals
_FEWEST: Final = 3  # values that an interval is made of


@dataclass(frozen=True, slots=True)
class Estimate:
    """A mean and its 95 % bootstrap interval.

    Attributes
    ----------
    mean, low, high : float
        NaN where there is no value, or too few for an interval.
    n : int
        Runs, or pairs of runs.
    """

    mean: float
    low: float
    high: float
    n: int

    @property
    def half_width(self) -> float:
        """Half of the interval."""
        return 0.5 * (self.high - self.low)


@dataclass(frozen=True, slots=True)
class Verdict:
    """What the results say of a claim.

    Attributes
    ----------
    claim : Claim
    estimate : Estimate
        Of what the claim is about.
    answer : {"supported", "contradicted", "open"}
        "open" where the interval holds the value, so that it carries neither.
    """

    claim: Claim
    estimate: Estimate
    answer: Literal["supported", "contradicted", "open"]


def estimate(values: Sequence[float] | Floats) -> Estimate:
    """Mean of independent values and its interval: bias-corrected and accelerated bootstrap.

    Parameters
    ----------
    values : (n,) array_like
        NaN is left out.

    Returns
    -------
    Estimate

    Examples
    --------
    >>> estimate([1.0, 1.0, 1.0, 1.0])
    Estimate(mean=1.0, low=1.0, high=1.0, n=4)
    """
    from scipy.stats import bootstrap

    sample = np.asarray(values, dtype=np.float64)
    sample = sample[~np.isnan(sample)]
    n = len(sample)
    mean = float(sample.mean()) if n else math.nan
    if n < _FEWEST:
        return Estimate(mean, math.nan, math.nan, n)
    if np.ptp(sample) == 0.0:
        return Estimate(mean, mean, mean, n)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of samples so even that the acceleration is undefined
        interval = bootstrap(
            (sample,),
            np.mean,
            n_resamples=RESAMPLES,
            batch=max(1, 2_000_000 // n),
            method="BCa",
            rng=np.random.default_rng(_SEED),
        ).confidence_interval
    low, high = float(interval.low), float(interval.high)
    if math.isnan(low) or math.isnan(high):
        low, high = math.nan, math.nan
    return Estimate(mean, low, high, n)


def run_values(results: Results, metric: str) -> list[BySeed]:
    """Value of each run: the mean over its vehicles, for those never detected what stands for them.

    Parameters
    ----------
    results : Results
    metric : str
        A column of `CATALOGUE`.

    Returns
    -------
    list of dict of int to float
        By point, then by seed; runs without a value are left out.
    """
    return _run_values(results.table, results.duration, metric)


def differences(values: BySeed, others: BySeed) -> Floats:
    """`values` minus `others`, of the seeds that both have, in the order of the seeds."""
    shared = sorted(values.keys() & others.keys())
    return np.array([values[seed] - others[seed] for seed in shared])


def baseline_of(study: Study, point: int) -> int | None:
    """The point that another is compared with: along the first factor, at its baseline.

    Returns
    -------
    int or None
        None for a baseline itself, and where its point was not flown.
    """
    combinations = study.combinations()
    if not study.factors:
        return None
    first = study.factors[0]
    step = 0 if first.baseline is None else first.find(first.baseline) or 0
    here = combinations[point]
    there = (step, *here[1:])
    return combinations.index(there) if there != here and there in combinations else None


def matching(study: Study, place: Place) -> list[int]:
    """Numbers of the points at a place: those of the named levels, whatever the others are."""
    wanted = {
        number: factor.find(place[factor.name])
        for number, factor in enumerate(study.factors)
        if factor.name in place
    }
    return [
        point
        for point, steps in enumerate(study.combinations())
        if all(steps[number] == step for number, step in wanted.items())
    ]


def judge(results: Results) -> list[Verdict]:
    """Hold each claim of a study against its results."""
    return [_judge(results, claim) for claim in results.study.claims]


def narrow_enough(study: Study, points: Sequence[Point], journal: Journal, count: int) -> bool:
    """Whether the interval of `study.until` is narrow enough at every point, of the first seeds.

    Parameters
    ----------
    study : Study
        With `until`.
    points : sequence of Point
    journal : Journal
    count : int
        Seeds that count.
    """
    until = study.until
    if until is None:
        return True
    values: dict[int, list[float]] = {point.number: [] for point in points}
    stand_in = [_stand_in(until.metric, point.scenario.minutes * 60.0) for point in points]
    for entry in journal.entries():
        if "rows" in entry and entry["seed"] < study.first_seed + count:
            found = [row[until.metric] for row in entry["rows"]]
            values[entry["point"]].append(
                _mean([stand_in[entry["point"]] if one is None else one for one in found])
            )
    widths = [estimate(of_point).half_width for of_point in values.values()]
    return all(width <= until.half_width for width in widths)


def _run_values(table: "pa.Table", durations: Sequence[float], metric: str) -> list[BySeed]:
    points = table["point"].to_numpy()
    seeds = table["seed"].to_numpy()
    raw = table[metric].to_numpy(zero_copy_only=False).astype(np.float64)  # null is NaN
    stand_in = np.array([_stand_in(metric, duration) for duration in durations])
    filled = np.where(np.isnan(raw), stand_in[points] if len(points) else raw, raw)
    values: list[BySeed] = [{} for _ in durations]
    # Rows of one run follow one another.
    new = np.ones(len(points), dtype=bool)
    new[1:] = (points[1:] != points[:-1]) | (seeds[1:] != seeds[:-1])
    starts = np.flatnonzero(new)
    for start, end in zip(starts, [*starts[1:], len(points)], strict=True):
        mean = _mean(filled[start:end])
        if not math.isnan(mean):
            values[points[start]][int(seeds[start])] = mean
    return values


def _mean(values: Sequence[float] | Floats) -> float:
    """Mean of the values that are there (the others are NaN)."""
    array = np.asarray(values, dtype=np.float64)
    array = array[~np.isnan(array)]
    return float(array.mean()) if len(array) else math.nan


def _stand_in(metric: str, duration: float) -> float:
    return CATALOGUE[metric].stand_in(duration)


def _judge(results: Results, claim: Claim) -> Verdict:
    values = run_values(results, claim.metric)
    found = estimate(_sample(results.study, claim, values) - claim.value)
    # NaN compares false: too few values leave a claim open.
    if found.high < 0.0:
        answer: Literal["lower", "higher", ""] = "lower"
    elif found.low > 0.0:
        answer = "higher"
    else:
        answer = ""
    shown = Estimate(
        found.mean + claim.value, found.low + claim.value, found.high + claim.value, found.n
    )
    if not answer:
        return Verdict(claim, shown, "open")
    return Verdict(claim, shown, "supported" if answer == claim.expect else "contradicted")


def _sample(study: Study, claim: Claim, values: Sequence[BySeed]) -> Floats:
    """One value a seed of what the claim is about."""
    if claim.along is not None:
        return _slopes(study, claim, values)
    terms: list[tuple[Place, float]] = [(claim.at, 1.0)]
    if claim.contrast:
        terms = [(term.at, term.weight) for term in claim.contrast]
    elif claim.than is not None:
        terms.append((claim.than, -1.0))
    places = [(_at(study, place, values), weight) for place, weight in terms]
    shared = set.intersection(*(set(place) for place, _ in places))
    return np.array([sum(w * place[seed] for place, w in places) for seed in sorted(shared)])


def _at(study: Study, place: Place, values: Sequence[BySeed]) -> BySeed:
    """Mean over the points of a place, of the seeds that all of them have."""
    points = [values[point] for point in matching(study, place)]
    shared = set.intersection(*map(set, points)) if points else set()
    return {seed: _mean([point[seed] for point in points]) for seed in shared}


def _slopes(study: Study, claim: Claim, values: Sequence[BySeed]) -> Floats:
    """Least-squares slope over a factor, of each seed that all its levels have."""
    factor = study.factor("claims", claim.along or "")
    low, high = claim.within or (-math.inf, math.inf)
    columns: list[tuple[float, BySeed]] = []
    for level in factor.steps:
        place = level.x
        if place is not None and low <= place <= high:
            at = {**claim.at, factor.name: level.label}
            if matching(study, at):
                columns.append((place, _at(study, at, values)))
    if len(columns) < 2:
        return np.zeros(0)
    shared = sorted(set.intersection(*(set(column) for _, column in columns)))
    x = np.array([place for place, _ in columns])
    y = np.array([[column[seed] for _, column in columns] for seed in shared])
    centred = x - x.mean()
    slopes: Floats = y.reshape(-1, len(x)) @ centred / (centred @ centred)
    return slopes
