"""Options of a robust search, and the limits of its designs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, TypeAlias

import numpy as np
from typer import Option

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.choices import SearchAlgorithm
from deboom.explore.moments import Limit, Objective
from deboom.explore.result import Front, SearchResult
from deboom.explore.robust import Robust
from deboom.explore.search import (
    BEFORE_DESCENTS,
    VERIFIED,
    Checkpoint,
    Search,
    Until,
    search,
    searched,
)
from deboom.explore.space import Evaluate
from deboom.files.doe_table import read_plan
from deboom.files.run_folder import CheckpointFolder
from deboom.progress import progress_bar
from deboom.runs.options import Checks, at_least
from deboom.runs.result import RunContext
from deboom.vehicles.fleet_front import FleetFront, PeakRise

PeakRiseOption: TypeAlias = Annotated[
    float | None, Option(help="Largest allowed rise of a booming peak [dB]; default: no limit.")
]
"""By how much a design may raise the booming peak that rises most."""


def check_peak_rise(most: float | None) -> None:
    """Refuse a rise that is negative or not finite."""
    if most is not None and not 0 <= most < np.inf:
        raise InputError(f"--peak-rise {most:g}: give by how much a peak may rise, from 0 dB")


def peak_rise_limits(most: float | None, model: Evaluate, today: RealArray) -> tuple[Limit, ...]:
    """Return the limit of ``--peak-rise``, by how much the peak that rises most may; None: none.

    - `model`, `today` (k,): model with levels, and design whose peaks count, without scatter.
    - `most`: rise over today's peaks [dB].
    """
    if most is None:
        return ()
    rise = Objective("nominal", response=PeakRise(model, today))
    return (Limit(rise, at_most=most, source=f"--peak-rise {most:g}"),)


@dataclass(frozen=True)
class SearchOptions:
    """Options of a study: what searches, how long, and with how many processes."""

    generations: Annotated[
        int, Option(help="Largest number of generations of the search.", callback=at_least(1))
    ] = Search.generations
    population: Annotated[
        int, Option(help="Number of designs per generation.", callback=at_least(4))
    ] = Search.population
    algorithm: Annotated[SearchAlgorithm, Option(help="Search algorithm of pymoo.")] = (
        SearchAlgorithm.nsga2
    )
    workers: Annotated[
        int,
        Option(help="Number of processes; the result does not depend on it.", callback=at_least(1)),
    ] = 1
    scheduler: Annotated[
        str | None,
        Option(
            help="Dask cluster, tcp://host:port. Everybody who can reach it can use it: keep"
            " it in a closed network, or use tls://host:port with Dask's own TLS "
            "settings."
        ),
    ] = None

    until_gain: Annotated[
        float | None,
        Option(
            help="End the search when the hypervolume of its front gains less than this share over "
            "10 generations [1]; default: no such end."
        ),
    ] = None
    until_seconds: Annotated[
        float | None,
        Option(
            help="End the search after this time [s]; the front then depends on the computer; "
            "default: no limit."
        ),
    ] = None

    def __post_init__(self) -> None:
        self.until  # noqa: B018 - a gain or a time that is not above 0 is refused before any work

    @property
    def until(self) -> Until | None:
        """What ends a search before its last generation; None: nothing said."""
        if self.until_gain is None and self.until_seconds is None:
            return None
        return Until(seconds=self.until_seconds, gain=self.until_gain)

    def settings(self, seed: int) -> Search:
        """Return the search of a seed with these options, without gradients after it."""
        return Search(
            population=self.population,
            generations=self.generations,
            seed=seed,
            algorithm=self.algorithm,
            until=self.until,
            polish=False,
        )

    def searched(
        self,
        robust: Robust,
        *,
        seed: int,
        run: RunContext | None,
        inputs: Sequence[Path],
        title: str = "NSGA-II",
    ) -> SearchResult:
        """Search with these options, as `deboom.explore.search.searched`.

        - `seed`: of the first search; `title`: of the progress bar.
        - `run`: where the searches are kept, each by itself; `inputs`: files that they depend on.
        """
        with progress_bar(title) as bar:
            return searched(
                robust,
                self.settings(seed),
                workers=self.workers,
                scheduler=self.scheduler,
                progress=bar,
                checkpoint=_checkpoint(run, inputs, "search", seed),
            )

    def front(
        self,
        robust: Robust,
        *,
        seed: int,
        run: RunContext | None,
        inputs: Sequence[Path],
        verified_with: int = VERIFIED,
        title: str = "NSGA-II",
    ) -> Front:
        """Search and verify the whole front with these options, as `deboom.search` unpolished.

        Picks that make no vehicle louder make no booming peak louder either.
        """
        with progress_bar(title) as bar:
            front = search(
                robust,
                self.settings(seed),
                shown=None,
                verified_with=verified_with,
                workers=self.workers,
                scheduler=self.scheduler,
                progress=bar,
                checkpoint=_checkpoint(run, inputs, "search", seed),
            )
        return _keeping_peaks(front)


def _keeping_peaks(front: Front) -> Front:
    """Return the front with picks that keep booming peaks, where its model has levels."""
    if hasattr(front.model, "levels") and callable(front.model.levels):
        return FleetFront.keeping_peaks(front).front
    return front


def _checkpoint(
    run: RunContext | None, inputs: Sequence[Path], name: str, first: int
) -> Checkpoint | None:
    """Return where the search of a seed is kept: a folder of the run for each."""
    if run is None:
        return None

    def kept(seed: int) -> CheckpointFolder:
        return run.checkpoint(inputs, name if seed == first else f"{name}_seed{seed}")

    return kept


@dataclass(frozen=True)
class ThoroughSearchOptions(SearchOptions):
    """Options of a study that may search with several seeds, and goes on by gradient."""

    searches: Annotated[
        int,
        Option(
            help="Number of searches with the seeds from --seed upwards; they give one front.",
            callback=at_least(1),
        ),
    ] = Search.searches
    polish: Annotated[
        bool,
        Option(
            help="Improve the front, or its picks, along gradients after the search. If the whole "
            f"front is improved, a search without limits ends after {BEFORE_DESCENTS} designs, "
            "unless --until-gain or --until-seconds says when."
        ),
    ] = Search.polish
    begin: Annotated[
        Path | None,
        Option(help="Designs to begin with: a file that the interactive page saved, or a table."),
    ] = None
    checks: Checks = VERIFIED

    def settings(self, seed: int) -> Search:
        """Return the searches from a seed upwards with these options, and what follows them."""
        return replace(super().settings(seed), searches=self.searches, polish=self.polish)

    def verified(
        self,
        robust: Robust,
        *,
        seed: int,
        run: RunContext | None,
        inputs: Sequence[Path],
        name: str = "search",
        begin: RealArray | None = None,
    ) -> Front:
        """Search, improve and verify a front with these options, as `deboom.search`.

        Picks that make no vehicle louder make no booming peak louder either.

        - `name`: of the folder within the run, and of the progress bar.
        - `begin` (n, k): designs to begin with, beside those of the option and a Latin hypercube
          [units of the space].
        """
        if self.begin is not None:
            designs = read_plan(self.begin, robust.space)
            begin = designs if begin is None else np.unique(np.vstack([begin, designs]), axis=0)
            inputs = (*inputs, self.begin)
        with progress_bar(name) as bar:
            front = search(
                robust,
                self.settings(seed),
                first_population=begin,
                verified_with=self.checks,
                workers=self.workers,
                scheduler=self.scheduler,
                progress=bar,
                checkpoint=_checkpoint(run, inputs, name, seed),
            )
        return _keeping_peaks(front)
