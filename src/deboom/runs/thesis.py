"""Run what the thesis ran, and write it beside the thesis."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import typer
from pydantic import TypeAdapter

from deboom.files.disk import replace_text
from deboom.files.run_folder import read_run
from deboom.pages.thesis import read_thesis, thesis_markdown, thesis_report
from deboom.runs.runner import Study, load_study, run_once, study_command

FOLDER, MARKDOWN = "thesis", "thesis.md"


def rerun_thesis(out: Path) -> Path:
    """Run every command of the thesis once, write the page and return its path.

    - `out`: folder of all results. A finished run of the same options, files and code is taken as
      it is, one that was interrupted goes on.
    """
    thesis, runs = read_thesis(), {}
    for number, (name, command) in enumerate(thesis.runs.items(), 1):
        typer.echo(f"{number} of {len(thesis.runs)}: {command}", err=True)
        runs[name] = read_run(run_once(*typed(command), out))
    folder = out / FOLDER
    page = thesis_report(thesis, runs).write(folder)
    replace_text(folder / MARKDOWN, thesis_markdown(thesis, runs))
    return page


def typed(command: str) -> tuple[Study, Mapping[str, Any]]:
    """Return the study of a command, and the options that are typed with it.

    - raises UsageError: an option that the study does not have, or a value that it does not take.
    """
    _, *words = shlex.split(command)
    name, *options = words[1:] if words[0] == "run" else words
    study = load_study(name)
    context: Any = typer.main.get_command(study_command(name)).make_context(name, options)
    return study, {
        name: TypeAdapter(study.parameters[name].annotation).validate_python(value)
        for name, value in context.params.items()
        if context.get_parameter_source(name).name == "COMMANDLINE"
    }
