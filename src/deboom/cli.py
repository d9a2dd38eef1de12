"""The command line: thin, and quick to start, because every command imports only what it needs."""

from __future__ import annotations

import ast
import gc
import os
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

import deboom
from deboom.cli_bench import bench_app, example
from deboom.cli_measurements import characterise, library_app, orders
from deboom.cli_results import (
    check,
    evaluate,
    list_,
    listen,
    new,
    report,
    serve,
    show,
    thesis,
)
from deboom.files.shipped_studies import shipped_studies


class StudyCommand(TyperCommand):
    """A study of paths that the user names, as a command: its options are read when it is called.

    What lists commands needs their first sentence only, and imports no study.
    """

    @property
    def path(self) -> Path:
        """File of the study."""
        return shipped_studies() / f"{self.name}.py"

    def loaded(self) -> Any:
        """Return the command with its options."""
        from deboom.runs.runner import study_command

        return typer.main.get_command(study_command(self.path))

    def make_context(self, *arguments: Any, **extra: Any) -> Any:
        """Read a command line."""
        return self.loaded().make_context(*arguments, **extra)


COMMANDS = {
    "Start": ("example", "new", "check", "look"),
    "Studies": ("studies", "run", "evaluate", "thesis"),
    "Measurements": ("characterise", "orders", "identify", "unbalance"),
    "Results": ("list", "show", "serve", "report", "compare", "listen", "driven"),
    "Mounts": ("library", "accept"),
    "Virtual test bench": ("bench",),
}
"""Commands by what a user comes with; each stands in one group."""


class Commands(TyperGroup):
    """Commands that end bad input with one sentence and exit code 2; the help has them by group."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write each group with the whole first sentence of its commands."""
        for title, names in COMMANDS.items():
            rows = [(name, self._first_sentence(ctx, name)) for name in names]
            with formatter.section(title):
                formatter.write_dl(rows, col_spacing=2)

    def _first_sentence(self, ctx: Any, name: str) -> str:
        command = self.get_command(ctx, name)
        text = (command.help if command else "") or ""
        return " ".join(text.partition("\n\n")[0].split())

    def invoke(self, ctx: Any) -> Any:
        """Carry a command out."""
        from deboom.runs.sentences import errors_as_sentences

        with errors_as_sentences():
            return super().invoke(ctx)


app = typer.Typer(
    cls=Commands,
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    help="Takes the booming noise (15-140 Hz) out of vehicles.",
    epilog=(
        "Try:  deboom run front   (a fleet of cars, in a minute)   or   deboom new platform "
        "mine   (a folder for measurements of your own).  `deboom COMMAND --help` explains each. "
        "Bad input ends with one sentence and exit code 2."
    ),
)


def add_study(name: str) -> None:
    """Add the command of a study; its help begins with the study's docstring."""
    path = shipped_studies() / f"{name}.py"
    help_ = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8")))
    app.command(name, cls=StudyCommand, help=help_)(lambda: None)


app.add_typer(bench_app, name="bench")
app.add_typer(library_app, name="library")
app.command()(example)
app.command()(new)
app.command()(check)
add_study("look")
app.command()(evaluate)
app.command()(thesis)
app.command()(characterise)
app.command()(orders)
app.command("list")(list_)
app.command()(show)
add_study("compare")
app.command()(report)
app.command()(listen)
app.command()(serve)
add_study("driven")
add_study("identify")
add_study("unbalance")
add_study("accept")


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
    # figures and tables are many objects that stay, and each round of the collector passes them
    gc.set_threshold(50_000, 20, 50)


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
        str | None, typer.Argument(help="Name or file of a study, such as front.")
    ] = None,
) -> None:
    """Run a study and print the folder of its results as the last line.

    Each study has its own options: `deboom run STUDY --help` explains them. All studies have --out
    (folder of results, default `results`), --seed (an integer from 1) and --resume RUN (continue an
    interrupted run; `deboom list` shows these runs).
    """
    if study is None or study in ("--help", "-h"):
        typer.echo(context.get_help())
        raise typer.Exit
    from deboom.runs.runner import study_command

    every_option = "--help-all" in context.args
    command = study_command(study, every_option=every_option)
    arguments = ["--help" if word == "--help-all" else word for word in context.args]
    command(args=arguments, prog_name=f"deboom run {study}")


@app.command()
def studies(
    folder: Annotated[
        Path | None,
        typer.Option(
            help="Folder with studies; default: ./studies, or else the studies of deboom."
        ),
    ] = None,
) -> None:
    """List the studies with their questions."""
    from deboom.runs.runner import question_of, study_files

    for path in study_files(folder):
        name = path.as_posix() if folder else path.stem
        typer.echo(f"{name}\n    {question_of(path)}")
