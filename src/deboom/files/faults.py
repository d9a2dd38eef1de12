"""One reading rule for two readers: the first fault stops a study, a check wants them all.

A reader that takes a `Note` tells it every fault and goes on without the item. The default,
`refuse`, raises; a list's ``append`` collects.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from deboom.errors import InputError

Note = Callable[[InputError], None]


def refuse(error: InputError) -> None:
    """Stop at the first fault.

    Raises
    ------
    InputError
        Always.
    """
    raise error


@contextmanager
def noting(note: Note) -> Iterator[None]:
    """Tell a fault of the block to `note`; the block ends there."""
    try:
        yield
    except InputError as error:
        note(error)
