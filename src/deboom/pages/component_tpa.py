"""The page on blocked forces of a source, and its sound in another receiver."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from deboom import plot
from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError, listed
from deboom.measurement.component_tpa import (
    INCOMPLETE,
    ComponentTpa,
    InReceiver,
    RunTpa,
    level_difference,
)
from deboom.measurement.interface_completeness import MOST_ATTENUATED
from deboom.measurement.quality import quality_table
from deboom.measurement.uncertainty import COVERAGE
from deboom.physics.sound_level import REFERENCE_PRESSURE
from deboom.plot import CurvePanel
from deboom.plot.style import signed
from deboom.report import Report, Step, Table

SHOWN = 4
"""Points and loads that the page ranks and draws."""
UNTRUSTED = "noise of the functions hides a load"
MEASURED, PREDICTED = "measured", "of the blocked forces"


@dataclass(frozen=True, eq=False)
class Truth:
    """What the virtual bench knows of a run: forces (f, 6 n_point), sound (f, n_ear)."""

    blocked: ComplexArray
    sound: ComplexArray
    second_sound: ComplexArray


@dataclass(frozen=True, eq=False)
class Measured:
    """A test with what follows from it; truth by the name of the run, none for a real one."""

    result: ComponentTpa
    moved: tuple[InReceiver, ...]
    truth: dict[str, Truth]
    inputs: tuple[Path, ...]


def component_tpa_report(measured: Measured, seconds: float) -> Report:
    """Report one test."""
    result = measured.result
    test, first = result.test, result.runs[0]
    report = Report(
        f"Component TPA: {test.name}",
        "Which blocked forces does this source bring into any receiver, how far may they be "
        "believed, which of them make the sound, and what will it be in another receiver?",
    )
    report.explain("SPL", "noise transfer function", "blocked force", "virtual point")
    report.inputs += measured.inputs
    report.warn(*result.doubts)
    report.assume(*test.assumed)
    _answer(report, measured)
    _numbers(report, measured, seconds)
    _procedure(report, result)
    _sound(report, result)
    _forces(report, measured)
    _on_board(report, result)
    _interface(report, result)
    if measured.moved:
        _other_receiver(report, measured)
    _quality(report, result)
    for run in result.runs:
        report.table(f"blocked_forces_{_stem(run.name)}", force_table(run))
    report.facts["runs"] = ", ".join(run.name for run in result.runs)
    report.facts["first run"] = first.name
    return report


def _numbers(report: Report, measured: Measured, seconds: float) -> None:
    """Say what contributes most, and how far interface, forces and sound may be believed."""
    result, runs = measured.result, measured.result.runs
    ear, first = result.test.ears[0], runs[0]
    top = first.ranking(ear).iloc[0]
    report.number(
        "loudest", str(top["contribution"]), "", "contributes most at the first ear", headline="s"
    )
    report.number(
        "without_loudest_db",
        float(top["without it, the level changes by [dB]"]),
        "dB",
        "change of the level at the first ear without what contributes most",
        headline="+.1f",
    )
    if result.completeness is not None:
        report.number(
            "completeness",
            result.completeness.median,
            "1",
            "completeness of the interface, median over the lines; 1 is complete",
            headline=".3f",
        )
        if result.completeness.rest.resolved.any():
            report.number(
                "hits_chi_squared",
                result.completeness.rest.chi_squared,
                "1",
                "what no load at the interface explains of hits on the source, over its noise; "
                "squared, per degree of freedom",
                headline=".1f",
            )
    if judged := [run.rest.chi_squared for run in runs if run.resolved.any()]:
        report.number(
            "run_chi_squared",
            max(judged),
            "1",
            "what no load at the interface explains of a run, over its noise: the largest",
            headline=".1f",
        )
    report.number(
        "condition_number",
        float(np.median(first.inversion.condition_number)),
        "1",
        "condition of the inversion, median over the lines",
    )
    report.number(
        "trusted_lines_percent",
        100 * float(np.mean([run.trusted.mean() for run in runs])),
        "%",
        "lines on which intervals of forces hold",
    )
    levels = np.concatenate([np.abs(run.on_board_level) for run in runs])
    if levels.size:
        report.number(
            "on_board_db",
            float(levels.max()),
            "dB",
            "largest error at a sensor left out",
            headline=".1f",
        )
        report.number(
            "on_board_coherence",
            min(float(np.median(run.by_line)) for run in runs),
            "1",
            "coherence at the sensors left out: median over the lines, least of the runs",
            headline=".3f",
        )
    sound = (level_difference(run.sound.values, run.measured_sound.values, 0) for run in runs)
    report.number(
        "sound_db",
        max(float(np.abs(difference).max()) for difference in sound),
        "dB",
        "largest error at an ear, all lines",
        headline=".1f",
    )
    heard = [moved for moved in measured.moved if moved.measured is not None]
    if heard:
        report.number(
            "receiver_sound_db",
            max(float(np.abs(moved_level(transfer)).max()) for transfer in heard),
            "dB",
            "largest error at an ear of the other receiver",
            headline=".1f",
        )
    if measured.truth:
        errors, forces, sounds = zip(*(_against(measured, run) for run in runs), strict=True)
        report.number(
            "blocked_error_percent",
            max(errors),
            "%",
            "error of the blocked forces where noise hides none, against the truth",
            headline=".0f",
        )
        report.number(
            "blocked_coverage_percent",
            float(np.mean(forces)),
            "%",
            "90 % intervals of blocked forces that contain the truth",
            headline=".0f",
        )
        report.number(
            "sound_coverage_percent",
            float(np.mean(sounds)),
            "%",
            "90 % intervals of the sound that contain the truth",
        )
    report.number("n_doubts", len(result.doubts), "", "reasons not to rely on the result")
    report.number("seconds", seconds, "s", "time of the analysis")


def _answer(report: Report, measured: Measured) -> None:
    """Say whether the forces may be used, what makes the sound, and what comes next."""
    result = measured.result
    first, ear = result.runs[0], result.test.ears[0]
    ranking = first.ranking(ear)
    top = ranking.iloc[0]
    change = signed(float(top["without it, the level changes by [dB]"]), 1)
    doubts = len(result.doubts)
    trusted = 100 * float(np.mean([run.trusted.mean() for run in result.runs]))
    verdict = (
        f"Do not rely on these forces yet, for the {doubts} reason{'s' if doubts > 1 else ''} below"
        if doubts
        else "Use the blocked forces: loads at the interface explain what was measured"
    )
    left_out = [
        float(np.abs(run.on_board_level).max()) for run in result.runs if run.on_board_level.size
    ]
    checks = [f"sensors that were left out within {max(left_out):.1f} dB"] if left_out else []
    at_ears = [
        float(np.abs(level_difference(run.sound.values, run.measured_sound.values, 0)).max())
        for run in result.runs
    ]
    checks.append(f"the sound at the ears within {max(at_ears):.1f} dB, all lines together")
    moved = [
        np.abs(moved_level(each)).max() for each in measured.moved if each.measured is not None
    ]
    checks += [f"the sound in the other receiver within {max(moved):.1f} dB"] if moved else []
    loudest = str(top["contribution"])
    report.answer(
        f"{verdict}. {loudest[0].upper()}{loudest[1:]} makes most of the sound at {ear}: "
        "without it the level "
        f"of {first.name} changes by {change} dB.",
        f"How sure: the forces give {listed(tuple(checks))}.",
        "What not to trust: "
        + (
            f"forces on {100 - trusted:.0f} % of the lines, where {UNTRUSTED}; "
            if trusted < 99.5
            else ""
        )
        + "a point or a moment that was not measured, which no interval knows.",
    )
    points = ranking[ranking["what"] == "point"].drop(columns="what").head(SHOWN)
    report.panel(
        f"What reaches {ear}, {first.name}",
        Table(points, "", {"share of the energy [1]": 2}),
        "Levels are unweighted, dB re 20 µPa. They do not add up, as loads cancel; the share "
        "counts the phase, so that a louder one may have the smaller share.",
        wide=True,
    )
    report.panel(
        "What to do next",
        Step("deboom run component_tpa --test TEST --receiver FOLDER", "its sound in another car"),
        Step("deboom check TEST", "what the folder's numbers contradict"),
    )


def _against(measured: Measured, run: RunTpa) -> tuple[float, float, float]:
    """Error of the blocked forces on resolved lines, and coverages of forces and sound [%]."""
    truth, kept = measured.truth[run.name], run.resolved
    identified = run.blocked.force.values
    error = np.linalg.norm((identified - truth.blocked)[kept]) / np.linalg.norm(truth.blocked[kept])
    forces = run.force_interval().holds(np.abs(truth.blocked))[kept]
    sounds = run.sound_interval().holds(np.abs(truth.sound))
    return 100 * float(error), 100 * float(forces.mean()), 100 * float(sounds.mean())


def measured_lines(moved: InReceiver) -> ComplexArray:
    """Pressure measured on the other receiver, on the lines of the prediction (f, n_ear) [Pa]."""
    assert moved.measured is not None
    lines = np.isin(np.round(moved.measured.frequency, 6), np.round(moved.sound.frequency, 6))
    if lines.sum() != moved.sound.frequency.size:
        raise InputError(
            f"{moved.receiver}: the spectra of run {moved.run} lack lines of the prediction: "
            "record them on the same, nothing is interpolated"
        )
    return moved.measured.values[lines]


def moved_level(moved: InReceiver) -> RealArray:
    """Level of predicted over measured energy at the ears of the other receiver [dB]."""
    return level_difference(moved.sound.values, measured_lines(moved), 0)


def _procedure(report: Report, result: ComponentTpa) -> None:
    """Say what was asked, and with which data."""
    test = result.test
    points = "; ".join(f"{p.name} ({len(p.motions)} degrees of freedom)" for p in test.points)
    runs = "; ".join(
        f"{run.name}: {run.frequency.size} lines, {run.frequency[0]:g}–{run.frequency[-1]:g} Hz"
        + (f", order {run.order:g}" if run.order else "")
        for run in result.runs
    )
    report.section(
        "What was asked, and with which data",
        f"Source and receiver meet at {points}. Hits around each point, {test.n_averages} per "
        f"function, give the assembly's functions from {sum(len(p.motions) for p in test.points)} "
        f"loads to {len(test.indicator_channels)} indicator channels, "
        f"{len(test.on_board_channels)} channels that are left out, and "
        f"{', '.join(test.ears)}. Runs: {runs}.\n\n"
        "The blocked forces are the inverse of these functions times the responses in operation: "
        "those with which the source would push at a receiver that does not give way. They are the "
        "source's own, whatever it stands on. What each of them brings to an ear is force times "
        "the assembly's function.\n\n"
        f"Intervals are those of {100 * COVERAGE:.0f} %. They include noise of operation and "
        "functions, place, direction and gain of the hammer, and of the microphones; not a point "
        "or moment that is missing.",
        folded=True,
    )


def _level(pressure: ComplexArray | RealArray) -> RealArray:
    """Level of a peak amplitude, without weighting [dB]."""
    least = np.finfo(float).tiny
    return np.asarray(
        20 * np.log10(np.maximum(np.abs(pressure), least) / (np.sqrt(2) * REFERENCE_PRESSURE))
    )


def _sound(report: Report, result: ComponentTpa) -> None:
    """Show which loads make the sound, and whether they make all of it."""
    ear, first = result.test.ears[0], result.runs[0]
    report.section(
        "What reaches the ear",
        f"Contributions at {ear}, {first.name}: force times function, over all lines. Levels do "
        "not add up, as loads cancel; the last column says what the sound would lose without one.",
    )
    ranks = pd.concat(
        [
            run.ranking(each).assign(run=run.name, ear=each)
            for run in result.runs
            for each in result.test.ears
        ],
        ignore_index=True,
    )
    ranks = ranks[["contribution", *ranks.columns.drop("contribution")]]
    here = ranks[(ranks["run"] == first.name) & (ranks["ear"] == ear)]
    loads = here[here["what"] == "load"].head(SHOWN)
    shown = pd.concat([here[here["what"] == "point"], loads]).drop(columns=["run", "ear"])
    report.table(
        "contributions",
        ranks,
        f"All points, and the {len(loads)} loudest loads.",
        shown=shown,
        decimals={"share of the energy [1]": 2},
    )
    report.figure(
        "contributions",
        partial(_contribution_panels, result),
        "Level at the first ear: the sum of all loads and the loudest points, and what was "
        "measured. Where the sum differs from the measured curve, sound came by another path.",
    )
    report.figure(
        "sound",
        partial(_sound_panels, result.runs),
        f"Sound of the blocked forces against the microphones. Shade: {100 * COVERAGE:.0f} % "
        "interval.",
    )


def _contribution_panels(result: ComponentTpa) -> plot.Figure:
    ear = result.test.ears[0]
    panels = []
    for run in result.runs:
        parts, points = run.contributions(ear), [p.name for p in result.test.points]
        owners = [load.rpartition(" ")[0] for load in run.blocked.force.channels]
        curves = {
            point: _level(parts[:, [k for k, o in enumerate(owners) if o == point]].sum(axis=1))
            for point in points[:SHOWN]
        }
        curves["all loads"] = _level(parts.sum(axis=1))
        curves[MEASURED] = _level(run.measured_sound.select((ear,)).values[:, 0])
        panels.append(CurvePanel(f"{run.name}, {ear}", run.frequency, curves))
    return plot.curve_panels(
        panels, y_label="level [dB re 20 µPa]", columns=1, dashed=(MEASURED,), depth=60.0
    )


def _sound_panels(runs: Sequence[RunTpa]) -> plot.Figure:
    panels = []
    for run in runs:
        interval = run.sound_interval()
        for column, ear in enumerate(run.sound.channels):
            ends = (_level(interval.lower[:, column]), _level(interval.upper[:, column]))
            curves = {
                PREDICTED: _level(run.sound.values[:, column]),
                MEASURED: _level(run.measured_sound.values[:, column]),
            }
            title = f"{run.name}, {ear}"
            panels.append(CurvePanel(title, run.frequency, curves, ranges={PREDICTED: ends}))
    return plot.curve_panels(
        panels, y_label="level [dB re 20 µPa]", columns=2, dashed=(MEASURED,), share_y=True
    )


def _forces(report: Report, measured: Measured) -> None:
    """Show the blocked forces of the first run with their intervals."""
    result, first = measured.result, measured.result.runs[0]
    hidden = 100 * (1 - first.resolved.mean())
    report.section(
        "Blocked forces",
        ("" if first.complete else "**No line is trusted, see the warnings.** ")
        + f"Magnitudes in {first.name}; the tables blocked_forces have every run. Hatched, "
        f"{hidden:.0f} % of the lines: the noise of the functions shrinks the load that the "
        f"indicators see least by more than {100 * MOST_ATTENUATED:.0f} %, so that its interval "
        "does not hold. This happens at resonances that the source has with its points held, and "
        "where the source moves as a rigid body, because loads that only squeeze it move nothing. "
        "The sound does not depend on these loads. Better functions help: harder or more hits.",
    )
    truth = measured.truth.get(first.name)
    for kind, unit, stem in (("forces", "N", "forces"), ("moments", "N m", "moments")):
        columns = [k for k, u in enumerate(first.blocked.force.units) if u == unit]
        if columns:
            report.figure(
                f"blocked_{stem}",
                partial(_force_panels, result, columns, unit, truth),
                f"Blocked {kind}. Shade: {100 * COVERAGE:.0f} % interval."
                + (" The truth of the virtual source is for comparison only." if truth else ""),
            )


def _force_panels(
    result: ComponentTpa, columns: Sequence[int], unit: str, truth: Truth | None
) -> plot.Figure:
    run = result.runs[0]
    interval = run.force_interval()
    panels = []
    for k in columns:
        curves = {"blocked": interval.value[:, k]}
        if truth is not None:
            curves["truth"] = np.abs(truth.blocked[:, k])
        panels.append(
            CurvePanel(
                run.blocked.force.channels[k],
                run.frequency,
                curves,
                ranges={"blocked": (interval.lower[:, k], interval.upper[:, k])},
                masked={UNTRUSTED: ~run.resolved},
                logarithmic=True,
            )
        )
    dashed = ("truth",) if truth is not None else ()
    return plot.curve_panels(panels, y_label=f"magnitude [{unit}]", columns=3, dashed=dashed)


def force_table(run: RunTpa) -> pd.DataFrame:
    """Write the blocked forces of a run: real and imaginary part, and the interval."""
    force, interval = run.blocked.force, run.force_interval()
    columns: dict[str, object] = {"frequency [Hz]": force.frequency}
    for k, (name, unit) in enumerate(zip(force.channels, force.units, strict=True)):
        columns |= {
            f"{name} real [{unit}]": force.values[:, k].real,
            f"{name} imag [{unit}]": force.values[:, k].imag,
            f"{name} from [{unit}]": interval.lower[:, k],
            f"{name} to [{unit}]": interval.upper[:, k],
        }
    trusted = np.where(run.trusted, "yes", "no")
    return pd.DataFrame(columns | {"interval holds": trusted})


def _on_board(report: Report, result: ComponentTpa) -> None:
    """Show whether the blocked forces explain sensors that were left out."""
    report.section(
        "Do they explain what was left out?",
        "Sensors that took no part in the inversion: predicted from the blocked forces against "
        "measured. Agreement is necessary, but no proof: a load that the sensors hardly see may be "
        "wrong.",
    )
    frames = [
        pd.DataFrame(
            {
                "sensor": run.on_board.predicted.channels,
                "run": run.name,
                "predicted over measured [dB]": run.on_board_level,
                "coherence [1]": run.on_board_coherence,
                "relative error [1]": run.on_board.relative_error,
            }
        )
        for run in result.runs
        if run.on_board is not None
    ]
    if not frames:
        report.text("No sensor was left out: name one or more as on_board in component.toml.")
        return
    report.table(
        "on_board",
        pd.concat(frames, ignore_index=True),
        "Over all lines: level of the energies, coherence of the complex spectra, and norm of the "
        "difference over that of the measured one.",
        {"coherence [1]": 3, "relative error [1]": 3},
    )
    report.figure(
        "on_board",
        partial(_on_board_panels, result.runs),
        "Acceleration at the sensors left out, root of the sum of squares: of the blocked forces "
        "against measured; and their coherence over the sensors, line by line.",
    )


def _on_board_panels(runs: Sequence[RunTpa]) -> plot.Figure:
    panels = []
    for run in runs:
        if run.on_board is not None:
            sums = [
                np.linalg.norm(side.values, axis=1)
                for side in (run.on_board.predicted, run.on_board.measured)
            ]
            curves = dict(zip((PREDICTED, MEASURED), sums, strict=True))
            panels += [
                CurvePanel(run.name, run.frequency, curves, y_label="[m/s²]", logarithmic=True),
                CurvePanel(
                    run.name, run.frequency, {"coherence": run.by_line}, y_label="coherence [1]"
                ),
            ]
    return plot.curve_panels(panels, columns=2, dashed=(MEASURED,))


def _interface(report: Report, result: ComponentTpa) -> None:
    """Show completeness of interface and excitation, and the condition of the inversion."""
    complete, run = result.completeness, result.runs[0]
    words = (
        "Hits on the source away from its interface are known loads. If loads at the stated "
        "points reproduce the responses to these hits, the interface is complete. Completeness is "
        "the coherence of predicted and measured. The rest is what all sensors show beyond the "
        "loads, over the noise that coherences and deviations state (χ² per degree of freedom): 1 "
        f"where the interface is complete. From {complete.rest.limit:.1f} on, a point, such as a "
        "hose, or a moment is missing: the stated loads may stand for it with a completeness of "
        "nearly 1 and are not those of the source."
        if complete is not None
        else "Nobody struck the source beside its interface, so that nothing says whether it is "
        "complete."
    )
    report.section(
        "Interface and inversion",
        f"{words} The condition number, columns scaled to one norm, says how much noise the "
        "inversion may amplify. The freedom is the number of load directions in the inversion.",
    )
    panels = []
    if complete is not None:
        rows = np.searchsorted(complete.frequency, run.frequency)
        panels.append(
            CurvePanel(
                "interface",
                complete.frequency,
                {"completeness": complete.per_line},
                levels={"asked": INCOMPLETE},
                y_label="completeness [1]",
            )
        )
    rests = {run.name: run.rest.per_line}
    if complete is not None:
        rests["hits on the source"] = complete.rest.per_line[rows]
    panels += [
        CurvePanel(
            "rest",
            run.frequency,
            rests,
            levels={"limit of the mean": run.rest.limit},
            masked={UNTRUSTED: ~run.resolved},
            y_label="rest over noise, χ² [1]",
            logarithmic=True,
        ),
        CurvePanel(
            run.name,
            run.frequency,
            {"condition number": run.inversion.condition_number},
            y_label="condition number [1]",
            logarithmic=True,
        ),
        CurvePanel(
            run.name,
            run.frequency,
            {"freedom": run.inversion.freedom},
            y_label="directions that took part [1]",
        ),
    ]
    report.figure(
        "interface",
        lambda: plot.curve_panels(panels, columns=2),
        "Completeness of the interface, rest over noise, condition number and freedom of the "
        "inversion.",
    )
    lines = pd.DataFrame(
        {
            "frequency [Hz]": run.frequency,
            "condition number [1]": run.inversion.condition_number,
            "freedom [1]": run.inversion.freedom,
            "explained [1]": run.explained,
            "attenuation [1]": run.repeated.attenuation,
            "rest over noise [1]": run.rest.per_line,
        }
    )
    if complete is not None:
        lines["completeness [1]"] = complete.per_line[rows]
        lines["rest over noise, hits [1]"] = complete.rest.per_line[rows]
    report.table("lines", lines)


def _other_receiver(report: Report, measured: Measured) -> None:
    """Show the source in another receiver."""
    moved = measured.moved
    joints = (
        "The free source, the receiver alone and the joints between them are coupled by "
        "frequency-based substructuring; the blocked forces stay. Intervals are those of the "
        "forces: errors of the functions of receiver and free source are in none."
    )
    report.section(f"On another receiver: {moved[0].receiver}", joints)
    report.figure(
        "receiver_sound",
        partial(_receiver_panels, moved),
        "Sound at its ears, predicted"
        + (" against measured with the source in place." if moved[0].measured else "."),
    )
    ranks = pd.concat(
        [
            transfer.ranking(ear).assign(run=transfer.run, ear=ear)
            for transfer in moved
            for ear in transfer.sound.channels
        ],
        ignore_index=True,
    )
    ranks = ranks[["contribution", *ranks.columns.drop("contribution")]]
    here = ranks[(ranks["run"] == moved[0].run) & (ranks["ear"] == moved[0].sound.channels[0])]
    report.table(
        "receiver_contributions",
        ranks,
        f"Points, and the {SHOWN} loudest loads, at {moved[0].sound.channels[0]} in "
        f"{moved[0].run}.",
        {"share of the energy [1]": 2},
        shown=pd.concat(
            [here[here["what"] == "point"], here[here["what"] == "load"].head(SHOWN)]
        ).drop(columns=["run", "ear"]),
    )


def _receiver_panels(moved: Sequence[InReceiver]) -> plot.Figure:
    panels = []
    for transfer in moved:
        interval = transfer.sound_interval()
        for column, ear in enumerate(transfer.sound.channels):
            curves = {PREDICTED: _level(transfer.sound.values[:, column])}
            if transfer.measured is not None:
                curves[MEASURED] = _level(measured_lines(transfer)[:, column])
            ends = (_level(interval.lower[:, column]), _level(interval.upper[:, column]))
            title = f"{transfer.run}, {ear}"
            panels.append(
                CurvePanel(title, transfer.sound.frequency, curves, ranges={PREDICTED: ends})
            )
    dashed = (MEASURED,) if moved[0].measured is not None else ()
    return plot.curve_panels(
        panels, y_label="level [dB re 20 µPa]", columns=2, dashed=dashed, share_y=True
    )


def _quality(report: Report, result: ComponentTpa) -> None:
    """Show the consistency of sensors and hits around every point."""
    report.section(
        "Sensors and hits",
        "Around every point sensors and hits must agree on one rigid motion and load.",
        folded=True,
    )
    rows = [
        {"check": row.pop("check"), "point": name, **row}
        for name, checks in result.quality.items()
        for row in quality_table(checks)
    ]
    if rows:
        report.table("quality", pd.DataFrame(rows), "Checks of the virtual points.")
    unjudged = [name for name, checks in result.quality.items() if not checks]
    if unjudged:
        report.text(
            f"Too few sensors or hits to judge: {', '.join(unjudged)}. Three triaxial sensors and "
            "six hits that are not on one line would do."
        )


def _stem(name: str) -> str:
    return "".join(c if c.isalnum() else "_" for c in name)
