"""A first look at files, of any format that deboom reads, side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from deboom.arrays import RealArray, RealOrComplexArray
from deboom.errors import InputError, listed
from deboom.files.curves import Curve, CurveKind, read_curves
from deboom.files.function_table import with_their_tables
from deboom.measurement.channels import TimeRecord
from deboom.measurement.order_tracking import shaft_of
from deboom.measurement.quality import HALFWAY, likeness
from deboom.measurement.sound_quality import sound_quality
from deboom.measurement.tacho import ShaftAngle
from deboom.names import look_alikes
from deboom.pages.look_pictures import (
    RECIPROCITY_CAPTION,
    matrix_section,
    panels_section,
    show_signals,
    stems,
)
from deboom.plot import CurvePanel
from deboom.report import Report, Step

_QUANTITIES = {"m/s^2": "acceleration", "N": "force", "Pa": "sound pressure", "m/s": "velocity"}


def look_files_report(paths: Sequence[Path], tacho: str, pulses_per_revolution: int) -> Report:
    """Draw what files hold, with the functions of one name in one panel.

    - `paths`: of files; each has another name.
    - `tacho`: channel that makes orders of the signals beside it; ``""`` for none.
    - `pulses_per_revolution`: pitches of its wheel, missing teeth included.
    - raises InputError: a file that cannot be read, two of one name, a tacho that no file has.
    """
    names = [path.name for path in paths]
    if doubled := {name for name in names if names.count(name) > 1}:
        raise InputError(f"two files have the name {sorted(doubled)[0]!r}: rename one of them")
    for sentence in look_alikes("file", names):
        raise InputError(sentence)
    files = {path.name: read_curves(path) for path in paths}
    report = Report(
        f"First look: {listed(tuple(names[:3]))}" + (" and others" if len(names) > 3 else ""),
        "What is in these files, and does it look right?",
    )
    counts = {kind: sum(c.kind is kind for f in files.values() for c in f) for kind in CurveKind}
    report.number("n_files", len(files), "", "files", headline="d")
    report.number("n_functions", counts[CurveKind.function], "", "functions over frequency")
    report.number("n_signals", counts[CurveKind.signal], "", "signals over time")
    _contents(report, files)
    _functions(report, files)
    _coherences(report, files)
    _reciprocity(report, files)
    if tacho and not any(c.name == tacho for f in files.values() for c in f):
        raise InputError(f"no file has a channel '{tacho}': name the tacho as a file does")
    for name, stem in stems(names).items():
        _signals(report, stem, files[name], tacho, pulses_per_revolution)
    _loudness(report, files)
    remarks = report.remarks
    holds = listed(
        tuple(
            f"{n} {one if n == 1 else many}"
            for n, one, many in (
                (counts[CurveKind.function], "function", "functions"),
                (counts[CurveKind.coherence], "coherence", "coherences"),
                (counts[CurveKind.signal], "signal over time", "signals over time"),
            )
            if n
        )
    )
    first = f"The file{'s' if len(files) > 1 else ''} can be read: {holds}"
    report.answer(
        f"{first}; {remarks[0]}." if remarks else f"{first}.",
        *(f"{remark[0].upper()}{remark[1:]}." for remark in remarks[1:]),
        "What not to trust: nothing was identified or corrected. A folder of `deboom new` says "
        "where sensors stand, and `deboom check` then says what contradicts.",
    )
    report.panel(
        "What to do next",
        Step("deboom new KIND FOLDER", "a folder in which such files become a measurement"),
        wide=True,
    )
    report.inputs = list(with_their_tables(paths))
    return report


def _contents(report: Report, files: Mapping[str, Sequence[Curve]]) -> None:
    rows = []
    for name, curves in files.items():
        for kind in CurveKind:
            of_kind = [curve for curve in curves if curve.kind is kind]
            if of_kind:
                units = listed(tuple(dict.fromkeys(c.unit or "no unit" for c in of_kind)))
                low = min(float(c.abscissa[0]) for c in of_kind)
                high = max(float(c.abscissa[-1]) for c in of_kind)
                axis = "s" if kind is CurveKind.signal else "Hz"
                span = f"{low:.4g} to {high:.4g} {axis}"
                rows.append((name, kind.value, len(of_kind), units, span))
    columns = ["file", "what", "number", "unit", "over"]
    report.section("What they hold")
    report.table("contents", pd.DataFrame(rows, columns=columns), "In the order of the files.")


def _functions(report: Report, files: Mapping[str, Sequence[Curve]]) -> None:
    """Show functions of one name in one panel, a curve per file."""
    by_name: dict[str, dict[str, Curve]] = {}
    for file, curves in files.items():
        for curve in curves:
            if curve.kind is CurveKind.function and np.any(curve.values):
                by_name.setdefault(f"{curve.name} [{curve.unit or '?'}]", {})[file] = curve
    panels = []
    for name, of_file in by_name.items():
        for lines in _groups_of_lines(of_file):
            size = {file: np.abs(of_file[file].values) for file in lines}
            kept = np.all([each > 0 for each in size.values()], axis=0)  # 0 has no logarithm
            if np.count_nonzero(kept) > 1:
                abscissa = of_file[lines[0]].abscissa[kept]
                shown = {file: each[kept] for file, each in size.items()}
                panels.append(CurvePanel(name, abscissa, shown, logarithmic=True))
    if panels:
        panels_section(
            report,
            "Functions",
            "functions",
            panels,
            "Magnitudes of functions, by name and unit, a curve for each file.",
            y_label="magnitude",
        )
    _differences(report, by_name)


def _groups_of_lines(of_file: Mapping[str, Curve]) -> list[list[str]]:
    """Return the files whose function has the same lines, together."""
    groups: dict[bytes, list[str]] = {}
    for file, curve in of_file.items():
        groups.setdefault(np.asarray(curve.abscissa).tobytes(), []).append(file)
    return list(groups.values())


def _differences(report: Report, by_name: Mapping[str, Mapping[str, Curve]]) -> None:
    """Tell how far functions of one name lie apart in two files, and name the farthest."""
    rows = []
    for name, of_file in by_name.items():
        first, *others = of_file
        for other in others:
            a, b = of_file[first], of_file[other]
            if np.array_equal(a.abscissa, b.abscissa):
                both = (np.abs(a.values) > 0) & (np.abs(b.values) > 0)
                if both.any():
                    level = 20 * np.log10(np.abs(b.values[both]) / np.abs(a.values[both]))
                    rows.append((name, first, other, np.median(level), np.median(np.abs(level))))
    if rows:
        columns = [
            "function",
            "file",
            "against",
            "median of the level difference [dB]",
            "median of its magnitude [dB]",
        ]
        table = pd.DataFrame(rows, columns=columns)
        worst = table.iloc[int(table[columns[-1]].argmax())]
        report.remarks.append(
            f"functions of one name differ most in {worst['function']}, by "
            f"{worst[columns[-1]]:.1f} dB over half of the lines "
            f"({worst['file']} and {worst['against']})"
        )
        report.table("differences", table, "The first file with each of the others.")


def _coherences(report: Report, files: Mapping[str, Sequence[Curve]]) -> None:
    """Show the median coherence of every response to every reference."""
    for file, curves in files.items():
        median = {
            (curve.response, curve.reference): float(np.median(curve.values.real))
            for curve in curves
            if curve.kind is CurveKind.coherence
        }
        if not median:
            continue
        low = {pair: value for pair, value in median.items() if value < 0.9}
        if low:
            pair = min(low, key=low.__getitem__)
            report.remarks.append(
                f"{len(low)} of {len(median)} coherences of {file} stay below 0.9 over half of the "
                f"lines, least {pair[0]} from {pair[1]} ({low[pair]:.2f})"
            )
        matrix_section(
            report,
            f"Coherence: {file}",
            f"coherence_{stems([file])[file]}",
            median,
            "Median over the lines, by response (rows) and reference (columns); 0 where there is "
            "none.",
        )


def _reciprocity(report: Report, files: Mapping[str, Sequence[Curve]]) -> None:
    """Show how far functions with response and reference exchanged lie apart."""
    for file, curves in files.items():
        by_pair = {
            (_unsigned(c.response), _unsigned(c.reference), c.unit): c
            for c in curves
            if c.kind is CurveKind.function and c.reference
        }
        alike = {}
        for (response, reference, unit), curve in by_pair.items():
            other = by_pair.get((reference, response, unit))
            if response < reference and other and np.array_equal(curve.abscissa, other.abscissa):
                alike[response, reference] = float(
                    likeness(_towards_plus(curve), _towards_plus(other), axis=0)
                )
        if not alike:
            continue
        (a, b), least = min(alike.items(), key=lambda item: item[1])
        low = sum(value < HALFWAY for value in alike.values())
        report.remarks.append(
            f"{low} of {len(alike)} reciprocal pairs of {file} are below {HALFWAY:g}, least "
            f"{a} and {b} ({least:.2f})"
        )
        matrix_section(
            report,
            f"Reciprocity: {file}",
            f"reciprocity_{stems([file])[file]}",
            alike,
            RECIPROCITY_CAPTION,
        )


def _unsigned(dof: str) -> str:
    return dof.replace(" +", " ").replace(" -", " ")


def _towards_plus(curve: Curve) -> RealOrComplexArray:
    """Return the values with both axes turned towards plus."""
    minus = (" -" in curve.response) != (" -" in curve.reference)
    return -curve.values if minus else curve.values


def _signals(
    report: Report, name: str, curves: Sequence[Curve], tacho: str, pulses_per_revolution: int
) -> None:
    """Show the signals of one file, by quantity."""
    signals = [curve for curve in curves if curve.kind is CurveKind.signal]
    uneven = [curve.name for curve in signals if _rate(curve.abscissa) == 0.0]
    if uneven:
        report.remarks.append(
            f"{listed(tuple(uneven[:3]))} of {name} {'are' if len(uneven) > 1 else 'is'} not "
            "sampled evenly and left out"
        )
    shaft: ShaftAngle | None = None
    records: dict[str, TimeRecord] = {}
    even = [curve for curve in signals if curve.name not in uneven]
    for (unit, _), group in _by_raster(even).items():
        rate, start = _rate(group[0].abscissa), float(group[0].abscissa[0])
        for curve in group:
            if curve.name == tacho:
                shaft = shaft_of(np.asarray(curve.values, float), rate, pulses_per_revolution)
        shown = [curve for curve in group if curve.name != tacho]
        if shown:
            quantity = _QUANTITIES.get(unit, f"channels in {unit}" if unit else "channels")
            quantity = quantity if quantity not in records else f"{quantity} at {rate:g} Hz"
            records[quantity] = TimeRecord(
                np.column_stack([curve.values.real for curve in shown]),
                rate,
                tuple(curve.name for curve in shown),
                unit.replace("^2", "²"),
                start,
            )
    if records:
        show_signals(report, name, records, shaft)


def _by_raster(curves: Sequence[Curve]) -> dict[tuple[str, bytes], list[Curve]]:
    groups: dict[tuple[str, bytes], list[Curve]] = {}
    for curve in curves:
        groups.setdefault((curve.unit, np.asarray(curve.abscissa).tobytes()), []).append(curve)
    return groups


def _rate(time: RealArray) -> float:
    """Return the samples per second; 0 where they are not even [Hz]."""
    step = (time[-1] - time[0]) / (len(time) - 1)
    return 1 / step if np.allclose(np.diff(time), step, rtol=0.05) else 0.0


def _loudness(report: Report, files: Mapping[str, Sequence[Curve]]) -> None:
    """Tell how loud and how rough recordings of sound are heard."""
    rows: list[tuple[str, str, float, float]] = []
    sounds = [
        (file, curve)
        for file, curves in files.items()
        for curve in curves
        if curve.kind is CurveKind.signal and curve.unit == "Pa" and _rate(curve.abscissa)
    ]
    if not sounds:
        return
    report.section("Loudness and roughness")
    for file, curve in sounds:
        try:
            heard = sound_quality(curve.values.real, _rate(curve.abscissa))
        except InputError as error:
            report.text(f"{file}, {curve.name}: {error}.")
            continue
        rows.append((file, curve.name, heard.loudness, heard.roughness))
    if rows:
        columns = ["file", "channel", "loudness N5 [sone]", "roughness [asper]"]
        loudest = max(rows, key=lambda row: row[2])
        quietest = min(rows, key=lambda row: row[2])
        report.number("loudest_sone", loudest[2], "sone", "loudness N5 of the loudest recording")
        text = f"{loudest[1]} of {loudest[0]} has {loudest[2]:.1f} sone"
        if len(rows) > 1:
            text += f", {quietest[1]} of {quietest[0]} {quietest[2]:.1f}"
        report.remarks.append(text)
        report.table(
            "loudness",
            pd.DataFrame(rows, columns=columns),
            "Loudness exceeded in 5 % of the time by ISO 532-1 (Zwicker), mean roughness by Daniel "
            "and Weber, both by MoSQITo. Below 22 Hz ISO 532-1 hears nothing.",
            {columns[2]: 1, columns[3]: 2},
        )
