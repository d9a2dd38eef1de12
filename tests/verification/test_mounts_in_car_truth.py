"""Mounts from the car alone against the truth of the virtual car."""

from dataclasses import replace

import numpy as np
import pytest

from deboom.bench.layout import LOAD_CASES
from deboom.bench.vehicle_writer import NO_VEHICLE_ERRORS, write_vehicle
from deboom.errors import InputError
from deboom.files.vehicle import read_vehicle
from deboom.mounts.mount import refuse_active_mounts
from deboom.mounts.mounts_in_car import both_sides, mounts_in_car
from deboom.physics.transfer_path import mount_force

TWO = tuple(case for case in LOAD_CASES if case.name in ("g5_wot220", "g6_wot120"))


def truth(folder, result):
    """Return the true stiffness of each direction, run after run."""
    rows = []
    for run in result.runs:
        with np.load(folder / f"truth/{run.name}.npz") as arrays:
            channels = arrays["channels"].tolist()
            names = [name.replace("Du x", "Du left x") for name in result.directions]
            rows.append(arrays["stiffness"][:, [channels.index(name) for name in names]])
    return np.vstack(rows)


@pytest.fixture(scope="module")
def exact(exact_vehicle):
    folder, vehicle = exact_vehicle
    return folder, vehicle, mounts_in_car(vehicle, draws=2)


def test_exact_measurements_give_every_stiffness_back(exact):
    """Between the frequencies of the parametric stiffness it is linear, the truth is not."""
    folder, _, result = exact
    assert len(result.directions) == 10
    error = np.abs(result.stiffness / truth(folder, result) - 1)
    assert np.median(error) < 5e-4
    assert np.quantile(error, 0.95) < 0.02


def test_exact_forces_are_those_of_the_car(exact):
    folder, _, result = exact
    (run,) = result.runs
    with np.load(folder / "truth/g5_wot220.npz") as arrays:
        names = arrays["channels"].tolist()
        order = [names.index(channel) for channel in run.force.channels]
        force, deflection = arrays["force"][:, order], arrays["deflection"][:, order]
    assert np.linalg.norm(run.force.values - force) < 0.02 * np.linalg.norm(force)
    np.testing.assert_allclose(
        run.deflection.values, deflection, atol=1e-9 * np.abs(deflection).max()
    )
    assert run.unexplained < 0.02


def test_a_load_case_has_the_force_on_a_body_at_rest(exact):
    """The same mounts under the motion of the source alone, as a bench shows it."""
    _, vehicle, result = exact
    (run,), (case,) = result.runs, result.load_cases
    source, _ = both_sides(vehicle, vehicle.runs[0])
    assert np.array_equal(case.displacement.values, source.select(case.force.channels).values)
    stiffness = run.stiffness[:, [result.directions.index("TSM x")]]
    column = case.force.channels.index("TSM x")
    moved = source.select(["TSM x"]).values
    alone = mount_force(stiffness, moved, np.zeros_like(moved))
    np.testing.assert_allclose(case.force.values[:, [column]], alone)


def test_a_direction_of_which_the_car_says_nothing_is_as_stiff_as_its_mount(measured):
    """So no load case has a mount that drives the powertrain."""
    _, result = measured
    assert {"TSM y"} <= set(result.assumed) <= {"EnM y", "GeM y", "TSM y", "GeM z"}
    case, run = result.load_cases[0], result.runs[0]
    sure = [f"TSM {axis}" for axis in "xz" if result.identified[f"TSM {axis}"]]
    expected = run.stiffness[:, [result.directions.index(name) for name in sure]].mean(axis=1)
    column = case.force.channels.index("TSM y")
    ratio = case.force.values[:, column] / case.displacement.values[:, column]
    np.testing.assert_allclose(ratio, expected)
    for each in result.load_cases:
        refuse_active_mounts(each)


def test_tilted_mounts_are_stiff_along_their_own_axes(tmp_path):
    folder = tmp_path / "car"
    write_vehicle(folder, 3, errors=NO_VEHICLE_ERRORS, load_cases=TWO[:1], truth_seed=3, tilt=25.0)
    result = mounts_in_car(read_vehicle(folder), draws=2)
    assert np.median(np.abs(result.stiffness / truth(folder, result) - 1)) < 1e-3


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """Measure a drawn car on a soft body with the errors of a good laboratory."""
    folder = tmp_path_factory.mktemp("car") / "attachments"
    write_vehicle(folder, 31, truth_seed=31, family="attachments,stiffness", load_cases=TWO)
    return folder, mounts_in_car(read_vehicle(folder), draws=20)


def test_directions_that_carry_the_load_are_identified_within_their_intervals(measured):
    """One car; the decisions have the shares over twenty cars of five kinds of bodies."""
    folder, result = measured
    error = np.abs(np.abs(result.stiffness) / np.abs(truth(folder, result)) - 1)
    width = np.vstack([run.half_width for run in result.runs])
    sure = np.array(list(result.identified.values()))
    along = np.array([name[-1] for name in result.directions])
    assert sure[along == "x"].all()
    assert np.median(error, axis=0)[along == "x"].max() < 0.10
    assert np.median(error, axis=0)[sure].max() < 0.20
    assert np.mean(error[:, sure] <= width[:, sure]) > 0.6


def test_a_direction_that_hardly_moves_is_not_identified(measured):
    _, result = measured
    assert not any(result.identified[f"{mount} y"] for mount in ("EnM", "GeM", "TSM"))


def test_the_library_has_the_stiffness_over_the_wheel_torque(measured):
    folder, result = measured
    (part,) = [part for part in result.mounts if part.mount.name == "TSM"]
    direction = part.direction("x")
    assert direction.quality.identified
    assert 0 < direction.quality.half_width_95 < 0.2
    case = result.load_cases[0]
    column = result.directions.index("TSM x")
    lines = case.force.frequency
    moved = np.abs(case.displacement.select(["TSM x"]).values[:, 0])
    points = np.column_stack([case.wheel_torque, moved, lines])
    surface = direction.surface.predict(points, extrapolate=True)
    error = np.abs(surface) / np.abs(truth(folder, result)[: len(lines), column]) - 1
    assert np.median(np.abs(error)) < 0.10


def test_the_ears_hear_what_the_forces_say(exact):
    """The microphone takes no part in finding them."""
    _, _, result = exact
    microphone, synthesised = result.at_ear(result.runs[0])
    off = np.linalg.norm(synthesised - microphone) / np.linalg.norm(microphone)
    assert off < 0.03


def test_force_that_passes_the_mounts_by_withdraws_all_directions(exact):
    """A body that moves by what no mount does."""
    _, vehicle, result = exact
    (run,) = vehicle.runs
    values = run.acceleration.values.copy()
    body = [run.acceleration.channels.index(name) for name in vehicle.accelerance.outputs]
    values[:, body] += 0.5 * np.abs(values[:, body]).max(axis=1, keepdims=True)
    shaken = replace(run, acceleration=replace(run.acceleration, values=values))
    again = mounts_in_car(replace(vehicle, runs=(shaken,)), draws=2)
    assert again.unexplained > 0.3 > 10 * result.unexplained
    assert not any(again.identified.values())
    with pytest.raises(InputError, match="no direction is identified, so that there is no load"):
        _ = again.load_cases


def without(vehicle, mount):
    """Take the accelerometers above a mount off."""
    return replace(
        vehicle,
        source_sensors=tuple(s for s in vehicle.source_sensors if s.mount not in mount),
    )


def flat(vehicle):
    """Magnitudes in the place of complex spectra."""
    (run,) = vehicle.runs
    values = np.abs(run.acceleration.values).astype(complex)
    return replace(
        vehicle, runs=(replace(run, acceleration=replace(run.acceleration, values=values)),)
    )


def fewer_lines(vehicle):
    (run,) = vehicle.runs
    halved = replace(
        run.acceleration,
        frequency=run.acceleration.frequency[::2],
        values=run.acceleration.values[::2],
    )
    return replace(vehicle, runs=(replace(run, acceleration=halved),))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda v: replace(v, runs=()), "there are no runs: drive run-ups"),
        (lambda v: without(v, ("EnM", "GeM", "TSM")), "none on the powertrain: .* both sides"),
        (lambda v: without(v, ("Du",)), "none on Du left: .* both sides of its mount"),
        (lambda v: without(v, ("EnM", "GeM")), "show only .* of 6 motions"),
        (flat, "run g5_wot220: its spectra are magnitudes without phase, .* without a tacho"),
        (fewer_lines, "run g5_wot220: it has other lines than the accelerances"),
        (lambda v: replace(v, accelerance=None), "not recorded in its hammer test"),
    ],
)
def test_what_cannot_be_used_is_refused_with_a_remedy(exact_vehicle, change, words):
    with pytest.raises(InputError, match=words):
        mounts_in_car(change(exact_vehicle[1]), draws=2)


def test_without_torque_there_is_no_library(exact):
    _, vehicle, result = exact
    assert result.mounts
    silent = tuple(replace(run, engine_torque=None) for run in vehicle.runs)
    again = mounts_in_car(replace(vehicle, runs=silent), draws=2)
    with pytest.raises(InputError, match=r"no engine torque was recorded .* torque_table"):
        _ = again.mounts
    with pytest.raises(InputError, match="seeds are whole numbers from 1"):
        mounts_in_car(vehicle, seed=0)
