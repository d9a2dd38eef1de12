"""Transfer paths: a source joined to a receiver, forces at the paths, pressure at the ear.

Source A and receiver B meet at their interface, one degree of freedom per path. Receptances are
those of each body on its own ("uncoupled") or of the two joined ("assembled"):

==========================  ==================================================================
force                       goes with
==========================  ==================================================================
interface force ``g``       uncoupled receiver, ``p = Y_B g`` (thesis, eq. 8)
blocked force ``f_bl``      assembled bodies, ``p = Y_AB f_bl`` (van der Seijs et al. 2016)
==========================  ==================================================================

Blocked forces with the uncoupled receiver are an approximation: good where the receiver is much
stiffer than the source with its mounts. Forces out of responses: `force_inversion`.

Shapes that do not belong together, and interfaces that cannot be solved, raise InputError.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray, checked_array
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
    array, shape (n_frequency, n_path) — interface force, complex peak [N]

    Notes
    -----
    ``g = K (u_A − u_B)``, the mount-stiffness method of the thesis, section 2.4.2; for mounts whose
    mass does not matter in the band. Where both ends move nearly alike the difference is noise.
    """
    sizes: dict[str, int] = {}
    above = _complex(source_displacement, "f p", "displacement of the source", sizes)
    below = _complex(receiver_displacement, "f p", "displacement of the receiver", sizes)
    axes = "f p p" if np.ndim(stiffness) == 3 else "f p"
    springs = _complex(stiffness, axes, "stiffness of the mounts", sizes)
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

    Notes
    -----
    The terms ``Y_dj f_j`` of the thesis, eq. 13. Their levels do not add up to the level of the
    sum: paths cancel.
    """
    sizes: dict[str, int] = {}
    forces = _complex(force, "f p", "forces of the paths", sizes)
    axes = "f ear p" if np.ndim(ntf) == 3 else "f p"
    transfer = _complex(ntf, axes, "transfer functions of the paths", sizes)
    return np.asarray(transfer * (forces if transfer.ndim == 2 else forces[:, np.newaxis, :]))


def pressure(ntf: npt.ArrayLike, force: npt.ArrayLike) -> ComplexArray:
    """Return the pressure as the sum of all paths, ``p_d = Σ_j Y_dj f_j``, complex peak [Pa].

    Arguments as for `contributions`; shape (n_frequency,) or (n_frequency, n_ear). Thesis, eq. 13;
    eq. 7 and 8 with other responses in place of the pressure.
    """
    return np.asarray(contributions(ntf, force).sum(axis=-1))


def pressure_with_airborne(
    ntf: npt.ArrayLike,
    force: npt.ArrayLike,
    acoustic_ntf: npt.ArrayLike,
    source_strength: npt.ArrayLike,
) -> ComplexArray:
    """Return the pressure of the structure-borne and the airborne paths together [Pa].

    ``p_d = Σ_j Y_dj f_j + Σ_k Y_dk q_k``, thesis, eq. 12, with the pressure per volume velocity
    [Pa s/m³] and the volume velocity [m³/s] of each airborne source, both (n_frequency, n_source).
    At low frequency the structure carries 90 to 95 % (thesis, section 2.4), and eq. 13 leaves the
    second sum out.
    """
    return pressure(ntf, force) + pressure(acoustic_ntf, source_strength)


def partial_sums(
    path_contributions: npt.ArrayLike, groups: Sequence[Sequence[int]]
) -> ComplexArray:
    """Return the contribution of groups of paths, shape (n_frequency, ..., n_group) [Pa].

    Parameters
    ----------
    path_contributions : array_like, shape (n_frequency, ..., n_path) — complex contributions [Pa]
    groups : sequence of sequences of int
        Path numbers of each group, such as all axes of one mount. Each path belongs to exactly one
        group, so that the groups add up to the pressure; else InputError.
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
    """Return the part of the energy of the sum that each path brings, with its phase, (n_path,).

    Shares add up to 1; one is below 0 where a path takes away from the others [1].

    Parameters
    ----------
    path_contributions : array_like, shape (n_frequency, n_path) — complex contributions [Pa]
    line_weight : array_like, shape (n_frequency,), optional
        Energy weight of each line, such as the A-weighting; by default all alike [1].

    Notes
    -----
    ``Σ_f w Re(c_k p*) / Σ_f w |p|²`` with ``p = Σ_k c_k``, which must not be zero on all lines. It
    is also the slope of the energy: ``d ln E / d ln |c_k| = 2 share``.
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
    """Return how large each path is on its own, whatever its phase, shape (n_path,) [Pa].

    ``√(Σ_f w |c_k|² / n_frequency)``, peak amplitude: weights are not divided by their sum;
    arguments as for `energy_share`.
    """
    values, weight = _weighted(path_contributions, line_weight)
    return np.asarray(np.sqrt(weight @ np.abs(values) ** 2 / len(values)))


def mounted_source(source: npt.ArrayLike, stiffness: npt.ArrayLike) -> ComplexArray:
    """Return the receptance [m/N] of a source seen from the far side of its mounts.

    - `source` (n_frequency, n_path, n_path): its receptance without the mounts [m/N].
    - `stiffness` (n_frequency, n_path): complex dynamic stiffness of the mount in each path, not 0
      [N/m].

    ``Y_A + diag(1/K)``: a massless mount carries the same force at both ends and adds its own
    deflection. The free motion behind the mounts is that of the source itself. With it the mounts
    belong to the source, as on the test bench of the thesis, section 2.4.2.
    """
    sizes: dict[str, int] = {}
    receptance = _complex(source, "f p p", "receptance of the source", sizes)
    mounts = _complex(stiffness, "f p", "stiffness of the mounts", sizes)
    if np.any(mounts == 0):
        raise InputError(
            "a mount of zero stiffness carries no force: leave its path out of source and receiver"
        )
    return np.asarray(receptance + np.eye(receptance.shape[1]) / mounts[:, :, np.newaxis])


def interface_force(
    source: npt.ArrayLike, receiver: npt.ArrayLike, free_displacement: npt.ArrayLike
) -> ComplexArray:
    """Return the force of a source on the receiver to which it is joined, complex peak [N].

    Parameters
    ----------
    source, receiver : array_like, shape (n_frequency, n_path, n_path)
        Uncoupled receptances at the interface [m/N]; a source behind mounts: `mounted_source`.
    free_displacement : array_like, shape (n_frequency, n_path)
        Motion of the source's interface when nothing is attached, complex peak [m].

    Notes
    -----
    ``g = (Y_A + Y_B)⁻¹ u_free``, from equal motion and opposite forces (thesis, eq. 9 and 10).
    """
    sizes: dict[str, int] = {}
    joined = _complex(source, "f p p", "receptance of the source", sizes)
    joined = joined + _complex(receiver, "f p p", "receptance of the receiver", sizes)
    free = _complex(free_displacement, "f p", "displacement of the interface", sizes)
    return _solve(joined, free[:, :, np.newaxis], "source plus receiver")[:, :, 0]


def blocked_force(source: npt.ArrayLike, free_displacement: npt.ArrayLike) -> ComplexArray:
    """Return the force of a source on a rigid receiver, ``f_bl = Y_A⁻¹ u_free`` [N].

    Arguments as for `interface_force`. A property of the source alone, which belongs with the
    assembled receptance, ``p = Y_AB f_bl`` (`assembled_frf`).
    """
    sizes: dict[str, int] = {}
    receptance = _complex(source, "f p p", "receptance of the source", sizes)
    free = _complex(free_displacement, "f p", "displacement of the interface", sizes)
    return _solve(receptance, free[:, :, np.newaxis], "source")[:, :, 0]


def blocked_force_on_rig(
    source: npt.ArrayLike, rig_force: npt.ArrayLike, rig_displacement: npt.ArrayLike
) -> ComplexArray:
    """Return the blocked force from a test rig that gives way, ``f_bl = g + Y_A⁻¹ u`` [N].

    Thesis, eq. 11; on a rigid rig u = 0 and the cells read f_bl.

    Parameters
    ----------
    source : array_like, shape (n_frequency, n_path, n_path) — receptance at the interface [m/N]
    rig_force, rig_displacement : array_like, shape (n_frequency, n_path)
        Force between source and rig, on the rig [N], and motion of the interface [m].
    """
    sizes: dict[str, int] = {}
    _complex(source, "f p p", "receptance of the source", sizes)
    force = _complex(rig_force, "f p", "force on the rig", sizes)
    return np.asarray(force + blocked_force(source, rig_displacement))


def force_on_moving_receiver(
    source: npt.ArrayLike, receiver: npt.ArrayLike, blocked: npt.ArrayLike
) -> ComplexArray:
    """Return the interface force of a source with known blocked forces on a receiver [N].

    Parameters
    ----------
    source, receiver : array_like, shape (n_frequency, n_path, n_path)
        Uncoupled receptances at the interface [m/N]; a source behind mounts: `mounted_source`.
    blocked : array_like, shape (n_frequency, n_path)
        Forces of the source on a receiver at rest, such as a test bench, complex peak [N].

    Notes
    -----
    ``g = (Y_A + Y_B)⁻¹ Y_A f_bl``, from `interface_force` with ``u_free = Y_A f_bl`` (thesis, eq. 9
    to 11; van der Seijs et al. 2016). With mounts of stiffness K on a source Y_S it is ``g = (K⁻¹ +
    Y_S + Y_B)⁻¹ (K⁻¹ + Y_S) f_bl``. It goes with the functions of the uncoupled receiver.
    """
    sizes: dict[str, int] = {}
    receptance = _complex(source, "f p p", "receptance of the source", sizes)
    force = _complex(blocked, "f p", "blocked forces", sizes)
    free = (receptance @ force[:, :, np.newaxis])[:, :, 0]
    return interface_force(receptance, receiver, free)


def assembled_frf(
    response: npt.ArrayLike,
    receiver: npt.ArrayLike,
    source: npt.ArrayLike,
    excitation: npt.ArrayLike,
) -> ComplexArray:
    """Return functions of the assembled bodies out of those of the uncoupled ones.

    Response on the receiver per force on the source, (n_frequency, n_output, n_input), unit of
    `response`.

    Parameters
    ----------
    response : array_like, shape (n_frequency, n_output, n_path)
        Response of the receiver per force at the interface; a noise transfer function [Pa/N], or
        the receptance of `receiver` [m/N].
    receiver, source : array_like, shape (n_frequency, n_path, n_path)
        Uncoupled receptances at the interface [m/N]; a source behind mounts: `mounted_source`.
    excitation : array_like, shape (n_frequency, n_path, n_input)
        Motion of the interface per force inside the source [m/N]; `source` itself for forces at the
        interface.

    Notes
    -----
    ``Y_AB = Y_B,oj (Y_A,jj + Y_B,jj)⁻¹ Y_A,ji``, dual coupling; the assembled function of the
    thesis, eq. 7 and 8.
    """
    sizes: dict[str, int] = {}
    joined = _complex(source, "f p p", "receptance of the source", sizes)
    joined = joined + _complex(receiver, "f p p", "receptance of the receiver", sizes)
    heard = _complex(response, "f o p", "responses of the receiver", sizes)
    excited = _complex(excitation, "f p i", "excitation of the source", sizes)
    return heard @ _solve(joined, excited, "source plus receiver")


def _complex(values: npt.ArrayLike, axes: str, item: str, sizes: dict[str, int]) -> ComplexArray:
    return checked_array(values, f"{axes} ?", item, sizes, complex)


def _solve(matrix: ComplexArray, right: ComplexArray, what: str) -> ComplexArray:
    try:
        return np.asarray(np.linalg.solve(matrix, right))
    except np.linalg.LinAlgError:
        raise InputError(
            f"the receptance of {what} is singular: leave out paths that move only together"
        ) from None


def _weighted(
    path_contributions: npt.ArrayLike, line_weight: npt.ArrayLike | None
) -> tuple[ComplexArray, RealArray]:
    sizes: dict[str, int] = {}
    values = _complex(path_contributions, "f p", "contributions of the paths", sizes)
    weight = np.ones(len(values)) if line_weight is None else line_weight
    return values, checked_array(weight, "f ?", "weights of the lines", sizes)
