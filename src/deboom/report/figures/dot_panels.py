"""Single results by category: dots of every case, their median, and the value asked for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.report.figures.canvas import finite, png, styled_figure
from deboom.report.style import ACCENT, FULL_WIDTH, INK

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SPREAD = 0.28


@dataclass(frozen=True, eq=False)
class DotPanel:
    """One measure of all categories.

    Parameters
    ----------
    x_label : str
        With its unit.
    values : mapping of str to (mapping of str to array)
        Category → group → values; a group has one colour in all panels.
    limit : float, optional
        What was asked for, drawn as a line [unit of the label].
    limit_label : str
        What that is.
    """

    x_label: str
    values: Mapping[str, Mapping[str, npt.ArrayLike]]
    limit: float | None = None
    limit_label: str = ""


def dot_panels(panels: Sequence[DotPanel], colours: Mapping[str, str]) -> bytes:
    """Draw panels side by side that share their categories, top to bottom.

    Parameters
    ----------
    panels : sequence of DotPanel
        At least one; all with the same categories.
    colours : mapping of str to str
        Of every group.

    Returns
    -------
    bytes
        PNG.

    Raises
    ------
    InputError
        No panel, categories that differ, values that are not finite, a group without colour.
    """
    if not panels:
        raise InputError("figure dot_panels: there is no panel to draw")
    categories = list(panels[0].values)
    if any(list(panel.values) != categories for panel in panels):
        raise InputError("figure dot_panels: panels side by side need the same categories")
    with styled_figure(FULL_WIDTH, 1.35 + 0.36 * len(categories)) as figure:
        grid = figure.subplots(1, len(panels), sharey=True, squeeze=False).ravel()
        for axes, panel in zip(grid, panels, strict=True):
            for row, category in enumerate(categories):
                groups = {
                    name: finite("dot_panels", {name: values})[name]
                    for name, values in panel.values[category].items()
                }
                together = np.concatenate([*groups.values()])
                offsets = np.linspace(-_SPREAD, _SPREAD, max(len(groups), 2))
                for offset, (name, values) in zip(offsets, groups.items(), strict=False):
                    if name not in colours:
                        raise InputError(f"figure dot_panels: '{name}' has no colour")
                    height = np.full(values.size, row + (offset if len(groups) > 1 else 0.0))
                    axes.plot(values, height, "o", color=colours[name], markersize=3.6, alpha=0.8)
                middle = float(np.median(together))
                axes.plot([middle, middle], [row - 0.4, row + 0.4], color=INK, linewidth=1.6)
            if panel.limit is not None:
                axes.axvline(panel.limit, color=ACCENT, linewidth=1.0, linestyle=(0, (4, 2)))
                axes.set_title(panel.limit_label, loc="right", fontsize=8.0, color=ACCENT)
            axes.set_xlabel(panel.x_label)
            axes.set_xlim(left=0.0)
            axes.grid(False, axis="y")
        grid[0].set_yticks(range(len(categories)), categories)
        grid[0].set_ylim(len(categories) - 0.5, -0.5)
        drawn = {name for panel in panels for one in panel.values.values() for name in one}
        _legend(figure, [name for name in colours if name in drawn], colours)
        return png(figure)


def _legend(figure: Figure, names: Sequence[str], colours: Mapping[str, str]) -> None:
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], linestyle="none", marker="o", markersize=4, color=colours[n], label=n)
        for n in names
    ]
    handles.append(
        Line2D([], [], linestyle="none", marker="|", markersize=9, color=INK, label="median")
    )
    figure.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 6))
