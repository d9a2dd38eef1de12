"""Which vehicles of the platform can share which mounts, and what does sharing cost?

Every vehicle has a best set of mounts of its own; a platform wants few part numbers. The study
finds the fewest distinct part numbers (of all mounts together) with which every vehicle keeps its
limit: --allowed dB per line above what mounts of its own would give it, or a table of limits.
Levels count the energy that scatter adds to each line: a notch that no made part has is no gain.
Families of the correlation study and the platform's groups are tried first; an integer program
chooses numbers, gradients move their values.

Keys of summary.json: part_numbers_min, part_numbers_lower_bound (fewer are impossible),
part_numbers_own (nothing shared); price_db, price_worst_db, price_worst_vehicle (level above
mounts of its own, mean over the vehicles and worst); one_set_price_worst_db (one set for all);
group_sets_part_numbers, group_sets_price_worst_db (one set per group);
change_db_per_line_mean (against today's mounts); share_verified_min (of the cars of a vehicle
within its limit); surface_difference_at_peaks_db (library against spectra).
"""

from pathlib import Path
from typing import Annotated

from typer import Option

from deboom.files.platform import read_platform
from deboom.report import Report
from deboom.study.commonality import CommonalityAims, commonality_result, commonality_study
from deboom.study.options import factor_space
from deboom.study.platform_model import Kernel, Motion, MountSource, motion_index, operation
from deboom.study.progress import progress_bar
from deboom.study.runner import run_script

PLATFORM = Path(__file__).parent / "data" / "u06_f39_f45"


def main(
    seed: Annotated[int, Option(help="From 1; the same seed gives the same answer.")] = 1,
    allowed: Annotated[float, Option(help="Above mounts of its own, per line [dB].")] = 0.5,
    limits: Annotated[Path | None, Option(help="Table: vehicle, limit [dB(A)].")] = None,
    share: Annotated[float, Option(help="Of the cars that keep the limit [1].")] = 0.95,
    together: Annotated[list[str] | None, Option(help="TSM=U06-1,U06-2; repeatable.")] = None,
    apart: Annotated[list[str] | None, Option(help="TSM=U06-1,U06-2; repeatable.")] = None,
    starts: Annotated[int, Option(help="Descents per vehicle for its own best.")] = 12,
    half_width: Annotated[float, Option(help="Bounds are 1 ± this [1].")] = 0.20,
    tolerance: Annotated[float, Option(help="Half width of the scatter, 3 sigma [1].")] = 0.15,
    group: Annotated[str | None, Option(help="Vehicles to serve; default is all.")] = None,
    load_case: Annotated[list[str] | None, Option(help="name or name=weight; repeatable.")] = None,
    platform: Annotated[Path, Option(help="Folder with platform.toml.")] = PLATFORM,
    mounts: Annotated[MountSource, Option(help="Source of forces.")] = MountSource.library,
    motion: Annotated[Motion, Option(help="Of the powertrain.")] = Motion.prescribed,
    kernel: Annotated[Kernel | None, Option(help="By default as the motion needs.")] = None,
) -> Report:
    """Search, verify and report."""
    runs = operation(read_platform(platform), load_case, mounts, group, band=(20, 60))
    index = motion_index(runs, motion, kernel)
    space = factor_space(index.variable_names, half_width, tolerance)
    aims = CommonalityAims(allowed, limits, share, starts, seed)
    with progress_bar("commonality") as progress:
        study = commonality_study(runs, index, space, aims, together or [], apart or [], progress)
    return runs.checked(commonality_result(study))


if __name__ == "__main__":
    run_script(__file__)
