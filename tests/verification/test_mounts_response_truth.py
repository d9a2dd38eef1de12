"""Response surfaces against known truths."""

import itertools
from functools import cache

import numpy as np
import pytest
from scipy import stats
from sklearn.preprocessing import PolynomialFeatures

from deboom.bench.campaign import LOW_GEAR_RUNS, TRAINING_RUNS
from deboom.bench.operating_run import PlannedRun, static_direction_forces, true_run
from deboom.bench.powertrain import load_bench, operating_stiffness
from deboom.mounts import response_surface
from deboom.mounts.piecewise_cubic import PiecewiseCubicRegressor
from deboom.physics.dynamic_stiffness import kelvin_voigt


def cubic(X, coefficients):
    return PolynomialFeatures(3).fit_transform(X) @ coefficients


def test_data_of_one_cubic_are_given_back():
    generator = np.random.default_rng(1)
    # ranges of a mount: N m, m, Hz
    X = generator.uniform([10, 2e-5, 20], [900, 7e-4, 80], (600, 3))
    scaled = X / [900, 7e-4, 80]
    truth = cubic(scaled, generator.normal(size=20))
    for pieces in (1, 2, 4):
        model = PiecewiseCubicRegressor(pieces=pieces).fit(X, truth)
        np.testing.assert_allclose(model.predict(X), truth, rtol=0, atol=1e-9)


@pytest.mark.parametrize("seed", [1, 2])
def test_the_split_between_two_cubics_is_found_to_the_row(seed):
    generator = np.random.default_rng(seed)
    X = generator.uniform(-1, 1, (1500, 3))
    split = generator.uniform(-0.6, 0.6)
    low, high = generator.normal(size=(2, 20))
    truth = np.where(X[:, 0] > split, cubic(X, high), cubic(X, low))
    model = PiecewiseCubicRegressor(overlap=0.0).fit(X, truth)
    position = np.sort(X[:, 0])
    behind = np.searchsorted(position, split)
    assert position[behind - 1] < model.split_points_[0] < position[behind]
    np.testing.assert_allclose(model.predict(X), truth, rtol=0, atol=1e-9)


def test_the_split_is_the_best_of_all():
    """Dynamic programming between triangles against trying every cut with plain least squares."""
    generator = np.random.default_rng(3)
    x = np.sort(generator.uniform(0, 1, 66))
    y = np.sin(9 * x**2) + generator.normal(0, 0.05, 66)
    least = 8  # twice the terms of a cubic

    def squares(low, high):
        polynomial = np.polynomial.Polynomial.fit(x[low:high], y[low:high], 3)
        return np.sum((y[low:high] - polynomial(x[low:high])) ** 2)

    for n_pieces in (2, 3):
        cuts = [
            (0, *inner, 66)
            for inner in itertools.combinations(range(least, 66 - least + 1), n_pieces - 1)
            if np.all(np.diff((0, *inner, 66)) >= least)
        ]
        sums = [sum(squares(*pair) for pair in itertools.pairwise(cut)) for cut in cuts]
        best = np.array(cuts[int(np.argmin(sums))][1:-1])
        model = PiecewiseCubicRegressor(pieces=n_pieces, overlap=0.0)
        model.fit(x[:, np.newaxis], y)
        np.testing.assert_allclose(model.split_points_, (x[best - 1] + x[best]) / 2)


def test_the_blend_is_continuous_and_hands_over_linearly():
    generator = np.random.default_rng(5)
    x = np.sort(generator.uniform(0, 1, 800))[:, np.newaxis]
    y = np.where(x[:, 0] > 0.5, 2.0, 1.0)
    model = PiecewiseCubicRegressor(overlap=0.2).fit(x, y)
    split, width = model.split_points_[0], 0.2 * np.ptp(x)
    ends = np.array([split - width / 2, split + width / 2])
    for at in (*ends, split):
        assert abs(np.diff(model.predict(np.array([[at - 1e-9], [at + 1e-9]])))[0]) < 1e-6
    rows = np.array([[split - 0.6 * width], [split], [split + width / 4]])
    scaled = (rows - model.centre_[:, np.newaxis]) / model.half_range_[:, np.newaxis]
    low, high = (cubic(z, c)[:, 0] for z, c in zip(scaled, model.coefficients_, strict=True))
    share = np.array([0.0, 0.5, 0.75])
    np.testing.assert_allclose(model.predict(rows), (1 - share) * low + share * high)


def test_the_gradient_is_the_limit_of_differences():
    generator = np.random.default_rng(6)
    X = generator.uniform([0, 1e-5, 20], [800, 6e-4, 80], (900, 3))
    y = 1e5 * np.tanh((X[:, 0] - 300) / 120) * (1 - 500 * X[:, 1]) + 40 * X[:, 2] ** 1.5
    model = PiecewiseCubicRegressor(overlap=0.1).fit(X, y)
    rows = X[:200]
    assert np.any(np.abs(rows[:, 0] - model.split_points_[0]) < 30)
    for feature, step in enumerate([1e-3, 1e-9, 1e-4]):
        shift = np.zeros(3)
        shift[feature] = step
        difference = (model.predict(rows + shift) - model.predict(rows - shift)) / (2 * step)
        scale = np.abs(difference).max()
        np.testing.assert_allclose(model.gradient(rows)[:, feature], difference, atol=1e-5 * scale)


def test_weights_are_repeated_rows():
    generator = np.random.default_rng(7)
    X = generator.uniform(-1, 1, (300, 2))
    y = np.sin(5 * X[:, 0]) + X[:, 1] ** 2
    repeats = generator.integers(1, 4, 300)
    weighted = PiecewiseCubicRegressor().fit(X, y, sample_weight=repeats)
    repeated = PiecewiseCubicRegressor().fit(np.repeat(X, repeats, axis=0), np.repeat(y, repeats))
    np.testing.assert_allclose(weighted.split_points_, repeated.split_points_)
    np.testing.assert_allclose(weighted.predict(X), repeated.predict(X), rtol=1e-9, atol=1e-11)


def test_the_interval_is_that_of_the_textbook():
    """Against ``t σ √(1/w + a (AᵀWA)⁻¹ aᵀ)`` written out for one cubic in one variable."""
    generator = np.random.default_rng(8)
    x, weight = generator.uniform(-1, 1, 40), generator.uniform(0.3, 3.0, 40)
    y = 1 + x - 2 * x**3 + generator.normal(0, 0.3, 40) / np.sqrt(weight)
    model = PiecewiseCubicRegressor(pieces=1).fit(x[:, np.newaxis], y, sample_weight=weight)
    at, new = np.linspace(-1, 1, 11), np.linspace(0.5, 2.0, 11)
    lower, upper = model.predict_interval(at[:, np.newaxis], 0.9, sample_weight=new)
    A, a = np.vander(x, 4), np.vander(at, 4)
    normal = A.T @ (weight[:, np.newaxis] * A)
    coefficients = np.linalg.solve(normal, A.T @ (weight * y))
    sigma = np.sqrt(np.sum(weight * (y - A @ coefficients) ** 2) / 36)
    leverage = np.einsum("ni,ij,nj->n", a, np.linalg.inv(normal), a)
    expected = stats.t.ppf(0.95, 36) * sigma * np.sqrt(1 / new + leverage)
    np.testing.assert_allclose((upper - lower) / 2, expected, rtol=1e-9)
    np.testing.assert_allclose((upper + lower) / 2, a @ coefficients, rtol=1e-9)


def test_cross_validation_over_runs_finds_the_number_of_pieces():
    """Lines of a run share their error: runs left out find three pieces, single lines do not."""
    generator = np.random.default_rng(10)
    run = np.repeat(np.arange(24), 40)
    x = np.linspace(0, 1, 40)[np.newaxis] * generator.uniform(0.6, 1, (24, 1))
    second = generator.uniform(-1, 1, (24, 1)) + 0.3 * np.sin(9 * x)
    X = np.column_stack([x.ravel(), second.ravel()])
    truth = X[:, 1] + 200 * np.maximum(X[:, 0] - 0.3, 0) ** 3
    truth -= 600 * np.maximum(X[:, 0] - 0.6, 0) ** 3
    y = truth + 0.03 * np.sin(25 * X[:, 0] + generator.uniform(0, 7, 24)[run])
    by_run = PiecewiseCubicRegressor(pieces="cv").fit(X, y, groups=run)
    by_line = PiecewiseCubicRegressor(pieces="cv").fit(X, y)
    assert by_run.split_points_.size == 2
    assert by_line.split_points_.size > 2
    np.testing.assert_allclose(by_run.split_points_, [0.3, 0.6], atol=0.1)


def test_a_refit_with_known_splits_takes_many_outputs_at_once():
    """What an error budget does: one triangularisation for all draws, equal to single fits."""
    generator = np.random.default_rng(11)
    X = generator.uniform(-1, 1, (500, 3))
    y = np.tanh(3 * X[:, 0]) + X[:, 1] * X[:, 2]
    first = PiecewiseCubicRegressor().fit(X, y)
    draws = y[:, np.newaxis] + generator.normal(0, 0.1, (500, 30))
    together = first.refitted(X, draws)
    single = PiecewiseCubicRegressor(split=first.split_points_).fit(X, draws[:, 17])
    np.testing.assert_allclose(
        together.predict(X)[:, 17], single.predict(X), rtol=1e-10, atol=1e-12
    )


def steady_friction_force(displacement):
    """Berg's friction force over a displacement record, by his rule from turning point to point.

    Displacement over x_2, force over F_max; two cycles are enough to settle.
    """
    force = np.zeros_like(displacement)
    turned_at, turned_with, direction = displacement[0], 0.0, 0.0
    for k in range(1, displacement.size):
        step = displacement[k] - displacement[k - 1]
        if step * direction < 0:
            turned_at, turned_with = displacement[k - 1], force[k - 1]
        if step:
            direction = np.sign(step)
        travel = abs(displacement[k] - turned_at)
        gap = 1 - direction * turned_with
        force[k] = turned_with + direction * travel * gap / (gap + travel)
    return force


@pytest.mark.parametrize("amplitude", [1e-3, 0.05, 0.4, 1.0, 3.0, 30.0])
def test_the_closed_form_is_the_first_harmonic_of_the_force_over_time(amplitude):
    per_cycle, cycles = 20000, 12
    phase = 2 * np.pi * np.arange(cycles * per_cycle) / per_cycle
    force = steady_friction_force(amplitude * np.sin(phase))[-per_cycle:]
    last = phase[-per_cycle:]
    # x = Im(X e^{jωt}) with X real, so F e^{jωt} has the harmonic 2j <F e^{-jωt}>
    harmonic = 2j * np.mean(force * np.exp(-1j * last)) / amplitude
    # stiffness at rest is F_max/x_2, here 1
    np.testing.assert_allclose(response_surface.friction_stiffness(amplitude), harmonic, atol=3e-4)


def test_small_and_large_amplitudes():
    assert response_surface.friction_stiffness(0.0) == 1.0
    around = response_surface.friction_stiffness(np.array([0.99e-4, 1.01e-4]))
    np.testing.assert_allclose(around[0].imag / 0.99, around[1].imag / 1.01, rtol=1e-3)
    far = response_surface.friction_stiffness(1e4)
    # a dry friction force of amplitude F_max: first harmonic 4/π, purely dissipative
    assert far.imag * 1e4 == pytest.approx(4 / np.pi, rel=2e-3)
    assert abs(far.real) < 0.05 * far.imag
    everywhere = response_surface.friction_stiffness(np.geomspace(1e-6, 1e4, 200))
    assert np.all(np.diff(everywhere.real) < 0)
    assert np.all(everywhere.imag > 0)


def lines(count=500):
    return np.random.default_rng(1).uniform([0, 2e-5, 20], [800, 6e-4, 80], (count, 3))


def test_a_kelvin_voigt_element_is_given_back():
    points = lines()
    z = points[:, 0] / 800
    spring, damper = 1e5 * (1 + z + 2 * z**3), 40 * (2 + z)
    truth = kelvin_voigt(points[:, 2], spring, damper)
    model = response_surface.KelvinVoigtModel().fit(points, truth)
    np.testing.assert_allclose(model.predict(points), truth, rtol=1e-9)


def test_a_berg_element_is_given_back():
    points = lines()
    shape = (0.4, 1.5e-4, 0.6, 55.0)
    z = points[:, 0] / 800
    truth = (
        1e5
        * (1 + z - z**2 + 2 * z**3)
        * response_surface.berg_shape(shape, points[:, 1], points[:, 2])
    )
    model = response_surface.BergModel().fit(points, truth)
    np.testing.assert_allclose(model.predict(points), truth, rtol=1e-5)
    assert model.shape_ == pytest.approx(np.array(shape), rel=1e-3)


BENCH = load_bench()
FREQUENCY = np.linspace(20, 80, 81)
DIRECTIONS = [f"{mount} {axis}" for mount in BENCH.mount_names for axis in "xyz"]
CHECK = [
    PlannedRun(gear, limit, full_load=True)
    for gear, limit in ((5, 120), (5, 220), (6, 120), (6, 160), (6, 220), (7, 220))
]


@cache
def run_of(plan):
    return true_run(BENCH, plan, FREQUENCY)


def samples(plans, direction, preload="wheel torque"):
    """Lines of true runs, over wheel torque or over the static force of the direction."""
    column = run_of(plans[0]).channels.index(direction)
    if preload == "wheel torque":
        parts = [run_of(plan).engine_torque * BENCH.total_ratios[plan.gear - 1] for plan in plans]
    else:
        parts = [static_direction_forces(BENCH, run_of(plan))[:, column] for plan in plans]
    return response_surface.StiffnessSamples(
        np.concatenate(parts),
        np.concatenate([run_of(plan).displacement[:, column] for plan in plans]),
        np.tile(FREQUENCY, len(plans)),
        np.concatenate([run_of(plan).stiffness[:, column] for plan in plans]),
        run=np.repeat([plan.name for plan in plans], FREQUENCY.size),
    )


def fitted_to(lines, **parameters):
    surface = response_surface.DynamicStiffnessSurface(PiecewiseCubicRegressor(**parameters))
    return surface.fit(lines.points, lines.stiffness, groups=lines.run)


def rms_error(surface, lines):
    fitted = surface.predict(lines.points)
    return np.sqrt(np.mean(np.abs(fitted / lines.stiffness - 1) ** 2))


@pytest.mark.parametrize(
    ("direction", "preload"),
    [*((name, "wheel torque") for name in DIRECTIONS), ("TSM x", "static force")],
)
def test_two_pieces_follow_the_true_law_in_every_direction(direction, preload):
    """Noise-free: at most 1 % rms on the training runs and on the thesis's six load cases."""
    training = samples(TRAINING_RUNS, direction, preload)
    surface = fitted_to(training)
    assert rms_error(surface, training) < 0.01
    assert rms_error(surface, samples(CHECK, direction, preload)) < 0.01
    assert surface.r2_real_ > 0.998
    assert surface.r2_imag_ > 0.99


def test_seven_inflections_need_a_third_piece_and_cross_validation_finds_it():
    """Gears 3 to 7 take the strut through all its stops."""
    training = samples([*TRAINING_RUNS, *LOW_GEAR_RUNS], "TSM x")
    two, chosen = fitted_to(training), fitted_to(training, pieces="cv", max_pieces=3)
    assert len(two.real_.coefficients_) == 2
    assert rms_error(two, training) > 0.02
    assert len(chosen.real_.coefficients_) >= 3
    assert rms_error(chosen, training) < 0.005


@pytest.mark.parametrize("direction", ["EnM z", "TSM x"])
def test_the_guard_separates_known_from_unknown(direction):
    """True law asked anywhere in the box of the ranges: inside the error is small, outside not."""
    training = samples(TRAINING_RUNS, direction)
    surface = fitted_to(training)
    assert surface.supported(training.points).all()
    generator = np.random.default_rng(1)
    lower, upper = surface.region_.lower, surface.region_.upper
    rows = generator.uniform(
        lower - 0.1 * (upper - lower), upper + 0.1 * (upper - lower), (2500, 3)
    )
    rows[:, 1] = np.maximum(rows[:, 1], 5e-6)
    truth = _true_stiffness(training, rows, direction)
    stiffness, inside = surface.predict(rows, extrapolate=True), surface.supported(rows)
    error = np.abs(stiffness / truth - 1)
    assert 0.02 < inside.mean() < 0.4
    assert np.median(error[inside]) < 0.03
    assert np.quantile(error[inside], 0.95) < 0.15
    assert np.median(error[~inside]) > 0.2
    # convex hull and ranges alone would have let most of the bad points pass
    in_range = surface.region_.in_range(rows).all(axis=1)
    assert np.quantile(error[in_range & ~inside], 0.5) > 0.1


def _true_stiffness(training, rows, direction):
    """Ask the true law at wheel torque, own amplitude and frequency, on the rising branch."""
    column = DIRECTIONS.index(direction)
    run = run_of(TRAINING_RUNS[0])
    wheel = np.concatenate(
        [run_of(plan).engine_torque * BENCH.total_ratios[plan.gear - 1] for plan in TRAINING_RUNS]
    )
    static = np.concatenate([run_of(plan).powertrain.static_deflection for plan in TRAINING_RUNS])
    order = np.argsort(wheel)
    deflection = np.stack(
        [
            np.interp(rows[:, 0], wheel[order], static[order, k])
            for k in range(run.powertrain.static_deflection.shape[1])
        ],
        axis=1,
    )
    play = BENCH.powertrain.play
    remembered = np.sign(deflection) * np.maximum(np.abs(deflection) - play, 0)
    others = np.concatenate(
        [np.abs(run_of(plan).powertrain.displacement) for plan in TRAINING_RUNS]
    )
    scaled = (training.points - rows.min(axis=0)) / np.ptp(rows, axis=0)
    unit_rows = (rows - rows.min(axis=0)) / np.ptp(rows, axis=0)
    nearest = np.array([np.argmin(np.sum((scaled - row) ** 2, axis=1)) for row in unit_rows])
    # the other axes of the mount move in the proportion of the nearest measured line
    amplitude = others[nearest] * (rows[:, 1] / others[nearest, column])[:, np.newaxis]
    return operating_stiffness(BENCH.powertrain, remembered, amplitude, rows[:, 2])[:, column]
