"""Pictures of fronts, boxes and parts: what they draw, and what they refuse."""

import numpy as np
import plot_samples as figures
import pytest
from plot_samples import box_intervals

from deboom.errors import InputError
from deboom.plot import Intervals, LineMap
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


VARIABLES, LINES = ("EnM x", "TSM x"), np.array([20.0, 30.0, 40.0])
DESIGNS = np.array([[0.8, 1.2], [1.0, 1.0], [1.2, 0.9]])


def draw_lines(designs=DESIGNS, value=(51.0, 52.0, 53.0)):
    bounds, marks = [[0.8] * 2, [1.2] * 2], {"today's": [1.0, 1.0]}
    return figures.parallel_coordinates(
        VARIABLES, designs, bounds, value, marks, value_label="mean level [dB(A)]"
    )


def draw_maps(after=((60.0, 50.0, 40.0), (61.0, 51.0, 40.0)), **options):
    maps = [
        LineMap("today", np.full((2, 3), 55.0), "SPL [dB(A)]", (20.0, 60.0), "inferno"),
        LineMap("after", after, "SPL [dB(A)]", (20.0, 60.0), "inferno"),
        LineMap("difference", np.ones((2, 3)), "change [dB]", (-1.0, 1.0), peaks=[30.0]),
    ]
    return figures.line_maps(LINES, 1.5, VARIABLES, maps, **options)


def draw_sum(after=(1j, 0.5)):
    return figures.vector_sum(VARIABLES, {"today": [1.0, 0.5j], "new": after}, ("red", "blue"))


def test_pictures_are_png_and_repeat_bit_for_bit():
    for draw in (draw_fronts, draw_lines, draw_maps, draw_sum):
        assert draw() == draw()
        assert draw()[:8] == b"\x89PNG\r\n\x1a\n"
    assert len({draw_maps(), draw_maps(columns=1), draw_maps(np.full((2, 3), 50.0))}) == 3
    assert draw_sum() != draw_sum((-1j, 0.5))


@pytest.mark.parametrize(
    ("draw", "sentence"),
    [
        (lambda: draw_fronts(curves={}), "no front to draw"),
        (lambda: draw_fronts(points={"all": (FRONT[0], [np.nan] * 3)}), "finite"),
        (lambda: draw_lines(DESIGNS[:, :1]), "one column per variable"),
        (lambda: draw_lines(value=(51.0, 52.0)), "one column per variable"),
        (lambda: draw_lines(value=(51.0, np.nan, 53.0)), "finite"),
        (lambda: draw_maps(np.zeros((3, 3))), r"shape \(3, 3\), expected \(2, 3\)"),
        (lambda: draw_sum([np.inf, 0.0]), "finite"),
        (lambda: draw_sum([1.0]), "different lengths"),
    ],
)
def test_what_cannot_be_drawn_is_refused(draw, sentence):
    with pytest.raises(InputError, match=sentence):
        draw()


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
LOW, HIGH = np.full(3, 0.8), np.full(3, 1.2)


def intervals(other):
    return box_intervals(
        NAMES,
        Intervals("box", LOW, HIGH),
        other,
        Intervals("bounds", LOW - 0.2, HIGH + 0.2),
        np.ones(3),
        np.array([300.0, np.nan, 200.0]),
        [False, True, False],
        COLOURS,
    )


def test_intervals_are_drawn_against_another():
    other = Intervals("±10 %", LOW + 0.1, HIGH - 0.1)
    assert intervals(Intervals("±10 %", LOW, HIGH)) != intervals(other)
    assert intervals(other).startswith(b"\x89PNG")
    with pytest.raises(InputError, match="not finite"):
        intervals(Intervals("other", LOW * np.nan, HIGH))
