"""How far a surface speaks about a run, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.files.platform import read_platform
from deboom.mounts.piecewise_cubic import TrainingRegion
from deboom.mounts.response_surface import DynamicStiffnessSurface
from deboom.mounts.surface_forces import identified_surfaces
from deboom.vehicles.design_factor import StaticPosition, backed_range
from samples import resolved_truth as truth

RNG = np.random.default_rng(1)
TORQUE, AMPLITUDE, FREQUENCY = (
    RNG.uniform(low, high, 4000) for low, high in ((50.0, 700.0), (1e-5, 1e-3), (20.0, 60.0))
)
STIFFNESS = 2e5 * (1 + TORQUE / 700 - 100 * AMPLITUDE) * (1 + 0.1j)
POINTS = np.column_stack([TORQUE, AMPLITUDE, FREQUENCY])
SURFACE = DynamicStiffnessSurface(preload_unit="N m").fit(POINTS, STIFFNESS)
LINES = np.array([300.0, 400.0]), np.array([2e-4, 3e-4]), np.array([30.0, 50.0])


def test_range_goes_to_the_end_of_what_was_measured():
    low, high = backed_range(SURFACE, *LINES, "amplitude", "run")
    assert low == pytest.approx(SURFACE.ranges["amplitude"][0], rel=1e-9)
    assert high == pytest.approx(SURFACE.ranges["amplitude"][1], rel=1e-9)
    low, high = backed_range(SURFACE, *LINES, "preload", "run")
    assert low == pytest.approx(SURFACE.ranges["preload"][0], rel=1e-9)
    assert high == pytest.approx(SURFACE.ranges["preload"][1], rel=1e-9)


def test_range_ends_at_a_hole():
    here = AMPLITUDE < 4e-4
    holed = DynamicStiffnessSurface(preload_unit="N m").fit(POINTS[here], STIFFNESS[here])
    region = TrainingRegion.around(np.vstack([holed.region_.points, POINTS[TORQUE > 600.0]]))
    for model in (holed, holed.real_, holed.imag_):
        model.region_ = region
    _, high = backed_range(holed, *LINES, "amplitude", "run")
    assert np.all((high > 3e-4) & (high < 6e-4))


def test_refuses_lines_that_are_not_backed_and_torque_that_does_not_drive():
    args = LINES[0], np.array([2e-4, 5e-3]), LINES[2]
    with pytest.raises(InputError, match=r"TSM x: 1 of 2 lines, from 50 to 50 Hz, lie outside"):
        backed_range(SURFACE, *args, "amplitude", "run, TSM x")
    slow = DynamicStiffnessSurface().fit(POINTS - np.array([100.0, 0, 0]), STIFFNESS)
    with pytest.raises(InputError, match="a preload of 0 or less: take a run whose wheel torque"):
        backed_range(slow, *LINES, "preload", "run")


def test_surfaces_of_the_library_are_those_that_were_identified():
    parts = truth.platform_parts(read_platform(truth.PLATFORM))
    names = {"EnM x", "EnM z", "GeM x", "GeM z", "TSM x", "TSM z", "Du x"}
    assert set(identified_surfaces(parts)) == names


def test_a_deflection_that_turns_back_does_not_rise():
    deflections = np.array([[0.0, 0.0, 0.0], [1.0, -1.0, 1.0], [2.0, -2.0, 0.5]])
    position = StaticPosition(None, np.ones(1), np.ones((1, 1)), np.arange(3.0), deflections)
    assert position.rises.tolist() == [True, True, False]
