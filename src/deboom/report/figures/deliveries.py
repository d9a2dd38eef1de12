"""Delivered parts in the intervals that they must keep."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.report.figures.canvas import finite, png, styled_figure
from deboom.report.style import ACCENT, FULL_WIDTH, INK, TRACK, VEHICLE_PALETTE

_MARKS = {"pass": ("o", ACCENT), "undecided": ("D", INK), "fail": ("X", VEHICLE_PALETTE[1])}
_SPREAD = 0.26


@dataclass(frozen=True, eq=False)
class PartsRow:
    """One axis of one batch.

    Parameters
    ----------
    label : str
    interval : (float, float)
        Ends [1].
    values : mapping of str to array
        ``pass``, ``undecided``, ``fail`` → stiffness over today's [1].
    """

    label: str
    interval: tuple[float, float]
    values: Mapping[str, npt.ArrayLike]


def parts_in_intervals(rows: Sequence[PartsRow]) -> bytes:
    """Draw every measured part on the interval of its axis.

    Parameters
    ----------
    rows : sequence of PartsRow
        At least one.

    Returns
    -------
    bytes
        PNG.

    Raises
    ------
    InputError
        No row, an unknown verdict, values that are not finite.
    """
    if not rows:
        raise InputError("figure parts_in_intervals: there is no part to draw")
    from matplotlib.lines import Line2D

    with styled_figure(FULL_WIDTH, 0.9 + 0.34 * len(rows)) as figure:
        axes = figure.add_subplot()
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
        figure.legend(handles=handles, loc="outside upper right", ncols=3)
        return png(figure)
