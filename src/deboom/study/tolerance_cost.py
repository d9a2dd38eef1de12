"""The numbers behind the report of tolerances with a price: what each budget buys."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.fronts import verification_response
from deboom.explore.problems import SearchResult
from deboom.explore.robust import RobustValues
from deboom.explore.tolerance_variables import ToleranceCost, ToleranceResponse
from deboom.files.platform import Platform
from deboom.files.table_cells import read_rows
from deboom.vehicles.load_case_index import LoadCaseIndex

DRAWS = 1024
"""Independent draws with which the designs that are shown are evaluated again."""
REFERENCE = 0.15
"""Tolerance that is assumed to cost what today's parts cost, half width [1]."""


@dataclass(frozen=True, eq=False)
class ToleranceStudy:
    """A search over stiffnesses and tolerances with the cost of the tolerances.

    Parameters
    ----------
    platform : Platform
        As measured.
    index : LoadCaseIndex
        What was evaluated.
    response : ToleranceResponse
        How it was made robust, and the cost.
    search : SearchResult
        What was found; objectives are mean, scatter, cost.
    mean_margin : float
        Designs of a budget may be louder than the quietest design of the front by this [dB], mean
        over vehicles and lines.
    seed : int
        Of the verification.
    """

    platform: Platform
    index: LoadCaseIndex[Any, Any]
    response: ToleranceResponse
    search: SearchResult
    mean_margin: float
    seed: int

    @property
    def variables(self) -> tuple[str, ...]:
        """Names of the directions."""
        return self.response.robust.space.names

    @property
    def per_line(self) -> float:
        """Factor from a sum over vehicles and lines to the mean over both [1]."""
        return 1.0 / (self.index.n_lines * len(self.index.response_names))

    @cached_property
    def costs(self) -> RealArray:
        """Cost of every design of the front, shape (n,) [unit of the weights]."""
        return np.asarray(self.search.front.objectives[:, -1])

    @cached_property
    def quiet(self) -> npt.NDArray[np.intp]:
        """Rows of the front within the margin of the quietest one."""
        mean = self.search.front.mean_sum * self.per_line
        return np.flatnonzero(mean <= mean.min() + self.mean_margin)

    @cached_property
    def rows(self) -> tuple[int, ...]:
        """Rows of the front: of the quiet designs, those with the least scatter for their cost."""
        order = self.quiet[np.argsort(self.costs[self.quiet], kind="stable")]
        sigma = self.search.front.sigma_sum[order]
        best = np.concatenate([[True], sigma[1:] < np.minimum.accumulate(sigma)[:-1]])
        return tuple(int(row) for row in order[best])

    @cached_property
    def verified(self) -> RobustValues:
        """The designs of `rows`, with draws that the search never saw."""
        return self._verified(self.search.front.designs[list(self.rows)])

    @cached_property
    def uniform(self) -> RobustValues:
        """The same stiffnesses, each with one tolerance everywhere at the same cost."""
        designs = self.search.front.designs[list(self.rows)].copy()
        inner, tolerances = self.response.split(designs)
        cost = self.response.cost
        total = float(cost.weight.sum())
        same = (cost.weight * cost.reference).sum() / (self.costs[list(self.rows)] + total)
        tolerances[:] = same[:, np.newaxis]
        return self._verified(np.hstack([inner, tolerances]))

    @cached_property
    def baseline(self) -> RobustValues:
        """Today's design with its tolerances; one row."""
        return self._verified(self.response.space.nominal[np.newaxis, :])

    @property
    def baseline_cost(self) -> float:
        """Cost of today's tolerances."""
        return float(self.response.cost(self.response.robust.space.tolerance))

    def at_budget(self, budget: float) -> int:
        """Return the place in `rows` of the least scatter that costs no more; -1 if none does."""
        affordable = np.flatnonzero(self.costs[list(self.rows)] <= budget)
        return int(affordable[-1]) if affordable.size else -1

    def _verified(self, designs: RealArray) -> RobustValues:
        robust = verification_response(self.response.robust, DRAWS, seed=self.seed)
        response = ToleranceResponse(
            robust, self.response.lower, self.response.upper, self.response.cost
        )
        return response(designs)


def tolerance_cost(path: Path | None, variables: Sequence[str]) -> ToleranceCost:
    """Return the price of tolerances, by default 1 per direction and `REFERENCE`.

    Parameters
    ----------
    path : Path or None
        Table with the columns ``variable, weight, reference tolerance``, one row per variable, in
        any order; the weight is in any unit of money, the tolerance a plain number such as 0.15.
    variables : sequence of str
        Of the stiffness factors.

    Raises
    ------
    InputError
        A table that cannot be read, lacks a variable or names it twice.
    """
    if path is None:
        one = np.ones(len(variables))
        return ToleranceCost(one, REFERENCE * one)
    rows = {}
    for row in read_rows(path, ("variable", "weight", "reference tolerance"), {}):
        name = row.filled("variable")
        if name in rows or name not in variables:
            raise row.error(f"'{name}' is named twice or is none of {list(variables)}")
        rows[name] = (row.number("weight"), row.number("reference tolerance"))
    missing = [name for name in variables if name not in rows]
    if missing:
        raise InputError(f"{path}: there is no row for {missing}: give every variable one")
    weight, reference = np.array([rows[name] for name in variables]).T
    return ToleranceCost(weight, reference)
