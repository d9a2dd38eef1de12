"""The written vehicle: exact files give the truth back, and the car obeys its parts."""

from dataclasses import replace

import numpy as np
import pytest

from deboom.bench.fleet import load_fleet, point_receptance, receptance
from deboom.bench.layout import FREQUENCY, LOAD_CASES
from deboom.bench.operating_run import (
    NO_CAR_ERRORS,
    CarErrors,
    PlannedRun,
    at_ears,
    drive,
    true_run,
)
from deboom.bench.powertrain import load_bench, with_mount_set
from deboom.bench.vehicle_writer import write_vehicle
from deboom.errors import InputError
from deboom.measurement.measured_vehicle import Method, path_noise_transfer, point_noise_transfer
from deboom.measurement.virtual_point import virtual_point, virtual_point_frf
from deboom.physics.transfer_path import interface_force, mounted_source, pressure

BENCH = load_bench()
FLEET = load_fleet(1)
CASES = tuple(case for case in LOAD_CASES if case.name == "g5_wot220")
ON_M1 = with_mount_set(BENCH, "M1")


def truth(folder, name):
    with np.load(folder / "truth" / f"{name}.npz") as file:
        return {key: file[key] for key in file.files}


@pytest.mark.parametrize("method", list(Method))
def test_exact_files_give_all_six_loads_of_every_point_back(exact_vehicle, method):
    folder, vehicle = exact_vehicle
    estimated = point_noise_transfer(vehicle, method)
    true = truth(folder, "vehicle")["noise_transfer"].reshape(FREQUENCY.size, 2, -1)
    assert estimated.outputs == ("driver ear", "passenger ear")
    assert estimated.inputs[:7] == (
        "EnM x",
        "EnM y",
        "EnM z",
        "EnM mx",
        "EnM my",
        "EnM mz",
        "GeM x",
    )
    assert np.abs(estimated.values - true).max() < 1e-12 * np.abs(true).max()


def test_exact_accelerances_are_those_of_the_body(exact_vehicle):
    _, vehicle = exact_vehicle
    response = virtual_point(vehicle.geometry("TSM", Method.RECIPROCAL))
    excitation = virtual_point(vehicle.geometry("GeM", Method.DIRECT))
    estimated = virtual_point_frf(vehicle.accelerance, response=response, excitation=excitation)
    rows = tuple(np.eye(6) for _ in vehicle.points)
    whole = point_receptance(FLEET.bodies["U06-1"], FREQUENCY, rows, rows)
    true = -((2 * np.pi * FREQUENCY[:, None, None]) ** 2) * whole[:, 12:18, 6:12]
    assert np.abs(estimated.values - true).max() < 1e-11 * np.abs(true).max()


def test_paths_are_those_of_the_platform(exact_vehicle):
    _, vehicle = exact_vehicle
    estimated = path_noise_transfer(vehicle, Method.RECIPROCAL, "driver ear")
    assert estimated.inputs == FLEET.paths
    with pytest.raises(InputError, match="no point 'Du'"):
        vehicle.position("Du")
    with pytest.raises(InputError, match="no run 'g3'"):
        vehicle.run("g3")


def test_the_car_obeys_the_coupling_of_its_parts():
    """The dual way: interface forces from receptances, nothing of the bench's own solution."""
    body = FLEET.bodies["U06-3"]
    torque = true_run(ON_M1, PlannedRun(5, 220.0), FREQUENCY).engine_torque
    car = drive(ON_M1, body, FLEET.cabin, 5, torque, FREQUENCY)
    squared = (2 * np.pi * FREQUENCY) ** 2
    forward = ON_M1.powertrain.forward
    n_mount = len(forward)
    source = np.zeros((n_mount + 2, n_mount + 2))
    source[:n_mount, :n_mount] = -forward @ np.linalg.solve(ON_M1.powertrain.mass_matrix, forward.T)
    source[[-2, -1], [-2, -1]] = -1 / ON_M1.wheel_end.mass_matrix[0, 0]
    rows = [np.eye(3, 6)] * len(ON_M1.mount_names) + [np.eye(1, 6)] * 2
    receiver = point_receptance(body, FREQUENCY, tuple(rows), tuple(rows))
    source_receptance = source / squared[:, None, None]
    # what the sources do on their own, from the loads: the car's motion less what its forces do
    everything = np.hstack([car.powertrain @ forward.T, car.wheel_ends])
    free = everything + np.einsum("fij,fj->fi", source_receptance, car.force)
    load = -squared[:, None] * (
        np.linalg.lstsq(forward, free[:, :n_mount].T, rcond=None)[0].T
        @ ON_M1.powertrain.mass_matrix
    )
    assert np.abs(load[:, [0, 1, 2, 3, 5]]).max() < 1e-9 * np.abs(load[:, 4]).max()
    force = interface_force(mounted_source(source_receptance, car.stiffness), receiver, free)
    assert np.abs(force - car.force).max() < 1e-9 * np.abs(car.force).max()
    # and with the old receptance of the ten paths, up to what the sides differ in
    old = receptance(body, FREQUENCY)
    np.testing.assert_allclose(receiver[:, :9, :9], old[:, :9, :9], rtol=1e-12)
    both = receiver[:, 9:, 9:].mean(axis=(1, 2))
    np.testing.assert_allclose(both, old[:, 9, 9], rtol=1e-12)


def test_a_body_that_does_not_give_way_is_the_bench():
    body = FLEET.bodies["U06-1"]
    stiff = replace(
        body,
        shapes_at_paths=1e-9 * body.shapes_at_paths,
        local_stiffness=1e12 * body.local_stiffness,
    )
    run = true_run(ON_M1, PlannedRun(6, 160.0), FREQUENCY)
    car = drive(ON_M1, stiff, FLEET.cabin, 6, run.engine_torque, FREQUENCY)
    assert np.abs(car.force - run.force).max() < 1e-8 * np.abs(run.force).max()
    assert np.abs(car.path_force - run.path_force).max() < 1e-8 * np.abs(run.path_force).max()


def test_pressure_is_transfer_function_times_force(exact_vehicle):
    folder, vehicle = exact_vehicle
    true = truth(folder, "g5_wot220")
    ntf = path_noise_transfer(vehicle, Method.DIRECT, "driver ear").values[:, 0]
    sides = true["force"][:, -2:].sum(axis=1, keepdims=True)
    synthesised = pressure(ntf, np.hstack([true["force"][:, :-2], sides]))
    measured = vehicle.run("g5_wot220").pressure.values[:, 0]
    # the sides carry different forces and have different functions: the mean costs this much
    assert np.abs(synthesised - measured).max() < 0.02 * np.abs(measured).max()


def test_other_paths_have_their_stated_size():
    body = FLEET.bodies["U06-1"]
    torque = true_run(ON_M1, PlannedRun(5, 220.0), FREQUENCY).engine_torque
    car = drive(ON_M1, body, FLEET.cabin, 5, torque, FREQUENCY, CarErrors().mount_stiffness)
    sizes = []
    for seed in range(1, 41):
        true, _ = at_ears(car, CarErrors(), np.random.default_rng(seed))
        other = np.mean(np.abs(true - car.pressure) ** 2, axis=0)
        sizes.append(other / np.mean(np.abs(car.pressure) ** 2, axis=0))
    # cosines and a constant: (1 + 9/2)/10 of the weights' power
    expected = CarErrors().other_paths ** 2 * (1 + 9 / 2) / 10
    assert np.mean(sizes) == pytest.approx(expected, rel=0.25)
    same, heard = at_ears(car, NO_CAR_ERRORS, np.random.default_rng(1))
    np.testing.assert_array_equal(same, car.pressure)
    np.testing.assert_array_equal(heard, car.pressure)


def test_the_same_seed_gives_the_same_bytes(tmp_path):
    first, two = (
        write_vehicle(tmp_path / name, 3, "F39-2", load_cases=CASES, accelerance=False)
        for name in ("one", "two")
    )
    for path in sorted(first.rglob("*")):
        if path.is_file():
            assert path.read_bytes() == (two / path.relative_to(first)).read_bytes(), path
