"""Receptances of a platform's bodies: written by the bench, read, and refused where wrong."""

from __future__ import annotations

import shutil
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from deboom.bench.families import BRACKETS, KINDS, draw_family
from deboom.bench.fleet import load_fleet, noise_transfer, receptance
from deboom.bench.layout import FREQUENCY, LOAD_CASES
from deboom.bench.platform_writer import write_platform
from deboom.errors import InputError
from deboom.files.check import check_platform
from deboom.files.platform import read_platform
from deboom.files.rows import ChannelRow
from deboom.files.tables import read_table
from deboom.files.uff import read_uff, write_uff
from deboom.files.uncertain_index import uncertain_index
from deboom.measurement.channels import Frf
from deboom.pages.motion import report_runs
from deboom.report import Report
from deboom.vehicles.booming_model import Motion, booming_model
from deboom.vehicles.coupled_motion import FlexibleMotion
from deboom.vehicles.expected_change import Information
from deboom.vehicles.fleet import Vehicle, relative_noise
from deboom.vehicles.platform import MountSource


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return write_platform(tmp_path_factory.mktemp("platform") / "p", 1, receptance=True)


def model(platform, **options):
    first = platform.load_cases[0]
    data = platform.fleet.group("U06"), platform.mounts, [(first, 1.0)], (20.0, 60.0)
    return booming_model(*data, powertrain=platform.powertrain, **options)


def test_the_bench_writes_the_receptance_of_every_body(folder):
    platform = read_platform(folder)
    bodies = load_fleet(1).bodies
    for vehicle in platform.fleet.vehicles:
        true = receptance(bodies[vehicle.name], FREQUENCY)
        paths = vehicle.noise_transfer.inputs
        measured = vehicle.receptance.select(outputs=paths, inputs=paths).values
        # noise of 5 %, and resonances of another day
        assert 0.04 < np.linalg.norm(measured - true) / np.linalg.norm(true) < 0.4
    assert folder / "receptance/U06-1.uff" in platform.input_files
    case = model(platform, motion=Motion.coupled).cases[0]
    assert isinstance(case, FlexibleMotion)
    assert case.receptance.shape == (5, 161, 11, 11)


def test_motion_that_follows_the_amplitude_is_refused_in_a_sentence(folder):
    with pytest.raises(
        InputError, match="go with bodies at rest: leave the receptances or driving"
    ):
        model(read_platform(folder), motion=Motion.amplitude)


def test_a_receptance_of_other_channels_or_a_table_is_refused(folder, tmp_path):
    copy = shutil.copytree(folder, tmp_path / "p")
    (copy / "receptance/U06-1.uff").write_bytes((copy / "noise_transfer/U06-1.uff").read_bytes())
    with pytest.raises(
        InputError, match=r"vehicle U06-1: receptance 'EnM x' per EnM x .* is not in"
    ):
        read_platform(copy)
    toml = copy / "platform.toml"
    text = toml.read_text().replace("receptance/U06-1.uff", "receptance/U06-1.csv")
    toml.write_text(text)
    (copy / "receptance/U06-1.csv").write_text("frequency [Hz]\n20\n")
    with pytest.raises(InputError, match="vehicle U06-1: a receptance has a response and a force"):
        read_platform(copy)


RUN = tuple(case for case in LOAD_CASES if case.name == "g5_wot220")
TWO_CARS = {"groups": ("U06-1", "U06-2"), "load_cases": RUN}
POINTS = "driving_points/U06-1.uff"


@pytest.fixture(scope="module")
def points_folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("points") / "p"
    return write_platform(path, 1, driving_points=True, **TWO_CARS)


@pytest.fixture
def points(points_folder, tmp_path):
    return shutil.copytree(points_folder, tmp_path / "p")


def test_driving_points_are_the_diagonal_of_the_receptance(points_folder, folder):
    platform, entire = read_platform(points_folder), read_platform(folder)
    for vehicle in platform.fleet.vehicles:
        (same,) = (car for car in entire.fleet.vehicles if car.name == vehicle.name)
        diagonal = np.eye(len(vehicle.receptance.inputs)) * same.receptance.values
        np.testing.assert_allclose(vehicle.receptance.values, diagonal, rtol=1e-9)
        assert vehicle.has_driving_points_alone
        assert not same.has_driving_points_alone
    assert points_folder / POINTS in platform.input_files
    check = check_platform(points_folder)
    assert check.faults == ()
    assert "driving points of 2 vehicles" in check.summary
    assert "receptances of 15 vehicles" in check_platform(folder).summary


def test_changes_of_a_folder_with_driving_points_are_expected_with_them(points_folder):
    platform = read_platform(points_folder)
    index = model(platform, motion=Motion.coupled)
    receptance = index.cases[0].receptance
    change = uncertain_index(index, platform, ()).expected_change(np.full((1, 12), 0.9))
    assert change.information is Information.driving_points
    report = Report("cars", "what is known?")
    report_runs(report, platform.runs(["g5_wot220"], mounts=MountSource.spectra))
    assert report.facts["bodies"] == (
        "driving points of 2 vehicles; in coupled motion a driving point gives way to its own "
        "force alone"
    )
    # at the mounts of the powertrain the model has what was measured, and nothing between them
    values = platform.fleet.vehicles[0].receptance.values.diagonal(axis1=1, axis2=2)
    inside = np.isin(FREQUENCY, index.frequency)
    np.testing.assert_allclose(receptance[0].diagonal(axis1=1, axis2=2)[:, :9], values[inside, :9])
    assert not np.any(receptance[0][:, :9, :9][:, ~np.eye(9, dtype=bool)])


def stated_as_table(folder):
    """Replace the file of the first vehicle by a table in mm/N."""
    functions = read_uff(folder / POINTS)
    names = [row.channel for row in read_table(folder / "channels.csv", ChannelRow)]
    names = names[-len(functions) :]
    columns = {"frequency [Hz]": functions[0].abscissa}
    for name, function in zip(names, functions, strict=True):
        columns[f"{name} real [mm/N]"] = 1e3 * function.values.real
        columns[f"{name} imag [mm/N]"] = 1e3 * function.values.imag
    pd.DataFrame(columns).to_csv((folder / POINTS).with_suffix(".csv"), index=False)
    toml = folder / "platform.toml"
    toml.write_text(toml.read_text().replace(POINTS, POINTS.replace(".uff", ".csv")))


def test_driving_points_of_a_table_are_those_of_the_file(points, points_folder):
    stated_as_table(points)
    cars = [read_platform(each).fleet.vehicles[0] for each in (points, points_folder)]
    np.testing.assert_allclose(*(car.receptance.values for car in cars), rtol=1e-6, atol=1e-20)


def rewritten(change):
    """Write the driving points of the first vehicle again, changed."""

    def fault(folder):
        functions = [change(each) for each in read_uff(folder / POINTS)]
        write_uff(folder / POINTS, functions)

    return fault


def with_one_between_two(folder):
    first, second, *others = read_uff(folder / POINTS)
    between = replace(first, response_direction=second.response_direction)
    write_uff(folder / POINTS, [first, second, *others, between])


def with_receptance_too(folder):
    toml = folder / "platform.toml"
    line = f'driving_points = "{POINTS}"'
    toml.write_text(toml.read_text().replace(line, f'{line}\nreceptance = "{POINTS}"'))


def without_a_column(folder):
    stated_as_table(folder)
    table = (folder / POINTS).with_suffix(".csv")
    pd.read_csv(table).drop(columns="EnM y real [mm/N]").to_csv(table, index=False)


def in_another_unit(folder):
    stated_as_table(folder)
    table = (folder / POINTS).with_suffix(".csv")
    table.write_text(table.read_text().replace("mm/N", "Pa/N"))


def half_of_the_lines(function):
    return replace(function, abscissa=function.abscissa[::2], values=function.values[::2])


WRONG_POINTS = {
    "vehicle U06-1: its lines are not those of the noise transfer functions: ": rewritten(
        half_of_the_lines
    ),
    r"vehicle U06-1: driving point 'EnM x' \(.* is not in it: .*acceleration": rewritten(
        lambda each: replace(each, ordinate="acceleration", ordinate_unit="m/s^2")
    ),
    "its receptance gives energy at EnM x: check the sign": rewritten(
        lambda each: replace(each, values=-each.values)
    ),
    "vehicle U06-1: the file has EnM y per EnM x, which is no driving .* key 'receptance'": (
        with_one_between_two
    ),
    "the receptance has the driving points in it: keep one of both keys": with_receptance_too,
    "vehicle U06-1: driving point 'EnM y': there is no column 'EnM y real": without_a_column,
    "vehicle U06-1: driving point 'EnM x' is in 'Pa/N': export it in m/N": in_another_unit,
}


@pytest.mark.parametrize("sentence", WRONG_POINTS)
def test_driving_points_that_do_not_fit_are_named(points, sentence):
    WRONG_POINTS[sentence](points)
    with pytest.raises(InputError, match=sentence):
        read_platform(points)


def test_the_bench_writes_receptances_or_driving_points(tmp_path):
    with pytest.raises(InputError, match="write one of both"):
        write_platform(tmp_path / "p", 1, receptance=True, driving_points=True)


FAULTS = {"conjugated": np.conj, "reversed": np.negative, "inverse": np.reciprocal}
NOISES = (0.01, 0.05, 0.1)


def body_and_functions(kind, seed):
    """One car of a family: its transfer functions and its receptance, without errors."""
    fleet = draw_family(kind, seed, 1).fleet()
    body = fleet.bodies["U06-1"]
    transfer = noise_transfer(body, fleet.cabin, FREQUENCY)[:, np.newaxis]
    heard = Frf(FREQUENCY, transfer, ("ear",), fleet.paths, "Pa/N")
    return heard, receptance(body, FREQUENCY)


def noisy(values, noise, generator):
    parts = generator.standard_normal((2, *values.shape))
    return values * (1 + noise * (parts[0] + 1j * parts[1]) / np.sqrt(2))


def vehicle_of(heard, values):
    paths = heard.inputs
    return Vehicle("U06-1", "U06", heard, Frf(FREQUENCY, values, paths, paths, "m/N"))


@pytest.mark.parametrize("kind", [BRACKETS, *KINDS])
def test_right_functions_of_every_family_pass_and_wrong_ones_are_named(kind):
    generator = np.random.default_rng(7)
    for seed in range(2, 6):
        heard, true = body_and_functions(kind, seed)
        for noise in NOISES:
            values = noisy(true, noise, generator)
            vehicle_of(heard, values)
            points_alone = np.eye(len(heard.inputs))
            vehicle_of(heard, values * points_alone)
            for fault in FAULTS.values():
                with pytest.raises(InputError, match="its receptance gives energy at"):
                    vehicle_of(heard, fault(values) * points_alone)
                with pytest.raises(InputError, match="its receptance"):
                    vehicle_of(heard, fault(values))
                row, column = generator.choice(len(heard.inputs), 2, replace=False)
                wrong = values.copy()
                wrong[:, row, column] = fault(values[:, row, column])
                with pytest.raises(InputError, match="check both") as refused:
                    vehicle_of(heard, wrong)
                for path in (heard.inputs[row], heard.inputs[column]):
                    assert path in str(refused.value)


@pytest.mark.parametrize("kind", [BRACKETS, *KINDS])
def test_a_driving_point_that_is_reversed_or_inverse_is_named(kind):
    """A conjugated one, too, unless noise hides its losses, as along y of stiff brackets."""
    generator = np.random.default_rng(8)
    heard, true = body_and_functions(kind, 3)
    values = noisy(true, 0.05, generator)
    for path, name in enumerate(heard.inputs):
        for fault, change in FAULTS.items():
            wrong = values.copy()
            wrong[:, path, path] = change(values[:, path, path])
            if fault == "conjugated" and kind == BRACKETS and name.endswith("y"):
                continue
            with pytest.raises(InputError, match=f"at {name}"):
                vehicle_of(heard, wrong)


def test_the_noise_of_functions_follows_from_what_is_not_reciprocal():
    generator = np.random.default_rng(9)
    for kind in (BRACKETS, "attachments"):
        _, true = body_and_functions(kind, 4)
        for noise in NOISES:
            estimate = relative_noise(noisy(true, noise, generator))
            assert estimate == pytest.approx(noise, rel=0.05)
