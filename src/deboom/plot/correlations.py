"""Families of responses, and scatter matrices."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.plot.matrices import cell_number
from deboom.plot.style import (
    ACCENT,
    FIGURE_STYLE,
    FULL_WIDTH,
    INK,
    MUTED,
    VEHICLE_PALETTE,
    RealArray,
    finite,
)

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def clustered_matrix(
    names: Sequence[str],
    r: npt.ArrayLike,
    merges: npt.ArrayLike,
    family: Sequence[int],
    cut: float,
) -> Figure:
    """Draw a correlation matrix in the order of its tree; a bar of colour marks each family.

    - `names`: of rows and columns, at least two; of many not each is written.
    - `r` (n, n): coefficients [1]; written up to 24 names.
    - `merges` (n - 1, 4): in the layout of `scipy.cluster.hierarchy.linkage`; heights are 1 - r.
    - `family`: number of each name's family, from 1.
    - `cut`: correlation at which the tree was cut, a dashed line across it [1].
    - raises InputError: shapes that do not fit the names, values that are not finite.
    """
    import pandas as pd
    import seaborn as sns
    from matplotlib import style

    n = len(names)
    values = finite("clustered_matrix", {"r": r})["r"]
    tree = finite("clustered_matrix", {"merges": merges})["merges"]
    if values.shape != (n, n) or tree.shape != (n - 1, 4) or len(family) != n:
        raise InputError(
            f"figure clustered_matrix: r {values.shape}, {len(tree)} merges and {len(family)} "
            f"families for {n} names"
        )
    signs = bool(values.min() < 0.0)
    texts = np.where(np.eye(n), "1", [[coefficient(value) for value in row] for row in values])
    side = min(FULL_WIDTH, 2.4 + 0.5 * n)
    with style.context(dict(FIGURE_STYLE), after_reset=True):
        grid = sns.clustermap(
            pd.DataFrame(values, index=list(names), columns=list(names)),
            row_linkage=tree,
            col_linkage=tree,
            row_colors=[VEHICLE_PALETTE[(k - 1) % len(VEHICLE_PALETTE)] for k in family],
            annot=texts if n <= _ANNOTATED else None,
            fmt="",
            annot_kws={"fontsize": min(8.5, 90.0 / n)},
            cmap="PuOr_r" if signs else "Blues",
            vmin=-1.0 if signs else 0.0,
            vmax=1.0,
            figsize=(side, side),
            dendrogram_ratio=0.14,
            colors_ratio=0.02,
            cbar_pos=(0.02, 0.87, 0.02, 0.11),
            cbar_kws={"label": "r [1]"},
        )
        tall = grid.ax_row_dendrogram
        tall.axvline(1.0 - cut, color=INK, linewidth=1.0, linestyle=(0, (4, 2)))
        tall.set_xlim(1.05 * max(float(tree[:, 2].max()), 1.0 - cut), 0.0)
        for axes in (grid.ax_heatmap, tall, grid.ax_col_dendrogram, grid.ax_row_colors):
            axes.grid(visible=False)
        grid.ax_heatmap.tick_params(length=0, labelsize=7.5)
        grid.ax_heatmap.tick_params(axis="y", rotation=0)
        figure: Figure = grid.figure
        figure.tight_layout(h_pad=0.02, w_pad=0.02)  # names lie flat now and need more room
        return figure


def coefficient(value: float, decimals: int | None = None) -> str:
    """Write a coefficient, by default with two decimals and close to 1 with three.

    1 is written for nothing less.
    """
    if decimals is None:
        decimals = 2 if abs(value) < 0.95 else 3
    return cell_number(value, decimals)


LABEL_WIDTH = 18
"""Letters of a line below an axis of a small panel."""
MOST = 8
"""Responses that one figure holds legibly."""
_ANNOTATED = 24  # names whose coefficients can still be read in a matrix
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
    dots = _thinned(data)
    margin = 0.04 * np.ptp(data, axis=0)
    limits = np.stack([data.min(axis=0) - margin, data.max(axis=0) + margin], axis=1)
    import seaborn as sns

    places = {name: place for place, name in enumerate(names)}

    def histogram(x: pd.Series, **_: object) -> None:
        color = colours.get(str(x.name), MUTED)
        plt.gca().hist(x, bins=20, color=color, histtype="stepfilled")

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
        grid.map_lower(_cloud)
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


def variable_grid(
    variables: Mapping[str, npt.ArrayLike], responses: Mapping[str, npt.ArrayLike], y_label: str
) -> Figure:
    """Draw every response over every variable, with a straight line through the cloud.

    - `variables`, `responses`: name → values (n,), one per design, up to `MOST` of each.
    - `y_label`: of all responses, with unit.
    - raises InputError: none or too many, different lengths, values that are not finite.
    """
    import pandas as pd
    import seaborn as sns
    from matplotlib import style

    if not 1 <= len(variables) <= MOST or not 1 <= len(responses) <= MOST:
        raise InputError(
            f"figure variable_grid: {len(variables)} variables and {len(responses)} responses, it "
            f"shows 1 to {MOST} of each"
        )
    data = finite("variable_grid", {**variables, **responses})
    dots = _thinned(np.column_stack(list(data.values())))
    with style.context(dict(FIGURE_STYLE), after_reset=True):
        width = FULL_WIDTH / len(variables)
        grid = sns.PairGrid(
            pd.DataFrame(dots, columns=list(data)),
            x_vars=list(variables),
            y_vars=list(responses),
            height=min(width, 1.3),
            aspect=width / min(width, 1.3),
        )
        grid.map(_cloud)
        for axes in grid.axes.ravel():
            axes.locator_params(nbins=3)
            axes.tick_params(labelsize=6.5, length=2, pad=1.5)
        grid.figure.subplots_adjust(left=0.11, right=0.99, top=0.98, bottom=0.4 / len(responses))
        grid.figure.supylabel(y_label, fontsize=8.5, x=0.005)
        figure: Figure = grid.figure
        return figure


def objective_grid(
    objectives: pd.DataFrame, picks: Mapping[str, int], today: RealArray | None = None
) -> Figure:
    """Draw a front, each pair of its objectives against each other, with its picks.

    - `objectives`: one row per design, columns ``name [unit]``.
    - `picks`: row by name of the pick.
    - `today` (m,), optional: objectives of today's design.
    """
    import seaborn
    from matplotlib import style

    with style.context(dict(FIGURE_STYLE), after_reset=True):
        names = list(objectives.columns)
        grid = seaborn.pairplot(
            objectives,
            corner=True,
            diag_kind="hist",
            height=1.9 if len(names) > 2 else 2.5,
            plot_kws={"s": 12, "color": INK},
        )
        for place, name in enumerate(names):
            lines = "\n".join(textwrap.wrap(name, LABEL_WIDTH, break_long_words=False))
            grid.axes[-1, place].set_xlabel(lines)
            if place:
                grid.axes[place, 0].set_ylabel(lines)
        colours = seaborn.color_palette("colorblind", len(picks))
        for row in range(len(names)):
            for column in range(row):
                axes = grid.axes[row, column]
                if today is not None:
                    axes.plot(today[column], today[row], "x", color=MUTED, label="today's")
                for (name, at), colour in zip(picks.items(), colours, strict=True):
                    x, y = objectives.iloc[at, column], objectives.iloc[at, row]
                    axes.plot(x, y, "o", color=colour, label=name)
        handles, labels = grid.axes[1, 0].get_legend_handles_labels()
        grid.figure.tight_layout()
        grid.figure.legend(handles, labels, loc="upper right", fontsize="small")
    figure: Figure = grid.figure
    return figure


def _thinned(rows: RealArray) -> RealArray:
    """Take some rows in a fixed random order: every n-th may be the same draw of every design."""
    return np.asarray(rows[np.random.default_rng(1).permutation(len(rows))[:_DOTS]])


def _cloud(x: pd.Series, y: pd.Series, **_: object) -> None:
    """Draw dots and their straight line on the current axes."""
    from matplotlib import pyplot as plt

    axes = plt.gca()
    axes.plot(x, y, "o", markersize=1.8, alpha=0.45, color=ACCENT, markeredgewidth=0)
    slope, offset = np.polyfit(x - x.mean(), y, 1)
    ends = np.array([x.min(), x.max()])
    axes.plot(ends, offset + slope * (ends - x.mean()), color=INK, linewidth=1.0)


def _coefficient(axes: Axes, value: float, low: float, high: float) -> None:
    text = coefficient(value, 3)
    axes.text(
        0.5, 0.56, text, transform=axes.transAxes, ha="center", va="center", fontsize=11, color=INK
    )
    ends = f"{coefficient(low, 3)} – {coefficient(high, 3)}"
    axes.text(
        0.5,
        0.34,
        ends,
        transform=axes.transAxes,
        ha="center",
        va="center",
        fontsize=6.5,
        color=MUTED,
    )
