"""Hear a front: the model's run-up at the driver's ear, today and with a pick, as WAV files."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from deboom.errors import InputError
from deboom.explore.choices import Pick
from deboom.files.disk import made_folder, replace_bytes, replace_text
from deboom.files.front_run import design_name
from deboom.files.sound import run_up_files
from deboom.files.tables import write_table
from deboom.files.time_data import WavChannel
from deboom.names import path_inside
from deboom.physics.sound_level import RUN_UP_RATE, full_scale
from deboom.runs.rebuilt import compared_run
from deboom.vehicles.booming_model import BoomingModel
from deboom.vehicles.fleet_front import sound_rows


def write_run_ups(
    folder: Path,
    *,
    pick: Pick | Path,
    seconds: float,
    studies: Path | None,
    out: Path | None = None,
) -> list[Path]:
    """Write a WAV file per vehicle and design, and what they mean.

    Parameters
    ----------
    folder : Path
        Finished run of a front study.
    pick : Pick or Path
        Design of the front beside today's.
    seconds : float
        Time from the first to the last frequency of the order [s].
    studies : Path or None
        Folder with the script of the run; None: deboom's own.
    out : Path or None
        Folder that gets the files, made when missing; None: ``listen`` in the run.

    Returns
    -------
    list of Path
        ``<vehicle> today.wav`` and ``<vehicle> <pick>.wav``, 16 bit, one full scale for all, each
        with a table of its calibration beside it, by which `deboom look` reads it; last
        ``listen.json`` with that scale [Pa], the band [Hz] and the time [s], and that the model is
        heard.

    Raises
    ------
    InputError
        A run that is no front of mount stiffnesses or has no such pick; a time below 1 s or above
        120 s; a folder that cannot be written.
    """
    if not 1.0 <= seconds <= 120.0:
        raise InputError(f"a run-up of {seconds:g} s: give --seconds from 1 to 120")
    run = compared_run(folder, studies)
    model = run.model.evaluate
    if not isinstance(model, BoomingModel):
        raise InputError(
            f"run {folder} has no pressure at an ear: only fronts of mounts can be heard"
        )
    designs = {"today": run.model.space.nominal, design_name(pick): run.picked(pick)}
    ears = sound_rows(model)  # vibrations are not heard
    pressure = model.pressure(np.array(list(designs.values())))[:, ears]
    rows = np.moveaxis(pressure, 1, 0).reshape(-1, pressure.shape[-1])
    scale = full_scale(rows)
    sounds = run_up_files(rows, model.frequency, seconds, RUN_UP_RATE, scale)
    place = made_folder(run.entry.writable("listen") if out is None else out)
    paths = []
    names = [f"{model.response_names[ear]} {name}.wav" for ear in ears for name in designs]
    for name, sound in zip(names, sounds, strict=True):
        paths.append(path_inside(place, name))
        replace_bytes(paths[-1], sound)
        calibration = WavChannel(channel="driver ear", full_scale=scale, unit="Pa")
        write_table(paths[-1].with_suffix(".csv"), WavChannel, [calibration])
    facts = {
        "run": run.entry.name,
        "heard": "the model without scatter; the run's page has what cars are expected to show",
        "load_case": model.load_case_names[0],
        "full_scale_Pa": scale,
        "first_Hz": float(model.frequency[0]),
        "last_Hz": float(model.frequency[-1]),
        "seconds": seconds,
    }
    paths.append(place / "listen.json")
    replace_text(paths[-1], json.dumps(facts, indent=2) + "\n")
    return paths
