"""Forces of the mounts on the body: stiffness times what both of their sides move apart."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.measurement.inertance_test import CompressorMount
from deboom.physics.rigid_body import forward_matrices

AXES = 3
"""Directions in which a mount pushes: it has no rotational stiffness of its own."""


def stiffness_of_mounts(mounts: Sequence[CompressorMount]) -> RealArray:
    """Return the stiffness of each mount in fixed axes, where the gain is 1.

    Parameters
    ----------
    mounts : sequence of CompressorMount

    Returns
    -------
    array, shape (n, 3, 3)
        ``R diag(k) Rᵀ`` [N/m].
    """
    turn = np.array([mount.orientation for mount in mounts])
    along = np.array([mount.stiffness for mount in mounts])[:, np.newaxis, :]
    return np.asarray((turn * along) @ np.swapaxes(turn, 1, 2))


def motion_at_mounts(
    mounts: Sequence[CompressorMount], displacement: npt.ArrayLike
) -> ComplexArray:
    """Return how the compressor moves at each of its mounts.

    Parameters
    ----------
    mounts : sequence of CompressorMount
    displacement : array, shape (n_frequency, 6)
        Of the virtual point [m, rad].

    Returns
    -------
    array, shape (n_frequency, 3 n)
        x, y, z of each mount [m].
    """
    rows = forward_matrices(np.array([mount.position for mount in mounts]))
    return np.asarray(np.asarray(displacement, dtype=complex) @ rows.T)


def mount_forces(
    mounts: Sequence[CompressorMount], factor: npt.ArrayLike, travel: npt.ArrayLike
) -> ComplexArray:
    """Return the force of each mount on the body.

    Parameters
    ----------
    mounts : sequence of CompressorMount
    factor : complex array, shape (n_frequency,)
        Gain, and what the mounts have changed since it was found [1].
    travel : array, shape (n_frequency, 3 n)
        Motion of the compressor minus motion of the body, x, y, z of each mount [m].

    Returns
    -------
    array, shape (n_frequency, 3 n)
        Complex peak [N].

    Notes
    -----
    ``F_i = v(f) K_i (T_i x − y_i)``: thesis, section 4.5.1, with the body's motion y that the
    thesis leaves out.
    """
    apart = np.asarray(travel, dtype=complex)
    by_mount = apart.reshape(len(apart), len(mounts), AXES)
    forces = np.einsum("iab,fib->fia", stiffness_of_mounts(mounts), by_mount)
    scale = np.asarray(factor, dtype=complex)[:, np.newaxis]
    return np.asarray(scale * forces.reshape(apart.shape))


def load_at_virtual_point(mounts: Sequence[CompressorMount], forces: npt.ArrayLike) -> ComplexArray:
    """Refer forces at the mounts to the virtual point.

    Parameters
    ----------
    mounts : sequence of CompressorMount
    forces : array, shape (n_frequency, 3 n)
        [N].

    Returns
    -------
    array, shape (n_frequency, 6)
        [N, N m].
    """
    rows = forward_matrices(np.array([mount.position for mount in mounts]))
    return np.asarray(np.asarray(forces, dtype=complex) @ rows)
