"""Figures of a mount characterisation: maps, static curves, load cases, motions."""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.mounts.operating_map import OperatingMap, Preload
from deboom.physics.orders import rpm_of_frequency
from deboom.report.figures import CurvePanel, MapPanel, curve_panels, map_panels
from deboom.study.characterisation import CharacterisedBench
from deboom.study.characterisation_motion import neighbours, reprojections, shown_run

N_PER_MM = 1e-3
"""From N/m to N/mm."""
MICRO = 1e6
SHOWN_POINTS = 2000
"""Of a panel; more hide each other."""
SPEED = "engine speed [rpm]"
MEASURED = ", measured"


def characterisation_figures(bench: CharacterisedBench) -> dict[str, bytes]:
    """Draw all pictures of one bench; file stem → PNG."""
    maps = {name: _thinned(one) for name, one in usable_maps(bench).items()}
    figures = {
        "map_magnitude": _map(maps, lambda m: m.frequency, "frequency [Hz]", _magnitude),
        "map_phase": _map(maps, lambda m: m.frequency, "frequency [Hz]", _phase),
        "map_amplitude": _map(
            maps,
            lambda m: np.asarray(20 * np.log10(m.amplitude / m.amplitude.max())),
            "amplitude [dB]",
            _magnitude,
        ),
    }
    for axis in dict.fromkeys(one.axis for one in maps.values()):
        panels = _static_panels(bench, axis, maps)
        if panels:
            figures[f"static_{axis}"] = curve_panels(
                panels, x_label="static force [N]", y_label="K [N/mm]", columns=len(panels) // 2
            )
    for mount in dict.fromkeys(one.mount for one in maps.values()):
        names = [name for name in bench.surfaces if maps[name].mount == mount]
        if names:
            stem = mount.replace(" ", "_")
            figures[f"stiffness_{stem}"] = _load_cases(bench, names, of_force=False)
            figures[f"force_{stem}"] = _load_cases(bench, names, of_force=True)
    return figures | _motion_figures(bench)


def usable_maps(bench: CharacterisedBench) -> dict[str, OperatingMap]:
    """Return the maps of all directions that were ever loaded, without lines near the floor."""
    maps = {name: one.measured for name, one in bench.result.directions.items()}
    usable = {name: one.select(~one.near_floor) for name, one in maps.items()}
    return {name: one for name, one in usable.items() if len(one)}


def _thinned(measured: OperatingMap) -> OperatingMap:
    return measured.select(slice(None, None, max(1, len(measured) // SHOWN_POINTS)))


def _magnitude(measured: OperatingMap) -> tuple[RealArray, str]:
    return np.abs(measured.stiffness) * N_PER_MM, "|K| [N/mm]"


def _phase(measured: OperatingMap) -> tuple[RealArray, str]:
    return np.degrees(np.angle(measured.stiffness)), "phase of K [°]"


def _map(
    maps: dict[str, OperatingMap],
    height: Callable[[OperatingMap], RealArray],
    y_label: str,
    value: Callable[[OperatingMap], tuple[RealArray, str]],
) -> bytes:
    panels = [MapPanel(name, m.wheel_torque, height(m), value(m)[0]) for name, m in maps.items()]
    label = value(next(iter(maps.values())))[1]
    return map_panels(panels, x_label="wheel torque [N m]", y_label=y_label, value_label=label)


def _static_panels(
    bench: CharacterisedBench, axis: str, maps: dict[str, OperatingMap]
) -> list[CurvePanel]:
    """Real parts of all mounts, then imaginary parts, over the static force."""
    names = [
        name
        for name in bench.surfaces
        if maps[name].axis == axis and np.isfinite(maps[name].static_force).all()
    ]
    panels = []
    for part, of in (("Re", np.real), ("Im", np.imag)):
        for name in names:
            lines = maps[name]
            preload = lines.preload(Preload.STATIC_FORCE)
            modelled = bench.modelled(bench.surfaces[name], lines)
            points = {
                "measured": (preload, of(lines.stiffness) * N_PER_MM),
                "response surface": (preload, of(modelled) * N_PER_MM),
            }
            panels.append(CurvePanel(f"{part} K, {name}", preload, {}, points))
    return panels


def _load_cases(bench: CharacterisedBench, names: list[str], *, of_force: bool) -> bytes:
    """Check runs of one mount: real parts of its directions, then imaginary parts."""
    runs, order = bench.check_runs, bench.result.campaign.order
    common: RealArray = reduce(np.intersect1d, [run.frequency for run in runs])
    panels = []
    letter, unit = ("F", "N") if of_force else ("K", "N/mm")
    for part, of in (("Re", np.real), ("Im", np.imag)):
        for name in names:
            modelled: dict[str, RealArray] = {}
            measured: dict[str, RealArray] = {}
            for run in runs:
                lines = _lines_of(bench.result.directions[name].measured, run.name, common)
                surface = bench.modelled(bench.surfaces[name], lines)
                label = _case(run.gear, run.torque_limit)
                modelled[label] = of(_shown(surface, lines, of_force))
                measured[label + MEASURED] = of(_shown(lines.stiffness, lines, of_force))
            title = f"{part} {letter}, {name}"
            panels.append(CurvePanel(title, rpm_of_frequency(common, order), modelled | measured))
    return curve_panels(
        panels,
        x_label=SPEED,
        y_label=f"{letter} [{unit}]",
        columns=len(names),
        dashed=[_case(run.gear, run.torque_limit) + MEASURED for run in runs],
    )


def _case(gear: int, torque_limit: float) -> str:
    return f"gear {gear}, {torque_limit:g} N m"


def _lines_of(measured: OperatingMap, run: str, frequency: RealArray) -> OperatingMap:
    """Lines of one run; of a mount with several pieces those of the first."""
    labels = [str(label) for label in measured.run]
    own = next(label for label in labels if label.partition(" ")[0] == run)
    return measured.select((measured.run == own) & np.isin(measured.frequency, frequency))


def _shown(stiffness: ComplexArray, lines: OperatingMap, of_force: bool) -> ComplexArray:
    return stiffness * lines.displacement if of_force else stiffness * N_PER_MM


def _motion_figures(bench: CharacterisedBench) -> dict[str, bytes]:
    run = shown_run(bench)
    rpm = rpm_of_frequency(run.frequency, run.order)
    again, beside = reprojections(bench), neighbours(bench)
    if not again:
        return {}
    reprojected = [
        CurvePanel(
            f"{one.sensor.channels[row]}, {one.sensor.mount}",
            rpm,
            {
                f"{part}, {label}": of(values[:, row])
                for part, of in (("Re", np.real), ("Im", np.imag))
                for label, values in (("rigid body", one.reprojected), ("measured", one.measured))
            },
        )
        for one in again
        for row in range(3)
    ]
    motion = [
        CurvePanel(
            one.direction,
            rpm,
            {"virtual point": np.abs(one.at_point), "sensor beside": np.abs(one.at_sensor)},
        )
        for one in beside
    ]
    error = [
        CurvePanel(axis, rpm, {one.mount: 100 * one.error for one in beside if one.axis == axis})
        for axis in dict.fromkeys(one.axis for one in beside)
    ]
    return {
        "reprojected_acceleration": curve_panels(
            reprojected,
            x_label=SPEED,
            y_label="a [m/s²]",
            dashed=("Re, measured", "Im, measured"),
        ),
        "neighbour_acceleration": curve_panels(
            motion,
            x_label=SPEED,
            y_label="|a| [m/s²]",
            dashed=("sensor beside",),
        ),
        "neighbour_stiffness_error": curve_panels(error, x_label=SPEED, y_label="error of |K| [%]"),
    }
