"""Pictures for suppliers: stiffness over preload, effects of a part, deliveries, shared parts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.plot.style import (
    ACCENT,
    FULL_WIDTH,
    INK,
    MUTED,
    TRACK,
    VEHICLE_PALETTE,
    canvas,
    finite,
    halo,
    panel_grid,
    place_legend,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLUMNS = 3
_PANEL_HEIGHT = 2.05
_DASHED = (0, (4, 1.6))

Pair = tuple[npt.ArrayLike, npt.ArrayLike]


@dataclass(frozen=True, eq=False)
class StiffnessPanel:
    """Dynamic stiffness of one direction over its preload.

    - `title`: mount and axis.
    - `x_label`: preload with its unit.
    - `points`: preload and stiffness of every line in operation [unit of the label, N/mm].
    - `today`, `wanted` or None: curves at one test condition; nan where nothing backs them.
    - `tolerance`: half width of the band around the wanted curve [1].
    - `note`: in the panel, such as ``no requirement``.
    """

    title: str
    x_label: str
    points: Pair
    today: Pair | None = None
    wanted: Pair | None = None
    tolerance: float = 0.0
    note: str = ""


STIFFNESS_WORDS = (
    "dynamic stiffness |K| [N/mm]",
    "today, in the vehicle",
    "today",
    "nominal",
    "band",
)


def stiffness_over_preload(
    panels: Sequence[StiffnessPanel], colour: str, words: Sequence[str] = STIFFNESS_WORDS
) -> Figure:
    """Draw the static force – dynamic stiffness diagrams of one mount, after thesis, Figure 26.

    - `panels`: at least one.
    - `colour`: of the mount.
    - `words`: label of the ordinate and names of what is drawn, in another language.
    - raises InputError: no panel, points that are not finite.
    """
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch
    from matplotlib.ticker import MaxNLocator

    columns = min(_COLUMNS, max(len(panels), 1))
    with panel_grid("stiffness_over_preload", len(panels), columns, 0.45, _PANEL_HEIGHT) as (
        figure,
        grid,
    ):
        for place, (axes, panel) in enumerate(zip(grid, panels, strict=True)):
            _stiffness(axes, panel, colour)
            axes.set_title(panel.title, loc="left", fontweight="bold")
            axes.set_xlabel(panel.x_label)
            axes.xaxis.set_major_locator(MaxNLocator(5))
            if place % columns == 0:
                axes.set_ylabel(words[0])
        handles: list[Line2D | Patch] = [
            Line2D([], [], color=MUTED, label=words[1], ls="none", marker=".")
        ]
        if any(panel.today is not None for panel in panels):
            handles.append(Line2D([], [], color=INK, ls=_DASHED, label=words[2]))
        if any(panel.wanted is not None for panel in panels):
            handles.append(Line2D([], [], color=colour, label=words[3]))
            handles.append(Patch(color=colour, alpha=0.22, label=words[4]))
        figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
        return figure


def _stiffness(axes: Axes, panel: StiffnessPanel, colour: str) -> None:
    points = finite("stiffness_over_preload", {"x": panel.points[0], "y": panel.points[1]})
    axes.plot(points["x"], points["y"], ".", color=MUTED, markersize=2.2, alpha=0.45)
    tops = [float(np.max(points["y"]))]
    if panel.today is not None:
        axes.plot(*(np.asarray(a) for a in panel.today), color=INK, ls=_DASHED, linewidth=1.2)
        tops.append(float(np.nanmax(np.asarray(panel.today[1]))))
    if panel.wanted is not None:
        x, k = (np.asarray(a, dtype=float) for a in panel.wanted)
        low, high = ((1.0 + side * panel.tolerance) * k for side in (-1.0, 1.0))
        axes.fill_between(x, low, high, color=colour, alpha=0.22, linewidth=0)
        axes.plot(x, k, color=colour, linewidth=1.7)
        tops.append(float(np.nanmax(high)))
    axes.set_ylim(0.0, 1.12 * max(tops))
    if panel.note:
        axes.text(
            0.97,
            0.05,
            panel.note,
            transform=axes.transAxes,
            ha="right",
            fontsize=8.0,
            fontweight="bold",
            color=INK,
            path_effects=halo(2.5),
        )


_MARKS = {"pass": ("o", ACCENT), "undecided": ("D", INK), "fail": ("X", VEHICLE_PALETTE[1])}
_SPREAD = 0.26


@dataclass(frozen=True, eq=False)
class PartsRow:
    """One axis of one batch.

    - `interval`: ends [1].
    - `values`: ``pass``, ``undecided``, ``fail`` → stiffness over today's [1].
    """

    label: str
    interval: tuple[float, float]
    values: Mapping[str, npt.ArrayLike]


def parts_in_intervals(
    rows: Sequence[PartsRow],
    *,
    ax: Axes | None = None,
) -> Axes:
    """Draw every measured part on the interval of its axis.

    - `rows`: at least one.
    - raises InputError: no row, an unknown verdict, values that are not finite.
    """
    if not rows:
        raise InputError("figure parts_in_intervals: there is no part to draw")
    from matplotlib.lines import Line2D

    with canvas(ax, FULL_WIDTH, 0.9 + 0.34 * len(rows)) as axes:
        axes.grid(visible=False, axis="y")
        used = []
        for place, row in enumerate(rows):
            lower, upper = row.interval
            axes.barh(place, upper - lower, left=lower, height=0.72, color=TRACK)
            for name, values in row.values.items():
                if name not in _MARKS:
                    raise InputError(f"figure parts_in_intervals: unknown verdict '{name}'")
                if not np.size(values):
                    continue
                x = finite("parts_in_intervals", {name: values})[name]
                used.append(name)
                mark, colour = _MARKS[name]
                # parts of one value stand above each other
                height = place + _SPREAD * np.linspace(-1, 1, x.size) if x.size > 1 else [place]
                axes.plot(x, height, mark, color=colour, markersize=4.2, linestyle="none")
        axes.set_yticks(range(len(rows)), [row.label for row in rows])
        axes.set_ylim(len(rows) - 0.4, -0.6)
        axes.set_xlabel("dynamic stiffness over today's [1]")
        handles = [
            Line2D([], [], marker=mark, color=colour, linestyle="none", label=name)
            for name, (mark, colour) in _MARKS.items()
            if name in used
        ]
        place_legend(axes, ax, handles=handles, loc="outside upper right", ncols=3)
        return axes


def shared_parts(
    parts: Sequence[str],
    vehicles: Sequence[str],
    labels: npt.NDArray[np.str_],
    *,
    ax: Axes | None = None,
) -> Axes:
    """Draw the part number of each part in each vehicle; one colour per number of a row.

    - `parts`, `vehicles`: of rows and columns.
    - `labels` (n_parts, n_vehicles): part numbers.
    - raises InputError: labels of another shape.
    """
    if labels.shape != (len(parts), len(vehicles)):
        raise InputError(
            f"figure shared_parts: {labels.shape} labels for {len(parts)} parts in "
            f"{len(vehicles)} vehicles"
        )
    from matplotlib.patches import Rectangle

    turned = max(len(name) for name in vehicles) * len(vehicles) > 70
    with canvas(ax, FULL_WIDTH, 0.75 + 0.36 * len(parts) + 0.35 * turned) as axes:
        axes.grid(visible=False)
        for row, names in enumerate(labels):
            numbers = list(dict.fromkeys(names.tolist()))
            for column, name in enumerate(names.tolist()):
                colour = VEHICLE_PALETTE[numbers.index(name) % len(VEHICLE_PALETTE)]
                axes.add_patch(
                    Rectangle((column - 0.47, row - 0.42), 0.94, 0.84, facecolor=colour, alpha=0.32)
                )
                axes.text(column, row, name, ha="center", va="center", fontweight="bold")
        axes.set_xlim(-0.6, len(vehicles) - 0.4)
        axes.set_ylim(len(parts) - 0.5, -0.5)
        axes.set_xticks(range(len(vehicles)), vehicles, rotation=45 if turned else 0)
        axes.set_yticks(range(len(parts)), parts)
        axes.tick_params(length=0)
        for side in ("left", "bottom"):
            axes.spines[side].set_visible(False)
        return axes
