"""A source joined to a receiver: interface forces, blocked forces and assembled functions.

Source A and receiver B meet at their interface, one degree of freedom per path. Receptances are
those of each body on its own ("uncoupled") or of the two joined ("assembled"):

==========================  ==================================================================
force                       goes with
==========================  ==================================================================
interface force ``g``       uncoupled receiver, ``p = Y_B g`` (thesis, eq. 8)
blocked force ``f_bl``      assembled bodies, ``p = Y_AB f_bl`` (van der Seijs et al. 2016)
==========================  ==================================================================

Blocked forces with the uncoupled receiver are an approximation: good where the receiver is much
stiffer than the source with its mounts.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray
from deboom.errors import InputError


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
