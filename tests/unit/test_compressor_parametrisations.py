"""Gain, model and parametrisations of the compressor: derivatives, round trips, refusals."""

import numpy as np
import pytest

from deboom.compressor.gain import AmplitudeGain, GainFactor, HyperbolicGain
from deboom.compressor.gain_parameters import (
    gain_derivatives,
    gain_from_parameters,
    gain_parameters,
)
from deboom.compressor.identical_mounts import IdenticalMountParameters
from deboom.compressor.mass_parameters import mass_matrix_from_parameters, mass_parameters
from deboom.compressor.minimal_parameters import MinimalParameters
from deboom.compressor.model import CompressorModel
from deboom.compressor.parametrisation import Parametrisation
from deboom.compressor.thesis_parameters import ThesisParameters
from deboom.errors import InputError
from deboom.measurement.inertance_test import CompressorMount
from deboom.physics.mass_properties import RigidBody
from deboom.physics.rigid_body import mass_matrix

LINES = np.array([10.0, 17.5, 30.0, 100.0, 150.0])
INERTIA = np.array([[0.0158, 2e-4, -1.5e-4], [2e-4, 0.0291, 1e-4], [-1.5e-4, 1e-4, 0.0302]])
CENTRE = np.array([0.0015, -0.002, 0.001])
GAIN = GainFactor.of([1.85, 0.06, 2.2, 0.42, 0.15, 2.5])
MOUNTS = (
    CompressorMount(
        "mount 1",
        np.array([-0.156, 0.004, 0.020]),
        np.deg2rad([-4.9, -4.9, 185.0]),
        np.array([29900.0, 10800.0, 12200.0]),
    ),
    CompressorMount(
        "mount 2",
        np.array([-0.019, -0.067, 0.078]),
        np.deg2rad([2.5, 43.3, 87.5]),
        np.array([29700.0, 12900.0, 11800.0]),
    ),
    CompressorMount(
        "mount 3",
        np.array([-0.008, 0.074, 0.082]),
        np.deg2rad([2.2, 131.5, 89.4]),
        np.array([29200.0, 10600.0, 10300.0]),
    ),
)
MODEL = CompressorModel.on_mounts(7.2, CENTRE, INERTIA, MOUNTS, GAIN)


def identical_values() -> np.ndarray:
    minimal = MinimalParameters(0.055).values_of(MODEL)
    rng = np.random.default_rng(1)
    mounting = np.concatenate(
        [rng.normal(0, 0.003, 9), rng.normal(0, 0.05, 6), np.log([3e4, 1.2e4])]
    )
    return np.concatenate([minimal[:10], mounting, minimal[-5:]])


def thesis_values() -> np.ndarray:
    values = ThesisParameters().values_of(MODEL, MOUNTS)
    values[-1] = 1.1
    return values


CASES = [
    (MinimalParameters(0.055), MinimalParameters(0.055).values_of(MODEL)),
    (ThesisParameters(), thesis_values()),
    (IdenticalMountParameters(MOUNTS, 0.055), identical_values()),
]
NAMES = ["minimal", "thesis", "identical"]


def fourth_order(function, values, number, step):
    """Central difference over four points."""

    def at(times: int):
        moved = values.copy()
        moved[number] += times * step
        return function(moved)

    return (8 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12 * step)


@pytest.mark.parametrize(("parametrisation", "values"), CASES, ids=NAMES)
def test_derivatives_of_the_apparent_mass(
    parametrisation: Parametrisation, values: np.ndarray
) -> None:
    analytic = parametrisation.sensitivities(values, LINES)
    assert analytic.shape == (len(parametrisation.names), LINES.size, 6, 6)
    for number in range(values.size):
        step = 1e-3 * max(abs(values[number]), 1e-2)
        numeric = fourth_order(
            lambda v: parametrisation.model(v).apparent_mass(LINES), values, number, step
        )
        size = np.abs(analytic[number]).max()
        assert size > 0
        np.testing.assert_allclose(analytic[number], numeric, rtol=0, atol=1e-7 * size)


@pytest.mark.parametrize(("parametrisation", "values"), CASES, ids=NAMES)
def test_derivatives_of_the_mass_matrix(
    parametrisation: Parametrisation, values: np.ndarray
) -> None:
    analytic = parametrisation.mass_sensitivities(values)
    for number in range(values.size):
        step = 1e-3 * max(abs(values[number]), 1e-2)
        numeric = fourth_order(lambda v: parametrisation.model(v).mass_matrix, values, number, step)
        np.testing.assert_allclose(
            analytic[number], numeric, rtol=0, atol=1e-7 * max(np.abs(numeric).max(), 1e-3)
        )


@pytest.mark.parametrize(("parametrisation", "values"), CASES, ids=NAMES)
def test_one_name_and_one_unit_each(parametrisation: Parametrisation, values: np.ndarray) -> None:
    assert len(parametrisation.names) == len(parametrisation.units) == values.size
    assert len(set(parametrisation.names)) == values.size


def test_the_numbers_of_each_parametrisation() -> None:
    assert [values.size for _, values in CASES] == [35, 44, 32]


def test_minimal_parameters_return_the_compressor() -> None:
    back = CASES[0][0].model(CASES[0][1])
    np.testing.assert_allclose(
        back.apparent_mass(LINES), MODEL.apparent_mass(LINES), rtol=0, atol=1e-12
    )
    assert back.gain.real.at(20.0) == pytest.approx(1.0, abs=1e-14)


def test_thesis_parameters_return_the_compressor() -> None:
    values = ThesisParameters().values_of(MODEL, MOUNTS)
    back = ThesisParameters().model(values)
    np.testing.assert_allclose(
        back.apparent_mass(LINES), MODEL.apparent_mass(LINES), rtol=0, atol=1e-12
    )
    values[-1] = 2.0
    doubled = ThesisParameters().model(values)
    np.testing.assert_allclose(doubled.gain.at(LINES), 2 * GAIN.at(LINES), rtol=1e-14)


def test_identical_mounts_at_their_nominal_place() -> None:
    values = identical_values()
    values[10:25] = 0.0
    mounts = IdenticalMountParameters(MOUNTS, 0.055).mounts(values)
    for mount, nominal in zip(mounts, MOUNTS, strict=True):
        np.testing.assert_allclose(mount.position, nominal.position, atol=1e-15)
        np.testing.assert_allclose(mount.orientation, nominal.orientation, atol=1e-12)
        np.testing.assert_allclose(mount.stiffness, [3e4, 1.2e4, 1.2e4])


def test_any_ten_numbers_are_a_body() -> None:
    rng = np.random.default_rng(2)
    for _ in range(50):
        matrix = mass_matrix_from_parameters(rng.normal(0, 1, 10), 0.1)
        assert np.linalg.eigvalsh(matrix)[0] > 0
        inertia = matrix[3:, 3:]
        moments = np.linalg.eigvalsh(inertia)
        assert moments[2] <= moments[0] + moments[1] + 1e-12 * moments[2]


def test_mass_parameters_of_a_body() -> None:
    body = RigidBody(7.2, CENTRE, INERTIA)
    back = mass_matrix_from_parameters(mass_parameters(body, 0.055), 0.055)
    np.testing.assert_allclose(back, mass_matrix(7.2, INERTIA, CENTRE), rtol=1e-12, atol=1e-15)


def test_gain_shape_keeps_the_gain_but_for_its_scale() -> None:
    shape = gain_from_parameters(gain_parameters(GAIN, 20.0), 20.0)
    np.testing.assert_allclose(shape.at(LINES), GAIN.at(LINES) / GAIN.real.at(20.0), rtol=1e-13)


def test_derivatives_of_the_gain_shape() -> None:
    values = gain_parameters(GAIN, 20.0)
    analytic = gain_derivatives(values, 20.0, LINES)
    for number in range(5):
        numeric = fourth_order(
            lambda v: gain_from_parameters(v, 20.0).at(LINES), values, number, 1e-3
        )
        np.testing.assert_allclose(analytic[number], numeric, rtol=0, atol=1e-9)


def test_loss_that_causality_expects_is_a_slope() -> None:
    above, below = GAIN.real.at(LINES * 1.0001), GAIN.real.at(LINES / 1.0001)
    slope = (above - below) / (2 * np.log(1.0001))
    np.testing.assert_allclose(GAIN.expected_loss(LINES), np.pi / 2 * slope, rtol=1e-6)


def test_amplitude_gain_falls_to_its_limit() -> None:
    gain = AmplitudeGain(0.9, 1e5, 3.0)
    assert gain.at(0.0) == pytest.approx(0.9 + 1 / 3)
    assert gain.at(1.0) == pytest.approx(0.9, abs=2e-5)
    assert np.all(np.diff(gain.at(np.linspace(0, 1e-3, 9))) < 0)


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: HyperbolicGain(1.0, -0.1, 2.0), "must be positive"),
        (lambda: HyperbolicGain(1.0, 0.1, 0.0), "must be positive"),
        (lambda: HyperbolicGain(np.nan, 0.1, 2.0), "finite"),
        (lambda: AmplitudeGain(1.0, 0.0, 2.0), "must be positive"),
        (lambda: CompressorMount("m", np.zeros(2), np.zeros(3), np.ones(3)), "position has shape"),
        (lambda: CompressorMount("m", np.zeros(3), np.zeros(3), np.zeros(3)), "positive"),
        (
            lambda: CompressorModel(-1.0, CENTRE, INERTIA, MODEL.stiffness, GAIN),
            "mass of -1 kg",
        ),
        (
            lambda: CompressorModel(7.0, CENTRE, np.diag([1.0, 1.0, 3.0]), MODEL.stiffness, GAIN),
            "no body has the principal moments",
        ),
        (
            lambda: CompressorModel(7.0, CENTRE, INERTIA, np.triu(np.ones((6, 6))), GAIN),
            "not symmetric",
        ),
        (lambda: MODEL.apparent_mass([0.0, 10.0]), "0 Hz"),
    ],
)
def test_what_cannot_be_is_refused(build, words: str) -> None:
    with pytest.raises(InputError, match=words):
        build()
