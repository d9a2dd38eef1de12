"""Every option of every command and study, with its kind, default and help, pinned as text."""

from operator import eq
from pathlib import Path

import typer

from deboom.cli import app
from deboom.runs.runner import study_command, study_files
from pinned_pages import hold_lines


def said(command, path, before):
    """Yield what `--help` says of a command; options that one `before` it has alike by name."""
    command = command.loaded() if hasattr(command, "loaded") else command
    answers = {True: "alone it helps"}.get(getattr(command, "no_args_is_help", False), "")
    yield f"== {path} {answers}"
    yield from filter(None, map(str.strip, (command.help or "").splitlines()))
    alike = []
    for option in command.params:
        names = "/".join([*option.opts, *option.secondary_opts])
        attributes = (
            "nargs",
            "min",
            "max",
            "required",
            "multiple",
            "is_flag",
            "is_eager",
            "hidden",
        )
        marks = (f"{mark} {value}" for mark in attributes if (value := getattr(option, mark, None)))
        default = option.default.name if isinstance(option.default, Path) else option.default
        text = getattr(option, "help", None) or ""
        declared = f"{names}: {' '.join(marks)}, by default {default!r}. {text}"
        if declared in before:
            alike.append(names)
        else:
            before.add(declared)
            yield declared
    yield from [f"as before: {' '.join(alike)}"] if alike else []
    for name, inner in sorted(getattr(command, "commands", {}).items()):
        yield from said(inner, f"{path} {name}", before)


def test_options_are_those_that_help_declares():
    before = set()
    lines = [*said(typer.main.get_command(app), "deboom", before)]
    for study in study_files():
        lines += said(typer.main.get_command(study_command(study)), study.stem, before)
    hold_lines([" ".join(line.split()) for line in lines], "options", eq)
