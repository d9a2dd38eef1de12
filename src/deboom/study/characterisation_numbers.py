"""Numbers of every characterised direction of every bench, as one table."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from scipy.spatial import cKDTree

from deboom.errors import InputError
from deboom.mounts.agreement import agreement
from deboom.mounts.cubic_fit import PieceOptions
from deboom.mounts.error_budget import IDENTIFIED, DirectionBudget
from deboom.mounts.operating_map import OperatingMap
from deboom.mounts.response_surface import DynamicStiffnessSurface
from deboom.study.characterisation import CharacterisedBench
from deboom.study.characterisation_truth import SetTruth

PARTS = ("real", "imag")


def direction_numbers(benches: Sequence[CharacterisedBench]) -> pd.DataFrame:
    """One row per bench and direction; plain ratios, nan where something is not known.

    Columns ``r2_<part>`` and ``r2_force_<part>`` compare the surface with its own lines, with the
    prefix ``check_`` a surface fitted without the check runs with those. ``error`` and its kin are
    rms relative errors of the magnitude against the truth, ``error_imag`` the median one of Im K.
    """
    rows = [_row(bench, name) for bench in benches for name in bench.surfaces]
    if not rows:
        raise InputError("no direction of any mount could be characterised: nothing to report")
    return pd.DataFrame(rows)


def all_gears_numbers(benches: Sequence[CharacterisedBench]) -> pd.DataFrame:
    """One row per bench and direction, for surfaces over all gears, pieces by cross-validation.

    Columns as in `direction_numbers`, and ``pieces`` of the real part.
    """
    rows: list[dict[str, object]] = []
    for bench in benches:
        for name in bench.surfaces:
            measured = bench.all_gears_maps[name]
            usable = measured.select(~measured.near_floor)
            surface = bench.fitted_to(usable, PieceOptions(pieces="cv"))
            row: dict[str, object] = {"bench": bench.title, "direction": name}
            row["pieces"] = surface.real.n_pieces
            row |= _r2(bench, surface, usable)
            row |= _errors(bench, surface, usable)
            rows.append(row)
    return pd.DataFrame(rows)


def _row(bench: CharacterisedBench, name: str) -> dict[str, object]:
    one = bench.result.directions[name]
    surface, measured = bench.surfaces[name], one.measured
    usable = measured.select(~measured.near_floor)
    row: dict[str, object] = {
        "bench": bench.title,
        "direction": name,
        **_r2(bench, surface, usable),
    }
    row |= _budget(bench, name)
    if bench.truth is not None:
        row |= _errors(bench, surface, usable)
        stated = bench.stated_maps[name]
        row["error_stated"] = _errors(
            bench, bench.fitted_to(stated), stated.select(~stated.near_floor)
        )["error"]
    check = bench.in_check_runs(usable)
    if check.any() and not check.all():
        without = bench.fitted_to(usable.select(~check))
        held_out = usable.select(check)
        inside = without.inside(
            held_out.preload(bench.result.options.preload), held_out.amplitude, held_out.frequency
        )
        row["check_inside"] = float(inside.mean())
        held_out = held_out.select(inside)
        row |= {f"check_{key}": value for key, value in _r2(bench, without, held_out).items()}
        if bench.truth is not None:
            row["check_error"] = _errors(bench, without, held_out)["error"]
    return row


def _r2(
    bench: CharacterisedBench, surface: DynamicStiffnessSurface, lines: OperatingMap
) -> dict[str, float]:
    if len(lines) < 2:
        return {}
    found = agreement(lines.samples(bench.result.options.preload), bench.modelled(surface, lines))
    return {
        "r2_real": found.r2_real,
        "r2_imag": found.r2_imag,
        "r2_force_real": found.r2_force_real,
        "r2_force_imag": found.r2_force_imag,
    }


def _errors(
    bench: CharacterisedBench, surface: DynamicStiffnessSurface, lines: OperatingMap
) -> dict[str, float]:
    if bench.truth is None or not len(lines):
        return {"error": np.nan, "error_imag": np.nan}
    truth, modelled = bench.truth.at(lines), bench.modelled(surface, lines)
    relative = np.abs(modelled) / np.abs(truth) - 1
    return {
        "error": float(np.sqrt(np.mean(relative**2))),
        "error_imag": float(np.median(np.abs(modelled.imag / truth.imag - 1))),
    }


def _budget(bench: CharacterisedBench, name: str) -> dict[str, object]:
    one = bench.result.directions[name]
    budget = one.budget
    if budget is None:
        return {}
    row: dict[str, object] = {
        "half_width": budget.half_width_95,
        "half_width_imag": budget.imag_half_width_95,
        "half_width_stated": budget.stated_half_width,
        "misfit": budget.misfit,
        "repeatability": budget.repeatability,
        **{source.value: width for source, width in budget.sources.items()},
    }
    if bench.truth is not None:
        row["coverage"] = _coverage(bench, bench.truth, name, budget)
    return row


def _coverage(
    bench: CharacterisedBench, truth: SetTruth, name: str, budget: DirectionBudget
) -> float:
    r"""Share of the budget's lines whose true magnitude lies inside the stated band."""
    measured = bench.result.directions[name].measured
    usable = measured.select(~measured.near_floor)
    points = usable.samples(bench.result.options.preload).points
    scale = np.ptp(points, axis=0)
    rows = cKDTree(points / scale).query(budget.points / scale)[1]
    modelled = np.abs(bench.modelled(bench.surfaces[name], usable))
    relative = (np.abs(truth.at(usable)) / modelled - 1)[rows]
    return float(np.mean((budget.lower <= relative) & (relative <= budget.upper)))


def over_benches(numbers: pd.DataFrame, column: str, quantile: float = 0.5) -> pd.Series[float]:
    """Quantile over the benches of one column in percent, by direction; nan where not known."""
    names = numbers["direction"].drop_duplicates().tolist()
    if column not in numbers:
        return pd.Series(np.nan, index=names)
    values = numbers.groupby("direction", sort=False)[column].quantile(quantile)
    return 100.0 * values.reindex(names)


def identified(numbers: pd.DataFrame) -> pd.Series[bool]:
    """Whether the median half width over the benches is narrow enough, by direction."""
    return over_benches(numbers, "half_width") <= 100.0 * IDENTIFIED
