"""The picture of the pursuit page is drawn from what its benchmark writes."""

import importlib.util
import json
from pathlib import Path

import numpy as np
from PIL import Image

GALLERY = Path(__file__).resolve().parents[2] / "docs" / "gallery"


def load(path):
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_case_is_drawn_and_the_page_shows_the_picture(tmp_path):
    gallery = load(GALLERY / "make_pursuit.py")
    rng, lines = np.random.default_rng(0), []
    for aircraft, loss in ((1, 0.0), (2, 0.5)):
        flights = {
            name: [[h, h, 40.0 * h, 0, 590.0] for h in rng.uniform(0.2, 0.6, 6)]
            for name in ("carrot", "orbit", "lookahead")
        }
        flights["carrot"].append([1.0, 1.0, 10.0, 0, 10.0])  # found too late: left out
        case = {"aircraft": aircraft, "height": 2.0, "speed": 2.0, "loss": loss}
        lines.append(json.dumps({"case": case, "flights": flights}))
    source = tmp_path / "pursuit.jsonl"
    source.write_text("\n".join(lines), encoding="utf-8")
    with Image.open(gallery.main(source, tmp_path)) as drawn:
        assert drawn.width > 900
    assert f"gallery/{gallery.PICTURE}" in (GALLERY.parent / "pursuit.md").read_text("utf-8")
    with Image.open(GALLERY / gallery.PICTURE) as kept:
        assert kept.width == drawn.width
