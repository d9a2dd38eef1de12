"""Piecewise cubics and response surfaces: scikit-learn's rules, storage, guard and refusals."""

import io

import numpy as np
import pytest
from sklearn.base import clone
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.model_selection import GroupKFold, cross_val_score
from sklearn.neighbors import KNeighborsRegressor
from sklearn.utils.estimator_checks import parametrize_with_checks

from deboom.errors import InputError
from deboom.mounts.piecewise_cubic import (
    FewLevelsWarning,
    PiecewiseCubicRegressor,
    TrainingRegion,
)
from deboom.mounts.response_surface import (
    BergModel,
    DynamicStiffnessSurface,
    KelvinVoigtModel,
    StiffnessSamples,
    agreement,
    berg_shape,
    compare_models,
    friction_stiffness,
    gaussian_process,
    operating_points,
    r_squared,
    standard_models,
)

GENERATOR = np.random.default_rng(1)
X = GENERATOR.uniform(-1, 1, (400, 2))
Y = np.tanh(4 * X[:, 0]) + 0.2 * X[:, 1]


@pytest.mark.filterwarnings("ignore:.* distinct rows do not determine a cubic:UserWarning")
@pytest.mark.filterwarnings("ignore:.*of the 4 levels")  # of the checks' own tiny samples
@parametrize_with_checks(
    [PiecewiseCubicRegressor(), PiecewiseCubicRegressor(pieces="cv", max_pieces=3)]
)
def test_scikit_learn_estimator_rules(estimator, check):
    check(estimator)


@pytest.mark.parametrize("weighted", [False, True])
def test_least_squares_are_those_of_the_normal_singular_values(weighted):
    random = np.random.default_rng(5)
    rows = random.uniform([-3e3, 1e-6, 15.0], [4e3, 2e-4, 120.0], (400, 3))
    observed = np.column_stack([rows[:, 0] * rows[:, 2], np.exp(rows[:, 1] * 1e4)])
    observed += 0.1 * observed.std(axis=0) * random.standard_normal(observed.shape)
    weight = random.uniform(0.5, 2.0, 400) if weighted else np.ones(400)
    fitted = PiecewiseCubicRegressor(pieces=1).fit(rows, observed, weight)
    terms = fitted._terms(rows, 0)
    left, singular, right = np.linalg.svd(np.sqrt(weight)[:, None] * terms, full_matrices=False)
    exact = terms @ (right.T / singular @ left.T @ (np.sqrt(weight)[:, None] * observed))
    assert np.abs(fitted.predict(rows) - exact).max() <= 1e-12 * np.abs(observed).max()


def test_a_constant_column_is_harmless_and_guarded():
    rows = np.column_stack([X, np.full(len(X), 7.0)])
    model = PiecewiseCubicRegressor().fit(rows, Y)
    expected = PiecewiseCubicRegressor().fit(X, Y).predict(X)
    np.testing.assert_allclose(model.predict(rows), expected, atol=1e-9)
    assert model.supported(rows).all()
    assert not model.supported(rows + np.array([0, 0, 1e-3])).any()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"pieces": 0}, 'pieces 0, .*: whole numbers of at least 1, or "cv"'),
        ({"pieces": 2.5}, "pieces 2.5, .*whole numbers"),
        ({"pieces": "many"}, "pieces 'many', .*whole numbers"),
        ({"split": [0.5, 0.1]}, "must increase within the range"),
        ({"split": [3.0]}, "must increase within the range"),
        ({"overlap": 1.0}, "overlap is a fraction"),
        ({"overlap": -0.1}, "overlap is a fraction"),
        ({"max_pieces": 0}, "max_pieces 0: whole numbers"),
    ],
)
def test_options_without_sense_are_refused(options, words):
    with pytest.raises(InputError, match=words):
        PiecewiseCubicRegressor(**options).fit(X, Y)


def test_rows_and_groups_that_cannot_be_fitted_are_refused():
    with pytest.raises(ValueError, match="inconsistent numbers of samples"):
        PiecewiseCubicRegressor(pieces="cv").fit(X, Y, groups=["a", "b", "c"])
    apart = X * [1 + 5 * (X[:, :1] > 0)][0]
    for groups in (np.zeros(len(X)), X[:, 0] > 0):
        with pytest.raises(InputError, match="cannot be cross-validated"):
            PiecewiseCubicRegressor(pieces="cv").fit(apart, Y, groups=groups)
    gap = X[np.abs(X[:, 0]) > 0.4]
    with pytest.raises(InputError, match="no rows between the split points"):
        PiecewiseCubicRegressor(split=[-0.2, 0.2]).fit(gap, gap[:, 0])


def test_an_underdetermined_piece_gets_a_lower_degree_and_is_named():
    """Nine rows of a parabola in the upper piece, each twice: no cubic, and no wild values."""
    rows = np.vstack([X[X[:, 0] < 0], np.repeat(X[X[:, 0] > 0.1][:9], 2, axis=0)])
    parabola = rows[:, 0] ** 2 - rows[:, 0] * rows[:, 1]
    with pytest.warns(UserWarning, match=r"piece from 0.1.* to 0.*: 9 distinct .* of degree 2"):
        model = PiecewiseCubicRegressor(split=[0.05], overlap=0.0).fit(rows, parabola)
    everywhere = np.column_stack([np.linspace(0.06, 10, 50), np.linspace(-10, 10, 50)])
    expected = everywhere[:, 0] ** 2 - everywhere[:, 0] * everywhere[:, 1]
    np.testing.assert_allclose(model.predict(everywhere), expected, rtol=1e-9, atol=1e-9)
    assert model.supported(rows).all()


@pytest.mark.parametrize(
    ("temperatures", "pieces"), [((-20, 0, 40, 80), 2), ((-20, 0, 40, 60, 80), 3), ((0, 80), 1)]
)
def test_a_temperature_between_few_levels_is_not_invented(temperatures, pieces):
    """A cubic through two or three levels errs by 45 to 280 % between them."""

    def stiffness(rows):
        return (1 + 0.5 * np.exp(-(rows[:, 0] + 20) / 60)) * (1 + 0.2 * rows[:, 1] ** 2)

    other = np.linspace(-1, 1, 40)
    rows = np.array([(temperature, value) for temperature in temperatures for value in other])
    with pytest.warns(FewLevelsWarning, match=r"variable 1 takes [123] of the 4 levels"):
        model = PiecewiseCubicRegressor(pieces=pieces).fit(rows, stiffness(rows))
    held_out = np.column_stack([np.full(40, 23.0), other])
    assert np.abs(model.predict(held_out) / stiffness(held_out) - 1).max() < 0.08
    np.testing.assert_allclose(model.predict(rows), stiffness(rows), rtol=0.06)


def test_a_variable_that_only_rounding_moves_is_constant_in_its_piece():
    """Two slices at constant torque: scaled to its rounding, a cubic would err by 1e40."""
    torque = np.repeat([100.0, 300.0], 100) + 1e-13 * GENERATOR.normal(size=200)
    rows = np.column_stack([torque, GENERATOR.uniform(-1, 1, 200)])
    model = PiecewiseCubicRegressor(split=[200.0]).fit(rows, 1 + rows[:, 1] ** 3)
    between = np.column_stack([np.linspace(100, 300, 30), np.linspace(-1, 1, 30)])
    np.testing.assert_allclose(model.predict(between), 1 + between[:, 1] ** 3, atol=1e-6)
    assert not model.supported(between[5:25]).any()


def test_a_piece_has_at_least_two_rows_for_each_of_its_terms():
    """The best cut of a step behind four rows would leave four rows to four terms."""
    rows = np.linspace(0.0, 1.0, 60)[:, np.newaxis]
    step = np.where(np.arange(60) < 4, 5.0, 0.0)
    for observed in (step, step[::-1]):
        (split,) = PiecewiseCubicRegressor(pieces=2).fit(rows, observed).split_points_
        assert min((rows < split).sum(), (rows > split).sum()) == 8


def test_region_knows_its_reach():
    corners = np.array([[0.0, 0.0], [10.0, 2.0]])
    region = TrainingRegion(corners, corners[0], corners[1], 0.25)
    rows = np.array([[2.0, 0.0], [3.0, 0.0], [-0.1, 0.0], [-0.3, 0.0], [10.0, 2.0]])
    np.testing.assert_allclose(region.distance(rows), [0.2, 0.3, 0.01, 0.03, 0.0], atol=1e-12)
    assert region.contains(rows).tolist() == [True, False, True, False, True]


# ------------------------------------------------------------------ the surface

N = 900
RUN = np.repeat([f"run {k}" for k in range(9)], 100)
DRAWN = np.random.default_rng(1)
PRELOAD = DRAWN.uniform(-1500, 0, N)
AMPLITUDE = DRAWN.uniform(2e-5, 7e-4, N)
FREQUENCY = DRAWN.uniform(20, 80, N)
LINES = np.column_stack([PRELOAD, AMPLITUDE, FREQUENCY])


def law(points):
    preload, amplitude, frequency = points.T
    elastic = 2e5 + 1.5e5 * (1 + np.tanh((-preload - 700) / 150))
    return elastic * (1.2 - 250 * amplitude + 0.12j * (frequency / 40) ** 0.3)


STIFFNESS = law(LINES)
SURFACE = DynamicStiffnessSurface().fit(LINES, STIFFNESS)
POINTS = operating_points([-1200.0, -700.0, -300.0], [1e-4, 3e-4, 5e-4], 40.0)
MIDDLE = np.array([-700.0, 2e-4, 40.0])


def samples(lines=slice(None)):
    return StiffnessSamples(*LINES.T[:, lines], STIFFNESS[lines], RUN[lines])


def test_shapes_follow_the_points():
    grid = operating_points(np.full((4, 1), -700.0), np.full((1, 5), 2e-4), 40.0)
    for points, shape in ((POINTS, (3,)), (MIDDLE, ()), (grid, (4, 5))):
        assert SURFACE.predict(points).shape == SURFACE.supported(points).shape == shape
        assert SURFACE.gradient(points).shape == (*shape, 3)
        lower, upper = SURFACE.predict_interval(points)
        assert lower.shape == upper.shape == shape
        assert np.all((lower.real < upper.real) & (lower.imag < upper.imag))
    assert SURFACE.predict(POINTS).dtype == complex


def test_scikit_learn_cross_validates_a_surface_by_whole_runs():
    scores = cross_val_score(
        DynamicStiffnessSurface(), LINES, STIFFNESS, groups=RUN, cv=GroupKFold(3)
    )
    assert scores.min() > 0.99
    squares = np.abs(STIFFNESS - SURFACE.predict(LINES)) ** 2
    spread = np.abs(STIFFNESS - STIFFNESS.mean()) ** 2
    assert SURFACE.score(LINES, STIFFNESS) == pytest.approx(1 - squares.sum() / spread.sum())


def test_storage_gives_the_same_surface_bit_for_bit():
    file = io.BytesIO()
    np.savez(file, allow_pickle=False, **SURFACE.to_arrays())
    file.seek(0)
    with np.load(file, allow_pickle=False) as stored:
        again = DynamicStiffnessSurface.from_arrays(stored)
    everywhere = np.linspace([-2000, 0, 10], [400, 1e-3, 90], 50)
    for ask in (
        lambda s: s.predict(everywhere, extrapolate=True),
        lambda s: s.supported(everywhere),
        lambda s: s.predict_interval(POINTS),
        lambda s: s.gradient(POINTS),
    ):
        np.testing.assert_array_equal(ask(again), ask(SURFACE))
    assert (again.units, again.ranges, again.n_lines_) == (SURFACE.units, SURFACE.ranges, N)
    for name in ("r2_real_", "r2_imag_", "r2_force_"):
        assert getattr(again, name) == getattr(SURFACE, name)


def test_storage_of_another_version_or_incomplete_is_refused():
    arrays = SURFACE.to_arrays()
    with pytest.raises(InputError, match="format 2 cannot be read"):
        DynamicStiffnessSurface.from_arrays({**arrays, "format": np.array(2)})
    for missing in ("format", "r2_real", "real_coefficients", "region_points"):
        partial = {name: array for name, array in arrays.items() if name != missing}
        with pytest.raises(InputError, match=missing):
            DynamicStiffnessSurface.from_arrays(partial)
    cut = {**arrays, "imag_coefficients": arrays["imag_coefficients"][:, :19]}
    with pytest.raises(InputError, match=r"coefficients imag of shape \(2, 19, 1\), expected"):
        DynamicStiffnessSurface.from_arrays(cut)
    for name in ("region_lower", "region_points"):
        with pytest.raises(InputError, match="training region"):
            DynamicStiffnessSurface.from_arrays({**arrays, name: arrays[name][..., :2]})


def test_at_fixed_preload_and_frequency_it_is_a_cubic_in_the_amplitude():
    split = SURFACE.real_.split_points_[0]
    preload = np.array([[-1200.0], [split], [split + 4.0], [-200.0]])
    frequency = np.array([[30.0, 60.0]])
    coefficients = SURFACE.at_amplitude(preload, frequency)
    assert coefficients.shape == (4, 2, 4)
    low, high = SURFACE.ranges["amplitude"]
    for amplitude in (3e-5, 2.2e-4, 6.9e-4):
        points = operating_points(preload, amplitude, frequency)
        z = (2 * amplitude - low - high) / (high - low)
        expected = SURFACE.predict(points, extrapolate=True)
        np.testing.assert_allclose(coefficients @ z ** np.arange(4), expected, rtol=1e-11)
        slope = coefficients[..., 1:] @ ([1, 2, 3] * z ** np.arange(3)) * 2 / (high - low)
        np.testing.assert_allclose(SURFACE.gradient(points)[..., 1], slope, rtol=1e-9)


def test_predict_names_what_lies_outside():
    with pytest.raises(InputError, match=r"1 of 3 points .* preload was measured from -149. to"):
        SURFACE.predict(operating_points([-1000.0, 500.0, -900.0], 2e-4, 40.0))
    with pytest.raises(InputError, match="frequency was measured from 20"):
        SURFACE.predict([-700.0, 2e-4, 140.0])
    kept = (np.abs(PRELOAD + 700) > 300) | (np.abs(FREQUENCY - 50) > 20)
    kept |= np.abs(AMPLITUDE - 3.5e-4) > 2e-4
    holed = DynamicStiffnessSurface().fit(LINES[kept], STIFFNESS[kept])
    with pytest.raises(InputError, match="no line was measured near it"):
        holed.predict([-700.0, 3.5e-4, 50.0])
    points = operating_points([-700.0, -1200.0], [3.5e-4, 2e-4], 50.0)
    assert np.isfinite(holed.predict(points, extrapolate=True)).all()
    assert holed.supported(points).tolist() == [False, True]


def test_predict_refuses_what_the_lines_do_not_determine():
    """Amplitude tied to the frequency: beside the curve the cubic is free, however near."""
    frequency = np.linspace(20, 80, 400)
    lines = operating_points(
        np.tile([-300.0, -350.0], 200), 1e-4 + 5e-4 * (frequency - 20) / 60, frequency
    )
    with pytest.warns(FewLevelsWarning, match="variable 1 takes 2 of the 4 levels"):
        tied = DynamicStiffnessSurface().fit(lines, law(lines))
    assert tied.supported(lines).all()
    with pytest.raises(InputError, match="the measured lines do not determine the model there"):
        tied.predict([-300.0, 3.6e-4, 50.0])


def test_a_state_measured_again_is_supported_at_the_edge_of_the_lines():
    """Noise moves the end of a ramp beyond every leverage of the fit; a line beside it vouches."""
    region, real, imag = SURFACE.region_, SURFACE.real_, SURFACE.imag_
    step = 0.02 * (region.upper - region.lower)
    edge = LINES[np.argmax(real.leverage_ratio(LINES))]
    moved = np.array([edge + step * np.array(s) for s in np.ndindex(3, 3, 3)]) - step
    ratio = np.maximum(real.leverage_ratio(moved), imag.leverage_ratio(moved))
    inside, distance = region.contains(moved), region.distance(moved)
    further = inside & (distance <= 0.025) & (ratio > 1.001) & (ratio < 3.9)
    assert further.any()
    assert SURFACE.supported(moved[further]).all()
    away = inside & (distance > 0.03) & (ratio > 1.001)
    assert not SURFACE.supported(moved[away]).any()


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda: operating_points(np.zeros(3), np.zeros(4), 40.0), "shapes"),
        (lambda: SURFACE.supported([np.nan, 1e-4, 40.0]), "must be finite"),
        (lambda: SURFACE.predict([-700.0, 1e-4]), "last axis is preload, amplitude, frequency"),
        (lambda: SURFACE.predict_interval(MIDDLE, 1.0), "coverage lies between 0 and 1"),
        (lambda: friction_stiffness(-0.1), "at least 0"),
        (
            lambda: DynamicStiffnessSurface(gaussian_process(), max_lines=1).fit(LINES, STIFFNESS),
            "max_lines is at least 2",
        ),
        (  # twenty lines and twenty terms in the lower piece
            lambda: DynamicStiffnessSurface(
                PiecewiseCubicRegressor(split=[np.sort(PRELOAD)[19:21].mean()], overlap=0.0)
            ).fit(LINES, STIFFNESS),
            "900 lines are too few for cubics",
        ),
        (
            lambda: DynamicStiffnessSurface(PiecewiseCubicRegressor(pieces="cv")).fit(
                LINES, STIFFNESS
            ),
            "name each line's run",
        ),
    ],
)
def test_questions_without_sense_are_refused(ask, words):
    with pytest.raises(InputError, match=words):
        ask()


@pytest.mark.parametrize(
    ("X", "y", "options", "words"),
    [
        (LINES[:-1], STIFFNESS, {}, r"stiffness: shape \(899\) is needed, not \(900,\)"),
        (LINES[:, :2], STIFFNESS, {}, "preload, amplitude and frequency: shape .900, 3. is needed"),
        (LINES * [1, -1, 1], STIFFNESS, {}, "peak value of at least 0 m"),
        (LINES - [0, 0, 30], STIFFNESS, {}, "above 0 Hz"),
        (
            LINES,
            np.where(np.arange(N) == 7, np.nan, STIFFNESS),
            {},
            r"stiffness: a number is not finite at index \(7,\)",
        ),
        (LINES, STIFFNESS, {"sample_weight": np.arange(N)}, "weights are above 0"),
        (LINES[:0], STIFFNESS[:0], {}, "no lines"),
        (LINES[:20], STIFFNESS[:20], {}, "20 lines are too few for cubics"),
        (LINES[:19], STIFFNESS[:19], {}, "19 distinct rows do not determine a cubic of 20 terms"),
        (LINES, STIFFNESS, {"groups": ["a", "b"]}, "2 names of runs for 900 lines"),
    ],
)
def test_lines_that_cannot_be_fitted_are_refused(X, y, options, words):
    with pytest.raises(InputError, match=words):
        DynamicStiffnessSurface().fit(X, y, **options)


# ------------------------------------------------------------------ other models


@pytest.mark.parametrize(
    "model",
    [KelvinVoigtModel(), BergModel(), DynamicStiffnessSurface(gaussian_process(), max_lines=80)],
)
def test_other_models_share_the_interface(model):
    fitted = clone(model).fit(LINES[::9], STIFFNESS[::9])
    stiffness = fitted.predict(POINTS, extrapolate=True)
    assert stiffness.shape == (3,)
    assert fitted.predict(LINES[9]).shape == ()
    assert fitted.units == SURFACE.units
    with pytest.raises(InputError, match="outside of the measured region"):
        fitted.predict([2000.0, 2e-4, 40.0])
    if isinstance(model, BergModel):
        # a Maxwell element far below and above its corner: Berg, Vehicle System Dynamics 30, 1998
        spring, damper = berg_shape([0.0, 1e-4, 0.5, 10.0], np.full(2, 1e-4), np.array([1e-3, 1e5]))
        assert (spring, damper) == (pytest.approx(1 + 5e-5j, abs=1e-8), pytest.approx(1.5 + 5e-5j))
    if isinstance(model, DynamicStiffnessSurface):
        np.testing.assert_allclose(stiffness, law(POINTS), rtol=0.05)


@pytest.mark.parametrize(
    ("ask", "what"),
    [
        (lambda s: s.predict_interval(LINES[9]), "interval"),
        (lambda s: s.gradient(LINES[9]), "gradient"),
        (lambda s: s.at_amplitude(-700.0, 40.0), "cubic in the amplitude"),
        (lambda s: s.predict_refitted(LINES, STIFFNESS, LINES), "refit"),
        (lambda s: s.to_arrays(), "stored form"),
    ],
)
def test_what_only_cubics_have_is_refused_by_name(ask, what):
    other = DynamicStiffnessSurface(KNeighborsRegressor(1), max_lines=2).fit(LINES, STIFFNESS)
    assert np.array_equal(other.predict(LINES[[0, -1]], extrapolate=True), STIFFNESS[[0, -1]])
    with pytest.raises(InputError, match=f"surface of KNeighborsRegressor has no {what}"):
        ask(other)
    with pytest.raises(InputError, match="GaussianProcessRegressor fits all lines alike"):
        DynamicStiffnessSurface(GaussianProcessRegressor()).fit(LINES, STIFFNESS, 1 + LINES[:, 1])


def test_comparison_is_one_table_over_common_lines():
    few = samples(slice(50))
    beyond = StiffnessSamples(
        np.append(few.preload, 5000.0),
        np.append(few.displacement, 2e-4),
        np.append(few.frequency, 40.0),
        np.append(few.stiffness, 1e5),
    )
    models = standard_models()
    fits = {name: models[name] for name in ("one cubic", "two cubics", "Kelvin-Voigt")}
    table = compare_models(fits, samples(), beyond, truth=beyond.stiffness)
    assert table["model"].tolist() == list(fits)
    assert (table["lines compared [1]"] == 50).all()
    np.testing.assert_allclose(table["share of lines [%]"], 100 * 50 / 51)
    np.testing.assert_allclose(table["rms error [%]"], table["rms error against truth [%]"])
    assert "rms error against truth [%]" not in compare_models(fits, samples(), beyond)
    with pytest.raises(InputError, match="no models"):
        compare_models({}, samples(), beyond)
    with pytest.raises(InputError, match="no line to check"):
        compare_models(fits, samples(), StiffnessSamples([9e3], [1e-4], [40.0], [1e5]))


def test_agreement_is_in_the_phase_of_the_displacement():
    phase = np.exp(1j * GENERATOR.uniform(0, 6, N))
    lines = StiffnessSamples(PRELOAD, AMPLITUDE * phase, FREQUENCY, STIFFNESS)
    result = agreement(lines, 1.01 * STIFFNESS)
    force = STIFFNESS * AMPLITUDE * phase
    assert result["r2_force_real"] == pytest.approx(r_squared(force.real, 1.01 * force.real))
    assert result["r2_force_imag"] == pytest.approx(r_squared(force.imag, 1.01 * force.imag))
    with pytest.raises(InputError, match="all equal"):
        r_squared(np.ones(4), np.ones(4))


def test_a_frequency_over_decades_enters_as_its_logarithm():
    lines = np.random.default_rng(3).uniform([0, 1e-5, -1], [800, 5e-4, 2.5], (1500, 3))
    lines[:, 2] = 10 ** lines[:, 2]
    relaxed = (1j * lines[:, 2] / 5) ** 0.5
    stiffness = 2e5 * (1 + lines[:, 0] / 800) * (1 + 10 * relaxed) / (1 + relaxed)
    surfaces = [
        DynamicStiffnessSurface(PiecewiseCubicRegressor(logarithmic=columns)).fit(lines, stiffness)
        for columns in ((), (2,))
    ]
    plain, by_logarithm = (
        np.sqrt(np.mean(np.abs(each.predict(lines) / stiffness - 1) ** 2)) for each in surfaces
    )
    assert plain > 0.15
    assert by_logarithm < 0.02
    again = DynamicStiffnessSurface.from_arrays(surfaces[1].to_arrays())
    np.testing.assert_array_equal(again.predict(lines), surfaces[1].predict(lines))
    np.testing.assert_array_equal(again.supported(lines), surfaces[1].supported(lines))
    step = 1e-5 * lines * [0, 0, 1]
    slope = surfaces[1].predict(lines + step, True) - surfaces[1].predict(lines - step, True)
    np.testing.assert_allclose(again.gradient(lines)[:, 2], slope / (2 * step[:, 2]), rtol=1e-6)
    for columns in ((0,), (3,)):
        with pytest.raises(InputError, match="logarithmic names columns from 1 to 2"):
            PiecewiseCubicRegressor(logarithmic=columns).fit(lines, stiffness.real)
    with pytest.raises(InputError, match="lies above 0"):
        surfaces[1].real_.predict(lines * [1, 1, 0])
