"""Pictures: functions of plain arrays that draw in one style. The only door to matplotlib.

A picture of one panel takes ``ax`` and returns its Axes; a grid returns its Figure. `deboom.report`
makes files of both and closes them. matplotlib is imported inside the functions, so that importing
a study stays fast, and no global setting survives a call. The same arguments give the same bytes.
"""

from typing import TYPE_CHECKING

from deboom.plot.bars import (
    MarkedPanel,
    marked_bars,
    ratio_bars,
    stiffness_bars,
)
from deboom.plot.boxes import Intervals, box_intervals, box_trade_off, levels_in_box
from deboom.plot.correlations import (
    CorrelationPanel,
    clustered_matrix,
    correlation_matrices,
    scatter_matrix,
    variable_grid,
)
from deboom.plot.curves import CurvePanel, MapPanel, curve_panels, map_panels, spl_curves
from deboom.plot.fronts import (
    AttainedFront,
    attained_fronts,
    convergence,
    design_ranges,
    fronts,
    noise_bars,
    parallel_coordinates,
    pareto_front,
    part_choices,
)
from deboom.plot.intervals import (
    DotPanel,
    IntervalPanel,
    dot_panels,
    front_intervals,
    interval_panels,
)
from deboom.plot.levels import level_maps, vector_sum
from deboom.plot.matrices import HeatMap, curve_matrix, heat_maps
from deboom.plot.modal import (
    BodyMotion,
    mode_shapes,
    moving_mode_shapes,
    stabilisation_chart,
)
from deboom.plot.parts import (
    STIFFNESS_WORDS,
    PartsRow,
    StiffnessPanel,
    parts_in_intervals,
    shared_parts,
    stiffness_over_preload,
)
from deboom.plot.sensitivity import (
    IndexBars,
    IndexMap,
    index_bars,
    index_map,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = [
    "STIFFNESS_WORDS",
    "AttainedFront",
    "BodyMotion",
    "CorrelationPanel",
    "CurvePanel",
    "DotPanel",
    "Figure",
    "HeatMap",
    "IndexBars",
    "IndexMap",
    "IntervalPanel",
    "Intervals",
    "MapPanel",
    "MarkedPanel",
    "PartsRow",
    "StiffnessPanel",
    "attained_fronts",
    "box_intervals",
    "box_trade_off",
    "clustered_matrix",
    "convergence",
    "correlation_matrices",
    "curve_matrix",
    "curve_panels",
    "design_ranges",
    "dot_panels",
    "front_intervals",
    "fronts",
    "heat_maps",
    "index_bars",
    "index_map",
    "interval_panels",
    "level_maps",
    "levels_in_box",
    "map_panels",
    "marked_bars",
    "mode_shapes",
    "moving_mode_shapes",
    "noise_bars",
    "parallel_coordinates",
    "pareto_front",
    "part_choices",
    "parts_in_intervals",
    "ratio_bars",
    "scatter_matrix",
    "shared_parts",
    "spl_curves",
    "stabilisation_chart",
    "stiffness_bars",
    "stiffness_over_preload",
    "variable_grid",
    "vector_sum",
]
