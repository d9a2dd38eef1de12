"""Receptances of a platform's bodies: written by the bench, read, and refused where wrong."""

from __future__ import annotations

import shutil

import numpy as np
import pytest

from deboom.bench.families import BRACKETS, KINDS, draw_family
from deboom.bench.fleet import load_fleet, noise_transfer, receptance
from deboom.bench.layout import FREQUENCY
from deboom.bench.platform_writer import write_platform
from deboom.errors import InputError
from deboom.files.platform import read_platform
from deboom.measurement.channels import Frf
from deboom.vehicles.booming_model import Motion, booming_model
from deboom.vehicles.coupled_motion import FlexibleMotion
from deboom.vehicles.fleet import Vehicle, relative_noise


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
    with pytest.raises(InputError, match="go with bodies at rest: leave the receptances"):
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
            vehicle_of(heard, values * np.eye(len(heard.inputs)))  # driving points alone
            for fault in FAULTS.values():
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
