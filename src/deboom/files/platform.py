"""A platform folder, read and checked: mounts, vehicles and load cases in SI.

``platform.toml`` names the other files: the mount and channel tables, one UFF file of noise
transfer functions per vehicle and one of operating spectra per load case. Functions are chosen by
node, direction and quantity, never by their place in a file.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from deboom.errors import InputError
from deboom.files.columns import common_axis, noise_transfer_columns, operating_columns
from deboom.files.mount_entries import mounts_of
from deboom.files.platform_file import load_platform_file
from deboom.files.tables import (
    NOISE_TRANSFER,
    ChannelRow,
    read_channel_table,
    read_mount_table,
)
from deboom.files.torque_table import read_torque_table
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.load_case import LoadCase
from deboom.mounts.mount import AXES, Mount
from deboom.vehicles.fleet import Fleet, Vehicle
from deboom.vehicles.powertrain import Powertrain

PLATFORM_FILE = "platform.toml"


@dataclass(frozen=True, eq=False)
class Platform:
    """Everything measured on one platform.

    Parameters
    ----------
    name, title, description : str
        Short key, a name for readers, a paragraph.
    folder : Path
        Where it was read from.
    mounts : tuple of Mount
        In the order of the design variables.
    powertrain : Powertrain
        Nominal mass and inertia, with tolerances, as the data sheet states them.
    fleet : Fleet
        The vehicles, each with its noise transfer functions from a force at each path, inputs
        ``<mount> <axis>``, to the pressure at the driver's ear.
    load_cases : tuple of LoadCase
        All on the same frequency lines as the noise transfer functions.
    default_load_case : str
        Name of the load case that is meant when none is asked for.
    input_files : tuple of Path
        Every file that was read.
    """

    name: str
    title: str
    description: str
    folder: Path
    mounts: tuple[Mount, ...]
    powertrain: Powertrain
    fleet: Fleet
    load_cases: tuple[LoadCase, ...]
    default_load_case: str
    input_files: tuple[Path, ...]

    def load_case(self, name: str) -> LoadCase:
        """Return a load case by its name.

        Raises
        ------
        InputError
            No such load case.
        """
        for case in self.load_cases:
            if case.name == name:
                return case
        known = ", ".join(case.name for case in self.load_cases)
        raise InputError(
            f"{self.folder / PLATFORM_FILE}: there is no load case '{name}': use {known}"
        )


def read_platform(folder: Path) -> Platform:
    """Read a platform folder and check that its files fit together.

    Parameters
    ----------
    folder : Path
        Holds ``platform.toml``.

    Returns
    -------
    Platform
        In SI.

    Raises
    ------
    InputError
        A file that is missing, damaged or truncated; a key, column, channel, unit or DoF that is
        missing, unknown or doubled; a vehicle without one of the paths; frequency axes that
        differ. The sentence names the file, the item and the remedy.
    """
    platform_path = folder / PLATFORM_FILE
    file = load_platform_file(platform_path)
    mount_path, channel_path = folder / file.mount_table, folder / file.channel_table
    mounts = mounts_of(platform_path, file.mounts, mount_path, read_mount_table(mount_path))
    rows = read_channel_table(channel_path)
    _check_channels(channel_path, rows, mounts)
    wanted = _by_quantity(rows, mounts)
    operating_rows = [*wanted["displacement"], *wanted["force"]]
    noise_transfer = [
        noise_transfer_columns(
            folder / entry.noise_transfer,
            f"vehicle {entry.name}",
            entry.ear_node,
            wanted[NOISE_TRANSFER],
        )
        for entry in file.vehicles
    ]
    operating = [
        operating_columns(
            folder / entry.operating,
            f"load case {entry.name}",
            file.engine.dominant_order,
            operating_rows,
        )
        for entry in file.load_cases
    ]
    frequency = common_axis([*noise_transfer, *(c for pair in operating for c in pair)])
    inputs = [platform_path, mount_path, channel_path]
    inputs += [folder / entry.noise_transfer for entry in file.vehicles]
    for entry in file.load_cases:
        inputs += [folder / name for name in (entry.operating, entry.torque_table) if name]
    return Platform(
        name=file.name,
        title=file.title,
        description=file.description,
        folder=folder,
        mounts=mounts,
        powertrain=Powertrain(
            mass=file.powertrain.mass_kg,
            inertia=np.array(file.powertrain.inertia_kg_m2),
            mass_tolerance=file.powertrain.mass_tolerance_kg,
            inertia_tolerance=file.powertrain.inertia_tolerance,
            centre_tolerance=file.powertrain.centre_of_gravity_tolerance_m,
        ),
        fleet=Fleet(
            tuple(
                Vehicle(
                    entry.name,
                    entry.group,
                    Frf(
                        frequency,
                        columns.values[:, np.newaxis, :],
                        (columns.functions[0].response_name or f"node {entry.ear_node}",),
                        columns.names,
                        "Pa/N",
                    ),
                )
                for entry, columns in zip(file.vehicles, noise_transfer, strict=True)
            )
        ),
        load_cases=tuple(
            LoadCase(
                name=entry.name,
                title=entry.title,
                gear=entry.gear,
                total_ratio=file.engine.total_ratios[entry.gear - 1],
                torque_limit=entry.torque_limit_nm,
                order=file.engine.dominant_order,
                displacement=Spectrum(frequency, displacement.values, displacement.names, "m"),
                force=Spectrum(frequency, force.values, force.names, "N"),
                engine_torque=read_torque_table(folder / entry.torque_table, frequency)
                if entry.torque_table
                else None,
            )
            for entry, (displacement, force) in zip(file.load_cases, operating, strict=True)
        ),
        default_load_case=file.default_load_case,
        input_files=tuple(dict.fromkeys(inputs)),
    )


def _by_quantity(
    rows: Sequence[ChannelRow], mounts: Sequence[Mount]
) -> dict[str, list[ChannelRow]]:
    """Order the rows of each quantity as mount, axis, piece."""
    there = {(row.quantity, row.channel): row for row in rows}
    operating = [name for m in mounts for axis in AXES for name in m.channels(axis)]
    paths = [name for mount in mounts for name in mount.paths]
    return {
        quantity: [there[quantity, name] for name in names if (quantity, name) in there]
        for quantity, names in (
            ("displacement", operating),
            ("force", operating),
            (NOISE_TRANSFER, paths),
        )
    }


def _check_channels(path: Path, rows: Sequence[ChannelRow], mounts: Sequence[Mount]) -> None:
    """Every row belongs to a mount, and every path has all that its force and motion need."""
    paths = [name for mount in mounts for name in mount.paths]
    operating = [name for mount in mounts for axis in AXES for name in mount.channels(axis)]
    for row in rows:
        if row.channel not in (paths if row.quantity == NOISE_TRANSFER else operating):
            raise InputError(
                f"{path}: {row.quantity} channel '{row.channel}' fits no mount, piece and transfer "
                f"axis of {PLATFORM_FILE}: correct one of them"
            )
    if not paths:
        raise InputError(f"{path}: no mount of {PLATFORM_FILE} has a transfer axis: name one")
    measured = [row.channel for row in rows if row.quantity != NOISE_TRANSFER]
    needed = [(NOISE_TRANSFER, name) for name in paths]
    for mount in mounts:
        names = [name for axis in AXES for name in mount.channels(axis)]
        through = [name for axis in mount.transfer_axes for name in mount.channels(axis)]
        if not any(name in measured for name in names):
            raise InputError(f"{path}: mount '{mount.name}' has no channel: add '{names[0]}', ...")
        for name in names:
            if name in through or name in measured:
                needed += [("displacement", name), ("force", name)]
    there = {(row.quantity, row.channel) for row in rows}
    for quantity, name in needed:
        if (quantity, name) not in there:
            raise InputError(
                f"{path}: there is no {quantity} channel '{name}': add its row, or take the axis "
                f"out of transfer_axes in {PLATFORM_FILE}"
            )
