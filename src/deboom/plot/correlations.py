"""Correlation matrices, families of responses and scatter matrices."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.plot.matrices import cell_number, cells
from deboom.plot.style import (
    ACCENT,
    FIGURE_STYLE,
    FULL_WIDTH,
    INK,
    MUTED,
    VEHICLE_PALETTE,
    RealArray,
    canvas,
    finite,
    panel_grid,
)

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_INTERVALS_UP_TO = 6
"""Rows; of larger matrices the intervals would not be legible and stand in the table alone."""
_LABELS_FLAT_UP_TO = 6
_TICKS = (-0.8, -0.5, 0.0, 0.5, 0.8, 0.9, 0.95, 0.99, 0.999, 1.0)
_POPULATION = "#B3BCC8"


@dataclass(frozen=True, eq=False)
class CorrelationPanel:
    """One correlation matrix.

    - `title`: what was correlated.
    - `values`, `low`, `high` (n, n): coefficients and the ends of their intervals [1].
    """

    title: str
    values: npt.ArrayLike
    low: npt.ArrayLike
    high: npt.ArrayLike


@dataclass(frozen=True, eq=False)
class PopulationPanel:
    """One value, and those of others that were not chosen.

    - `x_label`: with its unit.
    - `values` (n,): of the population.
    - `own`: the value that is held against it.
    - `asked`: bounds that are drawn as lines.
    - `note`: title of the panel.
    """

    x_label: str
    values: npt.ArrayLike
    own: float
    asked: tuple[float, ...] = ()
    note: str = ""


def correlation_matrices(
    names: Sequence[str], panels: Sequence[CorrelationPanel], groups: Sequence[str] = ()
) -> Figure:
    """Draw correlation matrices side by side, each coefficient written into its cell.

    Parameters
    ----------
    names : sequence of str
        Of rows and columns.
    panels : sequence of CorrelationPanel
        At least one.
    groups : sequence of str, optional
        Group of each row; lines separate neighbours of different groups.

    Returns
    -------
    Figure Small matrices show the interval below the coefficient.

    Raises
    ------
    InputError
        No panel, shapes that do not fit the names, values that are not finite.
    """
    n, count = len(names), len(panels)
    checked = [_checked_panel(panel, n) for panel in panels]
    lowest = min((float(part["values"].min()) for part in checked), default=0.0)
    limits = (-1.0 if lowest < 0.0 else 0.0, 1.0)
    side = FULL_WIDTH / max(count, 1)
    edges = [place for place in range(1, len(groups)) if groups[place] != groups[place - 1]]
    margin = 0.15 + (0.35 if n > _LABELS_FLAT_UP_TO else 0.0)
    with panel_grid("correlation_matrices", count, count, margin, side) as (page, grid):
        size = 72.0 * (side - 0.7) / n  # of a cell [pt]
        for axes, panel, part in zip(grid, panels, checked, strict=True):
            cells(
                axes,
                part["values"],
                names,
                names,
                texts=_texts(part),
                limits=limits,
                label_size=min(7.5, 0.36 * size + 1.0),
                text_size=min(8.5, (0.145 if n <= _INTERVALS_UP_TO else 0.3) * size),
            )
            axes.spines[:].set_visible(False)
            if n > _LABELS_FLAT_UP_TO or max(map(len, names)) * 4.2 > size:
                axes.tick_params(axis="x", rotation=90)
            axes.set_title(panel.title, loc="left", fontweight="bold", fontsize=8.5)
            for edge in edges:
                axes.axhline(edge, color="white", linewidth=2.5)
                axes.axvline(edge, color="white", linewidth=2.5)
        return page


def family_tree(
    merges: npt.ArrayLike,
    names: Sequence[str],
    family: Sequence[int],
    cut: float,
    *,
    ax: Axes | None = None,
) -> Axes:
    """Draw which responses go together, as a tree over the correlation of its branches.

    - `merges` (n - 1, 4): in the layout of `scipy.cluster.hierarchy.linkage`; heights are 1 - r.
    - `names`: of the leaves.
    - `family`: number of each leaf's family, from 1: its colour.
    - `cut`: correlation at which the tree was cut [1].
    - raises InputError: lengths that do not fit, values that are not finite.
    """
    from scipy.cluster.hierarchy import dendrogram

    tree = finite("family_tree", {"merges": merges})["merges"]
    if len(names) != len(tree) + 1 or len(family) != len(names):
        raise InputError(
            f"figure family_tree: {len(names)} names and {len(family)} families for a tree of "
            f"{len(tree) + 1} leaves"
        )
    drawn = dendrogram(tree, no_plot=True)
    colour = [VEHICLE_PALETTE[(number - 1) % len(VEHICLE_PALETTE)] for number in family]
    leaves = drawn["leaves"] or []
    with canvas(ax, FULL_WIDTH, 0.9 + 0.22 * len(names)) as axes:
        for places, heights in zip(drawn["icoord"], drawn["dcoord"], strict=True):
            inside = heights[1] <= 1.0 - cut
            below = leaves[round((min(places) - 5.0) / 10.0)]
            axes.plot(heights, places, color=colour[below] if inside else MUTED, linewidth=1.6)
        axes.axvline(1.0 - cut, color=INK, linewidth=1.0, linestyle=(0, (4, 2)))
        axes.set_yticks([10.0 * place + 5.0 for place in range(len(names))])
        axes.set_yticklabels([names[leaf] for leaf in leaves])
        for label, leaf in zip(axes.get_yticklabels(), leaves, strict=True):
            label.set_color(colour[leaf])
            label.set_fontweight("bold")
        axes.set_ylim(10.0 * len(names), 0.0)
        axes.grid(visible=False, axis="y")
        furthest = 1.06 * max(float(tree[:, 2].max()), 1.0 - cut)
        axes.set_xscale("function", functions=(np.sqrt, np.square))  # most branches are close to 1
        axes.set_xlim(0.0, furthest)
        ticks = [r for r in _TICKS if 1.0 - r <= furthest]
        axes.set_xticks([1.0 - r for r in ticks], [_tick(r) for r in ticks])
        axes.set_xlabel("correlation r of the worst pair below a branch [1]")
        axes.set_title(f"cut at r = {cut:g}", loc="right", fontsize=8.0)
        return axes


def populations(panels: Sequence[PopulationPanel]) -> Figure:
    """Draw histograms of correlations in a population with one value marked in each.

    The scale is Fisher's artanh r, which spreads what is close to 1.

    - `panels`: at least one.
    - raises InputError: no panel, values that are not finite.
    """
    with panel_grid("populations", len(panels), len(panels), 0.0, 2.5) as (figure, grid):
        for axes, panel in zip(grid, panels, strict=True):
            values = finite("populations", {"values": panel.values})["values"]
            stretched = _stretched(values)
            edges = np.linspace(stretched.min(), stretched.max(), 31)
            axes.hist(stretched, bins=list(edges), color=_POPULATION)
            axes.axvline(float(_stretched(panel.own)), color=VEHICLE_PALETTE[1], linewidth=1.8)
            for bound in panel.asked:
                place = float(_stretched(bound))
                axes.axvline(place, color=ACCENT, linewidth=1.0, linestyle=(0, (4, 2)))
            low, high = axes.get_xlim()
            ticks = [r for r in _TICKS if low <= _stretched(r) <= high and r < 1.0]
            axes.set_xticks([float(_stretched(r)) for r in ticks], [_tick(r) for r in ticks])
            axes.set_xlabel(panel.x_label)
            axes.set_title(panel.note, loc="left", fontsize=8.0)
            axes.grid(visible=False, axis="x")
        grid[0].set_ylabel("fleets")
        return figure


def _checked_panel(panel: CorrelationPanel, n: int) -> dict[str, RealArray]:
    part = finite(
        "correlation_matrices", {"values": panel.values, "low": panel.low, "high": panel.high}
    )
    for name, values in part.items():
        if values.shape != (n, n):
            raise InputError(
                f"figure correlation_matrices: {name} of '{panel.title}' has shape {values.shape} "
                f"for {n} names"
            )
    return part


def _texts(part: Mapping[str, RealArray]) -> npt.NDArray[np.str_]:
    """Write every coefficient, below it the interval of a small matrix."""
    values = part["values"]
    texts = []
    for (row, column), value in np.ndenumerate(values):
        text = "1" if row == column else coefficient(float(value))
        if len(values) <= _INTERVALS_UP_TO and row != column:
            ends = (coefficient(float(part[end][row, column])) for end in ("low", "high"))
            text += "\n" + "–".join(ends)
        texts.append(text)
    return np.array(texts).reshape(values.shape)


def _stretched(r: npt.ArrayLike) -> RealArray:
    return np.asarray(np.arctanh(np.clip(np.asarray(r, dtype=float), -0.9999, 0.9999)))


def _tick(r: float) -> str:
    return f"{r:g}".replace("-", "−")


def coefficient(value: float, decimals: int | None = None) -> str:
    """Write a coefficient, by default with two decimals and close to 1 with three.

    1 is written for nothing less.
    """
    if decimals is None:
        decimals = 2 if abs(value) < 0.95 else 3
    return cell_number(value, decimals)


MOST = 8
"""Responses that one figure holds legibly."""
_DOTS = 1500  # a cloud of more is thinned


def scatter_matrix(
    names: Sequence[str],
    values: npt.ArrayLike,
    coefficients: tuple[npt.ArrayLike, npt.ArrayLike, npt.ArrayLike],
    colours: Mapping[str, str],
    *,
    value_label: str,
) -> Figure:
    """Draw histograms on the diagonal, clouds below it, correlations with intervals above it.

    - `names`: two to `MOST` responses.
    - `values` (n, r): one row per design [unit in the label].
    - `coefficients` (r, r): Pearson's correlation and the ends of its interval [1].
    - `colours`: of the histograms.
    - `value_label`: of all axes, with unit.
    - raises InputError: too few or too many responses, shapes that do not fit, values that are not
      finite.
    """
    import pandas as pd
    from matplotlib import pyplot as plt
    from matplotlib import style
    from matplotlib.ticker import MaxNLocator

    n = len(names)
    if not 2 <= n <= MOST:
        raise InputError(f"figure scatter_matrix: {n} responses, it shows 2 to {MOST}")
    data = finite("scatter_matrix", {"values": values})["values"]
    r, low, high = (
        finite("scatter_matrix", {"coefficients": part})["coefficients"] for part in coefficients
    )
    if data.ndim != 2 or data.shape[1] != n or any(part.shape != (n, n) for part in (r, low, high)):
        raise InputError(
            f"figure scatter_matrix: values {data.shape} and coefficients {r.shape} for {n} names"
        )
    # in a fixed random order: every n-th row may be the same tolerance draw of every design
    dots = data[np.random.default_rng(1).permutation(len(data))[:_DOTS]]
    margin = 0.04 * np.ptp(data, axis=0)
    limits = np.stack([data.min(axis=0) - margin, data.max(axis=0) + margin], axis=1)
    import seaborn as sns

    places = {name: place for place, name in enumerate(names)}

    def histogram(x: pd.Series, **_: object) -> None:
        color = colours.get(str(x.name), MUTED)
        plt.gca().hist(x, bins=20, color=color, histtype="stepfilled")

    def cloud(x: pd.Series, y: pd.Series, **_: object) -> None:
        _cloud(plt.gca(), x.to_numpy(), y.to_numpy())

    def written(x: pd.Series, y: pd.Series, **_: object) -> None:
        place = places[str(y.name)], places[str(x.name)]
        plt.gca().set_axis_off()
        _coefficient(plt.gca(), r[place], low[place], high[place])

    with style.context(dict(FIGURE_STYLE), after_reset=True):
        grid = sns.PairGrid(
            pd.DataFrame(dots, columns=list(names)),
            height=FULL_WIDTH / n,
            diag_sharey=False,
        )
        grid.map_diag(histogram)
        grid.map_lower(cloud)
        grid.map_upper(written)
        for row in range(n):
            grid.axes[0, row].set_title(names[row], fontweight="bold")
            for column in range(row + 1):
                axes = grid.axes[row, column]
                axes.set_xlim(*limits[column])
                axes.xaxis.set_major_locator(MaxNLocator(3))
                axes.yaxis.set_major_locator(MaxNLocator(3))
                axes.tick_params(labelsize=6.5, length=2, pad=1.5)
        grid.axes[0, 0].tick_params(labelleft=False)
        grid.figure.subplots_adjust(left=0.08, right=0.99, top=0.965, bottom=0.085)
        grid.figure.supxlabel(value_label, fontsize=8.5, y=0.005)
        figure: Figure = grid.figure
        return figure


def _cloud(axes: Axes, x: RealArray, y: RealArray) -> None:
    axes.plot(x, y, "o", markersize=1.8, alpha=0.45, color=VEHICLE_PALETTE[0], markeredgewidth=0)
    slope, offset = np.polyfit(x - x.mean(), y, 1)
    ends = np.array([x.min(), x.max()])
    axes.plot(ends, offset + slope * (ends - x.mean()), color=VEHICLE_PALETTE[1], linewidth=1.0)


def _coefficient(axes: Axes, value: float, low: float, high: float) -> None:
    text = coefficient(value, 3)
    axes.text(
        0.5, 0.56, text, transform=axes.transAxes, ha="center", va="center", fontsize=11, color=INK
    )
    ends = f"{coefficient(low, 3)} – {coefficient(high, 3)}"
    axes.text(
        *(0.5, 0.34, ends),
        transform=axes.transAxes,
        ha="center",
        va="center",
        fontsize=6.5,
        color=MUTED,
    )
