"""Figures of a second engine: its forces, and the stiffness both engines found over the preload."""

from __future__ import annotations

import numpy as np

from deboom.mounts.characterised_direction import MapPoints
from deboom.mounts.mount_state import MountState, state_at
from deboom.mounts.operating_map import OperatingMap
from deboom.physics.orders import rpm_of_frequency
from deboom.report.figures import CurvePanel, curve_panels
from deboom.study.second_engine import SecondEngine

N_PER_MM = 1e-3
"""From N/m to N/mm."""
DOT_SPACING = 6
"""Lines between the dots of a prediction, so that what was measured shows between them."""
SHOWN_POINTS = 1500
"""Of a panel; more hide each other."""


def second_engine_figures(engine: SecondEngine) -> dict[str, bytes]:
    """Draw all pictures of one bench; file stem → PNG."""
    figures = {}
    for mount in engine.mounts:
        names = [name for name in engine.directions if engine.mount_of(name) is mount]
        if names:
            stem = mount.mount.name.replace(" ", "_")
            figures[f"force_{stem}"] = _forces(engine, names)
    for axis in dict.fromkeys(name.rpartition(" ")[2] for name in engine.directions):
        names = [name for name in engine.directions if name.endswith(f" {axis}")]
        figures[f"preload_{axis}"] = curve_panels(
            [_preload_panel(engine, name) for name in names],
            x_label="static force along the main axis [N]",
            y_label="|K| [N/mm]",
            columns=min(2, len(names)),
        )
    return figures


def _forces(engine: SecondEngine, names: list[str]) -> bytes:
    """Run with the highest torque in each gear: real parts, then imaginary parts."""
    panels = []
    for part, of in (("Re", np.real), ("Im", np.imag)):
        for name in names:
            prediction = engine.predictions[MountState.MAIN_FORCE][name]
            lines = prediction.lines
            shown = np.isin(lines.run, _shown_runs(engine, lines))
            rpm = rpm_of_frequency(lines.frequency, engine.campaign.order)
            dots = np.flatnonzero(shown & prediction.inside)[::DOT_SPACING]
            force = prediction.stiffness * lines.displacement
            points = {
                "measured": (rpm[shown], of(lines.force[shown])),
                "predicted": (rpm[dots], of(force[dots])),
            }
            some = {label: pair for label, pair in points.items() if pair[0].size}
            panels.append(CurvePanel(f"{part} F, {name}", rpm, {}, some))
    return curve_panels(panels, x_label="engine speed [rpm]", y_label="F [N]", columns=len(names))


def _shown_runs(engine: SecondEngine, lines: OperatingMap) -> list[str]:
    """Labels of the runs with the highest torque in each gear; of a mount's pieces the first."""
    labels = list(dict.fromkeys(str(label) for label in lines.run))
    piece = labels[0].partition(" ")[2] if labels else ""
    runs = {" ".join(filter(None, (run.name, piece))): run for run in engine.campaign.runs}
    best = {
        run.gear: label
        for label, run in sorted(
            runs.items(), key=lambda item: (item[1].full_load, item[1].torque_limit)
        )
        if label in labels
    }
    return list(best.values())


def _preload_panel(engine: SecondEngine, name: str) -> CurvePanel:
    """Measured stiffness of both engines over the static force along the mount's main axis."""
    mount = engine.mount_of(name)
    axis = name.rpartition(" ")[2]
    first: MapPoints = mount.direction(axis).map_points
    along = mount.direction(engine.main_direction(name).rpartition(" ")[2]).map_points
    used = np.flatnonzero(first.confidence > 0)
    used = used[:: max(1, used.size // SHOWN_POINTS)]
    lines = engine.maps[name]
    preload = state_at(engine.maps, mount, axis, MountState.MAIN_FORCE)
    shown = np.flatnonzero(~lines.near_floor)
    shown = shown[:: max(1, shown.size // SHOWN_POINTS)]
    points = {
        "first engine": (
            along.preload[used],
            np.abs(first.dynamic_stiffness[used]) * N_PER_MM,
        ),
        "second engine": (preload[shown], np.abs(lines.stiffness[shown]) * N_PER_MM),
    }
    return CurvePanel(name, along.preload[used], {}, points)
