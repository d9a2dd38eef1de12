"""Fronts beside each other, and the parts along a front."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.report import figures

FRONT = (np.array([1.0, 2.0, 3.0]), np.array([3.0, 2.0, 1.0]))
LABELS = {"mean_label": "mean [dB(A)]", "sigma_label": "σ [dB]"}


def draw_fronts(curves=None, points=None):
    return figures.fronts(
        {"front": FRONT} if curves is None else curves,
        {"all": FRONT} if points is None else points,
        {"today's": (2.5, 2.5)},
        **LABELS,
    )


def draw_parts(chosen, labels=(("old", "new"), ("old", "soft", "stiff"))):
    return figures.part_choices(("EnM", "TSM"), labels, chosen, point_label="design")


def test_pictures_are_png_and_repeat_bit_for_bit():
    chosen = np.array([[0, 2], [1, 1], [1, 0]])
    for draw in (draw_fronts, lambda: draw_parts(chosen)):
        assert draw() == draw()
        assert draw()[:8] == b"\x89PNG\r\n\x1a\n"
    assert draw_parts(chosen) != draw_parts(chosen[::-1])


@pytest.mark.parametrize(
    ("draw", "sentence"),
    [
        (lambda: draw_fronts(curves={}), "no front to draw"),
        (lambda: draw_fronts(points={"all": (FRONT[0], [np.nan] * 3)}), "finite"),
        (lambda: draw_parts(np.array([[0, 3]])), "has no label"),
        (lambda: draw_parts(np.array([[0], [1]])), "one column"),
    ],
)
def test_what_cannot_be_drawn_is_refused(draw, sentence):
    with pytest.raises(InputError, match=sentence):
        draw()
