"""A city from a file, by its suffix."""

from os import PathLike
from pathlib import Path

from staniel.city.checks import check_cell
from staniel.city.city import City
from staniel.errors import CityError

__all__ = ["load_city"]

_PICTURES = frozenset(
    {".png", ".jpg", ".jpeg", ".bmp", ".gif", ".tif", ".tiff", ".webp", ".pbm", ".pgm", ".ppm"}
)

_FOOTPRINTS = frozenset({".geojson", ".json"})


def load_city(
    path: str | PathLike[str],
    *,
    cell: float | None = None,
    heights: tuple[float, float],
    seed: int = 0,
) -> City:
    """Read a city from a picture, a Moving AI grid or building footprints.

    Parameters
    ----------
    path : path
        A ``.map`` grid (see `City.from_grid`), a ``.geojson`` or ``.json`` file (see
        `City.from_geojson`) or a picture (see `City.from_image`).
    cell : float [m]
        Side of a cell or pixel on the ground. GeoJSON has its own scale and takes none.
    heights : (float, float) [m]
        Roof heights are drawn uniformly between these, of GeoJSON those that the file lacks.
    seed : int
        Of the heights.

    Raises
    ------
    CityError
        A missing file, an unknown suffix, and all that the readers refuse.
    """
    file = Path(path)
    suffix = file.suffix.lower()
    if suffix in _FOOTPRINTS:
        if cell is not None:
            raise CityError(f"{file}: expected no cell, GeoJSON has its own scale, got {cell!r}")
        return City.from_geojson(file, heights=heights, seed=seed)
    if suffix == ".map" or suffix in _PICTURES:
        read = City.from_grid if suffix == ".map" else City.from_image
        return read(file, cell=check_cell(cell), heights=heights, seed=seed)
    raise CityError(
        f"{file}: expected a Moving AI .map grid or a picture ({', '.join(sorted(_PICTURES))}), "
        f"or GeoJSON ({', '.join(sorted(_FOOTPRINTS))}), "
        f"got the suffix {suffix!r}"
    )
