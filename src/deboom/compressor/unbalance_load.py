"""What an unbalanced rotor does to the body around it."""

from __future__ import annotations

from enum import Enum

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray
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
