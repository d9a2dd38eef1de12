"""A mount with two ends, reduced in steps: 12×12, 6×6, three translations.

Each end has six motions. The thesis (conclusions) concentrates the mount in one virtual point and
then leaves its rotations out; each step has its own error, which is a result here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.physics.rigid_body import shift_matrix


@dataclass(frozen=True, eq=False)
class ReducedMount:
    """A mount in its three forms, and what each step costs at worst.

    Parameters
    ----------
    both_ends : array, shape (n_frequency, 12, 12)
        Loads on the mount per motions of its source end, then its receiver end, both referred to
        the virtual point [N/m, N/rad, N m/rad].
    one_point : array, shape (n_frequency, 6, 6)
        Load on the receiver per motion of the source relative to the receiver.
    translations : array, shape (n_frequency, 3)
        Its first three diagonal entries [N/m].
    condensation_error : array, shape (n_frequency,)
        Of the load on the receiver, 12×12 → 6×6, relative to the largest load, over all motions of
        both ends [1]: mass of the mount, and whatever carries load to ground.
    translation_error : array, shape (n_frequency,)
        Of the load on the receiver, 6×6 → 3, relative to the largest load, over all relative
        motions [1]: rotations, and axes that are coupled.
    length : float
        At which a rotation counts as much as a translation [m].
    """

    both_ends: ComplexArray
    one_point: ComplexArray
    translations: ComplexArray
    condensation_error: RealArray
    translation_error: RealArray
    length: float

    def __post_init__(self) -> None:
        for name in (
            "both_ends",
            "one_point",
            "translations",
            "condensation_error",
            "translation_error",
        ):
            array = np.array(getattr(self, name))
            array.setflags(write=False)
            object.__setattr__(self, name, array)


def reduce_mount(
    stiffness: npt.ArrayLike,
    source_end: npt.ArrayLike,
    receiver_end: npt.ArrayLike,
    length: float,
) -> ReducedMount:
    """Reduce a mount from twelve motions to six, and to three.

    Parameters
    ----------
    stiffness : array, shape (n_frequency, 12, 12)
        Loads on the mount at its source end, then its receiver end, per motions of these ends
        [N/m, N/rad, N m/rad]. Complex, reciprocal.
    source_end, receiver_end : array, shape (3,)
        Where the ends are, from the virtual point [m].
    length : float
        At which a rotation counts as much as a translation, such as the size of the mount [m]; to
        be printed with the errors.

    Returns
    -------
    ReducedMount

    Raises
    ------
    InputError
        Another shape, a stiffness that is not reciprocal, or a length that is not positive.

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

    Parameters
    ----------
    mount : ReducedMount
        Of n_frequency lines.
    motion : array, shape (n_frequency, 12)
        Of the source end, then the receiver end, both at the virtual point, complex peak
        [m, rad].

    Returns
    -------
    condensed, translational : array, shape (n_frequency,)
        Norm of the error of the three forces, of 6×6 and of three translations against 12×12, over
        their norm [1].

    Raises
    ------
    InputError
        Another shape, or a line without force.

    Notes
    -----
    Smaller than the errors over all motions where the source hardly rotates: that is why the
    thesis can leave rotations out.
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
