"""Thesis, eq. 6 to 13, on a source, mounts and a receiver made of masses and springs.

The judge never sees a receptance: it assembles the dynamic stiffness of all masses and springs and
solves it directly, or integrates the motion in time.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from deboom.errors import InputError
from deboom.physics.coupling import (
    assembled_frf,
    blocked_force,
    blocked_force_on_rig,
    interface_force,
    mounted_source,
)
from deboom.physics.transfer_path import (
    contributions,
    partial_sums,
    pressure,
    pressure_with_airborne,
)

FREQUENCY = np.arange(20, 80.1, 1.0)
OMEGA = 2 * np.pi * FREQUENCY[:, np.newaxis, np.newaxis]

# Source: masses 0, 1 inside, 2, 3 at the interface; free in space. [kg], [N/m]
SOURCE_MASS = np.diag([40.0, 25.0, 9.0, 11.0])
SOURCE_STIFFNESS = [(0, 1, 8e6), (0, 2, 2.2e6), (1, 3, 3.1e6), (0, 3, 0.9e6), (2, 3, 0.4e6)]
# Receiver: masses 0, 1 at the interface, 2, 3, 4 behind; -1 is the ground.
RECEIVER_MASS = np.diag([6.0, 8.0, 30.0, 22.0, 15.0])
RECEIVER_STIFFNESS = [
    (0, 2, 1.9e6),
    (1, 3, 1.4e6),
    (2, 3, 0.8e6),
    (3, 4, 1.1e6),
    (2, -1, 1.5e6),
    (4, -1, 0.7e6),
    (1, -1, 0.3e6),
]
# Two ears: pressure per displacement of the receiver's panels [Pa/m].
EARS = np.array([[0, 0, 900.0, -400.0, 650.0], [0, 0, 300.0, 700.0, -500.0]])
# Internal force of the source at masses 0 and 1 [N].
INTERNAL_FORCE = np.column_stack(
    [80 + 30j * FREQUENCY / 40, 45 * np.exp(1j * FREQUENCY / 25)],
)
MOUNTS = np.column_stack(
    [
        3.2e5 * (1 + 0.002 * FREQUENCY) * (1 + 0.09j),
        1.7e5 * (1 + 0.003 * FREQUENCY) * (1 + 0.16j),
    ]
)
RIGID = 1e15


def dynamic_stiffness(mass, springs, loss):
    """Dynamic stiffness of masses and springs, ``K (1 + jη) − ω² M`` [N/m]."""
    stiffness = np.zeros_like(mass)
    for first, second, value in springs:
        for dof in (first, second):
            if dof >= 0:
                stiffness[dof, dof] += value
        if second >= 0:
            stiffness[first, second] -= value
            stiffness[second, first] -= value
    return stiffness * (1 + 1j * loss) - OMEGA**2 * mass


SOURCE = dynamic_stiffness(SOURCE_MASS, SOURCE_STIFFNESS, 0.02)
RECEIVER = dynamic_stiffness(RECEIVER_MASS, RECEIVER_STIFFNESS, 0.05)
RIG = dynamic_stiffness(np.diag([30.0, 45.0]), [(0, -1, 4e6), (1, -1, 3e6), (0, 1, 1e6)], 0.03)


def solve_assembly(source_force, receiver_force, other=RECEIVER, other_interface=(0, 1)):
    """Motion of all masses when the mounts join them: source first, receiver (or rig) behind."""
    n_source, n_other = SOURCE.shape[1], other.shape[1]
    matrix = np.zeros((FREQUENCY.size, n_source + n_other, n_source + n_other), dtype=complex)
    matrix[:, :n_source, :n_source] = SOURCE
    matrix[:, n_source:, n_source:] = other
    for path, (above, below) in enumerate(zip((2, 3), other_interface, strict=True)):
        below += n_source
        matrix[:, above, above] += MOUNTS[:, path]
        matrix[:, below, below] += MOUNTS[:, path]
        matrix[:, above, below] -= MOUNTS[:, path]
        matrix[:, below, above] -= MOUNTS[:, path]
    force = np.concatenate([source_force, receiver_force], axis=1)
    motion = np.linalg.solve(matrix, force[:, :, np.newaxis])[:, :, 0]
    return motion[:, :n_source], motion[:, n_source:]


def internal_force():
    force = np.zeros((FREQUENCY.size, 4), dtype=complex)
    force[:, :2] = INTERNAL_FORCE
    return force


def nothing(n):
    return np.zeros((FREQUENCY.size, n), dtype=complex)


@pytest.fixture(scope="module")
def truth():
    """Mount force and ear pressure of the assembly in operation, by the direct solution."""
    source, receiver = solve_assembly(internal_force(), nothing(5))
    mount_force = MOUNTS * (source[:, 2:] - receiver[:, :2])
    return mount_force, receiver @ EARS.T


@pytest.fixture(scope="module")
def bodies():
    """Receptances of the bodies on their own, as a laboratory would measure them."""
    source, receiver = np.linalg.inv(SOURCE), np.linalg.inv(RECEIVER)
    return {
        "source": mounted_source(source[:, 2:, 2:], MOUNTS),
        "excitation": source[:, 2:, :2],
        "receiver": receiver[:, :2, :2],
        "ntf": EARS @ receiver[:, :, :2],
        "free": (source[:, 2:, :2] @ INTERNAL_FORCE[:, :, np.newaxis])[:, :, 0],
    }


def agree(ours, truth, tolerance=1e-10):
    np.testing.assert_allclose(ours, truth, rtol=0, atol=tolerance * np.abs(truth).max())


def relative_difference(ours, truth):
    return np.linalg.norm(ours - truth) / np.linalg.norm(truth)


def test_interface_force_is_the_mount_force(truth, bodies):
    mount_force, _ = truth
    agree(interface_force(bodies["source"], bodies["receiver"], bodies["free"]), mount_force)


def test_eq_8_and_13_interface_forces_go_with_the_uncoupled_body(truth, bodies):
    _, ears = truth
    force = interface_force(bodies["source"], bodies["receiver"], bodies["free"])
    agree(pressure(bodies["ntf"], force), ears)
    agree(pressure(bodies["ntf"][:, 0], force), ears[:, 0])


def test_eq_8_needs_its_sum(truth, bodies):
    """As printed, each product alone would be the response."""
    mount_force, ears = truth
    products = contributions(bodies["ntf"], mount_force)
    agree(products.sum(axis=-1), ears)
    for path in range(2):
        assert relative_difference(products[:, :, path], ears) > 0.1


def test_eq_7_and_8_internal_forces_go_with_the_assembled_body(truth, bodies):
    _, ears = truth
    assembled = assembled_frf(
        bodies["ntf"], bodies["receiver"], bodies["source"], bodies["excitation"]
    )
    agree(pressure(assembled, INTERNAL_FORCE), ears)
    # column by column against a unit force in the direct solution
    for column in range(2):
        unit = nothing(4)
        unit[:, column] = 1
        agree(assembled[:, :, column], solve_assembly(unit, nothing(5))[1] @ EARS.T)


def test_eq_6_and_7_rows_are_responses(truth, bodies):
    """Printed with the index order reversed: Σ_i Y_ij f_i of a matrix with responses as rows."""
    _, ears = truth
    assembled = assembled_frf(
        bodies["ntf"], bodies["receiver"], bodies["source"], bodies["excitation"]
    )
    reversed_indices = np.einsum("fij,fi->fj", assembled, INTERNAL_FORCE)
    assert relative_difference(reversed_indices, ears) > 0.1


def test_blocked_force_is_the_reaction_of_a_rigid_receiver(bodies):
    """Far ends of the mounts held: the direct solution of the source on grounded mounts."""
    held = SOURCE.copy()
    held[:, 2, 2] += MOUNTS[:, 0]
    held[:, 3, 3] += MOUNTS[:, 1]
    motion = np.linalg.solve(held, internal_force()[:, :, np.newaxis])[:, :, 0]
    agree(blocked_force(bodies["source"], bodies["free"]), MOUNTS * motion[:, 2:])


def test_blocked_forces_go_with_the_assembled_body(truth, bodies):
    _, ears = truth
    blocked = blocked_force(bodies["source"], bodies["free"])
    assembled = assembled_frf(bodies["ntf"], bodies["receiver"], bodies["source"], bodies["source"])
    agree(pressure(assembled, blocked), ears)
    # the assembled function is what an impact at the receiver's interface measures
    for path in range(2):
        impact = nothing(5)
        impact[:, path] = 1
        agree(assembled[:, :, path], solve_assembly(nothing(4), impact)[1] @ EARS.T)


def test_blocked_forces_with_the_uncoupled_body_are_an_approximation(truth, bodies):
    """The thesis multiplies blocked forces with trimmed-body functions; softer mounts forgive."""
    _, ears = truth
    blocked = blocked_force(bodies["source"], bodies["free"])
    error = relative_difference(pressure(bodies["ntf"], blocked), ears)
    assert error > 0.05

    soft = mounted_source(np.linalg.inv(SOURCE)[:, 2:, 2:], MOUNTS / 100)
    soft_truth = pressure(bodies["ntf"], interface_force(soft, bodies["receiver"], bodies["free"]))
    soft_blocked = pressure(bodies["ntf"], blocked_force(soft, bodies["free"]))
    assert relative_difference(soft_blocked, soft_truth) < error / 10


def test_coupling_agrees_with_the_primal_form(bodies):
    """At the interface itself, dynamic stiffnesses add: ``Y_AB⁻¹ = Y_A⁻¹ + Y_B⁻¹``."""
    source, receiver = bodies["source"], bodies["receiver"]
    primal = np.linalg.inv(np.linalg.inv(source) + np.linalg.inv(receiver))
    agree(assembled_frf(receiver, receiver, source, source), primal)
    agree(assembled_frf(source, source, receiver, receiver), primal)


def test_eq_9_to_11_blocked_force_from_a_rig_that_gives_way(bodies):
    """Source on the rig by the direct solution; cells read the force between mount and rig."""
    source_motion, rig_motion = solve_assembly(internal_force(), nothing(2), RIG)
    cell = MOUNTS * (source_motion[:, 2:] - rig_motion)

    # eq. 9, rows 2 and 3, and eq. 10: g_A = −g_LC and equal motion
    on_source = bodies["free"] - np.einsum("fij,fj->fi", bodies["source"], cell)
    on_rig = np.einsum("fij,fj->fi", np.linalg.inv(RIG), cell)
    agree(on_source, rig_motion)
    agree(on_rig, rig_motion)
    # eq. 9, row 1, the motion inside the source
    source = np.linalg.inv(SOURCE)
    inside = np.einsum("fij,fj->fi", source[:, :2, :2], INTERNAL_FORCE)
    inside -= np.einsum("fij,fj->fi", source[:, :2, 2:], cell)
    agree(inside, source_motion[:, :2])

    # eq. 11
    blocked = blocked_force(bodies["source"], bodies["free"])
    agree(blocked_force_on_rig(bodies["source"], cell, rig_motion), blocked)
    # the cells alone are off by what the rig gives way
    assert relative_difference(cell, blocked) > 0.02


def test_on_a_rigid_rig_the_cells_read_the_blocked_force(bodies):
    source_motion, rig_motion = solve_assembly(
        internal_force(), nothing(2), np.broadcast_to(RIGID * np.eye(2), (FREQUENCY.size, 2, 2))
    )
    cell = MOUNTS * (source_motion[:, 2:] - rig_motion)
    agree(cell, blocked_force(bodies["source"], bodies["free"]), 1e-8)


def test_eq_12_a_volume_source_in_the_cabin():
    """One panel on an air spring; the judge solves panel and air together.

    Panel: ``(k (1 + jη) − ω² m) u = f + S p``; air: ``p = (ρc²/V) (q/jω − S u)``.
    """
    omega = OMEGA[:, 0, 0]
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
    agree(pressure_with_airborne(ntf, structure, acoustic, airborne), ear)
    assert relative_difference(pressure(ntf, structure), ear) > 0.1


def test_eq_12_and_13_give_a_pressure_not_a_level(truth, bodies):
    """Printed "SPL_d": levels of contributions do not add up, in decibels or in energy."""
    mount_force, ears = truth
    products = contributions(bodies["ntf"][:, 0], mount_force)
    level = 20 * np.log10(np.abs(products) / np.sqrt(2) / 20e-6)
    level_of_sum = 20 * np.log10(np.abs(ears[:, 0]) / np.sqrt(2) / 20e-6)
    assert np.abs(level.sum(axis=1) - level_of_sum).min() > 20
    in_energy = 10 * np.log10((10 ** (level / 10)).sum(axis=1))
    assert np.abs(in_energy - level_of_sum).max() > 3


def test_partial_sums_add_up_to_the_pressure(bodies):
    six_paths = np.concatenate([bodies["ntf"]] * 3, axis=2)
    force = np.column_stack([INTERNAL_FORCE, MOUNTS / 1e4, INTERNAL_FORCE**2 / 1e3])
    each = contributions(six_paths, force)
    mounts = partial_sums(each, [(0, 2, 4), (5,), (3, 1)])
    assert mounts.shape == (FREQUENCY.size, 2, 3)
    agree(mounts.sum(axis=-1), pressure(six_paths, force))
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
    mounted = mounted_source(source, [[2e5 + 900j * omega]])
    ours = interface_force(mounted, receiver, source[:, :, 0] * force)
    assert ours[0, 0] == pytest.approx(measured, rel=1e-7)


def test_a_singular_interface_is_refused():
    """A rigid source at two points of one axis: they move only together."""
    together = np.ones((3, 2, 2))
    with pytest.raises(InputError, match="leave out paths that move only together"):
        blocked_force(together, np.ones((3, 2)))
