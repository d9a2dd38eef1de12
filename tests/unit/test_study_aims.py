"""What a study's options make of a search's objectives."""

from dataclasses import dataclass

import numpy as np
import pytest

from deboom.explore.design_space import stiffness_factor_space
from deboom.explore.tolerance_samples import sobol_sample
from deboom.study.aims import Aim, aim_note, robust_response


@dataclass(frozen=True)
class TwoVehicles:
    """One response is linear, the other quadratic in two factors."""

    variable_names: tuple[str, ...] = ("a x", "a y")
    response_names: tuple[str, ...] = ("one", "two")
    response_unit: str = "dB"

    def __call__(self, designs):
        """Return both responses, shape (n, 2)."""
        return np.column_stack([designs[:, 0], 3 * designs[:, 1] ** 2])


MODEL = TwoVehicles()
SPACE = stiffness_factor_space(MODEL.variable_names, 0.2, 0.15)
SAMPLE = sobol_sample(2, 128, seed=1)


def values(aim, **changes):
    return robust_response(MODEL, SPACE, SAMPLE, aim, **changes)(np.ones((1, 2)))


def test_each_aim_minimises_what_it_says():
    mean = values(Aim.mean)
    np.testing.assert_array_equal(mean.objectives, [[mean.mean_sum[0], mean.sigma_sum[0]]])
    worst = values(Aim.worst)
    np.testing.assert_array_equal(worst.objectives[0], [mean.mean.max(), mean.sigma.max()])
    quantile, tail = values(Aim.quantile).objectives[0], values(Aim.tail).objectives[0]
    assert mean.mean_sum[0] < quantile[0] < tail[0]
    assert quantile[1] == tail[1] == mean.sigma_sum[0]


def test_control_variate_knows_a_parabola_exactly():
    exact = 1 + 3 * (1 + 0.05**2 * 0.9733369246625415)  # variance of a normal cut at 3 sigma
    off = abs(values(Aim.mean).mean_sum[0] - exact)
    assert values(Aim.mean, control_variate=True).mean_sum[0] == pytest.approx(exact, abs=1e-12)
    assert off > 1e-7


def test_only_other_objectives_need_a_note():
    assert aim_note(robust_response(MODEL, SPACE, SAMPLE)) == ""
    text = aim_note(robust_response(MODEL, SPACE, SAMPLE, Aim.tail))
    assert "mean of the worst 5 %, sum" in text
