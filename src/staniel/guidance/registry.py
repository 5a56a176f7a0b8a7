"""Rivals of one signature, by name: anybody may add one of his own."""

from collections.abc import Callable
from typing import Generic, TypeVar

__all__ = ["Registry"]

Rival = TypeVar("Rival", bound=Callable[..., object])


class Registry(Generic[Rival]):
    """Functions by name.

    Parameters
    ----------
    noun : str
        What they are, for messages.
    key : str
        Where a name is written, for messages.
    error : type of exception
        Raised where a name is unknown.

    Examples
    --------
    >>> laws = Registry("law", "laws.name", ValueError)
    >>> @laws.register("double")
    ... def double(x):
    ...     return 2 * x
    >>> laws.names(), laws.named("double")(2)
    (['double'], 4)
    >>> laws.named("half")
    Traceback (most recent call last):
        ...
    ValueError: laws.name = 'half': expected one of double
    """

    def __init__(self, noun: str, key: str, error: type[Exception]) -> None:
        self._noun, self._key, self._error = noun, key, error
        self._rivals: dict[str, Rival] = {}

    def register(self, name: str) -> Callable[[Rival], Rival]:
        """Register the decorated function as `name`.

        Raises
        ------
        ValueError
            The name is taken by another function.
        """

        def keep(rival: Rival) -> Rival:
            if self._rivals.get(name, rival) is not rival:
                raise ValueError(f"{self._noun} {name!r} is registered already")
            self._rivals[name] = rival
            return rival

        return keep

    def names(self) -> list[str]:
        """All names, sorted."""
        return sorted(self._rivals)

    def named(self, name: str) -> Rival:
        """The function registered as `name`; raises the registry's error where nobody did."""
        try:
            return self._rivals[name]
        except KeyError:
            choice = ", ".join(self.names())
            raise self._error(f"{self._key} = {name!r}: expected one of {choice}") from None
