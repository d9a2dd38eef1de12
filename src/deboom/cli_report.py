"""The command line of reports for others than the engineer who ran the study."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from deboom.study.supplier_pick import Pick


def report(
    run: Annotated[Path, typer.Argument(help="Folder of a finished front study.")],
    supplier: Annotated[
        bool, typer.Option("--supplier", help="The page that a mount supplier reads.")
    ] = False,
    mount: Annotated[str | None, typer.Option(help="One part; by default all of them.")] = None,
    anonymous: Annotated[
        bool, typer.Option("--anonymous", help="Vehicles are letters; a name left is refused.")
    ] = False,
    design: Annotated[Pick, typer.Option(help="Of the front, that is wanted.")] = Pick.best_mean,
    studies: Annotated[Path, typer.Option(help="Folder with the study scripts.")] = Path("studies"),
    out: Annotated[
        Path | None, typer.Option(help="Folder for page and workbook; by default RUN/supplier.")
    ] = None,
) -> None:
    """Write a page and a workbook for a mount supplier from a finished run.

    For every mount and axis: today's and the wanted stiffness, its tolerance, what it brings, and
    how sure that is. The model is built again from the run's options; edited files are refused.
    """
    from deboom.errors import InputError
    from deboom.study.runner import one_sentence_errors
    from deboom.study.supplier_report import supplier_report

    with one_sentence_errors():
        if not supplier:
            raise InputError(
                f"{run / 'report.html'} is the page of the run itself; say --supplier for the one "
                "that a mount supplier reads"
            )
        for path in supplier_report(
            run,
            mount=mount,
            anonymous=anonymous,
            out=out,
            studies=studies,
            pick=design,
        ):
            typer.echo(path.as_posix())
