"""Which mounts make a refrigerant compressor quiet in a fleet of electric cars, scatter or not?

NSGA-II varies the stiffness of the mounts under a compressor. The objectives are two sums over the
cars: the mean level of the first order at the driver's ear, 20 to 140 Hz, and its sigma over
pieces, batches and mount positions. For every design the motion is solved again, with the
identified compressor and source and the measured bodies. No mount may travel more than --travel
times its travel today. Without --cars, five virtual cars are measured; docs/validation.md compares
the model with their exact solution.

Result with seed 1: radial stiffness matters most. 40 % less of it lowers the mean level by 3 dB and
sigma by 15 %, with 1.2 times the travel, but raises the peak at 24 Hz by 3 to 5 dB in every car.
Softer mounts mostly isolate better, so limit and bounds decide.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Annotated

import numpy as np
from typer import Option

from deboom.arrays import RealArray
from deboom.bench.choices import CalibrationLevel
from deboom.compressor.cabin_index import DATUM, MountVariables
from deboom.compressor.mounted_fleet import (
    MountedFleet,
    exact_change,
    mount_space,
    mounted_fleet,
    travel_limit,
)
from deboom.errors import InputError
from deboom.explore.choices import Pick
from deboom.explore.robust import Robust
from deboom.explore.scatter import sobol_sample
from deboom.explore.sensitivity import (
    SensitivityInputs,
    SobolIndices,
    fast_sobol_indices,
    sobol_designs,
)
from deboom.explore.space import DesignSpace
from deboom.files.design_limits import load_limits, read_level_limits
from deboom.pages.compressor_front import MountFront, mount_front_report
from deboom.progress import counted, progress_bar
from deboom.report import Report
from deboom.runs.compressor_fleet import measured_fleet, virtual_fleet
from deboom.runs.options import (
    BAND,
    AimOptions,
    Bounds,
    Checks,
    Level,
    Seed,
    at_least,
    band_of,
    robust_response,
)
from deboom.runs.result import RunContext, run_name
from deboom.runs.search import PeakRiseOption, SearchOptions, check_peak_rise, peak_rise_limits

STEPS = 8
"""Of `prepare`, for progress."""


class Parts(Enum):
    """What may be chosen."""

    identical = "identical"
    """One part number: one axial and one radial stiffness for all mounts."""
    separate = "own"
    """An axial and a radial stiffness for every mount."""


class Hoses(Enum):
    """What joins compressor and body besides the mounts."""

    none = "none"
    """Nothing."""
    identified = "identified"
    """The standard hoses, as beams identified from the first car's sweeps."""


@dataclass(frozen=True)
class Options:
    """Which cars, which mounts, what scatters, and for how long is searched."""

    seed: Seed = 1
    cars: Annotated[list[Path] | None, Option(help="Folder with car.toml; repeatable.")] = None
    fleet: Annotated[
        int | None, Option(help="Seed of a random virtual fleet; default: the shipped fleet.")
    ] = None
    level: Level = CalibrationLevel.C2
    parts: Annotated[
        Parts, Option(help="One part for all mounts, or a separate part for each mount.")
    ] = Parts.identical
    hoses: Annotated[Hoses, Option(help="Hoses as a path that the mounts do not change.")] = (
        Hoses.none
    )
    pressure: Annotated[
        list[str] | None, Option(help="Pressure of a sweep, as BAR or BAR=WEIGHT; repeatable.")
    ] = None
    band: Annotated[str, Option(metavar=BAND, help="Band whose lines count [Hz].")] = "20-140"
    line_step: Annotated[float, Option(help="Distance of the frequency lines [Hz].")] = 2.0
    reach: Bounds = 0.4
    travel: Annotated[
        float, Option(help="Largest allowed travel under 1 g, over today's travel [1].")
    ] = 1.2
    peak_rise: PeakRiseOption = None
    limits: Annotated[
        Path | None, Option(help="TOML file with limits of the levels of cars, [[level]].")
    ] = None
    aims: AimOptions = AimOptions()
    tolerance: Annotated[
        float, Option(help="Half width of the scatter of a mount's stiffness, 3 sigma [1].")
    ] = 0.15
    batch: Annotated[float, Option(help="Share of the batch in the variance of stiffness [1].")] = (
        0.5
    )
    place_tolerance: Annotated[
        float, Option(help="Half width of the scatter of mount coordinates, 3 sigma [mm].")
    ] = 1.0
    search: SearchOptions = SearchOptions(generations=20, population=24)
    samples: Annotated[
        int,
        Option(
            help="Number of draws per design, a power of two.",
            callback=at_least(8, power_of_two=True),
        ),
    ] = 32
    checks: Checks = 128
    n: Annotated[
        int,
        Option(
            help="Number of base points of the Sobol indices, a power of two.",
            callback=at_least(8, power_of_two=True),
        ),
    ] = 256

    def __post_init__(self) -> None:
        if not 0 < self.reach < 1:
            raise InputError(f"--reach {self.reach:g}: factors run within 1 ± reach, below 1")
        if not 0 < self.tolerance < 1 or not 0 <= self.batch <= 1:
            raise InputError("tolerance and share of the batch lie between 0 and 1")
        if not 0 <= self.place_tolerance < DATUM:
            raise InputError(
                f"--place-tolerance {self.place_tolerance:g}: mounts are placed to some millimetres"
            )
        if not self.line_step > 0:
            raise InputError(f"--line-step {self.line_step:g}: give a step above 0 Hz")
        check_peak_rise(self.peak_rise)
        if not self.travel > 0:
            raise InputError(f"--travel {self.travel:g}: give a ratio above 0, such as 1.2")

    @property
    def identical(self) -> bool:
        """Whether all mounts are of one part number."""
        return self.parts is Parts.identical

    @property
    def lines(self) -> RealArray:
        """Of the band [Hz]."""
        low, high = band_of(self.band)
        return np.arange(low, high + 1e-6 * high, self.line_step)

    @property
    def weights(self) -> dict[str, float]:
        """Weight of each pressure asked for, such as ``7.5 bar`` → 1; empty for all alike [1]."""
        chosen: dict[str, float] = {}
        for request in self.pressure or ():
            text, _, weight = request.partition("=")
            try:
                name, share = f"{float(text):g} bar", float(weight or 1)
            except ValueError:
                name, share = "", 0.0
            if not 0 < share < float("inf") or name in chosen:
                raise InputError(
                    f"--pressure {request}: write each pressure once, as BAR or BAR=WEIGHT with a "
                    "weight above 0, such as 7.5=2"
                )
            chosen[name] = share
        return chosen


def design_space(variables: MountVariables, options: Options) -> DesignSpace:
    """Return the design space that the options ask for."""
    return mount_space(
        variables,
        reach=options.reach,
        tolerance=options.tolerance,
        batch=options.batch,
        place_tolerance=options.place_tolerance,
    )


@dataclass(frozen=True, eq=False)
class Model:
    """The cars on a compressor's mounts, and their levels under scatter."""

    mounted: MountedFleet
    robust: Robust


def prepare(options: Options) -> Model:
    """Measure or read the cars, identify them, and build the model of their mounts."""
    if options.limits and load_limits(options.limits).of_mounts:
        raise InputError(
            f"{options.limits}: here only levels are limited, [[level]]: leave the others out, and "
            "limit the travel with --travel"
        )
    lines, weights = options.lines, options.weights
    with progress_bar("compressor mounts") as bar:
        step = counted(bar, STEPS)
        step("cars")
        if options.cars:
            fleet = measured_fleet(options.cars)
        else:
            fleet = virtual_fleet(options.seed, options.level, options.fleet)
        mounted = mounted_fleet(
            fleet,
            lines,
            weights,
            step,
            identical=options.identical,
            with_hoses=options.hoses is Hoses.identified,
            places=options.place_tolerance > 0,
        )
    space = design_space(mounted.index.variables, options)
    if options.checks < space.n_variables + 2:
        raise InputError(
            f"--checks {options.checks}: a verification of {space.n_variables} variables that "
            f"scatter needs at least {space.n_variables + 2} draws"
        )
    sample = sobol_sample(space.n_variables, options.samples, seed=options.seed)
    limits = (
        *read_level_limits(options.limits, mounted.index),
        travel_limit(mounted, space, options.travel),
        *peak_rise_limits(options.peak_rise, mounted.index, space.nominal),
    )
    robust = robust_response(mounted.index, space, sample, aims=options.aims, limits=limits)
    return Model(mounted, robust)


def run(prepared: Model, options: Options, context: RunContext | None = None) -> Report:
    """Search, verify, find out what matters, and report."""
    model, robust, seed = prepared.mounted, prepared.robust, options.seed
    space = robust.space
    of_limits = [options.limits] if options.limits else []
    front = options.search.front(
        robust,
        seed=seed,
        run=context,
        inputs=(*model.fleet.inputs, *of_limits),
        verified_with=options.checks,
    )
    nominal, best = space.nominal, front.pick_designs[Pick.best_mean]
    view = MountFront(
        front=front,
        model=model,
        sobol=stiffness_sobol(model, space, options.n, seed=seed),
        exact=exact_change(model, nominal, best),
        band=band_of(options.band),
        identical=options.identical,
        tolerance=options.tolerance,
        place_tolerance=options.place_tolerance,
        allowed_travel=options.travel,
    )
    report = mount_front_report(view, run_name(context, "compressor_front"))
    report.inputs += of_limits
    return report


def stiffness_sobol(model: MountedFleet, space: DesignSpace, n: int, *, seed: int) -> SobolIndices:
    """Return first and total indices of the chosen stiffnesses, from n base points."""
    columns = np.flatnonzero(space.upper > space.lower)
    names = tuple(space.names[column] for column in columns)
    inputs = SensitivityInputs(names, space.lower[columns], space.upper[columns])
    chosen = sobol_designs(inputs, n, seed=seed)
    designs = np.tile(space.nominal, (len(chosen), 1))
    designs[:, columns] = chosen
    outputs = model.index.response_names
    return fast_sobol_indices(model.index(designs), names, outputs, seed=seed)
