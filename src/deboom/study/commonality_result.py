"""Tables, figures, headline numbers and page of shared mounts."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from deboom.explore.shared_design import SharedDesign
from deboom.report import figures
from deboom.report.page import Headline, Page, Picture, Section, Table
from deboom.report.style import signed
from deboom.study.commonality import CommonalityStudy
from deboom.study.motion_report import motion_report
from deboom.study.result import Scalar, StudyResult
from deboom.study.supplier_names import letters

TERMS = ("booming noise", "SPLV", "stiffness factor", "tolerance")
PERCENT = 100.0


def commonality_result(study: CommonalityStudy) -> StudyResult:
    """Make tables, figures, headline numbers and page.

    Parameters
    ----------
    study : CommonalityStudy

    Returns
    -------
    StudyResult
        Tables ``part_numbers``, ``vehicles``, ``counts``.
    """
    tables = {
        "part_numbers": part_table(study),
        "vehicles": vehicle_table(study),
        "counts": count_table(study),
    }
    pictures = commonality_figures(study)
    summary = commonality_summary(study)
    table = (study.aims.limits,) if study.aims.limits else ()
    return StudyResult(
        tables=tables,
        figures=pictures,
        summary=summary,
        page=_page(study, tables, pictures, summary),
        inputs=(*study.runs.platform.input_files, *table),
        facts={"kernel": study.level.index.kernel.name},
    )


def part_table(study: CommonalityStudy) -> pd.DataFrame:
    """One row per part number and axis: its stiffness factor and its vehicles."""
    chosen, space = study.found.fewest, study.problem.space
    rows: list[dict[str, object]] = []
    for part, (mount, columns) in enumerate(
        zip(study.problem.part_names, study.problem.columns, strict=True)
    ):
        for number in range(chosen.sharing.counts[part]):
            holder = np.flatnonzero(chosen.sharing.numbers[part] == number)[0]
            for column in columns:
                heard = space.names[column] not in study.silent
                factor = chosen.designs[holder, column] if heard else np.nan
                rows.append(
                    {
                        "part number": f"{mount} {letters(number)}",
                        "direction": space.names[column],
                        "stiffness factor [1]": factor,
                        "vehicles": ", ".join(chosen.sharing.members(part, number)),
                    }
                )
    return pd.DataFrame(rows)


def vehicle_table(study: CommonalityStudy) -> pd.DataFrame:
    """One row per vehicle: today, with mounts of its own, with shared ones, and its limit."""
    chosen = study.found.fewest
    return pd.DataFrame(
        {
            "vehicle": study.vehicles,
            "today [dB(A)]": study.today,
            "own mounts [dB(A)]": study.own.levels,
            "shared mounts [dB(A)]": chosen.levels,
            "limit as drawn [dB(A)]": study.problem.limits,
            "margin for scatter [dB]": study.margin,
            "price of sharing [dB]": study.price(chosen),
            "change against today [dB]": chosen.levels - study.today,
            "cars within the limit [%]": PERCENT * study.shares,
        }
    )


def count_table(study: CommonalityStudy) -> pd.DataFrame:
    """One row per count of part numbers that is worth its numbers, and the comparisons."""
    named = [(str(one.sharing.total), one) for one in study.found.by_count]
    if study.by_group is not None:
        named.append((f"{study.by_group.sharing.total}, one set per group", study.by_group))
    n_own = len(study.problem.part_names) * len(study.vehicles)
    rows = [_count_row(study, name, one) for name, one in named]
    rows.append({"part numbers": f"{n_own}, every vehicle its own", "worst price [dB]": 0.0})
    rows[-1] |= {"mean price [dB]": 0.0, "dearest for": "", "worst excess [dB]": _own_excess(study)}
    return pd.DataFrame(rows)


def _own_excess(study: CommonalityStudy) -> float:
    return float((study.own.levels - study.problem.limits).max())


def _count_row(study: CommonalityStudy, name: str, one: SharedDesign) -> dict[str, object]:
    price = study.price(one)
    counts = zip(study.problem.part_names, one.sharing.counts, strict=True)
    return {
        "part numbers": name,
        **{f"of {mount}": count for mount, count in counts},
        "worst price [dB]": float(price.max()),
        "dearest for": study.vehicles[int(np.argmax(price))],
        "mean price [dB]": float(price.mean()),
        "worst excess [dB]": one.worst,
    }


def commonality_summary(study: CommonalityStudy) -> dict[str, Scalar]:
    """Headline numbers; the study's docstring explains the keys."""
    chosen, found = study.found.fewest, study.found
    price = study.price(chosen)
    summary: dict[str, Scalar] = {
        "part_numbers_min": chosen.sharing.total,
        "part_numbers_lower_bound": found.lower_bound,
        "part_numbers_own": len(study.problem.part_names) * len(study.vehicles),
        "price_db": float(price.mean()),
        "price_worst_db": float(price.max()),
        "price_worst_vehicle": study.vehicles[int(np.argmax(price))],
        "one_set_price_worst_db": float(study.price(found.by_count[0]).max()),
        "change_db_per_line_mean": float((chosen.levels - study.today).mean()),
        "share_verified_min": float(study.shares.min()),
    }
    if study.by_group is not None:
        summary["group_sets_part_numbers"] = study.by_group.sharing.total
        summary["group_sets_price_worst_db"] = float(study.price(study.by_group).max())
    return summary


def commonality_figures(study: CommonalityStudy) -> dict[str, bytes]:
    """Draw all pictures of the page; file stem → PNG."""
    counts = np.array([one.sharing.total for one in study.found.by_count], dtype=float)
    worst = np.array([study.price(one).max() for one in study.found.by_count])
    mean = np.array([study.price(one).mean() for one in study.found.by_count])
    chosen, group = study.found.fewest, study.by_group
    marks = {}
    if group is not None:
        price = float(study.price(group).max())
        marks["one set per group, worst vehicle"] = (float(group.sharing.total), price)
    labels = np.array([[letters(number) for number in row] for row in chosen.sharing.numbers])
    return {
        "price": figures.fronts(
            {"worst vehicle": (counts, worst), "mean of the vehicles": (counts, mean)},
            {},
            marks,
            mean_label="mount part numbers in all",
            sigma_label="level above mounts of its own [dB]",
        ),
        "sharing": figures.shared_parts(study.problem.part_names, study.vehicles, labels),
    }


def _page(
    study: CommonalityStudy,
    tables: Mapping[str, pd.DataFrame],
    pictures: Mapping[str, bytes],
    summary: Mapping[str, Scalar],
) -> Page:
    chosen, aims = study.found.fewest, study.aims
    total, bound = chosen.sharing.total, study.found.lower_bound
    proof = (
        "No sharing has fewer, as far as descents from several starts find the best values."
        if total == bound
        else f"Fewer than {bound} are impossible, as far as descents from several starts find the "
        f"best values; between {bound} and {total} the search found none."
    )
    asked = (
        f"the limits of {aims.limits.name}"
        if aims.limits
        else f"{aims.allowed:g} dB above what mounts of its own would give it"
    )
    one_set = float(summary["one_set_price_worst_db"])
    return Page(
        title="Mounts that vehicles can share",
        question=(
            f"How few mount part numbers serve {len(study.vehicles)} vehicles, if {aims.share:.0%} "
            f"of the cars of each are to keep {asked}?"
        ),
        headlines=(
            Headline(f"{total}", f"part numbers instead of {summary['part_numbers_own']}"),
            Headline(f"{signed(float(summary['price_db']), 2)} dB", "mean price of sharing"),
            Headline(
                f"{signed(float(summary['price_worst_db']), 2)} dB",
                f"for {summary['price_worst_vehicle']}, the worst",
            ),
            Headline(
                f"{signed(float(summary['change_db_per_line_mean']), 2)} dB",
                "mean change against today",
            ),
        ),
        terms=TERMS,
        warnings=(
            *_not_kept(study),
            *motion_report(study.level.index, chosen.designs).warnings,
        ),
        sections=(
            Section(
                "Which vehicle has which mount",
                f"{proof} A letter is a part number of the mount in that row; vehicles with one "
                "letter share it in all directions.",
                figures=(
                    Picture(
                        pictures["sharing"],
                        "Part number of each mount in each vehicle",
                        "Equal letters are equal parts.",
                    ),
                ),
                tables=(
                    Table(
                        tables["part_numbers"],
                        "Values of the part numbers; a direction without a number is heard by no "
                        "vehicle, any stiffness within the bounds serves.",
                        {"stiffness factor [1]": 3},
                    ),
                ),
            ),
            Section(
                "What sharing costs",
                "A vehicle with mounts of its own is the zero line. One set for all vehicles costs "
                f"the worst of them {one_set:.2f} dB per line; every further part number buys some "
                "of it back. Counts that buy nothing are left out.",
                figures=(
                    Picture(
                        pictures["price"],
                        "Price of sharing over the count of part numbers",
                        f"Price against part numbers; {total} keep every limit.",
                    ),
                ),
                tables=(
                    Table(
                        tables["counts"],
                        "Best sharing found for each count, with values that keep the worst "
                        "vehicle low; those of the chosen one are then moved until all vehicles "
                        "together are as quiet as their limits allow. The excess is beyond the "
                        "limit, negative where room is left.",
                    ),
                    Table(
                        tables["vehicles"],
                        "Mean level of the lines, each with the energy that scatter adds: a notch "
                        "that no made part has is no gain. The limit is that of a car as drawn: "
                        "the margin between it and the asked share of cars as made is taken off. "
                        "The last column counts cars with draws of its own.",
                    ),
                ),
            ),
        ),
    )


def _not_kept(study: CommonalityStudy) -> tuple[str, ...]:
    """Warn of vehicles whose cars, counted with draws of its own, miss the asked share."""
    pairs = zip(study.vehicles, study.shares, strict=True)
    short = [
        f"{name} ({PERCENT * share:.1f} %)" for name, share in pairs if share < study.aims.share
    ]
    if not short:
        return ()
    return (
        f"New draws find fewer than {study.aims.share:.0%} of the cars within the limit: "
        f"{', '.join(short)}. The margin for scatter is that of mounts of its own.",
    )
