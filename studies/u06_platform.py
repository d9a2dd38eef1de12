"""What does one platform tell, from a first look at its designs to the mounts to build?

A DOE (Sobol) in all vehicles, the correlation of groups and of the vehicles of one group in it,
the robust front of that group (NSGA-II, on request from the best designs of the DOE) and its Sobol
sensitivities (SALib), all of one model, in one run folder and on one page. Each step is a study of
its own, too: group_correlation, u06_correlation, u06_robust_front, u06_sensitivity; not begun from
the DOE, the front is that of u06_robust_front, byte for byte.

Keys of summary.json: those of the four studies, such as splv_change_db_per_line_U06-1,
r_group_min, r_u06_1_4_min, r_u06_5_mean and st_TSM_x_U06-1. Where two have the same key the front's
keeps it (n_failed), then that of the groups (r_vehicle_min); the other gets doe_ or within_group_
before it. surface_difference_at_peaks_db is that of all vehicles, n_runs counts sensitivities only.
"""

from pathlib import Path
from typing import Annotated

from typer import Option

from deboom.files.platform import read_platform
from deboom.report import Report
from deboom.study.correlation import DoeRequest, Plan
from deboom.study.platform_model import Kernel, Motion, MountSource, operation
from deboom.study.platform_study import DoePlan, FrontPlan, platform_result, platform_study
from deboom.study.progress import progress_bar
from deboom.study.result import RunContext
from deboom.study.runner import run_script
from deboom.study.search import Budget
from deboom.study.sensitivity import Analysis, Ranked, SensitivityPlan

PLATFORM = Path(__file__).parent / "data" / "u06_f39_f45"


def main(
    seed: Annotated[int, Option(help="From 1; the same seed gives the same numbers.")] = 1,
    doe: Annotated[int, Option(help="Designs of the DOE; a power of two.")] = 256,
    draws: Annotated[int, Option(help="Of each design's scatter; a power of two.")] = 16,
    generations: Annotated[int, Option(help="Generations of NSGA-II.")] = 100,
    population: Annotated[int, Option(help="Designs per generation.")] = 100,
    from_doe: Annotated[bool, Option(help="NSGA-II begins with the DOE's best.")] = False,
    samples: Annotated[int, Option(help="Tolerance draws per design; a power of two.")] = 128,
    n: Annotated[int, Option(help="Base points of sensitivities; a power of two.")] = 1024,
    resamples: Annotated[int, Option(help="Bootstrap resamples of all intervals.")] = 200,
    half_width: Annotated[float, Option(help="Of DOE and sensitivities [1].")] = 0.15,
    tolerance: Annotated[float, Option(help="Half width of the scatter, 3 sigma [1].")] = 0.15,
    load_case: Annotated[list[str] | None, Option(help="name or name=weight; repeatable.")] = None,
    group: Annotated[str, Option(help="Vehicles of front and sensitivities.")] = "U06",
    platform: Annotated[Path, Option(help="Folder with platform.toml.")] = PLATFORM,
    mounts: Annotated[MountSource, Option(help="Source of forces.")] = MountSource.library,
    motion: Annotated[Motion, Option(help="Of the powertrain.")] = Motion.prescribed,
    kernel: Annotated[Kernel | None, Option(help="By default as the motion needs.")] = None,
    workers: Annotated[int, Option(help="Processes; any number gives the same front.")] = 1,
    run: RunContext | None = None,
) -> Report:
    """Try, correlate, search, verify, analyse and report."""
    runs = operation(read_platform(platform), load_case, mounts, None, band=(20, 60))
    designs = DoeRequest(Plan.sobol, doe, seed)
    tried = DoePlan(designs, half_width, tolerance, draws, resamples)
    searched = FrontPlan(Budget(population, generations), samples, from_doe, workers)
    ranked = SensitivityPlan(
        *(Analysis.design, Ranked.decibels, half_width, 0.20, tolerance, n, resamples, seed)
    )
    model = (motion, kernel)
    found = platform_study(runs, group, model, tried, searched, ranked, run, progress_bar)
    return runs.checked(platform_result(found))


if __name__ == "__main__":
    run_script(__file__)
