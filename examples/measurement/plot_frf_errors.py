"""
How sure a measured function is
===============================

One shaker, noise in both channels and blocks that overlap: which estimate is biased, what a
coherence says of the error, and what overlapping is worth.
"""

import numpy as np

import deboom
from deboom.physics import frf

RATE, LENGTH, STEP = 512.0, 512, 256
rng = np.random.default_rng(1)
force = rng.normal(size=(40 * LENGTH, 1))
answer = np.convolve(force[:, 0], [0.0, 0.5, 0.3, 0.2])[: force.size, np.newaxis]  # [m/s²]
channels = np.hstack([force, answer])
noise = 0.3 * channels.std(axis=0)  # [N], [m/s²]
measured = channels + noise * rng.normal(size=channels.shape)

# %%
# Hann blocks that overlap by half are worth almost as many independent averages.

blocks = frf.overlapping_blocks(measured, LENGTH, STEP)
window = np.hanning(LENGTH)
worth = frf.effective_averages(window, STEP, len(blocks))
print(f"{len(blocks)} blocks are worth {worth:.1f} averages; without overlap there are 40")
spectra = frf.cross_spectra(
    blocks[..., :1], blocks[..., 1:], RATE, input_window=window, output_window=window
)

# %%
# Noise in the input makes H1 too small, noise in the output makes H2 too large; Hv, which is given
# the ratio of the noises, is right on average.

lines = slice(2, 60)
frequency = np.arange(LENGTH // 2 + 1)[lines] * RATE / LENGTH
true = np.abs(np.fft.rfft([0.0, 0.5, 0.3, 0.2], LENGTH))[lines]
estimates = {
    "H1": frf.h1(spectra),
    "Hv": frf.hv(spectra, noise_ratio=noise[1] / noise[0]),
    "H2": frf.h2(spectra),
}
ratios = {name: np.abs(values[lines, 0, 0]) / true for name, values in estimates.items()}
panel = deboom.plot.CurvePanel(
    "Three estimates of one noisy function", frequency, ratios | {"truth": np.ones(frequency.size)}
)
deboom.plot.curve_panels([panel], y_label="|H| over the true one [1]", dashed=["truth"])

# %%
# The coherence says how large the error by chance is, of magnitude and of phase. With one input the
# partial coherence is the ordinary one.

coherence = frf.partial_coherence(spectra)[lines, 0, 0]
chance = frf.magnitude_error(coherence, worth)
turn = np.degrees(frf.phase_error(coherence, worth))
print(f"coherence {coherence.mean():.2f}")
print(f"error by chance {100 * chance.mean():.1f} % and {turn.mean():.1f}°")
