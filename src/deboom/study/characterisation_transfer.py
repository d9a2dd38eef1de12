"""The force transfer matrices of a campaign, and what it costs at the ears to ignore moments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from deboom.files.platform import Platform
from deboom.measurement.campaign import AXES, OperatingRun
from deboom.measurement.channels import Spectrum
from deboom.measurement.force_transfer import (
    ForceTransferMatrix,
    force_transfer_matrix,
    operating_force,
)
from deboom.measurement.force_transfer_moments import moment_transfer_matrix, without_moments
from deboom.measurement.load_case import LoadCase
from deboom.mounts.instrumented_body import MountPoint
from deboom.report.figures import CurvePanel, curve_panels
from deboom.study.characterisation import CharacterisedBench
from deboom.study.surface_check import level_differences
from deboom.vehicles.fleet import Band

BAND: Band = (20.0, 60.0)


def force_transfer_matrices(bench: CharacterisedBench) -> dict[str, ForceTransferMatrix]:
    """Return the 3×3 matrix of every mount (piece) that a shaker calibrated."""
    runs = bench.result.campaign.shaker_runs
    return {
        point.name: force_transfer_matrix(runs, point.cells, point.mount, point.piece)
        for point in _points(bench)
        if point.calibrated
    }


def moment_transfer_matrices(bench: CharacterisedBench) -> dict[str, ForceTransferMatrix]:
    """Return the 6×6 matrix of every mount (piece) with pushes beside its virtual point."""
    campaign = bench.result.campaign
    pushed = {(run.mount, run.piece) for run in campaign.pushes}
    return {
        point.name: moment_transfer_matrix(campaign, point.mount, point.piece)
        for point in _points(bench)
        if (point.mount, point.piece) in pushed
    }


def force_transfer_table(matrices: Sequence[ForceTransferMatrix]) -> pd.DataFrame:
    """One row per mount: how constant its force transfer matrix is, and how well it inverts."""
    rows = [
        {
            "mount": " ".join(filter(None, (one.mount, one.piece))),
            "cells": len(one.cells),
            "loads": len(one.matrix),
            "repeats": min(one.repeats),
            "condition number [1]": one.condition_number,
            "residual [%]": 100 * one.residual,
            "largest change over frequency [%]": 100 * float(one.frequency_dependence.max()),
            "largest drift over repeats [%]": 100 * float(one.drift.max()),
        }
        for one in matrices
    ]
    columns = ["mount", "cells", "loads", "repeats", "condition number [1]", "residual [%]"]
    columns += ["largest change over frequency [%]", "largest drift over repeats [%]"]
    return pd.DataFrame(rows, columns=columns)


def force_transfer_figure(matrices: Mapping[str, ForceTransferMatrix]) -> bytes:
    """Draw every 3×3 matrix over frequency: along the shaker, and all that it shows across."""
    panels = [
        CurvePanel(
            f"{name}, {words}",
            one.frequency,
            {
                f"shaker along {axis}": np.linalg.norm(
                    one.response[:, kept[column], column], axis=1
                )
                for column, axis in enumerate(AXES)
            },
        )
        for kept, words in ((np.eye(3, dtype=bool), "along"), (~np.eye(3, dtype=bool), "across"))
        for name, one in matrices.items()
    ]
    return curve_panels(
        panels,
        x_label="frequency [Hz]",
        y_label="cells per shaker [N/N]",
        columns=len(matrices),
    )


def moment_cost_table(bench: CharacterisedBench, platform: Platform) -> pd.DataFrame:
    """Compare the sound at the ears with and without moments, check run by check run.

    Parameters
    ----------
    bench : CharacterisedBench
        Whose campaign has pushes beside the virtual points.
    platform : Platform
        Its vehicles listen.

    Returns
    -------
    DataFrame
        See `deboom.study.surface_check.level_differences`: forces out of the 6×6 matrices against
        those out of their 3×3 blocks.

    Raises
    ------
    InputError
        Vehicles without a noise transfer function for one of the forces.

    Notes
    -----
    Vehicles have noise transfer functions for forces alone. What is stated is what moments of the
    mounts change at the cells and so in the forces, not what the moments themselves radiate.
    """
    full = moment_transfer_matrices(bench)
    forces = {name: without_moments(one) for name, one in full.items()}
    tables = []
    for run in bench.check_runs:
        with_all, without = (_load_case(bench, run, known) for known in (full, forces))
        table = level_differences(platform.fleet, platform.mounts, with_all, without, BAND)
        table.insert(0, "load case", run.name)
        tables.append(table)
    return pd.concat(tables, ignore_index=True)


def _points(bench: CharacterisedBench) -> list[MountPoint]:
    return [point for chain in bench.result.chains for point in chain.alignment.body.points]


def _load_case(
    bench: CharacterisedBench, run: OperatingRun, transfers: Mapping[str, ForceTransferMatrix]
) -> LoadCase:
    """One run with its forces by these matrices; other mounts as they are characterised."""
    names: list[str] = []
    displacements, forces = [], []
    to_displacement = -1 / (2 * np.pi * run.frequency[:, np.newaxis]) ** 2
    for chain in bench.result.chains:
        body = chain.alignment.body
        motion = run.acceleration.select(body.channels).values @ chain.motion_matrix.T
        for place, point in enumerate(body.points):
            rows = [AXES.index(axis) for axis in point.axes]
            if point.name in transfers:
                force = operating_force(transfers[point.name], run.cell_force).values
            else:
                cells = run.cell_force.select(point.cell_channels).values
                force = cells @ point.force_matrix.T
            names += [f"{point.name} {axis}" for axis in point.axes]
            forces.append(force[:, rows])
            displacements.append(to_displacement * motion[:, [3 * place + row for row in rows]])
    channels = tuple(names)
    return LoadCase(
        name=run.name,
        title=run.name,
        gear=run.gear,
        total_ratio=run.total_ratio,
        torque_limit=run.torque_limit,
        order=run.order,
        displacement=Spectrum(run.frequency, np.hstack(displacements), channels, "m"),
        force=Spectrum(run.frequency, np.hstack(forces), channels, "N"),
    )
