"""The fewest part numbers with which every vehicle keeps its limit, and what sharing costs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain, combinations, product

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import csr_array, hstack

from deboom.arrays import RealArray, frozen_copy
from deboom.errors import InputError
from deboom.explore.sharing import (
    IntArray,
    OwnOptima,
    SharedDesign,
    Sharing,
    SharingProblem,
    quietest_within_limits,
    shared_design,
)
from deboom.explore.space import responses

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


Step = Callable[[int, int, str], None]

BESIDE = 3
"""Counts above the first within the limits that are worked out as well: merging begins there."""
WIDTH = 3
"""Sharings of each count whose numbers are merged in pairs."""
EXCHANGES = 3
"""Times that values of the library are put in after a descent."""
SMALLEST_GAIN = 0.005
"""Of the worst excess, below which a sharing is left as it is [unit]."""
SHARPNESS = 8.0
"""With which the worst vehicles lead in an exchange of values [1/unit]."""
MOST_PARTS = 8
"""Subsets of the parts are gone through one by one: 256 of them."""
ROOM = 1e3
"""Added to the limit of a vehicle that is not asked about [unit]."""
STARTS = 4
"""Local optima of all vehicles that a relaxation begins with."""


@dataclass(frozen=True, eq=False)
class Commonality:
    """Result of `fewest_part_numbers`.

    Parameters
    ----------
    by_count : tuple of SharedDesign
        Best sharing found for each count of part numbers, from few to many; each has a lower worst
        excess than those before it.
    fewest : SharedDesign
        The first within all limits; among all values of these part numbers the quietest found.
    lower_bound : int
        With fewer numbers some vehicle misses its limit, even where every part that has several
        numbers has one for each vehicle.
    """

    by_count: tuple[SharedDesign, ...]
    fewest: SharedDesign
    lower_bound: int


def fewest_part_numbers(
    problem: SharingProblem,
    own: OwnOptima,
    guesses: Sequence[Sharing] = (),
    step: Step | None = None,
) -> Commonality:
    """Find the fewest distinct part numbers with which every vehicle keeps its limit.

    Parameters
    ----------
    problem : SharingProblem
    own : OwnOptima
        Of `own_optima`, for the same model and space.
    guesses : sequence of Sharing
        Tried as well, such as the families of a correlation study.
    step : callable, optional
        Told what is done: number, of how many, in words.

    Returns
    -------
    Commonality

    Raises
    ------
    InputError
        A limit that a vehicle misses even with parts of its own: says by how much, and which
        vehicle binds. Rules that leave no sharing within the limits.

    Notes
    -----
    Two steps in turn. Numbers: of a library of part values, choose a stated count and give every
    vehicle one of each part, so that the worst vehicle is as good as can be (`choose_numbers`, an
    exact integer program on that library). Values: move the values of these numbers by gradients
    (`shared_design`), then put other values of the library in wherever vehicles gain. The library
    holds the local optima of every vehicle by itself; a vehicle's optimum may need two parts to
    change together, which is why numbers are chosen for all parts at once.

    The lower bound is a relaxation: parts outside of a subset are shared by all vehicles, those
    inside, and those of which rules keep vehicles apart, are free for each vehicle. All optima of
    values are local ones, of several starts: the search may miss a sharing, and the bound is one
    too high where every start missed one.
    """
    say = step or (lambda *_: None)
    _refuse_unreachable(problem, own)
    if len(problem.part_names) > MOST_PARTS:
        raise InputError(
            f"{len(problem.part_names)} parts: this search goes through subsets of at most "
            f"{MOST_PARTS}; fix the parts that are settled"
        )
    least = problem.rules.fewest(problem.part_names, problem.vehicles)
    most = sum(_free(problem, part) for part in range(len(problem.part_names)))
    found: dict[bytes, SharedDesign] = {}

    def work_out(sharing: Sharing, starts: Sequence[RealArray]) -> None:
        known = found.get(sharing.key)
        tried = shared_design(problem, sharing, starts)
        for _ in range(EXCHANGES):
            exchanged = _exchanged(problem, library, tried)
            if exchanged is None:
                break
            better = shared_design(problem, sharing, [exchanged])
            if better.worst > tried.worst - SMALLEST_GAIN:
                break
            tried = better
        if known is None or tried.worst < known.worst:
            found[sharing.key] = tried

    library = PartLibrary.of(problem, np.concatenate([own.designs, own.candidates]), own.designs)
    begin = _starts(problem, own)
    for guess in [least, *guesses]:
        if problem.rules.kept_by(guess):
            work_out(guess, begin)
    reached = most
    for count in range(least.total, most + 1):
        say(count - least.total, most, f"choice of {count} part numbers")
        chosen = choose_numbers(problem, library, count)
        if chosen is not None:
            work_out(chosen[0], [chosen[1]])
        if _worst(found, count) <= 0.0:
            reached = min(reached, count)
        if count >= reached + BESIDE or (chosen is not None and chosen[0].total < count):
            break
    for count in range(max(one.sharing.total for one in found.values()), least.total, -1):
        say(most - count, most, f"merging to {count - 1} part numbers")
        for one in _of_count(found, count)[:WIDTH]:
            for sharing, starts in _merged(problem, one):
                work_out(sharing, starts)
    say(most, most, "lower bound")
    by_count = _best(found)
    if by_count[-1].worst > 0.0:
        raise InputError(
            f"with every part number that the rules allow, {most}, the limits are missed by "
            f"{by_count[-1].worst:.3g} {problem.evaluate.response_unit}: loosen the rules of what "
            "belongs together, or the limits"
        )
    fewest = next(one for one in by_count if one.worst <= 0.0)
    bound = _bound(problem, least, [*begin, *(one.designs for one in by_count)])
    return Commonality(
        by_count, quietest_within_limits(problem, fewest), min(bound, fewest.sharing.total)
    )


def separate_sets(problem: SharingProblem, own: OwnOptima, sharing: Sharing) -> SharedDesign:
    """Find values for a sharing in which no set of vehicles has a number of another set.

    Parameters
    ----------
    problem : SharingProblem
    own : OwnOptima
        Of `own_optima`, for the same model and space.
    sharing : Sharing
        Such as one number of every part for each group of vehicles.

    Returns
    -------
    SharedDesign
        In each set the worst vehicle is as good as was found.

    Notes
    -----
    One search per set, with room for all others: in a search of all, values of a set without the
    worst vehicle stay where they began.
    """
    place = np.unique(sharing.numbers, axis=1, return_inverse=True)[1].ravel()
    designs = own.designs.copy()
    for one in range(int(place.max()) + 1):
        inside = place == one
        alone = replace(problem, limits=problem.limits + np.where(inside, 0.0, ROOM))
        best = shared_design(alone, sharing, _starts(alone, own))
        designs[inside] = best.designs[inside]
    levels = problem.own(designs)
    return SharedDesign(sharing, designs, levels, levels - problem.limits)


def _starts(problem: SharingProblem, own: OwnOptima) -> list[RealArray]:
    """Every vehicle its own optimum; all vehicles one of the candidates that suit the worst."""
    worst = (problem.evaluate(own.candidates) - problem.limits).max(axis=1)
    alike = own.candidates[np.argsort(worst, kind="stable")[:STARTS]]
    return [own.designs, *np.repeat(alike[:, np.newaxis], len(problem.vehicles), axis=1)]


def _worst(found: dict[bytes, SharedDesign], count: int) -> float:
    fitting = [one.worst for one in found.values() if one.sharing.total <= count]
    return min(fitting, default=float("inf"))


def _best(found: dict[bytes, SharedDesign]) -> tuple[SharedDesign, ...]:
    """Of each count the best, where it is better than all with fewer numbers."""
    best: list[SharedDesign] = []
    for one in sorted(found.values(), key=lambda one: (one.sharing.total, one.worst)):
        if not best or one.worst < best[-1].worst:
            best.append(one)
    first = {one.sharing.total: one for one in reversed(best)}
    return tuple(first[count] for count in sorted(first))


def _exchanged(
    problem: SharingProblem, library: PartLibrary, one: SharedDesign
) -> RealArray | None:
    """Put other values of the library into one number after the other, wherever vehicles gain.

    Gradients do not leave the corner of the bounds that they end in; this does.
    """
    designs, gained = one.designs.copy(), False
    score = _eagerness(one.excess)
    for _ in range(EXCHANGES):
        before = score
        for part, columns in enumerate(problem.columns):
            for number in range(one.sharing.counts[part]):
                users = np.flatnonzero(one.sharing.numbers[part] == number)
                values = library.values[part]
                tried = np.repeat(designs[np.newaxis], len(values), axis=0)
                tried[np.ix_(np.arange(len(values)), users, np.array(columns))] = values[
                    :, np.newaxis
                ]
                scores = _eagerness(problem.own(tried) - problem.limits)
                if scores.min() < score:
                    designs, score = tried[np.argmin(scores)], scores.min()
                    gained = True
        if score >= before:
            break
    return designs if gained else None


def _eagerness(excess: RealArray) -> RealArray:
    """Measure that the worst vehicles lead, (…, v) → (…)."""
    return np.asarray(np.log(np.mean(np.exp(SHARPNESS * excess), axis=-1)) / SHARPNESS)


def _of_count(found: dict[bytes, SharedDesign], count: int) -> list[SharedDesign]:
    fitting = [one for one in found.values() if one.sharing.total == count]
    return sorted(fitting, key=lambda one: one.worst)


def _merged(
    problem: SharingProblem, one: SharedDesign
) -> Iterator[tuple[Sharing, list[RealArray]]]:
    """Join pairs of numbers; all their users begin with the value of one, then of the other."""
    for part, count in enumerate(one.sharing.counts):
        columns, numbers = np.array(problem.columns[part]), one.sharing.numbers[part]
        for pair in combinations(range(count), 2):
            sharing = one.sharing.merged(part, *pair)
            if not problem.rules.kept_by(sharing):
                continue
            users, starts = np.flatnonzero(np.isin(numbers, pair)), []
            for number in pair:
                designs = one.designs.copy()
                holder = np.flatnonzero(numbers == number)[0]
                designs[np.ix_(users, columns)] = one.designs[holder, columns]
                starts.append(designs)
            yield sharing, starts


def _refuse_unreachable(problem: SharingProblem, own: OwnOptima) -> None:
    missed = own.levels - problem.limits
    binding = int(np.argmax(missed))
    if missed[binding] > 0.0:
        unit = problem.evaluate.response_unit
        raise InputError(
            f"{problem.vehicles[binding]} cannot keep its limit of {problem.limits[binding]:.4g} "
            f"{unit}: with parts of its own it reaches {own.levels[binding]:.4g} {unit}, "
            f"{missed[binding]:.3g} too much; {int((missed > 0).sum())} of {missed.size} vehicles "
            "miss theirs: raise the limit or widen the bounds"
        )


def _bound(problem: SharingProblem, least: Sharing, starts: Sequence[RealArray]) -> int:
    """Return the least count that the relaxation leaves possible."""
    best = least.total + len(problem.part_names)
    for parts in chain([()], _subsets(len(problem.part_names))):
        numbers = least.numbers.copy()
        # where rules keep vehicles apart, nobody knows which of the others share with which
        for part in {*parts, *np.flatnonzero(np.array(least.counts) > 1).tolist()}:
            numbers[part] = problem.rules.units(problem.part_names[part], problem.vehicles)
        relaxed = Sharing(least.parts, least.vehicles, numbers)
        # a part that is free for each vehicle has at least one number more
        more = sum(relaxed.counts[part] > least.counts[part] for part in parts)
        if least.total + more >= best:
            continue
        if shared_design(problem, relaxed, starts, enough=0.0).worst <= 0.0:
            best = least.total + more
    return best


def _free(problem: SharingProblem, part: int) -> int:
    return len(np.unique(problem.rules.units(problem.part_names[part], problem.vehicles)))


def _subsets(count: int) -> Iterator[tuple[int, ...]]:
    """Non-empty subsets of the parts, small ones first."""
    return chain.from_iterable(combinations(range(count), size) for size in range(1, count + 1))
