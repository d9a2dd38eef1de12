"""Nested analysis of variance: by hand, against the moments of known effects, against one level."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.measurement.channels import Frf
from deboom.measurement.level_spread import level_spread, noise_transfer_levels
from deboom.measurement.variance_split import variance_split


def test_by_hand():
    """Vehicle means 3 and 7, state means 2 4 | 6 8, repeats +-1 around them."""
    values = np.array([[[1.0, 3.0], [3.0, 5.0]], [[5.0, 7.0], [7.0, 9.0]]])
    split = variance_split(values)
    assert split.levels == ("vehicle", "state", "repeat")
    assert split.degrees_of_freedom == (1, 2, 4)
    # MS: 4 ((3-5)² + (7-5)²)/1; 2 (4·1²)/2; (8·1²)/4
    np.testing.assert_allclose(split.mean_square, [32.0, 4.0, 2.0])
    np.testing.assert_allclose(split.estimate, [7.0, 1.0, 2.0])
    np.testing.assert_allclose(split.share, [0.7, 0.1, 0.2])
    np.testing.assert_allclose(
        split.standard_error,
        [
            np.sqrt(2 * 32**2 / 1 + 2 * 4**2 / 2) / 4,
            np.sqrt(2 * 4**2 / 2 + 2 * 2**2 / 4) / 2,
            np.sqrt(2 * 2**2 / 4),
        ],
    )


def test_sums_of_squares_add_up():
    values = np.random.default_rng(1).normal(size=(4, 3, 5))
    split = variance_split(values)
    total = np.sum((values - values.mean()) ** 2)
    assert split.mean_square @ split.degrees_of_freedom == pytest.approx(total, rel=1e-12)


def test_one_level_is_the_sample_variance():
    values = np.random.default_rng(2).normal(size=(9, 7))
    split = variance_split(values, ("vehicle",))
    np.testing.assert_allclose(split.estimate[0], values.var(axis=0, ddof=1), rtol=1e-12)
    complex_values = values + 2j * values[::-1]
    split = variance_split(complex_values, ("vehicle",))
    expected = complex_values.real.var(axis=0, ddof=1) + complex_values.imag.var(axis=0, ddof=1)
    np.testing.assert_allclose(split.estimate[0], expected, rtol=1e-12)


@pytest.mark.parametrize("is_complex", [False, True])
def test_known_components_are_recovered_without_bias_and_with_the_stated_error(is_complex):
    """3000 designs of 5 vehicles, 3 states and 4 repeats with deviations 3, 1 and 0.5."""
    generator = np.random.default_rng(5)
    deviations, n = (3.0, 1.0, 0.5), 3000

    def draw(*shape):
        real = generator.normal(size=shape)
        return (real + 1j * generator.normal(size=shape)) / np.sqrt(2) if is_complex else real

    values = (
        deviations[0] * draw(5, 1, 1, n)
        + deviations[1] * draw(5, 3, 1, n)
        + deviations[2] * draw(5, 3, 4, n)
    )
    split = variance_split(values)
    true = np.square(deviations)
    scatter = split.estimate.std(axis=1)
    assert np.all(np.abs(split.estimate.mean(axis=1) - true) < 4 * scatter / np.sqrt(n))
    # the stated error squared is unbiased up to the known factor 1 + 2/df of MS²
    assert np.sqrt(np.mean(split.standard_error**2, axis=1)) == pytest.approx(scatter, rel=0.3)


def test_a_component_below_zero_is_reported_as_it_is_and_shares_nothing():
    values = np.array([[[0.0, 2.0], [2.0, 0.0]], [[0.0, 2.0], [2.0, 0.0]]])
    split = variance_split(values)
    assert split.estimate[1] < 0
    np.testing.assert_allclose(split.share, [0.0, 0.0, 1.0])


def test_what_cannot_be_split_is_refused():
    with pytest.raises(InputError, match=r"at least two of each .* 5 x 1 x 4"):
        variance_split(np.zeros((5, 1, 4)))
    with pytest.raises(InputError, match="at least two of each"):
        variance_split(np.zeros(5))
    with pytest.raises(InputError, match="finite"):
        variance_split(np.full((2, 2, 2), np.nan))


def test_spread_of_levels():
    frequency = np.array([20.0, 30.0])
    vehicles = [
        Frf(frequency, np.full((2, 1, 1), 2e-5 * gain), ("ear",), ("TSM x",), "Pa/N")
        for gain in (1.0, 10.0, 100.0)
    ]
    spread = level_spread(noise_transfer_levels(vehicles))
    np.testing.assert_allclose(spread.range, 40.0)
    np.testing.assert_allclose(spread.mean, 20.0)
    assert spread.quantile(0.9) == pytest.approx(40.0)
    with pytest.raises(InputError, match="vehicle 2 has other ears"):
        noise_transfer_levels(
            [vehicles[0], Frf(frequency, np.ones((2, 1, 1)), ("ear",), ("EnM x",), "Pa/N")]
        )
    with pytest.raises(InputError, match="vehicle 2 has other frequency lines"):
        noise_transfer_levels(
            [vehicles[0], Frf(frequency + 1, np.ones((2, 1, 1)), ("ear",), ("TSM x",), "Pa/N")]
        )
    with pytest.raises(InputError, match="give at least one"):
        noise_transfer_levels([])
    with pytest.raises(InputError, match="at least two vehicles"):
        level_spread(np.zeros((1, 5)))
    with pytest.raises(InputError, match="finite levels"):
        level_spread([[0.0], [-np.inf]])
