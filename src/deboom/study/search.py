"""Robust searches within limits, merged into one front."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
from typer import Option

from deboom.arrays import RealArray
from deboom.common import AXES, Progress
from deboom.errors import InputError
from deboom.explore.doe import latin_hypercube
from deboom.explore.front import pareto_front, replicates, thinned, verify
from deboom.explore.moments import MEAN_SUM, SIGMA_SUM
from deboom.explore.robust import (
    Limit,
    LimitedResponse,
    Limits,
    Robust,
    RobustResponse,
    chosen,
    joined,
)
from deboom.explore.scatter import ToleranceSample
from deboom.explore.search import SearchResult, merge, nsga2
from deboom.explore.selection import improved, pick
from deboom.explore.space import Requirements
from deboom.explore.workers import workers_for
from deboom.files.limits import LimitsFile, load_limits
from deboom.measurement.channels import LoadCase
from deboom.mounts.mount import Mount, in_mount_axes
from deboom.physics.dynamic_stiffness import dynamic_stiffness
from deboom.report import Report
from deboom.study.front import Front
from deboom.study.options import at_least
from deboom.study.progress import progress_bar
from deboom.study.result import RunContext
from deboom.vehicles.booming_model import Motion
from deboom.vehicles.design_factor import Factor
from deboom.vehicles.fleet import lines_inside
from deboom.vehicles.limits import (
    MountRequirements,
    NaturalFrequencies,
    OperatingStiffness,
    Quantity,
    TorqueTravel,
    WeightSag,
)
from deboom.vehicles.platform import MissingLibrary, Runs
from deboom.vehicles.powertrain import KinematicModel, Powertrain


def robust_search(
    robust: Robust,
    budget: SearchOptions,
    seed: int,
    progress: Progress,
    run: RunContext | None,
    inputs: Sequence[Path],
    name: str = "search",
    first_population: RealArray | None = None,
) -> SearchResult:
    """Search with every seed and merge the fronts.

    - `robust`: what evaluates a generation, perhaps in many processes; `budget`: for how long.
    - `seed`: of the first search; `name`: its folder within the run.
    - `run`: where the searches are kept, each by itself; `inputs`: files that they depend on.
    - `first_population` (population, k): designs that every search begins with [units of the
      space].
    - returns, of several searches, their merged front with the convergence of the first one. A
      single search is `nsga2`'s, bit for bit.
    - raises InputError: fewer searches than one; see also `nsga2`.
    """
    if budget.searches < 1:
        raise InputError(f"{budget.searches} searches find nothing: ask for at least one")
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
    if len(found) == 1:
        return first
    return replace(
        merge(found), hypervolume=first.hypervolume, reference_point=first.reference_point
    )


@dataclass(frozen=True, eq=False)
class MountLimits:
    """What the designs of a study must keep; nothing at all without a file.

    - `requirements`, `limits`: the limited numbers of a design, and one limit for each.
    - `every_part`: whose draws must keep the limits; None: the design itself.
    - `inputs`: files that they come from.
    """

    requirements: Requirements | None = None
    limits: Limits | None = None
    every_part: RobustResponse | None = None
    inputs: tuple[Path, ...] = ()

    def around(self, robust: Robust) -> Robust:
        """Return a response whose designs must keep the limits."""
        if self.requirements is None or self.limits is None:
            return robust
        made = self.every_part.made if self.every_part else None
        return LimitedResponse(robust, self.requirements, self.limits, made)


def report_limits(
    report: Report, limits: MountLimits, search: SearchResult, designs: Mapping[str, RealArray]
) -> None:
    """Add to a report what the limits did; nothing without limits.

    The report gets the tables ``limits`` and ``beyond_limits``, the key ``n_beyond_limits`` and a
    section, and warns of a named design that misses a limit because variables without effect on the
    noise went back to nominal. Of `designs`, (k,) each, the first one is today's.
    """
    requirements, bounds = limits.requirements, limits.limits
    if requirements is None or bounds is None:
        return
    for name, design in list(designs.items())[1:]:
        excess = bounds.excess(requirements(design[np.newaxis, :]))
        if np.any(excess > 0.0):
            report.warn(f"The design '{name}' misses a limit: {bounds.closest(excess)}.")
    whose = "every drawn part" if limits.every_part else "the design itself"
    report.section(
        "Limits",
        f"Limits had to be kept by {whose}: {search.infeasible.sum()} "
        f"of {search.n_evaluated} designs miss one. All designs of the front keep all.",
    )
    table = _limited_numbers(requirements, bounds, designs)
    report.table("limits", table, "Limited numbers of the named designs, without scatter.")
    report.table("beyond_limits", _beyond(search, requirements.variable_names, bounds))
    report.summary["n_beyond_limits"] = int(search.infeasible.sum())
    report.inputs += limits.inputs


def _limited_numbers(
    requirements: Requirements, limits: Limits, designs: Mapping[str, RealArray]
) -> pd.DataFrame:
    """One row per limited number: its value in each design, and its bounds."""
    numbers = requirements(np.stack(list(designs.values())))
    bounds = limits.limits
    labels = [f"{one.response} [{one.unit}]" for one in bounds]
    table: dict[str, Sequence[object]] = {"number": labels}
    for name, row in zip(designs, numbers, strict=True):
        table[name] = row.tolist()
    for side in ("at_least", "at_most"):
        values = np.array([getattr(one, side) for one in bounds])
        table[side.replace("_", " ")] = np.where(np.isfinite(values), values, np.nan).tolist()
    return pd.DataFrame(table)


def mount_limits(
    path: Path | None, runs: Runs, robust: RobustResponse, factor: Factor = Factor.dynamic
) -> MountLimits:
    """Read the limits of a study.

    - `path`: see `deboom.files.limits`; None is no limit.
    - `runs`: platform, and the first run, whose operating stiffness counts.
    - `robust`: its draws count where every part has to keep the limits.
    - `factor`: what a stiffness factor means, for travels.
    - raises InputError: a file that cannot be read; a mount, direction or variable that there is
      not; a limit that today's design cannot be held to because a curve was not measured that far.
    """
    if path is None:
        return MountLimits()
    content = load_limits(path)
    try:
        pairs = _quantities(content, runs, factor)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    requirements = MountRequirements(robust.space.names, tuple(one for one, _ in pairs))
    limits = Limits(tuple(limit for _, bounds in pairs for limit in bounds))
    nominal = requirements(robust.space.nominal[np.newaxis, :])[0]
    for name, number in zip(requirements.response_names, nominal, strict=True):
        if not np.isfinite(number):
            raise InputError(f"{path}: {name} of today's design lies beyond its measured curve")
    library = (runs.platform.library_file,) if content.sag or content.travel else ()
    every_part = robust if content.kept_by == "every part" else None
    return MountLimits(requirements, limits, every_part, (path, *library))


def _quantities(
    content: LimitsFile, runs: Runs, factor: Factor
) -> list[tuple[Quantity, tuple[Limit, ...]]]:
    """Return what is limited with its limits, one per column."""
    carriers = [mount for mount in runs.platform.mounts if mount.carries_powertrain]
    found: list[tuple[Quantity, tuple[Limit, ...]]] = []
    if content.sag or content.travel:
        model = _static_curves(runs)
        for sag in content.sag:
            quantity = WeightSag(model, _powertrain(runs), (sag.mount,))
            found.append((quantity, _limits(quantity, at_most=sag.at_most_mm)))
        for travel in content.travel:
            moved = TorqueTravel(model, travel.wheel_torque_nm, (travel.direction,), factor)
            found.append((moved, _limits(moved, travel.at_least_mm, travel.at_most_mm)))
    case = runs.cases[0][0]
    if content.natural_frequency:
        every = natural_frequencies(runs)
        for window in content.natural_frequency:
            modes = replace(every, modes=(window.mode,))
            found.append((modes, _limits(modes, window.at_least_hz, window.at_most_hz)))
    if content.stiffness:
        names = [name for mount in runs.platform.mounts for name in mount.variables]
        magnitude = dict(zip(names, runs.stiffness(case, runs.band).tolist(), strict=True))
        for entry in content.stiffness:
            variables = [entry.variable]
            if entry.variable in AXES:
                variables = [f"{one.name} {entry.variable}" for one in carriers for _ in one.pieces]
            stiff = OperatingStiffness(magnitude, {entry.variable: variables})
            found.append((stiff, _limits(stiff, entry.at_least_n_per_mm, entry.at_most_n_per_mm)))
    return found


def price(runs: Runs, factor: Factor) -> MountRequirements:
    """Return what mounts pay for being quiet: sag, travel at full torque, rigid-body modes.

    Without a mount library, and so without static curves, only modes.

    - raises InputError: no static curve of a direction, no [powertrain], no torque.
    """
    names = tuple(name for mount in runs.platform.mounts for name in mount.variables)
    modes = natural_frequencies(runs)
    if isinstance(runs.platform.library_fault, MissingLibrary):
        return MountRequirements(names, (modes,))
    carriers = [mount for mount in runs.platform.mounts if mount.carries_powertrain]
    model, case = _static_curves(runs), runs.cases[0][0]
    places = [
        f"{mount.name} {piece}" if piece else mount.name
        for mount in carriers
        for piece in (mount.pieces if len(mount.pieces) > 1 else ("",))
    ]
    travel = [f"{place} {axis}" for place in places for axis in "xz"]
    quantities = (
        WeightSag(model, _powertrain(runs), tuple(places)),
        TorqueTravel(model, round(float(case.wheel_torque.max())), tuple(travel), factor),
        modes,
    )
    return MountRequirements(names, quantities)


def natural_frequencies(runs: Runs) -> NaturalFrequencies:
    """Return the rigid-body modes of the powertrain, as `price` has them; errors likewise."""
    carriers = [mount for mount in runs.platform.mounts if mount.carries_powertrain]
    real = _real_stiffness(carriers, runs.cases[0][0], runs.band)
    return NaturalFrequencies(tuple(carriers), _powertrain(runs), real)


def _limits(
    quantity: Quantity, at_least: float | None = None, at_most: float | None = None
) -> tuple[Limit, ...]:
    low = -np.inf if at_least is None else at_least
    high = np.inf if at_most is None else at_most
    return tuple(Limit(name, quantity.unit, low, high) for name in quantity.names)


def _powertrain(runs: Runs) -> Powertrain:
    if runs.platform.powertrain is None:
        raise InputError(
            "sag and natural frequencies need mass and inertia: fill in [powertrain] of "
            "platform.toml, or leave out [[sag]] and [[natural_frequency]]"
        )
    return runs.platform.powertrain


def _static_curves(runs: Runs) -> KinematicModel:
    platform = runs.platform
    if isinstance(platform.library_fault, MissingLibrary):
        raise InputError(
            f"sag and travel need static curves, and there is no mount library "
            f"{platform.library_file}: export one there, or leave out [[sag]] and [[travel]]"
        )
    return platform.static_curves()


def _real_stiffness(
    mounts: Sequence[Mount], case: LoadCase, band: tuple[float, float]
) -> dict[str, float]:
    """Mean real part over the lines of a run, per piece, by variable [N/m]."""
    case = in_mount_axes(mounts, case)
    inside = lines_inside(case.force.frequency, band, f"load case {case.name}")
    found = {}
    for mount in mounts:
        for axis, name in zip(AXES, mount.variables, strict=True):
            channels = mount.channels(axis)
            if set(channels) <= set(case.force.channels):
                force = case.force.select(channels).values[inside]
                displacement = case.displacement.select(channels).values[inside]
                found[name] = float(np.mean(dynamic_stiffness(force, displacement).real))
    return found


def _beyond(search: SearchResult, variables: Sequence[str], limits: Limits) -> pd.DataFrame:
    """One row per design that misses a limit: factors, and by how much it misses each."""
    beyond = chosen(search.evaluated, np.flatnonzero(search.infeasible))
    factors = {f"{name} [1]": beyond.designs[:, k] for k, name in enumerate(variables)}
    excess = {
        f"beyond {name} [{name.rpartition(' ')[2]}]": beyond.excess[:, k]
        for k, name in enumerate(limits.names)
    }
    return pd.DataFrame({**factors, **excess})


@dataclass(frozen=True)
class SearchOptions:
    """Options of a study: how long NSGA-II searches, and with how many processes."""

    generations: Annotated[int, Option(help="Generations of NSGA-II.", callback=at_least(1))] = 100
    population: Annotated[int, Option(help="Designs per generation.", callback=at_least(4))] = 100
    workers: Annotated[
        int, Option(help="Processes; any number gives the same result.", callback=at_least(1))
    ] = 1
    scheduler: Annotated[
        str | None,
        Option(
            help="Dask cluster, tcp://host:port; it trusts whoever reaches it, so keep it in a "
            "closed network or use tls://host:port with Dask's own TLS settings."
        ),
    ] = None
    searches = 1

    def front(
        self,
        robust: Robust,
        seed: int,
        context: RunContext | None,
        inputs: Sequence[Path],
        *,
        limits: MountLimits | None = None,
        title: str = "NSGA-II",
        name: str = "search",
        first_population: RealArray | None = None,
    ) -> SearchResult:
        """Search the front of a robust response with these options.

        - `robust`: its designs are spread over the processes; `limits`: what designs must keep.
        - `title`: of the progress bar; others and errors as for `robust_search`.
        """
        with (
            workers_for(robust, self.workers, self.scheduler) as spread,
            progress_bar(title) as bar,
        ):
            whole = spread if limits is None else limits.around(spread)
            return robust_search(
                *(whole, self, seed, bar, context, inputs, name),
                first_population=first_population,
            )


VERIFIED = 1024
"""Draws of each scramble behind a verified number."""
SHOWN = 100
"""Designs of a front that are verified and shown; a longer front is thinned evenly along it."""


@dataclass(frozen=True)
class ThoroughSearchOptions(SearchOptions):
    """Options of a study that may search with several seeds, and improves its picks by gradient."""

    searches: Annotated[
        int, Option(help="Seeds from seed upwards, into one front.", callback=at_least(1))
    ] = 1
    polish: Annotated[bool, Option(help="Picks go on by gradient.")] = True

    def verified(
        self,
        robust: RobustResponse,
        seed: int,
        context: RunContext | None,
        inputs: Sequence[Path],
        limits: MountLimits | None = None,
        draws: int = VERIFIED,
        *,
        name: str = "search",
        begin: RealArray | None = None,
    ) -> Front:
        """Search a front, improve its picks, and verify what is shown of it.

        - `begin` (n, k): designs to begin with, beside a Latin hypercube [units of the space].
        - `draws`: of each scramble of the verification, a power of two; others as for `front`.

        Picks go on by gradient where the model is smooth, two sums are minimised, all designs share
        their draws, and no limits are set; elsewhere they are the best of all evaluated designs.
        """
        if begin is not None:
            rest = latin_hypercube(robust.space, self.population, seed=seed)[len(begin) :]
            begin = np.vstack([begin, rest])
        search = self.front(
            *(robust, seed, context, inputs),
            limits=limits,
            title=name,
            name=name,
            first_population=begin,
        )
        smooth = (
            robust.objectives == (MEAN_SUM, SIGMA_SUM)
            and isinstance(robust.sample, ToleranceSample)
            and not robust.space.integer.any()
            and getattr(robust.evaluate, "motion", None) is not Motion.amplitude
        )
        polished = self.polish and smooth and (limits is None or limits.limits is None)
        today = robust(robust.space.nominal[np.newaxis])
        picked = chosen(search.evaluated, sorted(set(pick(search.evaluated, today).values())))
        if polished:
            picked = improved(robust, search.evaluated, today)
        front = pareto_front(search.front, picked)
        rows = joined([thinned(front, SHOWN), picked])
        order = np.lexsort([*rows.designs.T, rows.objectives[:, 0]])
        new = np.r_[True, np.any(np.diff(rows.designs[order], axis=0) != 0.0, axis=1)]
        searched, judge = chosen(rows, order[new]), replicates(robust, draws, seed=seed)
        note = "Its picks then went on by gradient." if polished else ""
        if self.searches > 1:
            note = f"The front is that of {self.searches} searches with different seeds. {note}"
        found = replace(search, front=front), searched, judge, verify(searched, judge)
        return Front(robust, *found, note.strip())
