"""Transfer paths and force inversion against the thesis and known forces."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from thesis_samples import deviation

from deboom.physics import transfer_path
from deboom.physics.force_inversion import (
    LAMBDAS,
    PLAIN,
    Choice,
    Decomposition,
    Inversion,
    Regularisation,
    cross_validation_scores,
    invert_for_forces,
    l_curve_curvature,
    tikhonov_filters,
)
from deboom.physics.frf import corr_f, corr_s
from samples.transfer_path_assembly import (
    FREQUENCY,
    INDICATORS,
    INTERFACE,
    N_PATH,
    N_SOURCE,
    OMEGA,
    VALIDATION,
    accelerance,
    receiver,
    rig,
    source,
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
SOURCE, RIG = source(1), rig(1)
RECEIVER, EAR = receiver(1)
EARS = np.stack([EAR, EAR[::-1]])
INSIDE = np.arange(N_PATH, N_SOURCE)
DRIVE = SOURCE.drive[:, INSIDE]


def times(matrix, vector):
    """Product at every line."""
    return np.einsum("fij,fj->fi", matrix, vector)


@pytest.fixture(scope="module")
def operation():
    return SOURCE.run(RECEIVER)


@pytest.fixture(scope="module")
def truth(operation):
    """Mount force and ear pressure of the assembly in operation, by the direct solution."""
    _, motion, force = operation
    return force, motion @ EARS.T


@pytest.fixture(scope="module")
def bodies():
    """Receptances of the bodies on their own, as a laboratory would measure them."""
    free_source, alone = np.linalg.inv(SOURCE.stiffness), np.linalg.inv(RECEIVER)
    at_interface = free_source[:, INTERFACE]
    return {
        "own": free_source,
        "source": transfer_path.mounted_source(at_interface[:, :, INTERFACE], SOURCE.mounts),
        "excitation": at_interface[:, :, INSIDE],
        "receiver": alone[:, INTERFACE][:, :, INTERFACE],
        "ntf": EARS @ alone[:, :, INTERFACE],
        "free": times(at_interface, SOURCE.drive),
    }


def agree(ours, truth, tolerance=EXACT):
    np.testing.assert_allclose(ours, truth, rtol=0, atol=tolerance * np.abs(truth).max())


def test_eq_8_and_13_interface_forces_go_with_the_uncoupled_body(truth, bodies):
    of_mounts, ears = truth
    force = transfer_path.interface_force(bodies["source"], bodies["receiver"], bodies["free"])
    agree(force, of_mounts)
    agree(transfer_path.pressure(bodies["ntf"], force), ears)
    agree(transfer_path.pressure(bodies["ntf"][:, 0], force), ears[:, 0])
    # eq. 8 needs its sum: as printed, each product alone would be the response
    products = transfer_path.contributions(bodies["ntf"], of_mounts)
    agree(products.sum(axis=-1), ears)
    for path in range(N_PATH):
        assert deviation(products[:, :, path], ears) > 0.1


def test_eq_7_and_8_internal_forces_go_with_the_assembled_body(truth, bodies):
    _, ears = truth
    assembled = transfer_path.assembled_frf(
        bodies["ntf"], bodies["receiver"], bodies["source"], bodies["excitation"]
    )
    agree(transfer_path.pressure(assembled, DRIVE), ears)
    agree(assembled, EARS @ np.linalg.inv(SOURCE.joined(RECEIVER))[:, N_SOURCE:, INSIDE])


def test_eq_6_and_7_rows_are_responses(bodies):
    """Printed with the index order reversed: Σ_i Y_ij f_i of a matrix with responses as rows."""
    two = transfer_path.assembled_frf(
        bodies["ntf"], bodies["receiver"], bodies["source"], bodies["excitation"][:, :, :2]
    )
    direct = EARS @ np.linalg.inv(SOURCE.joined(RECEIVER))[:, N_SOURCE:, INSIDE[:2]]
    heard = times(direct, DRIVE[:, :2])
    agree(transfer_path.pressure(two, DRIVE[:, :2]), heard)
    assert deviation(np.einsum("fij,fi->fj", two, DRIVE[:, :2]), heard) > 0.1


def test_blocked_force_is_the_reaction_of_a_rigid_receiver(bodies):
    agree(transfer_path.blocked_force(bodies["source"], bodies["free"]), SOURCE.blocked_force)


def test_blocked_forces_go_with_the_assembled_body(truth, bodies):
    _, ears = truth
    assembled = transfer_path.assembled_frf(
        bodies["ntf"], bodies["receiver"], bodies["source"], bodies["source"]
    )
    agree(transfer_path.pressure(assembled, SOURCE.blocked_force), ears)
    # the assembled function is what an impact at the receiver's interface measures
    agree(assembled, EARS @ SOURCE.receptance_below(RECEIVER)[:, :, INTERFACE])


def test_blocked_forces_with_the_uncoupled_body_are_an_approximation(truth, bodies):
    """The thesis multiplies blocked forces with trimmed-body functions; softer mounts forgive."""
    _, ears = truth
    error = deviation(transfer_path.pressure(bodies["ntf"], SOURCE.blocked_force), ears)
    assert error > 0.05
    soft = transfer_path.mounted_source(
        bodies["own"][:, INTERFACE][:, :, INTERFACE], SOURCE.mounts / 100
    )
    soft_truth = transfer_path.pressure(
        bodies["ntf"], transfer_path.interface_force(soft, bodies["receiver"], bodies["free"])
    )
    soft_blocked = transfer_path.pressure(
        bodies["ntf"], transfer_path.blocked_force(soft, bodies["free"])
    )
    assert deviation(soft_blocked, soft_truth) < error / 10


def test_eq_9_to_11_blocked_force_from_a_rig_that_gives_way(bodies):
    """Source on the rig by the direct solution; cells read the force between mount and rig."""
    _, rig_motion, cell = SOURCE.run(RIG)
    # eq. 9, rows 2 and 3, and eq. 10: g_A = −g_LC and equal motion
    agree(bodies["free"] - times(bodies["source"], cell), rig_motion)
    agree(times(np.linalg.inv(RIG), cell), rig_motion)
    # eq. 9, row 1, the motion inside the source
    inside = bodies["own"][:, INSIDE]
    whole = np.linalg.inv(SOURCE.joined(RIG))[:, INSIDE][:, :, INSIDE]
    agree(times(inside, SOURCE.drive) - times(inside[:, :, INTERFACE], cell), times(whole, DRIVE))
    # eq. 11
    blocked = transfer_path.blocked_force_on_rig(bodies["source"], cell, rig_motion)
    agree(blocked, SOURCE.blocked_force)
    # the cells alone are off by what the rig gives way
    assert deviation(cell, blocked) > 0.02
    # in situ, by inversion of the rig's own motion
    on_rig = accelerance(SOURCE.receptance_below(RIG))
    agree(invert_for_forces(on_rig, accelerance(rig_motion), PLAIN).force, blocked)


def test_eq_12_a_volume_source_in_the_cabin():
    """One panel on an air spring; the judge solves panel and air together.

    Panel: ``(k (1 + jη) − ω² m) u = f + S p``; air: ``p = (ρc²/V) (q/jω − S u)``.
    """
    omega = OMEGA
    panel = 4e5 * (1 + 0.06j) - omega**2 * 12.0
    area, air = 0.8, 1.42e5 / 3.0
    force = 5 * np.exp(1j * FREQUENCY / 10)
    volume_velocity = 1e-3 * (1 + 0.02j * FREQUENCY)

    matrix = np.empty((FREQUENCY.size, 2, 2), dtype=complex)
    matrix[:, 0, 0], matrix[:, 0, 1] = panel, -area
    matrix[:, 1, 0], matrix[:, 1, 1] = air * area, 1
    loads = np.column_stack([force, air * volume_velocity / (1j * omega)])
    ear = np.linalg.solve(matrix, loads[:, :, np.newaxis])[:, 1, 0]

    with_air = panel + air * area**2
    ntf = (-air * area / with_air)[:, np.newaxis]
    acoustic = (air / (1j * omega) * panel / with_air)[:, np.newaxis]
    structure, airborne = force[:, np.newaxis], volume_velocity[:, np.newaxis]
    agree(transfer_path.pressure_with_airborne(ntf, structure, acoustic, airborne), ear)
    assert deviation(transfer_path.pressure(ntf, structure), ear) > 0.1


def test_eq_12_and_13_give_a_pressure_not_a_level(truth, bodies):
    """Printed "SPL_d": levels of contributions do not add up, in decibels or in energy."""
    of_mounts, ears = truth
    products = transfer_path.contributions(bodies["ntf"][:, 0], of_mounts)
    level = 20 * np.log10(np.abs(products) / np.sqrt(2) / 20e-6)
    level_of_sum = 20 * np.log10(np.abs(ears[:, 0]) / np.sqrt(2) / 20e-6)
    assert np.abs(level.sum(axis=1) - level_of_sum).min() > 20
    in_energy = 10 * np.log10((10 ** (level / 10)).sum(axis=1))
    assert np.abs(in_energy - level_of_sum).max() > 3


def test_partial_sums_add_up_to_the_pressure(truth, bodies):
    each = transfer_path.contributions(bodies["ntf"], truth[0])
    mounts = transfer_path.partial_sums(each, [(0, 2, 4, 6, 7, 8), (5,), (3, 1)])
    assert mounts.shape == (FREQUENCY.size, 2, 3)
    agree(mounts.sum(axis=-1), truth[1])
    agree(mounts[..., 2], each[..., 1] + each[..., 3])


def test_mount_force_in_time():
    """Sign and phase: integrate two masses on dashpots and springs until the start is forgotten.

    Source 20 kg, free; mount 2·10⁵ N/m with 900 N s/m; receiver 35 kg on 5·10⁵ N/m and 1500 N s/m.
    A force of 50 N acts on the source at 18 Hz.
    """
    frequency, force = 18.0, 50.0
    omega = 2 * np.pi * frequency

    def mount(state):
        return 2e5 * (state[0] - state[1]) + 900 * (state[2] - state[3])

    def motion(time, state):
        on_source = force * np.cos(omega * time) - mount(state)
        on_receiver = mount(state) - 5e5 * state[1] - 1500 * state[3]
        return [state[2], state[3], on_source / 20, on_receiver / 35]

    end = 4.0
    period = np.linspace(end - 1 / frequency, end, 65)[:-1]
    record = solve_ivp(
        motion, (0, end), np.zeros(4), method="DOP853", t_eval=period, rtol=1e-10, atol=1e-13
    )
    measured = 2 * np.mean(mount(record.y) * np.exp(-1j * omega * period))

    source = np.array([[[-1 / (20 * omega**2)]]])
    receiver = np.array([[[1 / (5e5 + 1500j * omega - 35 * omega**2)]]])
    mounted = transfer_path.mounted_source(source, [[2e5 + 900j * omega]])
    ours = transfer_path.interface_force(mounted, receiver, source[:, :, 0] * force)
    assert ours[0, 0] == pytest.approx(measured, rel=1e-7)


@pytest.fixture(scope="module")
def alone():
    """Receptance of the receiver on its own."""
    return np.linalg.inv(RECEIVER)


@pytest.fixture(scope="module")
def assembled():
    """Receptance of the receiver with the source mounted on it."""
    return SOURCE.receptance_below(RECEIVER)


@pytest.mark.parametrize("rule", EVERY_RULE)
def test_classical_inversion_finds_the_forces_in_the_mounts(operation, alone, rule):
    _, motion, truth = operation
    matrix = accelerance(alone[:, INDICATORS][:, :, INTERFACE])
    inverted = invert_for_forces(matrix, accelerance(motion)[:, INDICATORS], rule)
    assert deviation(inverted.force, truth) < EXACT
    assert np.all(inverted.residual < EXACT)
    # kept out of the inversion: other sensors, and the ear
    validation = accelerance(alone[:, VALIDATION][:, :, INTERFACE])
    predicted = transfer_path.pressure(validation, inverted.force)
    measured = accelerance(motion)[:, VALIDATION]
    assert deviation(predicted, measured) < EXACT
    assert np.max(corr_f(predicted, measured)) < EXACT
    assert np.max(corr_s(predicted, measured)) < EXACT
    ear = transfer_path.pressure((EAR @ alone)[:, INTERFACE], inverted.force)
    assert deviation(ear, motion @ EAR) < EXACT


def test_forces_from_the_stiffness_of_the_mounts(operation):
    above, motion, truth = operation
    below = motion[:, INTERFACE]
    assert deviation(transfer_path.mount_force(SOURCE.mounts, above, below), truth) < EXACT
    as_matrix = SOURCE.mounts[:, :, np.newaxis] * np.eye(N_PATH)
    assert deviation(transfer_path.mount_force(as_matrix, above, below), truth) < EXACT
    # mounts may couple paths
    coupled = transfer_path.mount_force([[[2.0, 1j], [1j, 3.0]]], [[2.0, 1.0]], [[1.0, 0.0]])
    np.testing.assert_allclose(coupled, [[2 + 1j, 3 + 1j]])


def test_in_situ_inversion_finds_the_blocked_forces(operation, assembled):
    _, motion, interface = operation
    matrix = accelerance(assembled[:, INDICATORS][:, :, INTERFACE])
    inverted = invert_for_forces(matrix, accelerance(motion)[:, INDICATORS])
    assert deviation(inverted.force, SOURCE.blocked_force) < EXACT
    ear = transfer_path.pressure((EAR @ assembled)[:, INTERFACE], inverted.force)
    assert deviation(ear, motion @ EAR) < EXACT
    # blocked forces are another quantity than the interface forces of this vehicle
    assert deviation(interface, SOURCE.blocked_force) > 0.1


def test_blocked_forces_predict_another_vehicle():
    other, ears = receiver(2)
    _, motion, _ = SOURCE.run(other)
    ntf = (ears @ SOURCE.receptance_below(other))[:, INTERFACE]
    assert deviation(transfer_path.pressure(ntf, SOURCE.blocked_force), motion @ ears) < EXACT


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
        inverted = invert_for_forces(
            matrix, clean + sigma * (noise[0] + 1j * noise[1]), PLAIN, sigma
        )
        draws.append(inverted.force - truth)
    scatter = np.sqrt(np.mean(np.abs(draws) ** 2, axis=0))
    ratio = scatter / inverted.noise_gain
    assert np.sqrt(np.mean(ratio**2)) == pytest.approx(1.0, abs=0.02)
    assert np.all(np.abs(ratio - 1) < 0.3)
    # scatter of the mean of 200 complex draws: √(1/200), five times
    assert np.max(np.abs(np.mean(draws, axis=0)) / inverted.noise_gain) < 5 * np.sqrt(1 / 200)


def test_energy_shares_are_the_slope_of_the_energy():
    """Make one path a little larger: energy grows by twice its share."""
    rng = np.random.default_rng(8)
    ntf, force = rng.normal(size=(2, 6, 4)) + 1j * rng.normal(size=(2, 6, 4))
    weight = rng.uniform(0.2, 3, 6)
    each = transfer_path.contributions(ntf, force)
    share = transfer_path.energy_share(each, weight)
    assert share.sum() == pytest.approx(1.0, rel=EXACT)

    def energy(factor, path):
        scaled = each * np.where(np.arange(4) == path, factor, 1.0)
        return weight @ np.abs(scaled.sum(axis=1)) ** 2

    for path in range(4):
        slope = (energy(1 + 1e-5, path) - energy(1 - 1e-5, path)) / 2e-5 / energy(1, path)
        assert slope == pytest.approx(2 * share[path], rel=1e-8)


def test_two_paths_that_cancel_have_large_magnitude_and_opposite_share():
    each = np.array([[5.0 + 0j, -4.0, 0.0]] * 3)
    np.testing.assert_allclose(transfer_path.energy_share(each), [5.0, -4.0, 0.0])
    np.testing.assert_allclose(transfer_path.rms_contribution(each), [5.0, 4.0, 0.0])


N_LINE, N_INDICATOR, N_PATH_3 = 3, 12, 5


@pytest.fixture(scope="module")
def problem():
    rng = np.random.default_rng(3)
    matrix = rng.normal(size=(N_LINE, N_INDICATOR, N_PATH_3)) + 1j * rng.normal(
        size=(N_LINE, N_INDICATOR, N_PATH_3)
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
    inverted = invert_for_forces(matrix, response, Inversion(Regularisation.TIKHONOV, amount))
    for line in range(N_LINE):
        unit, columns = scaled(matrix[line])
        penalty = amount * np.linalg.norm(unit, 2) * np.eye(N_PATH_3)
        longer = np.concatenate([response[line], np.zeros(N_PATH_3)])
        direct = np.linalg.lstsq(np.vstack([unit, penalty]), longer)[0] / columns
        np.testing.assert_allclose(inverted.force[line], direct, rtol=1e-10)


def test_truncation_is_least_squares_of_lower_rank(problem):
    matrix, response = problem
    inverted = invert_for_forces(matrix, response, Inversion(Regularisation.TRUNCATED, 0.1))
    np.testing.assert_array_equal(inverted.freedom, N_PATH_3 - 1)
    for line in range(N_LINE):
        unit, columns = scaled(matrix[line])
        direct = np.linalg.lstsq(unit, response[line], rcond=0.1)[0] / columns
        np.testing.assert_allclose(inverted.force[line], direct, rtol=1e-10)
        assert inverted.condition_number[line] == pytest.approx(np.linalg.cond(unit), rel=1e-10)
        assert inverted.amount[line] > 0.1


def decomposition(problem):
    matrix, response = problem
    units = np.stack([scaled(line)[0] for line in matrix])
    left, singular, _ = np.linalg.svd(units, full_matrices=False)
    return Decomposition(left, singular, response), units


def test_generalised_score_does_not_depend_on_the_directions_of_sensors(problem):
    """By the hat matrix; a rotation of the responses does not change it."""
    data, units = decomposition(problem)
    _, response = problem
    amount = 0.05
    filters = tikhonov_filters(data.relative, np.array([amount]))
    ours = cross_validation_scores(data, filters)[:, 0]
    for line in range(N_LINE):
        ridge = (amount * data.singular[line, 0]) ** 2 * np.eye(N_PATH_3)
        matrix = units[line]
        hat = matrix @ np.linalg.solve(matrix.conj().T @ matrix + ridge, matrix.conj().T)
        rest = response[line] - hat @ response[line]
        free = np.trace(np.eye(N_INDICATOR) - hat).real
        assert ours[line] == pytest.approx(np.linalg.norm(rest) ** 2 / free**2, rel=1e-10)

    turn = np.linalg.qr(np.random.default_rng(9).normal(size=(N_INDICATOR, N_INDICATOR)))[0]
    turned = Decomposition(turn @ data.left, data.singular, data.responses @ turn.T)
    np.testing.assert_allclose(cross_validation_scores(turned, filters)[:, 0], ours, rtol=1e-10)


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
                rows = np.vstack([units[line], amount * np.eye(N_PATH_3)])
                right = np.concatenate([response[line], np.zeros(N_PATH_3)])
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
        forces = invert_for_forces(matrix, clean + noise, rule).force
        return np.linalg.norm(forces - truth, axis=1) / np.linalg.norm(truth)

    amounts = np.logspace(-6, 0, 61)
    best = min(np.median(errors(Inversion(regularisation, amount))) for amount in amounts)
    assert np.median(errors(Inversion(Regularisation.NONE))) > 100 * best
    assert np.median(errors(Inversion(regularisation, choice))) < 3 * best
