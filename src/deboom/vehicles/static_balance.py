"""Static equilibrium of a rigid body on nonlinear springs, for many loads or designs at once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from deboom.arrays import RealArray

NEWTON_STEPS = 100
HALVINGS = 30
BALANCED = 1e-9
"""Unbalanced load at which the equilibrium counts as found, relative to the load [1]."""

Curve = Callable[[RealArray], RealArray]
"""From the deflection of every direction, shape (n, n_direction) [m], to a value of each."""


def balanced_deflection(
    load: RealArray, forward: RealArray, force: Curve, tangent: Curve
) -> RealArray:
    """Find the deflections at which springs carry a load.

    Parameters
    ----------
    load : array, shape (n, 6)
        One row per case [N, N m].
    forward : array, shape (n_direction, 6)
        Motion of the body → deflection of every direction.
    force : callable
        Force of every direction, increasing with its deflection [N].
    tangent : callable
        Its derivative, above 0 [N/m].

    Returns
    -------
    array, shape (n, n_direction)
        [m].

    Raises
    ------
    ArithmeticError
        No equilibrium found.

    Notes
    -----
    Newton's method on ``Vᵀ F(V q) = load`` for all rows at once, with the step halved until the
    unbalanced load shrinks. Every tangent is positive, so the equilibrium is unique. A row that has
    come to rest stays: it depends on its load alone, bit for bit.
    """
    # rotations in radians are small numbers: weigh their load by the size of the body
    length = float(np.sqrt(np.mean(np.sum(forward[:, 3:] ** 2, axis=1))))
    scale = np.array([1.0] * 3 + [1 / length] * 3)

    # row by row: a product of matrices would round a case by the cases beside it
    def moved(position: RealArray) -> RealArray:
        return np.asarray((forward @ position[..., np.newaxis])[..., 0])

    def unbalanced(position: RealArray) -> RealArray:
        carried = force(moved(position))[..., np.newaxis]
        return np.asarray(load - (forward.T @ carried)[..., 0])

    def size(residual: RealArray) -> RealArray:
        return np.asarray(np.linalg.norm(residual * scale, axis=1))

    position = np.zeros_like(load)
    residual = unbalanced(position)
    enough = BALANCED * (1.0 + size(load))
    for _ in range(NEWTON_STEPS):
        moving = size(residual) > enough
        if not moving.any():
            return moved(position)
        stiffness = forward.T @ (tangent(moved(position))[..., np.newaxis] * forward)
        step = np.linalg.solve(stiffness, residual[..., np.newaxis])[..., 0]
        share = np.where(moving, 1.0, 0.0)[:, np.newaxis]
        for _ in range(HALVINGS):
            tried = unbalanced(position + share * step)
            worse = size(tried) > (1 - 0.1 * share[:, 0]) * size(residual)
            worse &= moving & (size(tried) > enough)
            if not worse.any():
                break
            share[worse] /= 2
        position = position + share * step
        residual = unbalanced(position)
    raise ArithmeticError(f"no static equilibrium within {NEWTON_STEPS} Newton steps")
