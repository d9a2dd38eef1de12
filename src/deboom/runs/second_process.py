"""A second process of a run: it computes beside a search what needs nothing of it, and draws.

A task gives the same bytes wherever it is done: the second process has one thread of linear
algebra, as the first has during a run. Where there is one core only, or where the second process
does not bring a result, for whatever reason, the first does the task when its result is read.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable
from concurrent.futures import Future
from functools import partial
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import cloudpickle
from joblib import cpu_count

from deboom.explore.workers import process_pool
from deboom.report.report import Picture

if TYPE_CHECKING:
    from joblib.externals.loky import ProcessPoolExecutor

T = TypeVar("T")
Warned = list[Warning | str]

CORES = 2
"""Cores from which on a second process is worth its start."""


class Pending(Generic[T]):
    """A task whose result is read later.

    Parameters
    ----------
    task : callable
        What is done.
    future : Future or None
        Where the second process does it; None leaves it to the first.
    """

    def __init__(self, task: Callable[[], T], future: Future[tuple[T, Warned]] | None) -> None:
        self.task, self.future = task, future

    def result(self, here: Callable[[], T] | None = None) -> T:
        """Return the result, or raise the error of the task; its warnings are shown here.

        A task that fails in the second process is done here as well: a sound one then gives its
        result, and another one its warnings and its error.

        - `here`: does the same where the second process does not, such as with a bar of progress.
        """
        if self.future is not None and not self.future.cancel():
            try:
                value, warned = self.future.result()
            except Exception:
                pass
            else:
                for message in warned:
                    warnings.warn(message, stacklevel=2)
                return value
        return (here or self.task)()


class SecondProcess:
    """The second process; it starts with its first task, and ends with the run.

    Examples
    --------
    >>> with SecondProcess(cores=1) as second:
    ...     second.begin(lambda: 6 * 7).result()
    42
    """

    def __init__(self, cores: int | None = None) -> None:
        self.cores = cpu_count() if cores is None else cores
        self.pool: ProcessPoolExecutor | None = None
        self.pictures: dict[Picture, Pending[tuple[bytes, str]]] = {}

    def __enter__(self) -> SecondProcess:
        return self

    def __exit__(self, *_: object) -> None:
        if self.pool is not None:
            self.pool.shutdown(wait=True, kill_workers=True)

    def begin(self, task: Callable[[], T]) -> Pending[T]:
        """Begin a task beside this process; tasks are done in the order of their beginning."""
        if self.cores < CORES:
            return Pending(task, None)
        try:
            carried = cloudpickle.dumps(task)  # now: what it works on may change later
            if self.pool is None:
                self.pool = process_pool(1)
            return Pending(task, self.pool.submit(_done, carried))
        except Exception:  # what pickle does not take, no process to be had, or a dead one
            return Pending(task, None)

    def draw(self, pictures: Iterable[Picture]) -> None:
        """Begin to draw pictures; `drawn` waits for them."""
        for picture in pictures:
            if picture not in self.pictures and callable(picture.drawing):
                self.pictures[picture] = self.begin(partial(_drawn, picture))

    def drawn(self, pictures: Iterable[Picture]) -> None:
        """Draw the pictures that are not drawn yet: the second process from the first one on.

        This process takes the others, from the last one on. Nothing is begun where no second
        process runs: for a few pictures its start takes longer than they do.
        """
        if self.pool is None:
            return
        self.draw(pictures)
        for picture, pending in reversed(self.pictures.items()):
            picture.keep(*pending.result())
        self.pictures.clear()


def begun(second: SecondProcess | None, task: Callable[[], T]) -> Pending[T]:
    """Begin a task in the second process of a run; without one it is done when it is read."""
    return Pending(task, None) if second is None else second.begin(task)


def _drawn(picture: Picture) -> tuple[bytes, str]:
    return picture.png, picture.failure


def _done(carried: bytes) -> tuple[Any, Warned]:
    """Do a task in the second process; return its result with the warnings on the way."""
    task = cloudpickle.loads(carried)
    with warnings.catch_warnings(record=True) as shown:
        warnings.simplefilter("always")
        value = task()
    return value, [each.message for each in shown]
