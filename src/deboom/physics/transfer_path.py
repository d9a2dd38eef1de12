"""Transfer paths: a source joined to a receiver, forces at the paths, pressure at the ear."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError


def mount_force(
    stiffness: npt.ArrayLike,
    source_displacement: npt.ArrayLike,
    receiver_displacement: npt.ArrayLike,
) -> ComplexArray:
    """Return the force of each mount on the receiver from the motion of its two ends.

    Parameters
    ----------
    stiffness : array_like, shape (n_frequency, n_path) or (n_frequency, n_path, n_path)
        Complex dynamic stiffness of each path, or of all paths with what couples them [N/m].
    source_displacement, receiver_displacement : array_like, shape (n_frequency, n_path)
        Motion above and below the mount, complex peak [m].

    Returns
    -------
    array, shape (n_frequency, n_path)
        Interface force, complex peak [N].

    Raises
    ------
    InputError
        Shapes that do not belong together.

    Notes
    -----
    ``g = K (u_A − u_B)``, the mount-stiffness method of the thesis, section 2.4.2; for mounts whose
    mass does not matter in the band. Where both ends move nearly alike the difference is noise.
    """
    springs = np.asarray(stiffness, dtype=complex)
    above = np.asarray(source_displacement, dtype=complex)
    below = np.asarray(receiver_displacement, dtype=complex)
    if (
        above.ndim != 2
        or above.shape != below.shape
        or springs.shape not in (above.shape, (*above.shape, above.shape[1]))
    ):
        raise InputError(
            f"stiffnesses of shape {springs.shape} and displacements of shapes {above.shape} and "
            f"{below.shape} do not belong together: give the same lines first and the same paths "
            "last"
        )
    if springs.ndim == 2:
        return np.asarray(springs * (above - below))
    return np.asarray(np.einsum("fij,fj->fi", springs, above - below))


def contributions(ntf: npt.ArrayLike, force: npt.ArrayLike) -> ComplexArray:
    """Return what each path gives to the pressure, kept complex.

    Parameters
    ----------
    ntf : array_like, shape (n_frequency, n_path) or (n_frequency, n_ear, n_path)
        Noise transfer functions [Pa/N].
    force : array_like, shape (n_frequency, n_path)
        Force of each path on the receiver, complex peak [N].

    Returns
    -------
    array, shape of `ntf`
        Complex peak pressure per path [Pa].

    Raises
    ------
    InputError
        Lines or paths that differ.

    Notes
    -----
    The terms ``Y_dj f_j`` of the thesis, eq. 13. Their levels do not add up to the level of the
    sum: paths cancel.
    """
    transfer, forces = np.asarray(ntf, dtype=complex), np.asarray(force, dtype=complex)
    if (
        transfer.ndim not in (2, 3)
        or forces.ndim != 2
        or (transfer.shape[0], transfer.shape[-1]) != forces.shape
    ):
        raise InputError(
            f"transfer functions of shape {transfer.shape} and forces of shape {forces.shape} do "
            "not belong together: give the same lines first and the same paths last"
        )
    return np.asarray(transfer * (forces if transfer.ndim == 2 else forces[:, np.newaxis, :]))


def pressure(ntf: npt.ArrayLike, force: npt.ArrayLike) -> ComplexArray:
    """Return the pressure as the sum of all paths.

    Parameters
    ----------
    ntf : array_like, shape (n_frequency, n_path) or (n_frequency, n_ear, n_path)
        Noise transfer functions [Pa/N].
    force : array_like, shape (n_frequency, n_path)
        Force of each path on the receiver, complex peak [N].

    Returns
    -------
    array, shape (n_frequency,) or (n_frequency, n_ear)
        Complex peak pressure [Pa].

    Raises
    ------
    InputError
        Lines or paths that differ.

    Notes
    -----
    ``p_d = Σ_j Y_dj f_j``, thesis, eq. 13; eq. 7 and 8 with other responses in place of the
    pressure.
    """
    return np.asarray(contributions(ntf, force).sum(axis=-1))


def pressure_with_airborne(
    ntf: npt.ArrayLike,
    force: npt.ArrayLike,
    acoustic_ntf: npt.ArrayLike,
    source_strength: npt.ArrayLike,
) -> ComplexArray:
    """Return the pressure of the structure-borne and the airborne paths together.

    Parameters
    ----------
    ntf : array_like, shape (n_frequency, n_path)
        Noise transfer functions [Pa/N].
    force : array_like, shape (n_frequency, n_path)
        Force of each path, complex peak [N].
    acoustic_ntf : array_like, shape (n_frequency, n_source)
        Pressure per volume velocity of each airborne source [Pa s/m³].
    source_strength : array_like, shape (n_frequency, n_source)
        Volume velocity of each source, complex peak [m³/s].

    Returns
    -------
    array, shape (n_frequency,)
        Complex peak pressure [Pa].

    Raises
    ------
    InputError
        Lines, paths or sources that differ.

    Notes
    -----
    ``p_d = Σ_j Y_dj f_j + Σ_k Y_dk q_k``, thesis, eq. 12. At low frequency the structure carries
    90 to 95 % (thesis, section 2.4), and eq. 13 leaves the second sum out.
    """
    return pressure(ntf, force) + pressure(acoustic_ntf, source_strength)


def partial_sums(
    path_contributions: npt.ArrayLike, groups: Sequence[Sequence[int]]
) -> ComplexArray:
    """Return the contribution of groups of paths, such as all axes of one mount.

    Parameters
    ----------
    path_contributions : array_like, shape (n_frequency, ..., n_path)
        Complex contributions [Pa].
    groups : sequence of sequences of int
        Path numbers of each group. Each path belongs to exactly one group, so that the groups add
        up to the pressure.

    Returns
    -------
    array, shape (n_frequency, ..., n_group)
        Complex peak pressure per group [Pa].

    Raises
    ------
    InputError
        A path in no group or in two, or one that does not exist.
    """
    values = np.asarray(path_contributions, dtype=complex)
    n_path = values.shape[-1]
    if sorted(path for group in groups for path in group) != list(range(n_path)):
        raise InputError(
            f"groups {[list(group) for group in groups]} do not hold each of the paths 0 to "
            f"{n_path - 1} exactly once: name every path in one group"
        )
    return np.stack([values[..., list(group)].sum(axis=-1) for group in groups], axis=-1)


def energy_share(
    path_contributions: npt.ArrayLike, line_weight: npt.ArrayLike | None = None
) -> RealArray:
    """Return the part of the energy of the sum that each path brings, with its phase.

    Parameters
    ----------
    path_contributions : array_like, shape (n_frequency, n_path)
        Complex contributions [Pa].
    line_weight : array_like, shape (n_frequency,), optional
        Energy weight of each line, such as the A-weighting; by default all alike [1].

    Returns
    -------
    array, shape (n_path,)
        Adds up to 1; below 0 where a path takes away from the others [1].

    Raises
    ------
    InputError
        Weights that do not fit, or a sum that is zero on all lines.

    Notes
    -----
    ``Σ_f w Re(c_k p*) / Σ_f w |p|²`` with ``p = Σ_k c_k``. It is also the slope of the energy:
    ``d ln E / d ln |c_k| = 2 share``.
    """
    values, weight = _weighted(path_contributions, line_weight)
    total = values.sum(axis=1)
    energy = np.sum(weight * np.abs(total) ** 2)
    if energy == 0:
        raise InputError("the paths add up to nothing on all lines: there is no energy to share")
    return np.asarray(weight @ np.real(values * total.conj()[:, np.newaxis]) / energy)


def rms_contribution(
    path_contributions: npt.ArrayLike, line_weight: npt.ArrayLike | None = None
) -> RealArray:
    """Return how large each path is on its own, whatever its phase.

    Parameters
    ----------
    path_contributions : array_like, shape (n_frequency, n_path)
        Complex contributions, peak [Pa].
    line_weight : array_like, shape (n_frequency,), optional
        Energy weight of each line; by default all alike [1].

    Returns
    -------
    array, shape (n_path,)
        Root of the weighted mean of |c_k|² over the lines, peak amplitude [Pa].

    Raises
    ------
    InputError
        Weights that do not fit.
    """
    values, weight = _weighted(path_contributions, line_weight)
    return np.asarray(np.sqrt(weight @ np.abs(values) ** 2 / len(values)))


def _weighted(
    path_contributions: npt.ArrayLike, line_weight: npt.ArrayLike | None
) -> tuple[ComplexArray, RealArray]:
    values = np.asarray(path_contributions, dtype=complex)
    n_frequency = values.shape[0] if values.ndim == 2 else 0
    weight = np.ones(n_frequency) if line_weight is None else np.asarray(line_weight, dtype=float)
    if n_frequency == 0 or weight.shape != (n_frequency,):
        raise InputError(
            f"contributions of shape {values.shape} and line weights of shape {weight.shape}: give "
            "(n_frequency, n_path) and one weight per line"
        )
    return values, weight


def mounted_source(source: npt.ArrayLike, stiffness: npt.ArrayLike) -> ComplexArray:
    """Return the receptance of a source seen from the far side of its mounts.

    Parameters
    ----------
    source : array_like, shape (n_frequency, n_path, n_path)
        Receptance of the source at its interface [m/N].
    stiffness : array_like, shape (n_frequency, n_path)
        Complex dynamic stiffness of the mount in each path [N/m].

    Returns
    -------
    array, shape (n_frequency, n_path, n_path)
        [m/N].

    Raises
    ------
    InputError
        Shapes that do not belong together, or a mount without stiffness.

    Notes
    -----
    ``Y_A + diag(1/K)``: a massless mount carries the same force at both ends and adds its own
    deflection. The free motion behind the mounts is that of the source itself. With it the mounts
    belong to the source, as on the test bench of the thesis, section 2.4.2.
    """
    receptance, mounts = np.asarray(source, dtype=complex), np.asarray(stiffness, dtype=complex)
    _check_square(receptance, "source")
    if mounts.shape != receptance.shape[:2]:
        raise InputError(
            f"mounts of shape {mounts.shape} do not fit a source of shape {receptance.shape}: give "
            "one stiffness per line and path"
        )
    if np.any(mounts == 0):
        raise InputError(
            "a mount of zero stiffness carries no force: leave its path out of source and receiver"
        )
    return np.asarray(receptance + np.eye(receptance.shape[1]) / mounts[:, :, np.newaxis])


def interface_force(
    source: npt.ArrayLike, receiver: npt.ArrayLike, free_displacement: npt.ArrayLike
) -> ComplexArray:
    """Return the force of a source on the receiver to which it is joined.

    Parameters
    ----------
    source, receiver : array_like, shape (n_frequency, n_path, n_path)
        Uncoupled receptances at the interface [m/N]; a source behind mounts: `mounted_source`.
    free_displacement : array_like, shape (n_frequency, n_path)
        Motion of the source's interface when nothing is attached, complex peak [m].

    Returns
    -------
    array, shape (n_frequency, n_path)
        On the receiver, complex peak [N].

    Raises
    ------
    InputError
        Shapes that do not belong together, or an interface that cannot be solved.

    Notes
    -----
    ``g = (Y_A + Y_B)⁻¹ u_free``, from equal motion and opposite forces (thesis, eq. 9 and 10).
    """
    source, receiver = np.asarray(source, dtype=complex), np.asarray(receiver, dtype=complex)
    _check_square(source, "source")
    _check_same_shape(receiver, source, "receiver")
    return _solve_vector(source + receiver, free_displacement, "source plus receiver")


def blocked_force(source: npt.ArrayLike, free_displacement: npt.ArrayLike) -> ComplexArray:
    """Return the force of a source on a rigid receiver, a property of the source alone.

    Parameters
    ----------
    source : array_like, shape (n_frequency, n_path, n_path)
        Receptance at the interface [m/N].
    free_displacement : array_like, shape (n_frequency, n_path)
        Motion of the interface when nothing is attached, complex peak [m].

    Returns
    -------
    array, shape (n_frequency, n_path)
        Complex peak [N].

    Raises
    ------
    InputError
        Shapes that do not belong together, or a source that cannot be solved.

    Notes
    -----
    ``f_bl = Y_A⁻¹ u_free``. It belongs with the assembled receptance, ``p = Y_AB f_bl``
    (`assembled_frf`).
    """
    source = np.asarray(source, dtype=complex)
    _check_square(source, "source")
    return _solve_vector(source, free_displacement, "source")


def blocked_force_on_rig(
    source: npt.ArrayLike, rig_force: npt.ArrayLike, rig_displacement: npt.ArrayLike
) -> ComplexArray:
    """Return the blocked force from a test rig that gives way.

    Parameters
    ----------
    source : array_like, shape (n_frequency, n_path, n_path)
        Receptance at the interface [m/N].
    rig_force : array_like, shape (n_frequency, n_path)
        Measured between source and rig, on the rig, complex peak [N].
    rig_displacement : array_like, shape (n_frequency, n_path)
        Motion of the interface, complex peak [m].

    Returns
    -------
    array, shape (n_frequency, n_path)
        Complex peak [N].

    Raises
    ------
    InputError
        Shapes that do not belong together, or a source that cannot be solved.

    Notes
    -----
    ``f_bl = g + Y_A⁻¹ u``, thesis, eq. 11; on a rigid rig u = 0 and the cells read f_bl.
    """
    source, force = np.asarray(source, dtype=complex), np.asarray(rig_force, dtype=complex)
    _check_square(source, "source")
    _check_same_shape(force, source[:, :, 0], "rig force")
    return force + _solve_vector(source, rig_displacement, "source")


def assembled_frf(
    response: npt.ArrayLike,
    receiver: npt.ArrayLike,
    source: npt.ArrayLike,
    excitation: npt.ArrayLike,
) -> ComplexArray:
    """Return frequency response functions of source and receiver joined at their interface.

    Parameters
    ----------
    response : array_like, shape (n_frequency, n_output, n_path)
        Uncoupled receiver: response per force at the interface; a noise transfer function [Pa/N],
        or the receptance of `receiver` [m/N].
    receiver, source : array_like, shape (n_frequency, n_path, n_path)
        Uncoupled receptances at the interface [m/N]; a source behind mounts: `mounted_source`.
    excitation : array_like, shape (n_frequency, n_path, n_input)
        Uncoupled source: motion of the interface per force inside the source [m/N]. `source`
        itself for forces at the interface.

    Returns
    -------
    array, shape (n_frequency, n_output, n_input)
        Response on the receiver per force on the source, of the assembled bodies; the unit of
        `response`.

    Raises
    ------
    InputError
        Shapes that do not belong together, or an interface that cannot be solved.

    Notes
    -----
    ``Y_AB = Y_B,oj (Y_A,jj + Y_B,jj)⁻¹ Y_A,ji``, dual coupling; the assembled function of the
    thesis, eq. 7 and 8.
    """
    response, receiver = np.asarray(response, dtype=complex), np.asarray(receiver, dtype=complex)
    source, excitation = np.asarray(source, dtype=complex), np.asarray(excitation, dtype=complex)
    _check_square(source, "source")
    _check_same_shape(receiver, source, "receiver")
    n_frequency, n_path = source.shape[:2]
    if response.ndim != 3 or response.shape[::2] != (n_frequency, n_path):
        raise InputError(
            f"responses of shape {response.shape} do not fit a source of shape {source.shape}: "
            "give (n_frequency, n_output, n_path)"
        )
    if excitation.ndim != 3 or excitation.shape[:2] != (n_frequency, n_path):
        raise InputError(
            f"excitations of shape {excitation.shape} do not fit a source of shape "
            f"{source.shape}: give (n_frequency, n_path, n_input)"
        )
    return response @ _solve(source + receiver, excitation, "source plus receiver")


def _check_square(matrix: ComplexArray, what: str) -> None:
    if matrix.ndim != 3 or matrix.shape[1] != matrix.shape[2]:
        raise InputError(
            f"the {what} has shape {matrix.shape}: give receptances of shape "
            "(n_frequency, n_path, n_path)"
        )


def _check_same_shape(array: ComplexArray, like: ComplexArray, what: str) -> None:
    if array.shape != like.shape:
        raise InputError(
            f"the {what} has shape {array.shape}: give {like.shape}, the lines and paths of the "
            "source"
        )


def _solve(matrix: ComplexArray, right: ComplexArray, what: str) -> ComplexArray:
    try:
        return np.asarray(np.linalg.solve(matrix, right))
    except np.linalg.LinAlgError:
        raise InputError(
            f"the receptance of {what} is singular: leave out paths that move only together"
        ) from None


def _solve_vector(matrix: ComplexArray, right: npt.ArrayLike, what: str) -> ComplexArray:
    vector = np.asarray(right, dtype=complex)
    _check_same_shape(vector, matrix[:, :, 0], "displacement")
    return np.asarray(_solve(matrix, vector[:, :, np.newaxis], what)[:, :, 0])
