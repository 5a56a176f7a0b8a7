"""The script of the tracking page draws its pictures, and its scenes are what they are called."""

import importlib.util
import re
import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from PIL import Image
from scipy.stats import norm

from staniel.tracking import TrackingConfig

GALLERY = Path(__file__).resolve().parents[2] / "docs" / "gallery"


@pytest.fixture(scope="module")
def gallery():
    mpl.use("Agg")
    spec = importlib.util.spec_from_file_location("make_tracking", GALLERY / "make_tracking.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # its dataclasses look for themselves there
    spec.loader.exec_module(module)
    return module


def test_every_picture_of_the_page_is_drawn(gallery, tmp_path):
    gallery.draw_all(tmp_path, seeds=3)
    page = (GALLERY / "tracking.md").read_text(encoding="utf-8")
    shown = set(re.findall(r"\]\((\w+\.png)\)", page))
    assert shown == {path.name for path in tmp_path.iterdir()}
    for name in shown:
        assert (GALLERY / name).stat().st_size < 150_000
        with Image.open(GALLERY / name) as kept, Image.open(tmp_path / name) as drawn:
            assert np.ptp(np.asarray(kept.convert("L"))) > 100
            assert drawn.size == kept.size


def test_the_scenes_are_what_they_are_called(gallery):
    apart, crossing, clutter = gallery.scenes()
    for scene, least, most in ((apart, 50.0, 200.0), (crossing, 0.0, 2.0), (clutter, 50.0, 200.0)):
        between = np.hypot(*(scene.path[:, 0] - scene.path[:, 1]).T)
        assert least <= between.min() <= most
        # Names can be told apart at both ends: the gate of the scores is 10 m.
        assert min(between[0], between[-1]) > 3 * gallery.GATE
    off = np.hypot(*(apart.path - apart.view[:, None]).transpose(2, 0, 1))
    assert (off < apart.reach).all(axis=1)[:3].all()
    assert 0.1 < (off > apart.reach).mean() < 0.5
    found = np.array([len(clutter.look(0, np.random.default_rng(s)).false) for s in range(2000)])
    assert found.mean() == pytest.approx(clutter.clutter, abs=0.06)


def test_the_interval_of_a_share_is_wilsons(gallery):
    share, low, high = gallery.share([True] * 190 + [False] * 10)
    z, n = norm.ppf(0.975), 200
    middle = (share + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * np.sqrt(share * (1 - share) / n + (z / (2 * n)) ** 2)
    assert (low, high) == pytest.approx((middle - half, middle + half))


def test_a_vehicle_in_town_keeps_to_the_streets(gallery):
    city = gallery.town()
    for seed in range(20):
        way = gallery.driven_in_town(seed)
        assert not city.inside(way).any()
        np.testing.assert_allclose(np.abs(np.diff(way, axis=0)).sum(axis=1), 5.0)


def test_the_table_of_keys_says_what_the_defaults_are():
    page = (GALLERY.parent / "tracking.md").read_text(encoding="utf-8")
    table = page.split("## Keys of")[1]
    rows = re.findall(r"^\| `(\w+)` \| (\S+) \| (.*) \|$", table, re.MULTILINE)
    said = {key: (value.strip('`"'), words) for key, value, words in rows}
    assert list(said) == list(TrackingConfig.model_fields)
    for key, field in TrackingConfig.model_fields.items():
        value, words = said[key]
        assert words == field.description
        if isinstance(field.default, int | float) and not isinstance(field.default, bool):
            assert float(value) == field.default
        else:
            assert value == str(field.default).lower()
