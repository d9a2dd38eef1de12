"""What limits did to a search, on a page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from deboom.arrays import RealArray
from deboom.errors import listed
from deboom.explore.moments import STATISTICS, Limit
from deboom.explore.result import Front, SearchResult
from deboom.explore.robust import Limits, chosen
from deboom.report import Report


def report_limits(report: Report, front: Front) -> None:
    """Add to a report what the limits of a search did; nothing without limits.

    The report gets the tables ``limits`` of numbers of a design, ``level_limits`` of numbers over
    the scatter, and ``beyond_limits``, the key ``n_beyond_limits`` and a section. It warns of a
    named design that misses a limit because variables without effect on the noise went back to
    nominal.
    """
    limits = front.robust.limits
    if not limits:
        return
    of_design = limits.of_designs
    report.section("Limits", _limits_in_words(front))
    if of_design:
        designs = np.stack(list(front.named_designs.values()))
        values = front.robust.numbers(designs, [limit.number for limit in of_design.limits])
        report.warn(*_misses_at_nominal(of_design, front.named_designs, values))
        report.table(
            "limits",
            _limited_numbers(of_design.limits, dict(zip(front.named_designs, values, strict=True))),
            "Limited numbers of the named designs, without scatter unless the name says otherwise.",
        )
    if len(of_design) < len(limits):
        report.table(
            "level_limits",
            _limited_levels(front),
            "Limited levels of the named designs, under the draws of the verification: means over "
            f"the lines, and loudest lines. {_misses_in_words(_missed_levels(front))}",
        )
    report.table("beyond_limits", _beyond(front.search, front.variables, limits))
    report.number(
        "n_beyond_limits",
        int(front.search.infeasible.sum()),
        "",
        "evaluated designs that miss a limit",
    )


def _limits_in_words(front: Front) -> str:
    """Say what had to keep limits, and how many designs of the search miss one."""
    statistics = {limit.number.statistic for limit in front.robust.limits.limits}
    estimates = {name for name in statistics if STATISTICS[name].is_estimate}
    whose, draws = [], ""
    if estimates:
        whose.append("by the levels over the scatter")
        draws = " under the draws of the search"
    if "nominal" in statistics:
        whose.append("by the design itself")
    if statistics - estimates - {"nominal"}:
        whose.append("by every drawn part")
    return (
        f"Limits had to be kept {listed(whose)}: {front.search.infeasible.sum()} of "
        f"{front.search.n_evaluated} designs miss one. All designs of the front keep all{draws}."
    )


def _misses_at_nominal(
    limits: Limits, designs: Mapping[str, RealArray], values: RealArray
) -> list[str]:
    """Say which named designs, with limited numbers (n, l), miss a limit; the first one may."""
    return [
        f"The design '{name}' misses a limit: {limits.closest(excess[np.newaxis])}."
        for name, excess in list(zip(designs, limits.excess(values), strict=True))[1:]
        if np.any(excess > 0.0)
    ]


def _missed_levels(front: Front) -> RealArray:
    """Return by how much verified designs miss the limit that they miss most, (n,) [dB]."""
    excess = np.where(np.isfinite(front.values.excess), front.values.excess, 0.0)
    limits = front.judge.sets[0].limits
    n_lines = [limits.limits[row].n_lines for row in limits.rows]
    return np.asarray((excess / n_lines).max(axis=1))


def _misses_in_words(missed: RealArray) -> str:
    """Say how many verified designs miss a limit of a level, and by how much (n,) [dB]."""
    n_missed = np.count_nonzero(missed > 0.0)
    if n_missed == 0:
        return "All designs of the front keep all limits there too."
    return (
        f"There {n_missed} of {missed.size} designs of the front miss a limit, by "
        f"{missed.max():.2g} dB at most; no pick does."
    )


def _limited_levels(front: Front) -> pd.DataFrame:
    """Tabulate limited numbers over the scatter, those of sums over lines divided by the lines."""
    designs, sets = np.stack(list(front.named_designs.values())), front.judge.sets
    limited = [robust.limits for robust in sets]
    values = np.mean([robust.limits.numbers(robust(designs).excess) for robust in sets], axis=0)
    # today's number is another one under each set of draws
    least, most = (
        np.mean([[float(getattr(each, side)) for each in one.limits] for one in limited], axis=0)
        for side in ("at_least", "at_most")
    )
    scales = np.array([1.0 / limit.n_lines for limit in limited[0].limits])
    limits = []
    for limit, low, high, scale in zip(
        limited[0].limits, least * scales, most * scales, scales, strict=True
    ):
        name = limit.number.name if scale == 1.0 else f"{limit.number.name}, per line"
        number = replace(limit.number, label=name)
        limits.append(Limit(number, at_least=float(low), at_most=float(high)))
    return _limited_numbers(limits, dict(zip(front.named_designs, values * scales, strict=True)))


def _limited_numbers(limits: Sequence[Limit], designs: Mapping[str, RealArray]) -> pd.DataFrame:
    """One row per limited number: its value in each design, and its bounds.

    - `designs`: values of the limited numbers of each design, by its name.
    """
    labels = [f"{limit.number.name} [{limit.number.unit}]" for limit in limits]
    table: dict[str, Sequence[object]] = {"number": labels}
    table |= {name: row.tolist() for name, row in designs.items()}
    for side in ("at_least", "at_most"):
        values = np.array([getattr(limit, side) for limit in limits])
        table[side.replace("_", " ")] = np.where(np.isfinite(values), values, np.nan).tolist()
    return pd.DataFrame(table)


def _beyond(search: SearchResult, variables: Sequence[str], limits: Limits) -> pd.DataFrame:
    """One row per design that misses a limit: factors, and by how much it misses each."""
    beyond = chosen(search.evaluated, np.flatnonzero(search.infeasible))
    factors = {f"{name} [1]": beyond.designs[:, k] for k, name in enumerate(variables)}
    excess = {label: beyond.excess[:, k] for k, label in enumerate(beyond_labels(limits))}
    return pd.DataFrame({**factors, **excess})


def beyond_labels(limits: Limits) -> list[str]:
    """Return the columns of by how much a design misses each bound; negative where room is left."""
    return [f"beyond {name} [{name.rpartition(' ')[2]}]" for name in limits.names]
