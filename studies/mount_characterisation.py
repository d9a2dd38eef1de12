"""How stiff are the mounts in operation, and how reliable is the answer?

Accelerometers on the powertrain and force cells under its mounts, in 27 runs with rising torque in
gears 5 to 7, give operating dynamic stiffness, response surfaces and an error budget. Without
--campaign the virtual test bench first measures a campaign. Its truth is used only for comparison.

The example plot_second_engine tests whether these mounts predict the forces of another engine.

What it showed on six virtual benches: x and z are identified, with a true error of at most 2.1 %
rms (median bench). The y stiffnesses of the three powertrain mounts are not, because a misalignment
of half a degree hides them.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from typer import Option

from deboom.errors import InputError
from deboom.mounts.characterise import CharacteriseOptions
from deboom.mounts.characterised_bench import model_table
from deboom.mounts.operating_map import Preload
from deboom.mounts.piecewise_cubic import PiecewiseCubicRegressor
from deboom.pages.mount_characterisation import characterisation_report
from deboom.progress import progress_bar
from deboom.report import Report
from deboom.runs.campaigns import characterise_given, characterise_virtual
from deboom.runs.options import CubicPieces, MountSet, Seed, SelfCalibration


@dataclass(frozen=True)
class Options:
    """Which mounts are characterised, and how."""

    seed: Seed = 1
    campaign: Annotated[Path | None, Option(help="Folder with campaign.toml.")] = None
    mount_set: MountSet = "M1"
    static_force: Annotated[
        bool, Option(help="Use the static force as preload, not the wheel torque.")
    ] = False
    pieces: CubicPieces = 2
    models: Annotated[bool, Option(help="Also compare other models of the stiffness.")] = False
    self_calibration: SelfCalibration = True
    noise_free: Annotated[bool, Option(help="Use virtual benches without errors.")] = False

    def __post_init__(self) -> None:
        if self.campaign is not None and self.noise_free:
            raise InputError(
                "--noise-free asks for a virtual bench: leave it out, or leave --campaign out"
            )


def prepare(options: Options) -> CharacteriseOptions:
    """Return how mounts are characterised."""
    return CharacteriseOptions(
        preload=Preload.STATIC_FORCE if options.static_force else Preload.WHEEL_TORQUE,
        regressor=PiecewiseCubicRegressor(pieces=options.pieces),
        self_calibration=options.self_calibration,
        seed=options.seed,
    )


def run(how: CharacteriseOptions, options: Options) -> Report:
    """Measure or read a campaign, characterise, compare and report."""
    with progress_bar("mount characterisation") as progress:
        if options.campaign is not None:
            bench = characterise_given(options.campaign, options.mount_set, how, progress)
            inputs = bench.input_files
        else:
            bench = characterise_virtual(
                options.seed, options.mount_set, how, progress, noise_free=options.noise_free
            )
            inputs = ()  # its files do not stay
        models = model_table(bench) if options.models else None
        return characterisation_report(bench, models, inputs)
