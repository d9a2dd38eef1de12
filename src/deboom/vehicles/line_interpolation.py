"""Interpolation over the lines in ``u = 1/ω²``, from those next to Chebyshev points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment

from deboom.arrays import RealArray


@dataclass(frozen=True, eq=False)
class LineInterpolation:
    """From values at a few lines to values at all.

    Parameters
    ----------
    nodes : array of int, shape (n_node,)
        The few lines, in order.
    weights : array, shape (n_frequency, n_node)
        Lagrange's polynomials of the nodes at all lines [1].
    """

    nodes: npt.NDArray[np.intp]
    weights: RealArray

    def roughness(self, values: npt.ArrayLike) -> RealArray:
        """Return how far values are from their own interpolation.

        Parameters
        ----------
        values : array, shape (n_frequency, n)
            Real or complex.

        Returns
        -------
        array, shape (n_frequency, n)
            Relative to the root mean square of each column [1].
        """
        columns = np.asarray(values)
        scale = np.sqrt(np.mean(np.abs(columns) ** 2, axis=0))
        distance = np.abs(columns - self.weights @ columns[self.nodes])
        return np.asarray(distance / np.where(scale > 0.0, scale, 1.0))


def interpolation_over_lines(frequency: RealArray, n_nodes: int) -> LineInterpolation:
    """Choose lines next to Chebyshev points of the second kind, and interpolate between them.

    Parameters
    ----------
    frequency : array, shape (n_frequency,)
        Lines, rising; at least `n_nodes` [Hz].
    n_nodes : int
        At least 2.

    Notes
    -----
    Measured lines serve as nodes, so that the data themselves need no interpolation. Near the lower
    end Chebyshev points may lie closer than lines do; every point gets a line of its own.
    """
    u = 1.0 / frequency**2
    place = (u - u[-1]) / (u[0] - u[-1])
    wanted = 0.5 + 0.5 * np.cos(np.pi * np.arange(n_nodes) / (n_nodes - 1))
    lines = linear_sum_assignment(np.abs(wanted[:, np.newaxis] - place))[1]
    nodes = np.sort(lines)
    weights = np.empty((u.size, n_nodes))
    for k, own in enumerate(place[nodes]):
        others = np.delete(place[nodes], k)
        weights[:, k] = np.prod((place[:, np.newaxis] - others) / (own - others), axis=1)
    return LineInterpolation(nodes, weights)
