"""The report on the unbalance of a running compressor."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from deboom import plot
from deboom.arrays import RealArray
from deboom.compressor.acceptance import DYNAMIC, STATIC, overall
from deboom.compressor.measured_unbalance import MeasuredUnbalance, UnbalanceTruth
from deboom.compressor.routes import OperatingMotion
from deboom.compressor.sources import UnbalanceCurve, case_name
from deboom.compressor.unbalance import RouteResult, SweepUnbalance
from deboom.files.compressor_model import MODEL_FILE, compressor_document
from deboom.pages.component_sheet import append_verdicts
from deboom.pages.identification import alarms_in_words
from deboom.plot import CurvePanel
from deboom.report import Report, Step
from deboom.report.tables import in_words

TRUTH = "truth"
FORCES = ("in y", "in z", "along x, gas alone")
"""Forces of the thesis's figures 61c and 62c."""
ROTOR = "rotor speed [rpm]"
"""Axis above the panels."""
_SIZES = {STATIC: ("|u| [g mm]", 1e6), DYNAMIC: ("|u_d| [g mm²]", 1e9)}
"""Unbalance → label of its axis, and its unit per SI unit."""
_CAPTIONS = (
    "Static unbalance over speed (thesis, figure 61a), from the load in y and in z. A rotor makes "
    "both curves one horizontal line; a gas force that turns with it bends both alike at low "
    "speed. Shades: confidence bands. Hatched: not to be trusted, for the reason given.",
    "Dynamic unbalance about the virtual point (thesis, figure 61b), from the moments about z (y) "
    "and about y (z).",
)
_SHOWN_UNIT = {"kg m": ("g mm", 1e6), "kg m^2": ("g mm²", 1e9), "kg m²": ("g mm²", 1e9)}


def unbalance_report(
    measured: MeasuredUnbalance,
    inputs: Sequence[Path] = (),
    *,
    command: str = "",
) -> Report:
    """Report one running compressor.

    - `inputs`: files that stay; a test that was measured for the study leaves none.
    - `command`: among the conditions of the supplier's sheet, which is written where there are
      limits.
    """
    evaluation, chosen = measured.evaluation, measured.evaluation.chosen
    sources = chosen.sources
    static, dynamic = sources.static, sources.dynamic
    report = Report(
        f"Unbalance: {measured.test.name}",
        "Which unbalance rotates inside this compressor, which forces does the gas make, and at "
        "which speeds is the answer reliable?",
    )
    alarms = (*evaluation.identification.alarms, *evaluation.alarms)
    _answer(report, measured, alarms)
    report.warn(*alarms, *evaluation.notices)
    report.assume(*measured.test.hammer.assumed)
    report.number(
        "u_stat_g_mm", 1e6 * abs(static.value), "g mm", "static unbalance", headline=".2f"
    )
    report.number(
        "u_stat_deviation_g_mm",
        1e6 * static.deviation,
        "g mm",
        "standard deviation of the static unbalance",
    )
    report.number(
        "u_dyn_g_mm2", 1e9 * abs(dynamic.value), "g mm²", "dynamic unbalance", headline=".0f"
    )
    report.number(
        "u_dyn_deviation_g_mm2",
        1e9 * dynamic.deviation,
        "g mm²",
        "standard deviation of the dynamic unbalance",
    )
    report.number(
        "y_z_mismatch_percent",
        100 * evaluation.mismatch_above,
        "%",
        "static unbalance from y against that from z, rms of the lines above 50 Hz",
    )
    report.number("route", chosen.route.letter, "", "route of identification that counts")
    report.number(
        "sense", evaluation.sense.sense.name.lower(), "", "sense in which the rotor turns"
    )
    report.number(
        "mounts_changed",
        measured.mounts_changed,
        "",
        "whether the mounts of the running compressor differ from those of the hammer test",
    )
    report.number("reduced_chi", sources.reduced_chi, "1", "residuals over their noise")
    report.number(
        "remaining_chi",
        sources.remaining_chi,
        "1",
        "what rotor, gas and mounts leave over its noise; what mounts do beyond one common factor "
        "counts as noise",
        headline=".2f",
    )
    report.number("n_alarms", len(alarms), "", "alarms: reasons not to rely on the result")
    if measured.truth is not None:
        true = measured.truth
        report.number(
            "u_stat_first_error_percent",
            100 * abs(static.value / true.static - 1),
            "%",
            "error of the static unbalance, where the truth is known",
        )
        report.number(
            "u_dyn_first_error_percent",
            100 * abs(dynamic.value / true.dynamic - 1),
            "%",
            "error of the dynamic unbalance, where the truth is known",
        )
    if measured.limits is not None:
        report.number(
            "decision",
            overall(measured.verdicts).value,
            "",
            "decision over all limits",
            headline="s",
        )
    report.number("seconds", measured.seconds, "s", "time from files to result")
    report.facts["route"] = chosen.route.letter
    report.inputs += inputs
    report.document(
        MODEL_FILE,
        compressor_document(
            evaluation.identification, measured.inputs_sha256, evaluation.model.mounts
        ),
    )

    _procedure(report, measured)
    if measured.limits is not None:
        append_verdicts(report, measured, command)
    _unbalance(report, measured)
    _motions(report, measured)
    _routes(report, measured)
    if measured.with_hoses is not None:
        _hoses(report, measured, measured.with_hoses)
    return report


def _answer(report: Report, measured: MeasuredUnbalance, alarms: Sequence[str]) -> None:
    """Say both unbalances, how far they may be believed, and what comes next."""
    evaluation, chosen = measured.evaluation, measured.evaluation.chosen
    static, dynamic = chosen.sources.static, chosen.sources.dynamic
    sure = f"Do not rely on it, {alarms_in_words(alarms)}" if alarms else "Use it"
    decided, open_ = sure, " Whether that is acceptable cannot be said: no limit was given."
    if measured.limits:
        decided, open_ = overall(measured.verdicts).value.capitalize(), ""
    report.answer(
        f"{decided}: static unbalance {1e6 * abs(static.value):.2f} g mm "
        f"({1e6 * static.lower:.2f} to {1e6 * static.upper:.2f}), dynamic unbalance "
        f"{1e9 * abs(dynamic.value):.0f} g mm² ({1e9 * dynamic.lower:.0f} to "
        f"{1e9 * dynamic.upper:.0f}).{open_}",
        f"How sure: in brackets the interval of {100 * evaluation.options.confidence:g} %. Rotor, "
        f"gas and mounts leave {chosen.sources.remaining_chi:.2f} times the noise by route "
        f"{chosen.route.letter}: {alarms_in_words(alarms)}.",
        "What not to trust: lines near a resonance of the mounts, where the curves are hatched; "
        "the fit over all speeds does not depend on them.",
    )
    report.panel(
        "What to do next",
        Step("deboom unbalance TEST --limits FILE", "judge it by limits"),
        Step("deboom run compressor_front --cars CAR", "the mounts that make cars quiet"),
        wide=True,
    )


def _procedure(report: Report, measured: MeasuredUnbalance) -> None:
    """Say what was asked, and with which data."""
    evaluation = measured.evaluation
    apart = max(
        float(100 * np.sqrt(np.clip(1 - motion.consistency.overall**2, 0, None)).max())
        for motion in evaluation.motions
    )
    sweeps = "; ".join(
        f"{sweep.name}: {sweep.speed[0]:.0f}–{sweep.speed[-1]:.0f} rpm, "
        f"{sweep.frequency.size} lines"
        for sweep in measured.test.sweeps
    )
    report.section(
        "What was asked, and with which data",
        "The hammer test of the compressor at rest, without hoses, gives its apparent mass. The "
        "load inside is the apparent mass times the accelerations of first order in operation. "
        f"Sweeps: {sweeps}.\n\n{evaluation.sense.statement}\n\nAll bands and intervals are those "
        f"of {100 * evaluation.options.confidence:g} %. They include noise of sweeps and hammer "
        "test, remaining errors of placement and calibration after the hammer test, and a "
        "possible change of the mounts between hammer test and operation.\n\n"
        f"At most {apart:.2g} % of the measured acceleration is not rigid motion, at any speed. A "
        "larger share would mean a bending body, a loose sensor or a wrong position sheet.",
        folded=True,
    )


def _unbalance(report: Report, measured: MeasuredUnbalance) -> None:
    """Show unbalance and internal forces by the chosen route."""
    chosen = measured.evaluation.chosen
    truth = " The truth of the virtual compressor is for comparison only." if measured.truth else ""
    report.section(
        "Unbalance and internal forces",
        f"By route {chosen.route.letter}, {chosen.route.title}. "
        f"{measured.evaluation.agreement}{truth}",
    )
    limits = measured.limits
    bounds = (limits.static_unbalance, limits.dynamic_unbalance) if limits else (None, None)
    for stem, name, bound, caption in zip(
        ("figure_61a_static", "figure_61b_dynamic"), _SIZES, bounds, _CAPTIONS, strict=True
    ):
        limit = None if bound is None else bound.at_most
        panels = [_panel(sweep, name, measured, limit) for sweep in chosen.sweeps]
        report.figure(
            stem,
            partial(
                plot.curve_panels, panels, dashed=(TRUTH,), columns=1, order=1.0, speed_label=ROTOR
            ),
            caption,
        )
    sources = _source_table(measured)
    report.table(
        "sources",
        sources,
        "Sources: unbalance, which grows with the square of the speed and is the same at every "
        "pressure; gas forces, which depend on pressure and not on speed. One weighted fit "
        "over all lines and sweeps; the phase counts from the tacho's mark.",
        shown=in_words(sources),
    )
    report.table("unbalance", pd.concat([_curve_table(sweep) for sweep in chosen.sweeps]))
    report.table("forces", pd.concat([_force_table(sweep) for sweep in chosen.sweeps]))


def _motions(report: Report, measured: MeasuredUnbalance) -> None:
    """Show the motion at the virtual point, and the forces inside, over speed."""
    evaluation = measured.evaluation
    report.section(
        "Motion and forces over speed",
        "Measured motion at the virtual point, from calibrated sensors, and the load inside that "
        "follows from it. Unbalance grows with the square of the speed. Gas forces do not grow "
        "with speed, and dominate at low speed only.",
        folded=True,
    )
    kinds = (
        ("Translations", slice(0, 3), ("x", "y", "z"), "|a| [m/s²]"),
        ("Rotations", slice(3, 6), ("rx", "ry", "rz"), "|α| [rad/s²]"),
    )
    panels = [
        CurvePanel(
            f"{what}, {motion.sweep}",
            motion.motion.frequency,
            dict(zip(names, np.abs(motion.motion.values[:, columns]).T, strict=True)),
            y_label=label,
        )
        for motion in evaluation.motions
        for what, columns, names, label in kinds
    ]
    report.figure(
        "figure_52_motions",
        lambda: plot.curve_panels(panels, columns=2, order=1.0, speed_label=ROTOR),
        "The six motions of the virtual point over speed (thesis, figure 52): amplitudes of "
        "first order.",
    )
    report.table("motions", pd.concat([_motion_table(motion) for motion in evaluation.motions]))
    forces = _force_panels(evaluation.chosen, measured.truth)
    report.figure(
        "figure_61c_forces",
        lambda: _forces_over_speed(forces),
        "Forces inside over speed, rotor against gas (thesis, figure 61c): in y and in z what "
        "turns, along x what only the gas does. Shades: confidence bands; forces.csv has all six "
        "loads.",
    )


def _force_panels(result: RouteResult, truth: UnbalanceTruth | None) -> list[CurvePanel]:
    """Draw the three forces of each sweep, and the true ones where they are known."""
    panels = []
    for sweep in result.sweeps:
        load = None if truth is None else truth.load_of(sweep)
        curves = dict(zip(FORCES, np.abs(sweep.load[:, (1, 2, 0)]).T, strict=True))
        if load is not None:
            true = np.abs(load[:, (1, 2, 0)]).T
            curves |= {
                f"{name}, {TRUTH}": values for name, values in zip(FORCES, true, strict=True)
            }
            del curves[f"{FORCES[1]}, {TRUTH}"]  # the same as in y
        bands = zip(sweep.load_lower[:, (1, 2, 0)].T, sweep.load_upper[:, (1, 2, 0)].T, strict=True)
        panels.append(
            CurvePanel(
                f"Forces, {sweep.sweep}",
                sweep.frequency,
                curves,
                ranges=dict(zip(FORCES, bands, strict=True)),
                y_label="|F| [N]",
                masked=sweep.static.reasons,
                note=f"route {result.route.letter}",
            )
        )
    return panels


def _forces_over_speed(panels: Sequence[CurvePanel]) -> plot.Figure:
    names = dict.fromkeys(name for panel in panels for name in panel.curves)
    return plot.curve_panels(
        panels,
        dashed=[name for name in names if name.endswith(TRUTH)],
        columns=1,
        order=1.0,
        speed_label=ROTOR,
    )


def _motion_table(motion: OperatingMotion) -> pd.DataFrame:
    """Write the motion of the virtual point in one sweep, complex."""
    table: dict[str, Any] = {"sweep": motion.sweep, "frequency [Hz]": motion.motion.frequency}
    names = ["x", "y", "z", "rx", "ry", "rz"]
    for name, values in zip(names, motion.motion.values.T, strict=True):
        unit = "rad/s²" if name.startswith("r") else "m/s²"
        table |= {f"{name} real [{unit}]": values.real, f"{name} imaginary [{unit}]": values.imag}
    return pd.DataFrame(table)


def _routes(report: Report, measured: MeasuredUnbalance) -> None:
    """Compare the routes, and show the state of the mounts."""
    report.section(
        "Routes compared",
        f"{measured.mount_state}\n\nA disturbance below 50 Hz comes from mounts whose state "
        "(amplitude, temperature) differs between hammer test and operation, not from the "
        "conditioning of the inversion. If the state is the same, all routes agree there.",
        folded=True,
    )
    rows = [
        {
            "route": result.route.letter,
            "what it does": result.route.title,
            "static [g mm]": 1e6 * abs(result.sources.static.value),
            "± [g mm]": 1e6 * result.sources.static.deviation,
            "dynamic [g mm²]": 1e9 * abs(result.sources.dynamic.value),
            "± [g mm²]": 1e9 * result.sources.dynamic.deviation,
            "residuals over noise [1]": result.sources.reduced_chi,
        }
        for result in measured.evaluation.routes
    ]
    report.table(
        "routes",
        pd.DataFrame(rows),
        "Global fit by each route; ± is one standard deviation.",
        {name: 0 if "mm²" in name else 2 for name in list(rows[0])[2:]},
    )


def _hoses(report: Report, measured: MeasuredUnbalance, joined: RouteResult) -> None:
    """Show what the hoses of the vehicle push back."""
    statements = "\n\n".join(
        f"At {case_name(reaction.pressure)}: " + " ".join(band.statement for band in reaction.bands)
        for reaction in measured.reactions
    )
    report.section(
        "With the hoses of the vehicle",
        "The same evaluation of sweeps with joined hoses: the forces of the hoses appear as an "
        "apparent unbalance, most at the resonances of the hoses.\n\n" + statements,
    )
    free, with_hoses = _widest(measured.evaluation.chosen), _widest(joined)
    pressures = [pressure for pressure in free if pressure in with_hoses]
    panels = []
    for name, (label, unit) in _SIZES.items():
        for pressure in pressures:
            sweep, other = free[pressure], with_hoses[pressure]
            joined_curve = _curve(other, name)
            curves = {"hoses cut off": unit * np.abs(_curve(sweep, name).mean)}
            for part, band in (("y", joined_curve.from_y), ("z", joined_curve.from_z)):
                curves[f"hoses of the vehicle, from {part}"] = unit * np.interp(
                    sweep.frequency,
                    other.frequency,
                    np.abs(band.value),
                    left=np.nan,
                    right=np.nan,
                )
            curves |= _true_curve(measured.truth, sweep, name)
            title = f"{name.capitalize()}, {case_name(pressure)}"
            masked = _curve(sweep, name).reasons
            panels.append(CurvePanel(title, sweep.frequency, curves, y_label=label, masked=masked))
    if all(_is_masked(panel) for panel in panels):
        report.text(
            "No line of the unbalance is to be trusted where hoses are joined and cut off alike: "
            "nothing is drawn."
        )
    else:
        report.figure(
            "figure_62_hoses",
            lambda: plot.curve_panels(
                panels,
                columns=min(2, len(pressures)),
                dashed=(TRUTH,),
                order=1.0,
                speed_label=ROTOR,
            ),
            "Unbalance from y and from z as it appears with the hoses of the vehicle, against the "
            "mean with hoses cut off (thesis, figure 62). The difference is what the hoses push "
            "back.",
        )
    forces = _force_panels(joined, measured.truth)
    if all(_is_masked(panel) for panel in forces):
        report.text(
            "No line of the forces inside is to be trusted while hoses are joined (thesis, figure "
            "62c): the load is not that of rotor, gas and mounts alone, and nothing is drawn."
        )
        return
    report.figure(
        "figure_62c_forces",
        lambda: _forces_over_speed(forces),
        "Forces inside as they appear with the hoses joined (thesis, figure 62c): where the hoses "
        "resonate, they are drawn with the truth of rotor and gas.",
    )


def _is_masked(panel: CurvePanel) -> bool:
    """Say whether a panel has a reason against every line."""
    reasons = [np.asarray(lines, dtype=bool) for lines in panel.masked.values()]
    return bool(reasons) and bool(np.any(reasons, axis=0).all())


def _widest(result: RouteResult) -> dict[float, SweepUnbalance]:
    """Take the sweep with the most lines at each pressure; the first of equals."""
    widest: dict[float, SweepUnbalance] = {}
    for sweep in result.sweeps:
        other = widest.get(sweep.pressure)
        if other is None or sweep.frequency.size > other.frequency.size:
            widest[sweep.pressure] = sweep
    return widest


def _curve(sweep: SweepUnbalance, name: str) -> UnbalanceCurve:
    """Return the static or the dynamic unbalance of a sweep."""
    return sweep.static if name == STATIC else sweep.dynamic


def _true_curve(
    truth: UnbalanceTruth | None, sweep: SweepUnbalance, name: str
) -> dict[str, RealArray]:
    """Size of the true unbalance, the rotating gas force included [g mm, g mm²], if known."""
    load = None if truth is None else truth.load_of(sweep)
    if load is None:
        return {}
    across = np.abs(load[:, 1 if name == STATIC else 5])
    return {TRUTH: _SIZES[name][1] * across / (2 * np.pi * sweep.frequency) ** 2}


def _panel(
    sweep: SweepUnbalance, name: str, measured: MeasuredUnbalance, limit: float | None
) -> CurvePanel:
    """Draw an unbalance of a sweep from y and from z: a panel of the thesis's figure 61."""
    label, unit = _SIZES[name]
    curve = _curve(sweep, name)
    parts = {"from y": curve.from_y, "from z": curve.from_z}
    sizes = {part: unit * np.abs(band.value) for part, band in parts.items()}
    return CurvePanel(
        f"{name.capitalize()}, {sweep.sweep}",
        sweep.frequency,
        sizes | _true_curve(measured.truth, sweep, name),
        y_label=label,
        ranges={part: (unit * band.lower, unit * band.upper) for part, band in parts.items()},
        masked=curve.reasons,
        levels={} if limit is None else {"limit": unit * limit},
        note=f"route {measured.evaluation.chosen.route.letter}",
    )


def _source_table(measured: MeasuredUnbalance) -> pd.DataFrame:
    """Tell what rotor and gas do: the fit over all sweeps by the chosen route."""
    table = measured.evaluation.table
    units = [_SHOWN_UNIT.get(unit, (unit, 1.0)) for unit in table["unit"]]
    table["unit"] = [unit for unit, _ in units]
    numbers = ["amplitude", "from", "to", "standard deviation"]
    table[numbers] = table[numbers].mul([factor for _, factor in units], axis=0)
    if measured.truth is not None:
        true = [1e6 * abs(measured.truth.static), 1e9 * abs(measured.truth.dynamic)]
        table["truth"] = [*true, *[np.nan] * (len(table) - 2)]
    return table


def _curve_table(sweep: SweepUnbalance) -> pd.DataFrame:
    """Both unbalances of one sweep line by line, amplitudes."""
    table: dict[str, Any] = {"speed [rpm]": sweep.speed}
    for name, curve, unit, factor in (
        ("static", sweep.static, "g mm", 1e6),
        ("dynamic", sweep.dynamic, "g mm²", 1e9),
    ):
        table |= {
            f"{name} from y [{unit}]": factor * np.abs(curve.from_y.value),
            f"{name} from z [{unit}]": factor * np.abs(curve.from_z.value),
            f"{name} mean [{unit}]": factor * np.abs(curve.mean),
            f"{name} mean from [{unit}]": factor * curve.both.lower,
            f"{name} mean to [{unit}]": factor * curve.both.upper,
            f"{name} trusted": curve.trusted,
        }
    return _lines(sweep, table)


def _force_table(sweep: SweepUnbalance) -> pd.DataFrame:
    """Write the load inside, complex, and the band of its amplitudes."""
    table: dict[str, Any] = {}
    forces = [(f"F_{axis}", "N") for axis in "xyz"] + [(f"M_{axis}", "N m") for axis in "xyz"]
    for place, (name, unit) in enumerate(forces):
        table |= {
            f"{name} real [{unit}]": sweep.load[:, place].real,
            f"{name} imaginary [{unit}]": sweep.load[:, place].imag,
            f"{name} amplitude from [{unit}]": sweep.load_lower[:, place],
            f"{name} amplitude to [{unit}]": sweep.load_upper[:, place],
        }
    return _lines(sweep, table)


def _lines(sweep: SweepUnbalance, columns: dict[str, Any]) -> pd.DataFrame:
    """One row per line of a sweep."""
    return pd.DataFrame({"sweep": sweep.sweep, "frequency [Hz]": sweep.frequency} | columns)
