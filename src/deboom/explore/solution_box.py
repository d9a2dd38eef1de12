"""A specification as a box: one interval per variable, independent of all the others.

A part that lies in its box is accepted, whatever the other variables of the same part are; that is
what a drawing can say. The box of this room is the largest one in which at least a stated share of
the parts keeps a limit (M. Zimmermann and J. E. von Hoessle, "Computing solution spaces for robust
design", Int. J. Numer. Meth. Engng 94, 2013); a share below one leaves out the corners that parts
hardly ever reach.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
import numpy.typing as npt

from deboom.arrays import BoolArray, RealArray, frozen_copy
from deboom.errors import InputError
from deboom.explore.evaluate import responses
from deboom.explore.polish import Differentiable
from deboom.explore.tolerance_samples import TRUNCATION, truncated_normal

CHUNK = 4096
"""Parts evaluated at a time: what is in memory."""


class PartLaw(Protocol):
    """How parts lie between the two ends of their intervals; variables are independent."""

    @property
    def name(self) -> str:
        """In words, for reports and records."""

    def places(self, unit: RealArray) -> RealArray:
        """Return places from 0 (lower end) to 1 (upper end) of uniform draws, both (n, k) [1]."""


@dataclass(frozen=True)
class UniformParts:
    """Parts lie anywhere in their interval, evenly: what an acceptance test allows at its worst."""

    name: str = "uniform in the box"

    def places(self, unit: RealArray) -> RealArray:
        """Return the draws themselves."""
        return unit


@dataclass(frozen=True)
class CutNormalParts:
    """Normal about the middle of their interval, whose ends lie three standard deviations off."""

    name: str = "normal, ends of the box at ±3 σ"

    def places(self, unit: RealArray) -> RealArray:
        """Return places of uniform draws, both of shape (n, k) [1]."""
        return 0.5 + truncated_normal(unit) / (2.0 * TRUNCATION)


@dataclass(frozen=True, eq=False)
class Box:
    """Product of intervals.

    Parameters
    ----------
    names : tuple of str, length k
        Variables.
    lower, upper : array, shape (k,)
        Ends of the intervals, both inside [units of the variables].

    Raises
    ------
    InputError
        Ends of another number, not finite or reversed.
    """

    names: tuple[str, ...]
    lower: RealArray
    upper: RealArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "names", tuple(self.names))
        for end in ("lower", "upper"):
            values = np.asarray(getattr(self, end), dtype=float)
            if values.shape != (len(self.names),) or not np.all(np.isfinite(values)):
                raise InputError(
                    f"a box of the {len(self.names)} variables {list(self.names)} needs one finite "
                    f"{end} end for each, not {values.tolist()}"
                )
            object.__setattr__(self, end, frozen_copy(values))
        for name, low, high in zip(self.names, self.lower, self.upper, strict=True):
            if low > high:
                raise InputError(
                    f"the interval of '{name}' has its ends reversed: {low:g} is above {high:g}"
                )

    @property
    def width(self) -> RealArray:
        """Of the intervals, shape (k,) [units of the variables]."""
        return np.asarray(self.upper - self.lower)

    @property
    def centre(self) -> RealArray:
        """Middle of the intervals, shape (k,) [units of the variables]."""
        return np.asarray(0.5 * (self.lower + self.upper))

    def at(self, places: RealArray) -> RealArray:
        """Return the designs at places from 0 to 1 of the intervals, both of shape (n, k)."""
        return np.asarray(self.lower + places * self.width)

    def contains(self, designs: RealArray) -> BoolArray:
        """Say which designs, shape (n, k), lie inside, shape (n,)."""
        return np.asarray(np.all((designs >= self.lower) & (designs <= self.upper), axis=1))


@dataclass(frozen=True, eq=False)
class BoxQuestion:
    """Which box is asked for.

    Parameters
    ----------
    response : Differentiable
        The model, such as the level in every vehicle.
    limit : array, shape (r,)
        Largest value that is kept, of each response [response_unit].
    share : float
        Of parts and responses that keep their limit at least, above 0 and below 1 [1].
    lower, upper : array, shape (k,)
        Where parts may lie at all; equal bounds hold a variable fixed [units of the variables].
    weight : array, shape (k,), optional
        What a per cent of tolerance costs, above 0; only ratios count. Default is 1 [1].
    together : bool
        A part counts as a whole: it must keep all its limits (worst vehicle). Otherwise every pair
        of part and response counts.
    law : PartLaw
        How parts lie in the box.

    Raises
    ------
    InputError
        A model without gradient; limits, bounds or weights of another number or value; a share
        outside 0 to 1; bounds that leave nothing free.

    Notes
    -----
    The box maximises ``Σ_k weight_k log(upper_k - lower_k)``. A value that could not be computed
    keeps no limit.
    """

    response: Differentiable
    limit: RealArray
    share: float
    lower: RealArray
    upper: RealArray
    weight: RealArray = field(default_factory=lambda: np.empty(0))
    together: bool = False
    law: PartLaw = field(default_factory=UniformParts)

    def __post_init__(self) -> None:
        names, outputs = self.response.variable_names, self.response.response_names
        if not hasattr(self.response, "gradient"):
            raise InputError(
                f"{type(self.response).__name__} offers no gradient: a box is found with one only"
            )
        if np.size(self.weight) == 0:
            object.__setattr__(self, "weight", np.ones(len(names)))
        for column, wanted in (
            ("limit", outputs),
            ("lower", names),
            ("upper", names),
            ("weight", names),
        ):
            values = np.asarray(getattr(self, column), dtype=float)
            if values.shape != (len(wanted),) or not np.all(np.isfinite(values)):
                raise InputError(
                    f"{column} of a box: give one finite number for each of {list(wanted)}, not "
                    f"{values.tolist()}"
                )
            object.__setattr__(self, column, frozen_copy(values))
        self._check_values(names)

    def _check_values(self, names: tuple[str, ...]) -> None:
        if not 0.0 < self.share < 1.0:
            raise InputError(
                f"a share of {self.share:g} of the parts: give one above 0 and below 1, such as "
                "0.95; that all parts keep a limit no sample can show"
            )
        for name, low, high, weight in zip(names, self.lower, self.upper, self.weight, strict=True):
            if low > high:
                raise InputError(f"the bounds of '{name}' are reversed: {low:g} is above {high:g}")
            if not weight > 0.0:
                raise InputError(
                    f"the weight of '{name}' is {weight:g}: give one above 0, or its interval "
                    "would shrink to nothing"
                )
        if not np.any(self.free):
            raise InputError("the bounds hold every variable fixed: a box needs one that is free")

    @property
    def names(self) -> tuple[str, ...]:
        """Of the variables."""
        return self.response.variable_names

    @property
    def free(self) -> BoolArray:
        """Variables that are not held fixed, shape (k,)."""
        return np.asarray(self.upper > self.lower)

    @property
    def bounds(self) -> Box:
        """The largest box that may be asked for."""
        return Box(self.names, self.lower, self.upper)

    @property
    def least_kept(self) -> int:
        """How many responses of one part must keep their limit for the share to be kept."""
        n_responses = self.limit.size
        least = int(np.ceil(self.share * n_responses - 1e-12))
        return n_responses if self.together else least

    def lowered(self, step: float) -> BoxQuestion:
        """Return the same question with all limits lowered by a step [response_unit]."""
        return replace(self, limit=self.limit - step)

    def parts(self, box: Box, unit: RealArray) -> RealArray:
        """Return the parts of a box that uniform draws, shape (n, k), stand for, shape (n, k)."""
        return box.at(self.law.places(unit))

    def excess(self, designs: RealArray) -> RealArray:
        """Return how far designs, (n, k), are above each limit, (n, r) [response_unit]."""
        found = np.empty((len(designs), self.limit.size))
        for start in range(0, len(designs), CHUNK):
            rows = slice(start, start + CHUNK)
            found[rows] = responses(self.response, designs[rows]) - self.limit
        return np.where(np.isnan(found), np.inf, found)

    def part_shares(self, excess: RealArray) -> RealArray:
        """Return the share of its limits that each part keeps, shape (n,), of its excess (n, r).

        With `together` it is 1 or 0.
        """
        kept = excess <= 0.0
        return np.asarray(kept.all(axis=1) if self.together else kept.mean(axis=1), dtype=float)

    def share_of(self, box: Box, unit: RealArray) -> float:
        """Return the share over the parts that uniform draws, shape (n, k), stand for [1]."""
        return float(self.part_shares(self.excess(self.parts(box, unit))).mean())

    def log_volume(self, box: Box) -> float:
        """Return ``Σ weight log width`` over the free variables."""
        return float(self.weight[self.free] @ np.log(box.width[self.free]))


def checked_point(question: BoxQuestion, point: npt.ArrayLike) -> RealArray:
    """Return a design inside the bounds of a question, shape (k,), or refuse it.

    Raises
    ------
    InputError
        Another shape, or a value outside the bounds.
    """
    values = np.asarray(point, dtype=float)
    if values.shape != question.lower.shape:
        raise InputError(
            f"a design of shape {values.shape} for the variables {list(question.names)}: give one "
            "number each"
        )
    inside = (values >= question.lower) & (values <= question.upper)
    if not np.all(inside):
        column = int(np.argmin(inside))
        raise InputError(
            f"'{question.names[column]}' of the design is {values[column]:g}, outside the bounds "
            f"{question.lower[column]:g} to {question.upper[column]:g}: widen them"
        )
    return values
