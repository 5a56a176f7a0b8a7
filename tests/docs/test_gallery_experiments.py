"""The page of the experiments shows its pictures, and has words for every packaged experiment."""

import importlib.util
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from staniel.studies import load_study

GALLERY = Path(__file__).resolve().parents[2] / "docs" / "gallery"


@pytest.fixture(scope="module")
def script():
    spec = importlib.util.spec_from_file_location("experiments", GALLERY / "make_experiments.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_picture_is_there():
    pages = ("experiments.md", "beyond.md")
    page = "".join((GALLERY / name).read_text(encoding="utf-8") for name in pages)
    shown = re.findall(r"\]\(([\w.-]+\.png)\)", page)
    assert set(shown) == {path.name for path in GALLERY.glob("experiment_*.png")}
    for name in shown:
        assert (GALLERY / name).stat().st_size < 150_000
        with Image.open(GALLERY / name) as picture:
            assert np.ptp(np.asarray(picture.convert("L"))) > 100


def test_there_are_words_for_every_claim(script):
    names = {load_study(number).name for number in script.THESIS}
    assert names <= set(script.WORDS)
    assert set(script.WORDS) - names <= set(script.BEYOND)


@pytest.mark.parametrize("number", [*"123456", "crowd"])
def test_the_words_are_about_every_claim(script, number):
    study = load_study(str(number))
    verdicts, words = script.WORDS[study.name]
    assert len(verdicts) == len(study.claims)
    assert len(words.split()) > 30


def test_words_about_other_verdicts_stop_the_script(script, monkeypatch):
    about = {"claims": [{"answer": "open"}] * 3, "points": []}
    monkeypatch.setattr(script, "summary", lambda results: about)
    results = type("Made", (), {"study": load_study("1")})()
    with pytest.raises(SystemExit, match="the words are about"):
        script.section(results)
