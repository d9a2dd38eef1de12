"""
Virtual point of a published rig
================================

Three triaxial accelerometers around a virtual point (geometry published with pyFBS; thesis,
figure 15): how well they determine its six motions, and what is left when one of them is turned
round on the position sheet.

Data to download:
:download:`sensors_AB.csv <../../../tests/data/pyfbs-published/sensors_AB.csv>`,
:download:`virtual_point_1.csv <../../../tests/data/pyfbs-published/virtual_point_1.csv>`.
"""

from pathlib import Path

import numpy as np
import pandas as pd

import deboom
from deboom.measurement.sensors import Sensor, SensorKind

# the data in a clone, or downloaded beside this file
DATA = next(p for p in (Path("../../tests/data/pyfbs-published"), Path()) if p.exists())
PLACE = ["x_mm", "y_mm", "z_mm"]

sheet = pd.read_csv(DATA / "sensors_AB.csv", index_col="name").loc[["S3", "S4", "S5"], PLACE] / 1e3
centre = pd.read_csv(DATA / "virtual_point_1.csv")[PLACE].to_numpy()[0] / 1e3
sensors = [
    Sensor(name, SensorKind.ACCELEROMETER, "triaxial", "", "", row.to_numpy(), np.eye(3))
    for name, row in sheet.iterrows()
]
point = deboom.virtual_point(deboom.sensor_geometry(sensors, centre))

# %%
# The condition number depends on the unit of length unless rotations are scaled by a length.

print(f"as measured in metres {np.linalg.cond(point.forward):.0f}")
promise = point.conditioning
print(f"scaled by {promise.length * 1e3:.0f} mm {promise.condition_number:.2f}")

# %%
# A rigid motion with 1 % noise comes back; a sensor that is turned by 180° about z shows in what
# its channels leave.

rng = np.random.default_rng(1)
motion = rng.normal(size=6) * np.repeat([1.0, 1 / point.conditioning.length], 3)
measured = point.forward @ motion
measured = measured + 0.01 * np.abs(measured).max() * rng.normal(size=9)
turned = measured * np.r_[np.ones(3), -1, -1, 1, np.ones(3)]

panel = deboom.plot.IntervalPanel(
    "not explained by a rigid body [m/s²]",
    {
        name: [np.abs(point.reproject(values) - values)] * 3
        for name, values in {"as on the sheet": measured, "S4 turned": turned}.items()
    },
    title="A sensor turned by 180° shows in the virtual point",
)
deboom.plot.interval_panels(point.channels, [panel])
