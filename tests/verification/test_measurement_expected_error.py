"""What tolerances let expect, against draws of every error: nothing is linearised in the draws."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from deboom.measurement.channel_geometry import sensor_geometry
from deboom.measurement.culprit import culprit_of_responses, find_culprit
from deboom.measurement.expected_error import error_variance
from deboom.measurement.tolerances import Tolerances
from deboom.measurement.virtual_point import virtual_point
from hammer_test import CAREFUL, EXACT, draw_hammer_test, measure

NOTHING = replace(EXACT, acceleration_own=0.0, acceleration_norm=0.0)
N_DRAW = 4000


def drawn_errors(sensors, motion, tolerances, generator):
    """Error of each channel in each state, shape (n_draw, n_state, n_channel)."""
    errors = []
    for s in sensors:
        placed = s.position + generator.normal(0, tolerances.sensor_position, (N_DRAW, 1, 3))
        angles = generator.normal(0, tolerances.sensor_angle, (N_DRAW, 3))
        turned = s.orientation @ Rotation.from_rotvec(angles).as_matrix()
        gain = 1 + generator.normal(0, tolerances.sensor_gain, (N_DRAW, 1, 3))
        cross = generator.normal(0, tolerances.sensor_cross_axis, (N_DRAW, 3, 3))
        cross *= 1 - np.eye(3)
        here = motion[:3].T + np.cross(motion[3:].T, placed)
        shown = here @ turned
        shown = gain * shown + np.einsum("nab,nsb->nsa", cross, shown)
        own = tolerances.acceleration_own * np.abs(shown) * generator.normal(size=shown.shape)
        norm = np.linalg.norm(shown, axis=2, keepdims=True)
        leaked = tolerances.acceleration_norm * norm * generator.normal(size=shown.shape)
        true = (motion[:3].T + np.cross(motion[3:].T, s.position)) @ s.orientation
        errors.append(shown + own + leaked - true)
    return np.concatenate(errors, axis=2)


@pytest.mark.parametrize(
    "tolerances",
    [
        replace(NOTHING, sensor_position=2e-3),
        replace(NOTHING, sensor_angle=0.01),
        replace(NOTHING, sensor_gain=0.01),
        replace(NOTHING, sensor_cross_axis=0.01),
        replace(NOTHING, acceleration_own=0.01),
        replace(NOTHING, acceleration_norm=0.01),
        Tolerances(),
    ],
)
def test_variance_is_that_of_the_draws(tolerances):
    generator = np.random.default_rng(31)
    test = draw_hammer_test(generator, n_sensor=3)
    motion = generator.normal(size=(6, 2)) * np.array([[1, 1, 1, 9, 9, 9]]).T
    drawn = drawn_errors(test.sensors, motion, tolerances, generator)
    found = error_variance(sensor_geometry(test.sensors), motion, tolerances)
    truth = np.sum(np.mean(drawn**2, axis=0), axis=0)
    assert found == pytest.approx(truth, rel=0.12)


def test_disagreement_is_the_noise_per_degree_of_freedom():
    generator = np.random.default_rng(32)
    test = draw_hammer_test(generator)
    geometry = sensor_geometry(test.sensors)
    motion = generator.normal(size=(2000, 6)) * [1, 1, 1, 9, 9, 9]
    shown = motion @ geometry.forward.T
    size = np.sqrt(np.mean(shown**2, axis=1, keepdims=True))
    noisy = shown / size + 0.02 * generator.normal(size=shown.shape)
    found = find_culprit(geometry, noisy, EXACT)
    assert found.residual_of_all == pytest.approx(0.02, rel=0.03)
    for residual in found.residual_without.values():
        assert residual == pytest.approx(0.02, rel=0.05)
    # six independent motions are not noise: 18 of 18 channels would have shown 0.02 √(12/18)
    assert found.residual_of_all > 0.018


def test_contradiction_within_tolerances_is_about_one():
    first_suspects = []
    for seed in range(1, 16):
        generator = np.random.default_rng(seed)
        test = draw_hammer_test(generator)
        point = virtual_point(sensor_geometry(test.sensors))
        found = culprit_of_responses(point, measure(test, generator, errors=CAREFUL), CAREFUL)
        first_suspects.append(found.suspect.significance)
    # the largest of six contradictions, each of rms 1 over many sheets
    assert 1.0 < np.median(first_suspects) < 1.6
    assert max(first_suspects) < 2.0
