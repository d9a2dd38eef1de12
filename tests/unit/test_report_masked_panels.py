"""Panels over the frequency of a rotor: what they draw, whom they distrust, what they refuse."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.report.figures import MaskedPanel, masked_panels
from deboom.report.figures.masked_panels import _scale, _shown, _spans

LINES = np.linspace(17.0, 150.0, 134)
VALUES = 20 + np.sin(LINES)


def panel(**more):
    return MaskedPanel("u", "u [g mm]", LINES, {"y": VALUES, "truth": 0 * LINES + 20}, **more)


def test_panels_are_drawn_alike_every_time():
    full = panel(
        ranges={"y": (VALUES - 1, VALUES + 1)},
        masked={"a resonance": LINES < 50},
        levels={"limit": 25.0},
        note="route d",
    )
    first, second = (masked_panels([full], dashed=("truth",)) for _ in range(2))
    assert first == second
    assert first.startswith(b"\x89PNG\r\n\x1a\n")
    assert masked_panels([panel(logarithmic=True), full], columns=2) != first


def test_a_line_shows_its_first_reason():
    shown = _shown(panel(masked={"a": LINES < 50, "b": LINES < 60, "c": LINES < 20}))
    assert list(shown) == ["a", "b"]
    assert LINES[shown["b"]].min() == 50.0


def test_spans_reach_half_way_to_the_next_line():
    lines = np.array([10.0, 12.0, 14.0, 16.0, 18.0])
    mask = np.array([True, False, True, True, False])
    assert _spans(lines, mask) == [(10.0, 11.0), (13.0, 17.0)]


def test_the_scale_is_made_for_trusted_lines():
    values = np.array([100.0, 20.0, 21.0, 20.0])
    trusted = np.array([False, True, True, True])
    low, high = _scale([values], trusted, [])
    assert 19.5 < low < 20.0
    assert 23.0 < high < 23.5
    assert _scale([values], trusted, [30.0])[1] > 30.0
    assert _scale([values], ~trusted & False, [])[1] > 80.0


def test_panels_that_do_not_fit_are_refused_in_words():
    with pytest.raises(InputError, match="no panel to draw"):
        masked_panels([])
    with pytest.raises(InputError, match="mask 'short' has other lines"):
        masked_panels([panel(masked={"short": LINES[1:] < 50})])
    with pytest.raises(InputError, match="y is not finite"):
        masked_panels([MaskedPanel("u", "u", LINES, {"y": np.full(134, np.nan)})])
