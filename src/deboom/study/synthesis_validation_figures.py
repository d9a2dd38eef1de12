"""Figures of a validated synthesis (thesis, figures 10, 36 to 38 and 40 to 42)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from deboom.arrays import RealArray
from deboom.physics.sound_level import spl
from deboom.report.figures import DotPanel, SpeedPanel, dot_panels, speed_panels
from deboom.report.style import INK, MUTED, VEHICLE_PALETTE, mount_colours, vehicle_colours
from deboom.study.synthesis_validation import Synthesis
from deboom.study.synthesis_validation_design import DesignMotion
from deboom.study.synthesis_validation_numbers import (
    BY_HAMMER,
    BY_SURFACES,
    ON_ROAD,
    PEAK,
    Validation,
)
from deboom.study.synthesis_validation_transfer import RoadAnalysis
from deboom.vehicles.booming_peaks import BoomingPeak
from deboom.vehicles.path_analysis import PathAnalysis, paths_by_axis
from deboom.vehicles.pressure_comparison import PressureComparison

DEPTH = 45.0
"""Of a level axis below the loudest line; deeper notches leave the panel [dB]."""

MEASURED, SYNTHESISED = "measured in the vehicle", "synthesised"
BENCH_FORCES, SURFACE_FORCES = "measured bench forces", "forces from response surfaces"
RECIPROCAL, HAMMER = "reciprocal functions", "hammer functions"
ALL_PATHS = "sum of all paths"
LEVEL = "SPL [dB(A)]"
WAYS = {way.value: VEHICLE_PALETTE[place] for place, way in enumerate(DesignMotion)}


def validation_figures(
    result: Validation, comparisons: pd.DataFrame, causes: pd.DataFrame
) -> dict[str, bytes]:
    """Draw all pictures; file stem → PNG."""
    figures = {
        "measured_synthesised": _pairs(result, "on_road", MEASURED, SYNTHESISED),
        "synthesis_error": _errors(result, comparisons),
        "surface_forces": _pairs(result, "by_surfaces", BENCH_FORCES, SURFACE_FORCES),
    }
    if result.design is not None:
        figures["virtual_design"] = _virtual_design(result)
        figures["virtual_design_deviation"] = _design_deviation(result)
    figures["hammer_reciprocal"] = _pairs(result, "by_hammer", RECIPROCAL, HAMMER)
    figures["contributions"] = _contributions(result)
    if len(causes):
        figures["causes"] = _causes(result, causes)
        figures["interface_forces"] = _interface_forces(result)
    if result.spread is not None:
        figures["vehicle_spread"] = _spread(result)
    return figures


def _pairs(result: Validation, what: str, reference: str, compared: str) -> bytes:
    """Every vehicle once: two curves with their paired peaks."""
    panels = []
    for one in result.shown:
        pair: PressureComparison = getattr(one, what)
        first, second = pair.levels
        peaks = pair.peaks
        several = bool(peaks.pairs)
        panels.append(
            SpeedPanel(
                one.driven.title,
                {reference: first, compared: second},
                f"peaks within {pair.peak_deviation:.2f} dB" if several else "no paired peak",
                {
                    reference: _points([peak for peak, _ in peaks.pairs]),
                    compared: _points([peak for _, peak in peaks.pairs]),
                },
            )
        )
    first_pair: PressureComparison = getattr(result.shown[0], what)
    return speed_panels(
        first_pair.frequency,
        first_pair.order,
        panels,
        y_label=LEVEL,
        colours={reference: INK, compared: VEHICLE_PALETTE[1]},
        dashed=(compared,),
        depth=DEPTH,
    )


def _points(peaks: list[BoomingPeak]) -> tuple[RealArray, RealArray]:
    return np.array([one.frequency for one in peaks]), np.array([one.level for one in peaks])


def _errors(result: Validation, comparisons: pd.DataFrame) -> bytes:
    """Every vehicle and mount set: shape, scale, peaks, for the road and for what leads to it."""
    wanted = {
        ON_ROAD: "against the road",
        BY_HAMMER: "hammer against reciprocal",
        BY_SURFACES: "surfaces against forces",
    }
    return _dots(
        {label: comparisons[comparisons["comparison"] == what] for what, label in wanted.items()},
        result,
        (("corr_f complex [%]", 5.0), ("corr_s magnitude [%]", 15.0), (PEAK, 3.0)),
        "asked of the road",
    )


def _causes(result: Validation, causes: pd.DataFrame) -> bytes:
    """Show what a synthesis loses where."""
    rows = {
        str(what).replace(", against", ",\nagainst"): causes[causes["what is compared"] == what]
        for what in dict.fromkeys(causes["what is compared"])
    }
    measures = (("corr_f complex [%]", None), ("corr_s magnitude [%]", None), (PEAK, None))
    return _dots(rows, result, measures, "")


def _dots(
    rows: Mapping[str, pd.DataFrame],
    result: Validation,
    measures: tuple[tuple[str, float | None], ...],
    limit_label: str,
) -> bytes:
    panels = []
    for column, limit in measures:
        values = {
            category: {
                str(vehicle): part[column].dropna().to_numpy()
                for vehicle, part in frame.groupby("vehicle", sort=False)
                if part[column].notna().any()
            }
            for category, frame in rows.items()
        }
        label = column.replace("largest peak deviation", "largest at peaks")
        panels.append(DotPanel(label, values, limit, limit_label if limit else ""))
    names = [one.vehicle.name for one in result.data.vehicles]
    return dot_panels(panels, vehicle_colours(names))


def _virtual_design(result: Validation) -> bytes:
    design = result.design
    assert design is not None
    measured = "measured forces of the design"
    colours = {measured: INK, **WAYS}
    panels = []
    names = [one.vehicle.name for one in result.data.vehicles]
    for name in names:
        ways = {way: design.comparisons[name, way] for way in DesignMotion}
        first = next(iter(ways.values()))
        worst = max(one.peak_deviation for one in ways.values())
        panels.append(
            SpeedPanel(
                name,
                {measured: first.levels[0]}
                | {way.value: one.levels[1] for way, one in ways.items()},
                f"peaks within {worst:.2f} dB" if np.isfinite(worst) else "no paired peak",
            )
        )
    some = design.comparisons[names[0], DesignMotion.RESOLVED]
    return speed_panels(
        some.frequency,
        some.order,
        panels,
        y_label=LEVEL,
        colours=colours,
        dashed=[way.value for way in DesignMotion],
        depth=DEPTH,
    )


def _design_deviation(result: Validation) -> bytes:
    """Levels of the three ways above those of the measured forces."""
    design = result.design
    assert design is not None
    panels = []
    for name in (one.vehicle.name for one in result.data.vehicles):
        ways = {way.value: design.comparisons[name, way] for way in DesignMotion}
        curves = {label: one.levels[1] - one.levels[0] for label, one in ways.items()}
        panels.append(SpeedPanel(name, curves))
    some = next(iter(design.comparisons.values()))
    return speed_panels(
        some.frequency,
        some.order,
        panels,
        y_label="deviation [dB]",
        colours=WAYS,
    )


def path_groups(paths: PathAnalysis) -> PathAnalysis:
    """Sum all paths across by axis and keep those along x apart, as the thesis's figure 42."""
    by_axis = paths_by_axis(paths.paths)
    groups = {name: [name] for name in by_axis.get("x", ())}
    groups |= {f"all {axis}": [*names] for axis, names in by_axis.items() if axis != "x"}
    return paths.grouped(groups)


def _contributions(result: Validation) -> bytes:
    """First vehicle: partial sums with reciprocal and with hammer functions."""
    one = result.shown[0]
    low, high = result.listening.band
    grouped = {RECIPROCAL: path_groups(one.reciprocal), HAMMER: path_groups(one.hammer)}
    names = grouped[RECIPROCAL].paths
    colours = mount_colours(names) | {ALL_PATHS: INK}
    panels = []
    inside = (one.reciprocal.frequency >= low) & (one.reciprocal.frequency <= high)
    for label, analysis in grouped.items():
        loudest = analysis.level[inside].max()
        curves = {ALL_PATHS: analysis.level[inside]} | {
            name: level
            for name, level in zip(names, analysis.path_levels[inside].T, strict=True)
            if level.max() > loudest - DEPTH
        }
        panels.append(SpeedPanel(f"{one.driven.title}, {label}", curves))
    order = one.on_road.order
    return speed_panels(
        one.reciprocal.frequency[inside],
        order,
        panels,
        y_label=LEVEL,
        colours=colours,
        columns=1,
        depth=DEPTH,
    )


def _interface_forces(result: Validation) -> bytes:
    """First analysed vehicle: strongest directions, bench, road and truth."""
    road: RoadAnalysis = result.roads[0]
    one: Synthesis = road.synthesis
    low, high = result.listening.band
    force = road.forces.force
    inside = (force.frequency >= low) & (force.frequency <= high)
    blocked = result.data.sets[one.driven.mount_set].load_case.force
    by_inversion, on_bench, exact = (
        "by inversion on the road",
        "on the bench",
        "true, in the vehicle",
    )
    channels = [name for name in force.channels if name.endswith(" x")]
    panels = []
    for name in channels:
        curves = {
            on_bench: np.abs(blocked.select([name]).values[inside, 0]),
            by_inversion: np.abs(force.select([name]).values[inside, 0]),
        }
        if one.driven.truth is not None:
            curves[exact] = np.abs(one.driven.truth.force.select([name]).values[inside, 0])
        panels.append(SpeedPanel(name, curves))
    return speed_panels(
        force.frequency[inside],
        one.on_road.order,
        panels,
        y_label="|F| [N]",
        colours={exact: INK, by_inversion: VEHICLE_PALETTE[1], on_bench: VEHICLE_PALETTE[0]},
        dashed=(by_inversion,),
    )


def _spread(result: Validation) -> bytes:
    """Measured levels of all vehicles with the first mount set."""
    first = result.syntheses[0].driven.mount_set
    several = [one for one in result.syntheses if one.driven.mount_set == first]
    lines = several[0].on_road.frequency
    names = [one.driven.vehicle.name for one in several]
    spread = result.spread
    assert spread is not None
    curves = {
        name: spl(one.on_road.reference, lines) for name, one in zip(names, several, strict=True)
    }
    mean = "mean of the levels"
    return speed_panels(
        lines,
        several[0].on_road.order,
        [
            SpeedPanel(
                f"measured in {len(names)} vehicles, mount set {first}",
                {**curves, mean: spread.mean},
                f"lowest to highest: median {spread.quantile(0.5):.1f} dB",
            )
        ],
        y_label=LEVEL,
        colours={**vehicle_colours(names), mean: MUTED},
        dashed=(mean,),
        depth=DEPTH,
    )
