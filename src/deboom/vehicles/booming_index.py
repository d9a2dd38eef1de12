"""The seam to the exploration: designs of the mounts in, one number per vehicle out.

Here the motion is prescribed; `deboom.vehicles.coupled_index` lets it answer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.measurement.load_case import LoadCase
from deboom.mounts.mount import Mount
from deboom.vehicles.fleet import Band, Fleet, PathContributions, path_contributions
from deboom.vehicles.load_case_index import LevelSum, LoadCaseIndex
from deboom.vehicles.synthesis import pressure


class LevelSumKernel(Protocol):
    """A way to compute sums of levels; all kernels agree within 1e-9 dB."""

    @property
    def name(self) -> str:
        """What the run's record calls it."""

    def prepare(self, contributions: ComplexArray) -> LevelSum:
        """Lay out contributions, shape (n_vehicle, n_frequency, n_variable) [Pa], once."""


@dataclass(frozen=True, eq=False)
class BoomingIndex(LoadCaseIndex[PathContributions, LevelSumKernel]):
    """SPLV of every vehicle, as a function of the stiffness factors; the motion is prescribed.

    ``index(designs)`` is all that an exploration needs. The object is a value: it can be pickled
    into a process pool, and a design gives the same bits however designs are batched or ordered.

    Parameters
    ----------
    contributions : sequence of PathContributions
        One per load case, of the same vehicles, lines and variables.
    weights : sequence of float
        Of the load cases, not negative; kept normalised to a sum of 1, without load cases of
        weight 0 [1].
    kernel : LevelSumKernel
        Such as `deboom.vehicles.kernel_numpy.NUMPY`.

    Raises
    ------
    InputError
        Weights that are negative or all zero, load cases that differ in vehicles, lines or
        variables, or a line to which no path of a vehicle contributes.

    Notes
    -----
    ``SPLV_v = Σ_c w_c Σ_f [20 lg(|Σ_k x_k C_cvfk| / (√2 p0)) + A(f)]``, thesis, eq. 35, as the mean
    over load cases. A sum of decibels counts 1 dB in a notch like 1 dB at a peak. The gradient is
    that of ``p = Σ_k x_k C_k``, thus ``∂p/∂x_k = C_k``.
    """

    def _level_sum(self, case: PathContributions) -> LevelSum:
        return self.kernel.prepare(case.values)

    def _transmits(self, case: PathContributions) -> npt.NDArray[np.bool_]:
        return np.asarray(case.values.any(axis=2))

    def _pressure(self, case: PathContributions, designs: RealArray) -> ComplexArray:
        return pressure(case, designs)

    def _neper_gradient(self, case: PathContributions, designs: RealArray) -> RealArray:
        inverse = 1.0 / pressure(case, designs)
        return np.asarray(np.einsum("vfk,dvf->dvk", case.values, inverse).real)


def booming_index(
    fleet: Fleet,
    mounts: Sequence[Mount],
    load_cases: Sequence[tuple[LoadCase, float]],
    band: Band,
    kernel: LevelSumKernel,
) -> BoomingIndex:
    """Return the booming index of a fleet over weighted load cases, with the motion prescribed.

    Parameters
    ----------
    fleet : Fleet
        One response per vehicle.
    mounts : sequence of Mount
        Three design variables per mount.
    load_cases : sequence of (LoadCase, weight)
        Weights are not negative and are normalised to a sum of 1 [1].
    band : (lower, upper)
        Lines that count, both edges included [Hz].
    kernel : LevelSumKernel
        Such as `deboom.vehicles.kernel_numpy.NUMPY`.

    Returns
    -------
    BoomingIndex

    Raises
    ------
    InputError
        See `path_contributions` and `BoomingIndex`.
    """
    cases = tuple(path_contributions(fleet, mounts, case, band) for case, _ in load_cases)
    return BoomingIndex(cases, tuple(weight for _, weight in load_cases), kernel)
