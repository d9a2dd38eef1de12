"""Colours, fonts and sizes of every figure, and the way from a figure to PNG bytes."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from decimal import ROUND_FLOOR, Decimal
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError

VEHICLE_PALETTE = ("#0072B2", "#D55E00", "#009E73", "#882255", "#E69F00", "#56B4E9")
MOUNT_PALETTE = ("#332288", "#CC6677", "#999933", "#44AA99", "#882255", "#88CCEE")

INK = "#1F2933"
MUTED = "#5F6B7A"
TRACK = "#E3E7EC"
GRID = "#DFE3E8"
ACCENT = "#0B4F7D"

FULL_WIDTH = 7.2
"""Width of a figure over the whole column [in]."""
DPI = 200

FIGURE_STYLE: Mapping[str, str | float | bool] = {
    "font.family": "DejaVu Sans",
    "font.size": 8.5,
    "text.color": INK,
    "text.parse_math": False,  # a name may have a dollar sign
    "axes.edgecolor": MUTED,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.7,
    "axes.titlesize": 9.0,
    "axes.labelsize": 8.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.grid": True,
    "grid.color": GRID,
    "grid.linewidth": 0.7,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "legend.frameon": False,
    "legend.fontsize": 8.0,
    "lines.solid_capstyle": "round",
    "hatch.linewidth": 0.5,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
}
"""Settings over the plotting library's own defaults; a reader's settings never leak in."""

_SHADES = (0.0, -0.40, 0.35)


def vehicle_colours(names: Sequence[str]) -> dict[str, str]:
    """Give each vehicle its colour by its place in the platform's list.

    - `names`: all vehicles of the platform in the platform's order; a study of a few of them passes
      the whole list too, so that a vehicle keeps its colour in every figure.
    - returns ``#RRGGBB`` by vehicle. After the palette's six come darker, then lighter ones; from
      the nineteenth on they repeat.
    - raises InputError: duplicated names.
    """
    return _colours(names, VEHICLE_PALETTE, "vehicle")


def mount_colours(names: Sequence[str]) -> dict[str, str]:
    """Give each mount its colour by its place in the platform's list; see `vehicle_colours`."""
    return _colours(names, MOUNT_PALETTE, "mount")


def mount_of(variable: str) -> str:
    """Name of the mount that a design variable ``<mount> <axis>`` belongs to."""
    return variable.rpartition(" ")[0] or variable


def signed(value: float, decimals: int) -> str:
    """Write a change with its sign, such as ``−3.1`` or ``+0.2``; a rounded zero has none."""
    text = f"{value:+.{decimals}f}"
    return f"{0:.{decimals}f}" if float(text) == 0.0 else text.replace("-", "−")


def at_least(value: float, decimals: int) -> str:
    """Write a number that “or more” follows: rounded down, so that the sentence is true."""
    last_place = Decimal(1).scaleb(-decimals)
    return str(Decimal(str(float(value))).quantize(last_place, ROUND_FLOOR)).replace("-", "−")


def _colours(names: Sequence[str], palette: tuple[str, ...], what: str) -> dict[str, str]:
    doubled = sorted({name for name in names if list(names).count(name) > 1})
    if doubled:
        raise InputError(f"duplicated {what} {doubled}: every {what} needs a name of its own")
    return {
        name: _shade(palette[place % len(palette)], _SHADES[place // len(palette) % len(_SHADES)])
        for place, name in enumerate(names)
    }


def _shade(colour: str, amount: float) -> str:
    """Mix with white (amount > 0) or black (amount < 0)."""
    target = 255 if amount > 0 else 0
    channels = (int(colour[place : place + 2], 16) for place in (1, 3, 5))
    mixed = (round(channel + abs(amount) * (target - channel)) for channel in channels)
    return "#" + "".join(f"{channel:02X}" for channel in mixed)


if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.patheffects import AbstractPathEffect
    from PIL.Image import Image

    Drawing = Axes | Figure | bytes

RealArray = npt.NDArray[np.float64]

PALETTE = 256
"""Colours of a picture: as many as one byte tells apart."""
_ROUNDS = 4
_UNLIKE = 0xF8F8F8  # bits of a colour in which it differs from others to begin with


@contextmanager
def styled_figure(width: float, height: float) -> Iterator[Figure]:
    """Open an empty figure of ``width`` by ``height`` [in] in our style, for a grid of panels."""
    from matplotlib import pyplot as plt
    from matplotlib import style

    with style.context(dict(FIGURE_STYLE), after_reset=True):
        yield plt.figure(figsize=(width, height), layout="constrained")


@contextmanager
def panel_grid(
    name: str,
    count: int,
    columns: int,
    margin: float,
    row_height: float,
    share_x: bool | Literal["col"] = False,
    share_y: bool | Literal["col"] = False,
    width: float = FULL_WIDTH,
) -> Iterator[tuple[Figure, list[Axes]]]:
    """Open a figure of `count` panels in rows; sizes in inches; InputError without one."""
    if not count:
        raise InputError(f"figure {name}: there is no panel to draw")
    rows = -(-count // columns)
    with styled_figure(width, margin + rows * row_height) as figure:
        grid = figure.subplots(rows, columns, squeeze=False, sharex=share_x, sharey=share_y)
        for axes in grid.ravel()[count:]:
            axes.set_axis_off()
        yield figure, list(grid.ravel()[:count])


@contextmanager
def canvas(ax: Axes | None, width: float, height: float) -> Iterator[Axes]:
    """Give the axes to draw on in our style: the caller's, or those of a figure of this size."""
    from matplotlib import style

    if ax is None:
        with styled_figure(width, height) as figure:
            yield figure.add_subplot()
    else:
        with style.context(dict(FIGURE_STYLE), after_reset=True):
            yield ax


def place_legend(axes: Axes, ax: Axes | None, *, loc: str, ncols: int = 1, **options: Any) -> None:
    """Put the legend outside of the axes in a figure of our own, else inside of the caller's.

    Names too long for `ncols` columns beside each other get fewer, so that none leaves the figure.
    """
    if ax is not None:
        axes.legend(ncols=ncols, **options)
        return
    figure = figure_of(axes)
    place: Any = loc
    legend = figure.legend(loc=place, ncols=ncols, **options)
    if ncols > 1 and legend.get_window_extent().width > figure.bbox.width:
        legend.remove()
        place_legend(axes, ax, loc=loc, ncols=ncols - 1, **options)


def figure_of(axes: Axes) -> Figure:
    """Return the figure that axes belong to."""
    figure = axes.get_figure(root=True)
    assert figure is not None
    return figure


def close(figure: Figure) -> None:
    """Let go of a figure that is drawn."""
    from matplotlib import pyplot as plt

    plt.close(figure)


def as_png(drawing: Drawing) -> bytes:
    """Return the PNG of a picture and close it; bytes are a PNG already.

    The same picture gives the same bytes. The PNG has a palette, a third of the size with colours
    as before to the eye, and neither the writer's name nor its version.
    """
    if isinstance(drawing, bytes):
        return drawing
    from matplotlib import style
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from PIL import Image

    figure = drawing if isinstance(drawing, Figure) else figure_of(drawing)
    flat = io.BytesIO()
    with style.context(dict(FIGURE_STYLE), after_reset=True):
        figure.set_dpi(DPI)
        canvas = FigureCanvasAgg(figure)
        # once: savefig lays a figure out while it draws all of it into nothing
        if (engine := figure.get_layout_engine()) is not None:
            engine.execute(figure)
            figure.set_layout_engine("none")
        canvas.draw()
        pixels = np.ascontiguousarray(np.asarray(canvas.buffer_rgba())[..., :3])
    close(figure)
    _with_palette(Image.fromarray(pixels)).save(flat, format="PNG", dpi=(DPI, DPI))
    return flat.getvalue()


def _with_palette(picture: Image) -> Image:
    """Give a picture the palette that its colours are nearest to, by k-means.

    Pillow's own k-means takes minutes for what has some ten thousand colours: it goes through all
    pixels until none changes. The colours are fewer, and a few rounds settle them to the eye.
    """
    import pandas as pd
    from PIL import Image
    from scipy.spatial import cKDTree

    four_bytes = np.frombuffer(picture.tobytes("raw", "BGRX"), dtype="<u4")
    shown, colours = pd.factorize(four_bytes)
    count = np.bincount(shown)
    strip = np.stack([colours >> 16 & 255, colours >> 8 & 255, colours & 255], axis=1)
    # of each colour once, not of each pixel, and of colours nearly alike one: the search for those
    # far apart takes long over many; no dithering: it would make flat colours grainy
    unlike = np.unique(colours & _UNLIKE, return_index=True)[1]
    begin = strip if len(unlike) < PALETTE else strip[unlike]
    flat = Image.fromarray(begin.astype(np.uint8)[np.newaxis]).quantize(
        PALETTE, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE
    )
    centres, seen = np.array(flat.getpalette(), dtype=float).reshape(-1, 3), strip.astype(float)
    for _ in range(_ROUNDS):
        nearest = cKDTree(centres).query(seen)[1]
        weight = np.bincount(nearest, count, len(centres))
        sums = [np.bincount(nearest, count * part, len(centres)) for part in seen.T]
        near = weight > 0
        centres[near] = np.transpose(sums)[near] / weight[near, np.newaxis]
    centres = np.round(centres)
    number = np.asarray(cKDTree(centres).query(seen)[1], dtype=np.uint8)
    drawn = Image.frombytes("P", picture.size, number[shown].tobytes())
    drawn.putpalette(centres.astype(np.uint8).tobytes())
    return drawn


def halo(width: float) -> list[AbstractPathEffect]:
    """White outline of ``width`` [pt] that keeps text and thin lines readable over other marks."""
    from matplotlib.patheffects import withStroke

    return [withStroke(linewidth=width, foreground="white")]


def finite(figure_name: str, arrays: Mapping[str, npt.ArrayLike]) -> dict[str, RealArray]:
    """Return the arrays as floats.

    - raises InputError: arrays of different lengths, an empty one, or a value that is not finite: a
      plot would drop it silently.
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
