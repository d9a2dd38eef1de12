"""Which vehicle has which part number: one row per part, one column per vehicle."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.report.figures.canvas import png, styled_figure
from deboom.report.style import FULL_WIDTH, VEHICLE_PALETTE


def shared_parts(
    parts: Sequence[str], vehicles: Sequence[str], labels: npt.NDArray[np.str_]
) -> bytes:
    """Draw the part number of each part in each vehicle; one colour per number of a row.

    Parameters
    ----------
    parts, vehicles : sequence of str
        Of rows and columns.
    labels : array of str, shape (n_parts, n_vehicles)
        Part numbers.

    Returns
    -------
    bytes
        PNG.

    Raises
    ------
    InputError
        Labels of another shape.
    """
    if labels.shape != (len(parts), len(vehicles)):
        raise InputError(
            f"figure shared_parts: {labels.shape} labels for {len(parts)} parts in "
            f"{len(vehicles)} vehicles"
        )
    from matplotlib.patches import Rectangle

    turned = max(len(name) for name in vehicles) * len(vehicles) > 70
    with styled_figure(FULL_WIDTH, 0.75 + 0.36 * len(parts) + 0.35 * turned) as figure:
        axes = figure.add_subplot()
        axes.grid(visible=False)
        for row, names in enumerate(labels):
            numbers = list(dict.fromkeys(names.tolist()))
            for column, name in enumerate(names.tolist()):
                colour = VEHICLE_PALETTE[numbers.index(name) % len(VEHICLE_PALETTE)]
                axes.add_patch(
                    Rectangle((column - 0.47, row - 0.42), 0.94, 0.84, facecolor=colour, alpha=0.32)
                )
                axes.text(column, row, name, ha="center", va="center", fontweight="bold")
        axes.set_xlim(-0.6, len(vehicles) - 0.4)
        axes.set_ylim(len(parts) - 0.5, -0.5)
        axes.set_xticks(range(len(vehicles)), vehicles, rotation=45 if turned else 0)
        axes.set_yticks(range(len(parts)), parts)
        axes.tick_params(length=0)
        for side in ("left", "bottom"):
            axes.spines[side].set_visible(False)
        return png(figure)
