"""How well does sound that is synthesised from forces of the bench agree with the measured sound?

The study multiplies bench forces by noise transfer functions and compares the result with the
microphone of the driven vehicle (thesis, 3.6 and 3.7), for every vehicle with every mount set. Then
it tests each step alone: forces from response surfaces, a virtual design of separately
characterised parts (with three ways to its motion), hammer against loudspeaker, blocked against
interface forces, and the modes of the body. Without --vehicle the virtual bench measures
everything, with the car on its flexible body. For your own car give --vehicle, repeated for more
vehicles, and the --campaign of the bench on which its mounts were measured.

If the hammer test recorded the accelerometers on the body, its receptance turns blocked forces into
interface forces, and the road says how stiff the mounts are in the car. On twenty benches with
drawn powertrains, five kinds of bodies, and rubber that is softer or harder in the car, corr_f is
2.2 % in the median (largest 20.3), corr_s 5.6 % (13.1), booming peaks agree within 1.1 dB (6.2),
and forces within 7.9 % (25.1). With blocked forces the medians are 32.5 %, 26.6 %, 5.0 dB and 49.4
%.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from typer import Option

from deboom.errors import InputError
from deboom.pages.synthesis_validation import synthesis_report
from deboom.progress import progress_bar
from deboom.report import Report
from deboom.runs.campaigns import given_vehicles, virtual_vehicles
from deboom.runs.options import BAND, Seed, at_least
from deboom.vehicles.synthesis import DrivenVehicles, Listening, validate


@dataclass(frozen=True)
class Options:
    """Which vehicles, on which mounts, and where their sound is compared."""

    seed: Seed = 1
    vehicles: Annotated[
        int, Option(help="Number of virtual vehicles of one group, 1 to 5.", callback=at_least(1))
    ] = 5
    mount_sets: Annotated[
        int,
        Option(
            help="Number of virtual mount sets, at least 2; a mixed set is added.",
            callback=at_least(2),
        ),
    ] = 5
    load_case: Annotated[str, Option(help="Run of the vehicles, at full load.")] = "g5_wot220"
    vehicle: Annotated[list[Path] | None, Option(help="Folder of a measured vehicle.")] = None
    campaign: Annotated[
        Path | None, Option(help="Campaign folder of the mounts of this vehicle.")
    ] = None
    mount_set: Annotated[
        str, Option(help="Mount set of the measured vehicle, as named in the campaign.")
    ] = "M1"
    ear: Annotated[str, Option(help="Ear at which the sound is compared.")] = "driver ear"
    band: Annotated[
        tuple[float, float], Option(metavar=BAND, help="Band in which the sound is compared [Hz].")
    ] = (
        20.0,
        55.0,
    )

    def __post_init__(self) -> None:
        if (self.vehicle is None) != (self.campaign is None):
            raise InputError("a measured vehicle needs --vehicle and --campaign, its bench")


def prepare(options: Options) -> DrivenVehicles:
    """Measure on the virtual bench and in virtual vehicles, or read what was measured."""
    with progress_bar("synthesis") as progress:
        if options.campaign is not None:
            folders, parts = options.vehicle or [], options.mount_set
            return given_vehicles(options.campaign, folders, parts, options.load_case, progress)
        counts = (options.vehicles, options.mount_sets)
        return virtual_vehicles(options.seed, *counts, options.load_case, progress)


def run(model: DrivenVehicles, options: Options) -> Report:
    """Synthesise, compare, and report."""
    return synthesis_report(model, validate(model, Listening(options.ear, options.band)))
