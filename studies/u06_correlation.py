"""Does what quietens one vehicle of a group quieten the others?

300 designs within ±15 % are evaluated in every vehicle of the group (thesis, figure 45), as they
are, as means over the manufacturing tolerance, and for the scatter alone. Vehicles that go together
form families, which can share one mount set; one vehicle is held against all others.

On the virtual platform U06-1 to U06-4 correlate above 0.99 and form a family; U06-5, with its
battery, follows them by 0.4 to 0.5 only. Its fleet was selected; the page says how many of 300
fleets that nobody selected show the same.

Keys of summary.json: apart (the vehicle held against the others); r_<others>_min, r_<apart>_mean
over the designs, such as r_u06_1_4_min and r_u06_5_mean, and with _means and _tolerance for means
and scatter; r_vehicle_min; n_families; n_designs, n_failed; rate_alike, rate_alike_closely,
rate_battery, n_unselected_fleets (share of unselected fleets: others above 0.9, above 0.95, apart
within 0.3 to 0.8); surface_difference_at_peaks_db (library against spectra).
"""

from pathlib import Path
from typing import Annotated

from typer import Option

from deboom.files.platform import read_platform
from deboom.report import Report
from deboom.study.correlation import DoeRequest, Plan, correlation_study, vehicle_correlation_result
from deboom.study.platform_model import Kernel, Motion, MountSource, motion_index, operation
from deboom.study.runner import run_script

PLATFORM = Path(__file__).parent / "data" / "u06_f39_f45"


def main(
    seed: Annotated[int, Option(help="From 1; the same seed gives the same designs.")] = 1,
    designs: Annotated[int, Option(help="Of a space-filling plan.")] = 300,
    plan: Annotated[Plan, Option(help="How designs are laid out.")] = Plan.latin_hypercube,
    generators: Annotated[str | None, Option(help="Fraction, such as 'a b c abc'.")] = None,
    table: Annotated[Path | None, Option(help="Own designs, CSV or xlsx.")] = None,
    append_to: Annotated[Path | None, Option(help="doe.csv of a run, to go on.")] = None,
    half_width: Annotated[float, Option(help="Designs lie within 1 ± this [1].")] = 0.15,
    tolerance: Annotated[float, Option(help="Half width of the scatter, 3 sigma [1].")] = 0.15,
    draws: Annotated[int, Option(help="Of the scatter per design; a power of two.")] = 16,
    resamples: Annotated[int, Option(help="Of the bootstrap.")] = 1000,
    cut: Annotated[float, Option(help="Least correlation within a family [1].")] = 0.9,
    load_case: Annotated[list[str] | None, Option(help="name or name=weight; repeatable.")] = None,
    group: Annotated[str, Option(help="Vehicles to compare.")] = "U06",
    apart: Annotated[str | None, Option(help="Held against the others; else the oddest.")] = None,
    platform: Annotated[Path, Option(help="Folder with platform.toml.")] = PLATFORM,
    mounts: Annotated[MountSource, Option(help="Source of forces.")] = MountSource.library,
    motion: Annotated[Motion, Option(help="Of the powertrain.")] = Motion.prescribed,
    kernel: Annotated[Kernel | None, Option(help="By default as the motion needs.")] = None,
) -> Report:
    """Evaluate, correlate and report."""
    runs = operation(read_platform(platform), load_case, mounts, group, band=(20, 60))
    study = correlation_study(
        runs,
        motion_index(runs, motion, kernel),
        DoeRequest(plan, designs, seed, generators, table, append_to),
        motion=motion.value,
        half_width=half_width,
        tolerance=tolerance,
        draws=draws,
        resamples=resamples,
        cut=cut,
    )
    return runs.checked(vehicle_correlation_result(study, apart))


if __name__ == "__main__":
    run_script(__file__)
