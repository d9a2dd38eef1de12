"""Receptances of a platform's bodies: written by the bench, read, and refused where wrong."""

from __future__ import annotations

import shutil

import numpy as np
import pytest

from deboom.bench.fleet import load_fleet, receptance
from deboom.bench.layout import FREQUENCY
from deboom.bench.platform_writer import write_platform
from deboom.errors import InputError
from deboom.files.platform import read_platform
from deboom.vehicles.booming_model import Motion, booming_model
from deboom.vehicles.coupled_motion import FlexibleMotion


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
