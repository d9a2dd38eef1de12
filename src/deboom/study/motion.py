"""Options of a study that stand for models: which motion answers a design, which kernel sums."""

from __future__ import annotations

from enum import Enum
from typing import Any

from deboom.study.mount_source import Operation
from deboom.vehicles.booming_index import booming_index
from deboom.vehicles.coupled_index import coupled_index
from deboom.vehicles.kernel_coupled_numpy import NUMPY_COUPLED
from deboom.vehicles.kernel_numba import NUMBA, NUMBA_COUPLED
from deboom.vehicles.kernel_numpy import NUMPY
from deboom.vehicles.load_case_index import LoadCaseIndex


class Motion(Enum):
    """What the powertrain does when a stiffness changes."""

    prescribed = "prescribed"
    """It moves as measured: the thesis."""
    coupled = "coupled"
    """Its six degrees of freedom and those of the wheel ends are solved again."""


class Kernel(Enum):
    """What sums the levels."""

    numpy = "numpy"
    numba = "numba"


_KERNELS: dict[Motion, dict[Kernel, Any]] = {
    Motion.prescribed: {Kernel.numpy: NUMPY, Kernel.numba: NUMBA},
    Motion.coupled: {Kernel.numpy: NUMPY_COUPLED, Kernel.numba: NUMBA_COUPLED},
}
_DEFAULT = {Motion.prescribed: Kernel.numpy, Motion.coupled: Kernel.numba}


def motion_index(runs: Operation, motion: Motion, kernel: Kernel | None) -> LoadCaseIndex[Any, Any]:
    """Build the booming index of a study's runs under one model of the motion.

    Parameters
    ----------
    runs : Operation
        Vehicles, mounts, load cases and band.
    motion : Motion
        Which model.
    kernel : Kernel or None
        None takes numpy for prescribed and numba for coupled motion.

    Raises
    ------
    InputError
        Data that do not fit together, or numba asked for and not installed.
    """
    chosen = _KERNELS[motion][kernel or _DEFAULT[motion]]
    data = runs.platform
    if motion is Motion.coupled:
        return coupled_index(
            runs.fleet, data.mounts, data.powertrain, runs.cases, runs.band, chosen
        )
    return booming_index(runs.fleet, data.mounts, runs.cases, runs.band, chosen)
