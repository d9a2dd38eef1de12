"""
Blocked forces on a rig that gives way, and the air beside them
===============================================================

Cells between a source and a test rig read its blocked force if the rig is rigid. One that gives way
takes part of it back; the correction of the thesis, eq. 9 to 11 and figure 9, gives it again. In
the car the pressure of the forces and that over the air add up (eq. 12).
"""

import matplotlib.pyplot as plt
import numpy as np

from deboom.physics.sound_level import spl
from deboom.physics.transfer_path import (
    blocked_force,
    blocked_force_on_rig,
    interface_force,
    pressure,
    pressure_with_airborne,
)

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

truth = blocked_force(source, free)
cells = interface_force(source, rig, free)
motion = np.einsum("fij,fj->fi", rig, cells)
corrected = blocked_force_on_rig(source, cells, motion)

figure, (upper, lower) = plt.subplots(2, 1, figsize=(6.4, 6.4), layout="constrained", sharex=True)
upper.semilogy(lines, np.abs(truth[:, 0]), "k", label="blocked force")
upper.semilogy(lines, np.abs(cells[:, 0]), label="as the cells read it")
upper.semilogy(lines, np.abs(corrected[:, 0]), "--", label="corrected by the rig's motion")
upper.set(ylabel="force of the first mount [N]")
upper.legend()
left_out = 20 * np.log10(np.abs(cells / truth))
print(f"without the correction up to {np.abs(left_out).max():.1f} dB wrong")
assert np.allclose(corrected, truth, rtol=1e-9)
assert np.abs(left_out).max() > 3.0

# %%
# In the car the source radiates as well. Its volume velocity is the same at all speeds, and the
# firewall lets more through the higher the tone.

body = 0.0
for natural in (28.0, 48.0, 75.0, 112.0):
    body = body + 1 / (1 - (lines / natural) ** 2 + 0.2j * lines / natural)
structure = 0.02 * body[:, np.newaxis, np.newaxis] * np.array([[1.0, 0.6]])
air = (lines * np.exp(-0.02j * lines))[:, np.newaxis, np.newaxis]  # [Pa s/m³]
volume_velocity = np.full((lines.size, 1), 4.0e-4)  # [m³/s]

forces_alone = pressure(structure[:, 0], truth)
both = pressure_with_airborne(structure[:, 0], truth, air[:, 0], volume_velocity)
lower.plot(lines, spl(both, lines), "k", label="forces and air")
lower.plot(lines, spl(forces_alone, lines), "--", label="forces alone")
lower.set(xlabel="frequency [Hz]", ylabel="sound pressure [dB(A)]")
lower.legend()
left_out = np.abs(spl(both, lines) - spl(forces_alone, lines))
low = lines < 60.0
print(
    f"air left out: {np.median(left_out[low]):.1f} dB wrong below 60 Hz, "
    f"{np.median(left_out[~low]):.1f} dB above (medians)"
)
assert np.median(left_out[low]) < 1.0 < np.median(left_out[~low])
