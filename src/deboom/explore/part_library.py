"""Part values to choose from, and the choice that serves the worst vehicle best."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import csr_array, hstack

from deboom.arrays import RealArray, frozen_copy
from deboom.errors import InputError
from deboom.explore.evaluate import responses
from deboom.explore.shared_design import SharingProblem
from deboom.explore.sharing import IntArray, Sharing

SAME_VALUE = 0.05
"""Values of a part whose levels differ by less in every vehicle are taken for one [unit]."""
LARGEST = 6
"""Values per part; the most different ones are kept."""
GAP = 1e-3
"""Largest share by which the chosen numbers may miss the best ones of the library."""


@dataclass(frozen=True, eq=False)
class PartLibrary:
    """Values of each part, as candidates for part numbers.

    Parameters
    ----------
    values : tuple of array, shape (n_values, n_variables of the part)
        One array per part [units of the variables].
    contexts : array, shape (v, k)
        Design of each vehicle in which values of a part are compared.
    """

    values: tuple[RealArray, ...]
    contexts: RealArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", tuple(frozen_copy(one) for one in self.values))
        object.__setattr__(self, "contexts", frozen_copy(self.contexts))

    @classmethod
    def of(cls, problem: SharingProblem, designs: RealArray, contexts: RealArray) -> PartLibrary:
        """Take the parts of designs, shape (n, k), that differ in what vehicles hear."""
        return cls(
            tuple(
                _different(problem, contexts, list(columns), designs[:, list(columns)])
                for columns in problem.columns
            ),
            contexts,
        )


def choose_numbers(
    problem: SharingProblem, library: PartLibrary, count: int
) -> tuple[Sharing, RealArray] | None:
    """Choose part numbers of a library and give each vehicle one of each part.

    Parameters
    ----------
    problem : SharingProblem
    library : PartLibrary
    count : int
        Part numbers in all, at most.

    Returns
    -------
    (Sharing, array of shape (v, k)) or None
        Numbers and designs with the least worst excess; None where the rules need more numbers, or
        other values.

    Raises
    ------
    InputError
        The solver found no choice within its limits.

    Notes
    -----
    A p-centre problem as an integer program. Binary ``a_mi``: value i of part m is a number; shares
    ``z_vc`` of combinations c of values in vehicle v: minimise t with ``Σ_c z_vc = 1``,
    ``Σ_{c: c_m = i} z_vc ≤ a_mi``, ``Σ a ≤ count``, ``Σ_c excess_vc z_vc ≤ t``. For given numbers
    the best z is whole, since each vehicle may take its best combination; only rules make z
    binary. Solved by HiGHS (`scipy.optimize.milp`).
    """
    sizes = [len(values) for values in library.values]
    combos = np.array(list(product(*(range(size) for size in sizes))))
    designs = np.empty((len(combos), problem.space.n_variables))
    for part, columns in enumerate(problem.columns):
        designs[:, list(columns)] = library.values[part][combos[:, part]]
    excess = responses(problem.evaluate, designs) - problem.limits
    program = _Program(problem, combos, sizes, excess)
    chosen = program.solved(count)
    if chosen is None:
        return None
    sharing = Sharing(problem.part_names, problem.vehicles, combos[chosen].T)
    return sharing, designs[chosen]


@dataclass(frozen=True, eq=False)
class _Program:
    """The integer program for one library; variables are a, then z vehicle by vehicle, then t."""

    problem: SharingProblem
    combos: IntArray
    """Shape (n_combinations, m): value of each part."""
    sizes: Sequence[int]
    excess: RealArray
    """Shape (n_combinations, v) [response_unit]."""

    def solved(self, count: int) -> IntArray | None:
        """Return the combination of each vehicle, shape (v,)."""
        rows = self._offered()
        n_values, n_shares = sum(self.sizes), [len(one) for one in rows]
        columns = n_values + sum(n_shares) + 1
        objective = np.zeros(columns)
        objective[-1] = 1.0
        whole = np.zeros(columns, dtype=int)
        whole[:n_values] = 1
        if self._has_rules:
            whole[n_values:-1] = 1
        lower, upper = np.zeros(columns), np.ones(columns)
        lower[-1], upper[-1] = -np.inf, np.inf
        solution = milp(
            objective,
            integrality=whole,
            bounds=Bounds(lower, upper),
            constraints=[*self._constraints(rows, columns, count)],
            options={"mip_rel_gap": GAP},
        )
        if solution.status == 2:
            return None
        if solution.x is None:
            raise InputError(
                f"no part numbers were found for a count of {count}: {solution.message}"
            )
        numbers = np.flatnonzero(solution.x[:n_values] > 0.5)
        return self._whole(numbers, solution.x, rows)

    @property
    def _has_rules(self) -> bool:
        return bool(self.problem.rules.together or self.problem.rules.apart)

    def _offered(self) -> list[IntArray]:
        """Return the combinations of each vehicle that can be part of the best choice."""
        if self._has_rules:
            return [np.arange(len(self.combos))] * self.excess.shape[1]
        # one combination for all is a choice of any count: nothing worse is needed
        enough = self.excess.max(axis=1).min()
        return [np.flatnonzero(column <= enough) for column in self.excess.T]

    def _membership(self, offered: IntArray) -> csr_array:
        """Shape (n_values, n_offered): 1 where a combination uses a value."""
        starts = np.concatenate([[0], np.cumsum(self.sizes)[:-1]])
        used = self.combos[offered] + starts
        places = np.repeat(np.arange(len(offered)), used.shape[1])
        ones = np.ones(used.size)
        return csr_array((ones, (used.ravel(), places)), shape=(sum(self.sizes), len(offered)))

    def _constraints(
        self, rows: list[IntArray], columns: int, count: int
    ) -> list[LinearConstraint]:
        n_values = sum(self.sizes)
        blocks = [self._membership(one) for one in rows]
        ends = n_values + np.cumsum([0, *(len(one) for one in rows)])

        def wide(parts: dict[int, csr_array], height: int) -> csr_array:
            """Put blocks at their first columns, zeros elsewhere."""
            pieces, at = [], 0
            for begin in sorted(parts):
                pieces += [csr_array((height, begin - at)), parts[begin]]
                at = begin + parts[begin].shape[1]
            return csr_array(hstack([*pieces, csr_array((height, columns - at))]))

        minus = csr_array(-np.eye(n_values))
        total = np.zeros((1, columns))
        total[0, :n_values] = 1.0
        found = [LinearConstraint(csr_array(total), 0, count)]
        for vehicle, (one, block) in enumerate(zip(rows, blocks, strict=True)):
            at = int(ends[vehicle])
            one_each = wide({at: _row(np.ones(len(one)))}, 1)
            miss = wide(
                {
                    at: _row(self.excess[one, vehicle]),
                    columns - 1: _row(np.array([-1.0])),
                },
                1,
            )
            found += [
                LinearConstraint(wide({0: minus, at: block}, n_values), -np.inf, 0),
                LinearConstraint(one_each, 1, 1),
                LinearConstraint(miss, -np.inf, 0),
            ]
        for row, part in enumerate(self.problem.part_names):
            values = slice(sum(self.sizes[:row]), sum(self.sizes[: row + 1]))
            units = self.problem.rules.units(part, self.problem.vehicles)
            clash = self.problem.rules.clash(part, self.problem.vehicles)
            ruled = np.triu(clash | (units[:, np.newaxis] == units), 1)
            for first, second in np.argwhere(ruled).tolist():
                differ = bool(clash[first, second])
                both = {
                    int(ends[first]): blocks[first][values],
                    int(ends[second]): (1.0 if differ else -1.0) * blocks[second][values],
                }
                low, high = (-np.inf, 1.0) if differ else (0.0, 0.0)
                found.append(LinearConstraint(wide(both, self.sizes[row]), low, high))
        return found

    def _whole(self, numbers: IntArray, found: RealArray, rows: list[IntArray]) -> IntArray:
        """Give each vehicle one combination of the chosen numbers."""
        chosen, begin = [], sum(self.sizes)
        starts = np.concatenate([[0], np.cumsum(self.sizes)[:-1]])
        available = np.isin(self.combos + starts, numbers).all(axis=1)
        for vehicle, one in enumerate(rows):
            shares = found[begin : begin + len(one)]
            begin += len(one)
            if self._has_rules:
                chosen.append(int(one[np.argmax(shares)]))
            else:
                excess = np.where(available, self.excess[:, vehicle], np.inf)
                chosen.append(int(np.argmin(excess)))
        return np.array(chosen)


def _row(values: RealArray) -> csr_array:
    return csr_array(values[np.newaxis])


def _different(
    problem: SharingProblem, contexts: RealArray, columns: list[int], values: RealArray
) -> RealArray:
    """Return the values that differ in what vehicles hear, most different ones first."""
    designs = np.repeat(contexts[np.newaxis], len(values), axis=0)
    designs[:, :, columns] = values[:, np.newaxis]
    levels = problem.own(designs)
    kept = [0]
    while len(kept) < min(LARGEST, len(values)):
        apart = np.abs(levels[:, np.newaxis] - levels[kept]).max(axis=2).min(axis=1)
        if apart.max() < SAME_VALUE:
            break
        kept.append(int(np.argmax(apart)))
    return values[kept]
