"""The run as a short animated picture: who was where, what cameras covered, what was believed."""

import io
import math
import os
from collections.abc import Callable, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from staniel.pictures import style
from staniel.pictures.canvas import Canvas
from staniel.pictures.files import write_picture
from staniel.record import Record

__all__ = ["draw_movie"]

_FRAMES: Final = 180
"""Most frames where the step between them is not given."""

_MILLISECONDS: Final = 80
"""How long a frame is shown; the last one is held longer."""

_HOLD: Final = 1500
_COLORS: Final = 192
_SAMPLES: Final = 4
"""Frames that the movie's colours are chosen from."""


def draw_movie(
    record: Record,
    path: str | os.PathLike[str],
    *,
    seconds_per_frame: float | None = None,
    on_progress: Callable[[int, int], object] | None = None,
) -> None:
    """Draw a run as an animated GIF that repeats for ever.

    Parameters
    ----------
    record : Record
    path : path
        Of the picture; one that exists is replaced.
    seconds_per_frame : float, optional [s]
        Simulated time from one frame to the next, rounded to whole decision steps, one at least.
        Not given: the least that makes no more than 180 frames.
    on_progress : callable, optional
        Called after each frame with the number of frames drawn and of all frames.

    Raises
    ------
    OutputError
        The picture cannot be written.
    ValueError
        `seconds_per_frame` is not a number greater than 0.
    """
    ticks = _ticks(record.times, seconds_per_frame)
    canvas = Canvas(record)
    palette = _palette(canvas, ticks)
    frames: list[Image.Image] = []
    for tick in ticks:
        picture = canvas.draw(tick)
        frames.append(picture.quantize(palette=palette, dither=Image.Dither.NONE))
        if on_progress is not None:
            on_progress(len(frames), len(ticks))
    buffer = io.BytesIO()
    shown = [_MILLISECONDS] * (len(frames) - 1) + [_HOLD]
    frames[0].save(
        buffer,
        "GIF",
        save_all=True,
        append_images=frames[1:],
        duration=shown,
        loop=0,
        optimize=True,
    )
    write_picture(path, buffer.getvalue())


def _ticks(times: NDArray[np.float64], seconds_per_frame: float | None) -> range:
    """Rows of `times` that become frames; the last one is the run's last."""
    count = len(times)
    if seconds_per_frame is None:
        step = -(-count // _FRAMES)
    elif not 0.0 < seconds_per_frame < math.inf:
        raise ValueError(
            f"seconds_per_frame = {seconds_per_frame}: expected a number greater than 0"
        )
    else:
        period = float(times[-1] - times[0]) / (count - 1) if count > 1 else seconds_per_frame
        step = max(1, round(seconds_per_frame / period))
    return range((count - 1) % step, count, step)


def _palette(canvas: Canvas, ticks: Sequence[int]) -> Image.Image:
    """One palette for all frames, so that nothing flickers: the legend's colours, and the rest
    from a few frames.
    """
    picked = [ticks[k * (len(ticks) - 1) // (_SAMPLES - 1)] for k in range(_SAMPLES)]
    samples = [canvas.draw(tick) for tick in picked]
    width, height = samples[0].size
    sheet = Image.new("RGB", (width, height * len(samples)))
    for row, sample in enumerate(samples):
        sheet.paste(sample, (0, row * height))
    kept = (
        style.PAPER,
        *style.TEAM,
        style.VEHICLE,
        style.TRACK,
        style.INK,
        style.EDGE,
        style.GROUND,
    )
    rest = sheet.quantize(
        _COLORS - len(kept), method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE
    )
    palette = Image.new("P", (1, 1))
    palette.putpalette([part for color in kept for part in color] + (rest.getpalette() or []))
    return palette
