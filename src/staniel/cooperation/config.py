"""How the team shares its targets out and where it searches."""

import math
from collections.abc import Iterable
from typing import Annotated, Literal

from pydantic import Field

from staniel.datatypes.config import Config

__all__ = ["Area", "CooperationConfig", "priority_at"]

Coordinate = Annotated[float, Field(ge=-1e5, le=1e5)]


class Area(Config):
    """A disc that the operator cares about more, or less, than about the rest of the city."""

    center: tuple[Coordinate, Coordinate] = Field(description="east, north [m]")
    radius: float = Field(gt=0.0, le=1e5, description="of the disc [m]")
    priority: float = Field(
        2.0, gt=0.0, le=100.0, description="how much more than elsewhere it matters, a factor"
    )


def priority_at(areas: Iterable[Area], position: tuple[float, float]) -> float:
    """How much a place matters: the highest priority of the areas that it lies in, 1 outside.

    Parameters
    ----------
    areas : iterable of Area
    position : (float, float) [m]

    Examples
    --------
    >>> priority_at([Area(center=(100.0, 100.0), radius=50.0, priority=3.0)], (100.0, 150.0))
    3.0
    """
    return max(
        (area.priority for area in areas if math.dist(area.center, position) <= area.radius),
        default=1.0,
    )


class CooperationConfig(Config):
    """The auction's patience, the hand-over margin, the search map."""

    mode: Literal["decentralised"] = Field("decentralised", description="who auctions")
    bid_wait: int = Field(
        2, ge=1, le=10, description="ticks that an auctioneer waits for bids, without the latency"
    )
    lease: float = Field(8.0, gt=0.0, description="an award without a heartbeat ends after [s]")
    handover_margin: float = Field(
        80.0, ge=0.0, description="Dubins length that a hand-over must save [m]"
    )
    same_target: float = Field(
        12.0, gt=0.0, description="two reports this close are one target [m]"
    )
    search_cell: float = Field(20.0, gt=0.0, description="cell of the search map [m]")
    share_every: float = Field(
        5.0, ge=0.0, le=3600.0, description="between two words on what was looked at; 0: none [s]"
    )
    areas: tuple[Area, ...] = Field(
        (), max_length=100, description="that matter more, or less, than the rest"
    )
    helpers: int = Field(
        0, ge=0, le=10, description="free aircraft that join each one which holds a target"
    )
