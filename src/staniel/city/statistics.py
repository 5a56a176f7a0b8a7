"""A city in figures: how dense, how tall, how high an aircraft flies over it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from staniel.errors import CityError

__all__ = ["CityStatistics", "city_statistics"]


@dataclass(frozen=True)
class CityStatistics:
    """Figures of a city; without buildings all heights are 0."""

    buildings: int
    density: float
    """Built share of the rectangle."""
    lowest: float
    """Roof height [m], as are those that follow; every building counts once."""
    mean: float
    median: float
    tallest: float
    deciles: tuple[float, ...]
    """Nine roof heights: a tenth, two tenths, ... of the buildings are not taller [m]."""
    mean_roof: float
    """Roof height where every built square metre counts once [m]."""
    height_ratio: float | None
    """Flight height over mean roof; None without a flight height or buildings."""


def city_statistics(
    outlines: Sequence[shapely.Polygon],
    heights: NDArray[np.float64],
    size: tuple[float, float],
    altitude: float | None,
) -> CityStatistics:
    """Figures of outlines and (n,) roofs [m] in a rectangle; see `City.statistics`."""
    if altitude is not None and not (
        isinstance(altitude, int | float | np.number) and 0.0 < altitude < np.inf
    ):
        raise CityError(f"altitude: expected metres greater than 0, got {altitude!r}")
    ground = size[0] * size[1]
    if not len(outlines):
        return CityStatistics(0, 0.0, 0.0, 0.0, 0.0, 0.0, (0.0,) * 9, 0.0, None)
    areas = shapely.area(np.asarray(outlines, dtype=object))
    mean_roof = float(areas @ heights / areas.sum())
    return CityStatistics(
        buildings=len(outlines),
        density=float(areas.sum()) / ground,
        lowest=float(heights.min()),
        mean=float(heights.mean()),
        median=float(np.median(heights)),
        tallest=float(heights.max()),
        deciles=tuple(np.quantile(heights, np.arange(1, 10) / 10.0).tolist()),
        mean_roof=mean_roof,
        height_ratio=None if altitude is None else float(altitude) / mean_roof,
    )
