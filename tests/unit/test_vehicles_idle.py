"""Idle: levels of orders by hand, functions between their lines, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.files.platform import LoadCaseEntry, PlatformFile, platform_folder
from deboom.files.schema import load_toml
from deboom.measurement.channels import Frf, LoadCase, Spectrum
from deboom.mounts.mount import Mount
from deboom.physics.sound_level import a_weighting
from deboom.vehicles.booming_model import Motion
from deboom.vehicles.fleet import Fleet, Vehicle
from deboom.vehicles.idle import IdleRun, _vehicle_at, idle_model
from deboom.vehicles.receivers import Receiver

SPEED = 800.0
ORDERS = np.arange(1, 13) / 2.0
LINES = ORDERS * SPEED / 60.0
FREQUENCY = np.arange(5.0, 85.1, 0.5)
PATHS = ("M z", "N z")
MOUNTS = [Mount(name, "", ("",), ((0.2, 0.1, 0.0),), ("z",)) for name in "MN"]
SEAT = Receiver("seat rail z", "acceleration")


def idle_run(lines=LINES, speed=SPEED):
    generator = np.random.default_rng(3)
    names = tuple(f"{mount} {axis}" for mount in "MN" for axis in "xyz")
    parts = generator.normal(size=(2, len(lines), 6))
    values = parts[0] + 1j * parts[1]
    motion = Spectrum(lines, 1e-5 * values, names, "m")
    force = Spectrum(lines, (2.0 + 0.3j) * values, names, "N")
    return IdleRun(LoadCase("idle", "idle", 1, 14.0, 25.0, 2.0, motion, force), speed)


def fleet(frequency=FREQUENCY):
    # linear over the lines, so that what lies between them is known
    slope = np.stack([1e-3 * frequency, 2e-3 * frequency + 0.01j], axis=1)
    ear = Frf(frequency, slope[:, np.newaxis], ("ear",), PATHS, "Pa/N")
    seat = Frf(frequency, 0.1j * slope[:, np.newaxis], ("seat",), PATHS, "m/s^2/N")
    return Fleet((Vehicle("V-1", "V", ear, receivers={SEAT: seat}),))


def at_idle(run, cars):
    return idle_model(run, cars, MOUNTS, motion=Motion.prescribed, powertrain=None)


def test_levels_of_orders_and_of_all_together_are_those_by_hand():
    run = idle_run()
    model = at_idle(run, fleet())
    np.testing.assert_array_equal(model.orders, ORDERS)
    assert not model.left_out.size
    force = run.case.force.select(["M z", "N z"]).values
    pressure = (np.stack([1e-3 * LINES, 2e-3 * LINES + 0.01j], axis=1) * force).sum(axis=1)
    heard = 20 * np.log10(np.abs(pressure) / np.sqrt(2) / 20e-6) + a_weighting(LINES)
    felt = 20 * np.log10(np.abs(0.1j * pressure) / np.sqrt(2) / 1e-6)
    today = np.ones((1, 6))
    np.testing.assert_allclose(model.levels(today)[0], [heard, felt], rtol=1e-9)
    total = [10 * np.log10(np.sum(10 ** (levels / 10))) for levels in (heard, felt)]
    np.testing.assert_allclose(model(today)[0], total, rtol=1e-9)
    # twice the force of a linear path is 6 dB more at every order
    np.testing.assert_allclose(model(2.0 * today) - model(today), 20 * np.log10(2.0), rtol=1e-9)


def test_orders_without_functions_are_left_out_by_name_and_none_is_extrapolated():
    model = at_idle(idle_run(), fleet(FREQUENCY[(FREQUENCY > 20.0) & (FREQUENCY < 60.0)]))
    np.testing.assert_array_equal(model.left_out, [0.5, 1.0, 1.5, 4.5, 5.0, 5.5, 6.0])
    gap = (FREQUENCY < 25.0) | (FREQUENCY > 28.0)
    assert at_idle(idle_run(), fleet(FREQUENCY[gap])).left_out.tolist() == [2.0]
    with pytest.raises(
        InputError, match="functions at 100 to 150 Hz: measure functions at the ord"
    ):
        at_idle(idle_run(), fleet(np.arange(100.0, 151.0)))


def test_lines_that_are_no_orders_are_refused_by_their_frequency():
    with pytest.raises(
        InputError, match=r"6\.66667 Hz is order 0\.471 of 850 rpm: export one line"
    ):
        idle_run(speed=850.0)
    doubled = np.sort(np.r_[LINES[:4], LINES[1] + 0.01])
    with pytest.raises(InputError, match="two lines of one order"):
        idle_run(doubled)


def test_a_noisy_body_that_passed_on_all_lines_is_not_judged_again_on_a_few():
    generator = np.random.default_rng(143)  # of 300 seeds the first at which a few lines fail
    noise = generator.normal(size=(2, FREQUENCY.size, 2, 2))
    noise = noise[0] + 1j * noise[1]
    body = 1e-7 * (np.eye(2) * (1.0 - 0.03j) + 0.03 * (noise + noise.swapaxes(1, 2)))
    (car,) = fleet().vehicles
    car = replace(car, receptance=Frf(FREQUENCY, body, PATHS, PATHS, "m/N"))
    moved = _vehicle_at(car, LINES)
    exact = np.isin(LINES, FREQUENCY)
    kept = moved.receptance.values[exact]
    np.testing.assert_array_equal(kept, body[np.isin(FREQUENCY, LINES)])
    with pytest.raises(InputError, match="gives energy at N z"):
        replace(moved, receivers={})


STATED = {
    "name": "idle",
    "title": "idle",
    "kind": "idle",
    "speed_rpm": 800.0,
    "gear": 1,
    "torque_limit_nm": 25.0,
    "operating": "operating/idle.uff",
}


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"speed_rpm": None}, "idle has one speed: state it"),
        ({"kind": None}, "a run-up has no fixed speed"),
        ({"order": 1.5}, "idle has several orders and one torque"),
        ({"torque_table": "operating/idle.csv"}, "idle has several orders and one torque"),
        ({"kind": "cruise"}, "'idle'"),
    ],
)
def test_keys_of_idle_that_do_not_go_together_are_refused(change, sentence):
    assert LoadCaseEntry(**STATED).is_idle
    with pytest.raises(ValueError, match=sentence):
        LoadCaseEntry(**{**STATED, **change})


def test_a_platform_of_idle_alone_is_refused():
    file = load_toml(platform_folder("u06") / "platform.toml", PlatformFile)
    at_idle = {"kind": "idle", "speed_rpm": 800.0, "torque_table": None}
    alone = [case.model_copy(update=at_idle) for case in file.load_cases]
    faults = list(file.model_copy(update={"load_cases": tuple(alone)}).faults())
    assert len(faults) == 1
    assert faults[0].endswith("are at idle: add a run-up")
