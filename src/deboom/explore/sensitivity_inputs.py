"""How the variables of a sensitivity analysis vary, and which of them count as one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from deboom.arrays import RealArray, frozen_copy
from deboom.errors import InputError
from deboom.explore.design_space import DesignSpace
from deboom.explore.tolerance_samples import TRUNCATION


@dataclass(frozen=True, eq=False)
class SensitivityInputs:
    """Independent variables with their distributions: all uniform, or all gaussian and cut.

    Parameters
    ----------
    names : tuple of str, length k
        Variables, in the order of a design's columns.
    lower, upper : array, shape (k,)
        Bounds, outside of which no variable comes [units of the variables].
    sigma : array, shape (k,), optional
        Standard deviations before the cut of gaussian variables, whose mean lies midway between
        the bounds [units of the variables]. By default the variables are uniform.
    groups : tuple of str, length k, optional
        Group that each variable belongs to: the members of a group vary together, and one index
        stands for all. By default each variable stands for itself.

    Raises
    ------
    InputError
        Names the variable with reversed or equal bounds, or without a standard deviation; names
        used twice; not one value per variable; one group only.
    """

    names: tuple[str, ...]
    lower: RealArray
    upper: RealArray
    sigma: RealArray | None = None
    groups: tuple[str, ...] = field(default=())

    def __post_init__(self) -> None:
        object.__setattr__(self, "names", tuple(self.names))
        object.__setattr__(self, "groups", tuple(self.groups))
        doubled = sorted({name for name in self.names if self.names.count(name) > 1})
        if doubled or not self.names:
            raise InputError(
                f"a sensitivity analysis of the variables {list(self.names)}: give at least one, "
                "each with a name of its own"
            )
        given = {"lower": self.lower, "upper": self.upper, "sigma": self.sigma}
        for column, values in given.items():
            if values is not None:
                self._keep(column, np.asarray(values, dtype=float))
        if self.groups and len(self.groups) != len(self.names):
            raise InputError(
                f"{len(self.groups)} groups for {len(self.names)} variables: name one per variable"
            )
        if self.groups and len(set(self.groups)) == 1:
            raise InputError(
                f"all variables are in the group '{self.groups[0]}': there is nothing to compare, "
                "name at least two groups"
            )
        for place, name in enumerate(self.names):
            self._check_spread(place, name)

    def _keep(self, column: str, values: RealArray) -> None:
        if values.shape != (len(self.names),) or not np.isfinite(values).all():
            raise InputError(
                f"{column} of shape {values.shape} for {len(self.names)} variables: give one "
                "finite number per variable"
            )
        object.__setattr__(self, column, frozen_copy(values))

    def _check_spread(self, place: int, name: str) -> None:
        low, high = float(self.lower[place]), float(self.upper[place])
        fixed = self.sigma is not None and not self.sigma[place] > 0.0
        if not low < high or fixed:
            raise InputError(
                f"variable '{name}' does not vary (from {low:g} to {high:g}): give it a range, or "
                "leave it out of the sensitivity analysis"
            )

    @property
    def n_variables(self) -> int:
        """Number k of variables."""
        return len(self.names)

    @property
    def factors(self) -> tuple[str, ...]:
        """What indices are given for: the groups in the order they appear, or the variables."""
        return tuple(dict.fromkeys(self.groups)) or self.names

    @property
    def description(self) -> str:
        """Distribution and range in words, for reports and run records."""
        low, high = (self._listed(values) for values in (self.lower, self.upper))
        kind = "uniform" if self.sigma is None else f"gaussian, cut at ±{TRUNCATION:g} σ,"
        return f"{kind} from {low} to {high}"

    def _listed(self, values: RealArray) -> str:
        """One number if all are equal, else the range of them."""
        ends = dict.fromkeys(f"{value:g}" for value in (values.min(), values.max()))
        return "…".join(ends)

    def grouped(self, groups: Sequence[str]) -> SensitivityInputs:
        """Return the same variables in groups, see `SensitivityInputs`."""
        return SensitivityInputs(self.names, self.lower, self.upper, self.sigma, tuple(groups))


def design_inputs(space: DesignSpace) -> SensitivityInputs:
    """Return variables that are uniform within the bounds of a space: what a designer may choose.

    Raises
    ------
    InputError
        A variable that is fixed.
    """
    return SensitivityInputs(space.names, space.lower, space.upper)


def tolerance_inputs(space: DesignSpace) -> SensitivityInputs:
    """Return variables that scatter around the nominal design: what manufacturing does.

    Gaussian, with the tolerance as three standard deviations, cut there by the inverse distribution
    function.

    Raises
    ------
    InputError
        A variable without a tolerance.
    """
    sigma = np.abs(space.nominal) * space.relative_sigma
    reach = TRUNCATION * sigma
    return SensitivityInputs(space.names, space.nominal - reach, space.nominal + reach, sigma)
