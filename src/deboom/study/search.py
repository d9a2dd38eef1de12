"""Options of a robust search, and the limits of its designs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
from typer import Option

from deboom.arrays import RealArray
from deboom.choices import SearchAlgorithm
from deboom.common import AXES
from deboom.errors import InputError
from deboom.explore.result import Front, SearchResult
from deboom.explore.robust import DesignLimits, Limit, Limits, Robust, chosen
from deboom.explore.search import VERIFIED, Checkpoint, search, searched
from deboom.explore.space import Requirements
from deboom.files.limits import LimitsFile, load_limits
from deboom.files.run_folder import CheckpointFolder
from deboom.measurement.channels import LoadCase
from deboom.mounts.mount import Mount, in_mount_axes
from deboom.physics.dynamic_stiffness import dynamic_stiffness
from deboom.report import Report
from deboom.study.options import at_least
from deboom.study.progress import progress_bar
from deboom.study.result import RunContext
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


def report_limits(
    report: Report,
    limits: DesignLimits | None,
    search: SearchResult,
    designs: Mapping[str, RealArray],
) -> None:
    """Add to a report what the limits did; nothing without limits.

    The report gets the tables ``limits`` and ``beyond_limits``, the key ``n_beyond_limits`` and a
    section, and warns of a named design that misses a limit because variables without effect on the
    noise went back to nominal. Of `designs`, (k,) each, the first one is today's.
    """
    if limits is None:
        return
    requirements, bounds = limits.requirements, limits.limits
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
    path: Path | None, runs: Runs, robust: Robust, factor: Factor = Factor.dynamic
) -> DesignLimits | None:
    """Read the limits of a study.

    - `path`: see `deboom.files.limits`; None is no limit.
    - `runs`: platform, and the first run, whose operating stiffness counts.
    - `robust`: its draws count where every part has to keep the limits.
    - `factor`: what a stiffness factor means, for travels.
    - raises InputError: a file that cannot be read; a mount, direction or variable that there is
      not; a limit that today's design cannot be held to because a curve was not measured that far.
    """
    if path is None:
        return None
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
    return DesignLimits(requirements, limits, every_part, (path, *library))


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
    """Options of a study: what searches, how long, and with how many processes."""

    generations: Annotated[int, Option(help="Generations of the search.", callback=at_least(1))] = (
        100
    )
    population: Annotated[int, Option(help="Designs per generation.", callback=at_least(4))] = 100
    algorithm: Annotated[
        SearchAlgorithm, Option(help="Algorithm of pymoo that searches the front.")
    ] = SearchAlgorithm.nsga2
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
                population=self.population,
                generations=self.generations,
                seed=seed,
                algorithm=self.algorithm,
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
        """Search and verify the whole front with these options, as `deboom.search` unpolished."""
        with progress_bar(title) as bar:
            return search(
                robust,
                population=self.population,
                generations=self.generations,
                seed=seed,
                limits=limits,
                algorithm=self.algorithm,
                polish=False,
                shown=None,
                verified_with=verified_with,
                workers=self.workers,
                scheduler=self.scheduler,
                progress=bar,
                checkpoint=_checkpoint(run, inputs, "search", seed),
            )


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
        int, Option(help="Seeds from seed upwards, into one front.", callback=at_least(1))
    ] = 1
    polish: Annotated[bool, Option(help="The front, or its picks, go on by gradient.")] = True

    def verified(
        self,
        robust: Robust,
        *,
        seed: int,
        run: RunContext | None,
        inputs: Sequence[Path],
        limits: DesignLimits | None = None,
        verified_with: int = VERIFIED,
        name: str = "search",
        begin: RealArray | None = None,
    ) -> Front:
        """Search, improve and verify a front with these options, as `deboom.search`.

        - `name`: of the folder within the run, and of the progress bar.
        - `begin` (n, k): designs to begin with, beside a Latin hypercube [units of the space].
        """
        with progress_bar(name) as bar:
            return search(
                robust,
                population=self.population,
                generations=self.generations,
                seed=seed,
                searches=self.searches,
                limits=limits,
                first_population=begin,
                algorithm=self.algorithm,
                polish=self.polish,
                verified_with=verified_with,
                workers=self.workers,
                scheduler=self.scheduler,
                progress=bar,
                checkpoint=_checkpoint(run, inputs, name, seed),
            )
