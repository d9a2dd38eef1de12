"""Which mount stiffnesses make the U06 vehicles quiet, and keep them so as parts scatter?

NSGA-II over the 12 stiffness factors of engine, gearbox, strut (TSM), wishbone (Du): sums over the
vehicles of mean SPLV, 20 to 60 Hz, and of its sigma. Softer TSM and Du take 2.5 to 3 dB per line
off (seed 1). Keys of summary.json: splv_change_db_per_line_<vehicle>,
energy_25_40hz_change_db_<vehicle> (best mean, no scatter); sigma_change_percent_best_sigma;
sigma_bias_percent, mean_bias_db_per_line (search - verification); surface_difference_at_peaks_db;
design_factor; held_*_share (beyond data); n_front, n_evaluated, n_failed, n_beyond_limits.
"""

from pathlib import Path
from typing import Annotated

from typer import Option

from deboom.explore.front import verify
from deboom.explore.workers import workers_for
from deboom.files.platform import read_platform
from deboom.report import Report
from deboom.study.made_parts import made_parts
from deboom.study.options import Aim, Sampler, factor_space, tolerance_sample
from deboom.study.platform_model import Factor, Kernel, Motion, MountSource, motion_index, operation
from deboom.study.progress import progress_bar
from deboom.study.result import RunContext
from deboom.study.robust_front import RobustFront, robust_front_result
from deboom.study.runner import run_script
from deboom.study.search import Budget, mount_limits, robust_search

PLATFORM = Path(__file__).parent / "data" / "u06_f39_f45"


def main(
    seed: Annotated[int, Option(help="From 1; the same seed gives the same front.")] = 1,
    generations: Annotated[int, Option(help="Generations of NSGA-II.")] = 100,
    population: Annotated[int, Option(help="Designs per generation.")] = 100,
    searches: Annotated[int, Option(help="Seeds from seed upwards, into one front.")] = 1,
    polish: Annotated[bool, Option(help="Picks go on by gradient.")] = False,
    samples: Annotated[int, Option(help="Tolerance draws per design; a power of two.")] = 128,
    sampler: Annotated[Sampler, Option(help="Tolerance draws; fresh: the thesis.")] = Sampler.sobol,
    tolerance: Annotated[float, Option(help="Half width of the scatter, 3 sigma [1].")] = 0.15,
    parts: Annotated[Path | None, Option(help="TOML: part numbers, batches, scatter.")] = None,
    objective: Annotated[Aim, Option(help="What is minimised.")] = Aim.mean,
    nominal_mean: Annotated[bool, Option(help="Level of the design itself as mean.")] = False,
    control_variate: Annotated[bool, Option(help="Mean and sigma by regression.")] = False,
    load_case: Annotated[list[str] | None, Option(help="name or name=weight; repeatable.")] = None,
    group: Annotated[str, Option(help="Vehicles to serve.")] = "U06",
    platform: Annotated[Path, Option(help="Folder with platform.toml.")] = PLATFORM,
    mounts: Annotated[MountSource, Option(help="Source of forces.")] = MountSource.library,
    motion: Annotated[Motion, Option(help="Of the powertrain.")] = Motion.prescribed,
    factor: Annotated[Factor, Option(help="What a stiffness factor means.")] = Factor.dynamic,
    loss_factors: Annotated[bool, Option(help="Loss factors ±20 % are variables too.")] = False,
    limits: Annotated[Path | None, Option(help="TOML: sag, travel, modes to keep.")] = None,
    kernel: Annotated[Kernel | None, Option(help="By default as the motion needs.")] = None,
    workers: Annotated[int, Option(help="Processes; any number gives the same front.")] = 1,
    scheduler: Annotated[str | None, Option(help="Dask cluster, tcp://host:port.")] = None,
    run: RunContext | None = None,
) -> Report:
    """Search, verify and report."""
    runs = operation(read_platform(platform), load_case, mounts, group, band=(20, 60))
    index = motion_index(runs, motion, kernel, factor, loss_factors=loss_factors)
    made = made_parts(parts, factor_space(index.variable_names, 0.20, tolerance))
    sample = tolerance_sample(sampler, made.n_draws, samples, seed=seed)
    robust = made.response(index, sample, objective, nominal_mean, control_variate)
    limited = mount_limits(limits, runs, robust, factor)
    budget = Budget(population, generations, searches, polish)
    files = (*runs.platform.input_files, *limited.inputs, *made.inputs)
    with workers_for(robust, workers, scheduler) as spread, progress_bar("NSGA-II") as bar:
        search = robust_search(limited.around(spread), robust, budget, seed, bar, run, files)
    check = verify(search.front, robust, n_samples=1024, seed=seed)
    front = RobustFront(runs.platform, index, robust, search, check, budget.note)
    result = limited.reported(robust_front_result(front), search, front.named_designs)
    return runs.checked(made.reported(result))


if __name__ == "__main__":
    run_script(__file__)
