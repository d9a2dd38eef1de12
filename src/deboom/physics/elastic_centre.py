"""Elastic centres, and the reduction of a mount with two ends: 12×12, 6×6, three translations.

An elastic centre is the point at which forces and rotations of a mount or a suspended body couple
least. Each end of a mount has six motions; the thesis (conclusions) concentrates the mount in one
virtual point and then leaves its rotations out. What either step neglects is a result here.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.linalg import solve_triangular

from deboom.arrays import ComplexArray, RealArray, checked
from deboom.errors import InputError
from deboom.physics.rigid_body import shift_matrix, shift_stiffness


@checked(position="... 3", stiffness="... 6 6", coupling="...")
class ElasticCentre:
    """A centre of a stiffness, one for all or one per line, and how well it decouples there.

    Parameters
    ----------
    position : array, shape (3,) or (n_frequency, 3)
        Centre, from the point at which the stiffness was given [m].
    stiffness : array, shape (6, 6) or (n_frequency, 6, 6)
        Stiffness at the centre [N/m, N/rad, N m/rad].
    coupling : array, shape () or (n_frequency,)
        Coupling of translations and rotations at the centre [1]; see `residual_coupling` and
        `dynamic_coupling`.
    """

    position: RealArray
    stiffness: ComplexArray
    coupling: RealArray


def residual_coupling(stiffness: npt.ArrayLike) -> float:
    """Return how much translations and rotations are coupled by a 6×6 stiffness, 0 to 1 [1].

    0: a force gives a pure translation, a moment a pure rotation. Raises InputError: a stiffness
    that is complex, asymmetric or not positive definite.

    The largest ``|tᵀ K_xθ φ|`` over all translations t and rotations φ of unit energy,
    ``tᵀ K_xx t = φᵀ K_θθ φ = 1``. It depends on the point, neither on the unit of length nor on the
    directions of the axes.
    """
    matrix = _checked_static(stiffness)
    translation = np.linalg.cholesky(matrix[:3, :3])
    rotation = np.linalg.cholesky(matrix[3:, 3:])
    half = solve_triangular(translation, matrix[:3, 3:], lower=True)
    normalised = solve_triangular(rotation, half.T, lower=True)
    return float(np.linalg.norm(normalised, 2))


def centre_of_stiffness(stiffness: npt.ArrayLike) -> ElasticCentre:
    """Return the point at which the coupling block of the stiffness is symmetric.

    Parameters
    ----------
    stiffness : array, shape (6, 6)
        Real, symmetric, positive definite, at some origin [N/m, N/rad, N m/rad].

    Returns
    -------
    ElasticCentre
        ``position``, shape (3,) [m], and ``coupling``, what is left of it there [1].

    Raises
    ------
    InputError
        A stiffness that is complex, asymmetric or not positive definite.

    See Also
    --------
    deboom.dynamic_centre_of_stiffness, deboom.characterise

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

    Examples
    --------
    >>> import deboom, numpy as np
    >>> from deboom.physics.rigid_body import mount_stiffness_matrix
    >>> places = np.array([[0.2, 0.5, 0.1], [0.2, -0.5, 0.1], [-0.4, 0.0, 0.1]])
    >>> stiffness = mount_stiffness_matrix(places, np.full((3, 3), 2e5))
    >>> np.allclose(deboom.centre_of_stiffness(stiffness).position, places.mean(axis=0))
    True
    """
    return _static(dynamic_centre_of_stiffness(_checked_static(stiffness)[np.newaxis]))


def centre_of_compliance(stiffness: npt.ArrayLike) -> ElasticCentre:
    """Return the point at which the coupling block of the compliance is symmetric.

    Argument, errors and source as for `centre_of_stiffness`.

    Notes
    -----
    With ``C = K⁻¹``, ``C_xθ − skew(r) C_θθ`` is symmetric for
    ``r = (tr(C_θθ) I − C_θθ)⁻¹ axial(C_xθ − C_xθᵀ)``. It is the centre of stiffness where the
    coupling vanishes, and another point where it does not.
    """
    return _static(dynamic_centre_of_compliance(_checked_static(stiffness)[np.newaxis]))


def dynamic_coupling(stiffness: npt.ArrayLike) -> RealArray:
    """Return how much translations and rotations are coupled, 0 and up, shape (n_frequency,) [1].

    Argument as for `dynamic_centre_of_stiffness`; a block without an inverse raises InputError.

    Notes
    -----
    Root of the spectral radius of ``K_xx⁻¹ K_xθ K_θθ⁻¹ K_θx``. Of a real, positive definite
    stiffness it is `residual_coupling`; of a mounted body it exceeds 1 near the resonances of its
    blocks.
    """
    matrix = _checked_lines(stiffness)
    coupling = matrix[:, :3, 3:]
    try:
        turning = np.linalg.solve(matrix[:, :3, :3], coupling)
        shifting = np.linalg.solve(matrix[:, 3:, 3:], np.swapaxes(coupling, 1, 2))
    except np.linalg.LinAlgError:
        raise InputError(
            "a dynamic stiffness has a block without an inverse, so its coupling has no measure"
        ) from None
    squared = np.abs(np.linalg.eigvals(turning @ shifting)).max(axis=1)
    return np.asarray(np.sqrt(squared), dtype=float)


def dynamic_centre_of_stiffness(stiffness: npt.ArrayLike) -> ElasticCentre:
    """Return the dynamic elastic centre: where the coupling block is most symmetric, per line.

    Parameters
    ----------
    stiffness : array, shape (n_frequency, 6, 6)
        Complex, symmetric: ``K`` of a mount, ``K − ω²M`` of a mounted body [N/m, N/rad, N m/rad].

    Returns
    -------
    ElasticCentre
        ``position``, shape (n_frequency, 3) [m], and ``coupling``, what is left of it there [1].

    Raises
    ------
    InputError
        A stiffness that is not symmetric, or has a singular block of translations or rotations.

    See Also
    --------
    deboom.centre_of_stiffness, deboom.physics.substructuring.assembled_stiffness

    Notes
    -----
    `centre_of_stiffness` at each line, as the real point that comes closest in least squares where
    the complex equation has none. That of a mounted body goes from the centre of its mounts at low
    frequency to its centre of gravity above its modes; the thesis (section 2.3.2) speaks of one
    point.

    Examples
    --------
    >>> import deboom, numpy as np
    >>> from deboom.physics.rigid_body import mass_matrix, mount_stiffness_matrix
    >>> places = np.array([[0.2, 0.5, 0.1], [0.2, -0.5, 0.1], [-0.4, 0.0, 0.1]])
    >>> mounts = mount_stiffness_matrix(places, np.full((3, 3), 2e5))
    >>> omega = 2 * np.pi * np.array([0.1, 1000.0])[:, None, None]
    >>> dynamic = (1 + 0.1j) * mounts - omega**2 * mass_matrix(200.0, 10 * np.eye(3))
    >>> deboom.dynamic_centre_of_stiffness(dynamic).position[:, 2].round(3)
    array([ 0.1, -0. ])
    """
    matrix = _checked_lines(stiffness)
    return _centre_at(matrix, _real_point(matrix[:, :3, :3], -_axial(matrix[:, :3, 3:])))


def dynamic_centre_of_compliance(stiffness: npt.ArrayLike) -> ElasticCentre:
    """Return the point where the coupling block of the compliance is most symmetric, per line.

    `centre_of_compliance` at each line; argument and errors as for `dynamic_centre_of_stiffness`.
    Where both meet, a force at the point gives a translation alone and a moment a rotation alone.
    """
    matrix = _checked_lines(stiffness)
    try:
        compliance = np.asarray(np.linalg.inv(matrix), dtype=complex)
    except np.linalg.LinAlgError:
        raise InputError("a dynamic stiffness without an inverse has no compliance") from None
    return _centre_at(matrix, _real_point(compliance[:, 3:, 3:], _axial(compliance[:, :3, 3:])))


def _axial(block: ComplexArray) -> ComplexArray:
    """Vector a with ``block − blockᵀ = skew(a)``: the sum of e_i × block e_i."""
    return np.asarray(np.cross(np.eye(3), np.swapaxes(block, -1, -2)).sum(axis=-2))


def _real_point(block: ComplexArray, moment: ComplexArray) -> RealArray:
    """Real least-squares solution of ``(tr(block) I − block) r = moment``, line by line."""
    trace = np.trace(block, axis1=-2, axis2=-1)[..., np.newaxis, np.newaxis]
    lever = trace * np.eye(3) - block
    stacked = np.concatenate([lever.real, lever.imag], axis=1)
    right = np.concatenate([moment.real, moment.imag], axis=1)
    if np.any(np.linalg.matrix_rank(stacked) < 3):
        raise InputError(
            "a stiffness along one axis alone has no centre: every point of the axis would do"
        )
    return np.asarray((np.linalg.pinv(stacked) @ right[:, :, np.newaxis])[:, :, 0])


def _centre_at(stiffness: ComplexArray, position: RealArray) -> ElasticCentre:
    pairs = zip(stiffness, position, strict=True)
    shifted = [shift_stiffness(line, point) for line, point in pairs]
    at_centre = np.asarray(np.stack(shifted), dtype=np.complex128)
    return ElasticCentre(position, at_centre, dynamic_coupling(at_centre))


def _static(centre: ElasticCentre) -> ElasticCentre:
    """Centre of the only line of a real stiffness."""
    stiffness = centre.stiffness[0].real
    coupling = residual_coupling((stiffness + stiffness.T) / 2)
    return ElasticCentre(centre.position[0], stiffness, np.asarray(coupling))


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


def _checked_static(stiffness: npt.ArrayLike) -> RealArray:
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


@checked(
    both_ends="f 12 12",
    one_point="f 6 6",
    translations="f 3",
    condensation_error="f",
    translation_error="f",
)
class ReducedMount:
    """A mount in its three forms, and what each step costs at worst.

    - `both_ends` (n_frequency, 12, 12): loads on the mount per motions of its source end, then its
      receiver end, both referred to the virtual point [N/m, N/rad, N m/rad].
    - `one_point` (n_frequency, 6, 6): load on the receiver per motion of the source relative to the
      receiver.
    - `translations` (n_frequency, 3): the first three diagonal entries of `one_point` [N/m].
    - `condensation_error` (n_frequency,): error of the load on the receiver, 12×12 → 6×6, relative
      to the largest load, over all motions of both ends [1]: mass of the mount, and whatever
      carries load to ground.
    - `translation_error` (n_frequency,): error of the load on the receiver, 6×6 → 3, relative to
      the largest load, over all relative motions [1]: rotations, and axes that are coupled.
    - `length`: at which a rotation counts as much as a translation [m].
    """

    both_ends: ComplexArray
    one_point: ComplexArray
    translations: ComplexArray
    condensation_error: RealArray
    translation_error: RealArray
    length: float


def reduce_mount(
    stiffness: npt.ArrayLike,
    source_end: npt.ArrayLike,
    receiver_end: npt.ArrayLike,
    length: float,
) -> ReducedMount:
    """Reduce a mount from twelve motions to six, and to three.

    Raises InputError: another shape, a stiffness that is not reciprocal, or a length that is not
    positive.

    Parameters
    ----------
    stiffness : array, shape (n_frequency, 12, 12)
        Loads on the mount at its source end, then its receiver end, per motions of these ends [N/m,
        N/rad, N m/rad]. Complex, reciprocal.
    source_end, receiver_end : array, shape (3,) — positions of the ends, from the virtual point [m]
    length : float
        Length at which a rotation counts as much as a translation, such as the size of the mount
        [m]; to be printed with the errors.

    Notes
    -----
    Both ends move as rigid fittings, so their motions and loads are referred to one point,
    ``Z = χᵀ Z_ends χ``. The six are the transfer stiffness, ``K = −(Z_AB + Z_BA)/2``: exact for a
    mount without mass, for which ``Z = [[K, −K], [−K, K]]``. ISO 10846-1 states the same limit for
    the transfer stiffness. Errors are ratios of spectral norms with rotations times, and moments
    over, the length.
    """
    matrix = np.asarray(stiffness, dtype=complex)
    if matrix.ndim != 3 or matrix.shape[1:] != (12, 12):
        raise InputError(
            f"a mount with two ends has shape (n_frequency, 12, 12), not {matrix.shape}"
        )
    if not length > 0:
        raise InputError(f"a characteristic length is positive, not {length} m")
    if np.max(np.abs(matrix - np.swapaxes(matrix, 1, 2))) > 1e-9 * np.max(np.abs(matrix)):
        raise InputError(
            "the stiffness of the mount is not reciprocal (symmetric): symmetrise it first"
        )
    chi = np.zeros((12, 12))
    # the virtual point lies at minus the end, seen from the end
    chi[:6, :6] = shift_matrix(-np.asarray(source_end, dtype=float))
    chi[6:, 6:] = shift_matrix(-np.asarray(receiver_end, dtype=float))
    both_ends = chi.T @ matrix @ chi
    one_point = -(both_ends[:, :6, 6:] + both_ends[:, 6:, :6]) / 2
    translations = np.diagonal(one_point, axis1=1, axis2=2)[:, :3]

    on_receiver = -both_ends[:, 6:, :]
    condensed = np.concatenate([one_point, -one_point], axis=2)
    three = np.zeros_like(one_point)
    three[:, range(3), range(3)] = translations
    return ReducedMount(
        both_ends=both_ends,
        one_point=one_point,
        translations=translations,
        condensation_error=_relative(on_receiver - condensed, on_receiver, length),
        translation_error=_relative(one_point - three, one_point, length),
        length=length,
    )


def reduction_error_in_operation(
    mount: ReducedMount, motion: npt.ArrayLike
) -> tuple[RealArray, RealArray]:
    """Return what the two steps cost in the force on the receiver for one motion.

    Norms of the error of the three forces, of 6×6 and of three translations against 12×12, over
    their norm, each (n_frequency,) [1]. Another shape, or a line without force, raises InputError.

    Parameters
    ----------
    mount : ReducedMount — mount of n_frequency lines
    motion : array, shape (n_frequency, 12)
        Motion of the source end, then the receiver end, both at the virtual point, complex peak
        [m, rad].

    Notes
    -----
    Smaller than the errors over all motions where the source hardly rotates: that is why the thesis
    can leave rotations out.
    """
    ends = np.asarray(motion, dtype=complex)
    if ends.shape != mount.both_ends.shape[:2]:
        raise InputError(
            f"motions of shape {ends.shape}: give the twelve of both ends at each of "
            f"{len(mount.both_ends)} lines"
        )
    relative = ends[:, :6] - ends[:, 6:]
    full = -np.einsum("fij,fj->fi", mount.both_ends[:, 6:9], ends)
    condensed = np.einsum("fij,fj->fi", mount.one_point[:, :3], relative)
    translational = mount.translations * relative[:, :3]
    size = np.linalg.norm(full, axis=1)
    if not np.all(size > 0):
        raise InputError("the mount passes no force on at some line: its error has no measure")
    return (
        np.asarray(np.linalg.norm(condensed - full, axis=1) / size),
        np.asarray(np.linalg.norm(translational - full, axis=1) / size),
    )


def _relative(error: ComplexArray, whole: ComplexArray, length: float) -> RealArray:
    """Spectral norm of a load-by-motion matrix over another's, made free of the unit of length."""
    rows = np.repeat([1.0, 1 / length], 3)[:, np.newaxis]
    columns = np.tile(np.repeat([1.0, 1 / length], 3), whole.shape[2] // 6)
    scale = rows * columns
    return np.asarray(
        np.linalg.norm(error * scale, 2, axis=(1, 2))
        / np.linalg.norm(whole * scale, 2, axis=(1, 2))
    )
