"""Sweeps on a body that gives way, turned into what they were on a rigid foundation."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.body_loads import body_receptance, loads_by_measured_holders
from deboom.compressor.hose_beams import hose_matrices
from deboom.compressor.hose_sweeps import motion_at_virtual_point, running_compressor
from deboom.compressor.mount_forces import load_at_virtual_point, mount_forces
from deboom.errors import InputError
from deboom.measurement.channels import Spectrum
from deboom.measurement.operating_sweep import HoseState
from deboom.measurement.sensors import SENSOR_AXES

if TYPE_CHECKING:
    from deboom.compressor.identify import Identification
    from deboom.measurement.channels import Frf
    from deboom.measurement.inertance_test import CompressorMount
    from deboom.measurement.operating_sweep import HoseDrawing, OperatingSweep, OperatingTest

StiffnessCurve = Callable[[RealArray], ComplexArray]


@dataclass(frozen=True, eq=False)
class Neighbours:
    """What a compressor hangs on beside its mounts, and how the body answers.

    Parameters
    ----------
    hoses : tuple of HoseDrawing
        Standard ones, called like the points of the body; empty where they are not known.
    accelerance : Frf
        Of the free body at mounts and hoses, from `wrench_accelerance`.
    """

    hoses: tuple[HoseDrawing, ...]
    accelerance: Frf


def on_rigid_foundation(
    test: OperatingTest,
    found: Identification,
    mounts: Sequence[CompressorMount],
    neighbours: Neighbours | None = None,
    change: StiffnessCurve | None = None,
) -> OperatingTest:
    """Take the motion of the body off the accelerations of a running compressor.

    Parameters
    ----------
    test : OperatingTest
        With accelerations on the body side of the mounts in every sweep.
    found : Identification
        Of its hammer test, which stood on a rigid foundation.
    mounts : sequence of CompressorMount
        Called like the holders.
    neighbours : Neighbours, optional
        Without it, what the body does through the hoses stays in the sweeps that have them.
    change : callable, optional
        Lines [Hz] → change of the mounts' stiffness since the hammer test [1]; none by default.

    Returns
    -------
    OperatingTest
        With the accelerations that the same load would cause on a rigid foundation.

    Raises
    ------
    InputError
        A sweep without holder accelerations of a mount, a hose without accelerances.

    Notes
    -----
    The body's motions y at the mounts and b at the hoses drive the compressor, ``AM a = F + Σ Tᵀ v
    K y + Sᵀ b``, so that ``a − AM⁻¹ (Σ Tᵀ v K y + Sᵀ b)`` is the motion by F alone; b is predicted
    by the free body's accelerances. A change of the mounts since the hammer test that is not known
    yet enters this small part only. What sees the sweeps afterwards may take the foundation as
    rigid.
    """
    return replace(
        test,
        sweeps=tuple(_corrected(sweep, found, mounts, neighbours, change) for sweep in test.sweeps),
    )


def holder_displacement(sweep: OperatingSweep, mounts: Sequence[CompressorMount]) -> ComplexArray:
    """Return how the body moves at the mounts.

    Parameters
    ----------
    sweep : OperatingSweep
    mounts : sequence of CompressorMount

    Returns
    -------
    array, shape (n_frequency, 3 n)
        x, y, z of each mount [m].

    Raises
    ------
    InputError
        No accelerations on the body side of a mount.
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


def displacement_at_virtual_point(sweep: OperatingSweep, found: Identification) -> ComplexArray:
    """Return how the compressor moves, by the calibrated accelerometers.

    Parameters
    ----------
    sweep : OperatingSweep
    found : Identification

    Returns
    -------
    array, shape (n_frequency, 6)
        [m, rad].
    """
    acceleration, _ = motion_at_virtual_point(sweep, found)
    return np.asarray(-acceleration / (2 * np.pi * sweep.frequency[:, np.newaxis]) ** 2)


def _corrected(
    sweep: OperatingSweep,
    found: Identification,
    mounts: Sequence[CompressorMount],
    neighbours: Neighbours | None,
    change: StiffnessCurve | None,
) -> OperatingSweep:
    lines, holder = sweep.frequency, holder_displacement(sweep, mounts)
    changed = np.zeros(lines.size, dtype=complex) if change is None else change(lines)
    factor = found.calibrated.model.gain.at(lines) * (1 + changed)
    # the gyroscopic moment has no part in a motion this small
    mass = running_compressor(found, lines, change=changed).apparent_mass
    load = load_at_virtual_point(mounts, mount_forces(mounts, factor, holder))
    if neighbours is not None and neighbours.hoses and sweep.hoses is HoseState.STANDARD:
        hoses = neighbours.hoses
        matrices = hose_matrices(hoses, lines)
        ends = loads_by_measured_holders(
            mounts,
            factor,
            displacement_at_virtual_point(sweep, found),
            holder,
            hoses,
            lines,
            body_receptance(
                neighbours.accelerance,
                lines,
                [mount.name for mount in mounts],
                [hose.name for hose in hoses],
            ),
        ).hose_ends
        load = load + matrices.compressor_load(np.zeros_like(load), ends)
        mass = mass - matrices.point / (2 * np.pi * lines[:, np.newaxis, np.newaxis]) ** 2
    follows = np.linalg.solve(mass, load[:, :, np.newaxis])[:, :, 0]
    calibrated = found.calibrated
    seen = follows @ calibrated.placement.response_matrix(calibrated.errors).T
    measured = sweep.acceleration
    return replace(
        sweep,
        acceleration=Spectrum(lines, measured.values - seen, measured.channels, measured.unit),
    )
