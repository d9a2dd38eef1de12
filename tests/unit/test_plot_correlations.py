"""Correlations and sensitivities: what they draw, and what they refuse."""

import io

import numpy as np
import plot_samples as figures
import pytest
from PIL import Image

from deboom.errors import InputError
from deboom.plot.correlations import coefficient

NAMES = ("sedan", "tourer", "van")
VALUES = np.random.default_rng(1).normal(size=(50, 3))
R = np.corrcoef(VALUES.T)


def is_picture(drawn):
    with Image.open(io.BytesIO(drawn)) as picture:
        return picture.width >= 1400 and len(picture.getcolors(512)) > 10


TREE = np.array([[0, 1, 0.02, 2], [2, 3, 0.4, 3]])
TEN = [f"car-{number}" for number in range(10)]
STEPS = np.array([[0, 1, 0.01, 2], *([k + 1, k + 9, 0.01 * k, k + 1] for k in range(1, 9))])
COLUMNS = dict(zip(NAMES, VALUES.T, strict=True))


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
