"""Correlation of vehicles and of vehicle groups, from designs to pages."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from deboom import plot
from deboom.arrays import RealArray
from deboom.errors import InputError, listed
from deboom.explore.correlation import (
    Correlations,
    Families,
    correlations,
    families,
    input_correlations,
    tolerance_scatter,
)
from deboom.explore.doe import (
    Doe,
    box_behnken,
    central_composite,
    doe_frame,
    fractional_factorial,
    full_factorial,
    latin_hypercube,
    run_doe,
    sobol_designs,
)
from deboom.explore.space import DesignSpace
from deboom.files.doe_table import read_plan
from deboom.pages.front_answer import abbreviations
from deboom.plot.correlations import MOST
from deboom.plot.style import at_least, signed, vehicle_colours
from deboom.report import Report, Step, Table
from deboom.vehicles.booming_model import BoomingModel
from deboom.vehicles.design_factor import factor_space
from deboom.vehicles.fleet_front import sound_rows
from deboom.vehicles.platform import Runs

SHOWN = 6
"""Design variables that a grid of levels shows."""


class Plan(Enum):
    """How designs are laid out within their bounds."""

    latin_hypercube = "latin-hypercube"
    """Space-filling, maximin; any number of designs."""
    sobol = "sobol"
    """Space-filling, scrambled Sobol points; a power of two."""
    full_factorial = "full-factorial"
    """All corners."""
    fractional_factorial = "fractional-factorial"
    """The corners that ``--generators`` keep."""
    box_behnken = "box-behnken"
    """Edges and middle, no corner."""
    central_composite = "central-composite"
    """Corners (those of ``--generators``, if given), star and middle."""


@dataclass(frozen=True)
class DoeRequest:
    """What a study was asked to evaluate.

    - `n_designs`: of a space-filling plan; those of fixed levels have their own number.
    - `generators`: of a fractional factorial, see `deboom.explore.doe.fractional_factorial`.
    - `table`: a user's own designs instead of a plan, see `deboom.files.doe_table.read_plan`.
    """

    plan: Plan
    n_designs: int
    seed: int
    generators: str | None = None
    table: Path | None = None

    @property
    def inputs(self) -> tuple[Path, ...]:
        """Files that the designs come from."""
        return () if self.table is None else (self.table,)

    @property
    def words(self) -> str:
        """What the designs are, in words."""
        if self.table is not None:
            return f"table {self.table.name}"
        kind = {Plan.latin_hypercube: "Latin hypercube", Plan.sobol: "Sobol"}
        if self.plan in kind:
            return f"{kind[self.plan]}, seed {self.seed}"
        return " ".join((str(self.plan.value).replace("-", " "), self.generators or "")).strip()

    def designs(self, space: DesignSpace) -> RealArray:
        """Return the asked designs, shape (n, k) [units of the space].

        - raises InputError: see the plans and `deboom.files.doe_table.read_plan`.
        """
        if self.table is not None:
            return read_plan(self.table, space)
        if self.plan is Plan.latin_hypercube:
            return latin_hypercube(space, self.n_designs, seed=self.seed)
        if self.plan is Plan.sobol:
            return sobol_designs(space, self.n_designs, seed=self.seed)
        if self.plan is Plan.box_behnken:
            return box_behnken(space)
        if self.plan is Plan.full_factorial:
            return full_factorial(space)
        if self.plan is Plan.central_composite:
            return central_composite(space, self.generators)
        if self.generators is None:
            raise InputError(
                "a fractional factorial needs --generators: one word of letters per variable, such "
                "as 'a b c abc'"
            )
        return fractional_factorial(space, self.generators)


@dataclass(frozen=True, eq=False)
class CorrelationSet:
    """The same responses correlated in three ways.

    - `designs`: of the designs as they are: the thesis.
    - `means`: of the designs' means over their manufacturing scatter.
    - `scatter`: of the scatter alone: each draw less its design's mean, all designs pooled.
    """

    designs: Correlations
    means: Correlations
    scatter: Correlations

    @property
    def kinds(self) -> dict[str, Correlations]:
        """The three, with the words for them."""
        return {
            "designs": self.designs,
            "means over the tolerance": self.means,
            "tolerance scatter": self.scatter,
        }


@dataclass(frozen=True, eq=False)
class Levels:
    """Mean level of the lines of several listeners, for designs and for their scatter.

    - `names`: vehicles, or sums of vehicles.
    - `designs` (n, r): of the designs as they are [dB(A)].
    - `means` (n_toleranced, r): of the designs whose draws could all be computed, mean over the
      draws [dB(A)].
    - `scatter` (n_toleranced, m, r): draws less those means [dB].
    """

    names: tuple[str, ...]
    designs: RealArray
    means: RealArray
    scatter: RealArray

    def averaged(self, groups: Mapping[str, Sequence[str]]) -> Levels:
        """Return the means over groups of names."""
        member = np.array(
            [[(name in of) / len(of) for of in groups.values()] for name in self.names]
        )
        return Levels(
            tuple(groups), self.designs @ member, self.means @ member, self.scatter @ member
        )

    def correlated(self, seed: int, resamples: int) -> CorrelationSet:
        """Correlate all pairs of names in all three ways.

        - raises InputError: see `deboom.explore.correlation.correlations`.
        """
        return CorrelationSet(
            *(
                correlations(values, self.names, seed=seed, resamples=resamples)
                for values in (self.designs, self.means, self.scatter)
            )
        )


@dataclass(frozen=True, eq=False)
class CorrelationStudy:
    """A DOE over a platform's mounts, and who goes with whom in it.

    - `runs`, `index`: vehicles, load cases and band, and what was evaluated.
    - `doe`, `plan`: all designs with their responses, and how they were laid out.
    - `seed`, `resamples`: of the bootstrap; `cut`: least correlation within a family [1].
    - `inputs`: files that the designs came from.
    """

    runs: Runs
    index: BoomingModel
    doe: Doe
    plan: str
    vehicles: Levels
    seed: int
    resamples: int
    cut: float
    inputs: tuple[Any, ...]

    def within(self, runs: Runs, index: BoomingModel) -> CorrelationStudy | None:
        """Return the DOE of the vehicles of another model; None if these are one, or all."""
        names = tuple(index.response_names[row] for row in sound_rows(index))
        if len(names) < 2 or names == self.names:
            return None
        levels, columns = self.vehicles, [self.names.index(name) for name in names]
        some = Levels(
            names,
            levels.designs[:, columns],
            levels.means[:, columns],
            levels.scatter[..., columns],
        )
        return replace(self, runs=runs, index=index, vehicles=some)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the vehicles."""
        return self.vehicles.names

    @property
    def n_untoleranced(self) -> int:
        """Designs that were computed, but not all of their tolerance draws."""
        return len(self.vehicles.designs) - len(self.vehicles.means)

    @property
    def group_of(self) -> dict[str, str]:
        """Group of every ear."""
        return {
            receiver.response_name(vehicle.name): vehicle.group
            for vehicle in self.runs.fleet.vehicles
            for receiver in vehicle.transfers
        }

    @cached_property
    def groups(self) -> dict[str, tuple[str, ...]]:
        """Vehicles of every group, in the platform's order."""
        of = self.group_of
        return {
            group: tuple(name for name in self.names if of[name] == group)
            for group in dict.fromkeys(of.values())
        }

    @cached_property
    def by_vehicle(self) -> CorrelationSet:
        """All pairs of vehicles."""
        return self.vehicles.correlated(self.seed, self.resamples)

    @cached_property
    def group_levels(self) -> Levels:
        """Means over the vehicles of each group."""
        return self.vehicles.averaged(self.groups)

    @cached_property
    def by_group(self) -> CorrelationSet | None:
        """All pairs of groups; None if there is only one."""
        if len(self.groups) < 2:
            return None
        return self.group_levels.correlated(self.seed, self.resamples)

    @cached_property
    def families(self) -> Families:
        """Vehicles that can share one mount set."""
        return families(self.names, self.by_vehicle.designs.pearson, self.cut)

    def with_factors(self, levels: Levels) -> Correlations:
        """Correlate the factors that vary with levels over the designs."""
        return input_correlations(
            self.doe.space,
            self.doe.computed_designs,
            levels.designs,
            levels.names,
            seed=self.seed,
            resamples=self.resamples,
        )

    def mean_with_others(self, name: str) -> float:
        """Return the mean correlation of one vehicle with all others [1]."""
        others = [other for other in self.names if other != name]
        return float(self.by_vehicle.designs.between(name, others).mean())

    def least_alike(self) -> str:
        """Return the vehicle with the lowest mean correlation with the others."""
        return min(self.names, key=self.mean_with_others)


def correlation_study(
    runs: Runs,
    index: BoomingModel,
    request: DoeRequest,
    *,
    half_width: float,
    tolerance: float,
    draws: int,
    resamples: int,
    cut: float,
) -> CorrelationStudy:
    """Evaluate a DOE, let its designs scatter, and prepare their correlation.

    - `request`: which designs, with the seed of everything that is drawn.
    - `half_width`, `tolerance`: of the designs' bounds and of their scatter [1].
    - `draws`: of the scatter per design, a power of two; `resamples`: of the bootstrap.
    - `cut`: least correlation within a family [1].
    - raises InputError: fewer than two vehicles; see also `DoeRequest.designs`.
    """
    ears = sound_rows(index)
    names = tuple(index.response_names[ear] for ear in ears)
    if len(names) < 2:
        raise InputError(f"only vehicle {names[0]} was asked for: a correlation needs two")
    space = factor_space(index.variable_names, half_width, tolerance)
    doe = run_doe(index, space, request.designs(space), name=runs.platform.name, plan=request.words)
    means, scatter = tolerance_scatter(
        index, space, doe.computed_designs, n_draws=draws, seed=request.seed
    )
    whole = np.isfinite(scatter).all(axis=(1, 2))
    scale = 1.0 / index.n_lines
    levels = Levels(
        names,
        doe.computed[:, ears] * scale,
        means[whole][:, ears] * scale,
        scatter[whole][..., ears] * scale,
    )
    return CorrelationStudy(
        runs=runs,
        index=index,
        doe=doe,
        plan=request.words,
        vehicles=levels,
        seed=request.seed,
        resamples=resamples,
        cut=cut,
        inputs=request.inputs,
    )


def key_of(names: Sequence[str]) -> str:
    """Return a short name of several vehicles for summary keys, ``u06_1_4`` for U06-1 to U06-4."""
    head = re.match(r"(.*\W)?", names[0])
    shared = head[0] if head and all(name.startswith(head[0]) for name in names) else ""
    parts = [names[0], names[-1].removeprefix(shared)][: len(names)]
    return re.sub(r"\W+", "_", " ".join(parts)).strip("_").lower()


def correlation_report(study: CorrelationStudy, apart: str | None = None) -> Report:
    """Report who goes with whom: groups where there are several, else one vehicle held apart.

    - `study`: all vehicles of a platform, or those of one group.
    - `apart`, optional: vehicle of a single group that is compared with the others; by default the
      least alike one.
    - raises InputError: an unknown vehicle.
    """
    if study.by_group is None:
        return _vehicle_report(study, apart)
    return _group_report(study, study.by_group)


def _group_report(study: CorrelationStudy, by_group: CorrelationSet) -> Report:
    """Report groups with each other, then all vehicles."""
    designs = study.by_vehicle.designs
    worst = min(by_group.designs.pairs, key=lambda pair: by_group.designs.pearson[pair])
    r_min = float(by_group.designs.among(by_group.designs.names).min())
    report = _begun(
        study,
        "Correlation of vehicle groups",
        "Do the levels of groups and vehicles of a platform rise and fall together when mount "
        "stiffnesses change, so that one group can represent the others?",
    )
    pair = " and ".join(by_group.designs.names[place] for place in worst)
    least = f"{at_least(r_min, 2)} or more ({pair})"
    _answer(report, study, f"the means of any two groups correlate by {least}")
    report.number(
        "r_group_min",
        r_min,
        "1",
        "least correlation of two groups over the designs",
        headline=".2f",
    )
    report.number(
        "r_group_min_from",
        float(by_group.designs.pearson_low[worst]),
        "1",
        "lower end of the 95 % interval of r_group_min",
    )
    report.number(
        "r_group_min_to",
        float(by_group.designs.pearson_high[worst]),
        "1",
        "upper end of the 95 % interval of r_group_min",
    )
    report.number(
        "r_group_min_means",
        float(by_group.means.among(by_group.means.names).min()),
        "1",
        "least correlation of the means of two groups over the scatter",
    )
    report.number(
        "r_group_min_tolerance",
        float(by_group.scatter.among(by_group.scatter.names).min()),
        "1",
        "least correlation of the scatter of two groups",
    )
    sizes = ", ".join(f"{name} ({len(members)})" for name, members in study.groups.items())
    report.section("Groups", f"The index of a group is the mean over its vehicles: {sizes}.")
    names = by_group.designs.names
    of = by_group.designs
    lowest = float(of.pearson.min())
    matrix = plot.HeatMap(
        "designs",
        names,
        names,
        of.pearson,
        limits=(-1.0 if lowest < 0.0 else 0.0, 1.0),
        texts=_with_intervals(of),
    )
    kinds = [
        f"{float(other.among(names).min()):.2f} ({kind})"
        for kind, other in by_group.kinds.items()
        if other is not of
    ]
    report.figure(
        "group_matrix",
        lambda: plot.heat_maps([matrix], columns=2),
        "Pearson's correlation of the groups over the designs (thesis, figure 44), with its 95 % "
        f"interval. Least of the others: {', '.join(kinds)}; group_pairs.csv has all.",
    )
    _append_clouds(report, study, study.group_levels, by_group, "groups")
    report.table("group_matrix", _matrix_table(by_group.designs))
    report.table("group_pairs", _pair_table(by_group))
    _append_factors(report, study, study.group_levels)
    report.section(
        "Vehicles",
        "Every vehicle with every other one, over the designs; the intervals, Spearman's "
        "coefficients and those of means and tolerance scatter are in vehicle_pairs.csv.",
    )
    report.table("vehicle_matrix", _matrix_table(designs))
    report.table("vehicle_pairs", _pair_table(study.by_vehicle))
    _append_families(report, study)
    return report


def _with_intervals(of: Correlations) -> npt.NDArray[np.str_]:
    """Write each coefficient above its interval, shape (n, n); 1 on the diagonal."""
    rows = zip(of.pearson, of.pearson_low, of.pearson_high, strict=True)
    return np.array(
        [
            [
                "1" if i == j else f"{r:.3f}\n{low:.3f} … {high:.3f}"
                for j, (r, low, high) in enumerate(zip(*row, strict=True))
            ]
            for i, row in enumerate(rows)
        ]
    )


def _answer(report: Report, study: CorrelationStudy, finding: str) -> None:
    """Fill the first screen: who can share a mount set, family by family, and what comes next."""
    families, designs = study.families, study.by_vehicle.designs
    alone = [names[0] for names in families.members if len(names) == 1]
    if len(families.members) == 1:
        verdict = "One mount set quietens all vehicles alike"
    elif alone:
        verdict = (
            f"Judge {listed(tuple(alone))} by {'itself' if len(alone) == 1 else 'themselves'}; the "
            "others can share mount sets"
        )
    else:
        verdict = f"{len(families.members)} families of vehicles, each with a mount set of its own"
    half_width = float(np.max(designs.pearson_high - designs.pearson_low)) / 2.0
    report.answer(
        f"{verdict}: {finding}.",
        f"A family: any two of its vehicles correlate by {families.cut:g} or more over "
        f"{len(study.doe)} designs. A change that makes one of its vehicles quieter makes the "
        "others quieter as well, but not by the same amount.",
        f"How sure: with other designs r of two vehicles would move by ± {half_width:.2f} at most "
        "(95 %).",
        "What not to trust: r says how alike vehicles react, not how quiet they become. Other "
        "vehicles of a group are not in its intervals. Levels are the model's.",
        abbreviations(study.runs.platform.mounts),
    )
    rows = [
        {
            "family": place,
            "vehicles": listed(tuple(members)),
            "least r within [1]": float(designs.among(members).min()) if len(members) > 1 else None,
            "mean r with all others [1]": float(
                np.mean([study.mean_with_others(name) for name in members])
            ),
        }
        for place, members in enumerate(families.members, 1)
    ]
    decimals = dict.fromkeys(("least r within [1]", "mean r with all others [1]"), 2)
    report.panel("Families", Table(pd.DataFrame(rows), "", decimals), wide=True)
    report.panel(
        "What to do next",
        Step("deboom run commonality", "how few part numbers serve them all"),
        Step("deboom run front --group GROUP", "mounts for one group"),
        Step("deboom run front --group all", "mounts for all vehicles"),
    )


def _vehicle_report(study: CorrelationStudy, apart: str | None) -> Report:
    """Report the vehicles of one group, one of them compared with the others."""
    if apart is not None and apart not in study.names:
        raise InputError(f"--apart '{apart}' is no vehicle of this study: use {list(study.names)}")
    kinds, designs = study.by_vehicle.kinds, study.by_vehicle.designs
    report = _begun(
        study,
        "Correlation of vehicles",
        f"Do {', '.join(study.names)} rise and fall together when mount stiffnesses change, so "
        "that one mount set can serve them all?",
    )
    others: tuple[str, ...] = ()
    if len(study.names) > 2:
        held = "has" if apart else "is least alike,"
        apart = apart or study.least_alike()
        others = tuple(name for name in study.names if name != apart)
        alike = float(designs.among(others).min())
        mean = float(designs.between(apart, others).mean())
        least = f"{at_least(alike, 2)} or more"
        finding = f"{apart} {held} r = {mean:.2f} with the others, which have {least}"
        _answer(report, study, finding)
        report.number("apart", apart, "", "vehicle that is compared with the others", headline="s")
        one, rest = key_of([apart]), key_of(others)
        for kind, of in zip(("", "_means", "_tolerance"), kinds.values(), strict=True):
            report.number(
                f"r_{rest}_min{kind}",
                float(of.among(others).min()),
                "1",
                "least correlation of two of the others: over designs, their means, their scatter",
            )
            report.number(
                f"r_{one}_mean{kind}",
                float(of.between(apart, others).mean()),
                "1",
                "mean correlation of the one vehicle with the others: over designs, their means, "
                "their scatter",
            )
    shift = np.max([np.abs(of.pearson - designs.pearson) for of in kinds.values()])
    report.section(
        "Vehicle by vehicle",
        "A narrow cloud means that what quietens one vehicle quietens the other. The correlations "
        f"of means and of tolerance scatter differ from those of the designs by {shift:.2f} at "
        "most; the intervals say how much of that is chance.",
    )
    _append_clouds(report, study, study.vehicles, study.by_vehicle, "vehicles")
    report.table("matrix", _matrix_table(designs))
    report.table("pairs", _pair_table(study.by_vehicle))
    _append_factors(report, study, study.vehicles)
    _append_families(report, study)
    return report


def _begun(study: CorrelationStudy, title: str, question: str) -> Report:
    """Begin a report: what was evaluated, its DOE and the numbers that every such report has."""
    doe, space, platform = study.doe, study.doe.space, study.runs.platform
    report = Report(title, question)
    report.explain("booming noise", "SPL", "SPLV", "stiffness factor", "tolerance", "σ")
    report.explain("noise transfer function", "correlation", "family of vehicles")
    report.number(
        "n_families",
        len(study.families.members),
        "",
        "families of vehicles that one mount set quietens alike",
        headline="d",
    )
    report.number("n_designs", len(doe), "", "designs evaluated")
    report.number("n_failed", doe.n_failed, "", "designs that could not be computed")
    report.number(
        "r_vehicle_min",
        float(study.by_vehicle.designs.among(study.names).min()),
        "1",
        "least correlation of two vehicles over the designs",
    )
    report.facts |= {"plan": study.plan, "kernel": study.index.kernel}
    report.inputs += [*platform.input_files, *study.inputs]
    cases = ", ".join(
        f"{platform.load_case(case.name).title} (weight {weight:g})"
        for case, weight in study.runs.cases
    )
    lost = ""
    if study.n_untoleranced:
        lost = f"; {study.n_untoleranced} of them failed in some draw and have no scatter"
    report.section(
        "What was asked, and with which data",
        f"{platform.title}: {platform.description}\n\n"
        f"Load cases: {cases}. Lines: {study.index.n_lines} between {study.runs.band[0]:g} and "
        f"{study.runs.band[1]:g} Hz. A vehicle's index is SPLV, the sum of its SPL over the lines, "
        "shown divided by their number.\n\n"
        f"{len(doe)} designs ({study.plan}) of {space.n_variables} stiffness factors between "
        f"{space.lower.min():g} and {space.upper.max():g}; {doe.n_failed} failed. Each was "
        f"also made {study.by_vehicle.scatter.n_draws} times within its tolerance of "
        f"±{100 * space.tolerance.max():.0f} % (three standard deviations){lost}.\n\n"
        "Three correlations are computed. Designs: levels of the designs without scatter, as in "
        "the thesis. Means: mean level of each design over its scatter. Tolerance scatter: each "
        "draw minus the mean of its design, for all designs together. Intervals are "
        f"95 % bootstrap intervals over the designs ({study.resamples} resamples): they say how "
        "much the coefficients would move with other designs, not with other vehicles.",
        folded=True,
    )
    report.table("doe", doe_frame(doe))
    return report


def _append_clouds(
    report: Report, study: CorrelationStudy, levels: Levels, sets: CorrelationSet, stem: str
) -> None:
    """Show responses over each other and over the leading variables; none if there are too many."""
    if len(levels.names) > MOST:
        return
    label = "mean level of the lines [dB(A)]"
    of, colours = sets.designs, vehicle_colours(study.runs.platform.fleet.names)
    r = (of.pearson, of.pearson_low, of.pearson_high)
    report.figure(
        f"{stem}_designs",
        lambda: plot.scatter_matrix(levels.names, levels.designs, r, colours, value_label=label),
        f"Designs: each dot is one design (thesis, figure {44 if stem == 'groups' else 45}).",
    )
    level, spread = "mean level [dB(A)]", "σ [dB]"
    sigma = levels.scatter.std(axis=1, ddof=1)
    pairs = {
        name: {level: levels.means[:, k], spread: sigma[:, k]}
        for k, name in enumerate(levels.names)
    }
    shown = colours if set(pairs) <= set(colours) else vehicle_colours(levels.names)
    report.figure(
        f"{stem}_objectives",
        lambda: plot.grouped_pairs(pairs, {name: shown[name] for name in pairs}),
        "Both objectives of the designs: the mean over the scatter of parts, and its standard "
        "deviation.",
    )
    frames = [pd.DataFrame({"of": name, **columns}) for name, columns in pairs.items()]
    report.table(f"{stem}_objectives", pd.concat(frames, ignore_index=True))
    designs, names = study.doe.computed_designs, study.doe.space.names
    both = np.corrcoef(designs.T, levels.designs.T)[: len(names), len(names) :]
    leading = sorted(np.argsort(-np.nanmax(np.abs(both), axis=1), kind="stable")[:SHOWN])
    variables = {names[place]: designs[:, place] for place in leading}
    responses = dict(zip(levels.names, levels.designs.T, strict=True))
    report.figure(
        f"{stem}_variables",
        lambda: plot.variable_grid(variables, responses, label),
        f"The same levels over the {len(leading)} stiffness factors with the largest influence; "
        "doe.csv has all.",
    )


def _append_families(report: Report, study: CorrelationStudy) -> None:
    """Say which vehicles can share one mount set."""
    families, names = study.families, study.names
    designs = study.by_vehicle.designs
    number = [families.number(name) for name in names]
    report.section(
        "Which vehicles can share one mount set?",
        f"{len(families.members)} famil{'y' if len(families.members) == 1 else 'ies'} at "
        f"r = {families.cut:g}: within a family any two vehicles correlate by {families.cut:g} or "
        "more over the designs (hierarchical clustering of 1 − r, complete linkage). A change "
        "that makes one vehicle of a family quieter then makes the others quieter as well; σ over "
        "designs shows by how much. Check a vehicle that is alone in its family before it gets "
        "the mounts of the others.",
    )
    report.figure(
        "families",
        lambda: plot.clustered_matrix(
            names, designs.pearson, families.merges, number, families.cut
        ),
        "Pearson's correlation of the vehicles over the designs, in the order of their tree. Two "
        "branches join at the correlation of their worst pair; branches right of the dashed line "
        "are families, each with its colour.",
    )
    rows = []
    for place, members in enumerate(families.members, 1):
        inside = {kind: of.among(members) for kind, of in study.by_vehicle.kinds.items()}
        worst = {
            f"least r, {kind} [1]": float(r.min()) if r.size else np.nan
            for kind, r in inside.items()
        }
        rows.append({"family": place, "vehicles": ", ".join(members), **worst})
    report.table(
        "families",
        pd.DataFrame(rows),
        "Families and their worst pairs, in all three correlations.",
        {name: 2 for name in rows[0] if name.endswith("[1]")},
    )
    report.section("Vehicle by vehicle, in their families", folded=True)
    report.table(
        "vehicles",
        _vehicles_in_families(study),
        "A dash: alone in its family.",
        {
            "least r within its family [1]": 2,
            "mean r with all others [1]": 2,
            "sigma over designs [dB]": 2,
            "sigma over the tolerance [dB]": 2,
        },
    )


def _vehicles_in_families(study: CorrelationStudy) -> pd.DataFrame:
    """List each vehicle with its family, its correlation within and outside, and its levels."""
    families, levels, names = study.families, study.vehicles, study.names
    designs = study.by_vehicle.designs
    number = [families.number(name) for name in names]
    relatives = [
        [other for other in families.members[place - 1] if other != name]
        for name, place in zip(names, number, strict=True)
    ]
    return pd.DataFrame(
        {
            "vehicle": list(names),
            "group": [study.group_of[name] for name in names],
            "family": number,
            "least r within its family [1]": [
                float(designs.between(name, others).min()) if others else np.nan
                for name, others in zip(names, relatives, strict=True)
            ],
            "mean r with all others [1]": [study.mean_with_others(name) for name in names],
            "mean level [dB(A)]": levels.designs.mean(axis=0),
            "sigma over designs [dB]": levels.designs.std(axis=0, ddof=1),
            "sigma over the tolerance [dB]": levels.scatter.std(axis=(0, 1)),
        }
    )


def _append_factors(report: Report, study: CorrelationStudy, levels: Levels) -> None:
    """Show how each stiffness factor goes with each level."""
    of = study.with_factors(levels)
    matrix = of.matrix.iloc[: of.n_inputs]
    pairs = of.of_inputs.rename(columns={"first": "factor", "second": "level of"})
    strongest = pairs.iloc[int(np.argmax(np.abs(pairs["pearson [1]"])))]
    report.section(
        "Stiffness factors",
        f"The factor of {strongest['factor']} goes with {strongest['level of']} most: r = "
        f"{signed(strongest['pearson [1]'], 2)}, 95 % interval "
        f"{signed(strongest['pearson from [1]'], 2)} to {signed(strongest['pearson to [1]'], 2)}.",
    )
    heat_map = plot.HeatMap(
        "",
        tuple(matrix.columns),
        tuple(matrix.index),
        matrix.to_numpy().T,
        column_title="stiffness factor",
        limits=(-1.0, 1.0),
    )
    report.figure(
        "factor_matrix",
        lambda: plot.heat_maps([heat_map], columns=1),
        "Pearson's correlation of each stiffness factor with each index over the designs: above 0 "
        "the index rises with the stiffness. An influence that is not a straight line shows less; "
        "factor_pairs.csv has the 95 % intervals and Spearman's coefficients.",
    )
    report.table("factor_pairs", pairs)


def _matrix_table(of: Correlations) -> pd.DataFrame:
    """Pearson's coefficients as a square: one row and one column per name."""
    columns = {f"{name} [1]": of.pearson[:, i] for i, name in enumerate(of.names)}
    return pd.DataFrame({"name": list(of.names), **columns})


def _pair_table(sets: CorrelationSet) -> pd.DataFrame:
    """One row per pair and kind: Pearson's coefficient with its interval, and Spearman's."""
    parts = []
    for kind, of in sets.kinds.items():
        parts.append(of.table)
        parts[-1].insert(0, "correlated", kind)
    return pd.concat(parts, ignore_index=True)
