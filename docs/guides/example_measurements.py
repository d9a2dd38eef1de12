"""Fill a new platform folder with invented measurements, to try the guide before you have your own.

    python docs/guides/example_measurements.py my_platform

A rigid powertrain on its mounts, shaken by the engine's torque, and made-up bodies. It fills what
`deboom new platform ... --files csv` has left empty; nothing in it stands for a real car.
"""

import re
import sys
from pathlib import Path

import numpy as np
import pandas as pd

from deboom.physics.rigid_body import forward_matrices, mass_matrix, mount_stiffness_matrix

FREQUENCY = np.arange(20.0, 80.5, 0.5)
POSITIONS = np.array([[0.0, 0.45, 0.15], [0.05, -0.45, 0.1], [0.3, 0.05, -0.3]])
STIFFNESS = np.array([[2.0, 1.5, 2.5], [1.8, 1.6, 2.8], [3.0, 0.5, 0.6]]) * 1e5 * (1 + 0.1j)


def fill(folder: Path) -> None:
    """Write lines into the tables and take the # off the keys marked FILL IN."""
    toml = folder / "platform.toml"
    text = re.sub(r"^# (\w+ = .*# FILL IN)", r"\1", toml.read_text(encoding="utf-8"), flags=re.M)
    toml.write_text(text, encoding="utf-8")

    mounts = pd.read_excel(folder / "mounts.xlsx", keep_default_na=False)
    mounts[["x [m]", "y [m]", "z [m]"]] = POSITIONS
    mounts.to_excel(folder / "mounts.xlsx", index=False)

    names = [f"{mount} {axis}" for mount in mounts["mount"] for axis in "xyz"]
    displacement = motion()
    spectra = {"displacement": displacement, "force": displacement * STIFFNESS.ravel()}
    for path in sorted((folder / "operating").glob("*.csv")):
        columns = {f"{name} {q}": spectra[q][:, k] for q in spectra for k, name in enumerate(names)}
        write(path, columns)
    for seed, path in enumerate(sorted((folder / "noise_transfer").glob("*.csv")), 1):
        write(path, dict(zip(names, bodies(len(names), seed).T, strict=True)))


def motion() -> np.ndarray:
    """Displacement at each mount and axis [m], shape (n_frequency, 9)."""
    inertia = np.array([[11.0, 0.0, 0.0], [0.0, 7.0, 0.0], [0.0, 0.0, 10.0]])
    mass, spring = mass_matrix(190.0, inertia), mount_stiffness_matrix(POSITIONS, STIFFNESS)
    dynamic = spring - (2 * np.pi * FREQUENCY[:, None, None]) ** 2 * mass
    load = 120.0 * np.array([[0.0], [0.0], [2.0], [0.1], [1.0], [0.0]])  # mainly about y
    return (forward_matrices(POSITIONS) @ np.linalg.solve(dynamic, load))[..., 0]


def bodies(n_paths: int, seed: int) -> np.ndarray:
    """Pressure per force [Pa/N], shape (n_frequency, n_paths): five modes per path."""
    rng = np.random.default_rng(seed)
    ratio = FREQUENCY[:, None, None] / rng.uniform(25, 75, 5)
    return (rng.normal(0, 0.004, (n_paths, 5)) / (1 - ratio**2 + 0.1j * ratio)).sum(axis=-1)


def write(path: Path, functions: dict[str, np.ndarray]) -> None:
    """Put functions into the columns that a table has already; its units are SI."""
    header = list(pd.read_csv(path, nrows=0).columns)
    content = {"frequency [Hz]": FREQUENCY}
    for name, values in functions.items():
        parts = (f"{name} real [", values.real), (f"{name} imag [", values.imag)
        for start, part in parts:
            content[next(column for column in header if column.startswith(start))] = part
    pd.DataFrame(content)[header].to_csv(path, index=False)


if __name__ == "__main__":
    fill(Path(sys.argv[1]))
