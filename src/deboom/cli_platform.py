"""The command line of your own platform: a folder to fill in, and what is still wrong with it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from deboom.files.function_files import FunctionFiles

new_app = typer.Typer(
    no_args_is_help=True, rich_markup_mode=None, help="Write a folder to fill in: platform."
)


@new_app.callback()
def _new() -> None:
    # with a callback, typer keeps the name of a single command
    pass


@new_app.command("platform")
def new_platform(
    folder: Annotated[Path, typer.Argument(metavar="MY_PLATFORM", help="A folder to be made.")],
    mount: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="One per mount; NAME=left,right for pieces of one part number. Repeatable.",
        ),
    ] = None,
    vehicle: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="One per vehicle. Repeatable.")
    ] = None,
    group: Annotated[str, typer.Option(help="Of these vehicles.")] = "cars",
    load_case: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="One per run. Repeatable.")
    ] = None,
    files: Annotated[
        FunctionFiles, typer.Option(help="Format of your transfer functions and spectra.")
    ] = FunctionFiles.uff,
) -> None:
    """Write the folder of a new platform, to fill in.

    platform.toml with comments, the tables of mounts and channels (xlsx) with their columns and
    units, and a README that names each file and what it must hold. `deboom check MY_PLATFORM` lists
    what is still to be filled in.

    Try: deboom new platform my_platform --mount EnM --mount Du=left,right --vehicle car-1
    """
    from deboom.files.new_platform import new_platform as write
    from deboom.study.runner import one_sentence_errors

    with one_sentence_errors():
        write(
            folder,
            mounts=mount or ("engine", "gearbox", "strut"),
            vehicles=vehicle or ("car-1",),
            group=group,
            load_cases=load_case or ("run-1",),
            files=files,
        )
    typer.echo(folder.as_posix())


def check(
    folder: Annotated[
        Path, typer.Argument(metavar="MY_PLATFORM", help="Folder with platform.toml.")
    ],
) -> None:
    """List everything missing or wrong in a platform folder, or what it holds.

    Each fault names its file, the item and the remedy; exit code 2. Without a fault: mounts,
    vehicles, lines, load cases and band; exit code 0.
    """
    from deboom.study.platform_check import check_platform

    found = check_platform(folder)
    for number, fault in enumerate(found.faults, 1):
        typer.echo(f"{number:3}  {fault}", err=True)
    if found.faults:
        count = len(found.faults)
        waiting = f"; not looked at yet: {', '.join(found.waiting)}" if found.waiting else ""
        what = "fault" if count == 1 else "faults"
        typer.echo(f"deboom: {count} {what} in {folder}{waiting}", err=True)
        raise typer.Exit(2)
    typer.echo(found.summary)
