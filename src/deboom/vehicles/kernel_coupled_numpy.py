"""Coupled motion in plain numpy: exact, several times faster than a loop, and the careful tier.

The impedance of many designs is factorised entry by entry: each entry of the 6×6 matrix is an
array over lines and designs, so that numpy's loops are long. `deboom.vehicles.kernel_numba` does
the same many times faster; this kernel needs no compiler and takes every number.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.vehicles.coupled_motion import CoupledMotion
from deboom.vehicles.kernel_numpy import one_blas_thread
from deboom.vehicles.scaled_equations import ScaledEquations, scaled_equations

ROWS = 128
"""Designs per block, padded: the result of a design must not depend on the designs beside it."""

LINES = 16
"""Lines per block: what one step of the elimination touches stays in the second-level cache."""

ENTRIES = tuple((i, j) for i in range(6) for j in range(i + 1))
"""Rows and columns of the lower triangle."""

Matrix = dict[tuple[int, int], ComplexArray]
"""Nonzero entries (row ≥ column) of symmetric matrices."""


@dataclass(frozen=True, eq=False)
class NumpyCoupledSum:
    """Sums of levels over the lines of one load case; `NumpyCoupledKernel.prepare` makes it.

    Parameters
    ----------
    equations : ScaledEquations
        Of the load case.
    nonzero : tuple of (int, int)
        Entries of the impedance that are not zero for all lines and designs.
    springs : array, shape (n_frequency, 2 n_nonzero, n_direction)
        Real, then imaginary part of each direction's contribution to those entries.
    """

    equations: ScaledEquations
    nonzero: tuple[tuple[int, int], ...]
    springs: RealArray

    def __call__(self, designs: RealArray) -> RealArray:
        """Return ``Σ_f 20 lg |p_f|`` of each design and vehicle.

        Parameters
        ----------
        designs : array, shape (n, n_variable)
            Stiffness factors, finite [1].

        Returns
        -------
        array, shape (n, n_vehicle)
            [dB re 1 Pa]; not finite where a design silences a line completely, or resonates
            without any loss.
        """
        neper = np.empty((len(designs), self.equations.scale_level.size))
        with one_blas_thread(), np.errstate(all="ignore"):
            for start in range(0, len(designs), ROWS):
                rows = designs[start : start + ROWS]
                padded = np.empty((designs.shape[1], ROWS))
                padded[:, : len(rows)] = rows.T
                padded[:, len(rows) :] = padded[:, :1]
                neper[start : start + ROWS] = self._block(padded)[:, : len(rows)].T
        return np.asarray(20.0 / np.log(10.0) * neper + self.equations.scale_level)

    def _block(self, factors: RealArray) -> RealArray:
        """Return ``Σ_f ln |p_f|`` of factors (n_variable, ROWS), shape (n_vehicle, ROWS)."""
        equations = self.equations
        n_line = len(equations.stiffness)
        neper = np.zeros((equations.scale_level.size, ROWS))
        edges = [*range(0, n_line, LINES), n_line]
        for first, last in itertools.pairwise(edges):
            lines = slice(first, last)
            path = self._path_forces(lines, factors)
            transfer = (equations.transfer[:, lines], equations.own_transfer[:, lines])
            table = np.moveaxis(np.concatenate(transfer, axis=2), 0, 1)
            neper += np.log(np.abs(table @ path)).sum(axis=0)
        return neper

    def _path_forces(self, lines: slice, factors: RealArray) -> ComplexArray:
        """Return ``x v q`` and the forces of bodies of their own, shape (lines, n_path, ROWS)."""
        equations = self.equations
        x = np.ascontiguousarray(factors[equations.variables])
        both = self.springs[lines] @ x
        real, imaginary = np.split(both, 2, axis=1)
        matrix: Matrix = {}
        for k, (i, j) in enumerate(self.nonzero):
            matrix[i, j] = real[:, k] - equations.mass_matrix[i, j] + 1j * imaginary[:, k]
        load = [equations.load[lines, k, np.newaxis] for k in range(6)]
        motion = np.stack(np.broadcast_arrays(*solve_symmetric(matrix, load)[0]), axis=1)
        transmitting = equations.transmitting
        displacement = equations.forward[transmitting] @ motion
        own_force = self._own_forces(lines, factors)
        return np.concatenate([x[transmitting] * displacement, own_force], axis=1)

    def _own_forces(self, lines: slice, factors: RealArray) -> ComplexArray:
        """Return the forces of bodies of their own, shape (lines, n_own, ROWS)."""
        equations = self.equations
        own = factors[equations.own_variables]
        reach = own * equations.own_stiffness[lines, :, np.newaxis] - 1.0
        return np.asarray(own * equations.own_load[lines, :, np.newaxis] / reach)


def solve_symmetric(
    matrix: Matrix, load: list[ComplexArray]
) -> tuple[list[ComplexArray], list[ComplexArray]]:
    """Solve complex symmetric 6×6 systems, given and returned entry by entry, by LDLᵀ.

    Parameters
    ----------
    matrix : mapping of (int, int) to array
        Entries (row ≥ column) that are not zero; all diagonal ones are there.
    load : list of 6 arrays
        Right sides; their shapes broadcast against those of the entries.

    Returns
    -------
    list of 6 arrays
        The solutions.
    list of 6 arrays
        One over each pivot; the product of all is one over the determinant.

    Notes
    -----
    No pivoting: the impedance of a damped body has no small pivots.
    """
    z, b = dict(matrix), list(load)
    lower: Matrix = {}
    inverse = []
    for k in range(6):
        inverse.append(1.0 / z[k, k])
        below = [i for i in range(k + 1, 6) if (i, k) in z]
        for i in below:
            lower[i, k] = z[i, k] * inverse[k]
            b[i] = b[i] - lower[i, k] * b[k]
        for i, j in itertools.combinations_with_replacement(below, 2):
            change = lower[j, k] * z[i, k]
            z[j, i] = z[j, i] - change if (j, i) in z else -change
    b = [value * scale for value, scale in zip(b, inverse, strict=True)]
    for k in reversed(range(6)):
        for i in range(k + 1, 6):
            if (i, k) in lower:
                b[k] = b[k] - lower[i, k] * b[i]
    return b, inverse


@dataclass(frozen=True)
class NumpyCoupledKernel:
    """The kernel of this module, a `deboom.vehicles.booming_model.CoupledKernel`."""

    name: str = "numpy"

    def prepare(self, motion: CoupledMotion) -> NumpyCoupledSum:
        """Scale the equations of motion of one load case and lay them out."""
        equations = scaled_equations(motion)
        forward = equations.forward
        nonzero = nonzero_entries(forward, equations.mass_matrix)
        products = np.array([forward[:, i] * forward[:, j] for i, j in nonzero])
        springs = equations.stiffness[:, np.newaxis, :] * products
        both = np.concatenate([springs.real, springs.imag], axis=1)
        return NumpyCoupledSum(equations, nonzero, np.ascontiguousarray(both))


def nonzero_entries(
    forward: npt.ArrayLike, mass_matrix: npt.ArrayLike
) -> tuple[tuple[int, int], ...]:
    """Return the entries (row ≥ column) of the impedance that can differ from zero."""
    moved = np.asarray(forward) != 0
    there = (moved[:, :, np.newaxis] & moved[:, np.newaxis, :]).any(axis=0)
    there |= np.asarray(mass_matrix) != 0
    return tuple(entry for entry in ENTRIES if there[entry])


NUMPY_COUPLED = NumpyCoupledKernel()
"""Plain numpy in double precision: exact, without a compiler."""
