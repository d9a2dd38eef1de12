"""Sketches: the axes of a part, seen from the right, the rear and above."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.plot.style import GRID, INK, MUTED, TRACK, RealArray, finite, halo, styled_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH, _HEIGHT = 2.2, 1.4  # in
_ARROW, _NAME = 0.9, 1.2  # lengths
_CORE, _RUBBER, _HALF_LENGTH = 0.16, 0.38, 0.24  # radii and half height of the bush
_ACROSS = np.array([[-0.62, 0.8, 0.0], [-0.42, -0.28, 0.95]])  # of x, y and z on the paper
_HALF, _START = 0.3, 0.3
_POINTS = 60


def axes_sketch(axes: Mapping[str, npt.ArrayLike], along: npt.ArrayLike | None = None) -> Figure:
    """Draw a rubber part and where its axes point.

    - `axes`: label → where it points, x, y and z of the part, (3,) [1].
    - `along` (3,): axis of a round part [1]; None: the part is drawn as a block.
    - raises InputError: no axis, an axis without length, values that are not finite.
    """
    if not axes:
        raise InputError("figure axes_sketch: there is no axis to draw")
    arrows = finite("axes_sketch", dict(axes))
    if any(not np.any(arrow) for arrow in arrows.values()):
        raise InputError("figure axes_sketch: an axis has no length")
    with styled_figure(_WIDTH, _HEIGHT) as figure:
        plain = figure.add_subplot()
        plain.set_axis_off()
        plain.set_aspect("equal")
        plain.set_xlim(-1.7, 1.7)
        plain.set_ylim(-0.9, 1.4)
        if along is None:
            _block(plain)
        else:
            _bush(plain, _unit(along))
        for label, arrow in arrows.items():
            tip = _paper(_ARROW * _unit(arrow)[np.newaxis])[:, 0]
            name = _paper(_NAME * _unit(arrow)[np.newaxis])[:, 0]
            look = {"arrowstyle": "-|>", "color": INK, "lw": 1.2}
            start = _paper(_START * _unit(arrow)[np.newaxis])[:, 0]
            plain.annotate("", tuple(tip), tuple(start), arrowprops=look)
            plain.annotate(
                label,
                tuple(name),
                ha=("right", "center", "left")[1 + int(np.sign(np.round(name[0], 1)))],
                va="center",
                fontsize=7.5,
                path_effects=halo(1.5),
            )
    return figure


def _block(axes: Axes) -> None:
    """Draw the three sides of a cube that are seen."""
    corners = _HALF * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    for place, shade in ((0, GRID), (1, TRACK), (2, "white")):
        side = np.insert(corners, place, _HALF, axis=1)
        axes.fill(*_paper(side), facecolor=shade, edgecolor=MUTED, lw=0.8)


def _bush(axes: Axes, along: RealArray) -> None:
    """Draw a round bush with its core."""
    helper = [0.3, 1.0, 0.2] if abs(along[1]) < 0.9 else [1.0, 0.2, 0.3]
    across = _unit(np.cross(along, helper))
    turn = np.linspace(0.0, 2.0 * np.pi, _POINTS)[:, np.newaxis]
    ring = np.cos(turn) * across + np.sin(turn) * np.cross(along, across)
    for place in np.linspace(-_HALF_LENGTH, _HALF_LENGTH, 12):  # a solid, ring on ring
        axes.fill(*_paper(_RUBBER * ring + place * along), color=TRACK, lw=0.0)
    for place in (-_HALF_LENGTH, _HALF_LENGTH):
        axes.plot(*_paper(_RUBBER * ring + place * along), color=MUTED, lw=0.8)
    axes.fill(*_paper(_CORE * ring + _HALF_LENGTH * along), color="white", lw=0.0)
    axes.plot(*_paper(_CORE * ring + _HALF_LENGTH * along), color=MUTED, lw=0.8)


def _paper(points: RealArray) -> RealArray:
    """Return where points (n, 3) stand on the paper, shape (2, n)."""
    return np.asarray(_ACROSS @ points.T)


def _unit(vector: npt.ArrayLike | Sequence[float]) -> RealArray:
    values = np.asarray(vector, dtype=float)
    return np.asarray(values / np.linalg.norm(values))
