"""Folded parts of a page on characterised mounts: maps, load cases, sensors and cells, as tables.

They are the thesis's figures 14, 18 to 25 and 26 to 32, drawn from tables that are files.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TypeAlias

import numpy as np
import pandas as pd
from scipy.spatial import cKDTree

from deboom import plot
from deboom.arrays import BoolArray, ComplexArray, RealArray
from deboom.measurement.campaign import OperatingRun
from deboom.measurement.force_transfer import ForceTransferMatrix
from deboom.measurement.sensors import Sensor
from deboom.mounts.characterised_bench import (
    THESIS_R2,
    CharacterisedBench,
    percent,
    shown_run,
    usable_maps,
)
from deboom.mounts.measuring_chain import AlignmentEstimate, InstrumentedBody
from deboom.mounts.operating_map import OperatingMap, Preload
from deboom.mounts.piecewise_cubic import MARGIN, TrainingRegion
from deboom.mounts.response_surface import DynamicStiffnessSurface
from deboom.physics.dynamic_stiffness import N_PER_MM
from deboom.physics.order_tracking import rpm_of_frequency
from deboom.plot import CurvePanel, PointMap
from deboom.plot.style import VEHICLE_PALETTE
from deboom.report import Report

MM = 1e3
"""From m to mm."""
SHOWN_POINTS = 400
"""Of a map; more hide each other, and each is a part of the page."""
DIGITS = 6
"""Significant digits of a table line by line: a tenth of what noise leaves certain."""
SPIKE, SHOWN_SHARE = 5.0, 0.95
"""Widest interval over that share of a panel's, above which the scale is made for the share [1]."""
GRID, FINE = 80, 400
"""Lines of a grid that an outline is drawn on, and points of a curve that is bent."""
DOTS = 60
"""Of a measured curve, so that the surface's line shows between them."""
PRELOAD, DISPLACEMENT, FREQUENCY = "preload", "displacement", "frequency"
AXES = "xyz"
THESIS_FIGURES = {
    "EnM": (" (thesis, figure 23)", " (thesis, figure 23)", " (figure 27)", " (figure 30)"),
    "GeM": (" (thesis, figure 24)", " (thesis, figure 24)", " (figure 28)", " (figure 31)"),
    "TSM": (
        " (thesis, figures 19, 21 and 25)",
        " (thesis, figure 25)",
        " (figure 29)",
        " (figure 32)",
    ),
}
"""Of a mount's maps, those over frequency, its stiffness over speed and its force over speed."""
NO_FIGURES = ("", "", "", "")
"""Of a mount that the thesis does not show."""


def significant(values: RealArray) -> RealArray:
    """Round to `DIGITS` significant digits; nan stays nan."""
    size = np.where((values == 0) | ~np.isfinite(values), 1.0, np.abs(values))
    decade = 10.0 ** (DIGITS - 1 - np.floor(np.log10(size)))
    return np.asarray(np.round(values * decade) / decade)


def stiffness_noise(measured: OperatingMap) -> RealArray:
    """Return the standard deviation of Re K and of Im K by the stated noise, (n,) [N/m].

    A complex K has ``σ² = |K|² ((σ_s/|s|)² + (σ_f/|f|)²)``, half of it in each part.
    """
    moved = (measured.displacement_noise / measured.amplitude) ** 2
    pushed = (measured.force_noise / np.abs(measured.force)) ** 2
    return np.asarray(np.abs(measured.stiffness) * np.sqrt((moved + pushed) / 2))


def noise_ceiling(measured: OperatingMap) -> tuple[float, float]:
    """Return the R² [1] of Re K and of Im K that the truth would reach under the stated noise.

    ``1 − mean σ² / variance of what was measured``: noise is part of what R² compares with.
    """
    variance = float(np.mean(stiffness_noise(measured) ** 2))
    parts = measured.stiffness.real, measured.stiffness.imag
    real, imag = (1 - variance / float(np.var(part)) for part in parts)
    return real, imag


def stiffness_lines(bench: CharacterisedBench) -> pd.DataFrame:
    """List what was measured, line by line: where each mount was, its stiffness and σ of it.

    The surface is given where it was fitted or lies inside of its region, else nan.
    """
    parts = []
    for name, direction in bench.result.directions.items():
        lines, surface = direction.measured, bench.surfaces.get(name)
        modelled, inside = _modelled(bench, surface, lines)
        modelled = np.where(inside, modelled, np.nan)
        sigma = np.where(lines.near_floor, np.nan, stiffness_noise(lines) * N_PER_MM)
        columns = {
            "frequency [Hz]": lines.frequency,
            "wheel torque [N m]": lines.wheel_torque,
            "static force [N]": lines.static_force,
            "displacement [mm]": lines.amplitude * MM,
            "Re K [N/mm]": lines.stiffness.real * N_PER_MM,
            "Im K [N/mm]": lines.stiffness.imag * N_PER_MM,
            "σ of Re K and of Im K [N/mm]": sigma,
            "Re K, surface [N/mm]": modelled.real * N_PER_MM,
            "Im K, surface [N/mm]": modelled.imag * N_PER_MM,
        }
        part = pd.DataFrame({label: significant(values) for label, values in columns.items()})
        part.insert(0, "direction", name)
        part.insert(1, "run", lines.run)
        part["near the floor"] = np.where(lines.near_floor, "yes", "no")
        parts.append(part)
    return pd.concat(parts, ignore_index=True)


def check_lines(bench: CharacterisedBench) -> pd.DataFrame:
    """List the check runs over speed: K and F, measured and by the surface, with 95 % intervals.

    The interval of a line is the relative one of the nearest line of the error budget; that of |K|
    for the real part, that of Im K for the imaginary one.
    """
    order = bench.result.campaign.order
    parts = []
    for name, surface in bench.surfaces.items():
        every = bench.result.directions[name].measured
        lines = every.select(bench.in_check_runs(every))
        if not len(lines):
            continue
        modelled, inside = _modelled(bench, surface, lines)
        widths = _relative_widths(bench, name, lines)
        columns: dict[str, RealArray] = {
            "engine speed [rpm]": np.asarray(rpm_of_frequency(lines.frequency, order))
        }
        half_real, half_imag = widths[0] * np.abs(modelled.real), widths[1] * np.abs(modelled.imag)
        # a force is turned against its stiffness by the phase of the motion
        along, across = np.abs(lines.displacement.real), np.abs(lines.displacement.imag)
        force_halves = (
            np.hypot(half_real * along, half_imag * across),
            np.hypot(half_real * across, half_imag * along),
        )
        predicted = modelled * lines.displacement
        for letter, scale, unit, seen, model, halves in (
            ("K", N_PER_MM, "N/mm", lines.stiffness, modelled, (half_real, half_imag)),
            ("F", 1.0, "N", lines.force, predicted, force_halves),
        ):
            for part, of, half in zip(("Re", "Im"), (np.real, np.imag), halves, strict=True):
                columns |= {
                    f"{part} {letter} [{unit}]": of(seen) * scale,
                    f"{part} {letter}, surface [{unit}]": of(model) * scale,
                    f"half width of {part} {letter} [{unit}]": half * scale,
                }
        part_table = pd.DataFrame({label: significant(values) for label, values in columns.items()})
        part_table.insert(0, "direction", name)
        part_table.insert(1, "run", lines.run)
        part_table["inside the region"] = np.where(inside, "yes", "no")
        part_table["near the floor"] = np.where(lines.near_floor, "yes", "no")
        parts.append(part_table)
    return pd.concat(parts, ignore_index=True)


def append_maps(report: Report, bench: CharacterisedBench) -> None:
    """Show K over torque, displacement and frequency, and where the pieces of surfaces meet."""
    report.section(
        "Maps of the dynamic stiffness",
        "What was measured, over preload, displacement amplitude and frequency (thesis, figures 19 "
        "to 25), with the outline of what runs came near to, within a tenth of the ranges: outside "
        "of it no surface is to be used. Dashed: where the pieces of a surface meet, of its real "
        "part in |K| and Re K, of its imaginary part in phase and Im K. As in the thesis, small "
        "amplitudes are at the top; their scale is logarithmic.",
        folded=True,
    )
    report.table("stiffness_lines", stiffness_lines(bench))
    usable = usable_maps(bench)
    by_mount: dict[str, list[str]] = {}
    for name in bench.surfaces:
        by_mount.setdefault(name.rpartition(" ")[0], []).append(name)
    for mount, names in by_mount.items():
        figures = THESIS_FIGURES.get(mount, NO_FIGURES)
        directions = [usable[name] for name in names]
        report.figure(
            f"stiffness_map_{mount}",
            partial(_mount_map, bench, directions, _QUANTITIES, DISPLACEMENT),
            f"{mount}: magnitude, phase, real and imaginary part of K over preload and "
            f"displacement{figures[0]}.{_thinned(directions)}",
        )
        report.figure(
            f"frequency_map_{mount}",
            partial(_mount_map, bench, directions, _QUANTITIES[2:], FREQUENCY),
            f"{mount}: real and imaginary part of K over preload and frequency{figures[1]}."
            f"{_thinned(directions)}",
        )
    main = max(bench.surfaces, key=lambda name: float(np.median(np.abs(usable[name].force))))
    report.figure(
        "stiffness_dependence",
        partial(_dependence, bench, usable[main]),
        f"{main}, the most loaded direction: magnitude above, phase below, over each pair of the "
        f"three variables (thesis, figures 20 and 22).{_thinned([usable[main]])}",
    )
    report.text(
        "K over the static force has several inflection points, which one cubic cannot follow "
        "(thesis, figure 26): two cubics share 2 % of the range and are blended there. The thesis "
        "puts the split where the error first exceeds 3 %; that point depends on noise and on the "
        "end from which one looks. Here every split is tried and the one that leaves least squares "
        "is taken, for real and imaginary part apart: a common one moved K by up to 73 % in a "
        "direction that is hardly loaded. A cubic has one inflection point, so that two have up to "
        "three, one of them where they meet. Points are coloured by displacement, which explains "
        "their scatter."
    )
    shown = [
        operating_map
        for name, operating_map in usable.items()
        if name in bench.surfaces and _has_force(operating_map)
    ]
    if shown:
        report.figure(
            "splits",
            partial(_splits, bench, shown),
            "Re K over the static force of all directions, coloured by displacement; dashed: where "
            "the two pieces of the surface meet; red: its inflection points at the median "
            f"displacement and frequency (thesis, figure 26).{_thinned(shown)}",
        )


def append_runs(report: Report, bench: CharacterisedBench, numbers: pd.DataFrame) -> None:
    """Show stiffness and force over speed in the check runs, measured and by the surfaces."""
    cases = ", ".join(run.name for run in bench.check_runs)
    report.section(
        "Load cases over speed",
        f"Stiffness and force in the runs {cases} (thesis, figures 27 to 32): dots are measured, "
        f"lines the response surface with its 95 % interval. Where an interval is {SPIKE:g} times "
        f"as wide as {100 * SHOWN_SHARE:.0f} % of them, as where a direction hardly moves, those "
        "beyond are cut, and the widest is named above the panel.",
        folded=True,
    )
    table = check_lines(bench)
    report.table("check_runs", table)
    report.text(_why_r2(bench, numbers))
    for mount in dict.fromkeys(name.rpartition(" ")[0] for name in bench.surfaces):
        figures = THESIS_FIGURES.get(mount, NO_FIGURES)
        for letter, unit, word, figure in (
            ("K", "N/mm", "stiffness", figures[2]),
            ("F", "N", "force", figures[3]),
        ):
            report.figure(
                f"{word}_over_speed_{mount}",
                partial(_over_speed, bench, table, numbers, mount, letter, unit),
                f"{mount}: {word} over speed, real part left, imaginary part right; R² of the "
                f"surface against all its lines above each panel, and the thesis's{figure}.",
            )


def append_sensors(report: Report, bench: CharacterisedBench) -> None:
    """Show what sensors measured beside what the motion of the rigid body gives for them."""
    chain = next((c for c in bench.result.chains if c.alignment.body.is_rigid_body), None)
    if chain is None:
        return
    run = shown_run(bench)
    table = rebuilt_accelerations(chain.alignment.body, run)
    report.table("rebuilt_accelerations", table)
    report.figure(
        "rebuilt_accelerations",
        partial(_rebuilt, table),
        f"Acceleration of one sensor at each mount in run {run.name}, along the sensor's axes: "
        "measured, and dashed rebuilt from the rigid motion of all sensors together (thesis, "
        "figure 14).",
    )
    beside = motions_beside(chain, run)
    columns = _speed(run)
    for mount, (in_mount, near) in beside.items():
        columns[f"{mount}, virtual point [m/s^2]"] = in_mount
        columns |= {f"{mount}, sensor {name} [m/s^2]": moved for name, moved in near.items()}
    report.table(
        "motions_beside",
        pd.DataFrame({label: significant(values) for label, values in columns.items()}),
    )
    report.figure(
        "motions_beside",
        partial(_beside, columns["engine speed [rpm]"], beside),
        f"Acceleration along x in run {run.name}: in each mount, by the virtual point, and dashed "
        "of the sensors beside it (thesis, figure 16). A stiffness from a sensor beside the mount "
        "errs by what the two differ: on a body that pitches, one above the mount moves more than "
        "the mount, one below it less, or the reverse.",
    )
    apart = []
    for mount, (in_mount, near) in beside.items():
        for name, moved in near.items():
            sensor = name.replace(" ", "_")
            apart.append(float(np.max(np.abs(in_mount - moved))))
            report.number(
                f"beside_error_percent_{mount}_x_{sensor}",
                float(100 * np.median(in_mount / moved - 1)),
                "%",
                "error of |K| along x from a sensor beside the mount, median of a run's lines",
            )
    report.number(
        "beside_difference_m_per_s2",
        max(apart, default=None),
        "m/s^2",
        "largest difference of the accelerations in a mount and beside it, along x",
    )


def rebuilt_accelerations(body: InstrumentedBody, run: OperatingRun) -> pd.DataFrame:
    """List one sensor per mount over the lines of a run: measured and by the rigid motion."""
    assert body.virtual_point is not None
    measured = run.acceleration.select(body.channels)
    rebuilt = body.virtual_point.reproject(measured.values)
    columns = _speed(run)
    for mount in dict.fromkeys(point.mount for point in body.points):
        channels = (s.channels for s in _sensors_beside(body, mount))
        for channel in next(channels, ()):
            place = measured.channels.index(channel)
            for part, of in (("Re", np.real), ("Im", np.imag)):
                label = f"{part} {mount}, {channel}"
                columns[f"{label} [m/s^2]"] = of(measured.values[:, place])
                columns[f"{label}, rebuilt [m/s^2]"] = of(rebuilt[:, place])
    return pd.DataFrame({label: significant(values) for label, values in columns.items()})


def motions_beside(
    chain: AlignmentEstimate, run: OperatingRun
) -> dict[str, tuple[RealArray, dict[str, RealArray]]]:
    """Return amplitudes of the motion along x in each mount, and of the sensors beside it [m/s^2].

    Each (f,), by the name of the mount; sensors by theirs. Of pieces of a mount the first.
    """
    body = chain.alignment.body
    measured = run.acceleration.select(body.channels).values
    motion = measured @ chain.alignment.motion_matrix(chain.mean).T
    motions: dict[str, tuple[RealArray, dict[str, RealArray]]] = {}
    for place, point in enumerate(body.points):
        near = {}
        for sensor in _sensors_beside(body, point.mount):
            moved = sensor.orientation @ run.acceleration.select(sensor.channels).values.T
            along = (point.along_mount(part)[0] for part in (moved.real, moved.imag))
            near[sensor.name] = np.hypot(*along)
        motions.setdefault(point.mount, (np.abs(motion[:, 3 * place]), near))
    return motions


def _speed(run: OperatingRun) -> dict[str, RealArray]:
    return {"engine speed [rpm]": np.asarray(rpm_of_frequency(run.frequency, run.order))}


def _sensors_beside(body: InstrumentedBody, mount: str) -> list[Sensor]:
    """Return the sensors at a mount of which all channels are in use."""
    used = set(body.channels)
    return [s for s in body.accelerometers if s.mount == mount and used.issuperset(s.channels)]


def transfer_panels(matrices: Sequence[ForceTransferMatrix]) -> plot.Figure:
    """Draw the force transfer over frequency, a panel per mount (thesis, figure 18)."""
    panels = []
    for transfer in matrices:
        size = np.abs(transfer.response)
        curves = {f"{axis} per {axis}": size[:, k, k] for k, axis in enumerate(AXES)}
        across = size.copy()
        across[:, range(3), range(3)] = 0.0
        curves["largest across axes"] = across.max(axis=(1, 2))
        title = " ".join(filter(None, (transfer.mount, transfer.piece)))
        panels.append(CurvePanel(title, transfer.frequency, curves))
    return plot.curve_panels(
        panels, y_label="force of the cells per force [1]", columns=min(3, len(panels))
    )


def _modelled(
    bench: CharacterisedBench, surface: DynamicStiffnessSurface | None, lines: OperatingMap
) -> tuple[ComplexArray, BoolArray]:
    """Stiffness of a surface at all lines, and which of them lie inside of its region."""
    if surface is None:
        return np.full(len(lines), np.nan + 0j), np.zeros(len(lines), dtype=bool)
    inside = surface.supported(lines.points(bench.result.options.preload))
    return bench.modelled(surface, lines), inside


def _relative_widths(
    bench: CharacterisedBench, name: str, lines: OperatingMap
) -> tuple[RealArray, RealArray]:
    """Half widths of |K| and of Im K at lines, relative, of the nearest line of the budget [1]."""
    budget = bench.result.directions[name].budget
    assert budget is not None
    scale = np.ptp(budget.points, axis=0)
    scale[scale == 0] = 1.0
    points = lines.points(bench.result.options.preload)
    rows = cKDTree(budget.points / scale).query(points / scale)[1]
    return (budget.upper - budget.lower)[rows] / 2, budget.imag_half_width[rows]


def _step(measured: OperatingMap) -> int:
    """Return the distance of the lines of a direction that are drawn: 1 is all of them."""
    return math.ceil(len(measured) / SHOWN_POINTS)


def _few(measured: OperatingMap) -> OperatingMap:
    return measured.select(slice(None, None, _step(measured)))


def _thinned(directions: Sequence[OperatingMap]) -> str:
    """Say how many lines are drawn, where they are not all."""
    drawn = sum(math.ceil(len(direction) / _step(direction)) for direction in directions)
    lines = sum(len(direction) for direction in directions)
    if drawn == lines:
        return ""
    return f" {drawn} of {lines} lines are drawn, evenly; stiffness_lines.csv has all."


def _has_force(measured: OperatingMap) -> bool:
    return bool(np.isfinite(measured.static_force).all())


def outline(
    x: RealArray, y: RealArray, *, amplitude: bool
) -> tuple[RealArray, RealArray, RealArray]:
    """Return a grid and a height that is above 0 where runs came near, as seen on a map.

    A convex hull would enclose states that no run came near, where a surface is not to be used.
    """
    region = TrainingRegion.around(np.column_stack([x, y]))
    span = np.where(region.upper > region.lower, region.upper - region.lower, 1.0)
    lower, upper = region.lower - 2 * MARGIN * span, region.upper + 2 * MARGIN * span
    across = np.linspace(lower[0], upper[0], GRID)
    up = np.linspace(lower[1], upper[1], GRID)
    if amplitude:
        up = np.geomspace(max(lower[1], region.lower[1] / 2), upper[1], GRID)
    grid = np.stack(np.meshgrid(across, up), axis=-1).reshape(-1, 2)
    fractions = (grid - region.lower) / span
    beyond = MARGIN + np.minimum(fractions, 1 - fractions).min(axis=1)
    height = np.minimum(beyond, region.reach - region.distance(grid))
    return across, up, height.reshape(GRID, GRID)


def inflections(surface: DynamicStiffnessSurface, points: RealArray) -> list[tuple[float, float]]:
    """Return preload and Re K [N/m] where the curvature of a surface changes its sign.

    - `points` (n, 3): of the lines that it was fitted to. The preload runs over their range, at
      their median amplitude and frequency, where the surface may be used.

    Where two pieces blend, the bends are those of the blending: a change across counts once.
    """
    if np.ptp(points[:, 0]) == 0:
        return []
    path = np.tile(np.median(points, axis=0), (FINE, 1))
    path[:, 0] = preload = np.linspace(points[:, 0].min(), points[:, 0].max(), FINE)
    stiffness = surface.predict(path, extrapolate=True).real
    bend = np.gradient(np.gradient(stiffness, preload), preload)
    clear = surface.supported(path)
    for split in surface.real_.split_points_:
        clear &= np.abs(preload - split) > surface.real_.blend_width_
    kept = np.flatnonzero(clear)
    changes = np.flatnonzero(np.diff(bend[kept] > 0))
    middle = (kept[changes] + kept[changes + 1]) // 2
    return [(float(preload[k]), float(stiffness[k])) for k in middle]


def _variables(bench: CharacterisedBench, lines: OperatingMap) -> dict[str, tuple[RealArray, str]]:
    """Return values and label of the three variables of a stiffness."""
    return {
        PRELOAD: _preload(bench, lines),
        DISPLACEMENT: (lines.amplitude * MM, "displacement [mm]"),
        FREQUENCY: (lines.frequency, "frequency [Hz]"),
    }


def _preload(bench: CharacterisedBench, measured: OperatingMap) -> tuple[RealArray, str]:
    variable = bench.result.options.preload
    name = "wheel torque" if variable is Preload.WHEEL_TORQUE else "static force"
    return measured.preload(variable), f"{name} [{variable.unit}]"


def _static_force(
    bench: CharacterisedBench, measured: OperatingMap, preloads: Sequence[float]
) -> list[float]:
    """Return the static force [N] that goes with preloads: the median of the nearest 2 %."""
    preload = _preload(bench, measured)[0]
    count = max(1, len(measured) // 50)
    nearest = (np.argsort(np.abs(preload - at), kind="stable")[:count] for at in preloads)
    return [float(np.median(measured.static_force[lines])) for lines in nearest]


def _split_points(bench: CharacterisedBench, measured: OperatingMap, part: str) -> list[float]:
    surface = bench.surfaces[measured.name]
    return [float(point) for point in getattr(surface, f"{part}_").split_points_]


Quantity: TypeAlias = tuple[str, str, str, Callable[[ComplexArray], RealArray]]
"""Name and unit, the part of the surface whose splits are drawn, and what it is of K [N/m]."""

_QUANTITIES: tuple[Quantity, ...] = (
    ("|K|", "N/mm", "real", lambda k: np.abs(k) * N_PER_MM),
    ("phase of K", "deg", "imag", lambda k: np.degrees(np.angle(k))),
    ("Re K", "N/mm", "real", lambda k: k.real * N_PER_MM),
    ("Im K", "N/mm", "imag", lambda k: k.imag * N_PER_MM),
)


def _maps(
    bench: CharacterisedBench,
    every: OperatingMap,
    quantities: Sequence[Quantity],
    pairs: Sequence[tuple[str, str]],
) -> list[PointMap]:
    """Map quantities of a direction over pairs of its variables."""
    few = _few(every)
    shown, full = _variables(bench, few), _variables(bench, every)
    outlines = {
        (x, y): outline(full[x][0], full[y][0], amplitude=y == DISPLACEMENT) for x, y in pairs
    }
    return [
        PointMap(
            title=f"{quantity}, {every.name}",
            x=shown[x][0],
            y=shown[y][0],
            value=of(few.stiffness),
            x_label=shown[x][1],
            y_label=shown[y][1],
            value_label=f"[{unit}]",
            splits=_split_points(bench, every, part) if x == PRELOAD else [],
            outline=outlines[x, y],
            amplitude=y == DISPLACEMENT,
        )
        for quantity, unit, part, of in quantities
        for x, y in pairs
    ]


def _mount_map(
    bench: CharacterisedBench,
    directions: Sequence[OperatingMap],
    quantities: Sequence[Quantity],
    over: str,
) -> plot.Figure:
    """Draw quantities over preload and another variable, a column per direction."""
    columns = [_maps(bench, every, quantities, [(PRELOAD, over)]) for every in directions]
    maps = [panel for row in zip(*columns, strict=True) for panel in row]
    return plot.point_maps(maps, columns=len(columns) if len(columns) > 1 else 2)


def _dependence(bench: CharacterisedBench, every: OperatingMap) -> plot.Figure:
    """Magnitude and phase of one direction over each pair of variables."""
    pairs = [(PRELOAD, DISPLACEMENT), (PRELOAD, FREQUENCY), (FREQUENCY, DISPLACEMENT)]
    return plot.point_maps(_maps(bench, every, _QUANTITIES[:2], pairs), columns=3)


def _splits(bench: CharacterisedBench, directions: Sequence[OperatingMap]) -> plot.Figure:
    """Re K over the static force; a split over the torque stands at the force it goes with."""
    maps = []
    for every in directions:
        few = _few(every)
        points = every.points(bench.result.options.preload)
        bends = inflections(bench.surfaces[every.name], points)
        forces = _static_force(bench, every, [preload for preload, _ in bends])
        maps.append(
            PointMap(
                title=every.name,
                x=few.static_force,
                y=few.stiffness.real * N_PER_MM,
                value=few.amplitude * MM,
                x_label="static force [N]",
                y_label="Re K [N/mm]",
                value_label="displacement [mm]",
                splits=_static_force(bench, every, _split_points(bench, every, "real")),
                marks=[(f, k * N_PER_MM) for f, (_, k) in zip(forces, bends, strict=True)],
            )
        )
    return plot.point_maps(maps, columns=3)


def _over_speed(
    bench: CharacterisedBench,
    table: pd.DataFrame,
    numbers: pd.DataFrame,
    mount: str,
    letter: str,
    unit: str,
) -> plot.Figure:
    """Real part left, imaginary part right, a row per direction; of pieces the first."""
    colours = dict(zip((run.name for run in bench.check_runs), VEHICLE_PALETTE * 3, strict=False))
    panels = []
    for name in (
        direction for direction in bench.surfaces if direction.rpartition(" ")[0] == mount
    ):
        of_direction = table[table["direction"] == name]
        for part, column in (("Re", "real"), ("Im", "imag")):
            curves, points, ranges = {}, {}, {}
            abscissa: RealArray | None = None
            for label, lines in of_direction.groupby("run", sort=False):
                run = str(label).partition(" ")[0]
                speed = lines["engine speed [rpm]"].to_numpy()
                if run in curves or (abscissa is not None and not np.array_equal(abscissa, speed)):
                    continue  # another piece, or another raster: the table has it
                abscissa = speed
                model = lines[f"{part} {letter}, surface [{unit}]"].to_numpy()
                half = lines[f"half width of {part} {letter} [{unit}]"].to_numpy()
                curves[run], ranges[run] = model, (model - half, model + half)
                dots = lines[lines["near the floor"] == "no"]
                dots = dots.iloc[:: max(1, len(dots) // DOTS)]
                if len(dots):
                    measured = dots[f"{part} {letter} [{unit}]"].to_numpy()
                    points[run] = (dots["engine speed [rpm]"].to_numpy(), measured)
            if abscissa is None:
                continue
            r2 = _r2_note(numbers, name, letter, column)
            shown, spike = without_spikes(abscissa, curves, _narrow(ranges, points))
            panels.append(
                CurvePanel(
                    f"{part} {letter}, {name}",
                    abscissa,
                    curves,
                    points,
                    shown,
                    note="; ".join(filter(None, (r2, spike))),
                )
            )
    return plot.curve_panels(
        panels,
        x_label="engine speed [rpm]",
        y_label=f"{letter} [{unit}]",
        columns=2,
        colours=colours,
    )


def _narrow(
    ranges: dict[str, tuple[RealArray, RealArray]], points: dict[str, tuple[RealArray, RealArray]]
) -> dict[str, tuple[RealArray, RealArray]]:
    """Intervals, unless they are so wide that nothing else would be seen on their scale."""
    if not points:
        return ranges
    seen = np.concatenate([values for _, values in points.values()])
    widest = max(float(np.median(high - low)) for low, high in ranges.values())
    return ranges if widest < 3 * max(float(np.ptp(seen)), 1e-300) else {}


def without_spikes(
    speed: RealArray,
    curves: Mapping[str, RealArray],
    ranges: Mapping[str, tuple[RealArray, RealArray]],
) -> tuple[dict[str, tuple[RealArray, RealArray]], str]:
    """Cut intervals of single lines that would hide all others, and name the widest."""
    if not ranges:
        return {}, ""
    halves = {run: (high - low) / 2 for run, (low, high) in ranges.items()}
    most = float(np.quantile(np.concatenate([*halves.values()]), SHOWN_SHARE))
    widest = max(halves, key=lambda run: float(halves[run].max()))
    size, at = float(halves[widest].max()), speed[int(halves[widest].argmax())]
    if size <= SPIKE * most:
        return dict(ranges), ""
    cut = {run: np.minimum(half, most) for run, half in halves.items()}
    shown = {run: (curves[run] - half, curves[run] + half) for run, half in cut.items()}
    return shown, f"band to ± {size:.0f} at {at:.0f} rpm"


def _r2_note(numbers: pd.DataFrame, name: str, letter: str, column: str) -> str:
    key = f"r2_{column}" if letter == "K" else f"r2_force_{column}"
    value = percent(numbers, key).get(name, np.nan)
    if not np.isfinite(value):
        return ""
    place = ("real", "imag").index(column) + (0 if letter == "K" else 2)
    thesis = THESIS_R2.get(name)
    beside = f", thesis {thesis[place]:.2f}" if thesis else ""
    return f"R² {value:.2f} %{beside}"


def _why_r2(bench: CharacterisedBench, numbers: pd.DataFrame) -> str:
    """Say for which directions R² of Im K falls short of the thesis, and what noise allows."""
    short = []
    usable = usable_maps(bench)
    reached = percent(numbers, "r2_imag")
    for name, thesis in THESIS_R2.items():
        value = reached.get(name, np.nan)
        if np.isfinite(value) and value < thesis[1] - 1.0:
            ceiling = 100 * max(0.0, noise_ceiling(usable[name])[1])
            short.append(f"{name} {value:.1f} (thesis {thesis[1]:.1f}, noise allows {ceiling:.1f})")
    if not short:
        return ""
    return (
        "R² of Im K falls short of the thesis's tables 6 to 8 in " + "; ".join(short) + " [%]. R² "
        "compares with what was measured, noise included: a surface that is the truth itself "
        "would reach what noise allows, which is 1 − σ²/variance of Im K with the stated noise. "
        "Im K of these directions is small and hardly changes from line to line, so that noise is "
        "a good part of its variance, and a direction that hardly moves has errors besides that no "
        "surface follows. The interval beside the lines says how far to believe them."
    )


def _beside(
    speed: RealArray, beside: Mapping[str, tuple[RealArray, Mapping[str, RealArray]]]
) -> plot.Figure:
    names = [f"sensor {k}" for k in range(1, 1 + max(len(near) for _, near in beside.values()))]
    panels = [
        CurvePanel(
            mount,
            speed,
            {"virtual point": in_mount} | dict(zip(names, near.values(), strict=False)),
            note=", ".join(near),
        )
        for mount, (in_mount, near) in beside.items()
    ]
    return plot.curve_panels(
        panels,
        x_label="engine speed [rpm]",
        y_label="|a| along x [m/s²]",
        columns=min(3, len(panels)),
        dashed=names,
    )


def _rebuilt(table: pd.DataFrame) -> plot.Figure:
    speed = table["engine speed [rpm]"].to_numpy()
    labels = [str(label) for label in table.columns[1:] if ", rebuilt" not in str(label)]
    mounts = list(dict.fromkeys(label.split(" ", 1)[1].split(",")[0] for label in labels))
    colours = dict(zip(mounts, VEHICLE_PALETTE, strict=False))
    colours |= {f"{mount} rebuilt": "#1A1A1A" for mount in mounts}
    panels = []
    for part in ("Re", "Im"):
        for axis in AXES:
            curves = {}
            for label in labels:
                if label.startswith(f"{part} ") and label.endswith(f" {axis} [m/s^2]"):
                    mount = label.split(" ", 1)[1].split(",")[0]
                    curves[mount] = table[label].to_numpy()
                    rebuilt = label.replace(" [m/s^2]", ", rebuilt [m/s^2]")
                    curves[f"{mount} rebuilt"] = table[rebuilt].to_numpy()
            panels.append(CurvePanel(f"{part} a, axis {axis}", speed, curves))
    return plot.curve_panels(
        panels,
        x_label="engine speed [rpm]",
        y_label="acceleration [m/s²]",
        columns=3,
        dashed=[f"{mount} rebuilt" for mount in mounts],
        colours=colours,
    )
