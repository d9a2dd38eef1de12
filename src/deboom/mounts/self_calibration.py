"""A measuring chain that calibrates itself: rigid motion and Newton's law hold in every run.

Six triaxial sensors on a rigid body show twelve numbers more than it has motions, and the forces of
its mounts must be its mass times its acceleration. Both hold for every line of every run with every
mount set, whatever the mounts are; alignment errors alone break them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from deboom.arrays import ComplexArray, RealArray, checked
from deboom.errors import InputError
from deboom.measurement.virtual_point import RIGID_LOADS
from deboom.mounts.measuring_chain import (
    LARGEST_MISFIT,
    NEWTON,
    RIGID_MOTION,
    Alignment,
    AlignmentEstimate,
    BodyRecord,
    stated_alignment,
)
from deboom.physics.rigid_body import skew

LINES = 1200
"""Lines to use at most, of all runs: more would only average noise that is small by then, and
neighbouring lines share part of their time window."""

FIDELITY = 2e-4
"""What rigid body and linear alignment leave unexplained, per norm of a sensor, common to all
lines: products of two errors of a per cent [1]."""

ITERATIONS = 6
CONVERGED = 0.02
"""Largest step, in tolerances, at which the iteration ends [1]."""

IMPOSSIBLE = 5.0
"""A parameter this many tolerances off is a fault, not an error [1]."""


@checked(mass_matrix="6 6")
class FreeBody:
    """Rigid body as Newton's law needs to know it.

    `mass_matrix` (6, 6) at the origin of the position sheet [kg, kg m²] with the standard
    deviations of mass [kg], of moments of inertia relative to ``√(J_ii J_jj)`` [1] and of the
    centre of gravity per axis [m]. `excited` are the loads ``fx`` … ``mz`` of unknown amplitude
    that act besides the mounts, ``("my",)`` for a three-cylinder engine across the car; their
    direction is uncertain by `excitation_deviation` per axis [rad].
    """

    mass_matrix: RealArray
    mass_deviation: float
    inertia_deviation: float
    centre_deviation: float
    excited: tuple[str, ...]
    excitation_deviation: float

    @property
    def balanced(self) -> tuple[int, ...]:
        """Places of the loads that Newton's law must balance."""
        return tuple(k for k, name in enumerate(RIGID_LOADS) if name not in self.excited)

    @property
    def leaks(self) -> tuple[tuple[int, int], ...]:
        """Pairs (balanced, excited) of loads that a turned excitation connects."""
        excited = [RIGID_LOADS.index(name) for name in self.excited]
        return tuple((k, e) for k in self.balanced for e in excited if k // 3 == e // 3)

    @property
    def deviations(self) -> RealArray:
        """Standard deviations of mass, six moments of inertia, three coordinates, each leak."""
        radii = np.sqrt(np.diag(self.mass_matrix)[3:])
        rows, columns = np.triu_indices(3)
        return np.concatenate(
            [
                [self.mass_deviation],
                self.inertia_deviation * radii[rows] * radii[columns],
                [self.centre_deviation] * 3,
                [self.excitation_deviation] * len(self.leaks),
            ]
        )

    @property
    def mass_changes(self) -> RealArray:
        """Change of the mass matrix per parameter, shape (n, 6, 6)."""
        changes = np.zeros((self.deviations.size, 6, 6))
        changes[0, :3, :3] = np.eye(3)
        for place, (row, column) in enumerate(zip(*np.triu_indices(3), strict=True), 1):
            changes[place, 3 + row, 3 + column] = changes[place, 3 + column, 3 + row] = 1.0
        mass = self.mass_matrix[0, 0]
        for axis, unit in enumerate(np.eye(3)):
            changes[7 + axis, :3, 3:] = -mass * skew(unit)
            changes[7 + axis, 3:, :3] = mass * skew(unit)
        return changes


@dataclass(frozen=True, eq=False)
class _Equations:
    """Whitened equations ``jacobian @ change of the n parameters = residual`` of one group.

    `bias` (n,): expected value of ``jacobianᴴ residual`` where the parameters are right: both
    contain the noise of the channels, which is larger than the motion along some axes; by as much
    of the stated noise as the last iteration's misfit shows. `squares`: sum of squares over noise
    and rest, `freedom`: its degrees of freedom.
    """

    group: str
    jacobian: ComplexArray
    residual: ComplexArray
    bias: RealArray
    squares: float
    freedom: int


def self_calibrated(
    alignment: Alignment, records: Sequence[BodyRecord], free_body: FreeBody | None = None
) -> AlignmentEstimate:
    """Estimate the alignment of a body's measuring chain from the runs it recorded.

    With `free_body` Newton's law is used beside the rigid motion. The stated alignment comes back
    where nothing is redundant: a body with a single sensor, or no tolerance.

    - raises InputError: channels that contradict each other by far more than the tolerances.

    Most probable parameters p, with normal priors of the stated tolerances, under

    - rigid motion: ``(1 − V V⁺) a = 0`` with the forward matrix V(p) of the sensors;
    - Newton's law: ``M a_B + Σ V_iᵀ f_i`` has no part but the excitation, with the forces f(p), the
      mass matrix and the direction of the excitation within their tolerances as well.

    Gauss-Newton on both. Beside the noise of its lines each group has a systematic rest, common to
    all lines: the scatter of the force transfer matrices, and what the model leaves out. Where the
    residuals exceed both together, the rest is enlarged until it explains them, and the group loses
    its say: flexible bodies, further forces. Beyond `LARGEST_MISFIT` of Newton's law its loads are
    wrong: it gets the say of a single line, and the half widths of the body grow with it. Seven
    parameters show in no rigid motion, a common rotation, offset and scale of all sensors; Newton's
    law ties them to the cells.
    """
    if not alignment.body.is_rigid_body or not np.any(alignment.tolerance > 0):
        return stated_alignment(alignment)
    every = max(4, -(-sum(len(record) for record in records) // LINES))
    lines = [record.part(slice(None, None, every)) for record in records]
    deviations = alignment.tolerance
    if free_body is not None:
        deviations = np.concatenate([deviations, free_body.deviations])
    estimate = _most_probable(alignment, lines, free_body, deviations, {})
    _refuse_faults(alignment, estimate.mean)
    misfit = dict(estimate.misfit)
    if misfit.get(NEWTON, 0.0) > LARGEST_MISFIT:
        estimate = _most_probable(alignment, lines, free_body, deviations, misfit)
    return estimate


def _most_probable(
    alignment: Alignment,
    lines: Sequence[BodyRecord],
    free_body: FreeBody | None,
    deviations: RealArray,
    contradicted: dict[str, float],
) -> AlignmentEstimate:
    """Iterate from the stated alignment; a `contradicted` group, with its χ², has little say."""
    n_chain = alignment.tolerance.size
    active = deviations > 0
    prior = np.diag(1 / deviations[active] ** 2)
    parameters = np.zeros_like(deviations)
    misfit: dict[str, float] = {}
    for _ in range(ITERATIONS):
        normal, gradient, misfit = _normal_equations(
            alignment, lines, free_body, parameters, misfit, contradicted
        )
        curvature = normal[np.ix_(active, active)] + prior
        step = np.linalg.solve(curvature, gradient[active] - prior @ parameters[active])
        parameters[active] += step
        if np.max(np.abs(step) / deviations[active]) < CONVERGED:
            break
    covariance = np.zeros((deviations.size, deviations.size))
    covariance[np.ix_(active, active)] = np.linalg.inv(curvature)
    return AlignmentEstimate(
        alignment=alignment,
        mean=parameters[:n_chain],
        covariance=covariance[:n_chain, :n_chain],
        misfit=tuple(misfit.items()),
    )


def _normal_equations(
    alignment: Alignment,
    records: Sequence[BodyRecord],
    free_body: FreeBody | None,
    parameters: RealArray,
    misfit: dict[str, float],
    contradicted: dict[str, float],
) -> tuple[RealArray, RealArray, dict[str, float]]:
    """Sum over all lines, with the weights of the last iteration's misfit."""
    normal = np.zeros((parameters.size, parameters.size))
    gradient = np.zeros(parameters.size)
    squares: dict[str, float] = {}
    counts: dict[str, int] = {}
    n_lines = sum(len(record) for record in records)
    for record in records:
        for block in _equations(
            alignment, record, free_body, parameters, n_lines, misfit, contradicted
        ):
            # a complex normal deviation of variance 1 has two real ones of variance 1/2
            normal += 2 * (block.jacobian.conj().T @ block.jacobian).real
            gradient += 2 * ((block.jacobian.conj().T @ block.residual).real - block.bias)
            squares[block.group] = squares.get(block.group, 0.0) + block.squares
            counts[block.group] = counts.get(block.group, 0) + block.freedom
    return normal, gradient, {name: squares[name] / counts[name] for name in squares}


def _equations(
    alignment: Alignment,
    lines: BodyRecord,
    free_body: FreeBody | None,
    parameters: RealArray,
    n_lines: int,
    misfit: dict[str, float],
    contradicted: dict[str, float],
) -> Iterator[_Equations]:
    body = alignment.body
    of_chain, of_body = np.split(parameters, [alignment.tolerance.size])
    forward = alignment.forward(of_chain)
    inverse = np.linalg.pinv(forward)
    motion = lines.acceleration @ inverse.T
    channel_change = np.tensordot(motion, alignment.forward_change, axes=([1], [2]))
    channel_change = np.swapaxes(channel_change, 1, 2)

    sensor = np.array(body.channel_rows) // 3
    same_sensor = (sensor[:, np.newaxis] == sensor).astype(float)
    rest = FIDELITY**2 * np.abs(lines.acceleration) ** 2 @ same_sensor
    common = n_lines * max(1.0, misfit.get(RIGID_MOTION, 1.0))
    variance = lines.acceleration_noise**2 + common * rest
    white = 1 / np.sqrt(variance)
    basis = np.linalg.qr(white[:, :, np.newaxis] * forward)[0]
    columns = np.concatenate([channel_change, lines.acceleration[:, :, np.newaxis]], axis=2)
    columns = white[:, :, np.newaxis] * columns
    columns = columns - basis @ (np.swapaxes(basis, 1, 2) @ columns)
    expected = variance / (lines.acceleration_noise**2 + rest)
    freedom = len(lines) * (forward.shape[0] - forward.shape[1])
    jacobian = np.zeros((columns.shape[0] * columns.shape[1], parameters.size), dtype=complex)
    jacobian[:, : of_chain.size] = columns[:, :, :-1].reshape(len(jacobian), -1)
    squares = float(np.sum(np.abs(columns[:, :, -1]) ** 2 * expected))
    # E[tr(changeᴴ W P W a)] with a = noise: the trace of change @ both
    seen = min(1.0, misfit.get(RIGID_MOTION, 0.0))
    noise = seen * lines.acceleration_noise**2
    both = inverse @ (
        np.diag(np.sum(noise * white**2, axis=0))
        - np.einsum("nc,nck,ndk,nd->cd", noise * white, basis, basis, white)
    )
    bias = np.zeros(parameters.size)
    bias[: of_chain.size] = np.einsum("kcm,mc->k", alignment.forward_change, both)
    residual = columns[:, :, -1].ravel()
    yield _Equations(RIGID_MOTION, jacobian, residual, bias, squares, freedom)
    if free_body is None:
        return

    # load at the origin per channel of accelerometers and cells, and its change per parameter
    to_load, force_matrix = body.at_points.T, alignment.force_matrix(of_chain)
    mass_matrix = free_body.mass_matrix + np.tensordot(of_body, free_body.mass_changes, 1)
    of_motion, of_cells = mass_matrix @ inverse, to_load @ force_matrix
    by_motion = np.concatenate(
        [-of_motion @ alignment.forward_change @ inverse, free_body.mass_changes @ inverse]
    )
    by_cells = np.zeros((parameters.size, *of_cells.shape))
    by_cells[: of_chain.size] = to_load @ alignment.force_change
    leaks = free_body.leaks
    select = np.eye(6)
    for (balanced, excited), size in zip(leaks, of_body[of_body.size - len(leaks) :], strict=True):
        select[balanced, excited] = -size
    by_motion, by_cells = select @ by_motion, select @ by_cells
    for place, (balanced, excited) in enumerate(leaks, parameters.size - len(leaks)):
        by_motion[place, balanced] -= of_motion[excited]
        by_cells[place, balanced] -= of_cells[excited]
    rows = list(free_body.balanced)
    select, by_motion, by_cells = select[rows], by_motion[:, rows], by_cells[:, rows]
    of_motion, of_cells = select @ of_motion, select @ of_cells
    scatter = block_diag(*[point.transfer_scatter for point in body.points])
    force = lines.cell_force @ force_matrix.T
    noise = lines.acceleration_noise**2 @ of_motion.T**2 + lines.cell_noise**2 @ of_cells.T**2
    rest = rest @ of_motion.T**2 + np.abs(force) ** 2 @ (select @ to_load @ scatter).T ** 2
    # loads that are wrong are wrong in all lines by as much, however many there are
    unexplained = n_lines * contradicted.get(NEWTON, 0.0) * (noise + rest)
    variance = noise + n_lines * max(1.0, misfit.get(NEWTON, 1.0)) * rest + unexplained
    white = 1 / np.sqrt(variance)
    residual = -(lines.acceleration @ of_motion.T + lines.cell_force @ of_cells.T)
    jacobian = np.tensordot(lines.acceleration, by_motion, axes=([1], [2]))
    jacobian = jacobian + np.tensordot(lines.cell_force, by_cells, axes=([1], [2]))
    whitened = white[:, :, np.newaxis] * np.swapaxes(jacobian, 1, 2)
    squares = float(np.sum(np.abs(residual) ** 2 / (noise + rest)))
    seen_by_cells = min(1.0, misfit.get(NEWTON, 0.0))
    bias = -seen * np.einsum(
        "kmc,mc,mc->k", by_motion, of_motion, white.T**2 @ lines.acceleration_noise**2
    )
    bias -= seen_by_cells * np.einsum(
        "kmc,mc,mc->k", by_cells, of_cells, white.T**2 @ lines.cell_noise**2
    )
    yield _Equations(
        NEWTON,
        whitened.reshape(-1, parameters.size),
        (white * residual).ravel(),
        bias,
        squares,
        residual.size,
    )


def _refuse_faults(alignment: Alignment, parameters: RealArray) -> None:
    deviations = np.where(alignment.tolerance > 0, alignment.tolerance, np.inf)
    worst = int(np.argmax(np.abs(parameters) / deviations))
    times = abs(parameters[worst]) / deviations[worst]
    if times > IMPOSSIBLE:
        raise InputError(
            f"the channels of the {alignment.body.name} contradict each other: the "
            f"{alignment.names[worst]} would have to be off by {times:.0f} times its tolerance; "
            "look for a reversed, swapped or displaced channel there, or switch it off; if several "
            "sensors are turned, for another order of their angles (rotation_order)"
        )
