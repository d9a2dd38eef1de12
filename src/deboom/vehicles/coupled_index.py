"""The seam to the exploration with coupled motion: the body answers to other stiffnesses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.measurement.load_case import LoadCase
from deboom.mounts.mount import Mount
from deboom.vehicles.coupled_identification import coupled_motion
from deboom.vehicles.coupled_motion import CoupledMotion
from deboom.vehicles.fleet import Band, Fleet
from deboom.vehicles.load_case_index import LevelSum, LoadCaseIndex
from deboom.vehicles.powertrain import Powertrain


class CoupledKernel(Protocol):
    """A way to re-solve the motion and sum the levels; all kernels agree within 1e-9 dB."""

    @property
    def name(self) -> str:
        """What the run's record calls it."""

    def prepare(self, motion: CoupledMotion) -> LevelSum:
        """Lay out the equations of motion of one load case, once."""


@dataclass(frozen=True, eq=False)
class CoupledIndex(LoadCaseIndex[CoupledMotion, CoupledKernel]):
    """SPLV of every vehicle, as a function of the stiffness factors; the motion is re-solved.

    The same seam as `deboom.vehicles.booming_index.BoomingIndex`: a value that can be pickled, and
    a design gives the same bits however designs are batched or ordered.

    Parameters
    ----------
    contributions : sequence of CoupledMotion
        One per load case, of the same vehicles, lines and variables.
    weights : sequence of float
        Of the load cases, not negative; kept normalised to a sum of 1, without load cases of
        weight 0 [1].
    kernel : CoupledKernel
        Such as `deboom.vehicles.kernel_numba.NUMBA_COUPLED`.

    Raises
    ------
    InputError
        Weights that are negative or all zero, load cases that differ in vehicles, lines or
        variables, or a line to which no path of a vehicle contributes.

    Notes
    -----
    Levels and SPLV as in thesis, eq. 35; the pressure is that of `CoupledMotion.pressure`, and the
    gradient that of its adjoint.
    """

    def _level_sum(self, case: CoupledMotion) -> LevelSum:
        return self.kernel.prepare(case)

    def _transmits(self, case: CoupledMotion) -> npt.NDArray[np.bool_]:
        both = np.concatenate([case.transfer, case.own_transfer], axis=2)
        return np.asarray(both.any(axis=2))

    def _pressure(self, case: CoupledMotion, designs: RealArray) -> ComplexArray:
        return case.pressure(designs)

    def _neper_gradient(self, case: CoupledMotion, designs: RealArray) -> RealArray:
        return case.neper_gradient(designs)


def coupled_index(
    fleet: Fleet,
    mounts: Sequence[Mount],
    powertrain: Powertrain,
    load_cases: Sequence[tuple[LoadCase, float]],
    band: Band,
    kernel: CoupledKernel,
) -> CoupledIndex:
    """Return the booming index of a fleet over weighted load cases, with the motion coupled.

    Parameters
    ----------
    fleet : Fleet
        One response per vehicle.
    mounts : sequence of Mount
        Three design variables per mount.
    powertrain : Powertrain
        Mass and inertia from the data sheet.
    load_cases : sequence of (LoadCase, weight)
        Weights are not negative and are normalised to a sum of 1 [1].
    band : (lower, upper)
        Lines that count, both edges included [Hz].
    kernel : CoupledKernel
        Such as `deboom.vehicles.kernel_numba.NUMBA_COUPLED`.

    Returns
    -------
    CoupledIndex

    Raises
    ------
    InputError
        See `deboom.vehicles.coupled_identification.coupled_motion` and `CoupledIndex`.
    """
    cases = tuple(coupled_motion(fleet, mounts, powertrain, case, band) for case, _ in load_cases)
    return CoupledIndex(cases, tuple(weight for _, weight in load_cases), kernel)
