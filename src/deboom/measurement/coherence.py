"""Numbers between 0 and 1 that say how much two measurements of the same thing have in common."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.errors import InputError

CHANCE = 0.5
"""Mean of `likeness` for two numbers that have nothing to do with each other."""


def likeness(first: npt.ArrayLike, second: npt.ArrayLike, axis: int | None = None) -> RealArray:
    """Coherence criterion of two complex quantities that should be equal.

    Parameters
    ----------
    first, second : array
        Of one shape.
    axis : int, optional
        Axis over which energies are summed; by default each number stands for itself.

    Returns
    -------
    array
        1 if equal, 0 if opposite, 0.5 if one of them is zero and on average 0.5 if they are
        unrelated [1]; 1 where both are zero.

    Raises
    ------
    InputError
        Shapes that differ.

    Notes
    -----
    ``|a + b|² / 2 (|a|² + |b|²)``: van der Seijs's coherence of two responses, the number that
    pyFBS averages over lines for reciprocity and specific consistency. Equal amplitudes 60° apart
    give 0.75, so does a factor of 3.7 in phase.
    """
    a, b = np.asarray(first, dtype=complex), np.asarray(second, dtype=complex)
    if a.shape != b.shape:
        raise InputError(f"shapes {a.shape} and {b.shape} differ")
    together, apart = np.abs(a + b) ** 2, np.abs(a) ** 2 + np.abs(b) ** 2
    if axis is not None:
        together, apart = together.sum(axis=axis), apart.sum(axis=axis)
    silent = apart == 0
    return np.asarray(np.where(silent, 1.0, together / np.where(silent, 1.0, 2.0 * apart)))


def repeat_coherence(repeats: Sequence[npt.ArrayLike]) -> RealArray:
    """How well repeats of one measurement agree.

    Parameters
    ----------
    repeats : sequence of array, shape (...)
        At least two; complex, of one shape.

    Returns
    -------
    array, shape (...)
        1 if all are equal; on average 1/n for n repeats of nothing but noise [1].

    Raises
    ------
    InputError
        Fewer than two repeats, or shapes that differ.

    Notes
    -----
    ``|Σ x|² / n Σ |x|²``: the coherence between a constant excitation and the response.
    """
    arrays = [np.asarray(repeat, dtype=complex) for repeat in repeats]
    if len(arrays) < 2:
        raise InputError("repeatability needs at least two repeats of the measurement")
    shapes = sorted({array.shape for array in arrays})
    if len(shapes) > 1:
        raise InputError(f"repeats of one measurement have one shape, not {shapes}")
    stacked = np.stack(arrays)
    energy = len(arrays) * np.sum(np.abs(stacked) ** 2, axis=0)
    common = np.abs(stacked.sum(axis=0)) ** 2
    silent = energy == 0
    return np.asarray(np.where(silent, 1.0, common / np.where(silent, 1.0, energy)))
