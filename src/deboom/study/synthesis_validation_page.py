"""The page of a validated synthesis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from deboom.report.page import Headline, Page, Picture, Section, Table
from deboom.report.tables import split_label
from deboom.study.synthesis_validation_criteria import Criterion
from deboom.study.synthesis_validation_numbers import BY_HAMMER, DESIGN, ON_ROAD, PEAK, Validation
from deboom.vehicles.booming_peaks import TOLERANCE

TERMS = ("booming noise", "SPL", "booming peak", "dynamic stiffness", "noise transfer function")

_DIGITS = {"%": 1, "dB": 2, "Hz": 2, "1": 3}

MODAL_FIGURES = {
    "stabilisation": "Stabilisation chart: poles over the order of the polynomial.",
    "mode_shapes": "Shapes of the modes at the mounts and panels.",
    "mac": "Shapes found against each other, or against the truth where it is known (MAC).",
    "rebuilt": "Measured functions, and those rebuilt from modes and residuals.",
    "panel_contributions": "What each panel brings to the pressure at the ear in each mode.",
}
"""Captions of `deboom.study.modal_figures`."""


def validation_page(
    result: Validation,
    found: Sequence[Criterion],
    tables: Mapping[str, pd.DataFrame],
    figures: Mapping[str, bytes],
    complaint: str,
) -> Page:
    """Write the report.

    Parameters
    ----------
    result : Validation
    found : sequence of Criterion
        Every figure beside thesis and target.
    tables : mapping of str to DataFrame
        Of the study.
    figures : mapping of str to bytes
        PNG by file stem; empty if nothing was drawn.
    complaint : str
        Why there is no modal analysis; empty where there is one.
    """
    missed = [one.name for one in found if one.holds == "no"]
    warnings = []
    if missed:
        warnings.append(f"Not within its target: {'; '.join(missed)}.")
    if complaint:
        warnings.append(f"There is no modal analysis: {complaint}.")
    sections = (
        _criteria(result, found),
        _road(tables, figures),
        _forces(figures),
        *([_design(result, tables, figures)] if result.design is not None else []),
        _functions(result, tables, figures),
        *([_causes(tables, figures)] if "causes" in tables else []),
        *([_modes(result, tables, figures)] if "modes" in tables else []),
        *([_spread(result, figures)] if result.spread is not None else []),
    )
    return Page(
        title="Is the synthesised sound the measured one?",
        question=(
            "Forces of the mounts on the test bench times noise transfer functions of the trimmed "
            "body give a sound at the ear. How far is it from what a microphone hears in the "
            "driven vehicle, which step costs how much, and do parts that were characterised apart "
            "predict a design that nobody built?"
        ),
        headlines=_headlines(tables["comparisons"], result),
        terms=TERMS,
        warnings=tuple(warnings),
        sections=sections,
    )


def _headlines(comparisons: pd.DataFrame, result: Validation) -> tuple[Headline, ...]:
    road = comparisons[comparisons["comparison"] == ON_ROAD]
    shown = [
        Headline(
            f"{road['corr_f complex [%]'].median():.1f} %",
            "difference in shape of the pressure (corr_f, complex), median; thesis 5 %",
        ),
        Headline(
            f"{road['corr_s magnitude [%]'].median():.1f} %",
            "difference in scale (corr_s, magnitude), median; thesis 10 %",
        ),
    ]
    if np.isfinite(road[PEAK]).any():
        label = "largest deviation of a booming peak from the measured one; thesis 3 dB"
        shown.append(Headline(f"{road[PEAK].max():.1f} dB", label))
    if result.design is not None and np.isfinite(result.design.peak_deviation):
        label = "largest deviation of a booming peak of the virtual design, all three ways"
        shown.append(Headline(f"{result.design.peak_deviation:.2f} dB", label))
    return tuple(shown)


def _criteria(result: Validation, found: Sequence[Criterion]) -> Section:
    low, high = result.listening.band
    sets = list(dict.fromkeys(one.driven.mount_set for one in result.syntheses))
    vehicles = len(result.data.vehicles)
    frame = pd.DataFrame(
        {
            "figure": [one.name for one in found],
            "measured": [_written(one) for one in found],
            "thesis": [one.thesis or "–" for one in found],
            "target": [one.target or "–" for one in found],
            "holds": [one.holds or "–" for one in found],
        }
    )
    return Section(
        "Every figure beside the thesis",
        f"{vehicles} {'vehicles' if vehicles > 1 else 'vehicle'} with mount sets "
        f"{', '.join(sets)}, run {result.data.run}, {result.listening.ear}, {low:g} to {high:g} "
        "Hz. corr_f = |1 − MAC| is the difference in shape, corr_s = |1 − MSF| the scale that "
        "the synthesised pressure still needs to meet the measured one; the scale over the "
        "measured pressure stands beside it. Both are of pressures, complex or as magnitudes, "
        "never of dB curves. Booming peaks are compared with peaks, paired within "
        f"{TOLERANCE:g} Hz; a peak without partner has no deviation and is counted. Line by line, "
        "the largest difference in a notch would say nothing about booming.",
        tables=(Table(frame, "A figure without target is reported, not judged."),),
    )


def _written(one: Criterion) -> str:
    if not np.isfinite(one.measured):
        return "not known"
    return f"{one.measured:.{_DIGITS.get(split_label(one.name)[1], 2)}f}"


def _road(tables: Mapping[str, pd.DataFrame], figures: Mapping[str, bytes]) -> Section:
    frame = tables["comparisons"]
    road = frame[frame["comparison"] == ON_ROAD].drop(
        columns=["comparison", "corr_s magnitude, over the reference [%]"]
    )
    return Section(
        "Measured against synthesised",
        "The bench measures with cool mounts on a stiff frame, the vehicle drives with warmer ones "
        "on a body that gives way, and its microphone hears other paths as well. Forces of the "
        "bench are blocked forces; they belong with the transfer functions of the assembled "
        "vehicle, and those of the trimmed body are the thesis's approximation.",
        figures=_pictures(
            figures,
            {
                "measured_synthesised": "Measured and synthesised SPL of every vehicle; dots are "
                "paired booming peaks (thesis, figure 36).",
                "synthesis_error": "Every vehicle and mount set, dots by vehicle: difference in "
                "shape, in scale, and at booming peaks (thesis, figure 37).",
            },
        ),
        tables=(
            Table(road, "Every vehicle and mount set. Notches rule the rms over all lines."),
            *_unpaired(tables["peaks"]),
        ),
    )


def _unpaired(peaks: pd.DataFrame) -> tuple[Table, ...]:
    """Peaks of one curve alone; no table without any."""
    alone = peaks[(peaks["comparison"] == ON_ROAD) & peaks["deviation [dB]"].isna()]
    if alone.empty:
        return ()
    shown = alone.drop(columns=["comparison", "deviation [dB]"]).rename(
        columns={name: name.replace("reference", "measured") for name in alone.columns}
    )
    shown = shown.rename(columns=lambda name: str(name).replace("compared", "synthesised"))
    return (Table(shown, "Booming peaks of one curve alone: they have no deviation."),)


def _forces(figures: Mapping[str, bytes]) -> Section:
    return Section(
        "Forces from response surfaces",
        "The same forces from the dynamic stiffness of the mounts and the measured motion. The "
        "surfaces are fitted to all runs but this one. Directions that are not identified keep "
        "their measured force.",
        figures=_pictures(
            figures,
            {
                "surface_forces": "SPL from measured bench forces and from the surfaces' forces "
                "(thesis, figure 38)."
            },
        ),
    )


def _design(
    result: Validation, tables: Mapping[str, pd.DataFrame], figures: Mapping[str, bytes]
) -> Section:
    design = result.design
    assert design is not None
    frame = tables["comparisons"]
    rows = frame[frame["comparison"].str.startswith(DESIGN)]
    outside = int(design.resolved.outside.sum())
    kept = f" Measured forces stay in {'; '.join(design.kept)}." if design.kept else ""
    return Section(
        "A virtual design",
        f"{design.mix}: every part was characterised in another mount set, and the bench measured "
        "the design itself for comparison. With the motion that was measured with the design the "
        "check is nearly circular. With the motion of "
        f"{design.other} nothing of the design is known but its parts. Re-solved, only the "
        f"excitation comes from {design.other}: inertia from the data sheet, stiffness from the "
        f"surfaces at the amplitude that comes out ({design.resolved.sweeps} sweeps; lines and "
        f"directions outside of the measured region: {outside}).{kept}",
        figures=_pictures(
            figures,
            {
                "virtual_design": "SPL of the design from its measured forces, and from the "
                "surfaces of its parts in three ways (thesis, figure 40); the dashes take turns.",
                "virtual_design_deviation": "The same levels less those of the measured forces, "
                "line by line.",
            },
        ),
        tables=(
            Table(
                rows.drop(
                    columns=[
                        "mount set",
                        "corr_f magnitude [%]",
                        "corr_s complex [%]",
                        "corr_s magnitude, over the reference [%]",
                    ]
                ),
                "Against the forces measured with the design on the bench.",
                {"corr_f complex [%]": 3, "corr_s magnitude [%]": 2},
            ),
        ),
    )


def _functions(
    result: Validation, tables: Mapping[str, pd.DataFrame], figures: Mapping[str, bytes]
) -> Section:
    frame = tables["comparisons"]
    rows = frame[frame["comparison"] == BY_HAMMER]
    first = result.shown[0].driven.title
    by_vehicle = rows.groupby("vehicle", sort=False)[
        ["corr_f complex [%]", "corr_s magnitude [%]", PEAK]
    ].median()
    return Section(
        "Hammer against loudspeaker, and contributions",
        "Both methods acquire the same functions with errors of their own: hammer against "
        "accelerometers and a calibrated volume source. Contributions of single paths exceed their "
        "sum where they cancel, so an error of one function is not an error of the sum by its "
        "size alone.",
        figures=_pictures(
            figures,
            {
                "hammer_reciprocal": "SPL with the same bench forces and functions of either "
                "method (thesis, figure 41).",
                "contributions": f"{first}: partial sums per mount along x, and of all "
                "paths across (thesis, figure 42). Groups 45 dB below the loudest line are left "
                "out.",
            },
        ),
        tables=(
            Table(by_vehicle.reset_index(), "Median over the mount sets."),
            Table(
                tables["contributions"],
                f"{first}, reciprocal functions: paths by their own A-weighted size in the "
                "band. The share of the energy counts the phase: below 0 a path takes away.",
            ),
        ),
    )


def _causes(tables: Mapping[str, pd.DataFrame], figures: Mapping[str, bytes]) -> Section:
    frame = tables["causes"]
    medians = frame.groupby("what is compared", sort=False)[
        ["corr_f complex [%]", "corr_s magnitude [%]", PEAK]
    ].median()
    return Section(
        "Where the accuracy is lost",
        "Interface forces of the driven vehicle, found by inversion from accelerations on its "
        "body, are exact with the trimmed body's functions. What they predict better than bench "
        "forces is the cost of taking blocked forces; what they still miss is the error of the "
        "transfer functions and of the inversion. Where the truth is known each step "
        "stands alone. Accelerometers that took no part in the inversion judge its forces.",
        figures=_pictures(
            figures,
            {
                "causes": "Each step alone, dots by vehicle: difference in shape, in scale, and at "
                "booming peaks.",
                "interface_forces": "Forces along x of one vehicle: measured on the bench, found "
                "by inversion on the road, and the truth where it is known.",
            },
        ),
        tables=(
            Table(medians.reset_index(), "Median over the vehicles."),
            Table(tables["forces"], "Errors over the band, all directions together."),
        ),
    )


def _modes(
    result: Validation, tables: Mapping[str, pd.DataFrame], figures: Mapping[str, bytes]
) -> Section:
    more = [name for name in ("panel_contributions",) if name in tables]
    return Section(
        "Modes of the body",
        f"{result.shown[0].driven.vehicle.name}, from the loudspeaker's measurement (thesis, "
        "figure 43): poles by least squares on a common denominator over rising orders, clustered; "
        "shapes with residuals for the modes outside of the band.",
        figures=_pictures(figures, MODAL_FIGURES),
        tables=(
            Table(tables["modes"], "Median over the orders with its spread."),
            *(Table(tables[name], "Panels by mode.") for name in more),
        ),
    )


def _spread(result: Validation, figures: Mapping[str, bytes]) -> Section:
    spread = result.spread
    assert spread is not None
    return Section(
        "Vehicles of one drawing",
        f"The measured levels of {len(result.data.vehicles)} nominally identical vehicles lie "
        f"{spread.quantile(0.5):.1f} dB apart in the median line, {spread.quantile(0.9):.1f} dB "
        "in nine of ten. A synthesis that is to tell vehicles apart must be well below that.",
        figures=_pictures(
            figures, {"vehicle_spread": "SPL measured in every vehicle (thesis, figure 10)."}
        ),
    )


def _pictures(figures: Mapping[str, bytes], captions: Mapping[str, str]) -> tuple[Picture, ...]:
    return tuple(
        Picture(figures[stem], alt=caption, caption=caption)
        for stem, caption in captions.items()
        if stem in figures
    )
