"""Figures of a modal analysis: what is drawn, and what is refused."""

import io
import struct

import numpy as np
import pytest
from PIL import Image
from plot_samples import mode_shapes, moving_mode_shapes, stabilisation_chart

from deboom.errors import InputError
from deboom.plot import BodyMotion

POSITIONS = np.array([[0.0, 0.4, 0.2], [0.0, -0.4, 0.2], [0.2, 0.0, -0.3], [2.0, 0.0, 1.0]])
NORMALS = np.array([[0.0, 0.0, 0.0]] * 3 + [[0.0, 0.0, -1.0]])


def body(n_mode=2, **changes):
    motion = np.random.default_rng(1).normal(size=(n_mode, 4, 3)) * (1 + 0.1j)
    titles = [f"{20 + 5 * k} Hz" for k in range(n_mode)]
    fields = {"labels": ("EnM", "GeM", "TSM", "roof"), "positions": POSITIONS, "normals": NORMALS}
    return BodyMotion(**{**fields, "titles": titles, "motion": motion, **changes})


def chart(**changes):
    frequency = np.linspace(20.0, 80.0, 61)
    arguments = {
        "frequency": frequency,
        "level": -frequency,
        "pole_frequency": [24.0, 24.1, 30.0],
        "pole_order": [4, 5, 5],
        "stable": [False, True, False],
        "modes": [24.1, 25.0],
    }
    return stabilisation_chart(**{**arguments, **changes}, level_label="level [dB]")


def size(png):
    assert png.startswith(b"\x89PNG")
    return struct.unpack(">II", png[16:24])


def test_a_row_of_views_per_mode():
    one, two = mode_shapes(body(1)), mode_shapes(body(2))
    assert size(one)[0] == size(two)[0] == 1440
    assert size(one)[1] < size(two)[1]


def test_motion_is_one_period_of_different_frames():
    with Image.open(io.BytesIO(moving_mode_shapes(body(1)))) as moving:
        assert (moving.format, moving.n_frames) == ("PNG", 12)
        first = np.array(moving.convert("L"))
        moving.seek(6)
        assert np.any(np.array(moving.convert("L")) != first)


def test_shapes_that_do_not_fit_their_points_are_refused():
    with pytest.raises(InputError, match="2 modes and 4 points are named"):
        mode_shapes(body(motion=np.zeros((2, 3, 3))))
    with pytest.raises(InputError, match="motion is not finite"):
        mode_shapes(body(motion=np.full((2, 4, 3), np.nan)))
    with pytest.raises(InputError, match="no point of the carrier"):
        mode_shapes(body(normals=np.tile([0.0, 0.0, 1.0], (4, 1))))


def test_the_chart_draws_poles_and_modes():
    drawn = chart()
    assert size(drawn)[0] == 1440
    assert drawn != chart(stable=[True, True, False])
    with pytest.raises(InputError, match="one flag for every pole"):
        chart(stable=[True])
    with pytest.raises(InputError, match="different lengths"):
        chart(pole_order=[4])
