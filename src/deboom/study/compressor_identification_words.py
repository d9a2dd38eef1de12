"""Captions and number formats of an identified compressor's page."""

from __future__ import annotations

import math
from collections.abc import Mapping

import pandas as pd

from deboom.report.page import Picture

SHOWN_ROWS = 12
"""Of long tables; the files of the run hold them all."""
DIGITS = 4

CAPTIONS: Mapping[str, str] = {
    "figure_53_inertance": "Inertance at the virtual point (thesis, figure 53): response in rows, "
    "excitation in columns. Where the dashed curve leaves the measured one far below the diagonal "
    "entries, the misplacement of sensors and impacts leaks from the large entries into the small "
    "ones; noise is the ragged part.",
    "figure_54_gain": "Gain factor of the rubber (thesis, figure 54), its real part 1 at 20 Hz, "
    "since the scale of the gain and that of the stiffness are one number. The last curve is the "
    "loss that causality ties to the rise of the real part; a rubber several times off would not "
    "be plausible.",
    "figure_55_correlation": "Likeness of measured (places of the sheet) and identified (thesis, "
    "figure 55), numbers rounded down. Modes by their shapes at the accelerometers, in 10–30 Hz. "
    "From 100 Hz on there are no modes: there the FRFs themselves are compared, entry by entry.",
    "figure_56_condition": "Condition number over frequency (thesis, figure 56) of one measured "
    "matrix, with lengths in three units.",
    "figure_57_rotations": "Rotations Ri–Ri (thesis, figure 57), inertance and apparent mass.",
    "figure_58_translations": "Translations Ti–Ti (thesis, figure 58), inertance and apparent "
    "mass.",
    "figure_59_couplings": "Couplings Ti–Tj (thesis, figure 59). By the places of the sheet, the "
    "apparent mass misses the model; by the calibrated places it follows it. What looked like a "
    "fault of the inversion is misplacement.",
    "figure_66_inertance": "All entries of the inertance, real and imaginary (thesis, figure 66).",
    "figure_67_apparent_mass": "All entries of the apparent mass, real and imaginary (thesis, "
    "figure 67).",
    "knowledge": "How much of what was not known before the test is not known after it. A bar to "
    "the right end: the test has said nothing.",
}


def pictures_of(figures: Mapping[str, bytes], stems: tuple[str, ...]) -> tuple[Picture, ...]:
    """Give the figures whose names begin so their captions, in this order."""
    return tuple(
        Picture(png, alt=CAPTIONS[name], caption=CAPTIONS[name])
        for stem in stems
        for name, png in figures.items()
        if name.startswith(stem)
    )


def in_words(table: pd.DataFrame) -> pd.DataFrame:
    """Write numbers of different units in one column with equally many digits."""
    words = table.copy()
    for name in table.columns:
        if table[name].dtype.kind == "f" and not str(name).endswith("]"):
            digits = 2 if "deviation" in str(name) else DIGITS
            words[name] = [_digits(float(value), digits) for value in table[name]]
    return words


def _digits(value: float, digits: int) -> str:
    if not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    decimals = max(digits - 1 - math.floor(math.log10(abs(value))), 0)
    return f"{value:.{min(decimals, 6)}f}".replace("-", "−")
