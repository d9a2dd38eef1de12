"""Transfer path analysis on a source, nine mounts and a receiver, solved directly.

The judge (`benchmarks/transfer_path_assembly.py`) assembles the dynamic stiffness of all masses,
springs and mounts and solves it. What the functions under test get are accelerances of separate
measurements: the receiver on its own, the assembled bodies, the source on its own.
"""

import numpy as np
import pytest

from deboom.physics.correlation import corr_f, corr_s
from deboom.physics.coupling import blocked_force_on_rig
from deboom.physics.force_inversion import (
    CROSS_VALIDATED,
    PLAIN,
    Inversion,
    Regularisation,
    invert_for_forces,
)
from deboom.physics.regularisation_choice import Choice
from deboom.physics.transfer_path import (
    contributions,
    energy_share,
    mount_force,
    pressure,
    rms_contribution,
)
from transfer_path_assembly import (
    INDICATORS,
    INTERFACE,
    N_PATH,
    VALIDATION,
    accelerance,
    receiver,
    rig,
    source,
    with_noise,
)

EXACT = 1e-10
EVERY_RULE = [
    PLAIN,
    *(
        Inversion(regularisation, choice)
        for regularisation in (Regularisation.TRUNCATED, Regularisation.TIKHONOV)
        for choice in Choice
    ),
]
SOURCE = source(1)
RECEIVER, EARS = receiver(1)
RIG = rig(1)


@pytest.fixture(scope="module")
def operation():
    return SOURCE.run(RECEIVER)


@pytest.fixture(scope="module")
def alone():
    """Receptance of the receiver on its own."""
    return np.linalg.inv(RECEIVER)


@pytest.fixture(scope="module")
def assembled():
    """Receptance of the receiver with the source mounted on it."""
    return SOURCE.receptance_below(RECEIVER)


def deviation(ours, truth):
    return np.linalg.norm(ours - truth) / np.linalg.norm(truth)


@pytest.mark.parametrize("rule", EVERY_RULE)
def test_classical_inversion_finds_the_forces_in_the_mounts(operation, alone, rule):
    _, motion, truth = operation
    matrix = accelerance(alone[:, INDICATORS][:, :, INTERFACE])
    found = invert_for_forces(matrix, accelerance(motion)[:, INDICATORS], rule)
    assert deviation(found.force, truth) < EXACT
    assert np.all(found.residual < EXACT)
    # kept out of the inversion: other sensors, and the ear
    validation = accelerance(alone[:, VALIDATION][:, :, INTERFACE])
    predicted = pressure(validation, found.force)
    measured = accelerance(motion)[:, VALIDATION]
    assert deviation(predicted, measured) < EXACT
    assert np.max(corr_f(predicted, measured)) < EXACT
    assert np.max(corr_s(predicted, measured)) < EXACT
    ear = pressure((EARS @ alone)[:, INTERFACE], found.force)
    assert deviation(ear, motion @ EARS) < EXACT


def test_forces_from_the_stiffness_of_the_mounts(operation):
    above, motion, truth = operation
    below = motion[:, INTERFACE]
    assert deviation(mount_force(SOURCE.mounts, above, below), truth) < EXACT
    as_matrix = SOURCE.mounts[:, :, np.newaxis] * np.eye(N_PATH)
    assert deviation(mount_force(as_matrix, above, below), truth) < EXACT


def test_in_situ_inversion_finds_the_blocked_forces(operation, assembled):
    _, motion, interface = operation
    matrix = accelerance(assembled[:, INDICATORS][:, :, INTERFACE])
    found = invert_for_forces(matrix, accelerance(motion)[:, INDICATORS])
    assert deviation(found.force, SOURCE.blocked_force) < EXACT
    ear = pressure((EARS @ assembled)[:, INTERFACE], found.force)
    assert deviation(ear, motion @ EARS) < EXACT
    # blocked forces are another quantity than the interface forces of this vehicle
    assert deviation(interface, SOURCE.blocked_force) > 0.1


def test_blocked_forces_agree_from_cells_on_a_rig_and_in_situ_on_it():
    """Eq. 11 with cells on a rig that gives way, and inversion of the rig's own motion."""
    _, motion, cells = SOURCE.run(RIG)
    found = blocked_force_on_rig(SOURCE.mounted_receptance, cells, motion)
    assert deviation(found, SOURCE.blocked_force) < EXACT
    assert deviation(cells, SOURCE.blocked_force) > 0.02
    on_rig = SOURCE.receptance_below(RIG)
    in_situ = invert_for_forces(accelerance(on_rig), accelerance(motion), PLAIN)
    assert deviation(in_situ.force, SOURCE.blocked_force) < EXACT


def test_blocked_forces_predict_another_vehicle():
    other, ears = receiver(2)
    _, motion, _ = SOURCE.run(other)
    ntf = (ears @ SOURCE.receptance_below(other))[:, INTERFACE]
    assert deviation(pressure(ntf, SOURCE.blocked_force), motion @ ears) < EXACT


def test_noise_of_the_forces_is_the_stated_gain(operation, alone):
    """Responses with noise of known size: scatter over 200 draws within 15 % of the gain."""
    _, motion, truth = operation
    matrix = accelerance(alone[:, INDICATORS][:, :, INTERFACE])
    clean = accelerance(motion)[:, INDICATORS]
    sigma = 0.01 * np.sqrt(np.mean(np.abs(clean) ** 2, axis=0))
    rng = np.random.default_rng(6)
    draws = []
    for _ in range(200):
        noise = rng.normal(size=(2, *clean.shape)) / np.sqrt(2)
        found = invert_for_forces(matrix, clean + sigma * (noise[0] + 1j * noise[1]), PLAIN, sigma)
        draws.append(found.force - truth)
    scatter = np.sqrt(np.mean(np.abs(draws) ** 2, axis=0))
    ratio = scatter / found.noise_gain
    assert np.sqrt(np.mean(ratio**2)) == pytest.approx(1.0, abs=0.02)
    assert np.all(np.abs(ratio - 1) < 0.3)
    # scatter of the mean of 200 complex draws: √(1/200), five times
    assert np.max(np.abs(np.mean(draws, axis=0)) / found.noise_gain) < 5 * np.sqrt(1 / 200)


@pytest.mark.parametrize("rule", [PLAIN, CROSS_VALIDATED])
@pytest.mark.parametrize(
    ("indicators", "most"), [(INDICATORS, 0.10), (np.arange(INDICATORS.size), 0.03)]
)
def test_one_percent_noise_costs_less_than_ten_percent_where_conditioning_is_below_100(
    rule, indicators, most
):
    """Noise in accelerances and responses; sensors away from the mounts, and beside them."""
    rng = np.random.default_rng(7)
    errors, forces = [], []
    for seed in range(1, 7):
        body, _ = receiver(seed)
        _, motion, truth = source(seed).run(body)
        matrix = accelerance(np.linalg.inv(body)[:, indicators][:, :, INTERFACE])
        response = accelerance(motion)[:, indicators]
        found = invert_for_forces(with_noise(matrix, rng), with_noise(response, rng), rule)
        good = found.condition_number < 100
        assert good.sum() > 25
        errors.append(found.force[good] - truth[good])
        forces.append(truth[good])
    assert np.linalg.norm(np.vstack(errors)) < most * np.linalg.norm(np.vstack(forces))


def test_energy_shares_are_the_slope_of_the_energy():
    """Make one path a little larger: energy grows by twice its share."""
    rng = np.random.default_rng(8)
    ntf, force = rng.normal(size=(2, 6, 4)) + 1j * rng.normal(size=(2, 6, 4))
    weight = rng.uniform(0.2, 3, 6)
    each = contributions(ntf, force)
    share = energy_share(each, weight)
    assert share.sum() == pytest.approx(1.0, rel=EXACT)

    def energy(factor, path):
        scaled = each * np.where(np.arange(4) == path, factor, 1.0)
        return weight @ np.abs(scaled.sum(axis=1)) ** 2

    for path in range(4):
        slope = (energy(1 + 1e-5, path) - energy(1 - 1e-5, path)) / 2e-5 / energy(1, path)
        assert slope == pytest.approx(2 * share[path], rel=1e-8)


def test_two_paths_that_cancel_have_large_magnitude_and_opposite_share():
    each = np.array([[5.0 + 0j, -4.0, 0.0]] * 3)
    np.testing.assert_allclose(energy_share(each), [5.0, -4.0, 0.0])
    np.testing.assert_allclose(rms_contribution(each), [5.0, 4.0, 0.0])
