"""How sure the numbers on a supplier's page are, from measurements that are drawn again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from deboom.arrays import RealArray
from deboom.explore.tolerance_samples import sobol_sample
from deboom.measurement.load_case import LoadCase
from deboom.measurement.propagated_interval import Interval, pivotal_interval
from deboom.mounts.mount import AXES
from deboom.mounts.operating_stiffness import mean_operating_stiffness
from deboom.study.supplier_study import SupplierStudy
from deboom.study.uncertain_index import UncertainIndex, index_like, uncertain_index
from deboom.vehicles.booming_peaks import TOLERANCE
from deboom.vehicles.fleet import lines_inside

MEASURED_AGAIN = 120
"""Draws of all measurements."""

MADE = 64
"""Draws of the tolerance in each of them."""


@dataclass(frozen=True, eq=False)
class SupplierCertainty:
    """The same numbers from data as measured and from data measured again.

    Parameters
    ----------
    study : SupplierStudy
        What is asked for.
    designs : mapping of str to array, shape (k,)
        Changed parts → design; today's is not among them [1].
    peak_frequency : array, shape (n_vehicle,)
        Loudest booming peak of each vehicle today, nan where there is none [Hz].
    """

    study: SupplierStudy
    designs: Mapping[str, RealArray]
    peak_frequency: RealArray

    @cached_property
    def uncertain(self) -> UncertainIndex:
        """The run's index with the errors of its data."""
        return uncertain_index(self.study.index, self.study.platform, self.study.parts)

    @cached_property
    def measured(self) -> dict[str, RealArray]:
        """From the data as measured."""
        cases = tuple(case for case, _ in self.study.load_cases)
        return self._drawn(self.study.index, cases)

    @cached_property
    def again(self) -> dict[str, RealArray]:
        """The same with a leading axis of draws."""
        rows = []
        for draw in range(MEASURED_AGAIN):
            fleet, cases = self.uncertain.data.drawn(draw, self.study.run.seed)
            index = index_like(self.study.index, fleet, cases, self.study.platform)
            rows.append(self._drawn(index, cases))
        return {name: np.stack([row[name] for row in rows]) for name in rows[0]}

    def change(self, name: str) -> Interval:
        """Change of the mean level by a design, shape (n_vehicle,) [dB]."""
        return self._interval("change", self._place(name) - 1)

    def mean_change(self, name: str) -> Interval:
        """Its mean over the vehicles [dB]."""
        place = self._place(name) - 1
        return pivotal_interval(
            self.measured["change"][place].mean(), self.again["change"][:, place].mean(axis=1)
        )

    def mean_difference(self, name: str, other: str) -> Interval:
        """Mean level of a design above that of another one [dB]."""
        places = [self._place(one) - 1 for one in (name, other)]
        measured, again = self.measured["change"], self.again["change"]
        return pivotal_interval(
            (measured[places[0]] - measured[places[1]]).mean(),
            (again[:, places[0]] - again[:, places[1]]).mean(axis=1),
        )

    def sigma_ratio(self, name: str) -> Interval:
        """Scatter in a design over today's, both summed over the vehicles [1]."""
        return self._interval("sigma_ratio", self._place(name) - 1)

    def sigma(self, name: str | None) -> Interval:
        """Scatter of the mean level in a design, None: today's, shape (n_vehicle,) [dB]."""
        return self._interval("sigma", self._place(name))

    def peak(self, name: str | None) -> Interval:
        """Level at the loudest peak of today, nan without one, shape (n_vehicle,) [dB(A)]."""
        return self._interval("peak", self._place(name))

    @cached_property
    def stiffness(self) -> Interval:
        """Mean magnitude of every direction over the first load case, nan: none, (n,) [N/m]."""
        return self._interval("stiffness", slice(None))

    @cached_property
    def loss(self) -> Interval:
        """Loss factor of every direction, mean over the same lines, nan: none, (n,) [1]."""
        return self._interval("loss", slice(None))

    @cached_property
    def leads(self) -> RealArray:
        """Share of draws that keep each vehicle's leading direction, to first order [1]."""
        return np.asarray((self.again["leader"] == self.measured["leader"]).mean(axis=0))

    @cached_property
    def share(self) -> Interval:
        """Share of each direction in σ², mean over the vehicles, to first order, (n,) [1]."""
        return self._interval("share", slice(None))

    @cached_property
    def gain(self) -> Interval:
        """σ of the wanted design per unit of each tolerance, to first order, (n,) [dB]."""
        return self._interval("gain", slice(None))

    def _place(self, name: str | None) -> int:
        return 0 if name is None else 1 + list(self.designs).index(name)

    def _interval(self, what: str, place: int | slice) -> Interval:
        measured, again = self.measured[what][place], self.again[what][:, place]
        known = np.isfinite(measured) & np.isfinite(again).all(axis=0)
        found = pivotal_interval(np.where(known, measured, 0.0), np.where(known, again, 0.0))
        lower, upper = (np.where(known, end, np.nan) for end in (found.lower, found.upper))
        return Interval(np.where(known, measured, np.nan), lower, upper, found.coverage)

    def _drawn(self, index: Any, cases: Sequence[LoadCase]) -> dict[str, RealArray]:
        study, scale = self.study, self.study.per_vehicle
        rows = np.stack([study.space.nominal, *self.designs.values()])
        level = index(rows) * scale
        draws = sobol_sample(study.check.n_draws, MADE, seed=study.run.seed)
        robust = replace(study.check, evaluate=index, sample=draws)
        robust_sigma = robust(rows).sigma * scale
        both = np.stack([study.space.nominal, study.wanted])
        today, wanted = index.gradient(both) * scale
        reach = np.abs(today) * (study.space.upper - study.space.lower)
        columns = [direction.column for direction in study.directions]
        squared = (wanted * study.wanted * study.space.relative_sigma) ** 2
        total = squared.sum(axis=1, keepdims=True)
        stiffness, loss = self._stiffness(cases[0])
        return {
            "change": level[1:] - level[0],
            "sigma": robust_sigma,
            "peak": self._peaks(index, rows),
            "sigma_ratio": _sums(robust_sigma)[1:] / _sums(robust_sigma)[0],
            "stiffness": stiffness,
            "loss": loss,
            "leader": reach.argmax(axis=1),
            "share": _over(squared, total)[:, columns].mean(axis=0),
            "gain": _per_tolerance(squared, study.space.tolerance, total)[:, columns].mean(axis=0),
        }

    def _peaks(self, index: Any, rows: RealArray) -> RealArray:
        """Highest level within the tolerance of today's loudest peak, (n, n_vehicle) [dB(A)]."""
        levels, lines = index.levels(rows), np.asarray(index.frequency)
        found = np.full(levels.shape[:2], np.nan)
        for vehicle, frequency in enumerate(self.peak_frequency):
            near = np.abs(lines - frequency) <= TOLERANCE
            if near.any():
                found[:, vehicle] = levels[:, vehicle, near].max(axis=1)
        return found

    def _stiffness(self, case: LoadCase) -> tuple[RealArray, RealArray]:
        """Mean magnitude [N/m] and loss factor [1] of every direction; nan: not measured."""
        mounts, band = self.study.platform.mounts, self.study.band
        lines = lines_inside(case.force.frequency, band, f"load case {case.name}")
        loss = []
        for mount in mounts:
            for axis in AXES:
                names = mount.channels(axis)
                if not set(names) <= set(case.force.channels):
                    loss.append(np.nan)
                    continue
                force = case.force.select(names).values[lines]
                displacement = case.displacement.select(names).values[lines]
                own = (force / displacement).mean(axis=1) if displacement.all() else np.array(1j)
                loss.append(float(np.mean(own.imag / own.real)) if own.size > 1 else np.nan)
        by_mount = [mean_operating_stiffness(mount, case, band) for mount in mounts]
        return np.concatenate(by_mount), np.array(loss)


def _over(values: RealArray, total: RealArray) -> RealArray:
    return np.asarray(np.divide(values, total, out=np.zeros_like(values), where=total > 0))


def _sums(sigma: RealArray) -> RealArray:
    """Over the vehicles, shape (n_design,)."""
    return np.asarray(sigma.sum(axis=-1))


def _per_tolerance(squared: RealArray, tolerance: RealArray, total: RealArray) -> RealArray:
    """``∂σ/∂tol_k = σ_k²/(σ tol_k)``; 0 where there is no tolerance."""
    per_unit = np.divide(squared, tolerance, out=np.zeros_like(squared), where=tolerance > 0)
    return _over(per_unit, np.sqrt(total))
