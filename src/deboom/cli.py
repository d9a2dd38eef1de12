"""The command line: thin, and quick to start, because every command imports only what it needs."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

import deboom
from deboom.cli_bench import bench_app
from deboom.cli_measurements import characterise, identify, library_app, orders, unbalance
from deboom.cli_results import (
    accept,
    check,
    compare,
    driven,
    list_,
    listen,
    new,
    report,
    serve,
    show,
)


class Commands(TyperGroup):
    """Commands that end bad input with one sentence and exit code 2."""

    def invoke(self, ctx: Any) -> Any:
        """Carry a command out."""
        from deboom.runs.progress import one_sentence_errors

        with one_sentence_errors():
            return super().invoke(ctx)


app = typer.Typer(
    cls=Commands,
    add_completion=False,
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    help="Takes the booming noise (15-140 Hz) out of vehicles.",
    epilog=(
        "Start with:  deboom studies   then   deboom run studies/u06_robust_front.py --help.  "
        "Bad input ends with one sentence and exit code 2."
    ),
)
app.add_typer(bench_app, name="bench")
app.add_typer(library_app, name="library")
app.command()(new)
app.command()(check)
app.command()(characterise)
app.command()(orders)
app.command("list")(list_)
app.command()(show)
app.command()(compare)
app.command()(report)
app.command()(listen)
app.command()(serve)
app.command()(driven)
app.command()(identify)
app.command()(unbalance)
app.command()(accept)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"deboom {deboom.__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[  # noqa: ARG001
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version and stop."
        ),
    ] = False,
) -> None:
    os.environ.setdefault("MPLBACKEND", "agg")  # figures become files and need no window
    # worker processes import nothing from the folder that the user stands in
    os.environ["PYTHONSAFEPATH"] = "1"


@app.command(
    context_settings={
        "allow_extra_args": True,
        "ignore_unknown_options": True,
        "help_option_names": [],
    },
    options_metavar="",
)
def run(
    context: typer.Context,
    study: Annotated[
        str | None, typer.Argument(help="A study's name or file, such as u06_robust_front.")
    ] = None,
) -> None:
    """Run a study and print the folder of its results as the last line.

    Each study brings its own options: `deboom run STUDY --help` explains them. Common to all are
    --out (where results go, default `results`), --seed (an integer from 1) and --resume RUN (go on
    with an interrupted run; `deboom list` shows it).
    """
    if study is None or study in ("--help", "-h"):
        typer.echo(context.get_help())
        raise typer.Exit
    from deboom.runs.runner import study_command

    command = study_command(study)
    command(args=list(context.args), prog_name=f"deboom run {study}")


@app.command()
def studies(
    folder: Annotated[
        Path | None,
        typer.Option(help="Folder with the studies; default: studies here, or deboom's."),
    ] = None,
) -> None:
    """List the studies with their questions."""
    from deboom.runs.runner import question_of, study_files

    for path in study_files(folder):
        typer.echo(f"{path.as_posix()}\n    {question_of(path)}")
