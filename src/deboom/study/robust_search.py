"""One search or several, merged into one front; and the last steps of its picks by gradient."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.archive import merge
from deboom.explore.fronts import pareto_front
from deboom.explore.polish import polish
from deboom.explore.problems import Progress, SearchResult, nsga2
from deboom.explore.robust import Robust, RobustResponse
from deboom.explore.selection import pick
from deboom.study.context import RunContext


@dataclass(frozen=True)
class Budget:
    """How long a study searches.

    Parameters
    ----------
    population, generations : int
        Of each search.
    searches : int
        NSGA-II runs with as many seeds, counted up from the study's, under the same draws.
    polished : bool
        Whether best mean, knee and best sigma of the front go on by gradient.
    """

    population: int
    generations: int
    searches: int = 1
    polished: bool = False

    @property
    def note(self) -> str:
        """What a report must say beside the numbers of the first search; empty if nothing."""
        more = (
            f"The front is that of {self.searches} searches with different seeds; the convergence "
            "shown is that of the first one. "
            if self.searches > 1
            else ""
        )
        steps = (
            "Best mean, knee and best sigma then went on by gradient, to less mean at no more "
            "sigma."
        )
        return (more + (steps if self.polished else "")).strip()


def robust_search(
    robust: Robust,
    model: RobustResponse,
    budget: Budget,
    seed: int,
    progress: Progress,
    run: RunContext | None,
    inputs: Sequence[Path],
    name: str = "search",
    first_population: RealArray | None = None,
) -> SearchResult:
    """Search with every seed, merge the fronts, and polish the picks.

    Parameters
    ----------
    robust : Robust
        What evaluates a generation, perhaps in many processes.
    model : RobustResponse
        The same in this process; it offers the gradient.
    budget : Budget
        How long.
    seed : int
        Of the first search.
    progress : callable
        See `deboom.explore.problems.Progress`.
    run : RunContext or None
        Where the searches are kept, each by itself.
    inputs : sequence of Path
        Every file that the searches depend on.
    name : str
        Folder of the first search within the run.
    first_population : array, shape (population, n_variables), optional
        Designs that every search begins with [units of the space].

    Returns
    -------
    SearchResult
        Of several searches, with the convergence of the first one. A single search that is not
        polished is `nsga2`'s, bit for bit.

    Raises
    ------
    InputError
        Fewer searches than one, designs that are to be polished within limits; see also `nsga2` and
        `deboom.explore.polish.polish`.
    """
    if budget.searches < 1:
        raise InputError(f"{budget.searches} searches find nothing: ask for at least one")
    if budget.polished and getattr(robust, "limits", None) is not None:
        raise InputError(
            "a polish knows no limits: search for more generations, or leave the limits out"
        )
    if run is not None:
        run.search_begins(model)
    found = []
    for number in range(seed, seed + budget.searches):
        folder = name if number == seed else f"{name}_seed{number}"
        kept = run.checkpoint(inputs, folder) if run else None
        found.append(
            nsga2(
                robust,
                budget.population,
                budget.generations,
                seed=number,
                progress=progress,
                checkpoint=kept,
                first_population=first_population,
            )
        )
    first = found[0]
    whole = first
    if len(found) > 1:
        whole = replace(
            merge(found), hypervolume=first.hypervolume, reference_point=first.reference_point
        )
    if budget.polished:
        picks = pick(whole.front)
        rows = sorted({picks.best_mean, picks.knee, picks.best_sigma})
        better = polish(model, whole.front, rows)
        whole = replace(whole, front=pareto_front(whole.front, better))
    return whole
