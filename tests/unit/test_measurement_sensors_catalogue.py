"""Sensor catalogue, tolerances and the types of a campaign: figures as stated, nonsense refused."""

import dataclasses

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.measurement.campaign import OperatingRun, ShakerRun, StaticCurve
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.sensor_catalogue import SENSOR_CATALOGUE, sensor_model
from deboom.measurement.time_run import TimeRun
from deboom.measurement.tolerances import Tolerances

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


def test_the_catalogue_holds_the_sensors_of_the_thesis():
    # thesis, tables 4 and 5 and section 4.4
    charge = sensor_model("B&K 4321")
    assert np.array(charge.sensitivity) * 9.80665 == pytest.approx(9.81e-12)
    assert charge.gain_tolerance == 0.02
    assert charge.cross_axis == (0.010, 0.012, 0.004)
    assert charge.frequency_range == (0.1, 12000.0)
    assert np.array(sensor_model("B&K 4326").sensitivity) * 9.80665 == pytest.approx(3e-12)
    assert sensor_model("B&K 4326").gain_tolerance == 0.15
    assert sensor_model("Kistler 9077C").sensitivity == (-4.2e-12, -4.2e-12, -2e-12)
    assert sensor_model("Kistler 9077C").noise_floor == 0.01
    assert sensor_model("PCB 356A").sensitivity == (10.2e-3,) * 3
    assert sensor_model("PCB 086D05").sensitivity == (0.23e-3,)
    for name, model in SENSOR_CATALOGUE.items():
        assert model.name == name
        assert model.source.startswith("Thesis")
        assert model.quantity_unit in ("m/s^2", "N")
    assert charge.cross_axis_deviation[0] == pytest.approx(0.01 / np.sqrt(3))


def test_an_unknown_model_is_refused_with_those_there_are():
    with pytest.raises(InputError, match=r"'B&K 4322' is not in the catalogue, use B&K 4321, "):
        sensor_model("B&K 4322")


@pytest.mark.parametrize(
    ("new", "says"),
    [
        ({"cross_axis": (0.01,)}, "3 sensitivities, but 1 cross-axis limits"),
        ({"gain_tolerance": -0.1}, "gain_tolerance is -0.1"),
        ({"noise_floor": float("nan")}, "noise_floor is nan"),
    ],
)
def test_models_that_make_no_sense_are_refused(new, says):
    with pytest.raises(InputError, match=says):
        dataclasses.replace(sensor_model("PCB 356A"), **new)


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


def test_a_run_owns_its_arrays():
    torque = np.array([0.0, 1.0, 2.0])
    made = run(engine_torque=torque)
    torque[0] = 99.0
    assert made.wheel_torque == pytest.approx([0.0, 3.4, 6.8])
    assert not made.engine_torque.flags.writeable
    assert made.frequency is made.acceleration.frequency


@pytest.mark.parametrize(
    ("new", "says"),
    [
        ({"engine_torque": np.zeros(2)}, r"engine_torque has shape \(2,\), expected \(3,\)"),
        (
            {"engine_torque": np.array([0.0, np.nan, 1.0])},
            "engine_torque holds a value",
        ),
        ({"static_force_names": ("EnM x",)}, r"static_force has shape \(3, 2\), expected \(3, 1\)"),
        ({"acceleration": spectrum("g")}, r"acceleration is in g, expected m/s\^2"),
        ({"cell_force": spectrum("kN")}, "cell force is in kN, expected N"),
        ({"cell_force": spectrum("N", lines=LINES + 1)}, "the frequency axes .* differ"),
    ],
)
def test_runs_that_do_not_fit_together_are_refused(new, says):
    with pytest.raises(InputError, match=f"run g5_wot220: {says}"):
        run(**new)


def response(source="EnM x", unit="N/N"):
    return Frf(LINES, np.ones((3, 1, 1), complex), ("C1 x",), (source,), unit)


def test_shaker_runs_name_where_they_push():
    assert ShakerRun("EnM", "", "x", 1, response()).response.outputs == ("C1 x",)
    assert ShakerRun("Du", "left", "x", 1, response("Du left x")).piece == "left"
    with pytest.raises(InputError, match="unknown axis 'r'"):
        ShakerRun("EnM", "", "r", 1, response())
    with pytest.raises(InputError, match=r"expected \['EnM y'\]"):
        ShakerRun("EnM", "", "y", 1, response())
    with pytest.raises(InputError, match="N/N"):
        ShakerRun("EnM", "", "x", 1, response(unit="N"))


def test_static_curves_must_go_one_way():
    curve = StaticCurve("TSM", "x", "M1", np.array([-1e-3, 1e-3]), np.array([-75.0, 75.0]), 0.03)
    assert not curve.force.flags.writeable
    with pytest.raises(InputError, match="static curve TSM x of M1: its deflection must increase"):
        StaticCurve("TSM", "x", "M1", np.array([1e-3, 1e-3]), np.array([-75.0, 75.0]), 0.03)
    with pytest.raises(InputError, match="force has shape"):
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
    with pytest.raises(InputError, match=r"engine_torque has shape \(3,\), expected \(4,\)"):
        time_run(engine_torque=np.zeros(3))
    with pytest.raises(InputError, match=r"cell_force has shape \(4, 1\), expected \(4, 2\)"):
        time_run(cell_force=np.zeros((4, 1)))
    with pytest.raises(InputError, match="tacho holds a value that is not finite"):
        time_run(tacho=np.full(4, np.inf))
