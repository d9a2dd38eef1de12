"""Load of a rotor and of its gas at the virtual point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError


class RotationSense(Enum):
    """Sense of the rotor about x."""

    POSITIVE = 1
    """From y to z."""
    NEGATIVE = -1
    """From z to y."""


def unbalance_load(
    static: npt.ArrayLike,
    arm: npt.ArrayLike,
    frequency: npt.ArrayLike,
    sense: RotationSense = RotationSense.POSITIVE,
) -> ComplexArray:
    """Load of first order at a virtual point on the rotor's axis.

    Parameters
    ----------
    static : array, shape (n_source,)
        Unbalance of each source (crank, orbiting scroll, balance weight) as a rotating vector: its
        argument is the angle from y towards z in the sense of rotation, complex [kg m].
    arm : array, shape (n_source,)
        Of each source along x, from the virtual point [m].
    frequency : array, shape (n_frequency,)
        Of the rotation [Hz].
    sense : RotationSense
        About x.

    Returns
    -------
    array, shape (n_frequency, 6)
        Complex amplitudes [N, N m].

    Raises
    ------
    InputError
        Not one arm per source.

    Notes
    -----
    Thesis, eq. 36 and 37, with what they leave open: ``u = Σ u_i``, ``u_d = Σ arm_i u_i`` over
    sources, not over the six directions; ``F_y = u ω²``, ``F_z = −j u ω²``, ``M_z = u_d ω²``,
    ``M_y = +j u_d ω²`` for rotation from y to z, conjugate signs for the other sense. Gas forces
    and moments (eq. 38) add to it and do not grow with ω².
    """
    sources, arms = np.atleast_1d(static).astype(complex), np.atleast_1d(arm).astype(float)
    if sources.shape != arms.shape or sources.ndim != 1:
        raise InputError(f"{sources.size} unbalances and {arms.size} arms: give each its own")
    force, moment = sources.sum(), (arms * sources).sum()
    turn = -1j * sense.value
    directions = np.array([0, force, turn * force, 0, -turn * moment, moment])
    squared = (2 * np.pi * np.asarray(frequency, dtype=float)) ** 2
    return np.asarray(squared[:, np.newaxis] * directions)


GAS_NAMES = ("axial gas force", "gas moment", "rotating gas force")
GAS_UNITS = ("N", "N m", "N")
N_GAS = len(GAS_NAMES)


def rotor_columns(frequency: npt.ArrayLike, sense: RotationSense) -> ComplexArray:
    """Load per static and per dynamic unbalance.

    Parameters
    ----------
    frequency : array, shape (n_frequency,)
        Of the rotation [Hz].
    sense : RotationSense

    Returns
    -------
    array, shape (n_frequency, 6, 2)
        Columns of ``u`` [1/s²] and of ``u_d`` [1/s²].

    Notes
    -----
    Thesis, eq. 36; see `unbalance_load`.
    """
    # an unbalance of 1 on an arm of 0, and the pair (1, −1) on arms 1 and 0
    static = unbalance_load([1.0], [0.0], frequency, sense)
    dynamic = unbalance_load([1.0, -1.0], [1.0, 0.0], frequency, sense)
    return np.stack([static, dynamic], axis=-1)


def gas_columns(sense: RotationSense) -> ComplexArray:
    """Load per axial gas force, per gas moment and per rotating gas force.

    Parameters
    ----------
    sense : RotationSense

    Returns
    -------
    array, shape (6, 3)
        The same at every speed [1].

    Notes
    -----
    Thesis, eq. 38: the moment acts about x. The rotating force, ``F_y = g``, ``F_z = ∓j g``, passes
    as unbalance in y and z alike; only that it does not grow with ω² tells it apart.
    """
    columns = np.zeros((6, N_GAS), dtype=complex)
    columns[0, 0] = columns[3, 1] = columns[1, 2] = 1
    columns[2, 2] = -1j * sense.value
    return columns


class GasLaw(Protocol):
    """How gas forces at several pressures hang together; its unknowns are real numbers."""

    def start(self, pressure: RealArray) -> RealArray:
        """Unknowns to begin with, shape (n_unknown,)."""
        ...

    def gas(self, unknowns: RealArray) -> ComplexArray:
        """Axial force, moment and rotating force, shape (n_pressure, 3) [N, N m, N]."""
        ...

    def derivatives(self, unknowns: RealArray) -> ComplexArray:
        """Differentiate `gas`, shape (n_unknown, n_pressure, 3)."""
        ...


@dataclass(frozen=True)
class GasPerPressure:
    """Every pressure has its own gas forces: nothing is assumed."""

    def start(self, pressure: RealArray) -> RealArray:
        """No gas; real and imaginary part of three numbers per pressure."""
        return np.zeros(2 * N_GAS * pressure.size)

    def gas(self, unknowns: RealArray) -> ComplexArray:
        """Take real and imaginary parts by turns, shape (n_pressure, 3)."""
        return np.ascontiguousarray(unknowns).view(complex).reshape(-1, N_GAS)

    def derivatives(self, unknowns: RealArray) -> ComplexArray:
        """Differentiate `gas`: ones and imaginary units."""
        n = unknowns.size
        return np.eye(n).view(complex).reshape(n, -1, N_GAS)


@dataclass(frozen=True)
class ProportionalGas:
    """All three gas forces grow by one real factor from pressure to pressure.

    Notes
    -----
    The last unknowns are the factors of all pressures but the first; they begin as the ratio of the
    pressures.
    """

    def start(self, pressure: RealArray) -> RealArray:
        """No gas at the first pressure, and the ratios of the others to it."""
        return np.concatenate([np.zeros(2 * N_GAS), pressure[1:] / pressure[0]])

    def gas(self, unknowns: RealArray) -> ComplexArray:
        """Scale the gas forces at the first pressure, shape (n_pressure, 3)."""
        first = np.ascontiguousarray(unknowns[: 2 * N_GAS]).view(complex)
        return np.asarray(np.multiply.outer(np.append(1.0, unknowns[2 * N_GAS :]), first))

    def derivatives(self, unknowns: RealArray) -> ComplexArray:
        """Differentiate `gas`, shape (n_unknown, n_pressure, 3)."""
        n, n_first = unknowns.size, 2 * N_GAS
        factor = np.append(1.0, unknowns[n_first:])
        result = np.zeros((n, factor.size, N_GAS), dtype=complex)
        parts = np.eye(n_first).view(complex)
        result[:n_first] = factor[:, np.newaxis] * parts[:, np.newaxis]
        first = np.ascontiguousarray(unknowns[:n_first]).view(complex)
        for number in range(1, factor.size):
            result[n_first + number - 1, number] = first
        return result


def pressures(values: Sequence[float]) -> tuple[RealArray, npt.NDArray[np.intp]]:
    """Sort the pressures of all sweeps.

    Parameters
    ----------
    values : sequence of float
        One per sweep [Pa].

    Returns
    -------
    pressure : array, shape (n_pressure,)
        Each once, rising [Pa].
    index : int array, shape (n_sweep,)
        Which of them each sweep has.
    """
    pressure, index = np.unique(np.asarray(values, dtype=float), return_inverse=True)
    return pressure, index.reshape(-1)
