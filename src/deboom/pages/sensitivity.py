"""Sensitivity of a fleet's levels: model runs, indices, tables, page."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cached_property, partial
from typing import TYPE_CHECKING, TypeVar

import numpy as np
import numpy.typing as npt
import pandas as pd

from deboom.arrays import PERCENT, RealArray
from deboom.errors import listed
from deboom.explore.sensitivity import (
    PairIndices,
    SensitivityInputs,
    SobolIndices,
    design_inputs,
    fast_sobol_indices,
    pair_indices,
    sobol_designs,
    sobol_indices,
    tolerance_inputs,
)
from deboom.explore.space import stiffness_factor_space
from deboom.measurement.booming_peaks import booming_peaks
from deboom.mounts.mount import Mount
from deboom.pages.front import drawn_rows, left_out, report_cells
from deboom.pages.front_answer import abbreviations
from deboom.pages.motion import factor_name, motion_name, motion_report
from deboom.plot import HeatMap, IntervalPanel, LineMap, heat_maps, interval_panels, line_maps
from deboom.plot.style import signed
from deboom.progress import Progress
from deboom.report import Report, Step, Table
from deboom.vehicles.booming_model import BoomingModel
from deboom.vehicles.fleet import LOSS_SUFFIX
from deboom.vehicles.platform import Platform

if TYPE_CHECKING:
    from deboom.plot import Figure


def line_levels(index: BoomingModel, designs: RealArray) -> RealArray:
    """Return the levels of all lines, vehicle by vehicle, weighted mean of the load cases [dB(A)].

    Of designs (n, k), shape (n, n_vehicle n_lines).
    """
    cases = zip(index.weights, index.load_case_names, strict=True)
    level = np.asarray(sum(weight * index.levels(designs, name) for weight, name in cases))
    return level.reshape(len(level), -1)


LINE_POINTS = 1024
"""Base points behind the indices of single lines, at most."""
TENTH = 0.1
"""Change of a stiffness that a slope is stated for [1]."""
PART = 2048  # designs evaluated at a time
LINES, MOUNTS, PAIRS, PRESCRIBED = "lines", "by mount", "pairs", "prescribed motion"
Jobs = dict[str, tuple[Callable[[RealArray], RealArray], RealArray]]


class Analysis(Enum):
    """What the variables do."""

    design = "design"
    """They are chosen: uniform within a range."""
    tolerance = "tolerance"
    """They scatter as parts do: gaussian, cut at three standard deviations."""


@dataclass(frozen=True)
class SensitivityPlan:
    """What is asked, and with which budget.

    - `analysis`: whose indices are ranked; the other one stands beside it.
    - `half_width`: stiffness factors of the design analysis run within ``1 ± half_width`` [1].
    - `beside`: the same for the design analysis that stands beside it [1].
    - `tolerance`: half width of the scatter, three standard deviations [1].
    - `n_base`: base points, a power of two.
    - `n_resamples`: behind every interval.
    - `seed`: from 1 upwards.
    - `pairs`: whether pairs of variables get indices of their own.
    """

    analysis: Analysis
    half_width: float
    beside: float
    tolerance: float
    n_base: int
    n_resamples: int
    seed: int
    pairs: bool = False

    def inputs(self, names: tuple[str, ...]) -> dict[str, SensitivityInputs]:
        """Return the variables of each analysis by its label; the ranked one comes first."""
        scatter = tolerance_inputs(stiffness_factor_space(names, 0.0, self.tolerance))
        every = {
            f"{Analysis.design.value} ±{100 * width:g} %": (
                Analysis.design,
                design_inputs(stiffness_factor_space(names, width, 0.0)),
            )
            for width in (self.half_width, self.beside)
        }
        label = f"{Analysis.tolerance.value} ±{100 * self.tolerance:g} % (3 σ)"
        every[label] = (Analysis.tolerance, scatter)
        order = sorted(every.items(), key=lambda item: item[1][0] is not self.analysis)
        return {label: inputs for label, (_, inputs) in order}


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Indices of a fleet, with all that its report needs.

    - `label`, `inputs`: of the ranked analysis; `indices`: of every vehicle, by SALib.
    - `by_mount`: with the variables of each mount as one; None for a single mount.
    - `beside`: other analyses of the same vehicles: first-order and total indices, by the label of
      what the analysis varies.
    - `lines`: of every vehicle and line, vehicle by vehicle, first and total.
    - `pairs`: of every vehicle and two variables; None where nobody wants them.
    - `prescribed`: as `indices`, with the motion as measured; None where `index` has it so.
    - `n_runs`: designs that were evaluated.
    """

    platform: Platform
    index: BoomingModel
    plan: SensitivityPlan
    label: str
    inputs: SensitivityInputs
    indices: SobolIndices
    by_mount: SobolIndices | None
    beside: Mapping[str, SobolIndices]
    lines: SobolIndices
    n_runs: int
    pairs: PairIndices | None = None
    prescribed: SobolIndices | None = None

    @property
    def vehicles(self) -> tuple[str, ...]:
        """Names of the vehicles."""
        return self.index.response_names

    @property
    def variables(self) -> tuple[str, ...]:
        """Names of the design variables."""
        return self.index.variable_names

    @cached_property
    def slope(self) -> RealArray:
        """Change of the mean level of a vehicle per `TENTH` more stiffness than today's [dB].

        Shape (n_variable, n_vehicle); central difference.
        """
        half = 0.5 * TENTH * np.eye(len(self.variables))
        return np.asarray((self.index(1.0 + half) - self.index(1.0 - half)) / self.index.n_lines)

    @cached_property
    def total_of_lines(self) -> RealArray:
        """Total index of the level of every line, shape (n_vehicle, n_variable, n_lines) [1]."""
        shape = (len(self.variables), len(self.vehicles), -1)
        return np.ascontiguousarray(self.lines.total.reshape(shape).transpose(1, 0, 2))

    @cached_property
    def ranking(self) -> dict[str, tuple[str, ...]]:
        """Variables of each vehicle by falling total index."""
        return ranked(self.indices)


def ranked(indices: SobolIndices) -> dict[str, tuple[str, ...]]:
    """Return the factors of each output by falling total index."""
    order = np.argsort(-indices.total, axis=0, kind="stable")
    return {
        output: tuple(indices.factors[place] for place in places)
        for output, places in zip(indices.outputs, order.T, strict=True)
    }


def sensitivity(
    platform: Platform,
    index: BoomingModel,
    plan: SensitivityPlan,
    progress: Progress | None = None,
    *,
    prescribed: BoomingModel | None = None,
) -> Sensitivity:
    """Run the designs and return all indices.

    - `platform`: its mounts are the groups.
    - `index`: to be evaluated.
    - `plan`: what is asked.
    - `prescribed`: the same model with the motion as measured, beside it.
    - raises InputError: a range, count or seed that cannot be used; a design without finite levels.
    """
    (label, inputs), *others = plan.inputs(index.variable_names).items()
    names = index.response_names
    grouped = _by_mount(inputs, platform.mounts)
    saltelli = partial(sobol_designs, n_base=plan.n_base, seed=plan.seed)
    designs = saltelli(inputs)
    few = designs[: min(LINE_POINTS, plan.n_base) * (inputs.n_variables + 2)]
    jobs: Jobs = {
        label: (index, designs),
        LINES: (partial(line_levels, index), few),
        **{other: (index, saltelli(theirs)) for other, theirs in others},
    }
    if grouped is not None:
        jobs[MOUNTS] = (index, saltelli(grouped))
    if plan.pairs:
        jobs[PAIRS] = (index, saltelli(inputs, pairs=True))
    if prescribed is not None:
        jobs[PRESCRIBED] = (prescribed, designs)
    values = _evaluated(jobs, progress)

    analyse = partial(sobol_indices, outputs=names, seed=plan.seed, n_resamples=plan.n_resamples)
    analysis = analyse(values[label], inputs.factors)
    by_mount = analyse(values[MOUNTS], grouped.factors) if grouped is not None else None
    indices = partial(
        fast_sobol_indices, factors=inputs.factors, seed=plan.seed, n_resamples=plan.n_resamples
    )
    beside = {other: indices(values[other], outputs=names) for other, _ in others}
    pairs = None
    if plan.pairs:
        pairs = pair_indices(
            values[PAIRS],
            inputs.factors,
            names,
            seed=plan.seed,
            n_resamples=plan.n_resamples,
        )
    lines = [f"{vehicle} at {line:g} Hz" for vehicle in names for line in index.frequency]
    return Sensitivity(
        platform=platform,
        index=index,
        plan=plan,
        label=label,
        inputs=inputs,
        indices=analysis,
        by_mount=by_mount,
        beside=beside,
        lines=indices(values[LINES], outputs=lines),
        n_runs=sum(len(rows) for _, rows in jobs.values()),
        pairs=pairs,
        prescribed=indices(values[PRESCRIBED], outputs=names) if prescribed is not None else None,
    )


def _by_mount(inputs: SensitivityInputs, mounts: tuple[Mount, ...]) -> SensitivityInputs | None:
    """Group the variables by mount; None where there is only one."""
    owner = {name: mount.name for mount in mounts for name in mount.variables}
    groups = [owner[name.removesuffix(LOSS_SUFFIX)] for name in inputs.names]
    return inputs.grouped(groups) if len(set(groups)) > 1 else None


def _evaluated(jobs: Jobs, progress: Progress | None) -> dict[str, RealArray]:
    """Evaluate all designs, a part at a time."""
    total, done = sum(len(rows) for _, rows in jobs.values()), 0
    values = {}
    for name, (evaluate, rows) in jobs.items():
        parts = []
        for start in range(0, len(rows), PART):
            parts.append(evaluate(rows[start : start + PART]))
            done += len(parts[-1])
            if progress is not None:
                progress(done, total, name)
        values[name] = np.concatenate(parts)
    return values


_T = TypeVar("_T", bound=np.generic)
MATTERS = 0.02
"""Total index from which a variable is shown where there is no room for all [1]."""
SLOPE = "level, 10 % stiffer [dB]"
"""Column of the change of a vehicle's mean level."""
STRONGEST = 3
"""Pairs of a vehicle that the page lists."""
LEADING = 3
"""Stiffnesses of a vehicle whose order is told."""
NEGLIGIBLE = 0.005
"""Total index, with its interval, below which a variable may be left out [1]."""


def index_table(indices: SobolIndices, factor: str) -> pd.DataFrame:
    """One row per vehicle and factor: first, total and interaction share with their intervals.

    - `indices`: of the vehicles.
    - `factor`: heading of the column of factors, such as ``variable``.
    """
    rank = 1 + np.argsort(np.argsort(-indices.total, axis=0, kind="stable"), axis=0, kind="stable")
    return pd.DataFrame(
        {
            **_keys(indices.outputs, **{factor: indices.factors}),
            "first order [1]": _long(indices.first),
            "first order interval ± [1]": _long(indices.first_interval),
            "total [1]": _long(indices.total),
            "total interval ± [1]": _long(indices.total_interval),
            "interaction [1]": _long(indices.interaction),
            "interaction interval ± [1]": _long(indices.interaction_interval),
            "rank": _long(rank),
            "zero": _zeros(indices),
        }
    )


def _zeros(indices: SobolIndices) -> list[str]:
    """Name the indices of each row that are not above their intervals."""
    kinds = {
        "first order": _long(indices.first <= indices.first_interval),
        "total": _long(indices.zero),
        "interaction": _long(indices.interaction <= indices.interaction_interval),
    }
    return [
        ", ".join(name for name, flag in zip(kinds, flags, strict=True) if flag)
        for flags in zip(*kinds.values(), strict=True)
    ]


def beside_table(study: Sensitivity) -> pd.DataFrame:
    """One row per vehicle and variable: the total index in every analysis."""
    every = {study.label: study.indices, **study.beside}
    columns = {}
    for label, indices in every.items():
        columns[f"total, {label} [1]"] = _long(indices.total)
        columns[f"interval ±, {label} [1]"] = _long(indices.total_interval)
    return pd.DataFrame({**_keys(study.vehicles, variable=study.variables), **columns})


def pair_table(indices: PairIndices) -> pd.DataFrame:
    """One row per vehicle and two variables, the strongest pairs of each vehicle first."""
    rows, columns = np.triu_indices(len(indices.factors), 1)
    parts = []
    for place, vehicle in enumerate(indices.outputs):
        second, interval = (
            values[rows, columns, place] for values in (indices.second, indices.second_interval)
        )
        part = pd.DataFrame(
            {
                "vehicle": vehicle,
                "variable": [indices.factors[row] for row in rows],
                "with": [indices.factors[column] for column in columns],
                "second order [1]": second,
                "second order interval ± [1]": interval,
                "zero": np.where(second <= interval, "second order", ""),
            }
        )
        parts.append(part.sort_values("second order [1]", ascending=False, kind="stable"))
    return pd.concat(parts, ignore_index=True)


def motion_table(study: Sensitivity) -> pd.DataFrame:
    """One row per vehicle and variable: total index with the study's and with prescribed motion."""
    assert study.prescribed is not None
    both = {motion_name(study.index): study.indices, "prescribed": study.prescribed}
    columns = {}
    for name, indices in both.items():
        columns[f"total, {name} [1]"] = _long(indices.total)
        columns[f"interval ±, {name} [1]"] = _long(indices.total_interval)
    return pd.DataFrame({**_keys(study.vehicles, variable=study.variables), **columns})


def line_table(study: Sensitivity) -> pd.DataFrame:
    """One row per vehicle and line: the total index of its level by every variable."""
    frequency = study.index.frequency
    columns = {
        f"{name} [1]": row for name, row in zip(study.variables, study.lines.total, strict=True)
    }
    return pd.DataFrame(
        {
            "vehicle": np.repeat(study.vehicles, frequency.size),
            "frequency [Hz]": np.tile(frequency, len(study.vehicles)),
            **columns,
            "largest interval ± [1]": study.lines.total_interval.max(axis=0),
        }
    )


def negligible(study: Sensitivity) -> tuple[str, ...]:
    """Variables whose total index with its interval stays below `NEGLIGIBLE` in every vehicle."""
    highest = (study.indices.total + study.indices.total_interval).max(axis=1)
    return tuple(study.variables[place] for place in np.flatnonzero(highest < NEGLIGIBLE))


def matters(study: Sensitivity) -> list[int]:
    """Places of the variables that matter in some vehicle; of many small ones the largest."""
    highest = study.indices.total.max(axis=1)
    return np.flatnonzero(highest >= min(MATTERS, highest.max())).tolist()


def _numbers(report: Report, study: Sensitivity) -> None:
    """Say which stiffnesses lead, which nobody hears, and every total index."""
    leaders = (f"{', then '.join(names)} in {listed(tuple(v))}" for names, v in _leaders(study))
    report.number("leading", "; ".join(leaders), "", "stiffnesses that matter most", headline="s")
    report.number(
        "n_unheard",
        len(negligible(study)),
        "",
        "stiffnesses that no vehicle hears",
        headline="d",
    )
    for column, vehicle in enumerate(study.vehicles):
        for row, variable in enumerate(map(_key, study.variables)):
            report.number(
                f"st_{variable}_{vehicle}",
                float(study.indices.total[row, column]),
                "1",
                "total Sobol index: share of the stiffness in the variance of the vehicle's level",
            )
    if study.by_mount is not None:
        for column, vehicle in enumerate(study.vehicles):
            for row, mount in enumerate(map(_key, study.by_mount.factors)):
                report.number(
                    f"st_mount_{mount}_{vehicle}",
                    float(study.by_mount.total[row, column]),
                    "1",
                    "total Sobol index of all directions of the mount together",
                )
    report.number(
        "largest_interval",
        float(study.indices.total_interval.max()),
        "1",
        "largest half width of the 95 % intervals of the total indices",
    )
    report.number(
        "largest_interaction",
        float(study.indices.interaction.max()),
        "1",
        "largest difference of total and first-order index",
    )
    report.number(
        "n_zero", int(study.indices.zero.sum()), "", "indices that are not above their interval"
    )
    report.number("n_runs", study.n_runs, "", "designs evaluated")


def _key(name: str) -> str:
    return name.replace(" ", "_")


def _keys(vehicles: tuple[str, ...], **factors: tuple[str, ...]) -> dict[str, object]:
    """Return the columns that name vehicle and factor of each row."""
    ((heading, names),) = factors.items()
    return {
        "vehicle": np.repeat(vehicles, len(names)),
        heading: list(names) * len(vehicles),
    }


def _long(values: npt.NDArray[_T]) -> npt.NDArray[_T]:
    """Turn (d, r) into one column, vehicle by vehicle."""
    return values.T.ravel()


TERMS = (
    "booming noise",
    "SPL",
    "SPLV",
    "booming peak",
    "sensitivity index",
    "stiffness factor",
    "dynamic stiffness",
    "tolerance",
    "noise transfer function",
    "prescribed motion",
)


MOST_VEHICLES = 6
"""Vehicles of the first screen's table."""


def _answer(report: Report, study: Sensitivity) -> None:
    """Fill the first screen: who leads where, with shares and dB per 10 %, and what comes next."""
    words = [
        f"{' and '.join(names)} in {listed(tuple(vehicles))}" for names, vehicles in _leaders(study)
    ]
    verdict = f"Change {'; '.join(words)}"
    rows = sorted(matters(study), key=lambda row: -float(study.indices.total[row].mean()))
    heard = float(np.abs(study.slope[rows]).max()) if rows else 0.0
    unheard = negligible(study)
    report.answer(
        f"{verdict}: 10 % more or less of one stiffness moves a vehicle by up to {heard:.1f} dB.",
        f"No vehicle hears {listed(unheard)}: keep them as they are." if unheard else "",
        f"How sure: a share is known within ± {study.indices.total_interval.max():.2f} at worst "
        "(95 %).",
        f"Shares: of the variance of the mean level, alone and with others, {study.label}. "
        f"{abbreviations(study.platform.mounts)}",
    )
    shown = study.vehicles[:MOST_VEHICLES]
    table: dict[str, list[str]] = {"stiffness": [study.variables[row] for row in rows]}
    for column, vehicle in enumerate(shown):
        table[vehicle] = [
            f"{PERCENT * study.indices.total[row, column]:.0f} %, "
            f"{signed(float(study.slope[row, column]), 1)} dB"
            for row in rows
        ]
    beyond = len(study.vehicles) - len(shown)
    report.panel(
        "Each vehicle: share of the variance, and change by 10 % more stiffness",
        Table(pd.DataFrame(table), ""),
        f"sobol.csv has {beyond} further vehicles." if beyond else "",
        wide=True,
    )
    report.panel(
        "What to do next",
        Step("deboom run front", "the best set of stiffnesses"),
        Step("deboom report results/sensitivity/latest --supplier", "a page per mount"),
        Step("deboom run tolerance_allocation", "where a tolerance pays"),
    )


def sensitivity_report(study: Sensitivity) -> Report:
    """Report which stiffness matters: alone, by mount, line by line, under other questions."""
    plan, by_mount, report = study.plan, study.by_mount, _headed(study)
    _answer(report, study)
    report.section(
        "Stiffness by stiffness",
        "Share of the variance that comes from each stiffness: alone, and in total, together with "
        "others. An index that is not larger than its interval is shown as zero.",
    )
    index_figures(
        report,
        study,
        "sobol",
        study.indices,
        f"Sensitivity indices of every vehicle, {study.label} (thesis, figure 48).",
    )
    _mattering(
        report,
        study,
        "sobol",
        index_table(study.indices, "variable").assign(**{SLOPE: _long(study.slope)}),
        f"Stiffnesses of a total index of {MATTERS:g} and more in some vehicle; sobol.csv has all.",
    )
    if by_mount is not None:
        report.section(
            "Mount by mount",
            "All stiffnesses of a mount vary as one input: the share of each part.",
        )
        index_figures(
            report, study, "sobol_mounts", by_mount, "Sensitivity indices of whole mounts."
        )
        report.table("sobol_mounts", index_table(by_mount, "mount"))
    _pairs(report, study)
    _prescribed(report, study)
    report.section(
        "Line by line",
        "The same for the level of every single line. The passenger hears a stiffness that "
        "matters at a booming peak (▼). In the notches between the peaks, paths cancel and "
        "several stiffnesses share the variance.",
    )
    report.figure(
        "sobol_lines",
        lambda: _line_map(study),
        f"Total index of the level of each line, {study.lines.n_base} base points, largest half "
        f"interval {study.lines.total_interval.max():.2f}; ▼ today's booming peaks in the first "
        f"load case.{_left_out(study, 'sobol_lines')}",
    )
    report.table("sobol_lines", line_table(study))
    report.section(
        "Other ranges, the tolerance",
        "Dependence of the ranking on range and kind of analysis. A share does not show the size "
        "of the variance, which grows with the range.",
    )
    _mattering(
        report,
        study,
        "sobol_beside",
        beside_table(study),
        "Total indices. sobol_beside.csv has all, with intervals.",
    )
    _numbers(report, study)
    report.inputs += study.platform.input_files
    report.facts |= {
        "motion": motion_name(study.index),
        "design_factor": factor_name(study.index),
        "kernel": study.index.kernel,
        "variables": f"{plan.analysis.value}: {study.inputs.description}",
    }
    return report


def _pairs(report: Report, study: Sensitivity) -> None:
    """Show what two stiffnesses do together only, a matrix per vehicle."""
    pairs = study.pairs
    if pairs is None:
        return
    report.section(
        "Pairs of stiffnesses",
        "The share of the variance that two stiffnesses are behind together only (thesis, figure "
        "48, speaks of coupled effects); on the diagonal that of each alone. An index that is not "
        "above its own interval reads zero.",
    )
    shown = matters(study)
    names = tuple(study.variables[row] for row in shown)
    second = np.where(pairs.second <= pairs.second_interval, 0.0, pairs.second)
    maps = []
    for place in most_changed(study):
        matrix = second[np.ix_(shown, shown)][:, :, place]
        np.fill_diagonal(matrix, np.clip(pairs.first[shown, place], 0.0, 1.0))
        maps.append(HeatMap(f"{study.vehicles[place]} [1]", names, names, matrix))
    report.figure(
        "sobol_pairs",
        lambda: heat_maps(maps, columns=min(3, len(maps))),
        f"Second-order indices, {study.label}; stiffnesses that matter in some vehicle."
        f"{_left_out(study, 'sobol_pairs')}",
    )
    table = pair_table(pairs)
    strong = table[table["zero"] == ""].groupby("vehicle", sort=False).head(STRONGEST)
    if strong.empty:
        report.text("No pair is above its own interval; sobol_pairs.csv has all.")
        report.table("sobol_pairs", table)
        return
    caption = f"The {STRONGEST} strongest pairs of each vehicle; sobol_pairs.csv has all."
    report.table("sobol_pairs", table, caption, shown=strong.filter(regex="^(?!zero)"))


def _prescribed(report: Report, study: Sensitivity) -> None:
    """Say how prescribed motion, which is the thesis's, orders the stiffnesses otherwise."""
    if study.prescribed is None:
        return
    orders = (study.ranking, ranked(study.prescribed))
    words = []
    for vehicle in study.vehicles:
        here, prescribed_order = (", ".join(order[vehicle][:LEADING]) for order in orders)
        words.append(
            f"{vehicle}: {here}; prescribed {prescribed_order}."
            if here != prescribed_order
            else f"{vehicle}: {here}, in both."
        )
    report.section(
        "The order with prescribed motion",
        "The thesis keeps the powertrain's motion as measured, where a stiffness acts through its "
        f"own force alone; with {motion_name(study.index)} motion it moves the powertrain as well, "
        "and with it the forces of all other mounts. The leading stiffnesses:\n\n"
        + "\n\n".join(words),
        folded=True,
    )
    _mattering(
        report,
        study,
        "sobol_motion",
        motion_table(study),
        "Total indices. sobol_motion.csv has all, with intervals.",
    )


def _headed(study: Sensitivity) -> Report:
    """Begin the report: what was asked, and with which data."""
    indices, plan, frequency = study.indices, study.plan, study.index.frequency
    motion = motion_report(study.index, np.ones((1, len(study.variables))))
    report = Report(
        "Which stiffness matters",
        f"On which mount stiffnesses does the booming noise of {listed(study.vehicles)} between "
        f"{frequency[0]:g} and {frequency[-1]:g} Hz depend?",
    )
    report.explain(*(motion.terms.get(term, term) for term in TERMS))
    report.warn(*motion.warnings)
    report.section(
        "What was asked, and with which data",
        f"{study.platform.title}: {study.platform.description}\n\n"
        "The ranking is for SPLV, a sum of decibels, in which a notch counts like a peak. The "
        "maps show on which stiffnesses the loud lines depend.\n\n"
        f"Analysis: {plan.analysis.value}. {_meaning(study)} Vehicles: {listed(study.vehicles)}. "
        f"Load cases: {', '.join(study.index.load_case_names)}. Lines: {frequency.size}, engine "
        f"order {_order(study):g}.\n\n"
        f"{indices.n_base} base points of a scrambled Sobol sequence, {study.n_runs} designs "
        f"evaluated in all; intervals from {indices.n_resamples} bootstrap resamples. The tables "
        "are SALib's; lines come from its estimators in vectorised form.",
        folded=True,
    )
    return report


def _mattering(
    report: Report, study: Sensitivity, stem: str, table: pd.DataFrame, caption: str
) -> None:
    """Keep a table, and show of it the stiffnesses that matter, without further intervals."""
    names = [study.variables[row] for row in matters(study)]
    shown = table[table["variable"].isin(names)].filter(regex="^(?!interval|interaction|zero)")
    # intervals are a few hundredths wide
    digits = {name: 2 for name in map(str, shown) if name.endswith("[1]")}
    report.table(stem, table, caption, digits, shown=shown)


def _order(study: Sensitivity) -> float:
    """Engine order of the first load case."""
    return study.platform.load_case(study.index.load_case_names[0]).order


def _line_map(study: Sensitivity) -> Figure:
    """Draw the total index of every line, with today's booming peaks of the first load case."""
    lines, order = study.index.frequency, _order(study)
    level = study.index.levels(np.ones((1, len(study.variables))))[0]
    peaks = [[peak.frequency for peak in booming_peaks(row, lines, order)] for row in level]
    label = "total index of the level of a line [1]"
    maps = [
        LineMap(study.vehicles[row], study.total_of_lines[row], label, peaks=peaks[row])
        for row in most_changed(study)
    ]
    return line_maps(lines, order, study.variables, maps, columns=2)


def most_changed(study: Sensitivity) -> list[int]:
    """Return the vehicles with a panel, in their order: those that the stiffnesses change most."""
    return drawn_rows(np.abs(study.slope).max(axis=0))


def _left_out(study: Sensitivity, table: str) -> str:
    """Say in what table the vehicles stand that have no panel; nothing where all have one."""
    return left_out(len(study.vehicles), "that a stiffness changes most", table)


def index_figures(
    report: Report, study: Sensitivity, name: str, indices: SobolIndices, caption: str
) -> None:
    """Show the indices as panels; of a wide fleet those changed least are cells of a matrix."""
    drawn = most_changed(study)
    report.figure(
        name,
        lambda: interval_panels(indices.factors, _panels(indices, drawn), columns=3),
        caption + _left_out(study, name),
    )
    total = np.where(indices.zero, 0.0, indices.total)
    report_cells(
        report, f"{name}_others", "total index", indices.factors, indices.outputs, total, drawn
    )


def _panels(indices: SobolIndices, vehicles: Sequence[int]) -> list[IntervalPanel]:
    """Total indices with their intervals and those alone; what is not above its interval is 0."""
    panels = []
    total = np.where(indices.zero, 0.0, indices.total)
    half = np.where(indices.zero, 0.0, indices.total_interval)
    alone = np.where(indices.zero, 0.0, np.clip(indices.first, 0.0, indices.total))
    for place in vehicles:
        values, first, reach = total[:, place], alone[:, place], half[:, place]
        groups = {
            "total, 95 % interval": (values, values - reach, values + reach),
            "alone (first order)": (first, first, first),
        }
        panels.append(IntervalPanel("share of the variance [1]", groups, indices.outputs[place]))
    return panels


def _meaning(study: Sensitivity) -> str:
    """Say what varies, and how."""
    what = f"Each of {len(study.variables)} stiffness factors is {study.inputs.description}, "
    if study.plan.analysis is Analysis.design:
        return f"{what}on its own: what a designer may choose."
    return f"{what}on its own: what manufacturing does to today's parts."


def _leaders(study: Sensitivity) -> list[tuple[tuple[str, ...], list[str]]]:
    """Pairs of leading variables with the vehicles that have them; the three most frequent."""
    groups: dict[tuple[str, ...], list[str]] = {}
    for vehicle, names in study.ranking.items():
        groups.setdefault(names[:2], []).append(vehicle)
    return sorted(groups.items(), key=lambda item: -len(item[1]))[:3]
