"""What a supplier's parts do at the ears: alone, together, by their scatter, how surely."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pandas as pd

from deboom.explore.design_space import DesignSpace
from deboom.explore.robust import RobustResponse, RobustValues
from deboom.explore.sensitivity import sobol_designs
from deboom.explore.sensitivity_inputs import design_inputs
from deboom.explore.sigma_shares import SigmaShares, sigma_shares
from deboom.explore.sobol_indices import SobolIndices, sobol_indices
from deboom.explore.tolerance_samples import gaussian_sample
from deboom.physics.arrays import RealArray
from deboom.study.supplier_study import SupplierStudy
from deboom.vehicles.booming_peaks import PeakChange, compare_peaks

BASE_POINTS = 1024
"""Of the Sobol analysis."""
PART = 4096
"""Designs that are evaluated at a time."""
STEP = 0.01
"""By which a tolerance is made tighter: one percentage point [1]."""
KNOWN_DRAWS = 256
"""Of the measurement uncertainty of today's stiffnesses."""
TWO_SIDED_95 = 1.959964
"""Half width of a 95 % interval over its standard deviation, gaussian [1]."""
ALL = "all parts"
CHANGE = "change of level [dB]"
HALF_WIDTH = "± 95 % [dB]"


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
    def half_width(self) -> dict[str, RealArray]:
        """Of the 95 % interval of `change` by today's measured stiffness, (n_vehicle,) [dB].

        Notes
        -----
        Today's stiffness of each direction is off by an unknown factor, the same before and after,
        with the standard deviation that its error budget states; directions are independent.
        Directions without a usable surface have the measured force and add nothing.
        """
        study = self.study
        relative = np.zeros(study.space.n_variables)
        for direction in study.directions:
            if direction.name not in study.unidentified and direction.half_width_95 > 0.0:
                relative[direction.column] = direction.half_width_95 / TWO_SIDED_95
        draws = gaussian_sample(study.space.n_variables, KNOWN_DRAWS, seed=study.run.seed).values
        factors = 1.0 + relative * draws
        before = study.index(factors * study.space.nominal)
        found = {}
        for name, design in self.designs.items():
            moved = (study.index(factors * design) - before) * study.per_vehicle
            found[name] = TWO_SIDED_95 * moved.std(axis=0, ddof=1)
        return found

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
        """Share of every draw in the scatter of the wanted design."""
        return sigma_shares(self.study.check, self.study.wanted)

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
    study, rows = effects.study, []
    scale = study.per_vehicle
    for place, (name, design) in enumerate(effects.designs.items(), 1):
        peaks = effects.peaks(design)
        for row, vehicle in enumerate(study.vehicles):
            loudest = max(peaks[vehicle], key=lambda change: change.level_before, default=None)
            sigma, today = effects.values.sigma[place, row], effects.values.sigma[0, row]
            rows.append(
                {
                    "changed": name if name == ALL else f"only {name}",
                    "vehicle": shown(vehicle),
                    CHANGE: effects.change[name][row],
                    HALF_WIDTH: effects.half_width[name][row],
                    "sigma today [dB]": today * scale,
                    "sigma then [dB]": sigma * scale,
                    "loudest peak [Hz]": loudest.frequency if loudest else np.nan,
                    "peak today [dB(A)]": loudest.level_before if loudest else np.nan,
                    "peak then [dB(A)]": loudest.level_after if loudest else np.nan,
                }
            )
    return pd.DataFrame(rows)
