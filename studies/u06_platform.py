"""What do the data of a platform show, from a first look at designs to the mounts to build?

With one model, the study computes a DOE (Sobol) in all vehicles, the correlation of groups and of
the vehicles of one group, the robust front of this group (NSGA-II) and its Sobol sensitivities
(SALib). Everything is in one run folder and on one page. Each step is also a separate study:
fleet_correlation, u06_robust_front (which adds prescribed motion) and u06_sensitivity.

Keys of summary.json: those of the four studies, such as splv_change_db_per_line_U06-1,
r_group_min, r_u06_1_4_min, r_u06_5_mean and st_TSM_x_U06-1. If two studies have the same key, the
front keeps it (n_failed), or else the groups (r_vehicle_min); the key of the other study begins
with doe_ or within_group_. surface_difference_at_peaks_db is that of all vehicles, and n_runs
counts the sensitivities only.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated, Any

from typer import Option

from deboom.explore.robust import Robust
from deboom.pages.correlation import (
    CorrelationStudy,
    DoeRequest,
    Levels,
    Plan,
    correlation_report,
    correlation_study,
)
from deboom.pages.motion import report_runs
from deboom.pages.platform_front import PlatformFront
from deboom.pages.robust_front import front_report
from deboom.pages.sensitivity import Analysis, SensitivityPlan, sensitivity, sensitivity_report
from deboom.progress import progress_bar
from deboom.report import Report
from deboom.runs.options import (
    AimOptions,
    Sampler,
    Seed,
    Tolerance,
    at_least,
    robust_response,
    tolerance_sample,
)
from deboom.runs.platform_options import MotionOptions, PlatformOptions, in_all_load_cases
from deboom.runs.result import RunContext, run_name
from deboom.runs.search import ThoroughSearchOptions
from deboom.runs.second_process import begun
from deboom.vehicles.design_factor import factor_space
from deboom.vehicles.platform import Runs

FAMILY = 0.9
"""Least correlation within a family of vehicles [1]."""
NOTHING = "There is one vehicle only: nothing to correlate, and no DOE was run."
SAME_DOE = ("doe", "n_designs", "n_failed")
"""What the vehicles of a group would say of the DOE once more."""


@dataclass(frozen=True)
class Options:
    """What is tried, searched and ranked."""

    seed: Seed = 1
    doe: Annotated[
        int,
        Option(
            help="Number of designs of the DOE, a power of two.",
            callback=at_least(8, power_of_two=True),
        ),
    ] = 256
    draws: Annotated[
        int,
        Option(help="Number of draws of the scatter per design of the DOE, a power of two."),
    ] = 16
    search: ThoroughSearchOptions = ThoroughSearchOptions(generations=30)
    samples: Annotated[
        int,
        Option(help="Number of draws of the scatter per design of the search, a power of two."),
    ] = 128
    n: Annotated[
        int,
        Option(
            help="Number of base points of the sensitivities, a power of two.",
            callback=at_least(8, power_of_two=True),
        ),
    ] = 1024
    resamples: Annotated[
        int, Option(help="Number of bootstrap resamples for all intervals.", callback=at_least(100))
    ] = 200
    bounds: Annotated[
        float,
        Option(help="Half width of the range of stiffness factors around 1, in the search [1]."),
    ] = 0.20
    half_width: Annotated[
        float, Option(help="The same half width in the DOE and the sensitivities [1].")
    ] = 0.15
    tolerance: Tolerance = 0.15
    aims: AimOptions = AimOptions()
    platform: PlatformOptions = PlatformOptions()
    motion: MotionOptions = MotionOptions()


@dataclass(frozen=True, eq=False)
class Model:
    """Levels of all vehicles and of one group, and the group's under scattering parts."""

    everyone: Runs
    everyone_index: Any
    runs: Runs
    robust: Robust


def prepare(options: Options) -> Model:
    """Read the platform and build its models."""
    everyone = replace(options.platform, group=None).runs()
    runs = replace(everyone, fleet=options.platform.served(everyone.fleet))
    index = options.motion.model(runs)
    space = factor_space(index.variable_names, options.bounds, options.tolerance)
    sample = tolerance_sample(Sampler.sobol, space.n_variables, options.samples, seed=options.seed)
    robust = robust_response(index, space, sample, aims=options.aims)
    return Model(everyone, options.motion.model(everyone), runs, robust)


def run(model: Model, options: Options, context: RunContext | None = None) -> Report:
    """Try, correlate, search, verify, analyse and report."""
    runs, platform = model.runs, model.runs.platform
    index: Any = model.robust.evaluate
    half, spread = options.half_width, options.tolerance
    plan = SensitivityPlan(
        analysis=Analysis.design,
        half_width=half,
        beside=0.20,
        tolerance=spread,
        n_base=options.n,
        n_resamples=options.resamples,
        seed=options.seed,
    )
    second = context.second if context is not None else None
    # the second process compiles slopes, ranks stiffnesses and draws clouds while this one searches
    if options.search.polish:
        begun(second, index.compile_slopes)
    ranking = begun(second, partial(sensitivity, platform, index, plan))

    parts: dict[str, Report] = {}
    fleet = fleet_doe(model, options)
    vehicles = within_group(fleet, runs, index)
    fleet_names = fleet.names if fleet is not None else ()
    if fleet is not None:
        parts["DOE and groups"] = correlation_report(fleet)
    if vehicles is not None and vehicles.names != fleet_names:
        parts["Vehicles"] = correlation_report(vehicles)
    if second is not None:
        second.draw(picture for part in parts.values() for picture in part.every_picture)
    front = options.search.verified(
        model.robust,
        seed=options.seed,
        run=context,
        inputs=platform.input_files,
    )
    view = PlatformFront(
        front=front,
        runs=runs,
        every=in_all_load_cases(options.platform, runs, options.motion),
        run=run_name(context, "u06_platform"),
    )
    with progress_bar("sensitivity") as bar:
        ranked = ranking.result(partial(sensitivity, platform, index, plan, bar))
    parts["Front"] = front_report(view)
    parts["Sensitivity"] = sensitivity_report(ranked)
    names = _names(parts)

    group = ", ".join(dict.fromkeys(vehicle.group for vehicle in runs.fleet.vehicles))
    report = Report(
        f"{platform.title}: one study",
        "Which vehicles go together, which mount stiffnesses make those of group "
        f"{group} quiet and keep them so, and which stiffness matters?",
    )
    report.inputs += [options.search.begin] if options.search.begin else []
    report.section(
        "What was asked, and with which data",
        f"{platform.title}: {platform.description}\n\n"
        "All steps ask one model: the same forces, motion, lines and kernel. Every vehicle of the "
        f"platform hears the DOE; front and sensitivities are those of group {group}. DOE "
        f"and sensitivities keep within ±{100 * half:g} %, the search within "
        f"±{100 * options.bounds:g} %. {front.note}\n\n"
        "Files of this folder are those of all four studies; their own pages show more: "
        "fleet_correlation (with --group for one group), u06_robust_front, u06_sensitivity.",
        folded=True,
    )
    if fleet is None:
        report.section("DOE and groups", NOTHING)
    for name in ("Front", "Sensitivity", "DOE and groups", "Vehicles"):
        if name in parts:
            folded = name == "DOE and groups"  # the first screen says which vehicles go together
            report.include(parts[name], name, names=names[name], leading=True, folded=folded)
    others = [parts[name] for name in ("DOE and groups", "Sensitivity") if name in parts]
    report.remarks += [other.verdict for other in others]
    report_runs(report, model.everyone)
    return report


def _names(parts: Mapping[str, Report]) -> dict[str, dict[str, str]]:
    """Return new names by part, where another part that comes before it here has the same."""
    prefixes = {
        "Front": "",
        "DOE and groups": "doe_",
        "Vehicles": "within_group_",
        "Sensitivity": "sobol_",
    }
    new: dict[str, dict[str, str]] = {}
    taken: list[set[str]] = [set(), set(), set()]
    for name, prefix in prefixes.items():
        if name not in parts:
            continue
        part = parts[name]
        new[name] = dict.fromkeys(SAME_DOE, "") if name == "Vehicles" else {}
        kinds: list[set[str]] = [set(part.tables), set(part.pictures), set(part.summary)]
        for names, kind in zip(taken, kinds, strict=True):
            doubled = (names & kind) - new[name].keys()
            new[name] |= {key: prefix + key for key in doubled}
            names |= kind - new[name].keys()
    return new


def fleet_doe(model: Model, options: Options) -> CorrelationStudy | None:
    """Try the designs of a DOE in all vehicles; None if there is one vehicle only."""
    if len(model.everyone_index.response_names) < 2:
        return None
    return correlation_study(
        model.everyone,
        model.everyone_index,
        DoeRequest(Plan.sobol, options.doe, options.seed),
        half_width=options.half_width,
        tolerance=options.tolerance,
        draws=options.draws,
        resamples=options.resamples,
        cut=FAMILY,
    )


def within_group(study: CorrelationStudy | None, runs: Runs, index: Any) -> CorrelationStudy | None:
    """Return the part of a fleet's DOE that some of its vehicles heard; nothing is run again."""
    names = index.response_names
    if study is None or len(names) < 2:
        return None
    heard, columns = study.vehicles, [study.names.index(name) for name in names]
    levels = Levels(
        names, heard.designs[:, columns], heard.means[:, columns], heard.scatter[..., columns]
    )
    return replace(study, runs=runs, index=index, vehicles=levels)
