"""Characterised mounts in other runs."""

from dataclasses import replace

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.measurement.channels import LoadCase, Spectrum
from deboom.mounts.characterised_mount import (
    CharacterisedDirection,
    CharacterisedMount,
    DirectionQuality,
    MapPoints,
    MountIdentity,
)
from deboom.mounts.mount import Mount
from deboom.mounts.response_surface import DynamicStiffnessSurface, operating_points
from deboom.mounts.surface_forces import (
    Outside,
    main_axis,
    smooth_static_force,
    surface_forces,
    surface_over_main_force,
)

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


def test_a_surface_over_the_force_along_the_main_axis():
    surface = surface_over_main_force(mount(), "z")
    assert surface.preload_unit == "N"
    assert surface.n_lines_ == len(TORQUES) * (FREQUENCY.size - 2)
    found = surface.predict([1000.0, 1.6e-4, 40.0], extrapolate=True)
    assert found == pytest.approx(1e5 + 50e3 + 4e3 + 2e3j, rel=1e-3)


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
        surface_over_main_force(mount(z=masked), "z")
    other = replace(points("z", 0.1), run=["other"] * 405)
    with pytest.raises(InputError, match="the lines of z and x are not those of the same runs"):
        surface_over_main_force(mount(z=other), "z")
    none = MapPoints.none()
    with pytest.raises(InputError, match="it has no measured line"):
        main_axis(mount(x=none, z=none))


LINES = np.linspace(20.0, 60.0, 41)
TORQUE = np.linspace(20.0, 220.0, 41)
RATIO = 3.4
CHANNELS = ("TSM x", "TSM y", "TSM z", "Du left x", "Du right x")
NO_POINTS = MapPoints.none()


def stiffness(wheel_torque, amplitude, frequency):
    """Return a cubic that a surface represents exactly [N/m]."""
    torque, motion = wheel_torque / 700, amplitude / 1e-3
    real = 2e5 * (1 + 0.8 * torque**2 - 0.2 * motion + 0.1 * torque * motion)
    return real + 2e4j * (1 + frequency / 60)


def fitted(preload_unit="N m", highest=1.05):
    rng = np.random.default_rng(3)
    torque = rng.uniform(0, highest * RATIO * TORQUE[-1], 4000)
    amplitude = rng.uniform(0, 1.2e-3, 4000)
    frequency = rng.uniform(19, 61, 4000)
    values = stiffness(torque, amplitude, frequency)
    lines = operating_points(torque, amplitude, frequency)
    return DynamicStiffnessSurface(preload_unit=preload_unit).fit(lines, values)


SURFACE = fitted()
KNOWN = DirectionQuality(identified=True)
UNKNOWN = DirectionQuality(identified=False)


def characterised(name, pieces, directions):
    mount = Mount(name, "", pieces, ((0.0, 0.0, 0.0),) * len(pieces), ("x",))
    identity = MountIdentity("spring", name, "M0")
    return CharacterisedMount(
        identity,
        mount,
        tuple(CharacterisedDirection(a, NO_POINTS, q, s) for a, q, s in directions),
        {},
    )


TSM = characterised("TSM", ("",), [("x", KNOWN, SURFACE), ("y", UNKNOWN, SURFACE)])
DU = characterised("Du", ("left", "right"), [("x", KNOWN, SURFACE)])


def load_case():
    rng = np.random.default_rng(1)
    size = rng.uniform(1e-4, 1e-3, (41, 5))
    displacement = size * np.exp(1j * rng.uniform(-np.pi, np.pi, (41, 5)))
    force = rng.normal(size=(41, 5)) + 1j
    motion, pushed = (
        Spectrum(LINES, displacement, CHANNELS, "m"),
        Spectrum(LINES, force, CHANNELS, "N"),
    )
    return LoadCase("g5", "5th gear", 5, RATIO, 220.0, 1.5, motion, pushed, TORQUE)


def truth(case):
    s = case.displacement.values
    return stiffness((RATIO * TORQUE)[:, None], np.abs(s), LINES[:, None]) * s


def test_force_is_stiffness_at_the_point_of_operation_times_motion():
    case = load_case()
    result = surface_forces(case, [TSM, DU])
    modelled = result.load_case
    assert (modelled.name, modelled.force.unit) == ("g5", "N")
    assert modelled.displacement is case.displacement
    for channel in ("TSM x", "Du left x", "Du right x"):
        column = CHANNELS.index(channel)
        expected = truth(case)[:, column]
        error = np.abs(modelled.force.values[:, column] - expected)
        assert error.max() < 1e-6 * np.abs(expected).max()


def test_directions_that_cannot_be_believed_keep_the_measured_force_and_say_so():
    case = load_case()
    result = surface_forces(case, [TSM, DU])
    for channel in ("TSM y", "TSM z"):
        column = CHANNELS.index(channel)
        np.testing.assert_array_equal(
            result.load_case.force.values[:, column], case.force.values[:, column]
        )
    assert result.measured == {"TSM y": "not identified", "TSM z": "not characterised"}
    assert result.outside == {"TSM x": 0, "Du left x": 0, "Du right x": 0}


def test_a_direction_without_a_surface_says_so():
    bare = characterised("TSM", ("",), [(axis, UNKNOWN, None) for axis in "xyz"])
    reasons = surface_forces(load_case(), [bare, DU]).measured
    assert reasons == dict.fromkeys(CHANNELS[:3], "no surface")


def test_lines_outside_of_the_measured_region_are_refused_by_name():
    low = fitted(highest=0.5)
    tsm = characterised("TSM", ("",), [("x", KNOWN, low)])
    case = load_case()
    with pytest.raises(InputError) as refusal:
        surface_forces(case, [tsm, DU])
    sentence = str(refusal.value)
    outside = np.flatnonzero(1.02 * low.ranges["preload"][1] < RATIO * TORQUE)
    assert f"{outside.size} of 41 lines, from {LINES[outside[0]]:g} to 60 Hz" in sentence
    for word in ("load case g5", "'TSM x'", "TSM M0 of campaign spring", "keep the measured force"):
        assert word in sentence

    kept = surface_forces(case, [tsm, DU], Outside.KEEP_MEASURED)
    assert kept.measured["TSM x"] == f"{outside.size} of 41 lines are outside"
    np.testing.assert_array_equal(
        kept.load_case.force.values[outside, 0], case.force.values[outside, 0]
    )
    inside = np.setdiff1d(np.arange(41), outside)
    error = np.abs(kept.load_case.force.values[inside, 0] - truth(case)[inside, 0])
    assert error.max() < 1e-6 * np.abs(truth(case)[inside, 0]).max()


ELSEWHERE = characterised("EnM", ("",), [("x", KNOWN, SURFACE)])
STATIC = characterised("TSM", ("",), [("x", KNOWN, fitted("N"))])


@pytest.mark.parametrize(
    ("mounts", "words"),
    [
        (
            [TSM],
            r"no characterised mount has the channels \['Du left x', 'Du right x'\], the .* TSM",
        ),
        ([], "the mounts are none at all"),
        ([TSM, DU, ELSEWHERE], "EnM M0 of campaign spring has no channel in it"),
        ([TSM, DU, TSM], "two characterised mounts are TSM: keep one"),
        ([STATIC, DU], "its surface is over static force, which a load case does not carry"),
    ],
)
def test_mounts_that_do_not_fit_the_run_are_refused(mounts, words):
    with pytest.raises(InputError, match=words):
        surface_forces(load_case(), mounts)


def test_a_run_without_engine_torque_has_no_preload():
    with pytest.raises(InputError, match="g5: its engine torque was not recorded"):
        surface_forces(replace(load_case(), engine_torque=None), [TSM, DU])
