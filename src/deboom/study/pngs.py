"""The pictures of `deboom.plot` as PNG, for studies and commands that write no `Report` yet."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from deboom import plot
from deboom.plot.style import as_png


def __getattr__(name: str) -> Callable[..., bytes]:
    """Return a function of `deboom.plot` that gives PNG bytes, or one of its panels."""
    thing: Any = getattr(plot, name)
    if isinstance(thing, type):
        return thing
    return lambda *arguments, **options: as_png(thing(*arguments, **options))
