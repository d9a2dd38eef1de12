"""Tables of the supplier's page and workbook."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import date

import numpy as np
import pandas as pd

from deboom.files.run_folder import hash_files
from deboom.mounts.mount import AXES
from deboom.mounts.operating_stiffness import mean_operating_stiffness
from deboom.study.motion_report import factor_name, motion_name
from deboom.study.robust_front import N_PER_MM, NOTICEABLE
from deboom.study.supplier_certainty import SupplierCertainty
from deboom.study.supplier_curves import MICRO, StiffnessCurve, preload_factor
from deboom.study.supplier_effects import ALL, CHANGE, SupplierEffects, half_width_label
from deboom.study.supplier_names import ShownNames
from deboom.study.supplier_study import Direction, Need, SupplierStudy

PERCENT = 100.0
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
                "± 90 % [%]": PERCENT * half if known else NAN,
                "wanted [N/mm]": wanted,
                "wanted / today [1]": factor,
                "tolerance ± [%]": PERCENT * tolerance,
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
        of_vehicle = PERCENT * shares.of_response[own].sum(axis=0)
        worst = int(np.argmax(of_vehicle))
        rows.append(
            {
                "direction": direction.name,
                "tolerance today ± [%]": PERCENT * study.space.tolerance[direction.column],
                "share of sigma [%]": PERCENT * shares.of_sum[own].sum(),
                "share of sigma ± 90 % [%]": PERCENT * float(sure.share.half_width[row]),
                "sigma saved per % tighter [0.001 dB]": (
                    MILLI * effects.tolerance_gain[direction.column]
                ),
                "sigma saved ± 90 % [0.001 dB]": MILLI * float(sure.gain.half_width[row]) / PERCENT,
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
                "change of sigma [%]": PERCENT
                * (table["sigma then [dB]"].sum() / table["sigma today [dB]"].sum() - 1.0),
                "change of sigma ± 90 % [%]": PERCENT * float(ratio.half_width),
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
                "stiffness ± 95 % [%]": PERCENT * direction.half_width_95,
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
    items["meaning of a factor"] = (
        f"{factor_name(study.motion_index)}, motion {motion_name(study.motion_index)}"
    )
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
