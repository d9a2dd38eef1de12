"""The first screen of a front: vehicles, cars, peaks, how sure the change is, how it sounds."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np
import pandas as pd

from deboom import plot
from deboom.arrays import PERCENT, ComplexArray, RealArray
from deboom.files.sound import run_up_files
from deboom.measurement.booming_peaks import PeakChange
from deboom.mounts.mount import Mount
from deboom.physics.sound_level import full_scale
from deboom.plot.style import ACCENT, INK, signed
from deboom.report import Picture, Report, Sound, Table
from deboom.vehicles.expected_change import SHARE, ExpectedChange, Information, Interval
from deboom.vehicles.fleet_front import COMMON_PERCENTILE, FleetFront
from deboom.vehicles.free_directions import NOTICEABLE

MOST_ROWS = 12
"""Vehicles in the table of the first screen: of a larger fleet those that gain least."""
SOUND_SECONDS, SOUND_RATE = 6.0, 8000
"""Length of a run-up [s], and its samples per second [Hz]."""
IN_TARGET = "cars in target [%]"
TWO_DIGITS = 0.095
"""Half width below which a second digit is shown [dB]."""


def short_title(mount: Mount) -> str:
    """Return what a mount is called: its description up to the first comma."""
    return mount.description.partition(",")[0].strip()


def spelled_out(variable: str, mounts: Sequence[Mount]) -> str:
    """Write a direction with what its mount is called, ``torque strut mount x (TSM x)``."""
    name, _, axis = variable.rpartition(" ")
    titles = {mount.name: short_title(mount) for mount in mounts}
    return f"{titles[name]} {axis} ({variable})" if titles.get(name) else variable


def abbreviations(mounts: Sequence[Mount]) -> str:
    """Spell the mounts' names out in a sentence; empty where nobody says what they are called."""
    pairs = [f"{mount.name} {short_title(mount)}" for mount in mounts if short_title(mount)]
    return f"{', '.join(pairs)}." if pairs else ""


def mean_levels(fleet: FleetFront, design: RealArray) -> tuple[RealArray, RealArray]:
    """Return the mean level of the cars of each vehicle, today and with a design, (v,) [dB(A)].

    Today's is nan where it could not be computed in some draw.
    """
    if fleet.front.baseline.failed[0]:
        before = np.full(len(fleet.vehicles), np.nan)
    else:
        before = fleet.cars(fleet.today).levels.mean(axis=0)
    return before, fleet.cars(design).levels.mean(axis=0)


def vehicle_table(
    fleet: FleetFront,
    design: RealArray,
    *,
    target: RealArray,
    expected: ExpectedChange | str = "",
) -> pd.DataFrame:
    """Tabulate what a design does to each vehicle: level, change with its interval, peaks, cars.

    - `target` (v,): level that cars shall not exceed [dB(A)].
    - `expected`: what is expected of the design, or why nothing is.
    - returns a row per vehicle, of a large fleet those that gain least, and one of their mean; no
      column of the cars in target where that is all of them.
    """
    cars = fleet.cars(design)
    before, after = mean_levels(fleet, design)
    changes = fleet.peak_changes(design)
    share, tail = PERCENT * cars.share_within(target), cars.percentile()
    rows = np.sort(np.argsort(before - after, kind="stable")[:MOST_ROWS])
    table: dict[str, list[object]] = {
        "vehicle": [fleet.vehicles[row] for row in rows],
        **expected_column(expected, rows),
        "today [dB(A)]": before[rows].tolist(),
        "new [dB(A)]": after[rows].tolist(),
        "change [dB]": (after - before)[rows].tolist(),
        "loudest peak [dB(A)]": [_loudest(changes[fleet.vehicles[row]]) for row in rows],
        "worst peak [dB]": [_worst(changes[fleet.vehicles[row]]) for row in rows],
        IN_TARGET: share[rows].tolist(),
        f"P{COMMON_PERCENTILE:.0f} [dB(A)]": tail[rows].tolist(),
    }
    if len(fleet.vehicles) > 1:
        whose = "mean" if fleet.weights is None else "weighted mean"
        levels = (float(fleet.mean(each)) for each in (before, after, after - before))
        of_mean = [] if isinstance(expected, str) else [_cell(expected.mean)]
        means = (whose, *of_mean, *levels, "", "", float(fleet.mean(share)), None)
        for column, value in zip(table, means, strict=True):
            table[column].append(value)
    if share.min() == PERCENT:
        del table[IN_TARGET]
    return pd.DataFrame(table)


def cars_sentences(fleet: FleetFront, table: pd.DataFrame, target: str) -> str:
    """Say which cars a table of `vehicle_table` counts, and what its last columns are.

    - `target`: of the cars, in words.
    """
    kept = "" if IN_TARGET in table else ", which all of them keep"
    return (
        f"Cars: {fleet.n_cars} of each, parts as made. Target: {target}{kept}. P95: 95 % of the "
        "cars stay below. Worst peak: the booming peak that falls least or rises most."
    )


def weights_sentence(fleet: FleetFront) -> str:
    """Say how vehicles count in means, with a space behind; empty where they count alike."""
    if fleet.weights is None:
        return ""
    ratios = fleet.front.robust.weight_ratios[fleet.ears]
    pairs = zip(fleet.vehicles, ratios, strict=True)
    counted = [f"{name} {ratio:.3g}" for name, ratio in pairs if ratio != 1.0]
    rest = ", every other one 1" if len(counted) < len(ratios) else ""
    return f"In each mean of the vehicles the weights are {', '.join(counted)}{rest}. "


EXPECTED = "expected (90 %) [dB]"
VEHICLE_DECIMALS = {"change [dB]": 1}
"""Of the columns of `vehicle_table` that their units do not decide."""


def expected_column(
    expected: ExpectedChange | str, rows: Iterable[int], of: str = ""
) -> dict[str, list[object]]:
    """Return a column with what is expected in some vehicles, by their rows; or none.

    - `of`: what changes, before the column's name.
    """
    if isinstance(expected, str):
        return {}
    return {f"{of}{EXPECTED}": [_cell(expected.cars.of(row)) for row in rows]}


def _cell(interval: Interval) -> str:
    return f"{signed(float(interval.expected), 1)} ({_ends(interval)})"


def _loudest(changes: Sequence[PeakChange]) -> str:
    if not changes:
        return "none"
    top = max(changes, key=lambda peak: max(peak.level_before, peak.level_after))
    return f"{top.level_before:.1f} → {top.level_after:.1f} at {top.frequency:.0f} Hz"


def _worst(changes: Sequence[PeakChange]) -> str:
    counting = [peak for peak in changes if peak.counts]
    if not counting:
        return "–"
    top = max(counting, key=lambda peak: peak.change)
    return f"{signed(top.change, 1)} at {top.frequency:.0f} Hz"


def peaks_sentence(changes: Mapping[str, Sequence[PeakChange]]) -> str:
    """Say what becomes of today's booming peaks of all vehicles, and which peak rises most.

    - `changes`: of each vehicle.
    """
    every = [
        (peak.change, peak, name)
        for name, peaks in changes.items()
        for peak in peaks
        if peak.counts
    ]
    todays = [change for change, peak, _ in every if peak.before]
    louder = [rise for rise in every if rise[0] > NOTICEABLE]
    if not louder:
        if not todays:
            return "no vehicle has a booming peak"
        if len(todays) == 1:
            return f"today's booming peak changes by {signed(todays[0], 1)} dB"
        ends = dict.fromkeys(signed(end(todays), 1) for end in (min, max))
        return f"today's {len(todays)} booming peaks change by {' to '.join(ends)} dB"
    change, top, vehicle = max(louder, key=lambda rise: rise[0])
    subject = "one booming peak becomes" if len(louder) == 1 else f"{len(louder)} peaks become"
    return (
        f"{subject} louder than today, most of all {vehicle} at {top.frequency:.0f} Hz, by "
        f"{change:.1f} dB; today there are {len(todays)}"
    )


def certainty_sentence(expected: ExpectedChange | str, old_stops: float = np.nan) -> str:
    """Say how sure the mean change is, and under which condition.

    - `expected`: of the design, or the sentence that says why nothing is expected.
    - `old_stops`: mean change in the model if only the rubber gets softer [dB]; nan: not known.
    """
    condition = (
        "if the stops are re-tuned with the stiffness; if only the rubber gets softer: "
        f"{signed(old_stops, 1)} dB in the model"
    )
    if isinstance(expected, str):
        in_model = f" The change in the model holds {condition}." * bool(np.isfinite(old_stops))
        return f"How sure: {expected}.{in_model}"
    low, high = (signed(float(end), 1) for end in (expected.mean.low, expected.mean.high))
    worst = ""
    if len(expected.predicted) > 1:
        worst = f", in the car that gains least {_ends(expected.worst)} dB"
    holds = f", {condition}" * bool(np.isfinite(old_stops))
    return (
        f"How sure: with {PERCENT * SHARE:.0f} % the mean change of these cars lies between {low} "
        f"and {high} dB{worst}{holds}."
    )


def model_sentence(expected: ExpectedChange | str, predicted: float, *, bodies: bool = True) -> str:
    """Say why the model says another mean change, and what is known of the bodies.

    - `expected`: of the design; empty where it is the sentence that says why nothing is expected.
    - `predicted`: mean change in the model [dB].
    - `bodies`: whether to say it of the bodies, where no table beside it does.
    """
    if isinstance(expected, str):
        return ""
    known = f" Of the bodies {_known_of_bodies(expected)}." * bodies
    return (
        f"The model says {signed(predicted, 1)} dB: it leaves out bodies that give way, warmer or "
        f"older rubber, and amplitudes. {_loudest_line(expected)}.{known}"
    )


LITTLE_NARROWER = 0.1
"""Share of an interval by which it is hardly narrower [1]."""


def _known_of_bodies(expected: ExpectedChange) -> str:
    """Say what an interval rests on, and what would make it narrower."""
    if expected.information is Information.receptances:
        return "the receptances at the mounts are known"
    if expected.information is Information.driving_points:
        return (
            "the driving points are known and what passes between them is drawn at random; all "
            "receptances would narrow the interval"
        )
    narrower = 1.0 - float(expected.with_points)
    if narrower < LITTLE_NARROWER:
        return "nothing is known; driving points at the mounts would hardly narrow the interval"
    return (
        "nothing is known; driving points at the mounts would narrow the interval of a car by "
        f"about {round(PERCENT * narrower, -1):.0f} %"
    )


def expected_on_average(expected: ExpectedChange | str, predicted: float) -> str:
    """Write the mean change that a verdict states: the expected one, else the model's [dB]."""
    if isinstance(expected, str):
        return f"{signed(predicted, 1)} dB on average in the model"
    return f"{signed(float(expected.mean.expected), 1)} dB expected on average"


def _loudest_line(expected: ExpectedChange) -> str:
    """Say what the loudest line may do; how much it is expected to, receptances alone tell."""
    peaks, each = expected.peaks, " for each" * (len(expected.predicted) > 1)
    bounds = Interval(
        peaks.expected, np.asarray(np.nanmin(peaks.low)), np.asarray(np.nanmax(peaks.high))
    )
    if expected.information is not Information.receptances:
        return (
            f"The loudest line of a car may change by {_ends(bounds)} dB "
            f"({PERCENT * SHARE:.0f} %{each})"
        )
    changes = {signed(float(end(peaks.expected)), 1): None for end in (np.nanmin, np.nanmax)}
    return (
        f"The loudest line of a car is expected to change by {' to '.join(changes)} dB "
        f"({_ends(bounds)}, {PERCENT * SHARE:.0f} %{each})"
    )


def _ends(interval: Interval) -> str:
    return f"{signed(float(interval.low), 1)} to {signed(float(interval.high), 1)}"


def report_expected_numbers(
    report: Report, expected: ExpectedChange | str, vehicles: Sequence[str]
) -> None:
    """Say what is expected of one design: in each vehicle, on average, where it gains least."""
    if isinstance(expected, str):
        return
    report.number(
        "expected_change_db_mean",
        float(expected.mean.expected),
        "dB",
        "expected change of the mean level at the driver's ear, mean of the vehicles",
        headline="+.1f",
    )
    parts = {name: expected.cars.of(row) for row, name in enumerate(vehicles)}
    parts["worst"] = expected.worst
    for vehicle, part in parts.items():
        report.number(
            f"expected_change_db_{vehicle}",
            float(part.expected),
            "dB",
            "expected change of the mean level in the vehicle; worst: in that which gains least",
        )
    for vehicle, part in {**parts, "mean": expected.mean}.items():
        report.number(
            f"expected_change_db_{vehicle}_low",
            float(part.low),
            "dB",
            "lower end of the 90 % interval of the vehicle's expected change",
        )
        report.number(
            f"expected_change_db_{vehicle}_high",
            float(part.high),
            "dB",
            "upper end of the 90 % interval of the vehicle's expected change",
        )


def report_expected(
    report: Report,
    expected: ExpectedChange | str,
    designs: Sequence[str],
    vehicles: Sequence[str],
) -> None:
    """Add the file of what is expected of each design in each vehicle, where something is.

    - `expected`: of designs in their order, arrays (n, v).
    """
    if isinstance(expected, str):
        return
    names, rows = np.meshgrid(designs, vehicles, indexing="ij")
    table: dict[str, object] = {"design": names.ravel(), "vehicle": rows.ravel()}
    bounds = {"change": expected.cars, "loudest line": expected.peaks}
    for what, interval in bounds.items():
        if what == "change" or expected.information is Information.receptances:
            table[f"{what}, expected [dB]"] = interval.expected.ravel()
        table |= {
            f"{what}, from [dB]": interval.low.ravel(),
            f"{what}, to [dB]": interval.high.ravel(),
        }
    table["change in the model [dB]"] = expected.predicted.ravel()
    report.table("expected", pd.DataFrame(table))


def other_changes_sentence(*, unseen: float, prescribed: float) -> str:
    """Say what the model says with prescribed motion and of other cars [dB]; nan: unknown."""
    sentences = []
    if np.isfinite(prescribed):
        sentences.append(f"With prescribed motion the model says {signed(prescribed, 1)} dB.")
    if np.isfinite(unseen):
        sentences.append(f"In other vehicles of the group it may be ±{_half(unseen)} dB off.")
    return " ".join(sentences)


def _half(value: float) -> str:
    """Write a half width [dB] with the digits that it has."""
    return f"{value:.2f}" if value < TWO_DIGITS else f"{value:.1f}"


DRAWN_CARS, BAND = 64, (5.0, 95.0)
"""Cars as made behind the band of the picture, and its percentiles [%]."""
PICTURE_WIDTH = 4.4
"""Of the first screen [inch]."""


def report_loudest(
    report: Report,
    fleet: FleetFront,
    design: RealArray,
    pressure: Callable[[RealArray], ComplexArray],
    run_up: str,
    speed_label: str = "engine speed [rpm]",
) -> None:
    """Show, and let the reader hear, the vehicle with the loudest line today, today and new.

    - `pressure`: from designs (n, k) to complex peak amplitudes (n, v, n_frequency) [Pa].
    - `run_up`: what is heard, in words; `speed_label`: what turns.
    """
    both = np.stack([fleet.today, design])
    row = int(fleet.levels(fleet.today).max(axis=1).argmax())
    sounds = pressure(both)
    # of all vehicles, so that it is as loud as in the interactive page and by `deboom listen`
    scale = full_scale(sounds)
    files = run_up_files(sounds[:, row], fleet.frequency, SOUND_SECONDS, SOUND_RATE, scale)
    words = (
        f"Level over speed in {fleet.vehicles[row]}, today and new. Shade: 90 % of the cars with "
        "new parts as made."
    )
    report.panel(
        f"{fleet.vehicles[row]}, the loudest line today",
        Picture(lambda: _loudest_levels(fleet, design, row, speed_label), words, words),
        *(Sound(name, wav) for name, wav in zip((TODAY, NEW), files, strict=True)),
        f"Run-up of the model, {run_up}; full scale {scale:.3g} Pa in both. Use headphones.",
    )


TODAY, NEW = "today", "new"


def _loudest_levels(
    fleet: FleetFront, design: RealArray, row: int, speed_label: str
) -> plot.Figure:
    made = fleet.front.judge.sets[0].made(design)[:DRAWN_CARS]
    levels = np.asarray(fleet.model.levels(made))[:, fleet.ears]
    ends = np.percentile(levels[:, row], BAND, axis=0)
    curves = {TODAY: fleet.levels(fleet.today)[row], NEW: fleet.levels(design)[row]}
    panel = plot.CurvePanel("", fleet.frequency, curves, ranges={NEW: (ends[0], ends[1])})
    return plot.curve_panels(
        [panel],
        y_label="SPL [dB(A)]",
        columns=1,
        dashed=(TODAY,),
        colours={TODAY: INK, NEW: ACCENT},
        order=fleet.order,
        speed_label=speed_label,
        width=PICTURE_WIDTH,
    )


def part_table(
    parts: Sequence[str],
    *,
    share: RealArray,
    today: RealArray,
    alone: RealArray,
    decimals: int,
    beside: Mapping[str, Sequence[object] | RealArray],
) -> Table:
    """Tabulate the stiffnesses that change.

    - `share` (n,): new over today's [1]; `today` (n,): [N/mm], with `decimals`; `alone` (n,): what
      each alone brings [dB].
    - `beside`: further columns.
    """
    frame = pd.DataFrame(
        {
            "part": list(parts),
            "of today's [1]": share,
            "new [N/mm]": share * today,
            "today [N/mm]": today,
            "alone [dB]": alone,
            **beside,
        }
    )
    places = {"new [N/mm]": decimals, "today [N/mm]": decimals}
    return Table(frame, "", {"of today's [1]": 2, "alone [dB]": 1, **places})


def price_table(
    numbers: Iterable[str],
    *,
    today: Iterable[float],
    after: Iterable[float],
    allowed: Iterable[str] | None,
    decimals: int,
) -> Table:
    """Tabulate what a design costs in sag, travel and modes, beside what is allowed.

    - `allowed` or None: in words, where limits were stated.
    """
    frame = pd.DataFrame({"number": list(numbers), "today": list(today), "new": list(after)})
    if allowed is not None:
        frame["allowed"] = list(allowed)
    return Table(frame, "", {"today": decimals, "new": decimals})
