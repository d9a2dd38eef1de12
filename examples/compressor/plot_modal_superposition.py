"""
Forced response by modes
========================

The response of a compressor on its mounts as a sum over six rigid-body modes (thesis, eq. 62 to
75) equals the direct solution as long as all mounts share one gain; where they do not, it errs.
"""

import matplotlib.pyplot as plt
import numpy as np

from deboom.physics.forced_response import forced_response, modal_superposition
from deboom.physics.rigid_body import mass_matrix, mount_stiffness_matrix, rigid_body_modes

PLACES = np.array([[0.1, 0.06, -0.05], [-0.1, 0.06, -0.05], [0.1, -0.06, -0.04], [-0.1, -0.06, 0]])
EACH = np.array([[3e4, 2e4, 4e4], [2e4, 2e4, 5e4], [3e4, 3e4, 4e4], [2e4, 3e4, 3e4]])  # [N/m]
mass = mass_matrix(7.0, np.diag([0.015, 0.03, 0.03]))
stiffness = mount_stiffness_matrix(PLACES, EACH)
print("modes [Hz]", rigid_body_modes(mass, stiffness)[0].round(1))

# %%
# A load along z beside the centre of gravity, and a complex gain that rises over frequency.

lines = np.arange(5.0, 80.0, 0.1)
gain = 1 + 0.004 * lines + 0.12j
load = np.broadcast_to([0.0, 0.0, 1.0, 0.02, 0.01, 0.0], (lines.size, 6))
common = gain[:, np.newaxis, np.newaxis] * stiffness
direct = forced_response(mass, common, load, lines)
by_modes = modal_superposition(mass, stiffness, gain, load, lines)

# %%
# One mount whose gain is 15 % higher, one 15 % lower: no common gain, and the modes err.

scale = np.array([1.15, 0.85, 1.0, 1.0])[:, np.newaxis]
apart = gain[:, np.newaxis, np.newaxis] * mount_stiffness_matrix(PLACES, EACH * scale)
other = forced_response(mass, apart, load, lines)

figure, axes = plt.subplots(layout="constrained")
axes.semilogy(lines, np.abs(direct[:, 2]), "k", label="direct, one gain")
axes.semilogy(lines, np.abs(by_modes[:, 2]), "--", label="sum over modes")
axes.semilogy(lines, np.abs(other[:, 2]), label="direct, gains that differ")
axes.set(xlabel="frequency [Hz]", ylabel="displacement z [m/N]")
axes.legend()

error = np.abs(other - by_modes).max() / np.abs(other).max()
print(f"gains that differ by 15 %: up to {100 * error:.0f} %")
assert np.allclose(direct, by_modes, rtol=1e-9, atol=1e-15)
assert error > 0.02
