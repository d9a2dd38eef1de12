"""Coupled motion with every spring split in an elastic and a lossy part, each with its factor."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.vehicles.coupled_motion import CoupledMotion
from deboom.vehicles.kernel_coupled_numpy import NUMPY_COUPLED, NumpyCoupledSum

SUFFIX = " loss"
"""What the name of a lossy part's factor adds to that of the elastic part's."""


def with_loss(names: tuple[str, ...]) -> tuple[str, ...]:
    """Return the names of all factors of elastic parts, then of all lossy parts."""
    return (*names, *(f"{name}{SUFFIX}" for name in names))


@dataclass(frozen=True, eq=False)
class SplitMotion(CoupledMotion):
    """Equations of motion whose springs are ``x K' + z j K''``; designs are (x, z).

    `split_motion` makes it. The directions of the powertrain's mounts stand there twice; bodies of
    their own once, with both parts in one spring.
    """

    @property
    def own_parts(self) -> tuple[tuple[npt.NDArray[np.intp], ComplexArray], ...]:
        """Elastic and lossy part."""
        stiffness, n_variable = self.own_stiffness, len(self.variable_names) // 2
        return (
            (self.own_variables, stiffness.real.astype(np.complex128)),
            (self.own_variables + n_variable, (1j * stiffness.imag).astype(np.complex128)),
        )


def split_motion(motion: CoupledMotion) -> SplitMotion:
    """Return the same equations of motion with split springs."""
    values = {field.name: getattr(motion, field.name) for field in fields(CoupledMotion)}
    stiffness, n_variable = motion.stiffness, len(motion.variable_names)
    return SplitMotion(
        **values
        | {
            "forward": np.concatenate([motion.forward, motion.forward]),
            "stiffness": np.hstack([stiffness.real + 0j, 1j * stiffness.imag]),
            "variables": np.concatenate([motion.variables, motion.variables + n_variable]),
            "transfer": np.concatenate([motion.transfer, motion.transfer], axis=2),
            "variable_names": with_loss(motion.variable_names),
        }
    )


@dataclass(frozen=True, eq=False)
class NumpySplitSum(NumpyCoupledSum):
    """Sums of levels of split springs; `NumpySplitKernel.prepare` makes it."""

    def _own_forces(self, lines: slice, factors: RealArray) -> ComplexArray:
        equations = self.equations
        n_variable = len(factors) // 2
        stiffness = equations.own_stiffness[lines, :, np.newaxis]
        elastic = factors[equations.own_variables]
        lossy = factors[equations.own_variables + n_variable]
        spring = elastic * stiffness.real + 1j * lossy * stiffness.imag
        load = (equations.own_load / equations.own_stiffness)[lines, :, np.newaxis]
        return np.asarray(spring * load / (spring - 1.0))


@dataclass(frozen=True)
class NumpySplitKernel:
    """A `deboom.vehicles.booming_model.CoupledKernel` of split motions."""

    name: str = "numpy"

    def prepare(self, motion: CoupledMotion) -> NumpySplitSum:
        """Lay out the equations of motion of one load case, made by `split_motion`."""
        plain = NUMPY_COUPLED.prepare(motion)
        return NumpySplitSum(plain.equations, plain.nonzero, plain.springs)


NUMPY_SPLIT = NumpySplitKernel()
