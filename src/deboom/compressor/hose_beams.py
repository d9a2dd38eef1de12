"""Hoses as viscoelastic beams: stiffness at the virtual point, forces at their ports."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
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
NUMBERS_PER_HOSE = len(BEAM_NUMBERS) + len(PLACE_NUMBERS)
PLACE_STEP = 1e-5
"""Of the differences by `PLACE_NUMBERS`: a hundredth of a millimetre [m, rad, 1]."""


@dataclass(frozen=True, eq=False)
class HoseMatrices:
    """Dynamic stiffness of n hoses, seen at the virtual point and at their ends on the body.

    Parameters
    ----------
    frequency : array, shape (n_frequency,)
        [Hz].
    names : tuple of str
        Of the hoses.
    point : array, shape (n_frequency, 6, 6)
        Load on the hoses at the virtual point per its motion, body ends held
        [N/m, N/rad, N m/rad].
    transfer : array, shape (n_frequency, 6 n, 6)
        Load of the hoses on the body at their ends per motion of the virtual point; six rows per
        hose, global axes [N/m, N/rad, N m/rad].
    body : array, shape (n_frequency, 6 n, 6 n)
        Load on the hoses at the body's ends per motion of these ends, virtual point held; block
        diagonal [N/m, N/rad, N m/rad].

    Notes
    -----
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
        """Load of the hoses on the body.

        Parameters
        ----------
        displacement : array, shape (n_frequency, 6)
            Of the virtual point, complex peak [m, rad].
        body_motion : array, shape (n_frequency, 6 n), optional
            Of the ends on the body; held by default [m, rad].

        Returns
        -------
        array, shape (n_frequency, 6 n)
            ``fx fy fz mx my mz`` of each hose at its end, complex peak [N, N m].
        """
        load = _times(self.transfer, np.asarray(displacement, dtype=complex))
        if body_motion is not None:
            load = load - _times(self.body, np.asarray(body_motion, dtype=complex))
        return load

    def compressor_load(
        self, displacement: npt.ArrayLike, body_motion: npt.ArrayLike | None = None
    ) -> ComplexArray:
        """Load of the hoses on the compressor at the virtual point.

        Parameters
        ----------
        displacement, body_motion
            As for `body_load`.

        Returns
        -------
        array, shape (n_frequency, 6)
            Complex peak [N, N m].
        """
        load = -_times(self.point, np.asarray(displacement, dtype=complex))
        if body_motion is not None:
            back = np.swapaxes(self.transfer, -1, -2)
            load = load + _times(back, np.asarray(body_motion, dtype=complex))
        return load


def hose_matrices(hoses: Sequence[HoseDrawing], frequency: npt.ArrayLike) -> HoseMatrices:
    """Compute the dynamic stiffness of hoses.

    Parameters
    ----------
    hoses : sequence of HoseDrawing
        At least one; as drawn, or as identified.
    frequency : array, shape (n_frequency,)
        Above 0 [Hz].

    Returns
    -------
    HoseMatrices

    Raises
    ------
    InputError
        No hose, doubled names, or a line at 0 Hz.
    """
    _check(hoses)
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
    return HoseMatrices(lines, tuple(hose.name for hose in hoses), point, transfer, body)


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


def body_end(hose: HoseDrawing) -> RealArray:
    """Return where a hose meets the body, from the virtual point, shape (3,) [m]."""
    return np.asarray(hose.position + hose.length * _unit(hose.direction))


def changed_hose(hose: HoseDrawing, numbers: npt.ArrayLike) -> HoseDrawing:
    """Move a hose by what the identification varies.

    Parameters
    ----------
    hose : HoseDrawing
    numbers : array, shape (11,)
        Logarithms of the ratios of `BEAM_NUMBERS`, then `PLACE_NUMBERS`: shift of the port, two
        tilts of the direction, logarithm of the ratio of the length [1, m, rad, 1].

    Returns
    -------
    HoseDrawing
    """
    values = np.asarray(numbers, dtype=float)
    n = len(BEAM_NUMBERS)
    drawn = np.array([getattr(hose, name) for name in BEAM_NUMBERS])
    tension, torsion, bending, line_mass, loss_factor = (drawn * np.exp(values[:n])).tolist()
    shift, tilt, longer = values[n : n + 3], values[n + 3 : n + 5], values[n + 5]
    frame = frame_along(hose.direction)
    return replace(
        hose,
        position=hose.position + shift,
        direction=frame[:, 0] + frame[:, 1:] @ tilt,
        length=float(hose.length * np.exp(longer)),
        tension=tension,
        torsion=torsion,
        bending=bending,
        line_mass=line_mass,
        loss_factor=loss_factor,
    )


def point_derivatives(
    hoses: Sequence[HoseDrawing], numbers: npt.ArrayLike, frequency: npt.ArrayLike
) -> ComplexArray:
    """Differentiate `HoseMatrices.point` by the numbers of `changed_hose`.

    Parameters
    ----------
    hoses : sequence of HoseDrawing
        n of them, as drawn.
    numbers : array, shape (n, 11)
        Where the derivatives are taken.
    frequency : array, shape (n_frequency,)
        Above 0 [Hz].

    Returns
    -------
    array, shape (n, 11, n_frequency, 6, 6)
        The numbers of the beam analytically, those of the place by central differences.
    """
    lines, values = np.asarray(frequency, dtype=float), np.asarray(numbers, dtype=float)
    n_beam, end = len(BEAM_NUMBERS), np.s_[..., :6, :6]
    result = np.empty((*values.shape, lines.size, 6, 6), dtype=complex)
    steps = PLACE_STEP * np.eye(values.shape[1])[n_beam:]
    for number, (drawn, row) in enumerate(zip(hoses, values, strict=True)):
        hose = changed_hose(drawn, row)
        turn, own = _congruence(hose)[end], beam_stiffness(beam_of(hose), lines)[end]
        by_beam = beam_stiffness_derivatives(beam_of(hose), lines)[end]
        result[number, :n_beam] = turn.T @ by_beam @ turn
        for place, step in enumerate(steps, start=n_beam):
            ahead, behind = changed_hose(drawn, row + step), changed_hose(drawn, row - step)
            turned = (_congruence(ahead)[end] - _congruence(behind)[end]) / (2 * PLACE_STEP)
            half = turned.T @ own @ turn
            result[number, place] = half + np.swapaxes(half, -1, -2)
        # the last of them is the length, which moves the element alone
        longer, shorter = (beam_stiffness(beam_of(one), lines)[end] for one in (ahead, behind))
        result[number, -1] = turn.T @ (longer - shorter) @ turn / (2 * PLACE_STEP)
    return result


def _congruence(hose: HoseDrawing) -> RealArray:
    return beam_congruence(frame_along(hose.direction), hose.position)


def _unit(direction: RealArray) -> RealArray:
    return np.asarray(direction / np.linalg.norm(direction))


def _times(matrices: ComplexArray, vectors: npt.NDArray[np.complex128]) -> ComplexArray:
    return np.asarray((matrices @ vectors[..., np.newaxis])[..., 0])


def _check(hoses: Sequence[HoseDrawing]) -> None:
    names = [hose.name for hose in hoses]
    if not names:
        raise InputError("there is no drawing of a hose: state port, direction, length and beam")
    if len(set(names)) < len(names):
        raise InputError(f"two hoses have one name: {names}")


if TYPE_CHECKING:
    from deboom.compressor.identify import Identification
    from deboom.measurement.compressor_test import HoseDrawing, OperatingTest

RANK_TOLERANCE = 1e-9


@dataclass(frozen=True, eq=False)
class PortForces:
    """Which forces at the ports one wrench at the virtual point determines.

    Parameters
    ----------
    names : tuple of str
        Of the n hoses.
    rank : int
        Of the 3 n forces that the wrench determines.
    hidden : array, shape (3 n - rank, 3 n)
        Sets of forces at the ports, one per row, that have no wrench: nothing at the virtual point
        shows them [1].
    """

    names: tuple[str, ...]
    rank: int
    hidden: RealArray

    @property
    def n_forces(self) -> int:
        """Three per port."""
        return 3 * len(self.names)


def port_forces(hoses: Sequence[HoseDrawing]) -> PortForces:
    """Find the forces at the ports that a wrench at the virtual point leaves open.

    Parameters
    ----------
    hoses : sequence of HoseDrawing
        At least one.

    Returns
    -------
    PortForces

    Notes
    -----
    ``w = Σ V_iᵀ f_i``. Two ports have six forces and the wrench has six entries, yet the rank is 5:
    forces that push the ports apart along the line between them have no wrench.
    """
    positions = np.array([hose.position for hose in hoses])
    spread = float(np.abs(positions).max()) or 1.0
    wrench = np.hstack([forward_matrix(place / spread).T for place in positions])
    _, values, right = np.linalg.svd(wrench)
    rank = int(np.sum(values > RANK_TOLERANCE * values[0]))
    return PortForces(tuple(hose.name for hose in hoses), rank, right[rank:])


def separation_statement(hoses: Sequence[HoseDrawing]) -> str:
    """Say in words what is not separable.

    Parameters
    ----------
    hoses : sequence of HoseDrawing
        At least one.

    Returns
    -------
    str
    """
    seen = port_forces(hoses)
    if seen.rank == seen.n_forces:
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
        f"The motion of the compressor determines {seen.rank} of the {seen.n_forces} forces at the "
        f"ports of {len(hoses)} hoses.{along} Each hose's own force follows from the beams that "
        "were fitted, not from the measurement alone."
    )


def stiffness_by_difference(
    test: OperatingTest, found: Identification
) -> tuple[RealArray, ComplexArray]:
    """Take the stiffness of the hoses out of two hammer tests, without any model of a hose.

    Parameters
    ----------
    test : OperatingTest
        With a hammer test with hoses.
    found : Identification
        Whose calibrated sensors and impacts are used.

    Returns
    -------
    frequency : array, shape (n_frequency,)
        [Hz].
    stiffness : array, shape (n_frequency, 6, 6)
        At the virtual point, of all hoses together [N/m, N/rad, N m/rad].

    Raises
    ------
    InputError
        No hammer test with hoses, or other lines in it.

    Notes
    -----
    ``K_h = −ω² (AM_with − AM_without)``. For comparison: a difference of two large matrices, each
    with the noise and the scatter of its own hits, and silent about the single hose.
    """
    other = test.hammer_with_hoses
    if other is None:
        raise InputError(f"{test.name} has no hammer test with hoses: there is no difference")
    lines = test.hammer.frf.frequency
    if not np.array_equal(lines, other.frf.frequency):
        raise InputError(
            f"{test.name}: the hammer tests with and without hoses have other lines: record both "
            "with one setting"
        )
    without, with_hoses = (
        np.linalg.inv(found.calibrated.at_virtual_point(one.frf.values))
        for one in (test.hammer, other)
    )
    squared = ((2 * np.pi * lines) ** 2)[:, np.newaxis, np.newaxis]
    return lines, np.asarray(-squared * (with_hoses - without))
