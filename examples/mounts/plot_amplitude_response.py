"""
Rubber that softens with its own amplitude
==========================================

The stiffness of a mount falls with the amplitude that it causes (thesis, eq. 54 and 55): motion
and stiffness are solved together at every line by a fixed point.
"""

import matplotlib.pyplot as plt
import numpy as np

from deboom.physics.forced_response import amplitude_dependent_response, forced_response

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

figure, axes = plt.subplots(layout="constrained")
peaks = {}
for load in (10.0, 100.0, 400.0):
    force = np.full((lines.size, 1), load)
    steady = amplitude_dependent_response(MASS, softening, force, lines, np.eye(1))
    per_newton = np.abs(steady.displacement[:, 0]) / load
    peaks[load] = lines[per_newton.argmax()]
    axes.plot(lines, 1e6 * per_newton, label=f"{load:g} N")
axes.set(xlabel="frequency [Hz]", ylabel="displacement per force [µm/N]")
axes.legend()

# %%
# The solution is one: the response at the stiffness of its own amplitude.

again = forced_response(MASS, softening(steady.amplitude), force, lines)
print({f"{load:g} N": f"{peak:.2f} Hz" for load, peak in peaks.items()})
assert np.allclose(again, steady.displacement, rtol=1e-8)
assert peaks[400.0] < peaks[100.0] < peaks[10.0]
