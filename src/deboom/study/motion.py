"""Options of a study that stand for models: which motion answers a design, which kernel sums."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from typing import Any

from deboom.files.platform import Platform
from deboom.measurement.load_case import LoadCase
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


def motion_index(
    platform: Platform,
    group: str,
    load_cases: Sequence[tuple[LoadCase, float]],
    band: tuple[float, float],
    motion: Motion,
    kernel: Kernel | None,
) -> LoadCaseIndex[Any, Any]:
    """Build the booming index of a group of vehicles under one model of the motion.

    Parameters
    ----------
    platform : Platform
        As measured.
    group : str
        Of vehicles, such as ``U06``.
    load_cases : sequence of (LoadCase, weight)
        Weights are normalised [1].
    band : (lower, upper)
        Lines that count, both edges included [Hz].
    motion : Motion
        Which model.
    kernel : Kernel or None
        None takes numpy for prescribed and numba for coupled motion.

    Raises
    ------
    InputError
        An unknown group, data that do not fit together, or numba asked for and not installed.
    """
    chosen = _KERNELS[motion][kernel or _DEFAULT[motion]]
    fleet = platform.fleet.group(group)
    if motion is Motion.coupled:
        return coupled_index(fleet, platform.mounts, platform.powertrain, load_cases, band, chosen)
    return booming_index(fleet, platform.mounts, load_cases, band, chosen)
