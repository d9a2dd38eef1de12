"""Small multiples and intervals: what they draw, and what they refuse."""

import struct

import numpy as np
import pytest
from plot_samples import (
    curve_matrix,
    curve_panels,
    dot_panels,
    front_intervals,
    heat_maps,
    interval_panels,
    map_panels,
    masked_panels,
    ratio_bars,
    spectra_panels,
    speed_panels,
)

from deboom.errors import InputError
from deboom.plot import (
    CurvePanel,
    DotPanel,
    HeatMap,
    IntervalPanel,
    MapPanel,
    MaskedPanel,
    SpectrumPanel,
    SpeedPanel,
)
from deboom.plot.levels import _scale, _shown, _spans

PNG = b"\x89PNG\r\n\x1a\n"
BOUNDS = ([1.0, 2.0], [0.5, 1.5], [1.5, 2.6])


def test_rows_of_several_panels_and_a_front_are_drawn():
    panels = [
        IntervalPanel("level [dB(A)]", {"today's": BOUNDS}),
        IntervalPanel("change [dB]", {"best mean": BOUNDS, "knee": BOUNDS}, "against today's"),
    ]
    drawn = interval_panels(["V-1", "V-2"], panels)
    assert drawn.startswith(PNG)
    assert drawn == interval_panels(["V-1", "V-2"], panels)
    front = front_intervals(BOUNDS, BOUNDS, {"knee": 1}, mean_label="a [dB]", sigma_label="b [dB]")
    assert front.startswith(PNG)


def test_what_cannot_be_drawn_is_refused():
    with pytest.raises(InputError, match="no panel"):
        interval_panels(["V-1"], [])
    with pytest.raises(InputError, match="different lengths"):
        interval_panels(["V-1"], [IntervalPanel("x [dB]", {"a": BOUNDS})])
    broken = ([1.0, np.nan], *BOUNDS[1:])
    with pytest.raises(InputError, match="mean value is not finite"):
        front_intervals(broken, BOUNDS, {}, mean_label="a [dB]", sigma_label="b [dB]")


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


LINES_3 = np.geomspace(10.0, 150.0, 30)
PNG_3 = b"\x89PNG"


def panel_3(**changes):
    curve = {"measured": 1 / LINES_3, "identified": 1 / LINES_3}
    fields = {
        "title": "inertance",
        "y_label": "[1/kg]",
        "frequency": LINES_3,
        "curves": curve,
        "ranges": {"95 %": (0.9 / LINES_3, 1.1 / LINES_3)},
        "levels": {"450": 0.05},
        "logarithmic": True,
    }
    return SpectrumPanel(**(fields | changes))


def test_spectra_are_drawn_alike_twice():
    drawn = [
        spectra_panels([panel_3()], columns=1, dashed=("identified",), fitted=((10.0, 30.0),))
        for _ in range(2)
    ]
    assert drawn[0] == drawn[1]
    assert drawn[0].startswith(PNG_3)


def test_a_matrix_of_curves():
    values = np.ones((LINES_3.size, 2, 2)) * LINES_3[:, np.newaxis, np.newaxis]
    for logarithmic in (False, True):
        picture = curve_matrix(
            ("Tx", "Rx"),
            LINES_3,
            {"measured": values, "identified": 2 * values},
            units=("kg", "kg m", "kg m²"),
            what="apparent mass",
            dashed=("identified",),
            fitted=((10.0, 30.0),),
            logarithmic=logarithmic,
        )
        assert picture.startswith(PNG_3)


def test_heat_maps_and_bars():
    one = HeatMap("MAC", ("1", "2"), ("1", "2"), np.eye(2), "measured", "identified")
    assert heat_maps([one, one, one, one]).startswith(PNG_3)
    bars = ratio_bars(
        ("a", "b", "c"), (0.1, 0.9, 0.3), limit=0.5, x_label="[1]", below="seen", above="not"
    )
    assert bars.startswith(PNG_3)


def test_refusals():
    with pytest.raises(InputError, match="no panel"):
        spectra_panels([])
    with pytest.raises(InputError, match="not finite"):
        spectra_panels([panel_3(curves={"measured": np.full(LINES_3.size, np.nan)})])
    with pytest.raises(InputError, match="different lengths"):
        spectra_panels([panel_3(curves={"measured": LINES_3[:-1]})])
    with pytest.raises(InputError, match="has shape"):
        curve_matrix(
            ("Tx",), LINES_3, {"a": np.ones((LINES_3.size, 2, 2))}, units=("",) * 3, what=""
        )
    with pytest.raises(InputError, match="no matrix"):
        heat_maps([])
    with pytest.raises(InputError, match="has shape"):
        heat_maps([HeatMap("MAC", ("1",), ("1",), np.eye(2))])
    with pytest.raises(InputError, match="different lengths"):
        ratio_bars(("a",), (0.1, 0.2), limit=0.5, x_label="", below="", above="")


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


LINES_5 = np.linspace(20.0, 60.0, 41)
COLOURS = {"measured": "#1F2933", "synthesised": "#D55E00"}


def curves():
    return {"measured": 60 - abs(LINES_5 - 30), "synthesised": 61 - abs(LINES_5 - 31)}


def test_panels_are_drawn_alike_every_time_5():
    panel = SpeedPanel(
        "car", curves(), "peaks within 1.00 dB", {"measured": (np.array([30.0]), np.array([60.0]))}
    )
    pictures = {
        speed_panels(
            LINES_5,
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
        return speed_panels(LINES_5, 1.5, panels, y_label="y [1]", colours=colours)

    with pytest.raises(InputError, match="no panel"):
        draw([])
    with pytest.raises(InputError, match=r"measured in 'car' has shape \(40,\)"):
        draw([SpeedPanel("car", {"measured": LINES_5[1:]})])
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
