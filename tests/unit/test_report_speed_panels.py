"""Panels over an engine order, and dots by category: what they draw and refuse."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.report.figures import DotPanel, SpeedPanel, dot_panels, speed_panels

PNG = b"\x89PNG\r\n\x1a\n"
LINES = np.linspace(20.0, 60.0, 41)
COLOURS = {"measured": "#1F2933", "synthesised": "#D55E00"}


def curves():
    return {"measured": 60 - abs(LINES - 30), "synthesised": 61 - abs(LINES - 31)}


def test_panels_are_drawn_alike_every_time():
    panel = SpeedPanel(
        "car", curves(), "peaks within 1.00 dB", {"measured": (np.array([30.0]), np.array([60.0]))}
    )
    pictures = {
        speed_panels(
            LINES,
            1.5,
            [panel, panel, panel],
            y_label="SPL [dB(A)]",
            colours=COLOURS,
            dashed=("synthesised",),
            depth=45.0,
        )
        for _ in range(2)
    }
    assert len(pictures) == 1
    assert pictures.pop().startswith(PNG)


def test_curves_that_do_not_fit_are_refused_in_words():
    def draw(panels, colours=COLOURS):
        return speed_panels(LINES, 1.5, panels, y_label="y [1]", colours=colours)

    with pytest.raises(InputError, match="no panel"):
        draw([])
    with pytest.raises(InputError, match=r"measured in 'car' has shape \(40,\)"):
        draw([SpeedPanel("car", {"measured": LINES[1:]})])
    with pytest.raises(InputError, match="finite values"):
        draw([SpeedPanel("car", {"measured": np.full(41, np.nan)})])
    with pytest.raises(InputError, match="'measured' has no colour"):
        draw([SpeedPanel("car", curves())], {})


def test_dots_of_several_groups_are_drawn():
    values = {"road": {"A": [1.0, 2.0], "B": [3.0]}, "bench": {"A": [0.5]}}
    panels = [DotPanel("x [dB]", values, 3.0, "asked"), DotPanel("y [%]", values)]
    assert dot_panels(panels, {"A": "#0072B2", "B": "#D55E00"}).startswith(PNG)


def test_dots_that_do_not_fit_are_refused_in_words():
    one = DotPanel("x [dB]", {"road": {"A": [1.0]}})
    with pytest.raises(InputError, match="no panel"):
        dot_panels([], {})
    with pytest.raises(InputError, match="same categories"):
        dot_panels([one, DotPanel("y [%]", {"bench": {"A": [1.0]}})], {"A": "#0072B2"})
    with pytest.raises(InputError, match="'A' has no colour"):
        dot_panels([one], {})
    with pytest.raises(InputError, match="not finite"):
        dot_panels([DotPanel("x [dB]", {"road": {"A": [np.nan]}})], {"A": "#0072B2"})
