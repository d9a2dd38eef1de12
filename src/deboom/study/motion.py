"""Options of a study that stand for models: motion, kernel, and what a stiffness factor means."""

from __future__ import annotations

import sys
from enum import Enum
from typing import Any

from deboom.errors import InputError
from deboom.study.mount_source import Operation
from deboom.vehicles.amplitude_index import AmplitudeIndex, amplitude_index
from deboom.vehicles.booming_index import booming_index
from deboom.vehicles.coupled_index import coupled_index
from deboom.vehicles.design_factor import DYNAMIC, DesignFactor, PartFactor
from deboom.vehicles.design_factor import Factor as Factor  # an option beside those below
from deboom.vehicles.kernel_amplitude_numba import NUMBA_AMPLITUDE
from deboom.vehicles.kernel_amplitude_numpy import NUMPY_AMPLITUDE
from deboom.vehicles.kernel_coupled_numpy import NUMPY_COUPLED
from deboom.vehicles.kernel_numba import NUMBA, NUMBA_COUPLED
from deboom.vehicles.kernel_numpy import NUMPY
from deboom.vehicles.kernel_smooth_numpy import SMOOTH_COUPLED
from deboom.vehicles.kinematic_model import library_model
from deboom.vehicles.loss_factor_index import (
    LossFactorIndex,
    booming_loss_index,
    coupled_loss_index,
)

PART_WARNING = (
    "A stiffness factor means the rubber itself, with its stops where they were: a softer part "
    "rides deeper into its stop and most of the benefit is lost (on the virtual test bench about "
    "1 dB is left of 3.5 dB)."
)


class Motion(Enum):
    """What the powertrain does when a stiffness changes."""

    prescribed = "prescribed"
    """It moves as measured: the thesis."""
    coupled = "coupled"
    """Its six degrees of freedom and those of the wheel ends are solved again."""
    amplitude = "amplitude"
    """So are they, and the stiffnesses follow the amplitudes that come out."""


class Kernel(Enum):
    """What sums the levels."""

    numpy = "numpy"
    numba = "numba"
    smooth = "smooth"
    """Coupled motion interpolated over frequency: for smooth data, which measured ones are not."""


_AMPLITUDE = {Kernel.numpy: NUMPY_AMPLITUDE, Kernel.numba: NUMBA_AMPLITUDE}
_KERNELS: dict[Motion, dict[Kernel, Any]] = {
    Motion.prescribed: {Kernel.numpy: NUMPY, Kernel.numba: NUMBA},
    Motion.coupled: {
        Kernel.numpy: NUMPY_COUPLED,
        Kernel.numba: NUMBA_COUPLED,
        Kernel.smooth: SMOOTH_COUPLED,
    },
    Motion.amplitude: _AMPLITUDE,
}
_DEFAULT = {
    Motion.prescribed: Kernel.numpy,
    Motion.coupled: Kernel.numba,
    Motion.amplitude: Kernel.numba,
}


def motion_index(
    runs: Operation,
    motion: Motion,
    kernel: Kernel | None,
    factor: Factor = Factor.dynamic,
    *,
    loss_factors: bool = False,
) -> Any:
    """Build the booming index of a study's runs under one model of the motion.

    Parameters
    ----------
    runs : Operation
        Vehicles, mounts, load cases and band.
    motion : Motion
        Which model.
    kernel : Kernel or None
        None takes numpy for prescribed and numba for any other motion.
    factor : Factor
        What a stiffness factor means; the warning that ``part`` needs is printed.
    loss_factors : bool
        Whether the loss factors are variables, too.

    Returns
    -------
    LoadCaseIndex or LossFactorIndex

    Raises
    ------
    InputError
        Data that do not fit together, a kernel that is not made for the motion or the data, or
        numba asked for and not installed.
    """
    if loss_factors:
        return _loss_factor_index(runs, motion, kernel, factor)
    if motion is Motion.amplitude or factor is Factor.part:
        return _amplitude_index(runs, motion, kernel, factor)
    chosen = _kernel(_KERNELS[motion], motion, kernel)
    data = runs.platform
    if motion is Motion.coupled:
        return coupled_index(
            runs.fleet, data.mounts, data.powertrain, runs.cases, runs.band, chosen
        )
    return booming_index(runs.fleet, data.mounts, runs.cases, runs.band, chosen)


def _loss_factor_index(
    runs: Operation, motion: Motion, kernel: Kernel | None, factor: Factor
) -> LossFactorIndex:
    data = runs.platform
    if motion is Motion.amplitude or factor is Factor.part:
        raise InputError(
            "loss factors are variables with --motion prescribed or coupled and --factor dynamic: "
            "there the mounts stay where they are"
        )
    if motion is Motion.prescribed:
        chosen = _kernel(_KERNELS[motion], motion, kernel)
        return booming_loss_index(runs.fleet, data.mounts, runs.cases, runs.band, chosen)
    if kernel not in (None, Kernel.numpy):
        raise InputError("coupled motion with loss factors has a numpy kernel only")
    return coupled_loss_index(runs.fleet, data.mounts, data.powertrain, runs.cases, runs.band)


def _kernel(kernels: dict[Kernel, Any], motion: Motion, kernel: Kernel | None) -> Any:
    wanted = kernel or _DEFAULT[motion]
    if wanted not in kernels:
        raise InputError(
            f"there is no {wanted.value} kernel for {motion.value} motion: use one of "
            f"{[kernel.value for kernel in kernels]}"
        )
    return kernels[wanted]


def _amplitude_index(
    runs: Operation, motion: Motion, kernel: Kernel | None, factor: Factor
) -> AmplitudeIndex:
    if motion is Motion.prescribed:
        raise InputError(
            "a part that settles elsewhere moves otherwise too: --factor part goes with --motion "
            "coupled or amplitude"
        )
    if not runs.parts:
        raise InputError(
            "amplitude-dependent motion and --factor part need the surfaces and static curves of "
            "the mount library: take --mounts library"
        )
    carriers = {mount.name for mount in runs.platform.mounts if mount.body_mass is None}
    meaning: DesignFactor = DYNAMIC
    if factor is Factor.part:
        meaning = PartFactor(library_model([p for p in runs.parts if p.mount.name in carriers]))
        print(PART_WARNING, file=sys.stderr)
    data = runs.platform
    return amplitude_index(
        *(runs.fleet, data.mounts, runs.parts, data.powertrain, runs.cases, runs.band),
        kernel=_kernel(_AMPLITUDE, motion, kernel),
        factor=meaning,
        follow=motion is Motion.amplitude,
    )
