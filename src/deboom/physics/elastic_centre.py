"""The points at which forces and rotations of a suspended body couple least."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg import solve_triangular

from deboom.errors import InputError
from deboom.physics.arrays import RealArray
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
    lever = np.trace(translation) * np.eye(3) - translation
    return _centre_at(matrix, -np.linalg.solve(lever, _axial(coupling)))


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
    lever = np.trace(rotation) * np.eye(3) - rotation
    return _centre_at(matrix, np.linalg.solve(lever, _axial(coupling)))


def _axial(block: RealArray) -> RealArray:
    """Vector a with ``block − blockᵀ = skew(a)``: the sum of e_i × block e_i."""
    return np.asarray(np.cross(np.eye(3), block.T).sum(axis=0))


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
