"""Which of these fronts is better, and is the difference real?

All fronts are judged again by one model and one common, large sample of draws that no search has
seen.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from pathlib import Path

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.front_quality import CommonBox, common_box, design_distance, level_gap
from deboom.explore.front_verdict import Contestant, Difference, difference, last_gain
from deboom.explore.objectives import MEAN_SUM, SIGMA_SUM
from deboom.explore.problems import Progress
from deboom.explore.robust import RobustResponse
from deboom.explore.selection import at_nominal, variables_without_effect
from deboom.explore.tolerance_samples import sobol_sample
from deboom.study.compare_runs import (
    NOT_THE_CONFIGURATION,
    ComparedRun,
    check_same_platform,
    check_same_question,
    compared_run,
    other_models,
)

SETS = 8
"""Independent scrambled sets that the common sample consists of."""
FEWEST = 1024
"""Draws of the common sample."""
CHUNK = 50
"""Designs between two signs of progress."""


@dataclass(frozen=True, eq=False)
class JudgedRun:
    """A run's front under the common draws.

    Parameters
    ----------
    run : ComparedRun
        The run.
    name : str
        Of its configuration.
    by_set : array, shape (n_sets, n, 2)
        Objectives under each set of draws [unit of the objectives].
    designs : array, shape (n, k)
        Those that could be computed; variables without effect are at nominal [units of the space].
    n_failed : int
        Designs of the front that could not be computed.
    """

    run: ComparedRun
    name: str
    by_set: RealArray
    designs: RealArray
    n_failed: int

    @cached_property
    def objectives(self) -> RealArray:
        """Mean over the sets, shape (n, 2) [unit of the objectives]."""
        return np.asarray(self.by_set.mean(axis=0))


@dataclass(frozen=True, eq=False)
class Comparison:
    """Fronts under one judge.

    Parameters
    ----------
    judge : RobustResponse
        Model of the first run.
    fronts : tuple of JudgedRun
        In the order of the runs.
    n_samples, seed : int
        Of the common draws.
    foreign : tuple of str
        Folders of runs whose own model is another one.
    """

    judge: RobustResponse
    fronts: tuple[JudgedRun, ...]
    n_samples: int
    seed: int
    foreign: tuple[str, ...]

    @cached_property
    def box(self) -> CommonBox:
        """Of all fronts."""
        return common_box([one.objectives for one in self.fronts])

    @cached_property
    def groups(self) -> dict[str, list[JudgedRun]]:
        """Runs by configuration."""
        found: dict[str, list[JudgedRun]] = {}
        for one in self.fronts:
            found.setdefault(one.name, []).append(one)
        return found

    @cached_property
    def hypervolumes(self) -> dict[str, RealArray]:
        """By configuration: share of the box, shape (n_runs, n_sets) [1]."""
        return {
            name: np.array([[self.box.hypervolume(front) for front in one.by_set] for one in runs])
            for name, runs in self.groups.items()
        }

    def progress(self, one: JudgedRun) -> float:
        """Return what a search's last fifth has gained, as a share of the box; NaN: unknown.

        A gain beyond the box counts as well, but no more than the whole front is worth.
        """
        gained = self.box.share(last_gain(one.run.convergence))
        return float(np.minimum(gained, self.box.hypervolume(one.objectives)))

    @cached_property
    def contestants(self) -> dict[str, Contestant]:
        """Configurations with all that is known of their chance."""
        return {
            name: Contestant(
                name, self.hypervolumes[name], np.array([self.progress(one) for one in runs])
            )
            for name, runs in self.groups.items()
        }

    @cached_property
    def pairs(self) -> dict[tuple[str, str], Difference]:
        """Every configuration against every other, as shares of the box."""
        return {
            (first, second): difference(self.contestants[first], self.contestants[second])
            for first, second in combinations(self.contestants, 2)
        }

    def gap(self, first: str, second: str) -> float:
        """Mean difference of the first objective at equal second one [its unit]."""
        gaps = [
            level_gap(one.objectives, other.objectives)
            for one in self.groups[first]
            for other in self.groups[second]
        ]
        known = [gap for gap in gaps if np.isfinite(gap)]
        return float(np.mean(known)) if known else float("nan")

    @cached_property
    def bounds(self) -> tuple[RealArray, RealArray]:
        """Lowest and highest bounds of all runs, shape (k,) each [units of the space]."""
        spaces = [one.run.model.space for one in self.fronts]
        lower = np.min([space.lower for space in spaces], axis=0)
        return lower, np.max([space.upper for space in spaces], axis=0)

    def distance(self, first: str, second: str) -> float:
        """Mean distance in the design space between the runs of two configurations [1]."""
        return float(
            np.mean(
                [
                    design_distance(one.designs, other.designs, *self.bounds)
                    for one in self.groups[first]
                    for other in self.groups[second]
                    if one is not other
                ]
                or [np.nan]
            )
        )

    @property
    def plain_sums(self) -> bool:
        """Whether the objectives are the sums of mean and sigma over the responses."""
        return self.judge.objectives == (MEAN_SUM, SIGMA_SUM)

    @cached_property
    def per_line(self) -> float:
        """Factor from sums over responses and lines to their mean; 1 for other objectives [1]."""
        n_lines = getattr(self.judge.evaluate, "n_lines", None)
        if not self.plain_sums or n_lines is None:
            return 1.0
        return 1.0 / (int(n_lines) * len(self.judge.evaluate.response_names))


def comparison(
    folders: Sequence[Path], studies: Path, n_samples: int, seed: int, progress: Progress
) -> Comparison:
    """Read runs, check that they can be compared, and judge their fronts.

    Parameters
    ----------
    folders : sequence of Path
        Two run folders or more.
    studies : Path
        Folder with the study scripts.
    n_samples : int
        Common draws, a power of two.
    seed : int
        Of the common draws, from 1.
    progress : callable
        See `deboom.explore.problems.Progress`.

    Raises
    ------
    InputError
        One run only, or twice the same; too few draws; see also
        `deboom.study.compare_runs.compared_run`, `check_same_platform`, `check_same_question`.
    """
    if len({folder.resolve() for folder in folders}) < len(folders) or len(folders) < 2:
        raise InputError(
            f"{len(folders)} run folders, {len({f.resolve() for f in folders})} of them different: "
            "give two different runs or more"
        )
    if n_samples < FEWEST or n_samples & (n_samples - 1):
        raise InputError(f"{n_samples} common draws: take a power of two from {FEWEST}")
    runs = [compared_run(folder, studies) for folder in folders]
    check_same_platform(runs)
    return judged(runs, n_samples, seed, progress)


def judged(
    runs: Sequence[ComparedRun], n_samples: int, seed: int, progress: Progress
) -> Comparison:
    """Judge the fronts of runs by the model of the first one.

    Parameters
    ----------
    runs : sequence of ComparedRun
        At least one.
    n_samples, seed, progress
        See `comparison`.

    Raises
    ------
    InputError
        Runs of other variables, responses or objectives; a front that cannot be computed.
    """
    check_same_question(runs)
    foreign = tuple(run.entry.folder.as_posix() for run in other_models(runs))
    judge = runs[0].model
    judges = _judges(judge, n_samples, seed)
    free = variables_without_effect(judge.evaluate, judge.space)
    total = sum(len(run.designs) for run in runs)
    done, fronts, begin = 0, [], time.perf_counter()
    for run, name in zip(runs, configuration_names(runs), strict=True):
        parts = []
        for chunk in np.split(run.designs, range(CHUNK, len(run.designs), CHUNK)):
            parts.append(np.stack([one(chunk).objectives for one in judges]))
            done += len(chunk)
            progress(done, total, f"designs judged, {time.perf_counter() - begin:.0f} s")
        by_set = np.concatenate(parts, axis=1)
        computed = np.isfinite(by_set).all(axis=(0, 2))
        if not computed.any():
            raise InputError(f"no design of {run.entry.folder} can be computed with common draws")
        designs = at_nominal(run.designs[computed], judge.space, free)
        fronts.append(JudgedRun(run, name, by_set[:, computed], designs, int((~computed).sum())))
    return Comparison(judge, tuple(fronts), n_samples, seed, foreign)


def _judges(judge: RobustResponse, n_samples: int, seed: int) -> list[RobustResponse]:
    """Return the judge with each of the sets of draws."""
    structure = judge.structure
    width = judge.space.n_variables if structure is None else structure.n_draws
    return [
        replace(
            judge,
            sample=sobol_sample(
                width, n_samples // SETS, seed=seed, purpose=f"comparison sample, set {number}"
            ),
        )
        for number in range(1, SETS + 1)
    ]


def configuration_names(runs: Sequence[ComparedRun]) -> list[str]:
    """Return the name of each run's configuration: the options in which they differ.

    Runs that differ in nothing but the seed, all of them, are configurations of their own.
    """
    if len({run.configuration for run in runs}) == 1:
        seeds = [run.seed for run in runs]
        return [
            f"seed {run.seed}" if seeds.count(run.seed) == 1 else run.entry.name for run in runs
        ]
    options = [{"study": run.entry.study, **run.entry.record["arguments"]} for run in runs]
    ids = [run.configuration for run in runs]
    firsts = [ids.index(one) for one in dict.fromkeys(ids)]
    named = dict.fromkeys(name for i in firsts for name in options[i])
    differing = [
        name
        for name in named
        if name not in NOT_THE_CONFIGURATION
        and len({str(options[i].get(name)) for i in firsts}) > 1
    ]
    return [_name(option, differing) for option in options]


def _name(options: Mapping[str, object], differing: Sequence[str]) -> str:
    return ", ".join(f"{name.replace('_', '-')} {options.get(name)}" for name in differing)
