"""The compressor: its model, and verdicts on limits, characteristics and routes."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from deboom.arrays import DOFS, derivatives
from deboom.bench.choices import CompressorCase
from deboom.bench.compressor_truth import CompressorPlan, true_compressor
from deboom.bench.electric_car import MOUNTS as MOUNT_NAMES
from deboom.compressor.acceptance import (
    DYNAMIC,
    STATIC,
    Bounds,
    Characteristic,
    Decision,
    StiffnessLimit,
    judge,
    overall,
    stiffness_characteristic,
    unbalance_characteristic,
)
from deboom.compressor.identified_compressor import HosePresence, IdentifyOptions
from deboom.compressor.measured_unbalance import (
    AUTOMATIC,
    MeasuredUnbalance,
    UnbalanceTruth,
    with_route,
)
from deboom.compressor.model import (
    CompressorModel,
    GainFactor,
    HyperbolicGain,
    gain_from_parameters,
    gain_parameters,
    modal_table,
    mounts_at_virtual_point,
    rigid_limit,
)
from deboom.compressor.parameters import (
    MinimalParameters,
    ThesisParameters,
    mass_matrix_from_parameters,
    mass_parameters,
)
from deboom.compressor.routes import CALIBRATED_MEASUREMENT, UPDATED
from deboom.compressor.self_calibration import SelfCalibration
from deboom.compressor.sources import ResidualBand
from deboom.compressor.unbalance import Unbalance, UnbalanceOptions
from deboom.errors import InputError
from deboom.measurement.compressor_test import CompressorMount, HoseState
from deboom.pages.component_sheet import open_points, verdict_table
from deboom.physics.rigid_body import RigidBody, mass_matrix

LINES = np.arange(10.0, 150.5, 0.5)
FEW = np.array([10.0, 17.5, 30.0, 100.0, 150.0])
STRUCK = true_compressor(CompressorPlan(CompressorCase.TABLE11), np.random.default_rng(1))
RUBBER, INERTIA, CENTRE = STRUCK.gain, STRUCK.inertia, STRUCK.centre
GAIN = GainFactor.of(RUBBER)
MOUNTS = tuple(
    map(CompressorMount, MOUNT_NAMES, STRUCK.positions, STRUCK.rotations, STRUCK.stiffness)
)


def compressor(gain=RUBBER):
    return CompressorModel(
        7.2, CENTRE, INERTIA, mounts_at_virtual_point(MOUNTS), GainFactor.of(gain)
    )


MODEL = compressor()


def thesis_values():
    values = ThesisParameters().values_of(MODEL, MOUNTS)
    values[-1] = 1.1
    return values


CASES = [
    pytest.param(MinimalParameters(0.055), MinimalParameters(0.055).values_of(MODEL), id="minimal"),
    pytest.param(ThesisParameters(), thesis_values(), id="thesis"),
]


@pytest.mark.parametrize(("parametrisation", "values"), CASES)
def test_derivatives_of_apparent_mass_and_mass(parametrisation, values):
    """Of the rows at once, against one compressor after the other."""
    by_number = parametrisation.sensitivities(values, FEW)
    by_mass = parametrisation.mass_slope(values)

    def one_by_one(rows):
        models = [parametrisation.model(row) for row in rows]
        masses = [np.full((1, 6, 6), model.mass) for model in models]
        seen = [model.apparent_mass(FEW) for model in models]
        return np.concatenate([np.array(masses), np.array(seen)], axis=1)

    expected = derivatives(one_by_one, values, 1e-3 * np.maximum(np.abs(values), 1e-2))
    size = np.abs(by_number).max(axis=(1, 2, 3), keepdims=True)
    assert size.min() > 0
    np.testing.assert_allclose((by_number - expected[:, 1:]) / size, 0, atol=1e-7)
    np.testing.assert_allclose(by_mass, expected[:, 0, 0, 0].real, rtol=1e-7, atol=1e-9)


def test_parameters_return_the_compressor():
    minimal = MinimalParameters(0.055)
    thesis = ThesisParameters().values_of(MODEL, MOUNTS)
    back = minimal.model(minimal.values_of(MODEL))
    for model in (back, ThesisParameters().model(thesis)):
        np.testing.assert_allclose(
            model.apparent_mass(FEW), MODEL.apparent_mass(FEW), rtol=0, atol=1e-12
        )
    assert back.gain.real.at(20.0) == pytest.approx(1.0, abs=1e-14)
    thesis[-1] = 2.0
    doubled = ThesisParameters().model(thesis)
    np.testing.assert_allclose(doubled.gain.at(FEW), 2 * GAIN.at(FEW), rtol=1e-14)


def test_any_ten_numbers_are_a_body_and_any_body_is_ten_numbers():
    rng = np.random.default_rng(2)
    for _ in range(50):
        matrix = mass_matrix_from_parameters(rng.normal(0, 1, 10), 0.1)
        assert np.linalg.eigvalsh(matrix)[0] > 0
        moments = np.linalg.eigvalsh(matrix[3:, 3:])
        assert moments[2] <= moments[0] + moments[1] + 1e-12 * moments[2]
    body = RigidBody(7.2, CENTRE, INERTIA)
    back = mass_matrix_from_parameters(mass_parameters(body, 0.055), 0.055)
    np.testing.assert_allclose(back, mass_matrix(7.2, INERTIA, CENTRE), rtol=1e-12, atol=1e-15)


def test_gain_shape_keeps_the_gain_but_for_its_scale():
    values = gain_parameters(GAIN, 20.0)
    shape = gain_from_parameters(values, 20.0)
    np.testing.assert_allclose(shape.at(FEW), GAIN.at(FEW) / GAIN.real.at(20.0), rtol=1e-13)


def bare(stiffness, mass=7.0, inertia=INERTIA, gain=GAIN):
    return CompressorModel(mass, CENTRE, inertia, stiffness, gain)


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: HyperbolicGain(1.0, -0.1, 2.0), "slope is -0.1: give a number above 0"),
        (lambda: HyperbolicGain(1.0, 0.1, 0.0), "offset is 0.0"),
        (lambda: HyperbolicGain(np.nan, 0.1, 2.0), "limit is nan"),
        (lambda: bare(MODEL.stiffness, mass=-1.0), "mass of -1 kg"),
        (lambda: bare(MODEL.stiffness, inertia=np.diag([1.0, 1.0, 3.0])), "no body has the princ"),
        (lambda: bare(np.triu(np.ones((6, 6)))), "not symmetric"),
        (lambda: MODEL.apparent_mass([0.0, 10.0]), "0 Hz"),
        (lambda: modal_table(compressor([0.1, *RUBBER[1:]])), "not positive at a natural freq"),
        (lambda: modal_table(bare(np.diag([1e4, 1e4, -1e4, 1, 1, 1]))), "negative direction"),
        (lambda: rigid_limit(MODEL, LINES[:50], np.zeros((50, 6, 6))), "fewer than 8 lines"),
    ],
)
def test_what_cannot_be_is_refused(build, words):
    with pytest.raises(InputError, match=words):
        build()


def test_shapes_and_shares_of_a_body_on_a_mount_at_its_centre():
    """Translations along the mount's axes; energy shares add up to 1; the largest names them."""
    stiffness = np.diag([9e4, 4e4, 1e4, 100.0, 400.0, 900.0])
    model = CompressorModel(10.0, np.zeros(3), np.diag([0.02] * 3), stiffness, GAIN)
    table = modal_table(model)
    static = np.sqrt(np.diag(stiffness) / np.diag(model.mass_matrix)) / (2 * np.pi)
    for number, motion in enumerate(table.leading):
        axis = DOFS.index(motion)
        f = table.frequency[number]
        assert f == pytest.approx(static[axis] * np.sqrt(1.85 - 1 / (0.06 * f + 2.2)), rel=1e-10)
    assert sorted(table.leading) == sorted(DOFS)
    gains = GAIN.at(table.frequency)
    np.testing.assert_allclose(table.loss_factor, gains.imag / gains.real, rtol=1e-12)
    np.testing.assert_allclose(table.energy.sum(axis=0), 1, rtol=1e-12)
    coupled = modal_table(MODEL)
    np.testing.assert_allclose(coupled.energy.sum(axis=0), 1, rtol=1e-9)
    product = coupled.shapes.T @ MODEL.mass_matrix @ coupled.shapes
    np.testing.assert_allclose(product, np.eye(6), atol=1e-10)


def drifting(pattern, resonance, rng=None, noise=0.0):
    """Apparent mass whose mass line grows towards a resonance of the body."""
    share = (LINES / resonance) ** 2
    growth = (share / (1 - share))[:, None, None] * pattern
    apparent = MODEL.apparent_mass(LINES) + growth
    if rng is not None:
        scale = np.repeat([1.0, 0.055], 3)
        apparent = apparent + noise * np.outer(scale, scale) * rng.standard_normal(apparent.shape)
    return apparent


@pytest.mark.parametrize("resonance", [200.0, 300.0, 500.0])
@pytest.mark.parametrize("where", ["diagonal", "coupling"])
def test_the_limit_is_where_the_drift_reaches_the_tolerance(resonance, where):
    """On the diagonal as in the coupling, which a trace would not see."""
    pattern = np.diag(MODEL.mass_matrix.diagonal())
    if where == "coupling":
        pattern = np.zeros((6, 6))
        pattern[0, 4] = pattern[4, 0] = 7.2 * 0.055
    length = np.sqrt(np.trace(INERTIA) / (3 * 7.2))
    weight = np.outer(np.repeat([1.0, 1 / length], 3), np.repeat([1.0, 1 / length], 3))
    ratio = np.linalg.norm(weight * pattern) / np.linalg.norm(weight * MODEL.mass_matrix)
    drift_limit = rigid_limit(MODEL, LINES, drifting(pattern, resonance))
    # ratio · x/(1 − x) = 0.03 with x = (f/f_n)²
    expected = resonance * np.sqrt(0.03 / (0.03 + ratio))
    share = (150 / resonance) ** 2
    assert drift_limit.drift == pytest.approx(ratio * share / (1 - share), rel=0.02)
    assert drift_limit.holds_to == pytest.approx(expected, rel=0.02)
    assert not drift_limit.is_rigid
    assert f"holds to {drift_limit.holds_to:.0f} Hz" in drift_limit.statement


def test_noise_and_small_drift_count_as_rigid():
    rng = np.random.default_rng(3)
    assert rigid_limit(MODEL, LINES, drifting(np.zeros((6, 6)), 1e4, rng, 0.3)).is_rigid
    apparent = drifting(MODEL.mass_matrix, 1500.0)
    small = rigid_limit(MODEL, LINES, apparent)
    assert small.is_rigid
    assert small.drift == pytest.approx(0.01, abs=0.001)
    strict = rigid_limit(MODEL, LINES, apparent, tolerance=0.005)
    assert strict.holds_to == pytest.approx(1500 * np.sqrt(0.005), rel=0.02)


Z95 = 1.6448536269514722
"""One-sided 95 % quantile of the normal distribution."""


def measured(value, deviation=1.0, lines=0.0, **more):
    values = np.atleast_1d(np.asarray(value, dtype=float))
    lines = np.broadcast_to(lines, values.shape)
    return Characteristic("x", values, np.full(values.size, deviation), lines, **more)


UPPER, WINDOW = Bounds(at_most=10.0), Bounds(at_least=8.0, at_most=12.0)


CIRCLE = np.sqrt(-2 * np.log(0.05))
"""Radius that holds a vector with 95 %, in deviations."""
WORST_OF_9 = 2.539
"""One-sided quantile of 5 % over 9 lines."""


@pytest.mark.parametrize(
    ("number", "bounds", "decision"),
    [
        (measured(10 - Z95 - 1e-6), UPPER, Decision.PASS),
        (measured(10 - Z95 + 1e-6), UPPER, Decision.UNDECIDED),
        (measured(10.0), UPPER, Decision.UNDECIDED),
        (measured(10 + Z95 - 1e-6), UPPER, Decision.UNDECIDED),
        (measured(10 + Z95 + 1e-6), UPPER, Decision.FAIL),
        (measured(6.0), WINDOW, Decision.FAIL),
        (measured(8.0), WINDOW, Decision.UNDECIDED),
        (measured(10.0), WINDOW, Decision.PASS),
        # narrower than its guard bands
        (measured(10.0), Bounds(at_least=9.0, at_most=11.0), Decision.UNDECIDED),
        # the worst of many lines needs more to fail, and as much to pass
        (measured([10 + WORST_OF_9 - 1e-2] + [1.0] * 8), UPPER, Decision.UNDECIDED),
        (measured([10 + WORST_OF_9 + 1e-2] + [1.0] * 8), UPPER, Decision.FAIL),
        (measured([10 - Z95 - 1e-6] + [1.0] * 8), UPPER, Decision.PASS),
        # an unbalance fails with its whole circle
        (measured(10 + CIRCLE - 1e-6, is_radius=True), UPPER, Decision.UNDECIDED),
        (measured(10 + CIRCLE + 1e-6, is_radius=True), UPPER, Decision.FAIL),
        (measured([10 + CIRCLE + 1e-6, 1.0], is_radius=True), UPPER, Decision.UNDECIDED),
        (measured(1.0, doubt="a wet compressor"), UPPER, Decision.UNDECIDED),
    ],
)
def test_the_guard_band_lies_on_both_sides_of_a_bound(number, bounds, decision):
    verdict = judge(number, bounds)
    assert verdict.decision is decision
    assert verdict.interval == pytest.approx((verdict.value - Z95, verdict.value + Z95))
    assert verdict.doubt == number.doubt


def test_the_line_next_to_its_limit_decides_a_band():
    verdict = judge(measured([5.0, 9.5, 7.0], lines=[10.0, 20.0, 30.0]), UPPER)
    assert (verdict.decision, verdict.value, verdict.line) == (Decision.UNDECIDED, 9.5, 20.0)
    assert verdict.shrinkage == pytest.approx(0.5 / Z95)


def test_a_smaller_risk_needs_a_wider_guard():
    assert judge(measured(8.0), UPPER, risk=0.01).decision is Decision.UNDECIDED
    assert judge(measured(8.0), UPPER, risk=0.05).decision is Decision.PASS


def test_the_part_is_as_good_as_its_worst_verdict():
    verdicts = [judge(measured(value), UPPER) for value in (1.0, 10.0, 99.0)]
    assert overall(verdicts) is Decision.FAIL
    assert overall(verdicts[:2]) is Decision.UNDECIDED
    assert overall(verdicts[:1]) is Decision.PASS


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (Bounds, "needs a bound"),
        (lambda: Bounds(at_least=2.0, at_most=1.0), "no part keeps both"),
        (lambda: measured(1.0, deviation=0.0), "deviations is 0.0: give a number above 0"),
        (lambda: judge(measured(1.0), UPPER, risk=0.5), "a risk of"),
        (lambda: overall([]), "can neither pass nor fail"),
        (lambda: with_route(unbalance_source(), "a"), "there is no route 'a': choose auto, d, e"),
    ],
)
def test_bad_input_is_refused(build, words):
    with pytest.raises(InputError, match=words):
        build()


def unbalance_source(
    *,
    hoses=HoseState.SOFT,
    share=0.0,
    chi=1.0,
    alarms=(),
    route=CALIBRATED_MEASUREMENT,
    converged=True,
    presence=(),
    changed=True,
):
    """Build what is read of an `Unbalance` by routes d and e."""
    covariance = np.diag([4.0, 1.0, 9.0, 9.0, 0.0, 0.0])
    covariance[0, 1] = covariance[1, 0] = 1.5
    sources = SimpleNamespace(
        static=SimpleNamespace(value=3 + 4j),
        dynamic=SimpleNamespace(value=-7 + 0j),
        covariance=covariance,
        remaining_chi=chi,
        residual_bands=(ResidualBand(90.0, 120.0, share, 5.0 if share else 1.0),),
    )
    routes, single_sweep = (CALIBRATED_MEASUREMENT, UPDATED), (SimpleNamespace(sweep="one"),)
    fit = SimpleNamespace(converged=converged)
    sweeps = (
        SimpleNamespace(name="one", hoses=hoses),
        SimpleNamespace(name="another", hoses=HoseState.STANDARD),
    )
    return Unbalance(
        SimpleNamespace(sweeps=sweeps),
        SimpleNamespace(alarms=alarms),
        UnbalanceOptions(routes=routes, chosen=route),
        (),
        None,
        tuple(
            SimpleNamespace(sources=sources, sweeps=single_sweep, route=each, fit=fit)
            for each in routes
        ),
        SimpleNamespace(changed=changed),
        (),
        (),
        presence,
    )


def test_the_size_of_an_unbalance_with_its_worst_direction():
    measured = unbalance_characteristic(unbalance_source(), STATIC)
    assert measured.values.tolist() == [5.0]
    # largest eigenvalue of [[4, 1.5], [1.5, 1]]
    assert measured.deviations == pytest.approx([np.sqrt(2.5 + np.sqrt(4.5))])
    assert measured.is_radius
    assert measured.doubt == ""
    assert unbalance_characteristic(unbalance_source(), DYNAMIC).deviations.tolist() == [3.0]


@pytest.mark.parametrize(
    ("state", "words"),
    [
        ({"hoses": HoseState.STANDARD}, "run with long soft hoses"),
        ({"share": 0.08}, "8.0 % of the load in 90-120 Hz comes from no rotor"),
        ({"presence": (HosePresence("sweep one", 5.0, 0.3),)}, "they were attached"),
        ({"chi": 2.5}, "residuals are 2.50 times the noise"),
        ({"converged": False}, "no rotor, gas and mounts explain the sweeps"),
        ({"alarms": ("a subframe",), "route": UPDATED}, "choose route d"),
    ],
)
def test_what_makes_it_prove_nothing(state, words):
    assert words in unbalance_characteristic(unbalance_source(**state), STATIC).doubt
    # a measured route does not need the refuted model
    assert unbalance_characteristic(unbalance_source(alarms=("a subframe",)), STATIC).doubt == ""


def identified(alarms=()):
    """Make a compressor whose 35 parameters are known to 1 %, independent of each other."""
    parameters, gain = MinimalParameters(0.0591), GainFactor.of([1.85, 0.06, 2.2, 0.42, 0.15, 2.5])
    stiffness = np.diag([7e4, 5e4, 6e4, 400.0, 600.0, 650.0])
    inertia = np.diag([0.0158, 0.0291, 0.0302])
    values = parameters.values_of(CompressorModel(7.2, np.zeros(3), inertia, stiffness, gain))
    covariance = np.diag(np.maximum(0.01 * np.abs(values), 1e-6) ** 2)
    calibrated = SelfCalibration(parameters, values, None, np.zeros(0), covariance, 1.0, True)
    return SimpleNamespace(calibrated=calibrated, alarms=alarms, options=IdentifyOptions())


def limit(direction="x", band=(20.0, 20.0)):
    return StiffnessLimit(direction, band, Bounds(at_most=1.0))


def test_the_stiffness_at_the_reference_line():
    """There Re v is 1, so that |K| is K times |v|, and only K and v's loss are uncertain."""
    kept = identified()
    characteristic = stiffness_characteristic(kept, limit("rz"))
    model = kept.calibrated.model
    size = abs(model.gain.at([20.0])[0]) * model.stiffness[5, 5]
    assert characteristic.values == pytest.approx([size])
    assert characteristic.values[0] > model.gain.real.at(20.0) * model.stiffness[5, 5]
    assert 0.01 <= characteristic.deviations[0] / characteristic.values[0] < 0.02


def test_the_deviation_is_that_of_drawn_parameters():
    kept = identified()
    characteristic = stiffness_characteristic(kept, limit("y", (15.0, 60.0)))
    rng, calibrated, drawn = np.random.default_rng(3), kept.calibrated, []
    for _ in range(400):
        model = calibrated.parametrisation.model(
            calibrated.values + rng.standard_normal(35) * np.sqrt(np.diag(calibrated.covariance))
        )
        drawn.append(np.abs(model.gain.at(characteristic.lines)) * model.stiffness[1, 1])
    assert characteristic.deviations == pytest.approx(np.std(drawn, axis=0), rel=0.2)


def test_an_alarm_or_a_band_beyond_the_fitted_lines_proves_nothing():
    doubted = identified(alarms=("The residuals are 3 times the noise.",))
    assert "not to be trusted: The residuals" in stiffness_characteristic(doubted, limit()).doubt
    kept = identified()
    assert stiffness_characteristic(kept, limit(band=(10.0, 150.0))).doubt == ""
    assert "10–150 Hz" in stiffness_characteristic(kept, limit(band=(10.0, 200.0))).doubt


VERDICTS = tuple(
    judge(
        Characteristic(name, np.array([value]), np.array([deviation]), np.array([line]), **more),
        bounds,
    )
    for name, value, deviation, line, bounds, more in (
        (STATIC, 20e-6, 0.1e-6, 0.0, Bounds(at_most=22e-6), {"is_radius": True}),
        (DYNAMIC, 1.2e-6, 8e-9, 0.0, Bounds(at_most=1.207e-6), {"is_radius": True}),
        ("dynamic stiffness x, 10–30 Hz", 8e4, 100.0, 30.0, Bounds(at_least=6e4, at_most=7e4), {}),
        ("dynamic stiffness rz, 20 Hz", 685.0, 6.0, 20.0, Bounds(at_most=684.9), {}),
        ("dynamic stiffness y, 20 Hz", 8e4, 50.0, 20.0, Bounds(at_most=9e4), {"doubt": "on."}),
    )
)


def test_values_have_the_units_of_a_drawing():
    table = verdict_table(VERDICTS).set_index("characteristic")
    assert table["unit"].tolist() == ["g mm", "g mm²", "N/mm", "N m/rad", "N/mm"]
    assert table["measured"].tolist() == pytest.approx([20.0, 1200.0, 80.0, 685.0, 80.0])
    assert table["guard band ±"].tolist() == pytest.approx(
        [0.1645, 13.16, 0.1645, 9.869, 0.0822], rel=1e-3
    )
    assert np.isnan(table.loc[STATIC, "at least"])
    assert table["verdict"].tolist() == ["pass", "undecided", "fail", "undecided", "undecided"]


def test_what_is_open_comes_with_what_would_decide_it():
    table = open_points(VERDICTS).set_index("not decided")["what would decide it"]
    assert list(table.index) == [DYNAMIC, *(verdict.name for verdict in VERDICTS[3:])]
    # the guard band of 13.2 must shrink to the 7 that are left, by the mean of (13.2/7)² set-ups
    assert table[DYNAMIC].startswith("A guard band of ± 7 g mm² instead of ± 13")
    assert "mean of 4 set-ups" in table[DYNAMIC]
    assert table["dynamic stiffness rz, 20 Hz"].startswith("The value lies on its limit")
    assert table["dynamic stiffness y, 20 Hz"] == "On."
    assert open_points(VERDICTS[:1]).empty


@pytest.mark.parametrize(
    ("state", "letter"),
    [
        ({}, "e"),
        ({"changed": False}, "d"),
        ({"alarms": ("a subframe",)}, "d"),
        ({"hoses": HoseState.STANDARD}, "d"),
        ({"share": 0.08}, "d"),
    ],
)
def test_mounts_are_updated_only_where_nothing_else_can_look_like_them(state, letter):
    assert with_route(unbalance_source(**state), AUTOMATIC).chosen.route.letter == letter
    assert with_route(unbalance_source(**state), "e").chosen.route.letter == "e"


@pytest.mark.parametrize(
    ("state", "changed"), [({}, "yes"), ({"changed": False}, "no"), ({"share": 0.08}, "unknown")]
)
def test_mounts_are_not_judged_with_hoses_in_the_data(state, changed):
    measured = MeasuredUnbalance(
        with_route(unbalance_source(**state), "d"), None, None, (), None, (), None, 0.0
    )
    assert measured.mounts_changed == changed
    if changed == "unknown":
        assert "cannot be told" in measured.mount_state


def test_loads_are_taken_at_the_lines_of_the_sweep():
    lines, load = np.arange(17.0, 151.0), np.random.default_rng(1).standard_normal((134, 6))
    truth = UnbalanceTruth(Path("operation.json"), 2e-5, 1e-6, {"soft": load}, {"soft": lines})
    some = lines[10:100:7]
    for name, at, expected in (
        ("soft", some, load[10:100:7]),
        ("soft", some + 0.1, None),
        ("over time", some, None),
    ):
        np.testing.assert_array_equal(
            truth.load_of(SimpleNamespace(sweep=name, frequency=at)), expected
        )


def test_hoses_that_halve_a_misfit_explain_three_quarters_of_its_square():
    assert HosePresence("sweep", misfit=4.0, misfit_with_hoses=2.0).explained == 0.75
    assert HosePresence("sweep", misfit=4.0, misfit_with_hoses=4.0).explained == 0.0
