"""
Forced response by modes
========================

The response of a compressor on its mounts as a sum over six rigid-body modes (thesis, eq. 62 to
75) equals the direct solution as long as all mounts share one gain; where they do not, it errs.
"""

import numpy as np

import deboom
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
by_modes = modal_superposition(mass, stiffness, gain, load, lines)

# %%
# The gain of one mount is higher, that of another lower: no common gain, and the modes err.

error = {}
for apart in (0.0, 0.05, 0.15):
    scale = np.array([1 + apart, 1 - apart, 1.0, 1.0])[:, np.newaxis]
    dynamic = gain[:, np.newaxis, np.newaxis] * mount_stiffness_matrix(PLACES, EACH * scale)
    direct = forced_response(mass, dynamic, load, lines)
    name = f"gains ± {100 * apart:.0f} %" if apart else "one gain"
    error[name] = 100 * np.abs((by_modes - direct)[:, 2]) / np.abs(direct[:, 2]).max()

panel = deboom.plot.CurvePanel("Error of a sum over six modes", lines, error)
deboom.plot.curve_panels([panel], y_label="of the largest motion z [%]")
