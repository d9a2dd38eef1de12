"""How stiff are the mounts in operation, and how far may the answer be believed?

Accelerometers on the powertrain and force cells under its mounts, in 27 runs with rising torque in
gears 5 to 7, become operating dynamic stiffness, response surfaces and an error budget. Without
--campaign the virtual test bench measures a campaign first, one per bench seed; its truth is used
for comparison alone.

Keys of summary.json, with <dir> such as TSM_x: r2_real_<dir>, r2_imag_<dir>, r2_force_real_<dir>,
r2_force_imag_<dir> [%] (surface against its own lines; with _held_out surfaces fitted without the
check runs against those); truth_error_percent_<dir> (rms error of |K| against the bench's truth,
median over benches; with _90 their 90 % quantile, with _held_out on held-out runs, with _stated
without self-calibration); half_width_95_percent_<dir> (error budget); coverage_95_percent_<dir>
(lines whose truth is inside the stated band); n_benches; n_identified (directions); seconds (one
mount set, with its error budget).
"""

from enum import Enum
from pathlib import Path
from typing import Annotated

from typer import Option

from deboom.errors import InputError
from deboom.mounts.characterisation import CharacteriseOptions
from deboom.mounts.cubic_fit import PieceOptions
from deboom.mounts.operating_map import Preload
from deboom.study.characterisation import characterise_benches, characterise_given
from deboom.study.characterisation_result import characterisation_result
from deboom.study.progress import progress_bar
from deboom.study.result import StudyResult
from deboom.study.runner import run_script

Variable = Enum("Variable", {"torque": "torque", "force": "force"})
PRELOADS = {Variable.torque: Preload.WHEEL_TORQUE, Variable.force: Preload.STATIC_FORCE}


def main(
    seed: Annotated[int, Option(help="From 1: first bench, and draws of the budget.")] = 1,
    benches: Annotated[int, Option(help="Virtual benches; medians deserve six.")] = 1,
    campaign: Annotated[Path | None, Option(help="Folder with campaign.toml.")] = None,
    mount_set: Annotated[str, Option(help="Parts on the bench.")] = "M1",
    preload: Annotated[Variable, Option(help="Wheel torque or static force.")] = Variable.torque,
    pieces: Annotated[int, Option(help="Cubics per surface; 0: cross-validated.")] = 2,
    low_gears: Annotated[bool, Option(help="Train on gears 3 and 4 as well.")] = False,
    self_calibration: Annotated[bool, Option(help="Let chains calibrate themselves.")] = True,
    noise_free: Annotated[bool, Option(help="Virtual benches without any error.")] = False,
) -> StudyResult:
    """Measure, characterise, compare and report."""
    options = CharacteriseOptions(
        gears=None if low_gears else (5, 6, 7),
        preload=PRELOADS[preload],
        pieces=PieceOptions(pieces=pieces or "cv"),
        self_calibration=self_calibration,
        seed=seed,
    )
    if campaign is not None and (benches > 1 or noise_free):
        raise InputError("--benches and --noise-free ask for virtual benches: leave out --campaign")
    with progress_bar("mount characterisation") as progress:
        if campaign is not None:
            given = characterise_given(campaign, mount_set, options, progress)
            return characterisation_result([given], given.input_files)
        seeds = range(seed, seed + benches)
        done = characterise_benches(seeds, mount_set, options, progress, noise_free=noise_free)
    return characterisation_result(done)


if __name__ == "__main__":
    run_script(__file__)
