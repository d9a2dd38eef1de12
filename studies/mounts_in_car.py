"""How stiff are the mounts, found in the car alone: without a test bench and without force cells?

Run-ups with accelerometers on both sides of every mount, and a hammer test of the body without its
powertrain that recorded those on the body, give the complex stiffness of each direction in every
run, with its 90 % interval, and the forces on the body. Directions that move too little are named
and not used. The run has a mount library and the load cases, from which `front` goes on. Without
--vehicle a virtual car is measured first. Its truth is used only for comparison.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from typer import Option

from deboom.pages.mounts_in_car import MeasuredInCar, mounts_in_car_report
from deboom.progress import progress_bar
from deboom.report import Report
from deboom.runs.campaigns import mounts_in_given_car, mounts_in_virtual_car
from deboom.runs.options import Seed


@dataclass(frozen=True)
class Options:
    """Which car."""

    seed: Seed = 1
    vehicle: Annotated[Path | None, Option(help="Folder with vehicle.toml.")] = None


def prepare(options: Options) -> MeasuredInCar:
    """Read or measure a car, and find the stiffness of its mounts."""
    with progress_bar("mounts in the car") as progress:
        if options.vehicle is not None:
            return mounts_in_given_car(options.vehicle, options.seed, progress)
        return mounts_in_virtual_car(options.seed, progress)


def run(measured: MeasuredInCar, options: Options) -> Report:  # noqa: ARG001
    """Report."""
    return mounts_in_car_report(measured)
