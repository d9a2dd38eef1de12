"""Writes what is true of an electric car, for verification."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from deboom.bench.electric_body import POINTS, ElectricCarBody
from deboom.bench.electric_hammer import body_plan
from deboom.bench.electric_places import Setup
from deboom.bench.electric_sweeps import CarSweep
from deboom.files.atomic import replace_text


def write_car_truth(
    folder: Path,
    car: ElectricCarBody,
    setup: Setup,
    microphone: float,
    sweeps: Sequence[CarSweep],
) -> None:
    """Write ``car.json``, ``body.npz`` and one ``.npz`` per sweep.

    Parameters
    ----------
    folder : Path
        Made.
    car : ElectricCarBody
    setup : Setup
        Of the hammer on the body.
    microphone : float
        Stated over true pressure [1].
    sweeps : sequence of CarSweep
        In the order of ``operation.toml``.

    Notes
    -----
    ``body.npz``: ``frequency`` (f,); ``noise_transfer`` (f, 30) per load at the true points and
    ``point_receptance`` (f, 5, 6, 6). ``0.npz`` … of the sweeps:
    ``frequency``, ``load`` and ``displacement`` (f, 6) of the compressor, ``body_motion`` and
    ``body_load`` (f, 30), ``pressure`` (f,) at the ear.
    """
    folder.mkdir()
    lines = body_plan().lines
    blocks = car.receptance(lines).reshape(lines.size, len(POINTS), 6, len(POINTS), 6)
    np.savez(
        folder / "body.npz",
        frequency=lines,
        noise_transfer=car.noise_transfer(lines),
        point_receptance=np.einsum("fpapb->fpab", blocks),
    )
    for number, sweep in enumerate(sweeps):
        np.savez(
            folder / f"{number}.npz",
            frequency=sweep.run.frequency,
            load=sweep.run.load,
            displacement=sweep.run.displacement,
            body_motion=sweep.run.body_motion,
            body_load=sweep.run.body_load,
            pressure=sweep.run.pressure,
        )
    content = {
        "car": car.name,
        "sweeps": [sweep.name for sweep in sweeps],
        "points": POINTS,
        "positions_m": [point.position.tolist() for point in setup.points],
        "microphone": microphone,
        "hammer_gain": setup.hammer_gain,
    }
    replace_text(folder / "car.json", json.dumps(content, indent=1) + "\n")
