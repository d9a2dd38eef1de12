"""The specification sheet as a part of the supplier's page."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from deboom.report.page import Section, Table
from deboom.study.specification_sheet import SAMPLE, SpecificationSheet, SpecifiedDirection
from deboom.study.specification_tables import (
    DIRECTIONS,
    MISSING,
    PARTS,
    PERCENT,
    PROMISE,
    RATIO_ONLY,
)
from deboom.study.supplier_curves import STATIC_FORCE, WHEEL_TORQUE
from deboom.study.supplier_study import Need

TITLE = "Specification sheet"
INTERVAL = (
    "direction",
    "requirement",
    "accepted from [N/mm]",
    "accepted to [N/mm]",
    "from, of today's [%]",
    "to, of today's [%]",
    "set by the limit",
    "best value [N/mm]",
    "today ± 90 % [%]",
)
CONDITION = (
    "direction",
    STATIC_FORCE,
    WHEEL_TORQUE,
    "frequency [Hz]",
    "amplitude, peak [µm]",
    "there, today [N/mm]",
    "there, from [N/mm]",
    "there, to [N/mm]",
    "there, loss factor [1]",
)
SCATTER = (
    "direction",
    "tolerance wanted ± [%]",
    "best value with tolerance inside",
    "Cpk of the process at least [1]",
    f"Cpk of {SAMPLE} parts at least [1]",
    "sigma saved per % tighter [0.001 dB]",
    "sigma saved per unit of cost [0.001 dB]",
)


def specification_section(sheet: SpecificationSheet, tables: Mapping[str, pd.DataFrame]) -> Section:
    """Compose the section from the tables of the sheet.

    Parameters
    ----------
    sheet : SpecificationSheet
    tables : mapping of str to DataFrame
        See `deboom.study.specification_tables.specification_tables`.
    """
    whole = tables[DIRECTIONS]
    shown = [
        _table(whole, INTERVAL, "Interval of every direction, and the best value of the front."),
        _table(
            whole[whole["frequency [Hz]"].notna()],
            CONDITION,
            "One state of the load case to measure at: today's stiffness there and the same "
            "interval. Measure parts there and divide by today's.",
        ),
        _table(whole, SCATTER, "Scatter about the best value, and what the process must show."),
        Table(tables[PROMISE], "What the intervals promise, and what they follow from."),
        _parts(tables[PARTS]),
    ]
    if len(tables[MISSING]):
        shown.append(Table(tables[MISSING], "Not on this sheet, and where it comes from."))
    return Section(TITLE, "\n\n".join(filter(None, _texts(sheet))), tables=tuple(shown))


def _table(whole: pd.DataFrame, columns: tuple[str, ...], caption: str) -> Table:
    """Return those columns that say anything."""
    said = [name for name in columns if not _empty(whole[name])]
    rounded = {name: 0 for name in said if name.endswith("[N/mm]")}
    rounded |= {name: 2 for name in said if name.startswith("Cpk")}
    rounded |= {name: 1 for name in said if name.endswith("[0.001 dB]")}
    return Table(whole[said], caption, rounded)


def _parts(parts: pd.DataFrame) -> Table:
    names = [name for name in map(str, parts) if not name.endswith("today's [%]")]
    caption = "Part numbers with their pieces and vehicles."
    if "inside the intervals" in names:
        caption = (
            "Part numbers that vehicles share, their stiffness, and whether it lies inside the "
            "intervals; a dash: in none of the vehicles that these were found for."
        )
    return Table(parts[names], caption, {n: 0 for n in names if n.endswith("[N/mm]")})


def _empty(column: pd.Series) -> bool:
    return bool((column.isna() | (column == "–")).all())


def _texts(sheet: SpecificationSheet) -> list[str]:
    return [
        _interval_text(sheet),
        _beyond_text(sheet),
        _part_text(sheet),
        _free_text(sheet),
    ]


def _interval_text(sheet: SpecificationSheet) -> str:
    if sheet.sources.box is None:
        return (
            "There is no acceptance box on this sheet, so it has the best value of the front with "
            "its tolerance, but no interval that deliveries can be held against."
        )
    box = sheet.sources.box.box
    words = (
        "A part is accepted if every direction lies in its interval, whatever the others are; this "
        "decides, not the tolerance band above. Stiffness is the magnitude of the dynamic "
        "stiffness of one piece, mean over the lines of the load case; as a share of today's part "
        "the interval holds at every preload, frequency and amplitude. What is promised holds if "
        "the parts of all mounts keep their intervals. Ends that the limit does not set are where "
        "the search ended: the noise asks for nothing there."
    )
    worst = min(box.responses, key=lambda one: one.share)
    if not box.together and worst.share < box.share_stated:
        words += (
            f" The promised share counts parts and vehicles together: in {sheet.names(worst.name)} "
            f"alone {PERCENT * worst.share:.0f} % of the parts keep the limit."
        )
    own = [one.direction.name for one in sheet.directions if one.direction.need is Need.unknown]
    if own:
        words += (
            f" {RATIO_ONLY.capitalize()}: {', '.join(own)}. Today's stiffness is not known well "
            "enough there to write N/mm; measure a part of today and yours on the same machine."
        )
    return words


def _beyond_text(sheet: SpecificationSheet) -> str:
    """Name the directions whose tolerance about the best value reaches beyond their interval."""
    beyond = [one for one in sheet.directions if one.scatter_fits is False]
    by_limit = [one for one in beyond if one.set_by_limit != "neither"]
    others = [one.direction.name for one in beyond if one not in by_limit]
    words = []
    if by_limit:
        words.append(
            "Best value and tolerance do not fit into the interval: "
            f"{'; '.join(map(_beyond, by_limit))}. Aim for the middle, or make it more exactly."
        )
    if others:
        words.append(
            f"The tolerance of {', '.join(others)} about the best value reaches beyond the edge of "
            "the search: aim for the middle, or ask for a wider search."
        )
    return " ".join(words)


def _beyond(one: SpecifiedDirection) -> str:
    low, high = one.ends
    middle, half = 0.5 * (low + high), (high - low) / (high + low)
    return (
        f"{one.direction.name} ({one.best * one.today:.0f} N/mm ± {PERCENT * one.tolerance:.0f} %; "
        f"the middle is {middle * one.today:.0f} N/mm ± {PERCENT * half:.0f} %)"
    )


def _part_text(sheet: SpecificationSheet) -> str:
    words = (
        "State batch and serial number of every measured part, and the uncertainty of your "
        "measurement (expanded, 95 %): it is taken off the interval at both ends (ISO 14253-1)."
    )
    several = dict.fromkeys(
        one.direction.mount.name for one in sheet.directions if len(one.direction.mount.pieces) > 1
    )
    if several:
        words = (
            f"The pieces of {', '.join(several)}, such as left and right, have one part number, "
            f"and each is judged by itself. {words}"
        )
    asked = [one.capability for one in sheet.directions if np.isfinite(one.capability)]
    if sheet.sources.box is not None and asked:
        words += (
            f" The Cpk per direction leaves {PERCENT * sheet.sources.box.box.share_stated:g} % of "
            f"the pieces inside in all of them; {SAMPLE} measured parts must show the larger one."
        )
    return words


def _free_text(sheet: SpecificationSheet) -> str:
    free = [one.direction.name for one in sheet.directions if one.direction.need is Need.nothing]
    named = f" {', '.join(free)} (no vehicle depends on them)," if free else ""
    return (
        f"Not required:{named} a loss factor other than the wanted one, a static stiffness, a "
        "level in any vehicle. Strength, durability and static travel are matters of other sheets."
    )
