"""Within which stiffnesses may mounts be delivered so that the vehicles keep their limit?

The largest box of intervals, one per mount and axis, in which a stated share of parts and vehicles
keeps a limit (by default the one that ±15 % about a Pareto point keeps), verified with new parts.
With seed 1 on the virtual platform only TSM x and Du x need an end (18 of 20 lie on the bounds);
intervals are 2.1 times as wide as ±15 % (mean of ten axes); U06-3 binds.

Keys of summary.json: share_stated, share_verified, share_bound (95 % confidence, over parts);
share_measured_from, share_measured_to (90 %, with all measurements drawn again); volume_ratio_pm15
and width_ratio_pm15 (geometric mean; box over ±15 % about the Pareto point, axes with an effect),
the same _bisection; share_pm15; n_axes; n_ends_on_bounds; limit_db_first_vehicle;
limit_could_be_lowered_db (to a point); binding_vehicle; n_parts_verified; seconds (of the box).
"""

from pathlib import Path
from typing import Annotated

from typer import Option

from deboom.files.platform import read_platform
from deboom.report import Report
from deboom.study.options import factor_space
from deboom.study.platform_model import Kernel, Motion, MountSource, motion_index, operation
from deboom.study.progress import progress_bar
from deboom.study.runner import run_script
from deboom.study.solution_box import box_study, solution_box_result
from deboom.study.solution_box_question import (
    BoxOptions,
    Law,
    Quantity,
    limited_response,
    pareto_point,
)
from deboom.study.supplier_study import Pick

HERE = Path(__file__).parent


def main(
    seed: Annotated[int, Option(help="From 1; the same seed gives the same box.")] = 1,
    share: Annotated[float, Option(help="Of parts and vehicles that keep the limit [1].")] = 0.95,
    limit: Annotated[float | None, Option(help="For all vehicles [dB(A)].")] = None,
    below_today: Annotated[float | None, Option(help="Or: each quieter by this [dB].")] = None,
    quantity: Annotated[Quantity, Option(help="What is limited.")] = Quantity.mean,
    peak_from: Annotated[float, Option(help="First line of a peak level [Hz].")] = 25.0,
    peak_to: Annotated[float, Option(help="Last line of a peak level [Hz].")] = 40.0,
    worst_vehicle: Annotated[bool, Option(help="A part must keep the limit in all.")] = False,
    law: Annotated[Law, Option(help="How parts lie in their interval.")] = Law.uniform,
    cost_table: Annotated[Path | None, Option(help="variable, weight, reference.")] = None,
    front: Annotated[Path | None, Option(help="Run of a front study; default: search.")] = None,
    pick: Annotated[Pick, Option(help="Design of the front.")] = Pick.best_mean,
    half_width: Annotated[float, Option(help="Of the designs about today's [1].")] = 0.20,
    tolerance: Annotated[float, Option(help="Of the box that is compared with [1].")] = 0.15,
    curve: Annotated[bool, Option(help="Boxes at other limits, too.")] = True,
    load_case: Annotated[list[str] | None, Option(help="name or name=weight; repeatable.")] = None,
    group: Annotated[str, Option(help="Vehicles to serve.")] = "U06",
    platform: Annotated[Path, Option(help="With platform.toml.")] = HERE / "data" / "u06_f39_f45",
    mounts: Annotated[MountSource, Option(help="Source of forces.")] = MountSource.library,
    motion: Annotated[Motion, Option(help="Of the powertrain.")] = Motion.prescribed,
    kernel: Annotated[Kernel | None, Option(help="By default as the motion needs.")] = None,
    workers: Annotated[int, Option(help="Processes; any number gives the same box.")] = 1,
) -> Report:
    """Search, verify and report."""
    options = BoxOptions(share, limit, below_today, worst_vehicle, law, cost_table)
    runs = operation(read_platform(platform), load_case, mounts, group, band=(20, 60))
    index = motion_index(runs, motion, kernel)
    space = factor_space(index.variable_names, half_width, tolerance)
    with progress_bar("Box") as bar:
        point = pareto_point(front, pick, HERE, index, space, seed=seed, progress=bar)
        response = limited_response(quantity, index, (peak_from, peak_to))
        question = options.question(response, space, point, seed=seed)
        model = (runs, index, space, point, question)
        found = box_study(*model, seed=seed, curve=curve, workers=workers, progress=bar)
    return runs.checked(solution_box_result(found, (cost_table,) if cost_table else ()))


if __name__ == "__main__":
    run_script(__file__)
