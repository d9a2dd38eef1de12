"""Regularised inversion against direct least squares, brute force and a known ill-posed problem."""

import numpy as np
import pytest

from deboom.physics.force_inversion import Inversion, Regularisation, invert_for_forces
from deboom.physics.regularisation_choice import (
    LAMBDAS,
    Choice,
    Decomposition,
    cross_validation_scores,
    l_curve_curvature,
    tikhonov_filters,
)

N_LINE, N_INDICATOR, N_PATH = 3, 12, 5


@pytest.fixture(scope="module")
def problem():
    rng = np.random.default_rng(3)
    matrix = rng.normal(size=(N_LINE, N_INDICATOR, N_PATH)) + 1j * rng.normal(
        size=(N_LINE, N_INDICATOR, N_PATH)
    )
    matrix[:, :, 4] = matrix[:, :, 3] + 0.02 * matrix[:, :, 4]
    response = rng.normal(size=(N_LINE, N_INDICATOR)) + 1j * rng.normal(size=(N_LINE, N_INDICATOR))
    return matrix, response


def scaled(line):
    columns = np.linalg.norm(line, axis=0)
    return line / columns, columns


@pytest.mark.parametrize("amount", [0.0, 0.01, 0.3])
def test_tikhonov_is_least_squares_with_more_rows(problem, amount):
    matrix, response = problem
    found = invert_for_forces(matrix, response, Inversion(Regularisation.TIKHONOV, amount))
    for line in range(N_LINE):
        unit, columns = scaled(matrix[line])
        penalty = amount * np.linalg.norm(unit, 2) * np.eye(N_PATH)
        longer = np.concatenate([response[line], np.zeros(N_PATH)])
        direct = np.linalg.lstsq(np.vstack([unit, penalty]), longer)[0] / columns
        np.testing.assert_allclose(found.force[line], direct, rtol=1e-10)


def test_truncation_is_least_squares_of_lower_rank(problem):
    matrix, response = problem
    found = invert_for_forces(matrix, response, Inversion(Regularisation.TRUNCATED, 0.1))
    np.testing.assert_array_equal(found.freedom, N_PATH - 1)
    for line in range(N_LINE):
        unit, columns = scaled(matrix[line])
        direct = np.linalg.lstsq(unit, response[line], rcond=0.1)[0] / columns
        np.testing.assert_allclose(found.force[line], direct, rtol=1e-10)
        assert found.condition_number[line] == pytest.approx(np.linalg.cond(unit), rel=1e-10)
        assert found.amount[line] > 0.1


def decomposition(problem):
    matrix, response = problem
    units = np.stack([scaled(line)[0] for line in matrix])
    left, singular, _ = np.linalg.svd(units, full_matrices=False)
    return Decomposition(left, singular, response), units


def test_leave_one_out_score_is_that_of_all_smaller_inversions(problem):
    data, units = decomposition(problem)
    _, response = problem
    amount = 0.05
    filters = tikhonov_filters(data.relative, np.array([amount]))
    scores = cross_validation_scores(data, filters, generalised=False)[:, 0]
    for line in range(N_LINE):
        penalty = amount * data.singular[line, 0] * np.eye(N_PATH)
        errors = []
        for out in range(N_INDICATOR):
            others = np.arange(N_INDICATOR) != out
            rows = np.vstack([units[line][others], penalty])
            right = np.concatenate([response[line, others], np.zeros(N_PATH)])
            force = np.linalg.lstsq(rows, right)[0]
            errors.append(response[line, out] - units[line, out] @ force)
        assert scores[line] == pytest.approx(np.sum(np.abs(errors) ** 2), rel=1e-10)


def test_generalised_score_does_not_depend_on_the_directions_of_sensors(problem):
    """By the hat matrix; a rotation of the responses changes the plain score and not this one."""
    data, units = decomposition(problem)
    _, response = problem
    amount = 0.05
    filters = tikhonov_filters(data.relative, np.array([amount]))
    ours = cross_validation_scores(data, filters, generalised=True)[:, 0]
    for line in range(N_LINE):
        ridge = (amount * data.singular[line, 0]) ** 2 * np.eye(N_PATH)
        matrix = units[line]
        hat = matrix @ np.linalg.solve(matrix.conj().T @ matrix + ridge, matrix.conj().T)
        rest = response[line] - hat @ response[line]
        free = np.trace(np.eye(N_INDICATOR) - hat).real
        assert ours[line] == pytest.approx(np.linalg.norm(rest) ** 2 / free**2, rel=1e-10)

    turn = np.linalg.qr(np.random.default_rng(9).normal(size=(N_INDICATOR, N_INDICATOR)))[0]
    turned = Decomposition(turn @ data.left, data.singular, data.responses @ turn.T)
    np.testing.assert_allclose(
        cross_validation_scores(turned, filters, generalised=True)[:, 0], ours, rtol=1e-10
    )
    plain = cross_validation_scores(data, filters, generalised=False)
    assert np.max(np.abs(cross_validation_scores(turned, filters, generalised=False) - plain)) > 1


def test_l_curve_curvature_is_that_of_the_points_themselves(problem):
    """Finite differences of log norms from direct solutions, where both norms still change."""
    data, units = decomposition(problem)
    _, response = problem
    curvature = l_curve_curvature(data)
    step = 1e-3
    for line in range(N_LINE):
        for index in np.flatnonzero((LAMBDAS > 1e-3) & (LAMBDAS < 0.9))[::4]:
            points = []
            for shift in (-1, 0, 1):
                amount = LAMBDAS[index] * np.exp(shift * step) * data.singular[line, 0]
                rows = np.vstack([units[line], amount * np.eye(N_PATH)])
                right = np.concatenate([response[line], np.zeros(N_PATH)])
                force = np.linalg.lstsq(rows, right)[0]
                rest = units[line] @ force - response[line]
                points.append(np.log([np.linalg.norm(rest), np.linalg.norm(force)]))
            before, here, after = points
            (x_1, y_1), (x_2, y_2) = (after - before) / 2, after - 2 * here + before
            direct = (x_1 * y_2 - y_1 * x_2) / np.hypot(x_1, y_1) ** 3
            assert curvature[line, index] == pytest.approx(direct, rel=1e-2, abs=1e-3)


def image_restoration(n_out, n_in):
    """Shaw's one-dimensional image restoration: condition number without bound."""
    out = (np.arange(n_out) + 0.5) * np.pi / n_out - np.pi / 2
    into = (np.arange(n_in) + 0.5) * np.pi / n_in - np.pi / 2
    path = np.pi * (np.sin(out)[:, np.newaxis] + np.sin(into))
    kernel = (np.cos(out)[:, np.newaxis] + np.cos(into)) ** 2 * np.sinc(path / np.pi) ** 2
    truth = 2 * np.exp(-6 * (into - 0.8) ** 2) + np.exp(-2 * (into + 0.5) ** 2)
    return kernel * np.pi / n_in, truth


@pytest.mark.parametrize("regularisation", [Regularisation.TRUNCATED, Regularisation.TIKHONOV])
@pytest.mark.parametrize("choice", list(Choice))
def test_shaw_problem_is_solved_nearly_as_well_as_with_the_best_amount(regularisation, choice):
    """Thirty draws of 0.1 % noise on a matrix of condition 10⁸: median error within a factor 3."""
    kernel, truth = image_restoration(30, 12)
    rng = np.random.default_rng(5)
    clean = kernel @ truth
    noise = 1e-3 * np.linalg.norm(clean) / np.sqrt(clean.size) * rng.normal(size=(30, clean.size))
    matrix = np.broadcast_to(kernel, (30, *kernel.shape))

    def errors(rule):
        found = invert_for_forces(matrix, clean + noise, rule).force
        return np.linalg.norm(found - truth, axis=1) / np.linalg.norm(truth)

    amounts = np.logspace(-6, 0, 61)
    best = min(np.median(errors(Inversion(regularisation, amount))) for amount in amounts)
    assert np.median(errors(Inversion(Regularisation.NONE))) > 100 * best
    assert np.median(errors(Inversion(regularisation, choice))) < 3 * best
