"""The exact truth behind a written platform, for verification only."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.data_sheet import DataSheet
from deboom.bench.fleet import BenchFleet
from deboom.bench.operating_run import OperatingRun
from deboom.bench.parameters import VirtualBench
from deboom.files.atomic import replace_text


def write_truth(
    folder: Path,
    bench: VirtualBench,
    sheet: DataSheet,
    fleet: BenchFleet,
    frequency: RealArray,
    runs: Mapping[str, OperatingRun],
    noise_transfer: Mapping[str, ComplexArray],
) -> None:
    """Write what the measurement files only approximate.

    Parameters
    ----------
    folder : Path
        Exists and is empty.
    bench, sheet, fleet
        What was measured.
    frequency : array, shape (f,)
        Lines of all spectra [Hz].
    runs : mapping of str to OperatingRun
        Load case to its true run.
    noise_transfer : mapping of str to array, shape (f, n_path)
        Vehicle to its true noise transfer functions [Pa/N].
    """
    first = next(iter(runs.values()))
    np.savez(
        folder / "operating.npz",
        frequency=frequency,
        load_cases=np.array(list(runs)),
        channels=np.array(first.channels),
        displacement=np.array([run.displacement for run in runs.values()]),
        force=np.array([run.force for run in runs.values()]),
        stiffness=np.array([run.stiffness for run in runs.values()]),
        engine_torque=np.array([run.engine_torque for run in runs.values()]),
    )
    np.savez(
        folder / "noise_transfer.npz",
        frequency=frequency,
        vehicles=np.array(list(noise_transfer)),
        paths=np.array(fleet.paths),
        noise_transfer=np.array(list(noise_transfer.values())),
    )
    bodies = fleet.bodies.values()
    np.savez(
        folder / "body_modes.npz",
        vehicles=np.array(list(fleet.bodies)),
        frequencies=np.array([body.frequencies for body in bodies]),
        damping_ratios=np.array([body.damping_ratios for body in bodies]),
        shapes_at_paths=np.array([body.shapes_at_paths for body in bodies]),
        shapes_at_panels=np.array([body.shapes_at_panels for body in bodies]),
        local_stiffness=np.array([body.local_stiffness for body in bodies]),
    )
    write_powertrain_truth(folder, bench, sheet)


def write_powertrain_truth(folder: Path, bench: VirtualBench, sheet: DataSheet) -> None:
    """Write what the data sheet only approximates, as ``powertrain.json``.

    Parameters
    ----------
    folder : Path
        Exists.
    bench, sheet
        The truth, and what is stated of it.
    """
    powertrain = {
        "mass_kg": bench.mass,
        "inertia_kg_m2": bench.inertia.tolist(),
        "mount_position_m": dict(zip(bench.mount_names, bench.positions.tolist(), strict=True)),
        "centre_of_gravity_from_stated_one_m": sheet.centre_error.tolist(),
        "wheel_end_mass_kg": float(bench.wheel_end.mass_matrix[0, 0]),
    }
    replace_text(folder / "powertrain.json", json.dumps(powertrain, indent=1) + "\n")
