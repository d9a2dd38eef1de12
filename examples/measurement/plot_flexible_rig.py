"""
Blocked forces on a rig that gives way, and the air beside them
===============================================================

Cells between a source and a test rig read its blocked force if the rig is rigid. One that gives way
takes part of it back; the correction of the thesis, eq. 9 to 11 and figure 9, gives it again. In
the car the pressure of the forces and that over the air add up (eq. 12).
"""

import numpy as np

import deboom
from deboom.physics import transfer_path
from deboom.physics.sound_level import spl

lines = np.arange(20.0, 140.5, 0.5)
omega = 2 * np.pi * lines[:, np.newaxis, np.newaxis]

# %%
# A source on two mounts, shaken by forces inside it, and a rig with a mode at 90 Hz: receptances.

bar = -np.linalg.inv([[12.0, 3.0], [3.0, 10.0]]) / omega**2
source = bar + np.eye(2) / (2.0e5 * (1 + 0.1j))
free = (bar @ np.array([30.0, 12.0])[:, np.newaxis])[:, :, 0]
shape = np.array([[1.0], [0.7]])
natural = 2 * np.pi * 90.0
rig = 1e-9 * np.eye(2) + shape @ shape.T / (60.0 * (natural**2 * (1 + 0.04j) - omega**2))

truth = transfer_path.blocked_force(source, free)
cells = transfer_path.interface_force(source, rig, free)
motion = np.einsum("fij,fj->fi", rig, cells)
corrected = transfer_path.blocked_force_on_rig(source, cells, motion)
on_rig = {
    "as the cells read it": 20 * np.log10(np.abs(cells / truth)[:, 0]),
    "corrected by the rig's motion": 20 * np.log10(np.abs(corrected / truth)[:, 0]),
}

# %%
# In the car the source radiates as well. Its volume velocity is the same at all speeds, and the
# firewall lets more through the higher the tone.

body = 0.0
for natural in (28.0, 48.0, 75.0, 112.0):
    body = body + 1 / (1 - (lines / natural) ** 2 + 0.2j * lines / natural)
structure = 0.02 * body[:, np.newaxis] * np.array([1.0, 0.6])
air = (lines * np.exp(-0.02j * lines))[:, np.newaxis]  # [Pa s/m³]
volume_velocity = np.full((lines.size, 1), 4.0e-4)  # [m³/s]
both = transfer_path.pressure_with_airborne(structure, truth, air, volume_velocity)
alone = transfer_path.pressure(structure, truth)
in_car = {"forces and air": spl(both, lines), "forces alone": spl(alone, lines)}

panels = [
    deboom.plot.CurvePanel("On the rig", lines, on_rig, y_label="force over the blocked one [dB]"),
    deboom.plot.CurvePanel("In the car", lines, in_car, y_label="sound pressure [dB(A)]"),
]
deboom.plot.curve_panels(panels, columns=2)
