"""The points at which forces and rotations of a mount or a suspended body couple least."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg import solve_triangular

from deboom.arrays import ComplexArray, RealArray, RealOrComplexArray
from deboom.errors import InputError
from deboom.physics.rigid_body import shift_stiffness


@dataclass(frozen=True, eq=False)
class ElasticCentre:
    """A centre of a 6×6 stiffness, and how well it decouples there.

    Parameters
    ----------
    position : array, shape (3,)
        From the point at which the stiffness was given [m].
    stiffness : array, shape (6, 6)
        At the centre [N/m, N/rad, N m/rad].
    coupling : float
        Between translations and rotations at the centre, 0 (a force gives a pure translation, a
        moment a pure rotation) to 1 [1]; see `residual_coupling`.
    """

    position: RealArray
    stiffness: RealArray
    coupling: float

    def __post_init__(self) -> None:
        for name in ("position", "stiffness"):
            copy = np.array(getattr(self, name), dtype=float)
            copy.setflags(write=False)
            object.__setattr__(self, name, copy)


def residual_coupling(stiffness: npt.ArrayLike) -> float:
    """How much translations and rotations are coupled by a 6×6 stiffness.

    Parameters
    ----------
    stiffness : array, shape (6, 6)
        Real, symmetric and positive definite [N/m, N/rad, N m/rad].

    Returns
    -------
    float
        0 (none) to 1 [1].

    Raises
    ------
    InputError
        Complex, asymmetric or not positive definite.

    Notes
    -----
    The largest ``|tᵀ K_xθ φ|`` over all translations t and rotations φ of unit energy,
    ``tᵀ K_xx t = φᵀ K_θθ φ = 1``. It depends on the point, neither on the unit of length nor on the
    directions of the axes.
    """
    matrix = _checked(stiffness)
    translation = np.linalg.cholesky(matrix[:3, :3])
    rotation = np.linalg.cholesky(matrix[3:, 3:])
    half = solve_triangular(translation, matrix[:3, 3:], lower=True)
    normalised = solve_triangular(rotation, half.T, lower=True)
    return float(np.linalg.norm(normalised, 2))


def centre_of_stiffness(stiffness: npt.ArrayLike) -> ElasticCentre:
    """Point at which the coupling block of the stiffness is symmetric.

    Parameters
    ----------
    stiffness : array, shape (6, 6)
        Real, symmetric and positive definite [N/m, N/rad, N m/rad].

    Returns
    -------
    ElasticCentre

    Raises
    ------
    InputError
        Complex, asymmetric or not positive definite.

    Notes
    -----
    ``K_xθ + K_xx skew(r)`` is symmetric for ``r = −(tr(K_xx) I − K_xx)⁻¹ axial(K_xθ − K_xθᵀ)``.
    Where one shift makes the coupling vanish, this is that point. In general none does: a stiffness
    has 21 entries against the 6 freedoms of a shift and a rotation, and the thesis's "completely
    diagonalized" (section 2.3.2) holds for some arrangements of mounts only.

    References
    ----------
    Ciblak and Lipkin, "Centers of stiffness, compliance, and elasticity in the analysis of robotic
    systems", ASME Design Technical Conferences, 1994.
    """
    matrix = _checked(stiffness)
    translation, coupling = matrix[:3, :3], matrix[:3, 3:]
    position = -np.linalg.solve(_lever(translation), _axial(coupling))
    return _centre_at(matrix, np.asarray(position, dtype=float))


def centre_of_compliance(stiffness: npt.ArrayLike) -> ElasticCentre:
    """Point at which the coupling block of the compliance is symmetric.

    Parameters
    ----------
    stiffness : array, shape (6, 6)
        Real, symmetric and positive definite [N/m, N/rad, N m/rad].

    Returns
    -------
    ElasticCentre

    Raises
    ------
    InputError
        Complex, asymmetric or not positive definite.

    Notes
    -----
    With ``C = K⁻¹``, ``C_xθ − skew(r) C_θθ`` is symmetric for
    ``r = (tr(C_θθ) I − C_θθ)⁻¹ axial(C_xθ − C_xθᵀ)``. It is the centre of stiffness where the
    coupling vanishes, and another point where it does not.

    References
    ----------
    Ciblak and Lipkin, see `centre_of_stiffness`.
    """
    matrix = _checked(stiffness)
    compliance = np.asarray(np.linalg.inv(matrix), dtype=float)
    rotation, coupling = compliance[3:, 3:], compliance[:3, 3:]
    position = np.linalg.solve(_lever(rotation), _axial(coupling))
    return _centre_at(matrix, np.asarray(position, dtype=float))


@dataclass(frozen=True, eq=False)
class DynamicElasticCentre:
    """A centre of a dynamic stiffness at every line.

    Parameters
    ----------
    position : array, shape (n_frequency, 3)
        From the point at which the stiffness was given [m].
    stiffness : array, shape (n_frequency, 6, 6)
        At the centre of its line, complex [N/m, N/rad, N m/rad].
    coupling : array, shape (n_frequency,)
        Between translations and rotations there [1]; see `dynamic_coupling`.
    """

    position: RealArray
    stiffness: ComplexArray
    coupling: RealArray

    def __post_init__(self) -> None:
        for name in ("position", "stiffness", "coupling"):
            copy = np.array(getattr(self, name))
            copy.setflags(write=False)
            object.__setattr__(self, name, copy)


def dynamic_coupling(stiffness: npt.ArrayLike) -> RealArray:
    """How much translations and rotations are coupled by dynamic stiffnesses.

    Parameters
    ----------
    stiffness : array, shape (n_frequency, 6, 6)
        Complex, symmetric; of a mount ``K``, of a mounted body ``K − ω²M``
        [N/m, N/rad, N m/rad].

    Returns
    -------
    array, shape (n_frequency,)
        0 (none) and up [1].

    Raises
    ------
    InputError
        Another shape, not symmetric, or a block without an inverse.

    Notes
    -----
    Root of the spectral radius of ``K_xx⁻¹ K_xθ K_θθ⁻¹ K_θx``. Of a real, positive definite
    stiffness it is `residual_coupling`; of a mounted body it exceeds 1 near the resonances of its
    blocks.
    """
    matrix = _checked_lines(stiffness)
    coupling = matrix[:, :3, 3:]
    try:
        there = np.linalg.solve(matrix[:, :3, :3], coupling)
        back = np.linalg.solve(matrix[:, 3:, 3:], np.swapaxes(coupling, 1, 2))
    except np.linalg.LinAlgError:
        raise InputError(
            "a dynamic stiffness has a block without an inverse, so its coupling has no measure"
        ) from None
    squared = np.abs(np.linalg.eigvals(there @ back)).max(axis=1)
    return np.asarray(np.sqrt(squared), dtype=float)


def dynamic_centre_of_stiffness(stiffness: npt.ArrayLike) -> DynamicElasticCentre:
    """Dynamic elastic centre: where the coupling block of a dynamic stiffness is most symmetric.

    Parameters
    ----------
    stiffness : array, shape (n_frequency, 6, 6)
        Complex, symmetric; of a mount ``K``, of a mounted body ``K − ω²M``
        [N/m, N/rad, N m/rad].

    Returns
    -------
    DynamicElasticCentre

    Raises
    ------
    InputError
        Another shape, not symmetric, or a stiffness along one axis alone.

    Notes
    -----
    `centre_of_stiffness` at each line, as the real point that comes closest in least squares where
    the complex equation has none. That of a mounted body goes from the centre of its mounts at low
    frequency to its centre of gravity above its modes; the thesis (section 2.3.2) speaks of one
    point.
    """
    matrix = _checked_lines(stiffness)
    translation = matrix[:, :3, :3]
    position = _real_point(_lever(translation), -_axial(matrix[:, :3, 3:]))
    return _dynamic_centre_at(matrix, position)


def dynamic_centre_of_compliance(stiffness: npt.ArrayLike) -> DynamicElasticCentre:
    """Where the coupling block of the dynamic compliance is most symmetric.

    Parameters
    ----------
    stiffness : array, shape (n_frequency, 6, 6)
        Complex, symmetric; of a mount ``K``, of a mounted body ``K − ω²M``
        [N/m, N/rad, N m/rad].

    Returns
    -------
    DynamicElasticCentre

    Raises
    ------
    InputError
        Another shape, not symmetric, or a stiffness without an inverse.

    Notes
    -----
    `centre_of_compliance` at each line. Where it meets `dynamic_centre_of_stiffness`, a force at
    the point gives a translation alone and a moment a rotation alone.
    """
    matrix = _checked_lines(stiffness)
    try:
        compliance = np.asarray(np.linalg.inv(matrix), dtype=complex)
    except np.linalg.LinAlgError:
        raise InputError("a dynamic stiffness without an inverse has no compliance") from None
    position = _real_point(_lever(compliance[:, 3:, 3:]), _axial(compliance[:, :3, 3:]))
    return _dynamic_centre_at(matrix, position)


def _lever(block: RealOrComplexArray) -> RealOrComplexArray:
    trace = np.trace(block, axis1=-2, axis2=-1)[..., np.newaxis, np.newaxis]
    return np.asarray(trace * np.eye(3) - block)


def _axial(block: RealOrComplexArray) -> RealOrComplexArray:
    """Vector a with ``block − blockᵀ = skew(a)``: the sum of e_i × block e_i."""
    return np.asarray(np.cross(np.eye(3), np.swapaxes(block, -1, -2)).sum(axis=-2))


def _real_point(lever: RealOrComplexArray, moment: RealOrComplexArray) -> RealArray:
    """Real least-squares solution of ``lever r = moment``, line by line."""
    stacked = np.concatenate([lever.real, lever.imag], axis=1)
    right = np.concatenate([moment.real, moment.imag], axis=1)
    if np.any(np.linalg.matrix_rank(stacked) < 3):
        raise InputError(
            "a stiffness along one axis alone has no centre: every point of the axis would do"
        )
    return np.asarray((np.linalg.pinv(stacked) @ right[:, :, np.newaxis])[:, :, 0])


def _dynamic_centre_at(stiffness: ComplexArray, position: RealArray) -> DynamicElasticCentre:
    at_centre = np.stack(
        [shift_stiffness(line, point) for line, point in zip(stiffness, position, strict=True)]
    )
    return DynamicElasticCentre(
        position, np.asarray(at_centre, dtype=complex), dynamic_coupling(at_centre)
    )


def _checked_lines(stiffness: npt.ArrayLike) -> ComplexArray:
    matrix = np.asarray(stiffness, dtype=complex)
    if matrix.ndim != 3 or matrix.shape[1:] != (6, 6) or not len(matrix):
        raise InputError(
            f"dynamic stiffnesses over frequency have shape (n_frequency, 6, 6), not {matrix.shape}"
        )
    size = np.abs(matrix).max(axis=(1, 2))
    asymmetry = np.abs(matrix - np.swapaxes(matrix, 1, 2)).max(axis=(1, 2))
    if not np.all(asymmetry <= 1e-9 * size) or not np.all(size > 0):
        raise InputError("a dynamic stiffness is not symmetric, or zero: symmetrise it first")
    return matrix


def _centre_at(stiffness: RealArray, position: RealArray) -> ElasticCentre:
    at_centre = np.asarray(shift_stiffness(stiffness, position), dtype=float)
    return ElasticCentre(position, at_centre, residual_coupling(at_centre))


def _checked(stiffness: npt.ArrayLike) -> RealArray:
    matrix = np.asarray(stiffness)
    if np.iscomplexobj(matrix):
        raise InputError("an elastic centre is a real point: pass the real part of the stiffness")
    if matrix.shape != (6, 6):
        raise InputError(f"the stiffness of a suspended body has shape (6, 6), not {matrix.shape}")
    if np.max(np.abs(matrix - matrix.T)) > 1e-9 * np.max(np.abs(matrix)):
        raise InputError("the stiffness is not symmetric")
    if not np.all(np.linalg.eigvalsh(matrix) > 0):
        raise InputError("the stiffness is not positive definite, so it has no elastic centre")
    return np.asarray(matrix, dtype=float)
