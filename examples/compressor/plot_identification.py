"""
A compressor from hammer blows
==============================

Mass, centre of gravity, inertia, stiffness and gain of a mounted refrigerant compressor from 18
impacts (thesis, chapter 4 and figure 55), with standard deviations that hold sensors' errors as
well.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import deboom
from deboom.physics.frf import FrfForm, scaled_condition_number

folder = Path(tempfile.mkdtemp()) / "hammer"
deboom.bench.write_compressor_test(folder, seed=1)
test = deboom.read_inertance_test(folder)
found = deboom.identify(test)
found.table.head(10)

# %%
# Drive point along z at the virtual point: measured, and as the model gives it back.

lines = found.inertance.frequency
model = found.calibrated.model
measured = found.inertance.values[:, 2, 2]
stiffness = model.gain.at(lines)[:, np.newaxis, np.newaxis] * model.stiffness
omega = 2 * np.pi * lines[:, np.newaxis, np.newaxis]
identified = np.linalg.inv(model.mass_matrix - stiffness / omega**2)[:, 2, 2]

figure, axes = plt.subplots(layout="constrained")
axes.semilogy(lines, np.abs(measured), ".", markersize=3, label="measured")
axes.semilogy(lines, np.abs(identified), label="identified")
axes.set(xlabel="frequency [Hz]", ylabel="inertance z/z [1/kg]")
axes.legend()

# %%
# How much the inverse of a mass matrix amplifies depends on the unit of length, unless rotations
# are scaled by one: here the radius of gyration.

radius = np.sqrt(np.trace(model.mass_matrix[3:, 3:]) / (3 * model.mass))
scaled = scaled_condition_number(model.mass_matrix, FrfForm.APPARENT_MASS, radius)
print(f"condition number {np.linalg.cond(model.mass_matrix):.0f} in metres, {scaled:.1f} scaled")
assert scaled < 10

# %%
# Six rigid-body modes, and the reasons not to trust the model: none.

print("modes [Hz]", found.modes.frequency.round(1), found.modes.leading)
off = np.abs(measured - identified)[found.fitted] / np.abs(measured)[found.fitted]
print(f"median distance {100 * np.median(off):.1f} %, alarms {found.alarms}")
assert found.alarms == ()
assert np.median(off) < 0.05
assert abs(model.mass / test.weighed_mass - 1) < 0.01
