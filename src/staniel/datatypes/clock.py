"""The two steps of time: dynamics inside, decisions outside."""

import math
from typing import Self

from pydantic import Field, model_validator

from staniel.datatypes.config import Config

__all__ = ["Clock"]


class Clock(Config):
    """Steps of time; a decision step is a whole number of dynamics steps."""

    decision_step: float = Field(1.0, gt=0.0, le=10.0, description="agents decide and track [s]")
    dynamics_step: float = Field(0.1, gt=0.0, le=0.2, description="vehicles and aircraft move [s]")

    @property
    def substeps(self) -> int:
        """Dynamics steps in one decision step."""
        return round(self.decision_step / self.dynamics_step)

    @model_validator(mode="after")
    def _whole_number(self) -> Self:
        ratio = self.decision_step / self.dynamics_step
        if not math.isclose(ratio, round(ratio), rel_tol=1e-9):
            raise ValueError(
                f"decision_step = {self.decision_step:g} must be a whole multiple of "
                f"dynamics_step = {self.dynamics_step:g}"
            )
        return self
