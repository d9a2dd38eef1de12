"""Limits that a design must keep: further responses, each at most or at least some value."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.robust import Robust, RobustValues
from deboom.explore.space import DesignSpace


class Requirements(Protocol):
    """What can be limited: ``requirements(designs (n, k)) -> numbers (n, r)``."""

    @property
    def variable_names(self) -> tuple[str, ...]:
        """Name of each column of the designs."""

    @property
    def response_names(self) -> tuple[str, ...]:
        """Name of each column of the result."""

    def __call__(self, designs: RealArray) -> RealArray:
        """Return the numbers, nan where one could not be computed."""


@dataclass(frozen=True)
class Limit:
    """One response with a bound.

    Parameters
    ----------
    response : str
        Name of the response.
    unit : str
        Of response and bounds; ``"1"`` is a plain number.
    at_least, at_most : float
        Bounds, both allowed values [unit]. Infinite where there is none.

    Raises
    ------
    InputError
        No bound at all, or bounds that leave no value between them.
    """

    response: str
    unit: str
    at_least: float = -np.inf
    at_most: float = np.inf

    def __post_init__(self) -> None:
        if not self.at_least <= self.at_most:
            raise InputError(
                f"limit of {self.response}: at least {self.at_least:g} {self.unit} and at most "
                f"{self.at_most:g} {self.unit} exclude each other"
            )
        if np.isinf(self.at_least) and np.isinf(self.at_most):
            raise InputError(f"limit of {self.response}: give at_least, at_most or both")


@dataclass(frozen=True)
class Limits:
    """Several limits as one-sided bounds, the columns of `RobustValues.excess`.

    Parameters
    ----------
    limits : sequence of Limit
        At least one, in the order of the responses.
    """

    limits: tuple[Limit, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "limits", tuple(self.limits))
        if not self.limits:
            raise InputError("there is no limit to keep: give at least one")

    @property
    def _bounds(self) -> list[tuple[int, float, float]]:
        """Column of the response, sign (1: at most, -1: at least) and bound of each side."""
        return [
            (column, sign, bound)
            for column, limit in enumerate(self.limits)
            for sign, bound in ((-1.0, limit.at_least), (1.0, limit.at_most))
            if np.isfinite(bound)
        ]

    @property
    def names(self) -> tuple[str, ...]:
        """Each bound in words, such as ``EnM z sag at most 4 mm``."""
        return tuple(
            f"{self.limits[column].response} at {'most' if sign > 0 else 'least'} {bound:g} "
            f"{self.limits[column].unit}"
            for column, sign, bound in self._bounds
        )

    @property
    def scale(self) -> RealArray:
        """What an excess is compared with: the bound itself, or 1 where it is 0, shape (c,)."""
        return np.array([abs(bound) or 1.0 for *_, bound in self._bounds])

    def excess(self, values: RealArray) -> RealArray:
        """Return how far responses, shape (n, r), miss each bound, shape (n, c).

        Negative where room is left [unit of the limit]; infinite where a response could not be
        computed.
        """
        columns = [sign * (values[:, column] - bound) for column, sign, bound in self._bounds]
        beyond = np.column_stack(columns)
        return np.where(np.isnan(beyond), np.inf, beyond)

    def closest(self, designs_excess: RealArray) -> str:
        """Say what the closest of designs that all miss a limit lacks.

        Parameters
        ----------
        designs_excess : array, shape (n, c)
            Of designs of which each misses a bound.

        Returns
        -------
        str
            Which bound keeps the closest design out and by how much, and which bounds no design
            keeps at all.
        """
        relative = designs_excess / self.scale
        row = int(np.argmin(relative.max(axis=1)))
        binding = int(np.argmax(relative[row]))
        column, sign, bound = self._bounds[binding]
        limit, missed = self.limits[column], float(designs_excess[row, binding])
        if np.isinf(missed):
            text = f"'{self.names[binding]}' could not be computed for any"
        else:
            text = (
                f"the closest one misses '{self.names[binding]}' by {missed:.3g} {limit.unit} "
                f"(it has {bound + sign * missed:.4g} {limit.unit})"
            )
        never = np.flatnonzero(np.all(designs_excess > 0.0, axis=0))
        others = [self.names[one] for one in never if one != binding]
        if others:
            text += f"; none keeps {', '.join(repr(name) for name in others)} either"
        return text


@dataclass(frozen=True, eq=False)
class LimitedResponse:
    """A robust response whose designs must keep limits; itself a `Robust` that a search drives.

    Put it around what `deboom.explore.workers.workers_for` gives: the limits are evaluated in this
    process.

    Parameters
    ----------
    robust : Robust
        What is to be minimised.
    response : Requirements
        What is limited, of the same variables, in the units of the limits.
    limits : Limits
        One limit per response, by name.
    made : callable, optional
        From a design, shape (k,), to the designs as they are made, shape (n_samples, k), such as
        `RobustResponse.made`: then the worst of them must keep each limit. Default is the design
        itself.

    Raises
    ------
    InputError
        Other variables, or other responses than limits.
    """

    robust: Robust
    response: Requirements
    limits: Limits
    made: Callable[[RealArray], RealArray] | None = None

    def __post_init__(self) -> None:
        _same("variables", self.response.variable_names, self.robust.space.names)
        limited = [limit.response for limit in self.limits.limits]
        _same("responses", self.response.response_names, limited)

    @property
    def space(self) -> DesignSpace:
        """The designs that may be asked for."""
        return self.robust.space

    @property
    def n_objectives(self) -> int:
        """How many objectives the values have."""
        return int(getattr(self.robust, "n_objectives", 2))

    def excess(self, designs: RealArray) -> RealArray:
        """Return how far designs, shape (n, k), miss each bound, shape (n, c) [its unit]."""
        if self.made is None:
            return self.limits.excess(self.response(designs))
        found = [
            self.limits.excess(self.response(self.made(design))).max(axis=0) for design in designs
        ]
        return np.array(found).reshape(len(designs), len(self.limits.names))

    def __call__(self, designs: RealArray) -> RobustValues:
        """Return the values of the designs, shape (n, k), with their excess."""
        values = self.robust(designs)
        return replace(values, excess=self.excess(values.designs))


def _same(what: str, found: Sequence[str], wanted: Sequence[str]) -> None:
    if tuple(found) != tuple(wanted):
        raise InputError(
            f"the limited responses have the {what} {list(found)}, expected {list(wanted)}: give "
            "both the same names in the same order"
        )
