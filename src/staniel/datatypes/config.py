"""The base of every configuration section: frozen, checked, unknown keys refused."""

from pydantic import BaseModel, ConfigDict

__all__ = ["Config"]


class Config(BaseModel):
    """One section of a scenario. Each room declares its own; the scenario composes them."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", allow_inf_nan=False, validate_default=True
    )
