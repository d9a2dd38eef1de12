"""The response surface as a value: shapes, storage, scaling, guard and refusals."""

import io

import numpy as np
import pytest
from sklearn.neighbors import KNeighborsRegressor

from deboom.errors import InputError
from deboom.mounts.agreement import agreement, r_squared
from deboom.mounts.berg import friction_stiffness
from deboom.mounts.cubic_fit import PieceOptions
from deboom.mounts.element_models import BergModel, KelvinVoigtModel
from deboom.mounts.model_comparison import compare_models, standard_models
from deboom.mounts.regression_model import RegressionModel, gaussian_process, spline_surface
from deboom.mounts.response_surface import DynamicStiffnessSurface
from deboom.mounts.stiffness_model import StiffnessSamples
from deboom.mounts.training_region import TrainingRegion

GENERATOR = np.random.default_rng(1)
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
