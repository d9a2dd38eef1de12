"""Loads of mounts and hoses on a body that moves: measured, predicted or left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray
from deboom.compressor.hose_beams import hose_matrices
from deboom.compressor.mount_forces import AXES, motion_at_mounts, mount_forces, stiffness_of_mounts
from deboom.errors import InputError
from deboom.measurement.channel_geometry import RIGID_MOTIONS
from deboom.measurement.noise_transfer import POINT_LOADS
from deboom.measurement.wrench_noise_transfer import measured_lines

if TYPE_CHECKING:
    from deboom.measurement.channels import Frf
    from deboom.measurement.inertance_test import CompressorMount
    from deboom.measurement.operating_sweep import HoseDrawing

N_WRENCH = len(POINT_LOADS)


@dataclass(frozen=True, eq=False)
class BodyLoads:
    """What compressor and hoses do to the body over the speed of a sweep.

    Parameters
    ----------
    mounts : array, shape (n_frequency, 3 n_mount)
        x, y, z of each mount [N].
    hoses : array, shape (n_frequency, 6 n_hose)
        Three forces and three moments of each hose at its end [N, N m].
    hose_ends : array, shape (n_frequency, 6 n_hose)
        Motion of the body there [m, rad].
    """

    mounts: ComplexArray
    hoses: ComplexArray
    hose_ends: ComplexArray


def body_receptance(
    accelerance: Frf,
    frequency: npt.ArrayLike,
    mounts: Sequence[str],
    hoses: Sequence[str] = (),
) -> ComplexArray:
    """Motion of the free body where mounts and hoses push, per load there.

    Parameters
    ----------
    accelerance : Frf
        From `deboom.measurement.wrench_noise_transfer.wrench_accelerance`.
    frequency : array, shape (n_frequency,)
        Measured lines [Hz].
    mounts, hoses : sequence of str
        Names of points: three motions of each of the first, six of each of the second.

    Returns
    -------
    array, shape (n_frequency, 3 n_mount + 6 n_hose, 3 n_mount + 6 n_hose)
        [m/N, 1/N, 1/(N m)].

    Raises
    ------
    InputError
        A point without accelerances, or a line that was not measured.
    """
    lines = np.asarray(frequency, dtype=float)
    chosen = [(name, AXES) for name in mounts] + [(name, N_WRENCH) for name in hoses]
    known = {name.rpartition(" ")[0] for name in accelerance.inputs}
    for name, _ in chosen:
        if name not in known:
            raise InputError(
                f"there are no accelerances of the body at '{name}': strike it there as well"
            )
    part = accelerance.select(
        [f"{name} {motion}" for name, count in chosen for motion in RIGID_MOTIONS[:count]],
        [f"{name} {load}" for name, count in chosen for load in POINT_LOADS[:count]],
    )
    rows = measured_lines(part.frequency, lines)
    return np.asarray(-part.values[rows] / (2 * np.pi * lines[:, np.newaxis, np.newaxis]) ** 2)


def loads_by_measured_holders(
    mounts: Sequence[CompressorMount],
    factor: npt.ArrayLike,
    displacement: ComplexArray,
    holder: ComplexArray,
    hoses: Sequence[HoseDrawing] = (),
    frequency: npt.ArrayLike = (),
    receptance: ComplexArray | None = None,
) -> BodyLoads:
    """Find the loads where accelerometers show how the body moves at the mounts.

    Parameters
    ----------
    mounts : sequence of CompressorMount
    factor : complex array, shape (n_frequency,)
        On their stiffness [1].
    displacement : array, shape (n_frequency, 6)
        Of the compressor at its virtual point [m, rad].
    holder : array, shape (n_frequency, 3 n_mount)
        Of the body at the mounts [m].
    hoses : sequence of HoseDrawing
        None where long soft ones cut their paths.
    frequency : array, shape (n_frequency,)
        With hoses [Hz].
    receptance : array, optional
        From `body_receptance`: how the body moves at the hoses' ends, where nothing was measured;
        without it these stand still.

    Returns
    -------
    BodyLoads

    Notes
    -----
    ``F_m = v K (T x − y)`` and, with the free body's receptances Y, ``F_h = (1 + Z Y_hh)⁻¹ (S x −
    Z Y_hm F_m)``, where a hose pushes on the body with ``S x − Z b``.
    """
    forces = mount_forces(mounts, factor, motion_at_mounts(mounts, displacement) - holder)
    if not hoses:
        return _without_hoses(forces)
    matrices = hose_matrices(hoses, frequency)
    free = matrices.body_load(displacement)
    if receptance is None:
        return BodyLoads(forces, free, np.zeros_like(free))
    n = forces.shape[1]
    by_mounts = _times(receptance[:, n:, :n], forces)
    own = receptance[:, n:, n:]
    flexible = np.eye(own.shape[-1]) + matrices.body @ own
    loads = _solved(flexible, free - _times(matrices.body, by_mounts))
    return BodyLoads(forces, loads, by_mounts + _times(own, loads))


def loads_by_predicted_holders(
    mounts: Sequence[CompressorMount],
    factor: npt.ArrayLike,
    displacement: ComplexArray,
    receptance: ComplexArray,
    hoses: Sequence[HoseDrawing] = (),
    frequency: npt.ArrayLike = (),
) -> BodyLoads:
    """Find the loads where the body's own receptances say how it moves.

    Parameters
    ----------
    mounts, factor, displacement, hoses, frequency
        As for `loads_by_measured_holders`.
    receptance : array
        From `body_receptance`, of these mounts and hoses.

    Returns
    -------
    BodyLoads

    Notes
    -----
    ``L = (1 + Z Y)⁻¹ S x``: every element pushes on the body with ``S x − Z b``, and ``b = Y L``.
    """
    n = AXES * len(mounts)
    scale = np.asarray(factor, dtype=complex)[:, np.newaxis, np.newaxis]
    size = receptance.shape[-1]
    stiffness = np.zeros((scale.shape[0], size, size), dtype=complex)
    for number, own in enumerate(stiffness_of_mounts(mounts)):
        place = slice(AXES * number, AXES * (number + 1))
        stiffness[:, place, place] = scale * own
    free = mount_forces(mounts, factor, motion_at_mounts(mounts, displacement))
    if hoses:
        matrices = hose_matrices(hoses, frequency)
        stiffness[:, n:, n:] = matrices.body
        free = np.hstack([free, matrices.body_load(displacement)])
    loads = _solved(np.eye(size) + stiffness @ receptance, free)
    return BodyLoads(loads[:, :n], loads[:, n:], _times(receptance, loads)[:, n:])


def loads_on_still_body(
    mounts: Sequence[CompressorMount],
    factor: npt.ArrayLike,
    displacement: ComplexArray,
    hoses: Sequence[HoseDrawing] = (),
    frequency: npt.ArrayLike = (),
) -> BodyLoads:
    """Find the loads as if the body stood still: what leaving its motion out amounts to.

    Parameters
    ----------
    mounts, factor, displacement, hoses, frequency
        As for `loads_by_measured_holders`.

    Returns
    -------
    BodyLoads
    """
    n = AXES * len(mounts)
    still = np.zeros((len(displacement), n), dtype=complex)
    return loads_by_measured_holders(mounts, factor, displacement, still, hoses, frequency)


def _without_hoses(forces: ComplexArray) -> BodyLoads:
    none: ComplexArray = np.zeros((len(forces), 0), dtype=complex)
    return BodyLoads(forces, none, none)


def _times(matrices: ComplexArray, vectors: ComplexArray) -> ComplexArray:
    return np.asarray((matrices @ vectors[..., np.newaxis])[..., 0])


def _solved(matrices: ComplexArray, vectors: ComplexArray) -> ComplexArray:
    return np.asarray(np.linalg.solve(matrices, vectors[..., np.newaxis])[..., 0], dtype=complex)
