"""The pictures of `deboom.plot` as PNG bytes: what a report keeps of them."""

from deboom import plot
from deboom.plot.style import as_png


def __getattr__(name):
    """Return a function of `deboom.plot` that gives PNG bytes, or one of its panels."""
    thing = getattr(plot, name)
    if isinstance(thing, type):
        return thing
    return lambda *arguments, **options: as_png(thing(*arguments, **options))
