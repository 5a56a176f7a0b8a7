"""The errors that staniel raises on purpose.

Every one of them is a `StanielError`; the command line prints its message and ends with exit code
2. A message names the field, the value, what was expected and, where there is one, the file.
"""

__all__ = [
    "CityError",
    "OutputError",
    "PlanningError",
    "RecordError",
    "ScenarioError",
    "StanielError",
    "StudyError",
    "WireError",
]


class StanielError(ValueError):
    """Something that the user handed in cannot be used as it is."""


class ScenarioError(StanielError):
    """A scenario, or a change to one, is missing, malformed or cannot be flown."""


class CityError(StanielError):
    """A map, an outline or a height cannot be used."""


class RecordError(StanielError):
    """A recorded run is missing, damaged or of an unknown version."""


class OutputError(StanielError):
    """Results cannot be written where they were asked for."""


class PlanningError(StanielError):
    """A path cannot be planned for what was asked: a goal in a building, a radius of 0."""


class StudyError(StanielError):
    """A study cannot be run as asked, or what it left cannot be read."""


class WireError(StanielError):
    """A packet is no message, or a message cannot become a packet.

    Parameters
    ----------
    message : str
    reason : {"malformed", "oversized", "forged"}, optional

    Attributes
    ----------
    reason : str
        By which it is counted.
    """

    def __init__(self, message: str, reason: str = "malformed") -> None:
        super().__init__(message)
        self.reason = reason
