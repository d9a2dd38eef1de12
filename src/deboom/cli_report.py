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
    interactive: Annotated[
        bool, typer.Option("--interactive", help="The page on which the front is explored.")
    ] = False,
    mount: Annotated[str | None, typer.Option(help="One part; by default all of them.")] = None,
    anonymous: Annotated[
        bool, typer.Option("--anonymous", help="Vehicles are letters; a name left is refused.")
    ] = False,
    design: Annotated[Pick, typer.Option(help="Of the front, that is wanted.")] = Pick.best_mean,
    box: Annotated[
        Path | None,
        typer.Option(help="Acceptance box, or the run of solution_box: for the specification."),
    ] = None,
    tolerances: Annotated[
        Path | None, typer.Option(help="Run of tolerance_allocation for RUN: likewise.")
    ] = None,
    sharing: Annotated[
        Path | None, typer.Option(help="Run of commonality, same platform: likewise.")
    ] = None,
    studies: Annotated[Path, typer.Option(help="Folder with the study scripts.")] = Path("studies"),
    out: Annotated[
        Path | None, typer.Option(help="Folder for the files; by default RUN, and RUN/supplier.")
    ] = None,
) -> None:
    """Write further pages from a finished run: for a mount supplier, or to explore its front.

    --supplier: for every mount and axis today's and the wanted stiffness, its tolerance, what it
    brings, and how sure that is; a page and a workbook. With --box, --tolerances and --sharing its
    specification sheet has acceptance intervals, allocated tolerances and shared part numbers; what
    is missing there is named with the study that gives it. --interactive: one page to brush designs
    in, pin two and read their stiffness. The model is built again from the run's options; edited
    files are refused.
    """
    from deboom.errors import InputError
    from deboom.study.runner import one_sentence_errors

    with one_sentence_errors():
        if not (supplier or interactive):
            raise InputError(
                f"{run / 'report.html'} is the page of the run itself; say --supplier for the one "
                "that a mount supplier reads, --interactive for the one to explore the front"
            )
        if interactive:
            if anonymous:
                raise InputError("--anonymous belongs to --supplier: no other page hides names")
            if mount and not supplier:
                raise InputError("--mount belongs to --supplier: the other page has all mounts")
            if (box or tolerances or sharing) and not supplier:
                raise InputError("--box, --tolerances and --sharing belong to --supplier")
            from deboom.study.interactive_front import write_interactive_page

            typer.echo(write_interactive_page(run, studies=studies, out=out).as_posix())
        if not supplier:
            return
        from deboom.study.specification_sources import SpecificationFiles
        from deboom.study.supplier_report import supplier_report

        for path in supplier_report(
            run,
            mount=mount,
            anonymous=anonymous,
            out=out,
            studies=studies,
            pick=design,
            pieces=SpecificationFiles(box, tolerances, sharing),
        ):
            typer.echo(path.as_posix())
