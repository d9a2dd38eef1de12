"""How the search went."""

from __future__ import annotations

import numpy.typing as npt

from deboom.report.figures.canvas import finite, png, styled_figure
from deboom.report.style import ACCENT, HALF_WIDTH


def convergence(
    generation: npt.ArrayLike, hypervolume: npt.ArrayLike, *, hypervolume_label: str
) -> bytes:
    """Draw the hypervolume over the generations of one search.

    Parameters
    ----------
    generation : array, shape (n,)
        Number of each generation [1].
    hypervolume : array, shape (n,)
        Of the front found so far [unit in the label].
    hypervolume_label : str
        Axis label with unit.

    Returns
    -------
    bytes
        PNG.

    Raises
    ------
    InputError
        Arrays of different lengths or values that are not finite.
    """
    from matplotlib.ticker import MaxNLocator

    curve = finite("convergence", {"generation": generation, "hypervolume": hypervolume})
    with styled_figure(HALF_WIDTH, 2.5) as figure:
        axes = figure.add_subplot()
        axes.plot(curve["generation"], curve["hypervolume"], color=ACCENT, linewidth=1.5)
        axes.plot(curve["generation"][-1], curve["hypervolume"][-1], "o", color=ACCENT)
        axes.set_xlabel("generation [1]")
        axes.set_ylabel(hypervolume_label)
        axes.xaxis.set_major_locator(MaxNLocator(6, integer=True))
        axes.margins(x=0.03)
        return png(figure)
