"""
Sound pressure at the ear, path by path
=======================================

Noise transfer functions times mount forces give the pressure (thesis, eq. 13, figures 4 and 42),
each path with its phase. Paths are ranked by their share of the energy, which adds up to one.
"""

import numpy as np

import deboom
from deboom.physics.sound_level import band_energy_level

model = deboom.read_platform("u06").model(vehicles="U06", band=(20, 60), motion="coupled")
today = np.ones(len(model.variable_names))

# %%
# Who is heard in the first vehicle? A negative share takes away from the sum.

paths = model.paths(today, "U06-1")
paths.table.head()

# %%
# Levels of the loudest paths and of their sum.

curves = {name: paths.path_levels[:, paths.paths.index(name)] for name in paths.table["path"][:3]}
panel = deboom.plot.CurvePanel(
    "Three mounts and all paths, in U06-1", paths.frequency, curves | {"all paths": paths.level}
)
deboom.plot.curve_panels(
    [panel], y_label="sound pressure level [dB(A)]", dashed=["all paths"], depth=50
)

# %%
# The sum over the lines is SPLV (thesis, eq. 35); per line it is easier to read.

splv = model([today])[0, 0]
print(f"SPLV {splv:.0f} dB(A), {splv / model.n_lines:.1f} dB(A) per line")
booming = band_energy_level(paths.level, paths.frequency, (20, 40))
print(f"energy sum of 20 to 40 Hz {booming:.1f} dB(A)")
