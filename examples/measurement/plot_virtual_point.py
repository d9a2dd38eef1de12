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

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import deboom
from deboom.measurement.sensors import Sensor, SensorKind
from deboom.measurement.virtual_point import sensor_geometry
from deboom.physics.dynamic_stiffness import force_at_virtual_point
from deboom.physics.rigid_body import point_acceleration, shift_load

DATA = Path("../../tests/data/pyfbs-published")  # or the folder of the files that you downloaded
PLACE = ["x_mm", "y_mm", "z_mm"]

sheet = pd.read_csv(DATA / "sensors_AB.csv", index_col="name").loc[["S3", "S4", "S5"], PLACE] / 1e3
centre = pd.read_csv(DATA / "virtual_point_1.csv")[PLACE].to_numpy()[0] / 1e3
sensors = [
    Sensor(name, SensorKind.ACCELEROMETER, "triaxial", "", "", row.to_numpy(), np.eye(3))
    for name, row in sheet.iterrows()
]
point = deboom.virtual_point(sensor_geometry(sensors, centre))

# %%
# The condition number depends on the unit of length unless rotations are scaled by a length.

print(f"as measured in metres {np.linalg.cond(point.forward):.0f}")
promise = point.conditioning
print(f"scaled by {promise.length * 1e3:.0f} mm {promise.condition_number:.2f}")
assert np.linalg.cond(point.forward) > 20 * promise.condition_number

# %%
# A rigid motion with 1 % noise comes back; a sensor that is turned by 180° about z shows in what
# its channels leave.

rng = np.random.default_rng(1)
motion = rng.normal(size=6) * np.repeat([1.0, 1 / point.conditioning.length], 3)
measured = point.forward @ motion
measured = measured + 0.01 * np.abs(measured).max() * rng.normal(size=9)
turned = measured * np.r_[np.ones(3), -1, -1, 1, np.ones(3)]

residual = {
    "as on the sheet": np.abs(point.reproject(measured) - measured),
    "S4 turned": np.abs(point.reproject(turned) - turned),
}
frame = pd.DataFrame(residual, index=point.channels)
frame.plot.bar(ylabel="not explained by a rigid body [m/s²]", figsize=(7, 4), rot=0)
plt.tight_layout()

assert np.allclose(point.inverse @ point.forward, np.eye(6), atol=1e-12)
assert frame["S4 turned"].max() > 10 * frame["as on the sheet"].max()

# %%
# Of a body that turns by 1 mrad at 30 Hz the virtual point takes the linear part. The centripetal
# rest is a thousandth of it, and answers at twice the frequency.

omega = 2 * np.pi * 30.0
turning, rate = 1e-3 * omega**2, 1e-3 * omega  # [rad/s²], [rad/s]
x, y, _ = point_acceleration([0.2, 0, 0], np.zeros(3), [0, 0, turning], [0, 0, rate])
print(f"0.2 m away: along the motion {y:.2f} m/s², across it {x:.4f} m/s²")
assert np.isclose(x / y, -1e-3)

# %%
# Forces go the other way. Cells that see 94 % of a force of 100 N give it back through the force
# transfer matrix; referred to a point 0.3 m aside it has a moment.

force = force_at_virtual_point(0.94 * np.eye(3), [0.0, 0.0, 94.0])
load = shift_load(np.r_[force, np.zeros(3)], [0.3, 0, 0])
print(f"force {force[2].real:.0f} N, moment {load[4].real:.0f} N m")
assert np.allclose(load, [0, 0, 100, 0, 30, 0])
