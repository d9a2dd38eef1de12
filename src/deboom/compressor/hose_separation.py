"""What one virtual point cannot tell of several hoses, and their stiffness without any model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.physics.rigid_body import forward_matrix

if TYPE_CHECKING:
    from deboom.compressor.identify import Identification
    from deboom.measurement.operating_sweep import HoseDrawing, OperatingTest

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
