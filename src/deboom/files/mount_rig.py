"""The folder of a mount on a rig, by the direct or the indirect method of ISO 10846."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import pandas as pd

from deboom.arrays import AXES, ComplexArray
from deboom.errors import InputError, naming
from deboom.files.disk import replace_text
from deboom.files.function_table import FunctionTable, read_function_table
from deboom.files.run_folder import hash_files
from deboom.files.schema import (
    AtLeastOne,
    Name,
    Positive,
    RelativePath,
    Row3,
    StrictModel,
    Title,
    doubled,
    load_toml,
    same_file,
    within,
)
from deboom.mounts.characterised_mount import CampaignRecord, CharacterisedMount, MountIdentity
from deboom.mounts.rig import RigRun, RigStiffness, rig_mount, rig_stiffness
from deboom.physics.dynamic_stiffness import N_PER_MM, displacement_from_acceleration
from deboom.tabled import csv_text

RIG_FILE = "rig.toml"


class RigRunSection(StrictModel):
    """One excitation under one preload."""

    name: Title  # such as z, -800 N
    axis: Literal["x", "y", "z"]  # along which the shaker pushes
    preload_n: Row3  # static force on the mount
    # CSV, xlsx or mat: input x … z and output x … z [m/s^2], force x … z [N]; see the guide
    table: RelativePath


class MountRigFile(StrictModel):
    """The whole file ``rig.toml``."""

    format: Literal[1]
    title: Title  # what a reader calls the test
    campaign: Name  # under which the library keeps it
    mount: Name  # in the vehicle, such as TSM
    variant: Name  # mount set or design level, such as M1
    part_number: str = ""
    supplier: str = ""
    serial: str = ""
    # direct: force cells below the mount (ISO 10846-2); indirect: a mass below it (ISO 10846-3)
    method: Literal["direct", "indirect"]
    blocking_mass_kg: (
        Annotated[Positive, within(1.0, 1e5, "no blocking mass weighs that: is it in g or t?")]
        | None
    ) = None  # of the indirect method, flange and half of the mount included
    force_side: Literal["output", "input"] = "output"  # of the specimen; input: at the shaker
    flange_mass_kg: (
        Annotated[Positive, within(0.001, 1e3, "no flange weighs that: is it in g?")] | None
    ) = None  # between force cells and specimen, on the side of the cells
    runs: AtLeastOne[RigRunSection]

    def faults(self) -> Iterator[str]:
        """Give a sentence for what comes twice, and for a mass that does not fit the method."""
        if (self.method == "indirect") != (self.blocking_mass_kg is not None):
            yield (
                "key 'blocking_mass_kg' belongs to the indirect method, which needs it: the direct "
                "one measures its force"
            )
        if self.method == "indirect" and (self.force_side == "input" or self.flange_mass_kg):
            yield (
                "keys 'force_side' and 'flange_mass_kg' belong to force cells, which the indirect "
                "method has not: its flange is part of blocking_mass_kg"
            )
        yield from doubled("[[runs]] are named", [run.name for run in self.runs])
        yield from same_file("runs", "table", self.runs)


@dataclass(frozen=True, eq=False)
class MountRig:
    """A mount on a rig: its stiffness under each preload, and what the library keeps of it."""

    title: str
    stiffness: tuple[RigStiffness, ...]
    campaign: CampaignRecord
    mount: CharacterisedMount

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences on what looks like a mass and not like a stiffness, under each preload."""
        return tuple(words for series in self.stiffness for words in series.warnings)


def read_mount_rig(folder: Path | str) -> MountRig:
    """Read a mount on a rig and make its dynamic transfer stiffness.

    Parameters
    ----------
    folder : path
        Holds ``rig.toml`` and its tables: columns ``frequency [Hz]``, and for each axis ``input x
        real [m/s^2]``, ``input x imag [m/s^2]``; ``force x real [N]`` … of the direct method; and
        ``output x real [m/s^2]`` …, which the indirect method needs, and which lets the direct one
        say where the output side was blocked.

    Returns
    -------
    MountRig
        Stiffness (n_frequency, 3, 3) per preload [N/m], full where all three axes were excited.

    Raises
    ------
    InputError
        A file is missing, damaged or wrong in itself; a column of another unit; unlike lines; an
        axis twice under one preload.
    """
    folder = Path(folder)
    path = folder / RIG_FILE
    file = load_toml(path, MountRigFile)
    runs = [_run(folder / run.table, run, file) for run in file.runs]
    with naming(path):
        stiffness = rig_stiffness(runs)
    identity = MountIdentity(
        campaign=file.campaign,
        mount=file.mount,
        variant=file.variant,
        part_number=file.part_number,
        supplier=file.supplier,
        serial=file.serial,
    )
    read = [path, *(folder / run.table for run in file.runs)]
    hashes = hash_files(read, relative_to=folder)
    record = CampaignRecord(file.campaign, 0.0, tuple(run.name for run in runs), {}, hashes)
    return MountRig(file.title, stiffness, record, rig_mount(identity, stiffness, file.title))


def _run(path: Path, section: RigRunSection, file: MountRigFile) -> RigRun:
    table = read_function_table(path)
    with naming(path):
        moved = _side(table, "input", "m/s^2")
        indirect = file.blocking_mass_kg is not None
        stated = any(f"output {axis}" in table.functions for axis in AXES)
        still = _side(table, "output", "m/s^2") if indirect or stated else None
        if file.blocking_mass_kg is not None and still is not None:
            force = file.blocking_mass_kg * still
        else:
            force = _side(table, "force", "N")
            force = force + _flange_force(file, moved, still)
        return RigRun(
            name=section.name,
            axis=section.axis,
            preload=np.array(section.preload_n),
            frequency=table.frequency,
            input_motion=displacement_from_acceleration(moved, table.frequency),
            force=force,
            output_motion=None
            if still is None
            else displacement_from_acceleration(still, table.frequency),
        )


def _flange_force(
    file: MountRigFile, moved: ComplexArray, still: ComplexArray | None
) -> ComplexArray | float:
    """Force that accelerates the flange between cells and specimen [N].

    Cells at the shaker push flange and specimen; those below feel the specimen less the flange.
    """
    if file.flange_mass_kg is None:
        return 0.0
    if file.force_side == "input":
        return -file.flange_mass_kg * moved
    if still is None:
        raise InputError(
            "flange_mass_kg on the output side needs its acceleration: export output x, y and z"
        )
    return file.flange_mass_kg * still


def _side(table: FunctionTable, side: str, unit: str) -> ComplexArray:
    columns = []
    for axis in AXES:
        stated, values = table.spectrum(f"{side} {axis}")
        if stated.si != unit:
            raise InputError(f"'{side} {axis}' is in '{stated.label}': export it in {unit}")
        columns.append(values)
    return np.stack(columns, axis=1)


def write_stiffness(path: Path, measured: RigStiffness) -> None:
    """Write the full stiffness as the table that a point of ``receiver.toml`` names.

    - raises InputError: not all three axes were excited, or the file cannot be written.
    """
    if not measured.complete:
        raise InputError(
            f"{path}: the runs {', '.join(measured.runs)} do not excite all three axes: a table of "
            "a 3 x 3 stiffness needs them"
        )
    columns: dict[str, object] = {"frequency [Hz]": measured.frequency}
    for row, a in enumerate(AXES):
        for column, b in enumerate(AXES):
            values = N_PER_MM * measured.stiffness[:, row, column]
            columns |= {
                f"{a}{b} real [N/mm]": values.real,
                f"{a}{b} imag [N/mm]": values.imag,
            }
    replace_text(path, csv_text(pd.DataFrame(columns)))
