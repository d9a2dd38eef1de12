"""Figures of allocated tolerances."""

from __future__ import annotations

import numpy as np

from deboom.report import figures
from deboom.report.figures import CurvePanel, MarkedPanel
from deboom.report.style import mount_colours, mount_of
from deboom.study.tolerance_allocation import AllocationStudy
from deboom.study.tolerance_allocation_tables import MILLI, PERCENT


def allocation_figures(study: AllocationStudy) -> dict[str, bytes]:
    """Draw all pictures of the page; file stem → PNG."""
    names = study.allocator.names
    colours = mount_colours([mount.name for mount in study.chosen.platform.mounts])
    of_rows = [colours[mount_of(name)] for name in names]
    scale = MILLI * study.per_line
    today, cheapest = study.marginal_today, study.marginal_cheapest
    asked, cost, uniform = study.curve
    by_sigma = study.limits is None
    return {
        "marginal_values": figures.marked_bars(
            names,
            of_rows,
            [
                MarkedPanel(
                    "σ per % of tolerance [0.001 dB]",
                    scale * today.sigma_per_percent,
                    scale * cheapest.sigma_per_percent,
                ),
                MarkedPanel(
                    "σ that one unit of cost takes away [0.001 dB]",
                    scale * np.nan_to_num(today.sigma_per_cost),
                    scale * np.nan_to_num(cheapest.sigma_per_cost),
                ),
            ],
            bar_label="at today's tolerances",
            mark_label="at the cheapest tolerances",
        ),
        "allocation": figures.marked_bars(
            names,
            of_rows,
            [
                MarkedPanel(
                    "tolerance ± [%]",
                    PERCENT * study.cheapest.tolerance,
                    PERCENT * study.uniform.tolerance,
                ),
                MarkedPanel("cost [1]", study.cheapest.cost, study.uniform.cost),
            ],
            bar_label="cheapest",
            mark_label="one tolerance everywhere",
        ),
        "cost_of_target": figures.curve_panels(
            [
                CurvePanel(
                    "same design, same target",
                    asked if by_sigma else PERCENT * asked,
                    {"cheapest tolerances": cost, "one tolerance everywhere": uniform},
                )
            ],
            x_label="σ of the mean level [dB]"
            if by_sigma
            else "parts × vehicles within limits [%]",
            y_label="cost of the tolerances [1]",
            columns=1,
        ),
    }
