"""How loud is the running compressor at the driver's ear, by which mount and which hose?

Thesis, 4.5 (figures 65 and 66): forces of the mounts are stiffness times what compressor and body
move apart, noise transfer functions at six loads per mount make sound of them. Beyond it: motion of
the body, single mounts with their uncertainty, hoses as beams with six loads at each end, bands.
Without --car, laboratories measure cars of the frozen fleet: the first one is shown in detail, all
are compared with the bench's own microphone; the gain by hoses comes from fleets drawn from their
prior. See docs/validation.md for figures.

Keys of summary.json, levels [dB], all cars and laboratories. Gain by hoses, A-weighted energy of
90–140 Hz: hose_gain_db_90_140 (median), …_p10, …_p90; hose_gain_as_in_thesis_percent (of cars
within its 5–10 dB), hose_quieter_percent, n_fleets. At measured peaks, synthesised against
measured: spl_peak_deviation_db (largest, soft hoses, outside 25–35 Hz), …_25_35 (there),
…_with_hoses (standard hoses modelled, 90–140 Hz), …_by_mounts (hoses left out, there), each with
…_median and n_peaks…; n_peaks_without_partner. Lines at 90–140 Hz with standard hoses:
spl_90_140_median_db_with_hoses|by_mounts, spl_90_140_p90_db_…, spl_90_140_energy_db_… (worst sweep,
energy of the band). measured_gain_db_90_140 (standard against soft hoses, median of these cars),
measured_gain_error_db_90_140 (largest, of the synthesis). still_body_error_db_median|p90 (motion of
the body left out), predicted_body_error_db_p90 (predicted instead of measured),
lines_in_band_percent (louder lines within the 90 % band), identical_mounts, n_alarms, seconds (from
files to result, longest car, one processor). No keys where there is no peak.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from typer import Option

from deboom.choices import CalibrationLevel
from deboom.report import Report
from deboom.study.compressor_noise import (
    STEPS,
    NoisePlan,
    fleet_gains,
    noise_of_car,
    noise_report,
    virtual_cars,
)
from deboom.study.options import Seed, band_of
from deboom.study.progress import counted, progress_bar
from deboom.study.result import RunContext

FIGURES = True
"""Whether the report has pictures."""


@dataclass(frozen=True)
class Options:
    """Which cars are looked at, and what is modelled of them."""

    seed: Seed = 1
    laboratories: Annotated[int, Option(help="Virtual ones; each has its own errors.")] = 2
    cars: Annotated[int, Option(help="Of the frozen fleet, EV-1 to EV-5.")] = 5
    fleets: Annotated[int, Option(help="Drawn for the gain by hoses; it deserves 50.")] = 60
    level: Annotated[
        CalibrationLevel, Option(help="How well sensors are calibrated and placed.")
    ] = CalibrationLevel.C2
    car: Annotated[Path | None, Option(help="Folder with car.toml.")] = None
    band: Annotated[str, Option(help="Lines that are looked at, such as 20-140 [Hz].")] = "20-140"
    hoses: Annotated[bool, Option(help="Identify and model standard hoses.")] = True
    draws: Annotated[int, Option(help="For the bands.")] = 64
    workers: Annotated[int, Option(help="Processes beside this one; same result.")] = 1


def prepare(options: Options) -> NoisePlan:
    """Return what is done with every car."""
    band = band_of(options.band)
    return NoisePlan(band=band, with_hoses=options.hoses, draws=options.draws, seed=options.seed)


def run(plan: NoisePlan, options: Options, context: RunContext | None = None) -> Report:  # noqa: ARG001
    """Measure or read cars, synthesise, compare and report."""
    with progress_bar("compressor noise") as progress:
        if options.car is not None:
            given = noise_of_car(options.car, plan, counted(progress, STEPS))
            inputs = given.there.car.input_files
            return noise_report(given, inputs, figures=FIGURES)
        seeds = range(options.seed, options.seed + options.laboratories)
        cars = virtual_cars(
            options.cars, seeds, options.level, plan, progress, workers=options.workers
        )
        gains = fleet_gains(options.fleets)
        return noise_report(cars.first, cars=cars, gains=gains, figures=FIGURES)
