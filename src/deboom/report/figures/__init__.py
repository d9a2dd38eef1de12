"""The only door to matplotlib: functions of plain arrays that return the bytes of a PNG.

matplotlib is imported inside the functions, so that importing a study stays fast; pyplot is never
used and no global setting survives a call. The same arguments give the same bytes.
"""

from deboom.report.figures.boxes import Intervals, box_intervals, box_trade_off, levels_in_box
from deboom.report.figures.changes import per_vehicle_change
from deboom.report.figures.choices import fronts, part_choices
from deboom.report.figures.comparison import (
    AttainedFront,
    attained_fronts,
    design_ranges,
    noise_bars,
)
from deboom.report.figures.correlations import (
    CorrelationPanel,
    PopulationPanel,
    correlation_matrices,
    family_tree,
    populations,
)
from deboom.report.figures.deliveries import PartsRow, parts_in_intervals
from deboom.report.figures.dot_panels import DotPanel, dot_panels
from deboom.report.figures.front import pareto_front
from deboom.report.figures.intervals import IntervalPanel, front_intervals, interval_panels
from deboom.report.figures.levels import spl_curves
from deboom.report.figures.marked_bars import MarkedPanel, marked_bars
from deboom.report.figures.masked_panels import MaskedPanel, masked_panels
from deboom.report.figures.matrices import HeatMap, curve_matrix, heat_maps
from deboom.report.figures.modal import matrix_map, stabilisation_chart
from deboom.report.figures.mode_shapes import BodyMotion, mode_shapes, moving_mode_shapes
from deboom.report.figures.panels import CurvePanel, MapPanel, curve_panels, map_panels
from deboom.report.figures.progress import convergence
from deboom.report.figures.ratios import ratio_bars
from deboom.report.figures.scatter_matrix import scatter_matrix
from deboom.report.figures.sensitivity import IndexBars, IndexMap, index_bars, index_map
from deboom.report.figures.sensitivity_growth import IndexGrowth, index_growth
from deboom.report.figures.sharing import shared_parts
from deboom.report.figures.spectra import SpectrumPanel, spectra_panels
from deboom.report.figures.speed_panels import SpeedPanel, speed_panels
from deboom.report.figures.stiffness import stiffness_bars
from deboom.report.figures.supplier import (
    StiffnessPanel,
    part_effects,
    stiffness_over_preload,
    tolerance_worth,
)

__all__ = [
    "AttainedFront",
    "BodyMotion",
    "CorrelationPanel",
    "CurvePanel",
    "DotPanel",
    "HeatMap",
    "IndexBars",
    "IndexGrowth",
    "IndexMap",
    "IntervalPanel",
    "Intervals",
    "MapPanel",
    "MarkedPanel",
    "MaskedPanel",
    "PartsRow",
    "PopulationPanel",
    "SpectrumPanel",
    "SpeedPanel",
    "StiffnessPanel",
    "attained_fronts",
    "box_intervals",
    "box_trade_off",
    "convergence",
    "correlation_matrices",
    "curve_matrix",
    "curve_panels",
    "design_ranges",
    "dot_panels",
    "family_tree",
    "front_intervals",
    "fronts",
    "heat_maps",
    "index_bars",
    "index_growth",
    "index_map",
    "interval_panels",
    "levels_in_box",
    "map_panels",
    "marked_bars",
    "masked_panels",
    "matrix_map",
    "mode_shapes",
    "moving_mode_shapes",
    "noise_bars",
    "pareto_front",
    "part_choices",
    "part_effects",
    "parts_in_intervals",
    "per_vehicle_change",
    "populations",
    "ratio_bars",
    "scatter_matrix",
    "shared_parts",
    "spectra_panels",
    "speed_panels",
    "spl_curves",
    "stabilisation_chart",
    "stiffness_bars",
    "stiffness_over_preload",
    "tolerance_worth",
]
