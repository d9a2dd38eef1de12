"""Noise transfer functions of vehicles and electric cars of known truth."""

from dataclasses import fields, replace

import numpy as np
import pytest
from thesis_samples import deviation

from deboom.bench.choices import CalibrationLevel
from deboom.bench.compressor_rig import operation
from deboom.bench.electric_car import mount_stiffnesses
from deboom.bench.electric_car_writer import CAR_PLAN, write_electric_car
from deboom.bench.fleet import ear_transfer, load_fleet, panel_pressure, source_motion
from deboom.errors import InputError
from deboom.files.electric_car import read_electric_car
from deboom.measurement import measured_vehicle, path_forces
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.electric_car import wrench_accelerance, wrench_noise_transfer
from deboom.measurement.noise_transfer import (
    ACCELERATION_PER_VOLUME_ACCELERATION,
    reciprocal_noise_transfer,
)
from deboom.measurement.sensors import PlacementTolerances
from deboom.measurement.uncertainty import level_spread
from deboom.physics.rigid_body import forward_matrices
from deboom.vehicles.path_analysis import analyse_paths

FREQUENCY = np.linspace(20.0, 80.0, 61)
OMEGA = 2 * np.pi * FREQUENCY


def as_reciprocal(ratio):
    """One channel, one ear."""
    return Frf(
        FREQUENCY, ratio[:, None, None], ("B1 x",), ("ear",), ACCELERATION_PER_VOLUME_ACCELERATION
    )


def test_sign_in_a_tube_of_standing_waves():
    # piston of mass m at 0, rigid end at L, ear at x; impedance of air and its own inertia together
    density, speed, area, mass, length, ear = 1.2, 343.0, 0.3, 2.0, 2.6, 1.1
    wave = OMEGA / speed * (1 - 0.02j)
    impedance = density * OMEGA / wave
    tube = -1j * impedance / np.tan(wave * length)  # p(0) per velocity of the piston
    at_ear = -1j * impedance * np.cos(wave * (length - ear)) / np.sin(wave * length)
    velocity_per_force = 1 / (1j * OMEGA * mass + area * tube)
    pressure_per_force = at_ear * velocity_per_force

    # a source Q at the ear: p = a e^-jkx + b e^jkx before it, c cos k(L-x) behind it, and the free
    # piston moves with v; velocity of the air u = -p'/(jw rho)
    ratio = []
    for k, z, w in zip(wave, impedance, OMEGA, strict=True):
        forth, back = np.exp(-1j * k * ear), np.exp(1j * k * ear)
        behind = k * (length - ear)
        matrix = np.array(
            [
                [forth, back, -np.cos(behind), 0],  # one pressure
                [-forth / z, back / z, 1j * np.sin(behind) / z, 0],  # velocity jumps by Q/S
                [1 / z, -1 / z, 0, -1],  # the air follows the piston
                [area, area, 0, 1j * w * mass],  # and pushes it out
            ]
        )
        ratio.append(np.linalg.solve(matrix, np.array([0, 1 / area, 0, 0], dtype=complex))[3])
    transfer = reciprocal_noise_transfer(as_reciprocal(np.array(ratio)))

    error = np.abs(transfer.values[:, 0, 0] - pressure_per_force) / np.abs(pressure_per_force)
    assert error.max() < 1e-10


@pytest.mark.parametrize("vehicle", ["U06-1", "U06-5", "F45-3"])
def test_the_bench_answers_the_loudspeaker_as_reciprocity_demands(vehicle):
    fleet = load_fleet(1)
    body = fleet.bodies[vehicle]
    direct = ear_transfer(body, fleet.cabin, FREQUENCY)
    breathing = source_motion(body, fleet.cabin, FREQUENCY).transpose(0, 3, 1, 2)
    assert np.abs(direct + breathing).max() < 1e-12 * np.abs(direct).max()


def test_the_passenger_hears_another_cabin_than_the_driver_but_not_a_strange_one():
    fleet = load_fleet(1)
    ears = panel_pressure(fleet.cabin, FREQUENCY)
    np.testing.assert_array_equal(ears[:, 0], fleet.cabin.pressure(FREQUENCY))
    body = fleet.bodies["U06-1"]
    levels = 20 * np.log10(np.abs(ear_transfer(body, fleet.cabin, FREQUENCY)[:, :, :3, :3]))
    assert 0.1 < np.median(np.abs(levels[:, 1] - levels[:, 0])) < 3.0


EXACT = 1e-10


@pytest.fixture(scope="module")
def vehicle(exact_vehicle):
    return exact_vehicle[1]


@pytest.fixture(scope="module")
def truth(exact_vehicle, vehicle):
    with np.load(
        exact_vehicle[0] / "truth" / f"{vehicle.runs[0].name}.npz", allow_pickle=False
    ) as file:
        return {name: file[name] for name in file.files}


def spectrum(truth, quantity, channels, unit):
    names = tuple(truth["channels"].tolist())
    return Spectrum(truth["frequency"], truth[quantity], names, unit).select(channels)


def test_forces_validation_sensors_and_pressure(vehicle, truth):
    """Third sensor of every point kept out; the ear by the transfer functions of the hammer."""
    accelerance = measured_vehicle.path_accelerance(vehicle)
    kept_out = [name for on in vehicle.body_sensors.values() for name in on[2].channels]
    indicators = [name for name in accelerance.outputs if name not in kept_out]
    response = vehicle.runs[0].acceleration
    forces = path_forces.forces_by_inversion(accelerance.select(outputs=indicators), response)
    assert len(forces.force.channels) == 11
    true = spectrum(truth, "force", forces.force.channels, "N")
    assert deviation(forces.force.values, true.values) < EXACT
    onboard = path_forces.validate_on_board(accelerance.select(outputs=kept_out), forces, response)
    # channels along which the body does not move at all have only rounding to show
    moving = np.abs(onboard.measured.values).max(axis=0) > 1e-6
    assert moving.sum() > 10
    assert onboard.relative_error[moving].max() < EXACT

    points = measured_vehicle.point_noise_transfer(vehicle, measured_vehicle.Method.DIRECT)
    ear = points.select(outputs=vehicle.ears[:1], inputs=forces.force.channels)
    result = analyse_paths(ear, forces.force)
    assert deviation(result.pressure, truth["pressure_of_mounts"][:, 0]) < EXACT


def test_stiffness_of_the_mounts_gives_the_same_forces(vehicle, truth):
    pieces = [
        piece for path in measured_vehicle.piece_paths(vehicle.mounts).values() for piece in path
    ]
    deflection = spectrum(truth, "deflection", pieces, "m")
    stiffness = spectrum(truth, "stiffness", pieces, "N/m")
    still = Spectrum(deflection.frequency, 0 * deflection.values, deflection.channels, "m")
    forces = path_forces.forces_by_mount_stiffness(stiffness, deflection, still)
    true = spectrum(truth, "force", pieces, "N")
    assert deviation(forces.force.values, true.values) < EXACT


def test_pieces_of_a_path_are_summed(vehicle, truth):
    paths = measured_vehicle.piece_paths(vehicle.mounts)
    assert paths["Du x"] == ("Du left x", "Du right x")
    pieces = [piece for path in paths.values() for piece in path]
    force = spectrum(truth, "force", pieces[::-1], "N")
    summed = measured_vehicle.summed_over_pieces(force, paths)
    assert summed.channels == tuple(paths)
    left, right = force.select(paths["Du x"]).values.T
    np.testing.assert_allclose(summed.select(("Du x",)).values[:, 0], left + right)
    with pytest.raises(InputError, match=r"path Du x has no force of \['Du right x'\]"):
        measured_vehicle.summed_over_pieces(force.select(pieces[:-1]), paths)


def test_without_accelerances_nothing_can_be_inverted(vehicle):
    with pytest.raises(InputError, match="not recorded in its hammer test"):
        measured_vehicle.path_accelerance(replace(vehicle, accelerance=None))


def test_spread_of_levels():
    levels = [[[60.0], [50.0]], [[80.0], [70.0]], [[100.0], [90.0]]]
    spread = level_spread(levels)
    np.testing.assert_allclose(spread.range, 40.0)
    np.testing.assert_allclose(spread.mean, [[80.0], [70.0]])
    assert spread.quantile(0.9) == pytest.approx(40.0)
    with pytest.raises(InputError, match="at least two vehicles"):
        level_spread(np.zeros((1, 5)))
    with pytest.raises(InputError, match="finite levels"):
        level_spread([[0.0], [-np.inf]])


SEED = 3


@pytest.fixture(scope="module")
def exact(tmp_path_factory):
    folder = tmp_path_factory.mktemp("car") / "exact"
    write_electric_car(folder, SEED, "EV-2", noise_free=True)
    return folder, read_electric_car(folder)


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    folder = tmp_path_factory.mktemp("car") / "measured"
    write_electric_car(folder, SEED, "EV-2", fleet=4)
    return folder, read_electric_car(folder)


def test_exact_files_give_the_noise_transfer_back(exact):
    folder, car = exact
    transfer = wrench_noise_transfer(car)
    with np.load(folder / "truth/body.npz") as truth:
        np.testing.assert_array_equal(transfer.transfer.frequency, truth["frequency"])
        true = truth["noise_transfer"]
    off = np.abs(transfer.transfer.values[:, 0] - true).max(axis=0)
    assert np.all(off < 1e-6 * np.abs(true).max(axis=0))


def test_an_error_of_place_acts_through_the_moments_about_the_other_two_axes(exact):
    sure = dict.fromkeys((item.name for item in fields(PlacementTolerances)), 1e-12)
    stated = PlacementTolerances(**{**sure, "sensor_position": 1e-3})
    car = replace(exact[1], coherence=np.ones_like(exact[1].coherence), tolerances=stated)
    transfer = wrench_noise_transfer(car, ("mount 1",))
    squared = np.abs(transfer.transfer.values[:, 0, 3:]) ** 2
    expected = 1e-3 * np.sqrt(squared @ (1 - np.eye(3)))
    np.testing.assert_allclose(transfer.deviation[:, :3], expected, rtol=1e-6)


def test_exact_files_give_the_body_back(exact):
    folder, car = exact
    body = wrench_accelerance(car, ("mount 3", car.hoses[0].name))
    assert body.outputs[3:7] == tuple(
        f"{name}" for name in ("mount 3 rx", "mount 3 ry", "mount 3 rz", f"{car.hoses[0].name} x")
    )
    assert body.inputs[2:4] == ("mount 3 z", "mount 3 mx")
    with np.load(folder / "truth/body.npz") as truth:
        squared = ((2 * np.pi * truth["frequency"]) ** 2)[:, None, None]
        for block, point in ((slice(0, 6), 2), (slice(6, 12), 3)):
            receptance = -body.values[:, block, block] / squared
            true = truth["point_receptance"][:, point]
            # rows and columns of different units: each entry by its own largest value
            off = np.abs(receptance - true).max(axis=0) / np.abs(true).max(axis=0)
            assert off.max() < 1e-6
    whole = body.values
    np.testing.assert_allclose(
        whole[:, :6, 6:], whole[:, 6:, :6].swapaxes(1, 2), atol=1e-6 * np.abs(whole).max()
    )


def test_exact_sweeps_are_the_coupled_car(exact):
    folder, car = exact
    transfer = wrench_noise_transfer(car)
    laboratory = operation(SEED, CalibrationLevel.C2, CAR_PLAN, noise_free=True).laboratory
    rows = laboratory.placed.response_rows()
    forward = forward_matrices(laboratory.compressor.positions)
    for number, sweep in enumerate(car.operation.sweeps):
        with np.load(folder / f"truth/{number}.npz") as truth:
            lines, body = truth["frequency"], truth["body_motion"].reshape(-1, 5, 6)
            squared = (2 * np.pi * lines[:, None]) ** 2
            load, pressure = truth["body_load"], truth["pressure"]
            seen = -squared * (truth["displacement"] @ rows.T)
        assert sweep.holder is not None
        assert sweep.sound is not None
        np.testing.assert_allclose(sweep.acceleration.values, seen, rtol=1e-8, atol=1e-14)
        held = -squared * body[:, :3, :3].reshape(len(lines), 9)
        np.testing.assert_allclose(sweep.holder.values, held, rtol=1e-8, atol=1e-14)
        np.testing.assert_allclose(sweep.sound.values[:, 0], pressure, rtol=1e-10)
        # mounts push with what their two sides differ by
        squeezed = (sweep.acceleration.values @ np.linalg.pinv(rows).T) @ forward.T - held
        stiffness = mount_stiffnesses(laboratory.compressor, lines)
        force = np.einsum(
            "fmab,fmb->fma", stiffness, -(squeezed / squared).reshape(len(lines), 3, 3)
        )
        np.testing.assert_allclose(
            force, load.reshape(-1, 5, 6)[:, :3, :3], rtol=1e-6, atol=1e-8 * np.abs(force).max()
        )
        # what was struck and what ran are one car
        summed = np.einsum("fp,fp->f", transfer.at(lines).transfer.values[:, 0], load)
        np.testing.assert_allclose(summed, pressure, rtol=1e-6, atol=1e-9 * np.abs(pressure).max())


@pytest.mark.slow("measures a noisy vehicle")
def test_errors_are_as_large_as_stated(measured):
    folder, car = measured
    transfer = wrench_noise_transfer(car)
    with np.load(folder / "truth/body.npz") as truth:
        error = np.abs(transfer.transfer.values[:, 0] - truth["noise_transfer"])
    ratio = np.sqrt(np.mean((error / transfer.deviation) ** 2, axis=0))
    # 30 functions of errors that are one draw each: not each of them, but all together
    assert 0.7 < np.sqrt(np.mean(ratio**2)) < 1.4
    assert ratio.max() < 2.5


def test_noise_falls_with_the_root_of_the_averages(measured):
    _, car = measured
    exact_sheet = PlacementTolerances(*[1e-12] * 6)
    once, four_times = (
        wrench_noise_transfer(
            replace(car, tolerances=exact_sheet, n_averages=count * car.n_averages)
        ).deviation
        for count in (1, 4)
    )
    np.testing.assert_allclose(four_times, once / 2, rtol=1e-6)


def test_sweeps_scatter_as_stated(measured):
    folder, car = measured
    with np.load(folder / "truth/2.npz") as truth:
        pressure = truth["pressure"]
    sound = car.operation.sweeps[2].sound
    assert sound is not None
    gain = np.vdot(pressure, sound.values[:, 0]) / np.vdot(pressure, pressure)
    assert abs(gain - 1) < 4 * 0.2 * np.log(10) / 20
    rest = sound.values[:, 0] - gain * pressure
    expected = np.hypot(np.sqrt(2) * 3e-5, 3e-3 * np.abs(pressure))
    assert np.sqrt(np.mean(np.abs(rest / expected) ** 2)) == pytest.approx(1.0, abs=0.2)


def test_lines_are_chosen_and_never_made(exact):
    transfer = wrench_noise_transfer(exact[1], ("mount 2",))
    assert transfer.transfer.inputs == tuple(
        f"mount 2 {load}" for load in ("x", "y", "z", "mx", "my", "mz")
    )
    some = transfer.at(np.array([20.0, 90.5]))
    rows = np.searchsorted(transfer.transfer.frequency, [20.0, 90.5])
    np.testing.assert_array_equal(some.transfer.values, transfer.transfer.values[rows])
    np.testing.assert_array_equal(some.deviation, transfer.deviation[rows])
    with pytest.raises(InputError, match=r"no line at 20.2 Hz.*nothing is interpolated"):
        transfer.at(np.array([20.0, 20.2]))
    with pytest.raises(InputError, match="no point 'mount 4'"):
        wrench_noise_transfer(exact[1], ("mount 4",))
    with pytest.raises(InputError, match="name at least one"):
        wrench_noise_transfer(exact[1], ())
