"""Campaigns, sensors, load cases, rising torque."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.measurement.campaign import (
    OperatingRun,
    StaticCurve,
    TimeRun,
)
from deboom.measurement.channels import LoadCase, Spectrum
from deboom.measurement.sensors import Tolerances

LINES = np.array([20.0, 21.0, 22.0])


def spectrum(unit, channels=("A1 x",), lines=LINES):
    return Spectrum(lines, np.ones((lines.size, len(channels)), complex), channels, unit)


def run(**new):
    fields = {
        "name": "g5_wot220",
        "mount_set": "M1",
        "gear": 5,
        "total_ratio": 3.4,
        "full_load": True,
        "torque_limit": 220.0,
        "rising": True,
        "order": 1.5,
        "engine_torque": np.array([0.0, 1.0, 2.0]),
        "acceleration": spectrum("m/s^2"),
        "cell_force": spectrum("N", ("C1 x",)),
        "static_force": np.zeros((3, 2)),
        "static_force_names": ("EnM x", "EnM y"),
    }
    return OperatingRun(**fields | new)


def test_default_tolerances_are_those_of_a_good_bench():
    stated = Tolerances()
    assert stated.sensor_position == 0.002
    assert np.rad2deg([stated.sensor_angle, stated.shaker_angle]) == pytest.approx(0.5)
    assert (stated.sensor_gain, stated.sensor_cross_axis, stated.shaker_gain) == (0.01, 0.01, 0.005)
    assert (stated.torque, stated.static_force) == (1.0, 5.0)


@pytest.mark.parametrize("value", [-0.1, float("inf"), float("nan")])
def test_tolerances_that_are_none_are_refused(value):
    with pytest.raises(InputError, match="tolerance shaker_gain is"):
        Tolerances(shaker_gain=value)


@pytest.mark.parametrize("torque", [np.zeros(2), np.array([0.0, np.nan, 1.0])])
def test_a_torque_that_does_not_fit_a_run_is_refused(torque):
    with pytest.raises(InputError, match="g5_wot220"):
        run(engine_torque=torque)


def test_static_curves_must_go_one_way():
    curve = StaticCurve("TSM", "x", "M1", np.array([-1e-3, 1e-3]), np.array([-75.0, 75.0]), 0.03)
    assert not curve.force.flags.writeable
    with pytest.raises(InputError, match="static curve TSM x of M1: its deflection must increase"):
        StaticCurve("TSM", "x", "M1", np.array([1e-3, 1e-3]), np.array([-75.0, 75.0]), 0.03)
    with pytest.raises(InputError, match="static curve TSM x of M1: force: shape"):
        StaticCurve("TSM", "x", "M1", np.array([0.0, 1e-3]), np.zeros(3), 0.03)


def time_run(**new):
    fields = {
        "name": "t",
        "mount_set": "M1",
        "gear": 5,
        "total_ratio": 3.4,
        "full_load": True,
        "torque_limit": 220.0,
        "rising": True,
        "order": 1.5,
        "sample_rate": 100.0,
        "tacho": np.zeros(4),
        "pulses_per_revolution": 2,
        "engine_torque": np.zeros(4),
        "acceleration": np.zeros((4, 1)),
        "acceleration_channels": ("A1 x",),
        "cell_force": np.zeros((4, 2)),
        "cell_force_channels": ("C1 x", "C1 y"),
        "static_force": np.zeros((4, 0)),
        "static_force_names": (),
    }
    return TimeRun(**fields | new)


def test_time_runs_hold_one_sample_per_channel_and_instant():
    assert not time_run().cell_force.flags.writeable
    with pytest.raises(InputError, match=r"t: engine_torque: shape \(4\)"):
        time_run(engine_torque=np.zeros(3))
    with pytest.raises(InputError, match="t: cell_force_channels: 1 are needed, not 2"):
        time_run(cell_force=np.zeros((4, 1)))
    with pytest.raises(InputError, match="t: tacho: a number is not finite"):
        time_run(tacho=np.full(4, np.inf))


FREQUENCY = np.array([20.0, 20.5, 21.0])


def load_case(**changes):
    values = np.ones((3, 1), dtype=complex)
    content = {
        "name": "g5",
        "title": "5th gear",
        "gear": 5,
        "total_ratio": 3.4,
        "torque_limit": 220.0,
        "order": 1.5,
        "displacement": Spectrum(FREQUENCY, values, ("TSM x",), "m"),
        "force": Spectrum(FREQUENCY, values, ("TSM x",), "N"),
    }
    return LoadCase(**(content | changes))


def test_wheel_torque_is_engine_torque_times_total_ratio():
    torque = np.array([10.0, 20.0, 40.0])
    case = load_case(engine_torque=torque)
    torque[0] = -1.0  # the caller's array stays the caller's
    np.testing.assert_allclose(case.wheel_torque, [34.0, 68.0, 136.0])
    with pytest.raises(ValueError, match="read-only"):
        case.engine_torque[0] = 0.0


def test_a_run_without_torque_is_fine_until_the_torque_is_needed():
    case = load_case()
    assert case.engine_torque is None
    with pytest.raises(InputError, match="g5: its engine torque was not recorded: add its table"):
        _ = case.wheel_torque


@pytest.mark.parametrize(
    ("torque", "words"),
    [
        (np.ones(2), r"shape \(2,\), expected one value for each of 3 lines"),
        (np.ones((3, 1)), "g5: engine_torque: shape"),
        (np.array([1.0, np.nan, 1.0]), "g5: engine_torque: a number is not finite"),
    ],
)
def test_a_torque_that_does_not_fit_is_refused(torque, words):
    with pytest.raises(InputError, match=words):
        load_case(engine_torque=torque)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"force": Spectrum(FREQUENCY, np.ones((3, 1)), ("TSM z",), "N")},
            "displacement channels .* and force channels .* differ",
        ),
        (
            {"force": Spectrum(FREQUENCY + 1, np.ones((3, 1)), ("TSM x",), "N")},
            "frequency axes of displacement and force differ",
        ),
        (
            {"force": Spectrum(FREQUENCY, np.ones((3, 1)), ("TSM x",), "kN")},
            "force is in kN, expected N",
        ),
    ],
)
def test_spectra_that_do_not_belong_together_are_refused(changes, words):
    with pytest.raises(InputError, match=words):
        load_case(**changes)
