"""How the team shares its targets out and where it searches."""

import math
from collections.abc import Iterable
from typing import Annotated, Literal

from pydantic import Field

from staniel.datatypes.config import Config

__all__ = ["Area", "CooperationConfig", "CostConfig", "priority_at"]

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


Weight = Annotated[float, Field(ge=0.0, le=1e6)]


class CostConfig(Config):
    """What a target costs beside the Dubins distance to it, each as so many metres more."""

    energy: Weight = Field(0.0, description="of an aircraft with no energy left [m]")
    exposure: Weight = Field(0.0, description="for each loss expected on the way [m]")
    visibility: Weight = Field(0.0, description="of a target hidden from all around [m]")
    sensor: Weight = Field(0.0, description="of a camera that detects nothing [m]")
    speed: Weight = Field(0.0, description="of a target as fast as the aircraft can fly [m]")
    priority: Weight = Field(0.0, description="less, for each unit of priority above 1 [m]")


class CooperationConfig(Config):
    """The auction's patience, the hand-over margin, help, revisits, the search map."""

    mode: Literal["decentralised", "centralised", "none"] = Field(
        "decentralised",
        description="who shares targets out: auctions, a ground station, or nobody: "
        "each follows the nearest that it sees",
    )
    award: Literal["lowest", "joint"] = Field(
        "joint",
        description="an auctioneer awards to the lowest bid, or by the best assignment of all "
        "open auctions that it hears of",
    )
    bid_wait: int = Field(
        2, ge=1, le=10, description="ticks that an auctioneer waits for bids, without the latency"
    )
    award_tries: int = Field(
        3, ge=1, le=20, description="how often an award is said while nobody acknowledges it"
    )
    lease: float = Field(8.0, gt=0.0, description="an award without a heartbeat ends after [s]")
    handover_margin: float = Field(80.0, ge=0.0, description="cost that a hand-over must save [m]")
    same_target: float = Field(
        12.0, gt=0.0, description="two reports this close are one target [m]"
    )
    weak_below: float = Field(
        0.1, ge=0.0, le=1.0, description="share of the energy below which an aircraft is relieved"
    )
    assistance: Literal["none", "asked", "always"] = Field(
        "none", description="when a free aircraft joins the holder of a target"
    )
    helpers: int = Field(
        1, ge=0, le=10, description="free aircraft that join each one which holds a target, at most"
    )
    ask_below: float = Field(
        0.5, ge=0.0, le=1.0, description="predicted visibility below which a holder asks for help"
    )
    revisit_after: float = Field(
        0.0,
        ge=0.0,
        description="holders leave their targets and patrol while many streets were not looked at "
        "for this long, where no station shares targets out; 0: never [s]",
    )
    revisit_dwell: float = Field(
        15.0, ge=0.0, description="a target is held at least so long before a patrol [s]"
    )
    unheld_memory: float = Field(
        120.0, ge=0.0, description="a target that nobody holds is remembered for [s]"
    )
    station: tuple[Coordinate, Coordinate] | None = Field(
        None, description="of the centralised mode; not set: the city's south-west corner [m]"
    )
    search_cell: float = Field(20.0, gt=0.0, description="cell of the search map [m]")
    share_every: float = Field(
        5.0, ge=0.0, le=3600.0, description="between two words on what was looked at; 0: none [s]"
    )
    areas: tuple[Area, ...] = Field(
        (), max_length=100, description="that matter more, or less, than the rest"
    )
    cost: CostConfig = CostConfig()
