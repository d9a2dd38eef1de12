"""The hot loop in plain numpy: the sum of the levels over the lines, for many designs.

What a robust search spends its time on is ``Σ_f 20 lg |Σ_k x_k C_fk|``, for every vehicle and every
design with every draw of its manufacturing scatter. Four things make it fast:

- the designs are real, so real and imaginary parts are two real matrix products, stacked into one;
- one block of lines times one block of designs stays in the processor's second-level cache;
- a sum of logarithms is the logarithm of a product: each line is scaled to about 1, and one
  logarithm serves up to 64 lines;
- BLAS is held to one thread: the matrices are too small for more, and the processes of a parallel
  search would take each other's cores.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from threadpoolctl import ThreadpoolController

from deboom.physics.arrays import ComplexArray, RealArray

ROWS = 128
"""Designs per matrix product. Constant, with padding: BLAS takes other instructions for other
shapes, and the result of a design must not depend on the designs it comes with."""

LINES = 256
"""Lines per matrix product at most: 2 × 256 × 128 numbers are half a mebibyte."""

PRODUCTS = 4
"""Products that grow side by side, of every fourth line each: long rows keep numpy's loops busy."""



@dataclass(frozen=True, eq=False)
class NumpyLevelSum:
    """Sums of levels over the lines of one set of contributions; made by ``NUMPY.prepare``.

    Parameters
    ----------
    tables : tuple of array, shape (n_vehicle, 2 n_lines, n_variable)
        For each block of lines the real parts, then the imaginary parts, of the scaled
        contributions [1].
    scale_level : array, shape (n_vehicle,)
        What the scaling took out of the sums [dB re 1 Pa].
    """

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
            [dB re 1 Pa]. A design that silences a line completely has minus infinity there.
        """
        level = np.empty((len(designs), self.scale_level.size))
        work = _aligned((max(table.shape[1] for table in self.tables), ROWS))
        # some BLAS raise floating-point flags that mean nothing
        with _blas().limit(limits=1, user_api="blas"), np.errstate(all="ignore"):
            for start in range(0, len(designs), ROWS):
                rows = designs[start : start + ROWS]
                level[start : start + ROWS] = self._block(rows, work)[:, : len(rows)].T
        return level

    def _block(self, rows: RealArray, work: RealArray) -> RealArray:
        """Return the sums of at most ROWS designs, shape (n_vehicle, ROWS)."""
        columns = np.empty((rows.shape[1], ROWS))
        columns[:, : len(rows)] = rows.T
        columns[:, len(rows) :] = rows[:1].T
        n_vehicle = self.scale_level.size
        products = np.empty((len(self.tables), n_vehicle, PRODUCTS * ROWS))
        exponents = np.zeros_like(products)
        for table, product, exponent in zip(self.tables, products, exponents, strict=True):
            _multiply_lines(table, columns, work[: table.shape[1]], product, exponent)
        neper = np.log(products)
        neper += np.log(2.0) * exponents
        total = neper.reshape(len(self.tables), n_vehicle, PRODUCTS, ROWS).sum(axis=(0, 2))
        return 10.0 / np.log(10.0) * total + self.scale_level[:, np.newaxis]


@dataclass(frozen=True)
class NumpyKernel:
    """The kernel of this module; see `deboom.vehicles.booming_index.LevelSumKernel`."""

    name: str = "numpy"

    def prepare(self, contributions: ComplexArray) -> NumpyLevelSum:
        """Scale the contributions and lay them out for the matrix products.

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
        Each line is divided by the power of two next to its nominal ``|p|`` (all factors 1), which
        rounds nothing. A nominal notch counts as 60 dB below the line's largest contribution.
        """
        nominal = np.abs(contributions.sum(axis=2))
        largest = np.abs(contributions).max(axis=2)
        exponents = np.frexp(np.maximum(nominal, 1e-3 * largest))[1]
        real, imaginary = (
            np.ldexp(part, -exponents[:, :, np.newaxis])
            for part in (contributions.real, contributions.imag)
        )
        n_lines = contributions.shape[1]
        edges = np.linspace(0, n_lines, -(-n_lines // LINES) + 1).astype(int)
        tables = tuple(
            np.concatenate([real[:, first:last], imaginary[:, first:last]], axis=1)
            for first, last in zip(edges[:-1], edges[1:], strict=True)
        )
        return NumpyLevelSum(tables, 20.0 * np.log10(2.0) * exponents.sum(axis=1))


NUMPY = NumpyKernel()
"""The default kernel: plain numpy, double precision."""


@cache
def _blas() -> ThreadpoolController:
    """Return the controller of the BLAS threads; to find the libraries takes milliseconds."""
    return ThreadpoolController()


def _aligned(shape: tuple[int, int]) -> RealArray:
    """Return an empty array that starts on a cache line; numpy's own cost a tenth of the speed."""
    size = shape[0] * shape[1]
    raw = np.empty(size + 8)
    start = -raw.ctypes.data % 64 // 8
    return raw[start : start + size].reshape(shape)


def _multiply_lines(
    table: RealArray,
    columns: RealArray,
    pressure: RealArray,
    products: RealArray,
    exponents: RealArray,
) -> None:
    """Write ``Π |p|²`` over every PRODUCTS-th line, for each vehicle, as product · 2^exponent."""
    n_lines = len(pressure) // 2
    square, imaginary = pressure[:n_lines], pressure[n_lines:]
    whole = n_lines - n_lines % PRODUCTS
    side_by_side = square[:whole].reshape(-1, PRODUCTS * ROWS)
    rest = square[whole:].reshape(-1)
    for vehicle, product in enumerate(products):
        np.matmul(table[vehicle], columns, out=pressure)
        try:
            # the processor itself reports when a square or a product loses digits
            with np.errstate(over="raise", under="raise", invalid="raise"):
                np.multiply(pressure, pressure, out=pressure)
                np.add(square, imaginary, out=square)
                np.multiply.reduce(side_by_side, axis=0, out=product)
                np.multiply(product[: rest.size], rest, out=product[: rest.size])
        except FloatingPointError:
            np.matmul(table[vehicle], columns, out=pressure)
            products[vehicle], exponents[vehicle] = _safe_products(pressure)


def _safe_products(pressure: RealArray) -> tuple[RealArray, RealArray]:
    """Return the products of `_multiply_lines` as ``product · 2^exponent``, whatever their size.

    Powers of two are taken out before every step, so that nothing overflows or underflows; the
    digits are those of the plain product. Hence a design whose product is safe has the same result
    here, where a neighbour brought it, as in `_multiply_lines`.
    """
    if True:
        real, imaginary = np.split(pressure, 2)
        shift = np.frexp(np.maximum(np.abs(real), np.abs(imaginary)))[1]
        square = np.square(np.ldexp(real, -shift)) + np.square(np.ldexp(imaginary, -shift))
        n_lines = len(square)
        product, exponent = np.ones((PRODUCTS, ROWS)), np.zeros((PRODUCTS, ROWS), dtype=int)
        for first in range(0, n_lines, PRODUCTS):
            part = slice(0, min(PRODUCTS, n_lines - first))
            lines = slice(first, first + PRODUCTS)
            product[part], carry = np.frexp(product[part] * square[lines])
            exponent[part] += carry + 2 * shift[lines]
        plain = (exponent > np.finfo(float).minexp) & (exponent <= np.finfo(float).maxexp)
        product = np.ldexp(product, np.where(plain, exponent, 0))
        return product.ravel(), np.where(plain, 0, exponent).ravel()
