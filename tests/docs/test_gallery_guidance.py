"""The script of the following page draws its picture, and what it draws has converged."""

import importlib.util
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from PIL import Image

GALLERY = Path(__file__).resolve().parents[2] / "docs" / "gallery"
PICTURE = "guidance_following.png"


@pytest.fixture(scope="module")
def gallery():
    mpl.use("Agg")
    spec = importlib.util.spec_from_file_location("make_guidance", GALLERY / "make_guidance.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_picture_of_the_page_is_drawn(gallery, tmp_path):
    gallery.draw_all(tmp_path)
    assert f"gallery/{PICTURE}" in (GALLERY.parent / "following.md").read_text(encoding="utf-8")
    assert (GALLERY / PICTURE).stat().st_size < 150_000
    with Image.open(GALLERY / PICTURE) as kept, Image.open(tmp_path / PICTURE) as drawn:
        assert np.ptp(np.asarray(kept.convert("L"))) > 100
        assert drawn.size == kept.size


@pytest.mark.parametrize("law", ["carrot", "vector-field"])
def test_what_is_drawn_has_converged(gallery, law):
    for way in gallery.line_ways()[law]:
        assert abs(way[-1, 1]) < 0.5
    for way in gallery.orbit_ways()[law]:
        assert np.hypot(way[-1, 0], way[-1, 1]) == pytest.approx(gallery.ORBIT, abs=1.0)
