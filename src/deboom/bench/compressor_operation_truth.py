"""Writes what truly happened in the test of a running virtual compressor, for verification."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from deboom.bench.compressor_operation import Operation, TrueSweep
from deboom.bench.compressor_operation_plan import OperationPlan
from deboom.bench.hoses import end_loads, held_stiffness
from deboom.files.atomic import replace_text

REACTION, END_LOAD = "hose_reaction", "end_load"


def write_operation_truth(
    folder: Path, there: Operation, plan: OperationPlan, sweeps: Sequence[TrueSweep]
) -> None:
    """Write ``operation.json``, ``operation.npz`` and one ``.npz`` per sweep.

    Parameters
    ----------
    folder : Path
        Made.
    there : Operation
        What ran.
    plan : OperationPlan
        What was asked for.
    sweeps : sequence of TrueSweep
        In the order of ``operation.toml``; a record over time has none.

    Notes
    -----
    ``<number>.npz`` of each sweep, from 0: ``frequency`` (f,) [Hz]; ``load`` of the source and
    ``displacement`` at the virtual point (f, 6); ``apparent_mass`` (f, 6, 6) with mounts as they
    were, hoses and the turning rotor; ``acceleration`` (f, n_channel) without noise; ``factors`` of
    softening and ``amplitudes`` at the mounts (f, n_mount); with hoses ``hose_reaction``, their
    load on the compressor at the virtual point (f, 6), and ``end_load``, their load on what holds
    the other ends (f, 6 n_hose). ``operation.npz``: ``response_matrix`` (n_channel, 6).
    """
    folder.mkdir()
    laboratory, source = there.laboratory, there.source
    rows = laboratory.placed.response_rows(laboratory.sheet)
    np.savez(folder / "operation.npz", response_matrix=rows)
    for number, sweep in enumerate(sweeps):
        np.savez(folder / f"{number}.npz", **_arrays(sweep))
    content: dict[str, Any] = {
        "case": plan.compressor.case.value,
        "sweeps": [sweep.name for sweep in sweeps],
        "sense": source.sense,
        "static_unbalance_kg_m": _pair(source.static_unbalance),
        "dynamic_unbalance_kg_m2": _pair(source.dynamic_unbalance),
        "unbalances": [asdict(part) for part in source.unbalances],
        "gas_force_n": _pair(source.gas_force),
        "gas_moment_n_m": _pair(source.gas_moment),
        "rotating_gas_force_n": _pair(source.rotating_gas_force),
        "rotor_inertia_kg_m2": source.rotor_inertia,
        "mount_storage": plan.mount_storage,
        "mount_loss": plan.mount_loss,
        "softening": plan.softening,
        "flexible_receiver": plan.compressor.flexible_receiver,
        "hose_case": plan.hoses.value,
        "hoses": [
            {
                "name": hose.name,
                "position": hose.position.tolist(),
                "direction": hose.direction.tolist(),
                **asdict(hose.beam),
            }
            for hose in laboratory.compressor.hoses
        ],
    }
    replace_text(folder / "operation.json", json.dumps(content, indent=1) + "\n")


def _arrays(sweep: TrueSweep) -> dict[str, Any]:
    run, frequency = sweep.running, sweep.frequency
    squared = ((2 * np.pi * frequency) ** 2)[:, None, None]
    arrays = {
        "frequency": frequency,
        "load": run.load,
        "displacement": run.displacement,
        "apparent_mass": -run.dynamic_stiffness / squared,
        "acceleration": sweep.acceleration,
        "factors": run.factors,
        "amplitudes": run.amplitudes,
    }
    if sweep.hoses:
        moved = run.displacement[:, :, None]
        arrays[REACTION] = -(held_stiffness(sweep.hoses, frequency) @ moved)[:, :, 0]
        arrays[END_LOAD] = (end_loads(sweep.hoses, frequency) @ moved)[:, :, 0]
    return arrays


def _pair(number: complex) -> list[float]:
    return [number.real, number.imag]
