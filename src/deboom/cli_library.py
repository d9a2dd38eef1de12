"""The command line of the mount library: list, show, import, export, migrate."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from deboom.mounts.characterised_mount import CharacterisedMount

library_app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="The mount library: an SQLite file, or a PostgreSQL URL.",
)

Where = Annotated[
    str, typer.Argument(metavar="LIBRARY", help="A file, or postgresql://user@host/database.")
]
Campaign = Annotated[str | None, typer.Option(help="Only mounts of this campaign.")]
MountName = Annotated[str | None, typer.Option("--mount", help="Only this mount, such as TSM.")]
Variant = Annotated[str | None, typer.Option(help="Only this variant, such as M3.")]
PartNumber = Annotated[str | None, typer.Option(help="Only this part number.")]
Serial = Annotated[str | None, typer.Option(help="Only this serial.")]


@library_app.command("list")
def list_mounts(
    library: Where,
    campaign: Campaign = None,
    mount: MountName = None,
    variant: Variant = None,
    part_number: PartNumber = None,
    serial: Serial = None,
) -> None:
    """List the mounts, one a line."""
    from deboom.mounts.library import open_library
    from deboom.mounts.library_tables import identity_table
    from deboom.study.runner import one_sentence_errors

    with one_sentence_errors(), open_library(library) as opened:
        found = opened.identities(
            campaign=campaign,
            mount=mount,
            variant=variant,
            part_number=part_number,
            serial=serial,
        )
    typer.echo(identity_table(found).to_string(index=False) if found else "no mount")


@library_app.command()
def show(
    library: Where,
    campaign: Campaign = None,
    mount: MountName = None,
    variant: Variant = None,
    part_number: PartNumber = None,
    serial: Serial = None,
) -> None:
    """Show one mount: where it sits, and how far to believe each direction."""
    from deboom.mounts.library import open_library
    from deboom.study.runner import one_sentence_errors

    with one_sentence_errors(), open_library(library) as opened:
        identity = opened.find(
            campaign=campaign,
            mount=mount,
            variant=variant,
            part_number=part_number,
            serial=serial,
        )
        typer.echo(_described(opened.load(identity)))


@library_app.command("import")
def import_mounts(
    library: Where,
    file: Annotated[Path, typer.Argument(help="A JSON export of another library.")],
    replace: Annotated[
        bool, typer.Option("--replace", help="Exchange mounts that are there already.")
    ] = False,
) -> None:
    """Import the mounts of a JSON export; a library that is missing is made."""
    from deboom.files.library_export import read_library_json
    from deboom.mounts.library import open_library
    from deboom.study.runner import one_sentence_errors

    with one_sentence_errors():
        campaigns, mounts = read_library_json(file)
        with open_library(library, create=True) as opened:
            opened.add(campaigns, mounts, replace=replace)
    typer.echo(f"{len(mounts)} mounts imported")


@library_app.command()
def export(
    library: Where,
    file: Annotated[
        Path, typer.Argument(help="What to write; .xlsx, .json or .uff says in which format.")
    ],
    campaign: Campaign = None,
    mount: MountName = None,
    variant: Variant = None,
    part_number: PartNumber = None,
    serial: Serial = None,
) -> None:
    """Export mounts: spreadsheet (.xlsx), everything (.json), spectra (.uff)."""
    from deboom.errors import InputError
    from deboom.files.library_export import (
        write_library_json,
        write_library_uff,
        write_library_xlsx,
    )
    from deboom.mounts.library import open_library
    from deboom.study.runner import one_sentence_errors

    with one_sentence_errors(), open_library(library) as opened:
        kind = file.suffix.lower()
        if kind not in (".xlsx", ".json", ".uff", ".unv"):
            raise InputError(f"{file}: name a file that ends with .xlsx, .json or .uff")
        found = opened.identities(
            campaign=campaign,
            mount=mount,
            variant=variant,
            part_number=part_number,
            serial=serial,
        )
        if not found:
            raise InputError(f"{opened.name}: no mount fits; `deboom library list` shows them all")
        mounts = [opened.load(identity) for identity in found]
        names = {identity.campaign for identity in found}
        campaigns = [record for record in opened.campaigns() if record.name in names]
        left_out: tuple[str, ...] = ()
        if kind == ".xlsx":
            write_library_xlsx(file, campaigns, mounts)
        elif kind == ".json":
            write_library_json(file, campaigns, mounts)
        else:
            left_out = write_library_uff(file, mounts)
    for run in left_out:
        typer.echo(f"left out, a single line is no spectrum: {run}", err=True)
    typer.echo(file.as_posix())


@library_app.command()
def migrate(library: Where) -> None:
    """Bring an older library to the version of this deboom; all of it, or nothing."""
    from deboom.mounts.library import migrate_library
    from deboom.study.runner import one_sentence_errors

    with one_sentence_errors():
        before, after = migrate_library(library)
    if before == after:
        typer.echo(f"version {after} already, nothing to do")
    else:
        typer.echo(f"migrated from version {before} to {after}")


def characterise(
    campaign: Annotated[Path, typer.Argument(help="Folder with campaign.toml.")],
    library: Annotated[
        str, typer.Option(help="Where mounts go: an SQLite file, or a PostgreSQL URL.")
    ],
    mount_set: Annotated[
        list[str] | None, typer.Option(help="Only this mount set, such as M3; repeatable.")
    ] = None,
    gear: Annotated[
        list[int] | None, typer.Option(help="Only runs in this gear; repeatable. Default 5 6 7.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Of the error budget, from 1.")] = 1,
    replace: Annotated[
        bool, typer.Option("--replace", help="Exchange mounts that are there already.")
    ] = False,
    time_runs: Annotated[
        bool,
        typer.Option(
            "--time-runs",
            help="First add the order spectra of its runs over time to the campaign, as "
            "`deboom orders` does.",
        ),
    ] = False,
) -> None:
    """Characterise the mounts of a measurement campaign and keep them in a library."""
    from deboom.mounts.characterisation import CharacteriseOptions
    from deboom.study.characterisation_library import characterise_into_library, described
    from deboom.study.order_runs import track_untracked
    from deboom.study.progress import progress_bar
    from deboom.study.runner import one_sentence_errors

    with one_sentence_errors(), progress_bar("characterise") as progress:
        if time_runs:
            track_untracked(campaign, typer.echo)
        gears = tuple(gear) if gear else CharacteriseOptions().gears
        options = CharacteriseOptions(gears=gears, seed=seed)
        results = characterise_into_library(
            campaign, library, options, progress, mount_sets=mount_set or (), overwrite=replace
        )
    for result in results:
        typer.echo(described(result))
    typer.echo(f"{sum(len(one.mounts) for one in results)} mounts kept in {library}")


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
