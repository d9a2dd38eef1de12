"""Figures of a modal analysis: poles, shapes, agreement with a truth, rebuilt FRFs, panels."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from deboom.report.figures import (
    BodyMotion,
    CurvePanel,
    curve_panels,
    matrix_map,
    mode_shapes,
    moving_mode_shapes,
    stabilisation_chart,
)
from deboom.study.modal_part import ModalPart, truth_mac

N_REBUILT = 4
"""FRFs shown beside the rebuilt ones: the mount directions and panels that move most."""


def modal_figures(part: ModalPart, truth: npt.ArrayLike | None = None) -> dict[str, bytes]:
    """Draw a modal analysis.

    Parameters
    ----------
    part : ModalPart
    truth : array, shape (n_true, n_output), optional
        True shapes in increasing frequency; columns as ``part.model.outputs``.

    Returns
    -------
    dict of str to bytes
        ``stabilisation``, ``mode_shapes``, ``rebuilt``, then ``mac`` with a truth and
        ``panel_contributions`` with panels; PNG.
    """
    figures = {
        "stabilisation": _stabilisation(part),
        "mode_shapes": mode_shapes(body_motion(part)),
        "rebuilt": _rebuilt(part),
    }
    modes = [f"{value:.1f} Hz" for value in part.model.frequency[: part.n_modes]]
    if truth is not None:
        values = truth_mac(part, truth)
        columns = [f"true {number}" for number in range(1, values.shape[1] + 1)]
        figures["mac"] = matrix_map(values, modes, columns, value_label="MAC [1]")
    if part.panels is not None:
        shares = 100 * part.panels.shares[: part.n_modes]
        figures["panel_contributions"] = matrix_map(
            shares,
            modes,
            part.panels.panels,
            value_label=f"share of the pressure at the {part.panels.ear} [%]",
            limits=(-100.0, 100.0),
            decimals=0,
        )
    return figures


def moving_shapes(part: ModalPart) -> bytes:
    """Return the reported modes in motion, an animated GIF."""
    return moving_mode_shapes(body_motion(part))


def body_motion(part: ModalPart) -> BodyMotion:
    """Return points, normals and shapes as the figures of shapes read them."""
    normals = np.zeros((len(part.places), 3))
    for row, place in enumerate(part.places):
        if place.is_panel:
            normals[row] = next(iter(place.directions.values()))
    modes = zip(part.model.frequency, part.model.damping, strict=True)
    return BodyMotion(
        [place.label for place in part.places],
        np.array([place.position for place in part.places]),
        normals,
        [f"{f:.1f} Hz, ζ {100 * zeta:.1f} %" for f, zeta in list(modes)[: part.n_modes]],
        part.motion,
    )


def _stabilisation(part: ModalPart) -> bytes:
    low, high = part.chart.band
    lines = (part.measured.frequency >= low) & (part.measured.frequency <= high)
    total = np.sqrt(np.sum(np.abs(part.measured.values[lines]) ** 2, axis=(1, 2)))
    return stabilisation_chart(
        part.measured.frequency[lines],
        20 * np.log10(total),
        part.chart.frequency,
        part.chart.order,
        part.chart.stable,
        part.model.frequency,
        level_label="all |a/Q̇|, root of sum of squares [dB re 1/m²]",
    )


def _rebuilt(part: ModalPart) -> bytes:
    """Show the strongest output of each of the strongest places, at the first ear."""
    rebuilt = part.model.rebuilt
    lines = np.isin(part.measured.frequency, rebuilt.frequency)
    measured = part.measured.values[lines][:, :, 0]
    energy = np.sum(np.abs(measured) ** 2, axis=0)
    outputs = list(part.measured.outputs)
    strongest = [
        max((outputs.index(name) for name in place.directions), key=lambda k: float(energy[k]))
        for place in part.places
    ]
    points = [k for k, place in zip(strongest, part.places, strict=True) if not place.is_panel]
    panels = [k for k, place in zip(strongest, part.places, strict=True) if place.is_panel]
    chosen = [
        *sorted(points, key=lambda k: -float(energy[k]))[: N_REBUILT if not panels else 2],
        *sorted(panels, key=lambda k: -float(energy[k]))[:2],
    ]
    frames = [
        CurvePanel(
            f"{outputs[k]}, error {100 * part.model.error[k, 0]:.1f} %",
            rebuilt.frequency,
            {
                "measured": 20 * np.log10(np.abs(measured[:, k])),
                "modes and residuals": 20 * np.log10(np.abs(rebuilt.values[:, k, 0])),
            },
        )
        for k in chosen
    ]
    return curve_panels(
        frames,
        x_label="frequency [Hz]",
        y_label="|a/Q̇| [dB re 1/m²]",
        columns=2,
        dashed=("modes and residuals",),
    )
