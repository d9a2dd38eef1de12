"""Fill a new platform folder with invented measurements, to try the guide before you have your own.

    python docs/guides/example_measurements.py my_platform            20 to 80 Hz
    python docs/guides/example_measurements.py my_platform 40 120     other lines [Hz]

A rigid powertrain on its mounts, shaken by the engine's torque, and made-up bodies. It fills what
`deboom new platform ... --files csv` (or xlsx) has left empty, for any number of mounts of one
piece; nothing in it stands for a real car.
"""

import re
import sys
from pathlib import Path

import numpy as np
import pandas as pd

from deboom.physics.rigid_body import forward_matrices, mass_matrix, mount_stiffness_matrix

FREQUENCY = np.arange(20.0, 80.5, 0.5)


def fill(folder: Path, frequency: np.ndarray = FREQUENCY) -> None:
    """Write lines [Hz] into the tables and take the # off the keys marked FILL IN."""
    if not any((folder / "operating").glob("*")):
        raise SystemExit(f"{folder} has no tables to fill: make it with --files csv or xlsx")
    toml = folder / "platform.toml"
    text = re.sub(r"^# (\w+ = .*# FILL IN)", r"\1", toml.read_text(encoding="utf-8"), flags=re.M)
    toml.write_text(text, encoding="utf-8")

    mounts = pd.read_excel(folder / "mounts.xlsx", keep_default_na=False)
    places = positions(len(mounts))
    mounts[["x [m]", "y [m]", "z [m]"]] = places
    mounts.to_excel(folder / "mounts.xlsx", index=False)

    names = [f"{mount} {axis}" for mount in mounts["mount"] for axis in "xyz"]
    stiffness = np.random.default_rng(1).uniform(0.6e5, 3e5, places.shape) * (1 + 0.1j)
    displacement = motion(frequency, places, stiffness)
    spectra = {"displacement": displacement, "force": displacement * stiffness.ravel()}
    for path in sorted((folder / "operating").iterdir()):
        columns = {f"{name} {q}": spectra[q][:, k] for q in spectra for k, name in enumerate(names)}
        write(path, frequency, columns)
    for seed, path in enumerate(sorted((folder / "noise_transfer").iterdir()), 1):
        functions = bodies(frequency, len(names), seed).T
        write(path, frequency, dict(zip(names, functions, strict=True)))


def positions(n_mounts: int) -> np.ndarray:
    """Places around the powertrain [m], shape (n_mounts, 3), never on one line from three on."""
    turn = 2 * np.pi * np.arange(n_mounts) / n_mounts
    return np.column_stack([0.3 * np.cos(turn), 0.45 * np.sin(turn), 0.15 * np.cos(2 * turn)])


def motion(frequency: np.ndarray, places: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    """Displacement at each mount and axis [m], shape (n_frequency, 3 n_mounts)."""
    inertia = np.array([[11.0, 0.0, 0.0], [0.0, 7.0, 0.0], [0.0, 0.0, 10.0]])
    mass, spring = mass_matrix(190.0, inertia), mount_stiffness_matrix(places, stiffness)
    dynamic = spring - (2 * np.pi * frequency[:, None, None]) ** 2 * mass
    load = 120.0 * np.array([[0.0], [0.0], [2.0], [0.1], [1.0], [0.0]])  # mainly about y
    return (forward_matrices(places) @ np.linalg.solve(dynamic, load))[..., 0]


def bodies(frequency: np.ndarray, n_paths: int, seed: int) -> np.ndarray:
    """Pressure per force [Pa/N], shape (n_frequency, n_paths): five modes per path."""
    rng = np.random.default_rng(seed)
    ratio = frequency[:, None, None] / rng.uniform(frequency[0], frequency[-1], 5)
    return (rng.normal(0, 0.004, (n_paths, 5)) / (1 - ratio**2 + 0.1j * ratio)).sum(axis=-1)


def write(path: Path, frequency: np.ndarray, functions: dict[str, np.ndarray]) -> None:
    """Put functions into the columns that a table has already; its units are SI."""
    excel = path.suffix == ".xlsx"
    header = list((pd.read_excel if excel else pd.read_csv)(path, nrows=0).columns)
    content = {"frequency [Hz]": frequency}
    for name, values in functions.items():
        parts = (f"{name} real [", values.real), (f"{name} imag [", values.imag)
        for start, part in parts:
            content[next(column for column in header if column.startswith(start))] = part
    table = pd.DataFrame(content)[header]
    table.to_excel(path, index=False) if excel else table.to_csv(path, index=False)


if __name__ == "__main__":
    low, high = (float(text) for text in (sys.argv[2:] or ("20", "80")))
    fill(Path(sys.argv[1]), np.arange(low, high + 0.25, 0.5))
