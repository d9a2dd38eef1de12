"""The hot loop in plain numpy: sums of levels over the lines, for many designs.

What a robust search spends its time on is ``Σ_f 20 lg |Σ_k x_k C_fk|``, for every vehicle and every
draw of the manufacturing scatter of every design. Five things make it fast:

- the factors x are real, so the real and the imaginary part are two real matrix products, and
  stacked one;
- variables without effect are left out;
- the pressures of one product, a block of lines times a block of designs, stay in the second-level
  cache of the processor;
- a sum of logarithms is the logarithm of a product: lines are scaled to about 1, and one logarithm
  serves up to 96 of them;
- BLAS is held to one thread: the matrices are too small for more, and the processes of a parallel
  search would take the cores from each other.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt
from threadpoolctl import LibController, ThreadpoolController

from deboom.arrays import ComplexArray, RealArray

ROWS = 128
"""Designs per matrix product. Constant, with padding: BLAS takes other instructions for other
shapes, and the result of a design must not depend on the designs that come with it."""

LINES = 384
"""Lines per matrix product at most; 2 · 384 · 128 numbers are 3/4 MiB."""

PRODUCTS = 4
"""Products that grow side by side, each of every fourth line: numpy is fast along long rows."""


@dataclass(frozen=True, eq=False)
class NumpyLevelSum:
    """Sums of levels over the lines of one set of contributions; `NumpyKernel.prepare` makes it.

    Parameters
    ----------
    active : array, shape (n_active,)
        Positions of the variables that contribute anywhere.
    tables : tuple of array, shape (n_vehicle, 2 n_lines, n_active)
        Of each block of lines, the real and then the imaginary parts of the scaled contributions
        [1].
    scale_level : array, shape (n_vehicle,)
        Sum over the lines of what the scaling took out [dB re 1 Pa].
    """

    active: npt.NDArray[np.intp]
    tables: tuple[RealArray, ...]
    scale_level: RealArray

    def __call__(self, designs: RealArray) -> RealArray:
        """Return ``Σ_f 20 lg |p_f|`` of each design and vehicle.

        Parameters
        ----------
        designs : array, shape (n, n_variable)
            Stiffness factors, finite [1].

        Returns
        -------
        array, shape (n, n_vehicle)
            [dB re 1 Pa]; minus infinity where a design silences a line completely.
        """
        neper = np.empty((len(designs), self.scale_level.size))
        work = _aligned(max(table.shape[1] for table in self.tables), ROWS)
        # some BLAS leave floating-point flags behind that mean nothing
        with one_blas_thread(), np.errstate(all="ignore"):
            for start in range(0, len(designs), ROWS):
                rows = designs[start : start + ROWS]
                neper[start : start + ROWS] = self._block(rows, work)[:, : len(rows)].T
        return np.asarray(10.0 / np.log(10.0) * neper + self.scale_level)

    def _block(self, rows: RealArray, work: RealArray) -> RealArray:
        """Return ``Σ_f ln |p_f|²`` of at most ROWS designs, shape (n_vehicle, ROWS)."""
        columns = np.empty((self.active.size, ROWS))
        columns[:, : len(rows)] = rows.T[self.active]
        columns[:, len(rows) :] = columns[:, :1]
        n_block, n_vehicle = len(self.tables), self.scale_level.size
        products = _aligned(n_vehicle * n_block, PRODUCTS * ROWS).reshape(n_vehicle, n_block, -1)
        exact: dict[tuple[int, int], RealArray] = {}
        for block, table in enumerate(self.tables):
            pressure = work[: table.shape[1]]
            for vehicle in range(n_vehicle):
                np.matmul(table[vehicle], columns, out=pressure)
                try:
                    _multiply_lines(pressure, out=products[vehicle, block])
                except FloatingPointError:
                    np.matmul(table[vehicle], columns, out=pressure)
                    exact[vehicle, block] = _log_of_product(pressure)
        neper = np.log(products)
        for which, logarithm in exact.items():
            neper[which] = logarithm
        return np.asarray(neper.reshape(n_vehicle, -1, ROWS).sum(axis=1))


@dataclass(frozen=True)
class NumpyKernel:
    """The kernel of this module, a `deboom.vehicles.booming_model.LevelSumKernel`."""

    name: str = "numpy"

    def prepare(self, contributions: ComplexArray) -> NumpyLevelSum:
        """Scale contributions and lay them out for the matrix products.

        Parameters
        ----------
        contributions : array, shape (n_vehicle, n_frequency, n_variable)
            Complex pressure per unit stiffness factor [Pa].

        Returns
        -------
        NumpyLevelSum
            From designs, shape (n, n_variable), to sums of levels, shape (n, n_vehicle).

        Notes
        -----
        Each line is divided by a power of two, see `line_exponents`, which rounds nothing.
        """
        exponents = line_exponents(contributions)
        active = np.flatnonzero(contributions.any(axis=(0, 1)))
        parts = contributions.real[:, :, active], contributions.imag[:, :, active]
        scaled = [np.ldexp(part, -exponents[:, :, np.newaxis]) for part in parts]
        n_lines = contributions.shape[1]
        edges = np.linspace(0, n_lines, -(-n_lines // LINES) + 1).astype(int)
        tables = tuple(
            np.ascontiguousarray(np.concatenate([part[:, first:last] for part in scaled], axis=1))
            for first, last in itertools.pairwise(edges)
        )
        return NumpyLevelSum(active, tables, 20.0 * np.log10(2.0) * exponents.sum(axis=1))


NUMPY = NumpyKernel()
"""Plain numpy in double precision: the default kernel."""


def line_exponents(contributions: ComplexArray) -> npt.NDArray[np.int32]:
    """Return the power of two next to the nominal ``|p|`` of each line.

    Parameters
    ----------
    contributions : array, shape (n_vehicle, n_frequency, n_path)
        Pressure by path with all factors 1 [Pa]. A nominal notch counts as 60 dB below the line's
        largest contribution.

    Returns
    -------
    array of int, shape (n_vehicle, n_frequency)
    """
    nominal = np.abs(contributions.sum(axis=2))
    largest = np.abs(contributions).max(axis=2)
    return np.asarray(np.frexp(np.maximum(nominal, 1e-3 * largest))[1])


@cache
def _blas_libraries() -> list[LibController]:
    """Return what controls the threads of BLAS; to look for it takes milliseconds."""
    return list(ThreadpoolController().select(user_api="blas").lib_controllers)


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Hold BLAS to one thread for a while."""
    libraries = _blas_libraries()
    before = [library.get_num_threads() for library in libraries]
    for library in libraries:
        library.set_num_threads(1)
    try:
        yield
    finally:
        for library, n_threads in zip(libraries, before, strict=True):
            library.set_num_threads(n_threads)


def _aligned(n_rows: int, n_columns: int) -> RealArray:
    """Return an empty array that starts on a cache line, which is worth a tenth of the speed."""
    raw = np.empty(n_rows * n_columns + 8)
    start = -raw.ctypes.data % 64 // raw.itemsize
    return raw[start : start + n_rows * n_columns].reshape(n_rows, n_columns)


def _multiply_lines(pressure: RealArray, out: RealArray) -> None:
    """Write ``Π |p|²`` over every PRODUCTS-th line of the stacked `pressure`, and overwrite it.

    The processor itself reports when a square or a product on the way loses digits, by overflow or
    underflow; numpy turns that into a FloatingPointError, and `_log_of_product` is for that case.
    """
    n_lines = len(pressure) // 2
    square, imaginary = pressure[:n_lines], pressure[n_lines:]
    whole = n_lines - n_lines % PRODUCTS
    with np.errstate(over="raise", under="raise"):
        np.multiply(pressure, pressure, out=pressure)
        np.add(square, imaginary, out=square)
        np.multiply.reduce(square[:whole].reshape(-1, out.size), axis=0, out=out)
        if whole < n_lines:
            rest = square[whole:].reshape(-1)
            np.multiply(out[: rest.size], rest, out=out[: rest.size])


def _log_of_product(pressure: RealArray) -> RealArray:
    """Return the logarithms of the products of `_multiply_lines`, of any size.

    Powers of two are taken out before each step, so nothing overflows or underflows and the digits
    are those of the plain product. Hence a design that is here only because of a neighbour gets the
    same result, bit for bit, as without it.
    """
    real, imaginary = np.split(pressure, 2)
    shift = np.frexp(np.maximum(np.abs(real), np.abs(imaginary)))[1]
    square = np.square(np.ldexp(real, -shift)) + np.square(np.ldexp(imaginary, -shift))
    product, exponent = np.ones((PRODUCTS, ROWS)), np.zeros((PRODUCTS, ROWS), dtype=np.int64)
    for first in range(0, len(square), PRODUCTS):
        lines = slice(first, min(first + PRODUCTS, len(square)))
        grown = slice(0, lines.stop - first)
        product[grown], carry = np.frexp(product[grown] * square[lines])
        exponent[grown] += carry + 2 * shift[lines]
    double = np.finfo(np.float64)
    plain = (exponent > double.minexp) & (exponent <= double.maxexp)
    logarithm = np.log(np.ldexp(product, np.where(plain, exponent, 0)))
    return np.asarray(logarithm + np.where(plain, 0, exponent) * np.log(2.0)).ravel()
