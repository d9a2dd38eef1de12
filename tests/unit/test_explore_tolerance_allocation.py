"""Tolerances as a choice; draws, structures and part numbers of manufacturing scatter."""

from dataclasses import replace

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.explore.front import verification_response
from deboom.explore.moments import Estimator, Objective
from deboom.explore.robust import Robust
from deboom.explore.scatter import (
    FreshGaussianSampler,
    PartNumber,
    ToleranceSample,
    ToleranceStructure,
    cut_normal_moments,
    gaussian_sample,
    part_structure,
    sobol_sample,
)
from deboom.explore.search import Search, nsga2
from deboom.explore.space import ResponseFunction, generator, stiffness_factor_space
from deboom.explore.tolerance_allocation import (
    Allocator,
    FreeTolerances,
    ShareTarget,
    SigmaTarget,
    ToleranceCost,
    ToleranceEffect,
)
from samples.known_truth import quad2

SECOND = cut_normal_moments()[0]


class Linear:
    """Responses that are linear in the variables."""

    response_unit = "dB"

    def __init__(self, slopes):
        self.slopes = np.atleast_2d(slopes)
        self.variable_names = tuple(f"M x{k}" for k in range(self.slopes.shape[1]))
        self.response_names = tuple(f"v{r}" for r in range(len(self.slopes)))

    def __call__(self, designs):
        """Return the responses."""
        return designs @ self.slopes.T

    def gradient(self, designs):
        """Return their slopes."""
        return np.tile(self.slopes, (len(designs), 1, 1))


def linear_allocator(slopes, weight, lower=0.001, upper=0.9, structure=None):
    model = Linear(slopes)
    k = len(model.variable_names)
    n_draws = structure.n_draws if structure else k
    space = stiffness_factor_space(model.variable_names)
    robust = Robust(
        model,
        space,
        sobol_sample(n_draws, 128, seed=1),
        estimator=Estimator(1),
        structure=structure,
    )
    price = ToleranceCost(model.variable_names, np.asarray(weight, dtype=float), np.full(k, 0.15))
    effect = ToleranceEffect(robust, np.ones(k))
    return Allocator(effect, price, np.asarray(lower), np.asarray(upper))


def lagrange(slope, weight, sigma, lower=0.0, upper=np.inf):
    """Minimise Σ w r / t within Σ (a t)² ≤ σ²: t = (w r / (2 λ a²))^(1/3) between the bounds."""
    a = np.abs(slope) * np.sqrt(SECOND) / 3.0

    def tolerance(price):
        return np.clip(np.cbrt(weight * 0.15 / (2.0 * price * a**2)), lower, upper)

    low, high = 1e-12, 1e12
    for _ in range(300):
        middle = np.sqrt(low * high)
        over = np.sum((a * tolerance(middle)) ** 2) > sigma**2
        low, high = (middle, high) if over else (low, middle)
    return tolerance(high)


RNG = np.random.default_rng(3)
SLOPE, WEIGHT = RNG.uniform(0.2, 3.0, 12), RNG.uniform(0.5, 2.0, 12)


@pytest.mark.parametrize("bounds", [(0.001, 0.9), (0.05, 0.30)])
def test_the_cheapest_tolerances_are_lagranges(bounds):
    allocator = linear_allocator(SLOPE, WEIGHT, *bounds)
    target = SigmaTarget(allocator.at(allocator.today).sigma_sum)
    allocation = allocator.cheapest(target)
    exact = lagrange(SLOPE, WEIGHT, target.sigma_sum, *bounds)
    np.testing.assert_allclose(allocation.tolerance, exact, rtol=2e-4)
    assert allocation.total_cost == pytest.approx((WEIGHT * 0.15 / exact).sum(), rel=1e-8)
    assert allocation.sigma_sum <= target.sigma_sum * (1.0 + 1e-6)
    uniform = allocator.uniform(target)
    np.testing.assert_allclose(uniform.tolerance, 0.15, rtol=1e-9)
    assert allocation.total_cost < uniform.total_cost
    without_effect = linear_allocator(0.0 * SLOPE, WEIGHT, *bounds).uniform(target)
    np.testing.assert_allclose(without_effect.tolerance, bounds[1])


def test_axes_of_one_hardness_have_their_own_closed_form():
    """σ = Σ a t if all axes share one draw: t ∝ sqrt(w / a)."""
    slope, weight = SLOPE[:4], WEIGHT[:4]
    names = tuple(f"M x{k}" for k in range(4))
    structure = ToleranceStructure(names, np.ones((4, 1)), ("hardness",))
    allocator = linear_allocator(slope, weight, structure=structure)
    allocation = allocator.cheapest(SigmaTarget(0.1))
    a = slope * np.sqrt(SECOND) / 3.0
    exact = np.sqrt(weight / a)
    exact *= 0.1 / (a * exact).sum()
    np.testing.assert_allclose(allocation.tolerance, exact, rtol=2e-4)


def test_a_sum_of_two_vehicles_is_checked_by_a_search_of_all_pairs():
    slopes = np.array([[1.0, 0.3], [0.2, 1.5]])
    allocator = linear_allocator(slopes, [1.0, 1.0])
    target = SigmaTarget(0.08)
    first = np.linspace(0.05, 0.5, 1500)
    scale = np.sqrt(SECOND) / 3.0
    second = np.linspace(0.02, 0.5, 1500)[:, None]
    sigma = scale * sum(np.sqrt((b * first) ** 2 + (c * second) ** 2) for b, c in slopes)
    cost = np.where(sigma <= target.sigma_sum, 0.15 / first + 0.15 / second, np.inf)
    assert allocator.cheapest(target).total_cost == pytest.approx(cost.min(), rel=1e-3)


@pytest.mark.parametrize("estimator", [Estimator(2), Estimator(1), Estimator()])
def test_gradients_by_the_tolerance_are_those_of_differences(estimator):
    model = quad2(4, seed=2)
    names = model.variable_names
    correlation = np.eye(4)
    correlation[:3, :3] += 0.4 * (1.0 - np.eye(3))
    structure = ToleranceStructure(names, np.linalg.cholesky(correlation), tuple("abcd"))
    sample = sobol_sample(structure.n_draws, 64, seed=1)
    space = stiffness_factor_space(names)
    robust = Robust(model, space, sample, estimator=estimator, structure=structure)
    effect = ToleranceEffect(robust, np.array([0.9, 1.1, 1.0, 0.85]))
    tolerance = np.array([0.1, 0.15, 0.2, 0.12])
    here, step = effect.at(tolerance), 1e-6
    limit = here.values.mean(axis=0) + 0.5 * here.sigma
    share, share_slope = here.soft_share(limit)
    for column in range(4):
        move = step * np.eye(4)[column]
        up, down = effect.at(tolerance + move), effect.at(tolerance - move)
        slope = (up.sigma - down.sigma) / (2.0 * step)
        np.testing.assert_allclose(here.sigma_by_tolerance[:, column], slope, rtol=1e-6)
        slope = (up.soft_share(limit)[0] - down.soft_share(limit)[0]) / (2.0 * step)
        np.testing.assert_allclose(share_slope[:, column], slope, rtol=1e-5, atol=1e-8)
    assert np.all(np.abs(share - here.share(limit)) < 0.05)


def test_a_share_of_a_linear_response_is_reached():
    """Within μ + 2 σ lie 97.7 % of a normal response."""
    allocator = linear_allocator(SLOPE, WEIGHT, 0.01, 0.6)
    many = replace(
        allocator.effect,
        robust=replace(allocator.effect.robust, sample=sobol_sample(12, 4096, seed=2)),
    )
    allocator = replace(allocator, effect=many)
    mean, sigma = SLOPE.sum(), 0.2
    target = ShareTarget(np.array([mean + 2.0 * sigma]), 0.9772)
    allocation = allocator.cheapest(target)
    assert allocation.scattered.sigma[0] == pytest.approx(sigma, rel=0.03)
    assert allocation.scattered.share(target.limit)[0] >= 0.9772 - 1e-3
    exact = lagrange(SLOPE, WEIGHT, allocation.scattered.sigma[0], 0.01, 0.6)
    assert allocation.total_cost == pytest.approx((WEIGHT * 0.15 / exact).sum(), rel=0.01)


def test_a_target_that_costs_nothing_gets_the_widest_tolerances():
    allocator = linear_allocator(SLOPE, WEIGHT, 0.05, 0.30)
    np.testing.assert_allclose(allocator.cheapest(SigmaTarget(100.0)).tolerance, 0.30)


def test_a_variable_without_a_price_keeps_its_tolerance():
    allocator = linear_allocator(SLOPE, WEIGHT, 0.05, 0.30)
    price = allocator.price
    fewer = replace(
        allocator,
        price=ToleranceCost(price.names[1:], price.weight[1:], price.reference[1:]),
        lower=np.asarray(0.05),
        upper=np.asarray(0.30),
    )
    target = SigmaTarget(allocator.at(allocator.today).sigma_sum)
    allocation = fewer.cheapest(target)
    assert allocation.tolerance.size == 11
    assert allocation.scattered.tolerance[0] == 0.15


def test_an_unreachable_target_says_by_how_much_and_who_binds():
    allocator = linear_allocator([[1.0, 0.0], [3.0, 3.0]], [1.0, 1.0], 0.05, 0.30)
    tightest = allocator.at(np.full(2, 0.05)).sigma_sum
    with pytest.raises(InputError, match=rf"still {tightest:.4g}.*0.02 less; v1 binds with 81 %"):
        allocator.cheapest(SigmaTarget(tightest - 0.02))
    limit = np.array([2.0, 5.9])
    with pytest.raises(InputError, match=r"v1 binds with .* %, its mean is 0\.1.* above the limit"):
        allocator.cheapest(ShareTarget(limit, 0.95))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (
            lambda: ToleranceCost(("a",), np.array([-1.0]), np.array([0.15])),
            "weight is -1.0: give a number at least 0",
        ),
        (lambda: ToleranceCost(("a",), np.ones(1), np.zeros(1)), "reference is 0.0"),
        (lambda: SigmaTarget(0.0), "sigma_sum is 0.0"),
        (lambda: ShareTarget(np.zeros(1), 1.0), "above 0 and below 1"),
        (lambda: ShareTarget(np.array([np.nan]), 0.9), "finite"),
        (lambda: linear_allocator(SLOPE, WEIGHT, 0.0, 0.3), "could only be chosen from 0 to 0.3"),
        (lambda: linear_allocator(SLOPE, WEIGHT, 0.4, 0.3), "could only be chosen from 0.4"),
    ],
)
def test_what_makes_no_sense_is_refused(make, words):
    with pytest.raises(InputError, match=words):
        make()


class Broken(Linear):
    """A model that always fails."""

    def __call__(self, designs):
        """Fail."""
        return np.full((len(designs), 1), np.nan)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"sample": FreshGaussianSampler(12, 64, seed=1)}, "draws that they share"),
        (
            {"evaluate": ResponseFunction(Linear(SLOPE), Linear(SLOPE).variable_names, "v", "dB")},
            "offers no gradient",
        ),
        ({"evaluate": Broken(SLOPE)}, "fails somewhere in its scatter"),
    ],
)
def test_models_and_draws_that_do_not_serve_are_refused(changes, words):
    robust = linear_allocator(SLOPE, WEIGHT).effect.robust
    with pytest.raises(InputError, match=words):
        ToleranceEffect(replace(robust, **changes), np.ones(12)).at(np.full(12, 0.1))


DESIGN = np.linspace(0.8, 1.2, 5)


def samplers(seed=1, n_samples=64):
    return [
        sobol_sample(5, n_samples, seed=seed),
        gaussian_sample(5, n_samples, seed=seed),
        FreshGaussianSampler(5, n_samples, seed=seed),
    ]


@pytest.mark.parametrize("index", range(3))
def test_draws_repeat_under_one_seed_and_change_with_it(index):
    first, again, other = (samplers(seed)[index].normals(DESIGN) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert not np.any(first == other)


def test_shared_draws_are_the_same_for_every_design_and_fresh_ones_are_not():
    sobol, gaussian, fresh = samplers()
    for shared in (sobol, gaussian):
        np.testing.assert_array_equal(shared.normals(DESIGN), shared.normals(DESIGN + 0.01))
    assert not np.any(fresh.normals(DESIGN) == fresh.normals(DESIGN + 0.01))


def test_fresh_draws_follow_from_the_design_alone():
    fresh = FreshGaussianSampler(2, 10, seed=3)
    alone = fresh.normals(np.array([0.0, 1.0]))
    fresh.normals(np.array([0.9, 1.0]))
    strided = np.array([[0.0, 7.0, 1.0, 7.0], [2.0, 7.0, 2.0, 7.0]])[0, ::2]
    np.testing.assert_array_equal(alone, fresh.normals(strided))
    np.testing.assert_array_equal(alone, fresh.normals(np.array([-0.0, 1.0])))


@pytest.mark.parametrize("make", [sobol_sample, gaussian_sample, FreshGaussianSampler])
def test_draws_that_cannot_be_are_refused(make):
    for seed in (0, -1, 1.5, True, None):
        with pytest.raises(InputError, match="seed"):
            make(5, seed=seed)
    with pytest.raises(InputError, match="at least 2 draws"):
        make(5, 1, seed=1)
    with pytest.raises(InputError, match="at least 1 variable"):
        make(0, seed=1)


def test_streams_of_different_purposes_share_nothing():
    search = sobol_sample(5, 128, seed=1).values
    verification = sobol_sample(5, 128, seed=1, purpose="verification sample").values
    assert not np.any(search == verification)
    assert generator(1, "a").random() != generator(1, "b").random()


NAMES = ("EnM x", "EnM z", "GeM x", "GeM z")


def batches(rho):
    """Two mounts whose axes share a batch and scatter on their own besides."""
    shared = np.kron(np.eye(2), [[1.0], [1.0]])
    loadings = np.hstack([np.sqrt(1.0 - rho) * np.eye(4), np.sqrt(rho) * shared])
    return ToleranceStructure(NAMES, loadings, (*NAMES, "batch EnM", "batch GeM"))


def sum_of_all(designs):
    return designs.sum(axis=1, keepdims=True)


def test_structures_that_do_not_fit_are_refused():
    structure = batches(0.5)
    space = stiffness_factor_space(NAMES)
    model = ResponseFunction(sum_of_all, NAMES, ("y",), "1")
    with pytest.raises(InputError, match="4 columns for 6 draws"):
        Robust(model, space, sobol_sample(4, seed=1), structure=structure)
    wide = replace(space, tolerance=np.full(4, 0.75))
    with pytest.raises(InputError, match="could change its sign"):
        Robust(model, wide, sobol_sample(6, seed=1), structure=structure)
    other = ToleranceStructure(tuple("abcd"), np.eye(4), tuple("abcd"))
    with pytest.raises(InputError, match="same names in the same order"):
        Robust(model, space, sobol_sample(4, seed=1), structure=other)


SIX = tuple(f"{mount} {axis}" for mount in ("EnM", "GeM", "Du") for axis in "xz")
H, B = 0.6, 0.3
PARTS = (PartNumber("bush", ("EnM", "GeM"), 1, H, B), PartNumber("wishbone bush", ("Du",), 2, H, B))


def covariance(structure):
    return structure.loadings @ structure.loadings.T


def stated():
    """Correlation by hand: axes h, pieces of a batch b; left and right even out."""
    axes = np.array([[1.0, H], [H, 1.0]])
    two_places = np.array([[1.0, B], [B, 1.0]])
    expected = np.zeros((6, 6))
    expected[:4, :4] = np.kron(two_places, axes)
    expected[4:, 4:] = (B + (1.0 - B) / 2.0) * axes
    return expected


def test_covariance_is_that_of_the_hand_calculation():
    np.testing.assert_allclose(covariance(part_structure(SIX, PARTS)), stated(), atol=1e-12)


def test_sigma_of_a_linear_response_is_the_closed_form():
    structure = part_structure(SIX, PARTS)
    slope = np.array([1.0, -2.0, 0.5, 3.0, 2.0, -1.0])
    space = replace(stiffness_factor_space(SIX), tolerance=np.linspace(0.06, 0.18, 6))
    robust = Robust(
        ResponseFunction(lambda designs: (designs @ slope)[:, None], SIX, ("level",), "dB"),
        space,
        sobol_sample(structure.n_draws, 128, seed=1),
        structure=structure,
        estimator=Estimator(1),
    )
    design = np.linspace(0.8, 1.2, 6)
    pull = slope * design * space.relative_sigma
    exact = np.sqrt(cut_normal_moments()[0] * pull @ stated() @ pull)
    assert robust(design[None]).sigma_sum[0] == pytest.approx(exact, rel=1e-9)
    # the verification draws as many columns as the structure has
    check = verification_response(robust, 256, seed=1)
    assert check.sample.n_variables == structure.n_draws == robust.n_draws
    assert check(design[None]).sigma_sum[0] == pytest.approx(exact, rel=1e-9)


def test_parts_without_anything_in_common_are_independent():
    structure = part_structure(SIX, ())
    assert structure.draw_names == SIX
    np.testing.assert_array_equal(structure.loadings, np.eye(6))


def test_the_batch_of_a_single_piece_adds_no_draw():
    alone = part_structure(SIX[:2], (PartNumber("bush", ("EnM",), 1, H, B),))
    assert alone.n_draws == 3
    np.testing.assert_allclose(covariance(alone), [[1.0, H], [H, 1.0]], atol=1e-12)


@pytest.mark.parametrize(("h", "b"), [(0.0, 1.0), (1.0, 0.0), (1.0, 1.0)])
def test_shares_at_their_ends(h, b):
    structure = part_structure(SIX[:4], (PartNumber("bush", ("EnM", "GeM"), 1, h, b),))
    expected = np.kron([[1.0, b], [b, 1.0]], [[1.0, h], [h, 1.0]])
    np.testing.assert_allclose(covariance(structure), expected, atol=1e-12)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: sobol_sample(5, 100, seed=1), "take 64 or 128"),
        (lambda: sobol_sample(5, 3, seed=1), "take 2 or 4"),
        (lambda: ToleranceSample(np.zeros((1, 3)), "measured", seed=1), "tolerance sample"),
        (lambda: ToleranceSample(np.zeros(3), "measured", seed=1), "tolerance sample"),
        (lambda: ToleranceSample(np.full((4, 3), np.nan), "measured", seed=1), "tolerance sample"),
        (lambda: ToleranceStructure(NAMES, np.eye(4) * np.nan, NAMES), "loadings: a number is not"),
        (lambda: part_structure(SIX, (PartNumber("a", ("TSM",)),)), "sits at 'TSM', which no"),
        (
            lambda: part_structure(SIX, (PartNumber("a", ("Du",)), PartNumber("b", ("Du",)))),
            "takes the part numbers 'a' and 'b': give it one",
        ),
    ],
)
def test_what_cannot_be_made_is_refused(make, words):
    with pytest.raises(InputError, match=words):
        make()


def linear_robust(**changes):
    model = Linear([[1.0, 2.0, 3.0]])
    space = stiffness_factor_space(model.variable_names)
    sample = sobol_sample(3, 128, seed=1)
    return Robust(model, space, sample, estimator=Estimator(1), **changes)


GROUPS = {"A": ["M x0", "M x2"], "B": ["M x1"]}


def test_tolerances_as_variables_are_those_of_a_response_that_has_them():
    """For a linear response: σ² = Σ (a x t/3)² m₂, m₂ of the cut normal; price mean(0.15/t)."""
    robust = linear_robust()
    free = FreeTolerances(robust, GROUPS, 0.05, 0.25)
    assert free.space.names[3:] == ("tolerance A", "tolerance B")
    design = np.array([1.1, 0.9, 1.0, 0.06, 0.2])
    values = free(design[np.newaxis])
    tolerance = np.array([0.06, 0.2, 0.06])
    space = replace(robust.space, tolerance=tolerance)
    fixed = replace(robust, space=space)(design[np.newaxis, :3])
    np.testing.assert_array_equal(values.objectives[:, :2], fixed.objectives)
    sigma = np.sqrt(SECOND * np.sum(([1.0, 2.0, 3.0] * design[:3] * tolerance / 3.0) ** 2))
    assert values.sigma_sum[0] == pytest.approx(sigma, rel=0.01)
    assert values.objectives[0, 2] == pytest.approx(np.mean(0.15 / tolerance))
    today = free(free.space.nominal[np.newaxis])
    np.testing.assert_array_equal(
        today.objectives[0], [*robust(robust.space.nominal[np.newaxis]).objectives[0], 1.0]
    )


def test_a_front_over_tolerances_trades_sigma_for_price():
    free = FreeTolerances(linear_robust(), GROUPS, 0.05, 0.25)
    front = nsga2(free, Search(16, 12, seed=1)).front
    assert front.designs.shape[1] == 5
    order = np.argsort(front.objectives[:, 2])
    cheap, dear = front.sigma_sum[order[0]], front.sigma_sum[order[-1]]
    assert front.objectives[order[-1], 2] > 1.5 * front.objectives[order[0], 2]
    assert dear < 0.5 * cheap


@pytest.mark.parametrize(
    ("groups", "bounds", "changes", "words"),
    [
        ({"A": ["M x9"]}, (0.05, 0.25), {}, "name variables that scatter"),
        ({"A": ["M x0"], "B": ["M x0"]}, (0.05, 0.25), {}, "each in one group"),
        (GROUPS, (0.2, 0.25), {}, "hold today's, 0.15, 0.15"),
        (GROUPS, (0.0, 0.25), {}, "give bounds above 0"),
        (GROUPS, (0.05, 0.25), {"limits": [Objective("mean").at_most(9.0)]}, "without limits"),
    ],
)
def test_tolerances_that_cannot_vary_are_refused(groups, bounds, changes, words):
    with pytest.raises(InputError, match=words):
        FreeTolerances(linear_robust(**changes), groups, *bounds)
