"""
Rubber that softens with its own amplitude
==========================================

The stiffness of a mount falls with the amplitude that it causes (thesis, eq. 54 and 55): motion
and stiffness are solved together at every line by a fixed point.
"""

import numpy as np

import deboom
from deboom.physics.forced_response import amplitude_dependent_response

MASS, STIFFNESS = np.array([[200.0]]), 2.0e6  # [kg], [N/m]
lines = np.arange(8.0, 25.0, 0.05)

# %%
# A stiffness that falls by 20 % per decade of amplitude above 10 µm, with a loss factor of 0.15.


def softening(amplitude):
    """Return the stiffness (n_frequency, 1, 1) [N/m] at amplitudes (n_frequency, 1) [m]."""
    storage = STIFFNESS * (1 - 0.2 * np.log10(np.maximum(amplitude, 1e-5) / 1e-5))
    return (storage * (1 + 0.15j))[:, :, np.newaxis]


# %%
# The resonance moves down as the load rises.

per_newton = {}
for load in (10.0, 100.0, 400.0):
    force = np.full((lines.size, 1), load)
    steady = amplitude_dependent_response(MASS, softening, force, lines, np.eye(1))
    per_newton[f"{load:g} N"] = 1e6 * np.abs(steady.displacement[:, 0]) / load
panel = deboom.plot.CurvePanel("A mass on rubber that softens", lines, per_newton)
deboom.plot.curve_panels([panel], y_label="displacement per force [µm/N]")

print({load: f"{lines[curve.argmax()]:.2f} Hz" for load, curve in per_newton.items()})
