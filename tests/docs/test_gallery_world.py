"""The gallery's script draws its page, and its visible fraction agrees with the slow answer."""

import importlib.util
import math
import re
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from PIL import Image

from staniel.city import City

GALLERY = Path(__file__).resolve().parents[2] / "docs" / "gallery"


@pytest.fixture(scope="module")
def gallery():
    mpl.use("Agg")
    spec = importlib.util.spec_from_file_location("make_world", GALLERY / "make_world.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_picture_of_the_page_is_drawn(gallery, tmp_path):
    gallery.draw_all(tmp_path, pairs=300, checked=40)
    page = (GALLERY / "world.md").read_text(encoding="utf-8")
    shown = set(re.findall(r"\]\((\w+\.png)\)", page))
    assert shown == {path.name for path in tmp_path.iterdir()}
    for name in shown:
        assert (GALLERY / name).stat().st_size < 150_000
        with Image.open(GALLERY / name) as kept, Image.open(tmp_path / name) as drawn:
            assert np.ptp(np.asarray(kept.convert("L"))) > 100
            assert drawn.size == kept.size


@pytest.mark.parametrize(("density", "ratio"), [(0.2, 0.6), (0.2, 3.0), (0.5, 1.5), (0.5, 6.0)])
def test_visible_fraction_agrees_with_the_slow_answer(gallery, density, ratio):
    """Pair by pair, and within the errors of two independent draws."""
    city = City.generate(size=(400.0, 400.0), density=density, seed=5)
    height = ratio * city.statistics().mean_roof
    rng = np.random.default_rng(0)
    observers, targets = gallery.uniform_pairs(city, height, 600, rng)
    assert not city.inside(targets[:, :2]).any()
    slow = gallery.slowly_visible(city, observers, targets)
    assert np.array_equal(slow, city.visible_pairs(observers, targets))
    share, error = gallery.fraction(
        city.visible_pairs(*gallery.uniform_pairs(city, height, 6000, rng))
    )
    slow_share, slow_error = gallery.fraction(slow)
    assert abs(share - slow_share) < 3.5 * math.hypot(error, slow_error)
    assert 0.0 < share < 1.0
