"""Hear a front: the run-up at the driver's ear, today and with a pick, as WAV files."""

from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np
from scipy.io import wavfile
from scipy.signal.windows import tukey

from deboom.arrays import RealArray
from deboom.choices import Pick
from deboom.errors import InputError
from deboom.files.disk import made_folder, replace_bytes, replace_text
from deboom.names import path_inside
from deboom.physics.sound_level import RUN_UP_RATE, full_scale, run_up_sound
from deboom.runs.rebuilt import compared_run
from deboom.vehicles.booming_model import BoomingModel

FADE_S = 0.05
"""Fading in and out, against clicks at both ends [s]."""


def write_run_ups(
    folder: Path, *, pick: Pick, seconds: float, studies: Path | None, out: Path | None = None
) -> list[Path]:
    """Write a WAV file per vehicle and design, and what they mean.

    Parameters
    ----------
    folder : Path
        Finished run of a front study.
    pick : Pick
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
        ``<vehicle> today.wav`` and ``<vehicle> <pick>.wav``, 16 bit, one full scale for all; last
        ``listen.json`` with that scale [Pa], the band [Hz] and the time [s].

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
    designs = {"today": run.model.space.nominal, pick.value: run.picked(pick)}
    pressure = model.pressure(np.array(list(designs.values())))
    sounds = run_up_sound(np.moveaxis(pressure, -1, 0), model.frequency, seconds, RUN_UP_RATE)
    fade = tukey(len(sounds), 2 * FADE_S / seconds)
    scale = full_scale(sounds)
    place = made_folder(path_inside(run.entry.folder, "listen") if out is None else out)
    paths = []
    for v, vehicle in enumerate(model.response_names):
        for d, name in enumerate(designs):
            paths.append(path_inside(place, f"{vehicle} {name}.wav"))
            replace_bytes(paths[-1], _wav(fade * sounds[:, d, v] / scale))
    facts = {
        "run": run.entry.name,
        "load_case": model.load_case_names[0],
        "full_scale_Pa": scale,
        "first_Hz": float(model.frequency[0]),
        "last_Hz": float(model.frequency[-1]),
        "seconds": seconds,
    }
    paths.append(place / "listen.json")
    replace_text(paths[-1], json.dumps(facts, indent=2) + "\n")
    return paths


def _wav(signal: RealArray) -> bytes:
    """Write a signal between −1 and 1 as 16 bit."""
    stream = io.BytesIO()
    wavfile.write(stream, RUN_UP_RATE, np.round(32767 * signal).astype(np.int16))
    return stream.getvalue()
