"""The page on synthesised sound against the measured one."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from deboom import plot
from deboom.arrays import RealArray
from deboom.measurement.booming_peaks import TOLERANCE, BoomingPeak, PressureComparison
from deboom.measurement.channels import Band
from deboom.measurement.uncertainty import LevelSpread
from deboom.pages.modal import append_modes
from deboom.plot import CurvePanel
from deboom.plot.style import INK, VEHICLE_PALETTE
from deboom.report import Report, Step, Table
from deboom.report.tables import split_label
from deboom.vehicles.path_analysis import paths_by_axis
from deboom.vehicles.synthesis import (
    BLOCKED,
    BY_HAMMER,
    BY_SURFACES,
    CORR_F,
    CORR_S,
    DESIGN,
    FUNCTIONS,
    LARGEST_REST,
    ON_ROAD,
    ON_ROAD_AS_TESTED,
    ON_ROAD_BLOCKED,
    OTHER_PATHS,
    PEAK,
    DesignMotion,
    DrivenVehicles,
    Synthesis,
    Validation,
    VirtualDesign,
    cause_table,
    comparison_table,
    factor_table,
    force_table,
    peak_table,
)

if TYPE_CHECKING:
    from deboom.plot.style import Drawing

BODY_MODES = (24.0, 30.0, 37.0, 40.0, 47.0)
"""Of the thesis's vehicle, figure 43 [Hz]."""
DEPTH = 45.0
"""Of a level axis below the loudest line; deeper notches leave the panel [dB]."""
ALL_PATHS, LEVEL = "sum of all paths", "SPL [dB(A)]"
RECIPROCAL, HAMMER = "reciprocal functions", "hammer functions"
SOUNDS = ("measured in the vehicle", "synthesised")
FORCES = ("measured bench forces", "forces from response surfaces")
_DIGITS = {"%": 1, "dB": 2, "Hz": 2, "1": 3}


def synthesis_report(model: DrivenVehicles, result: Validation) -> Report:
    """Report how far the sound of driven vehicles is from the synthesised one."""
    report = Report(
        "Is the synthesised sound the measured one?",
        "Forces of the mounts on the test bench times noise transfer functions of the trimmed "
        "body give a sound at the ear. How far is it from what a microphone hears in the driven "
        "vehicle, which step costs how much, and do parts that were characterised apart predict a "
        "design that nobody built?",
    )
    report.explain(
        "booming noise",
        "SPL",
        "booming peak",
        "dynamic stiffness",
        "noise transfer function",
    )
    report.inputs += model.input_files
    report.assume(*model.campaign.assumed)
    comparisons, causes, forces = (
        table(result) for table in (comparison_table, cause_table, force_table)
    )
    judged = pd.DataFrame(_criteria(result, comparisons, causes, forces))
    missed = judged.loc[judged["holds"] == "no", "name"]
    report.warn(
        f"Not within its target: {'; '.join(missed)}." if len(missed) else "",
        f"There is no modal analysis: {result.complaint}." if result.complaint else "",
    )
    _answer(report, result, comparisons, judged)
    _headlines(report, result, comparisons)
    _facts(report, result)
    _against_the_thesis(report, result, judged)
    _road(report, result, comparisons)
    _car(report, result)
    report.section(
        "Forces from response surfaces",
        "The same forces from the dynamic stiffness of the mounts and the measured motion. The "
        "surfaces are fitted to all runs but this one. Directions that are not identified keep "
        "their measured force.",
        folded=True,
    )
    report.figure(
        "surface_forces",
        lambda: _pairs(
            result, [synthesis.comparisons[BY_SURFACES] for synthesis in result.shown], FORCES
        ),
        "SPL from measured bench forces and from the surfaces' forces (thesis, figure 38).",
    )
    if result.design is not None:
        _design(report, result, result.design)
    _functions(report, result)
    if result.roads:
        _causes(report, causes, forces)
    if result.modes is not None:
        append_modes(report, result.modes, result.true_shapes, result.shown[0].driven.vehicle.name)
    if result.spread is not None:
        _spread(report, result, result.spread)
    return report


def _answer(
    report: Report, result: Validation, comparisons: pd.DataFrame, judged: pd.DataFrame
) -> None:
    """Say whether the synthesis may be used, how far it is off, and what comes next."""
    road = comparisons[comparisons["comparison"] == ON_ROAD]
    aimed = judged[judged["holds"] != ""]
    missed = aimed.loc[aimed["holds"] == "no", "name"]
    held = f"{len(aimed) - len(missed)} of {len(aimed)} targets hold"
    n_cars, n_peaks = len(result.vehicles), int(road["paired peaks"].sum())
    off = (
        f"{road[CORR_F].median():.1f} % in shape (corr_f) and {road[CORR_S].median():.1f} % in "
        f"scale (corr_s){', in the median,' if len(road) > 1 else ''} and by up to "
        f"{road[PEAK].max():.1f} dB at {n_peaks} booming peak{'' if n_peaks == 1 else 's'}"
    )
    report.answer(
        (
            f"Use the synthesised sound: it differs from the measured one by {off}; {held}."
            if missed.empty
            else f"Look at {len(missed)} missed targets before you use the synthesised sound: "
            f"it differs from the measured one by {off}; {held}."
        ),
        "How sure: the thesis reached 5 %, 10 % and 3 dB. All differences are against the "
        f"microphone of {n_cars} driven vehicle{'' if n_cars == 1 else 's'}.",
        "What not to trust: "
        + (f"{'; '.join(missed)}. " if len(missed) else "")
        + "Levels in notches, where paths cancel: only peaks are compared.",
    )
    each = road.drop(columns=["comparison"])
    report.panel("Each vehicle on the road", Table(each, ""), wide=True)
    report.panel(
        "What to do next",
        Step("deboom run front PLATFORM", "which stiffnesses make the fleet quiet"),
        Step("deboom look VEHICLE", "functions and runs of a vehicle, as measured"),
    )


def _headlines(report: Report, result: Validation, comparisons: pd.DataFrame) -> None:
    """Show and keep the numbers that a hurried reader takes away."""
    road = comparisons[comparisons["comparison"] == ON_ROAD]
    corr_f, corr_s, peak = road[CORR_F].median(), road[CORR_S].median(), road[PEAK].max()
    report.number(
        "corr_f_percent",
        float(corr_f),
        "%",
        "difference in shape of the pressure (corr_f, complex), median; thesis 5 %",
        headline=".1f",
    )
    report.number(
        "corr_s_percent",
        float(corr_s),
        "%",
        "difference in scale (corr_s, magnitude), median; thesis 10 %",
        headline=".1f",
    )
    report.number(
        "peak_deviation_db",
        float(peak),
        "dB",
        "largest deviation of a booming peak from the measured one; thesis 3 dB",
        headline=".1f",
    )
    if result.design is not None:
        report.number(
            "virtual_design_peak_db",
            result.design.peak_deviation,
            "dB",
            "largest deviation of a booming peak of the virtual design, all three ways",
            headline=".2f",
        )
    off = np.concatenate([np.abs(values) for values in _errors(result).values()])
    report.number(
        "line_error_90_percent_db",
        float(np.quantile(off, 0.9)),
        "dB",
        "90 % of the lines of the vehicles shown: level synthesised minus measured, at most",
    )
    where, most = _worst_band(band_errors(result))
    report.number(
        "band_error_db", most, "dB", "median error of the lines in the worst 10 Hz of a vehicle"
    )
    report.number("band_of_largest_error", where, "", "vehicle and band of the largest error")
    surfaces = comparisons[comparisons["comparison"] == BY_SURFACES]
    report.number(
        "surfaces_peak_db",
        float(surfaces[PEAK].max()),
        "dB",
        "largest deviation of a booming peak by the surfaces' forces from the measured forces'",
    )
    shares = [
        _structure_borne(road.causes[OTHER_PATHS])
        for road in result.roads
        if OTHER_PATHS in road.causes
    ]
    if shares:
        report.number(
            "structure_borne_percent",
            float(100 * np.median(np.concatenate(shares))),
            "%",
            "share of the sound at the ear that comes through the mounts, median of the lines, "
            "where the truth is known",
        )
    hammer = comparisons[comparisons["comparison"] == BY_HAMMER]
    report.number(
        "hammer_peak_db",
        float(hammer[PEAK].median()),
        "dB",
        "deviation of a booming peak by the hammer's functions from the loudspeaker's, median",
    )
    if result.spread is not None:
        report.number(
            "level_spread_db",
            result.spread.quantile(0.5),
            "dB",
            "spread of the measured levels of the vehicles, median of the lines",
        )
    modes, truth = result.modes, result.true_shapes
    if modes is None:
        return
    for n, frequency in enumerate(modes.frequency, 1):
        report.number(
            f"mode_{n}_hz", float(frequency), "Hz", "frequency of a mode of the first vehicle"
        )
    agreement = () if truth is None else np.diag(modes.mac(truth))
    for n, mac in enumerate(agreement, 1):
        report.number(f"mode_{n}_mac", float(mac), "1", "MAC of the mode against the true shape")


def _structure_borne(heard: PressureComparison) -> RealArray:
    """Return how much of the sound at the ear comes through the mounts, per line [1]."""
    through, beside = np.abs(heard.compared), np.abs(heard.reference - heard.compared)
    return np.asarray(through / (through + beside))


def _facts(report: Report, result: Validation) -> None:
    """Note what was settled beside the options."""
    data = result.data
    report.facts |= {
        "run": data.run,
        "ear": result.listening.ear,
        "vehicles": ", ".join(result.vehicles),
        "mount_sets": ", ".join(name for name in data.sets if name not in data.mixes),
    }
    if result.complaint:
        report.facts["no_modal_analysis"] = result.complaint


def _against_the_thesis(report: Report, result: Validation, judged: pd.DataFrame) -> None:
    """Show every figure beside thesis and target."""
    low, high = result.listening.band
    sets = list(dict.fromkeys(synthesis.driven.mount_set for synthesis in result.syntheses))
    n_vehicles = len(result.vehicles)
    report.section(
        "Every figure beside the thesis",
        f"{n_vehicles} {'vehicles' if n_vehicles > 1 else 'vehicle'} with mount sets "
        f"{', '.join(sets)}, run {result.data.run}, {result.listening.ear}, {low:g} to {high:g} "
        "Hz. corr_f = |1 − MAC| is the difference in shape, corr_s = |1 − MSF| that in scale, "
        "relative to the measured pressure: a synthesis twice as loud has 100 %. Both are of "
        "pressures, complex or as magnitudes, never of dB curves. Booming peaks are compared with "
        f"peaks, paired within {TOLERANCE:g} Hz; a peak without partner has no deviation and is "
        "counted. Line by line, the largest difference in a notch would say nothing about booming.",
    )
    words = judged[["thesis", "target", "holds"]].replace("", "–")
    written = list(map(_written, judged["name"], judged["measured"]))
    shown = judged.rename(columns={"name": "figure"}).assign(measured=written, **words)
    report.table(
        "validation", judged, "A figure without target is reported, not judged.", shown=shown
    )


def _road(report: Report, result: Validation, comparisons: pd.DataFrame) -> None:
    """Compare the road with the synthesis."""
    report.section(
        "Measured against synthesised",
        "The bench measures with cool mounts on a stiff frame, the vehicle drives with warmer ones "
        "on a body that gives way, and its microphone hears other paths as well. Forces of the "
        "bench are blocked forces. Where the hammer test recorded the accelerometers, the body's "
        "receptance makes interface forces of them, which belong with the functions of the trimmed "
        "body; blocked forces with these functions are the thesis's approximation, and are "
        "shown for comparison.",
    )
    report.figure(
        "measured_synthesised",
        lambda: _pairs(
            result, [synthesis.comparisons[ON_ROAD] for synthesis in result.shown], SOUNDS
        ),
        "Measured and synthesised SPL of every vehicle; dots are paired booming peaks (thesis, "
        "figure 36).",
    )
    heard = result.shown[0].comparisons[ON_ROAD]
    bands = band_errors(result)
    where, most = _worst_band(bands)
    report.figure(
        "synthesis_error",
        lambda: plot.curve_panels(
            [CurvePanel("", heard.frequency, _errors(result))],
            columns=1,
            order=heard.order,
            y_label="synthesised minus measured [dB]",
        ),
        "Error of the synthesis over frequency (thesis, figure 37). It is largest in notches, "
        "where nobody hears it, and next to peaks that lie at another frequency; over a band in "
        f"{where}: {most:.1f} dB in the median line.",
    )
    report.table(
        "synthesis_error",
        bands,
        "Median error of the lines, without sign, in bands of 10 Hz.",
    )
    road = comparisons[comparisons["comparison"] == ON_ROAD]
    report.table(
        "comparisons",
        comparisons,
        "Every vehicle and mount set.",
        shown=road.drop(columns=["comparison"]),
    )
    peaks = peak_table(result)
    alone = peaks[(peaks["comparison"] == ON_ROAD) & peaks["deviation [dB]"].isna()]
    shown = alone.drop(columns=["comparison", "deviation [dB]"]).rename(
        columns=lambda n: str(n).replace("reference", "measured").replace("compared", "synthesised")
    )
    caption = "Booming peaks of one curve alone: they have no deviation."
    report.table("peaks", peaks, "" if alone.empty else caption, shown=shown)


def _errors(result: Validation) -> dict[str, RealArray]:
    """Return synthesised minus measured level [dB] of every vehicle that is shown, by its name."""
    errors = {}
    for synthesis in result.shown:
        measured, synthesised = synthesis.comparisons[ON_ROAD].levels
        errors[synthesis.driven.vehicle.name] = synthesised - measured
    return errors


def band_errors(result: Validation) -> pd.DataFrame:
    """Find the median of the error without sign in each band of 10 Hz, a row per vehicle [dB]."""
    frequency = result.shown[0].comparisons[ON_ROAD].frequency
    low, high = result.listening.band
    edges = np.append(np.arange(low, high, 10.0), high)
    band_of = np.clip(np.searchsorted(edges, frequency, side="right") - 1, 0, len(edges) - 2)
    columns = {
        f"{start:g} to {end:g} Hz [dB]": band_of == n
        for n, (start, end) in enumerate(pairwise(edges))
    }
    rows = {
        vehicle: {name: np.median(np.abs(error[lines])) for name, lines in columns.items()}
        for vehicle, error in _errors(result).items()
    }
    return pd.DataFrame.from_dict(rows, orient="index").rename_axis("vehicle").reset_index()


def _worst_band(bands: pd.DataFrame) -> tuple[str, float]:
    """Return vehicle with band, in words, and size of the largest error [dB]."""
    sizes = bands.set_index("vehicle").to_numpy(dtype=float)
    row, column = divmod(int(sizes.argmax()), sizes.shape[1])
    band, _ = split_label(str(bands.columns[1 + column]))
    return f"{bands['vehicle'].iloc[row]}, {band}", float(sizes.max())


def _car(report: Report, result: Validation) -> None:
    """Show what the car says of its loudspeaker and its mounts, and what that changes."""
    factors = factor_table(result)
    refused = factors.loc[
        factors["left of forces by inversion [%]"].notna() & ~factors["taken over"]
    ]
    report.section(
        "What the car says of the loudspeaker and of its mounts",
        "The strength of a loudspeaker is calibrated to some tenths of a decibel: the functions of "
        "the hammer, which is calibrated better, correct it by one factor for the ear. How stiff "
        "the mounts are on the road, warmer or older than on the bench, shows in the forces that "
        "accelerations on the body give by inversion: one factor of all mounts and one of each "
        "besides bring the bench's forces closest to them. The microphone takes no part in "
        "either, so the comparison with it stays one. Factors are taken over where what they "
        f"leave of these forces is at most {LARGEST_REST:g} times the error of the inversion.",
    )
    report.warn(
        "Mounts that are softer or harder do not explain the forces on the road of "
        f"{'; '.join(refused['vehicle'] + ' with ' + refused['mount set'])}: bench and car differ "
        "in something else, such as a part, a bracket or the powertrain. Forces of the bench are "
        "taken as they are."
        if len(refused)
        else ""
    )
    report.table("car_factors", factors, "Every vehicle and mount set.")


def _design(report: Report, result: Validation, design: VirtualDesign) -> None:
    """Show the virtual design in every vehicle."""
    outside = int(design.resolved.outside.sum())
    kept = f" Measured forces stay in {'; '.join(design.kept)}." if design.kept else ""
    report.section(
        "A virtual design",
        f"{design.mix}: every part was characterised in another mount set, and the bench measured "
        "the design itself for comparison. With the motion that was measured with the design the "
        "check is nearly circular. With the motion of "
        f"{design.other} nothing of the design is known but its parts. Re-solved, only the "
        f"excitation comes from {design.other}: inertia from the data sheet, stiffness from the "
        f"surfaces at the amplitude that comes out ({design.resolved.sweeps} sweeps; lines and "
        f"directions outside of the measured region: {outside}).{kept}",
    )
    measured = "measured forces of the design"
    colours = {way.value: VEHICLE_PALETTE[place] for place, way in enumerate(DesignMotion)}
    levels = []
    lines = next(iter(design.comparisons.values()))
    for name in result.vehicles:
        ways = {way.value: design.comparisons[name, way] for way in DesignMotion}
        worst = max(compared.peak_deviation for compared in ways.values())
        reference = ways[DesignMotion.OF_THE_MIX.value].levels[0]
        levels.append(
            CurvePanel(
                name,
                lines.frequency,
                {measured: reference}
                | {label: comparison.levels[1] for label, comparison in ways.items()},
                note=f"peaks within {worst:.2f} dB" if np.isfinite(worst) else "no paired peak",
            )
        )
    report.figure(
        "virtual_design",
        lambda: plot.curve_panels(
            levels,
            columns=2,
            order=lines.order,
            y_label=LEVEL,
            colours={measured: INK, **colours},
            dashed=list(colours),
            depth=DEPTH,
        ),
        "SPL of the design from its measured forces, and from the surfaces of its parts in three "
        "ways (thesis, figure 40); the dashes take turns.",
    )


def _functions(report: Report, result: Validation) -> None:
    """Hold both methods to measure functions against each other; contributions of the paths."""
    first = result.shown[0]
    report.section(
        "Hammer against loudspeaker, and contributions",
        "Both methods acquire the same functions with errors of their own: hammer against "
        "accelerometers and a calibrated volume source. Contributions of single paths exceed their "
        "sum where they cancel, so an error of one function is not an error of the sum by its "
        "size alone.",
        folded=True,
    )
    report.figure(
        "hammer_reciprocal",
        lambda: _pairs(
            result,
            [synthesis.comparisons[BY_HAMMER] for synthesis in result.shown],
            (RECIPROCAL, HAMMER),
        ),
        "SPL with the same bench forces and functions of either method (thesis, figure 41).",
    )
    report.figure(
        "contributions",
        lambda: _contributions(first, result.listening.band),
        f"{first.driven.title}: partial sums per mount along x, of all paths across, and their "
        "sum, by both methods (thesis, figure 42). A mount that is louder than the sum is "
        f"cancelled by others. Groups {DEPTH:g} dB below the loudest line are left out.",
    )
    report.table(
        "contributions",
        first.reciprocal.ranking(result.listening.band),
        f"{first.driven.title}, reciprocal functions: paths by their own A-weighted size in the "
        "band. The share of the energy counts the phase: below 0 a path takes away.",
    )


def _causes(report: Report, causes: pd.DataFrame, forces: pd.DataFrame) -> None:
    """Say what a synthesis loses where."""
    report.section(
        "Where the accuracy is lost",
        "Interface forces of the driven vehicle, found by inversion from accelerations on its "
        "body, are exact with the trimmed body's functions. What they predict better than bench "
        "forces is the cost of taking blocked forces; what they still miss is the error of the "
        "transfer functions and of the inversion. Where the truth is known each step "
        "stands alone. Accelerometers that took no part in the inversion judge its forces.",
    )
    medians = causes.groupby("what is compared", sort=False)[[CORR_F, CORR_S, PEAK]].median()
    report.table("causes", causes, "Median over the vehicles.", shown=medians.reset_index())
    report.table("forces", forces, "Errors over the band, all directions together.")


def _spread(report: Report, result: Validation, spread: LevelSpread) -> None:
    """Show how far the vehicles of the group lie apart, and without the one that differs most."""
    rest = ""
    if result.spread_without is not None:
        name, others = result.spread_without
        rest = f", without {name} {others.quantile(0.5):.1f} dB"
    report.section(
        "Vehicles of one group",
        f"The measured levels of {len(result.vehicles)} vehicles lie {spread.quantile(0.5):.1f} dB "
        f"apart in the median line{rest}, {spread.quantile(0.9):.1f} dB in nine of ten. A "
        "synthesis that is to distinguish vehicles must be well below that.",
        folded=True,
    )
    heard = result.shown[0].comparisons[ON_ROAD]
    panel = CurvePanel("", heard.frequency, result.measured_levels)
    report.figure(
        "vehicles_of_one_group",
        lambda: plot.curve_panels([panel], columns=1, order=heard.order, y_label=LEVEL),
        "Measured level of every vehicle over the others (thesis, figure 10).",
    )


def criterion(
    name: str, measured: float, thesis: str = "", *, most: float = np.inf, least: float = -np.inf
) -> dict[str, Any]:
    """Hold a figure against what was asked and what the thesis reports; unknown is not held."""
    target = f"≤ {most:g}" if most < np.inf else f"≥ {least:g}" if least > -np.inf else ""
    holds = ("yes" if least <= measured <= most else "no") if target else ""
    figures = {"name": name, "measured": float(measured), "thesis": thesis}
    return {**figures, "target": target, "holds": holds}


def _written(name: str, measured: float) -> str:
    """Write a figure with the decimals of its unit."""
    digits = _DIGITS.get(split_label(name)[1], 2)
    return f"{measured:.{digits}f}" if np.isfinite(measured) else "not known"


def _criteria(
    result: Validation, comparisons: pd.DataFrame, causes: pd.DataFrame, forces: pd.DataFrame
) -> list[dict[str, Any]]:
    """Gather the figures of a validation."""
    of = {str(what): rows for what, rows in comparisons.groupby("comparison", sort=False)}
    road, surfaces, hammer = of[ON_ROAD], of[BY_SURFACES], of[BY_HAMMER]
    alone = float(road["unpaired peaks"].sum())
    unpaired = 100 * alone / max(alone + 2 * float(road["paired peaks"].sum()), 1.0)
    # what blocked forces are asked for, and interface forces
    corr_f, corr_s = ((1, 2), (10, 15)) if ON_ROAD_BLOCKED in of else ((5, 10), (15, 20))
    judged = [
        criterion(
            "corr_f, complex pressure, median [%]", road[CORR_F].median(), "5", most=corr_f[0]
        ),
        criterion("corr_f, complex pressure, largest [%]", road[CORR_F].max(), most=corr_f[1]),
        criterion("corr_s, magnitude, median [%]", road[CORR_S].median(), "10", most=corr_s[0]),
        criterion("corr_s, magnitude, largest [%]", road[CORR_S].max(), most=corr_s[1]),
        criterion(
            "peaks, synthesised against measured, largest [dB]", road[PEAK].max(), "3", most=3
        ),
        criterion(
            "corr_s without what the car says, median [%]", of[ON_ROAD_AS_TESTED][CORR_S].median()
        ),
        *_blocked_criteria(of.get(ON_ROAD_BLOCKED)),
        criterion("peaks of one curve alone, share [%]", unpaired),
        criterion("forces from surfaces, at peaks, largest [dB]", surfaces[PEAK].max(), most=0.3),
        *(
            criterion(f"{what}, at peaks, largest [dB]", rows[PEAK].max(), most=0.5)
            for what, rows in of.items()
            if what.startswith(DESIGN)
        ),
        criterion(
            "hammer against reciprocal, at peaks, median [dB]", hammer[PEAK].median(), "1 to 2"
        ),
        criterion(
            "hammer against reciprocal, at peaks, largest [dB]", hammer[PEAK].max(), "1 to 2"
        ),
    ]
    if result.roads:
        judged += _force_criteria(causes, forces)
    if result.spread is not None:
        name = f"spread over {len(result.vehicles)} vehicles of one group, median [dB]"
        judged.append(criterion(name, result.spread.quantile(0.5), "10 to 15"))
    if result.spread_without is not None:
        left_out, others = result.spread_without
        name = f"spread of the same without {left_out}, median [dB]"
        judged.append(criterion(name, others.quantile(0.5), "10 to 15"))
    return judged + _mode_criteria(result)


def _blocked_criteria(blocked: pd.DataFrame | None) -> list[dict[str, Any]]:
    """Show what the synthesis from blocked forces reaches, where it is not the one judged."""
    if blocked is None:
        return []
    names = {
        "corr_f, blocked forces instead, median [%]": blocked[CORR_F].median(),
        "corr_s, blocked forces instead, median [%]": blocked[CORR_S].median(),
        "peaks, blocked forces instead, largest [dB]": blocked[PEAK].max(),
    }
    return [criterion(name, value) for name, value in names.items()]


def _force_criteria(causes: pd.DataFrame, forces: pd.DataFrame) -> list[dict[str, Any]]:
    """Judge the forces found on the road, and what blocked forces and functions cost."""
    judged = []
    inversion = forces["forces by inversion, rms error [%]"]
    if inversion.notna().any():
        corr_f = causes.groupby("what is compared")[CORR_F].median()
        name = "interface forces by inversion on the road, rms error, largest [%]"
        blocked = forces["bench forces, rms error [%]"].max()
        judged = [
            criterion(name, inversion.max(), most=10),
            criterion("bench forces as interface forces, rms error, largest [%]", blocked),
            criterion(
                "interface forces from bench and receptance, rms error, largest [%]",
                forces["interface forces, rms error [%]"].max(),
                most=10,
            ),
            criterion("cost of blocked forces, corr_f, median [%]", corr_f[BLOCKED]),
            criterion("cost of measured transfer functions, corr_f, median [%]", corr_f[FUNCTIONS]),
        ]
    held_out = forces["held-out accelerometers, median error [%]"].max()
    return [*judged, criterion("held-out accelerometers, median error, largest [%]", held_out)]


def _mode_criteria(result: Validation) -> list[dict[str, Any]]:
    """Judge the modes: each against the nearest true one, and true ones that none was near."""
    modes, truth = result.modes, result.shown[0].driven.truth
    if modes is None:
        return []
    judged = [
        criterion(f"mode {n}, natural frequency [Hz]", float(value), f"{wanted:g}")
        for n, (wanted, value) in enumerate(zip(BODY_MODES, modes.frequency, strict=False), 1)
    ]
    if truth is None or result.true_shapes is None:
        return judged
    true = truth.natural_frequency
    nearest = np.abs(np.subtract.outer(modes.frequency, true)).argmin(axis=1)
    missed = len(set(range(modes.n_modes)) - set(nearest.tolist()))
    frequency = np.abs(modes.frequency / true[nearest] - 1).max()
    ratio = modes.model.damping[: modes.n_modes] / truth.damping_ratio[nearest]
    damping = np.abs(ratio - 1).max()
    against = "against the truth, largest error [%]"
    judged += [
        criterion("true modes among the lowest that were missed [1]", missed, most=0),
        criterion(f"natural frequencies {against}", 100 * float(frequency), most=0.5),
        criterion(f"damping ratios {against}", 100 * float(damping), most=15),
    ]
    least = float(np.diag(modes.mac(result.true_shapes)).min())
    if np.isfinite(least):
        name = "shapes of the modes against the truth, least MAC [1]"
        judged.append(criterion(name, least, least=0.95))
    return judged


def _pairs(
    result: Validation, pairs: Sequence[PressureComparison], labels: tuple[str, str]
) -> Drawing:
    """Every vehicle once: two curves with their paired peaks."""
    panels = []
    for synthesis, pair in zip(result.shown, pairs, strict=True):
        peaks = [[both[side] for both in pair.peaks.pairs] for side in (0, 1)]
        panels.append(
            CurvePanel(
                synthesis.driven.title,
                pair.frequency,
                dict(zip(labels, pair.levels, strict=True)),
                {
                    n: _points(of_curve)
                    for n, of_curve in zip(labels, peaks, strict=True)
                    if of_curve
                },
                note=f"peaks within {pair.peak_deviation:.2f} dB" if peaks[0] else "no paired peak",
            )
        )
    return plot.curve_panels(
        panels,
        columns=2,
        order=pairs[0].order,
        y_label=LEVEL,
        colours={labels[0]: INK, labels[1]: VEHICLE_PALETTE[1]},
        dashed=labels[1:],
        depth=DEPTH,
    )


def _points(peaks: list[BoomingPeak]) -> tuple[RealArray, RealArray]:
    """Return frequencies and levels of peaks."""
    return np.array([peak.frequency for peak in peaks]), np.array([peak.level for peak in peaks])


def _contributions(first: Synthesis, band: Band) -> Drawing:
    """Draw partial sums along x each, across by axis, and their sum, by both methods each."""
    frequency = first.reciprocal.frequency
    inside = (frequency >= band[0]) & (frequency <= band[1])
    panels = []
    by_axis = paths_by_axis(first.reciprocal.paths)
    groups = {name: [name] for name in by_axis.get("x", ())}
    groups |= {f"all {axis}": [*of] for axis, of in by_axis.items() if axis != "x"}
    reciprocal, hammer = first.reciprocal.grouped(groups), first.hammer.grouped(groups)
    pairs = {ALL_PATHS: (reciprocal.level, hammer.level)}
    columns = zip(reciprocal.path_levels.T, hammer.path_levels.T, strict=True)
    pairs |= dict(zip(reciprocal.paths, columns, strict=True))
    loudest = reciprocal.level[inside].max()
    for name, levels in pairs.items():
        seen = [level[inside] for level in levels]
        if max(level.max() for level in seen) > loudest - DEPTH:
            methods = dict(zip((RECIPROCAL, HAMMER), seen, strict=True))
            panels.append(CurvePanel(name, frequency[inside], methods))
    return plot.curve_panels(
        panels,
        order=first.comparisons[ON_ROAD].order,
        y_label=LEVEL,
        colours={RECIPROCAL: INK, HAMMER: VEHICLE_PALETTE[1]},
        dashed=(HAMMER,),
        columns=2,
        depth=DEPTH,
    )
