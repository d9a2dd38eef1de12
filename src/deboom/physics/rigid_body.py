"""Kinematics of a rigid body, its mass and stiffness at a point, and its modes on springs.

Motions are stacked ``(x, y, z, rx, ry, rz)``, loads ``(fx, fy, fz, mx, my, mz)``. Everything that
is called a forward matrix maps the motion of the body to the motion of a point; its transpose maps
forces at the point to loads on the body.
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from deboom.arrays import ComplexArray, RealArray, RealOrComplexArray, checked
from deboom.errors import InputError

LARGEST_RESIDUAL = 0.1
"""Largest part of a body's motion that no rigid motion explains; beyond it, positions or channels
are wrong rather than noisy [1]."""
TOLERATED = 4.0
"""Standard deviations that an entry of a measured mass matrix may be off a rigid body [1]."""


def skew(vector: npt.ArrayLike) -> RealArray:
    """Return the matrix of the cross product, ``skew(r) @ b = r × b``, shape (..., 3, 3)."""
    values = np.asarray(vector, dtype=float)
    matrix = np.zeros((*values.shape, 3))
    for row, column, axis in ((2, 1, 0), (0, 2, 1), (1, 0, 2)):
        matrix[..., row, column] = values[..., axis]
        matrix[..., column, row] = -values[..., axis]
    return matrix


ROTATION_ORDERS = ("RzRyRx", "RzRxRy", "RyRzRx", "RyRxRz", "RxRzRy", "RxRyRz")
"""Orders of three rotations by angles (rx, ry, rz), as products of their matrices; the first is
deboom's. The rightmost turns first about fixed axes, the leftmost first about axes that turn along:
``RzRyRx`` is x, y, z about fixed axes, or yaw, pitch, roll; ``RxRyRz`` is x, y, z about axes that
turn along, the Cardan angles."""


def rotation_matrix(angles: npt.ArrayLike, order: str = ROTATION_ORDERS[0]) -> RealArray:
    """Return the rotation ``R = Rz Ry Rx``; its columns are the local axes in global components.

    Angles (rx, ry, rz) have shape (..., 3), about the fixed axes x, then y, then z [rad], the
    matrix (..., 3, 3). In this order the axial axes of all mounts of the thesis's table 10 meet the
    compressor's axis. Another `order` is one of `ROTATION_ORDERS`; InputError: it is none.
    """
    angles = np.asarray(angles, dtype=float)
    if order not in ROTATION_ORDERS:
        raise InputError(
            f"unknown order of rotations '{order}', use one of {', '.join(ROTATION_ORDERS)}"
        )
    if order != ROTATION_ORDERS[0]:
        alone = {
            f"R{axis}": rotation_matrix(angles * np.eye(3)[place])
            for place, axis in enumerate("xyz")
        }
        first, second, third = (alone[order[start : start + 2]] for start in (0, 2, 4))
        return np.asarray(first @ second @ third)
    (cx, cy, cz), (sx, sy, sz) = (np.moveaxis(f(angles), -1, 0) for f in (np.cos, np.sin))
    rows = [
        [cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx],
        [sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx],
        [-sy, cy * sx, cy * cx],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def rotation_angles(rotation: npt.ArrayLike, order: str = ROTATION_ORDERS[0]) -> RealArray:
    """Return angles (rx, ry, rz) of a rotation (3, 3), such that `rotation_matrix` makes it [rad].

    Where the middle turn is by ±90°, many angles make it: the rotation that turns last is 0 then.
    """
    # scipy names rotations about fixed axes in small letters, the first one first
    axes: Any = order.replace("R", "")[::-1]
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Gimbal lock")
        turns = Rotation.from_matrix(np.asarray(rotation, dtype=float)).as_euler(axes)
    return np.array([turns[axes.index(axis)] for axis in "xyz"])


def point_acceleration(
    position: npt.ArrayLike,
    acceleration: npt.ArrayLike,
    angular_acceleration: npt.ArrayLike,
    angular_velocity: npt.ArrayLike,
) -> RealArray:
    """Return the acceleration of a point of a rigid body, with the centripetal term [m/s²].

    Parameters
    ----------
    position : array, shape (..., 3) — point, from the reference point of the body [m]
    acceleration : array, shape (..., 3) — acceleration of the reference point [m/s²]
    angular_acceleration, angular_velocity : array, shape (..., 3) — rotation [rad/s², rad/s]

    Notes
    -----
    ``a_i = a_B + α × r + ω × (ω × r)``. Thesis, eq. 14-18, writes ω where the angular acceleration
    α is meant and leaves the last term out: for a harmonic rotation of amplitude φ it is φ times
    the second one, and it answers at twice the frequency. The linear rest is `forward_matrix`.
    """
    lever = np.asarray(position, dtype=float)
    omega = np.asarray(angular_velocity, dtype=float)
    alpha = np.asarray(angular_acceleration, dtype=float)
    reference = np.asarray(acceleration, dtype=float)
    return reference + np.cross(alpha, lever) + np.cross(omega, np.cross(omega, lever))


def forward_matrix(position: npt.ArrayLike) -> RealArray:
    """Return the forward matrix of a point [m], ``V = [I, skew(r)ᵀ]``, shape (3, 6) [1, m/rad].

    Thesis, eq. 19-21 and 28: a row block, printed there as a column stack. Exact for accelerations
    but for the centripetal term, and for displacements of small rotation.
    """
    return forward_matrices(np.reshape(position, (1, 3)))


def forward_matrices(
    positions: npt.ArrayLike, orientations: npt.ArrayLike | None = None
) -> RealArray:
    """Return the forward matrices of several points, one below the other, shape (..., 3 n, 6).

    Parameters
    ----------
    positions : array, shape (..., n, 3) — points, from the reference point of the body [m]
    orientations : array, shape (..., n, 3, 3), optional
        Rotation matrix of each sensor or mount, its local axes as columns; by default all are
        parallel to the body's axes.

    Notes
    -----
    ``V_i' = R_iᵀ [I, skew(r_i)ᵀ]``: thesis, eq. 22-26, which uses one symbol for all R_i and one
    for V_i and V_i'. The rank is 6 from three points that are not on one line; two points leave the
    rotation about the line through them undetermined, although V is then square.
    """
    positions = np.asarray(positions, dtype=float)
    if positions.ndim < 2 or positions.shape[-1] != 3:
        raise InputError(f"positions have shape (n, 3), not {positions.shape}")
    *rows, n_points, _ = positions.shape
    shape = (*positions.shape, 3)
    forward = np.concatenate([np.broadcast_to(np.eye(3), shape), -skew(positions)], axis=-1)
    if orientations is not None:
        rotations = np.asarray(orientations, dtype=float)
        if rotations.shape != shape:
            raise InputError(
                f"orientations of {n_points} points have shape {shape}, not {rotations.shape}"
            )
        forward = np.swapaxes(rotations, -1, -2) @ forward
    return forward.reshape(*rows, 3 * n_points, 6)


def shift_matrix(position: npt.ArrayLike) -> RealArray:
    """Return χ, which takes the motion of a body at point E [m] to its origin O, ``δ_O = χ δ_E``.

    Notes
    -----
    ``χ = [[I, skew(r)], [0, I]]``. From it follow all shifts of thesis, eq. 3-5: loads
    ``F_E = χᵀ F_O``, stiffness and mass ``K_E = χᵀ K_O χ``. Eq. 5 prints χ and χ⁻¹ in the place of
    χᵀ, which makes K_E asymmetric.
    """
    chi = np.eye(6)
    chi[:3, 3:] = skew(position)
    return chi


def shift_load(load: RealOrComplexArray, position: npt.ArrayLike) -> RealOrComplexArray:
    """Refer a load, shape (..., 6) [N, N m], from the origin to a point, ``F_E = χᵀ F_O``."""
    return load @ shift_matrix(position)


def shift_stiffness(stiffness: RealOrComplexArray, position: npt.ArrayLike) -> RealOrComplexArray:
    """Refer a stiffness or mass, shape (..., 6, 6), to a point [m], ``K_E = χᵀ K_O χ``."""
    chi = shift_matrix(position)
    return chi.T @ stiffness @ chi


def mount_stiffness_matrix(
    positions: npt.ArrayLike,
    stiffness: npt.ArrayLike,
    orientations: npt.ArrayLike | None = None,
) -> RealOrComplexArray:
    """Return the 6×6 stiffness of a body on mounts, ``K = Σ V_iᵀ diag(k_i) V_i``.

    Raises InputError: not three stiffnesses per mount.

    Parameters
    ----------
    positions : array, shape (..., n, 3) — mounts, from the reference point of the body [m]
    stiffness : array, shape (..., n, 3) or (..., 3 n)
        Stiffness of each mount along its three axes, real or complex [N/m]. Last axes of (n, 3) are
        always read as the first form.
    orientations : array, shape (..., n, 3, 3), optional
        Rotation matrix of each mount; by default the mounts' axes are those of the body.

    Returns
    -------
    array, shape (..., 6, 6) — at the reference point, symmetric [N/m, N/rad, N m/rad]

    Notes
    -----
    Thesis, eq. 2 (whose lower left block is the transpose of the upper right one) and 44. Mounts
    have no rotational stiffness of their own.
    """
    forward = forward_matrices(positions, orientations)
    n_mounts = forward.shape[-2] // 3
    values = np.asarray(stiffness)
    if values.shape[-2:] == (n_mounts, 3):
        values = values.reshape(*values.shape[:-2], 3 * n_mounts)
    if values.ndim == 0 or values.shape[-1] != 3 * n_mounts:
        raise InputError(
            f"{n_mounts} mounts need stiffnesses of shape (..., {n_mounts}, 3) or "
            f"(..., {3 * n_mounts}), not {values.shape}"
        )
    weighted = values[..., :, np.newaxis] * forward
    matrix: RealOrComplexArray = np.swapaxes(forward, -1, -2) @ weighted
    return matrix


def mass_matrix(
    mass: float, inertia: npt.ArrayLike, centre: npt.ArrayLike = (0.0, 0.0, 0.0)
) -> RealArray:
    """Return the 6×6 mass matrix of a rigid body at its reference point [kg, kg m, kg m²].

    Mass [kg]; inertia (3, 3) about the centre of gravity [kg m²]; centre of gravity, from the
    reference point [m]. Thesis, eq. 39-41, with the moment ``r × F``.
    """
    at_centre = np.zeros((6, 6))
    at_centre[:3, :3] = mass * np.eye(3)
    at_centre[3:, 3:] = inertia
    # the reference point lies at -centre, seen from the centre of gravity
    return np.asarray(shift_stiffness(at_centre, -np.asarray(centre, dtype=float)), dtype=float)


@checked(centre="3 ?", inertia="3 3 ?")
class RigidBody:
    """Mass properties of a rigid body.

    - `mass` [kg].
    - `centre` (3,): centre of gravity, from the reference point [m].
    - `inertia` (3, 3): inertia about the centre of gravity, products as the matrix entries [kg m²].
    """

    mass: float
    centre: RealArray
    inertia: RealArray


def mass_properties(
    matrix: npt.ArrayLike, tolerance: float = 1e-6, deviation: npt.ArrayLike | None = None
) -> RigidBody:
    """Read mass, centre of gravity and inertia from a mass matrix, the inverse of `mass_matrix`.

    They are those of its symmetric part. Raises InputError: not positive definite, or further from
    a rigid body than `tolerance`, or than `TOLERATED` deviations where these are given.

    Parameters
    ----------
    matrix : array, shape (6, 6) — mass matrix at any reference point [kg, kg m, kg m²]
    tolerance : float
        Largest deviation from the mass matrix of a rigid body, relative to its mass, with lengths
        divided by the radius of gyration [1].
    deviation : array, shape (6, 6), optional
        Standard deviation of each entry of a measured matrix, in place of the tolerance [kg, kg m,
        kg m²].
    """
    matrix = np.asarray(matrix, dtype=float)
    if matrix.shape != (6, 6):
        raise InputError(f"a mass matrix has shape (6, 6), not {matrix.shape}")
    symmetric = (matrix + matrix.T) / 2
    if not np.all(np.linalg.eigvalsh(symmetric) > 0):
        raise InputError("the mass matrix is not positive definite, so it is not that of a body")
    mass = float(np.trace(symmetric[:3, :3])) / 3
    # the coupling block is mass · skew(centre), and Σ e_i × skew(c) e_i = 2 c
    centre = np.cross(np.eye(3), symmetric[3:, :3].T).sum(axis=0) / (2 * mass)
    inertia = symmetric[3:, 3:] - mass * skew(centre) @ skew(centre).T
    unit = np.repeat([1.0, np.sqrt(np.trace(symmetric[3:, 3:]) / (3 * mass))], 3)
    rest = np.abs(matrix - mass_matrix(mass, inertia, centre))
    if deviation is not None:
        worst, tolerance = float(np.max(rest / np.asarray(deviation))), TOLERATED
        size = f"{worst:.1f} standard deviations of an entry"
    else:
        worst = float(np.max(rest / np.outer(unit, unit))) / mass
        size = f"{worst:.2g} of its mass"
    if worst > tolerance:
        raise InputError(
            f"the mass matrix deviates by {size} from that of a rigid body, "
            f"more than the tolerance of {tolerance:.2g}"
        )
    return RigidBody(mass, centre, inertia)


def characteristic_length(mass: float, inertia: npt.ArrayLike) -> float:
    """Return the radius of gyration ``√(tr J / 3 m)`` [m], which makes rotations comparable."""
    return float(np.sqrt(np.trace(np.asarray(inertia, dtype=float)) / (3 * mass)))


def not_rigid(forward: RealArray, motion: ComplexArray) -> float:
    """Return the part of a body's measured motion (f, s) that no rigid motion explains [1].

    - `forward` (s, q): motion of the body → channels.
    """
    fit = np.linalg.lstsq(forward, motion.T, rcond=None)[0].T
    left = np.linalg.norm(motion - fit @ forward.T)
    return float(left / max(np.linalg.norm(motion), np.finfo(float).tiny))


def box_density(mass: float, inertia: npt.ArrayLike) -> float:
    """Return the density [kg/m³] of the box that has this mass and these principal moments.

    A side a of a box with principal moments J has ``a² = 6 (J_b + J_c − J_a) / m``. Infinite where
    no box has them.
    """
    moments = np.linalg.eigvalsh(np.asarray(inertia, dtype=float))
    squares = 6.0 * (moments.sum() - 2.0 * moments) / mass
    if np.any(squares <= 0.0):
        return float("inf")
    return float(mass / np.sqrt(np.prod(squares)))


def rigid_body_modes(
    mass_matrix: npt.ArrayLike, stiffness: npt.ArrayLike
) -> tuple[RealArray, RealArray]:
    """Return the undamped modes of a body on springs.

    Raises InputError: complex stiffness, asymmetric matrices, a mass matrix that is not positive
    definite, or a stiffness with a negative direction.

    Parameters
    ----------
    mass_matrix : array, shape (n, n) — symmetric, positive definite [kg, kg m, kg m²]
    stiffness : array, shape (..., n, n)
        Real, symmetric stiffness at the same point [N/m, N/rad, N m/rad]; pass the real part of a
        complex one.

    Returns
    -------
    frequency : array, shape (..., n) — increasing [Hz]; 0 for a free direction
    shapes : array, shape (..., n, n)
        One mode per column, ``Ψᵀ M Ψ = I``; the entry that moves most, weighted by the square root
        of its mass or inertia, is positive.
    """
    mass, springs = np.asarray(mass_matrix), np.asarray(stiffness)
    if np.iscomplexobj(mass) or np.iscomplexobj(springs):
        raise InputError("undamped modes need real matrices: pass the real part of the stiffness")
    for matrix, name in ((mass, "mass matrix"), (springs, "stiffness")):
        asymmetry = np.abs(matrix - np.swapaxes(matrix, -1, -2))
        if np.max(asymmetry) > 1e-9 * np.max(np.abs(matrix)):
            raise InputError(f"the {name} is not symmetric")
    try:
        factor = np.linalg.cholesky(mass)
    except np.linalg.LinAlgError:
        raise InputError("the mass matrix is not positive definite") from None
    half_solved = np.linalg.solve(factor, springs)
    whitened = np.linalg.solve(factor, np.swapaxes(half_solved, -1, -2))
    squared, vectors = np.linalg.eigh((whitened + np.swapaxes(whitened, -1, -2)) / 2)
    # rounding may leave a free direction slightly negative; more than that is an unstable body
    if np.any(squared < -1e-9 * np.abs(squared).max(axis=-1, keepdims=True)):
        raise InputError("the stiffness has a negative direction, so the body is not stable on it")
    shapes = np.linalg.solve(factor.T, vectors)
    weighted = np.sqrt(np.diag(mass))[:, np.newaxis] * np.abs(shapes)
    moves_most = np.take_along_axis(shapes, weighted.argmax(axis=-2, keepdims=True), axis=-2)
    return np.sqrt(np.maximum(squared, 0.0)) / (2 * np.pi), shapes * np.sign(moves_most)
