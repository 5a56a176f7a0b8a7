"""A city's outlines from a picture: dark is building."""

import warnings
from os import PathLike
from pathlib import Path

import numpy as np
import shapely
from numpy.typing import NDArray
from PIL import Image

from staniel.city.trace import MOST_CELLS, outlines_of_cells
from staniel.errors import CityError

__all__ = ["image_outlines", "otsu_threshold"]

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

_DEEP = ("I", "F")  # Pillow's modes of more than 8 bits, "I;16" and its like among them


def image_outlines(
    path: str | PathLike[str],
    cell: float,
    heights: tuple[float, float],
    seed: int,
    threshold: float | None,
) -> tuple[tuple[shapely.Polygon, ...], Floats, tuple[float, float]]:
    """Outlines, roof heights and size of the city in a picture; see `City.from_image`."""
    if threshold is not None and not (
        isinstance(threshold, int | float) and 0.0 <= threshold < 255.0
    ):
        raise CityError(f"threshold: expected a grey level in [0, 255), got {threshold!r}")
    grey = _grey_levels(Path(path))
    level = otsu_threshold(grey) if threshold is None else threshold
    return outlines_of_cells(grey <= level, cell, heights, seed, path)


def _grey_levels(path: Path) -> Floats | NDArray[np.uint8]:
    """(rows, columns) grey levels, 0 black to 255 white; what is transparent shows white."""
    if not path.is_file():
        raise CityError(f"{path}: expected a picture, found no such file")
    try:
        with warnings.catch_warnings():
            # The size is checked below, at a lower bound than Pillow's.
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            image = Image.open(path)
        with image:
            width, height = image.size
            if width * height > MOST_CELLS:
                raise CityError(
                    f"{path}: expected a picture of at most {MOST_CELLS} pixels, "
                    f"got {width} x {height}"
                )
            return _decoded(image)
    except CityError:
        raise
    except Image.DecompressionBombError:  # Pillow's own bound, met before ours
        raise CityError(
            f"{path}: expected a picture of at most {MOST_CELLS} pixels, got many more"
        ) from None
    except Exception as error:  # a damaged file can fail in any way inside a decoder
        raise CityError(f"{path}: expected a picture that can be read, got: {error}") from error


def _decoded(image: Image.Image) -> Floats | NDArray[np.uint8]:
    if image.mode.startswith(_DEEP):
        deep = np.asarray(image, dtype=np.float64)
        if not np.isfinite(deep).all():
            raise ValueError("grey levels that are not finite")
        return deep / 257.0 if deep.max(initial=0.0) > 255.0 else deep
    if image.mode == "1":
        return np.asarray(image.convert("L"))
    if image.mode in ("LA", "La", "PA", "RGBA", "RGBa") or "transparency" in image.info:
        layers = image.convert("RGBA")
        image = Image.alpha_composite(Image.new("RGBA", image.size, "white"), layers)
    return np.asarray(image.convert("RGB").convert("L"))


def otsu_threshold(grey: Floats | NDArray[np.uint8]) -> float:
    """Grey level that parts a picture into its two most distinct classes (Otsu 1979).

    The level with the greatest variance between the classes "at or below" and "above"; the middle
    of all such levels. A picture of one grey is dark below 128 and light from there on.

    Parameters
    ----------
    grey : float or uint8 array
        Levels 0 to 255.

    Examples
    --------
    >>> 20.0 <= otsu_threshold(np.array([[10, 20, 200, 220]], dtype=np.uint8)) < 200.0
    True
    """
    counts = np.bincount(np.clip(grey, 0, 255).astype(np.uint8).ravel(), minlength=256)
    below = np.cumsum(counts)[:-1].astype(np.float64)
    sums = np.cumsum(counts * np.arange(256))
    above = counts.sum() - below
    apart = (below > 0) & (above > 0)
    if not apart.any():
        return 127.0
    means = sums[:-1] / np.maximum(below, 1.0) - (sums[-1] - sums[:-1]) / np.maximum(above, 1.0)
    between = np.where(apart, below * above * means**2, -1.0)
    return float(np.flatnonzero(between >= between.max() * (1.0 - 1e-12)).mean())
