"""A new operating run in a campaign folder, such as one that was tracked from a run over time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.files.campaign import (
    CAMPAIGN_FILE,
    CampaignFile,
    RunEntry,
    names_of,
    of_quantity,
    read_operating_run,
)
from deboom.files.function_table import IN_SI
from deboom.files.rows import CAMPAIGN_QUANTITIES, CampaignChannel, read_table
from deboom.files.schema import append_toml, load_toml
from deboom.files.uff import UffFunction, write_uff
from deboom.measurement.campaign import OperatingRun
from deboom.physics.order_tracking import rpm_of_frequency

ORDER_SPECTRUM = 0
"""UFF function type; the order stands in the first ID line."""

ID_LINE = 80
"""Characters of an ID line."""


def new_run_file(folder: Path, mount_set: str, name: str) -> Path:
    """Return where the file of a new operating run goes.

    - `folder`: of the campaign.
    - `mount_set`, `name`: of the run.
    - raises InputError: the run is there already, or a file in its place; a name with a blank or a
      slash.
    """
    path = Path(folder) / CAMPAIGN_FILE
    file = load_toml(path, CampaignFile)
    if not name or any(c.isspace() or c in '/\\:*?"<>|' for c in name) or name.startswith("."):
        raise InputError(f"'{name}' is no name of a run: use letters, digits, _ and -")
    if (mount_set, name) in [(run.mount_set, run.name) for run in file.runs]:
        raise InputError(
            f"{path}: run '{name}' of mount set {mount_set} is there already: choose another name"
        )
    place = path.parent / _relative(mount_set, name)
    if place.exists():
        raise InputError(
            f"{place} is there already, though no run of {CAMPAIGN_FILE} has it: move it away, or "
            "choose another name"
        )
    return place


def add_operating_run(folder: Path, run: OperatingRun, notes: Sequence[str] = ()) -> Path:
    """Add an operating run to a campaign, in SI; the campaign has all of it or stays as it was.

    - `folder`: of the campaign.
    - `run`: with the channels of the campaign's channel table.
    - `notes`: up to two lines on where it comes from, for the ID lines of the file; they are cut at
      80 characters.
    - returns: the file of its spectra.
    - raises InputError: as `new_run_file`; a channel of the table that the run does not have; a
      table without engine speed; files that cannot be written.
    """
    place = new_run_file(folder, run.mount_set, run.name)
    path = Path(folder) / CAMPAIGN_FILE
    file = load_toml(path, CampaignFile)
    table = path.parent / file.channel_table
    channels = read_table(table, CampaignChannel)
    entry = RunEntry(
        name=run.name,
        mount_set=run.mount_set,
        gear=run.gear,
        full_load=run.full_load,
        torque_nm=run.torque_limit,
        rising=run.rising,
        file=_relative(run.mount_set, run.name),
    )
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{place.parent} cannot be made ({error.strerror or error})") from None
    functions = _functions(table, channels, run, notes)
    write_uff(place, functions, binary=True)
    try:
        # the campaign must be able to read it
        read_operating_run(path.parent, entry, file, channels, file.switched_off)
        append_toml(path, file, "runs", entry)
    except BaseException:
        place.unlink(missing_ok=True)
        raise
    return place


def _relative(mount_set: str, name: str) -> str:
    return f"runs/{mount_set}/{name}.uff"


def _functions(
    table: Path,
    channels: Sequence[CampaignChannel],
    run: OperatingRun,
    notes: Sequence[str],
) -> list[UffFunction]:
    if len(names_of(channels, "engine speed")) != 1:
        raise InputError(
            f"{table}: an operating run needs one channel of quantity 'engine speed': add its row "
            "with a node of its own, direction scalar and unit rpm"
        )
    speed = rpm_of_frequency(run.frequency, run.order)
    by_quantity: dict[str, dict[str, RealArray | ComplexArray]] = {
        "acceleration": dict(
            zip(run.acceleration.channels, run.acceleration.values.T, strict=True)
        ),
        "cell force": dict(zip(run.cell_force.channels, run.cell_force.values.T, strict=True)),
        "static force": dict(zip(run.static_force_names, run.static_force.T, strict=True)),
        "engine torque": dict.fromkeys(names_of(channels, "engine torque"), run.engine_torque),
        "engine speed": dict.fromkeys(names_of(channels, "engine speed"), speed),
    }
    title = f"{run.name}, mount set {run.mount_set}"
    lines = [f"order {run.order:g}", title, *[*notes, "", ""][:2], IN_SI]
    functions = []
    for channel in (each for quantity in by_quantity for each in of_quantity(channels, quantity)):
        values = by_quantity[channel.quantity].get(channel.channel)
        if values is None:
            raise InputError(
                f"run {run.name} has no {channel.quantity} '{channel.channel}', which {table} asks "
                "for"
            )
        ordinate, unit = CAMPAIGN_QUANTITIES[channel.quantity]
        notes = tuple(line[:ID_LINE] for line in lines)
        functions.append(
            channel.dof.function(run.frequency, values, ORDER_SPECTRUM, ordinate, unit, notes)
        )
    return functions
