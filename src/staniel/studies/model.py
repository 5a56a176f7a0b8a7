"""What a study file holds: a base scenario, what is varied, what is measured, what is claimed."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from staniel.datatypes.config import Config
from staniel.studies.catalogue import check_metric

__all__ = ["Claim", "Factor", "Level", "Study", "Term", "Until"]

Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$", max_length=40)]
Value = bool | int | float | str
Place = dict[str, Value]
"""Where on the factors: the level of each by its label or value; one left out means all."""

MAX_POINTS = 2000


class Level(Config):
    """One setting of a factor."""

    label: str = Field(min_length=1, max_length=60, description="in tables and figures")
    x: float | None = Field(None, description="its place on a figure's axis; not set: by the label")
    set: dict[str, Any] = Field({}, max_length=100, description="scenario keys and their values")


class Factor(Config):
    """What a study varies: one scenario key over values, or whole settings by level."""

    name: Name = Field(description="its column in the results")
    label: str = Field("", max_length=120, description="on an axis, with its unit")
    key: str | None = Field(None, min_length=1, description="scenario key that takes the values")
    values: tuple[Value, ...] = Field((), max_length=500, description="of the key")
    scale: float | None = Field(None, description="the key takes each value times this")
    levels: tuple[Level, ...] = Field((), max_length=500, description="instead of key and values")
    baseline: Value | None = Field(
        None, description="the level that others are compared with; not set: the first"
    )

    @model_validator(mode="after")
    def _one_way_to_vary(self) -> Self:
        if bool(self.levels) == (self.key is not None):
            raise ValueError(f"factor {self.name}: expected either key and values, or levels")
        if self.key is not None and not self.values:
            raise ValueError(f"values of factor {self.name} are missing: {self.key} needs some")
        numbers = all(isinstance(value, float | int) for value in self.values)
        if self.scale is not None and not (self.values and numbers):
            raise ValueError(f"scale of factor {self.name}: expected with values that are numbers")
        labels = [level.label for level in self.steps]
        if len(set(labels)) < len(labels):
            raise ValueError(f"factor {self.name} has a level twice: expected each once")
        if self.baseline is not None and self.find(self.baseline) is None:
            raise ValueError(f"baseline of factor {self.name}: no level {self.baseline!r}")
        return self

    @property
    def steps(self) -> tuple[Level, ...]:
        """The levels, however they were written."""
        if self.levels:
            return self.levels
        # The key is there: the model has checked it.
        key, scale = self.key or "", self.scale
        return tuple(
            Level(
                label=label_of(value),
                x=float(value) if isinstance(value, float | int) else None,
                set={key: value if scale is None else float(value) * scale},
            )
            for value in self.values
        )

    @property
    def numeric(self) -> bool:
        """Every level has a place on an axis, and none of them is true or false."""
        truths = any(isinstance(value, bool) for value in self.values)
        return not truths and all(level.x is not None for level in self.steps)

    def find(self, level: Value) -> int | None:
        """Number of a level named by its label or its value; None where there is none."""
        wanted = label_of(level)
        labels = [step.label for step in self.steps]
        if wanted in labels:
            return labels.index(wanted)
        places = [step.x for step in self.steps]
        return places.index(level) if level in places else None


class Until(Config):
    """Seeds are added until every point's interval is narrow enough."""

    metric: str = Field(description="whose interval counts")
    half_width: float = Field(gt=0.0, description="of the 95 % interval of its mean")
    most: int = Field(400, ge=2, le=100_000, description="seeds, however wide it still is")

    @model_validator(mode="after")
    def _known(self) -> Self:
        check_metric("until.metric", self.metric)
        return self


class Term(Config):
    """One part of a contrast."""

    at: Place = Field({}, description="which points, by factor")
    weight: float = Field(description="of their mean in the sum")


class Claim(Config):
    """A statement about the results that its own interval must carry.

    Either a contrast, the sum of weighted means over places, paired by seed; or, with `than`, the
    difference of two places; or, without either, the mean at one place against `value`; or, with
    `along`, the slope over a factor.
    """

    text: str = Field(min_length=1, max_length=400, description="the claim in words")
    metric: str = Field(description="what it is about")
    at: Place = Field({}, description="which points, by factor")
    than: Place | None = Field(None, description="compared with these points")
    contrast: tuple[Term, ...] = Field((), max_length=20, description="instead of at and than")
    along: Name | None = Field(None, description="slope over this factor, of points in at")
    within: tuple[float, float] | None = Field(None, description="part of the factor in along")
    value: float = Field(0.0, description="what it is compared with")
    expect: Literal["lower", "higher"] = Field(description="than value")

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        check_metric("claims.metric", self.metric)
        forms = (self.than is not None, bool(self.contrast), self.along is not None)
        if sum(forms) > 1:
            raise ValueError("contrast, than and along: expected at most one of them")
        if self.within is not None and self.along is None:
            raise ValueError("within goes with along")
        return self


class Study(Config):
    """A Monte Carlo experiment, complete: with a version of staniel it determines its results."""

    name: str = Field(
        "study", pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$", max_length=64, description="of its folder"
    )
    title: str = Field("", max_length=200, description="of the report")
    question: str = Field("", max_length=2000, description="what it is to answer")
    base: str = Field("downtown", min_length=1, description="scenario, packaged or a TOML file")
    settings: dict[str, Any] = Field({}, description="changes to it, for all points")
    seeds: int = Field(50, ge=1, le=100_000, description="the same ones at every point")
    first_seed: int = Field(0, ge=0, lt=2**62, description="lowest of them")
    metrics: tuple[str, ...] = Field(
        ("visible_fraction_fine",), min_length=1, max_length=40, description="shown in the report"
    )
    until: Until | None = Field(None, description="more seeds, until intervals are narrow enough")
    factors: tuple[Factor, ...] = Field((), max_length=8, description="what is varied")
    grids: tuple[dict[str, tuple[Value, ...]], ...] = Field(
        (), max_length=50, description="levels by factor; not set: all with all"
    )
    claims: tuple[Claim, ...] = Field((), max_length=100, description="what is to be shown")

    @model_validator(mode="after")
    def _metrics_known(self) -> Self:
        for metric in self.metrics:
            check_metric("metrics", metric)
        return self

    @model_validator(mode="after")
    def _factors_named_once(self) -> Self:
        names = [factor.name for factor in self.factors]
        taken = sorted({name for name in names if names.count(name) > 1})
        if taken:
            raise ValueError(f"factors: {taken[0]} is there twice, expected each name once")
        reserved = {"point", "seed", "vehicle", "version", "study"} & set(names)
        if reserved:
            raise ValueError(f"factors: the name {min(reserved)} is a column of its own")
        return self

    @model_validator(mode="after")
    def _places_exist(self) -> Self:
        for number, grid in enumerate(self.grids):
            for name, levels in grid.items():
                for level in levels:
                    self._check_place(f"grids[{number}]", {name: level})
            missing = {factor.name for factor in self.factors} - set(grid)
            if missing:
                raise ValueError(f"grids[{number}]: lacks the factor {min(missing)}")
        for number, claim in enumerate(self.claims):
            places = [claim.at, claim.than or {}, *(term.at for term in claim.contrast)]
            for place in places:
                self._check_place(f"claims[{number}]", place)
            if (
                claim.along is not None
                and not self.factor(f"claims[{number}]", claim.along).numeric
            ):
                raise ValueError(f"claims[{number}]: along = {claim.along!r} has no numbers")
        return self

    @model_validator(mode="after")
    def _not_too_large(self) -> Self:
        if len(self.combinations()) > MAX_POINTS:
            raise ValueError(
                f"factors make {len(self.combinations()):,} points: expected at most {MAX_POINTS:,}"
            )
        return self

    def factor(self, where: str, name: str) -> Factor:
        """The factor of a name.

        Raises
        ------
        ValueError
            There is none; begins with `where`.
        """
        for factor in self.factors:
            if factor.name == name:
                return factor
        known = ", ".join(factor.name for factor in self.factors) or "none"
        raise ValueError(f"{where}: unknown factor {name!r}, expected one of: {known}")

    def combinations(self) -> list[tuple[int, ...]]:
        """Level of each factor at each point, in the order of the points; none twice."""
        from itertools import product

        every = [tuple(range(len(factor.steps))) for factor in self.factors]
        if not self.grids:
            return list(product(*every))
        found: dict[tuple[int, ...], None] = {}
        for grid in self.grids:
            chosen = [
                [factor.find(level) or 0 for level in grid[factor.name]] for factor in self.factors
            ]
            found.update(dict.fromkeys(product(*chosen)))
        return list(found)

    def _check_place(self, where: str, place: Mapping[str, Value]) -> None:
        for name, level in place.items():
            factor = self.factor(where, name)
            if factor.find(level) is None:
                levels = ", ".join(step.label for step in factor.steps)
                raise ValueError(
                    f"{where}: factor {name} has no level {level!r}, expected one of: {levels}"
                )


def label_of(value: Value) -> str:
    """How a value is written as a level's label.

    Examples
    --------
    >>> label_of(0.1), label_of(4.0), label_of(True), label_of("carrot")
    ('0.1', '4', 'true', 'carrot')
    """
    if isinstance(value, bool):
        return "true" if value else "false"
    return value if isinstance(value, str) else f"{value:g}"
