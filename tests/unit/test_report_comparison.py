"""Figures of compared fronts: what they refuse, and that they are pictures."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.report.figures import AttainedFront, attained_fronts, design_ranges, noise_bars
from deboom.report.overview import RunCard, render_overview

STAIRS = np.array([[0.0, 2.0], [1.0, 1.0], [2.0, 0.0]])
LABELS = {"mean_label": "mean [dB]", "sigma_label": "σ [dB]"}


def test_figures_are_the_same_bytes_again():
    def drawn():
        front = AttainedFront(STAIRS, best=STAIRS - 0.1, worst=STAIRS + 0.1)
        names = [f"option {n}" for n in range(9)]
        return [
            attained_fronts(dict.fromkeys(names, front), (2.2, 2.2), **LABELS),
            # a front wholly beyond the reference point has no edge, but its points are shown
            attained_fronts({"far": AttainedFront(STAIRS + 9.0)}, (2.2, 2.2), **LABELS),
            noise_bars(["a − b", "a − c"], [1.0, -3.0], [2.0, np.nan], difference_label="x [%]"),
            design_ranges(["k"], {"a": [[0.8, 1.0, 1.2]]}, [[0.8, 1.2]], value_label="k [1]"),
        ]

    first = drawn()
    assert all(png.startswith(b"\x89PNG") for png in first)
    assert first == drawn()


def test_what_cannot_be_drawn_is_refused():
    with pytest.raises(InputError, match="no front"):
        attained_fronts({}, (1.0, 1.0), **LABELS)
    with pytest.raises(InputError, match="not finite"):
        attained_fronts({"a": AttainedFront(STAIRS * np.nan)}, (1.0, 1.0), **LABELS)
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
