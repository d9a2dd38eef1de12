"""The numbers behind the robust front of a compressor's mounts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from deboom.arrays import RealArray
from deboom.explore.design_space import DesignSpace
from deboom.explore.fronts import Verification, verification_response
from deboom.explore.problems import SearchResult
from deboom.explore.robust import RobustResponse, RobustValues
from deboom.explore.selection import indifference_intervals, pick
from deboom.explore.sensitivity import sobol_designs
from deboom.explore.sensitivity_inputs import SensitivityInputs
from deboom.explore.sigma_shares import SigmaShares, sigma_shares
from deboom.explore.sobol_indices import SobolIndices, sobol_indices
from deboom.study.compressor_agreement import Agreement, exact_change
from deboom.study.compressor_mounts import MountedFleet, Parts
from deboom.vehicles.booming_peaks import PeakChange, compare_peaks
from deboom.vehicles.synthesis import mean_energy_level

FIRST_ORDER = 1.0
"""One cycle per turn: the lines are the rotational frequency."""
NOTICEABLE = 0.1
"""Change of the mean level of the lines that counts as noticeable [dB]."""
TRIED = 11
"""Values of each stiffness that are tried for it."""
TIGHTER = 0.5
"""A tighter tolerance, over today's [1]."""
TODAY, BEST_MEAN, BEST_SIGMA, KNEE = "today", "best mean", "best sigma", "knee"
PLACES = "places"


@dataclass(frozen=True, eq=False)
class CompressorFront:
    """A search over the mounts of a compressor, verified, with everything its report needs.

    Parameters
    ----------
    model : MountedFleet
        What was evaluated.
    robust : RobustResponse
        How it was made robust.
    travel_ratio : float
        Travel allowed over today's [1].
    search : SearchResult
    verification : Verification
    sobol : SobolIndices
        Of the chosen stiffnesses, uniform within their bounds; one output per car.
    agreement : Agreement or None
        With the exact coupled solution; None where cars were measured.
    """

    model: MountedFleet
    robust: RobustResponse
    travel_ratio: float
    search: SearchResult
    verification: Verification
    sobol: SobolIndices
    agreement: Agreement | None

    @property
    def cars(self) -> tuple[str, ...]:
        """Names of the cars."""
        return self.model.index.response_names

    @property
    def space(self) -> DesignSpace:
        """All variables, fixed ones included."""
        return self.robust.space

    @property
    def chosen(self) -> tuple[int, ...]:
        """Columns of a design that the search could choose."""
        return chosen_columns(self.space)

    @property
    def chosen_names(self) -> tuple[str, ...]:
        """Names of these."""
        return tuple(self.space.names[column] for column in self.chosen)

    @property
    def frequency(self) -> RealArray:
        """Lines [Hz]."""
        return self.model.index.frequency

    @property
    def n_lines(self) -> int:
        """Number of lines of each sum."""
        return self.model.index.n_lines

    @property
    def per_line(self) -> float:
        """Factor from a sum over cars and lines to the mean over both [1]."""
        return 1.0 / (self.n_lines * len(self.cars))

    @cached_property
    def picks(self) -> dict[str, int]:
        """Rows of the front by name of the pick, chosen on verified values."""
        rows = pick(self.verification.values)
        return {BEST_MEAN: rows.best_mean, BEST_SIGMA: rows.best_sigma, KNEE: rows.knee}

    @cached_property
    def designs(self) -> dict[str, RealArray]:
        """Today's design and the picks, each of shape (k,)."""
        found = self.verification.values.designs
        return {TODAY: self.space.nominal} | {name: found[row] for name, row in self.picks.items()}

    @property
    def best(self) -> RealArray:
        """Best mean, shape (k,)."""
        return self.designs[BEST_MEAN]

    @cached_property
    def _verified(self) -> RobustResponse:
        check = self.verification
        return verification_response(self.robust, check.n_samples, seed=check.seed)

    @cached_property
    def baseline(self) -> RobustValues:
        """Today's mounts under the verification's draws; one row."""
        return self._verified(self.space.nominal[np.newaxis])

    def row(self, name: str) -> tuple[RobustValues, int]:
        """Return where the verified values of a named design stand."""
        if name == TODAY:
            return self.baseline, 0
        return self.verification.values, self.picks[name]

    def levels(self, design: RealArray) -> RealArray:
        """SPL of one design without scatter in the first case, shape (v, f) [dB(A)]."""
        return np.asarray(self.model.index.levels(design[np.newaxis])[0])

    def level_change(self, design: RealArray) -> RealArray:
        """Change of the mean level of the lines, all cases, shape (v,) [dB]."""
        both = self.model.index(np.stack([self.space.nominal, design]))
        return np.asarray((both[1] - both[0]) / self.n_lines)

    @property
    def mean_change(self) -> float:
        """Change of the mean level over cars, lines and scatter by best mean [dB]."""
        values, row = self.row(BEST_MEAN)
        return float((values.mean_sum[row] - self.baseline.mean_sum[0]) * self.per_line)

    def energy_change(self, design: RealArray) -> RealArray:
        """Change of the mean energy level of the first case, shape (v,) [dB]."""
        lines = self.frequency
        band = (float(lines[0]), float(lines[-1]))
        before, after = (
            mean_energy_level(self.levels(one), lines, band) for one in (self.space.nominal, design)
        )
        return np.asarray(after - before)

    def energy_sigma(self, design: RealArray) -> RealArray:
        """Scatter of the energy level over the search's draws, shape (v,) [dB]."""
        lines = self.frequency
        level = self.model.index.levels(self.robust.made(design))
        energy = mean_energy_level(level, lines, (float(lines[0]), float(lines[-1])))
        return np.asarray(energy.std(axis=0, ddof=1))

    @cached_property
    def peak_changes(self) -> Mapping[str, tuple[PeakChange, ...]]:
        """Peaks of each car in the first case, today and in best mean."""
        before, after = self.levels(self.space.nominal), self.levels(self.best)
        return {
            name: compare_peaks(before[row], after[row], self.frequency, FIRST_ORDER)
            for row, name in enumerate(self.cars)
        }

    def stiffness(self, design: RealArray) -> RealArray:
        """|K| of every mount at the reference line, axial and two radial, shape (m, 3) [N/m]."""
        factors = self.model.index.variables.factors(design[np.newaxis])[0]
        at_one = self.model.stiffness_at_reference
        return np.asarray(factors.reshape(at_one.shape) * at_one)

    def chosen_stiffness(self, design: RealArray) -> RealArray:
        """Mean |K| that each chosen variable stands for, shape (n_chosen,) [N/m]."""
        values = self.stiffness(design).ravel()
        scaled = self.model.index.variables.scaled
        return np.array([values[scaled[column]].mean() for column in self.chosen])

    def travel(self, design: RealArray) -> float:
        """Largest travel of a mount under 1 g [mm]."""
        return float(self.model.statics(design[np.newaxis])[0, 0])

    @cached_property
    def at_bound(self) -> tuple[str, ...]:
        """Chosen variables that best mean has at a bound, in words."""
        reached = []
        for column, name in zip(self.chosen, self.chosen_names, strict=True):
            span = self.space.upper[column] - self.space.lower[column]
            for end, word in ((self.space.lower, "lower"), (self.space.upper, "upper")):
                if abs(self.best[column] - end[column]) < 0.01 * span:
                    reached.append(f"{name} ({word})")
        return tuple(reached)

    @property
    def limit_reached(self) -> bool:
        """Whether best mean travels as far as it may, to 2 %."""
        allowed = self.travel_ratio * self.travel(self.space.nominal)
        return self.travel(self.best) > 0.98 * allowed

    @cached_property
    def leading(self) -> str:
        """Chosen stiffness with the largest mean total index over the cars."""
        return self.chosen_names[int(np.argmax(self.sobol.total.mean(axis=1)))]

    @cached_property
    def exact_change(self) -> RealArray | None:
        """What best mean changes in the exact cars, shape (v,) [dB]; None where none are."""
        return exact_change(self.model, self.space.nominal, self.best)

    @cached_property
    def shares(self) -> SigmaShares:
        """Whose tolerance makes the scatter of best mean."""
        return sigma_shares(self._verified, self.best)

    @cached_property
    def groups(self) -> dict[str, list[int]]:
        """Columns whose tolerance one would tighten together: a part number's axis, or places."""
        variables = self.model.index.variables
        scaled = variables.scaled
        groups: dict[str, list[int]] = {}
        for column, name in zip(self.chosen, self.chosen_names, strict=True):
            pieces = scaled.any(axis=1) & ~(scaled & ~scaled[column]).any(axis=1)
            groups[name] = np.flatnonzero(pieces).tolist()
        if variables.places.size:
            groups[PLACES] = variables.places.tolist()
        return groups

    @cached_property
    def worth(self) -> dict[str, float]:
        """Change of the sum of σ of best mean, where a group is made to `TIGHTER` tolerance [%]."""
        today = float(self.robust(self.best[np.newaxis]).sigma_sum[0])
        found = {}
        for name, columns in self.groups.items():
            tolerance = np.array(self.space.tolerance)
            tolerance[columns] *= TIGHTER
            tight = replace(self.robust, space=replace(self.space, tolerance=tolerance))
            then = float(tight(self.best[np.newaxis]).sigma_sum[0])
            found[name] = 100 * (then / today - 1)
        return found

    @cached_property
    def indifference(self) -> RealArray:
        """Interval of each chosen variable around best mean without a noticeable change, (n, 2)."""
        change = NOTICEABLE * self.n_lines
        both = np.column_stack(indifference_intervals(self.robust, self.best, change, TRIED))
        return np.asarray(both[list(self.chosen)])

    @cached_property
    def rigid_difference(self) -> RealArray:
        """Level with holders that do not move minus level, today, first case, (v, f) [dB]."""
        today = self.space.nominal[np.newaxis]
        return np.asarray((self.model.rigid.levels(today) - self.model.index.levels(today))[0])

    @property
    def facts(self) -> dict[str, str | float]:
        """What ``run.json`` says beside the arguments."""
        return {
            "mounts": self.model.running.shares.statement,
            "mount_state": self.model.running.source.state.statement,
            "parts": Parts(self.model.question.parts).value,
            "tolerance_sample": self.robust.sample.kind,
            "seconds_model": round(self.model.seconds, 3),
        }


def chosen_columns(space: DesignSpace) -> tuple[int, ...]:
    """Return the columns that a search can choose; the others are fixed and only scatter."""
    return tuple(np.flatnonzero(space.upper > space.lower).tolist())


def stiffness_sobol(model: MountedFleet, space: DesignSpace, n: int, *, seed: int) -> SobolIndices:
    """Return the Sobol indices of the chosen stiffnesses, uniform within their bounds.

    Parameters
    ----------
    model : MountedFleet
    space : DesignSpace
    n : int
        Base points, a power of two.
    seed : int
        From 1.

    Returns
    -------
    SobolIndices
        First and total; one output per car.

    Raises
    ------
    InputError
        See `deboom.explore.sensitivity.sobol_designs`.
    """
    columns = list(chosen_columns(space))
    inputs = SensitivityInputs(
        tuple(space.names[c] for c in columns), space.lower[columns], space.upper[columns]
    )
    chosen = sobol_designs(inputs, n, seed=seed, second_order=False)
    designs = np.tile(space.nominal, (len(chosen), 1))
    designs[:, columns] = chosen
    return sobol_indices(
        model.index(designs),
        inputs.factors,
        model.index.response_names,
        seed=seed,
        second_order=False,
    )
