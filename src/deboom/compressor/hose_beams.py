"""Hoses as viscoelastic beams: stiffness at the virtual point, loads, forces at their ports.

A demonstrator. Real hoses bend, are braided, carry pressure and coolant; none of that is in a
straight uniform beam.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.model import applied
from deboom.errors import InputError
from deboom.measurement.compressor_test import HoseDrawing
from deboom.physics.rigid_body import forward_matrix
from deboom.physics.viscoelastic_beam import (
    DERIVATIVES,
    ViscoelasticBeam,
    beam_congruence,
    beam_stiffness,
    beam_stiffness_derivatives,
    frame_along,
)

BEAM_NUMBERS = DERIVATIVES
"""What is identified of each hose, by logarithms: EA, GJ, EI, mass per length, loss factor."""
BEAM_UNITS = ("N", "N m²", "N m²", "kg/m", "1")
"""Of `BEAM_NUMBERS`."""
PLACE_NUMBERS = ("x", "y", "z", "tilt 1", "tilt 2", "ln length")
"""What may be wrong with the drawing of each hose: port, direction, length [m, rad, 1]."""
PLACE_STEP = 1e-5
"""Of the differences by `PLACE_NUMBERS`: a hundredth of a millimetre [m, rad, 1]."""
RANK_TOLERANCE = 1e-9


@dataclass(frozen=True, eq=False)
class HoseMatrices:
    """Dynamic stiffness of n hoses, seen at the virtual point and at their ends on the body.

    `frequency` (n_frequency,): lines [Hz]; `point` (n_frequency, 6, 6): load on the hoses at the
    virtual point per its motion, body ends fixed [N/m, N/rad, N m/rad]; `transfer` (n_frequency, 6
    n, 6): load of the hoses on the body at their ends per motion of the virtual point; six rows per
    hose, global axes [N/m, N/rad, N m/rad]; `body` (n_frequency, 6 n, 6 n): load on the hoses at
    the body's ends per motion of these ends, virtual point fixed; block diagonal [N/m, N/rad, N
    m/rad].

    With motions u at the virtual point and b at the body's ends, the hoses push on the body with
    ``transfer u − body b`` and on the compressor with ``transferᵀ b − point u``: a beam is
    reciprocal.
    """

    frequency: RealArray
    names: tuple[str, ...]
    point: ComplexArray
    transfer: ComplexArray
    body: ComplexArray

    def body_load(
        self, displacement: npt.ArrayLike, body_motion: npt.ArrayLike | None = None
    ) -> ComplexArray:
        """Compute the load of the hoses on the body.

        `displacement` (n_frequency, 6): motion of the virtual point, complex peak [m, rad];
        `body_motion` (n_frequency, 6 n): motion of the ends on the body; none by default [m, rad].
        Returns (n_frequency, 6 n) ``fx fy fz mx my mz`` of each hose at its end, complex peak
        [N, N m].
        """
        load = applied(self.transfer, np.asarray(displacement, dtype=complex))
        if body_motion is not None:
            load = load - applied(self.body, np.asarray(body_motion, dtype=complex))
        return load

    def compressor_load(
        self, displacement: npt.ArrayLike, body_motion: npt.ArrayLike | None = None
    ) -> ComplexArray:
        """Compute the load on the compressor at the virtual point, (n_frequency, 6) [N, N m]."""
        load = -applied(self.point, np.asarray(displacement, dtype=complex))
        if body_motion is not None:
            back = np.swapaxes(self.transfer, -1, -2)
            load = load + applied(back, np.asarray(body_motion, dtype=complex))
        return load


def hose_matrices(hoses: Sequence[HoseDrawing], frequency: npt.ArrayLike) -> HoseMatrices:
    """Compute the dynamic stiffness of hoses.

    - `hoses`: at least one hose; as drawn, or as identified.
    - `frequency` (n_frequency,): lines above 0 [Hz].
    - raises InputError: no hose, or a line at 0 Hz.
    """
    names = [hose.name for hose in hoses]
    if not names:
        raise InputError("there is no drawing of a hose: state port, direction, length and beam")
    lines = np.asarray(frequency, dtype=float)
    n = len(hoses)
    point = np.zeros((lines.size, 6, 6), dtype=complex)
    transfer = np.zeros((lines.size, 6 * n, 6), dtype=complex)
    body = np.zeros((lines.size, 6 * n, 6 * n), dtype=complex)
    for number, hose in enumerate(hoses):
        turn = _congruence(hose)
        both = turn.T @ beam_stiffness(beam_of(hose), lines) @ turn
        rows = slice(6 * number, 6 * number + 6)
        point += both[:, :6, :6]
        transfer[:, rows] = -both[:, 6:, :6]
        body[:, rows, rows] = both[:, 6:, 6:]
    return HoseMatrices(lines, tuple(names), point, transfer, body)


def beam_of(hose: HoseDrawing) -> ViscoelasticBeam:
    """Return the beam that stands for a hose."""
    return ViscoelasticBeam(
        hose.length,
        hose.tension,
        hose.torsion,
        hose.bending,
        hose.line_mass,
        hose.loss_factor,
        hose.torsion_radius,
    )


def changed_hose(hose: HoseDrawing, numbers: npt.ArrayLike) -> HoseDrawing:
    """Move a hose by what the identification varies.

    `numbers` (11,): logarithms of the ratios of `BEAM_NUMBERS`, then `PLACE_NUMBERS`: shift of the
    port, two tilts of the direction, logarithm of the ratio of the length [1, m, rad, 1].
    """
    values = np.asarray(numbers, dtype=float)
    n = len(BEAM_NUMBERS)
    drawn = np.array([getattr(hose, name) for name in BEAM_NUMBERS])
    beam = dict(zip(BEAM_NUMBERS, (drawn * np.exp(values[:n])).tolist(), strict=True))
    shift, tilt, longer = values[n : n + 3], values[n + 3 : n + 5], values[n + 5]
    frame = frame_along(hose.direction)
    return replace(
        hose,
        position=hose.position + shift,
        direction=frame[:, 0] + frame[:, 1:] @ tilt,
        length=float(hose.length * np.exp(longer)),
        **beam,
    )


def point_derivatives(
    hoses: Sequence[HoseDrawing], numbers: npt.ArrayLike, frequency: npt.ArrayLike
) -> ComplexArray:
    """Differentiate `HoseMatrices.point` by the numbers of `changed_hose`.

    `numbers` (n, 11): where the derivatives are taken; `frequency` (n_frequency,): lines above 0
    [Hz]. Returns (n, 11, n_frequency, 6, 6) the numbers of the beam analytically, those of the
    place by central differences.
    """
    lines, values = np.asarray(frequency, dtype=float), np.asarray(numbers, dtype=float)
    n_beam, end = len(BEAM_NUMBERS), np.s_[..., :6, :6]
    result = np.empty((*values.shape, lines.size, 6, 6), dtype=complex)
    steps = PLACE_STEP * np.eye(values.shape[1])[n_beam:]
    for number, (drawn, row) in enumerate(zip(hoses, values, strict=True)):
        hose = changed_hose(drawn, row)
        turn, element = _congruence(hose)[end], beam_stiffness(beam_of(hose), lines)[end]
        by_beam = beam_stiffness_derivatives(beam_of(hose), lines)[end]
        result[number, :n_beam] = turn.T @ by_beam @ turn
        for place, step in enumerate(steps, start=n_beam):
            ahead, behind = changed_hose(drawn, row + step), changed_hose(drawn, row - step)
            turned = (_congruence(ahead)[end] - _congruence(behind)[end]) / (2 * PLACE_STEP)
            half = turned.T @ element @ turn
            result[number, place] = half + np.swapaxes(half, -1, -2)
        # the last of them is the length, which moves the element alone
        longer, shorter = (
            beam_stiffness(beam_of(end_of), lines)[end] for end_of in (ahead, behind)
        )
        result[number, -1] = turn.T @ (longer - shorter) @ turn / (2 * PLACE_STEP)
    return result


def _congruence(hose: HoseDrawing) -> RealArray:
    """Motions at the virtual point and at the body's end → motions of the element's ends."""
    return beam_congruence(frame_along(hose.direction), hose.position)


def port_forces(hoses: Sequence[HoseDrawing]) -> tuple[int, RealArray]:
    """Find the forces at the ports that a wrench at the virtual point leaves open.

    Returns the number of the 3 n forces that the wrench determines, and sets of forces at the ports
    that have no wrench, (3 n - rank, 3 n): nothing at the virtual point shows them [1].

    ``w = Σ V_iᵀ f_i``. Two ports have six forces and the wrench has six entries, yet the rank is 5:
    forces that push the ports apart along the line between them have no wrench.
    """
    positions = np.array([hose.position for hose in hoses])
    spread = float(np.abs(positions).max()) or 1.0
    wrench = np.hstack([forward_matrix(place / spread).T for place in positions])
    _, values, right = np.linalg.svd(wrench)
    rank = int(np.sum(values > RANK_TOLERANCE * values[0]))
    return rank, right[rank:]


def separation_statement(hoses: Sequence[HoseDrawing]) -> str:
    """Say in words which forces at the ports of at least one hose are not separable."""
    (rank, _), n_forces = port_forces(hoses), 3 * len(hoses)
    if rank == n_forces:
        return "The motion of the compressor determines the force at the port of the hose."
    along = ""
    if len(hoses) == 2:
        apart = hoses[1].position - hoses[0].position
        apart = apart / np.linalg.norm(apart)
        along = (
            " Forces along the line between the ports, direction "
            f"({apart[0]:.2f}, {apart[1]:.2f}, {apart[2]:.2f}), leave the compressor at rest."
        )
    return (
        f"The motion of the compressor determines {rank} of the {n_forces} forces at the "
        f"ports of {len(hoses)} hoses.{along} Each hose's own force follows from the beams that "
        "were fitted, not from the measurement alone."
    )
