"""Surfaces of one mount over wheel torque, its own static force, or that along its main axis."""

from dataclasses import replace

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.mounts.characterised_direction import (
    CharacterisedDirection,
    DirectionQuality,
    MapPoints,
)
from deboom.mounts.characterised_mount import CharacterisedMount, MountIdentity
from deboom.mounts.mount import Mount
from deboom.mounts.mount_state import MountState, main_axis, smooth_static_force, surface_over

FREQUENCY = np.arange(20.0, 60.5, 0.5)
TORQUES = (200.0, 400.0, 600.0, 700.0, 800.0)


def points(axis, force_per_torque):
    """Five runs whose stiffness follows the force along x, 2 N per N m."""
    frequency = np.tile(FREQUENCY, len(TORQUES))
    torque = np.repeat(TORQUES, FREQUENCY.size)
    along = 2.0 * torque
    amplitude = 1e-4 * (1 + 0.3 * np.sin(frequency) + torque / 800)
    return MapPoints(
        preload=force_per_torque * torque + (0 if axis == "x" else 30 * np.sin(torque)),
        wheel_torque=torque,
        amplitude=amplitude,
        frequency=frequency,
        dynamic_stiffness=1e5 + 50.0 * along + 100.0 * frequency + 50j * frequency,
        confidence=np.where(frequency < 21, 0.0, 1.0),
        run=[f"t{value:.0f}" for value in torque],
    )


def mount(**new):
    directions = {"x": points("x", 2.0), "z": points("z", 0.1), **new}
    return CharacterisedMount(
        MountIdentity("spring", "TSM", "M1"),
        Mount("TSM", "", ("",), ((0.2, 0.0, -0.3),), ("x",)),
        tuple(
            CharacterisedDirection(axis, own, DirectionQuality(identified=False))
            for axis, own in directions.items()
        ),
        {},
    )


def test_the_main_axis_is_that_of_the_widest_static_force():
    assert main_axis(mount()) == "x"


@pytest.mark.parametrize(
    ("state", "preload", "unit"),
    [
        (MountState.MAIN_FORCE, 1000.0, "N"),
        (MountState.OWN_FORCE, 50.0 + 30 * np.sin(500.0), "N"),
        (MountState.WHEEL_TORQUE, 500.0, "N m"),
    ],
)
def test_a_surface_over_each_preload(state, preload, unit):
    surface = surface_over(mount(), "z", state)
    assert surface.preload_unit == unit
    assert surface.n_lines == len(TORQUES) * (FREQUENCY.size - 2)
    if state is not MountState.OWN_FORCE:
        found = surface._evaluate(np.array([[preload, 1.6e-4, 40.0]]))
        assert found[0] == pytest.approx(1e5 + 50e3 + 4e3 + 2e3j, rel=1e-3)


def test_noise_of_the_static_force_is_smoothed_run_by_run():
    run = np.repeat(["a", "b"], FREQUENCY.size)
    frequency = np.tile(FREQUENCY, 2)
    true = np.where(run == "a", 0.05 * frequency**2, 500.0)
    noise = np.random.default_rng(1).normal(0, 5.0, true.size)
    assert smooth_static_force(true, frequency, run) == pytest.approx(true)
    error = smooth_static_force(true + noise, frequency, run) - true
    assert 1.0 < np.std(error) < 3.2
    coarse = slice(None, None, 5)
    kept = smooth_static_force((true + noise)[coarse], frequency[coarse], run[coarse])
    assert np.array_equal(kept, (true + noise)[coarse])
    uneven = np.sort(np.random.default_rng(2).uniform(20, 60, 50))
    names = np.full(50, "a")
    assert np.array_equal(smooth_static_force(noise[:50], uneven, names), noise[:50])


def test_what_cannot_be_fitted_is_refused_in_words():
    masked = replace(points("z", 0.1), confidence=np.zeros(len(points("z", 0.1))))
    with pytest.raises(InputError, match="direction z: none of its 405 lines is above the noise"):
        surface_over(mount(z=masked), "z", MountState.MAIN_FORCE)
    other = replace(points("z", 0.1), run=["other"] * 405)
    with pytest.raises(InputError, match="the lines of z and x are not those of the same runs"):
        surface_over(mount(z=other), "z", MountState.MAIN_FORCE)
    none = MapPoints(*[np.empty(0)] * 6, run=[])
    with pytest.raises(InputError, match="it has no measured line"):
        main_axis(mount(x=none, z=none))
