"""Vehicles that share part numbers, and the best part values of a given sharing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.optimize import NonlinearConstraint, minimize

from deboom.arrays import RealArray, frozen_copy
from deboom.errors import InputError
from deboom.explore.selection import Differentiable
from deboom.explore.space import DesignSpace, generator, responses

IntArray = npt.NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Sharing:
    """Part numbers of every vehicle.

    Parameters
    ----------
    parts : tuple of str, length m
        Such as the mounts.
    vehicles : tuple of str, length v
    numbers : array, shape (m, v)
        Part number of each part in each vehicle: 0, 1, … in the order in which vehicles first use
        them, whatever numbers were given.

    Raises
    ------
    InputError
        Another shape.
    """

    parts: tuple[str, ...]
    vehicles: tuple[str, ...]
    numbers: IntArray

    def __post_init__(self) -> None:
        numbers = np.asarray(self.numbers, dtype=np.intp)
        if numbers.shape != (len(self.parts), len(self.vehicles)):
            raise InputError(
                f"part numbers of shape {numbers.shape} for {len(self.parts)} parts in "
                f"{len(self.vehicles)} vehicles: give one row per part, one column per vehicle"
            )
        in_order = [_in_order(row) for row in numbers]
        object.__setattr__(self, "numbers", frozen_copy(np.array(in_order, dtype=np.intp)))

    @classmethod
    def of_all(cls, parts: Sequence[str], vehicles: Sequence[str]) -> Sharing:
        """One part number of each part for all vehicles."""
        shape = (len(parts), len(vehicles))
        return cls(tuple(parts), tuple(vehicles), np.zeros(shape, dtype=np.intp))

    @property
    def counts(self) -> tuple[int, ...]:
        """Part numbers of each part."""
        return tuple(int(row.max()) + 1 for row in self.numbers)

    @property
    def total(self) -> int:
        """Part numbers in all."""
        return sum(self.counts)

    @property
    def key(self) -> bytes:
        """Equal for equal sharings of the same parts and vehicles."""
        return self.numbers.tobytes()

    def members(self, part: int, number: int) -> tuple[str, ...]:
        """Vehicles that use a part number."""
        users = np.flatnonzero(self.numbers[part] == number)
        return tuple(self.vehicles[user] for user in users)

    def separated(self, parts: Sequence[int], vehicles: npt.NDArray[np.bool_]) -> Sharing:
        """Give the marked vehicles new numbers of some parts, one for all of them.

        Parameters
        ----------
        parts : sequence of int
        vehicles : bool array, shape (v,)

        Returns
        -------
        Sharing
        """
        numbers = self.numbers.copy()
        for part in parts:
            numbers[part, vehicles] = numbers[part].max() + 1
        return Sharing(self.parts, self.vehicles, numbers)

    def merged(self, part: int, one: int, other: int) -> Sharing:
        """Replace two numbers of a part by one."""
        numbers = self.numbers.copy()
        numbers[part, numbers[part] == other] = one
        return Sharing(self.parts, self.vehicles, numbers)


@dataclass(frozen=True)
class SharingRules:
    """What is decided already: same part numbers, different part numbers.

    Parameters
    ----------
    together : mapping of str to sequence of sequence of str
        Part → sets of vehicles that have one number of it.
    apart : mapping of str to sequence of sequence of str
        Part → sets of vehicles of which no two have one number of it.
    """

    together: Mapping[str, Sequence[Sequence[str]]]
    apart: Mapping[str, Sequence[Sequence[str]]]

    def check(self, parts: Sequence[str], vehicles: Sequence[str]) -> None:
        """Refuse unknown names and rules that exclude each other.

        Raises
        ------
        InputError
            Names part, vehicles and both rules.
        """
        for rule, given in (("together", self.together), ("apart", self.apart)):
            for part, groups in given.items():
                if part not in parts:
                    raise InputError(f"{rule}: there is no part '{part}', only {list(parts)}")
                unknown = sorted({name for group in groups for name in group} - set(vehicles))
                if unknown:
                    raise InputError(
                        f"{rule}: {part} names the vehicles {unknown}, there are {list(vehicles)}"
                    )
        for part in parts:
            units = self.units(part, vehicles)
            for one, other in self._pairs_apart(part):
                if units[vehicles.index(one)] == units[vehicles.index(other)]:
                    raise InputError(
                        f"{part}: {one} and {other} must not share a part number, and by the "
                        "rules of what belongs together they must: drop one of the rules"
                    )

    def units(self, part: str, vehicles: Sequence[str]) -> IntArray:
        """Return the set of each vehicle that must share a part, shape (v,)."""
        unit = np.arange(len(vehicles))
        for group in self.together.get(part, ()):
            places = [vehicles.index(name) for name in group]
            joined = np.isin(unit, unit[places])
            unit[joined] = unit[places].min()
        return unit

    def clash(self, part: str, vehicles: Sequence[str]) -> npt.NDArray[np.bool_]:
        """Mark pairs of vehicles that must not share a part, shape (v, v)."""
        units = self.units(part, vehicles)
        marked = np.zeros((len(vehicles), len(vehicles)), dtype=bool)
        for one, other in self._pairs_apart(part):
            first = units == units[vehicles.index(one)]
            second = units == units[vehicles.index(other)]
            marked |= np.outer(first, second) | np.outer(second, first)
        return marked

    def kept_by(self, sharing: Sharing) -> bool:
        """Say whether a sharing keeps the rules."""
        for row, part in enumerate(sharing.parts):
            numbers = sharing.numbers[row]
            same = numbers[:, np.newaxis] == numbers
            units = self.units(part, sharing.vehicles)
            must = units[:, np.newaxis] == units
            if np.any(must & ~same) or np.any(self.clash(part, sharing.vehicles) & same):
                return False
        return True

    def fewest(self, parts: Sequence[str], vehicles: Sequence[str]) -> Sharing:
        """Return a sharing with the fewest numbers that keep the rules, whatever it costs.

        Vehicles are taken in their order, and each gets the first number with which the others can
        still do.
        """
        rows = [_fewest(self.units(part, vehicles), self.clash(part, vehicles)) for part in parts]
        return Sharing(tuple(parts), tuple(vehicles), np.array(rows, dtype=np.intp))

    def _pairs_apart(self, part: str) -> list[tuple[str, str]]:
        return [
            (one, other)
            for group in self.apart.get(part, ())
            for place, one in enumerate(group)
            for other in group[place + 1 :]
        ]


NO_RULES = SharingRules({}, {})
"""Every vehicle may share every part with every other."""


def _fewest(units: IntArray, clash: npt.NDArray[np.bool_]) -> list[int]:
    """Return the fewest numbers of vehicles, shape (v,), so that none that clash share one."""

    def filled(numbers: list[int], most: int) -> list[int] | None:
        place = len(numbers)
        if place == len(units):
            return numbers
        if units[place] < place:
            return filled([*numbers, numbers[units[place]]], most)
        forbidden = {numbers[other] for other in range(place) if clash[place, other]}
        for number in range(min(max(numbers, default=-1) + 2, most)):
            if number not in forbidden and (found := filled([*numbers, number], most)):
                return found
        return None

    return next(found for most in range(1, len(units) + 1) if (found := filled([], most)))


def _in_order(row: IntArray) -> list[int]:
    """Count again in the order of first use."""
    seen: dict[int, int] = {}
    return [seen.setdefault(number, len(seen)) for number in row.tolist()]


SAME_LEVEL = 0.02
"""Own optima whose levels in all vehicles differ by less are taken for one [unit]."""


@dataclass(frozen=True, eq=False)
class SharingProblem:
    """A fleet in which every vehicle has a design of its own, made of parts with part numbers.

    Parameters
    ----------
    evaluate : Differentiable
        One response per vehicle, smaller is better.
    space : DesignSpace
        Of one vehicle's design; continuous variables.
    parts : mapping of str to sequence of str
        Part → its variables, which a part number fixes together. Every variable belongs to one.
    limits : array, shape (v,)
        Largest allowed response of each vehicle [response_unit].
    rules : SharingRules

    Raises
    ------
    InputError
        Variables without a part or with two, other limits than vehicles, contradictory rules, a
        model without gradient, a variable of whole numbers.
    """

    evaluate: Differentiable
    space: DesignSpace
    parts: Mapping[str, Sequence[str]]
    limits: RealArray
    rules: SharingRules = NO_RULES

    def __post_init__(self) -> None:
        if not hasattr(self.evaluate, "gradient"):
            raise InputError(
                f"{type(self.evaluate).__name__} has no gradient: shared parts are found by "
                "gradients, use a model that offers one"
            )
        if self.space.integer.any():
            raise InputError("part numbers are shared among continuous variables only")
        listed = [name for names in self.parts.values() for name in names]
        if sorted(listed) != sorted(self.space.names):
            raise InputError(
                f"the parts have the variables {sorted(listed)}, the designs "
                f"{sorted(self.space.names)}: put every variable into exactly one part"
            )
        limits = np.array(self.limits, dtype=float)
        if limits.shape != (len(self.vehicles),) or not np.all(np.isfinite(limits)):
            raise InputError(f"give each of the vehicles {list(self.vehicles)} a finite limit")
        object.__setattr__(self, "limits", frozen_copy(limits))
        self.rules.check(self.part_names, self.vehicles)

    @property
    def vehicles(self) -> tuple[str, ...]:
        """One per response."""
        return tuple(self.evaluate.response_names)

    @property
    def part_names(self) -> tuple[str, ...]:
        """In the order of the parts."""
        return tuple(self.parts)

    @cached_property
    def columns(self) -> tuple[tuple[int, ...], ...]:
        """Columns of each part's variables in a design."""
        place = {name: column for column, name in enumerate(self.space.names)}
        return tuple(tuple(place[name] for name in names) for names in self.parts.values())

    def own(self, designs: RealArray) -> RealArray:
        """Return the response of each vehicle to its own design, (…, v, k) → (…, v)."""
        # vehicles that share all parts have one design: evaluate it once
        flat = designs.reshape(-1, designs.shape[-1])
        different, place = np.unique(flat, axis=0, return_inverse=True)
        values = responses(self.evaluate, different)[place.ravel()]
        n_vehicles = len(self.vehicles)
        return np.asarray(np.einsum("...vv->...v", values.reshape(*designs.shape[:-1], n_vehicles)))

    def own_gradient(self, designs: RealArray) -> RealArray:
        """Return the derivative of each vehicle's response by its own design, (v, k) → (v, k)."""
        different, place = np.unique(designs, axis=0, return_inverse=True)
        gradient = self.evaluate.gradient(different)
        return np.asarray(gradient[place.ravel(), np.arange(len(self.vehicles))])


@dataclass(frozen=True, eq=False)
class SharedDesign:
    """A sharing with values for its part numbers.

    Parameters
    ----------
    sharing : Sharing
    designs : array, shape (v, k)
        Of the vehicles [units]; equal where numbers are shared.
    levels : array, shape (v,)
        Response of each vehicle [response_unit].
    excess : array, shape (v,)
        Beyond its limit; negative where room is left [response_unit].
    """

    sharing: Sharing
    designs: RealArray
    levels: RealArray
    excess: RealArray

    def __post_init__(self) -> None:
        for name in ("designs", "levels", "excess"):
            object.__setattr__(self, name, frozen_copy(np.asarray(getattr(self, name), float)))

    @property
    def worst(self) -> float:
        """Largest excess [response_unit]."""
        return float(self.excess.max())


@dataclass(frozen=True, eq=False)
class OwnOptima:
    """What each vehicle could have with parts of its own.

    Parameters
    ----------
    levels : array, shape (v,)
        Best response [response_unit].
    designs : array, shape (v, k)
    candidates : array, shape (n, k)
        Different local optima of all vehicles: where a search for shared parts begins.
    """

    levels: RealArray
    designs: RealArray
    candidates: RealArray

    def __post_init__(self) -> None:
        for name in ("levels", "designs", "candidates"):
            object.__setattr__(self, name, frozen_copy(np.asarray(getattr(self, name), float)))


def own_optima(
    evaluate: Differentiable, space: DesignSpace, *, starts: int, seed: int
) -> OwnOptima:
    """Find the best design of each vehicle, as if it shared nothing.

    Parameters
    ----------
    evaluate : Differentiable
        One response per vehicle.
    space : DesignSpace
    starts : int
        Descents per vehicle, at least one: from the nominal design, then from random corners of
        the bounds, where stiffness factors like to end.
    seed : int
        Of the corners, from 1.

    Returns
    -------
    OwnOptima

    Raises
    ------
    InputError
        No start; seed 0.
    """
    if starts < 1:
        raise InputError(f"{starts} starts: at least one descent per vehicle is needed")
    random = generator(seed, "own optima")
    n_vehicles = len(evaluate.response_names)
    bounds = list(zip(space.lower, space.upper, strict=True))
    found: list[tuple[float, int, RealArray]] = []
    for vehicle in range(n_vehicles):
        for start in range(starts):
            corner = random.integers(0, 2, space.n_variables) == 1
            begin = space.nominal if start == 0 else np.where(corner, space.upper, space.lower)

            def level(design: RealArray, vehicle: int = vehicle) -> tuple[float, RealArray]:
                one = design[np.newaxis]
                return evaluate(one)[0, vehicle], evaluate.gradient(one)[0, vehicle]

            end = minimize(level, begin, jac=True, method="L-BFGS-B", bounds=bounds).x
            found.append((float(evaluate(end[np.newaxis])[0, vehicle]), vehicle, end))
    best = [min((f for f in found if f[1] == v), key=lambda f: f[0]) for v in range(n_vehicles)]
    ends = np.array([end for _, _, end in found])
    return OwnOptima(
        np.array([level for level, *_ in best]),
        np.array([end for *_, end in best]),
        ends[_different(responses(evaluate, ends))],
    )


def shared_design(
    problem: SharingProblem,
    sharing: Sharing,
    starts: Sequence[RealArray],
    *,
    enough: float = -np.inf,
    steps: int = 60,
) -> SharedDesign:
    """Find values for the part numbers of a sharing that keep the worst vehicle low.

    Parameters
    ----------
    problem : SharingProblem
    sharing : Sharing
    starts : sequence of array, shape (v, k)
        Designs to begin with; a number begins with the mean of its vehicles. The best end counts.
    enough : float
        Worst excess that ends the search: further starts are left out [response_unit].
    steps : int
        Of each descent.

    Returns
    -------
    SharedDesign

    Raises
    ------
    InputError
        No start.

    Notes
    -----
    Minimises t over part values and t, subject to ``level_v − limit_v ≤ t``: sequential quadratic
    programming (SLSQP) with exact gradients. A local optimum of a problem that has several.
    """
    numbering = _Numbering.of(problem, sharing)
    best: SharedDesign | None = None
    for start in starts:
        begin = numbering.values(start)
        # a descent over a kink may end above its start
        for values in (begin, _descend(problem, numbering, begin, steps)):
            found = _finished(problem, sharing, numbering.designs(values))
            if best is None or found.worst < best.worst:
                best = found
        if best is not None and best.worst <= enough:
            break
    if best is None:
        raise InputError("shared parts need a design to begin with: give at least one start")
    return best


def quietest_within_limits(problem: SharingProblem, start: SharedDesign) -> SharedDesign:
    """Lower the sum of all levels while every vehicle keeps its limit.

    Parameters
    ----------
    problem : SharingProblem
    start : SharedDesign
        Within all limits.

    Returns
    -------
    SharedDesign
        Within all limits; `start` itself where nothing was gained.
    """
    numbering = _Numbering.of(problem, start.sharing)

    def total(values: RealArray) -> tuple[float, RealArray]:
        designs = numbering.designs(values)
        return float(problem.own(designs).sum()), numbering.fold(problem.own_gradient(designs))

    def room(values: RealArray) -> RealArray:
        return np.asarray(problem.limits - problem.own(numbering.designs(values)))

    def room_gradient(values: RealArray) -> RealArray:
        return -numbering.rows(problem.own_gradient(numbering.designs(values)))

    end = minimize(
        total,
        numbering.values(start.designs),
        jac=True,
        method="SLSQP",
        bounds=numbering.bounds,
        constraints=[NonlinearConstraint(room, 0.0, np.inf, jac=room_gradient)],
        options={"maxiter": 40},
    )
    found = _finished(problem, start.sharing, numbering.designs(end.x))
    better = found.worst <= max(start.worst, 0.0) and found.levels.sum() < start.levels.sum()
    return found if better else start


@dataclass(frozen=True, eq=False)
class _Numbering:
    """Where the variables of each vehicle stand in the vector of part values."""

    places: npt.NDArray[np.intp]
    """Shape (v, k)."""
    bounds: list[tuple[float, float]]

    @classmethod
    def of(cls, problem: SharingProblem, sharing: Sharing) -> _Numbering:
        places = np.zeros((len(sharing.vehicles), problem.space.n_variables), dtype=np.intp)
        bounds: list[tuple[float, float]] = []
        for numbers, count, columns in zip(
            sharing.numbers, sharing.counts, problem.columns, strict=True
        ):
            for inner, column in enumerate(columns):
                places[:, column] = len(bounds) + numbers * len(columns) + inner
            pairs = [(problem.space.lower[c], problem.space.upper[c]) for c in columns]
            bounds += pairs * count
        return cls(places, bounds)

    def designs(self, values: RealArray) -> RealArray:
        """Part values (n,) → designs (v, k), within the bounds."""
        lower, upper = np.array(self.bounds).T
        return np.asarray(np.clip(values, lower, upper)[self.places])

    def values(self, designs: RealArray) -> RealArray:
        """Designs (v, k) → part values (n,), the mean where a number is shared."""
        users = np.bincount(self.places.ravel(), minlength=len(self.bounds))
        return np.asarray(self.fold(designs) / users)

    def fold(self, by_vehicle: RealArray) -> RealArray:
        """Add up what belongs to one part value, (v, k) → (n,)."""
        sums = np.bincount(
            self.places.ravel(), weights=by_vehicle.ravel(), minlength=len(self.bounds)
        )
        return sums.astype(float)

    def rows(self, by_vehicle: RealArray) -> RealArray:
        """Put each vehicle's row at its part values, (v, k) → (v, n)."""
        rows = np.zeros((len(by_vehicle), len(self.bounds)))
        np.put_along_axis(rows, self.places, by_vehicle, axis=1)
        return rows


def _descend(
    problem: SharingProblem, numbering: _Numbering, start: RealArray, steps: int
) -> RealArray:
    def excess(values: RealArray) -> RealArray:
        return np.asarray(problem.own(numbering.designs(values)) - problem.limits)

    def room(point: RealArray) -> RealArray:
        return np.asarray(point[-1] - excess(point[:-1]))

    def room_gradient(point: RealArray) -> RealArray:
        rows = numbering.rows(problem.own_gradient(numbering.designs(point[:-1])))
        return np.hstack([-rows, np.ones((len(rows), 1))])

    last = np.append(np.zeros(start.size), 1.0)

    def level(point: RealArray) -> tuple[float, RealArray]:
        return float(point[-1]), last

    end = minimize(
        level,
        np.append(start, excess(start).max()),
        jac=True,
        method="SLSQP",
        bounds=[*numbering.bounds, (-np.inf, np.inf)],
        constraints=[NonlinearConstraint(room, 0.0, np.inf, jac=room_gradient)],
        options={"maxiter": steps, "ftol": 1e-5},
    )
    return np.asarray(end.x[:-1])


def _finished(problem: SharingProblem, sharing: Sharing, designs: RealArray) -> SharedDesign:
    levels = problem.own(designs)
    return SharedDesign(sharing, designs, levels, levels - problem.limits)


def _different(levels: RealArray) -> list[int]:
    """Rows that differ from each row before them in some vehicle."""
    kept: list[int] = []
    for row, values in enumerate(levels):
        if all(np.abs(values - levels[other]).max() > SAME_LEVEL for other in kept):
            kept.append(row)
    return kept
