"""Horizontal bars per direction with a mark beside each: one number, before and after."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.report.figures.canvas import finite, png, styled_figure
from deboom.report.style import FULL_WIDTH, INK, MUTED, TRACK

_BAR = 0.21


@dataclass(frozen=True, eq=False)
class MarkedPanel:
    """One number of every direction.

    Parameters
    ----------
    x_label : str
        With its unit.
    bars, marks : array, shape (n,)
        [unit of the label].
    """

    x_label: str
    bars: npt.ArrayLike
    marks: npt.ArrayLike


def marked_bars(
    names: Sequence[str],
    colours: Sequence[str],
    panels: Sequence[MarkedPanel],
    *,
    bar_label: str,
    mark_label: str,
) -> bytes:
    """Draw panels side by side that share their directions, top to bottom.

    Parameters
    ----------
    names, colours : sequence of str, length n
        Of the directions.
    panels : sequence of MarkedPanel
        At least one.
    bar_label, mark_label : str
        What the bars and the marks are.

    Returns
    -------
    bytes
        PNG.

    Raises
    ------
    InputError
        No panel, arrays of different lengths, values that are not finite.
    """
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    if not panels:
        raise InputError("figure marked_bars: there is no panel to draw")
    rows = np.arange(len(names))
    with styled_figure(FULL_WIDTH, 0.95 + _BAR * len(names)) as figure:
        grid = figure.subplots(1, len(panels), squeeze=False, sharey=True)[0]
        for axes, panel in zip(grid, panels, strict=True):
            data = finite("marked_bars", {"names": rows, "bars": panel.bars, "marks": panel.marks})
            shown = np.concatenate([data["bars"], data["marks"], [0.0]])
            low, high = float(shown.min()), float(shown.max())
            axes.barh(rows, np.full(len(names), high), color=TRACK, height=0.66)
            axes.barh(rows, data["bars"], color=list(colours), height=0.66)
            axes.plot(data["marks"], rows, "D", color="white", mec=INK, ms=4.0, mew=0.9)
            axes.axvline(0.0, color=MUTED, linewidth=0.8)
            axes.set_xlabel(panel.x_label)
            axes.grid(False, axis="y")
            axes.tick_params(axis="y", length=0)
            reach = high - low
            axes.set_xlim(low - 0.02 * reach, high + 0.04 * reach)
            axes.set_yticks(rows, names)
            axes.set_ylim(len(names) - 0.4, -0.6)
        handles: list[Patch | Line2D] = [
            Patch(facecolor=MUTED, label=bar_label),
            Line2D([], [], ls="none", marker="D", color="white", mec=INK, ms=4, label=mark_label),
        ]
        figure.legend(handles=handles, loc="outside upper right", ncols=2)
        return png(figure)
