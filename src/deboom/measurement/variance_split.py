"""How much of a spread is between vehicles, between states of one vehicle, and in the repeat."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.errors import InputError

LEVELS = ("vehicle", "state", "repeat")


@dataclass(frozen=True, eq=False)
class VarianceSplit:
    """Components of variance of a balanced nested design, level by level from the outside.

    Parameters
    ----------
    levels : tuple of str
        Such as ``vehicle``, ``state``, ``repeat``.
    degrees_of_freedom : tuple of int
        Per level.
    mean_square : array, shape (n_level, ...)
        Between the means of each level, inside the one above [unit²].
    estimate : array, shape (n_level, ...)
        Unbiased components; one that is truly small may come out below 0 [unit²].
    standard_error : array, shape (n_level, ...)
        Of the estimates, for normal effects [unit²].
    """

    levels: tuple[str, ...]
    degrees_of_freedom: tuple[int, ...]
    mean_square: RealArray
    estimate: RealArray
    standard_error: RealArray

    def __post_init__(self) -> None:
        for name in ("mean_square", "estimate", "standard_error"):
            array = np.array(getattr(self, name), dtype=float)
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @property
    def variance(self) -> RealArray:
        """Components, not below 0, shape (n_level, ...) [unit²]."""
        return np.maximum(self.estimate, 0.0)

    @property
    def share(self) -> RealArray:
        """Share of each level in the sum of the components, shape (n_level, ...) [1]."""
        total = self.variance.sum(axis=0)
        return np.asarray(self.variance / np.where(total > 0, total, 1.0))


def variance_split(values: npt.ArrayLike, levels: tuple[str, ...] = LEVELS) -> VarianceSplit:
    """Split the variance of measurements that are repeated inside groups inside groups.

    Parameters
    ----------
    values : array_like, shape (n_vehicle, n_state, n_repeat, ...)
        One leading axis per level, the outermost first; at least two of each. Levels [dB], or
        complex values, whose variance is that of real and imaginary part together.
    levels : tuple of str
        Names of the leading axes.

    Returns
    -------
    VarianceSplit

    Raises
    ------
    InputError
        Fewer than two of a level, values that are not finite.

    Notes
    -----
    Random effects, ``y = µ + v_i + s_ij + e_ijk``, balanced nested analysis of variance (Searle,
    Casella and McCulloch 1992, ch. 3). With the mean squares MS between the means of a level, times
    the number of values below it::

        E MS_level = Σ_(levels from it downwards) n_below σ²
        σ²_level = (MS_level - MS_next)/n_below,  var MS = 2 MS²/df

    and ``MS²/df`` for circular complex effects. Mind the few vehicles: with five of them the
    component between vehicles is known to about 70 %.
    """
    data = np.asarray(values)
    n_level = len(levels)
    if n_level < 1 or data.ndim < n_level or min(data.shape[:n_level]) < 2:
        raise InputError(
            f"a variance split needs at least two of each of {', '.join(levels)}; there are "
            f"{' x '.join(map(str, data.shape[:n_level]))}"
        )
    if not np.all(np.isfinite(data)):
        raise InputError("a variance split needs finite values: leave out what was not measured")
    means = [data]
    for axis in reversed(range(n_level)):
        means.insert(0, means[0].mean(axis=axis))
    squares, freedoms = [], []
    for level in range(n_level):
        deviation = means[level + 1] - np.expand_dims(means[level], level)
        n_below = int(np.prod(data.shape[level + 1 : n_level]))
        freedom = int(np.prod(data.shape[:level])) * (data.shape[level] - 1)
        summed = np.sum(np.abs(deviation) ** 2, axis=tuple(range(level + 1)))
        squares.append(n_below * summed / freedom)
        freedoms.append(freedom)
    mean_square = np.array(squares)
    of_square = (1 if np.iscomplexobj(data) else 2) * mean_square**2
    of_square = of_square / np.reshape(freedoms, (-1,) + (1,) * (mean_square.ndim - 1))
    estimate, error = mean_square.copy(), np.sqrt(of_square)
    for level in range(n_level - 1):
        n_below = int(np.prod(data.shape[level + 1 : n_level]))
        estimate[level] = (mean_square[level] - mean_square[level + 1]) / n_below
        error[level] = np.sqrt(of_square[level] + of_square[level + 1]) / n_below
    return VarianceSplit(tuple(levels), tuple(freedoms), mean_square, estimate, error)
