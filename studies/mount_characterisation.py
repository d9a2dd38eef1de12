"""How stiff are the mounts in operation, and how far may the answer be believed?

Accelerometers on the powertrain and force cells under its mounts, in 27 runs with rising torque in
gears 5 to 7, become operating dynamic stiffness, response surfaces and an error budget. Without
--campaign the virtual test bench measures a campaign first, one per bench seed; its truth is used
for comparison alone.

What it showed on six virtual benches: x and z are identified, with a true error of at most 2.1 %
rms (median bench). The y stiffnesses of the three powertrain mounts are not: half a degree of
misalignment hides them.

Keys of summary.json, with <dir> such as TSM_x: r2_real_<dir>, r2_imag_<dir>, r2_force_real_<dir>,
r2_force_imag_<dir> [%] (surface against its own lines; with _held_out surfaces fitted without the
check runs against those); truth_error_percent_<dir> (rms error of |K| against the bench's truth,
median over benches; with _90 their 90 % quantile, with _held_out on held-out runs, with _stated
without self-calibration); half_width_95_percent_<dir> (error budget); coverage_95_percent_<dir>
(lines whose truth is inside the stated band); moments_cost_at_peaks_db, moments_cost_rms_db (with
--third-cell: largest change of level in any vehicle without moments); n_benches; n_identified
(directions); seconds (one mount set, with its error budget).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated

from typer import Option

from deboom.errors import InputError
from deboom.mounts.characterise import CharacteriseOptions
from deboom.mounts.operating_map import Preload
from deboom.mounts.piecewise_cubic import PiecewiseCubicRegressor
from deboom.report import Report
from deboom.study.mount_characterisation import (
    MeasuredSo,
    characterisation_result,
    characterise_benches,
    characterise_given,
)
from deboom.study.options import Seed
from deboom.study.platform_model import DEMONSTRATION
from deboom.study.progress import progress_bar
from deboom.study.result import RunContext

FIGURES = True
"""Whether the report has pictures."""


@dataclass(frozen=True)
class Options:
    """Which mounts are characterised, and how."""

    seed: Seed = 1
    benches: Annotated[int, Option(help="Virtual benches; medians deserve six.")] = 1
    campaign: Annotated[Path | None, Option(help="Folder with campaign.toml.")] = None
    mount_set: Annotated[str, Option(help="Parts on the bench.")] = "M1"
    static_force: Annotated[bool, Option(help="As preload, not the wheel torque.")] = False
    pieces: Annotated[int, Option(help="Cubics per surface.")] = 2
    all_gears: Annotated[bool, Option(help="Gears 3-7 beside, cross-validated pieces.")] = False
    models: Annotated[bool, Option(help="Other models of the stiffness beside.")] = False
    self_calibration: Annotated[bool, Option(help="Let chains calibrate themselves.")] = True
    noise_free: Annotated[bool, Option(help="Virtual benches without any error.")] = False
    third_cell: Annotated[bool, Option(help="Virtual benches that measure moments.")] = False
    platform: Annotated[Path, Option(help="Its vehicles judge moments left out.")] = DEMONSTRATION

    def __post_init__(self) -> None:
        virtual = self.benches > 1 or self.noise_free or self.third_cell
        if self.campaign is not None and virtual:
            raise InputError("--benches, --noise-free, --third-cell: leave them out, or --campaign")


def prepare(options: Options) -> CharacteriseOptions:
    """Return how mounts are characterised."""
    return CharacteriseOptions(
        preload=Preload.STATIC_FORCE if options.static_force else Preload.WHEEL_TORQUE,
        regressor=PiecewiseCubicRegressor(pieces=options.pieces),
        self_calibration=options.self_calibration,
        seed=options.seed,
    )


def run(how: CharacteriseOptions, options: Options, context: RunContext | None = None) -> Report:  # noqa: ARG001
    """Measure, characterise, compare and report."""
    result = partial(
        characterisation_result,
        all_gears=options.all_gears,
        models=options.models,
        with_figures=FIGURES,
        platform=options.platform,
    )
    measured = MeasuredSo(options.all_gears, options.noise_free, options.third_cell)
    with progress_bar("mount characterisation") as progress:
        if options.campaign is not None:
            given = characterise_given(options.campaign, options.mount_set, how, progress)
            return result([given], given.input_files).report()
        seeds = range(options.seed, options.seed + options.benches)
        benches = characterise_benches(seeds, options.mount_set, how, progress, measured)
    return result(benches).report()
