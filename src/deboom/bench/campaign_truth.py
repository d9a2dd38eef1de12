"""The exact truth behind a written campaign, for verification only."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.campaign_sensors import CampaignSensors
from deboom.bench.data_sheet import DataSheet
from deboom.bench.operating_run import OperatingRun
from deboom.bench.parameters import VirtualBench
from deboom.bench.time_run import TimeSignals
from deboom.bench.truth_files import write_powertrain_truth


def write_set_truth(
    path: Path,
    names: Sequence[str],
    runs: Sequence[OperatingRun],
    static: Sequence[RealArray],
    moments: Sequence[ComplexArray] | None = None,
) -> None:
    """Write the truth of all runs with one mount set.

    Parameters
    ----------
    path : Path
        ``.npz``; arrays have the shape (run, f, channel).
    names : sequence of str
        Of the runs.
    runs : sequence of OperatingRun
        The truth.
    static : sequence of array, shape (f, n_channel)
        True static force of every channel [N].
    moments : sequence of array, shape (f, n_mount, 3), optional
        Of the powertrain mounts, about their virtual points, where cells show them [N m].
    """
    optional: dict[str, Any] = {} if moments is None else {"moment": np.array(moments)}
    np.savez(
        path,
        frequency=runs[0].frequency,
        runs=np.array(names),
        channels=np.array(runs[0].channels),
        displacement=np.array([run.displacement for run in runs]),
        force=np.array([run.force for run in runs]),
        stiffness=np.array([run.stiffness for run in runs]),
        motion=np.array([run.powertrain.motion for run in runs]),
        engine_torque=np.array([run.engine_torque for run in runs]),
        static_force=np.array(static),
        **optional,
    )


def write_bench_truth(
    folder: Path, bench: VirtualBench, sheet: DataSheet, sensors: CampaignSensors
) -> None:
    """Write what the sensors truly do and the true powertrain.

    Parameters
    ----------
    folder : Path
        Exists.
    bench, sheet, sensors
        What was measured with what.
    """
    optional: dict[str, Any] = {}
    if sensors.third_cell:
        optional["moment_pushes"] = sensors.moment_pushes
    np.savez(
        folder / "sensors.npz",
        positions=sensors.true_positions,
        orientations=sensors.true_orientations,
        sensitivity=sensors.sensitivity,
        cells=sensors.cells,
        side_cells=sensors.side_cells,
        pushes=sensors.pushes,
        drift=sensors.drift,
        **optional,
    )
    write_powertrain_truth(folder, bench, sheet)


def write_time_truth(path: Path, signals: TimeSignals) -> None:
    """Write the steady states that a run over time passes through, and its speed.

    Parameters
    ----------
    path : Path
        ``.npz``.
    signals : TimeSignals
        With their truth.
    """
    np.savez(
        path,
        frequency=signals.steady.frequency,
        acceleration=signals.steady_acceleration,
        cell_force=signals.steady_cell_force,
        channels=np.array(signals.steady.channels),
        displacement=signals.steady.displacement,
        force=signals.steady.force,
        stiffness=signals.steady.stiffness,
        engine_torque=signals.steady.engine_torque,
        time=signals.time,
        speed=signals.speed,
    )
