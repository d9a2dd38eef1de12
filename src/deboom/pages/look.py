"""A first look at a folder of measurements: what it holds, and pictures of it as measured."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from deboom import plot
from deboom.arrays import RealArray
from deboom.errors import InputError, listed
from deboom.files.campaign import CAMPAIGN_FILE, CampaignFile, read_campaign, read_time_run
from deboom.files.check import check_folder
from deboom.files.component_test import read_component_test
from deboom.files.electric_car import read_electric_car
from deboom.files.folders import FOLDERS, kind_of_folder
from deboom.files.function_table import with_their_tables
from deboom.files.hammer_test import read_hammer_test
from deboom.files.inertance_test import read_inertance_test
from deboom.files.kinds import FolderKind
from deboom.files.operating_test import read_operating_test
from deboom.files.platform import read_platform
from deboom.files.schema import load_toml
from deboom.files.vehicle import read_vehicle
from deboom.measurement.campaign import TimeRun
from deboom.measurement.channels import Frf, Spectrum, TimeRecord
from deboom.measurement.component_test import functions_at_points, motions_at_points
from deboom.measurement.compressor_test import InertanceTest, OperatingTest
from deboom.measurement.impact_test import HammerOptions, hammer_frfs
from deboom.measurement.order_tracking import shaft_of
from deboom.measurement.quality import HALFWAY, reciprocity
from deboom.measurement.virtual_point import (
    impact_geometry,
    sensor_geometry,
    virtual_point,
    virtual_point_frf,
)
from deboom.pages.look_pictures import (
    HIGHEST_HZ,
    RECIPROCITY_CAPTION,
    matrix_section,
    panels_section,
    show_signals,
)
from deboom.plot import CurvePanel
from deboom.report import Report, Step


def look_report(folder: Path) -> Report:
    """Draw what a folder holds.

    - `folder`: of any kind that ``deboom new`` writes.
    - returns: one page with what ``deboom check`` says, functions, coherences, orders, waterfalls
      and geometry, as far as the folder has them.
    - raises InputError: files that cannot be read, or that do not fit together. What contradicts
      in the numbers alone is a warning on the page.
    """
    kind = kind_of_folder(folder)
    faults, _waiting, summary = check_folder(folder)  # what waits is refused below
    report = Report(
        f"First look: {folder.resolve().name}", "What is in this folder, and does it look right?"
    )
    report.number("n_faults", len(faults), "", "faults that deboom check names", headline="d")
    report.warn(*faults)
    lines = [line.partition("  ") for line in summary.splitlines()]
    table = pd.DataFrame(
        [(name, text.strip()) for name, _, text in lines], columns=["what", "in this folder"]
    )
    warned = table.loc[table["what"] == "WARNING", "in this folder"].tolist()
    report.section(
        "What is in it",
        f"A folder of the kind {kind.value}, by its file {FOLDERS[kind].file}. Nothing is "
        "identified here, and nothing is corrected."
        + ("" if summary else " The contradictions are listed above; the pictures show why."),
    )
    if len(table):
        report.table("held", table, "What deboom check says.")
    drawn = _DRAWN[kind](report, folder)
    report.inputs = list(dict.fromkeys((folder / FOLDERS[kind].file, *drawn)))
    _answer(report, kind, faults, warned, report.remarks)
    return report


COHERENT = 0.9
"""Median over the lines of a channel's coherence, below which an impact is to be looked at [1]."""


def _answer(
    report: Report,
    kind: FolderKind,
    faults: Sequence[str],
    warned: Sequence[str],
    remarks: Sequence[str],
) -> None:
    """Say whether the folder looks right, what to look at, and what comes next."""
    if faults:
        one = len(faults) == 1
        first = f"Repair first: deboom check names {len(faults)} fault{'' if one else 's'}"
    elif warned:
        many = "1 warning" if len(warned) == 1 else f"{len(warned)} warnings, the first"
        first = f"{many}: {warned[0].rstrip('.')}. No other fault was named by deboom check"
    else:
        first = "It looks right to deboom check: no fault"
    report.answer(
        f"{first}; {remarks[0]}." if remarks else f"{first}.",
        "What not to trust: nothing was identified or corrected here. Signs, places and gains "
        "of single channels show only when something is identified.",
    )
    report.panel(
        "What to do next",
        Step("deboom check FOLDER", "the same sentences, and what was read"),
        *_NEXT.get(kind, ()),
        wide=True,
    )


_NEXT = {
    FolderKind.platform: (Step("deboom run front FOLDER", "which stiffnesses make it quiet"),),
    FolderKind.campaign: (Step("deboom characterise FOLDER", "stiffness of the mounts"),),
    FolderKind.compressor: (Step("deboom identify FOLDER", "mass, inertia and mounts"),),
    FolderKind.operation: (Step("deboom unbalance FOLDER", "unbalance of the rotor"),),
    FolderKind.car: (Step("deboom run compressor_noise --car FOLDER", "its noise in the cabin"),),
    FolderKind.component: (Step("deboom run component_tpa --test FOLDER", "its blocked forces"),),
}
"""What a folder of a kind is measured for."""


def _platform(report: Report, folder: Path) -> Sequence[Path]:
    platform = read_platform(folder)
    first = platform.fleet.vehicles[0].noise_transfer
    groups = dict.fromkeys(vehicle.group for vehicle in platform.fleet.vehicles)
    panels = []
    for column, path in enumerate(first.inputs):
        sizes = {
            group: np.array(
                [
                    np.abs(vehicle.noise_transfer.values[:, 0, column])
                    for vehicle in platform.fleet.vehicles
                    if vehicle.group == group
                ]
            )
            for group in groups
        }
        panels.append(
            CurvePanel(
                title=path,
                abscissa=first.frequency,
                curves={group: np.median(size, axis=0) for group, size in sizes.items()},
                ranges={group: (np.min(size, 0), np.max(size, 0)) for group, size in sizes.items()},
                logarithmic=True,
            )
        )
    panels_section(
        report,
        "Functions",
        "noise_transfer",
        panels,
        "Noise transfer functions by path: median and range of the vehicles of each group.",
        y_label="pressure over force [Pa/N]",
    )
    for quantity, unit in (("force", "N"), ("displacement", "m")):
        spectra = {case.name: getattr(case, quantity) for case in platform.load_cases}
        panels_section(
            report,
            f"Orders: {quantity}",
            f"operating_{quantity}",
            _panels_of(spectra),
            f"Magnitude of each {quantity} along the dominant order, by load case.",
            y_label=f"{quantity}, peak [{unit}]",
            order=platform.load_cases[0].order,
        )
    points = {mount.name: np.array(mount.positions) for mount in platform.mounts}
    _geometry(report, {"mounts": _labelled(points)}, "centre of gravity at 0")
    return platform.input_files


def _campaign(report: Report, folder: Path) -> Sequence[Path]:
    campaign = read_campaign(folder)
    run = campaign.runs[0]
    for title, stem, spectrum, label in (
        ("Orders: accelerations", "accelerations", run.acceleration, "acceleration, peak [m/s²]"),
        ("Orders: forces below the mounts", "cell_forces", run.cell_force, "force, peak [N]"),
    ):
        panels_section(
            report,
            title,
            stem,
            _panels_of_sensors(spectrum),
            f"Magnitude along order {campaign.order:g} in run {run.name} of mount set "
            f"{run.mount_set}, by sensor. A channel far below its neighbours is dead, or has "
            "another gain.",
            y_label=label,
            order=campaign.order,
        )
    file = load_toml(folder / CAMPAIGN_FILE, CampaignFile)
    for entry in file.time_runs:
        _time_run(report, entry.name, read_time_run(folder, entry.name))
    _geometry(
        report,
        {
            "sensors": {sensor.name: sensor.position for sensor in campaign.sensors},
            "mounts": _labelled({m.name: np.array(m.positions) for m in campaign.mounts}),
        },
        "centre of gravity at 0",
    )
    recorded = with_their_tables(folder / entry.file for entry in file.time_runs)
    return (*campaign.input_files, *recorded)


def _vehicle(report: Report, folder: Path) -> Sequence[Path]:
    vehicle = read_vehicle(folder)
    panels, column = [], 0
    for point, blows in vehicle.impacts.items():
        sizes = np.abs(vehicle.direct.values[:, 0, column : column + len(blows)])
        names = vehicle.direct.inputs[column : column + len(blows)]
        curves = dict(zip(names, sizes.T, strict=True))
        panels.append(CurvePanel(point, vehicle.direct.frequency, curves, logarithmic=True))
        column += len(blows)
    panels_section(
        report,
        "Functions",
        "noise_transfer",
        panels,
        f"Pressure at {vehicle.ears[0]} per force of each blow, by mount.",
        y_label="pressure over force [Pa/N]",
    )
    if vehicle.runs:
        panels_section(
            report,
            "Orders",
            "run_pressure",
            _panels_of({run.name: run.pressure for run in vehicle.runs}),
            "Pressure along the dominant order, by run.",
            y_label="pressure, peak [Pa]",
            order=vehicle.runs[0].order,
        )
    bodies = {s.name: s.position for sensors in vehicle.body_sensors.values() for s in sensors}
    struck = {blow.name: blow.position for blows in vehicle.impacts.values() for blow in blows}
    mounts = _labelled({mount.name: np.array(mount.positions) for mount in vehicle.mounts})
    _geometry(report, {"sensors": bodies, "blows": struck, "mounts": mounts}, "")
    return ()


def _compressor(report: Report, folder: Path) -> Sequence[Path]:
    test = read_inertance_test(folder)
    _hammered(report, test)
    return test.input_files


def _hammered(report: Report, test: InertanceTest) -> None:
    _functions(report, test.frf, test.coherence, "inertance [(m/s²)/N]")
    response = virtual_point(sensor_geometry(test.sensors))
    excitation = virtual_point(impact_geometry(test.impacts))
    _reciprocity(report, virtual_point_frf(test.frf, response=response, excitation=excitation))
    _geometry(
        report,
        {
            "sensors": {sensor.name: sensor.position for sensor in test.sensors},
            "impacts": {impact.name: impact.position for impact in test.impacts},
        },
        "",
    )


def _functions(report: Report, frf: Frf, coherence: RealArray | None, label: str) -> None:
    """Size of all functions of each impact, and their coherences."""
    sizes = np.sqrt(np.mean(np.abs(frf.values) ** 2, axis=1))
    panels = [
        CurvePanel(name, frf.frequency, {"all channels": sizes[:, n]}, logarithmic=True)
        for n, name in enumerate(frf.inputs)
    ]
    panels_section(
        report,
        "Functions",
        "functions",
        panels,
        "Root mean square over all channels, by impact: impacts on one body look alike.",
        y_label=label,
        share_y=True,
    )
    if coherence is not None:
        report.remarks.append(_coherence_in_words(frf, coherence))
        panels = [
            CurvePanel(
                name,
                frf.frequency,
                {
                    "median of the channels": np.median(coherence[:, :, n], axis=1),
                    "worst channel": coherence[:, :, n].min(axis=1),
                },
            )
            for n, name in enumerate(frf.inputs)
        ]
        panels_section(
            report,
            "Coherence",
            "coherence",
            panels,
            "Ordinary coherence by impact. It says how much noise there is, and nothing of signs, "
            "places or gains.",
            y_label="coherence [1]",
            share_y=True,
        )
        median = np.median(coherence, axis=0)
        pairs = {
            (output, name): float(median[row, column])
            for row, output in enumerate(frf.outputs)
            for column, name in enumerate(frf.inputs)
        }
        matrix_section(
            report,
            "Coherence at a glance",
            "coherence_median",
            pairs,
            "Median over the lines, by channel and impact.",
        )


def _reciprocity(report: Report, at_points: Frf) -> None:
    """Show how reciprocal functions at virtual points are: outputs and inputs in one order."""
    symmetry = reciprocity(at_points)
    pair, least = symmetry.worst()
    if least < HALFWAY:
        report.remarks.append(
            f"the pair {pair} is not reciprocal ({least:.2f}): look for a reversed or exchanged "
            "sensor, or a point that was struck elsewhere"
        )
    pairs = {
        (row, column): float(symmetry.likeness[i, j])
        for i, row in enumerate(symmetry.names)
        for j, column in enumerate(symmetry.names)
    }
    caption = f"{RECIPROCITY_CAPTION} Functions at virtual points, motions by loads."
    matrix_section(report, "Reciprocity at a glance", "reciprocity", pairs, caption)


def _coherence_in_words(frf: Frf, coherence: RealArray) -> str:
    """Name the impacts whose worst channel is incoherent over most lines, or falls to nothing."""
    typical = np.median(coherence, axis=0).min(axis=0)
    named = [
        f"{name} ({value:.2f})"
        for name, value in zip(frf.inputs, typical, strict=True)
        if value < COHERENT
    ]
    if named:
        return (
            f"look at the coherence of {listed(tuple(named))}, whose worst channel stays below "
            f"{COHERENT:g} over half of the lines"
        )
    least = coherence.min(axis=1)
    line, impact = np.unravel_index(int(least.argmin()), least.shape)
    return (
        f"the worst channel of every impact is coherent ({COHERENT:g} or more) over half of the "
        f"lines and more; the least coherence is {least[line, impact]:.2f}, {frf.inputs[impact]} "
        f"at {frf.frequency[line]:.0f} Hz"
    )


def _hammer(report: Report, folder: Path) -> Sequence[Path]:
    test = read_hammer_test(folder)
    panels = []
    for measurement in test.measurements:
        time = 1e3 * (np.arange(measurement.force.shape[1]) / measurement.rate)
        first = int(measurement.rate * measurement.pretrigger)
        shown = slice(max(first - 20, 0), first + 60)
        curves = {f"hit {n}": force[shown] for n, force in enumerate(measurement.force, 1)}
        panels.append(CurvePanel(measurement.impact, time[shown], curves))
    panels_section(
        report,
        "Blows",
        "blows",
        panels,
        "Force of every hit around its trigger, by impact: one push, no second one, no flat top.",
        x_label="time in the block [ms]",
        y_label="force [N]",
    )
    estimate = hammer_frfs(test, HammerOptions(band=(0.0, HIGHEST_HZ), minimum_hits=1))
    several = min(estimate.n_averages) > 1
    _functions(report, estimate.frf, estimate.coherence if several else None, "response over N")
    _geometry(
        report,
        {
            "sensors": {sensor.name: sensor.position for sensor in test.sensors},
            "impacts": {impact.name: impact.position for impact in test.impacts},
        },
        "",
    )
    return sorted(path for path in folder.rglob("*") if path.is_file())


def _operation(report: Report, folder: Path) -> Sequence[Path]:
    test = read_operating_test(folder)
    _swept(report, test)
    return test.input_files


def _swept(report: Report, test: OperatingTest) -> None:
    for number, sweep in enumerate(test.sweeps, 1):
        panels_section(
            report,
            f"Orders: sweep {sweep.name}",
            f"sweep_{number}",
            _panels_of_sensors(sweep.acceleration),
            f"Accelerations along order 1 of the shaft, hoses {sweep.hoses.value}, by sensor.",
            y_label="acceleration, peak [m/s²]",
            order=1.0,
        )
    _hammered(report, test.hammer)


def _car(report: Report, folder: Path) -> Sequence[Path]:
    car = read_electric_car(folder)
    frf = car.pressure
    panels = [
        CurvePanel(name, frf.frequency, {car.ear: np.abs(frf.values[:, 0, n])}, logarithmic=True)
        for n, name in enumerate(frf.inputs)
    ]
    panels_section(
        report,
        "Functions of the body",
        "body_pressure",
        panels,
        f"Pressure at {car.ear} per force, by impact.",
        y_label="pressure over force [Pa/N]",
    )
    _swept(report, car.operation)
    return car.input_files


def _component(report: Report, folder: Path) -> Sequence[Path]:
    test = read_component_test(folder)
    _functions(report, test.accelerance, test.coherence, "accelerance [(m/s²)/N]")
    _reciprocity(
        report,
        functions_at_points(motions_at_points(test.accelerance, test.points), test.points),
    )
    frf = test.pressure
    panels = [
        CurvePanel(
            name,
            frf.frequency,
            dict(zip(frf.outputs, np.abs(frf.values[:, :, n]).T, strict=True)),
            logarithmic=True,
        )
        for n, name in enumerate(frf.inputs)
    ]
    panels_section(
        report,
        "Functions to the ears",
        "ear_pressure",
        panels,
        "Pressure at the ears per force, by impact.",
        y_label="pressure over force [Pa/N]",
    )
    for number, run in enumerate(test.runs, 1):
        panels_section(
            report,
            f"Run {run.name}: accelerations",
            f"run_{number}",
            _panels_of_sensors(run.acceleration),
            "Accelerations while the source runs, by sensor. A channel far below its neighbours "
            "is dead, or has another gain.",
            y_label="acceleration, peak [m/s²]",
            order=run.order or None,
        )
    panels_section(
        report,
        "Runs: pressures",
        "run_pressure",
        _panels_of({run.name: run.sound for run in test.runs}),
        "Pressure at each ear, by run.",
        y_label="pressure, peak [Pa]",
    )
    sensors = [sensor for point in test.points for sensor in point.sensors]
    sensors += [*test.indicators, *test.on_board]
    impacts = [impact for point in test.points for impact in point.impacts]
    _geometry(
        report,
        {
            "sensors": {sensor.name: sensor.position for sensor in sensors},
            "impacts": {impact.name: impact.position for impact in impacts},
            "impacts on the source": {hit.name: hit.position for hit in test.source_hits},
            "points": {point.name: point.position for point in test.points},
        },
        "",
    )
    return test.input_files


_DRAWN: Mapping[FolderKind, Callable[[Report, Path], Sequence[Path]]] = {
    FolderKind.platform: _platform,
    FolderKind.campaign: _campaign,
    FolderKind.vehicle: _vehicle,
    FolderKind.compressor: _compressor,
    FolderKind.hammer: _hammer,
    FolderKind.operation: _operation,
    FolderKind.car: _car,
    FolderKind.component: _component,
}


def _panels_of(spectra: Mapping[str, Spectrum]) -> list[CurvePanel]:
    """Return a panel for each channel with the magnitudes of all spectra on the same lines."""
    groups: dict[bytes, dict[str, Spectrum]] = {}
    for name, spectrum in spectra.items():
        groups.setdefault(spectrum.frequency.tobytes(), {})[name] = spectrum
    panels = []
    for group in groups.values():
        first = next(iter(group.values()))
        where = f", {', '.join(group)}" if len(groups) > 1 else ""
        for channel in dict.fromkeys(c for spectrum in group.values() for c in spectrum.channels):
            curves = {
                name: np.abs(spectrum.values[:, spectrum.channels.index(channel)])
                for name, spectrum in group.items()
                if channel in spectrum.channels
            }
            title = f"{channel}{where}"
            panels.append(CurvePanel(title, first.frequency, curves, logarithmic=True))
    return panels


def _panels_of_sensors(spectrum: Spectrum) -> list[CurvePanel]:
    """Return a panel for each sensor, with the magnitude of its axes."""
    sensors: dict[str, dict[str, RealArray]] = {}
    for name, column in zip(spectrum.channels, np.abs(spectrum.values).T, strict=True):
        sensor, _, axis = name.rpartition(" ")
        if np.any(column):  # a dead channel has no place on a logarithmic scale
            sensors.setdefault(sensor or name, {})[axis] = column
    return [
        CurvePanel(sensor, spectrum.frequency, curves, logarithmic=True)
        for sensor, curves in sensors.items()
    ]


def _time_run(report: Report, name: str, run: TimeRun) -> None:
    """Show a run over time, over the speed of its shaft where its tacho tells it."""
    records = {
        "acceleration": TimeRecord(
            run.acceleration, run.sample_rate, run.acceleration_channels, "m/s²"
        ),
        "force": TimeRecord(run.cell_force, run.sample_rate, run.cell_force_channels, "N"),
    }
    try:
        shaft = shaft_of(run.tacho, run.sample_rate, run.pulses_per_revolution)
    except InputError as error:
        shaft = None
        report.remarks.append(f"the tacho of run {name} gives no orders: {error}")
    show_signals(report, name, records, shaft)


def _labelled(points: Mapping[str, RealArray]) -> dict[str, RealArray]:
    """Name the pieces of mounts by their place."""
    return {
        name if len(rows) == 1 else f"{name} {n}": row
        for name, rows in points.items()
        for n, row in enumerate(rows, 1)
    }


def _geometry(report: Report, groups: Mapping[str, Mapping[str, RealArray]], remark: str) -> None:
    """Show where everything stands, from three sides."""
    filled = {name: points for name, points in groups.items() if points}
    if not filled:
        return
    report.section("Geometry")
    report.figure(
        "geometry",
        partial(plot.places, filled),
        "Places from three sides, axes as in the folder"
        + (f", {remark}" if remark else "")
        + ": a swapped axis, a mirrored side or mm for m shows at once.",
    )
