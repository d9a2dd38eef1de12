"""From an empty figure in our style to PNG bytes, without pyplot and without global state."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.report.style import DPI, FIGURE_STYLE

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.patheffects import AbstractPathEffect

RealArray = npt.NDArray[np.float64]

PALETTE = 256
"""Colours of a picture: as many as one byte tells apart."""


@contextmanager
def styled_figure(width: float, height: float) -> Iterator[Figure]:
    """Open an empty figure of ``width`` by ``height`` [in]; finish it with `png` inside."""
    from matplotlib import style
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with style.context(dict(FIGURE_STYLE), after_reset=True):
        figure = Figure(figsize=(width, height), layout="constrained")
        FigureCanvasAgg(figure)
        yield figure


def png(figure: Figure) -> bytes:
    """Bytes of the figure as PNG with a palette: a third of the size, colours as before to the eye.

    Without the writer's name and version; no dithering, which would make flat colours grainy.
    """
    from PIL import Image

    drawn, flat = io.BytesIO(), io.BytesIO()
    figure.savefig(drawn, format="png", dpi=DPI, metadata={"Software": None})
    with Image.open(drawn) as picture:
        picture.convert("RGB").quantize(
            PALETTE, Image.Quantize.MAXCOVERAGE, kmeans=3, dither=Image.Dither.NONE
        ).save(flat, format="PNG", optimize=True, dpi=(DPI, DPI))
    return flat.getvalue()


def halo(width: float) -> list[AbstractPathEffect]:
    """White outline of ``width`` [pt] that keeps text and thin lines readable over other marks."""
    from matplotlib.patheffects import withStroke

    return [withStroke(linewidth=width, foreground="white")]


def finite(figure_name: str, arrays: Mapping[str, npt.ArrayLike]) -> dict[str, RealArray]:
    """Return the arrays as floats.

    Raises
    ------
    InputError
        Arrays of different lengths, an empty one, or a value that is not finite: a plot would drop
        it silently.
    """
    checked = {name: np.asarray(values, dtype=float) for name, values in arrays.items()}
    lengths = {name: len(values) for name, values in checked.items()}
    if len(set(lengths.values())) > 1:
        raise InputError(f"figure {figure_name}: arrays of different lengths {lengths}")
    for name, values in checked.items():
        if values.size == 0:
            raise InputError(f"figure {figure_name}: {name} is empty, there is nothing to draw")
        if not np.isfinite(values).all():
            where = [int(place) for place in np.argwhere(~np.isfinite(values))[0]]
            raise InputError(f"figure {figure_name}: {name} is not finite at index {where}")
    return checked
