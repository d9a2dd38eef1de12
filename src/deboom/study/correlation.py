"""Correlation of vehicles and of vehicle groups, from designs to pages."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from deboom import plot as figures
from deboom.arrays import RealArray
from deboom.bench.unselected_fleets import Rate, UnselectedFleets, load_unselected
from deboom.errors import InputError
from deboom.explore.correlation import (
    Correlations,
    Families,
    correlations,
    families,
    tolerance_scatter,
)
from deboom.explore.doe import (
    Doe,
    box_behnken,
    central_composite,
    continue_doe,
    fractional_factorial,
    full_factorial,
    latin_hypercube,
    resolution,
    run_doe,
    sobol_designs,
    within_bounds,
)
from deboom.explore.space import DesignSpace, Evaluate
from deboom.files.doe_table import doe_frame, read_designs, read_doe
from deboom.plot.correlations import MOST
from deboom.plot.style import vehicle_colours
from deboom.report.page import Headline, Page, Picture, Section, Table
from deboom.study.options import factor_space
from deboom.study.platform_model import Operation
from deboom.study.result import Scalar, StudyResult
from deboom.vehicles.booming_model import LoadCaseIndex


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

    Parameters
    ----------
    plan : Plan
        Of the new designs.
    n_designs : int
        Of a space-filling plan; the classical ones have their own number.
    seed : int
        Of a space-filling plan, from 1.
    generators : str, optional
        Of a fractional factorial, see `deboom.explore.doe.fractional_factorial`.
    table : Path, optional
        A user's own designs instead of a plan, see `deboom.files.doe_table.read_designs`.
    append_to : Path, optional
        ``doe.csv`` of an earlier run; its designs come first and are not evaluated again.
    """

    plan: Plan
    n_designs: int
    seed: int
    generators: str | None = None
    table: Path | None = None
    append_to: Path | None = None

    @property
    def inputs(self) -> tuple[Path, ...]:
        """Files that the designs come from."""
        return tuple(path for path in (self.table, self.append_to) if path is not None)

    @property
    def words(self) -> str:
        """What the designs are, in words."""
        if self.table is not None:
            return f"table {self.table.name}"
        if self.plan in (Plan.latin_hypercube, Plan.sobol):
            kind = {Plan.latin_hypercube: "Latin hypercube (maximin)", Plan.sobol: "Sobol"}
            return f"{kind[self.plan]}, seed {self.seed}"
        if self.plan is Plan.fractional_factorial:
            return f"fractional factorial of resolution {resolution(self._generators)}"
        return str(self.plan.value).replace("-", " ")

    @property
    def _generators(self) -> str:
        if self.generators is None:
            raise InputError(
                "a fractional factorial needs --generators: one word of letters per variable, such "
                "as 'a b c abc'"
            )
        return self.generators

    def designs(self, space: DesignSpace) -> RealArray:
        """Return the asked designs, shape (n, k) [units of the space].

        Raises
        ------
        InputError
            See the plans and `deboom.files.doe_table.read_designs`; a fractional factorial without
            generators.
        """
        if self.table is not None:
            return read_designs(self.table, space)
        if self.plan is Plan.latin_hypercube:
            return latin_hypercube(space, self.n_designs, seed=self.seed)
        if self.plan is Plan.sobol:
            return sobol_designs(space, self.n_designs, seed=self.seed)
        return within_bounds(space, self._coded(space.n_variables))

    def _coded(self, n_variables: int) -> RealArray:
        if self.plan is Plan.box_behnken:
            return box_behnken(n_variables)
        if self.plan is Plan.fractional_factorial:
            return fractional_factorial(self._generators)
        if self.plan is Plan.full_factorial:
            return full_factorial(n_variables)
        if self.generators is None:
            return central_composite(full_factorial(n_variables))
        return central_composite(fractional_factorial(self.generators))


def doe_name(runs: Operation, motion: str, space: DesignSpace) -> str:
    """Return the name under which a study's DOE may be continued: all that its values follow from.

    Parameters
    ----------
    runs : Operation
        Platform, load cases and band.
    motion : str
        Of the powertrain.
    space : DesignSpace
        Its bounds.
    """
    cases = " ".join(f"{case.name}={weight:g}" for case, weight in runs.cases)
    forces = "spectra" if runs.check is None else "library"
    return (
        f"{runs.platform.name}: {cases}; {runs.band[0]:g}-{runs.band[1]:g} Hz; {forces}; {motion}; "
        f"{space.lower.min():g} to {space.upper.max():g}"
    )


def study_doe(
    evaluate: Evaluate, space: DesignSpace, request: DoeRequest, name: str
) -> tuple[Doe, int]:
    """Evaluate what was asked, or add it to an earlier DOE.

    Parameters
    ----------
    evaluate : Evaluate
        The model.
    space : DesignSpace
        Its bounds.
    request : DoeRequest
        Which designs.
    name : str
        See `doe_name`.

    Returns
    -------
    doe : Doe
        All designs with their responses.
    n_known : int
        Asked designs that were known already.

    Raises
    ------
    InputError
        See `deboom.explore.doe.continue_doe` and `deboom.files.doe_table.read_doe`.
    """
    designs = request.designs(space)
    if request.append_to is None:
        doe = run_doe(evaluate, space, designs, name=name, plan=request.words)
        return doe, len(designs) - len(doe)
    earlier = read_doe(
        request.append_to, space, evaluate.response_names, evaluate.response_unit, name=name
    )
    try:
        return continue_doe(earlier, evaluate, space, designs, name=name, plan=request.words)
    except InputError as error:
        raise InputError(f"{request.append_to}: {error}") from None


@dataclass(frozen=True, eq=False)
class CorrelationSet:
    """The same responses correlated in three ways.

    Parameters
    ----------
    designs : Correlations
        Of the designs as they are: the thesis.
    means : Correlations
        Of the designs' means over their manufacturing scatter.
    scatter : Correlations
        Of the scatter alone: each draw less its design's mean, all designs pooled.
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

    Parameters
    ----------
    names : tuple of str
        Vehicles, or sums of vehicles.
    designs : array, shape (n, r)
        Of the designs as they are [dB(A)].
    means : array, shape (n_toleranced, r)
        Of the designs whose draws could all be computed, mean over the draws [dB(A)].
    scatter : array, shape (n_toleranced, m, r)
        Draws less those means [dB].
    """

    names: tuple[str, ...]
    designs: RealArray
    means: RealArray
    scatter: RealArray

    def summed(self, groups: Mapping[str, Sequence[str]]) -> Levels:
        """Return the sums over groups of names."""
        member = np.array(
            [[float(name in members) for members in groups.values()] for name in self.names]
        )
        return Levels(
            tuple(groups), self.designs @ member, self.means @ member, self.scatter @ member
        )

    def correlated(self, seed: int, resamples: int) -> CorrelationSet:
        """Correlate all pairs of names in all three ways.

        Raises
        ------
        InputError
            See `deboom.explore.correlation.correlations`.
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

    Parameters
    ----------
    runs : Operation
        Vehicles, load cases and band.
    index : LoadCaseIndex
        What was evaluated.
    doe : Doe
        All designs with their responses.
    plan : str
        Of the designs, in words.
    n_known : int
        Asked designs that were known already.
    vehicles : Levels
        Vehicle by vehicle.
    seed, resamples : int
        Of the bootstrap.
    cut : float
        Least correlation within a family [1].
    inputs : tuple of Path
        Files that the designs came from.
    """

    runs: Operation
    index: LoadCaseIndex[Any, Any]
    doe: Doe
    plan: str
    n_known: int
    vehicles: Levels
    seed: int
    resamples: int
    cut: float
    inputs: tuple[Any, ...]

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
        """Group of every vehicle."""
        return {vehicle.name: vehicle.group for vehicle in self.runs.fleet.vehicles}

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
        """Sums over the vehicles of each group."""
        return self.vehicles.summed(self.groups)

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

    def mean_with_others(self, name: str) -> float:
        """Return the mean correlation of one vehicle with all others [1]."""
        others = [other for other in self.names if other != name]
        return float(self.by_vehicle.designs.between(name, others).mean())

    def least_alike(self) -> str:
        """Return the vehicle with the lowest mean correlation with the others."""
        return min(self.names, key=self.mean_with_others)


def correlation_study(
    runs: Operation,
    index: LoadCaseIndex[Any, Any],
    request: DoeRequest,
    *,
    motion: str,
    half_width: float,
    tolerance: float,
    draws: int,
    resamples: int,
    cut: float,
) -> CorrelationStudy:
    """Evaluate a DOE, let its designs scatter, and prepare their correlation.

    Parameters
    ----------
    runs : Operation
        Vehicles, load cases and band.
    index : LoadCaseIndex
        Of these runs.
    request : DoeRequest
        Which designs, with the seed of everything that is drawn.
    motion : str
        Of the powertrain, for the name of the DOE.
    half_width, tolerance : float
        Of the designs' bounds and of their scatter [1].
    draws : int
        Of the scatter per design, a power of two.
    resamples : int
        Of the bootstrap.
    cut : float
        Least correlation within a family [1].

    Raises
    ------
    InputError
        Fewer than two vehicles; see also `deboom.study.correlation.study_doe`.
    """
    names = index.response_names
    if len(names) < 2:
        raise InputError(f"only vehicle {names[0]} was asked for: a correlation needs two")
    space = factor_space(index.variable_names, half_width, tolerance)
    doe, n_known = study_doe(index, space, request, doe_name(runs, motion, space))
    means, scatter = tolerance_scatter(
        index, space, doe.computed_designs, n_draws=draws, seed=request.seed
    )
    whole = np.isfinite(scatter).all(axis=(1, 2))
    scale = 1.0 / index.n_lines
    levels = Levels(names, doe.computed * scale, means[whole] * scale, scatter[whole] * scale)
    return CorrelationStudy(
        runs=runs,
        index=index,
        doe=doe,
        plan=request.words,
        n_known=n_known,
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


TERMS = (
    "booming noise",
    "SPL",
    "SPLV",
    "stiffness factor",
    "tolerance",
    "σ",
    "noise transfer function",
    "correlation",
    "family of vehicles",
)


def matrix_figure(sets: CorrelationSet, groups: Sequence[str] = ()) -> bytes:
    """Draw the matrices of designs, means and scatter."""
    panels = [
        figures.CorrelationPanel(kind, found.pearson, found.pearson_low, found.pearson_high)
        for kind, found in sets.kinds.items()
    ]
    return figures.correlation_matrices(sets.designs.names, panels, groups)


def scatter_figures(
    study: CorrelationStudy, levels: Levels, sets: CorrelationSet, stem: str, label: str
) -> dict[str, bytes]:
    """Draw the scatter matrices of designs and of tolerance draws; none if there are too many."""
    names = levels.names
    if len(names) > MOST:
        return {}
    colours = vehicle_colours(study.runs.platform.fleet.names)
    drawn = {
        f"{stem}_designs": (levels.designs, sets.designs, label),
        f"{stem}_tolerance": (
            levels.scatter.reshape(-1, len(names)),
            sets.scatter,
            "scatter around each design's mean [dB]",
        ),
    }
    return {
        file: figures.scatter_matrix(
            names,
            values,
            (found.pearson, found.pearson_low, found.pearson_high),
            colours,
            value_label=words,
        )
        for file, (values, found, words) in drawn.items()
    }


def family_figure(study: CorrelationStudy) -> bytes:
    """Draw the tree of the vehicles."""
    families = study.families
    return figures.family_tree(
        families.merges,
        study.names,
        [families.number(name) for name in study.names],
        families.cut,
    )


def asked(study: CorrelationStudy) -> Section:
    """Say what was evaluated."""
    doe, space = study.doe, study.doe.space
    platform = study.runs.platform
    cases = ", ".join(
        f"{platform.load_case(case.name).title} (weight {weight:g})"
        for case, weight in study.runs.cases
    )
    scatter = study.by_vehicle.scatter
    known = (
        f" {study.n_known} of the asked designs were known already and not evaluated again."
        if study.n_known
        else ""
    )
    lost = (
        f"; {study.n_untoleranced} of them failed in some draw and have no scatter"
        if study.n_untoleranced
        else ""
    )
    return Section(
        "What was asked, and with which data",
        f"{platform.title}: {platform.description}\n\n"
        f"Load cases: {cases}. Lines: {study.index.n_lines} between {study.runs.band[0]:g} and "
        f"{study.runs.band[1]:g} Hz. A vehicle's index is SPLV, the sum of its SPL over the lines, "
        "shown divided by their number.\n\n"
        f"{len(doe)} designs ({study.plan}) of {space.n_variables} stiffness factors between "
        f"{space.lower.min():g} and {space.upper.max():g}; {doe.n_failed} failed.{known} Each was "
        f"also made {scatter.n_draws} times within its tolerance of "
        f"±{100 * space.tolerance.max():.0f} % (three standard deviations){lost}.\n\n"
        "Three correlations are told apart. Designs: the levels of the designs as drawn, the "
        "thesis's. Means: of each design's mean over its scatter. Tolerance scatter: of what "
        "manufacturing adds, each draw less its design's mean, all designs pooled. Intervals are "
        f"95 % bootstrap intervals over the designs ({study.resamples} resamples): they say how "
        "much the coefficients would move with other designs, not with other vehicles.",
    )


def family_section(
    study: CorrelationStudy, tables: Mapping[str, pd.DataFrame], pictures: Mapping[str, bytes]
) -> Section:
    """Say which vehicles can share one mount set."""
    families = study.families
    return Section(
        "Which vehicles can share one mount set?",
        f"{len(families.members)} famil{'y' if len(families.members) == 1 else 'ies'} at "
        f"r = {families.cut:g}: within a family any two vehicles correlate by {families.cut:g} or "
        "more over the designs (hierarchical clustering of 1 − r, complete linkage). What quietens "
        "one vehicle of a family then quietens the others; how much it does is another matter and "
        "shows in σ over designs. A vehicle alone in its family needs its own look before it gets "
        "the mounts of the others.",
        figures=(
            picture(
                pictures,
                "families",
                "Vehicles by family. Branches join where the worst pair below them stands; those "
                "left of the dashed line are families.",
            ),
        ),
        tables=(
            Table(tables["families"], "Families and their worst pairs, in all three correlations."),
            Table(
                tables["vehicles"],
                "By vehicle. A dash: alone in its family.",
                {"sigma over designs [dB]": 3, "sigma over the tolerance [dB]": 3},
            ),
        ),
    )


def fleet_section(
    tables: Mapping[str, pd.DataFrame], pictures: Mapping[str, bytes]
) -> tuple[Section, ...]:
    """Say how often fleets that nobody chose show the same; nothing for other platforms."""
    if "rates" not in tables:
        return ()
    n = int(tables["rates"]["fleets"].iloc[0])
    return (
        Section(
            "How special is this fleet?",
            "The virtual platform's fleet was selected because it shows every phenomenon of the "
            f"thesis. {n} fleets were drawn from the same prior and none of them selected, with "
            "the true forces of 5th gear at 220 Nm; the rates say how often a phenomenon comes by "
            "itself. A rate near 1 follows from the physics of the model, a small one is the "
            "choice of this fleet.",
            figures=(
                picture(
                    pictures,
                    "unselected_fleets",
                    "Correlations in the unselected fleets (grey), those of this platform (orange) "
                    "and the bounds asked for (dashed).",
                ),
            ),
            tables=(Table(tables["rates"], "Phenomena beside their rates."),),
        ),
    )


def pair_words(pairs: pd.DataFrame) -> Table:
    """Return the pairs for the page: designs with their interval, the others beside them."""
    kinds = {kind: part.reset_index() for kind, part in pairs.groupby("correlated", sort=False)}
    designs, means, scatter = kinds.values()
    frame = pd.DataFrame(
        {
            "pair": designs["first"] + " and " + designs["second"],
            "r [1]": designs["pearson [1]"],
            "from [1]": designs["pearson from [1]"],
            "to [1]": designs["pearson to [1]"],
            "Spearman [1]": designs["spearman [1]"],
            "r, means [1]": means["pearson [1]"],
            "r, tolerance [1]": scatter["pearson [1]"],
        }
    )
    return Table(frame, "Pairs: Pearson's r over the designs with its interval, and the others.")


def picture(pictures: Mapping[str, bytes], stem: str, caption: str) -> Picture:
    """Return a figure with its words."""
    return Picture(pictures[stem], alt=caption, caption=caption)


def doe_table(study: CorrelationStudy) -> pd.DataFrame:
    """Every design with its responses and failure code; a later run can go on from it."""
    return doe_frame(study.doe)


def pair_table(sets: CorrelationSet) -> pd.DataFrame:
    """One row per pair and kind: both coefficients with their intervals."""
    return pd.concat([_pairs(kind, found) for kind, found in sets.kinds.items()], ignore_index=True)


def matrix_table(found: Correlations) -> pd.DataFrame:
    """Pearson's coefficients as a square: one row and one column per name."""
    columns = {f"{name} [1]": found.pearson[:, i] for i, name in enumerate(found.names)}
    return pd.DataFrame({"name": list(found.names), **columns})


def vehicle_table(study: CorrelationStudy) -> pd.DataFrame:
    """One row per vehicle: level, how far designs and scatter move it, family."""
    levels, names = study.vehicles, study.names
    families = study.families
    inside = [
        [other for other in families.members[families.number(name) - 1] if other != name]
        for name in names
    ]
    designs = study.by_vehicle.designs
    return pd.DataFrame(
        {
            "vehicle": list(names),
            "group": [study.group_of[name] for name in names],
            "family": [families.number(name) for name in names],
            "least r within its family [1]": [
                float(designs.between(name, others).min()) if others else np.nan
                for name, others in zip(names, inside, strict=True)
            ],
            "mean r with all others [1]": [study.mean_with_others(name) for name in names],
            "mean level [dB(A)]": levels.designs.mean(axis=0),
            "sigma over designs [dB]": levels.designs.std(axis=0, ddof=1),
            "sigma over the tolerance [dB]": levels.scatter.std(axis=(0, 1)),
        }
    )


def family_table(study: CorrelationStudy) -> pd.DataFrame:
    """One row per family: who belongs to it, and its worst pair."""
    rows = []
    for number, members in enumerate(study.families.members, 1):
        inside = {kind: found.among(members) for kind, found in study.by_vehicle.kinds.items()}
        worst = {
            f"least r, {kind} [1]": float(r.min()) if r.size else np.nan
            for kind, r in inside.items()
        }
        rows.append({"family": number, "vehicles": ", ".join(members), **worst})
    return pd.DataFrame(rows)


def rate_table(rates: dict[str, Rate], own: dict[str, str]) -> pd.DataFrame:
    """One row per phenomenon: what this platform shows, and how often unselected fleets do."""
    return pd.DataFrame(
        [
            {
                "phenomenon": rates[name].phenomenon,
                "this platform": figure,
                "rate in unselected fleets [1]": rates[name].rate,
                "standard error [1]": rates[name].standard_error,
                "fleets": rates[name].n_fleets,
            }
            for name, figure in own.items()
        ]
    )


def unselected(study: CorrelationStudy) -> UnselectedFleets | None:
    """Return the bench's unselected fleets, if the platform is the bench's."""
    fleets = load_unselected()
    return fleets if fleets.platform == study.runs.platform.name else None


def _pairs(kind: str, found: Correlations) -> pd.DataFrame:
    rows, columns = (np.array(side) for side in zip(*found.pairs, strict=True))
    table: dict[str, object] = {
        "correlated": kind,
        "first": [found.names[row] for row in rows],
        "second": [found.names[column] for column in columns],
    }
    for name in ("pearson", "spearman"):
        for end, words in (("", ""), ("_low", " from"), ("_high", " to")):
            table[f"{name}{words} [1]"] = getattr(found, name + end)[rows, columns]
    return pd.DataFrame(table)


def group_correlation_result(study: CorrelationStudy) -> StudyResult:
    """Make tables, figures, headline numbers and page of the correlation of groups.

    Parameters
    ----------
    study : CorrelationStudy
        Of all vehicles of a platform.

    Returns
    -------
    StudyResult
        Tables ``doe``, ``vehicle_matrix``, ``vehicle_pairs``, ``vehicles``, ``families``; with two
        groups or more ``group_matrix`` and ``group_pairs``; of the bench's platform ``rates``.
    """
    by_group, by_vehicle = study.by_group, study.by_vehicle
    tables = {
        "doe": doe_table(study),
        "vehicle_matrix": matrix_table(by_vehicle.designs),
        "vehicle_pairs": pair_table(by_vehicle),
        "vehicles": vehicle_table(study),
        "families": family_table(study),
    }
    groups = [study.group_of[name] for name in study.names]
    designs = by_vehicle.designs
    pictures = {
        "vehicle_matrix": figures.correlation_matrices(
            study.names,
            [
                figures.CorrelationPanel(
                    "designs", designs.pearson, designs.pearson_low, designs.pearson_high
                )
            ],
            groups,
        ),
        "families": family_figure(study),
    }
    summary: dict[str, Scalar] = {
        "n_designs": len(study.doe),
        "n_failed": study.doe.n_failed,
        "n_families": len(study.families.members),
        "r_vehicle_min": float(designs.among(study.names).min()),
    }
    if by_group is not None:
        tables |= {
            "group_matrix": matrix_table(by_group.designs),
            "group_pairs": pair_table(by_group),
        }
        pictures["group_matrix"] = matrix_figure(by_group)
        pictures |= scatter_figures(
            study,
            study.group_levels,
            by_group,
            "groups",
            "mean level of the lines, summed over the vehicles of a group [dB(A)]",
        )
        summary |= _group_summary(by_group)
        _fleet(study, float(summary["r_group_min"]), tables, pictures, summary)
    return StudyResult(
        tables=tables,
        figures=pictures,
        summary=summary,
        page=_page(study, tables, pictures, summary),
        inputs=(*study.runs.platform.input_files, *study.inputs),
        facts={
            "plan": study.plan,
            "kernel": study.index.kernel.name,
            "known_designs": study.n_known,
        },
    )


def _group_summary(by_group: CorrelationSet) -> dict[str, Scalar]:
    names = by_group.designs.names
    worst = min(by_group.designs.pairs, key=lambda pair: by_group.designs.pearson[pair])
    return {
        "r_group_min": float(by_group.designs.among(names).min()),
        "r_group_min_from": float(by_group.designs.pearson_low[worst]),
        "r_group_min_to": float(by_group.designs.pearson_high[worst]),
        "r_group_min_means": float(by_group.means.among(names).min()),
        "r_group_min_tolerance": float(by_group.scatter.among(names).min()),
    }


def _fleet(
    study: CorrelationStudy,
    r_min: float,
    tables: dict[str, pd.DataFrame],
    pictures: dict[str, bytes],
    summary: dict[str, Scalar],
) -> None:
    """Add how often unselected fleets show the same."""
    fleets = unselected(study)
    if fleets is None:
        return
    rates = fleets.rates()
    tables["rates"] = rate_table(rates, {"groups": f"least r {r_min:.3f}"})
    pictures["unselected_fleets"] = figures.populations(
        [
            figures.PopulationPanel(
                "least correlation of two groups [1]",
                fleets.values("r_groups_min"),
                r_min,
                (0.9,),
                f"{len(fleets.fleets)} unselected fleets",
            )
        ]
    )
    summary["rate_groups"] = rates["groups"].rate
    summary["n_unselected_fleets"] = rates["groups"].n_fleets


def _page(
    study: CorrelationStudy,
    tables: Mapping[str, pd.DataFrame],
    pictures: Mapping[str, bytes],
    summary: Mapping[str, Scalar],
) -> Page:
    n = len(study.families.members)
    headlines = [
        Headline(f"{float(summary['r_vehicle_min']):.3f}", "least correlation of two vehicles"),
        Headline(str(n), "family of vehicles" if n == 1 else "families of vehicles"),
    ]
    if "r_group_min" in summary:
        r = f"{float(summary['r_group_min']):.3f}"
        headlines.insert(0, Headline(r, "least correlation of two groups"))
    if "rate_groups" in summary:
        rate = f"{100 * float(summary['rate_groups']):.0f} %"
        headlines.append(Headline(rate, "of unselected fleets: groups above 0.9"))
    return Page(
        title="Correlation of vehicle groups",
        question=(
            "Do the groups of a platform, and their vehicles, rise and fall together when mount "
            "stiffnesses change, so that one group can stand for the others?"
        ),
        headlines=tuple(headlines),
        terms=TERMS,
        sections=(
            asked(study),
            *_groups(study, tables, pictures),
            Section(
                "Vehicles",
                "Every vehicle with every other one, over the designs; the intervals, Spearman's "
                "coefficients and those of means and tolerance scatter stand in "
                "vehicle_pairs.csv.",
                figures=(
                    picture(
                        pictures,
                        "vehicle_matrix",
                        "Pearson's correlation of all vehicles; white lines part the groups.",
                    ),
                ),
            ),
            family_section(study, tables, pictures),
            *fleet_section(tables, pictures),
        ),
    )


def _groups(
    study: CorrelationStudy, tables: Mapping[str, pd.DataFrame], pictures: Mapping[str, bytes]
) -> tuple[Section, ...]:
    if "group_pairs" not in tables:
        group = next(iter(study.groups))
        text = f"All vehicles are of group {group}: there are no groups to compare."
        return (Section("Groups", text),)
    sizes = ", ".join(f"{name} ({len(members)})" for name, members in study.groups.items())
    drawn = (
        ("groups_designs", "Designs: each dot is one design, the sums of two groups."),
        ("groups_tolerance", "Tolerance scatter: each dot is one design as made once."),
    )
    return (
        Section(
            "Groups",
            f"The index of a group is the sum over its vehicles: {sizes}.",
            figures=(
                picture(
                    pictures,
                    "group_matrix",
                    "Pearson's correlation of the groups, below it its interval.",
                ),
                *(picture(pictures, stem, words) for stem, words in drawn if stem in pictures),
            ),
            tables=(pair_words(tables["group_pairs"]),),
        ),
    )


@dataclass(frozen=True)
class Apart:
    """One vehicle held against the others.

    Parameters
    ----------
    vehicle : str
        The one.
    others : tuple of str
        The others, at least two.
    """

    vehicle: str
    others: tuple[str, ...]


def vehicle_correlation_result(study: CorrelationStudy, apart: str | None) -> StudyResult:
    """Make tables, figures, headline numbers and page of the correlation of vehicles.

    Parameters
    ----------
    study : CorrelationStudy
        Of the vehicles of a group.
    apart : str or None
        Vehicle that is held against the others; None takes the one least like them.

    Returns
    -------
    StudyResult
        Tables ``doe``, ``matrix``, ``pairs``, ``vehicles``, ``families``; of the bench's platform
        ``rates``.

    Raises
    ------
    InputError
        An unknown vehicle.
    """
    both = _apart(study, apart)
    tables = {
        "doe": doe_table(study),
        "matrix": matrix_table(study.by_vehicle.designs),
        "pairs": pair_table(study.by_vehicle),
        "vehicles": vehicle_table(study),
        "families": family_table(study),
    }
    pictures = {
        "matrix": matrix_figure(study.by_vehicle),
        **scatter_figures(
            study,
            study.vehicles,
            study.by_vehicle,
            "vehicles",
            "mean level of the lines [dB(A)]",
        ),
        "families": family_figure(study),
    }
    summary: dict[str, Scalar] = {
        "n_designs": len(study.doe),
        "n_failed": study.doe.n_failed,
        "n_families": len(study.families.members),
        "r_vehicle_min": float(study.by_vehicle.designs.among(study.names).min()),
    }
    if both is not None:
        summary |= _summary(study, both)
        _fleet_6(study, both, tables, pictures, summary)
    return StudyResult(
        tables=tables,
        figures=pictures,
        summary=summary,
        page=_page_6(study, both, tables, pictures, summary),
        inputs=(*study.runs.platform.input_files, *study.inputs),
        facts={
            "plan": study.plan,
            "kernel": study.index.kernel.name,
            "known_designs": study.n_known,
        },
    )


def _apart(study: CorrelationStudy, name: str | None) -> Apart | None:
    if name is not None and name not in study.names:
        raise InputError(f"--apart '{name}' is no vehicle of this study: use {list(study.names)}")
    if len(study.names) < 3:
        return None
    vehicle = name or study.least_alike()
    return Apart(vehicle, tuple(other for other in study.names if other != vehicle))


def _summary(study: CorrelationStudy, both: Apart) -> dict[str, Scalar]:
    others, one = f"r_{key_of(both.others)}_min", f"r_{key_of([both.vehicle])}_mean"
    summary: dict[str, Scalar] = {"apart": both.vehicle}
    suffixes = ("", "_means", "_tolerance")
    for suffix, found in zip(suffixes, study.by_vehicle.kinds.values(), strict=True):
        summary[others + suffix] = float(found.among(both.others).min())
        summary[one + suffix] = float(found.between(both.vehicle, both.others).mean())
    return summary


def _fleet_6(
    study: CorrelationStudy,
    both: Apart,
    tables: dict[str, pd.DataFrame],
    pictures: dict[str, bytes],
    summary: dict[str, Scalar],
) -> None:
    """Add how often unselected fleets show the same."""
    fleets = unselected(study)
    if fleets is None or (both.vehicle, both.others) != (fleets.battery, fleets.alike):
        return
    alike = float(study.by_vehicle.designs.among(both.others).min())
    mean = float(study.by_vehicle.designs.between(both.vehicle, both.others).mean())
    rates = fleets.rates()
    tables["rates"] = rate_table(
        rates,
        {
            "alike": f"least r {alike:.3f}",
            "alike_closely": f"least r {alike:.3f}",
            "battery": f"mean r {mean:.3f}",
        },
    )
    note = f"{len(fleets.fleets)} unselected fleets"
    pictures["unselected_fleets"] = figures.populations(
        [
            figures.PopulationPanel(
                f"least r, {both.others[0]} to {both.others[-1]} [1]",
                fleets.values("r_alike_min"),
                alike,
                (0.95,),
                note,
            ),
            figures.PopulationPanel(
                f"mean r of {both.vehicle} with them [1]",
                fleets.values("r_battery_mean"),
                mean,
                (0.3, 0.8),
            ),
        ]
    )
    for name in ("alike", "alike_closely", "battery"):
        summary[f"rate_{name}"] = rates[name].rate
    summary["n_unselected_fleets"] = len(fleets.fleets)


def _page_6(
    study: CorrelationStudy,
    both: Apart | None,
    tables: Mapping[str, pd.DataFrame],
    pictures: Mapping[str, bytes],
    summary: Mapping[str, Scalar],
) -> Page:
    n = len(study.families.members)
    headlines = [Headline(str(n), "family of vehicles" if n == 1 else "families of vehicles")]
    if both is None:
        r = f"{float(summary['r_vehicle_min']):.3f}"
        headlines.insert(0, Headline(r, "least correlation of two vehicles"))
    else:
        designs = study.by_vehicle.designs
        least = float(designs.among(both.others).min())
        mean = float(designs.between(both.vehicle, both.others).mean())
        headlines[:0] = [
            Headline(f"{least:.3f}", f"least correlation without {both.vehicle}"),
            Headline(f"{mean:.2f}", f"{both.vehicle} with the others, mean"),
        ]
    if "rate_battery" in summary:
        rate = f"{100 * float(summary['rate_battery']):.0f} %"
        headlines.append(Headline(rate, "of unselected fleets set it apart like this"))
    return Page(
        title="Correlation of vehicles",
        question=(
            f"Do {', '.join(study.names)} rise and fall together when mount stiffnesses change, so "
            "that one mount set can serve them all?"
        ),
        headlines=tuple(headlines),
        terms=TERMS,
        sections=(
            asked(study),
            _matrix_section(study, tables, pictures),
            family_section(study, tables, pictures),
            *fleet_section(tables, pictures),
        ),
    )


def _matrix_section(
    study: CorrelationStudy, tables: Mapping[str, pd.DataFrame], pictures: Mapping[str, bytes]
) -> Section:
    drawn = (
        ("vehicles_designs", "Designs: each dot is one design, two vehicles with the same mounts."),
        ("vehicles_tolerance", "Tolerance scatter: each dot is one design as made once."),
    )
    kinds = study.by_vehicle.kinds.values()
    apart = np.max([np.abs(found.pearson - study.by_vehicle.designs.pearson) for found in kinds])
    return Section(
        "Vehicle by vehicle",
        "A narrow cloud means that what quietens one vehicle quietens the other. The correlations "
        f"of means and of tolerance scatter differ from those of the designs by {apart:.2f} at "
        "most; the intervals say how much of that is chance.",
        figures=(
            picture(
                pictures, "matrix", "Pearson's correlation of the vehicles, below it its interval."
            ),
            *(picture(pictures, stem, words) for stem, words in drawn if stem in pictures),
        ),
        tables=(pair_words(tables["pairs"]),),
    )
