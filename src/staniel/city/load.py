"""A city from a file, by its suffix."""

from os import PathLike
from pathlib import Path

from staniel.city.city import City
from staniel.errors import CityError

__all__ = ["load_city"]

_PICTURES = frozenset(
    {".png", ".jpg", ".jpeg", ".bmp", ".gif", ".tif", ".tiff", ".webp", ".pbm", ".pgm", ".ppm"}
)


def load_city(
    path: str | PathLike[str], *, cell: float, heights: tuple[float, float], seed: int = 0
) -> City:
    """Read a city from a picture or a Moving AI grid.

    Parameters
    ----------
    path : path
        A ``.map`` grid (see `City.from_grid`) or a picture (see `City.from_image`).
    cell : float [m]
        Side of a cell or pixel on the ground.
    heights : (float, float) [m]
        Roof heights are drawn uniformly between these.
    seed : int
        Of the heights.

    Raises
    ------
    CityError
        A missing file, an unknown suffix, and all that the readers refuse.
    """
    file = Path(path)
    suffix = file.suffix.lower()
    if suffix == ".map":
        return City.from_grid(file, cell=cell, heights=heights, seed=seed)
    if suffix in _PICTURES:
        return City.from_image(file, cell=cell, heights=heights, seed=seed)
    raise CityError(
        f"{file}: expected a Moving AI .map grid or a picture ({', '.join(sorted(_PICTURES))}), "
        f"got the suffix {suffix!r}"
    )
