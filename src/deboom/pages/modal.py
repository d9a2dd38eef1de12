"""Modes of a vehicle's body as a part of a report."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from deboom import plot
from deboom.arrays import RealArray
from deboom.measurement.body_modes import BodyModes
from deboom.plot import BodyMotion, HeatMap
from deboom.report import Report

if TYPE_CHECKING:
    from deboom.plot.style import Drawing


def append_modes(report: Report, modes: BodyModes, truth: RealArray | None, vehicle: str) -> None:
    """Add a section on the modes, with a table ``modes``, with panels ``panel_contributions`` too.

    - `modes`: of the vehicle.
    - `truth` (n_true, n_output) or None: true shapes in increasing frequency; columns as
      ``modes.model.outputs``.
    - `vehicle`: its name.
    """
    report.section(
        "Modes of the body",
        f"{vehicle}, from the loudspeaker's measurement (thesis, figure 43): poles by least "
        "squares on a common denominator over rising orders, clustered; shapes with residuals for "
        "the modes outside of the band.",
        folded=True,
    )
    caption = "Stabilisation chart (thesis, figure 43): poles over the order of the polynomial."
    report.figure("stabilisation", lambda: _stabilisation(modes), caption)
    report.figure(
        "mode_shapes",
        lambda: plot.mode_shapes(body_motion(modes)),
        "Shapes of the modes at the mounts and panels, in motion; carrier and panels are scaled "
        "apart.",
    )
    titles = [f"{value:.1f} Hz" for value in modes.frequency]
    panels = modes.panels
    numbers = [f"mode {n}" for n in range(1, modes.n_modes + 1)]
    if panels is not None:
        shares = 100 * panels.shares[: modes.n_modes]
        label = f"share of the pressure at the {panels.ear} [%]"
        brought = HeatMap(
            title=label,
            rows=tuple(titles),
            columns=tuple(panels.panels),
            values=shares,
            limits=(-100.0, 100.0),
            decimals=0,
        )
        report.figure(
            "panel_contributions",
            lambda: plot.heat_maps([brought], columns=1),
            "What each panel brings to the pressure at the ear in each mode.",
        )
    caption = f"Median over the orders with its spread; {modes.model.verdict}"
    report.table("modes", _mode_table(modes, truth, numbers), caption)
    if panels is not None:
        table = pd.DataFrame(shares, columns=[f"{panel} [%]" for panel in panels.panels])
        table.insert(0, "mode", numbers)
        report.table("panel_contributions", table)


def body_motion(modes: BodyModes) -> BodyMotion:
    """Return points, normals and shapes as the figures of shapes read them."""
    normals = np.zeros((len(modes.places), 3))
    for row, place in enumerate(modes.places):
        if place.is_panel:
            normals[row] = next(iter(place.directions.values()))
    damping = modes.model.damping[: modes.n_modes]
    return BodyMotion(
        [place.label for place in modes.places],
        np.array([place.position for place in modes.places]),
        normals,
        [f"{f:.1f} Hz, ζ {100 * z:.1f} %" for f, z in zip(modes.frequency, damping, strict=True)],
        modes.motion,
    )


def _mode_table(modes: BodyModes, truth: RealArray | None, numbers: list[str]) -> pd.DataFrame:
    """One row per mode, with its spread over the orders."""
    clusters = modes.model.clusters[: modes.n_modes]
    table = pd.DataFrame(
        {
            "mode": numbers,
            "frequency [Hz]": [c.frequency for c in clusters],
            "spread of frequency [Hz]": [c.frequency_spread for c in clusters],
            "damping ratio [%]": [100 * c.damping for c in clusters],
            "spread of damping [%]": [100 * c.damping_spread for c in clusters],
            "orders that agree [%]": [100 * c.share for c in clusters],
            "complexity 1 - MPC [%]": 100 * modes.model.complexity[: modes.n_modes],
            "residues of one shape [%]": 100 * modes.model.rank_one[: modes.n_modes],
            "unexplained nearby [%]": 100 * modes.model.nearby_error[: modes.n_modes],
        }
    )
    if truth is not None:
        table["MAC with the truth [1]"] = np.diag(modes.mac(truth))
        table["MAC of mount points [1]"] = np.diag(modes.mac(truth, mount_points_only=True))
    return table


def _stabilisation(modes: BodyModes) -> Drawing:
    """Draw the poles over the sum of all FRFs."""
    chart, measured = modes.chart, modes.measured
    lines = (measured.frequency >= chart.band[0]) & (measured.frequency <= chart.band[1])
    total = np.sqrt(np.sum(np.abs(measured.values[lines]) ** 2, axis=(1, 2)))
    return plot.stabilisation_chart(
        measured.frequency[lines],
        20 * np.log10(total),
        chart.frequency,
        chart.order,
        chart.stable,
        modes.model.frequency,
        level_label="all |a/Q̇|, root of sum of squares [dB re 1/m²]",
    )
