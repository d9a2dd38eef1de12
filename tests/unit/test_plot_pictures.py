"""Pictures: what changes them, PNG bytes that repeat, and what cannot be drawn."""

import io
import struct
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from PIL import Image

from deboom import plot
from deboom.errors import InputError
from deboom.plot import BodyMotion, CurvePanel, HeatMap, IntervalPanel, Intervals, LineMap, style
from deboom.plot.correlations import coefficient
from deboom.report.overview import RunCard, render_overview
from pinned_pages import described, hold


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    """Few dots take little time."""
    monkeypatch.setattr(style, "DPI", 60)


def size(png):
    assert png.startswith(b"\x89PNG\r\n\x1a\n")
    return struct.unpack(">II", png[16:24])


def picture(name, *usual, **always):
    """Return a function that draws a picture of `deboom.plot` as PNG, anything of it changed."""

    def draw(*arguments, **options):
        return style.as_png(getattr(plot, name)(*(arguments or usual), **(always | options)))

    return draw


BOUNDS = ([1.0, 2.0], [0.5, 1.5], [1.5, 2.6])
ALLOWED = IntervalPanel("level [dB(A)]", {"today's": BOUNDS}, allowed=([0, 0], [3, 3]))
TWO = [
    IntervalPanel("level [dB(A)]", {"today's": BOUNDS}),
    IntervalPanel("change [dB]", {"best-mean": BOUNDS, "knee": BOUNDS}, "against today's"),
]
rows = picture("interval_panels", ["V-1", "V-2"], TWO)

LINES = np.linspace(17.0, 150.0, 134)
VALUES = 20 + np.sin(LINES)
FULL = {
    "points": {"y": (LINES[3:5], VALUES[3:5]), "cloud": (LINES, VALUES + 1)},
    "ranges": {"y": (VALUES - 1, VALUES + 1)},
    "masked": {"a resonance": LINES < 50},
    "levels": {"limit": 25.0},
    "y_label": "static [g mm]",
    "note": "route d",
}


def panel(without="", **more):
    parts = {name: part for name, part in (FULL | more).items() if name != without}
    return CurvePanel("u", LINES, {"y": VALUES, "truth": 0 * LINES + 20}, **parts)


PAIR = tuple(CurvePanel(name, LINES, {"y": k * VALUES}) for k, name in ((1, "u"), (3, "v")))
WAYS = {"y_label": "u [g mm]", "columns": 1, "dashed": ("truth",), "order": 1.0}
curves = picture("curve_panels", (panel(),), **WAYS)
pair = partial(curves, PAIR, dashed=())

MATRIX = np.geomspace(10.0, 150.0, 30)[:, None, None] * np.ones((2, 2))
matrix = picture(
    "curve_matrix",
    ("Tx", "Rx"),
    np.geomspace(10.0, 150.0, 30),
    {"measured": MATRIX, "identified": 2 * MATRIX},
    units=("kg", "kg m", "kg m²"),
    what="apparent mass",
    dashed=("identified",),
    fitted=((10.0, 30.0),),
)
MAC = np.array([[1.0, 0.2], [0.1, -0.0004]])


def heat(values, count=1, **options):
    map_of = HeatMap("MAC", ("a", "b"), ("a", "b"), values, "measured", "identified", **options)
    return picture("heat_maps", [map_of] * count)()


FRONT = (np.array([1.0, 2.0, 3.0]), np.array([3.0, 2.0, 1.0]))
fronts = picture(
    "fronts",
    {"front": FRONT},
    {"all": FRONT},
    {"today's": (2.5, 2.5)},
    mean_label="mean [dB(A)]",
    sigma_label="σ [dB]",
)
VARIABLES = ("EnM x", "TSM x")
DESIGNS = np.array([[0.8, 1.2], [1.0, 1.0], [1.2, 0.9]])


def lines(designs=DESIGNS, value=(51.0, 52.0, 53.0)):
    bounds, marks = [[0.8] * 2, [1.2] * 2], {"today's": [1.0, 1.0]}
    label = {"value_label": "mean level [dB(A)]"}
    return picture("parallel_coordinates", VARIABLES, designs, bounds, value, marks, **label)()


def maps(after=((60.0, 50.0, 40.0), (61.0, 51.0, 40.0)), **options):
    shown = [
        LineMap("today", np.full((2, 3), 55.0), "SPL [dB(A)]", (20.0, 60.0), "inferno"),
        LineMap("after", after, "SPL [dB(A)]", (20.0, 60.0), "inferno"),
        LineMap("difference", np.ones((2, 3)), "change [dB]", (-1.0, 1.0), peaks=[30.0]),
    ]
    frequency = np.array([20.0, 30.0, 40.0])
    return picture("line_maps", frequency, 1.5, VARIABLES, shown, **options)()


def vectors(after=(1j, 0.5)):
    sums = {"today": [1.0, 0.5j], "new": after}
    return picture("vector_sum", VARIABLES, sums, ("red", "blue"))()


LOW, HIGH = np.full(3, 0.8), np.full(3, 1.2)


def box(low, high):
    return picture(
        "box_intervals",
        ("EnM x", "EnM y", "GeM x"),
        Intervals("box", LOW, HIGH),
        Intervals("±10 %", low, high),
        Intervals("bounds", LOW - 0.2, HIGH + 0.2),
        np.ones(3),
        np.array([300.0, np.nan, 200.0]),
        [False, True, False],
        {"EnM": "#332288", "GeM": "#CC6677"},
    )()


CARS = ("sedan", "tourer", "van")
CLOUD = np.random.default_rng(1).normal(size=(50, 3))
COLUMNS = dict(zip(CARS, CLOUD.T, strict=True))
R = np.corrcoef(CLOUD.T)
TREE = np.array([[0, 1, 0.02, 2], [2, 3, 0.4, 3]])
BAND = (R, R - 0.1, R + 0.1)
scatter = picture("scatter_matrix", CARS, CLOUD, BAND, {"van": "#000000"}, value_label="dB")
clusters = picture("clustered_matrix", CARS, R, TREE, [1, 1, 2], 0.9)
grid = picture("variable_grid", COLUMNS, {"level": CLOUD[:, 0]}, "level [dB]")


def body(n_mode=2, **changes):
    fields = {
        "labels": ("EnM", "GeM", "TSM", "roof"),
        "positions": [[0.0, 0.4, 0.2], [0.0, -0.4, 0.2], [0.2, 0.0, -0.3], [2.0, 0.0, 1.0]],
        "normals": [[0.0, 0.0, 0.0]] * 3 + [[0.0, 0.0, -1.0]],
        "titles": [f"{20 + 5 * k} Hz" for k in range(n_mode)],
        "motion": np.random.default_rng(1).normal(size=(n_mode, 4, 3)) * (1 + 0.1j),
    }
    arrays = {"positions", "normals"}
    fields = {k: np.array(v) if k in arrays else v for k, v in (fields | changes).items()}
    return BodyMotion(**fields)


shapes = picture("mode_shapes")


def chart(**changes):
    frequency = np.linspace(20.0, 80.0, 61)
    arguments = {
        "frequency": frequency,
        "level": -frequency,
        "pole_frequency": [24.0, 24.1, 30.0],
        "pole_order": [4, 5, 5],
        "stable": [False, True, False],
        "modes": [24.1, 25.0],
        "level_label": "level [dB]",
    }
    return picture("stabilisation_chart", **(arguments | changes))()


TWO_GROUPS = {
    "U06": {"level [dB(A)]": [50.0, 51.0, 52.5], "σ [dB]": [0.5, 0.4, 0.3]},
    "F39": {"level [dB(A)]": [48.0, 49.0, 49.5], "σ [dB]": [0.7, 0.5, 0.4]},
}
GROUP_COLOURS = {"U06": "#0072B2", "F39": "#D55E00"}
pairs = picture("grouped_pairs", TWO_GROUPS, colours=GROUP_COLOURS)
joint = picture("joint_scatter", TWO_GROUPS, colours=GROUP_COLOURS)
REPEATS = {"today": [50.0, 50.1, 50.05], "best-mean": [47.0, 47.2, 47.1]}
strips = picture("strips", {"level [dB(A)]": REPEATS, "σ [dB]": REPEATS})
ONE_GROUP = {"U06": TWO_GROUPS["U06"]}
PART_AXES = {"x rearward": (1.0, 0.0, 0.0), "y right": (0.0, 2.0, 0.0), "z up": (0.0, 0.0, 1.0)}
sketch = picture("axes_sketch", PART_AXES)

VARIANTS = {
    "pairs": [pairs, partial(pairs, ONE_GROUP)],
    "joint": [joint, partial(joint, ONE_GROUP)],
    "strips": [strips, partial(strips, {"level [dB(A)]": REPEATS})],
    "rows": [rows, *(partial(rows, ["V-1", "V-2"], [p, p], columns=1) for p in (TWO[0], ALLOWED))],
    "curves": [
        curves,
        *(partial(curves, (panel(without=part),)) for part in FULL),
        *(partial(curves, **way) for way in ({"order": 1.5}, {"dashed": ()})),
        partial(curves, (panel(x_label="deflection [mm]"),)),
        *(partial(curves, **way) for way in ({"log_frequency": True}, {"fitted": ((20, 30),)})),
        partial(curves, (panel(logarithmic=True),)),
    ],
    "scales": [pair, partial(pair, share_y=True), partial(pair, depth=5.0, columns=2)],
    "matrix": [matrix, partial(matrix, logarithmic=True)],
    "heat": [partial(heat, MAC), partial(heat, MAC, limits=(-1.0, 1.0)), partial(heat, MAC, 4)],
    "fronts": [fronts],
    "lines": [lines],
    "maps": [maps, partial(maps, columns=1), partial(maps, np.full((2, 3), 50.0))],
    "vectors": [vectors, partial(vectors, (-1j, 0.5))],
    "box": [partial(box, LOW, HIGH), partial(box, LOW + 0.1, HIGH - 0.1)],
    "scatter": [scatter],
    "clusters": [clusters],
    "grid": [grid],
    "chart": [chart, partial(chart, stable=[True, True, False])],
    "sketch": [sketch, *(partial(sketch, PART_AXES, axis) for axis in PART_AXES.values())],
}


@pytest.mark.slow("renders every picture three times and more")
@pytest.mark.parametrize("name", VARIANTS)
def test_a_picture_repeats_byte_by_byte_and_shows_each_of_its_parts(name):
    usual, *others = VARIANTS[name]
    drawn = [usual(), *(draw() for draw in others)]
    assert usual() == drawn[0]
    assert all(min(size(png)) > 50 for png in drawn)
    assert len(set(drawn)) == len(drawn)


@pytest.mark.parametrize("name", VARIANTS)
def test_pictures_show_what_they_showed(name, monkeypatch, tmp_path):
    monkeypatch.setattr(style, "as_png", described)
    for number, draw in enumerate(VARIANTS[name]):
        (tmp_path / f"{name} {number}.png").write_bytes(draw())
    hold(tmp_path, f"pictures/{name}")


def test_what_rounds_to_zero_has_no_sign():
    assert heat(MAC) == heat(np.abs(MAC))


def test_a_motion_is_drawn_as_large_in_any_unit():
    whole = body(1)
    smaller = replace(whole, motion=1e-6 * np.asarray(whole.motion))
    assert plot.mode_shapes(smaller) == plot.mode_shapes(whole)


def test_motion_is_one_period_of_different_frames():
    with Image.open(io.BytesIO(plot.mode_shapes(body(1)))) as moving:
        assert (moving.format, moving.n_frames) == ("PNG", 12)
        first = np.array(moving.convert("L"))
        moving.seek(6)
        assert np.any(np.array(moving.convert("L")) != first)


def one_curve(values, **more):
    return lambda: curves((CurvePanel("u", LINES, {"y": values}, **more),))


REFUSED = [
    (lambda: rows(["V-1"], []), "no panel"),
    (lambda: rows(["V-1"], TWO), "different lengths"),
    (
        lambda: rows(["a", "b"], [IntervalPanel("x", {"a": ([1.0, np.nan], *BOUNDS[1:])})]),
        "value is not finite",
    ),
    (lambda: curves(()), "no panel to draw"),
    (one_curve(VALUES, masked={"short": LINES[1:] < 50}), "mask 'short' has other lines"),
    (one_curve(LINES * np.nan), "y is not finite"),
    (one_curve(LINES[1:]), "different lengths"),
    (lambda: curves(colours={"y": "#0072B2"}), "has no colour"),
    (lambda: matrix(("Tx",), MATRIX[:, 0, 0], {"a": MATRIX}), "has shape"),
    (lambda: picture("heat_maps", [])(), "no panel"),
    (lambda: heat(np.eye(3)), "has shape"),
    (lambda: fronts({}, {}, {}), "no front to draw"),
    (lambda: pairs({"a": {"x": [1.0]}}), "at least two"),
    (lambda: joint({"a": {"x": [1.0], "y": [np.nan]}}), "not finite"),
    (lambda: joint({"a": {"x": [1.0], "y": [1.0, 2.0]}}), "different lengths"),
    (lambda: joint({"a": {"x": [1.0]}}), "it takes two"),
    (lambda: strips({}), "no panel"),
    (lambda: strips({"x": {"a": []}}), "empty"),
    (lambda: fronts({"a": FRONT}, {"all": (FRONT[0], [np.nan] * 3)}, {}), "finite"),
    (lambda: lines(DESIGNS[:, :1]), "one column per variable"),
    (lambda: lines(value=(51.0, 52.0)), "one column per variable"),
    (lambda: lines(value=(51.0, np.nan, 53.0)), "finite"),
    (lambda: maps(np.zeros((3, 3))), r"shape \(3, 3\), expected \(2, 3\)"),
    (lambda: vectors([np.inf, 0.0]), "finite"),
    (lambda: vectors([1.0]), "different lengths"),
    (lambda: box(LOW * np.nan, HIGH), "not finite"),
    (lambda: scatter(CARS[:1], CLOUD, BAND, {}), "2 to"),
    (lambda: scatter(CARS, CLOUD[:, :2], BAND, {}), "fo"),
    (lambda: clusters(CARS, R, TREE[:1], [1, 1, 1], 0.9), "for 3 names"),
    (lambda: clusters(CARS, R * np.nan, TREE, [1, 1, 1], 0.9), "not finite"),
    (lambda: grid({}, COLUMNS, "x"), "0 variables and 3 responses"),
    (lambda: shapes(body(motion=np.zeros((2, 3, 3)))), "2 modes and 4 points are named"),
    (lambda: shapes(body(motion=np.full((2, 4, 3), np.nan))), "motion is not finite"),
    (lambda: shapes(body(normals=[[0.0, 0.0, 1.0]] * 4)), "no point of the carrier"),
    (lambda: sketch({}), "no axis to draw"),
    (lambda: sketch({"x": (0.0, 0.0, 0.0)}), "has no length"),
    (lambda: sketch({"x": (np.nan, 0.0, 0.0)}), "not finite"),
    (lambda: chart(stable=[True]), "one flag for every pole"),
    (lambda: chart(pole_order=[4]), "different lengths"),
]


def test_a_diagonal_a_rounding_below_one_reads_one():
    assert clusters(CARS, R - 1e-9 * np.eye(3), TREE, [1, 1, 2], 0.9) == clusters()


@pytest.mark.parametrize(("draw", "sentence"), REFUSED)
def test_what_cannot_be_drawn_is_refused_in_words(draw, sentence):
    with pytest.raises(InputError, match=sentence):
        draw()


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.9999, "0.999"), (0.949, "0.95"), (-0.3, "−0.30"), (1.0, "1.000"), (-0.001, "0.00")],
)
def test_a_coefficient_is_never_rounded_up_to_one(value, text):
    assert coefficient(value) == text


def test_overview_escapes_and_shows_the_newest_run_of_a_study_first():
    def card(day, question):
        return RunCard(
            study="front",
            name=day,
            question=question,
            state="finished",
            started=day,
            seed=1,
            headlines={"level": "−2 dB"},
            folder=f"front/{day}",
            report=f"front/{day}/report.html",
            interactive=f"front/{day}/interactive.html" if question == "New?" else "",
            special="sampler <fresh>",
            call="deboom run",
            platform="u06 <2>",
            verdict="Soften TSM x: −3 dB & more.",
            thumbnail=f"front/{day}/figures/spl_curves.png",
            sheets={"sheet TSM": f"front/{day}/supplier/sheet%20TSM.html"},
        )

    page = render_overview([card("2026-01-01", "Old?"), card("2026-02-02", "New?")], ["a < b"])
    assert page.index("2026-02-02") < page.index("2026-01-01")
    shown = ("New?", "sampler &lt;fresh&gt;", "a &lt; b", "2 runs", 'href="front/2026-02-02/inter')
    assert all(words in page for words in shown)
    assert "Old?" not in page
    assert page.count("explore the front") == 1
    shown = ("u06 &lt;2&gt;", "Soften TSM x: −3 dB &amp; more.", 'href="front/2026-02-02/supplier/')
    assert all(words in page for words in shown)
    assert page.count('<img src="front/') == 2
