"""Identification returns the compressor that made the data, and states honestly how well."""

from functools import cache

import numpy as np
import pytest

from deboom.compressor.gain import GainFactor
from deboom.compressor.identifiability import identifiability, knowledge
from deboom.compressor.linear_start import START_GAIN, linear_start
from deboom.compressor.minimal_parameters import MinimalParameters
from deboom.compressor.model import CompressorModel
from deboom.compressor.objectives import (
    InertanceAndApparentMass,
    WhitenedInertance,
    in_bands,
)
from deboom.compressor.placement import Placement
from deboom.compressor.raw_inertance import RawInertance, deviation_from_coherence
from deboom.compressor.self_calibration import Prior, WeighedMass, self_calibrate
from deboom.compressor.thesis_parameters import ThesisParameters
from deboom.compressor.virtual_point_fit import Bounds, fit_at_virtual_point, fit_by_slsqp
from deboom.errors import InputError
from deboom.measurement.channels import Frf
from deboom.measurement.impacts import Impact
from deboom.measurement.inertance_test import CompressorMount
from deboom.measurement.placement_tolerances import PlacementTolerances
from deboom.measurement.sensors import Sensor, SensorKind
from deboom.physics.rigid_body import rotation_matrix

LENGTH = 0.055
LINES = np.concatenate([np.arange(10, 40, 1.5), np.arange(40, 151, 8.0)])
TOLERANCES = PlacementTolerances()
INERTIA = np.array([[0.0158, 2e-4, -1.5e-4], [2e-4, 0.0291, 1e-4], [-1.5e-4, 1e-4, 0.0302]])
POSITIONS = np.array([[-0.156, 0.004, 0.020], [-0.019, -0.067, 0.078], [-0.008, 0.074, 0.082]])
ROTATIONS = np.deg2rad([[-4.9, -4.9, 185.0], [2.5, 43.3, 87.5], [2.2, 131.5, 89.4]])
STIFFNESS = 1e3 * np.array([[29.9, 10.8, 12.2], [29.7, 12.9, 11.8], [29.2, 10.6, 10.3]])
MOUNTS = tuple(
    CompressorMount(f"mount {i + 1}", POSITIONS[i], ROTATIONS[i], STIFFNESS[i]) for i in range(3)
)
TRUTH = CompressorModel.on_mounts(
    7.2,
    [0.0015, -0.002, 0.001],
    INERTIA,
    MOUNTS,
    GainFactor.of([1.85, 0.06, 2.2, 0.42, 0.15, 2.5]),
)


def rig() -> tuple[tuple[Sensor, ...], tuple[Impact, ...]]:
    rng = np.random.default_rng(3)
    places = 1e-3 * np.array(
        [
            [80, 40, 45],
            [80, -45, -40],
            [-95, 42, -42],
            [-95, -40, 45],
            [0, 60, -20],
            [10, -5, -62],
        ]
    )
    sensors = tuple(
        Sensor(
            f"A{i + 1}",
            SensorKind.ACCELEROMETER,
            "",
            "",
            "",
            place,
            rotation_matrix(rng.uniform(-0.4, 0.4, 3)),
        )
        for i, place in enumerate(places)
    )
    impacts = []
    for axis in range(3):
        for side in (-1.0, 1.0):
            for _ in range(3):
                place = 0.06 * rng.uniform(-1, 1, 3)
                place[axis] = 0.09 * side
                impacts.append(Impact(f"I{len(impacts) + 1}", place, -side * np.eye(3)[axis]))
    return sensors, tuple(impacts)


@cache
def measured(seed: int, scale: float, noise: float) -> tuple[RawInertance, np.ndarray]:
    """Raw FRFs of the truth with placement errors of `scale` times the tolerances."""
    sensors, impacts = rig()
    rng = np.random.default_rng(seed)
    placement = Placement(sensors, impacts)
    deviations = placement.deviations(TOLERANCES)
    errors = scale * deviations * rng.standard_normal(deviations.size)
    exact = (
        placement.response_matrix(errors)
        @ TRUTH.inertance(LINES)
        @ placement.excitation_matrix(errors).T
    )
    deviation = np.full(exact.shape, noise)
    values = exact + noise * (
        rng.standard_normal(exact.shape) + 1j * rng.standard_normal(exact.shape)
    )
    frf = Frf(
        LINES,
        values,
        tuple(name for sensor in sensors for name in sensor.channels),
        tuple(impact.name for impact in impacts),
        "1/kg",
    )
    return RawInertance(sensors, impacts, frf, deviation, 1e-12), errors


def at_virtual_point(raw: RawInertance) -> WhitenedInertance:
    placement = Placement(raw.sensors, raw.impacts)
    zero = np.zeros(len(placement.names))
    response = np.linalg.pinv(placement.response_matrix(zero))
    excitation = np.linalg.pinv(placement.excitation_matrix(zero))
    return WhitenedInertance(
        raw.frf.frequency,
        response @ raw.frf.values @ excitation.T,
        response,
        excitation,
        raw.deviation[:, 0, 0],
    )


def test_exact_data_return_the_truth() -> None:
    raw, _ = measured(1, 0.0, 1e-9)
    minimal, data = MinimalParameters(LENGTH), at_virtual_point(raw)
    start = linear_start(minimal, LINES, data.measured)
    assert minimal.model(start).mass == pytest.approx(7.2, rel=0.01)
    found = fit_at_virtual_point(minimal, data, start)
    assert found.converged
    model = found.model
    assert model.mass == pytest.approx(TRUTH.mass, rel=1e-6)
    np.testing.assert_allclose(model.centre, TRUTH.centre, atol=1e-8)
    np.testing.assert_allclose(model.inertia, TRUTH.inertia, atol=1e-7)
    scale = TRUTH.gain.real.at(20.0)
    np.testing.assert_allclose(
        model.stiffness, TRUTH.stiffness * scale, atol=1e-5 * TRUTH.stiffness.max()
    )
    np.testing.assert_allclose(model.gain.at(LINES), TRUTH.gain.at(LINES) / scale, atol=1e-5)


@pytest.mark.parametrize("seed", [1, 2])
def test_self_calibration_returns_compressor_and_placement(seed: int) -> None:
    raw, errors = measured(seed, 1.0, 0.002)
    minimal, data = MinimalParameters(LENGTH), at_virtual_point(raw)
    point = fit_at_virtual_point(minimal, data, linear_start(minimal, LINES, data.measured))
    prior = Prior(
        np.concatenate([np.zeros(30), START_GAIN]),
        np.concatenate([np.full(30, np.inf), [0.6, 0.8, 0.15, 0.8, 0.8]]),
    )
    found = self_calibrate(
        minimal, raw, TOLERANCES, point.values, weighed=WeighedMass(7.2, 0.0072), prior=prior
    )
    assert found.converged
    assert found.reduced_chi == pytest.approx(1.0, abs=0.03)
    truth = minimal.values_of(TRUTH)
    score = (found.values - truth) / np.sqrt(np.diag(found.parameter_covariance))
    # 35 scores of unit spread: their rms lies below 1.5 with a probability of 0.9999
    assert np.sqrt(np.mean(score**2)) < 1.5
    assert np.linalg.norm(found.model.centre - TRUTH.centre) < 1.5e-3
    assert np.linalg.norm(found.errors - errors) < np.linalg.norm(errors)
    known = knowledge(minimal.names, found.parameter_covariance, prior.deviations)
    assert "ln √mass" not in known.prior_dominated


def test_placement_derivatives() -> None:
    sensors, impacts = rig()
    placement = Placement(sensors, impacts)
    rng = np.random.default_rng(5)
    errors = 3 * placement.deviations(TOLERANCES) * rng.standard_normal(len(placement.names))
    by_response = placement.response_derivatives(errors)
    by_excitation = placement.excitation_derivatives(errors)
    first = 9 * len(sensors)
    for number in rng.choice(len(placement.names), 40, replace=False):
        step = np.zeros(errors.size)
        step[number] = 1e-6
        if number < first:
            difference = placement.response_matrix(errors + step)
            difference = difference - placement.response_matrix(errors - step)
            analytic = by_response[number]
        else:
            difference = placement.excitation_matrix(errors + step)
            difference = difference - placement.excitation_matrix(errors - step)
            analytic = by_excitation[number - first]
        np.testing.assert_allclose(difference / 2e-6, analytic, atol=1e-8)


def thesis_fit_data() -> tuple[WhitenedInertance, np.ndarray, np.ndarray]:
    raw, _ = measured(1, 0.0, 1e-6)
    start = ThesisParameters().values_of(TRUTH, MOUNTS)
    tolerance = np.concatenate(
        [
            np.full(9, 0.0126),
            np.full(9, np.deg2rad(5.0)),
            np.full(9, 0.35 * 16e3),
            0.1 * np.diag(INERTIA),
            np.full(3, 5e-4),
            np.full(3, 3e-3),
            [0.5],
            0.3 * TRUTH.gain.values,
            [0.3],
        ]
    )
    return at_virtual_point(raw), start, tolerance


def test_35_of_44_numbers_are_seen() -> None:
    data, values, tolerance = thesis_fit_data()
    found = fit_at_virtual_point(
        ThesisParameters(), data, values, Bounds(values - tolerance, values + tolerance)
    )
    seen = identifiability(ThesisParameters().names, found.jacobian, tolerance)
    assert seen.rank == 35
    assert len(seen.null_space) == 9
    assert "mount 1 rotation x" in seen.invisible
    body = [
        share
        for name, share in zip(seen.names, seen.participation, strict=True)
        if name.startswith(("I", "centre", "mass"))
    ]
    assert len(body) == 10
    assert max(body) < 1e-6
    alone = [line.statement for line in seen.null_space if len(line.names) == 1]
    assert "mount 1 rotation x is not visible" in alone


def test_both_optimisers_end_at_one_cost() -> None:
    data, truth, tolerance = thesis_fit_data()
    bounds = Bounds(truth - tolerance, truth + tolerance)
    start = truth + 0.3 * tolerance
    objective = InertanceAndApparentMass(data.frequency, data.measured, LENGTH)
    squares = fit_at_virtual_point(ThesisParameters(), objective, start, bounds)
    programming = fit_by_slsqp(ThesisParameters(), objective, start, bounds)
    first = 0.5 * np.sum(
        np.abs(
            objective.residuals(
                ThesisParameters().model(start).apparent_mass(LINES),
                ThesisParameters().model(start).inertance(LINES),
            )
        )
        ** 2
    )
    assert squares.cost < 1e-6 * first
    assert programming.cost < 1e-3 * first
    assert squares.model.mass == pytest.approx(7.2, rel=1e-3)


def test_deviation_from_the_coherence_of_five_hits() -> None:
    rng = np.random.default_rng(7)
    shape, hits, noise = (200, 18, 6), 5, 0.05
    true = np.full(shape, 1.0 + 0.5j)
    force = np.ones((hits, *shape))
    response = true * force + noise * (
        rng.standard_normal((hits, *shape)) + 1j * rng.standard_normal((hits, *shape))
    )
    cross, auto = response.mean(axis=0), (np.abs(response) ** 2).mean(axis=0)
    frf = Frf(
        np.arange(1.0, 201.0),
        cross,
        tuple(f"c{i}" for i in range(18)),
        tuple(f"i{i}" for i in range(6)),
        "1/kg",
    )
    deviation = deviation_from_coherence(frf, np.abs(cross) ** 2 / auto, hits)
    np.testing.assert_allclose(deviation, noise / np.sqrt(hits), rtol=0.12)
    assert np.median(deviation) == pytest.approx(noise / np.sqrt(hits), rel=0.02)


def test_refusals() -> None:
    raw, _ = measured(1, 0.0, 1e-6)
    with pytest.raises(InputError, match="at least three"):
        RawInertance(raw.sensors[:2], raw.impacts, raw.frf, raw.deviation)
    with pytest.raises(InputError, match="at least six"):
        RawInertance(raw.sensors, raw.impacts[:5], raw.frf, raw.deviation)
    with pytest.raises(InputError, match="must be positive"):
        RawInertance(raw.sensors, raw.impacts, raw.frf, 0 * raw.deviation)
    with pytest.raises(InputError, match="above 0"):
        PlacementTolerances(sensor_gain=0.0)
    with pytest.raises(InputError, match="one hit"):
        deviation_from_coherence(raw.frf, np.ones(raw.frf.values.shape), 1)
    with pytest.raises(InputError, match="no line"):
        in_bands(LINES, ((200.0, 300.0),))
    flipped = -at_virtual_point(raw).measured
    with pytest.raises(InputError, match="wrong sign"):
        linear_start(MinimalParameters(LENGTH), LINES, flipped)
    data, values, tolerance = thesis_fit_data()
    with pytest.raises(InputError, match="outside its bounds"):
        fit_at_virtual_point(
            ThesisParameters(), data, values, Bounds(values + tolerance, values + 2 * tolerance)
        )
    with pytest.raises(InputError, match="cannot fix"):
        identifiability(("a", "b"), np.ones((1, 2)), np.ones(2))
