"""Options of a robust search, and the limits of its designs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, TypeAlias

import numpy as np
import pandas as pd
from typer import Option

from deboom.arrays import RealArray
from deboom.choices import SearchAlgorithm
from deboom.common import listed
from deboom.errors import InputError
from deboom.explore.moments import STATISTICS, Limit, Objective
from deboom.explore.result import Front, SearchResult
from deboom.explore.robust import Limits, Robust, chosen
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
from deboom.report import Report
from deboom.runs.options import Checks, at_least
from deboom.runs.result import RunContext
from deboom.vehicles.fleet_front import FleetFront, PeakRise


def report_limits(report: Report, front: Front) -> None:
    """Add to a report what the limits of a search did; nothing without limits.

    The report gets the tables ``limits`` of numbers of a design, ``level_limits`` of numbers over
    the scatter, and ``beyond_limits``, the key ``n_beyond_limits`` and a section. It warns of a
    named design that misses a limit because variables without effect on the noise went back to
    nominal.
    """
    limits = front.robust.limits
    if not limits:
        return
    of_design = limits.of_designs
    report.section("Limits", _limits_in_words(front))
    if of_design:
        designs = np.stack(list(front.named_designs.values()))
        values = front.robust.numbers(designs, [limit.number for limit in of_design.limits])
        report.warn(*_misses_at_nominal(of_design, front.named_designs, values))
        report.table(
            "limits",
            _limited_numbers(of_design.limits, dict(zip(front.named_designs, values, strict=True))),
            "Limited numbers of the named designs, without scatter unless the name says otherwise.",
        )
    if len(of_design) < len(limits):
        report.table(
            "level_limits",
            _limited_levels(front),
            "Limited levels of the named designs, under the draws of the verification: means over "
            f"the lines, and loudest lines. {_misses_in_words(_missed_levels(front))}",
        )
    report.table("beyond_limits", _beyond(front.search, front.variables, limits))
    report.summary["n_beyond_limits"] = int(front.search.infeasible.sum())


def _limits_in_words(front: Front) -> str:
    """Say what had to keep limits, and how many designs of the search miss one."""
    statistics = {limit.number.statistic for limit in front.robust.limits.limits}
    whose, draws = [], ""
    if any(STATISTICS[name].is_estimate for name in statistics):
        whose.append("by the levels over the scatter")
        draws = " under the draws of the search"
    if "nominal" in statistics:
        whose.append("by the design itself")
    if statistics & {"smallest", "largest"}:
        whose.append("by every drawn part")
    return (
        f"Limits had to be kept {listed(whose)}: {front.search.infeasible.sum()} of "
        f"{front.search.n_evaluated} designs miss one. All designs of the front keep all{draws}."
    )


def _misses_at_nominal(
    limits: Limits, designs: Mapping[str, RealArray], values: RealArray
) -> list[str]:
    """Say which named designs, with limited numbers (n, l), miss a limit; the first one may."""
    return [
        f"The design '{name}' misses a limit: {limits.closest(excess[np.newaxis])}."
        for name, excess in list(zip(designs, limits.excess(values), strict=True))[1:]
        if np.any(excess > 0.0)
    ]


def _missed_levels(front: Front) -> RealArray:
    """Return by how much verified designs miss the limit that they miss most, (n,) [dB]."""
    excess = np.where(np.isfinite(front.values.excess), front.values.excess, 0.0)
    limits = front.judge.sets[0].limits
    n_lines = [limits.limits[row].n_lines for row in limits.rows]
    return np.asarray((excess / n_lines).max(axis=1))


def _misses_in_words(missed: RealArray) -> str:
    """Say how many verified designs miss a limit of a level, and by how much (n,) [dB]."""
    n_missed = np.count_nonzero(missed > 0.0)
    if n_missed == 0:
        return "All designs of the front keep all limits there too."
    return (
        f"There {n_missed} of {missed.size} designs of the front miss a limit, by "
        f"{missed.max():.2g} dB at most; no pick does."
    )


def _limited_levels(front: Front) -> pd.DataFrame:
    """Tabulate limited numbers over the scatter, those of sums over lines divided by the lines."""
    designs, sets = np.stack(list(front.named_designs.values())), front.judge.sets
    limited = [robust.limits for robust in sets]
    values = np.mean([robust.limits.numbers(robust(designs).excess) for robust in sets], axis=0)
    # today's number is another one under each set of draws
    most = np.mean(
        [[float(limit.at_most) for limit in limits.limits] for limits in limited], axis=0
    )
    scales = np.array([1.0 / limit.n_lines for limit in limited[0].limits])
    limits = []
    for limit, scale, bound in zip(limited[0].limits, scales, most, strict=True):
        name = limit.number.name if scale == 1.0 else f"{limit.number.name}, per line"
        limits.append(Limit(replace(limit.number, label=name), at_most=float(scale * bound)))
    return _limited_numbers(limits, dict(zip(front.named_designs, values * scales, strict=True)))


def _limited_numbers(limits: Sequence[Limit], designs: Mapping[str, RealArray]) -> pd.DataFrame:
    """One row per limited number: its value in each design, and its bounds.

    - `designs`: values of the limited numbers of each design, by its name.
    """
    labels = [f"{limit.number.name} [{limit.number.unit}]" for limit in limits]
    table: dict[str, Sequence[object]] = {"number": labels}
    table |= {name: row.tolist() for name, row in designs.items()}
    for side in ("at_least", "at_most"):
        values = np.array([getattr(limit, side) for limit in limits])
        table[side.replace("_", " ")] = np.where(np.isfinite(values), values, np.nan).tolist()
    return pd.DataFrame(table)


def _beyond(search: SearchResult, variables: Sequence[str], limits: Limits) -> pd.DataFrame:
    """One row per design that misses a limit: factors, and by how much it misses each."""
    beyond = chosen(search.evaluated, np.flatnonzero(search.infeasible))
    factors = {f"{name} [1]": beyond.designs[:, k] for k, name in enumerate(variables)}
    excess = {label: beyond.excess[:, k] for k, label in enumerate(beyond_labels(limits))}
    return pd.DataFrame({**factors, **excess})


def beyond_labels(limits: Limits) -> list[str]:
    """Return the columns of by how much a design misses each bound; negative where room is left."""
    return [f"beyond {name} [{name.rpartition(' ')[2]}]" for name in limits.names]


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
