"""How a command ends: with the sentence of an error, and an exit code."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import typer

from deboom.errors import DataWarning, IncompleteReport, InputError


@contextmanager
def errors_as_sentences() -> Iterator[None]:
    """Turn what ends a command into its sentence on standard error and an exit code.

    Bad input is 2, a page that lacks a figure 3, Ctrl-C 130. Warnings about the data are sentences,
    too.
    """
    try:
        with _one_sentence_warnings():
            yield
    except InputError as error:
        typer.echo(f"deboom: {error}", err=True)
        raise typer.Exit(2) from error
    except IncompleteReport as error:
        typer.echo(error.folder.as_posix())
        raise typer.Exit(3) from None
    except KeyboardInterrupt as stop:
        typer.echo(f"deboom: {stop or 'stopped'}", err=True)
        raise typer.Exit(130) from None


@contextmanager
def _one_sentence_warnings() -> Iterator[None]:
    """Print a `DataWarning` as its sentence, and leave other warnings as they are."""
    layout = warnings.formatwarning

    def formatted(message: Warning | str, category: type[Warning], *place: Any, **line: Any) -> str:
        if issubclass(category, DataWarning):
            return f"deboom: warning: {message}\n"
        return layout(message, category, *place, **line)

    warnings.formatwarning = formatted
    try:
        yield
    finally:
        warnings.formatwarning = layout
