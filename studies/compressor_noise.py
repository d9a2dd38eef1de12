"""How loud is the running compressor at the driver's ear, by which mount and which hose?

As in the thesis (4.5, figures 65 and 66), the force of a mount is its stiffness times the relative
displacement of compressor and body. Noise transfer functions of six loads per mount turn forces
into sound. The study adds the motion of the body, single mounts with their uncertainty, hoses as
beams with six loads at each end, and bands. Without --car it measures a car of the shipped fleet in
a virtual laboratory, and compares the result with the microphone of that laboratory.
docs/validation.md has the errors of many cars and laboratories.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from typer import Option

from deboom.bench.choices import CalibrationLevel
from deboom.compressor.noise_comparison import measured_gain_table
from deboom.pages.compressor_noise import car_report
from deboom.progress import counted, progress_bar
from deboom.report import Report
from deboom.runs.compressor_tests import (
    NOISE_STEPS,
    NoisePlan,
    car_whose_hoses_add,
    noise_of_car,
    virtual_car,
)
from deboom.runs.options import BAND, Level, Seed, at_least, band_of


@dataclass(frozen=True)
class Options:
    """Which car is looked at, and what is modelled of it."""

    seed: Seed = 1
    level: Level = CalibrationLevel.C2
    car: Annotated[Path | None, Option(help="Folder with car.toml.")] = None
    band: Annotated[str, Option(metavar=BAND, help="Band of the analysis [Hz].")] = "20-140"
    hoses: Annotated[
        bool, Option(help="Identify the standard hoses and include them in the model.")
    ] = True
    draws: Annotated[int, Option(help="Number of draws for the bands.", callback=at_least(20))] = 64


def prepare(options: Options) -> NoisePlan:
    """Return what is done with the car."""
    band = band_of(options.band)
    return NoisePlan(band=band, with_hoses=options.hoses, draws=options.draws, seed=options.seed)


def run(plan: NoisePlan, options: Options) -> Report:
    """Measure or read a car, synthesise, compare and report."""
    with progress_bar("compressor noise") as bar:
        step = counted(bar, NOISE_STEPS)
        if options.car is not None:
            running, noise = noise_of_car(options.car, plan, step)
            return car_report(running, noise, None, running.car.input_files)
        running, noise = virtual_car(options.seed, options.level, plan, step)
    drawn = car_whose_hoses_add() if len(measured_gain_table(noise)) else None
    return car_report(running, noise, drawn)
