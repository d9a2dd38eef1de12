"""Figures of an identified compressor, numbered as in the thesis."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from deboom.compressor.gain_parameters import gain_from_parameters
from deboom.compressor.identifiability import PRIOR_DOMINATED
from deboom.compressor.likeness import frac, modal_likeness
from deboom.compressor.linear_start import START_GAIN
from deboom.compressor.quantities import REFERENCE_FREQUENCY, gain_deviation
from deboom.errors import InputError
from deboom.report.figures import (
    HeatMap,
    SpectrumPanel,
    curve_matrix,
    heat_maps,
    ratio_bars,
    spectra_panels,
)

if TYPE_CHECKING:
    from deboom.arrays import ComplexArray, RealArray
    from deboom.study.compressor_identification import IdentifiedTest

MOTIONS = ("Tx", "Ty", "Tz", "Rx", "Ry", "Rz")
INERTANCE_UNITS = ("1/kg", "1/(kg m)", "1/(kg m²)")
MASS_UNITS = ("kg", "kg m", "kg m²")
SHEET, CALIBRATED, MODEL = "measured, places of the sheet", "measured, calibrated", "identified"
THESIS_CONDITION = 450.0
COUPLINGS = {
    "figure_57_rotations": ((3, 3), (4, 4), (5, 5)),
    "figure_58_translations": ((0, 0), (1, 1), (2, 2)),
    "figure_59_couplings": ((0, 1), (0, 2), (1, 2)),
}
WIDE_BAND = 1.96
"""Standard deviations of a 95 % interval."""


def figures_of(test: IdentifiedTest) -> dict[str, bytes]:
    """Draw all pictures of one compressor; file stem → PNG."""
    found, lines = test.found, test.found.inertance.frequency
    sheet = found.inertance.values
    calibrated = found.calibrated.at_virtual_point(found.raw.frf.values)
    model = found.calibrated.model.inertance(lines)
    inertances = (sheet, calibrated, model)
    masses = [np.asarray(np.linalg.inv(values), dtype=complex) for values in inertances]
    bands = test.options.bands
    figures = {
        "figure_53_inertance": curve_matrix(
            MOTIONS,
            lines,
            {SHEET: np.abs(sheet), MODEL: np.abs(model)},
            units=INERTANCE_UNITS,
            what="|inertance|",
            dashed=(MODEL,),
            fitted=bands,
            logarithmic=True,
        ),
        "figure_54_gain": _gain(test),
        "figure_55_correlation": _likeness(test, inertances, masses),
        "figure_56_condition": _condition(test, sheet),
    }
    for stem, entries in COUPLINGS.items():
        figures[stem] = _comparison(lines, inertances, masses, entries, bands)
    for stem, what, values, units in (
        ("figure_66_inertance", "inertance", inertances, INERTANCE_UNITS),
        ("figure_67_apparent_mass", "apparent mass", masses, MASS_UNITS),
    ):
        curves = {
            f"{part}, measured, calibrated": of(values[1])
            for part, of in (("Re", np.real), ("Im", np.imag))
        }
        curves |= {
            f"{part}, identified": of(values[2]) for part, of in (("Re", np.real), ("Im", np.imag))
        }
        figures[stem] = curve_matrix(
            MOTIONS,
            lines,
            curves,
            units=units,
            what=what,
            dashed=("Re, identified", "Im, identified"),
        )
    if test.thesis is not None:
        known = test.thesis.known
        figures["knowledge"] = ratio_bars(
            known.names,
            known.ratio,
            limit=PRIOR_DOMINATED,
            x_label="deviation after over before the test [1]",
            below="the test says most of it",
            above="prior-dominated: the drawing says most of it",
        )
    return figures


def _gain(test: IdentifiedTest) -> bytes:
    """Figure 54: both parts, 1 at the reference, with their 95 % interval and the truth."""
    found = test.found
    lines = found.inertance.frequency
    gain = found.calibrated.model.gain
    identified = gain.at(lines) / gain.real.at(REFERENCE_FREQUENCY)
    deviation = gain_deviation(found.calibrated, lines)
    before = gain_from_parameters(START_GAIN, REFERENCE_FREQUENCY).at(lines)
    true = None
    if test.truth is not None:
        law = test.truth.model.gain
        true = law.at(lines) / law.real.at(REFERENCE_FREQUENCY)
    panels = []
    for title, of in (("Re v: stiffness", np.real), ("Im v: damping", np.imag)):
        curves: dict[str, RealArray] = {"medium rubber, before": of(before), MODEL: of(identified)}
        if true is not None:
            curves["truth"] = of(true)
        if of is np.imag:
            causal = gain.expected_loss(lines) / gain.real.at(REFERENCE_FREQUENCY)
            curves["loss that causality expects of Re v"] = causal
        half = WIDE_BAND * of(deviation)
        low, high = of(identified) - half, of(identified) + half
        panels.append(
            SpectrumPanel(title, "gain [1]", lines, curves, ranges={"95 % interval": (low, high)})
        )
    return spectra_panels(panels, columns=2, dashed=("truth",), fitted=test.options.bands)


def _likeness(
    test: IdentifiedTest,
    inertances: Sequence[ComplexArray],
    masses: Sequence[ComplexArray],
) -> bytes:
    """Figure 55: modes' MAC, and FRAC of every entry in each band."""
    found = test.found
    lines = found.inertance.frequency
    maps = []
    try:
        modes = modal_likeness(found)
    except InputError:  # the linear estimate has no modes: nothing to compare
        modes = None
    if modes is not None:
        numbers = tuple(str(number) for number in range(1, 7))
        title = "Modes, MAC"
        maps.append(HeatMap(title, numbers, numbers, modes, "linear estimate", "identified"))
    for what, values in (("inertance", inertances), ("app. mass", masses)):
        for low, high in test.options.bands:
            values_in_band = frac(values[0], values[2], lines, (low, high))
            title = f"FRAC, {what}, {low:g}–{high:g} Hz"
            maps.append(HeatMap(title, MOTIONS, MOTIONS, values_in_band, "", "excitation"))
    return heat_maps(maps)


def _condition(test: IdentifiedTest, inertance: ComplexArray) -> bytes:
    """Figure 56: condition number in SI units and with a characteristic length."""
    lines, length = test.found.inertance.frequency, test.found.length
    panel = SpectrumPanel(
        "Condition number of the inertance at the virtual point",
        "condition number [1]",
        lines,
        {
            "lengths in mm": condition_numbers(inertance, 1e-3),
            "lengths in m (SI)": condition_numbers(inertance, 1.0),
            f"lengths in {1e3 * length:.0f} mm, the radius of gyration": condition_numbers(
                inertance, length
            ),
        },
        levels={"450, the thesis": THESIS_CONDITION},
        logarithmic=True,
    )
    return spectra_panels([panel], columns=1)


def condition_numbers(inertance: ComplexArray, length: float) -> RealArray:
    """Condition number of each line with lengths counted in units of `length` [m]."""
    unit = np.repeat([1.0, length], 3)
    return np.asarray(np.linalg.cond(inertance * np.outer(unit, unit)))


def _comparison(
    lines: RealArray,
    inertances: Sequence[ComplexArray],
    masses: Sequence[ComplexArray],
    entries: Sequence[tuple[int, int]],
    bands: Sequence[tuple[float, float]],
) -> bytes:
    """Figures 57 to 59: three entries, inertance and apparent mass, both parts."""
    panels = []
    for what, values, units in (
        ("inertance", inertances, INERTANCE_UNITS),
        ("app. mass", masses, MASS_UNITS),
    ):
        for part, of in (("Re", np.real), ("Im", np.imag)):
            for row, column in entries:
                unit = units[(row > 2) + (column > 2)]
                panels.append(
                    SpectrumPanel(
                        f"{part} {what}, {MOTIONS[row]}–{MOTIONS[column]}",
                        f"[{unit}]",
                        lines,
                        {
                            label: of(one[:, row, column])
                            for label, one in zip((SHEET, CALIBRATED, MODEL), values, strict=True)
                        },
                    )
                )
    return spectra_panels(panels, columns=3, dashed=(MODEL,), fitted=bands)
