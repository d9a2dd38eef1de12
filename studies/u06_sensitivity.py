"""On which mount stiffnesses does the booming noise of the U06 vehicles depend?

Sobol indices of the stiffness factors (the thesis's figure 48): the share of the variance of a
vehicle's level, 20 to 60 Hz, that each is behind, alone, coupled with others, mount by mount, and
line by line. Two analyses: design (uniform within a range, by default 15 %, with 20 % beside it)
and tolerance (gaussian, cut at 3 sigma). Ranked is the sum of decibels (SPLV) or the energy level;
what is not ranked stands beside it.

On the virtual platform TSM x leads in U06-1 to U06-4, before Du x; in U06-5, the one with the
battery, GeM x leads before TSM x; of the energy, which follows the loud lines, TSM x leads there
too. Du y and z have no path to the cabin and come out as exactly 0.

Keys of summary.json: st_<variable>_<vehicle> such as st_TSM_x_U06-1 (total index), and
st_mount_<mount>_<vehicle>; largest_interval (half width, 95 %), largest_interaction (total minus
first order), n_zero (indices not above their interval), n_runs (designs evaluated),
surface_difference_at_peaks_db (library against spectra).
"""

from pathlib import Path
from typing import Annotated

from typer import Option

from deboom.files.platform import read_platform
from deboom.report import Report
from deboom.study.platform_model import Factor, Motion, MountSource, motion_index, operation
from deboom.study.progress import progress_bar
from deboom.study.runner import run_script
from deboom.study.sensitivity import (
    Analysis,
    Ranked,
    SensitivityPlan,
    sensitivity,
    sensitivity_result,
)

PLATFORM = Path(__file__).parent / "data" / "u06_f39_f45"


def main(
    seed: Annotated[int, Option(help="From 1; the same seed gives the same indices.")] = 1,
    n: Annotated[int, Option(help="Base points; a power of two.")] = 1024,
    resamples: Annotated[int, Option(help="Bootstrap resamples of the intervals.")] = 100,
    analysis: Annotated[Analysis, Option(help="Chosen or scattering.")] = Analysis.design,
    ranked: Annotated[Ranked, Option(help="What of the levels.")] = Ranked.decibels,
    half_width: Annotated[float, Option(help="Range of the design analysis [1].")] = 0.15,
    beside: Annotated[float, Option(help="Another range, beside it [1].")] = 0.20,
    tolerance: Annotated[float, Option(help="Half width of the scatter, 3 sigma [1].")] = 0.15,
    load_case: Annotated[list[str] | None, Option(help="name or name=weight; repeatable.")] = None,
    group: Annotated[str, Option(help="Vehicles to listen in.")] = "U06",
    platform: Annotated[Path, Option(help="Folder with platform.toml.")] = PLATFORM,
    mounts: Annotated[MountSource, Option(help="Source of forces.")] = MountSource.library,
    motion: Annotated[Motion, Option(help="Of the powertrain.")] = Motion.prescribed,
    factor: Annotated[Factor, Option(help="What a stiffness factor means.")] = Factor.dynamic,
) -> Report:
    """Evaluate, analyse and report."""
    runs = operation(read_platform(platform), load_case, mounts, group, band=(20, 60))
    index = motion_index(runs, motion, factor)
    plan = SensitivityPlan(
        analysis, ranked, half_width, beside, tolerance, n_base=n, n_resamples=resamples, seed=seed
    )
    with progress_bar("sensitivity") as bar:
        found = sensitivity(runs.platform, index, plan, bar)
    return runs.checked(sensitivity_result(found))


if __name__ == "__main__":
    run_script(__file__)
