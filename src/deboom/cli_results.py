"""The command line of results: what there is, one run in full, and fronts compared."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

STUDIES = Path("studies")


def list_(
    results: Annotated[Path, typer.Argument(help="Folder with results.")] = Path("results"),
    html: Annotated[
        bool, typer.Option("--html", help="Write index.html there, with a link to every report.")
    ] = False,
) -> None:
    """List finished, running and unfinished runs: question, seed, date and headline numbers.

    An unfinished run was interrupted: `deboom run STUDY --resume RUN` goes on with it.
    """
    from deboom.study.overview import list_lines, refresh_overview
    from deboom.study.runner import one_sentence_errors

    with one_sentence_errors():
        for line in list_lines(results):
            typer.echo(line)
        if html:
            page = refresh_overview(results)
            if page is None:
                raise typer.Exit(2)
            typer.echo(page.as_posix())


def show(
    run: Annotated[Path, typer.Argument(help="A run's folder, such as `deboom list` prints.")],
) -> None:
    """Show one run: question, options, headline numbers, versions, files, and if any was edited."""
    from deboom.files.run_list import read_run
    from deboom.study.overview import show_lines
    from deboom.study.runner import one_sentence_errors

    with one_sentence_errors():
        for line in show_lines(read_run(run)):
            typer.echo(line)


def compare(
    runs: Annotated[list[Path], typer.Argument(help="Folders of front studies, two or more.")],
    seed: Annotated[int, typer.Option(help="Of the common draws, from 1.")] = 1,
    samples: Annotated[
        int, typer.Option(help="Common draws, a power of two from 1024; no search has seen them.")
    ] = 2048,
    studies: Annotated[Path, typer.Option(help="Folder with the study scripts.")] = STUDIES,
    out: Annotated[Path, typer.Option(help="Folder that gets compare/<run>/.")] = Path("results"),
) -> None:
    """Compare the fronts of runs: is one really better, or is it noise?

    All fronts are judged by the model of the first run with the same draws. Runs that differ in
    their seed only show how far chance goes; three seeds or more of each configuration make the
    verdict sharp. Refused: runs of different platforms, and run folders with edited files.
    """
    from deboom.study.compare_command import compare as compare_runs
    from deboom.study.runner import one_sentence_errors

    with one_sentence_errors():
        folder, verdicts = compare_runs(runs, out=out, studies=studies, samples=samples, seed=seed)
        for verdict in verdicts:
            typer.echo(verdict)
        typer.echo(folder.as_posix())
