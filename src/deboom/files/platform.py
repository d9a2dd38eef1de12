"""A platform folder, read and checked: mounts, vehicles and load cases in SI.

``platform.toml`` names the other files: the mount and channel tables, one file of noise transfer
functions per vehicle and one of operating spectra per load case. Functions are chosen by node,
direction and quantity (UFF) or by name (tables), never by their place in a file.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.files.columns import Columns, common_axis, noise_transfer_columns, operating_columns
from deboom.files.faults import Note, noting, refuse
from deboom.files.mount_entries import mounts_of
from deboom.files.platform_file import (
    Engine,
    LoadCaseEntry,
    PlatformFile,
    VehicleEntry,
    load_platform_file,
)
from deboom.files.strict_toml import has_name
from deboom.files.platform_tables import (
    NOISE_TRANSFER,
    QUANTITY_UNIT,
    ChannelRow,
    MountRow,
    named_channels,
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
_OF_A_MOUNT = ("name", "description", "transfer_axes", "body_mass_kg", "body_mass_tolerance_kg")


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
    file = load_platform_file(folder / PLATFORM_FILE)
    return assembled(folder, file, read_contents(folder, file))


@dataclass(frozen=True, eq=False)
class Contents:
    """What the files of a platform hold, as far as they are right.

    Parameters
    ----------
    mounts : tuple of Mount
        In the order of ``platform.toml``; None if one of its entries is at fault.
    channels : tuple of ChannelRow
        In the order of their table; empty if it cannot be read.
    frequency : array, shape (f,)
        Lines that all functions share [Hz].
    noise_transfer : dict of str to Columns
        By vehicle.
    operating : dict of str to (Columns, Columns)
        Displacement and force, by load case.
    engine_torque : dict of str to array
        By load case, where it was recorded [N m].
    """

    mounts: tuple[Mount, ...] | None
    channels: tuple[ChannelRow, ...]
    frequency: RealArray
    noise_transfer: Mapping[str, Columns]
    operating: Mapping[str, tuple[Columns, ...]]
    engine_torque: Mapping[str, RealArray]


def read_contents(folder: Path, file: PlatformFile, note: Note = refuse) -> Contents:
    """Read all files that ``platform.toml`` names.

    Parameters
    ----------
    folder : Path
        Holds them.
    file : PlatformFile
        Keys at fault are absent, see `deboom.files.platform_file.load_right_platform_file`.
    note : callable
        Gets every fault; by default the first one is raised.
    """
    mounts: tuple[Mount, ...] | None = None
    mount_rows: tuple[MountRow, ...] | None = None
    rows: tuple[ChannelRow, ...] = ()
    row_faults: list[InputError] = []
    if hasattr(file, "mount_table"):
        with noting(note):
            mount_rows = read_mount_table(folder / file.mount_table, note)
    if mount_rows and all(
        has_name(entry.name) and all(hasattr(entry, key) for key in _OF_A_MOUNT)
        for entry in file.mounts
    ):
        with noting(note):
            mounts = mounts_of(
                folder / PLATFORM_FILE, file.mounts, folder / file.mount_table, mount_rows, note
            )
    if hasattr(file, "channel_table"):
        with noting(row_faults.append):
            rows = read_channel_table(folder / file.channel_table, row_faults.append)
        for fault in row_faults:
            note(fault)
        if rows and mounts:
            # a row at fault has been told: its channel is not missing as well
            named = named_channels(folder / file.channel_table) if row_faults else frozenset()
            _check_channels(folder / file.channel_table, rows, mounts, note, named)
    wanted = _by_quantity(rows, mounts) if mounts else _in_table_order(rows)
    order = getattr(getattr(file, "engine", None), "dominant_order", None)
    noise_transfer: dict[str, Columns] = {}
    operating: dict[str, tuple[Columns, ...]] = {}
    for vehicle in (one for one in file.vehicles if hasattr(one, "noise_transfer")):
        path, item = folder / vehicle.noise_transfer, f"vehicle {vehicle.name}"
        node = getattr(vehicle, "ear_node", None)
        with noting(note):
            noise_transfer[vehicle.name] = noise_transfer_columns(
                path, item, node, wanted[NOISE_TRANSFER], note
            )
    for case in (one for one in file.load_cases if hasattr(one, "operating")):
        path, item = folder / case.operating, f"load case {case.name}"
        with noting(note):
            operating[case.name] = operating_columns(
                path, item, order, [*wanted["displacement"], *wanted["force"]], note
            )
    frequency = common_axis(
        [*noise_transfer.values(), *(c for pair in operating.values() for c in pair)], note
    )
    engine_torque = {}
    for case in file.load_cases:
        if case.torque_table:
            with noting(note):
                engine_torque[case.name] = read_torque_table(folder / case.torque_table, frequency)
    return Contents(mounts, rows, frequency, noise_transfer, operating, engine_torque)


def assembled(folder: Path, file: PlatformFile, contents: Contents) -> Platform:
    """Put a platform together from files without a fault.

    Parameters
    ----------
    folder : Path
    file : PlatformFile
        Complete.
    contents : Contents
        Complete.
    """
    inputs = [folder / name for name in (PLATFORM_FILE, file.mount_table, file.channel_table)]
    inputs += [folder / entry.noise_transfer for entry in file.vehicles]
    for entry in file.load_cases:
        inputs += [folder / name for name in (entry.operating, entry.torque_table) if name]
    return Platform(
        name=file.name,
        title=file.title,
        description=file.description,
        folder=folder,
        mounts=contents.mounts or (),
        powertrain=Powertrain(
            mass=file.powertrain.mass_kg,
            inertia=np.array(file.powertrain.inertia_kg_m2),
            mass_tolerance=file.powertrain.mass_tolerance_kg,
            inertia_tolerance=file.powertrain.inertia_tolerance,
            centre_tolerance=file.powertrain.centre_of_gravity_tolerance_m,
        ),
        fleet=Fleet(
            tuple(
                _vehicle(entry, contents.noise_transfer[entry.name], contents.frequency)
                for entry in file.vehicles
            )
        ),
        load_cases=tuple(_load_case(entry, file.engine, contents) for entry in file.load_cases),
        default_load_case=file.default_load_case,
        input_files=tuple(dict.fromkeys(inputs)),
    )


def _vehicle(entry: VehicleEntry, columns: Columns, frequency: RealArray) -> Vehicle:
    ear = columns.functions[0].response_name or f"node {entry.ear_node}"
    values = columns.values[:, np.newaxis, :]
    return Vehicle(entry.name, entry.group, Frf(frequency, values, (ear,), columns.names, "Pa/N"))


def _load_case(entry: LoadCaseEntry, engine: Engine, contents: Contents) -> LoadCase:
    displacement, force = contents.operating[entry.name]
    return LoadCase(
        name=entry.name,
        title=entry.title,
        gear=entry.gear,
        total_ratio=engine.total_ratios[entry.gear - 1],
        torque_limit=entry.torque_limit_nm,
        order=engine.dominant_order,
        displacement=Spectrum(contents.frequency, displacement.values, displacement.names, "m"),
        force=Spectrum(contents.frequency, force.values, force.names, "N"),
        engine_torque=contents.engine_torque.get(entry.name),
    )


def _in_table_order(rows: Sequence[ChannelRow]) -> dict[str, list[ChannelRow]]:
    return {name: [row for row in rows if row.quantity == name] for name in QUANTITY_UNIT}


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


def _check_channels(
    path: Path,
    rows: Sequence[ChannelRow],
    mounts: Sequence[Mount],
    note: Note,
    named: frozenset[tuple[str, str]],
) -> None:
    """Every row belongs to a mount, and every path has all that its force and motion need."""
    paths = [name for mount in mounts for name in mount.paths]
    operating = [name for mount in mounts for axis in AXES for name in mount.channels(axis)]
    for row in rows:
        if row.channel not in (paths if row.quantity == NOISE_TRANSFER else operating):
            note(
                InputError(
                    f"{path}: {row.quantity} channel '{row.channel}' fits no mount, piece and "
                    f"transfer axis of {PLATFORM_FILE}: correct one of them"
                )
            )
    if not paths:
        note(InputError(f"{path}: no mount of {PLATFORM_FILE} has a transfer axis: name one"))
    there = {(row.quantity, row.channel) for row in rows} | named
    measured = [channel for quantity, channel in there if quantity != NOISE_TRANSFER]
    needed = [(NOISE_TRANSFER, name) for name in paths]
    for mount in mounts:
        names = [name for axis in AXES for name in mount.channels(axis)]
        through = [name for axis in mount.transfer_axes for name in mount.channels(axis)]
        if not any(name in measured for name in names):
            note(InputError(f"{path}: mount '{mount.name}' has no channel: add '{names[0]}', ..."))
        for name in names:
            if name in through or name in measured:
                needed += [("displacement", name), ("force", name)]
    for quantity, name in needed:
        if (quantity, name) not in there:
            note(
                InputError(
                    f"{path}: there is no {quantity} channel '{name}': add its row, or take the "
                    f"axis out of transfer_axes in {PLATFORM_FILE}"
                )
            )
