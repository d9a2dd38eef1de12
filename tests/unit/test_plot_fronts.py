"""Pictures of fronts, boxes and parts: what they draw, and what they refuse."""

import io

import numpy as np
import plot_samples as figures
import pytest
from PIL import Image
from plot_samples import (
    attained_fronts,
    box_intervals,
    box_trade_off,
    design_ranges,
    levels_in_box,
    noise_bars,
    stiffness_over_preload,
)

from deboom.errors import InputError
from deboom.plot import AttainedFront, Intervals, StiffnessPanel
from deboom.report.overview import RunCard, render_overview

FRONT = (np.array([1.0, 2.0, 3.0]), np.array([3.0, 2.0, 1.0]))
LABELS = {"mean_label": "mean [dB(A)]", "sigma_label": "σ [dB]"}


def draw_fronts(curves=None, points=None):
    return figures.fronts(
        {"front": FRONT} if curves is None else curves,
        {"all": FRONT} if points is None else points,
        {"today's": (2.5, 2.5)},
        **LABELS,
    )


def draw_parts(chosen, labels=(("old", "new"), ("old", "soft", "stiff"))):
    return figures.part_choices(("EnM", "TSM"), labels, chosen, point_label="design")


VARIABLES, LINES = ("EnM x", "TSM x"), np.array([20.0, 30.0, 40.0])
DESIGNS = np.array([[0.8, 1.2], [1.0, 1.0], [1.2, 0.9]])


def draw_lines(designs=DESIGNS, value=(51.0, 52.0, 53.0)):
    bounds, marks = [[0.8] * 2, [1.2] * 2], {"today's": [1.0, 1.0]}
    return figures.parallel_coordinates(
        VARIABLES, designs, bounds, value, marks, value_label="mean level [dB(A)]"
    )


def draw_maps(after=((60.0, 50.0, 40.0), (61.0, 51.0, 40.0))):
    return figures.level_maps(LINES, 1.5, VARIABLES, np.full((2, 3), 55.0), after)


def draw_sum(after=(1j, 0.5)):
    return figures.vector_sum(VARIABLES, {"today": [1.0, 0.5j], "new": after}, ("red", "blue"))


def test_pictures_are_png_and_repeat_bit_for_bit():
    chosen = np.array([[0, 2], [1, 1], [1, 0]])
    new = (draw_lines, draw_maps, draw_sum)
    for draw in (draw_fronts, lambda: draw_parts(chosen), *new):
        assert draw() == draw()
        assert draw()[:8] == b"\x89PNG\r\n\x1a\n"
    assert draw_parts(chosen) != draw_parts(chosen[::-1])
    assert draw_maps() != draw_maps(np.full((2, 3), 50.0))
    assert draw_sum() != draw_sum((-1j, 0.5))


@pytest.mark.parametrize(
    ("draw", "sentence"),
    [
        (lambda: draw_fronts(curves={}), "no front to draw"),
        (lambda: draw_fronts(points={"all": (FRONT[0], [np.nan] * 3)}), "finite"),
        (lambda: draw_parts(np.array([[0, 3]])), "has no label"),
        (lambda: draw_parts(np.array([[0], [1]])), "one column"),
        (lambda: draw_lines(DESIGNS[:, :1]), "one column per variable"),
        (lambda: draw_lines(value=(51.0, 52.0)), "one column per variable"),
        (lambda: draw_lines(value=(51.0, np.nan, 53.0)), "finite"),
        (lambda: draw_maps(np.zeros((3, 3))), "2 rows and 3 lines"),
        (lambda: draw_sum([np.inf, 0.0]), "finite"),
        (lambda: draw_sum([1.0]), "different lengths"),
    ],
)
def test_what_cannot_be_drawn_is_refused(draw, sentence):
    with pytest.raises(InputError, match=sentence):
        draw()


STAIRS = np.array([[0.0, 2.0], [1.0, 1.0], [2.0, 0.0]])
LABELS_2 = {"mean_label": "mean [dB]", "sigma_label": "σ [dB]"}


def test_figures_are_the_same_bytes_again():
    def drawn():
        front = AttainedFront(STAIRS, best=STAIRS - 0.1, worst=STAIRS + 0.1)
        names = [f"option {n}" for n in range(9)]
        return [
            attained_fronts(dict.fromkeys(names, front), (2.2, 2.2), **LABELS_2),
            # a front wholly beyond the reference point has no edge, but its points are shown
            attained_fronts({"far": AttainedFront(STAIRS + 9.0)}, (2.2, 2.2), **LABELS_2),
            noise_bars(["a − b", "a − c"], [1.0, -3.0], [2.0, np.nan], difference_label="x [%]"),
            design_ranges(["k"], {"a": [[0.8, 1.0, 1.2]]}, [[0.8, 1.2]], value_label="k [1]"),
        ]

    first = drawn()
    assert all(png.startswith(b"\x89PNG") for png in first)
    assert first == drawn()


def test_what_cannot_be_drawn_is_refused_2():
    with pytest.raises(InputError, match="no front"):
        attained_fronts({}, (1.0, 1.0), **LABELS_2)
    with pytest.raises(InputError, match="not finite"):
        attained_fronts({"a": AttainedFront(STAIRS * np.nan)}, (1.0, 1.0), **LABELS_2)
    with pytest.raises(InputError, match="one noise per difference"):
        noise_bars(["a − b"], [1.0], [1.0, 2.0], difference_label="x [%]")
    with pytest.raises(InputError, match="no front"):
        design_ranges(["k"], {}, [[0.8, 1.2]], value_label="k [1]")


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
        )

    page = render_overview([card("2026-01-01", "Old?"), card("2026-02-02", "New?")], ["a < b"])
    assert page.index("2026-02-02") < page.index("2026-01-01")
    assert "New?" in page
    assert "Old?" not in page
    assert "sampler &lt;fresh&gt;" in page
    assert "a &lt; b" in page
    assert "2 runs" in page
    assert page.count("explore the front") == 1
    assert 'href="front/2026-02-02/interactive.html"' in page


NAMES = ("EnM x", "EnM y", "GeM x")
COLOURS = {"EnM": "#332288", "GeM": "#CC6677"}
VEHICLES = {"A": "#0072B2", "B": "#D55E00"}
LOW, HIGH = np.full(3, 0.8), np.full(3, 1.2)


def intervals(others):
    return box_intervals(
        NAMES,
        Intervals("box", LOW, HIGH),
        others,
        Intervals("bounds", LOW - 0.2, HIGH + 0.2),
        np.ones(3),
        np.array([300.0, np.nan, 200.0]),
        [False, True, False],
        COLOURS,
    )


def test_intervals_are_drawn_with_up_to_two_others():
    other = Intervals("±10 %", LOW + 0.1, HIGH - 0.1)
    assert intervals([]) != intervals([other])
    assert intervals([other]).startswith(b"\x89PNG")
    with pytest.raises(InputError, match="at most two"):
        intervals([other] * 3)
    with pytest.raises(InputError, match="not finite"):
        intervals([Intervals("other", LOW * np.nan, HIGH)])


def trade_off(unreachable, missed):
    return box_trade_off(
        [54.0, 53.0],
        [20.0, 10.0],
        [95.0, 50.0],
        missed,
        VEHICLES,
        stated=(54.0, 20.0),
        unreachable=unreachable,
        limit_label="limit [dB(A)]",
        width_label="half width [%]",
        plain_label="share [%]",
    )


def test_a_curve_is_drawn_with_what_cannot_be_reached():
    missed = {"A": [1.0, 2.0], "B": [3.0, 4.0]}
    assert trade_off(None, missed) != trade_off(52.0, missed)
    with pytest.raises(InputError, match="different lengths"):
        trade_off(None, {"A": [1.0], "B": [2.0]})


def test_levels_are_drawn_about_their_limit():
    levels = np.random.default_rng(1).normal(53.0, 1.0, (500, 2))
    fits = (np.full(2, 54.0), np.full(2, 55.0), np.array([16.0, 15.0]), VEHICLES)
    drawn = levels_in_box(tuple(VEHICLES), levels, *fits, level_label="level [dB(A)]")
    assert drawn.startswith(b"\x89PNG")
    with pytest.raises(InputError, match="not finite"):
        levels_in_box(tuple(VEHICLES), levels * np.nan, *fits, level_label="level [dB(A)]")


COLOUR = "#332288"


def has_colour(data, colour):
    wanted = tuple(int(colour[place : place + 2], 16) for place in (1, 3, 5))
    with Image.open(io.BytesIO(data)) as picture:
        pixels = np.asarray(picture.convert("RGB")).reshape(-1, 3)
    return bool(np.all(np.abs(pixels - np.array(wanted)) <= 4, axis=1).any())


def panel(**changes):
    x = np.linspace(-5.0, 5.0, 11)
    k = 100.0 + x**2
    gap = np.where(x > 3.0, np.nan, k)
    return StiffnessPanel(
        "A x", "static force [N]", (x, k), **{"today": (x, gap), "wanted": (x, 0.8 * gap)} | changes
    )


def test_the_wanted_curve_has_the_colour_of_its_mount_and_is_left_out_where_nothing_is_asked():
    asked = stiffness_over_preload([panel(), panel(tolerance=0.15)], COLOUR)
    alone = panel(today=None, wanted=None, note="no requirement")

    assert has_colour(asked, COLOUR)
    # the legend alone has it
    assert len(stiffness_over_preload([alone], COLOUR)) < len(asked)


@pytest.mark.parametrize("panels", [[], [panel(today=None)]])
def test_points_that_cannot_be_drawn_are_refused(panels):
    panels = [StiffnessPanel(p.title, p.x_label, ([0.0], [np.nan])) for p in panels]

    with pytest.raises(InputError, match="stiffness_over_preload"):
        stiffness_over_preload(panels, COLOUR)
