"""Pictures: functions of plain arrays that draw in one style. The only package with matplotlib.

A picture of one panel takes ``ax`` and returns its Axes, a grid its Figure; `mode_shapes` returns
PNG bytes. `deboom.report` makes files of all and closes them. matplotlib is imported inside the
functions, so that studies start fast; no global setting survives. Same arguments, same bytes.
May import no other package.
"""

from typing import TYPE_CHECKING

from deboom.plot.bars import Intervals, box_intervals, stiffness_bars
from deboom.plot.correlations import (
    clustered_matrix,
    objective_grid,
    scatter_matrix,
    variable_grid,
)
from deboom.plot.curves import CurvePanel, curve_panels, spl_curves
from deboom.plot.distributions import grouped_pairs, joint_scatter, strips
from deboom.plot.fronts import fronts, parallel_coordinates, pareto_front
from deboom.plot.intervals import IntervalPanel, interval_panels
from deboom.plot.levels import LineMap, line_maps, vector_sum
from deboom.plot.maps import PointMap, places, point_maps
from deboom.plot.matrices import HeatMap, curve_matrix, heat_maps
from deboom.plot.modal import BodyMotion, mode_shapes, stabilisation_chart
from deboom.plot.sketches import axes_sketch

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = [
    "BodyMotion",
    "CurvePanel",
    "Figure",
    "HeatMap",
    "IntervalPanel",
    "Intervals",
    "LineMap",
    "PointMap",
    "axes_sketch",
    "box_intervals",
    "clustered_matrix",
    "curve_matrix",
    "curve_panels",
    "fronts",
    "grouped_pairs",
    "heat_maps",
    "interval_panels",
    "joint_scatter",
    "line_maps",
    "mode_shapes",
    "objective_grid",
    "parallel_coordinates",
    "pareto_front",
    "places",
    "point_maps",
    "scatter_matrix",
    "spl_curves",
    "stabilisation_chart",
    "stiffness_bars",
    "strips",
    "variable_grid",
    "vector_sum",
]
