"""The city that a scenario asks for."""

from pathlib import Path

from staniel.city import City
from staniel.errors import CityError, ScenarioError
from staniel.scenario.model import CitySource

__all__ = ["build_city"]


def build_city(source: CitySource, seed: int) -> City:
    """Generate or read the map.

    Parameters
    ----------
    source : CitySource
    seed : int
        The scenario's, taken where the city names none of its own.

    Returns
    -------
    City

    Raises
    ------
    ScenarioError
        The map's file does not exist.
    CityError
        The map cannot be used, or holds no free ground.
    """
    chosen = seed if source.seed is None else source.seed
    if source.source == "generate":
        try:
            return City.generate(
                size=source.size,
                density=source.density,
                block=source.block,
                heights=source.heights,
                seed=chosen,
            )
        except CityError as error:
            raise CityError(f"city.{error}") from error  # its message starts with the key
    # The model has checked that both are there.
    file, cell = Path(source.file or ""), source.cell or 0.0
    if not file.is_file():
        kind = "an image" if source.source == "image" else "a Moving AI .map grid"
        raise ScenarioError(f"city.file = {str(file)!r}: no such file, expected {kind}")
    read = City.from_image if source.source == "image" else City.from_grid
    return read(file, cell=cell, heights=source.heights, seed=chosen)
