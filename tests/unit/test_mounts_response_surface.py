"""Piecewise cubics and response surfaces."""

import io

import numpy as np
import pytest
from sklearn.base import clone
from sklearn.neighbors import KNeighborsRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.utils.estimator_checks import parametrize_with_checks

from deboom.errors import InputError
from deboom.mounts.piecewise_cubic import (
    PieceOptions,
    PiecewiseCubicRegressor,
    TrainingRegion,
    cubic_exponents,
    cubic_terms,
)
from deboom.mounts.response_surface import (
    DynamicStiffnessSurface,
    StiffnessSamples,
    agreement,
    r_squared,
)
from deboom.mounts.stiffness_models import (
    BergModel,
    KelvinVoigtModel,
    RegressionModel,
    compare_models,
    friction_stiffness,
    gaussian_process,
    spline_surface,
    standard_models,
)

GENERATOR = np.random.default_rng(1)
X = GENERATOR.uniform(-1, 1, (400, 2))
Y = np.tanh(4 * X[:, 0]) + 0.2 * X[:, 1]


@parametrize_with_checks(
    [
        PiecewiseCubicRegressor(),
        PiecewiseCubicRegressor(split="threshold"),
        PiecewiseCubicRegressor(pieces="cv", max_pieces=3),
    ]
)
def test_scikit_learn_estimator_rules(estimator, check):
    check(estimator)


@pytest.mark.parametrize(("n_features", "n_terms"), [(1, 4), (2, 10), (3, 20), (4, 35)])
def test_the_cubic_is_complete(n_features, n_terms):
    exponents = cubic_exponents(n_features)
    assert exponents.shape == (n_terms, n_features)
    assert len({tuple(row) for row in exponents.tolist()}) == n_terms
    assert exponents.sum(axis=1).max() == 3
    assert cubic_terms(np.ones((5, n_features))).shape == (5, n_terms)


def test_terms_are_the_products_that_the_exponents_say():
    rows = GENERATOR.normal(size=(7, 3))
    expected = [np.prod(rows**exponents, axis=1) for exponents in cubic_exponents(3)]
    np.testing.assert_allclose(cubic_terms(rows), np.transpose(expected), rtol=1e-14)


def test_one_and_several_outputs_keep_their_shape():
    one = PiecewiseCubicRegressor().fit(X, Y)
    two = PiecewiseCubicRegressor().fit(X, np.column_stack([Y, -2 * Y]))
    assert one.predict(X[:9]).shape == (9,)
    assert one.gradient(X[:9]).shape == (9, 2)
    assert two.predict(X[:9]).shape == (9, 2)
    assert two.gradient(X[:9]).shape == (9, 2, 2)
    lower, upper = two.prediction_interval(X[:9])
    assert lower.shape == upper.shape == (9, 2)
    # proportional outputs have one and the same best split
    np.testing.assert_allclose(two.split_points_, one.split_points_)
    np.testing.assert_allclose(two.predict(X)[:, 1], -2 * one.predict(X), rtol=1e-9, atol=1e-12)


def test_given_split_points_are_taken():
    model = PiecewiseCubicRegressor(split=[-0.5, 0.25]).fit(X, Y)
    assert model.n_pieces_ == 3
    np.testing.assert_array_equal(model.split_points_, [-0.5, 0.25])


def test_another_column_can_be_cut():
    model = PiecewiseCubicRegressor(split_feature=1).fit(X[:, ::-1], Y)
    straight = PiecewiseCubicRegressor().fit(X, Y)
    np.testing.assert_allclose(model.split_points_, straight.split_points_)
    np.testing.assert_allclose(model.predict(X[:, ::-1]), straight.predict(X), rtol=1e-9)


def test_too_few_rows_for_two_pieces_give_one():
    assert PiecewiseCubicRegressor().fit(X[:39], Y[:39]).n_pieces_ == 1
    assert PiecewiseCubicRegressor(min_rows=10).fit(X[:39], Y[:39]).n_pieces_ == 2


def test_a_constant_column_is_harmless_and_guarded():
    rows = np.column_stack([X, np.full(len(X), 7.0)])
    model = PiecewiseCubicRegressor().fit(rows, Y)
    np.testing.assert_allclose(
        model.predict(rows), PiecewiseCubicRegressor().fit(X, Y).predict(X), atol=1e-9
    )
    assert model.supported(rows).all()
    assert not model.supported(rows + np.array([0, 0, 1e-3])).any()


def test_rows_of_weight_zero_are_left_out():
    weight = np.ones(len(X))
    weight[::3] = 0
    spoilt = Y.copy()
    spoilt[::3] = 1e6
    kept = weight > 0
    expected = PiecewiseCubicRegressor().fit(X[kept], Y[kept])
    model = PiecewiseCubicRegressor().fit(X, spoilt, sample_weight=weight)
    np.testing.assert_allclose(model.predict(X), expected.predict(X), rtol=1e-9, atol=1e-12)


def test_it_works_in_a_pipeline_and_as_a_clone():
    model = clone(PiecewiseCubicRegressor(pieces=3, min_rows=25))
    assert model.get_params()["pieces"] == 3
    assert make_pipeline(StandardScaler(), model).fit(X, Y).score(X, Y) > 0.99


def test_as_many_terms_as_rows_leave_no_interval():
    model = PiecewiseCubicRegressor().fit(X[:10], Y[:10])
    with pytest.raises(InputError, match="needs more rows"):
        model.prediction_interval(X[:2])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"pieces": 0}, 'pieces is a whole number of at least 1 or "cv"'),
        ({"pieces": 2.5}, "pieces is a whole number"),
        ({"pieces": "many"}, "pieces is a whole number"),
        ({"split": "best"}, "split is"),
        ({"split": [0.5, 0.1]}, "must increase within the range"),
        ({"split": [3.0]}, "must increase within the range"),
        ({"split_feature": 2}, "there are 2 variables"),
        ({"split_feature": -1}, "split_feature is a whole number of at least 0"),
        ({"threshold": 0.0}, "threshold is a relative error above 0"),
        ({"overlap": 1.0}, "overlap is a fraction"),
        ({"overlap": -0.1}, "overlap is a fraction"),
        ({"max_pieces": 0}, "max_pieces is a whole number"),
        ({"folds": 1}, "folds is a whole number of at least 2"),
        ({"min_rows": 0}, "min_rows is a whole number"),
        ({"reach": 0.0}, "reach of measured rows is above 0"),
    ],
)
def test_options_without_sense_are_refused(options, words):
    with pytest.raises(InputError, match=words):
        PiecewiseCubicRegressor(**options).fit(X, Y)


def test_group_labels_of_another_length_are_refused():
    with pytest.raises(InputError, match="3 group labels for 400 rows"):
        PiecewiseCubicRegressor(pieces="cv").fit(X, Y, groups=["a", "b", "c"])


def test_groups_that_say_nothing_about_each_other_are_refused():
    for groups in (np.zeros(len(X)), X[:, 0] > 0):
        with pytest.raises(InputError, match="cannot be cross-validated"):
            PiecewiseCubicRegressor(pieces="cv", reach=0.1).fit(
                X * [1 + 5 * (X[:, :1] > 0)][0], Y, groups=groups
            )


@pytest.mark.parametrize("coverage", [0.0, 1.0, 95.0])
def test_coverages_that_do_not_exist_are_refused(coverage):
    with pytest.raises(InputError, match="coverage lies between 0 and 1"):
        PiecewiseCubicRegressor().fit(X, Y).prediction_interval(X, coverage)


def test_a_split_that_leaves_a_piece_empty_is_refused():
    gap = X[np.abs(X[:, 0]) > 0.4]
    with pytest.raises(InputError, match="no rows between the split points"):
        PiecewiseCubicRegressor(split=[-0.2, 0.2]).fit(gap, gap[:, 0])


N = 900
RUN = np.repeat([f"run {k}" for k in range(9)], 100)
PRELOAD = GENERATOR.uniform(-1500, 0, N)
AMPLITUDE = GENERATOR.uniform(2e-5, 7e-4, N)
FREQUENCY = GENERATOR.uniform(20, 80, N)


def law(preload, amplitude, frequency):
    elastic = 2e5 + 1.5e5 * (1 + np.tanh((-preload - 700) / 150))
    return elastic * (1.2 - 250 * amplitude + 0.12j * (frequency / 40) ** 0.3)


STIFFNESS = law(PRELOAD, AMPLITUDE, FREQUENCY)
LINES = (PRELOAD, AMPLITUDE, FREQUENCY, STIFFNESS)
SURFACE = DynamicStiffnessSurface.fit(*LINES)
POINTS = (np.array([-1200.0, -700.0, -300.0]), np.array([1e-4, 3e-4, 5e-4]), np.full(3, 40.0))


def test_shapes_follow_the_inputs():
    assert SURFACE.predict(*POINTS).shape == (3,)
    assert SURFACE.predict(-700.0, 2e-4, 40.0).shape == ()
    grid = SURFACE.predict(np.full((4, 1), -700.0), np.full((1, 5), 2e-4), 40.0)
    assert grid.shape == (4, 5)
    assert grid.dtype == complex
    stiffness, inside = SURFACE.predict_masked(np.full((2, 2), -700.0), 2e-4, 40.0)
    assert stiffness.shape == inside.shape == (2, 2)
    lower, upper = SURFACE.prediction_interval(np.full((2, 2), -700.0), 2e-4, 40.0)
    assert lower.shape == upper.shape == (2, 2)
    assert np.all(lower.real < upper.real)
    assert np.all(lower.imag < upper.imag)


def test_it_states_its_units_ranges_and_size():
    assert SURFACE.units == {
        "preload": "N",
        "amplitude": "m",
        "frequency": "Hz",
        "stiffness": "N/m",
    }
    assert SURFACE.ranges["preload"] == (PRELOAD.min(), PRELOAD.max())
    assert SURFACE.ranges["frequency"] == (FREQUENCY.min(), FREQUENCY.max())
    assert SURFACE.n_parameters == 2 * 2 * 20
    assert SURFACE.n_lines == N
    assert DynamicStiffnessSurface.fit(*LINES, preload_unit="N m").units["preload"] == "N m"


def test_its_r_squared_is_that_of_its_own_lines():
    fitted = SURFACE.predict(*LINES[:3])
    assert SURFACE.r2_real == pytest.approx(r_squared(STIFFNESS.real, fitted.real), rel=1e-12)
    assert SURFACE.r2_imag == pytest.approx(r_squared(STIFFNESS.imag, fitted.imag), rel=1e-12)
    force = r_squared(np.abs(STIFFNESS) * AMPLITUDE, np.abs(fitted) * AMPLITUDE)
    assert SURFACE.r2_force == pytest.approx(force, rel=1e-12)
    assert 0.99 < SURFACE.r2_real < 1


def test_storage_gives_the_same_surface_bit_for_bit():
    file = io.BytesIO()
    np.savez(file, allow_pickle=False, **SURFACE.to_arrays())
    file.seek(0)
    with np.load(file, allow_pickle=False) as stored:
        again = DynamicStiffnessSurface.from_arrays(stored)
    everywhere = (np.linspace(-2000, 400, 50), np.linspace(0, 1e-3, 50), np.linspace(10, 90, 50))
    for one, other in zip(
        again.predict_masked(*everywhere), SURFACE.predict_masked(*everywhere), strict=True
    ):
        np.testing.assert_array_equal(one, other)
    for one, other in zip(
        again.prediction_interval(*POINTS), SURFACE.prediction_interval(*POINTS), strict=True
    ):
        np.testing.assert_array_equal(one, other)
    assert (again.units, again.ranges) == (SURFACE.units, SURFACE.ranges)
    assert (again.r2_real, again.r2_imag, again.r2_force) == (
        SURFACE.r2_real,
        SURFACE.r2_imag,
        SURFACE.r2_force,
    )


def test_storage_of_another_version_or_incomplete_is_refused():
    arrays = SURFACE.to_arrays()
    with pytest.raises(InputError, match="format 2 cannot be read"):
        DynamicStiffnessSurface.from_arrays({**arrays, "format": np.array(2)})
    for missing in ("format", "r2_real", "real_coefficients", "region_points"):
        partial = {name: array for name, array in arrays.items() if name != missing}
        with pytest.raises(InputError, match=missing):
            DynamicStiffnessSurface.from_arrays(partial)


def test_a_surface_is_a_value():
    with pytest.raises(ValueError, match="read-only"):
        SURFACE.real.coefficients[0, 0, 0] = 0
    with pytest.raises(ValueError, match="read-only"):
        SURFACE.region.points[0, 0] = 0
    with pytest.raises(AttributeError):
        SURFACE.n_lines = 3


def test_a_dynamic_design_factor_scales_the_stiffness_and_leaves_the_loss_factor():
    softer = SURFACE.scaled(0.8)
    np.testing.assert_allclose(softer.predict(*POINTS), 0.8 * SURFACE.predict(*POINTS), rtol=1e-14)
    width = np.subtract(*SURFACE.prediction_interval(*POINTS))
    np.testing.assert_allclose(np.subtract(*softer.prediction_interval(*POINTS)), 0.8 * width)
    np.testing.assert_array_equal(softer.inside(*LINES[:3]), SURFACE.inside(*LINES[:3]))


@pytest.mark.parametrize("factor", [0.0, -1.0, np.nan, np.inf])
def test_factors_without_sense_are_refused(factor):
    with pytest.raises(InputError, match="stiffness factor is above 0"):
        SURFACE.scaled(factor)


def test_at_fixed_preload_and_frequency_it_is_a_cubic_in_the_amplitude():
    split = SURFACE.real.split_points[0]
    preload = np.array([[-1200.0], [split], [split + 4.0], [-200.0]])
    frequency = np.array([[30.0, 60.0]])
    cubic = SURFACE.at_amplitude(preload, frequency)
    assert cubic.coefficients.shape == (4, 2, 4)
    for amplitude in (3e-5, 2.2e-4, 6.9e-4):
        expected, _ = SURFACE.predict_masked(preload, amplitude, frequency)
        np.testing.assert_allclose(cubic(amplitude), expected, rtol=1e-11)
        step = 1e-8
        slope = (cubic(amplitude + step) - cubic(amplitude - step)) / (2 * step)
        np.testing.assert_allclose(cubic.derivative(amplitude), slope, rtol=1e-5)
    assert (cubic.lowest, cubic.highest) == SURFACE.ranges["amplitude"]
    np.testing.assert_array_equal(
        cubic.held(np.array([0.0, 1e-4, 1.0])), [AMPLITUDE.min(), 1e-4, AMPLITUDE.max()]
    )


def test_predict_names_what_lies_outside():
    with pytest.raises(InputError, match=r"1 of 3 points .* preload was measured from -149. to"):
        SURFACE.predict([-1000.0, 500.0, -900.0], 2e-4, 40.0)
    with pytest.raises(InputError, match="frequency was measured from 20"):
        SURFACE.predict(-700.0, 2e-4, 140.0)
    kept = (np.abs(PRELOAD + 700) > 300) | (np.abs(FREQUENCY - 50) > 20)
    kept |= np.abs(AMPLITUDE - 3.5e-4) > 2e-4
    holed = DynamicStiffnessSurface.fit(*(column[kept] for column in LINES))
    with pytest.raises(InputError, match="no line was measured near it"):
        holed.predict(-700.0, 3.5e-4, 50.0)
    stiffness, inside = holed.predict_masked([-700.0, -1200.0], [3.5e-4, 2e-4], 50.0)
    assert np.isfinite(stiffness).all()
    assert inside.tolist() == [False, True]


def test_predict_refuses_what_the_lines_do_not_hold():
    """Amplitude tied to the frequency: beside the curve the cubic is free, however near."""
    frequency = np.linspace(20, 80, 400)
    preload = np.tile([-300.0, -350.0], 200)
    amplitude = 1e-4 + 5e-4 * (frequency - 20) / 60
    tied = DynamicStiffnessSurface.fit(
        preload, amplitude, frequency, law(preload, amplitude, frequency)
    )
    assert tied.inside(preload, amplitude, frequency).all()
    with pytest.raises(InputError, match="the measured lines do not hold the model there"):
        tied.predict(-300.0, 3.6e-4, 50.0)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({0: PRELOAD[:-1]}, "one value per line"),
        ({1: -AMPLITUDE}, "peak value of at least 0 m"),
        ({2: FREQUENCY - 30}, "above 0 Hz"),
        ({3: np.where(np.arange(N) == 7, np.nan, STIFFNESS)}, "stiffness of line 7 is not finite"),
        ({0: PRELOAD[:, np.newaxis]}, "one value per line"),
    ],
)
def test_lines_that_cannot_be_fitted_are_refused(change, words):
    lines = [change.get(place, column) for place, column in enumerate(LINES)]
    with pytest.raises(InputError, match=words):
        DynamicStiffnessSurface.fit(*lines)


def test_weights_runs_and_numbers_of_lines_without_sense_are_refused():
    with pytest.raises(InputError, match="weights are above 0"):
        DynamicStiffnessSurface.fit(*LINES, np.zeros(N))
    with pytest.raises(InputError, match="no lines"):
        DynamicStiffnessSurface.fit([], [], [], [])
    few = [column[:20] for column in LINES]
    with pytest.raises(InputError, match="20 lines are too few for 1 pieces of 20 terms"):
        DynamicStiffnessSurface.fit(*few)
    with pytest.raises(InputError, match="name each line's run"):
        DynamicStiffnessSurface.fit(*LINES, options=PieceOptions(pieces="cv"))
    with pytest.raises(InputError, match="2 names of runs for 900 lines"):
        DynamicStiffnessSurface.fit(*LINES, run=["a", "b"])


def test_points_without_sense_are_refused():
    with pytest.raises(InputError, match="shapes"):
        SURFACE.predict(np.zeros(3), np.zeros(4), 40.0)
    with pytest.raises(InputError, match="must be finite"):
        SURFACE.inside(np.nan, 1e-4, 40.0)


def test_weights_count():
    spoilt = STIFFNESS.copy()
    spoilt[::2] *= 1.3
    weights = np.where(np.arange(N) % 2, 1.0, 1e-9)
    weighted = DynamicStiffnessSurface.fit(
        PRELOAD, AMPLITUDE, FREQUENCY, spoilt, weights, reach=0.3
    )
    half = DynamicStiffnessSurface.fit(*(column[1::2] for column in LINES), reach=0.3)
    np.testing.assert_allclose(weighted.predict(*POINTS), half.predict(*POINTS), rtol=1e-3)


def test_runs_choose_the_number_of_pieces():
    chosen = DynamicStiffnessSurface.fit(
        *LINES, options=PieceOptions(pieces="cv", max_pieces=3), run=RUN
    )
    assert 2 <= chosen.real.n_pieces <= 3


def test_region_knows_its_reach():
    region = TrainingRegion.around(np.array([[0.0, 0.0], [10.0, 2.0]]), reach=0.25)
    rows = np.array([[2.0, 0.0], [3.0, 0.0], [-0.1, 0.0], [-0.3, 0.0], [10.0, 2.0]])
    np.testing.assert_allclose(region.distance(rows), [0.2, 0.3, 0.01, 0.03, 0.0], atol=1e-12)
    assert region.contains(rows).tolist() == [True, False, True, False, True]


@pytest.mark.parametrize("model", [KelvinVoigtModel, BergModel])
def test_element_models_share_the_interface(model):
    fitted = model.fit(*LINES)
    assert fitted.predict(*POINTS).shape == (3,)
    assert fitted.units == SURFACE.units
    with pytest.raises(InputError, match="outside of the measured region"):
        fitted.predict(2000.0, 2e-4, 40.0)


@pytest.mark.parametrize("regressor", [gaussian_process, spline_surface])
def test_regression_models_share_the_interface(regressor):
    fitted = RegressionModel.fit(*LINES, regressor=regressor(), max_lines=100)
    stiffness = fitted.predict(*POINTS)
    assert stiffness.shape == (3,)
    assert fitted.predict(-700.0, 2e-4, 40.0).shape == ()
    assert fitted.n_parameters > 80
    np.testing.assert_allclose(stiffness, law(*POINTS), rtol=0.05)
    with pytest.raises(InputError, match="outside of the measured region"):
        fitted.predict(2000.0, 2e-4, 40.0)


def test_regression_models_refuse_what_they_cannot_do():
    with pytest.raises(InputError, match="leave out the weights"):
        RegressionModel.fit(*LINES, np.arange(1.0, N + 1), regressor=spline_surface())
    with pytest.raises(InputError, match="max_lines is at least 2"):
        RegressionModel.fit(*LINES, regressor=spline_surface(), max_lines=1)
    with pytest.raises(InputError, match="KNeighborsRegressor does not tell its number"):
        RegressionModel.fit(*LINES, regressor=KNeighborsRegressor())


def test_friction_refuses_a_negative_amplitude():
    with pytest.raises(InputError, match="at least 0"):
        friction_stiffness(-0.1)


def test_comparison_is_one_table_over_common_lines():
    samples = StiffnessSamples.of_amplitude(*LINES, run=RUN)
    beyond = StiffnessSamples.of_amplitude(
        np.append(PRELOAD[:50], 5000.0),
        np.append(AMPLITUDE[:50], 2e-4),
        np.append(FREQUENCY[:50], 40.0),
        np.append(STIFFNESS[:50], 1e5),
    )
    models = standard_models()
    fits = {name: models[name] for name in ("one cubic", "two cubics, least squares", "Berg")}
    table = compare_models(fits, samples, beyond, truth=beyond.stiffness)
    assert table["model"].tolist() == list(fits)
    assert (table["lines compared [1]"] == 50).all()
    assert table["parameters [1]"].tolist() == [40, 80, 12]
    np.testing.assert_allclose(table["rms error [%]"], table["rms error against truth [%]"])
    assert "rms error against truth [%]" not in compare_models(fits, samples, beyond)
    with pytest.raises(InputError, match="no models"):
        compare_models({}, samples, beyond)
    far = StiffnessSamples.of_amplitude([9e3], [1e-4], [40.0], [1e5])
    with pytest.raises(InputError, match="no line to check"):
        compare_models(fits, samples, far)


def test_agreement_is_in_the_phase_of_the_displacement():
    phase = np.exp(1j * GENERATOR.uniform(0, 6, N))
    samples = StiffnessSamples(PRELOAD, AMPLITUDE * phase, FREQUENCY, STIFFNESS)
    result = agreement(samples, 1.01 * STIFFNESS)
    force = STIFFNESS * AMPLITUDE * phase
    assert result.rms_error == pytest.approx(0.01, rel=1e-9)
    assert result.r2_force_real == pytest.approx(r_squared(force.real, 1.01 * force.real))
    assert result.r2_force_imag == pytest.approx(r_squared(force.imag, 1.01 * force.imag))
    with pytest.raises(InputError, match="all equal"):
        r_squared(np.ones(4), np.ones(4))
    with pytest.raises(InputError, match="one each"):
        r_squared(np.ones(4), np.ones(3))


def test_a_state_measured_again_is_held_at_the_edge_of_the_lines():
    """Noise moves the end of a ramp beyond every leverage of the fit; a line beside it vouches."""
    edge = np.argmax(SURFACE.real.leverage_ratio(np.column_stack(LINES[:3])))
    point = np.array([column[edge] for column in LINES[:3]])
    step = 0.02 * (SURFACE.region.upper - SURFACE.region.lower)
    moved = np.array([point + step * np.array(s) for s in np.ndindex(3, 3, 3)]) - step
    ratio = np.maximum(SURFACE.real.leverage_ratio(moved), SURFACE.imag.leverage_ratio(moved))
    beside = SURFACE.region.contains(moved) & (SURFACE.region.distance(moved) <= 0.025)
    further = beside & (ratio > 1.001) & (ratio < 3.9)
    assert further.any()
    assert SURFACE.inside(*moved[further].T).all()
    away = (
        SURFACE.region.contains(moved) & (SURFACE.region.distance(moved) > 0.03) & (ratio > 1.001)
    )
    assert not SURFACE.inside(*moved[away].T).any()
