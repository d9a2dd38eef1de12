"""How surely do we know what the mounts bring, and what should be measured next?

The errors of noise transfer functions, stiffnesses, motions and forces are drawn (shared by all
designs and vehicles), the model is built again from every draw: 90 % intervals of levels, of
changes against today's, of scatter and front, probabilities, the order of directions, and what one
more measurement would narrow. Sizes come from the mount library's error budget, from vehicles that
were measured in two ways (--vehicle), or are stated priors; a table names the origin of each.

On the virtual platform the mean level is known to 0.5 dB and a change to 0.08 dB: calibrations
cancel. For any vehicle and load case it is 0.6 dB: five vehicles are few, one more brings most.

Keys of summary.json: level_db, level_half_width_db (today's, mean of the vehicles); change_db with
change_lower_db, change_upper_db, change_half_width_db, and per vehicle (best mean against today's);
probability_quieter; front_half_width_db (median); front_kept_share (points not dominated, mean over
draws); next_measurement, next_narrower_percent, and with _series for any vehicle and load case;
least_leading_share (of the directions that scatter a vehicle most).
"""

from pathlib import Path
from typing import Annotated

from typer import Option

from deboom.files.platform import read_platform
from deboom.report import Report
from deboom.study.measured_uncertainty import (
    MeasuredUncertainty,
    front_designs,
    measured_transfer,
    uncertainty_result,
)
from deboom.study.options import Sampler, factor_space, robust_response, tolerance_sample
from deboom.study.platform_model import Factor, Motion, MountSource, motion_index, operation
from deboom.study.progress import progress_bar
from deboom.study.runner import run_script
from deboom.study.uncertain_index import uncertain_index

PLATFORM = Path(__file__).parent / "data" / "u06_f39_f45"
BAND = (20, 60)


def main(
    seed: Annotated[int, Option(help="From 1; the same seed gives the same intervals.")] = 1,
    draws: Annotated[int, Option(help="Measurements that are drawn, at least 40.")] = 200,
    front: Annotated[Path | None, Option(help="Run of a front study; none: a search.")] = None,
    generations: Annotated[int, Option(help="Generations of that search.")] = 40,
    population: Annotated[int, Option(help="Designs per generation.")] = 60,
    samples: Annotated[int, Option(help="Tolerance draws per design; a power of two.")] = 64,
    tolerance: Annotated[float, Option(help="Half width of the scatter, 3 sigma [1].")] = 0.15,
    vehicle: Annotated[list[Path] | None, Option(help="Measured in two ways; repeatable.")] = None,
    ear: Annotated[str | None, Option(help="Of these vehicles; default the first.")] = None,
    averaged: Annotated[bool, Option(help="The platform has means of both ways.")] = False,
    load_case: Annotated[list[str] | None, Option(help="name or name=weight; repeatable.")] = None,
    group: Annotated[str, Option(help="Vehicles to serve.")] = "U06",
    platform: Annotated[Path, Option(help="Folder with platform.toml.")] = PLATFORM,
    mounts: Annotated[MountSource, Option(help="Source of forces.")] = MountSource.library,
    motion: Annotated[Motion, Option(help="Of the powertrain.")] = Motion.prescribed,
    factor: Annotated[Factor, Option(help="What a stiffness factor means.")] = Factor.dynamic,
) -> Report:
    """Choose designs, draw the measurements again and report."""
    data = read_platform(platform)
    runs = operation(data, load_case, mounts, group, BAND)
    every = operation(data, [case.name for case in data.load_cases], mounts, group, BAND)
    index = motion_index(runs, motion, factor)
    space = factor_space(index.variable_names, half_width=0.20, tolerance=tolerance)
    sample = tolerance_sample(Sampler.sobol, space.n_variables, samples, seed=seed)
    robust = robust_response(index, space, sample)
    transfer, files = measured_transfer(vehicle or [], ear, BAND, averaged=averaged)
    uncertain = uncertain_index(index, runs.platform, runs.parts, transfer)
    with progress_bar("NSGA-II") as bar:
        designs, points = front_designs(front, robust, population, generations, seed, bar)
    cases = motion_index(every, motion, factor)
    study = MeasuredUncertainty(uncertain, robust, designs, points, cases, draws, seed)
    with progress_bar("measuring again") as bar:
        found = study.measure_again(bar)
    return runs.checked(uncertainty_result(found, files))


if __name__ == "__main__":
    run_script(__file__)
