"""Which mount directions deserve tight tolerances, and what does less scatter cost?

Stiffness factor and tolerance of every direction are variables (24 of them) and the tolerances have
a price: NSGA-II for three objectives, the sums over the vehicles of mean SPLV and of its standard
deviation, and the cost ``weight (reference / tolerance - 1)``, summed over the directions. Weight 1
and reference 15 % are assumptions; --cost-table takes your own.

What it showed, with seed 1 on the virtual platform: for today's money the scatter halves while the
mean falls by 2.1 dB per line; x of all four mounts deserves the precision, TSM x first, and y of
none. A quiet design with today's scatter saves the price of four halved tolerances.
Keys of summary.json, of designs no louder than the quietest one by more than the margin, verified
with 1024 draws: sigma_change_percent_at_todays_cost (against today's design),
sigma_change_percent_by_allocation (against one tolerance everywhere at that cost and stiffness),
mean_change_db_per_line_at_todays_cost; cost_for_todays_sigma (negative is a saving);
cost_most_precise, sigma_change_percent_most_precise; n_front, n_evaluated, n_failed (designs).
"""

from pathlib import Path
from typing import Annotated

from typer import Option

from deboom.explore.problems import nsga2
from deboom.explore.space import stiffness_factor_space
from deboom.explore.tolerance_allocation import ToleranceResponse
from deboom.explore.workers import workers_for
from deboom.files.platform import read_platform
from deboom.report import Report
from deboom.study.cost_of_tolerance import ToleranceStudy, tolerance_cost, tolerance_cost_result
from deboom.study.made_parts import made_parts
from deboom.study.options import Sampler, tolerance_sample
from deboom.study.platform_model import Kernel, Motion, MountSource, motion_index, operation
from deboom.study.progress import progress_bar
from deboom.study.result import RunContext
from deboom.study.runner import run_script

PLATFORM = Path(__file__).parent / "data" / "u06_f39_f45"


def main(
    seed: Annotated[int, Option(help="From 1; the same seed gives the same front.")] = 1,
    generations: Annotated[int, Option(help="Generations of NSGA-II.")] = 200,
    population: Annotated[int, Option(help="Designs per generation.")] = 100,
    samples: Annotated[int, Option(help="Tolerance draws per design; a power of two.")] = 128,
    tightest: Annotated[float, Option(help="Smallest tolerance, half width [1].")] = 0.05,
    widest: Annotated[float, Option(help="Largest tolerance, half width [1].")] = 0.30,
    tolerance: Annotated[float, Option(help="Today's tolerance, half width [1].")] = 0.15,
    mean_margin: Annotated[float, Option(help="Above the quietest design [dB].")] = 0.5,
    cost_table: Annotated[
        Path | None, Option(help="variable, weight, reference tolerance.")
    ] = None,
    parts: Annotated[Path | None, Option(help="TOML: part numbers, batches, scatter.")] = None,
    load_case: Annotated[list[str] | None, Option(help="name or name=weight; repeatable.")] = None,
    group: Annotated[str, Option(help="Vehicles to serve.")] = "U06",
    platform: Annotated[Path, Option(help="Folder with platform.toml.")] = PLATFORM,
    mounts: Annotated[MountSource, Option(help="Source of forces.")] = MountSource.library,
    motion: Annotated[Motion, Option(help="Of the powertrain.")] = Motion.prescribed,
    kernel: Annotated[Kernel | None, Option(help="By default as the motion needs.")] = None,
    workers: Annotated[int, Option(help="Processes; any number gives the same front.")] = 1,
    run: RunContext | None = None,
) -> Report:
    """Search, verify and report."""
    runs = operation(read_platform(platform), load_case, mounts, group, band=(20, 60))
    index = motion_index(runs, motion, kernel)
    made = made_parts(parts, stiffness_factor_space(index.variable_names, 0.20, tolerance))
    sample = tolerance_sample(Sampler.sobol, made.n_draws, samples, seed=seed)
    cost = tolerance_cost(cost_table, index.variable_names)
    response = ToleranceResponse(made.response(index, sample), tightest, widest, cost)
    tables = (*((cost_table,) if cost_table else ()), *made.inputs)
    kept = run.checkpoint((*runs.platform.input_files, *tables)) if run else None
    with workers_for(response, workers) as spread, progress_bar("NSGA-II") as bar:
        search = nsga2(spread, population, generations, seed=seed, progress=bar, checkpoint=kept)
    found = ToleranceStudy(runs.platform, index, response, search, mean_margin, seed)
    return runs.checked(made.reported(tolerance_cost_result(found, tables)))


if __name__ == "__main__":
    run_script(__file__)
