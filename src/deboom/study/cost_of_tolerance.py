"""Tolerances with a price: what each budget buys."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from deboom import plot as figures
from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.front import verification_response
from deboom.explore.problems import SearchResult
from deboom.explore.robust import RobustValues
from deboom.explore.tolerance_allocation import ToleranceCost, ToleranceResponse
from deboom.files.platform import Platform
from deboom.files.tables import read_rows
from deboom.plot import CurvePanel
from deboom.plot.style import mount_of, signed
from deboom.report.page import Headline, Page, Picture, Section, Table
from deboom.study.platform_model import motion_report
from deboom.study.result import Scalar, StudyResult
from deboom.vehicles.booming_model import LoadCaseIndex

DRAWS = 1024
"""Independent draws with which the designs that are shown are evaluated again."""
REFERENCE = 0.15
"""Tolerance that is assumed to cost what today's parts cost, half width [1]."""


@dataclass(frozen=True, eq=False)
class ToleranceStudy:
    """A search over stiffnesses and tolerances with the cost of the tolerances.

    Parameters
    ----------
    platform : Platform
        As measured.
    index : LoadCaseIndex
        What was evaluated.
    response : ToleranceResponse
        How it was made robust, and the cost.
    search : SearchResult
        What was found; objectives are mean, scatter, cost.
    mean_margin : float
        Designs of a budget may be louder than the quietest design of the front by this [dB], mean
        over vehicles and lines.
    seed : int
        Of the verification.
    """

    platform: Platform
    index: LoadCaseIndex[Any, Any]
    response: ToleranceResponse
    search: SearchResult
    mean_margin: float
    seed: int

    @property
    def variables(self) -> tuple[str, ...]:
        """Names of the directions."""
        return self.response.robust.space.names

    @property
    def per_line(self) -> float:
        """Factor from a sum over vehicles and lines to the mean over both [1]."""
        return 1.0 / (self.index.n_lines * len(self.index.response_names))

    @cached_property
    def costs(self) -> RealArray:
        """Cost of every design of the front, shape (n,) [unit of the weights]."""
        return np.asarray(self.search.front.objectives[:, -1])

    @cached_property
    def quiet(self) -> npt.NDArray[np.intp]:
        """Rows of the front within the margin of the quietest one."""
        mean = self.search.front.mean_sum * self.per_line
        return np.flatnonzero(mean <= mean.min() + self.mean_margin)

    @cached_property
    def rows(self) -> tuple[int, ...]:
        """Rows of the front: of the quiet designs, those with the least scatter for their cost."""
        order = self.quiet[np.argsort(self.costs[self.quiet], kind="stable")]
        sigma = self.search.front.sigma_sum[order]
        best = np.concatenate([[True], sigma[1:] < np.minimum.accumulate(sigma)[:-1]])
        return tuple(int(row) for row in order[best])

    @cached_property
    def verified(self) -> RobustValues:
        """The designs of `rows`, with draws that the search never saw."""
        return self._verified(self.search.front.designs[list(self.rows)])

    @cached_property
    def uniform(self) -> RobustValues:
        """The same stiffnesses, each with one tolerance everywhere at the same cost."""
        designs = self.search.front.designs[list(self.rows)].copy()
        inner, tolerances = self.response.split(designs)
        cost = self.response.cost
        total = float(cost.weight.sum())
        same = (cost.weight * cost.reference).sum() / (self.costs[list(self.rows)] + total)
        tolerances[:] = same[:, np.newaxis]
        return self._verified(np.hstack([inner, tolerances]))

    @cached_property
    def baseline(self) -> RobustValues:
        """Today's design with its tolerances; one row."""
        return self._verified(self.response.space.nominal[np.newaxis, :])

    @property
    def baseline_cost(self) -> float:
        """Cost of today's tolerances."""
        return float(self.response.cost(self.response.robust.space.tolerance))

    def at_budget(self, budget: float) -> int:
        """Return the place in `rows` of the least scatter that costs no more; -1 if none does."""
        affordable = np.flatnonzero(self.costs[list(self.rows)] <= budget)
        return int(affordable[-1]) if affordable.size else -1

    def _verified(self, designs: RealArray) -> RobustValues:
        robust = verification_response(self.response.robust, DRAWS, seed=self.seed)
        response = ToleranceResponse(
            robust, self.response.lower, self.response.upper, self.response.cost
        )
        return response(designs)


def tolerance_cost(path: Path | None, variables: Sequence[str]) -> ToleranceCost:
    """Return the price of tolerances, by default 1 per direction and `REFERENCE`.

    Parameters
    ----------
    path : Path or None
        Table with the columns ``variable, weight, reference tolerance``, one row per variable, in
        any order; the weight is in any unit of money, the tolerance a plain number such as 0.15.
    variables : sequence of str
        Of the stiffness factors.

    Raises
    ------
    InputError
        A table that cannot be read, lacks a variable or names it twice.
    """
    if path is None:
        one = np.ones(len(variables))
        return ToleranceCost(one, REFERENCE * one)
    rows = {}
    for row in read_rows(path, ("variable", "weight", "reference tolerance"), {}):
        name = row.filled("variable")
        if name in rows or name not in variables:
            raise row.error(f"'{name}' is named twice or is none of {list(variables)}")
        rows[name] = (row.number("weight"), row.number("reference tolerance"))
    missing = [name for name in variables if name not in rows]
    if missing:
        raise InputError(f"{path}: there is no row for {missing}: give every variable one")
    weight, reference = np.array([rows[name] for name in variables]).T
    return ToleranceCost(weight, reference)


TERMS = ("booming noise", "SPLV", "stiffness factor", "tolerance", "σ", "Pareto front")
PERCENT = 100.0


def tolerance_cost_result(study: ToleranceStudy, inputs: tuple[Path, ...] = ()) -> StudyResult:
    """Make tables, figures, headline numbers and page.

    Parameters
    ----------
    study : ToleranceStudy
        Searched.
    inputs : tuple of Path
        Files read beside the platform's.

    Returns
    -------
    StudyResult
        Tables ``front``, ``designs``, ``tolerances``, ``budgets``.
    """
    tables = {
        "front": front_table(study),
        "designs": design_table(study),
        "budgets": budget_table(study),
        "tolerances": tolerance_table(study),
    }
    pictures = tolerance_figures(study)
    return StudyResult(
        tables=tables,
        figures=pictures,
        summary=tolerance_summary(study),
        page=_page(study, tables, pictures),
        inputs=(*study.platform.input_files, *inputs),
        facts={"kernel": study.index.kernel.name},
    )


def front_table(study: ToleranceStudy) -> pd.DataFrame:
    """One row per design of the front, in the draws of the search."""
    front = study.search.front
    return pd.DataFrame(
        {
            "point": np.arange(1, len(front) + 1),
            "SPLV mean sum [dB(A)]": front.mean_sum,
            "SPLV sigma sum [dB]": front.sigma_sum,
            "cost [1]": study.costs,
        }
    )


def design_table(study: ToleranceStudy) -> pd.DataFrame:
    """One row per design of the front: stiffness factors and tolerances."""
    designs, labels = study.search.front.designs, study.response.space.labels
    columns = {label: designs[:, place] for place, label in enumerate(labels)}
    return pd.DataFrame({"point": np.arange(1, len(designs) + 1), **columns})


def budget_table(study: ToleranceStudy) -> pd.DataFrame:
    """Today's design, then every quiet design with the least scatter for its cost, verified."""
    scale, base = study.per_line, study.baseline
    chosen, same = study.verified, study.uniform
    sigma = np.concatenate([base.sigma_sum, chosen.sigma_sum]) * scale
    mean = np.concatenate([base.mean_sum, chosen.mean_sum]) * scale
    cost = np.concatenate([[study.baseline_cost], study.costs[list(study.rows)]])
    return pd.DataFrame(
        {
            "design": ["today's", *(f"point {row + 1}" for row in study.rows)],
            "cost [1]": cost,
            "mean level [dB(A)]": mean,
            "sigma of the level [dB]": sigma,
            "change of sigma [%]": PERCENT * (sigma / sigma[0] - 1.0),
            "sigma, one tolerance everywhere [dB]": np.concatenate(
                [sigma[:1], same.sigma_sum * scale]
            ),
        }
    )


def tolerance_table(study: ToleranceStudy) -> pd.DataFrame:
    """One row per direction: tolerance at the cheapest, at today's and at twice that precision."""
    table: dict[str, object] = {"variable": list(study.variables)}
    for name, place in _shown(study).items():
        tolerances = study.response.split(study.verified.designs)[1]
        table[f"{name} [%]"] = PERCENT * tolerances[place]
    return pd.DataFrame(table)


def tolerance_summary(study: ToleranceStudy) -> dict[str, Scalar]:
    """Headline numbers; the study's docstring explains the keys."""
    base = float(study.baseline.sigma_sum[0])
    place = _shown(study)["at today's cost"]
    sigma, same = study.verified.sigma_sum[place], study.uniform.sigma_sum[place]
    mean = study.verified.mean_sum[place] - study.baseline.mean_sum[0]
    return {
        "sigma_change_percent_at_todays_cost": float(PERCENT * (sigma / base - 1.0)),
        "sigma_change_percent_by_allocation": float(PERCENT * (sigma / same - 1.0)),
        "mean_change_db_per_line_at_todays_cost": float(mean * study.per_line),
        "sigma_change_percent_most_precise": float(
            PERCENT * (study.verified.sigma_sum[-1] / base - 1.0)
        ),
        "cost_most_precise": float(study.costs[study.rows[-1]]),
        "cost_for_todays_sigma": _cost_for(study, base),
        "n_front": len(study.search.front),
        "n_evaluated": study.search.n_evaluated,
        "n_failed": study.search.n_failed,
        "seconds_search": round(study.search.seconds, 3),
    }


def tolerance_figures(study: ToleranceStudy) -> dict[str, bytes]:
    """Draw all pictures of the page; file stem → PNG."""
    scale, cost = study.per_line, study.costs[list(study.rows)]
    tolerances = PERCENT * study.response.split(study.verified.designs)[1]
    few = _few(len(cost))
    mounts = dict.fromkeys(mount_of(name) for name in study.variables)
    panels = [
        CurvePanel(
            mount,
            cost[few],
            {
                name.removeprefix(f"{mount} "): tolerances[few, place]
                for place, name in enumerate(study.variables)
                if mount_of(name) == mount
            },
        )
        for mount in mounts
    ]
    return {
        "cost_of_scatter": figures.fronts(
            {
                "tolerances chosen": (cost, study.verified.sigma_sum * scale),
                "one tolerance everywhere": (cost, study.uniform.sigma_sum * scale),
            },
            {},
            {"today's": (study.baseline_cost, float(study.baseline.sigma_sum[0]) * scale)},
            mean_label="cost of the tolerances [1]",
            sigma_label="σ of the mean level [dB]",
        ),
        "tolerances": figures.curve_panels(
            panels, x_label="cost [1]", y_label="tolerance ± [%]", columns=2, share_y=True
        ),
        "front": figures.map_panels(
            [
                figures.MapPanel(
                    "every design of the front",
                    study.costs,
                    study.search.front.sigma_sum * scale,
                    study.search.front.mean_sum * scale,
                )
            ],
            x_label="cost of the tolerances [1]",
            y_label="σ of the mean level [dB]",
            value_label="mean level over vehicles and lines [dB(A)]",
            columns=1,
        ),
    }


def _shown(study: ToleranceStudy) -> dict[str, int]:
    """Places of the designs whose tolerances are listed; the cheapest one where none affords."""
    budgets = {"at today's cost": study.baseline_cost}
    return {
        "cheapest": 0,
        **{name: max(study.at_budget(budget), 0) for name, budget in budgets.items()},
        "most precise": len(study.rows) - 1,
    }


def _cost_for(study: ToleranceStudy, sigma: float) -> float:
    """Return the least cost of a quiet design with no more scatter; nan if there is none."""
    enough = np.flatnonzero(study.verified.sigma_sum <= sigma)
    return float(study.costs[study.rows[enough[0]]]) if enough.size else float("nan")


def _page(
    study: ToleranceStudy, tables: Mapping[str, pd.DataFrame], pictures: Mapping[str, bytes]
) -> Page:
    summary, search, cost = tolerance_summary(study), study.search, study.response.cost
    at_today = float(summary["sigma_change_percent_at_todays_cost"])
    allocated = float(summary["sigma_change_percent_by_allocation"])
    louder = float(summary["mean_change_db_per_line_at_todays_cost"])
    return Page(
        title="What tighter tolerances buy",
        question=(
            "Which directions of the mounts deserve tight tolerances, and what does less scatter "
            f"of the noise in {', '.join(study.index.response_names)} cost?"
        ),
        headlines=(
            Headline(f"{signed(at_today, 0)} %", "σ at today's cost"),
            Headline(f"{signed(allocated, 0)} %", "σ against one tolerance everywhere"),
            Headline(f"{signed(louder, 2)} dB", "mean level of that design"),
        ),
        terms=TERMS,
        warnings=(
            "The price of a tolerance is an assumption: weight × (reference / tolerance − 1) per "
            f"direction, weights {_span(cost.weight)}, references {_span(cost.reference)}. Give "
            "your own with --cost-table.",
            *motion_report(study.index, study.response.robust.space.nominal[np.newaxis]).warnings,
        ),
        sections=(
            Section(
                "What scatter costs",
                f"Of all designs within {study.mean_margin:g} dB of the quietest one, those with "
                f"the least scatter for their cost; evaluated with {DRAWS} independent draws. "
                "Beside them the same stiffnesses at the same cost, with one tolerance "
                "everywhere.",
                figures=(_picture(pictures, "cost_of_scatter", "Scatter over cost."),),
                tables=(
                    Table(
                        tables["budgets"].iloc[_few(len(tables["budgets"]))],
                        "Today's design and designs of the chosen tolerances, per line.",
                        {
                            "mean level [dB(A)]": 2,
                            "sigma of the level [dB]": 3,
                            "cost [1]": 2,
                            "sigma, one tolerance everywhere [dB]": 3,
                        },
                    ),
                ),
            ),
            Section(
                "Where to be precise",
                "A direction at the widest tolerance needs none; one that goes down first is what "
                "scatter comes from.",
                figures=(_picture(pictures, "tolerances", "Tolerance of each direction."),),
                tables=(Table(tables["tolerances"], "Half widths, three standard deviations."),),
            ),
            Section(
                "The front",
                f"NSGA-II over {study.response.space.n_variables} variables and three objectives: "
                f"{search.n_evaluated} designs were evaluated, {search.n_failed} failed, "
                f"{len(search.front)} are on the front, {search.seconds:.1f} s.",
                figures=(_picture(pictures, "front", "Cost, scatter and mean level."),),
            ),
        ),
    )


def _few(count: int, wanted: int = 12) -> list[int]:
    """Return about `wanted` rows, evenly over all, first and last among them."""
    return sorted({int(row) for row in np.linspace(0, count - 1, min(wanted, count))})


def _span(values: np.ndarray) -> str:
    low, high = values.min(), values.max()
    return f"{low:g}" if low == high else f"{low:g} to {high:g}"


def _picture(pictures: Mapping[str, bytes], stem: str, caption: str) -> Picture:
    return Picture(pictures[stem], alt=caption, caption=caption)
