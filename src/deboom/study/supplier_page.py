"""The page and the workbook for a mount supplier."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from datetime import UTC, date, datetime
from pathlib import Path

import numpy as np
import pandas as pd

from deboom.choices import Pick
from deboom.errors import InputError
from deboom.files.disk import replace_bytes
from deboom.files.run_folder import hash_files
from deboom.files.tables import workbook_bytes
from deboom.measurement.uncertainty import Interval
from deboom.mounts.mount import AXES, mean_operating_stiffness
from deboom.plot import IndexBars
from deboom.plot.style import MUTED, mount_colours, signed, vehicle_colours
from deboom.report.page import Headline, Page, Picture, Section, Table, render_page
from deboom.study import pngs as figures
from deboom.study.platform_model import (
    Factor,
    MotionReport,
    factor_name,
    motion_name,
    motion_report,
)
from deboom.study.robust_front import N_PER_MM, NOTICEABLE
from deboom.study.specification import (
    DIRECTIONS,
    MISSING,
    PARTS,
    PERCENT,
    PROMISE,
    RATIO_ONLY,
    SAMPLE,
    SpecificationFiles,
    SpecificationSheet,
    SpecificationSources,
    SpecifiedDirection,
    specification_sheet,
    specification_sources,
    specification_tables,
)
from deboom.study.supplier_numbers import (
    ALL,
    CHANGE,
    MEASURED_AGAIN,
    MICRO,
    PICKED,
    STATIC_FORCE,
    WHEEL_TORQUE,
    StiffnessCurve,
    SupplierCertainty,
    SupplierEffects,
    half_width_label,
    part_table,
    preload_factor,
    stiffness_curves,
    stiffness_panels,
)
from deboom.study.supplier_study import (
    DRAWS,
    Direction,
    Need,
    ShownNames,
    SupplierStudy,
    page_text,
    refuse_leaks,
    shown_names,
    supplier_study,
    workbook_text,
)

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
        See `deboom.study.specification.specification_tables`.
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


@dataclass(frozen=True, eq=False)
class SupplierContent:
    """All that the page is made of.

    Parameters
    ----------
    effects : SupplierEffects
        Of all parts.
    mount : str or None
        The one that the page is about; None: all.
    directions : tuple of Direction
        That are shown.
    curves : tuple of StiffnessCurve
        Of these.
    names : ShownNames
        Of the vehicles.
    tables : mapping of str to DataFrame
        By sheet of the workbook.
    motion : MotionReport
        Models behind the levels, checked at today's and the wanted design.
    sheet : SpecificationSheet
        What can be quoted.
    """

    effects: SupplierEffects
    mount: str | None
    directions: tuple[Direction, ...]
    curves: tuple[StiffnessCurve, ...]
    names: ShownNames
    tables: Mapping[str, pd.DataFrame]
    motion: MotionReport
    sheet: SpecificationSheet

    @property
    def study(self) -> SupplierStudy:
        """What is asked for."""
        return self.effects.study

    @property
    def mounts(self) -> tuple[str, ...]:
        """Names of the mounts that are shown."""
        return tuple(dict.fromkeys(direction.mount.name for direction in self.directions))

    @property
    def vehicles(self) -> tuple[str, ...]:
        """Shown names of the vehicles."""
        return tuple(self.names(vehicle) for vehicle in self.study.vehicles)


def supplier_figures(content: SupplierContent) -> dict[str, bytes]:
    """Draw all pictures of the page; file stem → PNG."""
    study, effects = content.study, content.effects
    colours = mount_colours([mount.name for mount in study.platform.mounts])
    found = effects.importance
    columns = [direction.column for direction in content.directions]
    own = [colours[direction.mount.name] for direction in content.directions]
    labels = [direction.name for direction in content.directions]
    pictures = {}
    for mount in content.mounts:
        curves = [one for one in content.curves if one.direction.mount.name == mount]
        if curves:
            panels = stiffness_panels(study, curves)
            pictures[f"stiffness {mount}"] = figures.stiffness_over_preload(panels, colours[mount])
    pictures["parts"] = figures.part_effects(
        content.vehicles,
        {f"only {mount}": effects.change[mount] for mount in content.mounts},
        {f"only {mount}": effects.half_width[mount] for mount in content.mounts},
        effects.change[ALL],
        {f"only {mount}": colours[mount] for mount in content.mounts},
        x_label="change of the mean level [dB]",
        together_label=f"{ALL} as wanted",
    )
    if content.mount is not None:
        pictures["levels"] = _levels(content, content.mount)
    pictures["importance"] = figures.index_bars(
        labels,
        own,
        [
            IndexBars(
                vehicle,
                found.first[columns, place],
                found.total[columns, place],
                found.total_interval[columns, place],
                found.zero[columns, place],
            )
            for place, vehicle in enumerate(content.vehicles)
        ],
        x_label="share of the variance [1]",
    )
    worth = content.tables["tolerances"]
    asked = [direction.need is not Need.nothing for direction in content.directions]
    pictures["tolerances"] = figures.tolerance_worth(
        labels,
        worth["share of sigma [%]"],
        worth["sigma saved per % tighter [0.001 dB]"],
        [colour if need else MUTED for colour, need in zip(own, asked, strict=True)],
    )
    return pictures


def _levels(content: SupplierContent, mount: str) -> bytes:
    study, design = content.study, content.effects.designs[mount]
    case, _ = study.load_cases[0]
    before, after = content.effects.levels(design)
    peaks = content.effects.peaks(design)
    colours = vehicle_colours(study.platform.fleet.names)
    return figures.spl_curves(
        np.asarray(study.index.frequency),
        case.order,
        before,
        after,
        content.vehicles,
        [[c.before.frequency for c in peaks[v] if c.before] for v in study.vehicles],
        [[c.after.frequency for c in peaks[v] if c.after] for v in study.vehicles],
        {content.names(vehicle): colours[vehicle] for vehicle in study.vehicles},
    )


PERCENT_3 = 100.0
MILLI = 1e3
MM = 1e3
"""From m to mm."""
NAN = float("nan")
SHOWN_FROM = 0.05
"""Largest share of a direction of which its vehicle is named [%]."""
SHORT_HASH = 12
"""Characters of a hash that a data sheet shows."""


def requirement_table(
    study: SupplierStudy,
    directions: Sequence[Direction],
    curves: Sequence[StiffnessCurve],
    sure: SupplierCertainty,
) -> pd.DataFrame:
    """One row per direction: today's and the wanted stiffness, its limits, and the loss factor.

    The relative half width of today's stiffness is that of every stiffness in its row.

    A stiffness is the mean magnitude over the lines of the first load case. A direction that is not
    identified has no number at all.
    """
    by_name = {curve.direction.name: curve for curve in curves}
    rows = []
    for direction in directions:
        column, curve = direction.column, by_name.get(direction.name)
        known = curve is not None and direction.need is not Need.unknown
        today = _stiffness(study, direction) if known else NAN
        loss = float(np.mean(curve.loss_factor[: curve.n_first])) if curve and known else NAN
        loss = loss if loss > 0.0 else NAN  # a mount cannot give energy: what was measured is noise
        asked = direction.need in (Need.wanted, Need.anything)
        factor = float(study.wanted[column]) if asked else NAN
        tolerance = float(study.space.tolerance[column]) if asked else NAN
        wanted = today * factor
        free = study.interval[column] if asked else (NAN, NAN)
        lost = 1.0 if direction.loss_column is None else study.wanted[direction.loss_column]
        place = study.directions.index(direction)
        half = float(sure.stiffness.half_width[place] / sure.stiffness.value[place])
        half_loss = float(sure.loss.half_width[place])
        rows.append(
            {
                "direction": direction.name,
                "requirement": direction.need.value,
                "today [N/mm]": today,
                "± 90 % [%]": PERCENT_3 * half if known else NAN,
                "wanted [N/mm]": wanted,
                "wanted / today [1]": factor,
                "tolerance ± [%]": PERCENT_3 * tolerance,
                "at least [N/mm]": wanted * (1.0 - tolerance),
                "at most [N/mm]": wanted * (1.0 + tolerance),
                "free from [N/mm]": today * free[0],
                "free to [N/mm]": today * free[1],
                "loss factor today [1]": loss,
                "loss factor ± 90 % [1]": half_loss if loss > 0.0 else NAN,
                "loss factor wanted [1]": loss * float(lost) if asked else NAN,
            }
        )
    return pd.DataFrame(rows)


def condition_table(curves: Sequence[StiffnessCurve]) -> pd.DataFrame:
    """One row per direction: the preload in the load cases, and where its curve is read."""
    rows = []
    for curve in curves:
        low, high = curve.preload_range
        condition = curve.condition if curve.has_curve else None
        rows.append(
            {
                "direction": curve.direction.name,
                "preload": curve.label,
                "least preload": low,
                "greatest preload": high,
                "curve at [Hz]": condition.frequency if condition else NAN,
                "amplitude, peak [µm]": condition.amplitude * MICRO if condition else NAN,
            }
        )
    return pd.DataFrame(rows)


def curve_table(study: SupplierStudy, curves: Sequence[StiffnessCurve]) -> pd.DataFrame:
    """Points of today's curves and of the wanted ones, where something is asked."""
    tables = []
    for curve in curves:
        direction = curve.direction
        if direction.need not in (Need.wanted, Need.anything):
            continue
        backed = np.isfinite(curve.curve_stiffness)
        preload, today = curve.curve_preload[backed], curve.curve_stiffness[backed]
        wanted = float(study.wanted[direction.column]) * today
        tolerance = float(study.space.tolerance[direction.column])
        points = {
            "preload today": preload,
            "today [N/mm]": today,
            "preload wanted": preload_factor(study, curve) * preload,
            "wanted [N/mm]": wanted,
            "at least [N/mm]": wanted * (1.0 - tolerance),
            "at most [N/mm]": wanted * (1.0 + tolerance),
        }
        tables.append(pd.DataFrame({"direction": direction.name, "preload": curve.label, **points}))
    return pd.concat(tables, ignore_index=True) if tables else pd.DataFrame()


def importance_table(
    effects: SupplierEffects, directions: Sequence[Direction], names: ShownNames
) -> pd.DataFrame:
    """One row per direction and vehicle: Sobol indices with the half widths of their intervals."""
    found = effects.importance
    return pd.DataFrame(
        [
            {
                "direction": direction.name,
                "vehicle": names(vehicle),
                "total [1]": found.total[direction.column, place],
                "total ± 95 % [1]": found.total_interval[direction.column, place],
                "alone [1]": found.first[direction.column, place],
                "alone ± 95 % [1]": found.first_interval[direction.column, place],
                "above zero": not found.zero[direction.column, place],
            }
            for direction in directions
            for place, vehicle in enumerate(found.outputs)
        ]
    )


def tolerance_table(
    effects: SupplierEffects, directions: Sequence[Direction], names: ShownNames
) -> pd.DataFrame:
    """One row per direction: its share in the scatter, and what a tighter tolerance is worth."""
    shares, study, sure = effects.shares, effects.study, effects.certainty
    rows = []
    for direction in directions:
        row = study.directions.index(direction)
        own = [
            place
            for place, draw in enumerate(shares.names)
            if draw == direction.name or draw.startswith(f"{direction.name} ")
        ]
        of_vehicle = PERCENT_3 * shares.of_response[own].sum(axis=0)
        worst = int(np.argmax(of_vehicle))
        rows.append(
            {
                "direction": direction.name,
                "tolerance today ± [%]": PERCENT_3 * study.space.tolerance[direction.column],
                "share of sigma [%]": PERCENT_3 * shares.of_sum[own].sum(),
                "share of sigma ± 90 % [%]": PERCENT_3 * float(sure.share.half_width[row]),
                "sigma saved per % tighter [0.001 dB]": (
                    MILLI * effects.tolerance_gain[direction.column]
                ),
                "sigma saved ± 90 % [0.001 dB]": MILLI
                * float(sure.gain.half_width[row])
                / PERCENT_3,
                "largest share [%]": of_vehicle[worst],
                "in": names(study.vehicles[worst]) if of_vehicle[worst] >= SHOWN_FROM else "–",
                **{
                    f"share of sigma², {names(vehicle)} [%]": of_vehicle[place]
                    for place, vehicle in enumerate(study.vehicles)
                },
            }
        )
    return pd.DataFrame(rows)


def part_summary(effects: SupplierEffects, parts: pd.DataFrame) -> pd.DataFrame:
    """One row per part alone, and all together: mean over the vehicles, best and worst of them."""
    rows = []
    for name, table in parts.groupby("changed", sort=False):
        changes = table[CHANGE].to_numpy()
        half = _half_widths(table, CHANGE).to_numpy()
        best, worst = int(np.argmin(changes)), int(np.argmax(changes))
        vehicles = table["vehicle"].to_list()
        own = ALL if name == ALL else str(name).removeprefix("only ")
        ratio = effects.certainty.sigma_ratio(own)
        rows.append(
            {
                "changed": name,
                "mean of the vehicles [dB]": changes.mean(),
                "mean ± 90 % [dB]": float(effects.certainty.mean_change(own).half_width),
                "best [dB]": changes[best],
                "best ± 90 % [dB]": half[best],
                "best in": vehicles[best],
                "least [dB]": changes[worst],
                "least ± 90 % [dB]": half[worst],
                "least in": vehicles[worst],
                "change of sigma [%]": PERCENT_3
                * (table["sigma then [dB]"].sum() / table["sigma today [dB]"].sum() - 1.0),
                "change of sigma ± 90 % [%]": PERCENT_3 * float(ratio.half_width),
            }
        )
    return pd.DataFrame(rows)


def one_part_table(parts: pd.DataFrame, mount: str) -> pd.DataFrame:
    """One row per vehicle: what this part does alone, beside all parts together."""
    alone = parts[parts["changed"] == f"only {mount}"].reset_index(drop=True)
    together = parts[parts["changed"] == ALL].reset_index(drop=True)
    columns: dict[str, pd.Series] = {"vehicle": alone["vehicle"]}
    for label, table, source in (
        (f"only {mount} [dB]", alone, CHANGE),
        (f"{ALL} [dB]", together, CHANGE),
        ("sigma today [dB]", alone, "sigma today [dB]"),
        (f"sigma, only {mount} [dB]", alone, "sigma then [dB]"),
        ("peak today [dB(A)]", alone, "peak today [dB(A)]"),
        (f"peak, only {mount} [dB(A)]", alone, "peak then [dB(A)]"),
    ):
        columns[label] = table[source]
        columns[half_width_label(label)] = _half_widths(table, source)
    return pd.DataFrame({**columns, "loudest peak [Hz]": alone["loudest peak [Hz]"]})


def _half_widths(table: pd.DataFrame, label: str) -> pd.Series:
    name, _, unit = label.rpartition(" [")
    return (table[f"{name}, to [{unit}"] - table[f"{name}, from [{unit}"]) / 2.0


def source_table(sure: SupplierCertainty) -> pd.DataFrame:
    """One row per source of error behind the intervals: its size and where that comes from."""
    return pd.DataFrame(
        [
            {"source": one.name, "size, 1 σ": one.size, "from": one.origin}
            for one in sure.uncertain.data.sources
        ]
    )


def quality_table(directions: Sequence[Direction]) -> pd.DataFrame:
    """One row per direction: how well today's stiffness is known."""
    rows = []
    for direction in directions:
        found = direction.characterised
        quality = found.quality if found else None
        rows.append(
            {
                "direction": direction.name,
                "identified": {True: "yes", False: "no"}[quality.identified] if quality else "–",
                "stiffness ± 95 % [%]": PERCENT_3 * direction.half_width_95,
                "R² of the force [1]": _number(quality.r2_force if quality else None),
                "R² of Re K [1]": _number(quality.r2_real if quality else None),
                "R² of Im K [1]": _number(quality.r2_imag if quality else None),
                "requirement": direction.need.value,
            }
        )
    return pd.DataFrame(rows)


def data_sheet(
    study: SupplierStudy, mount: str | None, names: ShownNames, today: date
) -> pd.DataFrame:
    """Everything else that belongs on a data sheet: item and value."""
    shown = [one for one in study.platform.mounts if mount in (None, one.name)]
    items = {}
    for one in shown:
        identity = next((p.identity for p in study.parts if p.mount.name == one.name), None)
        known = (
            (
                ("part number", identity.part_number),
                ("supplier", identity.supplier),
                ("serial", identity.serial),
                ("variant", identity.variant),
                ("campaign", identity.campaign),
            )
            if identity
            else ()
        )
        pieces = [piece for piece in one.pieces if piece]
        words = [one.description, *(["pieces " + ", ".join(pieces)] if pieces else [])]
        words += [f"{key} {value}" for key, value in known if value]
        items[f"mount {one.name}"] = "; ".join(words)
        for piece, place in zip(one.pieces, one.positions, strict=True):
            where = f"position of {one.name} {piece}".strip()
            items[f"{where}, x, y, z [mm]"] = ", ".join(f"{MM * value:.1f}" for value in place)
    low, high = study.band
    items["frequency band"] = f"{low:g} to {high:g} Hz, {study.index.n_lines} lines"
    for case, weight in study.load_cases:
        torque = case.engine_torque
        reached = (
            "" if torque is None else f", wheel torque up to {case.wheel_torque.max():.0f} N m"
        )
        items[f"load case {case.name}"] = (
            f"{case.title}; gear {case.gear}, engine torque limit {case.torque_limit:g} N m"
            f"{reached}, engine order {case.order:g}, weight {weight:.3g}"
        )
    items[f"vehicles, {len(study.vehicles)}"] = ", ".join(map(names, study.vehicles))
    items["design"] = f"{study.pick.value.replace('-', ' ')} of the front"
    items["meaning of a factor"] = f"{factor_name(study.index)}, motion {motion_name(study.index)}"
    items["tolerance"] = "three standard deviations of a normal distribution, cut there"
    items["free range"] = f"mean level within {NOTICEABLE} dB of the wanted design, one at a time"
    items["static force"] = "on the body side, under engine torque alone, in the axes below"
    items["axes"] = "x rearward, y to the right, z upward"
    items["stiffness"] = "magnitude of the complex dynamic stiffness, force per displacement"
    items["amplitudes"] = "peak, not rms, at the virtual point inside the mount"
    items["levels"] = "A-weighted, re 20 µPa, at the driver's ear, mean of the lines in dB(A)"
    items |= _revision(study, today)
    return pd.DataFrame({"item": list(items), "value": list(items.values())})


def _revision(study: SupplierStudy, today: date) -> dict[str, str]:
    entry = study.run.entry
    environment = entry.record["environment"]
    git = environment.get("git") or {}
    revision = git.get("revision") or "unknown"
    digest = hash_files([entry.folder / "run.json"], relative_to=entry.folder)["run.json"]
    return {
        "run": f"{entry.name}, seed {study.run.seed}",
        "record of the run, SHA-256": digest[:SHORT_HASH],
        "deboom": f"{environment['packages'].get('deboom', 'unknown')}, revision "
        f"{revision[:SHORT_HASH]}{', changed' if git.get('dirty') else ''}",
        "date of this page": today.isoformat(),
    }


def _stiffness(study: SupplierStudy, direction: Direction) -> float:
    """Mean magnitude over the lines of the first load case [N/mm]."""
    case, _ = study.load_cases[0]
    of_axes = mean_operating_stiffness(direction.mount, case, study.band)
    return float(of_axes[AXES.index(direction.axis)]) * N_PER_MM


def _number(value: float | None) -> float:
    return NAN if value is None else value


TERMS = (
    "booming noise",
    "SPL",
    "dynamic stiffness",
    "loss factor",
    "preload",
    "stiffness factor",
    "tolerance",
    "σ",
    "no requirement",
    "not identified",
    "no noticeable difference",
    "sensitivity index",
)
CURVE_SCALED = "the whole curve over static force is to be scaled alike, with the stops re-tuned"
PART_SCALED = (
    "the rubber itself is to be scaled, its force at every deflection. The numbers are those at "
    "today's static deflection; under load the part rides elsewhere, as the curves show"
)
OPERATION = (
    "Dots are the states in the load cases and scatter because amplitude and frequency differ"
)
AS_ON_A_MACHINE = (
    "; the curves are read at one frequency and amplitude (in the table below), as on a test "
    "machine, where measurements back them"
)
NO_UNCERTAINTY = (
    "Today's stiffnesses come from operating spectra without a characterisation of the mounts: "
    "their intervals rest on usual tolerances of a measuring chain, which nobody has stated."
)
REQUIREMENT = (
    "direction",
    "requirement",
    "today [N/mm]",
    "± 90 % [%]",
    "wanted [N/mm]",
    "at least [N/mm]",
    "at most [N/mm]",
    "free from [N/mm]",
    "free to [N/mm]",
)
LOSS_FACTORS = (
    "direction",
    "loss factor today [1]",
    "loss factor ± 90 % [1]",
    "loss factor wanted [1]",
)
WORTH = (
    "direction",
    "tolerance today ± [%]",
    "share of sigma [%]",
    "share of sigma ± 90 % [%]",
    "sigma saved per % tighter [0.001 dB]",
    "sigma saved ± 90 % [0.001 dB]",
    "largest share [%]",
    "in",
)
EDGE = 0.02
"""Of the range of the search that counts as its edge [1]."""
_WHOLE = {name: 0 for name in REQUIREMENT if name.endswith("[N/mm]")}


def supplier_page(
    content: SupplierContent, pictures: Mapping[str, bytes], provenance: Mapping[str, object]
) -> Page:
    """Compose the page from its tables and pictures."""
    study, tables = content.study, content.tables
    what = "the mounts" if content.mount is None else f"mount {content.mount}"
    low, high = study.band
    unknown = () if study.parts else (NO_UNCERTAINTY,)
    return Page(
        title=f"What {what} should be",
        question=(
            f"Which dynamic stiffness of {what} keeps {_count(content.vehicles)} quiet "
            f"between {low:g} and {high:g} Hz, how exactly must it be made, and what does it bring?"
        ),
        headlines=_headlines(content),
        terms=tuple(content.motion.terms.get(term, term) for term in TERMS),
        warnings=(*unknown, *content.motion.warnings),
        sections=(
            _wanted(content, pictures),
            specification_section(content.sheet, content.tables),
            _parts_4(content, pictures),
            _importance(content, pictures),
            _tolerances(content, pictures),
            _certainty(content),
            Section(
                "Data sheet",
                "Units are SI with mm for lengths and N/mm for stiffness; every table of this page "
                "and the points of the curves are in the workbook beside it.",
                tables=(Table(tables["data sheet"], "What the numbers stand for."),),
            ),
        ),
        provenance=provenance,
    )


def _headlines(content: SupplierContent) -> tuple[Headline, ...]:
    effects, requirement = content.effects, content.tables["requirements"]
    asked = requirement[requirement["requirement"] == Need.wanted.value]
    if content.mount is None:
        first = Headline(
            f"{len(asked)} of {len(requirement)}", "directions have a stiffness that must be met"
        )
        name = min(content.mounts, key=lambda mount: float(effects.change[mount].mean()))
    else:
        name = content.mount
        away = (asked["wanted / today [1]"] - 1.0).abs()
        if asked.empty:
            first = Headline("none", f"direction of {name} must change")
        else:
            row = asked.iloc[int(np.argmax(away))]
            first = Headline(
                f"{row['today [N/mm]']:.0f} → {row['wanted [N/mm]']:.0f} N/mm",
                f"{row['direction']}, the largest change",
            )
    sure = effects.certainty
    worth = content.tables["tolerances"]
    top = worth.iloc[int(np.argmax(worth["share of sigma [%]"]))]
    return (
        first,
        Headline(_with_half_width(sure.mean_change(name)), f"mean level, only {name} changes"),
        Headline(_with_half_width(sure.mean_change(ALL)), "mean level, all parts as wanted"),
        Headline(
            f"{top['share of sigma [%]']:.0f} ± {top['share of sigma ± 90 % [%]']:.0f} %",
            f"of the scatter comes from {top['direction']}",
        ),
    )


def _wanted(content: SupplierContent, pictures: Mapping[str, bytes]) -> Section:
    study, table = content.study, content.tables["requirements"]
    case, _ = study.load_cases[0]
    part = factor_name(study.index) == Factor.part.value
    scaled = PART_SCALED if part else CURVE_SCALED
    given_up = ""
    if study.unidentified:
        values, scale = content.effects.values, study.per_vehicle / len(study.vehicles)
        lost = (values.mean_sum[-2] - values.mean_sum[-1]) * scale
        half = float(content.effects.certainty.mean_difference(ALL, PICKED).half_width)
        own = [one.name for one in content.directions if one.need is Need.unknown]
        given_up = (
            f"\n\nNot identified: {', '.join(own) or 'directions of other mounts'}. No number is "
            "asked for there. The search had moved such directions as well; leaving all of them as "
            f"they are changes the mean level by {signed(float(lost), 2)} ± {half:.2f} dB."
        )
    return Section(
        "What is wanted",
        "A stiffness is the mean magnitude of the dynamic stiffness over the lines of the run "
        f"“{case.title}”; {scaled}. At least and at "
        "most: the tolerance band. Free: the range in which the mean level of all vehicles stays "
        f"within {NOTICEABLE} dB, all other directions kept. A dash: nothing is asked."
        f"{_at_bounds(content)}{given_up}",
        figures=tuple(
            _picture(
                pictures,
                f"stiffness {mount}",
                f"{mount}: dynamic stiffness over preload. {OPERATION}"
                f"{AS_ON_A_MACHINE if any(c.has_curve for c in content.curves) else ''}.",
            )
            for mount in content.mounts
            if f"stiffness {mount}" in pictures
        ),
        tables=(
            Table(table[list(REQUIREMENT)], "Today's and the wanted stiffness.", _WHOLE),
            Table(
                table[list(LOSS_FACTORS)],
                "Loss factors, mean over the same lines; what is asked for is the wanted one.",
            ),
            Table(
                content.tables["conditions"],
                "Preloads in the load cases, and the test condition of each curve.",
                {"least preload": 0, "greatest preload": 0},
            ),
        ),
    )


def _at_bounds(content: SupplierContent) -> str:
    """Name the wanted directions at the edge of what was searched."""
    study = content.study
    named = [
        f"{one.name} ({study.wanted[one.column]:.2f} of today's)"
        for one in content.directions
        if one.need is Need.wanted
        and min(
            study.wanted[one.column] - study.space.lower[one.column],
            study.space.upper[one.column] - study.wanted[one.column],
        )
        <= EDGE * (study.space.upper[one.column] - study.space.lower[one.column])
    ]
    if not named:
        return ""
    return (
        f"\n\nAt the edge of what was searched: {', '.join(named)}. Going further may bring more; "
        "tell us what can be made."
    )


def _parts_4(content: SupplierContent, pictures: Mapping[str, bytes]) -> Section:
    alone = "parts change one at a time" if content.mount is None else "only this part changes"
    drawn = [
        _picture(
            pictures,
            "parts",
            "Change against today's mounts without scatter, mean over the lines. Whiskers: half "
            "width of the 90 % interval by all errors of measurement.",
        )
    ]
    if "levels" in pictures:
        case, _ = content.study.load_cases[0]
        drawn.append(
            _picture(
                pictures,
                "levels",
                f"Sound pressure level at the driver's ear today (baseline) and with only "
                f"{content.mount} as wanted (optimised); {case.title}.",
            )
        )
    if content.mount is None:
        summary = content.tables["part alone, summary"]
        by_scatter = [n for n in map(str, summary) if n == "changed" or "sigma" in n]
        tables = (
            Table(
                summary.drop(columns=by_scatter[1:]),
                "Mean over the vehicles, and the vehicles with most and least effect.",
            ),
            Table(summary[by_scatter], "Scatter σ of all vehicles together."),
        )
    else:
        table = one_part_table(content.tables["part alone"], content.mount)
        by_peak = ["vehicle", *(name for name in map(str, table) if "peak" in name)]
        tables = (
            Table(
                table.drop(columns=by_peak[1:]),
                "Change of the mean level per vehicle, and the scatter σ of that level.",
            ),
            Table(table[by_peak], "Level of the loudest booming peak."),
        )
    return Section(
        f"What happens if {alone}",
        "One mount is as wanted in all its directions, the others are as they are today; diamonds "
        "show what all mounts bring together. The effects of parts do not simply add: forces "
        "through different mounts may cancel each other at the ear.",
        figures=tuple(drawn),
        tables=tables,
    )


def _importance(content: SupplierContent, pictures: Mapping[str, bytes]) -> Section:
    found, space = content.effects.importance, content.study.space
    low, high = space.lower.min(), space.upper.max()
    leading = []
    for place, vehicle in enumerate(content.vehicles):
        top = int(np.argmax(found.total[:, place]))
        if top in [direction.column for direction in content.directions]:
            leading.append(
                f"{found.factors[top]} in {vehicle} ({found.total[top, place]:.2f} ± "
                f"{found.total_interval[top, place]:.2f}, leading in "
                f"{100.0 * content.effects.certainty.leads[place]:.0f} % of what is drawn again)"
            )
    sentence = f" The leading direction: {', '.join(leading)}." if leading else ""
    return Section(
        "Which directions matter in which vehicle",
        f"All factors of all mounts vary at the same time, evenly between {low:g} and {high:g}; "
        "shown is the share of each direction in the variance of the mean level, with its 95 % "
        f"interval from {found.n_resamples} resamples of {found.n_base} points.{sentence}",
        figures=(
            _picture(
                pictures,
                "importance",
                "Total Sobol index per vehicle: filled what the direction does alone, hatched what "
                "it does together with others.",
            ),
        ),
    )


def _tolerances(content: SupplierContent, pictures: Mapping[str, bytes]) -> Section:
    shares = content.effects.shares
    rest = max(math.ceil(100.0 * float(shares.rest.max())), 1)
    return Section(
        "Where the scatter comes from, and what a tighter tolerance is worth",
        "Parts that are all within their tolerance make vehicles of one type differ by σ. The "
        "share of a direction in it says where a tighter tolerance pays; the other column says how "
        "much σ falls for each percentage point, such as ±14 % instead of ±15 %, mean over the "
        f"vehicles, of {DRAWS} draws around the wanted design. At most {rest} % of σ² in a "
        "vehicle belong to no single direction.",
        figures=(
            _picture(
                pictures,
                "tolerances",
                "Share of each direction in the scatter, and σ saved by one percentage point.",
            ),
        ),
        tables=(
            Table(
                content.tables["tolerances"][list(WORTH)],
                "Shares are of σ²; the largest one and its vehicle beside the mean.",
                {
                    "tolerance today ± [%]": 0,
                    "sigma saved per % tighter [0.001 dB]": 1,
                    "sigma saved ± 90 % [0.001 dB]": 1,
                },
            ),
        ),
    )


def _certainty(content: SupplierContent) -> Section:
    study = content.study
    text = (
        "The error budget of the characterisation covers sensors, shaker, force cells and noise; "
        "its 95 % half width is that of the stiffness itself. Above 15 % a direction counts as not "
        "identified and no number is asked for. R² says how well the response surface repeats what "
        "was measured; it is no accuracy."
    )
    again = (
        "Numbers with ± 90 %, or from … to, have an interval: all measurements are drawn again "
        f"{MEASURED_AGAIN} times with the errors below, the same for all designs and vehicles, and "
        "computed anew; in 90 % of such cases the truth lies inside. The relative half width of "
        "today's stiffness belongs to every stiffness of its row. The model of the motion has "
        "errors of its own, which are not in them."
    )
    texts = (text if study.parts else NO_UNCERTAINTY, again, content.motion.text)
    return Section(
        "How sure we are",
        "\n\n".join(filter(None, texts)),
        tables=(
            Table(content.tables["quality"], "Today's stiffness, direction by direction."),
            Table(content.tables["errors"], "Errors of measurement behind the intervals."),
        ),
    )


def _with_half_width(change: Interval) -> str:
    return f"{signed(float(change.value), 1)} ± {float(change.half_width):.1f} dB"


def _picture(pictures: Mapping[str, bytes], stem: str, caption: str) -> Picture:
    return Picture(pictures[stem], alt=caption, caption=caption)


def _count(vehicles: tuple[str, ...]) -> str:
    return vehicles[0] if len(vehicles) == 1 else f"{len(vehicles)} vehicles"


STEM = "supplier_report"
NOTHING = SpecificationFiles()


def supplier_report(
    folder: Path,
    *,
    mount: str | None,
    anonymous: bool,
    out: Path | None,
    studies: Path | None,
    pick: Pick = Pick.best_mean,
    pieces: SpecificationFiles = NOTHING,
) -> tuple[Path, Path]:
    """Write the page and the workbook for a mount supplier.

    Parameters
    ----------
    folder : Path
        Finished run of a front study.
    mount : str or None
        The part of this supplier; None: all mounts.
    anonymous : bool
        Call vehicles by letters, and refuse a report in which a name or path is left.
    out : Path or None
        Folder that gets both files, made when missing; None: ``supplier`` in the run's folder.
    studies : Path or None
        Folder with the studies; None: `studies` here, else deboom's own.
    pick : Pick
        Design of the front that is wanted.
    pieces : SpecificationFiles
        Of the specification sheet, beside the run.

    Returns
    -------
    page, workbook : Path
        Written; older ones of the same name are replaced.

    Raises
    ------
    InputError
        A run that is no front study, misses a file or holds an edited one; an unknown mount; a
        piece of the sheet that belongs to something else; a leak; a folder that cannot be written.
        Nothing is written then.
    """
    study = supplier_study(folder, studies, pick)
    study.of(mount)
    names = shown_names(study, anonymous=anonymous)
    content = supplier_content(study, mount, names, specification_sources(study, pieces))
    # pictures cannot be searched: whatever they show stands in a table as well
    tables = {f"table of {name}": table.to_csv() for name, table in content.tables.items()}
    refuse_leaks(names.secrets, tables)
    html, workbook = supplier_documents(content, pieces)
    stem = "_".join(
        [
            STEM,
            *([re.sub(r"[^\w-]+", "-", mount)] if mount else []),
            *(["anonymous"] if anonymous else []),
        ]
    )
    texts = {"page": page_text(html), "workbook": workbook_text(workbook), "file names": stem}
    refuse_leaks(names.secrets, texts)
    place = study.run.entry.folder / "supplier" if out is None else out
    try:
        place.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"{place} cannot be made a folder ({error.strerror or error}): choose another --out"
        ) from None
    page_path, workbook_path = place / f"{stem}.html", place / f"{stem}.xlsx"
    replace_bytes(page_path, html.encode("utf-8"))
    replace_bytes(workbook_path, workbook)
    return page_path, workbook_path


def supplier_documents(content: SupplierContent, pieces: SpecificationFiles) -> tuple[str, bytes]:
    """Return the page as HTML and the workbook as xlsx."""
    page = supplier_page(content, supplier_figures(content), _provenance(content, pieces))
    what = f"mount {content.mount}" if content.mount else "the mounts"
    sheets = {name: table for name, table in content.tables.items() if len(table)}
    return render_page(page), workbook_bytes(sheets, f"What {what} should be")


def supplier_content(
    study: SupplierStudy, mount: str | None, names: ShownNames, sources: SpecificationSources
) -> SupplierContent:
    """Compute everything that page and workbook show.

    Parameters
    ----------
    study : SupplierStudy
        What is asked for.
    mount : str or None
        The part that it is about; None: all.
    names : ShownNames
        Of the vehicles.
    sources : SpecificationSources
        Of the sheet.
    """
    directions, effects = study.of(mount), SupplierEffects(study)
    curves = stiffness_curves(study, directions)
    parts = part_table(effects, names)
    shown = [f"only {one.name}" for one in study.platform.mounts if mount in (None, one.name)]
    parts = parts[parts["changed"].isin([*shown, ALL])]
    sheet = specification_sheet(study, sources, directions, curves, effects.certainty, names)
    tables: dict[str, pd.DataFrame] = {
        **specification_tables(sheet),
        "requirements": requirement_table(study, directions, curves, effects.certainty),
        "conditions": condition_table(curves),
        "curves": curve_table(study, curves),
        "part alone": parts,
        "part alone, summary": part_summary(effects, parts),
        "importance": importance_table(effects, directions, names),
        "tolerances": tolerance_table(effects, directions, names),
        "quality": quality_table(directions),
        "errors": source_table(effects.certainty),
        "data sheet": data_sheet(study, mount, names, datetime.now(UTC).date()),
    }
    designs = np.stack([study.space.nominal, study.wanted])
    checked = motion_report(study.index, designs)
    return SupplierContent(effects, mount, directions, curves, names, tables, checked, sheet)


def _provenance(content: SupplierContent, pieces: SpecificationFiles) -> dict[str, object]:
    """Return the footer; an anonymous one has no command and no file names."""
    entry, study = content.study.run.entry, content.study
    facts: dict[str, object] = {
        "run": entry.name,
        "draws": content.study.check.sample.n_samples,
        "seed": study.run.seed,
    }
    if content.names.anonymous:
        return facts
    mount = f" --mount {content.mount}" if content.mount else ""
    design = "" if study.pick is Pick.best_mean else f" --design {study.pick.value}"
    given = "".join(
        f" --{field.name} {path.as_posix()}"
        for field in fields(pieces)
        if (path := getattr(pieces, field.name)) is not None
    )
    record = hash_files([entry.folder / "run.json"], relative_to=entry.folder)
    return {
        "command": f"deboom report {entry.folder.as_posix()} --supplier{mount}{design}{given}",
        **facts,
        "study": entry.study,
        "inputs": {**record, **entry.record["inputs_sha256"]},
    }
