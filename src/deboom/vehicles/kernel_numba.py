"""The hot loops compiled with numba: faster than numpy, and exact coupled motion in search time.

- The whole evaluation of a block of designs stays in the processor's registers and first cache.
- The loops are written out for the problem at hand by `deboom.vehicles.kernel_source`.
- A sum of logarithms is the logarithm of a product, taken once per 96 lines (48 in single
  precision); designs whose products come near the end of the range go to the numpy kernel.
- One thread: workers come from elsewhere.

Compiling takes seconds, once per problem shape and machine: numba keeps the result on disk.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.vehicles import kernel_source
from deboom.vehicles.booming_model import LevelSum
from deboom.vehicles.coupled_motion import CoupledMotion
from deboom.vehicles.kernel_coupled_numpy import NUMPY_COUPLED, NumpyCoupledSum, nonzero_entries
from deboom.vehicles.kernel_numpy import NUMPY, NumpyLevelSum, line_exponents
from deboom.vehicles.kernel_source import COUPLED_LANES, PRESCRIBED_LANES, CoupledPattern
from deboom.vehicles.scaled_equations import ScaledEquations, scaled_equations

GROUP = {"float64": 16, "float32": 8}
"""Lines multiplied in working precision before their product is looked at."""

GROUPS = 6
"""Groups multiplied in double precision before their product is stored."""

GROUP_RANGE = {"float64": 1e50, "float32": 1e30}
"""Designs with a group's product beyond this, or below its inverse, go to numpy; `GROUPS` of them
fit a double."""

FACTOR_RANGE = 1e3
"""Designs with a largest factor beyond this, or below its inverse, go to numpy at once: between
these bounds no product can leave the range of the numbers within a group and come back unseen."""


@dataclass(frozen=True, eq=False)
class NumbaLevelSum:
    """Sums of levels over the lines of one load case, compiled; a kernel's `prepare` makes it.

    Parameters
    ----------
    pattern : int or CoupledPattern
        What the loops are written for: the number of variables, or the equations' zeros.
    columns : array of int
        Design variable of each row of designs that the loops read.
    tables : tuple of array
        In the working precision, in the order of the loops' arguments.
    n_lines : int
        Number of lines.
    scale_level : array, shape (n_vehicle,)
        Sum over the lines of what scaling took out [dB re 1 Pa].
    careful : LevelSum
        Computes the designs whose products come near the end of the range.
    """

    pattern: int | CoupledPattern
    columns: npt.NDArray[np.intp]
    tables: tuple[Any, ...]
    n_lines: int
    scale_level: RealArray
    careful: NumpyLevelSum | NumpyCoupledSum

    def __call__(self, designs: RealArray) -> RealArray:
        """Return ``Σ_f 20 lg |p_f|`` of each design and vehicle.

        Parameters
        ----------
        designs : array, shape (n, n_variable)
            Stiffness factors, finite [1].

        Returns
        -------
        array, shape (n, n_vehicle)
            [dB re 1 Pa]; not finite where a design silences a line completely.
        """
        if len(designs) == 0:
            return np.empty((0, self.scale_level.size))
        with np.errstate(all="ignore"):
            factors = np.ascontiguousarray(designs[:, self.columns], dtype=self.tables[0].dtype)
            product, in_range = self._products(factors)
            neper = np.log(product).sum(axis=1).T
        level = 10.0 / np.log(10.0) * neper + self.scale_level
        if not in_range.all():
            level[~in_range] = self.careful(np.ascontiguousarray(designs[~in_range]))
        return np.asarray(level)

    def _products(self, factors: npt.NDArray[Any]) -> tuple[RealArray, npt.NDArray[np.bool_]]:
        """Return products of ``|p|²``, shape (n_vehicle, n_part, n), and which designs to trust."""
        precision, n, n_vehicle = factors.dtype, len(factors), self.scale_level.size
        run, lanes = _compiled(self.pattern)
        group = GROUP[precision.name]
        n_padded = -(-n // lanes) * lanes
        products = np.empty((n_vehicle, -(-self.n_lines // (GROUPS * group)), n_padded))
        lowest = np.ones((n_vehicle, n_padded), dtype=precision)
        highest = np.ones((n_vehicle, n_padded), dtype=precision)
        rows = [factors.shape[1], 1, 1, 1]
        if isinstance(self.pattern, CoupledPattern):
            n_entry, n_path = len(self.pattern.nonzero), self.pattern.n_paths
            rows = [factors.shape[1], *[n_vehicle] * 3, 2 * n_entry, 2 * 6, 2 * n_path]
        work = tuple(aligned(n_rows * lanes, precision) for n_rows in rows)
        total = aligned(rows[1] * lanes, np.dtype(np.float64))
        one = precision.type(1)
        run(
            *(factors, *self.tables, one, group, GROUPS * group),
            *(work, total, products, lowest, highest),
        )

        product, limit = products[:, :, :n], GROUP_RANGE[precision.name]
        size = np.abs(factors).max(axis=1)
        in_range = (size > 1.0 / FACTOR_RANGE) & (size < FACTOR_RANGE)
        in_range &= (lowest.min(axis=0) > 1.0 / limit)[:n] & (highest.max(axis=0) < limit)[:n]
        in_range &= (product > 0.0).all(axis=(0, 1)) & np.isfinite(product).all(axis=(0, 1))
        return product, in_range


@dataclass(frozen=True)
class NumbaKernel:
    """Compiled kernel for prescribed motion, a `deboom.vehicles.booming_model.LevelSumKernel`.

    Parameters
    ----------
    name : str
        What the run's record calls it.
    precision : str
        ``"float64"``, or ``"float32"`` for an error of up to 2e-3 dB in a sum over 321 lines.
    """

    name: str
    precision: str

    def prepare(self, contributions: ComplexArray) -> LevelSum:
        """Scale contributions, shape (n_vehicle, n_frequency, n_variable) [Pa].

        Numba compiles the loops when they run first.

        Raises
        ------
        InputError
            Numba is not installed.
        """
        careful = NUMPY.prepare(contributions)
        active = careful.active
        exponents = line_exponents(contributions)
        scaled = contributions[:, :, active] * np.ldexp(1.0, -exponents)[..., np.newaxis]
        table = np.concatenate([scaled.real, scaled.imag], axis=2).astype(self.precision)
        if active.size == 0:
            return careful
        _compiled(active.size)
        return NumbaLevelSum(
            pattern=active.size,
            columns=active,
            tables=(np.ascontiguousarray(table),),
            n_lines=contributions.shape[1],
            scale_level=20.0 * np.log10(2.0) * exponents.sum(axis=1),
            careful=careful,
        )


@dataclass(frozen=True)
class NumbaCoupledKernel:
    """Compiled kernel for coupled motion, a `deboom.vehicles.booming_model.CoupledKernel`.

    Parameters
    ----------
    name : str
        What the run's record calls it.
    precision : str
        ``"float64"``, or ``"float32"`` for an error of up to 5e-3 dB in a sum over 321 lines.
    """

    name: str
    precision: str

    def prepare(self, motion: CoupledMotion) -> LevelSum:
        """Scale the equations of motion of one load case.

        Numba compiles the loops when they run first.

        Raises
        ------
        InputError
            Numba is not installed.
        """
        equations = scaled_equations(motion)
        pattern, columns = coupled_pattern(equations)
        _compiled(pattern)
        tables = (
            _line_table(equations, pattern),
            _forward_table(equations, pattern),
            _transfer_table(equations, pattern),
        )
        return NumbaLevelSum(
            pattern=pattern,
            columns=columns,
            tables=tuple(np.ascontiguousarray(table, dtype=self.precision) for table in tables),
            n_lines=motion.frequency.size,
            scale_level=equations.scale_level,
            careful=NUMPY_COUPLED.prepare(motion),
        )


NUMBA = NumbaKernel("numba", "float64")
"""Prescribed motion, double precision."""

NUMBA_FLOAT32 = NumbaKernel("numba float32", "float32")
"""Prescribed motion, single precision: errors up to 2e-3 dB in a sum over 321 lines."""

NUMBA_COUPLED = NumbaCoupledKernel("numba", "float64")
"""Coupled motion, double precision."""

NUMBA_COUPLED_FLOAT32 = NumbaCoupledKernel("numba float32", "float32")
"""Coupled motion, single precision: errors up to 5e-3 dB in a sum over 321 lines."""


def aligned(size: int, precision: np.dtype[Any]) -> npt.NDArray[Any]:
    """Return an empty array that starts on a cache line: otherwise loops may take twice as long."""
    raw = np.empty(size + 64 // precision.itemsize, precision)
    start = -raw.ctypes.data % 64 // precision.itemsize
    return raw[start : start + size]


def coupled_pattern(equations: ScaledEquations) -> tuple[CoupledPattern, npt.NDArray[np.intp]]:
    """Return what the loops are written for, and the variable of each row that they read."""
    own = equations.own_variables
    own_paths = list(dict.fromkeys(own.tolist()))
    pattern = CoupledPattern(
        directions=tuple(tuple(np.flatnonzero(row).tolist()) for row in equations.forward),
        nonzero=nonzero_entries(equations.forward, equations.mass_matrix),
        transmitting=tuple(equations.transmitting.tolist()),
        own_paths=tuple(tuple(np.flatnonzero(own == path).tolist()) for path in own_paths),
    )
    return pattern, np.array([*equations.variables, *own_paths], dtype=np.intp)


def _line_table(equations: ScaledEquations, pattern: CoupledPattern) -> RealArray:
    """Lay out the coefficients of each line in the order in which the loops read them."""
    n_line = len(equations.stiffness)
    columns: list[RealArray] = []
    for i, j in pattern.nonzero:
        springs = pattern.springs(i, j)
        products = equations.forward[springs, i] * equations.forward[springs, j]
        stiffness = equations.stiffness[:, springs] * products
        columns.append(np.full((n_line, 1), -equations.mass_matrix[i, j]))
        columns += [stiffness.real, stiffness.imag]
    columns.append(_parts(equations.load))
    for piece in (piece for pieces in pattern.own_paths for piece in pieces):
        columns += [_parts(equations.own_stiffness[:, [piece]])]
        columns += [_parts(equations.own_load[:, [piece]])]
    return np.concatenate(columns, axis=1)


def _parts(values: ComplexArray) -> RealArray:
    """Return real and imaginary parts side by side, column by column."""
    return np.stack([values.real, values.imag], axis=-1).reshape(len(values), -1)


def _forward_table(equations: ScaledEquations, pattern: CoupledPattern) -> RealArray:
    rows = [equations.forward[i, list(pattern.directions[i])] for i in pattern.transmitting]
    return np.concatenate(rows) if rows else np.zeros(1)


def _transfer_table(equations: ScaledEquations, pattern: CoupledPattern) -> RealArray:
    """Return the transfer of each path, shape (n_frequency, n_vehicle, 2 n_path)."""
    # the pieces of a mount share its path, thus the transfer function of its first piece
    firsts = [pieces[0] for pieces in pattern.own_paths]
    both = [equations.transfer, equations.own_transfer[..., firsts]]
    table = np.moveaxis(np.concatenate(both, axis=2), 0, 1)
    return np.concatenate([table.real, table.imag], axis=2)


@cache
def _compiled(pattern: int | CoupledPattern) -> tuple[Callable[..., None], int]:
    """Compile the loops of a pattern; return their driver and the number of lanes."""
    lanes = PRESCRIBED_LANES if isinstance(pattern, int) else COUPLED_LANES
    return compile_loops(kernel_source.source(pattern), lanes), lanes


def compile_loops(text: str, lanes: int) -> Callable[..., None]:
    """Compile the source of loops and return their driver ``run``.

    Raises
    ------
    InputError
        Numba is not installed.
    """
    jit = _jit(hashlib.sha256(f"{lanes} {text}".encode()).hexdigest()[:16])
    namespace: dict[str, Any] = {"__name__": __name__, "jit": jit, "LANES": lanes, "np": np}
    exec(compile(text, kernel_source.__file__, "exec"), namespace)
    run: Callable[..., None] = namespace["run"]
    return run


def _jit(digest: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Return numba's decorator as the loops need it, or say that numba is missing."""
    try:
        import numba
    except ImportError:
        raise InputError(
            "the compiled kernel needs numba, which is not installed: pip install deboom[fast], or "
            "choose the numpy kernel"
        ) from None
    # error_model: a branch for a division by zero would keep the loops from being vectorised
    options: dict[str, Any] = {
        "fastmath": {"contract", "reassoc", "nsz", "arcp"},
        "error_model": "numpy",
        "nogil": True,
    }

    def jit(function: Callable[..., None]) -> Callable[..., None]:
        # numba finds what it kept on disk by file and name, so the name holds the content
        function.__qualname__ = f"{function.__name__}_{digest}"
        try:
            compiled: Callable[..., None] = numba.njit(cache=True, **options)(function)
        except RuntimeError:  # no folder that can be written: compile again in every process
            compiled = numba.njit(**options)(function)
        return compiled

    return jit
