"""Figures of shares of variance: what is drawn, and what is refused."""

import struct

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.report.figures import (
    IndexBars,
    IndexGrowth,
    IndexMap,
    index_bars,
    index_growth,
    index_map,
)

FACTORS, COLOURS = ["TSM x", "TSM y", "GeM x"], ["#999933", "#999933", "#CC6677"]
FIRST = np.array([0.6, -0.01, 0.1])
TOTAL, HALF = np.array([0.8, 0.001, 0.2]), np.array([0.05, 0.002, 0.01])
ZERO = np.array([False, True, False])
LINES = np.linspace(20.0, 60.0, 9)


def bars(panels=None, **options):
    drawn = [IndexBars("U06-1", FIRST, TOTAL, HALF, ZERO)] * 2 if panels is None else panels
    return index_bars(FACTORS, COLOURS, drawn, x_label="share [1]", **options)


def heat(panels=None, **options):
    values = np.outer(TOTAL, np.ones(LINES.size))
    drawn = [IndexMap("U06-1", values, [30.0])] * 2 if panels is None else panels
    return index_map(LINES, 1.5, FACTORS, drawn, value_label="share [1]", **options)


def growth(panels=None, **options):
    values = np.outer(TOTAL, np.ones(4))
    drawn = [IndexGrowth("U06-1", values, 0.1 * values)] * 2 if panels is None else panels
    return index_growth(
        *([16, 32, 64, 128], FACTORS, COLOURS, drawn), x_label="N", y_label="share [1]", **options
    )


def height(png):
    assert png.startswith(b"\x89PNG")
    return struct.unpack(">II", png[16:24])[1]


@pytest.mark.parametrize("draw", [bars, heat, growth])
def test_figures_grow_with_their_panels_and_repeat_byte_by_byte(draw):
    assert draw() == draw()
    assert height(draw(columns=1)) > height(draw())
    with pytest.raises(InputError, match="no panel"):
        draw([])


def test_what_is_zero_or_coupled_is_seen():
    drawn = [
        bars([IndexBars("U06-1", first, TOTAL, HALF, zero)])
        for first, zero in ((FIRST, ZERO), (FIRST, ~ZERO), (TOTAL, ZERO))
    ]
    assert len(set(drawn)) == 3


def test_a_single_line_and_a_single_panel_are_drawn():
    one = [IndexMap("U06-1", TOTAL[:, None])]
    assert height(index_map([30.0], 1.5, FACTORS, one, value_label="share [1]")) > 100
    assert height(bars([IndexBars("U06-1", FIRST, TOTAL, HALF, ZERO)])) > 100


def test_values_that_a_plot_would_drop_are_refused():
    with pytest.raises(InputError, match="different lengths"):
        bars([IndexBars("a", FIRST[:2], TOTAL, HALF, ZERO)])
    with pytest.raises(InputError, match="total is not finite"):
        bars([IndexBars("a", FIRST, TOTAL * np.nan, HALF, ZERO)])
    with pytest.raises(InputError, match=r"U06-1 has shape \(3, 8\)"):
        heat([IndexMap("U06-1", np.ones((3, 8)))])
    with pytest.raises(InputError, match=r"U06-1 needs shape \(3, 4\)"):
        growth([IndexGrowth("U06-1", np.ones((3, 5)), np.ones((3, 5)))])
