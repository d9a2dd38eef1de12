"""A platform that shares nothing with the shipped one but its format.

Five mounts (15 variables), one of them of two pieces, under a four-cylinder engine: order 2, two
vehicles, 101 uneven lines, millimetres and kilonewtons, no UFF file. The powertrain is rigid and
moves as its mounts let it, so that coupled motion can be told from the files.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.io import savemat

from deboom.arrays import AXES
from deboom.files.library_export import write_library_json
from deboom.mounts import characterised_mount
from deboom.mounts.mount import Mount
from deboom.mounts.response_surface import DynamicStiffnessSurface
from deboom.physics.rigid_body import forward_matrices, mass_matrix, mount_stiffness_matrix

GROUP = "wagons"
VEHICLES = ("Wagon", "Cabrio")
ORDER = 2.0
RATIOS = (11.0, 5.5)
LINES = np.sort(np.append(14.0 + 0.7 * np.arange(100), 30.45))
MASS, INERTIA = 240.0, ((16.0, 0.5, -1.0), (0.5, 9.0, 0.8), (-1.0, 0.8, 14.0))
PLACES = {
    "Front": {"": (-0.40, 0.02, -0.10)},
    "Left": {"": (0.05, -0.45, 0.15)},
    "Right": {"": (0.02, 0.48, 0.20)},
    "Roll": {"": (0.35, 0.10, -0.25)},
    "Rear": {"in": (0.25, -0.15, -0.20), "out": (0.25, 0.20, -0.20)},
}
TRANSFER_AXES = {"Front": ("x", "z"), "Rear": ("x",)}
HEAD = f"""format = 1
name = "foreign"
title = "Somebody else's"
description = ""
mount_table = "where.xlsx"
channel_table = "what.xlsx"
default_load_case = "high"
[engine]
cylinders = 4
dominant_order = {ORDER}
total_ratios = {list(RATIOS)}
[powertrain]
mass_kg = {MASS}
mass_tolerance_kg = 1.0
inertia_kg_m2 = {[list(row) for row in INERTIA]}
inertia_tolerance = 0.02
centre_of_gravity_tolerance_m = 0.002"""


@dataclass(frozen=True)
class Piece:
    """A piece of a mount, with its stiffness [N/m]."""

    mount: str
    name: str
    position: tuple[float, float, float]
    stiffness: np.ndarray

    def channel(self, axis):
        """Name of a channel, such as ``Rear in x``."""
        return " ".join(filter(None, (self.mount, self.name, axis)))


def pieces(seed=3):
    rng = np.random.default_rng(seed)
    mounted = []
    for mount, places in PLACES.items():
        stiffness = rng.uniform(0.8e5, 4e5, 3) * (1 + 1j * rng.uniform(0.08, 0.2, 3))
        mounted += [Piece(mount, name, at, stiffness) for name, at in places.items()]
    return mounted


def axes_of(mount):
    return TRANSFER_AXES.get(mount, AXES)


def motion(torque):
    """Displacement and force at every piece, shape (n_frequency, n_piece, 3)."""
    mounted = pieces()
    positions = np.array([piece.position for piece in mounted])
    stiffness = np.array([piece.stiffness for piece in mounted])
    matrix = mount_stiffness_matrix(positions, stiffness)
    mass = mass_matrix(MASS, np.array(INERTIA))
    load = torque * np.array([0.0, 0.0, 1.5, 0.15, 1.0, 0.05])
    omega = 2 * np.pi * LINES[:, None, None]
    body = np.linalg.solve(matrix - omega**2 * mass, np.tile(load[:, None], (LINES.size, 1, 1)))
    displacement = (forward_matrices(positions) @ body)[..., 0].reshape(LINES.size, -1, 3)
    return displacement, displacement * stiffness


def write_foreign_platform(folder, *, library=False):
    """Write the platform; with its mount library and a catalogue of further parts on request."""
    for name in ("ntf", "runs"):
        (folder / name).mkdir(parents=True)
    rows = [(p.mount, p.name, *(1e3 * np.array(p.position))) for p in pieces()]
    header = ["mount", "piece", "x [mm]", "y [mm]", "z [mm]"]
    pd.DataFrame(rows, columns=header).to_excel(folder / "where.xlsx", index=False)
    _channel_table().to_excel(folder / "what.xlsx", index=False)
    for seed, vehicle in enumerate(VEHICLES, 1):
        _write_transfer(folder / "ntf", vehicle, np.random.default_rng(seed))
    for name, torque in (("low", 60.0), ("high", 130.0)):
        displacement, force = motion(torque)
        table = {"frequency [Hz]": LINES}
        for k, piece in enumerate(pieces()):
            for a, axis in enumerate(AXES):
                for quantity, values, unit in (
                    ("displacement", displacement[:, k, a] * 1e3, "mm"),
                    ("force", force[:, k, a] * 1e-3, "kN"),
                ):
                    stem = f"{piece.channel(axis)} {quantity}"
                    table[f"{stem} real [{unit}]"] = values.real
                    table[f"{stem} imag [{unit}]"] = values.imag
        pd.DataFrame(table).to_csv(folder / f"runs/{name}.csv", index=False)
        engine = {"frequency [Hz]": LINES, "engine torque [N m]": torque + 0.5 * LINES}
        pd.DataFrame(engine).to_csv(folder / f"runs/{name}_torque.csv", index=False)
    (folder / "platform.toml").write_text(_platform_toml(), encoding="utf-8")
    if library:
        _write_libraries(folder)
    return folder


def _write_transfer(folder, vehicle, rng):
    """One vehicle as a table in Pa/kN, the other as a MATLAB file in Pa/N."""
    names = [f"{mount} {axis}" for mount in PLACES for axis in axes_of(mount)]
    resonance = rng.uniform(22.0, 58.0, (len(names), 4))
    gain = rng.normal(size=(len(names), 4)) * 0.004
    ratio = LINES[:, None, None] / resonance
    values = (gain / (1 - ratio**2 + 0.1j * ratio)).sum(axis=-1)
    if vehicle == VEHICLES[0]:
        table = {"frequency [Hz]": LINES, "comment": "x"}
        for k, name in enumerate(names):
            table[f"{name} real [Pa/kN]"] = 1e3 * values[:, k].real
            table[f"{name} imag [Pa/kN]"] = 1e3 * values[:, k].imag
        pd.DataFrame(table).to_excel(folder / f"{vehicle}.xlsx", index=False)
    else:
        cells = np.array(names, dtype=object)
        content = {"frequency": LINES, "names": cells, "values": 1e3 * values, "units": "Pa/kN"}
        savemat(folder / f"{vehicle}.mat", content)


def _channel_table():
    rows = []
    for node, piece in enumerate(pieces(), 1):
        for quantity, unit in (("displacement", "mm"), ("force", "kN")):
            for axis in AXES:
                name = (piece.channel(axis), quantity, piece.mount, piece.name, axis)
                rows.append((*name, node, f"+{axis}", unit))
    for node, mount in enumerate(PLACES, 51):
        for axis in axes_of(mount):
            name = (f"{mount} {axis}", "noise transfer function", mount, "", axis)
            rows.append((*name, node, f"+{axis}", "Pa/kN"))
    header = ["channel", "quantity", "mount", "piece", "axis", "node", "direction", "unit"]
    return pd.DataFrame(rows, columns=header)


def _platform_toml():
    parts = [HEAD]
    for name, places in PLACES.items():
        parts.append(f'[[mounts]]\nname = "{name}"\ndescription = ""')
        parts.append(f"transfer_axes = {list(axes_of(name))}")
        parts += [f"pieces = {list(places)}"] if len(places) > 1 else []
    for name, ending in zip(VEHICLES, ("xlsx", "mat"), strict=True):
        parts.append(f'[[vehicles]]\nname = "{name}"\ngroup = "{GROUP}"')
        parts.append(f'noise_transfer = "ntf/{name}.{ending}"')
    for name, limit in (("low", 110.0), ("high", 180.0)):
        parts.append(f'[[load_cases]]\nname = "{name}"\ntitle = "{name}"\ngear = 2')
        parts.append(f'torque_limit_nm = {limit}\noperating = "runs/{name}.csv"')
        parts.append(f'torque_table = "runs/{name}_torque.csv"')
    return "\n".join(parts)


def _write_libraries(folder):
    record = characterised_mount.CampaignRecord("fitted", ORDER, ("all",), {}, {})
    write_library_json(folder / "mounts.library.json", [record], _parts("A", 1.0))
    further = [part for part in _parts("B", 1.15) if part.mount.name in ("Roll", "Rear")]
    write_library_json(folder / "catalogue.library.json", [record], further)


def _parts(variant, factor):
    """Characterised mounts whose surfaces reach over both runs."""
    rng = np.random.default_rng(9)
    motions = [np.abs(motion(torque)[0]) for torque in (60.0, 130.0)]
    wheel_torque = np.concatenate([RATIOS[1] * (t + 0.5 * LINES) for t in (60.0, 130.0)])
    by_mount = {}
    for k, piece in enumerate(pieces()):
        for a, axis in enumerate(AXES):
            amplitude = np.concatenate([motion_of_case[:, k, a] for motion_of_case in motions])
            preload = np.repeat(wheel_torque, 2) + rng.normal(0.0, 5.0, 4 * LINES.size)
            about = np.repeat(amplitude, 2) * rng.uniform(0.7, 1.3, 4 * LINES.size)
            lines = np.repeat(np.tile(LINES, 2), 2)
            stiffness = factor * piece.stiffness[a] * (1 + 1e-3 * (lines - 40.0))
            by_mount.setdefault((piece.mount, axis), []).append((preload, about, lines, stiffness))
    parts = []
    for name, places in PLACES.items():
        directions = []
        for axis in AXES:
            columns = [np.concatenate(values) for values in zip(*by_mount[name, axis], strict=True)]
            points, stiffness = np.column_stack(columns[:3]), columns[3]
            surface = DynamicStiffnessSurface(preload_unit="N m").fit(points, stiffness)
            directions.append(
                characterised_mount.CharacterisedDirection(
                    axis,
                    characterised_mount.MapPoints.none(),
                    characterised_mount.DirectionQuality(True, 0.02, 0.99, 0.99, 0.99),
                    surface,
                )
            )
        mount = Mount(name, "", tuple(places), tuple(places.values()), axes_of(name))
        identity = characterised_mount.MountIdentity(campaign="fitted", mount=name, variant=variant)
        parts.append(characterised_mount.CharacterisedMount(identity, mount, tuple(directions), {}))
    return parts
