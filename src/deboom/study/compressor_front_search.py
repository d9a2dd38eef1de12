"""The search for the robust front of a compressor's mounts, and what is asked of it afterwards."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass

from deboom.errors import InputError
from deboom.explore.fronts import verify
from deboom.explore.limits import Limit, LimitedResponse, Limits
from deboom.explore.robust import Robust, RobustResponse
from deboom.explore.tolerance_samples import sobol_sample
from deboom.study.compressor_agreement import agreement
from deboom.study.compressor_mounts import MountedFleet
from deboom.study.compressor_robust_front import CompressorFront, stiffness_sobol
from deboom.study.context import RunContext
from deboom.study.progress import Progress
from deboom.study.robust_search import Budget, robust_search

COMPARED = 20
"""Designs that are compared with the exact solution."""


@dataclass(frozen=True)
class FrontBudget:
    """How long is searched and verified, and how far mounts may travel.

    Parameters
    ----------
    population, generations : int
        Of NSGA-II.
    samples, checks : int
        Draws per design in the search and in its verification, powers of two.
    base_points : int
        Of the Sobol indices, a power of two.
    travel : float
        Largest travel of a mount under 1 g, over today's [1].

    Raises
    ------
    InputError
        A travel that is not positive.
    """

    population: int
    generations: int
    samples: int
    checks: int
    base_points: int
    travel: float

    def __post_init__(self) -> None:
        if not self.travel > 0:
            raise InputError(f"--travel {self.travel:g}: give a ratio above 0, such as 1.2")


def compressor_front(
    model: MountedFleet,
    budget: FrontBudget,
    seed: int,
    progress: Progress,
    run: RunContext | None,
    workers: Callable[[Robust], AbstractContextManager[Robust]],
) -> CompressorFront:
    """Search, verify, and find out what matters.

    Parameters
    ----------
    model : MountedFleet
    budget : FrontBudget
    seed : int
        From 1.
    progress : callable
        Of the search.
    run : RunContext or None
        Where the search is kept.
    workers : callable
        Puts a robust response where it is computed.

    Returns
    -------
    CompressorFront

    Raises
    ------
    InputError
        No design keeps the limit on travel; counts that are no powers of two; seed 0.
    """
    space = model.question.space(model.index.variables)
    if budget.checks < space.n_variables + 2:
        raise InputError(
            f"--checks {budget.checks}: a verification of {space.n_variables} variables that "
            f"scatter needs at least {space.n_variables + 2} draws"
        )
    sample = sobol_sample(space.n_variables, budget.samples, seed=seed)
    robust = RobustResponse(model.index, space, sample)
    allowed = budget.travel * float(model.statics(space.nominal[None])[0, 0])
    limits = Limits((Limit(model.statics.response_names[0], "mm", at_most=allowed),))
    with workers(robust) as spread:
        limited = LimitedResponse(spread, model.statics, limits)
        search = robust_search(
            limited,
            robust,
            Budget(budget.population, budget.generations),
            seed,
            progress,
            run,
            model.fleet.inputs,
        )
    return CompressorFront(
        model,
        robust,
        budget.travel,
        search,
        verify(search.front, robust, n_samples=budget.checks, seed=seed),
        stiffness_sobol(model, space, budget.base_points, seed=seed),
        agreement(model, space, COMPARED, seed=seed),
    )
