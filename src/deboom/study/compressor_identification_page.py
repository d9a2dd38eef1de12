"""The page of an identified compressor: what was found, and how far it may be believed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from deboom.compressor.identifiability import PRIOR_DOMINATED
from deboom.compressor.identify import ALARM
from deboom.compressor.quantities import REFERENCE_FREQUENCY
from deboom.report.page import Headline, Page, Picture, Section, Table

if TYPE_CHECKING:
    from deboom.compressor.thesis_fit import ThesisFit
    from deboom.study.compressor_identification import IdentifiedTest

NARROW: Mapping[str, str] = {
    "parameter": "parameter",
    "unit": "unit",
    "start": "start",
    "fitted": "fitted",
    "truth": "truth",
    "posterior deviation": "±",
    "posterior over prior [1]": "left [1]",
    "verdict": "verdict",
}
"""Columns of the table of 44 numbers that the page has room for, and their short names."""
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


def page_of(
    tests: Sequence[IdentifiedTest],
    tables: Mapping[str, pd.DataFrame],
    figures: Mapping[str, bytes],
    condition: float,
) -> Page:
    """Write the page: the first compressor in detail, errors of all.

    Parameters
    ----------
    tests : sequence of IdentifiedTest
    tables : mapping of str to DataFrame
        From `tables_of`.
    figures : mapping of str to bytes
        From `figures_of`; may be empty.
    condition : float
        Scaled condition number near 100 Hz [1].

    Returns
    -------
    Page
    """
    first = tests[0]
    sections = [
        _asked(tests),
        _sound(first, tables, figures, condition),
        _found(first, tables, figures),
        _compared(tables, figures),
        _cannot(first, tables, figures),
    ]
    if first.identical is not None:
        sections.append(_identical(first, tables))
    sections.append(_placement(tables))
    if "cases" in tables:
        sections.append(_truth(tables["cases"]))
    return Page(
        title=f"Identified compressor: {first.found.test.name}",
        question=(
            "Which mass, centre of gravity, inertia, mount stiffness and rubber explain the hammer "
            "test of a compressor in its vehicle, and how far may each be believed?"
        ),
        sections=tuple(sections),
        headlines=_headlines(first),
        warnings=_warnings(first),
    )


def _headlines(test: IdentifiedTest) -> tuple[Headline, ...]:
    model = test.found.calibrated.model
    lines = [
        Headline(f"{model.mass:.3f} kg", "mass"),
        Headline(
            f"{test.found.calibrated.reduced_chi:.2f}",
            f"residuals over noise; alarm above {ALARM:g}",
        ),
        Headline(f"{1e3 * test.found.length:.0f} mm", "characteristic length"),
    ]
    if test.thesis is not None:
        seen = test.thesis.seen
        lines.append(
            Headline(f"{seen.rank} of {len(seen.names)}", "numbers of the thesis that are seen")
        )
    return tuple(lines)


def _warnings(test: IdentifiedTest) -> tuple[str, ...]:
    words = list(test.found.alarms)
    if test.found.test.weighed_mass is None:
        words.append(
            "The compressor was not weighed: its mass, inertia and stiffness are known no better "
            "than the ratio of hammer and accelerometers. Weigh it."
        )
    if test.identical is not None and not test.identical.holds:
        words.append(
            f"Identical mounts are refuted: they leave residuals {test.identical.chi_ratio:.2f} "
            "times as large as mounts that may differ."
        )
    return tuple(words)


def _asked(tests: Sequence[IdentifiedTest]) -> Section:
    first = tests[0]
    test, found = first.found.test, first.found
    bands = " and ".join(f"{low:g}–{high:g} Hz" for low, high in first.options.bands)
    weighed = (
        "It was not weighed."
        if test.weighed_mass is None
        else f"On the scales it has {test.weighed_mass:.4g} ± {test.weighed_mass_deviation:.1g} kg."
    )
    more = (
        ""
        if len(tests) == 1
        else f"\n\nThis page shows one compressor in detail; {len(tests)} were identified in all, "
        "and the last section compares them with their truth, which no identification has read."
    )
    return Section(
        "What was asked, and with which data",
        f"{len(test.sensors)} triaxial accelerometers and {len(test.impacts)} impacts of a roving "
        f"hammer, {test.n_averages} hits each: {test.frf.values[0].size} FRFs, "
        f"{test.frf.frequency.size} lines from {test.frf.frequency[0]:g} to "
        f"{test.frf.frequency[-1]:g} Hz. {weighed} {np.count_nonzero(found.fitted)} lines in "
        f"{bands} were fitted.\n\nThe compressor is a rigid body on mounts without rotational "
        "stiffness of their own: 10 numbers of mass, 20 of stiffness at the virtual point, 5 of "
        "the rubber's gain. Gains, places and angles of all sensors and impacts "
        f"({first.found.calibrated.errors.size} numbers) are unknowns as well, held by their "
        "tolerances: self-calibration. The start is linear and needs no drawing." + more,
    )


def _sound(
    test: IdentifiedTest,
    tables: Mapping[str, pd.DataFrame],
    figures: Mapping[str, bytes],
    condition: float,
) -> Section:
    length = test.found.length
    checks = tables["quality"].assign(limit=tables["quality"]["limit"].str.replace(" ", "\u00a0"))
    return Section(
        "Is the test sound?",
        f"{test.found.rigid.statement}\n\nThe condition number of the inertance near 100 Hz is "
        f"{condition:.1f}, with rotations counted as motion at the characteristic length of "
        f"{1e3 * length:.0f} mm, the radius of gyration. In SI units the same matrix has "
        "several hundred, in millimetres several thousand: on the mass line the number in SI is "
        "nothing but mass over the smallest moment of inertia, m/I. The 450 that the thesis finds "
        "above 50 Hz says that a body of 7 kg has 155 kg cm², and nothing of the quality of a "
        "measurement or of its inversion. Near a rigid-body mode the scaled number is larger: "
        "there the response is one shape, and noise in the others grows.",
        figures=_pictures(figures, ("figure_53", "figure_56")),
        tables=(
            Table(
                checks,
                "Checks in the order in which a laboratory repairs things. A reversed or swapped "
                "channel would have stopped the identification.",
                {"number [1]": 3},
            ),
        ),
    )


def _found(
    test: IdentifiedTest, tables: Mapping[str, pd.DataFrame], figures: Mapping[str, bytes]
) -> Section:
    truth = " The truth of the virtual compressor is for comparison only." if test.truth else ""
    return Section(
        "The identified compressor",
        "Origin and axes are those of the position sheet. The inertia is about the centre of "
        "gravity, products with their sign as matrix elements; it is that of a possible body by "
        f"construction. K is the stiffness at the virtual point at {REFERENCE_FREQUENCY:g} Hz, "
        f"where the real part of the gain is 1.{truth}",
        figures=_pictures(figures, ("figure_54",)),
        tables=(
            Table(
                _as_words(tables["parameters"]),
                "Start: linear, by the places of the sheet. Standard deviation: of noise, "
                "placement, calibration and scales together.",
            ),
            Table(
                tables["modes"],
                "Rigid-body modes. Energy: share of each motion in the kinetic energy; coupling "
                "through the mass matrix can make it negative.",
                {name: 0 for name in map(str, tables["modes"]) if name.startswith("energy")},
            ),
        ),
    )


def _compared(tables: Mapping[str, pd.DataFrame], figures: Mapping[str, bytes]) -> Section:
    return Section(
        "Measured against identified",
        "Lines and impacts that took no part in the fit are predicted as well as those that did, "
        "or the model is wrong. Of a held-out impact, its own misplacement is estimated before it "
        "is judged; everything else comes from a fit that has not seen it.",
        figures=_pictures(
            figures, ("figure_55", "figure_57", "figure_58", "figure_59", "figure_66", "figure_67")
        ),
        tables=(Table(tables["held_out"], "Predictions of what was held out."),),
    )


def _cannot(
    test: IdentifiedTest, tables: Mapping[str, pd.DataFrame], figures: Mapping[str, bytes]
) -> Section:
    dominated = test.found.known.prior_dominated
    text = (
        "The 35 numbers of the minimal model are all seen. "
        + (
            f"Of them {', '.join(dominated)} come mostly from what was known before. "
            if dominated
            else "None of them comes mostly from what was known before. "
        )
        + "Many hang together, since the position error of one sensor moves several: the strongest "
        "correlations are listed."
    )
    shown = [
        Table(
            tables["correlations"].head(SHOWN_ROWS),
            f"The strongest of {len(tables['correlations'])} correlations beyond 0.8 in size.",
        )
    ]
    if test.thesis is not None:
        text += "\n\n" + _thesis_words(test.thesis)
        shown = [
            Table(tables["null_space"], "Changes that no test at one virtual point can see."),
            Table(tables["fits"], "Optimisers of the 44-number fit, one cost."),
            Table(
                _as_words(tables["identifiability"]).rename(columns=NARROW)[
                    [name for name in NARROW.values() if name in _narrow_columns(tables)]
                ],
                "The thesis's numbers, from the drawing (its table 10) to the fit (its table 11). "
                "±: what is left of the bound, which counts as 1 σ before the test; left: its "
                "share. Invisible: nothing but the drawing is known of it. Prior-dominated: more "
                f"than {PRIOR_DOMINATED:.0%} is left. With others only: a part of it lies in a "
                "combination that no test at one point can see; read it together with the others, "
                "or not at all. Both judge what the self-calibrated test knows; the fit itself "
                "takes the places of the sheet for exact and may be further off.",
            ),
            *shown,
        ]
    else:
        text += (
            "\n\nThe test has no drawing: the thesis's single mount positions, rotations and "
            "stiffnesses were not fitted."
        )
    return Section(
        "What this test can and cannot say",
        text,
        figures=_pictures(figures, ("knowledge",)),
        tables=tuple(shown),
    )


def _thesis_words(thesis: ThesisFit) -> str:
    seen = thesis.seen
    held = (
        f"The fit ends with {', '.join(thesis.fit.at_bound)} at a bound."
        if thesis.fit.at_bound
        else "No number ends at a bound."
    )
    return (
        f"The thesis fits {len(seen.names)} numbers. A hammer test at one virtual point sees "
        f"{seen.rank} combinations of them, whatever its noise: {len(seen.null_space)} changes "
        "leave every FRF as it is; the first table names them. Rotation x is a mount's rotation "
        "about its own axis: it matters only as far as the two radial stiffnesses differ. "
        "Mass, centre of gravity and inertia take no part in any of these and are unique; "
        "single positions, rotations and stiffnesses of mounts are not, and equally good fits "
        f"differ by millimetres and degrees. {held} Report the stiffness at the virtual point "
        "and the gain instead; or, where all mounts are one round part, enforce that "
        "(--identical-mounts)."
    )


def _identical(test: IdentifiedTest, tables: Mapping[str, pd.DataFrame]) -> Section:
    fit = test.identical
    assert fit is not None
    verdict = (
        "as well as mounts that may differ: the assumption holds"
        if fit.holds
        else f"{fit.chi_ratio:.2f} times worse than mounts that may differ: the assumption is wrong"
    )
    return Section(
        "Identical round mounts",
        "With one axial and one radial stiffness for all mounts, nothing stays invisible: place "
        f"and tilt of each mount are found. This explains the test {verdict}. Offsets are along "
        "the axes of the sheet, tilts about the mount's own radial axes, both from the drawing; "
        f"stiffness at {REFERENCE_FREQUENCY:g} Hz.",
        tables=(Table(_as_words(tables["identical_mounts"]), "Mounts as found."),),
    )


def _placement(tables: Mapping[str, pd.DataFrame]) -> Section:
    table = tables["placement"]
    size = (table["found"] / table["prior deviation"]).abs()
    shown = table.loc[size.sort_values(ascending=False).index].head(SHOWN_ROWS)
    return Section(
        "What the test says of its own sensors",
        "Errors of gain, place and angle against the position sheet, the largest in units of "
        "their tolerance first; placement.csv has all. A posterior deviation near the prior one: "
        "the test cannot tell.",
        tables=(Table(_as_words(shown), "Largest errors of placement and calibration."),),
    )


def _truth(cases: pd.DataFrame) -> Section:
    return Section(
        "Against the truth",
        "Errors of each virtual compressor. Inertia: the worst moment; K_VP: norm of the "
        "difference, rotations scaled by the characteristic length; gain: the largest in "
        "10–30 Hz. Within 1 σ: parameters nearer to the truth than their stated standard "
        "deviation; 68 % where the deviations are honest.",
        tables=(
            Table(
                cases,
                "Identified against true.",
                {
                    name: 2
                    for name in map(str, cases)
                    if name.endswith(("[%]", "[1]", "[mm]", "[°]"))
                }
                | {"within 1 σ [%]": 0, "Re gain [%]": 3, "Im gain [%]": 3},
            ),
        ),
    )


def _pictures(figures: Mapping[str, bytes], stems: tuple[str, ...]) -> tuple[Picture, ...]:
    return tuple(
        Picture(png, alt=CAPTIONS[name], caption=CAPTIONS[name])
        for stem in stems
        for name, png in figures.items()
        if name.startswith(stem)
    )


def _as_words(table: pd.DataFrame) -> pd.DataFrame:
    """Write numbers of different units in one column with equally many digits."""
    words = table.copy()
    for name in table.columns:
        if table[name].dtype.kind == "f" and not str(name).endswith("]"):
            digits = 2 if "deviation" in str(name) else DIGITS
            words[name] = [_digits(float(value), digits) for value in table[name]]
    return words


def _narrow_columns(tables: Mapping[str, pd.DataFrame]) -> list[str]:
    return [NARROW.get(str(name), "") for name in tables["identifiability"]]


def _digits(value: float, digits: int) -> str:
    if not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    decimals = max(digits - 1 - math.floor(math.log10(abs(value))), 0)
    return f"{value:.{min(decimals, 6)}f}".replace("-", "−")
