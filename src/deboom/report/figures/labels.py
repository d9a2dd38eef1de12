"""Labels beside their points that cover neither each other nor the data."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

import numpy as np

from deboom.report.figures.canvas import RealArray, halo
from deboom.report.style import MUTED

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.transforms import Bbox

_DIRECTIONS = ((0, 1), (1, 1), (-1, 1), (1, 0), (-1, 0), (1, -1), (-1, -1), (0, -1))
_DISTANCES = (5.0, 11.0, 18.0, 27.0, 38.0, 52.0)  # pt
_PLACES = tuple((distance, direction) for distance in _DISTANCES for direction in _DIRECTIONS)
_LEADER_FROM = 12.0  # pt
_CLEARANCE = 6.0  # pixels
_HORIZONTAL: tuple[Literal["center", "left", "right"], ...] = ("center", "left", "right")
_VERTICAL: tuple[Literal["center", "bottom", "top"], ...] = ("center", "bottom", "top")


def freeze_layout(figure: Figure) -> None:
    """Lay the figure out for good: labels are placed in pixels and must not move afterwards."""
    figure.draw_without_rendering()
    figure.set_layout_engine("none")


def place_labels(
    axes: Axes,
    points: RealArray,
    texts: Sequence[str],
    colours: Sequence[str],
    obstacles: RealArray,
    size: float,
) -> None:
    """Write each text near its point, at the nearest of a ring of places that is free.

    Parameters
    ----------
    axes : Axes
        With frozen layout.
    points : array, shape (n, 2)
        Where each text belongs, data coordinates.
    texts, colours : sequence of str
        One for each point.
    obstacles : array, shape (m, 2)
        Points that no text should cover, data coordinates.
    size : float
        Font size [pt].
    """
    anchors = axes.transData.transform(points)
    pixels = np.vstack([axes.transData.transform(obstacles), anchors])
    taken: list[RealArray] = []
    for point, anchor, text, colour in zip(points, anchors, texts, colours, strict=True):
        label = axes.annotate(
            text,
            (float(point[0]), float(point[1])),
            xytext=(0.0, 0.0),
            textcoords="offset points",
            color=colour,
            fontsize=size,
            path_effects=halo(2.0),
        )
        extent = np.array(label.get_window_extent().size)
        pixels_per_point = axes.figure.dpi / 72.0
        boxes = [
            _box(anchor, distance * pixels_per_point, direction, extent)
            for distance, direction in _PLACES
        ]
        costs = [_cost(box, axes.bbox, pixels, taken) for box in boxes]
        best = int(np.argmin(costs))
        taken.append(boxes[best])
        distance, (right, up) = _PLACES[best]
        label.set_position((distance * right, distance * up))
        label.set_horizontalalignment(_HORIZONTAL[right])
        label.set_verticalalignment(_VERTICAL[up])
        if distance > _LEADER_FROM:
            axes.annotate(
                "",
                (float(point[0]), float(point[1])),
                xytext=(distance * right, distance * up),
                textcoords="offset points",
                arrowprops={"arrowstyle": "-", "color": MUTED, "linewidth": 0.6, "shrinkB": 4.0},
            )


def _box(
    anchor: RealArray, distance: float, direction: tuple[int, int], extent: RealArray
) -> RealArray:
    """Lower left and upper right corner [pixel] of a text at a place, shape (2, 2)."""
    towards = np.array(direction, dtype=float)
    centre = anchor + towards * (distance + extent / 2.0)
    return np.array([centre - extent / 2.0, centre + extent / 2.0])


def _cost(box: RealArray, frame: Bbox, pixels: RealArray, taken: Sequence[RealArray]) -> float:
    """Leaving the frame is worse than covering a label, which is worse than covering data."""
    low, high = box[0] - _CLEARANCE, box[1] + _CLEARANCE
    covered = np.all((pixels > low) & (pixels < high), axis=1).sum()
    overlaps = sum(bool(np.all((low < other[1]) & (high > other[0]))) for other in taken)
    outside = np.any(box[0] < frame.min) or np.any(box[1] > frame.max)
    return float(covered + 1e3 * overlaps + 1e6 * outside)
