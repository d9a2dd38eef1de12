"""Prescribed against coupled motion: the same designs under both, and the optimum of each."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.design_space import stiffness_factor_space
from deboom.explore.fronts import Verification, verification_response, verify
from deboom.explore.large_doe import SobolDesigns
from deboom.explore.problems import SearchResult
from deboom.explore.robust import RobustResponse, RobustValues
from deboom.explore.selection import pick
from deboom.files.platform import Platform
from deboom.study.motion import Kernel, Motion, motion_index
from deboom.study.mount_source import Operation
from deboom.vehicles.load_case_index import LoadCaseIndex


@dataclass(frozen=True, eq=False)
class SameDesigns:
    """SPLV of the same designs with prescribed and with answering motion, in one load case.

    Parameters
    ----------
    load_case : str
        Its name.
    gear : int
        Of the load case.
    vehicles : tuple of str
        Names of the vehicles.
    prescribed, truth : array, shape (n, n_vehicle)
        Change against today's mounts of the mean level of the lines [dB].
    """

    load_case: str
    gear: int
    vehicles: tuple[str, ...]
    prescribed: RealArray
    truth: RealArray

    @property
    def correlation(self) -> RealArray:
        """Correlation coefficient per vehicle, shape (n_vehicle,) [1]."""
        pairs = zip(self.prescribed.T, self.truth.T, strict=True)
        return np.array([np.corrcoef(x, y)[0, 1] for x, y in pairs])

    @property
    def line(self) -> RealArray:
        """Slope and offset of truth over prescribed, least squares, shape (2, n_vehicle)."""
        pairs = zip(self.prescribed.T, self.truth.T, strict=True)
        return np.array([np.polyfit(x, y, 1) for x, y in pairs]).T


@dataclass(frozen=True, eq=False)
class Found:
    """A front, with the model of the motion that it was searched with.

    Parameters
    ----------
    motion : str
        Which model.
    robust : RobustResponse
        Of the search.
    search : SearchResult
        What was found.
    verification : Verification
        The front evaluated again under its own model.
    """

    motion: str
    robust: RobustResponse
    search: SearchResult
    verification: Verification

    @cached_property
    def optimum(self) -> int:
        """Row of the best mean, chosen under the own model: who searched knows no other."""
        return pick(self.verification.values).best_mean

    @property
    def design(self) -> RealArray:
        """Stiffness factors of that row, shape (n_variable,) [1]."""
        return np.asarray(self.search.front.designs[self.optimum])


@dataclass(frozen=True, eq=False)
class PrescribedOrCoupled:
    """Both fronts, each under both models, and the same designs under both.

    Parameters
    ----------
    platform : Platform
        As measured.
    same_designs : tuple of SameDesigns
        One per load case, in all vehicles of the platform.
    prescribed, truth : Found
        Searched with the same seed, budget and draws.
    """

    platform: Platform
    same_designs: tuple[SameDesigns, ...]
    prescribed: Found
    truth: Found

    @property
    def both(self) -> tuple[Found, Found]:
        """The two fronts."""
        return self.prescribed, self.truth

    @property
    def vehicles(self) -> tuple[str, ...]:
        """Vehicles that the searches served."""
        return self.truth.robust.evaluate.response_names

    @property
    def n_lines(self) -> int:
        """Lines in each sum of levels."""
        return _index(self.truth).n_lines

    def kernel(self, found: Found) -> str:
        """Return the name of the kernel that a search used."""
        return str(_index(found).kernel.name)

    @cached_property
    def _across(self) -> dict[str, RobustValues]:
        judges = zip(self.both, self.both[::-1], strict=True)
        return {
            found.motion: verify(
                found.search.front,
                judge.robust,
                n_samples=found.verification.n_samples,
                seed=found.verification.seed,
            ).values
            for found, judge in judges
        }

    def under(self, found: Found, judge: Found) -> RobustValues:
        """Return a front's values under the model of either search, with unseen draws."""
        return found.verification.values if found is judge else self._across[found.motion]

    def nominal(self, judge: Found) -> RobustValues:
        """Return today's mounts under a model and the same draws; one row."""
        check = judge.verification
        response = verification_response(judge.robust, check.n_samples, seed=check.seed)
        return response(judge.robust.space.nominal[np.newaxis])

    @cached_property
    def benefits(self) -> pd.DataFrame:
        """Fall of the mean level by vehicle, of each optimum under each model.

        One row per optimum, judging model and vehicle.
        """
        rows = []
        for judge in self.both:
            nominal = self.nominal(judge)
            for found in self.both:
                values, at = self.under(found, judge), found.optimum
                rows.append(
                    pd.DataFrame(
                        {
                            "optimum found with": found.motion,
                            "judged with": judge.motion,
                            "vehicle": list(self.vehicles),
                            "benefit [dB]": (nominal.mean[0] - values.mean[at]) / self.n_lines,
                            "sigma before [dB]": nominal.sigma[0] / self.n_lines,
                            "sigma after [dB]": values.sigma[at] / self.n_lines,
                        }
                    )
                )
        return pd.concat(rows, ignore_index=True)

    def benefit(self, found: Found, judge: Found) -> float:
        """Return the fall of the mean level over vehicles and lines [dB]."""
        table = self.benefits
        rows = (table["optimum found with"] == found.motion) & (
            table["judged with"] == judge.motion
        )
        return float(table.loc[rows, "benefit [dB]"].mean())


def both_indices(
    runs: Operation, truth: Motion, kernel: Kernel | None
) -> dict[Motion, LoadCaseIndex[Any, Any]]:
    """Return the booming index of some runs with prescribed motion, and with another one.

    Raises
    ------
    InputError
        Prescribed motion as the truth; see also `deboom.study.motion.motion_index`.
    """
    if truth is Motion.prescribed:
        raise InputError("prescribed motion cannot judge itself: take another one for the truth")
    return {
        Motion.prescribed: motion_index(runs, Motion.prescribed, None),
        truth: motion_index(runs, truth, kernel),
    }


def same_designs(
    runs: Operation,
    truth: Motion,
    kernel: Kernel | None,
    *,
    n_designs: int,
    half_width: float,
    seed: int,
) -> tuple[SameDesigns, ...]:
    """Evaluate the same designs with both motions, in all vehicles, load case by load case.

    Parameters
    ----------
    runs : Operation
        Load cases to compare.
    truth : Motion
        The motion that answers.
    kernel : Kernel or None
        For it.
    n_designs, half_width, seed : int, float, int
        Scrambled Sobol points over factors of 1 ± `half_width`.
    """
    compared = []
    for case, _ in runs.cases:
        alone = replace(runs, fleet=runs.platform.fleet, cases=[(case, 1.0)])
        indices = both_indices(alone, truth, kernel)
        index = indices[truth]
        space = stiffness_factor_space(index.variable_names, half_width=half_width)
        points = SobolDesigns(space, n_designs, seed).part(0, n_designs)
        designs = np.vstack([space.nominal, points])
        changes = {motion: _changes(one, designs) for motion, one in indices.items()}
        compared.append(
            SameDesigns(
                load_case=case.name,
                gear=case.gear,
                vehicles=index.response_names,
                prescribed=changes[Motion.prescribed],
                truth=changes[truth],
            )
        )
    return tuple(compared)


def _changes(index: LoadCaseIndex[Any, Any], designs: RealArray) -> RealArray:
    levels = index(designs) / index.n_lines
    return np.asarray(levels[1:] - levels[0])


def _index(found: Found) -> LoadCaseIndex[Any, Any]:
    index = found.robust.evaluate
    assert isinstance(index, LoadCaseIndex)
    return index
