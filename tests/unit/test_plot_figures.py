"""Figures: PNG bytes that repeat, for any platform, with the words and scales they promise."""

import io
from dataclasses import replace
from itertools import combinations

import matplotlib
import numpy as np
import pytest
from matplotlib import pyplot
from matplotlib.figure import Figure
from PIL import Image
from scipy.cluster import hierarchy

from deboom import plot as figures
from deboom.errors import InputError
from deboom.plot import style
from deboom.plot.style import as_png, at_least, mount_of, signed, vehicle_colours
from figure_text import faults_of_text
from pinned_pages import described, hold

VARIABLES = [f"{mount} {axis}" for mount in ("EnM", "GeM", "TSM", "Du") for axis in "xyz"]


def front_arguments(n=40):
    mean = np.linspace(50.0, 54.0, n)
    sigma = 0.3 + 0.1 * (54.0 - mean) ** 2 / 16.0
    picks = {"best mean": (mean[0], sigma[0]), "best σ": (mean[-1], sigma[-1]), "knee": (51, 0.356)}
    errors = (np.full(n, 0.05), np.full(n, 0.01))
    labels = {"mean_label": "mean SPL [dB(A)]", "sigma_label": "σ [dB]"}
    return (mean, sigma, *errors, (53.0, 0.42), picks), labels


def levels(n_vehicle, n_frequency=161):
    frequency = np.linspace(20.0, 60.0, n_frequency)
    centres = 24.0 + np.arange(n_vehicle)[:, None] % 4
    before = 45.0 + 28.0 / (1.0 + ((frequency - centres) / 2.0) ** 2)
    return frequency, before, before - 3.0 * np.sin(frequency / 9.0), centres


def spl_arguments(n_vehicle, order=1.5):
    frequency, before, after, centres = levels(n_vehicle)
    names = [f"car {place}" for place in range(n_vehicle)]
    peaks = [row for row in centres]
    colours = style.vehicle_colours(names)
    return (frequency, order, before, after, names, peaks, peaks, colours), {}


def stiffness_arguments(variables=VARIABLES):
    n = len(variables)
    factor = np.linspace(0.8, 1.2, n)
    nominal = np.linspace(90.0, 650.0, n)
    nominal[-1] = np.nan
    free = [False] * (n - 1) + [True]
    interval = np.column_stack([factor - 0.02, factor + 0.03])
    interval[-1] = np.nan
    mounts = dict.fromkeys(style.mount_of(name) for name in variables)
    colours = style.mount_colours(list(mounts))
    bounds = (np.full(n, 0.8), np.full(n, 1.2))
    return (
        (variables, factor, *bounds, nominal, free, interval, colours),
        {"stiffness_label": "|K| at 36 Hz [N/mm]"},
    )


def map_arguments(n=60):
    x = np.linspace(0.0, 700.0, n)
    y = 0.01 + np.linspace(0.0, 1.0, n) ** 2
    outline = [0.0, 700.0], [0.01, 1.0], [[1.0, -1.0], [1.0, 1.0]]
    labels = {"x_label": "torque [N m]", "value_label": "|K| [N/mm]"}
    panels = [
        figures.PointMap(
            "TSM x",
            x,
            y,
            np.sqrt(x + 1),
            y_label="amplitude [mm]",
            amplitude=True,
            splits=[300.0],
            marks=[(100.0, 0.2)],
            outline=outline,
            **labels,
        ),
        figures.PointMap("TSM y", x, 60 - y, x, y_label="frequency [Hz]", **labels),
    ]
    return (panels,), {"columns": 2}


FIGURES = {
    "point_maps": (figures.point_maps, map_arguments),
    "pareto_front": (figures.pareto_front, front_arguments),
    "spl_curves": (figures.spl_curves, lambda: spl_arguments(3)),
    "stiffness_bars": (figures.stiffness_bars, stiffness_arguments),
}


@pytest.fixture
def drawn():
    """Draw a figure and return it, laid out."""
    opened = []

    def draw(function, arguments):
        picture = function(*arguments[0], **arguments[1])
        figure = picture if isinstance(picture, Figure) else style.figure_of(picture)
        figure.canvas.draw()
        opened.append(figure)
        return figure

    yield draw
    for figure in opened:
        style.close(figure)


def texts_of(figure):
    visible = [text for text in figure.findobj(matplotlib.text.Text) if text.get_visible()]
    return [text for text in visible if text.get_text().strip()]


@pytest.mark.parametrize("name", FIGURES)
def test_figure_repeats_whatever_is_set_globally_is_of_column_width_and_not_blank(
    name, monkeypatch
):
    monkeypatch.setattr(style, "DPI", 60)
    function, arguments = FIGURES[name]
    positional, named = arguments()
    png = as_png(function(*positional, **named))
    with matplotlib.rc_context({"font.size": 30.0, "axes.facecolor": "red"}):
        before = dict(matplotlib.rcParams)
        assert as_png(function(*positional, **named)) == png
        assert dict(matplotlib.rcParams) == before
    with Image.open(io.BytesIO(png)) as image:
        assert image.width == round(style.FULL_WIDTH * style.DPI)
        assert "Software" not in image.info
        assert len(image.convert("RGB").getcolors(1 << 16)) > 50


@pytest.mark.parametrize("name", FIGURES)
def test_every_axis_has_a_unit_text_is_legible_and_nothing_leaves_the_figure(name, drawn):
    function, arguments = FIGURES[name]
    figure = drawn(function, arguments())
    labels = [axes.get_xlabel() for axes in figure.axes] + [a.get_ylabel() for a in figure.axes]
    assert any(labels)
    assert all("[" in label for label in labels if label)
    assert min(text.get_fontsize() for text in texts_of(figure)) >= 7.0
    drawn_box, (width, height) = figure.get_tightbbox(), figure.get_size_inches()
    assert min(drawn_box.x0, drawn_box.y0) >= 0.0
    assert drawn_box.x1 <= width
    assert drawn_box.y1 <= height


def decades(n_points):
    """Draw moments over five decades, as a component's blocked forces."""
    lines = np.linspace(20.0, 140.0, 50)
    curve = {"a": 10.0 ** np.linspace(-3.3, 1.3, 50)}
    panels = [
        figures.CurvePanel(f"point {k} my", lines, curve, logarithmic=True) for k in range(n_points)
    ]
    return figures.curve_panels(panels, columns=3, y_label="moment [N m]")


def families(names):
    n = len(names)
    merges = hierarchy.linkage(np.arange(2.0 * n).reshape(n, 2), "average")
    merges[:, 2] = np.linspace(0.05, 0.5, n - 1)
    return figures.clustered_matrix(names, 0.5 + 0.5 * np.eye(n), merges, [1] * n, cut=0.9)


def inertances():
    values = 10.0 ** np.random.default_rng(1).uniform(-3.0, 2.0, (50, 6, 6))
    return figures.curve_matrix(
        ["x", "y", "z", "rx", "ry", "rz"],
        np.linspace(10.0, 150.0, 50),
        {"measured": values},
        units=["1/kg", "1/(kg m)", "1/(kg m²)"],
        what="|inertance|",
        logarithmic=True,
    )


CROWDED = {
    "decades": (lambda: decades(6), lambda: ((), {})),
    "families": (lambda: families([f"F45-battery-{k}" for k in range(5)]), lambda: ((), {})),
    "inertances": (inertances, lambda: ((), {})),
    "many cars": (figures.spl_curves, lambda: spl_arguments(7)),
}


@pytest.mark.parametrize("name", [*FIGURES, *CROWDED])
def test_no_text_is_cut_or_overlaps(name, drawn):
    function, arguments = {**FIGURES, **CROWDED}[name]
    assert faults_of_text(drawn(function, arguments())) == []


def test_text_that_is_cut_or_overlaps_is_found(drawn):
    figure = drawn(*FIGURES["stiffness_bars"][:1], stiffness_arguments())
    words = {"over the edge": (0.9, 0.5), "one": (0.4, 0.5), "two": (0.41, 0.5)}
    for text, place in words.items():
        figure.text(*place, f"{text} of several", fontsize=12.0)
    cut, pair = faults_of_text(figure)[0], faults_of_text(figure)[-1]
    assert cut.startswith("'over the edge of several' is cut: ")
    assert pair == "'one of several' and 'two of several' overlap"


def test_figures_show_what_they_showed(tmp_path):
    (*arrays, _), labels = front_arguments()
    once = ((*arrays, {"best mean": (50.0, 0.4), "knee": (50.0, 0.4)}), labels)
    shown = {name: (function, make()) for name, (function, make) in FIGURES.items()}
    shown |= {f"spl_curves {n}": (figures.spl_curves, spl_arguments(n, order=2.0)) for n in (1, 7)}
    shown["pareto_front, one pick of two names"] = (figures.pareto_front, once)
    for name, (function, (positional, named)) in shown.items():
        (tmp_path / f"{name}.png").write_bytes(described(function(*positional, **named)))
    hold(tmp_path, "figures")


def test_a_map_puts_small_amplitudes_above_and_marks_splits(drawn):
    amplitude, plain, *_ = drawn(figures.point_maps, map_arguments()).axes
    assert amplitude.get_yscale() == "log"
    assert amplitude.yaxis_inverted()
    assert {"0.1", "1"} <= {label.get_text() for label in amplitude.get_yticklabels()}
    assert not plain.yaxis_inverted()
    dashed = [line.get_xdata()[0] for line in amplitude.lines if line.get_linestyle() == "--"]
    assert dashed == [300.0]
    marked = [line for line in amplitude.lines if line.get_marker() == "o"]
    assert [(*line.get_xdata(), *line.get_ydata()) for line in marked] == [(100.0, 0.2)]
    colours = amplitude.collections[0].get_array()
    assert np.all(np.diff(colours) >= 0)  # large values lie above the others


def test_maps_of_the_same_points_share_the_axes_of_their_column(drawn):
    (panels,), _ = map_arguments()
    below = [replace(panel, title=f"phase, {panel.title}") for panel in panels]
    above, _, under, beside, *_ = drawn(
        figures.point_maps, (([*panels, *below],), {"columns": 2})
    ).axes
    assert under.yaxis_inverted()
    assert under.get_ylim() == above.get_ylim() != beside.get_ylim()
    assert [axes.get_xlabel() for axes in (above, under)] == ["", "torque [N m]"]
    under.set_xlim(100.0, 200.0)
    assert above.get_xlim() == (100.0, 200.0)


def test_a_map_refuses_what_it_could_not_show():
    (panels,), _ = map_arguments()
    panels[0] = replace(panels[0], value=np.full(60, np.nan))
    with pytest.raises(InputError, match="point_maps: value is not finite at index"):
        figures.point_maps(panels)
    with pytest.raises(InputError, match="no panel to draw"):
        figures.point_maps([])


def test_levels_have_speeds_above_and_a_grid_of_five_decibel(drawn):
    panels = drawn(figures.spl_curves, spl_arguments(2, order=2.0)).axes[:2]
    assert np.allclose(panels[0].child_axes[0].get_xlim(), [600.0, 1800.0])
    for axes in panels:
        assert np.all(np.asarray(axes.get_yticks()) % 10.0 == 0.0)
        assert np.all(np.asarray(axes.get_yticks(minor=True)) % 5.0 == 0.0)


def test_frequencies_of_peaks_do_not_cover_each_other(drawn):
    (frequency, order, before, after, names, *_, colours), _ = spl_arguments(2)
    crowd = [np.array([20.5, 23.5, 26.5, 30.0, 33.0, 57.0])] * 2
    arguments = ((frequency, order, before, after, names, crowd, crowd, colours), {})
    figure = drawn(figures.spl_curves, arguments)
    for axes in figure.axes[:2]:
        boxes = [text.get_window_extent() for text in axes.texts if text.get_text()]
        assert len(boxes) == 6
        assert not any(a.overlaps(b) for a, b in combinations(boxes, 2))


def changed(make, place, value):
    """Return the arguments of a figure with one of them exchanged."""
    positional, named = make()
    positional = list(positional)
    positional[place] = value(positional[place]) if callable(value) else value
    return positional, named


@pytest.mark.parametrize(
    ("name", "place", "value", "message"),
    [
        ("pareto_front", 0, lambda a: np.r_[a[:3], np.nan, a[4:]], r"mean is not finite at index"),
        ("pareto_front", 1, lambda a: a[:-1], "different lengths"),
        ("pareto_front", 4, (np.inf, 1.0), "baseline is not finite"),
        ("pareto_front", 5, {"knee": (1.0, np.nan)}, "knee is not finite"),
        ("pareto_front", slice(0, 4), [[], [], [], []], "mean is empty"),
        ("spl_curves", 0, lambda a: a[:-1], r"today has shape \(3, 161\), expected"),
        ("spl_curves", 5, lambda a: a[:1], "different lengths"),
    ],
)
def test_a_figure_refuses_what_it_would_drop(name, place, value, message):
    function, make = FIGURES[name]
    positional, named = changed(make, place, value)
    with pytest.raises(InputError, match=message):
        function(*positional, **named)


# Machado, Oliveira, Fernandes (2009), severity 1.0, on linear RGB
def test_a_vehicle_keeps_its_colour_whatever_follows_it_and_eighteen_differ():
    names = [f"V{place}" for place in range(18)]
    colours = vehicle_colours(names)
    assert vehicle_colours(names[:5]) == dict(list(colours.items())[:5])
    assert len(set(colours.values())) == 18
    with pytest.raises(InputError, match="duplicated vehicle \\['A'\\]"):
        vehicle_colours(["A", "B", "A"])


def test_colours_of_many_vehicles_repeat_darker_and_then_lighter():
    n = len(style.VEHICLE_PALETTE)
    colours = list(vehicle_colours([f"V{place}" for place in range(3 * n)]).values())

    def channels(colour):
        return np.array([int(colour[place : place + 2], 16) for place in (1, 3, 5)])

    for place in range(n):
        plain, darker, lighter = (channels(colours[place + k * n]) for k in range(3))
        np.testing.assert_allclose(darker, 0.6 * plain, atol=0.5)
        np.testing.assert_allclose(lighter, plain + 0.35 * (255 - plain), atol=0.5)


def test_bars_of_stiffness_reach_over_all_bounds(drawn):
    (variables, factor, _, _, *rest), keywords = stiffness_arguments()
    lower, upper = np.full(len(variables), 0.9), np.full(len(variables), 1.1)
    lower[1], upper[2] = 0.6, 1.6
    figure = drawn(figures.stiffness_bars, ((variables, factor, lower, upper, *rest), keywords))
    assert figure.axes[0].get_xlim() == pytest.approx((0.57, 1.63))


def test_mounts_of_variables_and_signs_of_changes():
    wanted = {"TSM x": "TSM", "front left z": "front left", "strut": "strut"}
    assert {name: mount_of(name) for name in wanted} == wanted
    changes = ((-3.14, 1, "−3.1"), (0.2, 1, "+0.2"), (-0.04, 1, "0.0"), (12.4, 0, "+12"))
    for value, digits, text in changes:
        assert signed(value, digits) == text


def test_a_number_that_or_more_follows_is_rounded_down():
    values = ((0.986, "0.98"), (0.98, "0.98"), (0.29, "0.29"), (-0.001, "−0.01"), (1.0, "1.00"))
    for value, text in values:
        assert at_least(value, 2) == text


def test_a_picture_is_drawn_on_the_callers_axes():
    figure, (left, right) = pyplot.subplots(1, 2)
    positional, named = front_arguments()
    assert figures.pareto_front(*positional, **named, ax=left) is left
    assert figures.pareto_front(*positional, **named, ax=right) is right
    assert right.get_legend() is not None
    assert len(figure.axes) == 2
    own_axes = figures.pareto_front(*positional, **named)
    assert style.figure_of(own_axes) is not figure
    for drawn in (figure, style.figure_of(own_axes)):
        style.close(drawn)


def test_a_tall_map_ends_and_names_every_few_rows(drawn):
    lines = np.linspace(20.0, 80.0, 31)
    rows = [f"car {place}" for place in range(1200)]
    values = np.outer(np.arange(1200.0), np.ones(31))
    maps = [figures.LineMap("today", values, "SPL [dB(A)]", (0.0, 1200.0))]
    figure = drawn(figures.line_maps, ((lines, 1.5, rows, maps), {}))
    assert figure.get_figheight() < 15.0
    named = [text.get_text() for text in figure.axes[0].get_yticklabels()]
    assert named == rows[::13]
    assert figure.axes[0].get_ylim() == (1199.5, -0.5)  # all are drawn


def test_a_large_matrix_writes_no_coefficients(drawn):
    n = 30
    r = np.full((n, n), 0.9) + 0.1 * np.eye(n)
    merges = [[0, 1, 0.1, 2], *([n + k, k + 2, 0.1, k + 3] for k in range(n - 2))]
    names = [f"car {place}" for place in range(n)]
    figure = drawn(figures.clustered_matrix, ((names, r, merges, [1] * n, 0.8), {}))
    assert "0.90" not in [text.get_text() for text in texts_of(figure)]


def test_the_palette_of_many_colours_is_close_to_them_and_fast():
    """Ten thousand colours of a cloud took minutes, and their mean error stays near one step."""
    shades = np.random.default_rng(1).integers(0, 256, (300, 300, 3))
    shades[..., 2] = 255 - shades[..., 0]
    picture = Image.fromarray(shades.astype(np.uint8))
    flat = style._with_palette(picture)
    assert flat.mode == "P"
    error = np.asarray(flat.convert("RGB"), dtype=float) - shades
    assert np.sqrt(np.mean(error**2)) < 6.0
    two = Image.fromarray(np.repeat(np.uint8([[[10, 20, 30], [200, 100, 0]]]), 5, axis=0))
    np.testing.assert_array_equal(np.asarray(style._with_palette(two).convert("RGB")), two)


@pytest.mark.parametrize("names", [("best-mean",), ("best-mean", "none-louder", "sigma-kept")])
def test_no_name_of_a_legend_leaves_its_figure(names):
    """Designs at one place share a name, which may be too long for two columns."""
    x = np.linspace(0.0, 1.0, 30)
    axes = figures.fronts(
        {"none better in both": (x, 1.0 - x)},
        {"20000 designs of the search": (x, 1.0 - x)},
        {"today": (0.5, 0.5)} | dict.fromkeys(names, (0.1, 0.9)) | {"best-sigma": (0.9, 0.1)},
        mean_label="mean change [dB]",
        sigma_label="change in U06-5 [dB]",
        width=3.6,
    )
    figure = axes.get_figure()
    figure.draw_without_rendering()
    (legend,) = figure.legends
    box = legend.get_window_extent()
    assert box.x0 >= 0.0
    assert box.x1 <= figure.bbox.width
