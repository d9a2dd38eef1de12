"""Fronts: what stays, in which order, with which volume, and what verification says."""

from dataclasses import replace

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.explore.design_space import stiffness_factor_space
from deboom.explore.evaluate import ResponseFunction
from deboom.explore.fronts import ParetoFront, hypervolume, nondominated, pareto_front, verify
from deboom.explore.robust import RobustResponse, RobustValues
from deboom.explore.tolerance_samples import FreshGaussianSampler, sobol_sample


def values(objectives, designs=None, failed=None):
    objectives = np.asarray(objectives, dtype=float)
    n = len(objectives)
    designs = np.arange(float(n))[:, None] if designs is None else np.asarray(designs, dtype=float)
    return RobustValues(
        designs=designs,
        mean=objectives[:, :1],
        sigma=objectives[:, 1:],
        mean_sum=objectives[:, 0],
        sigma_sum=objectives[:, 1],
        standard_error_mean_sum=np.zeros(n),
        standard_error_sigma_sum=np.zeros(n),
        failed=np.zeros(n, dtype=bool) if failed is None else np.asarray(failed),
    )


def test_a_front_keeps_what_no_other_beats_sorted_by_the_mean():
    front = pareto_front(values([[3, 1], [1, 3], [2, 2], [2.5, 2.5], [1, 4], [2, 3]]))
    np.testing.assert_array_equal(front.objectives, [[1, 3], [2, 2], [3, 1]])
    np.testing.assert_array_equal(front.designs[:, 0], [1, 2, 0])


def test_failed_designs_are_never_on_a_front():
    front = pareto_front(values([[1, 1], [np.nan, np.nan], [0, 0]], failed=[False, True, True]))
    np.testing.assert_array_equal(front.objectives, [[1, 1]])
    assert len(pareto_front(values([[np.nan, np.nan]], failed=[True]))) == 0


def test_equal_designs_leave_one_and_order_does_not_matter():
    rows = [[1.0, 2.0], [1.0, 2.0], [2.0, 1.0], [1.5, 1.5], [1.5, 1.5]]
    designs = [[5.0], [4.0], [3.0], [1.0], [2.0]]
    expected = [[4.0], [1.0], [3.0]]
    for order in ([0, 1, 2, 3, 4], [4, 3, 2, 1, 0], [1, 4, 0, 3, 2]):
        one = values(np.array(rows)[order], np.array(designs)[order])
        np.testing.assert_array_equal(pareto_front(one).designs, expected)
        parts = [values(np.array(rows)[[i]], np.array(designs)[[i]]) for i in order]
        np.testing.assert_array_equal(pareto_front(*parts).designs, expected)
        np.testing.assert_array_equal(
            pareto_front(pareto_front(*parts[:3]), *parts[3:]).designs, expected
        )


def test_nondominated_against_the_definition():
    points = np.random.default_rng(3).integers(0, 12, (80, 2)).astype(float)
    brute = np.array(
        [
            not any(
                (np.all(other <= point) and np.any(other < point))
                or (np.all(other == point) and j < i)
                for j, other in enumerate(points)
            )
            for i, point in enumerate(points)
        ]
    )
    np.testing.assert_array_equal(nondominated(points), brute)
    assert nondominated(np.empty((0, 2))).shape == (0,)


def test_only_a_sorted_front_is_called_one():
    good = pareto_front(values([[1, 3], [2, 2]]))
    columns = {name: getattr(good, name)[::-1] for name in good.__dataclass_fields__}
    with pytest.raises(InputError, match="not a sorted Pareto front"):
        ParetoFront(**columns)


def test_hypervolume_by_hand():
    points = np.array([[1.0, 3.0], [2.0, 2.0], [3.0, 1.0], [9.0, 0.0]])
    assert hypervolume(points, [4.0, 4.0]) == pytest.approx(3 + 2 + 1)
    assert hypervolume(points[:0], [4.0, 4.0]) == 0.0
    with pytest.raises(InputError, match="finite"):
        hypervolume(np.array([[np.nan, 1.0]]), [4.0, 4.0])


SPACE = stiffness_factor_space(("a", "b"))


def rising(designs):
    """Return responses that scatter the more, the better their mean."""
    return -np.exp(3.0 * designs)


def robust(function=rising, sampler=None, nominal_mean=False):
    model = ResponseFunction(function, ("a", "b"), ("u", "v"), "dB")
    return RobustResponse(model, SPACE, sampler or sobol_sample(2, 64, seed=1), nominal_mean)


def searched(response, n=200):
    designs = 0.8 + 0.4 * np.random.default_rng(1).random((n, 2))
    return pareto_front(response(designs))


def test_verification_uses_draws_of_its_own_and_keeps_the_rows():
    front = searched(robust())
    check = verify(front, robust(), 256, seed=1)
    np.testing.assert_array_equal(check.values.designs, front.designs)
    direct = replace(robust(), sample=sobol_sample(2, 256, seed=1, purpose="verification sample"))
    np.testing.assert_array_equal(check.values.sigma, direct(front.designs).sigma)
    relative = (front.sigma_sum - check.values.sigma_sum) / check.values.sigma_sum
    assert check.sigma_bias_percent == pytest.approx(100.0 * relative.mean())
    assert check.mean_bias == pytest.approx((front.mean_sum - check.values.mean_sum).mean())
    np.testing.assert_array_equal(check.nondominated, nondominated(check.values.objectives))
    assert (check.n_samples, check.seed) == (256, 1)


def test_verification_exposes_the_optimism_of_fresh_draws():
    shared = verify(searched(robust()), robust(), seed=1)
    lucky = robust(sampler=FreshGaussianSampler(2, 20, seed=1))
    fresh = verify(searched(lucky, 500), lucky, seed=1)
    assert abs(shared.sigma_bias_percent) < 5.0
    assert fresh.sigma_bias_percent < -10.0


def test_verification_keeps_the_meaning_of_the_mean():
    nominal = robust(nominal_mean=True)
    check = verify(searched(nominal), nominal, 64, seed=1)
    assert check.mean_bias == 0.0


def test_a_front_without_scatter_has_no_bias():
    response = replace(robust(), space=replace(SPACE, tolerance=np.zeros(2)))
    check = verify(searched(response), response, 64, seed=1)
    assert check.sigma_bias_percent == 0.0


def test_a_design_that_fails_under_the_new_draws_is_left_out_and_counted_as_beaten():
    def narrow(designs):
        return np.where(designs[:, :1] > 1.2 * 1.14, np.nan, rising(designs))

    front = pareto_front(values([[1.0, 2.0], [2.0, 1.0]], [[0.9, 1.1], [1.2, 1.1]]))
    check = verify(front, robust(narrow), 1024, seed=1)
    np.testing.assert_array_equal(check.values.failed, [False, True])
    np.testing.assert_array_equal(check.nondominated, [True, False])
    assert np.isfinite(check.sigma_bias_percent)


def test_a_front_that_fails_altogether_is_refused():
    front = searched(robust())
    broken = robust(lambda designs: np.full((len(designs), 2), np.nan))
    with pytest.raises(InputError, match="none of the"):
        verify(front, broken, 64, seed=1)
