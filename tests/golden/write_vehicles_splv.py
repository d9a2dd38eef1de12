"""Writes `vehicles_splv.json`: SPLV, gradient and peaks of a small fleet made of formulas.

Run it only when a change of these numbers is meant, and say in the changelog why.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from deboom.measurement.channels import Frf, LoadCase, Spectrum
from deboom.mounts.mount import Mount
from deboom.physics.sound_level import spl
from deboom.vehicles.booming_model import booming_model
from deboom.vehicles.booming_peaks import booming_peaks
from deboom.vehicles.fleet import Fleet, Vehicle, path_contributions

PATH = Path(__file__).with_name("vehicles_splv.json")
FREQUENCY = np.linspace(15.0, 80.0, 261)
MOUNTS = (
    Mount("TSM", "torque strut", ("",), ((0.2, 0.0, -0.3),), ("x", "z")),
    Mount("Du", "wishbone", ("left", "right"), ((0.0, -0.7, 0.0), (0.0, 0.7, 0.0)), ("x",)),
)
DESIGNS = np.array(
    [
        [1.0, 1.0, 1.0, 1.0, 1.0, 1.0],
        [0.8, 1.0, 1.2, 0.8, 1.0, 1.0],
        [1.15, 0.9, 0.85, 1.1, 0.8, 1.2],
    ]
)


def resonance(natural: float, damping: float) -> np.ndarray:
    ratio = FREQUENCY / natural
    return 1.0 / (1.0 - ratio**2 + 2j * damping * ratio)


def load_case(name: str, torque: float) -> LoadCase:
    channels = ("TSM x", "TSM z", "Du left x", "Du right x")
    gains = (1.0, 0.3, 0.15, 0.12 + 0.03j)
    naturals = (24.0, 19.0, 17.0, 17.5)
    pairs = zip(gains, naturals, strict=True)
    force = torque * np.column_stack([gain * resonance(f, 0.08) for gain, f in pairs])
    displacement = force / (3e5 * (1 + 0.1j))
    return LoadCase(
        *(name, name, 5, 3.4, torque, 1.5),
        Spectrum(FREQUENCY, displacement, channels, "m"),
        Spectrum(FREQUENCY, force, channels, "N"),
    )


def vehicle(name: str, shift: float) -> Vehicle:
    modes = [(30.0, 1.0, -0.4, 0.7), (41.0, -0.6, 0.8, 0.5), (56.0, 0.5, 0.3, -0.9)]
    columns = [
        1e-3 * sum(mode[path + 1] * resonance(shift * mode[0], 0.035) for mode in modes)
        for path in range(3)
    ]
    values = np.column_stack(columns)[:, np.newaxis, :]
    return Vehicle(name, "A", Frf(FREQUENCY, values, ("ear",), ("TSM x", "TSM z", "Du x"), "Pa/N"))


def compute() -> dict[str, list]:
    fleet = Fleet((vehicle("A-1", 1.0), vehicle("A-2", 1.04)))
    cases = [load_case("full", 220.0), load_case("part", 120.0)]
    weighted = [(cases[0], 3.0), (cases[1], 1.0)]
    index = booming_model(fleet, MOUNTS, weighted, (20.0, 60.0))
    contributions = path_contributions(fleet, MOUNTS, cases[0])
    level = spl(contributions.pressure(DESIGNS), contributions.frequency, axis=-1)
    peaks = booming_peaks(level[0, 0], contributions.frequency, 1.5)
    return {
        "splv": index(DESIGNS).tolist(),
        "gradient": index.gradient(DESIGNS).tolist(),
        "peaks": [[p.frequency, p.rpm, p.level, p.prominence] for p in peaks],
    }


if __name__ == "__main__":
    PATH.write_text(json.dumps(compute(), indent=1) + "\n", encoding="utf-8")
