"""How objectives and parts are distributed: pairs by group, strips of repeats, a joint scatter."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.plot.style import (
    FIGURE_STYLE,
    INK,
    MUTED,
    RealArray,
    finite,
    panel_grid,
)

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

GROUP = "group"
_SIDE = 4.6
"""Of a square figure [in]."""
_BINS = 24


def grouped_pairs(
    groups: Mapping[str, Mapping[str, npt.ArrayLike]], colours: Mapping[str, str]
) -> Figure:
    """Draw every pair of numbers over each other, with their histograms, in a colour per group.

    - `groups`: group → label with unit → values, the same labels in each, two or more.
    - `colours`: group → colour.
    - raises InputError: fewer than two labels, different lengths, values that are not finite.
    """
    import seaborn as sns
    from matplotlib import style

    labels = list(next(iter(groups.values()), {}))
    if len(labels) < 2:
        raise InputError(f"figure grouped_pairs: {len(labels)} numbers, it takes at least two")
    table = _long("grouped_pairs", groups)
    with style.context(dict(FIGURE_STYLE), after_reset=True):
        grid = sns.PairGrid(
            table,
            hue=GROUP,
            palette=dict(colours),
            vars=labels,
            height=_SIDE / len(labels),
            diag_sharey=False,
        )
        grid.map_diag(sns.histplot, element="step", bins=_BINS, alpha=0.25, linewidth=0.8)
        grid.map_offdiag(sns.scatterplot, s=9, alpha=0.6, linewidth=0)
        grid.add_legend(title="")
        figure: Figure = grid.figure
        return figure


def strips(panels: Mapping[str, Mapping[str, npt.ArrayLike]]) -> Figure:
    """Draw repeats of a number as dots in a row for each design, a panel per number.

    - `panels`: label with unit → design → its repeats; the same designs in each.
    - raises InputError: no panel, no repeat, values that are not finite.
    """
    import pandas as pd
    import seaborn as sns

    names = list(next(iter(panels.values()), {}))
    height = 0.7 + 0.3 * len(names)
    with panel_grid("strips", len(panels), len(panels), 0.0, height, share_y=True) as (
        figure,
        grid,
    ):
        for axes, (label, repeats) in zip(grid, panels.items(), strict=True):
            parts = {name: finite("strips", {name: repeats[name]})[name] for name in names}
            table = pd.DataFrame(
                [(name, value) for name, values in parts.items() for value in values],
                columns=["design", label],
            )
            sns.stripplot(
                table,
                x=label,
                y="design",
                ax=axes,
                color=INK,
                size=3.0,
                alpha=0.6,
                jitter=False,
            )
            means = [float(np.mean(values)) for values in parts.values()]
            axes.plot(means, range(len(means)), "|", color=MUTED, markersize=11.0)
            axes.set(ylabel="", ylim=(len(names) - 0.5, -0.5))
            axes.locator_params(axis="x", nbins=4)
        return figure


def joint_scatter(
    groups: Mapping[str, Mapping[str, npt.ArrayLike]], colours: Mapping[str, str]
) -> Figure:
    """Draw two numbers over each other with the histogram of each beside, in a colour per group.

    - `groups`: group → label with unit → values; two labels, the first along the abscissa.
    - `colours`: group → colour.
    - raises InputError: not two labels, different lengths, values that are not finite.
    """
    import seaborn as sns
    from matplotlib import style

    labels = list(next(iter(groups.values()), {}))
    if len(labels) != 2:
        raise InputError(f"figure joint_scatter: {len(labels)} numbers, it takes two")
    table = _long("joint_scatter", groups)
    look: dict[str, Any] = {"hue": GROUP, "palette": dict(colours)}
    with style.context(dict(FIGURE_STYLE), after_reset=True):
        grid = sns.JointGrid(table, x=labels[0], y=labels[1], height=_SIDE, **look)
        grid.plot_joint(sns.scatterplot, s=7, alpha=0.5, linewidth=0)
        grid.plot_marginals(sns.histplot, element="step", bins=_BINS, alpha=0.25, linewidth=0.8)
        legend = grid.ax_joint.get_legend()
        if legend is not None:
            legend.set_title("")
        figure: Figure = grid.figure
        return figure


def _long(name: str, groups: Mapping[str, Mapping[str, npt.ArrayLike]]) -> pd.DataFrame:
    """Return the numbers of all groups below each other, with a column of their group."""
    import pandas as pd

    frames = []
    for group, columns in groups.items():
        values: dict[str, RealArray] = finite(name, columns)
        frames.append(pd.DataFrame(values).assign(**{GROUP: group}))
    return pd.concat(frames, ignore_index=True)
