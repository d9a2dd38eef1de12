"""What a supplier's parts do at the ears: alone, together, by their scatter, how surely."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pandas as pd

from deboom.arrays import RealArray
from deboom.explore.design_space import DesignSpace
from deboom.explore.robust import RobustResponse, RobustValues
from deboom.explore.sensitivity import sobol_designs
from deboom.explore.sensitivity_inputs import design_inputs
from deboom.explore.sigma_shares import SigmaShares, sigma_shares
from deboom.explore.sobol_indices import SobolIndices, sobol_indices
from deboom.explore.tolerance_samples import sobol_sample
from deboom.measurement.propagated_interval import Interval
from deboom.study.supplier_certainty import SupplierCertainty
from deboom.study.supplier_study import DRAWS, SupplierStudy
from deboom.vehicles.booming_peaks import PeakChange, compare_peaks

BASE_POINTS = 1024
"""Of the Sobol analysis."""
PART = 4096
"""Designs that are evaluated at a time."""
STEP = 0.01
"""By which a tolerance is made tighter: one percentage point [1]."""
ALL = "all parts"
PICKED = "as searched"
CHANGE = "change of level [dB]"


@dataclass(frozen=True, eq=False)
class SupplierEffects:
    """Effects of the wanted parts; every level is the mean over the lines of a vehicle.

    Parameters
    ----------
    study : SupplierStudy
        Whose parts.
    """

    study: SupplierStudy

    @cached_property
    def designs(self) -> dict[str, RealArray]:
        """Each mount alone as wanted, then all together, each of shape (k,) [1]."""
        alone = {mount.name: self.study.only(mount.name) for mount in self.study.platform.mounts}
        return {**alone, ALL: self.study.wanted}

    @cached_property
    def values(self) -> RobustValues:
        """Today's design, those of `designs`, and the picked one, with independent draws."""
        rows = [self.study.space.nominal, *self.designs.values(), self.study.picked]
        return self.study.check(np.stack(rows))

    @cached_property
    def change(self) -> dict[str, RealArray]:
        """Change of the mean level by `designs`, without scatter, shape (n_vehicle,) [dB]."""
        rows = np.stack([self.study.space.nominal, *self.designs.values()])
        splv = self.study.index(rows)
        return dict(zip(self.designs, (splv[1:] - splv[0]) * self.study.per_vehicle, strict=True))

    @cached_property
    def certainty(self) -> SupplierCertainty:
        """How sure these effects are, from measurements that are drawn again."""
        loudest = [_loudest(changes) for changes in self.peaks(self.study.wanted).values()]
        frequency = [change.frequency if change else np.nan for change in loudest]
        designs = {**self.designs, PICKED: self.study.picked}
        return SupplierCertainty(self.study, designs, np.array(frequency))

    @cached_property
    def half_width(self) -> dict[str, RealArray]:
        """Of the 90 % interval of `change`, shape (n_vehicle,) [dB]."""
        return {name: self.certainty.change(name).half_width for name in self.designs}

    @cached_property
    def importance(self) -> SobolIndices:
        """Sobol indices of every vehicle's level within the bounds of the design."""
        study = self.study
        inputs = design_inputs(study.space)
        designs = sobol_designs(inputs, BASE_POINTS, seed=study.run.seed, second_order=False)
        parts = [study.index(designs[at : at + PART]) for at in range(0, len(designs), PART)]
        return sobol_indices(
            np.concatenate(parts),
            inputs.factors,
            study.vehicles,
            seed=study.run.seed,
            second_order=False,
        )

    @cached_property
    def shares(self) -> SigmaShares:
        """Share of every direction in the scatter of the wanted design.

        Each counts with all of its scatter, also with what parts or axes have in common.
        """
        study = self.study
        if study.check.structure is None:
            return sigma_shares(study.check, study.wanted)
        draws = sobol_sample(study.space.n_variables, DRAWS, seed=study.run.seed)
        return sigma_shares(replace(study.check, sample=draws, structure=None), study.wanted)

    @cached_property
    def tolerance_gain(self) -> RealArray:
        """Fall of σ by a tolerance tighter by one percentage point, shape (k,) [dB].

        σ is the mean over the vehicles, the draws are the same before and after.
        """
        study = self.study
        scale = study.per_vehicle / len(study.vehicles)
        now = study.check(study.wanted[np.newaxis]).sigma_sum[0]
        gains = []
        for column, tolerance in enumerate(study.space.tolerance):
            step = min(STEP, 0.5 * float(tolerance))
            if step == 0.0:
                gains.append(0.0)
                continue
            tighter = with_tolerance(study.check, column, float(tolerance) - step)
            then = tighter(study.wanted[np.newaxis]).sigma_sum[0]
            gains.append(float(now - then) * scale * STEP / step)
        return np.array(gains)

    def peaks(self, design: RealArray) -> dict[str, tuple[PeakChange, ...]]:
        """Booming peaks of each vehicle today and in one design, in the first load case."""
        case, _ = self.study.load_cases[0]
        before, after = self.levels(design)
        frequency = np.asarray(self.study.index.frequency)
        return {
            name: compare_peaks(before[row], after[row], frequency, case.order)
            for row, name in enumerate(self.study.vehicles)
        }

    def levels(self, design: RealArray) -> RealArray:
        """SPL today and in one design, first load case, (2, n_vehicle, n_frequency) [dB(A)]."""
        return np.asarray(self.study.index.levels(np.stack([self.study.space.nominal, design])))


def with_tolerance(robust: RobustResponse, column: int, tolerance: float) -> RobustResponse:
    """Return a response whose variable of one column has another tolerance [1]."""
    space: DesignSpace = robust.space
    tolerances = np.array(space.tolerance)
    tolerances[column] = tolerance
    return replace(robust, space=replace(space, tolerance=tolerances))


def part_table(effects: SupplierEffects, shown: Callable[[str], str]) -> pd.DataFrame:
    """One row per part alone and for all together, and vehicle.

    Parameters
    ----------
    effects : SupplierEffects
        Of all parts.
    shown : callable
        From a vehicle's name to the one that is shown.
    """
    study, sure, rows = effects.study, effects.certainty, []
    scale = study.per_vehicle
    for place, (name, design) in enumerate(effects.designs.items(), 1):
        peaks = effects.peaks(design)
        change, both = sure.change(name), ((None, 0, "today"), (name, place, "then"))
        for row, vehicle in enumerate(study.vehicles):
            loudest = _loudest(peaks[vehicle])
            levels = (loudest.level_before, loudest.level_after) if loudest else (np.nan, np.nan)
            numbers: dict[str, float | str] = {
                "changed": name if name == ALL else f"only {name}",
                "vehicle": shown(vehicle),
                **_with_interval(CHANGE, change.about(effects.change[name]), row),
            }
            for which, at, when in both:
                sigma = sure.sigma(which).about(effects.values.sigma[at] * scale)
                numbers |= _with_interval(f"sigma {when} [dB]", sigma, row)
            numbers["loudest peak [Hz]"] = loudest.frequency if loudest else np.nan
            for (which, _, when), level in zip(both, levels, strict=True):
                peak = sure.peak(which).about(np.full(len(study.vehicles), level))
                numbers |= _with_interval(f"peak {when} [dB(A)]", peak, row)
            rows.append(numbers)
    return pd.DataFrame(rows)


def half_width_label(label: str) -> str:
    """Return the label of the half width that belongs to ``name [unit]``."""
    name, _, unit = label.rpartition(" [")
    return f"{name} ± 90 % [{unit}"


def _with_interval(label: str, interval: Interval, row: int) -> dict[str, float]:
    name, _, unit = label.rpartition(" [")
    return {
        label: float(interval.value[row]),
        f"{name}, from [{unit}": float(interval.lower[row]),
        f"{name}, to [{unit}": float(interval.upper[row]),
    }


def _loudest(changes: Sequence[PeakChange]) -> PeakChange | None:
    """Return the peak that is loudest today."""
    return max(changes, key=lambda change: change.level_before, default=None)
