"""Which mounts make a refrigerant compressor quiet in a fleet of electric cars, scatter or not?

NSGA-II over the stiffness of the mounts under a compressor: sums over the cars of the mean level of
its first order at the driver's ear, 20 to 140 Hz, and of its sigma over pieces, batches and places.
The motion is solved anew for every design: identified compressor and source, measured bodies. No
mount may travel further than --travel times today's. Without --cars, five virtual cars are measured
in memory and the model is compared with their exact solution.

What it showed (seed 1): radial stiffness rules; -40 % of it takes 3 dB off on average and 15 % off
sigma at 1.2 times the travel. Limit and bounds decide: softer mounts mostly isolate better.

Keys of summary.json, best mean against today: level_change_db_<car>, mean_change_db (of cars),
sigma_change_percent_best_mean|best_sigma; leading_stiffness (largest mean Sobol index,
leading_total_index); travel_ratio, travel_limit_reached, at_bound (variables there);
rigid_holders_median_db|p90_db (of lines, if holders stood still); virtual cars only:
peak_error_median_db|p90_db (model - exact level), change_error_rms_db (of the mean level),
exact_mean_change_db; sigma_bias_percent, mean_bias_db (search - verification); n_front,
n_evaluated, n_failed.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from typer import Option

from deboom.choices import CalibrationLevel
from deboom.explore.workers import workers_for
from deboom.report import Report
from deboom.study.compressor_robust_front import (
    STEPS,
    FrontBudget,
    Hoses,
    MountedFleet,
    MountQuestion,
    Parts,
    compressor_front,
    compressor_front_report,
    measured_fleet,
    mounted_fleet,
    virtual_fleet,
    weighted_pressures,
)
from deboom.study.options import Seed, band_of
from deboom.study.progress import counted, progress_bar
from deboom.study.result import RunContext
from deboom.study.search import SearchOptions


@dataclass(frozen=True)
class Options:
    """Which cars, which mounts, what scatters, and for how long is searched."""

    seed: Seed = 1
    cars: Annotated[list[Path] | None, Option(help="Folder with car.toml; repeatable.")] = None
    fleet: Annotated[int | None, Option(help="Seed of a drawn virtual fleet.")] = None
    level: Annotated[CalibrationLevel, Option(help="Of the laboratory.")] = CalibrationLevel.C2
    parts: Annotated[Parts, Option(help="One part for all mounts, or own ones.")] = Parts.identical
    hoses: Annotated[Hoses, Option(help="Another path, which mounts do not change.")] = Hoses.none
    pressure: Annotated[list[str] | None, Option(help="BAR or BAR=WEIGHT; repeatable.")] = None
    band: Annotated[str, Option(help="Lines that count, LOW-HIGH [Hz].")] = "20-140"
    line_step: Annotated[float, Option(help="Between lines [Hz].")] = 2.0
    reach: Annotated[float, Option(help="Stiffness factors run within 1 ± reach [1].")] = 0.4
    travel: Annotated[float, Option(help="Largest travel under 1 g, over today's [1].")] = 1.2
    tolerance: Annotated[float, Option(help="Of a piece's stiffness, 3 sigma [1].")] = 0.15
    batch: Annotated[float, Option(help="Share of the batch in its variance [1].")] = 0.5
    place_tolerance: Annotated[float, Option(help="Of coordinates, 3 sigma [mm].")] = 1.0
    search: SearchOptions = SearchOptions(generations=20, population=24)
    samples: Annotated[int, Option(help="Draws per design; a power of two.")] = 32
    checks: Annotated[int, Option(help="Draws of the verification.")] = 128
    n: Annotated[int, Option(help="Base points of Sobol; a power of two.")] = 256


def prepare(options: Options) -> MountedFleet:
    """Measure or read the cars, identify them, and build the model of their mounts."""
    question = MountQuestion(
        options.parts,
        options.hoses,
        band_of(options.band),
        options.line_step,
        weighted_pressures(options.pressure),
        options.reach,
        options.tolerance,
        options.batch,
        options.place_tolerance,
    )
    with progress_bar("compressor mounts") as bar:
        step = counted(bar, STEPS)
        step("cars")
        if options.cars:
            measured = measured_fleet(options.cars)
        else:
            measured = virtual_fleet(options.seed, options.level, options.fleet)
        return mounted_fleet(measured, question, step)


def run(model: MountedFleet, options: Options, context: RunContext | None = None) -> Report:
    """Search, verify and report."""
    search = options.search
    budget = FrontBudget(
        search.population,
        search.generations,
        options.samples,
        options.checks,
        options.n,
        options.travel,
    )
    with progress_bar("NSGA-II") as bar:
        found = compressor_front(
            model,
            budget,
            options.seed,
            bar,
            context,
            lambda robust: workers_for(robust, search.workers, search.scheduler),
        )
    return compressor_front_report(found)
