"""How far is the sound synthesised from the bench's forces from the one measured in the vehicle?

Bench forces times noise transfer functions against the microphone of the driven vehicle (thesis,
3.6 and 3.7): every vehicle with every mount set. Then each step alone: forces from response
surfaces, a virtual design of parts that were characterised apart (three ways to its motion),
hammer against loudspeaker, blocked against interface forces, and the modes of the body. Without
--vehicle the virtual bench measures all of it, the car on its flexible body. A user names a
vehicle's folder (again for more vehicles) and the campaign of the bench its mounts were on.

What it showed in two fleets: shape (corr_f), surfaces and virtual design as asked, scale (corr_s)
at the limit of 15 %, and 7 of 50 cars with a peak beyond 3 dB. Most of it is the price of blocked
forces with the functions of a trimmed body, little that of the functions' errors.

Keys of summary.json: corr_f_percent (complex pressure, median over vehicles and mount sets),
corr_s_percent (magnitude, median), peak_deviation_db (largest of the paired booming peaks),
virtual_design_peak_db (largest, all three ways; where the campaign has a mix), mode_<n>_hz and
mode_<n>_mac, n from 1 to 5 (first vehicle; MAC where the true shapes are known).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from typer import Option

from deboom.errors import InputError
from deboom.report import Report
from deboom.study.options import Seed
from deboom.study.progress import progress_bar
from deboom.study.result import RunContext
from deboom.study.synthesis_validation import (
    ValidationData,
    given_data,
    synthesis_validation_result,
    virtual_data,
)

FIGURES = True
"""Whether the report has pictures."""


@dataclass(frozen=True)
class Options:
    """Which vehicles, on which mounts, and where their sound is compared."""

    seed: Seed = 1
    vehicles: Annotated[int, Option(help="Virtual vehicles of one drawing, 1 to 5.")] = 5
    mount_sets: Annotated[int, Option(help="Virtual mount sets, at least 2; and a mix.")] = 5
    load_case: Annotated[str, Option(help="Run of the vehicles; full load.")] = "g5_wot220"
    vehicle: Annotated[list[Path] | None, Option(help="Folder of a measured vehicle.")] = None
    campaign: Annotated[Path | None, Option(help="Bench campaign of its mounts.")] = None
    mount_set: Annotated[str, Option(help="The measured vehicle's, in the campaign.")] = "M1"
    ear: Annotated[str, Option(help="Where the sound is compared.")] = "driver ear"
    band: Annotated[tuple[float, float], Option(help="Lines to compare [Hz].")] = (20.0, 55.0)

    def __post_init__(self) -> None:
        if (self.vehicle is None) != (self.campaign is None):
            raise InputError("a measured vehicle needs --vehicle and --campaign, its bench")


def prepare(options: Options) -> ValidationData:
    """Measure on the virtual bench and in virtual vehicles, or read what was measured."""
    load_case = options.load_case
    with progress_bar("synthesis") as progress:
        if options.campaign is not None:
            vehicles = options.vehicle or []
            return given_data(options.campaign, vehicles, options.mount_set, load_case, progress)
        counts = (options.vehicles, options.mount_sets)
        return virtual_data(options.seed, *counts, load_case, progress)


def run(data: ValidationData, options: Options, context: RunContext | None = None) -> Report:  # noqa: ARG001
    """Synthesise, compare, and report."""
    return synthesis_validation_result(
        data, options.ear, options.band, with_figures=FIGURES
    ).report()
