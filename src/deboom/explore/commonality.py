"""The fewest part numbers with which every vehicle keeps its limit, and the price of sharing."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain, combinations, product

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import block_diag, csr_array, eye_array, hstack, vstack

from deboom.arrays import IntArray, RealArray
from deboom.errors import InputError
from deboom.explore.sharing import (
    SeparateOptima,
    SharedDesign,
    Sharing,
    SharingProblem,
    quietest_within_limits,
    shared_design,
)
from deboom.explore.space import responses
from deboom.progress import Progress

_BESIDE = 3  # counts above the first within the limits that are worked out as well
_WIDTH = 3  # sharings of each count whose numbers are merged in pairs
_MOST_PARTS = 8  # whose subsets are gone through one by one: 256 of them
_ROOM = 1e3  # added to the limit of a vehicle that is not asked about [unit]
_STARTS = 4  # local optima of all vehicles that a relaxation begins with
_SAME_VALUE = 0.05  # values of a part whose levels differ by less in every vehicle are one [unit]
_LARGEST = 6  # values per part in the library; the most different ones are kept
_GAP = 1e-3  # share by which chosen numbers may miss the best ones of the library

_Library = tuple[RealArray, ...]
# values of each part, shape (n_values, n_variables of the part), as candidates for part numbers


@dataclass(frozen=True, eq=False)
class Commonality:
    """Result of `fewest_part_numbers`.

    - `by_count`: best sharing found for each count of part numbers that improves on fewer, from few
      to many.
    - `fewest`: the first within all limits; among all values of these part numbers the quietest
      found.
    - `lower_bound`: count below which some vehicle misses its limit.
    """

    by_count: tuple[SharedDesign, ...]
    fewest: SharedDesign
    lower_bound: int


def fewest_part_numbers(
    problem: SharingProblem,
    optima: SeparateOptima,
    guesses: Sequence[Sharing] = (),
    step: Progress | None = None,
) -> Commonality:
    """Find the fewest distinct part numbers with which every vehicle keeps its limit.

    - `problem`, `optima`: fleet with limits, and the result of `separate_optima` for it.
    - `guesses`: sharings that are tried as well, such as one set per group.
    - `step`, optional: called after each step.
    - raises InputError: a limit that a vehicle misses even with parts of its own; vehicles that
      belong together and have no sharing within the limits; more than 8 parts.

    Two steps in turn. Numbers: of a library of part values, the local optima of every vehicle,
    choose a stated count and give every vehicle one of each part, so that the worst vehicle is as
    good as can be, by an integer program. Values: move the values of these numbers by gradients
    (`shared_design`). Then pairs of numbers of the best sharings are merged, one after the other.

    The lower bound is a relaxation: parts outside of a subset are shared by all vehicles, those
    inside are free for each vehicle. All optima of values are local ones, of several starts: the
    search may miss a sharing, and the bound is too high where every start missed one.
    """
    say = step or (lambda *_: None)
    _refuse_unreachable(problem, optima)
    if len(problem.part_names) > _MOST_PARTS:
        raise InputError(
            f"{len(problem.part_names)} parts: this search goes through subsets of at most "
            f"{_MOST_PARTS}; fix the parts that are settled"
        )
    least = Sharing(problem.part_names, problem.vehicles, np.zeros_like(problem.units))
    most = sum(len(np.unique(unit)) for unit in problem.units)
    library = _library(problem, optima)
    evaluated = _Known(problem)
    begin = _starts(problem, optima)
    for guess in [least, *guesses]:
        if problem.allowed(guess):
            evaluated.work_out(guess, begin)
    reached = most
    for count in range(least.total, most + 1):
        say(count - least.total, most, f"choice of {count} part numbers")
        chosen = _choose_numbers(problem, library, count)
        evaluated.work_out(chosen[0], [chosen[1]])
        if evaluated.worst(count) <= 0.0:
            reached = min(reached, count)
        if count >= reached + _BESIDE or chosen[0].total < count:
            break
    largest = max(design.sharing.total for design in evaluated.designs.values())
    for count in range(largest, least.total, -1):
        say(most - count, most, f"merging to {count - 1} part numbers")
        for design in evaluated.of_count(count)[:_WIDTH]:
            for sharing, starts in _merged(problem, design):
                evaluated.work_out(sharing, starts)
    say(most, most, "lower bound")
    by_count = evaluated.best()
    if by_count[-1].worst > 0.0:
        raise InputError(
            f"with {most} part numbers, all that is allowed, the limits are missed by "
            f"{by_count[-1].worst:.3g} {problem.evaluate.response_unit}: loosen what belongs "
            "together, or the limits"
        )
    fewest = next(design for design in by_count if design.worst <= 0.0)
    bound = _bound(problem, least, [*begin, *(design.designs for design in by_count)])
    return Commonality(
        by_count, quietest_within_limits(problem, fewest), min(bound, fewest.sharing.total)
    )


def separate_sets(
    problem: SharingProblem, optima: SeparateOptima, sharing: Sharing
) -> SharedDesign:
    """Find values for a sharing in which no set of vehicles has a number of another set.

    In each set the worst vehicle is as good as was found. One search per set, with room for all
    others: in a search of all, values of a set without the worst vehicle stay where they began.
    """
    place = np.unique(sharing.numbers, axis=1, return_inverse=True)[1].ravel()
    designs = optima.designs.copy()
    for number in range(int(place.max()) + 1):
        inside = place == number
        alone = replace(problem, limits=problem.limits + np.where(inside, 0.0, _ROOM))
        best = shared_design(alone, sharing, _starts(alone, optima))
        designs[inside] = best.designs[inside]
    levels = problem.response_of_each(designs)
    return SharedDesign(sharing, designs, levels, levels - problem.limits)


def _refuse_unreachable(problem: SharingProblem, optima: SeparateOptima) -> None:
    missed = optima.levels - problem.limits
    binding = int(np.argmax(missed))
    if missed[binding] > 0.0:
        unit = problem.evaluate.response_unit
        raise InputError(
            f"{problem.vehicles[binding]} cannot keep its limit of {problem.limits[binding]:.4g} "
            f"{unit}: with parts of its own it reaches {optima.levels[binding]:.4g} {unit}, "
            f"{missed[binding]:.3g} too much; {int((missed > 0).sum())} of {missed.size} vehicles "
            "miss theirs: raise the limit or widen the bounds"
        )


def _starts(problem: SharingProblem, optima: SeparateOptima) -> list[RealArray]:
    """Every vehicle its own optimum; all vehicles one of the candidates that suit the worst."""
    worst = (problem.evaluate(optima.candidates) - problem.limits).max(axis=1)
    alike = optima.candidates[np.argsort(worst, kind="stable")[:_STARTS]]
    return [optima.designs, *np.repeat(alike[:, np.newaxis], len(problem.vehicles), axis=1)]


class _Known:
    """The best design found so far for every sharing that was worked out."""

    def __init__(self, problem: SharingProblem) -> None:
        self.problem = problem
        self.designs: dict[bytes, SharedDesign] = {}

    def work_out(self, sharing: Sharing, starts: Sequence[RealArray]) -> None:
        """Find values for a sharing by gradients."""
        design = shared_design(self.problem, sharing, starts)
        best = self.designs.get(sharing.key)
        if best is None or design.worst < best.worst:
            self.designs[sharing.key] = design

    def worst(self, count: int) -> float:
        """Least worst excess with at most so many part numbers."""
        designs = self.designs.values()
        fitting = [design.worst for design in designs if design.sharing.total <= count]
        return min(fitting, default=float("inf"))

    def of_count(self, count: int) -> list[SharedDesign]:
        """Designs of a count of part numbers, the best first."""
        designs = self.designs.values()
        fitting = [design for design in designs if design.sharing.total == count]
        return sorted(fitting, key=lambda design: design.worst)

    def best(self) -> tuple[SharedDesign, ...]:
        """Of each count the best, where it is better than all with fewer numbers."""
        best: list[SharedDesign] = []
        counts = sorted({design.sharing.total for design in self.designs.values()})
        for design in (self.of_count(count)[0] for count in counts):
            if not best or design.worst < best[-1].worst:
                best.append(design)
        return tuple(best)


def _merged(
    problem: SharingProblem, design: SharedDesign
) -> Iterator[tuple[Sharing, list[RealArray]]]:
    """Join pairs of numbers; all their users begin with the value of one, then of the other."""
    for part, count in enumerate(design.sharing.counts):
        columns, numbers = np.array(problem.columns[part]), design.sharing.numbers[part]
        for pair in combinations(range(count), 2):
            sharing = design.sharing.merged(part, *pair)
            users, starts = np.flatnonzero(np.isin(numbers, pair)), []
            for number in pair:
                designs = design.designs.copy()
                holder = np.flatnonzero(numbers == number)[0]
                designs[np.ix_(users, columns)] = design.designs[holder, columns]
                starts.append(designs)
            yield sharing, starts


def _bound(problem: SharingProblem, least: Sharing, starts: Sequence[RealArray]) -> int:
    """Least count that the relaxation leaves possible."""
    n_parts = len(problem.part_names)
    subsets = chain.from_iterable(combinations(range(n_parts), size) for size in range(n_parts + 1))
    best = least.total + n_parts
    for parts in subsets:
        numbers = least.numbers.copy()
        numbers[list(parts)] = problem.units[list(parts)]
        relaxed = Sharing(least.parts, least.vehicles, numbers)
        # a part that is free for each vehicle has at least one number more
        more = sum(relaxed.counts[part] > least.counts[part] for part in parts)
        if least.total + more >= best:
            continue
        if shared_design(problem, relaxed, starts, enough=0.0).worst <= 0.0:
            best = least.total + more
    return best


def _library(problem: SharingProblem, optima: SeparateOptima) -> _Library:
    """Values of each part that differ in what vehicles hear, most different ones first."""
    designs = np.concatenate([optima.designs, optima.candidates])
    library = []
    for columns in problem.columns:
        values = designs[:, list(columns)]
        placed = np.repeat(optima.designs[np.newaxis], len(values), axis=0)
        placed[:, :, list(columns)] = values[:, np.newaxis]
        levels = problem.response_of_each(placed)
        kept = [0]
        while len(kept) < min(_LARGEST, len(values)):
            apart = np.abs(levels[:, np.newaxis] - levels[kept]).max(axis=2).min(axis=1)
            if apart.max() < _SAME_VALUE:
                break
            kept.append(int(np.argmax(apart)))
        library.append(values[kept])
    return tuple(library)


def _choose_numbers(
    problem: SharingProblem, library: _Library, count: int
) -> tuple[Sharing, RealArray]:
    """Choose part numbers of a library, at most `count`, and give each vehicle one of each part.

    Returns numbers and designs (v, k) with the least worst excess. A p-centre problem as an integer
    program: binary ``a_mi``: value i of part m is a number; shares ``z_vc`` of combinations c of
    values in vehicle v: minimise t with ``Σ_c z_vc = 1``, ``Σ_{c: c_m = i} z_vc ≤ a_mi``,
    ``Σ a ≤ count``, ``Σ_c excess_vc z_vc ≤ t``. For given numbers the best z is whole, since each
    vehicle may take its best combination; only vehicles that belong together make z binary. Solved
    by HiGHS (`scipy.optimize.milp`).
    """
    sizes = [len(values) for values in library]
    combos = np.array(list(product(*(range(size) for size in sizes))))
    designs = np.empty((len(combos), problem.space.n_variables))
    for part, columns in enumerate(problem.columns):
        designs[:, list(columns)] = library[part][combos[:, part]]
    excess = responses(problem.evaluate, designs) - problem.limits
    ruled = bool(problem.together)
    # where none belong together, nothing worse than one combination for all is needed
    enough = np.inf if ruled else excess.max(axis=1).min()
    offered = [np.flatnonzero(column <= enough) for column in excess.T]
    n_values, n_shares = sum(sizes), sum(len(rows) for rows in offered)
    whole = np.concatenate([np.ones(n_values), np.full(n_shares, ruled), [0]])
    lower, upper = np.zeros(whole.size), np.ones(whole.size)
    lower[-1], upper[-1] = -np.inf, np.inf
    solution = milp(
        np.append(np.zeros(n_values + n_shares), 1.0),
        integrality=whole,
        bounds=Bounds(lower, upper),
        constraints=_constraints(problem, combos, sizes, excess, offered, count),
        options={"mip_rel_gap": _GAP},
    )
    if solution.x is None:
        raise InputError(f"no part numbers were found for a count of {count}: {solution.message}")
    if ruled:
        shares = np.split(solution.x[n_values:-1], np.cumsum([len(rows) for rows in offered])[:-1])
        pairs = zip(offered, shares, strict=True)
        chosen = np.array([rows[np.argmax(share)] for rows, share in pairs])
    else:
        numbers = np.flatnonzero(solution.x[:n_values] > 0.5)
        available = np.all(np.isin(combos + _first_values(sizes), numbers), axis=1)
        chosen = np.where(available[:, np.newaxis], excess, np.inf).argmin(axis=0)
    return Sharing(problem.part_names, problem.vehicles, combos[chosen].T), designs[chosen]


def _first_values(sizes: Sequence[int]) -> IntArray:
    """Return the place of each part's first value among the values of all parts."""
    return np.cumsum([0, *sizes[:-1]])


def _constraints(
    problem: SharingProblem,
    combos: IntArray,
    sizes: Sequence[int],
    excess: RealArray,
    offered: Sequence[IntArray],
    count: int,
) -> list[LinearConstraint]:
    """Constraints of the integer program; its variables are a, then z by vehicle, then t."""
    n_values, n_vehicles = sum(sizes), len(offered)
    used = np.zeros((len(combos), n_values))
    np.put_along_axis(used, combos + _first_values(sizes), 1.0, axis=1)
    # rows: value by value of every vehicle, 1 where a combination uses it
    member = block_diag([csr_array(used[rows].T) for rows in offered], format="csr")
    every = block_diag([csr_array(np.ones((1, len(rows)))) for rows in offered], format="csr")
    missed = block_diag(
        [csr_array(excess[rows, v][np.newaxis]) for v, rows in enumerate(offered)], format="csr"
    )

    def wide(numbers: csr_array | None, shares: csr_array, worst: float) -> csr_array:
        height = shares.shape[0]
        left = csr_array((height, n_values)) if numbers is None else numbers
        return csr_array(hstack([left, shares, csr_array(np.full((height, 1), worst))]))

    minus = csr_array(vstack([-eye_array(n_values)] * n_vehicles))
    taken, one_each, kept = wide(minus, member, 0.0), wide(None, every, 0.0), wide(None, missed, -1)
    total = np.zeros((1, taken.shape[1]))
    total[0, :n_values] = 1.0
    constraints = [
        LinearConstraint(csr_array(total), 0, count),
        LinearConstraint(taken, -np.inf, 0),
        LinearConstraint(one_each, 1, 1),
        LinearConstraint(kept, -np.inf, 0),
    ]
    for first, size, unit in zip(_first_values(sizes), sizes, problem.units, strict=True):
        of_part = np.arange(first, first + size)
        for vehicle in np.flatnonzero(unit != np.arange(n_vehicles)).tolist():
            uses, other_uses = (member[v * n_values + of_part] for v in (vehicle, unit[vehicle]))
            constraints.append(LinearConstraint(wide(None, uses - other_uses, 0.0), 0, 0))
    return constraints
