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
from deboom.errors import InputError
from deboom.explore.result import Front, SearchResult
from deboom.explore.robust import DesignLimits, Limit, Limits, Robust, chosen
from deboom.explore.search import (
    BEFORE_DESCENTS,
    VERIFIED,
    Checkpoint,
    Search,
    Until,
    search,
    searched,
)
from deboom.explore.space import Evaluate, Requirements
from deboom.files.doe_table import read_plan
from deboom.files.run_folder import CheckpointFolder
from deboom.progress import progress_bar
from deboom.report import Report
from deboom.runs.options import Checks, at_least
from deboom.runs.result import RunContext
from deboom.vehicles.fleet_front import FleetFront, PeakRise


def report_limits(report: Report, limits: DesignLimits | None, front: Front) -> None:
    """Add to a report what the limits of a search did; nothing without limits.

    The report gets the tables ``limits`` of numbers of a design, ``level_limits`` of numbers over
    the scatter, and ``beyond_limits``, the key ``n_beyond_limits`` and a section. It warns of a
    named design that misses a limit because variables without effect on the noise went back to
    nominal.
    """
    every = (limits.around(front.robust) if limits else front.robust).limits
    if every is None:
        return
    report.section("Limits", _limits_in_words(limits, front))
    if limits:
        report.warn(*_misses_at_nominal(limits, front.named_designs))
        values = limits.requirements(np.stack(list(front.named_designs.values())))
        report.table(
            "limits",
            _limited_numbers(
                limits.limits.limits, dict(zip(front.named_designs, values, strict=True))
            ),
            "Limited numbers of the named designs, without scatter.",
        )
    if front.robust.limits:
        report.table(
            "level_limits",
            _limited_levels(front),
            "Limited levels of the named designs, under the draws of the verification: means over "
            f"the lines, and loudest lines. {_misses_in_words(_missed_levels(front))}",
        )
    report.table("beyond_limits", _beyond(front.search, front.variables, every))
    report.summary["n_beyond_limits"] = int(front.search.infeasible.sum())


def _limits_in_words(limits: DesignLimits | None, front: Front) -> str:
    """Say what had to keep limits, and how many designs of the search miss one."""
    whose, draws = [], ""
    if front.robust.limits:
        whose.append("by the levels over the scatter")
        draws = " under the draws of the search"
    if limits:
        whose.append(f"by {'every drawn part' if limits.every_part else 'the design itself'}")
    return (
        f"Limits had to be kept {' and '.join(whose)}: {front.search.infeasible.sum()} of "
        f"{front.search.n_evaluated} designs miss one. All designs of the front keep all{draws}."
    )


def _misses_at_nominal(limits: DesignLimits, designs: Mapping[str, RealArray]) -> list[str]:
    """Say which named designs (k,) miss a limit; the first, today's, may."""
    sentences = []
    for name, design in list(designs.items())[1:]:
        excess = limits.limits.excess(limits.requirements(design[np.newaxis, :]))
        if np.any(excess > 0.0):
            sentences.append(
                f"The design '{name}' misses a limit: {limits.limits.closest(excess)}."
            )
    return sentences


def _scales(front: Front) -> RealArray:
    """Return the factor from each limited number to a level that is shown, (n_limit,) [1]."""
    limits = front.robust.limits.limits if front.robust.limits else ()
    return np.array([1.0 / limit.n_lines for limit in limits])


def _missed_levels(front: Front) -> RealArray:
    """Return by how much verified designs miss the limit that they miss most, (n,) [dB]."""
    excess = np.where(np.isfinite(front.values.excess), front.values.excess, 0.0)
    # each limit of a level has one bound
    return np.asarray((excess * _scales(front)).max(axis=1))


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
    designs = np.stack(list(front.named_designs.values()))
    sets = [(robust, robust.limits) for robust in front.judge.sets if robust.limits]
    values = np.mean([kept.responses(robust(designs).excess) for robust, kept in sets], axis=0)
    # today's number is another one under each set of draws
    most = np.mean([[limit.at_most for limit in kept.limits] for _, kept in sets], axis=0)
    limits, scales = [], _scales(front)
    for limit, scale, bound in zip(sets[0][1].limits, scales, most, strict=True):
        name = limit.response if scale == 1.0 else f"{limit.response}, per line"
        limits.append(Limit(name, limit.unit, at_most=float(scale * bound)))
    return _limited_numbers(limits, dict(zip(front.named_designs, values * scales, strict=True)))


def _limited_numbers(bounds: Sequence[Limit], designs: Mapping[str, RealArray]) -> pd.DataFrame:
    """One row per limited number: its value in each design, and its bounds.

    - `designs`: values of the limited numbers of each design, by its name.
    """
    labels = [f"{limit.response} [{limit.unit}]" for limit in bounds]
    table: dict[str, Sequence[object]] = {"number": labels}
    table |= {name: row.tolist() for name, row in designs.items()}
    for side in ("at_least", "at_most"):
        values = np.array([getattr(limit, side) for limit in bounds])
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


@dataclass(frozen=True, eq=False)
class _Together:
    """Several limited numbers of one design, one after another."""

    parts: tuple[Requirements, ...]

    @property
    def variable_names(self) -> tuple[str, ...]:
        return self.parts[0].variable_names

    @property
    def response_names(self) -> tuple[str, ...]:
        return tuple(name for part in self.parts for name in part.response_names)

    def __call__(self, designs: RealArray) -> RealArray:
        return np.hstack([part(designs) for part in self.parts])


PeakRiseOption: TypeAlias = Annotated[
    float | None, Option(help="Largest allowed rise of a booming peak [dB]; default: no limit.")
]
"""By how much a design may raise the booming peak that rises most."""


def check_peak_rise(most: float | None) -> None:
    """Refuse a rise that is negative or not finite."""
    if most is not None and not 0 <= most < np.inf:
        raise InputError(f"--peak-rise {most:g}: give by how much a peak may rise, from 0 dB")


def keeping_peaks(
    limits: DesignLimits | None, model: Evaluate, today: RealArray, most: float
) -> DesignLimits:
    """Limit by how much the booming peak of a vehicle that rises most may rise, besides others.

    - `limits`: what designs must keep anyway, of the design itself.
    - `model`, `today` (k,): model with levels, and design whose peaks count.
    - `most`: rise over today's peaks, without scatter [dB].
    - raises InputError: limits that every drawn part must keep.
    """
    rise = PeakRise(model, today)
    limit = Limit(rise.response_names[0], "dB", at_most=most, source=f"--peak-rise {most:g}")
    if limits is None:
        return DesignLimits(rise, Limits((limit,)))
    if limits.every_part is not None:
        raise InputError(
            "--peak-rise limits the design itself, and the file of limits every part: let the file "
            "limit the design, or leave --peak-rise out"
        )
    return replace(
        limits,
        requirements=_Together((limits.requirements, rise)),
        limits=Limits((*limits.limits.limits, limit)),
    )


@dataclass(frozen=True)
class SearchOptions:
    """Options of a study: what searches, how long, and with how many processes."""

    generations: Annotated[
        int, Option(help="Largest number of generations of the search.", callback=at_least(1))
    ] = 100
    population: Annotated[
        int, Option(help="Number of designs per generation.", callback=at_least(4))
    ] = 100
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
        limits: DesignLimits | None = None,
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
                limits=limits,
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
    ] = 1
    polish: Annotated[
        bool,
        Option(
            help="Improve the front, or its picks, along gradients after the search. If the whole "
            f"front is improved, a search without limits ends after {BEFORE_DESCENTS} designs, "
            "unless --until-gain or --until-seconds says when."
        ),
    ] = True
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
        limits: DesignLimits | None = None,
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
                limits=limits,
                first_population=begin,
                verified_with=self.checks,
                workers=self.workers,
                scheduler=self.scheduler,
                progress=bar,
                checkpoint=_checkpoint(run, inputs, name, seed),
            )
        return _keeping_peaks(front)
