"""The visual language: colours by name, sizes and fonts. Plain values, no plotting library.

Vehicle colours are the colour-blind-safe set of Okabe and Ito; mount colours are from Paul Tol's
"muted" set, so that a vehicle and a mount are never taken for each other.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

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
HALF_WIDTH = 3.5
"""Width of a figure that shares its row with another [in]."""
DPI = 200

FIGURE_STYLE: Mapping[str, str | float | bool] = {
    "font.family": "DejaVu Sans",
    "font.size": 8.5,
    "text.color": INK,
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

    Parameters
    ----------
    names : sequence of str
        All vehicles of the platform in the platform's order; a study of a few of them passes the
        whole list too, so that a vehicle keeps its colour in every figure.

    Returns
    -------
    dict of str to str
        ``#RRGGBB`` by vehicle. After the palette's six come darker, then lighter ones; from the
        nineteenth on they repeat.

    Raises
    ------
    InputError
        Duplicated names.
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
