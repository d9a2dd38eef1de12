"""How wide may each direction of the mounts scatter, at the least cost, for a stated target?

For one design of a front (of a finished run with --from-run, else of a quick search): the cheapest
tolerances that keep sigma of the mean level at --sigma (default: today's), or --share of all parts
x vehicles within --limit. A direction costs 1 at +-15 %, and its reciprocal, or see --cost-table.

Keys of summary.json: design, target; cost_cheapest, cost_uniform (one tolerance everywhere for the
same target), cost_today; cost_ratio_to_uniform, cost_ratio_to_uniform_of_effective (uniform where a
direction has an effect, else free); sigma_today_db, sigma_cheapest_db (mean level, mean over
vehicles), sigma_verified_db, sigma_uniform_verified_db (new draws); optimality_percent (spread of
the target's price over directions, 0: optimal); share_stated, share_verified, share_lower_bound.
"""

from pathlib import Path
from typing import Annotated

from typer import Option

from deboom.files.platform import read_platform
from deboom.study.made_parts import made_parts
from deboom.study.options import factor_space
from deboom.study.platform_model import Motion, MountSource, motion_index, operation
from deboom.study.result import RunContext, StudyResult
from deboom.study.runner import run_script
from deboom.study.search import Budget
from deboom.study.supplier_study import Pick
from deboom.study.tolerance_allocation import (
    AllocationStudy,
    WantedDesign,
    WantedTarget,
    allocation_result,
    cost_curves,
    design_of_run,
    design_of_search,
)

STUDIES = Path(__file__).parent
PLATFORM = STUDIES / "data" / "u06_f39_f45"


def main(
    seed: Annotated[int, Option(help="From 1; the same seed gives the same tolerances.")] = 1,
    from_run: Annotated[Path | None, Option(help="Finished front study, not a search.")] = None,
    pick: Annotated[Pick, Option(help="Design of the front.")] = Pick.best_mean,
    point: Annotated[int | None, Option(help="Or its number there, from 1.")] = None,
    generations: Annotated[int, Option(help="Of the quick search.")] = 40,
    population: Annotated[int, Option(help="Designs per generation.")] = 60,
    samples: Annotated[int, Option(help="Draws to choose by; a power of two.")] = 256,
    sigma: Annotated[float | None, Option(help="Target of the mean level [dB].")] = None,
    limit: Annotated[list[str] | None, Option(help="dB(A), +dB, vehicle=dB(A).")] = None,
    share: Annotated[float, Option(help="Of parts x vehicles within limits [1].")] = 0.95,
    tightest: Annotated[float, Option(help="Smallest tolerance, half width [1].")] = 0.05,
    widest: Annotated[float, Option(help="Largest tolerance, half width [1].")] = 0.30,
    cost_table: Annotated[Path | None, Option(help="variable, weight, reference tolerance")] = None,
    cost_points: Annotated[Path | None, Option(help="variable, tolerance, cost")] = None,
    tolerance: Annotated[float, Option(help="Today's, half width [1].")] = 0.15,
    parts: Annotated[Path | None, Option(help="TOML: part numbers, batches, scatter.")] = None,
    load_case: Annotated[list[str] | None, Option(help="name or name=weight; repeatable.")] = None,
    group: Annotated[str, Option(help="Vehicles to serve.")] = "U06",
    platform: Annotated[Path, Option(help="Folder with platform.toml.")] = PLATFORM,
    mounts: Annotated[MountSource, Option(help="Source of forces.")] = MountSource.library,
    motion: Annotated[Motion, Option(help="Of the powertrain.")] = Motion.prescribed,
    run: RunContext | None = None,
) -> StudyResult:
    """Choose a design, allocate, verify and report."""
    wanted = WantedTarget(sigma, limit, share)
    asked = WantedDesign(pick, point)
    if from_run is not None:
        found = design_of_run(from_run, STUDIES, asked, parts)
    else:
        runs = operation(read_platform(platform), load_case, mounts, group, band=(20, 60))
        index = motion_index(runs, motion, None)
        made = made_parts(parts, factor_space(index.variable_names, 0.20, tolerance))
        found = design_of_search(
            runs, index, made, Budget(population, generations), seed, asked, run
        )
    curves, files = cost_curves(cost_table, cost_points, found.variables)
    study = AllocationStudy(found, curves, wanted, tightest, widest, samples, seed)
    return found.reported(allocation_result(study, files))


if __name__ == "__main__":
    run_script(__file__)
