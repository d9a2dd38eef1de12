"""From the options of a study to the box that is asked for."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.box import BoxQuestion, CutNormalParts, PartLaw, UniformParts
from deboom.explore.largest_box import kept_offset, tolerance_box
from deboom.explore.problems import Progress, nsga2
from deboom.explore.robust import RobustResponse
from deboom.explore.scatter import sobol_sample
from deboom.explore.selection import pick
from deboom.explore.space import DesignSpace
from deboom.study.cost_of_tolerance import tolerance_cost
from deboom.study.supplier_study import Pick, supplier_study
from deboom.vehicles.booming_model import LoadCaseIndex
from deboom.vehicles.fleet import Band
from deboom.vehicles.limit_responses import MeanLevel, PeakLevel

POPULATION, GENERATIONS, DRAWS = 80, 60, 64
"""Of the quick search for a Pareto point."""


class Quantity(Enum):
    """What is limited in every vehicle."""

    mean = "mean"
    """Mean level of the lines of the band."""
    peak = "peak"
    """Loudest line of the band."""


class Law(Enum):
    """How parts lie in their interval."""

    uniform = "uniform"
    """Evenly: all that an acceptance test promises."""
    normal = "normal"
    """Normal, with the ends three standard deviations off the middle."""


_LAWS: dict[Law, PartLaw] = {Law.uniform: UniformParts(), Law.normal: CutNormalParts()}


def limited_response(
    quantity: Quantity, index: LoadCaseIndex[Any, Any], band: Band
) -> MeanLevel | PeakLevel:
    """Return what is limited.

    Parameters
    ----------
    quantity : Quantity
    index : LoadCaseIndex
        The model.
    band : (lower, upper)
        Of a peak level [Hz].
    """
    return MeanLevel(index) if quantity is Quantity.mean else PeakLevel(index, band)


def pareto_point(
    front: Path | None,
    chosen: Pick,
    studies: Path | None,
    index: LoadCaseIndex[Any, Any],
    space: DesignSpace,
    *,
    seed: int,
    progress: Progress,
) -> RealArray:
    """Return a design of a Pareto front, shape (k,) [1].

    Parameters
    ----------
    front : Path or None
        Finished run of a front study; None: a quick search of its own.
    chosen : Pick
        Which design of the front.
    studies : Path or None
        Folder with the studies; None: `studies` here, else deboom's own.
    index : LoadCaseIndex
        The model of the quick search.
    space : DesignSpace
        Of the quick search.
    seed : int
        Of the quick search.
    progress : callable
        See `deboom.explore.problems.Progress`.

    Raises
    ------
    InputError
        A run that cannot be read, or has other variables.
    """
    if front is not None:
        study = supplier_study(front, studies, chosen)
        if study.space.names != space.names:
            raise InputError(
                f"run {front} has the variables {list(study.space.names)}, this study "
                f"{list(space.names)}: take a front of the same platform without loss factors"
            )
        return np.asarray(study.picked)
    sample = sobol_sample(space.n_variables, DRAWS, seed=seed)
    robust = RobustResponse(index, space, sample)
    found = nsga2(robust, POPULATION, GENERATIONS, seed=seed, progress=progress).front
    rows = pick(found)
    by_name = {
        Pick.best_mean: rows.best_mean,
        Pick.best_sigma: rows.best_sigma,
        Pick.knee: rows.knee,
    }
    return np.asarray(found.designs[by_name[chosen]])


@dataclass(frozen=True)
class BoxOptions:
    """What is asked for.

    Parameters
    ----------
    share : float
        Of parts and vehicles, or of parts if `worst_vehicle`, that keep the limit [1].
    limit : float, optional
        For all vehicles [dB(A)].
    below_today : float, optional
        What each vehicle must be quieter by than with today's mounts [dB]. Without either limit
        it is the one for all vehicles that the box of the space's tolerance about the Pareto point
        just keeps.
    worst_vehicle : bool
        A part must keep the limit in all vehicles.
    law : Law
        How parts lie in the box.
    cost_table : Path, optional
        See `deboom.study.cost_of_tolerance.tolerance_cost`; weights are those of the intervals.

    Raises
    ------
    InputError
        Two limits at once.
    """

    share: float
    limit: float | None = None
    below_today: float | None = None
    worst_vehicle: bool = False
    law: Law = Law.uniform
    cost_table: Path | None = None

    def __post_init__(self) -> None:
        if self.limit is not None and self.below_today is not None:
            raise InputError("--limit and --below-today are two limits at once: give one of them")

    def question(
        self, response: MeanLevel | PeakLevel, space: DesignSpace, point: RealArray, *, seed: int
    ) -> BoxQuestion:
        """Return the question about a response.

        Parameters
        ----------
        response : MeanLevel or PeakLevel
            What is limited.
        space : DesignSpace
            Parts may lie where its designs, made with their tolerance, do.
        point : array, shape (k,)
            The Pareto point [1].
        seed : int
            Of the parts that the default limit follows from.

        Raises
        ------
        InputError
            A cost table that cannot be read; see also `BoxQuestion`.
        """
        today = response(space.nominal[np.newaxis])[0]
        level = np.full(len(today), 0.0 if self.limit is None else self.limit)
        if self.below_today is not None:
            level = today - self.below_today
        question = BoxQuestion(
            response,
            level,
            self.share,
            lower=space.lower * (1.0 - space.tolerance),
            upper=space.upper * (1.0 + space.tolerance),
            weight=tolerance_cost(self.cost_table, space.names).weight,
            together=self.worst_vehicle,
            law=_LAWS[self.law],
        )
        if self.limit is None and self.below_today is None:
            about = tolerance_box(space.names, point, float(space.tolerance.max()))
            return question.lowered(-kept_offset(question, about, seed=seed))
        return question
