"""Coupled motion without a compiler and fast: solved at a few lines, interpolated between them.

In ``u = 1/ω²`` the determinant of the impedance is a polynomial of degree six as long as the
stiffnesses are constant, and so are the entries of its adjugate; with stiffnesses and loads that
are smooth over the frequency they stay close to polynomials. Both are therefore computed at a few
of the lines, those next to Chebyshev points in u, interpolated to all of them, and divided there.
The resonances are the roots of the interpolated determinant and need no fine lines.

Nothing of this holds for stiffnesses or loads that scatter from line to line, as measured ones do.
Hence the kernel compares itself with the exact solution before it is used, and refuses. Operating
spectra and what is identified with them are such data, whatever the source of the forces; use this
kernel for computed ones, and `deboom.vehicles.kernel_numba` for everything else.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.vehicles.coupled_motion import CoupledMotion
from deboom.vehicles.kernel_coupled_numpy import (
    NUMPY_COUPLED,
    Matrix,
    NumpyCoupledSum,
    nonzero_entries,
    solve_symmetric,
)
from deboom.vehicles.kernel_numpy import one_blas_thread
from deboom.vehicles.line_interpolation import LineInterpolation, interpolation_over_lines
from deboom.vehicles.scaled_equations import ScaledEquations, scaled_equations

ROWS = 128
"""Designs per block, padded: the result of a design must not depend on the designs beside it."""

LINES = 24
"""Lines per block: what is interpolated stays in the second-level cache."""

GROUP = 4
"""Lines multiplied before one logarithm is taken."""

LARGEST_LOGARITHM = 69.0
"""Designs with a group whose product is beyond 1e30, or below its inverse, are solved exactly."""

N_CHECKED = 15
"""Designs of the comparison with the exact solution, beside the nominal one."""

CHECK_REACH = 0.35
"""They lie this far around 1: the usual bounds and the scatter beyond them [1]."""

ALLOWED_PER_LINE = 0.2 / 321
"""Error of the sum over the lines that passes, per line [dB]."""

LOADS = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")
"""External load on the powertrain."""

SingleArray = npt.NDArray[np.float32]
"""What is interpolated: its error of 1e-3 dB is far below that of the interpolation."""


@dataclass(frozen=True, eq=False)
class _Work:
    """Memory of one call; a fresh page costs as much as the numbers that come to stand on it."""

    forces: SingleArray
    between: SingleArray
    pressure: SingleArray
    square: SingleArray
    determinant: SingleArray
    products: SingleArray


@dataclass(frozen=True, eq=False)
class SmoothCoupledSum:
    """Sums of levels over the lines of one load case; `SmoothCoupledKernel.prepare` makes it.

    Parameters
    ----------
    equations : ScaledEquations
        Of the load case.
    nonzero : tuple of (int, int)
        Entries of the impedance that are not zero for all lines and designs.
    nodes : array of int, shape (n_node,)
        Lines at which the equations are solved.
    springs : array, shape (2, n_nonzero, n_node, n_direction)
        Real and imaginary part of each direction's contribution to those entries at the nodes.
    mass : array, shape (n_nonzero,)
        What those entries lose.
    weights : array, shape (n_frequency, n_node)
        Of the interpolation from the nodes to the lines, times a power of two per line [1].
    transfer : array, shape (2, n_frequency, n_vehicle, 2 n_path)
        From real and imaginary parts of the powertrain's paths to those of the pressure.
    own_transfer : array, shape (2, n_frequency, n_vehicle, 2 n_own)
        The same from the bodies of their own.
    exact : NumpyCoupledSum
        Computes the designs whose products come near the end of the range.
    """

    equations: ScaledEquations
    nonzero: tuple[tuple[int, int], ...]
    nodes: npt.NDArray[np.intp]
    springs: RealArray
    mass: RealArray
    weights: SingleArray
    transfer: SingleArray
    own_transfer: SingleArray
    exact: NumpyCoupledSum

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
        n_vehicle, n_line = self.equations.scale_level.size, len(self.weights)
        n_group = -(-n_line // GROUP)
        work = _Work(
            forces=_single(self.nodes.size * self.transfer.shape[2]),
            between=_single(LINES * self.transfer.shape[2]),
            pressure=_single(LINES * 2 * n_vehicle),
            square=_single(max(LINES * n_vehicle, n_line)),
            determinant=_single(n_line * 2),
            products=_single(n_group * (n_vehicle + 1)),
        )
        with one_blas_thread(), np.errstate(all="ignore"):
            for start in range(0, len(designs), ROWS):
                rows = designs[start : start + ROWS]
                padded = np.empty((designs.shape[1], ROWS))
                padded[:, : len(rows)] = rows.T
                padded[:, len(rows) :] = padded[:, :1]
                neper[start : start + ROWS] = self._block(padded, work)[:, : len(rows)].T
        level = np.asarray(10.0 / np.log(10.0) * neper + self.equations.scale_level)
        in_range = np.isfinite(level).all(axis=1)
        if not in_range.all():
            level[~in_range] = self.exact(np.ascontiguousarray(designs[~in_range]))
        return level

    def _block(self, factors: RealArray, work: _Work) -> RealArray:
        """Return ``Σ_f ln |p_f|²`` of factors (n_variable, ROWS), shape (n_vehicle, ROWS).

        Not finite where a product of lines comes near the end of the range.
        """
        n_line, n_node = self.weights.shape
        n_vehicle = self.equations.scale_level.size
        forces = work.forces.reshape(n_node, 2, -1, ROWS)
        determinant = self._at_nodes(factors, forces)
        between = work.between.reshape(LINES, -1, ROWS)
        pressure = work.pressure.reshape(LINES, -1, ROWS)
        everywhere = work.determinant.reshape(n_line, 2, ROWS)
        np.matmul(self.weights, determinant, out=everywhere.reshape(n_line, -1))
        products = work.products.reshape(-1, n_vehicle + 1, ROWS)
        flat = forces.reshape(n_node, -1)
        for first in range(0, n_line, LINES):
            lines = slice(first, min(first + LINES, n_line))
            n = lines.stop - first
            found, heard = between[:n], pressure[:n]
            np.matmul(self.weights[lines], flat, out=found.reshape(n, -1))
            np.matmul(self.transfer[lines], found, out=heard)
            if self.own_transfer.shape[-1]:
                own = self._own(lines, factors, everywhere[lines])
                heard += self.own_transfer[lines] @ own
            _multiply_lines(heard, products[first // GROUP :, :-1], work.square)
        _multiply_lines(everywhere, products[:, -1:], work.square)
        neper = np.log(products)
        neper[np.abs(neper) > LARGEST_LOGARITHM] = np.nan
        total = neper.sum(axis=0, dtype=np.float64)
        return np.asarray(total[:-1] - total[-1])

    def _at_nodes(self, factors: RealArray, forces: SingleArray) -> SingleArray:
        """Write ``x v q det Z``, shape (n_node, 2, n_path, ROWS), real and imaginary parts.

        Return those of ``det Z``, shape (n_node, 2 ROWS).
        """
        equations, n_node = self.equations, len(self.nodes)
        x = np.ascontiguousarray(factors[equations.variables])
        entries = np.empty((len(self.nonzero), n_node, ROWS), dtype=np.complex128)
        entries.real, entries.imag = self.springs @ x
        entries.real -= self.mass[:, np.newaxis, np.newaxis]
        matrix: Matrix = dict(zip(self.nonzero, entries, strict=True))
        load = [equations.load[self.nodes, k, np.newaxis] for k in range(6)]
        motion, inverse_pivots = solve_symmetric(matrix, load)
        determinant = 1.0 / math.prod(inverse_pivots)
        scaled = np.empty((n_node, 2, 6, ROWS))
        for k, part in enumerate(motion):
            both = part * determinant
            scaled[:, 0, k], scaled[:, 1, k] = both.real, both.imag
        transmitting = equations.transmitting
        np.multiply(equations.forward[transmitting] @ scaled, x[transmitting], out=forces)
        return np.concatenate([determinant.real, determinant.imag], axis=1).astype(np.float32)

    def _own(self, lines: slice, factors: RealArray, determinant: SingleArray) -> SingleArray:
        """Return the forces of bodies of their own times ``det Z``, shape (n, 2 n_own, ROWS)."""
        equations = self.equations
        own = factors[equations.own_variables]
        reach = own * equations.own_stiffness[lines, :, np.newaxis] - 1.0
        force = own * equations.own_load[lines, :, np.newaxis] / reach
        force *= determinant[:, :1] + 1j * determinant[:, 1:]
        return np.concatenate([force.real, force.imag], axis=1).astype(np.float32)


@dataclass(frozen=True)
class SmoothCoupledKernel:
    """The kernel of this module, a `deboom.vehicles.booming_model.CoupledKernel`.

    Parameters
    ----------
    name : str
        What the run's record calls it.
    n_nodes : int
        Lines at which the equations are solved.

    Notes
    -----
    Results are those of the exact kernels within `ALLOWED_PER_LINE` times the number of lines for
    the designs of the comparison, not within 1e-9 dB. Levels and gradients of an index are exact
    with every kernel.
    """

    name: str = "numpy smooth"
    n_nodes: int = 12

    def prepare(self, motion: CoupledMotion) -> SmoothCoupledSum:
        """Scale the equations of motion of one load case, and compare with the exact solution.

        Raises
        ------
        InputError
            Too few lines; stiffnesses or loads that are not smooth enough over the lines: names
            what is the least smooth, its line, and the error.
        """
        if motion.frequency.size < 2 * self.n_nodes:
            raise InputError(
                f"load case {motion.load_case}: {motion.frequency.size} lines are too few to "
                f"interpolate between {self.n_nodes}: take an exact kernel (numba or numpy)"
            )
        equations = scaled_equations(motion)
        forward = equations.forward
        nonzero = nonzero_entries(forward, equations.mass_matrix)
        u = 1.0 / motion.angular_frequency_squared
        interpolation = interpolation_over_lines(motion.frequency, self.n_nodes)
        nodes = interpolation.nodes
        products = np.array([forward[:, i] * forward[:, j] for i, j in nonzero])
        springs = equations.stiffness[nodes] * products[:, np.newaxis]
        nominal = motion.impedance(np.ones((1, len(motion.variable_names))))[0]
        scale = 1.0 / np.sqrt(np.diag(motion.mass_matrix))
        unitless = nominal * np.outer(scale, scale) * u[:, np.newaxis, np.newaxis]
        # both sides of the quotient may be scaled; so scaled they are of the order of 1
        power = np.ldexp(1.0, -np.frexp(np.abs(np.linalg.det(unitless)))[1])
        level_sum = SmoothCoupledSum(
            equations=equations,
            nonzero=nonzero,
            nodes=nodes,
            springs=np.ascontiguousarray(np.stack([springs.real, springs.imag])),
            mass=np.array([equations.mass_matrix[entry] for entry in nonzero]),
            weights=(interpolation.weights * power[:, np.newaxis]).astype(np.float32),
            transfer=_real_table(equations.transfer),
            own_transfer=_real_table(equations.own_transfer),
            exact=NUMPY_COUPLED.prepare(motion),
        )
        _refuse_rough(motion, level_sum, interpolation)
        return level_sum


SMOOTH_COUPLED = SmoothCoupledKernel()
"""Plain numpy for smooth stiffnesses and loads, checked."""


def _refuse_rough(
    motion: CoupledMotion, level_sum: SmoothCoupledSum, interpolation: LineInterpolation
) -> None:
    """Compare with the exact solution, at all lines and for designs all over the usual bounds."""
    n_variable, n_line = len(motion.variable_names), motion.frequency.size
    spread = np.random.default_rng(1).uniform(-CHECK_REACH, CHECK_REACH, (N_CHECKED, n_variable))
    designs = np.vstack([np.ones(n_variable), 1.0 + spread])
    error = float(np.abs(level_sum(designs) - level_sum.exact(designs)).max())
    allowed = ALLOWED_PER_LINE * n_line
    if error <= allowed:
        return
    stiffness = interpolation.roughness(motion.stiffness)
    load = interpolation.roughness(motion.load)
    names = [f"stiffness {motion.variable_names[column]}" for column in motion.variables]
    worst = [
        _roughest(stiffness, names, motion.frequency),
        _roughest(load, [f"load {axis}" for axis in LOADS], motion.frequency),
    ]
    raise InputError(
        f"load case {motion.load_case}: the smooth kernel would err by {error:.2g} dB in a sum "
        f"over {n_line} lines, {allowed:.2g} dB are allowed: the data are not smooth enough "
        f"({' and '.join(worst)} off a smooth curve): take an exact kernel, numba or numpy"
    )


def _roughest(roughness: RealArray, names: Sequence[str], frequency: RealArray) -> str:
    line, column = divmod(int(np.argmax(roughness)), roughness.shape[1])
    percent = 100.0 * roughness[line, column]
    return f"{names[column]} at {frequency[line]:g} Hz is {percent:.2g} %"


def _real_table(transfer: ComplexArray) -> SingleArray:
    """Lay out (n_vehicle, n_frequency, n_path) for stacked real and imaginary parts."""
    table = np.moveaxis(transfer, 0, 1)
    real = np.concatenate([table.real, -table.imag], axis=2)
    imaginary = np.concatenate([table.imag, table.real], axis=2)
    return np.concatenate([real, imaginary], axis=1).astype(np.float32)


def _single(n_rows: int) -> SingleArray:
    """Return memory for rows of ROWS numbers that starts on a cache line."""
    raw = np.empty(n_rows * ROWS + 16, dtype=np.float32)
    start = -raw.ctypes.data % 64 // raw.itemsize
    return raw[start : start + n_rows * ROWS]


def _multiply_lines(parts: SingleArray, out: SingleArray, work: SingleArray) -> None:
    """Write ``Π |p|²`` of every `GROUP` lines of parts (n_line, 2 n, ROWS), and overwrite these."""
    n_line, n = len(parts), parts.shape[1] // 2
    square = work[: n_line * n * ROWS].reshape(n_line, n, ROWS)
    np.multiply(parts, parts, out=parts)
    np.add(parts[:, :n], parts[:, n:], out=square)
    n_group = n_line // GROUP
    whole = square[: n_group * GROUP].reshape(n_group, GROUP, n, ROWS)
    np.multiply.reduce(whole, axis=1, out=out[:n_group])
    if n_group * GROUP < n_line:
        np.multiply.reduce(square[n_group * GROUP :], axis=0, out=out[n_group])
