"""Compressors identified from hammer tests."""

from __future__ import annotations

import json
import math
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from threadpoolctl import threadpool_limits

from deboom.arrays import RealArray
from deboom.bench.compressor_truth import CalibrationLevel, CompressorCase, CompressorPlan
from deboom.bench.compressor_writer import write_compressor_test
from deboom.compressor.gain import GainFactor, gain_from_parameters
from deboom.compressor.identifiability import (
    ALONE,
    PRIOR_DOMINATED,
    REFERENCE_FREQUENCY,
    gain_deviation,
    quantities,
    quantity_deviations,
)
from deboom.compressor.identify import (
    ALARM,
    Identification,
    IdentifiedCompressor,
    IdentifyOptions,
    frac,
    identified_compressor,
    identify,
    modal_likeness,
)
from deboom.compressor.model import CompressorModel
from deboom.compressor.parameters import MinimalParameters, ThesisParameters
from deboom.compressor.thesis_fit import (
    IdenticalFit,
    ThesisFit,
    fit_identical_mounts,
    fit_thesis_parameters,
)
from deboom.compressor.virtual_point_fit import START_GAIN
from deboom.errors import InputError
from deboom.files.compressor_model import compressor_document
from deboom.files.inertance_test import read_inertance_test
from deboom.files.run_folder import environment_record, hash_files
from deboom.measurement.compressor_test import CompressorMount, InertanceTest
from deboom.measurement.quality import quality_table
from deboom.physics.rigid_body import rotation_matrix
from deboom.plot import HeatMap, SpectrumPanel, curve_matrix, heat_maps, ratio_bars, spectra_panels
from deboom.report.page import Headline, Page, Picture, Section, Table
from deboom.study.progress import Progress, counted
from deboom.study.result import Scalar, StudyResult
from deboom.study.runner import PACKAGES, run_command

if TYPE_CHECKING:
    import numpy.typing as npt

    from deboom.compressor.identify import Identification
    from deboom.compressor.thesis_fit import IdenticalFit

TRUTH_FILE = Path("truth") / "truth.json"
RUBBER_LINES = np.arange(10.0, 30.5, 0.5)
"""Where the gain is judged: around the rigid-body modes [Hz]."""


@dataclass(frozen=True, eq=False)
class CompressorTruth:
    """What the compressor truly is.

    Parameters
    ----------
    path : Path
        Where it was read.
    model : CompressorModel
    mounts : tuple of CompressorMount
    """

    path: Path
    model: CompressorModel
    mounts: tuple[CompressorMount, ...]


@dataclass(frozen=True, eq=False)
class IdentificationErrors:
    """How far an identification is from the truth.

    Parameters
    ----------
    mass, inertia, stiffness, gain_real, gain_imaginary : float
        Relative [1]: inertia, the worst moment; stiffness, the Frobenius norm of K_VP with
        rotations scaled by the characteristic length; gain, the largest in 10-30 Hz, both with
        a real part of 1 at `REFERENCE_FREQUENCY`.
    centre : float
        Distance of the centre of gravity [m].
    scores : array, shape (n_parameters,)
        Errors of the parameters in units of their stated standard deviation [1].
    """

    mass: float
    centre: float
    inertia: float
    stiffness: float
    gain_real: float
    gain_imaginary: float
    scores: RealArray


def read_compressor_truth(folder: Path) -> CompressorTruth | None:
    """Read the truth beside a virtual test; None where there is none.

    Raises
    ------
    InputError
        A truth file that cannot be read.
    """
    path = folder / TRUTH_FILE
    if not path.is_file():
        return None
    try:
        truth = json.loads(path.read_text(encoding="utf-8"))
        model = CompressorModel(
            truth["mass_kg"],
            np.array(truth["centre_of_gravity_m"]),
            np.array(truth["inertia_kg_m2"]),
            np.array(truth["static_stiffness"]),
            GainFactor.of(truth["gain"]),
        )
        mounts = tuple(
            CompressorMount(
                mount["name"],
                np.array(mount["position_m"]),
                np.array(mount["rotation_rad"]),
                np.array(mount["stiffness_n_per_m"]),
            )
            for mount in truth["mounts"]
        )
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(
            f"{path}: not the truth of a virtual compressor ({error}); write the test again"
        ) from None
    return CompressorTruth(path, model, mounts)


def errors_of(found: Identification, truth: CompressorTruth) -> IdentificationErrors:
    """Compare the result of an identification with the truth.

    Parameters
    ----------
    found : Identification
    truth : CompressorTruth

    Returns
    -------
    IdentificationErrors
    """
    model, true = found.calibrated.model, truth.model
    parametrisation = MinimalParameters(found.length)
    deviation = np.sqrt(np.diag(found.calibrated.parameter_covariance))
    unit = np.repeat([1.0, 1 / found.length], 3)
    stiffness, true_stiffness = (_stated(one) * np.outer(unit, unit) for one in (model, true))
    gain = _gain(model, RUBBER_LINES) / _gain(true, RUBBER_LINES) - 1
    moments = np.diag(model.inertia) / np.diag(true.inertia) - 1
    return IdentificationErrors(
        abs(model.mass / true.mass - 1),
        float(np.linalg.norm(model.centre - true.centre)),
        float(np.abs(moments).max()),
        float(np.linalg.norm(stiffness - true_stiffness) / np.linalg.norm(true_stiffness)),
        float(np.abs(gain[0]).max()),
        float(np.abs(gain[1]).max()),
        (found.calibrated.values - parametrisation.values_of(true)) / deviation,
    )


def quantity_scores(found: Identification, truth: CompressorTruth) -> RealArray:
    """Errors of what an engineer asks for, in units of their stated standard deviation [1]."""
    error = quantities(found.calibrated.model).values - quantities(truth.model).values
    return np.asarray(error / quantity_deviations(found.calibrated))


def mounting_errors(fit: IdenticalFit, truth: CompressorTruth) -> tuple[float, float]:
    """Largest error of place [m], and of the direction of the axis [rad], of identical mounts."""
    places, angles = [], []
    for found, true in zip(fit.mounts, truth.mounts, strict=True):
        places.append(float(np.linalg.norm(found.position - true.position)))
        along = found.orientation[:, 0] @ rotation_matrix(true.rotation)[:, 0]
        angles.append(float(np.arccos(np.clip(abs(along), 0.0, 1.0))))
    return max(places), max(angles)


def _stated(model: CompressorModel) -> RealArray:
    """K_VP at the reference line [N/m, N/rad, N m/rad]."""
    return np.asarray(model.stiffness * model.gain.real.at(REFERENCE_FREQUENCY))


def _gain(model: CompressorModel, lines: npt.ArrayLike) -> RealArray:
    """Real and imaginary part with a real part of 1 at the reference line, shape (2, f)."""
    values = model.gain.at(lines) / model.gain.real.at(REFERENCE_FREQUENCY)
    return np.stack([values.real, values.imag])


STEPS = 7
"""Of `identified_test`, for progress."""


@dataclass(frozen=True)
class Beside:
    """What is fitted beside the identification itself.

    Parameters
    ----------
    thesis : bool
        The thesis's 44 numbers, where there is a drawing.
    reference : bool
        These by sequential quadratic programming as well.
    identical_mounts : bool
        Identical round mounts.
    """

    thesis: bool = True
    reference: bool = False
    identical_mounts: bool = False


@dataclass(frozen=True, eq=False)
class IdentifiedTest:
    """One test, identified.

    Parameters
    ----------
    found : Identification
    options : IdentifyOptions
        How.
    thesis : ThesisFit or None
        None without a drawing, or where it was not asked for.
    identical : IdenticalFit or None
        None where it was not asked for.
    truth : CompressorTruth or None
        None where it is not known.
    seconds : float
        Of the identification alone [s].
    kept : IdentifiedCompressor
        What other studies load.
    """

    found: Identification
    options: IdentifyOptions
    thesis: ThesisFit | None
    identical: IdenticalFit | None
    truth: CompressorTruth | None
    seconds: float
    kept: IdentifiedCompressor

    @property
    def input_files(self) -> tuple[Path, ...]:
        """Every file that was read, the truth included."""
        truth = () if self.truth is None else (self.truth.path,)
        return (*self.found.test.input_files, *truth)


def read_test(
    folder: Path, *, from_hits: bool = False
) -> tuple[InertanceTest, CompressorTruth | None]:
    """Read a test and, where it is virtual, its truth.

    Raises
    ------
    InputError
        A folder that holds no test that can be read.
    """
    if not folder.is_dir():
        raise InputError(
            f"{folder}: there is no such folder; `deboom bench compressor {folder}` writes a "
            "virtual test"
        )
    return read_inertance_test(folder, from_hits=from_hits), read_compressor_truth(folder)


def identified_test(
    test: InertanceTest,
    truth: CompressorTruth | None,
    options: IdentifyOptions,
    beside: Beside,
    step: Callable[[str], None],
    relative_to: Path | None = None,
) -> IdentifiedTest:
    """Identify a test and fit what was asked for beside.

    Parameters
    ----------
    test : InertanceTest
    truth : CompressorTruth or None
        Kept for comparison.
    options : IdentifyOptions
    beside : Beside
    step : callable of str
        Told what is being done.
    relative_to : Path, optional
        Folder from which input files are named in the saved compressor; without it they leave no
        hashes, since they do not stay.

    Returns
    -------
    IdentifiedTest

    Raises
    ------
    InputError
        As `identify`; identical mounts without a drawing.
    """
    if beside.identical_mounts and test.drawing is None:
        raise InputError(
            f"{test.name}: identical mounts are counted from a drawing, and the test has none: add "
            "its [drawing] and [[mounts]], or leave out --identical-mounts"
        )
    hashes = {} if relative_to is None else hash_files(test.input_files, relative_to)
    with threadpool_limits(1):  # its matrices are too small to share
        begin = time.perf_counter()
        found = identify(test, options, step)
        seconds = time.perf_counter() - begin
        thesis, identical = None, None
        if beside.thesis and test.drawing is not None:
            step("the thesis's 44 numbers")
            thesis = fit_thesis_parameters(found, test.drawing, with_reference=beside.reference)
        if beside.identical_mounts and test.drawing is not None:
            step("identical mounts")
            identical = fit_identical_mounts(found, test.drawing)
    kept = identified_compressor(found, options.bands, hashes)
    return IdentifiedTest(found, options, thesis, identical, truth, seconds, kept)


def identified_folder(
    folder: Path,
    options: IdentifyOptions,
    beside: Beside,
    progress: Progress,
    *,
    from_hits: bool = False,
) -> IdentifiedTest:
    """Read and identify the test of a folder; see `read_test` and `identified_test`."""
    test, truth = read_test(folder, from_hits=from_hits)
    return identified_test(test, truth, options, beside, counted(progress, STEPS), folder)


def identified_virtual(
    seeds: Sequence[int],
    level: CalibrationLevel,
    options: IdentifyOptions,
    beside: Beside,
    progress: Progress,
) -> list[IdentifiedTest]:
    """Measure virtual compressors and identify each.

    Parameters
    ----------
    seeds : sequence of int
        One compressor each; seed 1 has the mounts of the thesis's table 11, others are random.
    level : CalibrationLevel
        Of sensors and impacts.
    options : IdentifyOptions
    beside : Beside
        For the first one; the others are identified only.
    progress : callable

    Returns
    -------
    list of IdentifiedTest
    """
    total = len(seeds) * STEPS
    done = []
    for place, seed in enumerate(seeds):
        step = counted(progress, total, place * STEPS, f"compressor {place + 1}: ")
        step("hammer test")
        plan = CompressorPlan(
            case=CompressorCase.TABLE11 if seed == 1 else CompressorCase.RANDOM,
            identical_mounts=beside.identical_mounts,
        )
        with tempfile.TemporaryDirectory(prefix="deboom-") as scratch:
            folder = write_compressor_test(Path(scratch) / "test", seed, level, plan)
            test, truth = read_test(folder)
        own = beside if place == 0 else Beside(thesis=False)
        done.append(identified_test(test, truth, options, own, step))
    return done


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
        "figure_54_gain": _gain_3(test),
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


def _gain_3(test: IdentifiedTest) -> bytes:
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


def limits_section(
    test: IdentifiedTest, tables: Mapping[str, pd.DataFrame], figures: Mapping[str, bytes]
) -> Section:
    """Say which parameters are seen, which are not, and which come from what was known before."""
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
                in_words(tables["identifiability"]).rename(columns=NARROW)[
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
        figures=pictures_of(figures, ("knowledge",)),
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


def _narrow_columns(tables: Mapping[str, pd.DataFrame]) -> list[str]:
    return [NARROW.get(str(name), "") for name in tables["identifiability"]]


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


if TYPE_CHECKING:
    from deboom.arrays import RealArray
    from deboom.compressor.thesis_fit import IdenticalFit, ThesisFit
    from deboom.study.compressor_identification import IdentifiedTest

_SHOWN_UNIT = {"m": ("mm", 1e3), "rad": ("°", 180 / np.pi), "N/m": ("N/mm", 1e-3)}
_SHOWN_UNIT |= {"kg m^2": ("kg cm²", 1e4)}
SMALLEST_SHARE = 1e-6
"""Of a parameter in the null space, above which it is visible with others only."""


def tables_of(tests: Sequence[IdentifiedTest]) -> dict[str, pd.DataFrame]:
    """Make all tables: of the first compressor in detail, of all of them in ``cases``."""
    first = tests[0]
    tables = {
        "parameters": parameter_table(first),
        "modes": mode_table(first),
        "quality": pd.DataFrame(quality_table(first.found.quality)),
        "knowledge": knowledge_table(first),
        "placement": placement_table(first),
        "correlations": correlation_table(first),
        "held_out": held_out_table(first),
    }
    if first.thesis is not None:
        tables["identifiability"] = identifiability_table(first, first.thesis)
        tables["null_space"] = null_space_table(first.thesis)
        tables["fits"] = fit_table(first.thesis)
    if first.identical is not None:
        tables["identical_mounts"] = identical_table(first.identical)
    if all(test.truth is not None for test in tests):
        tables["cases"] = case_table(tests)
    return tables


def parameter_table(test: IdentifiedTest) -> pd.DataFrame:
    """Tell what was found: start, identified, standard deviation, truth where it is known."""
    found = test.found
    identified = quantities(found.calibrated.model)
    start = quantities(found.point.parametrisation.model(found.start))
    table = {
        "parameter": identified.names,
        "unit": identified.units,
        "start": start.values,
        "identified": identified.values,
        "standard deviation": quantity_deviations(found.calibrated),
    }
    if test.truth is not None:
        table["truth"] = quantities(test.truth.model).values
    return pd.DataFrame(table)


def mode_table(test: IdentifiedTest) -> pd.DataFrame:
    """Rigid-body modes of the identified compressor."""
    modes = test.found.modes
    shares = {
        f"energy {motion} [%]": 100 * modes.energy[row]
        for row, motion in enumerate(("x", "y", "z", "rx", "ry", "rz"))
    }
    return pd.DataFrame(
        {
            "mode": [f"{number}, mainly {name}" for number, name in enumerate(modes.leading, 1)],
            "frequency [Hz]": modes.frequency,
            "loss factor [1]": modes.loss_factor,
            **shares,
        }
    )


def identifiability_table(test: IdentifiedTest, thesis: ThesisFit) -> pd.DataFrame:
    """Put the thesis's numbers side by side with their bounds and what the test says of each."""
    parametrisation = thesis.fit.parametrisation
    assert isinstance(parametrisation, ThesisParameters)
    shown = [_SHOWN_UNIT.get(unit, (unit, 1.0)) for unit in parametrisation.units]
    factor = np.array([scale for _, scale in shown])
    held = set(thesis.fit.at_bound)
    table = {
        "parameter": parametrisation.names,
        "unit": [unit for unit, _ in shown],
        "start": factor * thesis.start,
        "lower bound": factor * thesis.bounds.lower,
        "upper bound": factor * thesis.bounds.upper,
        "fitted": factor * thesis.fit.values,
        "at its bound": ["yes" if name in held else "" for name in parametrisation.names],
        "share in the null space [1]": thesis.seen.participation,
        "posterior deviation": factor * thesis.known.posterior,
        "posterior over prior [1]": thesis.known.ratio,
        "verdict": verdicts(thesis),
    }
    if test.truth is not None:
        names = tuple(mount.name for mount in test.truth.mounts)
        true = ThesisParameters(names).values_of(test.truth.model, test.truth.mounts)
        table["truth"] = factor * true
    return pd.DataFrame(table)


def null_space_table(thesis: ThesisFit) -> pd.DataFrame:
    """Say in words which changes leave every measurement as it is."""
    own_axis = (" rotation x", "'s rotation about its own axis")
    return pd.DataFrame(
        {
            "change": [str(number) for number in range(1, 1 + len(thesis.seen.null_space))],
            "in words": [one.statement.replace(*own_axis) for one in thesis.seen.null_space],
        }
    )


def verdicts(thesis: ThesisFit) -> list[str]:
    """Say of each of the thesis's numbers whether the test knows it."""
    words = []
    for share, ratio in zip(thesis.seen.participation, thesis.known.ratio, strict=True):
        if share >= ALONE:
            words.append("invisible")
        elif ratio > PRIOR_DOMINATED:
            words.append("prior-dominated")
        elif share > SMALLEST_SHARE:
            words.append("with others only")
        else:
            words.append("identified")
    return words


def fit_table(thesis: ThesisFit) -> pd.DataFrame:
    """Optimisers of the thesis's fit side by side."""
    fits = [("least squares, trf", thesis.fit, thesis.seconds)]
    if thesis.reference is not None:
        fits.append(("SLSQP, near to GRG", thesis.reference, thesis.reference_seconds))
    return pd.DataFrame(
        {
            "optimiser": [name for name, _, _ in fits],
            "cost [1]": [fit.cost for _, fit, _ in fits],
            "evaluations": [fit.n_evaluations for _, fit, _ in fits],
            "time [s]": [seconds for _, _, seconds in fits],
            "parameters at a bound": [len(fit.at_bound) for _, fit, _ in fits],
            "converged": [fit.converged for _, fit, _ in fits],
        }
    )


def knowledge_table(test: IdentifiedTest) -> pd.DataFrame:
    """Tell of each minimal parameter what was known, and what is known now."""
    known = test.found.known
    dominated = set(known.prior_dominated)
    finite = np.isfinite(known.prior)
    return pd.DataFrame(
        {
            "parameter": known.names,
            "identified [1]": test.found.calibrated.values,
            "posterior deviation [1]": known.posterior,
            "prior deviation [1]": np.where(finite, known.prior, np.nan),
            "posterior over prior [1]": known.ratio,
            "mark": ["prior-dominated" if name in dominated else "" for name in known.names],
        }
    )


def placement_table(test: IdentifiedTest) -> pd.DataFrame:
    """Errors of gains, places and angles that the test revealed."""
    kept = test.kept
    prior = test.found.calibrated.placement.deviations(test.found.test.tolerances)
    shown = [_placement_unit(name) for name in kept.placement_names]
    factor = np.array([scale for _, scale in shown])
    return pd.DataFrame(
        {
            "error of": kept.placement_names,
            "unit": [unit for unit, _ in shown],
            "found": factor * kept.placement_errors,
            "posterior deviation": factor * kept.placement_deviations,
            "prior deviation": factor * prior,
            "posterior over prior [1]": kept.placement_deviations / prior,
        }
    )


def correlation_table(test: IdentifiedTest) -> pd.DataFrame:
    """Pairs of parameters that the test hardly tells apart."""
    pairs = test.found.known.strong_correlations
    return pd.DataFrame(
        {
            "parameter": [one for one, _, _ in pairs],
            "and": [other for _, other, _ in pairs],
            "correlation [1]": [value for _, _, value in pairs],
        }
    )


def held_out_table(test: IdentifiedTest) -> pd.DataFrame:
    """Predictions of what took no part in the fit."""
    checks = test.found.held_out
    return pd.DataFrame(
        {
            "held out": [check.what for check in checks],
            "reduced χ [1]": [check.reduced_chi for check in checks],
            "error over measured, rms [%]": [100 * check.relative_error for check in checks],
        }
    )


def identical_table(fit: IdenticalFit) -> pd.DataFrame:
    """Place, tilt and stiffness of identical round mounts."""
    parametrisation, n = fit.calibrated.parametrisation, len(fit.drawn)
    values = fit.calibrated.values[10 : 10 + 5 * n]
    deviation = fit.deviations
    unit = ["mm"] * (3 * n) + ["°"] * (2 * n)
    factor = np.array([1e3] * (3 * n) + [180 / np.pi] * (2 * n))
    stiffness = fit.mounts[0].stiffness[:2]
    rows: dict[str, list[object] | RealArray] = {
        "parameter": [
            *parametrisation.names[10 : 10 + 5 * n],
            "axial stiffness",
            "radial stiffness",
        ],
        "unit": [*unit, "N/mm", "N/mm"],
        "identified": np.concatenate([factor * values, 1e-3 * stiffness]),
        "standard deviation": np.concatenate(
            [factor * deviation[: 5 * n], 1e-3 * stiffness * deviation[5 * n :]]
        ),
    }
    return pd.DataFrame(rows)


def case_table(tests: Sequence[IdentifiedTest]) -> pd.DataFrame:
    """Errors of every compressor against its truth."""
    rows = []
    for test in tests:
        assert test.truth is not None
        error = errors_of(test.found, test.truth)
        row: dict[str, object] = {
            "compressor": test.found.test.name,
            "mass [%]": 100 * error.mass,
            "centre of gravity [mm]": 1e3 * error.centre,
            "inertia [%]": 100 * error.inertia,
            "K_VP [%]": 100 * error.stiffness,
            "Re gain [%]": 100 * error.gain_real,
            "Im gain [%]": 100 * error.gain_imaginary,
            "within 1 σ [%]": 100 * float(np.mean(np.abs(error.scores) < 1)),
            "reduced χ [1]": test.found.calibrated.reduced_chi,
            "time [s]": test.seconds,
        }
        if test.identical is not None:
            place, angle = mounting_errors(test.identical, test.truth)
            row |= {"mount place [mm]": 1e3 * place, "mount axis [°]": float(np.degrees(angle))}
        rows.append(row)
    return pd.DataFrame(rows)


def _placement_unit(name: str) -> tuple[str, float]:
    if " position " in name:
        return "mm", 1e3
    return ("°", 180 / np.pi) if " angle " in name else ("%", 100.0)


MODEL_FILE = "compressor_model"
"""Stem of the file that other studies load."""
SHARE = 90
"""Percentile of the errors over the compressors."""


def compressor_result(
    tests: Sequence[IdentifiedTest],
    inputs: tuple[Path, ...] = (),
    *,
    with_figures: bool = True,
) -> StudyResult:
    """Make tables, figures, headline numbers and page.

    Parameters
    ----------
    tests : sequence of IdentifiedTest
        At least one; it is shown in detail, the others by their errors.
    inputs : tuple of Path
        Files that stay; tests that were measured for the study leave none.
    with_figures : bool
        Whether to draw.

    Returns
    -------
    StudyResult
        Among its documents the first compressor, for `read_compressor_model`.
    """
    first = tests[0]
    condition = _condition_8(first)
    tables = tables_of(tests)
    figures = figures_of(first) if with_figures else {}
    return StudyResult(
        tables=tables,
        figures=figures,
        summary=summary_of(tests),
        page=page_of(tests, tables, figures, condition),
        inputs=inputs,
        facts={"characteristic_length_m": first.found.length},
        documents={MODEL_FILE: compressor_document(first.kept)},
    )


def summary_of(tests: Sequence[IdentifiedTest]) -> dict[str, Scalar]:
    """Headline numbers: of the first compressor; errors as 90 % quantile over all of them.

    Returns
    -------
    dict
        Errors only where the truth is known, the rank only with a drawing.
    """
    first = tests[0]
    summary: dict[str, Scalar] = {"mass_kg": first.found.calibrated.model.mass}
    errors = [errors_of(test.found, test.truth) for test in tests if test.truth is not None]
    if errors:
        summary |= {
            "cog_error_mm": _quantile([1e3 * error.centre for error in errors]),
            "inertia_error_percent": _quantile([100 * error.inertia for error in errors]),
            "k_vp_error_percent": _quantile([100 * error.stiffness for error in errors]),
        }
    if first.thesis is not None:
        summary["jacobian_rank"] = first.thesis.seen.rank
    return summary | {
        "reduced_chi2": first.found.calibrated.reduced_chi**2,
        "condition_scaled_100hz": _condition_8(first),
        "seconds": first.seconds,
    }


def _quantile(values: Sequence[float]) -> float:
    return float(np.percentile(values, SHARE))


def _condition_8(test: IdentifiedTest) -> float:
    """Scaled condition number at the line nearest to 100 Hz [1]."""
    inertance = test.found.inertance
    nearest = int(np.argmin(np.abs(inertance.frequency - 100.0)))
    return float(condition_numbers(inertance.values[[nearest]], test.found.length)[0])


COMMAND = "identify"
SEED = 1
"""Identification draws nothing; a run folder states a seed all the same."""


def identify_into_run(
    folder: Path,
    out: Path,
    options: IdentifyOptions,
    beside: Beside,
    progress: Progress,
    *,
    from_hits: bool = False,
    with_figures: bool = True,
) -> Path:
    """Identify the compressor of a hammer test and write a run folder.

    Parameters
    ----------
    folder : Path
        Holds ``compressor_test.toml``.
    out : Path
        Folder that gets ``identify/<run>/``.
    options : IdentifyOptions
    beside : Beside
    progress : callable
    from_hits : bool
        Start from the blocks over time instead of the FRFs.
    with_figures : bool

    Returns
    -------
    Path
        The finished run folder.

    Raises
    ------
    InputError
        A test that cannot be read or identified, an output folder that cannot be written; nothing
        is left behind.
    """
    begin = time.perf_counter()
    progress(0, STEPS + 2, "reading")
    test, truth = read_test(folder, from_hits=from_hits)
    record = _record(folder, options, beside, from_hits=from_hits, with_figures=with_figures)
    done = 0

    def step(text: str) -> None:
        nonlocal done
        done += 1
        progress(min(done, STEPS), STEPS + 2, text)

    def work() -> StudyResult:
        identified = identified_test(test, truth, options, beside, step, folder)
        progress(STEPS + 1, STEPS + 2, "tables and figures")
        return compressor_result([identified], identified.input_files, with_figures=with_figures)

    run = run_command(out, record, work, relative_to=folder, begin=begin)
    progress(STEPS + 2, STEPS + 2, "done")
    return run


def _record(
    folder: Path,
    options: IdentifyOptions,
    beside: Beside,
    *,
    from_hits: bool,
    with_figures: bool,
) -> dict[str, Any]:
    """Gather what is known of a run before it begins."""
    return {
        "study": COMMAND,
        "command": f"deboom identify {folder.as_posix()}",
        "question": "Which compressor explains this hammer test?",
        "seed": SEED,
        "arguments": {
            "band": [f"{low:g}-{high:g}" for low, high in options.bands],
            "lines": options.largest_lines,
            "smallest-coherence": options.smallest_coherence,
            "held-out": options.held_out,
            "from-hits": from_hits,
            "thesis": beside.thesis,
            "reference": beside.reference,
            "identical-mounts": beside.identical_mounts,
            "figures": with_figures,
        },
        "environment": environment_record(PACKAGES),
    }
