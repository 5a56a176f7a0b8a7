"""The city that a scenario asks for."""

from pathlib import Path

from staniel.city import City
from staniel.errors import CityError, ScenarioError
from staniel.scenario.model import CitySource

__all__ = ["build_city"]

_KINDS = {"image": "an image", "grid": "a Moving AI .map grid", "geojson": "a GeoJSON file"}


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
        The map's file, or that of its roads, does not exist.
    CityError
        The map cannot be used, or holds no free ground.
    """
    if source.source == "open":
        return City.open(source.size)
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
    # The model has checked that what this source needs is there.
    file, cell = _file("file", source.file or "", _KINDS[source.source]), source.cell or 0.0
    if source.source == "geojson":
        roads = None if source.roads is None else _file("roads", source.roads, _KINDS["geojson"])
        return City.from_geojson(
            file, heights=source.heights, seed=chosen, frame=source.frame, roads=roads
        )
    read = City.from_image if source.source == "image" else City.from_grid
    return read(file, cell=cell, heights=source.heights, seed=chosen)


def _file(key: str, name: str, kind: str) -> Path:
    file = Path(name)
    if not file.is_file():
        raise ScenarioError(f"city.{key} = {name!r}: no such file, expected {kind}")
    return file
