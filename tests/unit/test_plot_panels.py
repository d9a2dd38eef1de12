"""Small multiples and intervals: what they draw, and what they refuse."""

import struct

import numpy as np
import pytest
from plot_samples import (
    curve_matrix,
    curve_panels,
    heat_maps,
    interval_panels,
)

from deboom.errors import InputError
from deboom.plot import CurvePanel, HeatMap, IntervalPanel

PNG = b"\x89PNG\r\n\x1a\n"
BOUNDS = ([1.0, 2.0], [0.5, 1.5], [1.5, 2.6])


def test_rows_of_several_panels_are_drawn():
    panels = [
        IntervalPanel("level [dB(A)]", {"today's": BOUNDS}),
        IntervalPanel("change [dB]", {"best mean": BOUNDS, "knee": BOUNDS}, "against today's"),
    ]
    drawn = interval_panels(["V-1", "V-2"], panels)
    assert drawn.startswith(PNG)
    assert drawn == interval_panels(["V-1", "V-2"], panels)
    allowed = IntervalPanel("level [dB(A)]", {"today's": BOUNDS}, allowed=([0, 0], [3, 3]))
    others = {interval_panels(["V-1", "V-2"], [p, p], columns=1) for p in (panels[0], allowed)}
    assert len({drawn, *others}) == 3


def test_what_cannot_be_drawn_is_refused():
    with pytest.raises(InputError, match="no panel"):
        interval_panels(["V-1"], [])
    with pytest.raises(InputError, match="different lengths"):
        interval_panels(["V-1"], [IntervalPanel("x [dB]", {"a": BOUNDS})])
    broken = ([1.0, np.nan], *BOUNDS[1:])
    with pytest.raises(InputError, match="value is not finite"):
        interval_panels(["V-1", "V-2"], [IntervalPanel("x [dB]", {"a": broken})])


LINES = np.linspace(17.0, 150.0, 134)
VALUES = 20 + np.sin(LINES)


def panel(**more):
    return CurvePanel("u", LINES, {"y": VALUES, "truth": 0 * LINES + 20}, **more)


def draw_curves(*panels, **options):
    return curve_panels(panels, **({"y_label": "u [g mm]", "columns": 1} | options))


FULL = {
    "points": {"y": (LINES[3:5], VALUES[3:5]), "cloud": (LINES, VALUES + 1)},
    "ranges": {"y": (VALUES - 1, VALUES + 1)},
    "masked": {"a resonance": LINES < 50},
    "levels": {"limit": 25.0},
    "y_label": "static [g mm]",
    "note": "route d",
}


def test_every_part_of_a_panel_is_seen_and_drawn_alike_every_time():
    usual = {"dashed": ("truth",), "order": 1.0}
    whole = draw_curves(panel(**FULL), **usual)
    assert whole == draw_curves(panel(**FULL), **usual)
    others = [
        draw_curves(
            panel(**{k: v for k, v in FULL.items() if k != name}), dashed=("truth",), order=1.0
        )
        for name in FULL
    ]
    ways = ({"order": 1.5}, {"dashed": ()}, {"log_frequency": True}, {"fitted": ((20, 30),)})
    others += [
        draw_curves(panel(**FULL), **({"dashed": ("truth",), "order": 1.0} | one)) for one in ways
    ]
    assert len({whole, *others}) == 1 + len(FULL) + len(ways)


def test_rows_of_panels_make_the_figure_higher():
    heights = [size(draw_curves(*[panel()] * n, columns=3))[1] for n in (3, 4)]
    assert heights[0] < heights[1]
    assert size(draw_curves(panel()))[0] == 1440


def test_scales_are_shared_or_end_below_the_highest_value():
    pair = (panel(), CurvePanel("v", LINES, {"y": 3 * VALUES}))
    drawn = {draw_curves(*pair, **way) for way in ({}, {"share_y": True}, {"depth": 5.0})}
    assert len(drawn) == 3
    assert draw_curves(panel(logarithmic=True)) not in drawn


@pytest.mark.parametrize(
    ("panels", "options", "words"),
    [
        ([], {}, "no panel to draw"),
        ([panel(masked={"short": LINES[1:] < 50})], {}, "mask 'short' has other lines"),
        ([CurvePanel("u", LINES, {"y": LINES * np.nan})], {}, "y is not finite"),
        ([CurvePanel("u", LINES, {"y": LINES[1:]})], {}, "different lengths"),
        ([panel()], {"colours": {"y": "#0072B2"}}, "'truth' has no colour"),
    ],
)
def test_panels_that_do_not_fit_are_refused_in_words(panels, options, words):
    with pytest.raises(InputError, match=words):
        draw_curves(*panels, **options)


def test_a_matrix_of_curves():
    lines = np.geomspace(10.0, 150.0, 30)
    values = np.ones((lines.size, 2, 2)) * lines[:, np.newaxis, np.newaxis]
    for logarithmic in (False, True):
        picture = curve_matrix(
            ("Tx", "Rx"),
            lines,
            {"measured": values, "identified": 2 * values},
            units=("kg", "kg m", "kg m²"),
            what="apparent mass",
            dashed=("identified",),
            fitted=((10.0, 30.0),),
            logarithmic=logarithmic,
        )
        assert picture.startswith(PNG)
    with pytest.raises(InputError, match="has shape"):
        curve_matrix(("Tx",), lines, {"a": values}, units=("",) * 3, what="")


def test_a_matrix_with_signs_has_another_scale():
    values = np.array([[1.0, 0.2], [0.1, -0.0004]])
    names = ("a", "b")
    drawn = heat_maps([HeatMap("MAC", names, names, values)])
    assert drawn != heat_maps([HeatMap("MAC", names, names, values, limits=(-1.0, 1.0))])
    # what rounds to zero has no sign
    assert drawn == heat_maps([HeatMap("MAC", names, names, np.abs(values))])


def test_heat_maps():
    one = HeatMap("MAC", ("1", "2"), ("1", "2"), np.eye(2), "measured", "identified")
    assert heat_maps([one, one, one, one]).startswith(PNG)
    with pytest.raises(InputError, match="no panel"):
        heat_maps([])
    with pytest.raises(InputError, match="has shape"):
        heat_maps([HeatMap("MAC", ("1",), ("1",), np.eye(2))])


def size(png):
    assert png.startswith(PNG)
    return struct.unpack(">II", png[16:24])
