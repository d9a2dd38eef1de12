from __future__ import annotations

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.physics.sound_level import spl
from deboom.vehicles.booming_model import checked_designs, levels, mean_energy_level, path_pressures
from deboom.vehicles.booming_model import pressure_1 as pressure
from deboom.vehicles.fleet import PathContributions

FREQUENCY = np.array([20.0, 30.0, 40.0])
VARIABLES = ("TSM x", "TSM y")


def _contributions():
    rng = np.random.default_rng(1)
    values = rng.normal(size=(4, 3, 2)) + 1j * rng.normal(size=(4, 3, 2))
    return PathContributions("g5", FREQUENCY, values, ("a", "b", "c", "d"), VARIABLES)


def test_paths_add_up_to_the_pressure_and_the_pressure_to_the_level():
    contributions = _contributions()
    designs = np.random.default_rng(2).uniform(0.8, 1.2, (5, 2))
    paths = path_pressures(contributions, designs)
    total = pressure(contributions, designs)
    assert paths.shape == (5, 4, 3, 2)
    np.testing.assert_allclose(paths.sum(axis=-1), total, rtol=1e-13)
    by_hand = contributions.values[3, 1, 0] * designs[4, 0]
    by_hand += contributions.values[3, 1, 1] * designs[4, 1]
    assert total[4, 3, 1] == pytest.approx(by_hand, rel=1e-13)
    level = levels(contributions, designs)
    assert level.shape == (5, 4, 3)
    np.testing.assert_allclose(level[2, 1], spl(total[2, 1], FREQUENCY), rtol=1e-13)


def test_mean_energy_of_equal_levels_is_the_level_whatever_the_number_of_lines():
    lines = np.linspace(20.0, 60.0, 161)
    level = np.full((2, 161), 63.0)
    np.testing.assert_allclose(mean_energy_level(level, lines, (25.0, 40.0)), [63.0, 63.0])


def test_mean_energy_counts_the_edges_of_the_band_and_nothing_beyond():
    level = np.array([90.0, 60.0, 70.0, 95.0])
    lines = np.array([24.9, 25.0, 40.0, 40.1])
    expected = 10 * np.log10((1e6 + 1e7) / 2)
    assert mean_energy_level(level, lines, (25.0, 40.0)) == pytest.approx(expected, abs=1e-12)


def test_mean_energy_refuses_a_band_without_a_line():
    with pytest.raises(InputError, match="no line between 41"):
        mean_energy_level(np.ones(3), FREQUENCY, (41.0, 45.0))


@pytest.mark.parametrize(
    ("designs", "message"),
    [
        (np.ones(2), r"designs of shape \(2,\).*2 factors \['TSM x', 'TSM y'\]"),
        (np.ones((3, 1)), r"designs of shape \(3, 1\)"),
        ([[1.0, 1.0], [1.0, np.nan]], "design 1: the factor of TSM y is nan"),
        ([[np.inf, 1.0]], "design 0: the factor of TSM x is inf"),
    ],
)
def test_designs_are_checked(designs, message):
    with pytest.raises(InputError, match=message):
        checked_designs(designs, VARIABLES)
    with pytest.raises(InputError, match=message):
        levels(_contributions(), designs)
