"""Writes the virtual platform: measurement files, the tables that name them, the truth apart."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from deboom.bench.body import noise_transfer
from deboom.bench.data_sheet import draw_data_sheet, draw_wheel_end_mass
from deboom.bench.fleet import load_fleet
from deboom.bench.laboratory import evaluate
from deboom.bench.measurement_files import (
    CHANNEL_TABLE,
    MOUNT_TABLE,
    channel_rows,
    ear_nodes,
    mount_rows,
    noise_transfer_file,
    noise_transfer_functions,
    operating_file,
    operating_functions,
    platform_file,
    torque_file,
)
from deboom.bench.operating_run import full_load_run
from deboom.bench.parameters import load_bench
from deboom.bench.platform_layout import FREQUENCY, LOAD_CASES
from deboom.bench.platform_readme import readme_text
from deboom.bench.sensors import ErrorBudget, draw_instrumentation, measure
from deboom.bench.truth_files import write_truth
from deboom.bench.vehicle_measurement import TransferErrors, measured_noise_transfer
from deboom.errors import InputError
from deboom.files.atomic import replace_text
from deboom.files.platform_file import dump_platform_file
from deboom.files.platform_tables import write_channel_table, write_mount_table
from deboom.files.torque_table import write_torque_table
from deboom.files.uff import write_uff
from deboom.files.whole_folder import complete_or_not_at_all

Progress = Callable[[int, int, str], None]

TORQUE_NOISE = 1.0
"""Standard deviation of the engine torque that the control unit states, per line [N m]."""

TORQUE_DIGITS = 2
"""Decimals to which it does."""


def write_platform(folder: Path, seed: int, progress: Progress | None = None) -> Path:
    """Measure the virtual platform and write its files.

    Parameters
    ----------
    folder : Path
        A new or an empty folder; it appears complete or not at all.
    seed : int
        From 1. It draws all errors of measurement, and every fleet but that of seed 1, which is
        frozen. The same seed gives the same bytes.
    progress : callable, optional
        Called with the files written so far, all files, and the name of the last one.

    Returns
    -------
    Path
        The folder, with ``platform.toml`` at its top and the exact truth in ``truth/``.

    Raises
    ------
    InputError
        Seed below 1; a folder that is not empty or cannot be written.
    """
    if seed < 1:
        raise InputError(f"seed {seed} is refused: seeds are whole numbers from 1")
    with complete_or_not_at_all(Path(folder)) as unfinished:
        _write_files(unfinished, seed, progress or _silent)
    return Path(folder)


def _silent(done: int, total: int, text: str) -> None:
    """Tell nobody."""


def _write_files(folder: Path, seed: int, progress: Progress) -> None:
    bench, fleet, budget = load_bench(), load_fleet(seed), ErrorBudget()
    names, order = bench.mount_names, bench.order_torque.order
    # one child per purpose, so that a change of one draw leaves the others as they are
    children = np.random.SeedSequence(seed).spawn(6)
    for_sheet, for_sensors, for_runs, for_vehicles, for_wheel_end, for_torque = children
    sheet = draw_data_sheet(bench, np.random.default_rng(for_sheet))
    wheel_end_mass = draw_wheel_end_mass(bench, np.random.default_rng(for_wheel_end))
    instrumentation, knowledge = draw_instrumentation(
        bench, budget, np.random.default_rng(for_sensors)
    )
    total = len(LOAD_CASES) + len(fleet.bodies) + 1
    for name in ("operating", "noise_transfer", "truth"):
        (folder / name).mkdir()

    runs = {}
    torque_noise = np.random.default_rng(for_torque)
    for case, child in zip(LOAD_CASES, for_runs.spawn(len(LOAD_CASES)), strict=True):
        run = full_load_run(bench, case.gear, case.torque_limit, FREQUENCY)
        raw = measure(instrumentation, run, budget, np.random.default_rng(child))
        measured = evaluate(knowledge, raw)
        functions = operating_functions(measured, FREQUENCY, case, names, order)
        write_uff(folder / operating_file(case), functions)
        torque = run.engine_torque + torque_noise.normal(0, TORQUE_NOISE, FREQUENCY.size)
        write_torque_table(folder / torque_file(case), FREQUENCY, np.round(torque, TORQUE_DIGITS))
        runs[case.name] = run
        progress(len(runs), total, operating_file(case))

    transfers = {}
    nodes = ear_nodes(fleet)
    children = for_vehicles.spawn(len(fleet.bodies))
    for (vehicle, body), child in zip(fleet.bodies.items(), children, strict=True):
        true = noise_transfer(body, fleet.cabin, FREQUENCY)
        found = measured_noise_transfer(true, TransferErrors(), np.random.default_rng(child))
        functions = noise_transfer_functions(found, FREQUENCY, vehicle, nodes[vehicle], names)
        write_uff(folder / noise_transfer_file(vehicle), functions)
        transfers[vehicle] = true
        progress(len(runs) + len(transfers), total, noise_transfer_file(vehicle))

    write_truth(folder / "truth", bench, sheet, fleet, FREQUENCY, runs, transfers)
    write_mount_table(folder / MOUNT_TABLE, mount_rows(bench, sheet))
    write_channel_table(folder / CHANNEL_TABLE, channel_rows(names))
    replace_text(folder / "README.txt", readme_text(fleet, names, FREQUENCY, order, seed))
    dump_platform_file(folder / "platform.toml", platform_file(bench, sheet, wheel_end_mass, fleet))
    progress(total, total, "platform.toml")
