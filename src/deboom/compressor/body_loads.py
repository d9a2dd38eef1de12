"""Loads of mounts and hoses on a body that moves, and sweeps corrected for its motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.hoses import hose_matrices, motion_at_virtual_point, running_mass
from deboom.compressor.identified_compressor import Identification
from deboom.compressor.model import applied
from deboom.compressor.mount_shares import stiffness_of_mounts
from deboom.errors import InputError
from deboom.measurement.channels import Frf
from deboom.measurement.compressor_test import (
    CompressorMount,
    HoseDrawing,
    HoseState,
    OperatingSweep,
    OperatingTest,
)
from deboom.measurement.electric_car import measured_lines
from deboom.measurement.noise_transfer import POINT_LOADS
from deboom.measurement.sensors import SENSOR_AXES
from deboom.measurement.virtual_point import RIGID_MOTIONS
from deboom.physics.rigid_body import forward_matrices

N_FORCE, N_WRENCH = 3, len(POINT_LOADS)
"""Loads of a mount, which has no rotational stiffness of its own, and of a hose."""

StiffnessCurve = Callable[[RealArray], ComplexArray]


def mount_forces(
    mounts: Sequence[CompressorMount], factor: npt.ArrayLike, travel: npt.ArrayLike
) -> ComplexArray:
    """Compute the force of each mount on the body.

    `factor` (n_frequency,): gain, and what the mounts have changed since it was found [1]; `travel`
    (n_frequency, 3 n): motion of the compressor minus motion of the body, x, y, z of each mount
    [m]. Returns (n_frequency, 3 n) complex peak [N].

    ``F_i = v(f) K_i (T_i x − y_i)``: thesis, section 4.5.1, with the body's motion y that the
    thesis leaves out.
    """
    apart = np.asarray(travel, dtype=complex)
    by_mount = apart.reshape(len(apart), len(mounts), N_FORCE)
    forces = np.einsum("iab,fib->fia", stiffness_of_mounts(tuple(mounts)), by_mount)
    scale = np.asarray(factor, dtype=complex)[:, np.newaxis]
    return np.asarray(scale * forces.reshape(apart.shape))


def body_receptance(
    accelerance: Frf,
    frequency: npt.ArrayLike,
    mounts: Sequence[str],
    hoses: Sequence[str] = (),
) -> ComplexArray:
    """Compute motion of the free body where mounts and hoses push, per load there.

    `frequency` (n_frequency,): measured lines [Hz]. Returns (n_frequency, 3 n_mount + 6 n_hose, 3
    n_mount + 6 n_hose) [m/N, 1/N, 1/(N m)]. InputError: a point without accelerances, or a line
    that was not measured.
    """
    lines = np.asarray(frequency, dtype=float)
    chosen = [(name, N_FORCE) for name in mounts] + [(name, N_WRENCH) for name in hoses]
    points = {name.rpartition(" ")[0] for name in accelerance.inputs}
    for name, _ in chosen:
        if name not in points:
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
) -> tuple[ComplexArray, ComplexArray]:
    """Find the loads on the body where accelerometers show how the body moves at the mounts.

    `factor` (n_frequency,): factor on their stiffness [1]; `displacement` (n_frequency, 6): motion
    of the compressor at its virtual point [m, rad]; `holder` (n_frequency, 3 n_mount): motion of
    the body at the mounts [m]; with hoses go their lines `frequency` (n_frequency,) [Hz] and the
    `receptance` of the body.

    Returns loads (n_frequency, 3 n_mount + 6 n_hose), three forces of each mount, then three forces
    and three moments of each hose at its end [N, N m], and the motion of the body at these ends
    (n_frequency, 6 n_hose) [m, rad].

    ``F_m = v K (T x − y)`` and, with the free body's receptances Y,
    ``F_h = (1 + Z Y_hh)⁻¹ (S x − Z Y_hm F_m)``, where a hose pushes on the body with ``S x − Z b``.
    """
    travel = displacement @ _rows(mounts).T - holder
    forces = mount_forces(mounts, factor, travel)
    if receptance is None or not hoses:
        return forces, np.zeros((len(forces), 0), dtype=complex)
    matrices = hose_matrices(hoses, frequency)
    free = applied(matrices.transfer, displacement)
    n = forces.shape[1]
    by_mounts = applied(receptance[:, n:, :n], forces)
    at_ends = receptance[:, n:, n:]
    flexible = np.eye(at_ends.shape[-1]) + matrices.body @ at_ends
    loads = _solved(flexible, free - applied(matrices.body, by_mounts))
    return np.hstack([forces, loads]), by_mounts + applied(at_ends, loads)


def _rows(mounts: Sequence[CompressorMount]) -> RealArray:
    """Motion of the virtual point → motion of each mount, shape (3 n, 6)."""
    return forward_matrices(np.array([mount.position for mount in mounts]))


def _solved(matrices: ComplexArray, vectors: ComplexArray) -> ComplexArray:
    """Solve line by line."""
    return np.asarray(np.linalg.solve(matrices, vectors[..., np.newaxis])[..., 0], dtype=complex)


def on_rigid_foundation(
    test: OperatingTest,
    identification: Identification,
    mounts: Sequence[CompressorMount],
    change: StiffnessCurve | None = None,
    hoses: tuple[HoseDrawing, ...] = (),
    accelerance: Frf | None = None,
) -> OperatingTest:
    """Take the motion of the body off the accelerations of a running compressor.

    `change`: lines [Hz] → δ of the mounts' stiffness [1]; `hoses` need the body's `accelerance`.

    Returns the test with the accelerations that the same load would cause on a rigid foundation.
    InputError: a sweep without holder accelerations of a mount, a hose without accelerances.

    The body's motions y at the mounts and b at the hoses drive the compressor,
    ``AM a = F + Σ Tᵀ v K y + Sᵀ b``, so that ``a − AM⁻¹ (Σ Tᵀ v K y + Sᵀ b)`` is the motion by F
    alone; b is predicted by the free body's accelerances. A change of the mounts since the hammer
    test that is not known yet enters this small part only. What sees the sweeps afterwards may take
    the foundation as rigid.
    """
    sweeps = []
    for sweep in test.sweeps:
        lines, holder = sweep.frequency, holder_displacement(sweep, mounts)
        changed = np.zeros(lines.size, dtype=complex) if change is None else change(lines)
        factor = identification.calibrated.model.gain.at(lines) * (1 + changed)
        # the gyroscopic moment has no part in a motion this small
        mass, _ = running_mass(identification, lines, change=changed)
        load = mount_forces(mounts, factor, holder) @ _rows(mounts)
        if accelerance is not None and hoses and sweep.hoses is HoseState.STANDARD:
            matrices = hose_matrices(hoses, lines)
            places = [mount.name for mount in mounts], [hose.name for hose in hoses]
            receptance = body_receptance(accelerance, lines, *places)
            displacement = displacement_at_virtual_point(sweep, identification)
            _, ends = loads_by_measured_holders(
                mounts, factor, displacement, holder, hoses, lines, receptance
            )
            load = load + applied(np.swapaxes(matrices.transfer, -1, -2), ends)
            mass = mass - matrices.point / (2 * np.pi * lines[:, np.newaxis, np.newaxis]) ** 2
        seen = _solved(mass, load) @ identification.calibrated.response_matrix.T
        measured = sweep.acceleration
        sweeps.append(replace(sweep, acceleration=replace(measured, values=measured.values - seen)))
    return replace(test, sweeps=tuple(sweeps))


def holder_displacement(sweep: OperatingSweep, mounts: Sequence[CompressorMount]) -> ComplexArray:
    """Return the motion of the body at the mounts, shape (n_frequency, 3 n) [m].

    InputError: no accelerations on the body side of a mount.
    """
    names = [f"{mount.name} {axis}" for mount in mounts for axis in SENSOR_AXES]
    recorded = () if sweep.holder is None else sweep.holder.channels
    missing = [name for name in names if name not in recorded]
    if sweep.holder is None or missing:
        raise InputError(
            f"sweep {sweep.name} has no body-side acceleration '{missing[0]}': record it, or "
            "predict the motion of the body from its accelerances"
        )
    square = (2 * np.pi * sweep.frequency[:, np.newaxis]) ** 2
    return np.asarray(-sweep.holder.select(names).values / square)


def displacement_at_virtual_point(
    sweep: OperatingSweep, identification: Identification
) -> ComplexArray:
    """Return the motion of the compressor by its calibrated sensors, (n_frequency, 6) [m, rad]."""
    acceleration, _ = motion_at_virtual_point(sweep, identification)
    return np.asarray(-acceleration / (2 * np.pi * sweep.frequency[:, np.newaxis]) ** 2)
