"""Small multiples: what is drawn, and what is refused."""

import struct

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.report.figures import CurvePanel, MapPanel, curve_panels, map_panels

X = np.linspace(20.0, 80.0, 30)
CURVES = [
    CurvePanel(name, X, {"measured": X + 2, "surface": X}, {"points": (X, X - 3)})
    for name in ("EnM x", "EnM y", "EnM z", "GeM x")
]
MAPS = [MapPanel(name, X, X**2, 100 * np.sin(X)) for name in ("EnM x", "EnM y")]


def draw_curves(panels=CURVES, **options):
    return curve_panels(panels, x_label="frequency [Hz]", y_label="|K| [N/mm]", **options)


def draw_map(panels=MAPS, **options):
    return map_panels(
        panels, x_label="frequency [Hz]", y_label="torque [N m]", value_label="|K|", **options
    )


def size(png):
    assert png.startswith(b"\x89PNG")
    return struct.unpack(">II", png[16:24])


def test_rows_of_panels_make_the_figure_higher():
    assert size(draw_curves())[0] == size(draw_map())[0] == 1440
    assert size(draw_curves(columns=2))[1] == size(draw_curves())[1]  # two rows either way
    assert size(draw_curves(CURVES[:3]))[1] < size(draw_curves())[1]


def test_the_same_arguments_give_the_same_bytes_and_other_values_others():
    assert draw_curves() == draw_curves()
    assert draw_map() == draw_map()
    assert draw_curves(dashed=("measured",)) != draw_curves()
    assert draw_curves(share_y=True) == draw_curves(share_y=True)


@pytest.mark.parametrize("draw", [draw_curves, draw_map])
def test_nothing_to_draw_is_refused(draw):
    with pytest.raises(InputError, match="no panel"):
        draw([])


def test_values_that_a_plot_would_drop_are_refused():
    with pytest.raises(InputError, match="surface is not finite at index"):
        draw_curves([CurvePanel("a", X, {"surface": np.where(X > 50, np.nan, X)})])
    with pytest.raises(InputError, match="different lengths"):
        draw_curves([CurvePanel("a", X, {"surface": X[1:]})])
    with pytest.raises(InputError, match="value is not finite"):
        draw_map([MapPanel("a", X, X, X * np.inf)])


def test_a_map_of_one_value_is_drawn():
    size(draw_map([MapPanel("flat", X, X, np.ones_like(X))]))
