"""One design of a front: of a finished run, or of a quick search."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.robust import RobustResponse
from deboom.explore.selection import at_nominal, pick, variables_without_effect
from deboom.files.platform import Platform
from deboom.study.context import RunContext
from deboom.study.made_parts import MadeParts
from deboom.study.mount_source import Operation
from deboom.study.progress import progress_bar
from deboom.study.result import StudyResult
from deboom.study.robust_search import Budget, robust_search
from deboom.study.sampling import Sampler, tolerance_sample
from deboom.study.supplier_pick import Pick
from deboom.study.supplier_study import supplier_study

SEARCH_DRAWS = 128
"""Draws per design of a quick search."""


@dataclass(frozen=True)
class WantedDesign:
    """Which design of a front.

    Parameters
    ----------
    pick : Pick
        By its name.
    point : int or None
        Or by its number on the front, from 1.
    """

    pick: Pick = Pick.best_mean
    point: int | None = None

    @property
    def name(self) -> str:
        """In words."""
        return self.pick.value.replace("-", " ") if self.point is None else f"point {self.point}"

    def row(self, designs: RealArray) -> RealArray:
        """Return the design of this number, shape (k,), of a front (n, k).

        Raises
        ------
        InputError
            There is none.
        """
        if self.point is None or not 1 <= self.point <= len(designs):
            raise InputError(
                f"there is no point {self.point} on the front: it has 1 to {len(designs)}"
            )
        return np.asarray(designs[self.point - 1])


@dataclass(frozen=True, eq=False)
class ChosenDesign:
    """A design of a front with its model.

    Parameters
    ----------
    platform : Platform
        As measured.
    model : RobustResponse
        Of the front.
    designs : array, shape (n, k)
        The front, sorted by mean level [1].
    design : array, shape (k,)
        The chosen one [1].
    name : str
        What it is called.
    without_effect : tuple of str
        Variables that no vehicle depends on.
    inputs : tuple of Path
        Files read, those of the platform among them.
    runs : Operation or None
        What was searched for; None if the front is that of a finished run.
    made : MadeParts or None
        How the parts scatter; None likewise.
    """

    platform: Platform
    model: RobustResponse
    designs: RealArray
    design: RealArray
    name: str
    without_effect: tuple[str, ...]
    inputs: tuple[Path, ...]
    runs: Operation | None = None
    made: MadeParts | None = None

    @property
    def variables(self) -> tuple[str, ...]:
        """Variables that scatter."""
        space = self.model.space
        return tuple(n for n, t in zip(space.names, space.tolerance, strict=True) if t > 0.0)

    def reported(self, result: StudyResult) -> StudyResult:
        """Add to a study's result how parts scatter and surfaces agree, if it has searched."""
        if self.made is not None:
            result = self.made.reported(result)
        return result if self.runs is None else self.runs.checked(result)


def design_of_run(
    folder: Path, studies: Path, wanted: WantedDesign, parts: Path | None = None
) -> ChosenDesign:
    """Return a design of the front of a finished run, with the run's model built again.

    Parameters
    ----------
    folder : Path
        Of the run.
    studies : Path
        Folder with the study scripts.
    wanted : WantedDesign
        Which one; a pick as a supplier would be asked for it.
    parts : Path or None
        Must be None: the run knows how its parts scatter.

    Raises
    ------
    InputError
        As `deboom.study.supplier_study.supplier_study`; a point that there is not; parts.
    """
    if parts is not None:
        raise InputError(f"{parts}: run {folder} has its own parts, leave --parts out")
    study = supplier_study(folder, studies, wanted.pick)
    run = study.run
    return ChosenDesign(
        platform=study.platform,
        model=run.model,
        designs=run.designs,
        design=study.wanted if wanted.point is None else wanted.row(run.designs),
        name=wanted.name,
        without_effect=study.without_effect,
        inputs=(*study.platform.input_files, *run.files),
    )


def design_of_search(
    runs: Operation,
    index: Any,
    made: MadeParts,
    budget: Budget,
    seed: int,
    wanted: WantedDesign,
    run: RunContext | None,
) -> ChosenDesign:
    """Search a front and return a design of it; variables without effect are at nominal.

    Parameters
    ----------
    runs : Operation
        Platform, vehicles and load cases.
    index : LoadCaseIndex
        Their model.
    made : MadeParts
        How the parts scatter.
    budget : Budget
        Of the search.
    seed : int
        From 1.
    wanted : WantedDesign
        Which one.
    run : RunContext or None
        Where the search is kept.

    Raises
    ------
    InputError
        As the search; a point that there is not.
    """
    sample = tolerance_sample(Sampler.sobol, made.n_draws, SEARCH_DRAWS, seed=seed)
    model = made.response(index, sample)
    files = (*runs.platform.input_files, *made.inputs)
    with progress_bar("NSGA-II") as bar:
        front = robust_search(model, model, budget, seed, bar, run, files).front
    rows = pick(front)
    named = {
        Pick.best_mean: rows.best_mean,
        Pick.best_sigma: rows.best_sigma,
        Pick.knee: rows.knee,
    }
    design = front.designs[named[wanted.pick]]
    if wanted.point is not None:
        design = wanted.row(front.designs)
    free = variables_without_effect(index, model.space)
    return ChosenDesign(
        platform=runs.platform,
        model=model,
        designs=front.designs,
        design=at_nominal(design[np.newaxis], model.space, free)[0],
        name=wanted.name,
        without_effect=free,
        inputs=runs.platform.input_files,
        runs=runs,
        made=made,
    )
