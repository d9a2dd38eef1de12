"""Figures of the supplier's page."""

import io

import numpy as np
import pytest
from PIL import Image

from deboom.errors import InputError
from deboom.report.figures import (
    StiffnessPanel,
    part_effects,
    stiffness_over_preload,
    tolerance_worth,
)

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


def test_effects_of_any_number_of_parts_are_drawn():
    parts = {f"only P{number}": [-1.0, 0.2] for number in range(5)}
    half = {name: [0.1, 0.1] for name in parts}
    colours = dict.fromkeys(parts, COLOUR)

    drawn = part_effects(
        ["one", "two"],
        parts,
        half,
        [-2.0, 0.1],
        colours,
        x_label="change [dB]",
        together_label="all",
    )

    assert has_colour(drawn, COLOUR)
    with pytest.raises(InputError, match="part_effects"):
        part_effects([], {}, {}, [], {}, x_label="", together_label="")


def test_shares_and_gains_are_drawn_and_values_that_are_not_finite_refused():
    assert has_colour(
        tolerance_worth(["A x", "A y"], [70.0, 0.0], [2.0, -0.1], [COLOUR] * 2), COLOUR
    )
    with pytest.raises(InputError, match="tolerance_worth"):
        tolerance_worth(["A x"], [np.nan], [1.0], [COLOUR])
