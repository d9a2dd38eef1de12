"""
Response surface of a rubber mount
==================================

A cubic in preload, amplitude and frequency for the dynamic stiffness (thesis, eq. 32 and figures 26
and 39), and a Gaussian process of scikit-learn in its place. Both are judged by runs that they did
not see.
"""

import tempfile
from pathlib import Path

import numpy as np

import deboom
from deboom.bench.campaign import training_plan
from deboom.mounts.operating_map import Preload
from deboom.mounts.response_surface import gaussian_process

# %%
# Measured stiffness of the torque strut mount, line by line; one run in three is kept for judging.

folder = Path(tempfile.mkdtemp()) / "campaign"
deboom.bench.write_campaign(folder, seed=1, plan=training_plan("M1"))
mounts = deboom.characterise(deboom.read_campaign(folder), "M1")
samples = mounts.directions["TSM x"].measured.samples(Preload.WHEEL_TORQUE)
_, number = np.unique(samples.run, return_inverse=True)
training, check = samples.select(number % 3 != 1), samples.select(number % 3 == 1)

# %%
# Another regressor fits the slot of the cubic and is compared under the same rules.

models = {
    "piecewise cubic": deboom.DynamicStiffnessSurface(preload_unit="N m"),
    "Gaussian process": deboom.DynamicStiffnessSurface(
        gaussian_process(), preload_unit="N m", max_lines=300
    ),
}
table = deboom.compare_models(models, training, check).set_index("model")
table[["lines compared [1]", "R² Re K [%]", "R² Im K [%]", "rms error [%]"]]

# %%
# The surface refuses to extrapolate: only lines inside of its training region are predicted.

surface = models["piecewise cubic"].fit(training.points, training.stiffness)
inside = surface.supported(check.points)
predicted = surface.predict(check.points[inside])
preload, amplitude, _ = check.points[inside].T
labels = ("wheel torque [N m]", "amplitude [µm]", "|K| of TSM x [N/mm]")
places = (preload, 1e6 * amplitude)
panels = [
    deboom.plot.PointMap(title, *places, np.abs(values) / 1e3, *labels, amplitude=True)
    for title, values in (("Measured", check.stiffness[inside]), ("Surface", predicted))
]
deboom.plot.point_maps(panels, columns=2)
