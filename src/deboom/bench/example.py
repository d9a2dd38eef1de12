"""A folder of invented measurements for trying the guides: `deboom example`."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pandas as pd

from deboom.arrays import AXES, ComplexArray, RealArray
from deboom.bench.campaign import TRAINING_RUNS, CampaignErrors, CampaignPlan, TimeRunPlan
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.choices import CalibrationLevel
from deboom.bench.compressor_truth import CompressorPlan
from deboom.bench.compressor_writer import POSITIONS, write_compressor_test
from deboom.files.disk import complete_or_not_at_all, replace_text
from deboom.files.folders import Names, new_folder
from deboom.files.kinds import FolderKind, FunctionFiles
from deboom.files.rows import PlacedImpact, PlacedSensor
from deboom.files.shipped_studies import shipped_studies
from deboom.files.tables import read_table
from deboom.files.uff import write_sets
from deboom.physics.rigid_body import forward_matrices, mass_matrix, mount_stiffness_matrix
from deboom.progress import Progress
from deboom.tabled import csv_text

DATA = Path(__file__).with_name("data") / "example"
PLATFORM = Names(("EnM", "GeM", "TSM"), ("wagon", "cabrio"), "family", files=FunctionFiles.csv)
"""Names of the invented platform."""
FILES = (
    DATA / "delivered_parts.csv",
    DATA / "limits.toml",
    DATA / "supplier_levels.xlsx",
    shipped_studies() / "data" / "u06_parts.toml",
)
README = "README.txt"
FREQUENCY: RealArray = np.arange(20.0, 80.5, 0.5)
"""Lines of its functions [Hz]."""


def write_example(folder: Path, progress: Progress | None = None) -> Path:
    """Write what the guides need beside the shipped platform.

    An invented platform, a campaign, a compressor with its geometry, a mount on a rig, parts of a
    delivery, limits, and a table of levels.

    - `folder`: a new or empty folder; it appears complete or not at all.
    - `progress`: gets the share that is done, as `deboom.bench.write_campaign` tells it.
    - returns: the folder.
    - raises InputError: a folder that is not empty or cannot be written.
    """
    over_time = TimeRunPlan(sample_rate=4096.0)
    plan = CampaignPlan(
        mount_sets=("M1",), runs=TRAINING_RUNS, shaker_repeats=1, time_run=over_time
    )
    with complete_or_not_at_all(folder) as unfinished:
        fill_platform(new_folder(unfinished / "platform", FolderKind.platform, PLATFORM))
        write_campaign(unfinished / "campaign", 1, plan, CampaignErrors(), progress)
        compressor = unfinished / "compressor"
        write_compressor_test(compressor, 1, CalibrationLevel.C2, CompressorPlan())
        _write_geometry(compressor / "geometry.uff", compressor / POSITIONS)
        _write_rig(unfinished / "rig")
        for path in FILES:
            shutil.copyfile(path, unfinished / path.name)
        about = (DATA / README).read_text(encoding="utf-8")
        replace_text(unfinished / README, about.replace("example", folder.resolve().name))
    return folder


def fill_platform(folder: Path, frequency: RealArray = FREQUENCY) -> None:
    """Fill a new platform folder with an invented powertrain and invented bodies.

    A rigid body on its mounts is shaken by the torque of an engine.

    - `folder`: as `deboom.files.folders.new_folder` writes it for functions in CSV or xlsx and for
      mounts of one piece.
    - `frequency`: lines of its functions [Hz].
    """
    toml = folder / "platform.toml"
    text = re.sub(r"^# (\w+ = .*# FILL IN)", r"\1", toml.read_text(encoding="utf-8"), flags=re.M)
    toml.write_text(text, encoding="utf-8")

    mounts = pd.read_excel(folder / "mounts.xlsx", keep_default_na=False)
    places = _positions(len(mounts))
    mounts[["x [m]", "y [m]", "z [m]"]] = places
    mounts.to_excel(folder / "mounts.xlsx", index=False)

    names = [f"{mount} {axis}" for mount in mounts["mount"] for axis in "xyz"]
    random = np.random.default_rng(1)
    stiffness = np.asarray(random.uniform(0.6e5, 3e5, places.shape) * complex(1.0, 0.1))
    displacement = _motion(frequency, places, stiffness)
    spectra = {"displacement": displacement, "force": displacement * stiffness.ravel()}
    for path in sorted((folder / "operating").iterdir()):
        columns = {f"{name} {q}": spectra[q][:, k] for q in spectra for k, name in enumerate(names)}
        _write(path, frequency, columns)
    for seed, path in enumerate(sorted((folder / "noise_transfer").iterdir()), 1):
        functions = _bodies(frequency, len(names), seed).T
        _write(path, frequency, dict(zip(names, functions, strict=True)))


def _positions(n_mounts: int) -> RealArray:
    """Places around the powertrain [m], shape (n_mounts, 3), never on one line from three on."""
    turn = 2 * np.pi * np.arange(n_mounts) / n_mounts
    return np.column_stack([0.3 * np.cos(turn), 0.45 * np.sin(turn), 0.15 * np.cos(2 * turn)])


def _motion(frequency: RealArray, places: RealArray, stiffness: ComplexArray) -> ComplexArray:
    """Displacement at each mount and axis [m], shape (n_frequency, 3 n_mounts)."""
    inertia = np.array([[11.0, 0.0, 0.0], [0.0, 7.0, 0.0], [0.0, 0.0, 10.0]])
    mass, spring = mass_matrix(190.0, inertia), mount_stiffness_matrix(places, stiffness)
    dynamic = spring - (2 * np.pi * frequency[:, None, None]) ** 2 * mass
    load = 120.0 * np.array([[0.0], [0.0], [2.0], [0.1], [1.0], [0.0]])  # mainly about y
    return np.asarray((forward_matrices(places) @ np.linalg.solve(dynamic, load))[..., 0])


def _bodies(frequency: RealArray, n_paths: int, seed: int) -> ComplexArray:
    """Pressure per force [Pa/N], shape (n_frequency, n_paths): five modes per path."""
    rng = np.random.default_rng(seed)
    ratio = frequency[:, None, None] / rng.uniform(frequency[0], frequency[-1], 5)
    gains = rng.normal(0, 0.004, (n_paths, 5))
    return np.asarray((gains / (1 - ratio**2 + 0.1j * ratio)).sum(axis=-1))


def _write(path: Path, frequency: RealArray, functions: dict[str, ComplexArray]) -> None:
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


def _write_geometry(path: Path, positions: Path) -> None:
    """Write sensors and impacts of a position sheet as nodes [m], as other programs export them."""
    rows: list[PlacedSensor | PlacedImpact] = [
        *read_table(positions, PlacedSensor),
        *read_table(positions, PlacedImpact),
    ]
    places = {row.node: row.position for row in rows}
    systems = {name: np.zeros(len(places)) for name in ("def_cs", "disp_cs", "color")}
    axes = dict(zip(AXES, np.array(list(places.values())).T, strict=True))
    write_sets(path, [{"type": 2411, "node_nums": np.array(list(places)), **systems, **axes}])


def _write_rig(folder: Path) -> None:
    """Write a massless mount on a stiff frame, shaken along each axis, with its cross stiffness."""
    folder.mkdir()
    shutil.copyfile(DATA / "rig.toml", folder / "rig.toml")
    frequency = np.arange(20.0, 201.0, 5.0)
    squared = -((2 * np.pi * frequency[:, None]) ** 2)
    static = 1e3 * np.array([[220.0, 15.0, 0.0], [15.0, 180.0, -8.0], [0.0, -8.0, 410.0]])
    stiffness = static * (1 + 0.12j + 0.001 * frequency[:, None, None])  # [N/m]
    for axis, along in zip(AXES, np.eye(3), strict=True):
        displacement = np.tile(1e-5 * along, (frequency.size, 1))  # 10 µm, output side at rest
        force = (stiffness @ displacement[:, :, None])[:, :, 0]
        columns = {"frequency [Hz]": frequency}
        columns |= _pairs("input {}", squared * displacement, "m/s^2")
        columns |= _pairs("force {}", force, "N")
        replace_text(folder / f"{axis}.csv", csv_text(pd.DataFrame(columns)))


def _pairs(name: str, values: RealArray | ComplexArray, unit: str) -> dict[str, RealArray]:
    """Return the columns of real and imaginary part for each axis (n_frequency, 3)."""
    return {
        f"{name.format(axis)} {part} [{unit}]": getattr(values[:, column], part)
        for column, axis in enumerate(AXES)
        for part in ("real", "imag")
    }
