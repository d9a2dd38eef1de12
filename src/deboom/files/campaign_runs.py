"""The runs of a campaign: spectra along an engine order, and pushes of the shaker."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from deboom.arrays import RealArray
from deboom.files.campaign_channels import ChannelFile
from deboom.files.campaign_file import CampaignFile, PushEntry, RunEntry, ShakerEntry
from deboom.files.campaign_tables import CampaignChannel
from deboom.measurement.campaign import AXES, OperatingRun, PushRun, ShakerRun
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.impacts import Impact
from deboom.physics.orders import frequency_of_order

_SPECTRA = (0, 12, 27)
"""UFF function types that hold complex spectra: general, spectrum, order function."""

_FRF = (4,)

SPEED_TOLERANCE = 0.5
"""Largest difference between a line and the tacho's speed times the order, in line spacings."""


def names_of(channels: Sequence[CampaignChannel]) -> tuple[str, ...]:
    """Return the names of channels."""
    return tuple(channel.channel for channel in channels)


def of_quantity(channels: Sequence[CampaignChannel], quantity: str) -> tuple[CampaignChannel, ...]:
    """Return the channels of one quantity, in the order of the table."""
    return tuple(channel for channel in channels if channel.quantity == quantity)


def read_operating_run(
    folder: Path,
    entry: RunEntry,
    campaign: CampaignFile,
    channels: Sequence[CampaignChannel],
    switched_off: Sequence[str],
) -> OperatingRun:
    """Read one operating run.

    Parameters
    ----------
    folder : Path
        Of the campaign.
    entry : RunEntry
        Which run.
    campaign : CampaignFile
        Its engine.
    channels : sequence of CampaignChannel
        Of every run.
    switched_off : sequence of str
        Channels that may be dead.

    Raises
    ------
    InputError
        A channel is missing, doubled, dead, or of another type, unit, axis or order; the tacho is
        missing or does not fit the lines.
    """
    file = ChannelFile(folder / entry.file, f"run '{entry.name}' of {entry.mount_set}", _SPECTRA)
    frequency = file.abscissa
    order = campaign.engine.dominant_order
    _check_order(file, order)
    speed = file.real(of_quantity(channels, "engine speed"))[:, 0]
    _check_speed(file, frequency, speed, order)
    accelerations = of_quantity(channels, "acceleration")
    cells = of_quantity(channels, "cell force")
    slow = of_quantity(channels, "static force")
    acceleration = file.complex(accelerations)
    for name, column in zip(names_of(accelerations), acceleration.T, strict=True):
        if name not in switched_off and not np.any(column):
            raise file.error(
                f"acceleration '{name}' is dead, 0 at all lines: name it in switched_off, or "
                "measure again"
            )
    torque = file.real(of_quantity(channels, "engine torque"))[:, 0]
    return OperatingRun(
        name=entry.name,
        mount_set=entry.mount_set,
        gear=entry.gear,
        total_ratio=campaign.engine.total_ratios[entry.gear - 1],
        full_load=entry.full_load,
        torque_limit=entry.torque_nm,
        rising=entry.rising,
        order=order,
        engine_torque=torque,
        acceleration=Spectrum(frequency, acceleration, names_of(accelerations), "m/s^2"),
        cell_force=Spectrum(frequency, file.complex(cells), names_of(cells), "N"),
        static_force=file.real(slow) if slow else np.empty((frequency.size, 0)),
        static_force_names=names_of(slow),
    )


def read_shaker_run(
    folder: Path, entry: ShakerEntry, cells: Sequence[CampaignChannel]
) -> ShakerRun:
    """Read one run of the shaker.

    Parameters
    ----------
    folder : Path
        Of the campaign.
    entry : ShakerEntry
        Which run.
    cells : sequence of CampaignChannel
        Channels of the cells below this mount.

    Raises
    ------
    InputError
        A channel is missing, doubled or of another type or unit; the file's reference is no force
        along the stated axis.
    """
    pushed = " ".join(filter(None, (entry.mount, entry.piece, entry.axis)))
    file = ChannelFile(folder / entry.file, f"shaker run '{pushed}' {entry.repeat}", _FRF)
    values = file.complex(cells)
    references = {(f.reference_direction, f.denominator) for f in file.functions}
    for direction, denominator in references:
        if direction.lstrip("+-") != entry.axis or denominator != "force" or len(references) > 1:
            raise file.error(
                f"its reference is {denominator} along '{direction}', expected one force along "
                f"'{entry.axis}': the file or the axis may be swapped"
            )
    sign = -1.0 if references.pop()[0].startswith("-") else 1.0
    response = Frf(file.abscissa, sign * values[:, :, None], names_of(cells), (pushed,), "N/N")
    return ShakerRun(entry.mount, entry.piece, entry.axis, entry.repeat, response)


def read_push(folder: Path, entry: PushEntry, cells: Sequence[CampaignChannel]) -> PushRun:
    """Read one push beside the virtual point of a mount.

    Parameters
    ----------
    folder, entry, cells
        As for `read_shaker_run`.

    Raises
    ------
    InputError
        As `read_shaker_run`.
    """
    run = read_shaker_run(folder, entry, cells)
    direction = np.eye(len(AXES))[AXES.index(entry.axis)]
    response = Frf(
        run.response.frequency, run.response.values, run.response.outputs, (entry.name,), "N/N"
    )
    push = Impact(entry.name, np.array(entry.position_m), direction)
    return PushRun(entry.mount, entry.piece, push, entry.repeat, response)


def _check_order(file: ChannelFile, order: float) -> None:
    for function in file.functions:
        match = re.match(r"order\s+(\d+(?:\.\d+)?)", function.id_lines[0])
        if match and float(match[1]) != order:
            raise file.error(
                f"{function.dof} is of order {match[1]}, but the dominant_order of the engine is "
                f"{order:g}: correct the wrong one"
            )


def _check_speed(file: ChannelFile, frequency: RealArray, speed: RealArray, order: float) -> None:
    spacing = float(np.min(np.diff(frequency)))
    error = np.abs(frequency_of_order(speed, order) - frequency)
    wrong = error > SPEED_TOLERANCE * spacing
    if wrong.any():
        first = int(np.argmax(wrong))
        raise file.error(
            f"the tacho reads {speed[first]:.6g} rpm at {frequency[first]:.6g} Hz, which is not "
            f"order {order:g}: a pulse may be missing; repair the tacho and track the order again"
        )
