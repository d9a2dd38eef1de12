"""Tolerances that nobody states: the default of each class of sensor, and its reason.

The only table of them; ``docs/guides/your-own-data.md`` shows it. No default is narrower than what
a careful laboratory states, so that the intervals of results grow.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

ACCELEROMETER = "triaxial ICP accelerometer"
FORCE_CELL = "triaxial force cell"
SHAKER = "shaker with force sensor"
HAMMER = "impact hammer"
CONTROL_UNIT = "torque of the control unit"


@dataclass(frozen=True)
class ClassDefault:
    """Standard deviation of a tolerance that nobody states.

    - `value`: 1 σ, in SI.
    - `sensor`: class of the sensor.
    - `reason`: where the value comes from. A limit ± c of a data sheet within which any value is as
      likely has the standard deviation c/√3.
    """

    value: float
    sensor: str
    reason: str


def _of_limit(half_width: float) -> float:
    return round(half_width / math.sqrt(3.0), 4)


CLASS_DEFAULTS: Mapping[str, ClassDefault] = {
    "sensor_position": ClassDefault(
        _of_limit(0.006), ACCELEROMETER, "within 6 mm by a tape measure, per axis"
    ),
    "sensor_angle": ClassDefault(
        math.radians(2.5), ACCELEROMETER, "turned by eye on a cast surface, by judgement"
    ),
    "sensor_gain": ClassDefault(
        _of_limit(0.06), ACCELEROMETER, "within 6 %: sensitivity of a certificate, years later"
    ),
    "sensor_cross_axis": ClassDefault(
        _of_limit(0.05), ACCELEROMETER, "within 5 %, transverse sensitivity of data sheets"
    ),
    "acceleration_own": ClassDefault(
        0.005, ACCELEROMETER, "twice what order tracking leaves, by judgement"
    ),
    "acceleration_norm": ClassDefault(
        0.0004, ACCELEROMETER, "twice what order tracking leaves, by judgement"
    ),
    "acceleration_floor": ClassDefault(
        0.01, ACCELEROMETER, "a range of 500 m/s² at 24 bits, by judgement"
    ),
    "cell_gain": ClassDefault(
        _of_limit(0.05), FORCE_CELL, "within 5 %: preload and what bears load beside the cell"
    ),
    "force_own": ClassDefault(0.005, FORCE_CELL, "twice what order tracking leaves, by judgement"),
    "force_norm": ClassDefault(
        0.0004, FORCE_CELL, "twice what order tracking leaves, by judgement"
    ),
    "force_floor": ClassDefault(0.02, FORCE_CELL, "a range of 10 kN at 24 bits, by judgement"),
    "static_force": ClassDefault(20.0, FORCE_CELL, "drift over one ramp, by judgement"),
    "shaker_angle": ClassDefault(math.radians(2.0), SHAKER, "stinger turned by eye, by judgement"),
    "shaker_gain": ClassDefault(_of_limit(0.05), SHAKER, "within 5 %, sensitivity of data sheets"),
    "torque": ClassDefault(10.0, CONTROL_UNIT, "5 % of 200 N m, as a control unit models it"),
    "hammer_gain": ClassDefault(
        _of_limit(0.05), HAMMER, "within 5 %: calibrated with another tip or mass"
    ),
    "impact_position": ClassDefault(
        _of_limit(0.006), HAMMER, "within 6 mm of the mark, by hand, per axis"
    ),
    "impact_angle": ClassDefault(
        math.radians(4.0), HAMMER, "within 7 degrees of the normal, by hand"
    ),
}
"""Name of a tolerance → its default."""
