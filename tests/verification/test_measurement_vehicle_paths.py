"""Classical transfer path analysis of a measured vehicle recovers the truth of the bench."""

from dataclasses import replace

import numpy as np
import pytest

from deboom.bench.platform_layout import LOAD_CASES
from deboom.bench.vehicle_writer import NO_VEHICLE_ERRORS, write_vehicle
from deboom.errors import InputError
from deboom.files.vehicle import read_vehicle
from deboom.measurement.channels import Spectrum
from deboom.measurement.measured_vehicle import Method, point_noise_transfer
from deboom.measurement.on_board_validation import validate_on_board
from deboom.measurement.path_forces import forces_by_inversion, forces_by_mount_stiffness
from deboom.measurement.vehicle_paths import path_accelerance, piece_paths, summed_over_pieces
from deboom.vehicles.path_analysis import analyse_paths

EXACT = 1e-10


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return write_vehicle(
        tmp_path_factory.mktemp("bench") / "vehicle",
        seed=1,
        errors=NO_VEHICLE_ERRORS,
        load_cases=LOAD_CASES[:1],
    )


@pytest.fixture(scope="module")
def vehicle(folder):
    return read_vehicle(folder)


@pytest.fixture(scope="module")
def truth(folder, vehicle):
    with np.load(folder / "truth" / f"{vehicle.runs[0].name}.npz", allow_pickle=False) as file:
        return {name: file[name] for name in file.files}


def spectrum(truth, quantity, channels, unit):
    names = tuple(truth["channels"].tolist())
    return Spectrum(truth["frequency"], truth[quantity], names, unit).select(channels)


def deviation(ours, true):
    return np.linalg.norm(ours - true) / np.linalg.norm(true)


def test_forces_validation_sensors_and_pressure(vehicle, truth):
    """Third sensor of every point kept out; the ear by the transfer functions of the hammer."""
    accelerance = path_accelerance(vehicle)
    kept_out = [name for on in vehicle.body_sensors.values() for name in on[2].channels]
    indicators = [name for name in accelerance.outputs if name not in kept_out]
    response = vehicle.runs[0].acceleration
    forces = forces_by_inversion(accelerance.select(outputs=indicators), response)
    assert len(forces.force.channels) == 11
    true = spectrum(truth, "force", forces.force.channels, "N")
    assert deviation(forces.force.values, true.values) < EXACT
    onboard = validate_on_board(accelerance.select(outputs=kept_out), forces, response)
    # channels along which the body does not move at all have only rounding to show
    moving = np.abs(onboard.measured.values).max(axis=0) > 1e-6
    assert moving.sum() > 10
    assert onboard.relative_error[moving].max() < EXACT

    points = point_noise_transfer(vehicle, Method.DIRECT)
    ear = points.select(outputs=vehicle.ears[:1], inputs=forces.force.channels)
    result = analyse_paths(ear, forces.force)
    assert deviation(result.pressure, truth["pressure_of_mounts"][:, 0]) < EXACT


def test_stiffness_of_the_mounts_gives_the_same_forces(vehicle, truth):
    pieces = [piece for path in piece_paths(vehicle.mounts).values() for piece in path]
    deflection = spectrum(truth, "deflection", pieces, "m")
    stiffness = spectrum(truth, "stiffness", pieces, "N/m")
    still = Spectrum(deflection.frequency, 0 * deflection.values, deflection.channels, "m")
    forces = forces_by_mount_stiffness(stiffness, deflection, still)
    true = spectrum(truth, "force", pieces, "N")
    assert deviation(forces.force.values, true.values) < EXACT


def test_pieces_of_a_path_are_summed(vehicle, truth):
    paths = piece_paths(vehicle.mounts)
    assert paths["Du x"] == ("Du left x", "Du right x")
    pieces = [piece for path in paths.values() for piece in path]
    force = spectrum(truth, "force", pieces[::-1], "N")
    summed = summed_over_pieces(force, paths)
    assert summed.channels == tuple(paths)
    left, right = force.select(paths["Du x"]).values.T
    np.testing.assert_allclose(summed.select(("Du x",)).values[:, 0], left + right)
    with pytest.raises(InputError, match=r"path Du x has no force of \['Du right x'\]"):
        summed_over_pieces(force.select(pieces[:-1]), paths)


def test_without_accelerances_nothing_can_be_inverted(vehicle):
    with pytest.raises(InputError, match="not recorded in its hammer test"):
        path_accelerance(replace(vehicle, accelerance=None))
