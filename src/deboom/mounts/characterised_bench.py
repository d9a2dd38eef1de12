"""Mounts characterised on one bench or several, beside the truth where it is known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy.spatial import cKDTree

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement.campaign import OperatingRun
from deboom.measurement.force_transfer import ForceTransferMatrix, force_transfer_matrix
from deboom.measurement.quality import quality_in_operation, quality_table
from deboom.mounts.characterise import Characterisation
from deboom.mounts.error_budget import DirectionBudget
from deboom.mounts.measuring_chain import ErrorSource, MountPoint
from deboom.mounts.operating_map import OperatingMap
from deboom.mounts.response_surface import (
    DynamicStiffnessSurface,
    StiffnessModel,
    agreement,
    compare_models,
    standard_models,
)

CHECK_CASES = ((5, 120.0), (5, 220.0), (6, 120.0), (6, 160.0), (6, 220.0), (7, 220.0))
"""Gear and torque limit [N m] of the full-load runs that surfaces are judged with: thesis, 3.5."""


@dataclass(frozen=True, eq=False)
class SetTruth:
    """True stiffness of all mounts of one set, run by run.

    - `path`: where it was read.
    - `runs`, `channels`: names along the first and the last axis.
    - `frequency` (n_frequency,): [Hz].
    - `stiffness` (n_run, n_frequency, n_channel): complex dynamic stiffness [N/m].
    """

    path: Path
    runs: tuple[str, ...]
    channels: tuple[str, ...]
    frequency: RealArray
    stiffness: ComplexArray

    def at(self, measured: OperatingMap) -> ComplexArray:
        """Return the true stiffness at every line of a map, shape (n,) [N/m].

        - raises InputError: a line, run or channel that the truth does not know.
        """
        labels, inverse = np.unique(measured.run, return_inverse=True)
        places = []
        for label in labels:
            run, _, piece = str(label).partition(" ")
            channel = " ".join(filter(None, (measured.mount, piece, measured.axis)))
            if run not in self.runs or channel not in self.channels:
                raise InputError(f"{self.path}: no truth of channel {channel} in run {run}")
            places.append((self.runs.index(run), self.channels.index(channel)))
        rows = np.searchsorted(self.frequency, measured.frequency - 1e-6)
        nearest = self.frequency[np.minimum(rows, self.frequency.size - 1)]
        if not np.allclose(nearest, measured.frequency, rtol=0, atol=1e-6):
            raise InputError(f"{self.path}: its frequency lines are not those of the campaign")
        run_place, channel_place = np.array(places)[inverse].T
        return np.asarray(self.stiffness[run_place, rows, channel_place])


@dataclass(frozen=True, eq=False)
class CharacterisedBench:
    """One bench whose mounts were characterised.

    - `title`: such as ``bench 1``.
    - `result`: of one mount set.
    - `truth`: none where nobody knows it.
    - `seconds`: that the characterisation took, with its error budget [s].
    """

    title: str
    result: Characterisation
    truth: SetTruth | None
    seconds: float

    @property
    def input_files(self) -> tuple[Path, ...]:
        """Every file that was read, the truth included."""
        truth = () if self.truth is None else (self.truth.path,)
        return (*self.result.campaign.input_files, *truth)

    @property
    def surfaces(self) -> dict[str, DynamicStiffnessSurface]:
        """Of every direction that has one."""
        surfaces = ((name, direction.surface) for name, direction in self.result.directions.items())
        return {name: surface for name, surface in surfaces if surface is not None}

    @cached_property
    def check_runs(self) -> tuple[OperatingRun, ...]:
        """Runs of `CHECK_CASES`; without one, all full-load runs, or all runs if there is none."""
        full_load = [run for run in self.result.runs if run.full_load]
        named = [run for run in full_load if (run.gear, run.torque_limit) in CHECK_CASES]
        return tuple(named or full_load or self.result.runs)

    def in_check_runs(self, measured: OperatingMap) -> npt.NDArray[np.bool_]:
        """Say which lines of a map belong to the check runs, shape (n,)."""
        names = {run.name for run in self.check_runs}
        return np.array([str(label).partition(" ")[0] in names for label in measured.run])

    def modelled(self, surface: DynamicStiffnessSurface, measured: OperatingMap) -> ComplexArray:
        """Stiffness of a surface at every line of a map, shape (n,) [N/m]."""
        points = measured.points(self.result.options.preload)
        return surface.predict(points, extrapolate=True)

    def fitted_to(self, measured: OperatingMap) -> DynamicStiffnessSurface:
        """Fit a surface to a map, by the same regressor as those of the bench."""
        options = self.result.options
        samples = measured.samples(options.preload)
        surface = DynamicStiffnessSurface(options.regressor, preload_unit=options.preload.unit)
        return surface.fit(samples.points, samples.stiffness, groups=samples.run)


def shown_run(bench: CharacterisedBench) -> OperatingRun:
    """Return the run that motions are shown of: of the check runs the one of most torque."""
    return max(bench.check_runs, key=lambda run: (run.torque_limit, -run.gear))


def quality_of_motion(bench: CharacterisedBench) -> pd.DataFrame:
    """Judge the virtual points of each rigid body in the run shown, in the order of repair.

    Columns as of `deboom.measurement.quality.quality_table`; ``worst`` names a channel,
    sensor or motion, and leave-one-out the culprit with its likely fault.
    """
    run = shown_run(bench)
    tolerances = bench.result.campaign.tolerances
    rows: list[dict[str, object]] = []
    for chain in bench.result.chains:
        point = chain.alignment.body.virtual_point
        if point is not None:
            checks = quality_in_operation(point, run.acceleration, tolerances=tolerances)
            rows += quality_table(checks)
    return pd.DataFrame(rows, columns=["check", "number [1]", "limit", "verdict", "worst"])


def usable_maps(bench: CharacterisedBench) -> dict[str, OperatingMap]:
    """Return the maps of all directions that were ever loaded, without lines near the floor."""
    maps = {name: entry.measured for name, entry in bench.result.directions.items()}
    usable = {name: entry.select(~entry.near_floor) for name, entry in maps.items()}
    return {name: entry for name, entry in usable.items() if len(entry)}


def direction_numbers(bench: CharacterisedBench) -> pd.DataFrame:
    """One row per direction; plain ratios, nan where something is not known.

    Columns ``r2_<part>`` and ``r2_force_<part>`` compare the surface with its own lines, with the
    prefix ``check_`` a surface fitted without the check runs with those. ``error`` and its kin are
    rms relative errors of the magnitude against the truth, ``error_imag`` the median one of Im K.
    InputError: no direction has a surface.
    """
    rows = [_row(bench, name) for name in bench.surfaces]
    if not rows:
        raise InputError("no direction of any mount could be characterised: nothing to report")
    return pd.DataFrame(rows)


def model_table(
    bench: CharacterisedBench, models: Mapping[str, StiffnessModel] | None = None
) -> pd.DataFrame:
    """Compare models of the stiffness, fitted without the check runs, on those of one bench.

    - `models`, optional: models by name; default are those of `standard_models`.
    - returns one row per direction and model, see `compare_models`.
    - raises InputError: no direction has lines in check runs and in others.
    """
    preload = bench.result.options.preload
    parts = []
    for name in bench.surfaces:
        measured = bench.result.directions[name].measured
        usable = measured.select(~measured.near_floor)
        check = bench.in_check_runs(usable)
        if check.all() or not check.any():
            continue
        held_out = usable.select(check)
        truth = None if bench.truth is None else bench.truth.at(held_out)
        chosen = standard_models() if models is None else models
        training, lines = usable.select(~check).samples(preload), held_out.samples(preload)
        try:
            table = compare_models(chosen, training, lines, truth)
        except InputError:  # its check runs lie where the others did not go
            continue
        table.insert(0, "direction", name)
        parts.append(table)
    if not parts:
        raise InputError("models are compared on check runs: measure runs beside them, too")
    return pd.concat(parts, ignore_index=True)


def _row(bench: CharacterisedBench, name: str) -> dict[str, object]:
    direction = bench.result.directions[name]
    surface, measured = bench.surfaces[name], direction.measured
    usable = measured.select(~measured.near_floor)
    row: dict[str, object] = {"direction": name, **_r2(bench, surface, usable)}
    row |= _budget(bench, name)
    if bench.truth is not None:
        row |= _errors(bench, surface, usable)
    check = bench.in_check_runs(usable)
    if check.any() and not check.all():
        without = bench.fitted_to(usable.select(~check))
        held_out = usable.select(check)
        inside = without.supported(held_out.points(bench.result.options.preload))
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
    return agreement(lines.samples(bench.result.options.preload), bench.modelled(surface, lines))


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
    direction = bench.result.directions[name]
    budget = direction.budget
    if budget is None:
        return {}
    row: dict[str, object] = {
        "identified": float(budget.identified),
        "half_width": budget.half_width_95,
        "half_width_imag": budget.imag_half_width_95,
        "misfit": budget.misfit,
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


def percent(numbers: pd.DataFrame, column: str) -> pd.Series[float]:
    """Return one column in percent, by direction; nan where not known."""
    by = numbers.set_index("direction")
    return 100.0 * by[column] if column in by else pd.Series(np.nan, index=by.index)


def identified(numbers: pd.DataFrame) -> pd.Series[bool]:
    """Whether the half width is narrow enough, and nothing contradicts it, by direction."""
    by = numbers.set_index("direction")
    return (by["identified"] if "identified" in by else pd.Series(0.0, index=by.index)) > 0.5


THESIS_R2 = {
    "EnM x": (99.978, 99.665, 99.975, 99.614),
    "EnM y": (60.865, 69.366, 87.228, 68.713),
    "EnM z": (99.249, 88.197, 99.518, 82.635),
    "GeM x": (99.654, 99.441, 99.794, 99.612),
    "GeM y": (92.474, 74.168, 92.146, 85.348),
    "GeM z": (99.441, 98.691, 99.612, 98.726),
    "TSM x": (99.976, 99.828, 99.975, 99.874),
    "TSM y": (99.912, 97.146, 99.949, 94.955),
    "TSM z": (99.969, 99.204, 99.976, 99.710),
}
"""Thesis, tables 6 to 8: R² of Re K, Im K, Re F, Im F [%]."""


def r2_table(numbers: pd.DataFrame) -> pd.DataFrame:
    """R² of the surfaces per direction and part, beside the thesis."""
    rows = []
    for place, (part, column) in enumerate((("real", "real"), ("imaginary", "imag"))):
        stiffness, force, check, check_force = (
            percent(numbers, f"{prefix}_{column}")
            for prefix in ("r2", "r2_force", "check_r2", "check_r2_force")
        )
        for name in stiffness.index:
            thesis = THESIS_R2.get(name, (np.nan,) * 4)
            rows.append(
                {
                    "direction": name,
                    "part": part,
                    "R² of stiffness [%]": stiffness[name],
                    "thesis, stiffness [%]": thesis[place],
                    "R² of force [%]": force[name],
                    "thesis, force [%]": thesis[2 + place],
                    "held-out R² of stiffness [%]": check[name],
                    "held-out R² of force [%]": check_force[name],
                }
            )
    order = {name: place for place, name in enumerate(numbers["direction"].drop_duplicates())}
    return pd.DataFrame(rows).sort_values(
        "direction", key=lambda names: names.map(order), kind="stable", ignore_index=True
    )


def truth_table(numbers: pd.DataFrame) -> pd.DataFrame:
    """Error of the surfaces against the bench's truth: rms of |K|, median of Im K."""
    columns = {
        "error of |K| [%]": percent(numbers, "error"),
        "error of Im K [%]": percent(numbers, "error_imag"),
        "held-out error of |K| [%]": percent(numbers, "check_error"),
    }
    return by_direction(columns)


def uncertainty_table(numbers: pd.DataFrame) -> pd.DataFrame:
    """List what the error budget makes of every direction."""
    columns = {
        "95 % half width of |K| [%]": percent(numbers, "half_width"),
        "95 % half width of Im K [%]": percent(numbers, "half_width_imag"),
        "misfit of the surface [%]": percent(numbers, "misfit"),
        "truth inside the band [%]": percent(numbers, "coverage"),
    }
    for source in ErrorSource:
        columns[f"{source.value} alone [%]"] = percent(numbers, source.value)
    table = by_direction(columns)
    is_identified = identified(numbers).to_numpy()
    table.insert(1, "identified", np.where(is_identified, "identified", "not identified"))
    return table


def by_direction(columns: dict[str, pd.Series[float]]) -> pd.DataFrame:
    """Columns without a single known value are left out."""
    table = pd.DataFrame(columns).rename_axis("direction").reset_index()
    return table.dropna(axis="columns", how="all")


def force_transfer_matrices(bench: CharacterisedBench) -> dict[str, ForceTransferMatrix]:
    """Return the 3×3 matrix of every mount (piece) that a shaker calibrated."""
    runs = bench.result.campaign.shaker_runs
    return {
        point.name: force_transfer_matrix(runs, point.cells, point.mount, point.piece)
        for point in _points(bench)
        if point.calibrated
    }


def force_transfer_table(matrices: Sequence[ForceTransferMatrix]) -> pd.DataFrame:
    """One row per mount: how constant its force transfer matrix is, and how well it inverts."""
    rows = [
        {
            "mount": " ".join(filter(None, (transfer.mount, transfer.piece))),
            "cells": len(transfer.cells),
            "loads": len(transfer.matrix),
            "repeats": min(transfer.repeats),
            "condition number [1]": transfer.condition_number,
            "residual [%]": 100 * transfer.residual,
            "largest change over frequency [%]": 100 * float(transfer.frequency_dependence.max()),
            "largest drift over repeats [%]": 100 * float(transfer.drift.max()),
        }
        for transfer in matrices
    ]
    columns = ["mount", "cells", "loads", "repeats", "condition number [1]", "residual [%]"]
    columns += ["largest change over frequency [%]", "largest drift over repeats [%]"]
    return pd.DataFrame(rows, columns=columns)


def _points(bench: CharacterisedBench) -> list[MountPoint]:
    return [point for chain in bench.result.chains for point in chain.alignment.body.points]
