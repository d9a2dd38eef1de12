"""Vehicles that share part numbers, and the best part values of a given sharing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.optimize import NonlinearConstraint, minimize

from deboom.arrays import IntArray, RealArray, checked
from deboom.errors import InputError
from deboom.explore.space import DesignSpace, Differentiable, check_gradient, generator, responses

_SAME_LEVEL = 0.02  # optima whose levels differ by less in all vehicles are one [unit]
_OVERSHOOT = 1e-5  # room to a limit that SLSQP, which misses by up to 1e-6, is asked for [unit]


@checked(numbers="m v")
class Sharing:
    """Part numbers of every vehicle.

    - `parts`, `vehicles`: names of the parts, such as the mounts, and of the vehicles, m and v of
      them.
    - `numbers` (m, v): part number of each part in each vehicle: 0, 1, … in the order in which
      vehicles first use them, whatever numbers were given.
    """

    parts: tuple[str, ...]
    vehicles: tuple[str, ...]
    numbers: IntArray

    def __post_init__(self) -> None:
        in_order = np.zeros_like(self.numbers)
        for row, numbers in enumerate(self.numbers.tolist()):
            in_order[row] = [list(dict.fromkeys(numbers)).index(number) for number in numbers]
        in_order.setflags(write=False)
        object.__setattr__(self, "numbers", in_order)

    @property
    def counts(self) -> tuple[int, ...]:
        """Number of part numbers of each part."""
        return tuple(int(row.max()) + 1 for row in self.numbers)

    @property
    def total(self) -> int:
        """Number of part numbers in all."""
        return sum(self.counts)

    @property
    def key(self) -> bytes:
        """Equal for equal sharings of the same parts and vehicles."""
        return self.numbers.tobytes()

    def members(self, part: int, number: int) -> tuple[str, ...]:
        """Return the vehicles that use a part number."""
        users = np.flatnonzero(self.numbers[part] == number)
        return tuple(self.vehicles[user] for user in users)

    def merged(self, part: int, first: int, second: int) -> Sharing:
        """Return the sharing with two numbers of a part replaced by one."""
        numbers = self.numbers.copy()
        numbers[part, numbers[part] == second] = first
        return Sharing(self.parts, self.vehicles, numbers)


def check_together(
    together: Mapping[str, Sequence[Sequence[str]]], parts: Sequence[str], vehicles: Sequence[str]
) -> None:
    """Refuse unknown names in what vehicles are to share, see `SharingProblem`."""
    for part, sets in together.items():
        if part not in parts:
            raise InputError(f"together: there is no part '{part}', only {list(parts)}")
        unknown = sorted({name for names in sets for name in names} - set(vehicles))
        if unknown:
            raise InputError(
                f"together: {part} names the vehicles {unknown}, there are {list(vehicles)}"
            )


@checked(limits="v")
class SharingProblem:
    """A fleet in which every vehicle has a design of its own, made of parts with part numbers.

    - `evaluate`: model with one response per vehicle, smaller is better.
    - `space`: space of one vehicle's design; continuous variables.
    - `parts`: variables of each part, which a part number fixes together; every variable belongs to
      one.
    - `limits` (v,): largest allowed response of each vehicle [response_unit].
    - `together`: sets of vehicles that have one number of a part, by part.
    - raises InputError: a model without gradient; unknown names of what belongs together.
    """

    evaluate: Differentiable
    space: DesignSpace
    parts: Mapping[str, Sequence[str]]
    limits: RealArray
    together: Mapping[str, Sequence[Sequence[str]]]

    def __post_init__(self) -> None:
        check_gradient(self.evaluate, "shared parts are found by gradients")
        check_together(self.together, self.part_names, self.vehicles)

    @property
    def vehicles(self) -> tuple[str, ...]:
        """Names of the vehicles, one per response."""
        return tuple(self.evaluate.response_names)

    @property
    def part_names(self) -> tuple[str, ...]:
        """Names of the parts, in their order."""
        return tuple(self.parts)

    @cached_property
    def columns(self) -> tuple[tuple[int, ...], ...]:
        """Columns of each part's variables in a design."""
        return tuple(
            tuple(self.space.names.index(name) for name in names) for names in self.parts.values()
        )

    @cached_property
    def units(self) -> IntArray:
        """First vehicle of the set with which each vehicle must share each part, shape (m, v)."""
        units = np.tile(np.arange(len(self.vehicles)), (len(self.parts), 1))
        for part, unit in zip(self.part_names, units, strict=True):
            for names in self.together.get(part, ()):
                places = [self.vehicles.index(name) for name in names]
                unit[np.isin(unit, unit[places])] = unit[places].min()
        return units

    def allowed(self, sharing: Sharing) -> bool:
        """Say whether vehicles share what belongs together."""
        needed = np.take_along_axis(sharing.numbers, self.units, axis=1)
        return np.array_equal(sharing.numbers, needed)

    def response_of_each(self, designs: RealArray) -> RealArray:
        """Return the response of each vehicle to its own design, (…, v, k) → (…, v)."""
        # vehicles that share all parts have one design: evaluate it once
        flat = designs.reshape(-1, designs.shape[-1])
        different, place = np.unique(flat, axis=0, return_inverse=True)
        values = responses(self.evaluate, different)[place.ravel()]
        n_vehicles = len(self.vehicles)
        return np.asarray(np.einsum("...vv->...v", values.reshape(*designs.shape[:-1], n_vehicles)))

    def gradient_of_each(self, designs: RealArray) -> RealArray:
        """Return the derivative of each vehicle's response by its own design, (v, k) → (v, k)."""
        different, place = np.unique(designs, axis=0, return_inverse=True)
        gradient = self.evaluate.gradient(different)
        return np.asarray(gradient[place.ravel(), np.arange(len(self.vehicles))])


@checked(designs="v k", levels="v", excess="v")
class SharedDesign:
    """A sharing with values for its part numbers.

    - `sharing`: part numbers.
    - `designs` (v, k): design of each vehicle [units]; equal where numbers are shared.
    - `levels`, `excess` (v,): response of each vehicle, and its distance beyond the limit
      [response_unit].
    """

    sharing: Sharing
    designs: RealArray
    levels: RealArray
    excess: RealArray

    @property
    def worst(self) -> float:
        """Largest excess [response_unit]."""
        return float(self.excess.max())


@checked(levels="v", designs="v k", candidates="n k")
class SeparateOptima:
    """What each vehicle could have with parts of its own.

    - `levels` (v,), `designs` (v, k): best response of each vehicle [response_unit], its design.
    - `candidates` (n, k): different local optima of all vehicles: where a search for shared parts
      begins.
    """

    levels: RealArray
    designs: RealArray
    candidates: RealArray


def separate_optima(
    evaluate: Differentiable, space: DesignSpace, *, starts: int, seed: int
) -> SeparateOptima:
    """Find the best design of each vehicle, as if it shared nothing.

    ``starts`` descents per vehicle, at least one: from the nominal design, then from random corners
    of the bounds, where stiffness factors like to end.
    """
    if starts < 1:
        raise InputError(f"{starts} starts: at least one descent per vehicle is needed")
    random = generator(seed, "own optima")
    n_vehicles = len(evaluate.response_names)
    bounds = list(zip(space.lower, space.upper, strict=True))
    levels, ends = np.empty((n_vehicles, starts)), np.empty((n_vehicles, starts, len(bounds)))
    for vehicle in range(n_vehicles):

        def level(design: RealArray, vehicle: int = vehicle) -> tuple[float, RealArray]:
            row = design[np.newaxis]
            return evaluate(row)[0, vehicle], evaluate.gradient(row)[0, vehicle]

        for start in range(starts):
            corner = random.integers(0, 2, space.n_variables) == 1
            begin = space.nominal if start == 0 else np.where(corner, space.upper, space.lower)
            end = minimize(level, begin, jac=True, method="L-BFGS-B", bounds=bounds).x
            ends[vehicle, start] = end
            levels[vehicle, start] = evaluate(end[np.newaxis])[0, vehicle]
    best = np.arange(n_vehicles), levels.argmin(axis=1)
    candidates = ends.reshape(-1, len(bounds))
    different = _different(responses(evaluate, candidates))
    return SeparateOptima(levels[best], ends[best], candidates[different])


def _different(levels: RealArray) -> list[int]:
    """Rows that differ from each row before them in some vehicle."""
    kept: list[int] = []
    for row, values in enumerate(levels):
        if all(np.abs(values - levels[other]).max() > _SAME_LEVEL for other in kept):
            kept.append(row)
    return kept


def shared_design(
    problem: SharingProblem,
    sharing: Sharing,
    starts: Sequence[RealArray],
    *,
    enough: float = -np.inf,
    steps: int = 60,
) -> SharedDesign:
    """Find values for the part numbers of a sharing that keep the worst vehicle low.

    - `problem`, `sharing`: fleet and part numbers.
    - `starts`: one array (v, k) or more to begin with; a number begins with the mean of its
      vehicles. The best end counts.
    - `enough`: worst excess that ends the search: further starts are left out [response_unit].
    - `steps`: largest number of steps of each descent.

    Minimises t over part values and t, subject to ``level_v − limit_v ≤ t``: sequential quadratic
    programming (SLSQP) with exact gradients. A local optimum of a problem that has several.
    """
    if not len(starts):
        raise InputError("shared parts need a design to begin with: give at least one start")
    numbering = _Numbering.of(problem, sharing)
    tried: list[SharedDesign] = []
    for start in starts:
        begin = numbering.values(start)
        # a descent over a kink may end above its start
        for values in (begin, _descend(problem, numbering, begin, steps)):
            tried.append(_finished(problem, sharing, numbering.designs(values)))
        best = min(tried, key=lambda design: design.worst)
        if best.worst <= enough:
            break
    return best


def quietest_within_limits(problem: SharingProblem, start: SharedDesign) -> SharedDesign:
    """Lower the sum of all levels while every vehicle keeps its limit, from a design that does."""
    numbering = _Numbering.of(problem, start.sharing)

    def total(values: RealArray) -> tuple[float, RealArray]:
        designs = numbering.designs(values)
        return float(problem.response_of_each(designs).sum()), numbering.fold(
            problem.gradient_of_each(designs)
        )

    def room(values: RealArray) -> RealArray:
        return np.asarray(problem.limits - problem.response_of_each(numbering.designs(values)))

    def room_gradient(values: RealArray) -> RealArray:
        return -numbering.rows(problem.gradient_of_each(numbering.designs(values)))

    end = minimize(
        total,
        numbering.values(start.designs),
        jac=True,
        method="SLSQP",
        bounds=numbering.bounds,
        constraints=[NonlinearConstraint(room, _OVERSHOOT, np.inf, jac=room_gradient)],
        options={"maxiter": 40},
    )
    quiet = _finished(problem, start.sharing, numbering.designs(end.x))
    better = quiet.worst <= max(start.worst, 0.0) and quiet.levels.sum() < start.levels.sum()
    return quiet if better else start


@dataclass(frozen=True, eq=False)
class _Numbering:
    """Where the variables of each vehicle stand, (v, k), in the vector of part values."""

    places: npt.NDArray[np.intp]
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
    """Part values, (n,), where a descent of the worst excess ends."""

    def excess(values: RealArray) -> RealArray:
        return np.asarray(problem.response_of_each(numbering.designs(values)) - problem.limits)

    def room(point: RealArray) -> RealArray:
        return np.asarray(point[-1] - excess(point[:-1]))

    def room_gradient(point: RealArray) -> RealArray:
        rows = numbering.rows(problem.gradient_of_each(numbering.designs(point[:-1])))
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
        constraints=[NonlinearConstraint(room, _OVERSHOOT, np.inf, jac=room_gradient)],
        options={"maxiter": steps, "ftol": 1e-5},
    )
    return np.asarray(end.x[:-1])


def _finished(problem: SharingProblem, sharing: Sharing, designs: RealArray) -> SharedDesign:
    levels = problem.response_of_each(designs)
    return SharedDesign(sharing, designs, levels, levels - problem.limits)
