"""SPLV against hand calculation, the mount forces it stands for, and differences."""

from __future__ import annotations

import numpy as np
import pytest

from deboom.measurement.channels import Frf, LoadCase, Spectrum
from deboom.mounts.mount import Mount
from deboom.physics.dynamic_stiffness import dynamic_stiffness
from deboom.physics.transfer_path import pressure as summed_pressure
from deboom.vehicles.booming_model import BoomingModel, booming_model
from deboom.vehicles.fleet import Fleet, PathContributions, Vehicle, path_contributions


def test_two_paths_by_hand():
    """At 1 kHz, where A is 0 dB, and at 100 Hz, where IEC 61672-1 gives -19.1 dB."""
    values = np.array([[[3e-3, 4e-3j], [3e-3, 4e-3j]]])
    case = PathContributions("g5", np.array([100.0, 1000.0]), values, ("A",), ("TSM x", "Du x"))
    index = BoomingModel((case,), (1.0,))
    # |p| = 5 mPa: 20 lg(5e-3 / (√2 · 2e-5)) = 20 lg 176.7767 = 44.9485 dB
    # |p| = 3 mPa with the second path off: 20 lg 106.0660 = 40.5115 dB
    # |p| = |1.5 + 8j| mPa: 20 lg 287.7716 = 49.1810 dB
    found = index([[1.0, 1.0], [1.0, 0.0], [0.5, 2.0]])[:, 0]
    unweighted = 2 * np.array([44.9485, 40.5115, 49.1810])
    assert np.ptp(found - unweighted) < 3e-4
    np.testing.assert_allclose(found - unweighted, -19.1, atol=0.05)


def test_prescribed_motion_scales_the_stiffness_of_each_piece():
    """``p = Σ_paths Y Σ_pieces x K s`` with K = f/s of each line and piece."""
    rng = np.random.default_rng(1)
    frequency = np.linspace(20.0, 60.0, 41)
    channels = ("TSM x", "TSM z", "Du left x", "Du right x")
    paths = ("TSM x", "TSM z", "Du x")
    mounts = (
        Mount("TSM", "strut", ("",), ((0.2, 0.0, -0.3),), ("x", "z")),
        Mount("Du", "wishbone", ("left", "right"), ((0, -0.7, 0), (0, 0.7, 0)), ("x",)),
    )

    def random(*shape):
        return rng.normal(size=shape) + 1j * rng.normal(size=shape)

    motion, force = 1e-4 * random(41, 4), 100 * random(41, 4)
    case = LoadCase(
        *("g5", "5th gear", 5, 3.4, 220.0, 1.5),
        Spectrum(frequency, motion, channels, "m"),
        Spectrum(frequency, force, channels, "N"),
    )
    ntf = 1e-3 * random(41, 1, 3)
    fleet = Fleet((Vehicle("A-1", "A", Frf(frequency, ntf, ("ear",), paths, "Pa/N")),))

    design = rng.uniform(0.8, 1.2, 6)
    factor = dict(zip(("TSM x", "TSM y", "TSM z", "Du x", "Du y", "Du z"), design, strict=True))
    stiffness = dynamic_stiffness(force, motion)
    scale = [factor["TSM x"], factor["TSM z"], factor["Du x"], factor["Du x"]]
    piece = stiffness * scale * motion
    path = np.column_stack([piece[:, 0], piece[:, 1], piece[:, 2] + piece[:, 3]])
    expected = summed_pressure(ntf[:, 0], path)

    contributions = path_contributions(fleet, mounts, case)
    assert contributions.variable_names == tuple(factor)
    assert not contributions.values[..., [1, 4, 5]].any()
    found = contributions.pressure(design[np.newaxis])[0, 0]
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    level = 20 * np.log10(np.abs(expected) / (np.sqrt(2) * 20e-6)) + _weighting(frequency)
    index = booming_model(fleet, mounts, [(case, 2.0)], (20.0, 60.0))
    assert index(design[np.newaxis])[0, 0] == pytest.approx(level.sum(), abs=41 * 0.005)


def _weighting(frequency):
    """A-weighting with the rounded poles that the standard prints, good to 0.005 dB."""
    f2 = frequency**2
    ratio = 12194**2 * f2**2 / ((f2 + 20.60**2) * (f2 + 12194**2))
    return 20 * np.log10(ratio / np.sqrt((f2 + 107.7**2) * (f2 + 737.9**2))) + 2.000
