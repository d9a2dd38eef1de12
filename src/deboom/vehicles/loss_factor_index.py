"""Loss factors as design variables beside the stiffness factors: ``K → x (K' + j y K'')``.

The pressure stays a linear form, and the equation of motion stays one of springs, in the factors
``x`` of the elastic and ``x y`` of the lossy part. So an index over the split parts does the work,
and an index without loss factors is as fast as before.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.measurement.load_case import LoadCase
from deboom.mounts.mount import Mount
from deboom.physics.dynamic_stiffness import dynamic_stiffness
from deboom.vehicles.booming_index import BoomingIndex, LevelSumKernel
from deboom.vehicles.coupled_identification import coupled_motion
from deboom.vehicles.coupled_index import CoupledIndex
from deboom.vehicles.fleet import Band, Fleet, PathContributions, path_contributions
from deboom.vehicles.kernel_split_numpy import NUMPY_SPLIT, split_motion, with_loss
from deboom.vehicles.load_case_index import LoadCaseIndex
from deboom.vehicles.powertrain import Powertrain
from deboom.vehicles.synthesis import checked_designs


@dataclass(frozen=True, eq=False)
class LossFactorIndex:
    """SPLV of every vehicle, as a function of stiffness and loss factors.

    Parameters
    ----------
    split : LoadCaseIndex
        Of the same paths twice: factors of the elastic parts, then of the lossy parts.

    Notes
    -----
    A variable ``EnM x`` multiplies K' and K'', ``EnM x loss`` multiplies K'' alone: the loss factor
    K''/K' is multiplied by it and K' stays; |K| changes by the square root of ``1 + (yη)²`` over
    that of ``1 + η²``, 0.7 % for η = 0.2 and y = 1.2.
    """

    split: LoadCaseIndex[Any, Any]

    @property
    def _n(self) -> int:
        return len(self.split.variable_names) // 2

    @property
    def variable_names(self) -> tuple[str, ...]:
        """Stiffness factors, then loss factors ``<mount> <axis> loss``."""
        return self.split.variable_names

    @property
    def response_names(self) -> tuple[str, ...]:
        """Name of each vehicle."""
        return self.split.response_names

    @property
    def response_unit(self) -> str:
        """Unit of all responses."""
        return self.split.response_unit

    @property
    def load_case_names(self) -> tuple[str, ...]:
        """Name of each load case that counts."""
        return self.split.load_case_names

    @property
    def frequency(self) -> RealArray:
        """Lines of the band, shape (n_lines,) [Hz]."""
        return self.split.frequency

    @property
    def contributions(self) -> tuple[Any, ...]:
        """Each load case that counts."""
        return self.split.contributions

    @property
    def weights(self) -> tuple[float, ...]:
        """Of the load cases [1]."""
        return self.split.weights

    @property
    def kernel(self) -> Any:
        """What sums the levels."""
        return self.split.kernel

    @property
    def n_lines(self) -> int:
        """Number of lines in each sum."""
        return self.split.n_lines

    def __call__(self, designs: npt.ArrayLike) -> RealArray:
        """Return SPLV of designs (n, 2 n_variable), shape (n, n_vehicle) [dB(A)]."""
        return self.split(self._split_factors(designs))

    def levels(self, designs: npt.ArrayLike, load_case: str | None = None) -> RealArray:
        """Return the level of every line, shape (n, n_vehicle, n_lines) [dB(A)]."""
        return self.split.levels(self._split_factors(designs), load_case)

    def gradient(self, designs: npt.ArrayLike) -> RealArray:
        """Return the derivatives of SPLV, shape (n, n_vehicle, 2 n_variable) [dB(A) per unit].

        Notes
        -----
        With ``z = x y``: ``∂/∂x = ∂/∂x|_z + y ∂/∂z``, ``∂/∂y = x ∂/∂z``.
        """
        factors = checked_designs(designs, self.variable_names)[:, np.newaxis, :]
        stiffness, loss = factors[..., : self._n], factors[..., self._n :]
        by_part = self.split.gradient(self._split_factors(designs))
        elastic, lossy = by_part[..., : self._n], by_part[..., self._n :]
        return np.concatenate([elastic + loss * lossy, stiffness * lossy], axis=-1)

    def _split_factors(self, designs: npt.ArrayLike) -> RealArray:
        factors = checked_designs(designs, self.variable_names)
        stiffness, loss = factors[:, : self._n], factors[:, self._n :]
        return np.hstack([stiffness, stiffness * loss])


def booming_loss_index(
    fleet: Fleet,
    mounts: Sequence[Mount],
    load_cases: Sequence[tuple[LoadCase, float]],
    band: Band,
    kernel: LevelSumKernel,
) -> LossFactorIndex:
    """Return the index with loss factors, motion prescribed; arguments as of `booming_index`.

    Raises
    ------
    InputError
        See `deboom.vehicles.booming_index.booming_index`; also a line without displacement.
    """
    cases = tuple(_split_contributions(fleet, mounts, case, band) for case, _ in load_cases)
    return LossFactorIndex(BoomingIndex(cases, tuple(weight for _, weight in load_cases), kernel))


def coupled_loss_index(
    fleet: Fleet,
    mounts: Sequence[Mount],
    powertrain: Powertrain,
    load_cases: Sequence[tuple[LoadCase, float]],
    band: Band,
) -> LossFactorIndex:
    """Return the index with loss factors, motion coupled, in numpy.

    Other arguments as of `deboom.vehicles.coupled_index.coupled_index`.

    Raises
    ------
    InputError
        See `deboom.vehicles.coupled_index.coupled_index`.
    """
    cases = tuple(
        split_motion(coupled_motion(fleet, mounts, powertrain, case, band))
        for case, _ in load_cases
    )
    weights = tuple(weight for _, weight in load_cases)
    return LossFactorIndex(CoupledIndex(cases, weights, NUMPY_SPLIT))


def split_forces(load_case: LoadCase) -> tuple[LoadCase, LoadCase]:
    """Return a run with the elastic forces ``K' s`` alone, and one with the lossy ``j K'' s``.

    Raises
    ------
    InputError
        A line without displacement.
    """
    displacement, force = load_case.displacement.values, load_case.force
    stiffness = dynamic_stiffness(force.values, displacement)
    elastic, lossy = stiffness.real * displacement, 1j * stiffness.imag * displacement
    return (
        replace(load_case, force=replace(force, values=elastic)),
        replace(load_case, force=replace(force, values=lossy)),
    )


def _split_contributions(
    fleet: Fleet, mounts: Sequence[Mount], load_case: LoadCase, band: Band
) -> PathContributions:
    elastic, lossy = (
        path_contributions(fleet, mounts, part, band) for part in split_forces(load_case)
    )
    return replace(
        elastic,
        values=np.concatenate([elastic.values, lossy.values], axis=2),
        variable_names=with_loss(elastic.variable_names),
    )
