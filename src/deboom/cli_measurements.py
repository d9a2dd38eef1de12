"""The command line of measurements: hammer tests, sweeps, order tracking, the mount library."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer


def orders(
    campaign: Annotated[Path, typer.Argument(help="Folder with campaign.toml.")],
    time_run: Annotated[str, typer.Argument(help="Name of one of its [[time_runs]].")],
    name: Annotated[
        str | None,
        typer.Option(help="Name of the operating run; default: the name of the time run."),
    ] = None,
    bandwidth: Annotated[float, typer.Option(help="Half-power width of the filter [Hz].")] = 3.0,
    other_order: Annotated[
        list[float] | None,
        typer.Option(help="Another strong order that the filter separates; repeatable."),
    ] = None,
    rpm_from: Annotated[
        float | None,
        typer.Option(help="Lowest engine speed [1/min]; default: the lowest of the run."),
    ] = None,
    rpm_to: Annotated[
        float | None,
        typer.Option(help="Highest engine speed [1/min]; default: the highest of the run."),
    ] = None,
    rpm_step: Annotated[
        float, typer.Option(help="Distance of the lines in engine speed [1/min].")
    ] = 10.0,
) -> None:
    """Make an operating run of a run over time, and add it to its campaign.

    The recording is a file of UFF, MDF, TDMS, HDF5, MATLAB or LabVIEW LVM, or a WAV file with a
    table of its calibration. The guide "Your own data" says what each format needs.

    The tacho is repaired and gives the angle of the shaft. The dominant order of all accelerometers
    and cells becomes complex spectra over engine speed, with phases relative to the tacho, and with
    engine torque and static forces on the same lines. The run gets a UFF file and an entry in
    campaign.toml; nothing is overwritten. `deboom characterise` uses it like any other run:

    deboom orders CAMPAIGN g5_wot220_time, then deboom characterise CAMPAIGN --library mounts.db.
    Both in one: deboom characterise CAMPAIGN --library mounts.db --time-runs.

    By default the other orders are 0.5, and twice and four times the dominant order.

    pulses_per_revolution is the number of pitches of the tacho's wheel, missing teeth included, or
    the number of stripes of its tape. It is checked by the gap or the seam that returns with every
    revolution, and a seam is corrected. Slowly sampled channels are resampled to the fastest rate.

    The output says what the spectra resolve: the bandwidth, the finest detail that the run-up
    leaves, and the level of noise and neighbouring orders in the result. It also says what checked
    the pulses per revolution, or that nothing did, and which channels were resampled.
    """
    from deboom.measurement.order_tracking import TrackingOptions
    from deboom.runs.campaigns import described_orders, orders_into_campaign

    options = TrackingOptions(
        bandwidth=bandwidth,
        other_orders=tuple(other_order) if other_order else None,
        lowest_rpm=rpm_from,
        highest_rpm=rpm_to,
        rpm_step=rpm_step,
    )
    tracked, path = orders_into_campaign(campaign, time_run, options, name)
    for line in described_orders(time_run, tracked, path):
        typer.echo(line)


if TYPE_CHECKING:
    from deboom.mounts.characterised_mount import CharacterisedMount

library_app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="The mount library: an SQLite file, or a PostgreSQL URL.",
)

Where = Annotated[
    str,
    typer.Argument(
        metavar="LIBRARY", help="Mount library: a file, or postgresql://user@host/database."
    ),
]
Campaign = Annotated[str | None, typer.Option(help="Only mounts of this campaign.")]
MountName = Annotated[str | None, typer.Option("--mount", help="Only this mount, such as TSM.")]
Variant = Annotated[str | None, typer.Option(help="Only this variant, such as M3.")]
PartNumber = Annotated[str | None, typer.Option(help="Only this part number.")]
Serial = Annotated[str | None, typer.Option(help="Only this serial.")]


@library_app.command("list")
def list_mounts(library: Where) -> None:
    """List the mounts, one a line."""
    import pandas as pd

    from deboom.mounts.library import open_library

    with open_library(library) as opened:
        identities = opened.identities()
    typer.echo(pd.DataFrame(identities).to_string(index=False) if identities else "no mount")


@library_app.command()
def show(
    library: Where,
    campaign: Campaign = None,
    mount: MountName = None,
    variant: Variant = None,
    part_number: PartNumber = None,
    serial: Serial = None,
) -> None:
    """Show one mount: its position, and how reliable each direction is."""
    from deboom.mounts.library import open_library

    with open_library(library) as opened:
        matching = opened.identities(
            campaign=campaign, mount=mount, variant=variant, part_number=part_number, serial=serial
        )
        typer.echo(_described(opened.load(opened.only(matching))))


@library_app.command("import")
def import_mounts(
    library: Where,
    file: Annotated[Path, typer.Argument(help="JSON file exported from another library.")],
    replace: Annotated[
        bool, typer.Option("--replace", help="Replace mounts that the library has already.")
    ] = False,
) -> None:
    """Import the mounts of a JSON export; if the library does not exist, it is made."""
    from deboom.files.library_export import read_library_json
    from deboom.mounts.library import open_library

    campaigns, mounts = read_library_json(file)
    with open_library(library, create=True) as opened:
        opened.add(campaigns, mounts, replace=replace)
    typer.echo(f"{len(mounts)} mounts imported")


@library_app.command("rig")
def import_rig(
    library: Where,
    folder: Annotated[
        Path, typer.Argument(help="Folder with rig.toml: a mount measured on a rig.")
    ],
    table: Annotated[
        Path | None,
        typer.Option(
            help="Also write the 3 x 3 stiffness at the first preload as CSV, for receiver.toml."
        ),
    ] = None,
    replace: Annotated[
        bool, typer.Option("--replace", help="Replace a mount that the library has already.")
    ] = False,
) -> None:
    """Import a mount that was measured on a rig: ISO 10846-2 direct, or -3 indirect.

    The library gets the dynamic transfer stiffness per preload, along every axis that was excited.
    Lines on which the output side moves within 20 dB of the input side count as not valid. If the
    library does not exist, it is made.
    """
    from deboom.files.mount_rig import read_mount_rig, write_stiffness
    from deboom.mounts.library import open_library

    rig = read_mount_rig(folder)
    if table is not None:  # before the library, which an incomplete stiffness leaves as it is
        write_stiffness(table, rig.stiffness[0])
    with open_library(library, create=True) as opened:
        opened.add([rig.campaign], [rig.mount], replace=replace)
    typer.echo(_described(rig.mount))
    for warning in rig.warnings:
        typer.echo(f"WARNING: {warning}")


@library_app.command()
def export(
    library: Where,
    file: Annotated[Path, typer.Argument(help="File to write, .xlsx or .json.")],
    campaign: Campaign = None,
    mount: MountName = None,
    variant: Variant = None,
    part_number: PartNumber = None,
    serial: Serial = None,
) -> None:
    """Export mounts: spreadsheet (.xlsx) or everything (.json)."""
    from deboom.errors import InputError
    from deboom.files.library_export import write_library_json, write_library_xlsx
    from deboom.mounts.library import open_library

    with open_library(library) as opened:
        kind = file.suffix.lower()
        if kind not in (".xlsx", ".json"):
            raise InputError(f"{file}: name a file that ends with .xlsx or .json")
        identities = opened.identities(
            campaign=campaign, mount=mount, variant=variant, part_number=part_number, serial=serial
        )
        if not identities:
            raise InputError(f"{opened.name}: no mount fits; `deboom library list` shows them all")
        mounts = [opened.load(identity) for identity in identities]
        names = {identity.campaign for identity in identities}
        campaigns = [record for record in opened.campaigns() if record.name in names]
        write = write_library_xlsx if kind == ".xlsx" else write_library_json
        write(file, campaigns, mounts)
    typer.echo(file.as_posix())


def characterise(
    campaign: Annotated[Path, typer.Argument(help="Folder with campaign.toml.")],
    library: Annotated[
        str, typer.Option(help="Mount library to write: a file, or a PostgreSQL URL.")
    ],
    mount_set: Annotated[
        list[str] | None, typer.Option(help="Characterise only this mount set; repeatable.")
    ] = None,
    gear: Annotated[
        list[int] | None, typer.Option(help="Gear of the runs; repeatable; default: 5 6 7.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of the error budget, 1 or higher.")] = 1,
    replace: Annotated[
        bool, typer.Option("--replace", help="Replace mounts that the library has already.")
    ] = False,
    time_runs: Annotated[
        bool,
        typer.Option(
            "--time-runs", help="First run `deboom orders` on the time runs of the campaign."
        ),
    ] = False,
) -> None:
    """Characterise the mounts of a measurement campaign and keep them in a library."""
    from deboom.mounts.characterise import CharacteriseOptions
    from deboom.progress import progress_bar
    from deboom.runs.campaigns import characterise_into_library, described, track_untracked

    with progress_bar("characterise") as progress:
        if time_runs:
            track_untracked(campaign, typer.echo)
        gears = tuple(gear) if gear else CharacteriseOptions().gears
        options = CharacteriseOptions(gears=gears, seed=seed)
        results = characterise_into_library(
            campaign, library, options, progress, mount_sets=mount_set or (), overwrite=replace
        )
    for result in results:
        typer.echo(described(result))
    typer.echo(f"{sum(len(of_set.mounts) for of_set in results)} mounts kept in {library}")


def _described(value: CharacterisedMount) -> str:
    from deboom.mounts.library_tables import direction_table

    identity = [field.name for field in fields(value.identity)]
    directions = direction_table([value]).drop(columns=identity).set_index("axis")
    places = [
        f"{piece or 'virtual point'} at x {x:g}, y {y:g}, z {z:g} m"
        for piece, (x, y, z) in zip(value.mount.pieces, value.mount.positions, strict=True)
    ]
    numbers = [f"{name}: {number:.4g}" for name, number in value.quality.items()]
    heading = ": ".join(filter(None, (str(value.identity), value.mount.description)))
    table = directions.map(_short).T.to_string()
    return "\n".join([heading, *places, *numbers, "", table])


def _short(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "NO"
    if value is None or value != value:
        return "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
