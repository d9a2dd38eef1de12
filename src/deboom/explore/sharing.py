"""Which vehicles have a part in common: one part number for several of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.arrays import frozen_copy
from deboom.errors import InputError

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
