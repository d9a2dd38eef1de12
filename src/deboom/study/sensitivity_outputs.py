"""What of the levels is ranked by a sensitivity analysis."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np

from deboom.arrays import RealArray
from deboom.vehicles.load_case_index import LoadCaseIndex
from deboom.vehicles.synthesis import mean_energy_level


class Ranked(Enum):
    """What of a vehicle's levels is ranked."""

    decibels = "decibels"
    """SPLV, the sum of the decibels of all lines: a notch counts like a peak."""
    energy = "energy"
    """The level of the mean energy of all lines: the loud ones rule it."""

    @property
    def words(self) -> str:
        """What a report calls it."""
        return "sum of decibels (SPLV)" if self.is_sum else "energy level of the band"

    @property
    def is_sum(self) -> bool:
        """Whether it grows with the number of lines."""
        return self is Ranked.decibels

    @property
    def other(self) -> Ranked:
        """The one that is not ranked."""
        return Ranked.energy if self is Ranked.decibels else Ranked.decibels


@dataclass(frozen=True, eq=False)
class LevelOutputs:
    """Levels of a design: line by line, and the energy level and SPLV of each vehicle.

    All are means over the load cases with their weights.

    Parameters
    ----------
    index : LoadCaseIndex
        v vehicles, f lines.
    """

    index: LoadCaseIndex[Any, Any]

    @property
    def line_names(self) -> tuple[str, ...]:
        """Vehicle and frequency of each line's column."""
        return tuple(
            f"{vehicle} at {line:g} Hz"
            for vehicle in self.index.response_names
            for line in self.index.frequency
        )

    def __call__(self, designs: RealArray) -> RealArray:
        """Return lines, then energy levels, then SPLV, shape (n, v f + 2 v) [dB(A)]."""
        parts = [self._case(designs, name) for name in self.index.load_case_names]
        weighted = zip(self.index.weights, parts, strict=True)
        return np.asarray(sum(weight * part for weight, part in weighted))

    def _case(self, designs: RealArray, load_case: str) -> RealArray:
        level, lines = self.index.levels(designs, load_case), self.index.frequency
        energy = mean_energy_level(level, lines, (float(lines[0]), float(lines[-1])))
        return np.hstack([level.reshape(len(level), -1), energy, level.sum(axis=-1)])

    def split(self, values: RealArray, ranked: Ranked) -> tuple[RealArray, RealArray]:
        """Return of the values those of the lines, and those that are not `ranked`, (n, v)."""
        count = len(self.index.response_names)
        lines, energy, decibels = np.split(values, [-2 * count, -count], axis=1)
        return lines, energy if ranked is Ranked.decibels else decibels


def ranked_output(
    index: LoadCaseIndex[Any, Any], ranked: Ranked
) -> Callable[[RealArray], RealArray]:
    """Return the function from designs to what is ranked, shape (n, n_vehicle) [dB(A)]."""
    if ranked is Ranked.decibels:
        return index
    outputs, count = LevelOutputs(index), len(index.response_names)
    return lambda designs: outputs(designs)[:, -2 * count : -count]
