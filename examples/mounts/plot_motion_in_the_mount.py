"""
Motion in the mount and beside it
=================================

Accelerometers sit on the powertrain next to its mounts, the motion is wanted inside of them. The
virtual point takes it there (thesis, section 3.2.4 and figure 16); a sensor beside the mount shows
another motion, and makes another stiffness.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import deboom
from deboom.bench.campaign import NO_ERRORS, CampaignPlan
from deboom.bench.operating_run import PlannedRun
from deboom.measurement.sensors import SensorKind
from deboom.physics.order_tracking import rpm_of_frequency

# %%
# One run of the virtual bench without errors of sensors: what is left is where they sit.

folder = Path(tempfile.mkdtemp()) / "campaign"
plan = CampaignPlan(("M0",), (PlannedRun(5, 220.0),), 1, frequency=np.arange(20.0, 80.5, 0.5))
deboom.bench.write_campaign(folder, 1, plan, NO_ERRORS)
campaign = deboom.read_campaign(folder)
(run,) = campaign.runs

# %%
# Rigid motion of the powertrain from all its sensors, and with it the acceleration in each mount.

sensors = campaign.sensors_of(SensorKind.ACCELEROMETER, campaign.powertrain_mounts)
mounts = [mount for mount in campaign.mounts if mount.name in campaign.powertrain_mounts]
in_mount, beside = {}, {}
for mount in mounts:
    point = deboom.virtual_point(deboom.sensor_geometry(sensors, mount.positions[0]))
    motion = run.acceleration.select(point.channels).values @ point.inverse.T
    in_mount[mount.name] = motion[:, :3]
    nearest = next(sensor for sensor in sensors if sensor.mount == mount.name)
    measured = run.acceleration.select(nearest.channels).values
    beside[mount.name] = measured @ nearest.orientation.T

# %%
# Along x, which the engine loads most. A stiffness from the sensor beside the mount errs by what
# the two motions differ.

speed = rpm_of_frequency(run.frequency, run.order)
figure, axes = plt.subplots(layout="constrained")
error = {}
for colour, name in zip(("C0", "C1", "C2"), in_mount, strict=True):
    virtual, near = np.abs(in_mount[name][:, 0]), np.abs(beside[name][:, 0])
    axes.plot(speed, virtual, colour, label=f"{name}, virtual point")
    axes.plot(speed, near, colour, linestyle="--", label=f"{name}, sensor beside it")
    error[name] = np.median(virtual / near - 1)
axes.set(xlabel="engine speed [rpm]", ylabel="acceleration along x [m/s²]")
axes.legend()
print({name: f"{100 * value:+.0f} % of |K|" for name, value in error.items()})

# %%
# The virtual point gives the truth of the bench.

with np.load(folder / "truth" / "M0.npz") as truth:
    column = list(truth["channels"]).index("TSM x")
    true = -((2 * np.pi * run.frequency) ** 2) * truth["displacement"][0, :, column]
assert np.allclose(in_mount["TSM"][:, 0], true, rtol=1e-9)
assert max(map(abs, error.values())) > 0.05
