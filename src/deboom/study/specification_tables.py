"""Tables of a specification sheet; each is a sheet of the workbook too."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from deboom.study.made_parts import MadeParts
from deboom.study.motion_report import factor_name, motion_name
from deboom.study.specification_sheet import (
    CONFIDENCE,
    NAN,
    SAMPLE,
    SpecificationSheet,
    SpecifiedDirection,
    measured_capability,
    shared_vehicles,
)
from deboom.study.supplier_curves import MICRO, STATIC_FORCE, WHEEL_TORQUE
from deboom.study.supplier_study import Need

PERCENT = 100.0
SHORT_HASH = 16
"""Characters of a box's hash that a sheet shows."""
DIRECTIONS = "specification"
PROMISE = "specification, promise"
PARTS = "specification, parts"
MISSING = "specification, missing"
FACTOR = "stiffness factor [1]"
NO_BOX = "no box given"
RATIO_ONLY = "of today's part only"
WHICH_ENDS = {
    "from": "from",
    "to": "to",
    "from and to": "from and to",
    "neither": "none",
    "": "not known",
}


def specification_tables(sheet: SpecificationSheet) -> dict[str, pd.DataFrame]:
    """Return all tables of a sheet, by the name of their sheet in the workbook."""
    return {
        DIRECTIONS: direction_table(sheet),
        PROMISE: promise_table(sheet),
        PARTS: part_table(sheet),
        MISSING: missing_table(sheet),
    }


def direction_table(sheet: SpecificationSheet) -> pd.DataFrame:
    """One row per direction: interval, wanted value, test condition, scatter and its worth."""
    case, _ = sheet.study.load_cases[0]
    rows = []
    for one in sheet.directions:
        low, high = one.ends
        setting, asked = one.setting, one.capability
        there = setting.stiffness if setting else NAN
        preload = {setting.preload_label: setting.preload} if setting else {}
        sample = measured_capability(asked, SAMPLE, CONFIDENCE) if np.isfinite(asked) else NAN
        rows.append(
            {
                "direction": one.direction.name,
                "requirement": _requirement(one),
                "accepted from [N/mm]": low * one.today,
                "accepted to [N/mm]": high * one.today,
                "from, of today's [%]": PERCENT * low,
                "to, of today's [%]": PERCENT * high,
                "set by the limit": WHICH_ENDS[one.set_by_limit] if one.limited else "–",
                "best value [N/mm]": one.best * one.today,
                "best value, of today's [%]": PERCENT * one.best,
                "tolerance wanted ± [%]": PERCENT * one.tolerance,
                "best value with tolerance inside": _yes(one.scatter_fits),
                "today [N/mm]": one.today,
                "today ± 90 % [%]": PERCENT * one.half_width,
                "load case": case.name if setting else "–",
                STATIC_FORCE: preload.get(STATIC_FORCE, NAN),
                WHEEL_TORQUE: preload.get(WHEEL_TORQUE, NAN),
                "frequency [Hz]": setting.frequency if setting else NAN,
                "amplitude, peak [µm]": MICRO * setting.amplitude if setting else NAN,
                "there, today [N/mm]": there,
                "there, from [N/mm]": low * there,
                "there, to [N/mm]": high * there,
                "there, loss factor [1]": setting.loss_factor if setting else NAN,
                "Cpk of the process at least [1]": asked,
                f"Cpk of {SAMPLE} parts at least [1]": sample,
                **_worth(sheet, one),
            }
        )
    return pd.DataFrame(rows)


def promise_table(sheet: SpecificationSheet) -> pd.DataFrame:
    """Limits, shares, and which files the sheet follows from: item and value."""
    study, sources = sheet.study, sheet.sources
    items: dict[str, str] = {}
    if sources.box is not None:
        box = sources.box.box
        what = "parts" if box.together else "parts and vehicles"
        low, high = box.band
        items["what is limited"] = f"{box.quantity}, {low:g} to {high:g} Hz, in {box.unit}"
        for response in box.responses:
            items[f"limit of {sheet.names(response.name)}"] = (
                f"{response.limit:.2f} {box.unit}, kept by {_percent(response.share)} of the parts"
            )
        items["share stated"] = f"{_percent(box.share_stated)} of {what}"
        items["share verified"] = (
            f"{_percent(box.share_verified)}, at least {_percent(box.share_bound)} with "
            f"{PERCENT * box.confidence:g} % confidence, {box.n_parts} independent parts, {box.law}"
        )
        again = sources.box.measured_again
        if again is not None:
            items["the same, with all measurements made again"] = (
                f"{_percent(again[0])} to {_percent(again[1])} (90 % interval)"
            )
        cases = ", ".join(f"{name}, weight {weight:g}" for name, weight in box.load_cases)
        items["load cases"] = cases
        items["stiffness"] = box.variables[0].condition
        items["acceptance box, SHA-256"] = sources.box.sha256[:SHORT_HASH]
    if sources.tolerances is not None:
        items |= _tolerance_items(sheet)
    if sources.sharing is not None:
        found = sources.sharing.summary
        items["part numbers of all vehicles"] = (
            f"{found['part_numbers_min']} instead of {found['part_numbers_own']}; sharing costs "
            f"{found['price_db']:.2f} dB in the mean, {found['price_worst_db']:.2f} dB at most"
        )
    items["scatter of parts"] = MadeParts(study.space, study.model.structure).text
    items["a factor"] = (
        f"{factor_name(study.motion_index)}, motion {motion_name(study.motion_index)}"
    )
    items["run of the front"] = f"{study.run.entry.name}, {study.pick.value.replace('-', ' ')}"
    return pd.DataFrame({"item": list(items), "value": list(items.values())})


def part_table(sheet: SpecificationSheet) -> pd.DataFrame:
    """One row per part number: pieces, vehicles, and its stiffness inside the intervals or not.

    Without a run of commonality each mount is one part number in all vehicles of the front. A part
    number of none of these vehicles is held against nothing.
    """
    sharing, rows = sheet.sources.sharing, []
    for mount in sheet.mounts:
        own = {d.direction.name: d for d in sheet.directions if d.direction.mount.name == mount}
        pieces = len(next(iter(own.values())).direction.mount.pieces)
        if sharing is None:
            vehicles = ", ".join(map(sheet.names, sheet.study.vehicles))
            rows.append({"part number": mount, "pieces in a vehicle": pieces, "vehicles": vehicles})
            continue
        table = sharing.part_numbers
        for number, lines in table[table["direction"].isin(own)].groupby("part number", sort=False):
            shared = {
                own[name]: float(factor)
                for name, factor in zip(lines["direction"], lines[FACTOR], strict=True)
            }
            vehicles = str(lines["vehicles"].iloc[0])
            rows.append(
                {
                    "part number": number,
                    "pieces in a vehicle": pieces,
                    "vehicles": shared_vehicles(sheet.names, vehicles),
                    **{
                        f"{one.direction.axis} [N/mm]": factor * one.today
                        for one, factor in shared.items()
                    },
                    **{
                        f"{one.direction.axis}, of today's [%]": PERCENT * factor
                        for one, factor in shared.items()
                    },
                    "inside the intervals": _inside(sheet, shared, vehicles),
                }
            )
    return pd.DataFrame(rows)


def _inside(
    sheet: SpecificationSheet, shared: Mapping[SpecifiedDirection, float], vehicles: str
) -> str:
    """Say which axes of a part number lie outside; a dash where nothing can be compared."""
    served = {name.strip() for name in vehicles.split(",")} & set(sheet.study.vehicles)
    limited = {one: f for one, f in shared.items() if one.limited and np.isfinite(f)}
    if not served or not limited:
        return "–"
    outside = [one.direction.axis for one, f in limited.items() if not _within(one.ends, f)]
    return f"no: {', '.join(outside)}" if outside else "yes"


def _within(ends: tuple[float, float], factor: float) -> bool:
    return ends[0] <= factor <= ends[1]


def missing_table(sheet: SpecificationSheet) -> pd.DataFrame:
    """One row per piece that is not there: what it would say, and the command that gives it."""
    sources, pick = sheet.sources, sheet.study.pick.value
    rows = []
    if sources.box is None:
        rows.append(
            (
                "acceptance intervals, shares, limits, Cpk",
                f"deboom run studies/solution_box.py --front RUN --pick {pick}",
                "--box",
            )
        )
    if sources.tolerances is None:
        rows.append(
            (
                "tolerances by what they are worth (here: those of the front)",
                f"deboom run studies/tolerance_allocation.py --from-run RUN --pick {pick}",
                "--tolerances",
            )
        )
    if sources.sharing is None:
        rows.append(
            (
                "which vehicles share a part number",
                "deboom run studies/commonality.py",
                "--sharing",
            )
        )
    if sheet.study.model.structure is None:
        rows.append(
            (
                "what pieces of a batch and axes of a piece have in common",
                "the study of the front with --parts FILE",
                "a new RUN",
            )
        )
    return pd.DataFrame(rows, columns=["missing", "comes from", "goes to"])


def _tolerance_items(sheet: SpecificationSheet) -> dict[str, str]:
    assert sheet.sources.tolerances is not None
    found = sheet.sources.tolerances.summary
    if "share_stated" in found:
        target = (
            f"{_percent(found['share_stated'])} of parts and vehicles within their limits, "
            f"verified {_percent(found['share_verified'])}"
        )
    else:
        target = (
            f"σ of the mean level {found['sigma_cheapest_db']:.3f} dB, verified "
            f"{found['sigma_verified_db']:.3f} dB"
        )
    return {
        "target of the tolerances": target,
        "cost of these tolerances": f"{PERCENT * found['cost_ratio_to_uniform']:.0f} % of one "
        "tolerance everywhere for the same target",
    }


def _requirement(one: SpecifiedDirection) -> str:
    if one.direction.need is Need.nothing:
        return Need.nothing.value
    if one.direction.need is Need.unknown:
        return RATIO_ONLY if one.limited else Need.unknown.value
    return "interval" if one.limited else NO_BOX


def _worth(sheet: SpecificationSheet, one: SpecifiedDirection) -> dict[str, float]:
    labels = ("sigma saved per % tighter [0.001 dB]", "sigma saved per unit of cost [0.001 dB]")
    if sheet.sources.tolerances is None:
        return dict.fromkeys(labels, NAN)
    table = sheet.sources.tolerances.directions
    columns = (
        "sigma per % of tolerance, cheapest [0.001 dB]",
        "sigma per unit of cost, cheapest [0.001 dB]",
    )
    known = one.direction.name in table.index
    return {
        label: float(table.loc[one.direction.name, column]) if known else NAN  # type: ignore[arg-type]
        for label, column in zip(labels, columns, strict=True)
    }


def _yes(value: bool | None) -> str:
    return {True: "yes", False: "no", None: "–"}[None if value is None else bool(value)]


def _percent(share: float) -> str:
    return f"{PERCENT * share:.2f} %"
