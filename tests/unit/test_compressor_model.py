"""The compressor's model: gain, parameters, modes and rigid limit."""

import numpy as np
import pytest

from deboom.arrays import AXES, derivatives
from deboom.bench.compressor_truth import CompressorPlan, true_compressor
from deboom.bench.electric_car import MOUNTS as MOUNT_NAMES
from deboom.choices import CompressorCase
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
from deboom.errors import InputError
from deboom.measurement.compressor_test import CompressorMount
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
        (lambda: HyperbolicGain(1.0, -0.1, 2.0), "must be positive"),
        (lambda: HyperbolicGain(1.0, 0.1, 0.0), "must be positive"),
        (lambda: HyperbolicGain(np.nan, 0.1, 2.0), "finite"),
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
        axis = AXES.index(motion)
        f = table.frequency[number]
        assert f == pytest.approx(static[axis] * np.sqrt(1.85 - 1 / (0.06 * f + 2.2)), rel=1e-10)
    assert sorted(table.leading) == sorted(AXES)
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
    found = rigid_limit(MODEL, LINES, drifting(pattern, resonance))
    # ratio · x/(1 − x) = 0.03 with x = (f/f_n)²
    expected = resonance * np.sqrt(0.03 / (0.03 + ratio))
    share = (150 / resonance) ** 2
    assert found.drift == pytest.approx(ratio * share / (1 - share), rel=0.02)
    assert found.holds_to == pytest.approx(expected, rel=0.02)
    assert not found.is_rigid
    assert f"holds to {found.holds_to:.0f} Hz" in found.statement


def test_noise_and_small_drift_count_as_rigid():
    rng = np.random.default_rng(3)
    noisy = rigid_limit(MODEL, LINES, drifting(np.zeros((6, 6)), 1e4, rng, 0.3))
    assert noisy.is_rigid
    apparent = drifting(MODEL.mass_matrix, 1500.0)
    small = rigid_limit(MODEL, LINES, apparent)
    assert small.is_rigid
    assert small.drift == pytest.approx(0.01, abs=0.001)
    strict = rigid_limit(MODEL, LINES, apparent, tolerance=0.005)
    assert strict.holds_to == pytest.approx(1500 * np.sqrt(0.005), rel=0.02)
