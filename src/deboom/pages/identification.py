"""The report on an identified compressor."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from deboom import plot
from deboom.arrays import PERCENT, ComplexArray, RealArray
from deboom.compressor.hammer_identification import frac, modal_likeness
from deboom.compressor.identification_results import (
    CompressorTruth,
    IdentifiedTest,
    calibrated_inertance,
    condition_at_100_hz,
    condition_numbers,
    errors_of,
    identifiability_table,
    placement_table,
)
from deboom.compressor.identified_compressor import ALARM, Identification
from deboom.compressor.inertance_fit import START_GAIN
from deboom.compressor.model import gain_from_parameters
from deboom.compressor.mount_shares import MountShares
from deboom.compressor.parameter_information import (
    PRIOR_DOMINATED,
    REFERENCE_FREQUENCY,
    gain_deviation,
    quantities,
)
from deboom.compressor.thesis_parameter_fit import ThesisFit
from deboom.errors import InputError
from deboom.files.compressor_model import MODEL_FILE, compressor_document
from deboom.measurement.channels import Band, Frf
from deboom.measurement.compressor_test import InertanceTest
from deboom.measurement.free_body import FreeBody
from deboom.measurement.quality import quality_table
from deboom.physics.rigid_body import mass_matrix
from deboom.report import Report, Step
from deboom.report.tables import in_words

if TYPE_CHECKING:
    from deboom.plot import Figure

MOTIONS = ("Tx", "Ty", "Tz", "Rx", "Ry", "Rz")
INERTANCE_UNITS = ("1/kg", "1/(kg m)", "1/(kg m²)")
MASS_UNITS = ("kg", "kg m", "kg m²")
SHEET, MODEL = "measured, places of the sheet", "identified"
CALIBRATED = "measured, calibrated places"
OF_MASS = "force in rows, acceleration in columns"
Measures = dict[str, tuple[Mapping[str, ComplexArray], tuple[str, str, str]]]
"""Quantity to what shows it, shape (n, 6, 6), by how it was come by; and its three units."""
WIDE_BAND = 1.96
"""Standard deviations of a 95 % interval."""
SHOWN_ROWS = 12
"""Of long tables; the files of the run hold them all."""
TABLE_11 = (
    "parameter",
    "unit",
    "start",
    "lower bound",
    "upper bound",
    "fitted",
    "truth",
    "at its bound",
    "verdict",
)
"""Columns of the thesis's numbers on the page."""


def identification_report(first: IdentifiedTest, inputs: Sequence[Path] = ()) -> Report:
    """Report an identified compressor.

    - `inputs`: files that were read.
    """
    identification = first.identification
    report = Report(
        f"Identified compressor: {identification.test.name}",
        "Which mass, centre of gravity, inertia, mount stiffness and rubber explain the hammer "
        "test of a compressor in its vehicle, and how reliable is each?",
    )
    chi = identification.calibrated.reduced_chi
    _answer(report, identification)
    report.warn(*identification.alarms)
    report.assume(*identification.test.assumed)
    if identification.test.weighed_mass is None:
        report.warn(
            "The compressor was not weighed: its mass, inertia and stiffness are known no better "
            "than the ratio of hammer and accelerometers. Weigh it."
        )
    if first.identical is not None and not first.identical.identical_holds:
        report.warn(first.identical.statement)
    report.number("mass_kg", identification.calibrated.model.mass, "kg", "mass", headline=".3f")
    if first.truth is not None:
        error = errors_of(identification, first.truth)
        report.number(
            "cog_error_mm",
            1e3 * error.centre,
            "mm",
            "error of the centre of gravity, where the truth is known",
        )
        report.number(
            "inertia_error_percent",
            100 * error.inertia,
            "%",
            "error of the worst moment of inertia, where the truth is known",
        )
        report.number(
            "k_vp_error_percent",
            100 * error.stiffness,
            "%",
            "error of the stiffness at the virtual point, where the truth is known",
        )
    if first.thesis is not None:
        report.number(
            "jacobian_rank",
            first.thesis.seen.rank,
            "",
            "combinations of the thesis's 44 numbers that the test sees",
            headline="d",
        )
    condition = condition_at_100_hz(identification, identification.length)
    report.number(
        "reduced_chi2",
        chi**2,
        "1",
        "residuals over their noise, squared; alarm above 2.25",
        headline=".2f",
    )
    report.number(
        "n_alarms", len(identification.alarms), "", "alarms: reasons not to rely on the result"
    )
    report.number(
        "condition_scaled_100hz",
        condition,
        "1",
        "condition of the measured inertance at 100 Hz, rotations scaled by the radius of gyration",
    )
    report.number(
        "condition_si_100hz",
        condition_at_100_hz(identification, 1.0),
        "1",
        "condition of the measured inertance at 100 Hz in SI units, which mix metres and radians",
    )
    for low, high in identification.options.bands:
        alike = _alike(first, (low, high))
        report.number(
            f"frac_diagonal_{low:g}_{high:g}hz",
            float(alike.diagonal().min()),
            "1",
            "likeness (FRAC) of inertances of one motion in the band, the least",
        )
        report.number(
            f"frac_least_{low:g}_{high:g}hz",
            float(alike.min()),
            "1",
            "likeness (FRAC) of all inertances in the band, the least",
        )
    report.number("seconds", first.seconds, "s", "time of the identification")
    report.facts["characteristic_length_m"] = identification.length
    report.inputs += inputs
    report.document(MODEL_FILE, compressor_document(identification, first.inputs_sha256))

    _procedure(report, first)
    _identified(report, first)
    _sound(report, first, condition)
    _compared(report, first)
    _apparent_mass(report, first)
    _limits(report, first)
    if first.identical is not None:
        _identical(report, first.identical)
    _placement(report, first)
    return report


def _answer(report: Report, identification: Identification) -> None:
    """Say mass and centre of gravity, how far they may be believed, and what comes next."""
    model, chi = identification.calibrated.model, identification.calibrated.reduced_chi
    mass = identification.table.set_index("quantity").loc["mass"]
    place = ", ".join(f"{1e3 * value:.1f}".replace("-", "−") for value in model.centre)
    report.answer(
        (
            f"Do not rely on it, {alarms_in_words(identification.alarms)}"
            if identification.alarms
            else "Use it: a rigid body on mounts explains the test"
        )
        + f"; mass {model.mass:.3f} ± {WIDE_BAND * mass['standard deviation']:.2g} kg, centre of "
        f"gravity at {place} mm.",
        f"How sure: ± means 95 %; residuals are {chi:.2f} times the noise, alarm above {ALARM:g}. "
        "Intervals of all numbers are below. Axes of the position sheet.",
        "What not to trust: small entries of the inertance far below the diagonal, into which "
        "misplaced sensors leak, and numbers whose standard deviation is of their own size.",
    )
    report.panel(
        "What to do next",
        Step("deboom unbalance TEST", "the unbalance of the running compressor"),
        Step("deboom run compressor_front --cars CAR", "the mounts that make cars quiet"),
        wide=True,
    )


def _procedure(report: Report, first: IdentifiedTest) -> None:
    """Say what was asked, and with which data."""
    identification, test = first.identification, first.identification.test
    bands = " and ".join(f"{low:g}–{high:g} Hz" for low, high in identification.options.bands)
    weighed = "It was not weighed."
    if test.weighed_mass is not None:
        weighed = (
            f"On the scales it has {test.weighed_mass:.4g} ± {test.weighed_mass_deviation:.1g} kg."
        )
    report.section(
        "What was asked, and with which data",
        f"{len(test.sensors)} triaxial accelerometers and {len(test.impacts)} impacts of a roving "
        f"hammer, {test.n_averages} hits each: {test.frf.values[0].size} FRFs, "
        f"{test.frf.frequency.size} lines from {test.frf.frequency[0]:g} to "
        f"{test.frf.frequency[-1]:g} Hz. {weighed} {np.count_nonzero(identification.fitted)} lines "
        f"in {bands} were fitted.\n\nThe compressor is a rigid body on mounts without rotational "
        "stiffness: 10 numbers of mass, 20 of stiffness at the virtual point, 5 of the rubber's "
        "gain. Gains, places and angles of all sensors and impacts "
        f"({identification.calibrated.errors.size} numbers) are unknowns as well, held by their "
        "tolerances: self-calibration. The linear start needs no drawing.",
        folded=True,
    )


def _sound(report: Report, test: IdentifiedTest, condition: float) -> None:
    """Say whether the test is sound."""
    identification, lines, length = (
        test.identification,
        test.identification.inertance.frequency,
        test.identification.length,
    )
    report.section(
        "Is the test sound?",
        f"{identification.rigid.statement}\n\nThe condition number of the inertance near 100 Hz is "
        f"{condition:.1f}, with rotations counted as motion at the characteristic length of "
        f"{1e3 * length:.0f} mm, the radius of gyration. In SI units the condition number is only "
        "mass over the smallest moment of inertia. So the thesis's value of 450 above 50 Hz says "
        "nothing about the quality of a measurement or of its inversion.",
    )
    report.figure(
        "figure_53_inertance",
        lambda: inertance_figure(lines, _inertances(identification), identification.options.bands),
        "Inertance at the virtual point (thesis, figure 53): response in rows, excitation in "
        "columns. The dashed model is to be compared with the measurement by calibrated places. "
        "By the places of the sheet the small entries are wrong: misplaced sensors and impacts "
        "leak into them from the large ones.",
    )
    checks = pd.DataFrame(quality_table(identification.quality))
    report.table(
        "quality",
        checks,
        "Checks in the order in which a laboratory corrects errors. A reversed or swapped channel "
        "would have stopped the identification.",
        {"number [1]": 3},
        shown=checks.assign(limit=checks["limit"].str.replace(" ", "\u00a0")),
    )


def _inertances(identification: Identification) -> Mapping[str, ComplexArray]:
    """Return the inertance at the virtual point, (n, 6, 6): measured by both places, identified."""
    return {
        SHEET: identification.inertance.values,
        CALIBRATED: calibrated_inertance(identification),
        MODEL: identification.calibrated.model.inertance(identification.inertance.frequency),
    }


def inertance_figure(
    lines: RealArray, curves: Mapping[str, ComplexArray], fitted: Sequence[tuple[float, float]]
) -> Figure:
    """Draw the magnitudes of inertances at the virtual point over frequency."""
    return plot.curve_matrix(
        MOTIONS,
        lines,
        {name: np.abs(values) for name, values in curves.items()},
        units=INERTANCE_UNITS,
        what="|inertance|",
        dashed=(MODEL,),
        fitted=fitted,
        logarithmic=True,
    )


def _identified(report: Report, test: IdentifiedTest) -> None:
    """Show the identified numbers, the gain and the modes."""
    identification = test.identification
    truth = " The truth of the virtual compressor is for comparison only." if test.truth else ""
    report.section(
        "The identified compressor",
        "Origin and axes are those of the position sheet. The inertia is about the centre of "
        "gravity, products with their sign as matrix elements; by construction it belongs to a "
        f"possible body. K is the stiffness at the virtual point at {REFERENCE_FREQUENCY:g} Hz, "
        f"where the real part of the gain is 1.{truth}",
    )
    report.figure(
        "figure_54_gain",
        lambda: _gain_figure(test),
        "Gain factor of the rubber (thesis, figure 54), its real part 1 at 20 Hz, "
        "since the scale of the gain and that of the stiffness are one number. The last curve "
        "is the loss that follows from the rise of the real part by causality. A rubber whose loss "
        "is several times larger or smaller is not plausible.",
    )
    parameters = identification.table.rename(
        columns={"quantity": "parameter", "value": "identified"}
    )
    start = quantities(identification.point.parametrisation.model(identification.start)).values
    parameters.insert(2, "start", start)
    if test.truth is not None:
        parameters["truth"] = quantities(test.truth.model).values
    coupling = parameters["parameter"].str.fullmatch(r"K (\w+) (?!\1$)\w+")
    report.table(
        "parameters",
        parameters,
        "Start: linear, by the places of the sheet. Standard deviation: of noise, "
        "placement, calibration and scales together. parameters.csv has the couplings of K.",
        shown=in_words(parameters[~coupling]),
    )
    energy = {
        f"energy {motion} [%]": 100 * identification.modes.energy[row]
        for row, motion in enumerate(("x", "y", "z", "rx", "ry", "rz"))
    }
    leading = [
        f"{number}, mainly {name}" for number, name in enumerate(identification.modes.leading, 1)
    ]
    modes = {
        "mode": leading,
        "frequency [Hz]": identification.modes.frequency,
        "loss factor [1]": identification.modes.loss_factor,
        **energy,
    }
    report.table(
        "modes",
        pd.DataFrame(modes),
        "Rigid-body modes. Energy: share of each motion in the kinetic energy; coupling "
        "through the mass matrix can make it negative.",
        dict.fromkeys(energy, 0),
    )


def _gain_figure(test: IdentifiedTest) -> Figure:
    """Draw both parts of the gain, 1 at the reference, with their 95 % interval and the truth."""
    identification = test.identification
    lines = identification.inertance.frequency
    gain = identification.calibrated.model.gain
    scale = gain.real.at(REFERENCE_FREQUENCY)
    identified = gain.at(lines) / scale
    deviation = gain_deviation(identification.calibrated, lines)
    before = gain_from_parameters(START_GAIN, REFERENCE_FREQUENCY).at(lines)
    panels = []
    for title, part in (("Re v: stiffness", np.real), ("Im v: damping", np.imag)):
        curves = {"medium rubber, before": part(before), MODEL: part(identified)}
        if test.truth is not None:
            law = test.truth.model.gain
            curves["truth"] = part(law.at(lines) / law.real.at(REFERENCE_FREQUENCY))
        if part is np.imag:
            curves["loss that causality expects of Re v"] = gain.expected_loss(lines) / scale
        half = WIDE_BAND * part(deviation)
        low, high = part(identified) - half, part(identified) + half
        ranges = {"95 % interval": (low, high)}
        panels.append(plot.CurvePanel(title, lines, curves, y_label="gain [1]", ranges=ranges))
    return plot.curve_panels(
        panels,
        columns=2,
        dashed=("truth",),
        fitted=test.identification.options.bands,
        log_frequency=True,
    )


def _compared(report: Report, test: IdentifiedTest) -> None:
    """Compare measured with identified FRFs, and what was held out with its prediction."""
    report.section(
        "Measured against identified",
        "Lines outside the fit must be predicted as well as lines in the fit; otherwise the model "
        "is wrong.",
        folded=True,
    )
    report.figure(
        "figure_55_correlation",
        lambda: _likeness(test),
        "Likeness of measured (places of the sheet) and identified (thesis, figure 55), numbers "
        "rounded down. Modes by their shapes at the accelerometers, in 10–30 Hz; beside them, the "
        "FRFs entry by entry. Above the modes, entries off the diagonal are a few percent of those "
        "on it or less: there, sensors a little off their places are what is compared.",
    )
    checks = test.identification.held_out
    table = {
        "held out": [check.what for check in checks],
        "reduced χ [1]": [check.reduced_chi for check in checks],
        "error over measured, rms [%]": [100 * check.relative_error for check in checks],
    }
    report.table("held_out", pd.DataFrame(table), "Predictions of what was held out.")


def _likeness(test: IdentifiedTest) -> Figure:
    """Draw figure 55 of the thesis."""
    identification = test.identification
    maps = []
    try:
        numbers = tuple(str(number) for number in range(1, 7))
        likeness = modal_likeness(identification)
        maps.append(
            plot.HeatMap("Modes, MAC", numbers, numbers, likeness, "linear estimate", "identified")
        )
    except InputError:  # the linear estimate has no modes: nothing to compare
        pass
    for low, high in identification.options.bands:
        title = f"FRAC, inertance, {low:g}–{high:g} Hz"
        alike = _alike(test, (low, high))
        maps.append(plot.HeatMap(title, MOTIONS, MOTIONS, alike, "", "excitation"))
    return plot.heat_maps(maps)


def _alike(test: IdentifiedTest, band: Band) -> RealArray:
    """Return how alike measured and identified inertances are in a band, (6, 6) [1]."""
    measured = test.identification.inertance
    model = test.identification.calibrated.model.inertance(measured.frequency)
    return frac(measured.values, model, measured.frequency, band)


def _apparent_mass(report: Report, test: IdentifiedTest) -> None:
    """Draw figures 56 to 59, 66 and 67 of the thesis, and write what they show."""
    identification, lines = test.identification, test.identification.inertance.frequency
    report.section(
        "Apparent mass, entry by entry",
        "The apparent mass is the inverse of the inertance: multiplied by the accelerations of "
        "the running compressor, it gives the load inside. With the positions of the sheet its "
        "small entries differ from the model; with the calibrated positions they agree. What "
        "looks like an error of the inversion is an error of position. apparent_mass.csv has all "
        "entries.",
        folded=True,
    )
    _condition(report, identification)
    inertance = _inertances(identification)
    mass: dict[str, ComplexArray] = {
        name: np.asarray(np.linalg.inv(values)) for name, values in inertance.items()
    }
    both: Measures = {
        "inertance": (inertance, INERTANCE_UNITS),
        "apparent mass": (mass, MASS_UNITS),
    }
    _entries(report, identification, both)
    _matrices(report, lines, both)
    report.figure(
        "apparent_mass_magnitude",
        lambda: plot.curve_matrix(
            MOTIONS,
            lines,
            {name: np.abs(values) for name, values in mass.items()},
            units=MASS_UNITS,
            what="|apparent mass|",
            reading=OF_MASS,
            dashed=(MODEL,),
            fitted=identification.options.bands,
            logarithmic=True,
        ),
        "Magnitude of the apparent mass, by the places of the sheet, by calibrated places and "
        "identified.",
    )
    report.table("apparent_mass", apparent_mass_table(lines, mass))


def _condition(report: Report, identification: Identification) -> None:
    """Draw the condition number of the inertance in SI units and scaled (thesis, figure 56)."""
    lines = identification.inertance.frequency
    shown = {
        "SI units": 1.0,
        f"rotations times {1e3 * identification.length:.0f} mm": identification.length,
    }
    condition = plot.CurvePanel(
        "Condition number of the inertance",
        lines,
        {name: condition_numbers(identification, length) for name, length in shown.items()},
        y_label="condition number [1]",
        levels={"450, the thesis": 450.0},
        logarithmic=True,
    )
    report.figure(
        "figure_56_condition",
        lambda: plot.curve_panels([condition], columns=1, log_frequency=True),
        "Condition number over frequency (thesis, figure 56) of one measured matrix in two units. "
        "In SI units it is mass over the smallest moment of inertia above the modes; scaled by the "
        "radius of gyration it is near 1 there, and large only at the modes, where one shape is "
        "all that moves.",
    )


def _entries(report: Report, identification: Identification, both: Measures) -> None:
    """Draw entries of inertance and apparent mass (thesis, figures 57 to 59)."""
    lines = identification.inertance.frequency
    for stem, entries, what, number in (
        ("figure_57_rotations", ((3, 3), (4, 4), (5, 5)), "Rotations Ri–Ri", 57),
        ("figure_58_translations", ((0, 0), (1, 1), (2, 2)), "Translations Ti–Ti", 58),
        ("figure_59_couplings", ((0, 1), (0, 2), (1, 2)), "Couplings Ti–Tj", 59),
    ):
        panels = _entry_panels(lines, both, entries)
        report.figure(
            stem,
            partial(
                plot.curve_panels,
                panels,
                columns=3,
                dashed=(MODEL,),
                fitted=identification.options.bands,
                log_frequency=True,
            ),
            f"{what} (thesis, figure {number}): inertance and apparent mass, real and imaginary "
            "part.",
        )


def _matrices(report: Report, lines: RealArray, both: Measures) -> None:
    """Draw all entries of inertance and apparent mass (thesis, figures 66 and 67)."""
    readings = {
        "inertance": "response in rows, excitation in columns",
        "apparent mass": OF_MASS,
    }
    for number, (name, (values, units)) in zip((66, 67), both.items(), strict=True):
        curves = {
            f"{part}, {label}": getattr(values[of], field)
            for label, of in (("measured", CALIBRATED), (MODEL, MODEL))
            for part, field in (("real", "real"), ("imaginary", "imag"))
        }
        report.figure(
            f"figure_{number}_{name.replace(' ', '_')}",
            partial(
                plot.curve_matrix,
                MOTIONS,
                lines,
                curves,
                units=units,
                what=name,
                reading=readings[name],
                dashed=[label for label in curves if label.endswith(MODEL)],
            ),
            f"All entries of the {name}, real and imaginary part, by calibrated places (thesis, "
            f"figure {number} of the appendix).",
        )


def _entry_panels(
    lines: RealArray,
    both: Mapping[str, tuple[Mapping[str, ComplexArray], tuple[str, str, str]]],
    entries: Sequence[tuple[int, int]],
) -> list[plot.CurvePanel]:
    """Draw real and imaginary part of some entries of both matrices."""
    return [
        plot.CurvePanel(
            f"{part} {name.replace('apparent', 'app.')}, {MOTIONS[row]}–{MOTIONS[column]}",
            lines,
            {label: getattr(matrix[:, row, column], field) for label, matrix in values.items()},
            y_label=f"[{units[(row > 2) + (column > 2)]}]",
        )
        for name, (values, units) in both.items()
        for part, field in (("Re", "real"), ("Im", "imag"))
        for row, column in entries
    ]


def apparent_mass_table(lines: RealArray, mass: Mapping[str, ComplexArray]) -> pd.DataFrame:
    """Write apparent masses (f, 6, 6), complex, entry by entry; units by entry."""
    frames = []
    for row, motion in enumerate(MOTIONS):
        for column, other in enumerate(MOTIONS):
            columns: dict[str, Any] = {
                "force": motion,
                "acceleration": other,
                "unit": MASS_UNITS[(row > 2) + (column > 2)],
                "frequency [Hz]": lines,
            }
            for name, matrix in mass.items():
                columns[f"{name}, real"] = matrix[:, row, column].real
                columns[f"{name}, imaginary"] = matrix[:, row, column].imag
            frames.append(pd.DataFrame(columns))
    return pd.concat(frames, ignore_index=True)


def _limits(report: Report, test: IdentifiedTest) -> None:
    """Say which parameters are seen, which are not, and which come from what was known before."""
    identification, thesis = test.identification, test.thesis
    dominated = identification.knowledge.prior_dominated
    names = f"Of them {', '.join(dominated)} come" if dominated else "None of them comes"
    report.section(
        "What this test can and cannot say",
        "The 35 numbers of the minimal model are all seen. "
        f"{names} mostly from what was known before. "
        "Many hang together, since the position error of one sensor moves several: the strongest "
        "correlations are in correlations.csv.",
    )
    if thesis is None:
        report.text(
            "The test has no drawing: the thesis's single mount positions, rotations and "
            "stiffnesses were not fitted."
        )
    else:
        _limits_of_the_thesis(report, thesis)
    pairs = identification.knowledge.strong_correlations
    correlations = pd.DataFrame(pairs, columns=["parameter", "and", "correlation [1]"])
    report.table("correlations", correlations)
    if thesis is not None:
        identifiability = identifiability_table(test, thesis)
        report.section(
            "The thesis's numbers",
            "From the drawing (table 10) to the fit (table 11): start, bounds and result of least "
            "squares that take the positions of the sheet as exact. A number at its bound was not "
            "identified. Invisible: only the drawing says something about it. Prior-dominated: "
            f"more than {PERCENT * PRIOR_DOMINATED:.0f} % of the bound's width is left. With "
            "others only: a part of it lies in a combination that no test at one point can see.",
            folded=True,
        )
        columns = [name for name in TABLE_11 if name in identifiability]
        report.table(
            "identifiability",
            identifiability,
            "The thesis's numbers: start and result (thesis, tables 10 and 11).",
            shown=in_words(identifiability)[columns],
        )


def _limits_of_the_thesis(report: Report, thesis: ThesisFit) -> None:
    """Say which combinations of the thesis's numbers the test sees."""
    held = "No number ends at a bound."
    if thesis.fit.at_bound:
        held = f"The fit ends with {', '.join(thesis.fit.at_bound)} at a bound."
    seen = thesis.seen
    report.text(
        f"The thesis fits {len(seen.names)} numbers. A hammer test at one virtual point sees "
        f"{seen.rank} combinations of them, whatever its noise: {len(seen.null_space)} changes "
        "leave every FRF as it is; the first table names them. Rotation x is a mount's "
        "rotation about its own axis: it matters only as far as the two radial stiffnesses "
        "differ. Mass, centre of gravity and inertia take no part in any of these and are "
        "unique; single positions, rotations and stiffnesses of mounts are not, and equally "
        f"good fits differ by millimetres and degrees. {held} Report the stiffness at the "
        "virtual point and the gain instead; or, where all mounts are one round part, enforce "
        "that (--identical-mounts)."
    )
    drawn = np.count_nonzero(np.asarray(thesis.knowledge.ratio) > PRIOR_DOMINATED)
    report.text(
        f"Of {drawn} of the {len(seen.names)} numbers the drawing says more than the test; "
        "identifiability.csv has them all."
    )
    own_axis = (" rotation x", "'s rotation about its own axis")
    changes = [change.statement.replace(*own_axis) for change in thesis.seen.null_space]
    report.table(
        "null_space",
        pd.DataFrame({"change that no test at one virtual point can see": changes}),
        "Changes that leave every FRF as it is.",
    )


def _identical(report: Report, fit: MountShares) -> None:
    """Show place, direction and stiffness of identical round mounts."""
    report.section(
        "Identical round mounts",
        "With one axial and one radial stiffness for all mounts, nothing stays invisible: place "
        f"and direction of each mount are found. {fit.statement} Offsets and angles are along and "
        f"about axes of the sheet, from the drawing; stiffness at {REFERENCE_FREQUENCY:g} Hz.",
    )
    # a round mount has no angle about its own axis, the first of its three
    columns = {"offset x": 0, "offset y": 1, "offset z": 2, "angle y": 4, "angle z": 5}
    shown = list(columns.values())
    n = len(fit.drawn)
    factor = np.array([1e3] * 3 + [180 / np.pi] * 2)
    moved = fit.values[:-1].reshape(n, -1)[:, shown]
    stiffness = 1e-3 * fit.mounts[0].stiffness[:2]
    table = pd.DataFrame(
        {
            "parameter": [
                *(f"{mount.name} {name}" for mount in fit.drawn for name in columns),
                "axial stiffness",
                "radial stiffness",
            ],
            "unit": ["mm", "mm", "mm", "°", "°"] * n + ["N/mm"] * 2,
            "identified": [*(factor * moved).ravel(), *stiffness],
            "standard deviation": [
                *(factor * fit.deviations[:, shown]).ravel(),
                *(stiffness * fit.deviations[0, 6:8]),
            ],
        }
    )
    report.table("identical_mounts", table, "Mounts as found.", shown=in_words(table))


def _placement(report: Report, test: IdentifiedTest) -> None:
    """Show the errors of gains, places and angles that the test revealed."""
    table = placement_table(test)
    size = (table["found"] / table["prior deviation"]).abs()
    largest = table.loc[size.sort_values(ascending=False).index].head(SHOWN_ROWS)
    report.section(
        "What the test says of its own sensors",
        "Errors of gain, place and angle against the position sheet, the largest in units of "
        "their tolerance first; placement.csv has all. A posterior deviation near the prior one: "
        "the test cannot tell.",
        folded=True,
    )
    report.table(
        "placement",
        table,
        "Largest errors of placement and calibration.",
        shown=in_words(largest),
    )


def alarms_in_words(alarms: Sequence[str]) -> str:
    """Count alarms: ``no alarm``, ``1 alarm``, ``2 alarms``."""
    return f"{len(alarms) or 'no'} {'alarms' if len(alarms) > 1 else 'alarm'}"


def free_body_report(
    test: InertanceTest, inertance: Frf, free: FreeBody, truth: CompressorTruth | None
) -> Report:
    """Report mass, centre of gravity and inertia of a free or softly hung body.

    - `inertance`: at the virtual point; `free`: fitted to its mass lines.
    - `truth` or None: of a virtual test.
    """
    lines = inertance.frequency
    report = Report(
        f"Free body: {test.name}", "Which mass, centre of gravity and inertia has this body?"
    )
    report.assume(*test.assumed)
    if test.weighed_mass is None:
        report.warn("Not weighed: a gain that all channels share looks like mass. Weigh it.")
    report.number("mass_kg", free.body.mass, "kg", "mass", headline=".3f")
    report.number(
        "mass_deviation_kg",
        float(free.deviation[0]),
        "kg",
        "standard deviation of the mass",
        headline=".2g",
    )
    low, high = free.band
    report.number("fit_from_hz", low, "Hz", "first line of the fit", headline="g")
    report.number("fit_to_hz", high, "Hz", "last line of the fit", headline="g")
    report.number("misfit", free.misfit, "1", "residuals over their noise")
    report.number("n_alarms", 0, "", "alarms: reasons not to rely on the result")
    report.inputs += test.input_files
    table = free.table
    if truth is not None:
        report.inputs.append(truth.path)
        true = truth.model
        inertia = true.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        table["truth"] = [true.mass, *true.centre, *inertia]
    report.section(
        "Mass, centre of gravity and inertia",
        "A constant and the foot of the flexible modes are fitted to the accelerance at the "
        "virtual point; the constant is the inverse mass matrix of a rigid body. Centre of gravity "
        "in the axes and from the origin of the position sheet, inertia about it.",
    )
    report.table("parameters", table, "1 σ of noise, model and gains.", shown=in_words(table))
    rigid = np.linalg.inv(mass_matrix(free.body.mass, free.body.inertia, free.body.centre))
    curves = {"measured": inertance.values, MODEL: np.broadcast_to(rigid, inertance.values.shape)}
    report.figure(
        "inertance",
        lambda: inertance_figure(lines, curves, (free.band,)),
        "Inertance at the virtual point, and that of the identified body.",
    )
    return report
