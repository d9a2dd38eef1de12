"""The design space: which variables, in which bounds, with which manufacturing tolerance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from deboom.arrays import BoolArray, RealArray, frozen_copy
from deboom.errors import InputError

SIGMAS_PER_TOLERANCE = 3.0
"""A tolerance's half width is this many standard deviations of the scatter [1]."""


@dataclass(frozen=True, eq=False)
class DesignSpace:
    """Design variables with units, nominal values, bounds and tolerances.

    ``dataclasses.replace`` gives a changed copy.

    Parameters
    ----------
    names, units : sequence of str, length k
        Name and unit of each variable; ``"1"`` is a plain number.
    nominal, lower, upper : array, shape (k,)
        Today's design and the bounds of the search [units]. Equal bounds hold a variable fixed.
    tolerance : array, shape (k,)
        Half width of the manufacturing scatter as a fraction of the design's own value [1]. It
        stands for three standard deviations; 0 means exactly made.
    integer : array of bool, shape (k,), optional
        Variables that take whole numbers only, such as the number of a part in a catalogue; their
        bounds and nominal values are whole and they have no tolerance. Default is none.

    Raises
    ------
    InputError
        Names the variable that has reversed bounds, a nominal value outside of them, a value that
        is not finite, no unit, a name used twice, a tolerance outside 0 <= tolerance < 1 (from 1 on
        the scatter would change the sign of a design), or a whole-number variable with a fraction
        or a tolerance.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    nominal: RealArray
    lower: RealArray
    upper: RealArray
    tolerance: RealArray
    integer: BoolArray = field(default_factory=lambda: np.empty(0, dtype=bool))

    def __post_init__(self) -> None:
        if np.size(self.integer) == 0:
            object.__setattr__(self, "integer", np.zeros(len(self.names), dtype=bool))
        object.__setattr__(self, "names", tuple(self.names))
        object.__setattr__(self, "units", tuple(self.units))
        if not self.names:
            raise InputError("a design space needs at least one variable")
        for column in ("units", "nominal", "lower", "upper", "tolerance", "integer"):
            count = np.shape(getattr(self, column))
            if count != (len(self.names),):
                raise InputError(
                    f"the design space names {len(self.names)} variables, but its {column} have "
                    f"shape {count}: give one value per variable"
                )
        for column in ("nominal", "lower", "upper", "tolerance"):
            values = np.asarray(getattr(self, column), dtype=float)
            object.__setattr__(self, column, frozen_copy(values))
        object.__setattr__(self, "integer", frozen_copy(np.asarray(self.integer, dtype=bool)))
        for position, name in enumerate(self.names):
            self._check_variable(position, name)

    def _check_variable(self, position: int, name: str) -> None:
        if self.names.count(name) > 1:
            raise InputError(
                f"design variable '{name}' appears {self.names.count(name)} times: "
                "every variable needs a name of its own"
            )
        if not self.units[position].strip():
            raise InputError(
                f"design variable '{name}' has no unit: give one, '1' for a plain number"
            )
        nominal, lower, upper = (
            float(values[position]) for values in (self.nominal, self.lower, self.upper)
        )
        tolerance = float(self.tolerance[position])
        if not np.all(np.isfinite([nominal, lower, upper, tolerance])):
            raise InputError(
                f"design variable '{name}' has a nominal value, bound or tolerance that is not "
                "finite: give a number"
            )
        if lower > upper:
            raise InputError(
                f"design variable '{name}' has its bounds reversed: lower {lower:g} is above "
                f"upper {upper:g}"
            )
        if not lower <= nominal <= upper:
            raise InputError(
                f"design variable '{name}' has the nominal value {nominal:g} outside its bounds "
                f"{lower:g} to {upper:g}: move one of them"
            )
        if not 0.0 <= tolerance < 1.0:
            raise InputError(
                f"design variable '{name}' has the tolerance {tolerance:g}: give the half width "
                "as a fraction of the design's value, from 0 up to but not including 1"
            )
        whole = np.all(np.mod([nominal, lower, upper], 1.0) == 0.0)
        if self.integer[position] and not (whole and tolerance == 0.0):
            raise InputError(
                f"design variable '{name}' takes whole numbers: give whole bounds, a whole nominal "
                "value and the tolerance 0"
            )

    @property
    def n_variables(self) -> int:
        """Number k of variables."""
        return len(self.names)

    @property
    def labels(self) -> tuple[str, ...]:
        """Column headers, ``name [unit]``."""
        return tuple(f"{n} [{u}]" for n, u in zip(self.names, self.units, strict=True))

    @property
    def relative_sigma(self) -> RealArray:
        """Standard deviation of the scatter as a fraction of the design's value, shape (k,) [1]."""
        return self.tolerance / SIGMAS_PER_TOLERANCE

    def checked(self, designs: RealArray) -> RealArray:
        """Return the designs as a finite array of shape (n, k), or refuse them.

        Raises
        ------
        InputError
            Another number of columns, or a value that is not finite. Designs outside the bounds
            are allowed: what a search keeps out, a question may ask for.
        """
        array = np.asarray(designs, dtype=float)
        if array.ndim != 2 or array.shape[1] != self.n_variables:
            raise InputError(
                f"designs have shape {array.shape}, expected one row per design and "
                f"{self.n_variables} columns {list(self.names)}"
            )
        if not np.all(np.isfinite(array)):
            row, column = np.argwhere(~np.isfinite(array))[0]
            raise InputError(
                f"design {row} has a value for '{self.names[column]}' that is not finite"
            )
        return array


def stiffness_factor_space(
    names: Sequence[str], half_width: float = 0.20, tolerance: float = 0.15
) -> DesignSpace:
    """Return the space of factors on today's stiffnesses.

    Parameters
    ----------
    names : sequence of str
        One per factor, such as ``TSM x``.
    half_width : float
        The search runs from ``1 - half_width`` to ``1 + half_width`` [1].
    tolerance : float
        Manufacturing scatter of the design's own stiffness, half width = three standard
        deviations [1]. The default is ±15 % (σ = 5 %); 0.45 reads the same 15 % as one σ.

    Returns
    -------
    DesignSpace
        Nominal value 1 for every factor.

    Raises
    ------
    InputError
        See `DesignSpace`; also a half width that would reach a stiffness of zero.
    """
    if not 0.0 <= half_width < 1.0:
        raise InputError(
            f"stiffness factors in 1 ± {half_width:g}: give a half width from 0 up to but not "
            "including 1"
        )
    ones = np.ones(len(names))
    return DesignSpace(
        names=tuple(names),
        units=("1",) * len(names),
        nominal=ones,
        lower=ones - half_width,
        upper=ones + half_width,
        tolerance=ones * tolerance,
    )
