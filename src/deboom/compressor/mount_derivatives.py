"""How the stiffness at the virtual point answers a mount that is moved, turned or stiffened."""

from __future__ import annotations

import numpy as np

from deboom.arrays import RealArray
from deboom.measurement.inertance_test import CompressorMount
from deboom.physics.rigid_body import forward_matrix, rotation_matrix, skew

_UNIT_VECTORS = np.eye(3)


def mount_stiffness_derivatives(mount: CompressorMount) -> RealArray:
    """Differentiate the 6×6 stiffness that one mount adds at the virtual point.

    Parameters
    ----------
    mount : CompressorMount

    Returns
    -------
    array, shape (9, 6, 6)
        With respect to position [1/m], rotation [1/rad] and stiffness [m/N], three each.
    """
    turn, forward = mount.orientation, forward_matrix(mount.position)
    in_vehicle = turn @ np.diag(mount.stiffness) @ turn.T
    derivatives = np.empty((9, 6, 6))
    for axis in range(3):
        moved = np.hstack([np.zeros((3, 3)), skew(_UNIT_VECTORS[axis]).T])
        derivatives[axis] = plus_transpose(forward.T @ in_vehicle @ moved)
        turned = rotation_derivative(mount.rotation, axis)
        half = turned @ np.diag(mount.stiffness) @ turn.T
        derivatives[3 + axis] = plus_transpose(forward.T @ half @ forward)
        row = turn[:, axis] @ forward
        derivatives[6 + axis] = np.outer(row, row)
    return derivatives


def plus_transpose(matrix: RealArray) -> RealArray:
    """Add the transpose: the derivative of ``A B Aᵀ`` out of its first half, shape (n, n)."""
    return np.asarray(matrix + matrix.T)


def rotation_derivative(angles: RealArray, axis: int) -> RealArray:
    """Differentiate ``R = Rz Ry Rx`` with respect to one of its angles.

    Parameters
    ----------
    angles : array, shape (3,)
        About the fixed axes x, then y, then z [rad].
    axis : int
        0, 1 or 2: which angle.

    Returns
    -------
    array, shape (3, 3)
        [1/rad].
    """
    before, after = angles.copy(), angles.copy()
    before[axis:] = 0.0
    after[:axis] = 0.0
    return np.asarray(rotation_matrix(after) @ skew(_UNIT_VECTORS[axis]) @ rotation_matrix(before))
