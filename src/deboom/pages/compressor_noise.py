"""The page on the sound of a running compressor at the driver's ear."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from deboom import plot
from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.cabin_noise import RunningInCar, SweepNoise
from deboom.compressor.noise_comparison import (
    HOSE_BAND,
    MODES,
    ORDER,
    QUIET_BAND,
    RANKED,
    CarNoise,
    DrawnCar,
    SweepErrors,
    band_words,
    in_band,
    measured_gain_table,
    peak_deviations,
    ranking,
    sweep_errors,
)
from deboom.compressor.parameters import STIFFNESS_AXES
from deboom.measurement.compressor_test import HoseState
from deboom.physics.sound_level import hearing_threshold
from deboom.plot import CurvePanel
from deboom.plot.style import signed
from deboom.report import Report, Step, Table
from deboom.report.tables import in_words

SOFT, STANDARD = HoseState.SOFT, HoseState.STANDARD
SPEED, LEVEL = "rotor speed [rpm]", "SPL [dB(A)]"
ABOVE_FLOOR = 6.0
"""Distance from the noise of the microphone within which a measured level is not trusted [dB]."""
THESIS_GAIN = (5.0, 10.0)
"""Observed on one car between 90 and 140 Hz [dB]."""


def car_report(
    running: RunningInCar,
    noise: CarNoise,
    drawn: DrawnCar | None,
    inputs: Sequence[Path] = (),
) -> Report:
    """Report one car.

    - `drawn` or None: a car whose hoses add, where those of this one were measured.
    - `inputs`: files that stay.
    """
    report = Report(
        f"Cabin noise of the compressor: {noise.car}",
        "How loud is the running compressor at the driver's ear, by which mount and which hose "
        "does the sound come, and how reliable is the synthesis?",
    )
    errors, gains = sweep_errors(noise), measured_gain_table(noise)
    levels, ways = level_table(noise), pd.concat(map(ranking, noise.sweeps), ignore_index=True)
    _answer(report, noise, levels, ways, errors)
    _loudest(report, levels, ways)
    report_errors(report, errors, gains)
    if drawn is not None:
        report.number(
            "drawn_gain_db_90_140",
            float(drawn.gain),
            "dB",
            "by hoses that add at 90–140 Hz, in a drawn car",
            headline="+.1f",
        )
    report.number(
        "common_band_db",
        max(band.common_half_width for band in noise.bands),
        "dB",
        "by how much all lines of a sweep may lie off together: half width, 90 %, the largest",
    )
    report.number(
        "line_band_db",
        max(band.line_half_width for band in noise.bands),
        "dB",
        "by how much each line may lie off besides: half width, 90 %, the largest",
    )
    report.number(
        "identical_mounts",
        "yes" if running.shares.identical else "no",
        "",
        "whether all mounts are one part",
    )
    report.number("n_alarms", len(noise.alarms), "", "alarms: reasons not to rely on the result")
    report.number("seconds", noise.seconds, "s", "time from files to result, one processor")
    report.warn(*noise.alarms, *running.source.notices)
    report.assume(*running.car.assumed)
    report.inputs += inputs
    sweeps = "; ".join(
        f"{sweep.sweep}: {60 * sweep.frequency[0]:.0f}–{60 * sweep.frequency[-1]:.0f} rpm"
        for sweep in noise.sweeps
    )
    report.section(
        "What was asked, and with which data",
        "A hammer test on a rig shows mass and mounts of the compressor. In the car, the motion "
        "of the compressor and of the body at each mount was recorded during run-ups. The force "
        "of a mount is its stiffness times the relative displacement of its two sides. The sound "
        "is the sum, with phases, of force times noise transfer function of the body. Sweeps: "
        f"{sweeps}.\n\n"
        f"{running.shares.statement}\n\n{running.source.state.statement} To see this, the motion "
        "of the body was taken off the sweeps.",
        folded=True,
    )
    report.table("levels", levels)
    _soft_hoses(report, noise, errors)
    if running.car.operation.with_hoses(STANDARD):
        _standard_hoses(report, running, noise)
        caption = (
            "Level of the A-weighted energy with standard hoses minus that with soft ones; the "
            f"thesis observed {THESIS_GAIN[0]:g} to {THESIS_GAIN[1]:g} dB on its car."
        )
        report.table("measured_gain", gains, caption if len(gains) else "")
    if drawn is not None:
        _hoses_that_add(report, drawn)
    _paths(report, noise, ways)
    _mounts(report, running)
    return report


def _answer(
    report: Report,
    noise: CarNoise,
    levels: pd.DataFrame,
    ways: pd.DataFrame,
    errors: Sequence[SweepErrors],
) -> None:
    """Say whether the compressor is heard, which way the sound comes, and what comes next."""
    loudest = levels.nlargest(1, "synthesised [dB(A)]").iloc[0]
    level, line = float(loudest["synthesised [dB(A)]"]), float(loudest["frequency [Hz]"])
    near = _near_loudest(loudest, ways)
    way = ""
    if len(near):
        way = (
            f" Without {near.iloc[0]['point']} the level of {near.iloc[0]['band']} changes by "
            f"{signed(float(near.iloc[0][CUT]), 1)} dB; no other way brings more."
        )
    off = np.abs(peak_deviations(errors, SOFT, without=MODES))
    sure = f"with soft hoses peaks outside 25–35 Hz lie off by {off.max():.1f} dB at most; " * bool(
        off.size
    )
    band = max(each.common_half_width for each in noise.bands)
    report.answer(
        f"The loudest line has {level:.0f} dB(A), at {line:.0f} Hz "
        f"({loudest['speed [rpm]']:.0f} rpm, {loudest['sweep']}), "
        f"{against_hearing(level, line)}.{way}",
        f"How sure: {loudest['measured [dB(A)]']:.1f} dB(A) were measured at that line, "
        f"{level:.1f} are synthesised; {sure}all lines of a sweep may lie off together by "
        f"± {band:.1f} dB (90 %).",
        "What not to trust: levels at 90–140 Hz with standard hoses where the hoses were not "
        "measured, and lines near the noise of the microphone, which are hatched.",
    )
    loud = levels.loc[levels.groupby("sweep", sort=False)["synthesised [dB(A)]"].idxmax()]
    table = loud[
        ["sweep", "speed [rpm]", "frequency [Hz]", "synthesised [dB(A)]", "measured [dB(A)]"]
    ]
    decimals = {"speed [rpm]": 0, "frequency [Hz]": 1}
    report.panel("The loudest line of each sweep", Table(table, "", decimals), wide=True)
    report.panel(
        "What to do next",
        Step("deboom run compressor_front --cars CAR", "the mounts that make cars quiet"),
        Step("deboom unbalance TEST", "how much of it is the rotor"),
    )


def against_hearing(level: float, line: float) -> str:
    """Say whether a level [dB(A)] at a line [Hz] can be heard where nothing else sounds."""
    threshold = float(hearing_threshold(np.array([line]))[0])
    if level > threshold:
        return (
            f"{level - threshold:.0f} dB above the threshold of hearing there (ISO 226): it can be "
            "heard in a silent car"
        )
    return (
        f"{threshold - level:.0f} dB below the threshold of hearing there (ISO 226): nobody hears "
        "it"
    )


CUT = "cut, the level changes by [dB]"


def _near_loudest(loudest: pd.Series, ways: pd.DataFrame) -> pd.DataFrame:
    """Return the ways of the sound about the loudest line, that which matters most first."""
    bands = [band_words(band) for band in RANKED if in_band(loudest["frequency [Hz]"], band)]
    near: pd.DataFrame = ways[(ways["sweep"] == loudest["sweep"]) & ways["band"].isin(bands)]
    return near.nsmallest(1, CUT)


def _loudest(report: Report, levels: pd.DataFrame, ways: pd.DataFrame) -> None:
    """Say how loud the loudest line is, and what brings most of it."""
    loudest = levels.nlargest(1, "synthesised [dB(A)]").iloc[0]
    sweep, rpm = loudest["sweep"], f"{loudest['speed [rpm]']:.0f}"
    report.number(
        "loudest_line_db",
        float(loudest["synthesised [dB(A)]"]),
        "dB(A)",
        f"the loudest line at the driver's ear, {rpm} rpm, {sweep}",
        headline=".0f",
    )
    for _, way in _near_loudest(loudest, ways).iterrows():
        band = way["band"]
        report.number(
            "loudest_way",
            str(way["point"]),
            "",
            f"contributes most in {band} of the loudest sweep",
            headline="s",
        )
        report.number(
            "without_loudest_way_db",
            float(way[CUT]),
            "dB",
            "change of the level in that band without what contributes most",
            headline="+.1f",
        )


def report_errors(report: Report, errors: Sequence[SweepErrors], gain: pd.DataFrame) -> None:
    """Say by how much synthesised levels lie off the measured ones; without a peak nothing."""
    complete = all(error.complete for error in errors)  # else nobody modelled the hoses
    off = np.abs(peak_deviations(errors, SOFT, without=MODES))
    if off.size:
        report.number(
            "spl_peak_deviation_db",
            float(off.max()),
            "dB",
            "largest deviation at a peak, soft hoses, outside 25–35 Hz",
            headline=".1f",
        )
        report.number(
            "spl_peak_deviation_db_median",
            float(np.median(off)),
            "dB",
            "median deviation at a peak, soft hoses, outside 25–35 Hz",
        )
    off = np.abs(peak_deviations(errors, SOFT, only=MODES))
    if off.size:
        report.number(
            "spl_peak_deviation_db_25_35",
            float(off.max()),
            "dB",
            "largest deviation at a peak, soft hoses, at 25–35 Hz",
        )
        report.number(
            "spl_peak_deviation_db_25_35_median",
            float(np.median(off)),
            "dB",
            "median deviation at a peak, soft hoses, at 25–35 Hz",
        )
    off = np.abs(peak_deviations(errors, STANDARD, only=HOSE_BAND))
    if off.size and complete:
        report.number(
            "spl_peak_deviation_db_with_hoses",
            float(off.max()),
            "dB",
            "largest deviation at a peak, standard hoses modelled, at 90–140 Hz",
        )
        report.number(
            "spl_peak_deviation_db_with_hoses_median",
            float(np.median(off)),
            "dB",
            "median deviation at a peak, standard hoses modelled, at 90–140 Hz",
        )
    off = np.abs(peak_deviations(errors, STANDARD, only=HOSE_BAND, by_mounts=True))
    if off.size:
        report.number(
            "spl_peak_deviation_db_by_mounts",
            float(off.max()),
            "dB",
            "largest deviation at a peak, standard hoses left out, at 90–140 Hz",
        )
        report.number(
            "spl_peak_deviation_db_by_mounts_median",
            float(np.median(off)),
            "dB",
            "median deviation at a peak, standard hoses left out, at 90–140 Hz",
        )
    report.number(
        "n_peaks_without_partner",
        sum(len(comparison.peaks.only_reference) for comparison in errors),
        "",
        "measured peaks without a synthesised one",
    )
    high = [error for error in errors if error.hoses is STANDARD]
    at = [in_band(error.frequency, HOSE_BAND) for error in high]
    of_lines = [np.abs(error.lines[rows]) for error, rows in zip(high, at, strict=True)]
    by_mounts = [np.abs(error.lines_by_mounts[rows]) for error, rows in zip(high, at, strict=True)]
    if any(rows.any() for rows in at) and complete:
        report.number(
            "spl_90_140_p90_db_with_hoses",
            float(np.percentile(np.concatenate(of_lines), 90)),
            "dB",
            "90 of 100 lines at 90–140 Hz lie off by less, hoses modelled",
            headline=".1f",
        )
    if any(rows.any() for rows in at):
        report.number(
            "spl_90_140_p90_db_by_mounts",
            float(np.percentile(np.concatenate(by_mounts), 90)),
            "dB",
            "90 of 100 lines at 90–140 Hz lie off by less, hoses left out",
            headline=".1f",
        )
    below = [np.abs(e.lines_by_mounts[in_band(e.frequency, QUIET_BAND)]) for e in high]
    if any(lines.size for lines in below):
        report.number(
            "spl_20_80_p90_db_by_mounts",
            float(np.percentile(np.concatenate(below), 90)),
            "dB",
            "90 of 100 lines at 20–80 Hz lie off by less, hoses left out",
        )
    if len(gain):
        error = (gain["synthesised gain [dB]"] - gain["measured gain [dB]"]).abs()
        report.number(
            "measured_gain_db_90_140",
            float(gain["measured gain [dB]"].median()),
            "dB",
            "by standard hoses at 90–140 Hz, measured against soft ones, median; the thesis heard "
            "5 to 10 dB",
            headline="+.1f",
        )
        report.number(
            "measured_gain_error_db_90_140",
            float(error.max()),
            "dB",
            "largest error of the synthesis of the hoses' gain",
        )
    inside = [error.inside for error in errors if error.complete]
    if inside:
        report.number(
            "lines_in_band_percent",
            100 * float(np.mean(inside)),
            "%",
            "louder lines inside the 90 % band",
        )


def level_table(noise: CarNoise) -> pd.DataFrame:
    """Write levels line by line: measured, synthesised with its band, and variants."""
    frames = []
    for sweep, band in zip(noise.sweeps, noise.bands, strict=True):
        ends = {"synthesised from [dB(A)]": band.lower, "synthesised to [dB(A)]": band.upper}
        frames.append(sweep.table.assign(**ends, sweep=sweep.sweep))
    whole = pd.concat(frames, ignore_index=True)
    return whole[["sweep", *whole.columns.drop("sweep")]]


def _soft_hoses(report: Report, noise: CarNoise, errors: Sequence[SweepErrors]) -> None:
    """Show sweeps whose paths of the hoses are cut."""
    report.section(
        "Without hoses",
        "Levels are compared at peaks with a prominence of at least 6 dB, paired within 1.5 Hz: in "
        "a notch the difference of two lines says nothing about noise. The thesis leaves out 25–35 "
        "Hz, the band of the rigid-body modes of the compressor; the last column marks these "
        "peaks.",
    )
    panels = [
        _level_panel(noise, sweep, {"synthesised": (sweep.total, band.lower, band.upper)})
        for sweep, band in zip(noise.sweeps, noise.bands, strict=True)
        if sweep.hoses is SOFT
    ]
    if panels:
        report.figure(
            "figure_65_soft_hoses",
            lambda: _over_speed(panels, "measured"),
            "Level at the driver's ear with long soft hoses, which cut the paths of the hoses "
            "(thesis, figure 65): synthesised against measured. Shade: where 90 % of what the "
            f"measurements allow lies. {_band_words(noise, SOFT)}"
            + (_FLOOR_WORDS if noise.floor is not None else ""),
        )
    table = peak_table(errors)
    mine = table[table["hoses"] == SOFT.value].drop(columns=["paths", "hoses"])
    report.table("peaks", table, "Peaks with soft hoses." if len(mine) else "", shown=mine)


def _band_words(noise: CarNoise, hoses: HoseState) -> str:
    """Say which part of the bands all lines share."""
    bands = [
        band for sweep, band in zip(noise.sweeps, noise.bands, strict=True) if sweep.hoses is hoses
    ]
    common, besides = (
        max(getattr(band, name) for band in bands)
        for name in ("common_half_width", "line_half_width")
    )
    return (
        f"All lines of a sweep may lie ± {common:.1f} dB together, and each ± {besides:.1f} dB "
        "besides (median line)."
    )


_FLOOR_WORDS = (
    " Hatched: the measured level is within 6 dB of the noise of cabin and microphone, 0.1 mPa per "
    "root of a hertz over the ten seconds of a line."
)


def _level_panel(
    noise: CarNoise, sweep: SweepNoise, curves: dict[str, tuple[ComplexArray, RealArray, RealArray]]
) -> CurvePanel:
    """Draw levels of one sweep with their bands over the measured one, which has a floor."""
    measured = sweep.level(sweep.measured)
    masked = {}
    if noise.floor is not None:
        floor = sweep.level(np.full(sweep.frequency.size, noise.floor))
        masked["near the noise of the microphone"] = measured < floor + ABOVE_FLOOR
    return CurvePanel(
        f"{noise.car}, {sweep.sweep}",
        sweep.frequency,
        {name: sweep.level(of[0]) for name, of in curves.items()} | {"measured": measured},
        ranges={name: of[1:] for name, of in curves.items()},
        masked=masked,
    )


def _over_speed(panels: Sequence[CurvePanel], dashed: str) -> plot.Figure:
    """Draw levels over the speed of the rotor."""
    return plot.curve_panels(
        panels, y_label=LEVEL, columns=1, dashed=(dashed,), order=ORDER, speed_label=SPEED
    )


def _standard_hoses(report: Report, running: RunningInCar, noise: CarNoise) -> None:
    """Show sweeps with the hoses of the car."""
    hoses = running.hoses
    report.section("With the hoses of the car")
    if hoses is None:
        report.text("The paths of the hoses were left out on request.")
    else:
        fit = "; ".join(f"{name}: {chi:.2f}" for name, chi in hoses.reduced_chi)
        report.text(
            "The hoses were identified as beams from the sweeps with standard and with soft hoses; "
            f"residuals over noise: {fit}. Their loads on the body at six degrees of freedom per "
            "end are further paths.\n\n" + "\n\n".join(hoses.statements)
        )
    panels = []
    for sweep, band in zip(noise.sweeps, noise.bands, strict=True):
        if sweep.hoses is STANDARD:
            mounts = (sweep.by_mounts, band.lower_mounts, band.upper_mounts)
            curves = {"synthesised, mounts alone": mounts}
            if sweep.contributions.shape[1] > sweep.n_mount_paths:
                whole = (sweep.total, band.lower, band.upper)
                curves["synthesised, mounts and hoses"] = whole
            panels.append(_level_panel(noise, sweep, curves))
    report.figure(
        "figure_66_standard_hoses",
        lambda: _over_speed(panels, "measured"),
        "Level with the hoses of the car (thesis, figure 66). Where hoses carry sound, mounts "
        "alone do not explain the measurement; mounts and identified hoses together do."
        + ("" if hoses is None else f" {_band_words(noise, STANDARD)}"),
    )
    if hoses is not None:
        words = {"identified": "found", "standard deviation": "deviation"}
        table = hoses.table.rename(columns=words)
        caption = "Hoses, as drawn and as found; deviation: 1 σ."
        report.table("hoses", table, caption, shown=in_words(table))


def _hoses_that_add(report: Report, drawn: DrawnCar) -> None:
    """Show a drawn car whose hoses add, as those of the thesis did."""
    report.section(
        "A car whose hoses add",
        "Hoses can add sound or cancel it, depending on the phases of the body at their ends: in "
        "all five cars of the frozen fleet they change little or cancel part of the mounts' "
        f"sound. In car {drawn.car} of drawn fleet {drawn.fleet} the same compressor with the same "
        f"hoses is {signed(drawn.gain, 1)} dB louder at {band_words(HOSE_BAND)}, as in the "
        "thesis. Levels are those of the bench's coupled car, without noise.",
        folded=True,
    )
    soft, joined = "hoses cut off", "hoses of the car"
    below = drawn.changes_in_quiet_band
    panel = CurvePanel(
        f"{drawn.car} of drawn fleet {drawn.fleet}",
        drawn.frequency,
        {soft: drawn.without_hoses, joined: drawn.with_hoses},
    )
    report.figure(
        "figure_66_drawn_car",
        lambda: plot.curve_panels(
            [panel],
            y_label=LEVEL,
            columns=1,
            dashed=(soft,),
            order=ORDER,
            speed_label=SPEED,
        ),
        "Level at the driver's ear with hoses and with their paths cut (thesis, figure 66, where "
        f"hoses add 5 to 10 dB at {band_words(HOSE_BAND)} and nothing below 80 Hz). Here they "
        f"change the lines at {band_words(QUIET_BAND)} by {np.median(below):.1f} dB in the median, "
        f"{below.max():.1f} dB at most: they hold the compressor besides its mounts.",
    )
    columns = {
        "frequency [Hz]": drawn.frequency,
        "speed [rpm]": 60 * drawn.frequency,
        f"{joined} [dB(A)]": drawn.with_hoses,
        f"{soft} [dB(A)]": drawn.without_hoses,
    }
    report.table("drawn_car", pd.DataFrame(columns))


def _paths(report: Report, noise: CarNoise, ways: pd.DataFrame) -> None:
    """Show by which mount and hose the sound gets to the ear."""
    report.section(
        "By which way",
        "Shares add up to 100 %. The share of a path is the part of its sound in phase with the "
        "sum, in the A-weighted energy. A path with a negative share reduces the sound of the "
        "others.",
    )
    total = "all paths"
    panels = [
        CurvePanel(
            f"{noise.car}, {sweep.sweep}",
            sweep.frequency,
            dict(zip(sweep.points, sweep.level(sweep.by_point).T, strict=True))
            | {total: sweep.level(sweep.total)},
        )
        for sweep in _lowest_pressure(noise)
    ]
    report.figure(
        "contributions",
        lambda: _over_speed(panels, total),
        "Level of each mount and hose on its own, forces and moments summed with their phases. "
        "If a single path is louder than the sum, other paths cancel it.",
    )
    report.table(
        "ranking",
        ways,
        "Mounts and hoses ranked, per sweep and band.",
    )
    for field in ("contributions", "loads"):
        report.table(field, path_table(noise, field))


def path_table(noise: CarNoise, field: str) -> pd.DataFrame:
    """Write loads or contributions of all paths, complex, line by line; units by path."""
    frames = []
    for sweep in noise.sweeps:
        for number, path in enumerate(sweep.paths):
            moment = path.rpartition(" ")[2].startswith("m")
            values = getattr(sweep, field)[:, number]
            columns = {
                "sweep": sweep.sweep,
                "path": path,
                "unit": "Pa" if field == "contributions" else "N m" if moment else "N",
                "frequency [Hz]": sweep.frequency,
                "real": values.real,
                "imaginary": values.imag,
            }
            frames.append(pd.DataFrame(columns))
    return pd.concat(frames, ignore_index=True)


def _lowest_pressure(noise: CarNoise) -> list[SweepNoise]:
    """Return the sweeps at the lowest pressure."""
    lowest = min(sweep.pressure for sweep in noise.sweeps)
    return [sweep for sweep in noise.sweeps if sweep.pressure == lowest]


def _mounts(report: Report, running: RunningInCar) -> None:
    """Show single mounts, as far as they are known."""
    reference = getattr(
        running.identification.calibrated.parametrisation, "reference_frequency", 20.0
    )
    report.section(
        "Single mounts",
        "Positions come from the sheet of the car, directions and stiffnesses from the drawing, "
        "and the sum of the stiffnesses from the hammer test. If a deviation hardly falls from "
        "before to after, the value is that of the drawing. The identified stiffness is dynamic, "
        f"real part at {reference:g} Hz; the stiffness of the drawing is static.",
        folded=True,
    )
    mounts = mount_table(running)
    report.table("mounts", mounts, "Mounts; deviations are 1 σ.", shown=in_words(mounts))
    stiffness = stiffness_table(running)
    report.figure(
        "figure_63_stiffness",
        lambda: _stiffness_figure(stiffness),
        "Dynamic stiffness of the single mounts over frequency, real and imaginary part (thesis, "
        "figure 63): the stiffness found times the gain of the hammer test and, where the mounts "
        "have changed, the change in operation.",
    )
    report.table("mount_stiffness", stiffness)


def mount_table(running: RunningInCar) -> pd.DataFrame:
    """Show single mounts as found, and how well they are known."""
    shares = running.shares
    before = shares.prior_deviations[:-1].reshape(len(shares.drawn), 9)
    before = np.hstack([before[:, :6], np.hypot(before[:, 6:], shares.prior_deviations[-1])])
    names = [f"position {axis}" for axis in "xyz"] + [f"angle {axis}" for axis in "xyz"]
    names += [f"stiffness {axis}" for axis in ("axial", "radial 1", "radial 2")]
    frames = []
    for mount, drawn, after, prior in zip(
        shares.mounts, shares.drawn, shares.deviations, before, strict=True
    ):
        scale = np.repeat([1e3, 180 / np.pi, 1e-3], 3)
        # deviations of a stiffness are relative
        relative = np.concatenate([np.ones(6), mount.stiffness])
        identified, wanted = (
            scale * np.concatenate([of.position, of.rotation, of.stiffness])
            for of in (mount, drawn)
        )
        columns = {
            "mount": mount.name,
            "number": names,
            "unit": np.repeat(["mm", "°", "N/mm"], 3),
            "drawn": wanted,
            "found": identified,
            "deviation": scale * relative * after,
            "deviation before": scale * relative * prior,
        }
        frames.append(pd.DataFrame(columns))
    return pd.concat(frames, ignore_index=True)


def stiffness_table(running: RunningInCar) -> pd.DataFrame:
    """Write the dynamic stiffness of single mounts along their axes, line by line."""
    lines = running.identification.inertance.frequency
    factor = running.identification.calibrated.model.gain.at(lines)
    factor = factor * (1 + running.source.state.significant(lines))
    frames = []
    for mount in running.shares.mounts:
        for axis, stiffness in zip(STIFFNESS_AXES, mount.stiffness, strict=True):
            columns = {
                "mount": mount.name,
                "direction": axis,
                "frequency [Hz]": lines,
                "real [N/mm]": 1e-3 * stiffness * factor.real,
                "imaginary [N/mm]": 1e-3 * stiffness * factor.imag,
            }
            frames.append(pd.DataFrame(columns))
    return pd.concat(frames, ignore_index=True)


def _stiffness_figure(table: pd.DataFrame) -> plot.Figure:
    """Draw real and imaginary part of each mount in a panel each."""
    panels = []
    for mount, rows in table.groupby("mount", sort=False):
        for part, name in (("Re K", "real [N/mm]"), ("Im K", "imaginary [N/mm]")):
            curves = {
                str(axis): group[name].to_numpy()
                for axis, group in rows.groupby("direction", sort=False)
            }
            lines = rows["frequency [Hz]"].unique()
            panels.append(CurvePanel(f"{part}, {mount}", lines, curves, y_label=f"{part} [N/mm]"))
    return plot.curve_panels(panels, columns=2, dashed=STIFFNESS_AXES[2:], log_frequency=True)


def peak_table(errors: Sequence[SweepErrors]) -> pd.DataFrame:
    """List measured peaks with their synthesised partners, by all paths and by mounts alone."""
    rows = []
    for error in errors:
        standard = error.hoses is STANDARD
        of = {"mounts and hoses" if standard else "mounts alone": error.peaks}
        if standard:
            of["mounts alone"] = error.peaks_by_mounts
        for paths, matched in of.items():
            pairs = [(peak, other.frequency, other.level) for peak, other in matched.pairs]
            pairs += [(peak, np.nan, np.nan) for peak in matched.only_reference]
            for peak, frequency, level in sorted(pairs, key=lambda pair: pair[0].frequency):
                rows.append(
                    {
                        "hoses": error.hoses.value,
                        "sweep": error.sweep,
                        "paths": paths,
                        "peak [Hz]": peak.frequency,
                        "measured [dB(A)]": peak.level,
                        "synthesised peak [Hz]": frequency,
                        "synthesised [dB(A)]": level,
                        "deviation [dB]": level - peak.level,
                        f"in {band_words(MODES)}": MODES[0] <= peak.frequency <= MODES[1],
                    }
                )
    return pd.DataFrame(rows, columns=None if rows else ["hoses", "sweep", "paths"])
