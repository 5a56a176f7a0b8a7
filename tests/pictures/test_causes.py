"""The bars of what was watched and why not: as long as the shares, named, and readable."""

import matplotlib.colors
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.figure import Figure

from staniel.metrics import Cause
from staniel.pictures import draw_causes, style


def drawn(labels, totals):
    axes = Figure().add_subplot()
    draw_causes(axes, labels, totals)
    return axes


def legend(axes):
    return [] if axes.get_legend() is None else [t.get_text() for t in axes.get_legend().texts]


def test_the_colours_are_those_of_the_causes_in_their_order():
    assert list(style.CAUSES) == [cause.words for cause in Cause]
    assert len(set(style.CAUSES.values())) == len(Cause)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 5))
def test_pieces_stand_end_to_end_and_are_as_long_as_their_shares(seed, count):
    random = np.random.default_rng(seed)
    totals = random.uniform(0.0, 600.0, (count, 9)) * (random.random((count, 9)) < 0.7)
    totals[:, 0] += 1.0
    axes = drawn([str(row) for row in range(count)], totals)
    occurring = [cause for cause in Cause if totals[:, cause].any()]
    assert legend(axes) == [cause.words for cause in occurring]
    end = np.zeros(count)
    for cause, bars in zip(occurring, axes.containers, strict=True):
        color = np.array(style.CAUSES[cause.words]) / 255.0
        for row, bar in enumerate(bars):
            share = 100.0 * totals[row, cause] / totals[row].sum()
            assert bar.get_x() == pytest.approx(end[row])
            assert bar.get_width() == pytest.approx(share, abs=1e-9)
            assert bar.get_facecolor()[:3] == pytest.approx(color)
            end[row] += share
    assert end == pytest.approx(100.0)


def test_a_number_stands_where_there_is_room_and_can_be_read():
    totals = np.zeros((2, 9))
    totals[0] = [60.0, 12.0, 12.0, 12.0, 0.0, 4.0, 0.0, 0.0, 0.0]
    totals[1, 4:] = 20.0
    axes = drawn(["a", "b"], totals)
    assert [text.get_text() for text in axes.texts if text.get_position()[1] == 0] == [
        "60", "12", "12", "12",
    ]  # fmt: skip
    for text in axes.texts:
        place = text.get_position()[0]
        (bar,) = (
            bar
            for bars in axes.containers
            for row, bar in enumerate(bars)
            if row == text.get_position()[1] and bar.get_x() < place < bar.get_x() + bar.get_width()
        )
        assert contrast(text.get_color(), bar.get_facecolor()) > 3.0


def contrast(one, other):
    """Ratio of luminances as WCAG 2 defines it."""
    values = []
    for color in (one, other):
        channels = np.array(matplotlib.colors.to_rgb(color))
        linear = np.where(
            channels <= 0.04045, channels / 12.92, ((channels + 0.055) / 1.055) ** 2.4
        )
        values.append(float(linear @ [0.2126, 0.7152, 0.0722]) + 0.05)
    return max(values) / min(values)


def test_the_first_label_is_on_top_and_rows_without_time_are_empty():
    axes = drawn(["first", "never"], [[600.0] + [0.0] * 8, [0.0] * 9])
    assert [label.get_text() for label in axes.get_yticklabels()] == ["first", "never"]
    assert axes.yaxis_inverted()
    assert [bar.get_width() for bar in axes.containers[0]] == [100.0, 0.0]
    assert legend(drawn([], np.zeros((0, 9)))) == []


@pytest.mark.parametrize(
    ("totals", "said"),
    [
        (np.zeros((2, 9)), r"shape \(2, 9\): expected \(1, 9\)"),
        (np.zeros((1, 8)), r"shape \(1, 8\): expected \(1, 9\)"),
        ([[-1.0] + [0.0] * 8], "expected finite numbers from 0 on"),
        ([[np.nan] + [0.0] * 8], "expected finite numbers from 0 on"),
    ],
)
def test_what_cannot_be_drawn_is_refused(totals, said):
    with pytest.raises(ValueError, match=said):
        drawn(["one"], totals)
