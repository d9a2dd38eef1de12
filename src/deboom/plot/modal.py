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
    DPI,
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
    from matplotlib.lines import Line2D
    from matplotlib.text import Annotation

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

LARGEST = 0.28
"""Largest displacement in the drawing [m]; a real one is below a tenth of a millimetre."""
_CAR = 0.5, 5.0
"""Sizes of a body that is drawn with lengths in m; those of others follow their size [m]."""
_NAME_AWAY = 9.0
"""Distance of a name from its point, away from the middle [pt]."""
_MOST_NAMES = 40
"""Points whose names are still legible."""

N_FRAMES = 12
_PANEL_LENGTH = 0.45
_SEEN = 0.1
"""Part of a panel's normal in the plane of a view from which its edge is drawn [1]."""
_MARGIN = 0.4
"""Around the points, for what moves [m]."""
_VIEWS = (("x", "z", "side view"), ("y", "z", "front view"))


@dataclass(frozen=True, eq=False)
class BodyMotion:
    """Points of a body and how modes move them.

    - `labels`: names of the points.
    - `positions` (n_point, 3): x rearward, y to the right, z up [m].
    - `normals` (n_point, 3): of panels, which move along them; zero for points of the carrier.
    - `titles`: one per mode, such as ``23.7 Hz, ζ 2.8 %``.
    - `motion` (n_mode, n_point, 3): [any unit]; carrier and panels are scaled apart, each to its
      largest motion in a mode.
    - `traces`: lines between points, each a sequence of their places; by default one closed line
      around the points of the carrier.
    """

    labels: Sequence[str]
    positions: npt.ArrayLike
    normals: npt.ArrayLike
    titles: Sequence[str]
    motion: npt.ArrayLike
    traces: Sequence[Sequence[int]] = ()


def mode_shapes(body: BodyMotion) -> bytes:
    """Draw the modes in motion, one period that repeats: from the side, the carrier from the front.

    - returns animated PNG; a reader that does not move it shows one end of the motion.
    - raises InputError: shapes that disagree, values that are not finite, no point of a carrier.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image

    drawing = _Drawing(body)
    columns = len(body.titles)
    frames: list[Image.Image] = []
    names: list[Annotation] = []
    with styled_figure(1.75 * columns, 3.0) as figure:
        grid = figure.subplots(2, columns, squeeze=False)
        for (view, mode), axes in np.ndenumerate(grid):
            names += drawing.at_rest(axes, view, named=mode == 0)
            if view == 0:
                axes.set_title(body.titles[mode], loc="left", fontsize=8.0)
        figure.set_dpi(DPI)
        agg = FigureCanvasAgg(figure)
        agg.draw()
        at_rest = agg.copy_from_bbox(figure.bbox)  # drawn once, under every frame
        for frame in range(N_FRAMES):
            agg.restore_region(at_rest)
            turned = np.exp(2j * np.pi * frame / N_FRAMES)
            for (view, mode), axes in np.ndenumerate(grid):
                points = drawing.positions + (drawing.motion[mode] * turned).real
                for line in drawing.lines(axes, view, points, VEHICLE_PALETTE[0], 1.4, "-"):
                    axes.draw_artist(line)
                    line.remove()
            for name in names:  # over what moves
                name.draw(agg.get_renderer())
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
        body_arrays = finite("mode_shapes", {"positions": body.positions, "normals": body.normals})
        self.labels = tuple(body.labels)
        self.positions, self.normals = body_arrays["positions"], body_arrays["normals"]
        motion = np.asarray(body.motion, dtype=complex)
        expected = (len(body.titles), len(self.labels), 3)
        if motion.shape != expected or self.positions.shape != expected[1:]:
            raise InputError(
                f"figure mode_shapes: {expected[0]} modes and {expected[1]} points are named, but "
                f"motion is {motion.shape} and positions {self.positions.shape}"
            )
        length = np.sqrt(
            np.sum(finite("mode_shapes", {"motion": np.abs(motion)})["motion"] ** 2, 2)
        )
        self.is_panel = np.any(self.normals != 0, axis=1)
        if self.is_panel.all():
            raise InputError("figure mode_shapes: there is no point of the carrier to draw")
        size = float(np.ptp(self.positions, axis=0).max())
        self.scale = size / np.clip(size, *_CAR) if size else 1.0
        for part in (self.is_panel, ~self.is_panel):
            size = length[:, part].max(axis=1, initial=0.0)
            motion[:, part] *= (self.scale * LARGEST / np.where(size > 0.0, size, 1.0))[
                :, None, None
            ]
        self.motion = motion
        # carrier points in the order of a closed line, seen from the front
        carrier = np.flatnonzero(~self.is_panel)
        offset = self.positions[carrier, 1:] - self.positions[carrier, 1:].mean(axis=0)
        order = carrier[np.argsort(np.arctan2(offset[:, 1], offset[:, 0]))]
        self.traces = [list(trace) for trace in body.traces] or [[*order, order[0]]]
        if any(not 0 <= point < len(self.labels) for trace in self.traces for point in trace):
            raise InputError("figure mode_shapes: a trace goes to a point that is not there")

    def at_rest(self, axes: Axes, view: int, *, named: bool) -> list[Annotation]:
        """Draw the body undeformed, with axes to scale; return the names of what a view shows."""
        across, up, title = _VIEWS[view]
        shown = self.positions[~self.is_panel | (view == 0)][:, _plane(view)]
        margin = self.scale * _MARGIN
        low, high = shown.min(axis=0) - margin, shown.max(axis=0) + margin
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(low[1], high[1])
        axes.set_aspect("equal")
        self.lines(axes, view, self.positions, MUTED, 0.8, (0, (3, 2)))
        axes.set_xlabel(f"{across} [m], {title}")
        if not named:
            axes.tick_params(labelleft=False)
            return []
        axes.set_ylabel(f"{up} [m]")
        if len(self.labels) > _MOST_NAMES:
            return []
        plane = _plane(view)
        centre = shown.mean(axis=0)
        names = []
        for place, (label, is_panel) in enumerate(zip(self.labels, self.is_panel, strict=True)):
            if is_panel != (view == 0) or (is_panel and self._is_flat(place, view)):
                continue
            at = self.positions[place][plane]
            away = at - centre
            away /= max(float(np.linalg.norm(away)), 1e-12)
            names.append(
                axes.annotate(
                    label,
                    tuple(at),
                    xytext=tuple(_NAME_AWAY * away),
                    textcoords="offset points",
                    ha="center",
                    va="center",
                    fontsize=7.0,
                    color=INK,
                    path_effects=halo(1.5),
                )
            )
        return names

    def lines(
        self,
        axes: Axes,
        view: int,
        points: RealArray,
        colour: str,
        width: float,
        style: str | tuple[int, tuple[int, ...]],
    ) -> list[Line2D]:
        """Draw the outline of the carrier and, from the side, the panels."""
        plane = _plane(view)
        drawn = [
            line
            for trace in self.traces
            for line in axes.plot(
                *points[trace][:, plane].T, color=colour, lw=width, ls=style, marker=".", ms=3.0
            )
        ]
        for place in np.flatnonzero(self.is_panel & (view == 0)):
            if self._is_flat(int(place), view):
                continue
            normal = self.normals[place][plane]
            along = np.array([-normal[1], normal[0]]) / np.linalg.norm(normal) * _PANEL_LENGTH / 2
            ends = np.stack([points[place][plane] - along, points[place][plane] + along])
            drawn += axes.plot(*ends.T, color=colour, lw=width + 0.6, ls=style)
        return drawn

    def _is_flat(self, place: int, view: int) -> bool:
        """Say whether a view shows neither the edge of a panel nor its motion."""
        return bool(np.linalg.norm(self.normals[place][_plane(view)]) < _SEEN)


def _plane(view: int) -> list[int]:
    """Return the columns of positions across and up in a view."""
    return ["xyz".index(axis) for axis in _VIEWS[view][:2]]
