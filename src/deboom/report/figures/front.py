"""The Pareto front: what the search offers, where the baseline is, which designs were picked."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from deboom.report.figures.canvas import finite, png, styled_figure
from deboom.report.figures.labels import freeze_layout, place_labels
from deboom.report.style import FULL_WIDTH, INK, VEHICLE_PALETTE

_PICK_MARKERS = ("o", "D", "^", "s", "P", "v")
_FRONT_COLOUR = "#4C86B0"
_ERROR_COLOUR = "#C3D7E6"


def pareto_front(
    mean: npt.ArrayLike,
    sigma: npt.ArrayLike,
    mean_error: npt.ArrayLike,
    sigma_error: npt.ArrayLike,
    baseline: tuple[float, float],
    picks: Mapping[str, tuple[float, float]],
    *,
    mean_label: str,
    sigma_label: str,
) -> bytes:
    """Draw the two objectives of the front, both minimised, with baseline and named picks.

    Parameters
    ----------
    mean, sigma : array, shape (n_front,)
        Objectives [unit in the label].
    mean_error, sigma_error : array, shape (n_front,)
        Standard errors of the objectives, drawn as bars of ± one error [unit of the label].
    baseline : (float, float)
        Mean and sigma of the nominal design [units of the labels].
    picks : mapping of str to (float, float)
        Mean and sigma of each named design [units of the labels].
    mean_label, sigma_label : str
        Axis labels with units.

    Returns
    -------
    bytes
        PNG.

    Raises
    ------
    InputError
        Arrays of different lengths or values that are not finite.
    """
    front = finite(
        "pareto_front",
        {"mean": mean, "sigma": sigma, "mean_error": mean_error, "sigma_error": sigma_error},
    )
    finite("pareto_front", {"baseline": baseline})
    finite("pareto_front", picks)
    chosen = _by_place(picks)
    order = np.argsort(front["mean"], kind="stable")
    points = np.column_stack([front["mean"], front["sigma"]])[order]
    with styled_figure(FULL_WIDTH, 4.0) as figure:
        axes = figure.add_subplot()
        axes.errorbar(
            points[:, 0],
            points[:, 1],
            xerr=front["mean_error"][order],
            yerr=front["sigma_error"][order],
            fmt="o",
            markersize=3.6,
            color=_FRONT_COLOUR,
            ecolor=_ERROR_COLOUR,
            elinewidth=0.8,
            label=f"Pareto front, {len(points)} designs (± standard error)",
        )
        axes.plot(*baseline, "X", color=INK, markersize=8, zorder=4)
        for place, position in enumerate(chosen):
            axes.plot(
                *position,
                marker=_PICK_MARKERS[place % len(_PICK_MARKERS)],
                color=VEHICLE_PALETTE[1],
                markeredgecolor="white",
                markersize=8.5,
                zorder=5,
            )
        axes.margins(0.08)
        axes.set_xlabel(f"← better    {mean_label}")
        axes.set_ylabel(f"← better    {sigma_label}")
        axes.ticklabel_format(useOffset=False, style="plain")
        figure.legend(loc="outside upper right")
        freeze_layout(figure)
        place_labels(
            axes,
            np.array([baseline, *chosen]),
            ["baseline", *chosen.values()],
            [INK] + [VEHICLE_PALETTE[1]] * len(chosen),
            obstacles=points,
            size=9.0,
        )
        return png(figure)


def _by_place(
    picks: Mapping[str, tuple[float, float]],
) -> dict[tuple[float, float], str]:
    """Join the names of picks that are one and the same design."""
    joined: dict[tuple[float, float], str] = {}
    for name, place in picks.items():
        joined[place] = f"{joined[place]}, {name}" if place in joined else name
    return joined
