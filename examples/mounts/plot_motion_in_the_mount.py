"""
Motion in the mount and beside it
=================================

Accelerometers sit on the powertrain next to its mounts, the motion is wanted inside of them. The
virtual point takes it there (thesis, section 3.2.4 and figure 16); a sensor beside the mount shows
another motion, and makes another stiffness.
"""

import tempfile
from pathlib import Path

import numpy as np

import deboom
from deboom.bench.campaign import NO_ERRORS, CampaignPlan
from deboom.bench.operating_run import PlannedRun
from deboom.measurement.sensors import SensorKind

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

panels, error = [], {}
for name in in_mount:
    virtual, near = np.abs(in_mount[name][:, 0]), np.abs(beside[name][:, 0])
    curves = {"in the mount": virtual, "sensor beside it": near}
    panels.append(deboom.plot.CurvePanel(name, run.frequency, curves))
    error[name] = f"{100 * np.median(virtual / near - 1):+.0f} % of |K|"
deboom.plot.curve_panels(
    panels, y_label="acceleration along x [m/s²]", order=run.order, dashed=["sensor beside it"]
)
print(error)
