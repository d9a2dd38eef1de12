"""The page on the cheapest tolerances of a design."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from deboom import plot
from deboom.arrays import PERCENT, RealArray
from deboom.errors import listed
from deboom.explore.tolerance_allocation import Allocation, Allocator, FreeTolerances, Verified
from deboom.mounts.mount import Mount
from deboom.pages.front_answer import abbreviations
from deboom.pages.motion import motion_report
from deboom.plot.style import signed
from deboom.report import Report, Step, Table
from deboom.vehicles.free_directions import NOTICEABLE, largest_changes

TIGHTEST = 3
"""Directions that the verdict names."""
SIGMA_DECIMALS = 3
"""Of σ in dB, where it stands beside its limit."""


@dataclass(frozen=True, eq=False)
class ToleranceSets:
    """Sets of tolerances of one design for one target, and what new draws say of each.

    - `index`: model of the levels.
    - `design` (k,): whose tolerances they are; `design_name`: in words.
    - `sigma`: target of the mean level's σ [dB], None for today's or a share; `share`: of parts
      within their limits, where levels are limited [1].
    - `samples`, `checks`: draws to allocate with, and to verify with.
    - `cost_table` or None: prices that were stated.
    - `per_line`: factor from a sum over vehicles and lines to the mean over both [1].
    """

    index: Any
    design: RealArray
    design_name: str
    sigma: float | None
    share: float
    samples: int
    checks: int
    cost_table: Path | None
    allocator: Allocator
    per_line: float
    by_sigma: bool
    today: Allocation
    cheapest: Allocation
    uniform: Allocation
    uniform_of_effective: Allocation
    verified: dict[str, Verified]

    @property
    def named(self) -> dict[str, Allocation]:
        """The sets that are verified, by the name that tables give them."""
        return {"today's": self.today, "cheapest": self.cheapest, "uniform": self.uniform}

    @property
    def ratio(self) -> float:
        """Cost of the cheapest tolerances over that of one tolerance everywhere [1]."""
        return self.cheapest.total_cost / self.uniform.total_cost

    @property
    def ratio_of_effective(self) -> float:
        """The same against one tolerance where a direction has an effect [1]."""
        return self.cheapest.total_cost / self.uniform_of_effective.total_cost

    @property
    def verified_limit(self) -> float:
        """σ that new draws must not exceed: the stated one, or today's in the same draws [dB]."""
        return self.verified["today's"].sigma if self.sigma is None else self.sigma

    @property
    def missed(self) -> str:
        """In what new draws miss the target, in words; empty where they reach it."""
        new, remedy = self.verified["cheapest"], "take more --samples"
        if not self.by_sigma:
            if new.share >= self.share:
                return ""
            return (
                f"New draws find {PERCENT * new.share:.1f} % within the limits, less than the "
                f"{PERCENT * self.share:g} % asked for: {remedy}"
            )
        if round(new.sigma, SIGMA_DECIMALS) <= round(self.verified_limit, SIGMA_DECIMALS):
            return ""
        return (
            f"New draws find σ {new.sigma:.{SIGMA_DECIMALS}f} dB, more than "
            f"{self.verified_limit:.{SIGMA_DECIMALS}f} dB: {remedy}"
        )

    @property
    def n_widest(self) -> int:
        """Directions that may be as wide as allowed."""
        return int(np.isclose(self.cheapest.tolerance, self.allocator.upper).sum())

    @property
    def bound(self) -> list[str]:
        """Which end of the allowed range each of the cheapest tolerances lies at."""
        tolerance, lower, upper = (
            self.cheapest.tolerance,
            self.allocator.lower,
            self.allocator.upper,
        )
        ends = [np.isclose(tolerance, lower), np.isclose(tolerance, upper)]
        return list(np.select(ends, ["tightest", "widest"], ""))


@dataclass(frozen=True, eq=False)
class ToleranceFront:
    """A front with the tolerance of each mount as a variable, one row per design by its price.

    `bounds`: of every tolerance, half widths [1].
    """

    free: FreeTolerances
    bounds: tuple[float, float]
    table: pd.DataFrame


def tolerance_report(
    sets: ToleranceSets,
    free: ToleranceFront | None,
    *,
    mounts: Sequence[Mount],
    assumed: Sequence[str],
    inputs: Sequence[Path],
    run: str,
) -> Report:
    """Report the cheapest tolerances of a design.

    - `free` or None: a front with tolerances as variables.
    - `mounts`: of the platform; `assumed`: defaults that the model rests on, in words.
    - `inputs`: files read; `run`: its name.
    """
    report = Report(
        "Cheapest tolerances of a design",
        f"How wide may each direction of the mounts scatter, so that {_goal(sets)} in "
        f"{', '.join(sets.index.response_names)}, at the least cost? The design is "
        f"{sets.design_name} of its front.",
    )
    report.explain("booming noise", "SPLV", "stiffness factor", "tolerance", "σ", "Pareto front")
    _answer(report, sets, abbreviations(mounts))
    _panels(report, sets, run)
    report.warn(
        "The price of a tolerance is an assumption unless you state your own prices. By default "
        "every direction costs 1 at ±15 % and twice as much at half the width. Ratios of costs "
        "are valid for prices without a fixed part.",
        *motion_report(sets.index, sets.design[np.newaxis]).warnings,
        _heard_alone(sets),
    )
    report.assume(*assumed)
    _numbers(report, sets)
    _allocation_section(report, sets)
    _verification_section(report, sets)
    if free is not None:
        _free_tolerances(report, free)
    report.facts |= {
        "kernel": sets.index.kernel,
        "allocation_draws": sets.samples,
        "verification_draws": sets.checks,
    }
    report.inputs += inputs
    return report


def _heard_alone(sets: ToleranceSets) -> str:
    """Name directions that are wide for the mean of all vehicles, and that one vehicle hears."""
    names, tolerance, column = (
        sets.cheapest.names,
        sets.cheapest.tolerance,
        np.arange(len(sets.cheapest.names)),
    )
    ends = np.tile(sets.design, (2, len(names), 1))
    ends[0, column, column] *= 1.0 - tolerance
    ends[1, column, column] *= 1.0 + tolerance
    change = largest_changes(sets.index, ends.reshape(-1, len(sets.design)), sets.design)
    change = change.reshape(2, len(names), -1).max(axis=0)
    wide = np.isclose(tolerance, sets.allocator.upper) & (change.max(axis=1) > NOTICEABLE)
    if not (sets.by_sigma and wide.any()):
        return ""
    most = int(np.argmax(np.where(wide, change.max(axis=1), 0.0)))
    vehicle = sets.index.response_names[int(change[most].argmax())]
    directions = [name for name, is_wide in zip(names, wide, strict=True) if is_wide]
    return (
        f"The target is the scatter of the mean of all vehicles. {listed(tuple(directions))} may "
        "be as wide as allowed for it, and a single vehicle hears them: "
        f"{names[most]} at "
        f"±{PERCENT * tolerance[most]:.0f} % moves {vehicle}, its mean level or one booming peak, "
        f"by up to {change[most].max():.1f} dB. Where each vehicle has a limit, ask solution_box."
    )


def _goal(sets: ToleranceSets) -> str:
    """Return the target in words."""
    if not sets.by_sigma:
        return f"{PERCENT * sets.share:g} % of parts × vehicles stay within their limits"
    which = "" if sets.sigma else ", today's"
    limit = f"{sets.verified_limit:.{SIGMA_DECIMALS}f} dB"
    return f"the mean level scatters by no more than {limit} (σ{which})"


def _answer(report: Report, sets: ToleranceSets, names: str) -> None:
    """Say what to hold, what it costs, and what new draws confirm."""
    cheapest, allocator, new = sets.cheapest, sets.allocator, sets.verified["cheapest"]
    order = np.argsort(cheapest.tolerance, kind="stable")
    held = [f"{allocator.names[k]} ±{PERCENT * cheapest.tolerance[k]:.0f} %" for k in order]
    may_be_wide = f"{sets.n_widest} of {len(allocator.names)} directions may be as wide as allowed"
    ratio = f"{PERCENT * sets.ratio:.0f} %"
    ratio_of_effective = f"{PERCENT * sets.ratio_of_effective:.0f} %"
    if sets.by_sigma:
        most = "" if sets.missed else f" of at most {sets.verified_limit:.{SIGMA_DECIMALS}f}"
        reached = f"σ {new.sigma:.{SIGMA_DECIMALS}f}{most} dB (verified)"
    else:
        reached = f"{PERCENT * new.share:.1f} % within limits (verified)"
    below_widest = np.count_nonzero(
        cheapest.tolerance[order[:TIGHTEST]] < allocator.upper[order[:TIGHTEST]]
    )
    tight = ", ".join(held[:below_widest])
    prices = (
        "those of --cost-table."
        if sets.cost_table
        else "assumed: 1 per direction at ±15 %, 2 at half the width (--cost-table)."
    )
    report.answer(
        (f"{sets.missed}. " if sets.missed else "")
        + (f"Keep {tight}; " if tight else "Keep nothing tight: ")
        + f"{may_be_wide}: {reached} at {ratio} of the cost of one tolerance everywhere.",
        "Against one common tolerance on only the directions that matter, the cost is "
        f"{ratio_of_effective}. "
        f"Prices are {prices}",
        names,
    )


def _panels(report: Report, sets: ToleranceSets, name_of_run: str) -> None:
    """Show each direction, what each set is worth, and what to do next."""
    today, cheapest = sets.today, sets.cheapest
    each = pd.DataFrame(
        {
            "direction": list(cheapest.names),
            "keep ± [%]": PERCENT * cheapest.tolerance,
            "today ± [%]": PERCENT * today.tolerance,
            "cost [1]": cheapest.cost,
            "cost today [1]": today.cost,
            "bound": sets.bound,
        }
    )
    report.panel(
        "Each direction",
        Table(each, "", {"keep ± [%]": 0, "today ± [%]": 0, "cost [1]": 2, "cost today [1]": 2}),
        "Half widths, three standard deviations. Widest: needs no precision.",
        wide=True,
    )
    today_is_uniform = bool(np.allclose(sets.uniform.tolerance, today.tolerance))
    shown = {k: v for k, v in sets.named.items() if not (today_is_uniform and k == "uniform")}
    worth = pd.DataFrame(
        {
            "tolerances": list(shown),
            "cost [1]": [allocation.total_cost for allocation in shown.values()],
            "σ, verified [dB]": [sets.verified[name].sigma for name in shown],
        }
    )
    if not sets.by_sigma:
        worth["within limits [%]"] = [PERCENT * sets.verified[name].share for name in shown]
    report.panel(
        "What it is worth",
        Table(worth, "", {"cost [1]": 1, "σ, verified [dB]": 3}),
        "Today's tolerance is the one for all directions that reaches the target."
        if today_is_uniform
        else "",
    )
    report.panel(
        "What to do next",
        Step(f"deboom report FRONT --supplier --tolerances {name_of_run}", "sheets with these"),
        Step("deboom run tolerance_allocation --cost-table FILE", "with your own prices"),
        Step("deboom run tolerance_allocation --limit LEVEL", "for a limit in place of a scatter"),
    )


def _numbers(report: Report, sets: ToleranceSets) -> None:
    """Say what the tolerances cost, and how far the levels scatter."""
    new, cheapest = sets.verified["cheapest"], sets.cheapest
    first = int(cheapest.tolerance.argmin())
    report.number("design", sets.design_name, "", "design of the front")
    report.number(
        "target", "sigma" if sets.by_sigma else "share", "", "what the tolerances must reach"
    )
    report.number(
        "tightest",
        f"{sets.allocator.names[first]} ±{PERCENT * cheapest.tolerance[first]:.0f} %",
        "",
        "tightest direction",
        headline="s",
    )
    report.number("cost_cheapest", cheapest.total_cost, "1", "cost of the cheapest tolerances")
    report.number(
        "cost_uniform",
        sets.uniform.total_cost,
        "1",
        "cost of one tolerance everywhere for the same target",
    )
    report.number("cost_today", sets.today.total_cost, "1", "cost of today's tolerances")
    report.number(
        "cost_ratio_to_uniform",
        sets.ratio,
        "1",
        "cost over that of one tolerance everywhere",
        headline=".2f",
    )
    report.number(
        "cost_ratio_to_uniform_of_effective",
        sets.ratio_of_effective,
        "1",
        "cost over that of one tolerance in the directions that matter",
        headline=".2f",
    )
    report.number(
        "sigma_today_db",
        sets.today.sigma_sum * sets.per_line,
        "dB",
        "σ of the mean level with today's tolerances, mean of the vehicles",
    )
    report.number(
        "sigma_cheapest_db",
        cheapest.sigma_sum * sets.per_line,
        "dB",
        "σ of the mean level with the cheapest tolerances, mean of the vehicles",
    )
    report.number(
        "sigma_verified_db",
        new.sigma,
        "dB",
        "σ of the mean level with the cheapest tolerances, verified with new draws",
        headline=".3f" if sets.by_sigma else "",
    )
    report.number(
        "sigma_uniform_verified_db",
        sets.verified["uniform"].sigma,
        "dB",
        "σ of the mean level with one tolerance everywhere, verified with new draws",
    )
    if not sets.by_sigma:
        report.number("share_stated", sets.share, "1", "share within limits that was asked for")
        report.number(
            "share_verified",
            new.share,
            "1",
            "share within limits, verified with new draws",
            headline=".3f",
        )
        report.number(
            "share_lower_bound", new.share_lower, "1", "lower end of the interval of share_verified"
        )


def _allocation_section(report: Report, sets: ToleranceSets) -> None:
    """Draw and list tolerance and price of every direction."""
    today, cheapest, uniform = sets.today, sets.cheapest, sets.uniform

    def panel(label: str, values: RealArray, everywhere: RealArray) -> plot.IntervalPanel:
        rows = {
            "cheapest": (values, np.zeros(len(values)), values),
            "one tolerance everywhere": (everywhere, everywhere, everywhere),
        }
        return plot.IntervalPanel(label, rows)

    report.section(
        "Allocation",
        "A direction at the widest tolerance needs no precision; the directions with the tightest "
        "tolerances make the noise scatter.",
    )
    panels = [
        panel("tolerance ± [%]", PERCENT * cheapest.tolerance, PERCENT * uniform.tolerance),
        panel("cost [1]", cheapest.cost, uniform.cost),
    ]
    report.figure(
        "allocation",
        lambda: plot.interval_panels(sets.allocator.names, panels),
        "Tolerance and price of every direction: the cheapest ones, and one "
        "tolerance everywhere for the same target.",
    )
    allocation = pd.DataFrame(
        {
            "variable": list(cheapest.names),
            "tolerance today ± [%]": PERCENT * today.tolerance,
            "uniform ± [%]": PERCENT * uniform.tolerance,
            "cheapest ± [%]": PERCENT * cheapest.tolerance,
            "cost today [1]": today.cost,
            "cost uniform [1]": uniform.cost,
            "cost cheapest [1]": cheapest.cost,
            "bound": sets.bound,
        }
    )
    report.table("allocation", allocation)


def _verification_section(report: Report, sets: ToleranceSets) -> None:
    """List cost and scatter of each set, as chosen and as new draws show it."""
    report.section("Verification", f"{sets.checks} new draws of the parts.")
    chosen, check = "sigma of the level, chosen with [dB]", "sigma of the level, verified [dB]"
    allocations, verified = sets.named.values(), sets.verified.values()
    verification = pd.DataFrame(
        {
            "tolerances": list(sets.named),
            "cost [1]": [allocation.total_cost for allocation in allocations],
            chosen: [allocation.sigma_sum * sets.per_line for allocation in allocations],
            check: [row.sigma for row in verified],
        }
    )
    if not sets.by_sigma:
        verification["within limits [%]"] = [PERCENT * row.share for row in verified]
        verification["at least, with 95 % confidence [%]"] = [
            PERCENT * row.share_lower for row in verified
        ]
    report.table(
        "verification",
        verification,
        "Cost and scatter of three sets of tolerances.",
        {chosen: 3, check: 3},
    )


def _free_tolerances(report: Report, front: ToleranceFront) -> None:
    """Show the front with the tolerance of each mount as a variable, by price."""
    free, whole, mounts = front.free, front.table, tuple(front.free.groups)
    affordable = np.flatnonzero(whole["price over today's [1]"] <= 1.0)
    steadiest = affordable[int(whole["sigma against today [%]"].to_numpy()[affordable].argmin())]
    best = whole.loc[steadiest]
    low, high = (f"{PERCENT * bound:g}" for bound in front.bounds)
    report.section(
        "Tolerances as variables",
        f"The tolerance of each mount lies between ±{low} and ±{high} %, as a variable beside the "
        "stiffness factors, and its price, today's tolerance over it, is a third objective. The "
        "tighter ones cost most, the front says what they buy. At no higher price than today's it "
        f"has a design with {signed(best['sigma against today [%]'], 0)} % of sigma and "
        f"{signed(best['mean level against today [dB]'], 1)} dB; its tolerances are "
        + ", ".join(f"{mount} ±{best[f'tolerance {mount} ± [%]']:.0f} %" for mount in mounts)
        + ".",
        folded=True,
    )
    report.table("free_tolerances", whole)
    shown = list(whole.columns[: 3 + len(mounts)])
    values = whole[shown].to_numpy()
    report.figure(
        "free_tolerances",
        lambda: plot.parallel_coordinates(
            [name.replace(" against today", "") for name in shown],
            values,
            np.stack([values.min(axis=0), values.max(axis=0)]),
            whole["price over today's [1]"],
            {
                "today": np.array([1.0, 0.0, 0.0, *(PERCENT * free.space.nominal[-len(mounts) :])]),
                "least sigma at no higher price": values[steadiest],
            },
            value_label="price over today's [1]",
            share_label="from smallest to largest [%]",
        ),
        "Every design of the front over both levels, the price and the tolerance of each mount, "
        "from the smallest to the largest of each.",
    )
