"""The numbers behind the report of a robust front: picks, levels, peaks, stiffnesses."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from deboom.arrays import RealArray
from deboom.explore.fronts import Verification, verification_response
from deboom.explore.problems import SearchResult
from deboom.explore.robust import RobustResponse, RobustValues
from deboom.explore.selection import (
    at_nominal,
    indifference_intervals,
    pick,
    variables_without_effect,
)
from deboom.files.platform import Platform
from deboom.measurement.load_case import LoadCase
from deboom.mounts.operating_stiffness import mean_operating_stiffness
from deboom.study.motion_report import MotionReport, factor_name, motion_name, motion_report
from deboom.vehicles.booming_peaks import PeakChange, compare_peaks
from deboom.vehicles.load_case_index import LoadCaseIndex
from deboom.vehicles.loss_factor_index import LossFactorIndex
from deboom.vehicles.synthesis import mean_energy_level

ENERGY_BAND = (25.0, 40.0)
"""Band of the energy level that stands beside SPLV [Hz]."""
NOTICEABLE = 0.1
"""Change of the mean level of the lines that counts as noticeable [dB]."""
N_PER_MM = 1e-3
"""From N/m to N/mm."""


@dataclass(frozen=True, eq=False)
class RobustFront:
    """A search over a platform's mounts, verified, with everything its report needs.

    Levels are those of the first load case; objectives are those of all.

    Parameters
    ----------
    platform : Platform
        As measured.
    index : LoadCaseIndex
        What was evaluated.
    robust : RobustResponse
        How it was made robust.
    search : SearchResult
        What was found.
    verification : Verification
        The found front, re-evaluated.
    note : str
        What else there is to say about the search.
    """

    platform: Platform
    index: LoadCaseIndex[Any, Any] | LossFactorIndex
    robust: RobustResponse
    search: SearchResult
    verification: Verification
    note: str = ""

    @property
    def vehicles(self) -> tuple[str, ...]:
        """Names of the vehicles the search served."""
        return self.index.response_names

    @property
    def variables(self) -> tuple[str, ...]:
        """Names of the design variables."""
        return self.index.variable_names

    @property
    def load_case(self) -> LoadCase:
        """The load case whose levels are shown."""
        return self.platform.load_case(self.index.load_case_names[0])

    @property
    def model(self) -> LoadCaseIndex[Any, Any]:
        """The model of the motion; behind loss factors it is that of the split stiffnesses."""
        return self.index.split if isinstance(self.index, LossFactorIndex) else self.index

    @property
    def stiffness_variables(self) -> tuple[str, ...]:
        """Variables that are stiffness factors; loss factors come after them."""
        return tuple(name for mount in self.platform.mounts for name in mount.variables)

    @property
    def named_designs(self) -> dict[str, RealArray]:
        """Today's design and the picks, each of shape (n_variable,) [1]."""
        return {"today's": self.robust.space.nominal, **self.pick_designs}

    @property
    def motion(self) -> str:
        """In a word, how the powertrain answers a design."""
        return motion_name(self.model)

    @property
    def facts(self) -> dict[str, str | int]:
        """What ``run.json`` says beside the arguments."""
        sample = self.robust.sample
        return {
            "motion": self.motion,
            "design_factor": factor_name(self.model),
            "kernel": self.index.kernel.name,
            "objectives": "; ".join(objective.name for objective in self.robust.objectives),
            "estimator": self.robust.estimator.kind,
            "tolerance_sample": sample.kind,
            "tolerance_draws": sample.n_samples,
            "verification_draws": self.verification.n_samples,
        }

    @cached_property
    def motion_report(self) -> MotionReport:
        """What there is to say about motion and stiffness factors, checked at the picks."""
        designs = np.stack([self.robust.space.nominal, *self.pick_designs.values()])
        return motion_report(self.model, designs)

    @property
    def frequency(self) -> RealArray:
        """Lines of the band, shape (n_frequency,) [Hz]."""
        return np.asarray(self.index.frequency)

    @property
    def per_line(self) -> float:
        """Factor from a sum over vehicles and lines to the mean over both [1]."""
        return 1.0 / (self.index.n_lines * len(self.vehicles))

    @cached_property
    def without_effect(self) -> tuple[str, ...]:
        """Variables that no vehicle's SPLV depends on."""
        return variables_without_effect(self.index, self.robust.space)

    @cached_property
    def picks(self) -> dict[str, int]:
        """Rows of the front by name of the pick, chosen on verified values."""
        rows = pick(self.verification.values)
        return {
            "best mean": rows.best_mean,
            "best sigma": rows.best_sigma,
            "knee": rows.knee,
        }

    @cached_property
    def pick_designs(self) -> dict[str, RealArray]:
        """Design of each pick, shape (n_variable,); variables without effect are at nominal [1]."""
        designs = at_nominal(
            self.verification.values.designs, self.robust.space, self.without_effect
        )
        return {name: designs[row] for name, row in self.picks.items()}

    @cached_property
    def _verified_response(self) -> RobustResponse:
        check = self.verification
        return verification_response(self.robust, check.n_samples, seed=check.seed)

    @cached_property
    def baseline(self) -> RobustValues:
        """The nominal design under the verification's draws; one row."""
        return self._verified_response(self.robust.space.nominal[np.newaxis, :])

    def shown_levels(self, design: RealArray) -> RealArray:
        """SPL of one design without scatter, shape (n_vehicle, n_frequency) [dB(A)]."""
        return np.asarray(self.index.levels(design[np.newaxis, :])[0])

    def splv_change(self, design: RealArray) -> RealArray:
        """Change of SPLV over the number of lines, shape (n_vehicle,) [dB]."""
        both = self.index(np.stack([self.robust.space.nominal, design]))
        return np.asarray((both[1] - both[0]) / self.index.n_lines)

    def energy_change(self, design: RealArray) -> RealArray:
        """Change of the mean energy level of `ENERGY_BAND`, shape (n_vehicle,) [dB]."""
        nominal = self.robust.space.nominal
        before, after = (
            mean_energy_level(self.shown_levels(x), self.frequency, ENERGY_BAND)
            for x in (nominal, design)
        )
        return np.asarray(after - before)

    def energy_sigma(self, design: RealArray) -> RealArray:
        """Scatter of the energy level over the verification's draws, shape (n_vehicle,) [dB]."""
        made = self._verified_response.made(design)
        level = self.index.levels(made)
        energy = mean_energy_level(level, self.frequency, ENERGY_BAND)
        return np.asarray(energy.std(axis=0, ddof=1))

    def peak_changes(self, design: RealArray) -> dict[str, tuple[PeakChange, ...]]:
        """Booming peaks of each vehicle at nominal and in one design."""
        before, after = self.shown_levels(self.robust.space.nominal), self.shown_levels(design)
        return {
            name: compare_peaks(before[row], after[row], self.frequency, self.load_case.order)
            for row, name in enumerate(self.vehicles)
        }

    @cached_property
    def nominal_stiffness(self) -> RealArray:
        """Mean |K| over the band at factor 1, shape (n_variable,) [N/mm]; nan: not measured."""
        band = (float(self.frequency[0]), float(self.frequency[-1]))
        by_mount = [
            mean_operating_stiffness(mount, self.load_case, band) for mount in self.platform.mounts
        ]
        return np.concatenate(by_mount) * N_PER_MM

    @cached_property
    def indifference(self) -> RealArray:
        """Interval of each variable around best mean without a noticeable change, shape (k, 2)."""
        change = NOTICEABLE * self.index.n_lines
        return np.column_stack(
            indifference_intervals(self.robust, self.pick_designs["best mean"], change)
        )
