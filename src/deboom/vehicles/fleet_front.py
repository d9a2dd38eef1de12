"""A front as the vehicles of a fleet hear it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from deboom.arrays import IntArray, RealArray, checked
from deboom.explore.doe import sobol_designs
from deboom.explore.result import Front
from deboom.explore.space import DesignSpace, Evaluate, units_of
from deboom.measurement.booming_peaks import PeakChange, compare_peaks
from deboom.physics.sound_level import hearing_threshold

PEAK_COLUMNS = (
    "vehicle",
    "frequency before [Hz]",
    "speed before [rpm]",
    "SPL before [dB(A)]",
    "prominence before [dB]",
    "frequency after [Hz]",
    "speed after [rpm]",
    "SPL after [dB(A)]",
    "prominence after [dB]",
    "change [dB]",
)


COMMON_PERCENTILE = 95.0
"""Of the levels of cars as made, that is shown [%]."""


@checked(vehicles="v", levels="d v")
class CarLevels:
    """Mean levels of the lines of cars as made: each draw of the parts in each vehicle.

    - `vehicles`: names.
    - `levels` (d, v): of d draws in v vehicles [dB(A)].
    - raises InputError: levels of another number of vehicles, or that are not finite.

    See Also
    --------
    deboom.vehicles.fleet_front.FleetFront, deboom.BoomingModel

    Examples
    --------
    >>> from deboom.vehicles.fleet_front import CarLevels
    >>> cars = CarLevels(("U06-1",), [[50.0], [51.0], [52.0], [53.0]])
    >>> cars.share_within(51.5)
    array([0.5])
    """

    vehicles: tuple[str, ...]
    levels: RealArray

    def share_within(self, target: npt.ArrayLike) -> RealArray:
        """Return the share of the cars of each vehicle at or below a level, shape (v,) [1].

        - `target` (v,) or a number: level that a car shall not exceed [dB(A)].
        """
        return np.asarray(np.mean(self.levels <= np.asarray(target, dtype=float), axis=0))

    def percentile(self, percent: float = COMMON_PERCENTILE) -> RealArray:
        """Return the level that this share of the cars does not exceed, shape (v,) [dB(A)]."""
        return np.asarray(np.percentile(self.levels, percent, axis=0))


def load_cases_of(model: Any) -> tuple[str, ...]:
    """Names of the load cases of a model with levels, or of the pressures of a compressor."""
    names = getattr(model, "load_case_names", None)
    return tuple(model.case_names if names is None else names)


SOUND_UNIT = "dB(A)"


def sound_rows(model: Any) -> IntArray:
    """Return the numbers of the responses that are levels of sound; of a model without any, all."""
    units = units_of(model.response_names, model.response_unit)
    rows = [row for row, unit in enumerate(units) if unit == SOUND_UNIT]
    return np.array(rows or range(len(units)))


@dataclass(frozen=True, eq=False)
class PeakRise:
    """By how much a design raises the booming peak that rises most, as a search limits it.

    - `model`: with ``frequency`` and ``levels``.
    - `today` (k,): design that it is compared with.
    """

    model: Any
    today: RealArray

    response_names = ("rise of a booming peak",)
    response_unit = "dB"
    smooth = False

    @property
    def variable_names(self) -> tuple[str, ...]:
        """Those of the model."""
        return tuple(self.model.variable_names)

    def __call__(self, designs: npt.ArrayLike) -> RealArray:
        """Return the largest rise over vehicles and load cases, without scatter, (n, 1) [dB].

        Of today's peaks, and of new ones that are louder than today; 0 without any.
        """
        rows = np.vstack([self.today, np.asarray(designs, dtype=float)])
        rise = np.full(len(rows) - 1, -np.inf)
        for case in load_cases_of(self.model):
            every = np.asarray(self.model.levels(rows, case))
            before, *after = every[:, sound_rows(self.model)]
            for row, levels in enumerate(after):
                changes = (
                    peak.change
                    for pair in zip(before, levels, strict=True)
                    # the order tells the speed of a peak, which does not count here
                    for peak in compare_peaks(*pair, self.model.frequency, order=1.0)
                    if peak.counts
                )
                rise[row] = max([rise[row], *changes])
        return np.where(np.isfinite(rise), rise, 0.0)[:, np.newaxis]


@dataclass(frozen=True, eq=False)
class FleetFront:
    """Levels, booming peaks and vehicles behind a front of designs; levels without scatter.

    Vehicles are the ears: the driver's of each, and perhaps others. Vibrations are told by
    `deboom.pages.receivers`.

    - `front`: of a model with lines, such as `BoomingModel`.
    - `order`: of the lines whose levels are shown, per revolution [1].
    - `audible`: whether lines below the threshold of hearing count as that threshold in the mean
      levels of `cars` and `todays_levels`, whose notches would count otherwise.

    See Also
    --------
    deboom.explore.result.Front, deboom.vehicles.fleet_front.CarLevels
    deboom.vehicles.expected_change.ExpectedChange
    """

    front: Front
    order: float
    audible: bool = False

    @classmethod
    def keeping_peaks(cls, front: Front, order: float = 1.0) -> FleetFront:
        """Return a front whose none-louder and sigma-kept make no booming peak louder either."""
        return cls(replace(front, rise=cls(front, order).peak_rise), order)

    @property
    def model(self) -> Any:
        """The model, which has ``frequency`` and ``levels``."""
        return self.front.model

    @property
    def vehicles(self) -> tuple[str, ...]:
        """Names of the vehicles, and of further ears."""
        return tuple(self.front.responses[row] for row in self.ears)

    @cached_property
    def ears(self) -> IntArray:
        """Numbers of their responses, shape (v,)."""
        return sound_rows(self.model)

    @property
    def today(self) -> RealArray:
        """Today's design, shape (k,)."""
        return self.front.robust.space.nominal

    @property
    def frequency(self) -> RealArray:
        """Lines of the band, shape (n_frequency,) [Hz]."""
        return np.asarray(self.model.frequency)

    @property
    def weights(self) -> RealArray | None:
        """Weights of the vehicles in means and sums, shape (v,) [1]; None: all alike."""
        weights = self.front.robust.weights
        if weights is None:
            return None
        heard = weights[self.ears]
        return None if np.all(heard == heard[0]) and len(heard) < len(weights) else heard

    def mean(self, values: RealArray, rows: Sequence[int] | None = None) -> RealArray:
        """Return the mean over the vehicles, of some `rows` or all; see `Robust.mean`."""
        n_responses = len(self.front.responses)
        if len(self.ears) == n_responses:
            return self.front.robust.mean(values, rows)
        heard = np.asarray(values)
        every = np.zeros((*heard.shape[:-1], n_responses))
        every[..., self.ears] = heard
        chosen = self.ears if rows is None else self.ears[list(rows)]
        return self.front.robust.mean(every, chosen.tolist())

    def splv_change(self, design: RealArray) -> RealArray:
        """Change of SPLV over the number of lines against today's design, shape (v,) [dB]."""
        both = self.model(np.stack([self.today, design]))
        return np.asarray((both[1] - both[0]) / self.front.n_lines)[self.ears]

    def levels(self, design: RealArray) -> RealArray:
        """SPL of one design without scatter in the first case, shape (v, f) [dB(A)]."""
        return np.asarray(self.model.levels(design[np.newaxis, :])[0])[self.ears]

    def cars(self, design: RealArray) -> CarLevels:
        """Levels of cars with the parts of one design as made, in all draws that verify it."""
        sets = self.front.judge.sets
        if self.audible:
            levels = [self.mean_levels(robust.made(design)) for robust in sets]
        else:
            levels = [
                robust.made_responses(design)[1][:, self.ears] / self.front.n_lines
                for robust in sets
            ]
        return CarLevels(self.vehicles, np.concatenate(levels))

    def mean_levels(self, designs: RealArray) -> RealArray:
        """Return the mean over lines and load cases, of designs (n, k), shape (n, v) [dB(A)]."""
        if not self.audible:
            return np.asarray(self.model(designs) / self.front.n_lines)[:, self.ears]
        floor = hearing_threshold(self.frequency)
        weights = np.asarray(self.model.weights) / np.sum(self.model.weights)
        return np.asarray(
            sum(
                weight
                * np.maximum(self.model.levels(designs, case)[:, self.ears], floor).mean(axis=2)
                for case, weight in zip(self.load_cases, weights, strict=True)
            )
        )

    @property
    def n_cars(self) -> int:
        """Cars of each vehicle that `cars` makes."""
        return len(self.front.judge.sets) * self.front.judge.n_samples

    @property
    def todays_levels(self) -> RealArray:
        """Mean level of the lines of each vehicle with today's parts as drawn, (v,) [dB(A)]."""
        return np.asarray(self.mean_levels(self.today[np.newaxis])[0])

    def peak_changes(self, design: RealArray) -> dict[str, tuple[PeakChange, ...]]:
        """Booming peaks of each vehicle today and in one design."""
        before, after = self.levels(self.today), self.levels(design)
        return {
            name: compare_peaks(before[row], after[row], self.frequency, self.order)
            for row, name in enumerate(self.vehicles)
        }

    def peak_rise(self, designs: RealArray) -> RealArray:
        """Return by how much designs (n, k) raise the booming peak that rises most, (n,) [dB].

        Of all vehicles and load cases, without scatter; 0 where there is no booming peak.
        """
        return PeakRise(self.model, self.today)(designs)[:, 0]

    @property
    def load_cases(self) -> tuple[str, ...]:
        """Names of the load cases, or of the pressures of a compressor."""
        return load_cases_of(self.model)

    def peak_table(self, design: RealArray) -> pd.DataFrame:
        """Tabulate today's booming peaks and what becomes of them in one design."""
        rows = []
        for vehicle, changes in self.peak_changes(design).items():
            for change in changes:
                states = [
                    (peak.frequency, peak.rpm, level, peak.prominence)
                    if peak
                    else (np.nan, np.nan, level, np.nan)
                    for peak, level in (
                        (change.before, change.level_before),
                        (change.after, change.level_after),
                    )
                ]
                rows.append((vehicle, *states[0], *states[1], change.change))
        return pd.DataFrame(rows, columns=PEAK_COLUMNS)

    def vehicle_table(self, name: str) -> pd.DataFrame:
        """Tabulate level, change and σ of each vehicle, today and in a pick, over the scatter."""
        row, n_lines = self.front.picks[name], self.front.n_lines
        before = self.front.baseline.mean[0, self.ears] / n_lines
        after = self.front.values.mean[row, self.ears] / n_lines
        return pd.DataFrame(
            {
                "vehicle": list(self.vehicles),
                "level before [dB(A)]": before,
                "level after [dB(A)]": after,
                "change [dB]": after - before,
                "sigma before [dB]": self.front.baseline.sigma[0, self.ears] / n_lines,
                "sigma after [dB]": self.front.values.sigma[row, self.ears] / n_lines,
            }
        )

    def worst_vehicle(self, design: RealArray) -> int:
        """Row of the vehicle that a design helps least."""
        return int(np.argmax(self.splv_change(design)))


def same_designs(
    prescribed: Evaluate, other: Evaluate, space: DesignSpace, n: int = 256
) -> pd.DataFrame:
    """Compare the changes of the mean level by the same designs under two models, by vehicle."""
    designs = sobol_designs(space, n, seed=1)
    both = np.vstack([space.nominal, designs])
    first, second = (index(both)[1:] - index(both)[0] for index in (prescribed, other))
    pairs = list(zip(first.T, second.T, strict=True))
    return pd.DataFrame(
        {
            "vehicle": list(other.response_names),
            "correlation [1]": [float(np.corrcoef(x, y)[0, 1]) for x, y in pairs],
            "slope [1]": [float(np.polyfit(x, y, 1)[0]) for x, y in pairs],
        }
    )
