"""Progress of a long computation, told on a terminal, in a notebook or in a log."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from tqdm import tqdm

Progress = Callable[[int, int, str], None]
"""Called after each step with its number, the number of steps, and a line of text."""

LOG_LINES = 4
MINUTE, HOUR = 60.0, 3600.0  # [s]


@contextmanager
def progress_bar(title: str) -> Iterator[Progress]:
    """Show progress under a title on standard error.

    - `title`: what is being done.
    - returns ``progress(done, total, text)``, which says ``title: text, 12 s left``. A text that
      does not count itself, such as ``generation 8 of 30``, is counted: ``3 of 8, text``. On a
      terminal and in a notebook one line is written anew; elsewhere there are about four lines in
      all, so that logs stay readable.
    """
    anew = sys.stderr.isatty() or _in_a_notebook()
    line = tqdm(desc=title, disable=not anew, file=sys.stderr, bar_format="{desc}", leave=True)
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


@contextmanager
def progress_shown(progress: Progress | bool | None, title: str) -> Iterator[Progress | None]:
    """Return the progress that a caller gave, or of True that of `progress_bar`."""
    if progress is True:
        with progress_bar(title) as bar:
            yield bar
    else:
        yield progress or None


def _in_a_notebook() -> bool:
    """Whether standard error is the output of a cell, where a line can be written anew."""
    return type(sys.stderr).__module__.startswith("ipykernel.")


def announce(title: str, step: Callable[[], object], steps: float) -> None:
    """Say on standard error how long a computation takes before it begins.

    - `title`: what will be done.
    - `step`: what it does `steps` times, or as much in all; the second of two is timed, since the
      first may compile.
    """
    step()
    begun = time.perf_counter()
    step()
    seconds = steps * (time.perf_counter() - begun)
    print(f"{title}: takes about {_in_words(max(seconds, 1.0))}", file=sys.stderr, flush=True)


def _left(seconds: float) -> str:
    """Say what time is left."""
    return f"{_in_words(seconds)} left"


def _in_words(seconds: float) -> str:
    """Return a time to a figure that can be believed."""
    if seconds < 2 * MINUTE:
        return f"{seconds:.0f} s"
    if seconds < 2 * HOUR:
        return f"{seconds / MINUTE:.0f} min"
    return f"{seconds / HOUR:.1f} h"


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
