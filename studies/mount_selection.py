"""Which parts of the mount catalogue make the U06 vehicles quiet, also with parts that scatter?

The study chooses one characterised part per mount from a library; each axis of the part may be
re-tuned a little. NSGA-II varies part numbers and stiffness factors. The objectives are two sums
over the vehicles: the mean SPLV, 20 to 60 Hz, and its standard deviation over the tolerance. For
comparison, every set of parts without re-tuning is evaluated, if there are not too many sets.

Result with seed 1 and five further parts of each mount, which differ by 5 % (one sigma) per axis:
parts without re-tuning lower the level by 0.2 dB per line, and parts re-tuned within 5 % by 0.9 dB.
In the virtual car, sets of parts change the level as predicted (r 0.999; 0.95 with prescribed
motion).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from typer import Option

from deboom.errors import InputError
from deboom.explore.front import VERIFICATION, pareto_front
from deboom.explore.robust import Robust, RobustValues, joined
from deboom.explore.scatter import sobol_sample
from deboom.explore.search import VERIFIED
from deboom.explore.workers import workers_for
from deboom.files.catalogue import platform_catalogue
from deboom.mounts.surface_forces import Outside
from deboom.pages.mount_selection import QUIETEST, Selection, mount_selection_report
from deboom.progress import announce, progress_bar
from deboom.report import Report
from deboom.runs.options import AimOptions, Draws, Seed, Tolerance, robust_response
from deboom.runs.platform_options import PlatformOptions
from deboom.runs.result import RunContext, run_name
from deboom.runs.search import SearchOptions
from deboom.vehicles.booming_model import Motion
from deboom.vehicles.catalogue import Catalogue, catalogue_index
from deboom.vehicles.fleet_front import FleetFront
from deboom.vehicles.platform import MountSource, Runs

BATCH = 100
"""Sets evaluated between two steps of the progress bar."""
FRONT_OVER_POPULATION = 5
"""Designs on the front, all of which are verified, for each of the population, about."""


@dataclass(frozen=True)
class Options:
    """Which parts are chosen from, for whom, and for how long is searched."""

    seed: Seed = 1
    search: SearchOptions = SearchOptions()
    samples: Draws = 128
    tolerance: Tolerance = 0.15
    retuning: Annotated[
        float,
        Option(help="Allowed change of a part's stiffness, ± [1]; 0 takes the parts as they are."),
    ] = 0.05
    catalogue: Annotated[
        Path | None, Option(help="Mount library with the parts: exported JSON, or a database.")
    ] = None
    mount: Annotated[list[str] | None, Option(help="Mount that may be replaced; repeatable.")] = (
        None
    )
    every_set_up_to: Annotated[
        int, Option(help="Evaluate all sets of parts up to this number of sets.")
    ] = 5000
    aims: AimOptions = AimOptions()
    platform: PlatformOptions = PlatformOptions(mounts=MountSource.library_inside)
    motion: Annotated[Motion, Option(help="Motion of the powertrain.")] = Motion.coupled

    def __post_init__(self) -> None:
        if self.platform.mounts is MountSource.spectra:
            raise InputError(
                "parts of a catalogue are known by their surfaces alone: take --mounts library or "
                "--mounts library-inside"
            )


@dataclass(frozen=True, eq=False)
class Model:
    """Levels of the vehicles with every set of parts, and the parts."""

    runs: Runs
    catalogue: Catalogue
    robust: Robust


def prepare(options: Options) -> Model:
    """Read platform and catalogue, and build the model of all parts."""
    runs = options.platform.runs()
    catalogue = platform_catalogue(runs.platform, options.catalogue, options.mount)
    index = catalogue_index(runs, catalogue, options.motion, _outside(options))
    space = catalogue.space(index.variable_names, options.retuning, options.tolerance)
    sample = sobol_sample(space.n_variables, options.samples, seed=options.seed)
    return Model(runs, catalogue, robust_response(index, space, sample, aims=options.aims))


def _outside(options: Options) -> Outside:
    """Return what becomes of lines that a part was not measured for."""
    inside = options.platform.mounts is MountSource.library_inside
    return Outside.KEEP_MEASURED if inside else Outside.REFUSE


def run(model: Model, options: Options, context: RunContext | None = None) -> Report:
    """Search, enumerate, verify and report."""
    chosen = _selected(model, options, context)
    return mount_selection_report(chosen, run_name(context, "mount_selection"))


def _selected(model: Model, options: Options, context: RunContext | None) -> Selection:
    """Evaluate every set of parts if they are not too many, search, and verify."""
    catalogue, search = model.catalogue, options.search
    enumerated = catalogue.n_sets <= options.every_set_up_to
    evaluated = search.population * search.generations + enumerated * catalogue.n_sets
    # the front and today's design, verified by many draws
    verified = search.population * len(VERIFICATION) * VERIFIED / model.robust.sample.n_samples
    today = model.robust.space.nominal[np.newaxis]
    steps = (evaluated + verified) / search.workers
    announce("mount selection", lambda: model.robust(today), steps)
    sets = every_set(model, options) if enumerated else None
    front = options.search.front(
        model.robust,
        seed=options.seed,
        run=context,
        inputs=(*model.runs.platform.input_files, *catalogue.inputs),
        verified_with=VERIFIED,
        title="mount selection",
    )
    named = {"today's parts": (front.baseline, 0)}
    set_front = None
    if sets is not None:
        set_front = pareto_front(sets)
        named[QUIETEST] = (front.judge.sets[0](set_front.designs[:1]), 0)
    named |= {name: (front.values, row) for name, row in front.picks.items()}
    picks = front.compared(named)
    designs = np.stack([values.designs[row] for values, row in named.values()])
    for place, (column, parts) in enumerate(catalogue.columns(designs).items()):
        picks.insert(1 + place, column, parts)
    return Selection(
        runs=model.runs,
        catalogue=catalogue,
        outside=_outside(options),
        retuning=options.retuning,
        front=front,
        heard=FleetFront(front, order=model.runs.cases[0][0].order),
        sets=sets,
        set_front=set_front,
        picks=picks,
    )


def every_set(model: Model, options: Options) -> RobustValues:
    """Evaluate every set of parts as they are, in the draws of the search."""
    catalogue, search = model.catalogue, options.search
    sets = catalogue.all_sets()
    factors = np.tile(model.robust.space.nominal[sets.shape[1] :], (len(sets), 1))
    designs = np.hstack([sets, factors])
    parts = []
    with (
        workers_for(model.robust, search.workers, search.scheduler) as spread,
        progress_bar("sets of parts") as progress,
    ):
        for start in range(0, len(designs), BATCH):
            parts.append(spread(designs[start : start + BATCH]))
            progress(min(start + BATCH, len(designs)), len(designs), "")
    values = joined(parts)
    if values.failed.any():
        raise InputError(f"the parts {catalogue.labels(sets[values.failed][0])} cannot be computed")
    return values
