"""Bars of how much is left of what was not known before."""

from __future__ import annotations

from collections.abc import Sequence

import numpy.typing as npt

from deboom.report.figures.canvas import finite, png, styled_figure
from deboom.report.style import FULL_WIDTH, INK, TRACK, VEHICLE_PALETTE

_BAR_HEIGHT = 0.175


def ratio_bars(
    names: Sequence[str],
    ratios: npt.ArrayLike,
    *,
    limit: float,
    x_label: str,
    below: str,
    above: str,
) -> bytes:
    """Draw one bar per name from 0 to 1, in two columns, coloured by a limit.

    Parameters
    ----------
    names : sequence of str
        In reading order.
    ratios : array, shape (n,)
        From 0 to 1 [1].
    limit : float
        Where the verdict changes [1].
    x_label : str
        What the ratio is.
    below, above : str
        The verdict on either side of the limit, for the legend.

    Returns
    -------
    bytes
        PNG.

    Raises
    ------
    InputError
        Arrays of different lengths, values that are not finite.
    """
    from matplotlib.patches import Patch

    values = finite("ratio_bars", {"names": range(len(names)), "ratios": ratios})["ratios"]
    half = -(-len(names) // 2)
    good, bad = VEHICLE_PALETTE[0], VEHICLE_PALETTE[1]
    with styled_figure(FULL_WIDTH, 0.9 + half * _BAR_HEIGHT) as figure:
        grid = figure.subplots(1, 2, sharex=True)
        for axes, part in zip(grid, (slice(None, half), slice(half, None)), strict=True):
            shown, own = values[part], list(names[part])
            axes.barh(range(len(own)), [1.0] * len(own), color=TRACK, height=0.72)
            axes.barh(
                range(len(own)),
                shown,
                color=[bad if r > limit else good for r in shown],
                height=0.72,
            )
            axes.axvline(limit, color=INK, linewidth=0.8, ls=":")
            axes.set_yticks(range(len(own)), own, fontsize=7)
            axes.set_ylim(half - 0.4, -0.6)
            axes.set_xlim(0, 1)
            axes.grid(axis="y", visible=False)
            axes.tick_params(axis="y", length=0)
            axes.set_xlabel(x_label)
        figure.legend(
            handles=[Patch(color=good, label=below), Patch(color=bad, label=above)],
            loc="outside lower center",
            ncols=2,
        )
        return png(figure)
