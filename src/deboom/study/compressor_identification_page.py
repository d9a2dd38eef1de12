"""The page of an identified compressor: what was found, and how far it may be believed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from deboom.compressor.identify import ALARM
from deboom.compressor.quantities import REFERENCE_FREQUENCY
from deboom.report.page import Headline, Page, Section, Table
from deboom.study.compressor_identification_limits import limits_section
from deboom.study.compressor_identification_words import SHOWN_ROWS, in_words, pictures_of

if TYPE_CHECKING:
    from deboom.study.compressor_identification import IdentifiedTest


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
        limits_section(first, tables, figures),
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
        figures=pictures_of(figures, ("figure_53", "figure_56")),
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
        figures=pictures_of(figures, ("figure_54",)),
        tables=(
            Table(
                in_words(tables["parameters"]),
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
        figures=pictures_of(
            figures, ("figure_55", "figure_57", "figure_58", "figure_59", "figure_66", "figure_67")
        ),
        tables=(Table(tables["held_out"], "Predictions of what was held out."),),
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
        tables=(Table(in_words(tables["identical_mounts"]), "Mounts as found."),),
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
        tables=(Table(in_words(shown), "Largest errors of placement and calibration."),),
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
