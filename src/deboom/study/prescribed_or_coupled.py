"""Prescribed against coupled motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from deboom import plot as figures
from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.doe import SobolDesigns
from deboom.explore.front import Verification, pareto_front, verification_response, verify
from deboom.explore.problems import SearchResult
from deboom.explore.robust import RobustResponse, RobustValues
from deboom.explore.selection import at_nominal, pick, variables_without_effect
from deboom.explore.space import stiffness_factor_space
from deboom.files.platform import Platform
from deboom.plot import CurvePanel
from deboom.report.page import Headline, Page, Picture, Section, Table
from deboom.study.platform_model import Kernel, Motion, Operation, motion_index
from deboom.study.result import Scalar, StudyResult
from deboom.vehicles.booming_model import LoadCaseIndex


@dataclass(frozen=True, eq=False)
class SameDesigns:
    """SPLV of the same designs with prescribed and with answering motion, in one load case.

    Parameters
    ----------
    load_case : str
        Its name.
    gear : int
        Of the load case.
    vehicles : tuple of str
        Names of the vehicles.
    prescribed, truth : array, shape (n, n_vehicle)
        Change against today's mounts of the mean level of the lines [dB].
    """

    load_case: str
    gear: int
    vehicles: tuple[str, ...]
    prescribed: RealArray
    truth: RealArray

    @property
    def correlation(self) -> RealArray:
        """Correlation coefficient per vehicle, shape (n_vehicle,) [1]."""
        pairs = zip(self.prescribed.T, self.truth.T, strict=True)
        return np.array([np.corrcoef(x, y)[0, 1] for x, y in pairs])

    @property
    def line(self) -> RealArray:
        """Slope and offset of truth over prescribed, least squares, shape (2, n_vehicle)."""
        pairs = zip(self.prescribed.T, self.truth.T, strict=True)
        return np.array([np.polyfit(x, y, 1) for x, y in pairs]).T


@dataclass(frozen=True, eq=False)
class Found:
    """A front, with the model of the motion that it was searched with.

    Parameters
    ----------
    motion : str
        Which model.
    robust : RobustResponse
        Of the search.
    search : SearchResult
        What was found.
    verification : Verification
        The front evaluated again under its own model.
    """

    motion: str
    robust: RobustResponse
    search: SearchResult
    verification: Verification

    @cached_property
    def optimum(self) -> int:
        """Row of the best mean, chosen under the own model: who searched knows no other."""
        return pick(self.verification.values).best_mean

    @property
    def design(self) -> RealArray:
        """Stiffness factors of that row, shape (n_variable,) [1]."""
        return np.asarray(self.search.front.designs[self.optimum])


@dataclass(frozen=True, eq=False)
class PrescribedOrCoupled:
    """Both fronts, each under both models, and the same designs under both.

    Parameters
    ----------
    platform : Platform
        As measured.
    same_designs : tuple of SameDesigns
        One per load case, in all vehicles of the platform.
    prescribed, truth : Found
        Searched with the same seed, budget and draws.
    """

    platform: Platform
    same_designs: tuple[SameDesigns, ...]
    prescribed: Found
    truth: Found

    @property
    def both(self) -> tuple[Found, Found]:
        """The two fronts."""
        return self.prescribed, self.truth

    @property
    def vehicles(self) -> tuple[str, ...]:
        """Vehicles that the searches served."""
        return self.truth.robust.evaluate.response_names

    @property
    def n_lines(self) -> int:
        """Lines in each sum of levels."""
        return _index(self.truth).n_lines

    def kernel(self, found: Found) -> str:
        """Return the name of the kernel that a search used."""
        return str(_index(found).kernel.name)

    @cached_property
    def _across(self) -> dict[str, RobustValues]:
        judges = zip(self.both, self.both[::-1], strict=True)
        return {
            found.motion: verify(
                found.search.front,
                judge.robust,
                n_samples=found.verification.n_samples,
                seed=found.verification.seed,
            ).values
            for found, judge in judges
        }

    def under(self, found: Found, judge: Found) -> RobustValues:
        """Return a front's values under the model of either search, with unseen draws."""
        return found.verification.values if found is judge else self._across[found.motion]

    def nominal(self, judge: Found) -> RobustValues:
        """Return today's mounts under a model and the same draws; one row."""
        check = judge.verification
        response = verification_response(judge.robust, check.n_samples, seed=check.seed)
        return response(judge.robust.space.nominal[np.newaxis])

    @cached_property
    def benefits(self) -> pd.DataFrame:
        """Fall of the mean level by vehicle, of each optimum under each model.

        One row per optimum, judging model and vehicle.
        """
        rows = []
        for judge in self.both:
            nominal = self.nominal(judge)
            for found in self.both:
                values, at = self.under(found, judge), found.optimum
                rows.append(
                    pd.DataFrame(
                        {
                            "optimum found with": found.motion,
                            "judged with": judge.motion,
                            "vehicle": list(self.vehicles),
                            "benefit [dB]": (nominal.mean[0] - values.mean[at]) / self.n_lines,
                            "sigma before [dB]": nominal.sigma[0] / self.n_lines,
                            "sigma after [dB]": values.sigma[at] / self.n_lines,
                        }
                    )
                )
        return pd.concat(rows, ignore_index=True)

    def benefit(self, found: Found, judge: Found) -> float:
        """Return the fall of the mean level over vehicles and lines [dB]."""
        table = self.benefits
        rows = (table["optimum found with"] == found.motion) & (
            table["judged with"] == judge.motion
        )
        return float(table.loc[rows, "benefit [dB]"].mean())


def both_indices(
    runs: Operation, truth: Motion, kernel: Kernel | None
) -> dict[Motion, LoadCaseIndex[Any, Any]]:
    """Return the booming index of some runs with prescribed motion, and with another one.

    Raises
    ------
    InputError
        Prescribed motion as the truth; see also `deboom.study.platform_model.motion_index`.
    """
    if truth is Motion.prescribed:
        raise InputError("prescribed motion cannot judge itself: take another one for the truth")
    return {
        Motion.prescribed: motion_index(runs, Motion.prescribed, None),
        truth: motion_index(runs, truth, kernel),
    }


def same_designs(
    runs: Operation,
    truth: Motion,
    kernel: Kernel | None,
    *,
    n_designs: int,
    half_width: float,
    seed: int,
) -> tuple[SameDesigns, ...]:
    """Evaluate the same designs with both motions, in all vehicles, load case by load case.

    Parameters
    ----------
    runs : Operation
        Load cases to compare.
    truth : Motion
        The motion that answers.
    kernel : Kernel or None
        For it.
    n_designs, half_width, seed : int, float, int
        Scrambled Sobol points over factors of 1 ± `half_width`.
    """
    compared = []
    for case, _ in runs.cases:
        alone = replace(runs, fleet=runs.platform.fleet, cases=[(case, 1.0)])
        indices = both_indices(alone, truth, kernel)
        index = indices[truth]
        space = stiffness_factor_space(index.variable_names, half_width=half_width)
        points = SobolDesigns(space, n_designs, seed).part(0, n_designs)
        designs = np.vstack([space.nominal, points])
        changes = {motion: _changes(one, designs) for motion, one in indices.items()}
        compared.append(
            SameDesigns(
                load_case=case.name,
                gear=case.gear,
                vehicles=index.response_names,
                prescribed=changes[Motion.prescribed],
                truth=changes[truth],
            )
        )
    return tuple(compared)


def _changes(index: LoadCaseIndex[Any, Any], designs: RealArray) -> RealArray:
    levels = index(designs) / index.n_lines
    return np.asarray(levels[1:] - levels[0])


def _index(found: Found) -> LoadCaseIndex[Any, Any]:
    index = found.robust.evaluate
    assert isinstance(index, LoadCaseIndex)
    return index


TERMS = (
    "booming noise",
    "SPLV",
    "stiffness factor",
    "tolerance",
    "σ",
    "Pareto front",
    "prescribed motion",
)
WARNING = (
    "The truth here is a model too: mounts keep their stiffness per line while the motion "
    "answers, and the body stays at rest."
)


def prescribed_or_coupled_result(study: PrescribedOrCoupled) -> StudyResult:
    """Make tables, figures, headline numbers and page of the comparison.

    Parameters
    ----------
    study : PrescribedOrCoupled
        Searched with both motions.

    Returns
    -------
    StudyResult
        Tables ``agreement``, ``benefit``, ``vehicles``, ``optima``, ``fronts``.
    """
    tables = {
        "agreement": agreement_table(study),
        "benefit": benefit_table(study),
        "vehicles": study.benefits,
        "optima": optima_table(study),
        "fronts": front_table(study),
    }
    pictures = comparison_figures(study)
    summary = comparison_summary(study)
    return StudyResult(
        tables=tables,
        figures=pictures,
        summary=summary,
        page=_page(study, tables, pictures),
        inputs=study.platform.input_files,
        facts={
            "truth": study.truth.motion,
            "kernel_prescribed": study.kernel(study.prescribed),
            "kernel_truth": study.kernel(study.truth),
            "tolerance_draws": study.truth.robust.sample.n_samples,
            "verification_draws": study.truth.verification.n_samples,
        },
    )


def agreement_table(study: PrescribedOrCoupled) -> pd.DataFrame:
    """One row per load case and vehicle: correlation, slope, largest effect."""
    parts = [
        pd.DataFrame(
            {
                "load case": same.load_case,
                "gear": same.gear,
                "vehicle": list(same.vehicles),
                "correlation [1]": same.correlation,
                "slope [1]": same.line[0],
                "largest change, prescribed [dB]": np.abs(same.prescribed).max(axis=0),
                "largest change, true [dB]": np.abs(same.truth).max(axis=0),
            }
        )
        for same in study.same_designs
    ]
    return pd.concat(parts, ignore_index=True)


def load_case_table(agreement: pd.DataFrame) -> pd.DataFrame:
    """One row per load case: the worst correlation and the range of the slopes over vehicles."""
    groups = agreement.groupby("load case", sort=False)
    return pd.DataFrame(
        {
            "load case": list(groups.groups),
            "gear": groups["gear"].first().to_numpy(),
            "smallest correlation [1]": groups["correlation [1]"].min().to_numpy(),
            "smallest slope [1]": groups["slope [1]"].min().to_numpy(),
            "largest slope [1]": groups["slope [1]"].max().to_numpy(),
        }
    )


def benefit_table(study: PrescribedOrCoupled) -> pd.DataFrame:
    """One row per optimum: what its own model promised, and what both models say."""
    promised, real = "as prescribed motion sees it [dB]", f"true ({study.truth.motion}) [dB]"
    return pd.DataFrame(
        [
            {
                "optimum found with": f"{found.motion} motion",
                promised: study.benefit(found, study.prescribed),
                real: study.benefit(found, study.truth),
            }
            for found in study.both
        ]
    )


def optima_table(study: PrescribedOrCoupled) -> pd.DataFrame:
    """One row per design variable: the factor of each optimum; no effect: nominal."""
    table: dict[str, object] = {"variable": list(study.truth.robust.space.names)}
    for found in study.both:
        space = found.robust.space
        without = variables_without_effect(found.robust.evaluate, space)
        design = at_nominal(found.design[np.newaxis], space, without)[0]
        table[f"{found.motion} motion [1]"] = design
    return pd.DataFrame(table)


def front_table(study: PrescribedOrCoupled) -> pd.DataFrame:
    """One row per design of each front: both objectives under both models."""
    parts = []
    for found in study.both:
        values = {judge.motion: study.under(found, judge) for judge in study.both}
        parts.append(
            pd.DataFrame(
                {
                    "found with": found.motion,
                    "point": np.arange(1, len(found.search.front) + 1),
                    "optimum": np.arange(len(found.search.front)) == found.optimum,
                    **{
                        f"{name}, {motion} [{unit}]": getattr(values[motion], column)
                        for motion in (study.prescribed.motion, study.truth.motion)
                        for name, column, unit in (
                            ("SPLV mean sum", "mean_sum", "dB(A)"),
                            ("SPLV sigma sum", "sigma_sum", "dB"),
                        )
                    },
                }
            )
        )
    return pd.concat(parts, ignore_index=True)


def comparison_summary(study: PrescribedOrCoupled) -> dict[str, Scalar]:
    """Headline numbers; the study's docstring explains the keys."""
    correlation = np.concatenate([same.correlation for same in study.same_designs])
    slope = np.concatenate([same.line[0] for same in study.same_designs])
    return {
        "r_min": float(correlation.min()),
        "slope_min": float(slope.min()),
        "slope_max": float(slope.max()),
        "benefit_prescribed_db": study.benefit(study.prescribed, study.truth),
        "benefit_coupled_db": study.benefit(study.truth, study.truth),
        "promised_prescribed_db": study.benefit(study.prescribed, study.prescribed),
        "n_compared": slope.size,
        "seconds_search": round(sum(found.search.seconds for found in study.both), 3),
    }


def comparison_figures(study: PrescribedOrCoupled) -> dict[str, bytes]:
    """Draw both pictures of the page; file stem → PNG."""
    per_line = 1.0 / (study.n_lines * len(study.vehicles))

    def pair(values: RobustValues) -> tuple[RealArray, RealArray]:
        return values.mean_sum * per_line, values.sigma_sum * per_line

    today = pair(study.nominal(study.truth))
    curves = {
        f"found with {found.motion} motion": pair(pareto_front(study.under(found, study.truth)))
        for found in study.both
    }
    first = study.same_designs[0]
    shown = [first.vehicles.index(name) for name in study.vehicles]
    return {
        "prescribed_against_coupled": figures.curve_panels(
            [_panel(first, row) for row in shown],
            x_label="change, prescribed [dB]",
            y_label=f"change, {study.truth.motion} [dB]",
            dashed=("equal",),
        ),
        "fronts": figures.fronts(
            curves,
            {},
            {"today's mounts": (float(today[0][0]), float(today[1][0]))},
            mean_label=f"mean level over vehicles and lines, {study.truth.motion} motion [dB(A)]",
            sigma_label="its σ over the tolerance [dB]",
        ),
    }


def _panel(same: SameDesigns, row: int) -> CurvePanel:
    x, y = same.prescribed[:, row], same.truth[:, row]
    slope, offset = same.line[:, row]
    ends = np.array([x.min(), x.max()])
    return CurvePanel(
        f"{same.vehicles[row]}: slope {slope:.2f}, r {same.correlation[row]:.3f}",
        ends,
        {"fitted": slope * ends + offset, "equal": ends},
        {f"{len(x)} designs": (x, y)},
    )


def _page(
    study: PrescribedOrCoupled, tables: Mapping[str, pd.DataFrame], pictures: Mapping[str, bytes]
) -> Page:
    summary = comparison_summary(study)
    first, truth = study.same_designs[0], study.truth.motion
    n_designs, half = len(first.prescribed), study.truth.robust.space.tolerance.max()
    n_group = len(study.vehicles)
    promised, real = summary["promised_prescribed_db"], summary["benefit_prescribed_db"]
    return Page(
        title="Prescribed or coupled motion",
        question=(
            "Does it matter for the choice of mounts whether the powertrain's motion stays as "
            "measured while stiffnesses change, or answers?"
        ),
        headlines=(
            Headline(f"{summary['r_min']:.3f}", "smallest correlation of SPLV"),
            Headline(
                f"{summary['slope_min']:.2f} … {summary['slope_max']:.2f}",
                f"{truth} over prescribed effect",
            ),
            Headline(f"{real:.2f} dB", "true benefit of the prescribed optimum"),
            Headline(
                f"{summary['benefit_coupled_db']:.2f} dB", f"true benefit of the {truth} optimum"
            ),
        ),
        terms=TERMS,
        warnings=(WARNING,),
        sections=(
            Section(
                "The same designs under both motions",
                f"{n_designs} designs in {len(study.same_designs)} load cases and "
                f"{len(first.vehicles)} vehicles. A slope above 1: prescribed motion understates "
                "what a change of stiffness does. A correlation near 1: it ranks designs alike.",
                figures=(
                    _picture(
                        pictures,
                        "prescribed_against_coupled",
                        f"Change of the mean level of the lines against today's mounts, "
                        f"{first.load_case}; each point is a design.",
                    ),
                ),
                tables=(
                    Table(
                        load_case_table(tables["agreement"]),
                        "Correlation and slope over the vehicles; agreement.csv has each.",
                        {"smallest correlation [1]": 3},
                    ),
                ),
            ),
            Section(
                "The two optima",
                f"Both searches had the same seed, budget and draws (tolerance ±{100 * half:.0f} "
                f"%). The optimum is the best mean of each front, judged with "
                f"{study.truth.verification.n_samples} draws that no search saw, as the fall of "
                f"the mean level over {n_group} vehicles and {study.n_lines} lines. The optimum of "
                f"prescribed motion promises {promised:.2f} dB and brings {real:.2f} dB.",
                figures=(
                    _picture(
                        pictures,
                        "fronts",
                        f"Both fronts as they truly are, that is with {truth} motion.",
                    ),
                ),
                tables=(
                    Table(tables["benefit"], "Benefit of each optimum under each motion."),
                    Table(tables["optima"], "Stiffness factors of the two optima."),
                    Table(tables["vehicles"], "The same by vehicle."),
                ),
            ),
        ),
    )


def _picture(pictures: Mapping[str, bytes], stem: str, caption: str) -> Picture:
    return Picture(pictures[stem], alt=caption, caption=caption)
