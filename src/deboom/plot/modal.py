"""Modal analysis: stabilisation chart, matrices of modes, mode shapes."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.plot.style import (
    FULL_WIDTH,
    INK,
    MUTED,
    TRACK,
    VEHICLE_PALETTE,
    canvas,
    close,
    finite,
    halo,
    place_legend,
    styled_figure,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

_STABLE, _ALONE = VEHICLE_PALETTE[0], VEHICLE_PALETTE[1]


def stabilisation_chart(
    frequency: npt.ArrayLike,
    level: npt.ArrayLike,
    pole_frequency: npt.ArrayLike,
    pole_order: npt.ArrayLike,
    stable: npt.ArrayLike,
    modes: npt.ArrayLike,
    *,
    level_label: str,
    ax: Axes | None = None,
) -> Axes:
    """Draw the poles of every order over the sum of the FRFs, and the modes they agree on.

    - `frequency` (f,): [Hz].
    - `level` (f,): of the sum of the FRFs [unit in the label].
    - `pole_frequency`, `pole_order` (n_pole,): [Hz], [1].
    - `stable` (n_pole,): confirmed by the order below.
    - `modes` (n_mode,): natural frequencies taken as modes [Hz].
    - `level_label`: with unit.
    - raises InputError: arrays of different lengths or values that are not finite.
    """
    curve = finite("stabilisation_chart", {"frequency": frequency, "level": level})
    poles = finite("stabilisation_chart", {"poles": pole_frequency, "orders": pole_order})
    confirmed = np.asarray(stable, dtype=bool)
    lines = finite("stabilisation_chart", {"modes": modes})["modes"]
    if confirmed.shape != poles["poles"].shape:
        raise InputError("figure stabilisation_chart: one flag for every pole")
    with canvas(ax, FULL_WIDTH, 3.6) as axes:
        behind = axes.twinx()
        behind.fill_between(
            curve["frequency"], curve["level"], curve["level"].min(), color=TRACK, linewidth=0
        )
        behind.plot(curve["frequency"], curve["level"], color=MUTED, linewidth=1.1)
        behind.set_ylabel(level_label)
        behind.grid(visible=False)
        behind.spines["right"].set_visible(True)
        axes.set_zorder(behind.get_zorder() + 1)
        axes.patch.set_visible(False)
        span = curve["frequency"][-1] - curve["frequency"][0]
        close = np.diff(lines, prepend=-np.inf) < 0.045 * span
        for mode, raised in zip(lines, close, strict=True):
            axes.axvline(mode, color=INK, linewidth=0.7, linestyle=(0, (4, 2)))
            axes.annotate(
                f"{mode:.1f}",
                (mode, 1.0),
                xycoords=("data", "axes fraction"),
                xytext=(0, 12 if raised else 3),
                textcoords="offset points",
                ha="center",
                fontsize=7.5,
            )
        for chosen, label, marker, colour in (
            (~confirmed, "once", "x", _ALONE),
            (confirmed, "stable in frequency and damping", "o", _STABLE),
        ):
            axes.plot(
                poles["poles"][chosen],
                poles["orders"][chosen],
                linestyle="none",
                marker=marker,
                markersize=3.6,
                markerfacecolor=colour if marker == "x" else "white",
                color=colour,
                label=label,
            )
        axes.set_xlim(curve["frequency"][0], curve["frequency"][-1])
        axes.set_ylim(poles["orders"].min() - 1, poles["orders"].max() + 1)
        axes.set_xlabel("frequency [Hz]; modes above the frame")
        axes.set_ylabel("order of the polynomial [1]")
        handles, labels = axes.get_legend_handles_labels()
        place_legend(axes, ax, handles=handles, labels=labels, loc="outside lower center", ncols=2)
        return axes


RealArray = npt.NDArray[np.float64]
ComplexArray = npt.NDArray[np.complex128]

LARGEST = 0.28
"""Largest displacement in the drawing [m]; a real one is below a tenth of a millimetre."""

_ENDS = ((0.0, VEHICLE_PALETTE[0], "one end"), (np.pi, VEHICLE_PALETTE[1], "half a period later"))
N_FRAMES = 12
_PANEL_LENGTH = 0.45
_MARGIN = 0.4
"""Around the points, for what moves [m]."""


@dataclass(frozen=True)
class _View:
    name: str
    plane: tuple[int, int]
    axes: tuple[str, str]
    with_panels: bool
    names_carrier: bool


_SIDE = _View("side view", (0, 2), ("x", "z"), with_panels=True, names_carrier=False)
_TOP = _View("top view", (0, 1), ("x", "y"), with_panels=True, names_carrier=False)
_FRONT = _View("front view", (1, 2), ("y", "z"), with_panels=False, names_carrier=True)


@dataclass(frozen=True, eq=False)
class BodyMotion:
    """Points of a body and how modes move them.

    - `labels`: names of the points.
    - `positions` (n_point, 3): x rearward, y to the right, z up [m].
    - `normals` (n_point, 3): of panels, which move along them; zero for points of the carrier.
    - `titles`: one per mode, such as ``23.7 Hz, ζ 2.8 %``.
    - `motion` (n_mode, n_point, 3): [any unit]; carrier and panels are scaled apart, each to its
      largest motion in a mode.
    """

    labels: Sequence[str]
    positions: npt.ArrayLike
    normals: npt.ArrayLike
    titles: Sequence[str]
    motion: npt.ArrayLike


def mode_shapes(body: BodyMotion) -> Figure:
    """Draw every mode in three views, undeformed and at both ends of its motion.

    - raises InputError: shapes that disagree, values that are not finite.
    """
    drawing = _Drawing(body)
    rows = len(body.titles)
    views = (_SIDE, _TOP, _FRONT)
    with styled_figure(FULL_WIDTH, 0.7 + 1.45 * rows) as figure:
        widths = [max(sum(drawing.extent(view)[0]), 2.4) for view in views]
        grid = figure.subplots(rows, len(views), squeeze=False, width_ratios=widths)
        for mode, line in enumerate(grid):
            for axes, view in zip(line, views, strict=True):
                drawing.at_rest(axes, view, last=mode == rows - 1)
                for phase, colour, label in _ENDS:
                    for drawn in drawing.moved(axes, view, mode, phase, colour):
                        drawn.set_label(label)
                if mode == 0:
                    drawing.name_points(axes, view)
            title = f"{body.titles[mode]}; {drawing.scale_text(mode)}"
            line[0].set_title(title, loc="left", fontweight="bold", fontsize=8.0)
        handles, labels = grid[0, 0].get_legend_handles_labels()
        shown = dict(zip(labels, handles, strict=True))
        figure.legend(shown.values(), shown.keys(), loc="outside lower center", ncols=3)
        return figure


def moving_mode_shapes(body: BodyMotion) -> bytes:
    """Draw the modes in motion, one period that repeats: from the side, the carrier from the front.

    - returns animated PNG.
    - raises InputError: as `mode_shapes`.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image

    drawing = _Drawing(body)
    columns = len(body.titles)
    frames: list[Image.Image] = []
    with styled_figure(1.75 * columns, 3.0) as figure:
        grid = figure.subplots(2, columns, squeeze=False)
        for mode in range(columns):
            for axes, view in zip(grid[:, mode], (_SIDE, _FRONT), strict=True):
                drawing.at_rest(axes, view, last=True)
                if mode:
                    axes.set_ylabel("")
                    axes.tick_params(labelleft=False)
            grid[0, mode].set_title(body.titles[mode], loc="left", fontsize=8.0)
        figure.set_dpi(100)
        agg = FigureCanvasAgg(figure)
        agg.draw()
        at_rest = agg.copy_from_bbox(figure.bbox)  # drawn once, under every frame
        for frame in range(N_FRAMES):
            phase = 2 * np.pi * frame / N_FRAMES
            agg.restore_region(at_rest)
            for mode in range(columns):
                for axes, view in zip(grid[:, mode], (_SIDE, _FRONT), strict=True):
                    for line in drawing.moved(axes, view, mode, phase, VEHICLE_PALETTE[0]):
                        axes.draw_artist(line)
                        line.remove()
            still = Image.fromarray(np.asarray(agg.buffer_rgba())).convert("RGB")
            frames.append(still.quantize(64, palette=frames[0] if frames else None))
    close(figure)
    moving = io.BytesIO()
    frames[0].save(
        moving, format="PNG", save_all=True, append_images=frames[1:], duration=100, loop=0
    )
    return moving.getvalue()


class _Drawing:
    """Checked arrays of a body, and how it is drawn in a view."""

    def __init__(self, body: BodyMotion) -> None:
        known = finite("mode_shapes", {"positions": body.positions, "normals": body.normals})
        self.labels = tuple(body.labels)
        self.positions, self.normals = known["positions"], known["normals"]
        motion = np.asarray(body.motion, dtype=complex)
        expected = (len(body.titles), len(self.labels), 3)
        if motion.shape != expected or self.positions.shape != expected[1:]:
            raise InputError(
                f"figure mode_shapes: {expected[0]} modes and {expected[1]} points are named, but "
                f"motion is {motion.shape} and positions {self.positions.shape}"
            )
        finite("mode_shapes", {"motion": np.abs(motion)})
        self.is_panel = np.any(self.normals != 0, axis=1)
        if self.is_panel.all():
            raise InputError("figure mode_shapes: there is no point of the carrier to draw")
        self.sizes = [self._sizes(shape) for shape in motion]
        self.motion: ComplexArray = np.stack(
            [
                np.where(self.is_panel[:, None], shape / panels, shape / carrier) * LARGEST
                for shape, (carrier, panels) in zip(motion, self.sizes, strict=True)
            ]
        )
        self.outline = self._outline()

    def _sizes(self, shape: ComplexArray) -> tuple[float, float]:
        """Largest motion of the carrier and of the panels; 1 where there is none."""
        length = np.sqrt(np.sum(np.abs(shape) ** 2, axis=1))
        carrier = float(length[~self.is_panel].max(initial=0.0)) or 1.0
        return carrier, float(length[self.is_panel].max(initial=0.0)) or 1.0

    def _outline(self) -> npt.NDArray[np.intp]:
        """Carrier points in the order of a closed line, seen from the front."""
        carrier = np.flatnonzero(~self.is_panel)
        offset = self.positions[carrier, 1:] - self.positions[carrier, 1:].mean(axis=0)
        order = carrier[np.argsort(np.arctan2(offset[:, 1], offset[:, 0]))]
        return np.append(order, order[0])

    def scale_text(self, mode: int) -> str:
        """How much more the carrier is magnified than the panels."""
        carrier, panels = self.sizes[mode]
        if not self.is_panel.any():
            return "all points on one scale"
        return f"carrier magnified {panels / carrier:.1f} times as much as panels"

    def extent(self, view: _View) -> tuple[tuple[float, float], tuple[float, float]]:
        """Reach of a view left and right of, and below and above, the origin [m]."""
        shown = self.positions if view.with_panels else self.positions[~self.is_panel]
        points = shown[:, list(view.plane)]
        low, high = points.min(axis=0) - _MARGIN, points.max(axis=0) + _MARGIN
        return (float(-low[0]), float(high[0])), (float(-low[1]), float(high[1]))

    def at_rest(self, axes: Axes, view: _View, *, last: bool) -> None:
        """Draw the body undeformed, with axes to scale."""
        across, up = self.extent(view)
        axes.set_xlim(-across[0], across[1])
        axes.set_ylim(-up[0], up[1])
        axes.set_aspect("equal")
        for drawn in self._body(axes, view, self.positions, MUTED, 0.8, (0, (3, 2))):
            drawn.set_label("at rest")
        axes.set_ylabel(f"{view.axes[1]} [m]")
        axes.tick_params(labelbottom=last)
        if last:
            axes.set_xlabel(f"{view.axes[0]} [m], {view.name}")

    def moved(self, axes: Axes, view: _View, mode: int, phase: float, colour: str) -> list[Line2D]:
        """Draw the body as a mode holds it at one phase."""
        points = self.positions + (self.motion[mode] * np.exp(1j * phase)).real
        return self._body(axes, view, points, colour, 1.4, "-")

    def name_points(self, axes: Axes, view: _View) -> None:
        """Write each name once: panels where their motion shows, the carrier from the front."""
        first, second = view.plane
        for place, label in enumerate(self.labels):
            above = True
            if self.is_panel[place]:
                in_plane = float(np.linalg.norm(self.normals[place][list(view.plane)]))
                written = view.with_panels and in_plane > 0.1
                written = written and (view is _SIDE or abs(self.normals[place][1]) > 0.5)
            else:
                written = view.names_carrier
                others = self.positions[~self.is_panel, second]
                above = self.positions[place, second] > others.min() + 0.1 * np.ptp(others)
            if written:
                axes.annotate(
                    label,
                    (self.positions[place, first], self.positions[place, second]),
                    xytext=(0, 7 if above else -11),
                    textcoords="offset points",
                    ha="center",
                    fontsize=5.5,
                    color=INK,
                    path_effects=halo(1.5),
                )

    def _body(
        self,
        axes: Axes,
        view: _View,
        points: RealArray,
        colour: str,
        width: float,
        style: str | tuple[int, tuple[int, ...]],
    ) -> list[Line2D]:
        plane = list(view.plane)
        line = points[self.outline][:, plane]
        drawn = axes.plot(*line.T, color=colour, lw=width, ls=style, marker=".", ms=3.0)
        for place in np.flatnonzero(self.is_panel & view.with_panels):
            normal = self.normals[place][plane]
            length = float(np.linalg.norm(normal))
            if length < 0.1:
                continue  # seen flat: neither its edge nor its motion shows
            along = np.array([-normal[1], normal[0]]) / length * _PANEL_LENGTH / 2
            ends = np.stack([points[place][plane] - along, points[place][plane] + along])
            drawn += axes.plot(*ends.T, color=colour, lw=width + 0.6, ls=style)
        return drawn
