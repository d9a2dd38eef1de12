"""Work of a command: how it ends, its progress, and tasks in several processes."""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

import typer
from tqdm import tqdm

from deboom.common import Progress
from deboom.errors import DataWarning, IncompleteReport, InputError

LOG_LINES = 4
MINUTE, HOUR = 60.0, 3600.0  # [s]


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


_Task = TypeVar("_Task")
_Result = TypeVar("_Result")


@contextmanager
def progress_bar(title: str) -> Iterator[Progress]:
    """Show progress under a title on standard error.

    - `title`: what is being done.
    - returns ``progress(done, total, text)``, which says ``title: text, 12 s left``. A text that
      does not count itself, such as ``generation 8 of 30``, is counted: ``3 of 8, text``. On a
      terminal one line is written anew; elsewhere there are about four lines in all, so that logs
      stay readable.
    """
    line = tqdm(desc=title, disable=None, file=sys.stderr, bar_format="{desc}", leave=True)
    begun, logged, before = time.monotonic(), 0, (0, 0)

    def progress(done: int, total: int, text: str) -> None:
        nonlocal begun, logged, before
        count = f"{done} of {total}"
        if total != before[1] or done < before[0]:  # another round of steps
            begun, logged = begun if before == (0, 0) else time.monotonic(), 0
        before = (done, total)
        parts = [] if count in text else [count]
        parts += [text] if text else []
        if 0 < done < total:
            parts.append(_left((time.monotonic() - begun) / done * (total - done)))
        sentence = f"{title}: {', '.join(parts)}"
        if not line.disable:
            line.set_description_str(sentence)
            return
        part = done * LOG_LINES // max(total, 1)
        if part > logged:
            logged = part
            print(sentence, file=sys.stderr, flush=True)

    try:
        yield progress
    finally:
        line.close()


def _left(seconds: float) -> str:
    """Say what time is left, to a figure that can be believed."""
    if seconds < 2 * MINUTE:
        return f"{seconds:.0f} s left"
    if seconds < 2 * HOUR:
        return f"{seconds / MINUTE:.0f} min left"
    return f"{seconds / HOUR:.1f} h left"


def counted(
    progress: Progress, total: int, first: int = 0, prefix: str = ""
) -> Callable[[str], None]:
    """Turn named steps into counted ones.

    - `total`: steps in all.
    - `first`: done before.
    - `prefix`: before every text.
    - returns to be called at the beginning of each step.
    """
    done = first

    def step(text: str) -> None:
        nonlocal done
        progress(min(done, total), total, prefix + text)
        done += 1

    return step
