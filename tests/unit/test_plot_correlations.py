"""Correlations and sensitivities: what they draw, and what they refuse."""

import io
import struct

import numpy as np
import plot_samples as figures
import pytest
from PIL import Image
from plot_samples import index_bars, index_map

from deboom.errors import InputError
from deboom.plot import IndexBars, IndexMap
from deboom.plot.correlations import coefficient

NAMES = ("sedan", "tourer", "van")
VALUES = np.random.default_rng(1).normal(size=(50, 3))
R = np.corrcoef(VALUES.T)
PANEL = figures.CorrelationPanel("designs", R, R - 0.1, R + 0.1)


def is_picture(drawn):
    with Image.open(io.BytesIO(drawn)) as picture:
        return picture.width >= 1400 and len(picture.getcolors(512)) > 10


TREE = np.array([[0, 1, 0.02, 2], [2, 3, 0.4, 3]])
TEN = [f"car-{number}" for number in range(10)]
STEPS = np.array([[0, 1, 0.01, 2], *([k + 1, k + 9, 0.01 * k, k + 1] for k in range(1, 9))])
COLUMNS = dict(zip(NAMES, VALUES.T, strict=True))


@pytest.mark.parametrize("n", [2, 9])
def test_matrices_of_any_size(n):
    r = np.full((n, n), 0.97) + 0.03 * np.eye(n)
    panel = figures.CorrelationPanel("designs", r, r - 0.01, r)
    names = [f"car-{number}" for number in range(n)]
    assert is_picture(figures.correlation_matrices(names, [panel]))


@pytest.mark.parametrize(
    "draw",
    [
        lambda: figures.scatter_matrix(
            NAMES, VALUES, (R, R - 0.1, R + 0.1), {"van": "#000000"}, value_label="dB"
        ),
        lambda: figures.clustered_matrix(TEN, np.eye(10), STEPS, [1] * 9 + [2], 0.9),
        lambda: figures.variable_grid(COLUMNS, {"level": VALUES[:, 0]}, "level [dB]"),
    ],
)
def test_grids_draw_and_repeat_byte_by_byte(draw):
    assert is_picture(draw())
    assert draw() == draw()


@pytest.mark.parametrize(
    ("draw", "sentence"),
    [
        (lambda: figures.correlation_matrices(NAMES, []), "no panel"),
        (lambda: figures.correlation_matrices(NAMES[:2], [PANEL]), "has shape"),
        (lambda: figures.scatter_matrix(NAMES[:1], VALUES, (R, R, R), {}, value_label="x"), "2 to"),
        (
            lambda: figures.scatter_matrix(NAMES, VALUES[:, :2], (R, R, R), {}, value_label="x"),
            "fo",
        ),
        (lambda: figures.clustered_matrix(NAMES, R, TREE[:1], [1, 1, 1], 0.9), "for 3 names"),
        (lambda: figures.clustered_matrix(NAMES, R * np.nan, TREE, [1, 1, 1], 0.9), "not finite"),
        (lambda: figures.variable_grid({}, COLUMNS, "x"), "0 variables and 3 responses"),
    ],
)
def test_figures_refuse_what_they_cannot_show(draw, sentence):
    with pytest.raises(InputError, match=sentence):
        draw()


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.9999, "0.999"), (0.949, "0.95"), (-0.3, "−0.30"), (1.0, "1.000"), (-0.001, "0.00")],
)
def test_a_coefficient_is_never_rounded_up_to_one(value, text):
    assert coefficient(value) == text


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


def height(png):
    assert png.startswith(b"\x89PNG")
    return struct.unpack(">II", png[16:24])[1]


@pytest.mark.parametrize("draw", [bars, heat])
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
