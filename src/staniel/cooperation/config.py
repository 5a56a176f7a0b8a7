"""How the team shares its targets out and where it searches."""

from typing import Literal

from pydantic import Field

from staniel.datatypes.config import Config

__all__ = ["CooperationConfig"]


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
    helpers: int = Field(
        0, ge=0, le=10, description="free aircraft that join each one which holds a target"
    )
