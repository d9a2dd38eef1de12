"""The report of a robust front of mount stiffnesses: what to build, and where it comes from."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from enum import StrEnum
from functools import partial

import numpy as np
import pandas as pd

from deboom import plot
from deboom.arrays import PERCENT, RealArray
from deboom.errors import listed
from deboom.explore.choices import Pick
from deboom.explore.front import VERIFICATION, nondominated
from deboom.explore.moments import MEAN_SUM, SIGMA_SUM, Limit
from deboom.explore.result import Front
from deboom.explore.robust import Robust
from deboom.pages.front import front_numbers, report_front
from deboom.pages.front_answer import (
    VEHICLE_DECIMALS,
    abbreviations,
    cars_sentences,
    certainty_sentence,
    expected_on_average,
    model_sentence,
    other_changes_sentence,
    part_table,
    peaks_sentence,
    price_table,
    report_expected,
    report_expected_numbers,
    report_loudest,
    spelled_out,
    vehicle_table,
    weights_sentence,
)
from deboom.pages.front_pictures import heard_by_the_driver, pictures_behind
from deboom.pages.motion import factor_name, motion_name
from deboom.pages.platform_front import FURTHER, PlatformFront
from deboom.pages.receivers import report_orders, report_vibrations, worse_sentence
from deboom.plot.style import at_least, mount_colours, signed
from deboom.report import Link, Report, Step, Table
from deboom.vehicles.design_factor import with_brackets
from deboom.vehicles.fleet_front import same_designs
from deboom.vehicles.free_directions import NOTICEABLE, Need

BESIDE_WIDTH = 3.6
"""Width of figures that share a row [inch]."""
SHOWN_STIFFNESS = (
    "variable",
    "new [1]",
    "new with brackets [1]",
    "best-mean from [1]",
    "best-mean to [1]",
    "new [N/mm]",
    "nominal [N/mm]",
    "requirement",
    "largest change over the search [dB]",
    "changed most",
)
"""Columns of the stiffnesses on the page; the file has those of all picks."""
MOST_PARTS = 8
"""Directions that the first screen names, those that bring most."""
TERMS = (
    "booming noise",
    "SPL",
    "SPLV",
    "booming peak",
    "stiffness factor",
    "dynamic stiffness",
    "tolerance",
    "σ",
    "Pareto front",
    "no requirement",
    "no noticeable difference",
    "noise transfer function",
    "prescribed motion",
)


def front_report(view: PlatformFront) -> Report:
    """Report a robust front, for a reader who builds mounts."""
    first, last = view.fleet.frequency[0], view.fleet.frequency[-1]
    half = PERCENT * view.front.robust.space.tolerance.max()
    report = Report(
        f"What to build: {view.platform.title}",
        f"Which stiffnesses make {listed(view.runs.fleet.names)} quiet between {first:g} and "
        f"{last:g} Hz, and keep them quiet when parts scatter within ±{half:.0f} %?",
    )
    motion = view.motion_report
    report.explain(*(motion.terms.get(term, term) for term in TERMS))
    report.warn(*motion.warnings, view.front.robust.sample.warning)
    picks, best = _picks(view), view.front.pick_designs[Pick.best_mean]
    changes = view.fleet.splv_change(best)
    for vehicle, splv in zip(view.fleet.vehicles, changes, strict=True):
        report.number(
            f"splv_change_db_per_line_{vehicle}",
            float(splv),
            "dB",
            "change of the mean level of the lines in the vehicle by best-mean, in the model "
            "without scatter",
        )
    expected = view.expected_of_best
    for name in view.front.picks:
        row = picks[picks["design"] == name].iloc[0]
        pick = re.sub(r"\W+", "_", name)
        report.number(
            f"mean_change_db_{pick}",
            float(row["change [dB]"]),
            "dB",
            "change of the mean level by the pick over the scatter, mean of the vehicles, in the "
            "model",
            headline="+.1f" if name == Pick.best_mean and isinstance(expected, str) else "",
        )
    everywhere = view.expected_everywhere
    of_best = everywhere if isinstance(everywhere, str) else everywhere.of(view.row_of_best)
    report_expected_numbers(report, of_best, view.front.responses)
    build = (f"{view.front.variables[column]} × {best[column]:.2f}" for column in view.telling)
    front_numbers(report, view.fleet, ", ".join(build) or "today's mounts")
    report_expected(report, everywhere, list(view.front.picks), view.front.responses)
    motion.report_numbers(report)
    report.facts |= {
        "motion": motion_name(view.index),
        "design_factor": factor_name(view.index),
        "kernel": view.index.kernel,
        "objectives": "; ".join(objective.name for objective in view.front.robust.objectives),
        "estimator": view.front.robust.estimator.kind,
        "tolerance_sample": view.front.robust.sample.kind,
        "tolerance_draws": view.front.robust.sample.n_samples,
        "verification_draws": view.front.judge.n_samples,
        "verification_scrambles": len(VERIFICATION),
    }
    report.inputs += view.platform.input_files

    _answer(report, view, picks)
    _conflict(report, view)
    heard_by_the_driver(report, view)
    _choices(report, view, picks)
    _supplier(report, view)
    _certainty(report, view, picks)
    _price(report, view)
    pictures_behind(report, view)
    report_orders(report, view)
    _search(report, view)
    return report


def _answer(report: Report, view: PlatformFront, picks: pd.DataFrame) -> None:
    """Fill the first screen: what to build, per vehicle, at which price, how sure, what next."""
    best, mounts = view.best, view.platform.mounts
    row = picks[picks["design"] == Pick.best_mean]
    mean, sigma = row[["change [dB]", "change of sigma [%]"]].to_numpy(float)[0]
    spread = "as today" if abs(sigma) < 1.0 else f"{signed(sigma, 0)} %"
    expected = view.expected_of_best
    report.answer(
        _verdict(view, mean),
        certainty_sentence(expected, view.as_softer_rubber),
        f"Levels: mean of the lines, {view.load_case.title}; scatter of parts (σ) {spread}. "
        f"{weights_sentence(view.fleet)}{abbreviations(mounts)}",
    )
    whose = f"{view.target:g} dB(A)" if view.target is not None else "its vehicle's level of today"
    if view.target is None and any(each.target is not None for each in view.index.receivers):
        whose = "that of platform.toml, or its vehicle's level of today"
    several = len(view.fleet.vehicles) > len(view.runs.fleet.names)
    ear = "each ear" if several else "the driver's ear"
    table = vehicle_table(view.fleet, best, target=view.cars_target, expected=expected)
    report.panel(
        "Each vehicle",
        Table(table, "", VEHICLE_DECIMALS),
        f"Mean level at {ear}. {cars_sentences(view.fleet, table, whose)}"
        + (
            " Levels, change and peaks are the model's; expected and its interval are of cars as "
            "they are."
            if not isinstance(expected, str)
            else ""
        ),
        wide=True,
    )
    report.panel(
        "Parts to change",
        _parts_table(view),
        *_about_parts(view),
        wide=True,
    )
    report_vibrations(report, view)
    report_loudest(report, view.fleet, view.best, view.heard, view.load_case.title)
    report.panel("What it costs", *_price_blocks(view))
    report.panel(
        "What to do next",
        Step(f"deboom listen {view.run}", "hear every vehicle, as WAV"),
        Step(f"deboom report {view.run} --interactive", "try other designs in a page"),
        Step(f"deboom run solution_box --front {view.run}", "how far parts may deviate"),
        Step(f"deboom report {view.run} --supplier", "sheets for the supplier to quote"),
        Step(f"deboom driven {view.run} FOLDER", "compare a driven prototype with this"),
        wide=True,
    )


def _certainty(report: Report, view: PlatformFront, picks: pd.DataFrame) -> None:
    """Say all that is known of how sure the change is."""
    mean = float(picks.loc[picks["design"] == Pick.best_mean, "change [dB]"].iloc[0])
    others = other_changes_sentence(unseen=view.unseen, prescribed=view.with_prescribed_motion)
    if text := f"{model_sentence(view.expected_of_best, mean)}\n\n{others}".strip():
        report.section("How sure, in full", text, folded=True)


def _verdict(view: PlatformFront, mean: float) -> str:
    """Say what to build and what it brings, or that nothing is noticeably quieter.

    - `mean`: change of the mean level by best-mean [dB].
    """
    changes, expected = view.fleet.splv_change(view.best), view.expected_of_best
    if not isinstance(expected, str):
        changes = expected.cars.expected
    order = np.argsort(-changes, kind="stable")
    by_vehicle = ""
    if len(order) > 1:
        least, most = order[0], order[-1]
        by_vehicle = (
            f", from {signed(changes[most], 1)} in {view.fleet.vehicles[most]} to "
            f"{signed(changes[least], 1)} in {view.fleet.vehicles[least]}"
        )
    peaks = peaks_sentence(view.fleet.peak_changes(view.best))
    average = expected_on_average(expected, mean)
    effect = f"{average}{by_vehicle}; in the model {peaks}."
    if mean > -NOTICEABLE:
        return f"Leave today's mounts: no design of the search is noticeably quieter. {effect}"
    verdict = f"{worse_sentence(view)}{_moves(view)}: {effect}"
    if changes.max() > NOTICEABLE:
        verdict += f" Not for all: {view.fleet.vehicles[order[0]]} becomes louder."
    return verdict


def _moves(view: PlatformFront) -> str:
    """Say which directions change, and to which share of today's stiffness."""
    verbs: dict[str, list[str]] = {}
    for column in view.telling:
        factor = float(view.best[column])
        verb = "soften" if factor < 1.0 else "stiffen"
        name = spelled_out(view.front.variables[column], view.platform.mounts)
        verbs.setdefault(verb, []).append(f"{name} to {factor:.2f}")
    words = "; ".join(f"{verb} {listed(tuple(names))}" for verb, names in verbs.items())
    return f"{words[0].upper()}{words[1:]} of today's"


def _parts_table(view: PlatformFront) -> Table:
    """Tabulate the directions that are to change, those that bring most first."""
    needs = view.freedom.needs
    wanted = [column for column, need in enumerate(needs) if need is Need.wanted]
    alone = {column: view.only([column]) for column in {*view.telling, *wanted}}
    mean_alone = {column: float(view.fleet.mean(changes)) for column, changes in alone.items()}
    columns = sorted(alone, key=lambda column: mean_alone[column])[:MOST_PARTS]
    nominal = np.append(
        view.nominal_stiffness,
        np.full(len(view.best) - len(view.nominal_stiffness), np.nan),
    )
    mounts = view.platform.mounts
    return part_table(
        [spelled_out(view.front.variables[column], mounts) for column in columns],
        share=view.best[columns],
        today=nominal[columns],
        alone=np.array([mean_alone[column] for column in columns]),
        decimals=0,
        beside={
            "alone, where most": [_most(alone[column], view.fleet.vehicles) for column in columns]
        },
    )


def _most(changes: RealArray, vehicles: Sequence[str]) -> str:
    """Write the largest of several changes [dB], and whose it is."""
    row = int(np.abs(changes).argmax())
    return f"{signed(float(changes[row]), 1)} dB in {vehicles[row]}"


def _about_parts(view: PlatformFront) -> list[str]:
    """Say what N/mm mean, what lies at the edge of the search, and what may stay."""
    space, names = view.front.robust.space, view.front.variables
    bring = "brings" if len(view.telling) == 1 else "bring"
    sentences = [
        f"{listed(tuple(names[column] for column in view.telling))} alone {bring} "
        f"{signed(float(view.fleet.mean(view.only(view.telling))), 1)} dB of the mean.",
    ]
    at_edge = [names[column] for column in view.telling if column in view.edges(view.best)]
    if at_edge:
        verb = "lies" if len(at_edge) == 1 else "lie"
        sentences.append(
            f"{listed(tuple(at_edge))} {verb} at the edge of the search ({space.lower.min():g} to "
            f"{space.upper.max():g}); another {PERCENT * FURTHER:.0f} % would bring a further "
            f"{signed(view.beyond, 1)} dB (--bounds)."
        )
    kept = [
        name
        for name, is_todays in zip(names, view.build == space.nominal, strict=True)
        if is_todays
    ]
    if kept:
        changes = view.fleet.splv_change(view.build) - view.fleet.splv_change(view.best)
        change = signed(float(view.fleet.mean(changes)), 2)
        sentences.append(
            f"As today: {listed(tuple(kept))} (together {change} dB against best-mean)."
        )
    sentences.append(f"N/mm are {view.stiffness_state}.")
    return [" ".join(sentences)]


def _price_blocks(view: PlatformFront) -> list[str | Table]:
    """Show sag and travel beside what is allowed, and say where the modes go."""
    if isinstance(view.price, str):
        return [f"Sag, travel and modes are not known: {view.price}."]
    rows = view.price[["number", "today's", Pick.best_mean]].set_axis(
        ["number", "today", "after"], axis=1
    )
    modes = rows["number"].str.startswith("mode ")
    costs = rows[~modes].assign(allowed="–")
    limits = view.front.robust.limits.of_designs.limits
    if limits:
        designs = np.stack([view.front.robust.space.nominal, view.best])
        numbers = view.front.robust.numbers(designs, [limit.number for limit in limits])
        limited = pd.DataFrame(
            {
                "number": [f"{limit.number.name} [{limit.number.unit}]" for limit in limits],
                "today": numbers[0],
                "after": numbers[1],
                "allowed": [_allowed(limit) for limit in limits],
            }
        )
        costs = pd.concat([limited, costs[~costs["number"].isin(limited["number"])]])
    blocks: list[str | Table] = []
    if len(costs):
        blocks.append(
            price_table(
                costs["number"],
                today=costs["today"],
                after=costs["after"],
                allowed=costs["allowed"] if limits else None,
                decimals=1,
            )
        )
    ends = rows[modes][["today", "after"]].to_numpy(float)
    no_limits = " No limits were stated: --limits FILE."
    if ends.size:
        blocks.append(
            f"Rigid-body modes: {ends[:, 1].min():.1f} to {ends[:, 1].max():.1f} Hz (today "
            f"{ends[:, 0].min():.1f} to {ends[:, 0].max():.1f})."
            + ("" if view.front.robust.limits else no_limits)
        )
    return blocks


def _allowed(limit: Limit) -> str:
    """Write the values that a limit allows, without their unit."""
    if np.isinf(float(limit.at_least)):
        return f"≤ {limit.at_most:g}".replace("-", "−")
    if np.isinf(float(limit.at_most)):
        return f"≥ {limit.at_least:g}".replace("-", "−")
    return f"{limit.at_least:g} to {limit.at_most:g}".replace("-", "−")


def _conflict(report: Report, view: PlatformFront) -> None:
    """Show what the designs trade: mean against σ, or one vehicle against the others."""
    width = BESIDE_WIDTH
    names = view.fleet.vehicles
    matters = view.sigma_range >= NOTICEABLE
    text = f"Over the front the scatter σ differs by {view.sigma_range:.2g} dB: " + (
        "mean and σ are traded against each other."
        if matters
        else "nobody hears that, and σ decides nothing. Designs differ in the vehicles that "
        "become quieter."
    )
    if len(names) > 1:
        odd, change = view.worst_vehicle, view.evaluated_changes
        rest = [row for row in range(len(names)) if row != odd]
        others = view.fleet.mean(change, rest)
        row = int(change[:, odd].argmin())
        text += (
            f" Of the {len(change)} designs that the search evaluated, the best one for "
            f"{names[odd]} alone brings {signed(change[row, odd], 1)} dB there and "
            f"{signed(others[row], 1)} dB in the others; best-mean brings "
            f"{signed(view.fleet.splv_change(view.best)[odd], 1)} and "
            f"{signed(float(view.fleet.mean(view.fleet.splv_change(view.best), rest)), 1)} dB."
        )
    report.section("What the designs trade", text)
    if len(names) > 1:
        both = np.column_stack([others, change[:, odd]])
        edge = tuple(both[nondominated(both)][np.argsort(others[nondominated(both)])].T)
        named = {"today": (0.0, 0.0)}
        for name, design in view.front.pick_designs.items():
            gains = view.fleet.splv_change(design)
            named[name] = (float(view.fleet.mean(gains, rest)), float(gains[odd]))
        report.figure(
            "who_gains",
            lambda: plot.fronts(
                {"none better in both": edge},
                {f"{len(change)} designs of the search": (others, change[:, odd])},
                named,
                mean_label="mean change in the other vehicles [dB]",
                sigma_label=f"change in {names[odd]} [dB]",
                width=width,
            ),
            f"{names[odd]}, which gains least, against the other vehicles: change of the mean "
            "level over the scatter. Down and left is better. The line joins designs "
            "that none beats in both.",
        )
    if view.front.robust.n_objectives > 2:
        report.figure(
            "pareto_front",
            view.front.picture,
            "Each pair of objectives of the front, with today's mounts and the picks; down and "
            "left is better. A design that is beaten in one pair is better in another.",
        )
        return
    report.figure(
        "pareto_front",
        lambda: view.front.picture(view.judged_prescribed, width),
        "Both objectives of the front, with today's mounts and the picks; down and left is "
        "better. Bars: 95 % intervals by Student's t over independent scrambles of the "
        "draws." + ("" if matters else f" All designs lie within {view.sigma_range:.2g} dB of σ."),
    )


def _price(report: Report, view: PlatformFront) -> None:
    """Keep sag, travel and modes of all picks."""
    if isinstance(view.price, str):
        return
    sag = view.price["number"].str.contains("sag").any()
    report.section("What it costs, pick by pick", folded=True)
    report.table(
        "price",
        view.price,
        "Sag under the weight, travel at full torque and rigid-body modes."
        if sag
        else "Rigid-body modes. Without static curves (a mount library) sag and travel are not "
        "known.",
        {name: 1 for name in view.price.columns if name != "number"},
    )


def _picks(view: PlatformFront) -> pd.DataFrame:
    """Tabulate today's design and the picks, verified."""
    rows = {name: (view.front.values, row) for name, row in view.front.picks.items()}
    return view.front.compared({"baseline": (view.front.baseline, 0), **rows})


def _choices(report: Report, view: PlatformFront, picks: pd.DataFrame) -> None:
    """Show the picks, under both motions, and in all load cases."""
    names = list(
        dict.fromkeys(
            " = ".join(name for name, other in view.front.picks.items() if other == row)
            for row in view.front.picks.values()
        )
    )
    missing = (
        ""
        if Pick.sigma_kept in view.front.picks
        else (
            " No design found keeps σ and every vehicle at today's and is quieter: today's stays."
        )
    )
    report.section(
        "The picks",
        "Best-mean has the lowest mean level. None-louder has it among the designs in which no "
        "vehicle and no booming peak is louder than today, sigma-kept among those that scatter no "
        f"more than today. Best-sigma has the least scatter.{_further_picks(view.front)} Here: "
        f"{'; '.join(names)}.{missing}",
        folded=True,
    )
    report.table(
        "picks",
        picks,
        f"Per vehicle and line, verified with {len(VERIFICATION)} scrambles of "
        f"{view.front.judge.n_samples} draws that the search never saw.",
        {"mean level [dB(A)]": 2, "sigma of the level [dB]": 3},
        shown=picks.replace({"design": {"baseline": "today"}}),
    )
    if len(view.by_load_case):
        _load_cases(report, view)
    report_front(report, view.front)
    report.table("per_vehicle", _per_vehicle(view))
    if view.prescribed is not None:
        _motions(report, view, view.prescribed)


def _further_picks(front: Front) -> str:
    """Say what the picks of objectives beyond level and sigma are; empty without any."""
    if front.robust.n_objectives == 2:
        return ""
    best = (f"Best-{each.name}: least {each.name}." for each in front.robust.objectives[2:])
    return (
        f" {' '.join(best)} Nearest-to-ideal: nearest to the best of every objective, over their "
        "ranges. None-worse: the same among designs that are above today in none."
    )


def _load_cases(report: Report, view: PlatformFront) -> None:
    """Show what the picks change in each load case, and where best-mean does least."""
    cases, column = view.by_load_case, f"{Pick.best_mean} [dB]"
    worst = cases.iloc[int(cases[column].argmax())]
    title = view.platform.load_case(worst["load case"]).title
    report.table("load_cases", cases)
    report.text(
        f"Over all load cases best-mean does least in {title}, {worst['vehicle']}: "
        f"{signed(worst[column], 1)} dB; load_cases.csv has each pick in each."
    )
    report.number(
        "worst_load_case", str(worst["load case"]), "", "load case in which best-mean does least"
    )
    report.number(
        "worst_load_case_change_db",
        float(worst[column]),
        "dB",
        "change of the mean level in worst_load_case, in the vehicle that gains least",
    )


def _per_vehicle(view: PlatformFront) -> pd.DataFrame:
    """List mean and scatter of each vehicle at each point of the front."""
    n_lines, ears = view.index.n_lines, view.fleet.ears
    mean, sigma = view.front.values.mean[:, ears], view.front.values.sigma[:, ears]
    points, vehicles = np.meshgrid(np.arange(1, len(mean) + 1), view.fleet.vehicles, indexing="ij")
    return pd.DataFrame(
        {
            "point": points.ravel(),
            "vehicle": vehicles.ravel(),
            "SPLV mean [dB(A)]": mean.ravel(),
            "SPLV sigma [dB]": sigma.ravel(),
            "mean level of the lines [dB(A)]": mean.ravel() / n_lines,
            "sigma of that level [dB]": sigma.ravel() / n_lines,
        }
    )


def _motions(report: Report, view: PlatformFront, prescribed: Front) -> None:
    """Show the picks of both motions under both, and why they differ."""
    mine = motion_name(view.index)
    motions = {mine: view.front, "prescribed": prescribed}
    tables = []
    for motion, searched in motions.items():
        designs = np.stack(list(searched.pick_designs.values()))
        table: dict[str, object] = {"pick": list(searched.picks), "found with": motion}
        for judge, other in motions.items():
            values, today = other.judge(designs), other.baseline
            change = (values.mean_sum - today.mean_sum[0]) * view.front.per_line
            table[f"{judge} [dB]"] = change
            table[f"σ, {judge} [%]"] = PERCENT * (values.sigma_sum / today.sigma_sum[0] - 1.0)
        tables.append(pd.DataFrame(table))
    whole = pd.concat(tables, ignore_index=True)
    best = whole[whole["pick"] == Pick.best_mean][[f"{judge} [dB]" for judge in motions]]
    (gain, _), (real, promised) = best.to_numpy(float)
    same = same_designs(prescribed.model, view.index, view.front.robust.space)
    report.section(
        "With prescribed motion instead",
        f"Here the motion of the powertrain is solved for each design ({mine} motion); prescribed "
        f"motion keeps the measured motion. Prescribed motion expects {signed(promised, 1)} dB of "
        f"its own best-mean, of which {mine} motion expects {signed(real, 1)} dB; the best-mean of "
        f"{mine} motion brings {signed(gain, 1)} dB. Both rank designs alike (correlation "
        f"{at_least(float(same['correlation [1]'].min()), 3)} or more), and prescribed motion "
        f"expects {PERCENT / same['slope [1]'].max():.0f} to "
        f"{PERCENT / same['slope [1]'].min():.0f} % of "
        "each change: it neglects that a softer mount changes the motion of the powertrain.",
        folded=True,
    )
    report.table(
        "motions",
        whole,
        "Change of mean level and of σ by the picks of both motions, predicted with each motion.",
    )
    report.table("same_designs", same)
    report.number("benefit_db", -gain, "dB", "fall of the mean level by best-mean")
    report.number(
        "benefit_prescribed_db",
        -real,
        "dB",
        "fall of the mean level by the best-mean of prescribed motion",
    )
    report.number(
        "promised_prescribed_db",
        -promised,
        "dB",
        "fall of the mean level that prescribed motion predicts for its best-mean",
    )
    report.number(
        "r_min",
        float(same["correlation [1]"].min()),
        "1",
        "least correlation of the changes by the same designs with both motions",
    )
    report.number(
        "slope_min",
        float(same["slope [1]"].min()),
        "1",
        "least slope of changes by the same designs over those with prescribed motion",
    )
    report.number(
        "slope_max",
        float(same["slope [1]"].max()),
        "1",
        "largest slope of changes by the same designs over those with prescribed motion",
    )
    seconds = view.front.search.seconds + prescribed.search.seconds
    report.number("seconds_both_searches", round(seconds, 3), "s", "time of both searches")


def _supplier(report: Report, view: PlatformFront) -> None:
    """Show the stiffnesses of the picks, and what is left open."""
    nominal, variables = view.nominal_stiffness, view.stiffness_variables
    n = len(variables)
    space, freedom = view.front.robust.space, view.freedom
    interval = freedom.interval[:n]
    free = np.isin(variables, view.front.without_effect)
    first, last = view.fleet.frequency[0], view.fleet.frequency[-1]
    report.section(
        "What the supplier should build",
        "Shares of today's stiffness: those of best-mean, and today's part where it does as well. "
        f"N/mm are {view.stiffness_state}.",
        folded=True,
    )
    report.figure(
        "stiffness_bars",
        partial(
            plot.stiffness_bars,
            variables,
            view.build[:n],
            space.lower[:n],
            space.upper[:n],
            nominal,
            free.tolist(),
            interval,
            mount_colours([mount.name for mount in view.platform.mounts]),
            stiffness_label=f"mean |K|, {first:g}–{last:g} Hz [N/mm]",
        ),
        "New stiffness of every mount and axis. The thin bracket spans the "
        f"range within which, {freedom.sentence}.",
    )
    stiffness, on_brackets = _stiffness_table(view), np.any(view.bracket_softness > 0.0)
    shown = stiffness[[column for column in SHOWN_STIFFNESS if column in stiffness]]
    shown = shown.rename(columns={"nominal [N/mm]": "today [N/mm]"})
    report.table(
        "stiffness",
        stiffness,
        "New: share of today's stiffness"
        + (", of the rubber; with brackets: of mount and brackets in series" if on_brackets else "")
        + ". From and to: the range around best-mean within "
        f"which, {freedom.sentence}, scatter of the parts included. Any in bounds: the range "
        "covers all bounds. As today: the range covers today's part. Largest change over the "
        f"search: this direction alone goes from {freedom.searched.min():.2f} to "
        f"{freedom.searched.max():.2f}, and the mean level of a vehicle or one of its booming "
        "peaks moves by so much. The first screen says what the new part brings. stiffness.csv has "
        "the picks as the search found them.",
        {
            column: 0 if column.endswith("[N/mm]") else 2
            for column in shown.columns
            if column.endswith(("[N/mm]", "[1]"))
        },
        shown=shown,
    )
    if len(view.front.variables) > n:
        report.table(
            "loss_factors",
            _loss_factor_table(view),
            "Factors on the loss factor K''/K' at unchanged K'; a dash: no requirement.",
        )


def _stiffness_table(view: PlatformFront) -> pd.DataFrame:
    """List what to build, each pick by direction, and the range around best-mean."""
    nominal, freedom, softness = view.nominal_stiffness, view.freedom, view.bracket_softness
    variables = list(view.stiffness_variables)
    n = len(variables)
    free = np.isin(variables, view.front.without_effect)
    table: dict[str, object] = {"variable": variables, "nominal [N/mm]": nominal}
    for name, design in view.front.pick_designs.items():
        table[f"{name} factor [1]"] = design[:n]
        if np.any(softness > 0.0):
            table[f"{name} with brackets [1]"] = with_brackets(design[:n], softness)
        table[f"{name} [N/mm]"] = nominal * design[:n]
    table["new [1]"] = view.build[:n]
    if np.any(softness > 0.0):
        table["new with brackets [1]"] = with_brackets(view.build[:n], softness)
    table["new [N/mm]"] = nominal * view.build[:n]
    for column, bound in zip(("from", "to"), freedom.interval[:n].T, strict=True):
        table[f"best-mean {column} [1]"] = np.where(free, np.nan, bound)
        table[f"best-mean {column} [N/mm]"] = np.where(free, np.nan, nominal * bound)
    table["requirement"] = [need.value for need in freedom.needs[:n]]
    moved = freedom.move[:n].argmax(axis=1)
    table["largest change over the search [dB]"] = np.where(free, 0.0, freedom.move[:n].max(axis=1))
    table["changed most"] = np.where(free, "–", np.array(freedom.vehicles)[moved])
    return pd.DataFrame(table)


def _loss_factor_table(view: PlatformFront) -> pd.DataFrame:
    """List factor of each pick on the loss factors, which stand behind the stiffnesses."""
    n = len(view.stiffness_variables)
    names = list(view.front.variables[n:])
    free = np.isin(names, view.front.without_effect)
    table: dict[str, object] = {"variable": names}
    table |= {f"{name} factor [1]": x[n:] for name, x in view.front.pick_designs.items()}
    for column, bound in zip(("from", "to"), view.freedom.interval[n:].T, strict=True):
        table[f"best-mean {column} [1]"] = np.where(free, np.nan, bound)
    return pd.DataFrame(table)


def _search(report: Report, view: PlatformFront) -> None:
    """Say what was asked, with which data, and how the search went."""
    space, sampler, case = view.front.robust.space, view.front.robust.sample, view.load_case
    motion, search, lines = view.motion_report, view.front.search, view.fleet.frequency
    cases = ", ".join(
        f"{view.platform.load_case(part.load_case).title} (weight {weight:.3g})"
        for part, weight in zip(view.index.cases, view.index.weights, strict=True)
    )
    summed = "sum" if view.fleet.weights is None else "weighted sum"
    factors = "stiffness factors"
    if len(view.front.variables) > len(view.stiffness_variables):
        factors = "factors of stiffness (K' and K'' alike) and of loss (K'' alone, exactly made)"
    objectives = (
        f"Two objectives, both as small as possible: the {summed} over the vehicles of the mean "
        "SPLV, and the sum of its standard deviation σ; shown"
    )
    if aims := aim_note(view.front.robust):
        objectives = f"{aims} Mean and σ are shown"
    paragraphs = (
        f"{view.platform.title}: {view.platform.description}",
        f"Vehicles: {listed(view.fleet.vehicles)}. Load cases: {cases}. Lines: "
        f"{lines.size} between {lines[0]:g} and {lines[-1]:g} Hz, engine order "
        f"{case.order:g}. Motion: {motion_name(view.index)}; meaning of a stiffness "
        f"factor: {motion.factor}.",
        f"Design variables: {len(view.front.variables)} {factors}, each between "
        f"{space.lower.min():g} and {space.upper.max():g}. "
        f"Manufacturing scatter: ±{PERCENT * space.tolerance.max():.0f} % of the design's own "
        f"stiffness as three standard deviations, {sampler.n_samples} draws ({sampler.kind}). "
        f"{objectives} divided by the number of vehicles and lines.",
        f"{search.algorithm}, {search.stopped}, {search.seconds:.1f} s. "
        f"{view.front.text} In the search σ was wrong by "
        f"{signed(view.front.sigma_bias_percent, 2)} % and its mean by "
        f"{signed(view.front.mean_bias * view.front.per_line, 3)} dB on average.",
        motion.text,
    )
    report.section(
        "What was asked, and how it was searched",
        "\n\n".join(paragraphs).strip(),
        folded=True,
    )
    report.figure(
        "convergence",
        view.front.convergence_picture,
        "Difference between the front of each generation and the last front at equal σ, mean over "
        "its range, before gradients. A flat end means that more generations would not have "
        "helped.",
    )


def aim_note(robust: Robust) -> str:
    """Say what a report must say about objectives that are not the two sums; empty otherwise."""
    names = tuple(objective.name for objective in robust.objectives)
    if robust.objectives == (MEAN_SUM, SIGMA_SUM):
        return ""
    if robust.objectives[:2] == (MEAN_SUM, SIGMA_SUM):
        return (
            f"Beside the mean level and its σ the search minimised {listed(names[2:])}. "
            "Figures of mean and sigma show designs that others beat there, but not in all "
            "objectives."
        )
    return (
        f"The search minimised {listed(names)}; picks are those of these objectives. Tables "
        "and figures show mean and sigma, in which the front is not a front."
    )


class Question(StrEnum):
    """A further question to the model of the search."""

    correlation = "correlation"
    sensitivity = "sensitivity"
    prescribed = "prescribed"


SAME_DOE = ("doe", "n_designs", "n_failed")
"""What the vehicles of a group would say of the DOE once more."""


def report_answers(
    report: Report, answers: Mapping[str, Report], questions: Collection[Question]
) -> None:
    """Add the answers to further questions: a sentence each, and a page of their own.

    - `answers`: report of each answer by its question, or by a longer name where one has several.
    - `questions`: that were asked.
    """
    blocks: list[str | Link] = []
    for name, part in answers.items():
        _include(report, part, name)
        words = name.replace("_", " ")
        blocks += [part.verdict] * (name in set(Question))
        blocks.append(Link(f"{name}.html", f"The page on {words}"))
    if Question.correlation in questions and Question.correlation not in answers:
        blocks.append("There is one vehicle only: nothing to correlate, and no DOE was run.")
    report.panel("Further questions", *blocks, wide=True)


def _include(report: Report, part: Report, name: str) -> None:
    """Add the answer to a further question; its files and numbers begin with its name."""
    names = {key: f"{name}_{key}" for key in (*part.tables, *part.pictures, *part.summary)}
    if name not in set(Question):
        names |= dict.fromkeys(SAME_DOE, "")
    report.include(part, names=names, page=name)
