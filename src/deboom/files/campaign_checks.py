"""Whether the tables of a campaign fit together: sensors, channels, mounts, shaker directions."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from deboom.errors import InputError
from deboom.files.campaign_file import CampaignFile, ShakerEntry
from deboom.files.campaign_runs import names_of, of_quantity
from deboom.files.campaign_tables import CampaignChannel
from deboom.measurement.sensors import Sensor, SensorKind

AXES = ("x", "y", "z")

FEWEST_ACCELEROMETERS = 3
"""On a rigid body: two leave the rotation about the line through them open."""


def check_sensors(
    path: Path, campaign: CampaignFile, sensors: Sequence[Sensor], switched_off: Sequence[str]
) -> None:
    """Check that every body and every mount has the sensors it needs.

    Parameters
    ----------
    path : Path
        Position sheet, for messages.
    campaign : CampaignFile
        Its mounts.
    sensors : sequence of Sensor
        The sheet.
    switched_off : sequence of str
        Channels not to be used.

    Raises
    ------
    InputError
        A sensor at an unknown mount; an unknown channel or one of a cell is switched off; fewer
        than three accelerometers on the powertrain; a mount without cell, or a body of its own
        without accelerometer.
    """
    pieces = [(mount.name, piece) for mount in campaign.mounts for piece in mount.piece_names]
    for sensor in sensors:
        if (sensor.mount, sensor.piece) not in pieces:
            raise InputError(
                f"{path}: sensor '{sensor.name}' is at mount '{sensor.mount}', piece "
                f"'{sensor.piece}', which is not among the mounts: correct it"
            )
    known = {channel: sensor for sensor in sensors for channel in sensor.channels}
    for name in switched_off:
        if name not in known:
            raise InputError(
                f"switched_off names '{name}', which is no channel of {path}: use <sensor> <axis>"
            )
        if known[name].kind is SensorKind.FORCE_CELL:
            raise InputError(
                f"switched_off names '{name}', a force cell: the force of mount "
                f"'{known[name].mount}' needs all its channels; repair the cell and measure again"
            )
    on_powertrain = {mount.name for mount in campaign.mounts if mount.on_powertrain}
    usable = [
        sensor
        for sensor in sensors
        if sensor.kind is SensorKind.ACCELEROMETER
        and any(channel not in switched_off for channel in sensor.channels)
    ]
    n_usable = sum(sensor.mount in on_powertrain for sensor in usable)
    if on_powertrain and n_usable < FEWEST_ACCELEROMETERS:
        raise InputError(
            f"{path}: {n_usable} usable accelerometers on the powertrain, fewer than three: three "
            "that are not on one line are needed to know its motion"
        )
    cells = {(s.mount, s.piece) for s in sensors if s.kind is SensorKind.FORCE_CELL}
    moved = {(sensor.mount, sensor.piece) for sensor in usable}
    for mount, piece in pieces:
        name = " ".join(filter(None, (mount, piece)))
        if (mount, piece) not in cells:
            raise InputError(f"{path}: mount '{name}' has no force cell: add it")
        if mount not in on_powertrain and (mount, piece) not in moved:
            raise InputError(
                f"{path}: mount '{name}' carries a body of its own, which has no usable "
                "accelerometer: add one"
            )


def check_channels(
    path: Path,
    campaign: CampaignFile,
    sensors: Sequence[Sensor],
    channels: Sequence[CampaignChannel],
    switched_off: Sequence[str],
) -> None:
    """Check that every channel belongs to something, and that none is missing.

    Parameters
    ----------
    path : Path
        Channel table, for messages.
    campaign : CampaignFile
        Its mounts and runs.
    sensors : sequence of Sensor
        Position sheet.
    channels : sequence of CampaignChannel
        The table.
    switched_off : sequence of str
        Channels that may be missing.

    Raises
    ------
    InputError
        A channel of no sensor or mount; a sensor's channel that is missing; engine torque, engine
        speed or tacho missing or doubled.
    """
    directions = [
        " ".join(filter(None, (mount.name, piece, axis)))
        for mount in campaign.mounts
        for piece in mount.piece_names
        for axis in AXES
    ]
    by_kind = {
        kind: [name for s in sensors if s.kind is kind for name in s.channels]
        for kind in SensorKind
    }
    for quantity, expected, belongs in (
        ("acceleration", by_kind[SensorKind.ACCELEROMETER], "accelerometer of the position sheet"),
        ("cell force", by_kind[SensorKind.FORCE_CELL], "force cell of the position sheet"),
        ("static force", directions, "mount, piece and axis"),
    ):
        there = names_of(of_quantity(channels, quantity))
        for name in there:
            if name not in expected:
                raise InputError(
                    f"{path}: {quantity} channel '{name}' fits no {belongs}: correct its name"
                )
        for name in expected:
            if quantity != "static force" and name not in (*there, *switched_off):
                raise InputError(
                    f"{path}: there is no {quantity} channel '{name}': add its row, or name it in "
                    "switched_off"
                )
    needed = [("engine torque", "no preload"), ("engine speed", "no phase: export the tacho")]
    if not campaign.runs:
        needed = needed[:1]
    if campaign.time_runs:
        needed.append(("tacho", "no order"))
    for quantity, without in needed:
        count = len(of_quantity(channels, quantity))
        if count != 1:
            raise InputError(
                f"{path}: {count} channels of quantity '{quantity}', expected one: a run without "
                f"it has {without}"
            )


def check_shaker_directions(path: Path, entries: Sequence[ShakerEntry]) -> None:
    """Check that every mount that was pushed was pushed along all three axes.

    Raises
    ------
    InputError
        A direction is missing; the mount and the missing axes are named.
    """
    for mount, piece in dict.fromkeys((entry.mount, entry.piece) for entry in entries):
        pushed = [e.axis for e in entries if (e.mount, e.piece) == (mount, piece)]
        missing = [axis for axis in AXES if axis not in pushed]
        if missing:
            raise InputError(
                f"{path}: mount '{' '.join(filter(None, (mount, piece)))}' has shaker runs along "
                f"{', '.join(dict.fromkeys(pushed))} only: add {', '.join(missing)}; a force "
                "transfer matrix needs all three"
            )
