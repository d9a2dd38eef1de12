"""The stiffness of one run: its mean for the reader, and mounts that cannot be real."""

from dataclasses import replace

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.measurement.channels import Spectrum
from deboom.measurement.load_case import LoadCase
from deboom.mounts.mount import Mount
from deboom.mounts.operating_stiffness import mean_operating_stiffness, refuse_active_mounts

FREQUENCY = np.arange(20.0, 41.0)
STIFFNESS = 300e3 * (1 + 0.12j) * (FREQUENCY / 30.0) ** 0.2
DU = Mount("Du", "wishbone", ("left", "right"), ((0, -1, 0), (0, 1, 0)), ("x",))


def run(stiffness=STIFFNESS, scale_right=1.0):
    """Two pieces in x that move alike; the right one may be stiffer."""
    names = ("Du left x", "Du right x")
    motion = 1e-4 * np.exp(1j * FREQUENCY)[:, None] * np.ones(2)
    force = stiffness[:, None] * motion * [1.0, scale_right]
    return LoadCase(
        "run",
        "a run",
        5,
        3.4,
        220.0,
        1.5,
        Spectrum(FREQUENCY, motion, names, "m"),
        Spectrum(FREQUENCY, force, names, "N"),
    )


def test_mean_is_over_lines_of_the_band_and_over_pieces():
    inside = (FREQUENCY >= 25) & (FREQUENCY <= 30)
    wanted = np.abs(STIFFNESS[inside]).mean() * 1.1
    found = mean_operating_stiffness(DU, run(scale_right=1.2), (25.0, 30.0))
    assert found[0] == pytest.approx(wanted, rel=1e-12)
    assert np.isnan(found[1:]).all()


def test_a_band_without_lines_is_refused():
    with pytest.raises(InputError, match="no line between 50 and 60"):
        mean_operating_stiffness(DU, run(), (50.0, 60.0))


def test_a_real_mount_passes_and_so_does_one_that_is_barely_askew():
    refuse_active_mounts(run())
    refuse_active_mounts(run(STIFFNESS.real * (1 - 0.04j)))


def test_opposite_signs_and_conjugated_spectra_are_named():
    with pytest.raises(InputError, match=r"run: channel 'Du left x' has a negative stiffness"):
        refuse_active_mounts(run(-STIFFNESS))
    with pytest.raises(InputError, match=r"channel 'Du right x' has a negative stiffness"):
        refuse_active_mounts(run(scale_right=-1.0))
    with pytest.raises(InputError, match=r"negative loss factor of -0\.12 .* e\^\(\+jωt\)"):
        refuse_active_mounts(run(STIFFNESS.conj()))


def test_noise_of_single_lines_does_not_count():
    case = run()
    force = case.force.values.copy()
    force[3] *= -1
    noisy = replace(case, force=replace(case.force, values=force))
    refuse_active_mounts(noisy)
