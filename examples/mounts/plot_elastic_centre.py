"""
Elastic centre of a powertrain, over frequency
==============================================

At the elastic centre a force turns the body as little as possible. That of the mounts alone is
one point; that of the mounted powertrain moves with frequency to its centre of gravity (the
thesis, section 2.3.2 with figures 5 and 6, speaks of one point).
"""

import numpy as np

import deboom
from deboom.physics.rigid_body import mass_matrix, mount_stiffness_matrix

POSITIONS = np.array([[0.0, 0.45, 0.15], [0.05, -0.45, 0.10], [0.3, 0.05, -0.3]])  # [m]
STIFFNESS = np.array([[2.0, 1.5, 2.5], [1.8, 1.6, 2.8], [3.0, 0.5, 0.6]]) * 1e5  # [N/m]

mounts = mount_stiffness_matrix(POSITIONS, STIFFNESS)
mass = mass_matrix(190.0, np.diag([11.0, 7.0, 10.0]))
still = deboom.centre_of_stiffness(mounts)
print(f"centre of the mounts {still.position.round(3)} m, coupling {float(still.coupling):.2f}")

# %%
# With mass the dynamic stiffness is K − ω²M at each line; the loss factor is 0.1. Far below the
# modes the elastic centre is that of the mounts, far above them the centre of gravity.

frequency = np.geomspace(1.0, 300.0, 300)
omega = 2 * np.pi * frequency[:, np.newaxis, np.newaxis]
moving = deboom.dynamic_centre_of_stiffness(mounts * (1 + 0.1j) - omega**2 * mass)

panel = deboom.plot.CurvePanel(
    "Elastic centre of a powertrain, from its centre of gravity",
    frequency,
    dict(zip("xyz", 1e3 * moving.position.T, strict=True)),
)
deboom.plot.curve_panels([panel], y_label="position [mm]", log_frequency=True)
