"""How certain is the effect of the mounts, and what should be measured next?

The study draws errors of noise transfer functions, stiffnesses, motions and forces, the same for
all designs and vehicles, and builds the model again from each draw. The results are 90 % intervals
of levels, of changes against today and of scatter, and the effect of one more measurement on them.
The sizes of the errors come from the error budget of the mount library, from vehicles that were
measured in two ways (--vehicle), or from stated priors; a table names the origin of each.

On the virtual platform the mean level is uncertain by 0.5 dB and a change by 0.08 dB, because
errors of calibration cancel. For any vehicle and load case the change is uncertain by 0.6 dB: five
vehicles are few, and one more vehicle narrows the interval most. Measurements are ranked by what
the interval of the expected change in cars gains: receptances or driving points of the bodies come
first, then brackets, one more vehicle, temperatures, and channels measured again.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from typer import Option

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.front import replicates, verified
from deboom.explore.robust import Robust
from deboom.explore.scatter import sobol_sample
from deboom.explore.selection import pick
from deboom.files.uncertain_index import UncertainIndex, uncertain_index
from deboom.files.vehicle import read_vehicle
from deboom.measurement.channels import Band, Frf, lines_inside
from deboom.measurement.measured_vehicle import Method, path_noise_transfer
from deboom.measurement.uncertainty import LEAST_DRAWS, method_difference
from deboom.pages.measured_uncertainty import TODAY, Drawn, Repeated, uncertainty_report
from deboom.pages.motion import report_runs
from deboom.progress import progress_bar
from deboom.report import Report
from deboom.runs.options import FrontRun, ScatterOptions, Seed, robust_response
from deboom.runs.platform_options import MotionOptions, PlatformOptions
from deboom.runs.rebuilt import compared_run
from deboom.runs.result import RunContext
from deboom.runs.search import SearchOptions
from deboom.vehicles.expected_change import expected_or_why
from deboom.vehicles.platform import Runs
from deboom.vehicles.platform_uncertainty import transfer_sources
from deboom.vehicles.uncertain_data import UncertaintySource

VERIFICATION = 1024
"""Draws of each scramble that a search's front is verified with before designs are picked."""


@dataclass(frozen=True)
class Options:
    """Which designs, and how often measurements are drawn again."""

    seed: Seed = 1
    draws: Annotated[int, Option(help="Number of drawn sets of measurements, at least 40.")] = 200
    front: FrontRun = None
    search: SearchOptions = SearchOptions(generations=40, population=60)
    scatter: ScatterOptions = ScatterOptions(samples=64)
    vehicle: Annotated[
        list[Path] | None,
        Option(help="Folder of a vehicle that was measured in two ways; repeatable."),
    ] = None
    ear: Annotated[str | None, Option(help="Ear of these vehicles; default: the first.")] = None
    averaged: Annotated[bool, Option(help="The platform contains the mean of both ways.")] = False
    platform: PlatformOptions = PlatformOptions()
    motion: MotionOptions = MotionOptions()

    def __post_init__(self) -> None:
        if self.draws < LEAST_DRAWS:
            raise InputError(
                f"{self.draws} draws do not give an interval: take at least {LEAST_DRAWS}"
            )


@dataclass(frozen=True, eq=False)
class Model:
    """Levels of the vehicles, their errors, and the same vehicles in all load cases."""

    runs: Runs
    robust: Robust
    uncertain: UncertainIndex
    every_case: Any
    inputs: tuple[Path, ...]


def prepare(options: Options) -> Model:
    """Read the platform and what is known of its errors, and build its models."""
    reason = "means over the vehicles are of sounds"
    runs = options.platform.runs().heard(reason)
    names = [case.name for case in runs.platform.load_cases]
    every = replace(options.platform, load_case=names).runs().heard(reason)
    index = options.motion.model(runs)
    made = options.scatter.made(index.variable_names)
    sample = sobol_sample(made.n_draws, options.scatter.samples, seed=options.seed)
    transfer, files = measured_transfer(
        options.vehicle or [], options.ear, runs.band, averaged=options.averaged
    )
    return Model(
        runs,
        robust_response(index, made.space, sample, structure=made.structure),
        uncertain_index(index, runs.platform, runs.parts, transfer),
        options.motion.model(every),
        (*runs.platform.input_files, *files, *made.inputs),
    )


def run(model: Model, options: Options, context: RunContext | None = None) -> Report:
    """Choose designs, draw the measurements again and report."""
    designs = _designs(model, options, context)
    repeated = _measure_again(model, designs, options)
    origin = "comes from a quick search, not from your front; use --front RUN for yours"
    if options.front is not None:
        origin = f"is that of the front {options.front.name}"
    report = uncertainty_report(repeated, model.inputs, origin)
    report_runs(report, model.runs)
    return report


def measured_transfer(
    folders: Sequence[Path], ear: str | None, band: Band, *, averaged: bool
) -> tuple[Sequence[UncertaintySource] | None, tuple[Path, ...]]:
    """Estimate the errors of noise transfer functions from vehicles measured in two ways.

    Returns them with the files that were read; without a vehicle None: the stated priors stay.
    """
    if not folders:
        return None, ()
    pairs = []
    for folder in folders:
        vehicle = read_vehicle(folder)
        whose = ear or vehicle.ears[0]
        hammer, loudspeaker = (
            _inside(path_noise_transfer(vehicle, method, whose), band)
            for method in (Method.DIRECT, Method.RECIPROCAL)
        )
        pairs.append((hammer, loudspeaker))
    origin = f"both methods in {', '.join(folder.name for folder in folders)}"
    files = tuple(path for car in folders for path in sorted(car.rglob("*")) if path.is_file())
    return transfer_sources(method_difference(pairs), origin, averaged=averaged), files


def _inside(transfer: Frf, band: Band) -> Frf:
    """Return the lines of a function within a band."""
    lines = lines_inside(transfer.frequency, band, "measured vehicle")
    return replace(transfer, frequency=transfer.frequency[lines], values=transfer.values[lines])


def _designs(model: Model, options: Options, context: RunContext | None) -> dict[str, RealArray]:
    """Return today's design and the picks by name, shape (k,) each."""
    robust = model.robust
    if options.front is not None:
        finished = compared_run(options.front, None)
        if finished.model.space.names != robust.space.names:
            raise InputError(
                f"run {options.front} has the variables {list(finished.model.space.names)}, this "
                f"study {list(robust.space.names)}: take a front of the same mounts and factors"
            )
        designs, picks = finished.designs, finished.front.picks
    else:
        search = options.search.searched(
            robust, seed=options.seed, run=context, inputs=model.inputs
        )
        designs = np.asarray(search.front.designs)
        judge = replicates(robust, VERIFICATION, seed=options.seed)
        picks = pick(verified(search.front, judge))
    named = {name: designs[row] for name, row in picks.items()}
    return {TODAY: np.asarray(robust.space.nominal), **named}


def _measure_again(model: Model, designs: Mapping[str, RealArray], options: Options) -> Repeated:
    """Draw all measurements, and those of each source alone."""
    uncertain, draws, seed = model.uncertain, options.draws, options.seed
    rows = np.stack(list(designs.values()))
    names = uncertain.data.names
    total = (1 + len(names)) * draws
    every, alone = [], {}
    with progress_bar("measuring again") as progress:
        for done, index in enumerate(uncertain.draws(draws, seed)):
            progress(done, total, "all errors")
            every.append(_drawn(model, index, rows))
        for place, name in enumerate(names, 1):
            levels = []
            for done, index in enumerate(uncertain.draws(draws, seed, [name])):
                progress(place * draws + done, total, name)
                levels.append(index(rows) / index.n_lines)
            alone[name] = np.stack(levels)
        progress(total, total, "done")
    fields = {
        name: np.stack([getattr(sample, name) for sample in every]) for name in vars(every[0])
    }
    measured = _drawn(model, uncertain.index, rows)
    expected = expected_or_why(
        uncertain.index, lambda: uncertain.expected_change(rows[1:], seed=seed)
    )
    return Repeated(
        uncertain=uncertain,
        every_case=model.every_case,
        designs=designs,
        measured=measured,
        again=Drawn(**fields),
        alone=alone,
        expected=expected,
        widths={}
        if isinstance(expected, str)
        else uncertain.widths_if_measured(rows[1:2], seed=seed),
    )


def _drawn(model: Model, index: Any, rows: RealArray) -> Drawn:
    """Ask one index for all designs."""
    n_lines = index.n_lines
    scattered = replace(model.robust, evaluate=index)(rows)
    if scattered.failed.any():
        raise InputError("a design could not be computed from data that were measured again")
    return Drawn(
        level=index(rows) / n_lines,
        loudest=index.levels(rows).max(axis=2),
        sigma=scattered.sigma / n_lines,
    )
