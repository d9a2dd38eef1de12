"""Figures of correlations: they draw, give the same bytes, and refuse what they cannot show."""

import io

import numpy as np
import pytest
from PIL import Image

from deboom.errors import InputError
from deboom.report import figures
from deboom.report.figures.correlations import coefficient

NAMES = ("sedan", "tourer", "van")
VALUES = np.random.default_rng(1).normal(size=(50, 3))
R = np.corrcoef(VALUES.T)
PANEL = figures.CorrelationPanel("designs", R, R - 0.1, R + 0.1)


def is_picture(drawn):
    with Image.open(io.BytesIO(drawn)) as picture:
        return picture.width >= 1400 and len(picture.getcolors(512)) > 10


@pytest.mark.parametrize("n", [2, 9])
def test_matrices_of_any_size(n):
    r = np.full((n, n), 0.97) + 0.03 * np.eye(n)
    panel = figures.CorrelationPanel("designs", r, r - 0.01, r)
    names = [f"car-{number}" for number in range(n)]
    assert is_picture(figures.correlation_matrices(names, [panel], ["one"] + ["two"] * (n - 1)))


def test_other_figures_draw():
    parts = (R, R - 0.1, R + 0.1)
    drawn = figures.scatter_matrix(NAMES, VALUES, parts, {"van": "#000000"}, value_label="dB")
    assert is_picture(drawn)
    tree = np.array([[0, 1, 0.02, 2], [2, 3, 0.4, 3]])
    assert is_picture(figures.family_tree(tree, NAMES, [1, 1, 2], 0.9))
    panel = figures.PopulationPanel("r [1]", [0.2, 0.9, 0.99, 0.5], 0.95, (0.9,), "four")
    pictures = [figures.populations([panel, panel]) for _ in range(2)]
    assert is_picture(pictures[0])
    assert pictures[0] == pictures[1]


@pytest.mark.parametrize(
    ("draw", "sentence"),
    [
        (lambda: figures.correlation_matrices(NAMES, []), "no matrix"),
        (lambda: figures.correlation_matrices(NAMES[:2], [PANEL]), "has shape"),
        (lambda: figures.scatter_matrix(NAMES[:1], VALUES, (R, R, R), {}, value_label="x"), "2 to"),
        (
            lambda: figures.scatter_matrix(NAMES, VALUES[:, :2], (R, R, R), {}, value_label="x"),
            "fo",
        ),
        (lambda: figures.family_tree(np.zeros((1, 4)), NAMES, [1, 1, 1], 0.9), "for a tree of 2"),
        (lambda: figures.populations([]), "no panel"),
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
