"""Two acquisitions of one vehicle and what they do to its sound."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.measurement.channels import Frf, Spectrum
from deboom.vehicles.noise_transfer import compare_noise_transfer

FREQUENCY = np.linspace(20.0, 40.0, 41)
RNG = np.random.default_rng(6)
PATHS = ("EnM x", "TSM x")
VALUES = RNG.normal(size=(41, 1, 2)) + 1j * RNG.normal(size=(41, 1, 2))
FORCE = Spectrum(FREQUENCY, RNG.normal(size=(41, 2)) + 1j, PATHS, "N")


def ntf(values=VALUES, ear="driver ear", paths=PATHS, frequency=FREQUENCY):
    return Frf(frequency, values, (ear,), paths, "Pa/N")


def test_a_calibration_error_is_all_scale_and_no_shape():
    found = compare_noise_transfer(ntf(), ntf(1.1 * VALUES), FORCE)
    np.testing.assert_allclose(found.corr_f, 0.0, atol=1e-12)
    np.testing.assert_allclose(found.corr_s, 0.1, rtol=1e-12)
    np.testing.assert_allclose(found.level_difference, 20 * np.log10(1.1))
    np.testing.assert_allclose(found.spl_difference, 20 * np.log10(1.1))


def test_contributions_stay_apart_and_sum_to_the_pressure():
    second = VALUES.copy()
    second[:, :, 1] *= -1
    found = compare_noise_transfer(ntf(), ntf(second[:, :, ::-1], paths=PATHS[::-1]), FORCE)
    assert found.paths == PATHS
    np.testing.assert_allclose(found.contributions[1, :, 0], found.contributions[0, :, 0])
    np.testing.assert_allclose(found.contributions[1, :, 1], -found.contributions[0, :, 1])
    by_hand = VALUES[:, 0, 0] * FORCE.values[:, 0] + VALUES[:, 0, 1] * FORCE.values[:, 1]
    np.testing.assert_allclose(found.pressure[0], by_hand)


def test_mixed_microphones_missing_paths_and_other_lines_are_refused():
    with pytest.raises(InputError, match="different microphones cannot be compared"):
        compare_noise_transfer(ntf(), ntf(ear="passenger ear"), FORCE)
    with pytest.raises(InputError, match=r"second set has no noise transfer function of \['TSM x'"):
        compare_noise_transfer(ntf(), ntf(paths=("EnM x", "GeM x")), FORCE)
    with pytest.raises(InputError, match="first set and the forces have different"):
        compare_noise_transfer(ntf(frequency=FREQUENCY + 1), ntf(), FORCE)
