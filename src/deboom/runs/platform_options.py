"""From the options of a study to the booming model of a platform."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated

from typer import Option

from deboom.errors import InputError
from deboom.files.platform import DEMONSTRATION, read_platform
from deboom.pages.motion import PART_WARNING
from deboom.runs.options import BAND
from deboom.vehicles.booming_model import BoomingModel, Motion
from deboom.vehicles.design_factor import Factor
from deboom.vehicles.fleet import Fleet
from deboom.vehicles.platform import MountSource, Runs

DEMONSTRATED = "U06"
"""Its group of vehicles that studies serve."""
ALL = "all"
"""All groups of a platform, as --group has it."""
BAND_DEFAULT = "20 60; all lines of data that miss 20 or 60 by a line or more"


@dataclass(frozen=True)
class PlatformOptions:
    """Options of a study: whose noise, in which runs, and where the forces come from.

    Of the groups None means all, and no group the one that the platform was made for.
    """

    load_case: Annotated[
        list[str] | None, Option(help="Load case, as NAME or NAME=WEIGHT; repeatable.")
    ] = None
    group: Annotated[
        list[str] | None,
        Option(
            help=f"Group of vehicles; repeatable; '{ALL}' takes all vehicles.",
            show_default=f"{DEMONSTRATED}, or the only one",
        ),
    ] = field(default_factory=list)
    platform: Annotated[
        Path,
        Option(
            hidden=True,  # typed by its place
            help="Folder with platform.toml; default: u06, the demonstration.",
        ),
    ] = DEMONSTRATION
    band: Annotated[
        tuple[float, float] | None,
        Option(metavar=BAND, help="Band whose lines count [Hz].", show_default=BAND_DEFAULT),
    ] = None
    mounts: Annotated[
        MountSource,
        Option(help="Source of the mount stiffnesses: mount library or operating spectra."),
    ] = MountSource.library

    def runs(self) -> Runs:
        """Read the platform and look up the runs; see `deboom.vehicles.platform.Platform.runs`."""
        platform = read_platform(self.platform)
        fleet = self.served(platform.fleet)
        return platform.runs(self.load_case, fleet=fleet, mounts=self.mounts, band=self.band)

    def served(self, fleet: Fleet) -> Fleet:
        """Return the vehicles of the groups; of a platform with one group all, by default."""
        single = len({vehicle.group for vehicle in fleet.vehicles}) == 1
        if self.group is None or ALL in self.group or (single and not self.group):
            return fleet
        return fleet.group(*(self.group or [DEMONSTRATED]))


MOTION_DEFAULT = "coupled; prescribed where the data do not allow it"


@dataclass(frozen=True)
class MotionOptions:
    """Options of a study: how the powertrain answers, and what a stiffness factor means."""

    motion: Annotated[
        Motion | None,
        Option(
            help="Motion of the powertrain: as measured, or solved again for each design.",
            show_default=MOTION_DEFAULT,
        ),
    ] = None
    factor: Annotated[
        Factor,
        Option(
            help="Meaning of a stiffness factor: dynamic stiffness, or rubber with its "
            "static curve."
        ),
    ] = Factor.dynamic

    def model(self, runs: Runs, *, loss_factors: bool = False) -> BoomingModel:
        """Build the booming model of the runs; the warning that ``part`` needs is printed."""
        model = runs.model(self.motion, self.factor, loss_factors=loss_factors)
        if self.factor is Factor.part:
            print(PART_WARNING, file=sys.stderr)
        return model


def in_all_load_cases(
    platform: PlatformOptions, runs: Runs, motion: MotionOptions, *, loss_factors: bool = False
) -> BoomingModel | None:
    """Return the model of a study in all load cases; None where their data do not allow it."""
    names = [case.name for case in runs.platform.load_cases]
    source = platform.mounts
    if source is MountSource.library:
        source = MountSource.library_inside
    try:
        every = replace(platform, load_case=names, mounts=source).runs()
        return motion.model(replace(every, fleet=runs.fleet), loss_factors=loss_factors)
    except InputError:
        return None
