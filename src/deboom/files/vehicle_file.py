"""``vehicle.toml``: what was measured on one vehicle, and in which files it lies."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from deboom.errors import InputError
from deboom.files.platform_file import Engine, MountEntry, Name, Positive, RelativePath
from deboom.files.strict_toml import StrictModel, dump_toml, load_toml
from deboom.files.vehicle_panels import PanelEntry

VEHICLE_FILE = "vehicle.toml"


class EarEntry(StrictModel):
    """One ear and the one microphone that stands for it."""

    name: Annotated[str, Field(min_length=1)]
    """Such as ``driver ear``."""
    node: Annotated[int, Field(ge=1)]
    """In the UFF files: of the microphone, and of the loudspeaker in its place."""
    microphone: Annotated[str, Field(min_length=1, max_length=10)]
    """Serial number, the response name of all of its functions."""


class VehicleRunEntry(StrictModel):
    """One run of the assembled vehicle."""

    name: Name
    """Such as ``g5_wot220``."""
    gear: Annotated[int, Field(ge=1)]
    """Gear of the run."""
    torque_limit_nm: Positive
    """Engine torque limit [N m]."""
    file: RelativePath
    """UFF file: pressure at the ears and acceleration, over the dominant order."""


class VehicleFile(StrictModel):
    """Keys of ``vehicle.toml``."""

    format: Literal[1]
    """Of this file."""
    name: Name
    """Such as ``U06-1``."""
    group: Name
    """Vehicles of one body, such as ``U06``."""
    title: str
    """In words, for the report."""
    mount_table: RelativePath
    """Virtual points, CSV."""
    sensor_table: RelativePath
    """Position sheet of all accelerometers, CSV or Excel."""
    channel_table: RelativePath
    """Nodes of their channels, CSV."""
    impact_table: RelativePath
    """Position sheet of the blows, CSV."""
    source_sensors: Annotated[tuple[Name, ...], Field(strict=False)]
    """Accelerometers on the powertrain and on wheel ends; all others are on the body."""
    direct: RelativePath
    """UFF: pressure at the ears per force of the hammer."""
    reciprocal: RelativePath
    """UFF: acceleration on the body per volume acceleration at the ears."""
    accelerance: RelativePath | None = None
    """UFF: acceleration on the body per force of the hammer; left out where not recorded."""
    panels: PanelEntry | None = None
    """Panels of the cabin under the loudspeaker; left out where not measured."""
    engine: Engine
    """For the order of the runs."""
    ears: Annotated[tuple[EarEntry, ...], Field(strict=False, min_length=1)]
    """In the order of the results."""
    mounts: Annotated[tuple[MountEntry, ...], Field(strict=False, min_length=1)]
    """As in ``platform.toml``; one without body mass carries the powertrain."""
    runs: Annotated[tuple[VehicleRunEntry, ...], Field(strict=False)] = ()
    """May be empty."""


def load_vehicle_file(path: Path) -> VehicleFile:
    """Read and check ``vehicle.toml``.

    Raises
    ------
    InputError
        Missing or no TOML; a key unknown, missing or out of range; a name or node that comes twice;
        a gear that the gearbox does not have.
    """
    vehicle = load_toml(path, VehicleFile)
    _refuse_doubled(path, "ear", [ear.name for ear in vehicle.ears])
    _refuse_doubled(path, "ear node", [str(ear.node) for ear in vehicle.ears])
    _refuse_doubled(path, "mount", [mount.name for mount in vehicle.mounts])
    _refuse_doubled(path, "run", [run.name for run in vehicle.runs])
    for run in vehicle.runs:
        if run.gear > len(vehicle.engine.total_ratios):
            raise InputError(
                f"{path}: run '{run.name}' is in gear {run.gear}, but engine.total_ratios names "
                f"{len(vehicle.engine.total_ratios)} gears: correct one of them"
            )
    return vehicle


def dump_vehicle_file(path: Path, vehicle: VehicleFile) -> None:
    """Write ``vehicle.toml``; what is written is read back and compared first."""
    dump_toml(path, vehicle)


def _refuse_doubled(path: Path, what: str, names: Sequence[str]) -> None:
    doubled = sorted({name for name in names if names.count(name) > 1})
    if doubled:
        raise InputError(f"{path}: {what} {', '.join(doubled)} comes twice: keep one")
