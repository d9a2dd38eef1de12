"""The alarm for mounts at an unstated angle: raised where one stands, silent where none does."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from deboom.measurement.channels import LoadCase, Spectrum
from deboom.measurement.sensors import Tolerances
from deboom.mounts.cross_stiffness import cross_stiffness, cross_stiffness_of_runs
from deboom.mounts.mount import Mount

LINES = np.linspace(20.0, 80.0, 121)
ALONG = np.diag([120e3, 100e3, 420e3]) * (1 + 0.1j)


LABORATORY = Tolerances(
    sensor_angle=np.deg2rad(0.5), sensor_cross_axis=0.01, shaker_angle=np.deg2rad(0.5)
)
"""A careful one; sensors and shaker of a class are turned by up to 5 times as much."""


def run(torque, angle, seed, cross=0.0, about="y", along=ALONG):
    """One run in vehicle axes: a smooth motion, and the force of a mount that is turned."""
    generator = np.random.default_rng(seed)
    place = np.linspace(0, 1, LINES.size)[:, np.newaxis]
    terms = generator.normal(size=(4, 3)) + 1j * generator.normal(size=(4, 3))
    waves = [np.ones_like(place), np.exp(3j * place), np.exp(-5j * place), np.exp(8j * place)]
    moved = 1e-4 * sum(wave * term for wave, term in zip(waves, terms, strict=True))
    angles = [angle if axis in about else 0.0 for axis in "xyz"]
    turn = Rotation.from_euler("xyz", angles, degrees=True).as_matrix()
    stiffness = turn @ along @ turn.T * (1 + 2e-3 * torque)
    skewed = np.array([[0, cross, 0], [-cross, 0, cross], [0, -cross, 0]])
    force = moved @ (stiffness + skewed).T
    force = force * (1 + 2e-3 * generator.normal(size=force.shape))
    return moved, force, np.stack([np.full(LINES.size, torque), LINES], axis=1)


def judged(angle, cross=0.0, about="y", along=ALONG):
    runs = [
        run(torque, angle, seed, cross, about, along)
        for seed, torque in enumerate((60.0, 120.0, 220.0), 1)
    ]
    moved, force, state = (np.vstack([each[k] for each in runs]) for k in range(3))
    return cross_stiffness("GeM", moved, force, state, LABORATORY)


@pytest.mark.parametrize("angle", [10.0, 30.0, -25.0])
def test_an_unstated_angle_is_named(angle):
    finding = judged(angle)
    assert finding.clear
    assert finding.decided[1]
    np.testing.assert_allclose(np.rad2deg(finding.angles), [0.0, angle, 0.0], atol=0.1)
    assert f"ry = {np.rad2deg(finding.angles[1]):.0f} ± " in finding.sentence


def test_an_angle_that_makes_no_difference_is_not_named():
    finding = judged(25.0, along=np.diag([110e3, 400e3, 110e3]) * (1 + 0.1j))
    assert not finding.clear  # x and z are alike: a turn about y changes nothing
    both = judged(25.0, about="xy", along=np.diag([110e3, 110e3, 400e3]) * (1 + 0.1j))
    assert both.clear
    assert not both.decided[2]  # a turn about the mount's main axis changes nothing
    assert "do not decide" in both.sentence


def test_parallel_mounts_raise_no_alarm():
    assert not judged(0.0).clear
    assert not judged(0.5).clear  # within what sensors askew show


def test_cross_stiffness_that_no_angle_explains_is_said():
    finding = judged(0.0, cross=8e4)
    assert finding.clear
    assert "no angle explains it" in finding.sentence


def test_a_stated_angle_is_no_alarm():
    moved, force, *_ = run(0.0, 30.0, 1)
    names = ("GeM x", "GeM y", "GeM z")
    spectra = (Spectrum(LINES, v, names, u) for v, u in ((moved, "m"), (force, "N")))
    case = LoadCase("r", "r", 5, 4.0, 220.0, 1.5, *spectra)
    stated = ((0.0, np.deg2rad(30.0), 0.0),)
    for rotations, alarm in (((), True), (stated, False)):
        mount = Mount("GeM", "", ("",), ((0.0, 0.0, 0.0),), ("x", "y", "z"), rotations=rotations)
        (finding,) = cross_stiffness_of_runs([mount], [case])
        assert finding.clear == alarm
