"""The file ``campaign.toml``: the files of a campaign, and what its bench states of itself."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from deboom.errors import InputError
from deboom.files.platform_file import (
    Engine,
    MountEntry,
    Name,
    NotNegative,
    Positive,
    Powertrain,
    RelativePath,
)
from deboom.files.strict_toml import StrictModel, dump_toml, load_toml

Axis = Literal["x", "y", "z"]
Gear = Annotated[int, Field(ge=1)]


class CampaignMount(MountEntry):
    """One mount."""

    on_powertrain: bool
    """Whether it carries the powertrain; else each piece carries a body of its own."""


class ToleranceEntry(StrictModel):
    """Standard deviations of what the bench states only approximately."""

    sensor_position_m: NotNegative
    """Of an accelerometer, per axis [m]."""
    sensor_angle_rad: NotNegative
    """Of an accelerometer, per axis [rad]."""
    sensor_gain: NotNegative
    """Of an accelerometer channel [1]."""
    sensor_cross_axis: NotNegative
    """Of an accelerometer channel [1]."""
    acceleration_own: NotNegative
    """Noise per amplitude of the channel [1]."""
    acceleration_norm: NotNegative
    """Noise per norm of the triaxial sensor [1]."""
    acceleration_floor_m_s2: NotNegative
    """Noise at rest [m/s²]."""
    cell_gain: NotNegative
    """Of a cell that no shaker calibrates [1]."""
    force_own: NotNegative
    """Noise per amplitude of the channel [1]."""
    force_norm: NotNegative
    """Noise per norm of the triaxial cell [1]."""
    force_floor_n: NotNegative
    """Noise at rest [N]."""
    shaker_angle_rad: NotNegative
    """Of the shaker against its nominal axis, per axis [rad]."""
    shaker_gain: NotNegative
    """Of the force the shaker states [1]."""
    torque_nm: NotNegative
    """Of the engine torque, per line [N m]."""
    static_force_n: NotNegative
    """Of the quasi-static cell force, per line [N]."""


class SensorModelEntry(StrictModel):
    """A sensor model that is not in the catalogue, or stands here instead of it."""

    name: str
    """As in the position sheet."""
    quantity_unit: Literal["m/s^2", "N"]
    """What it measures."""
    signal_unit: str
    """What it delivers: ``C`` or ``V``."""
    sensitivity: Annotated[tuple[float, ...], Field(strict=False, min_length=1)]
    """Nominal, per axis [signal_unit/quantity_unit]."""
    gain_tolerance: NotNegative
    """Half width before the single sensor is calibrated [1]."""
    cross_axis: Annotated[tuple[NotNegative, ...], Field(strict=False, min_length=1)]
    """Limit per axis [1]."""
    noise_floor: NotNegative
    """Threshold [quantity_unit]."""
    frequency_range_hz: Annotated[tuple[NotNegative, Positive], Field(strict=False)]
    """Lowest and highest [Hz]."""
    source: str
    """Where the figures stand."""


class RunEntry(StrictModel):
    """One operating run and the file of its spectra."""

    name: Name
    """Such as ``g5_wot220``; a mount set has it once."""
    mount_set: Name
    """Parts on the bench."""
    gear: Gear
    """From 1."""
    full_load: bool
    """Ramp with wide open throttle; else a slice at constant torque."""
    torque_nm: Positive
    """Limit of a ramp, torque of a slice [N m]."""
    rising: bool
    """Direction of the engine speed."""
    file: RelativePath
    """UFF file."""


class ShakerEntry(StrictModel):
    """One run of the shaker at the virtual point of a mount."""

    mount: Name
    """Where."""
    piece: str
    """Piece of it; ``""`` for a single one."""
    axis: Axis
    """Nominal direction of the force."""
    repeat: Annotated[int, Field(ge=1)]
    """From 1."""
    file: RelativePath
    """UFF file."""


class PushEntry(ShakerEntry):
    """One push beside the virtual point of a mount: it makes a moment as well."""

    name: Name
    """Of the point and direction; repeats share it."""
    position_m: Annotated[tuple[float, float, float], Field(strict=False)]
    """From the origin of the position sheet [m]."""


class CurveEntry(StrictModel):
    """One force-deflection curve of a supplier."""

    mount: Name
    """Of the direction."""
    axis: Axis
    """Of the direction."""
    mount_set: Name
    """Part that was measured."""
    force_uncertainty: NotNegative
    """Standard deviation of the curve's scale [1]."""
    file: RelativePath
    """CSV file."""


class TimeRunEntry(RunEntry):
    """One run recorded over time."""

    pulses_per_revolution: Annotated[int, Field(ge=1)]
    """Of the tacho."""


class CampaignFile(StrictModel):
    """The whole file ``campaign.toml``."""

    format: Literal[1]
    """Version of this format."""
    name: Name
    """Short key of the campaign."""
    title: str
    """What a reader calls it."""
    description: str
    """A paragraph for the report."""
    mount_table: RelativePath
    """CSV with the virtual points."""
    sensor_table: RelativePath
    """Position sheet, CSV or Excel."""
    channel_table: RelativePath
    """CSV that says which UFF node and direction is which channel."""
    switched_off: Annotated[tuple[str, ...], Field(strict=False)] = ()
    """Channels not to be used, such as ``A3 y``."""
    engine: Engine
    """Engine and gearbox."""
    powertrain: Powertrain
    """Nominal rigid-body data."""
    tolerances: ToleranceEntry
    """Of this bench."""
    mounts: Annotated[tuple[CampaignMount, ...], Field(strict=False, min_length=1)]
    """In the order of the platform."""
    sensor_models: Annotated[tuple[SensorModelEntry, ...], Field(strict=False)] = ()
    """Beyond the catalogue."""
    runs: Annotated[tuple[RunEntry, ...], Field(strict=False)] = ()
    """Operating runs."""
    shaker_runs: Annotated[tuple[ShakerEntry, ...], Field(strict=False)] = ()
    """For the force transfer matrices."""
    static_curves: Annotated[tuple[CurveEntry, ...], Field(strict=False)] = ()
    """From suppliers."""
    time_runs: Annotated[tuple[TimeRunEntry, ...], Field(strict=False)] = ()
    """Recorded over time."""
    pushes: Annotated[tuple[PushEntry, ...], Field(strict=False)] = ()
    """For force transfer matrices with moments."""


def load_campaign_file(path: Path) -> CampaignFile:
    """Read and check ``campaign.toml``.

    Raises
    ------
    InputError
        The file is missing or no TOML; a key is unknown, missing, mistyped or out of range; two
        items share a name; a gear has no ratio; an item belongs to a mount or piece that is not
        there.
    """
    campaign = load_toml(path, CampaignFile)
    _check(path, campaign)
    return campaign


def dump_campaign_file(path: Path, campaign: CampaignFile) -> None:
    """Write ``campaign.toml``.

    Raises
    ------
    InputError
        The content would be refused on reading, or the file cannot be written.
    """
    _check(path, campaign)
    dump_toml(path, campaign)


def _check(path: Path, campaign: CampaignFile) -> None:
    pieces = {(mount.name, piece) for mount in campaign.mounts for piece in mount.piece_names}
    unique: list[tuple[str, Sequence[object]]] = [
        ("[[mounts]] are named", [mount.name for mount in campaign.mounts]),
        ("[[sensor_models]] are named", [model.name for model in campaign.sensor_models]),
        ("[[runs]] of one mount set are named", [(r.mount_set, r.name) for r in campaign.runs]),
        (
            "[[shaker_runs]] are of",
            [(r.mount, r.piece, r.axis, r.repeat) for r in campaign.shaker_runs],
        ),
        (
            "[[static_curves]] are of",
            [(c.mount_set, c.mount, c.axis) for c in campaign.static_curves],
        ),
        ("[[time_runs]] are named", [run.name for run in campaign.time_runs]),
        ("[[pushes]] are of", [(p.mount, p.piece, p.name, p.repeat) for p in campaign.pushes]),
        ("switched_off are named", campaign.switched_off),
    ]
    for what, keys in unique:
        doubled = next((key for key in keys if keys.count(key) > 1), None)
        if doubled is not None:
            words = " ".join(map(str, doubled)) if isinstance(doubled, tuple) else doubled
            raise InputError(f"{path}: two {what} '{words}': keep or rename one")
    gears = len(campaign.engine.total_ratios)
    for run in (*campaign.runs, *campaign.time_runs):
        if run.gear > gears:
            raise InputError(
                f"{path}: run '{run.name}' is in gear {run.gear}, but total_ratios in [engine] "
                f"has {gears} gears: add the ratio"
            )
    for shaker in (*campaign.shaker_runs, *campaign.pushes):
        if (shaker.mount, shaker.piece) not in pieces:
            raise InputError(
                f"{path}: shaker run at mount '{shaker.mount}', piece '{shaker.piece}', which is "
                "not among the mounts: correct its name"
            )
    for curve in campaign.static_curves:
        if curve.mount not in {mount for mount, _ in pieces}:
            raise InputError(
                f"{path}: static curve of mount '{curve.mount}', which is not among the mounts: "
                "correct its name"
            )
