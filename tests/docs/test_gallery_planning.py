"""The picture of the planning page is drawn, and its flight without a map arrives."""

import importlib.util
from pathlib import Path

import numpy as np
from PIL import Image

GALLERY = Path(__file__).resolve().parents[2] / "docs" / "gallery"


def test_the_picture_is_drawn_and_the_flight_arrives(tmp_path):
    spec = importlib.util.spec_from_file_location("make_planning", GALLERY / "make_planning.py")
    gallery = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(gallery)
    flown, _, ended = gallery.flight(gallery.town())
    assert ended.startswith("arrived")
    assert np.hypot(*(flown[-1] - gallery.GOAL[:2])) < 20.0
    with (
        Image.open(gallery.main(tmp_path)) as drawn,
        Image.open(GALLERY / "guidance_planning.png") as kept,
    ):
        assert drawn.size == kept.size
