"""What noise and modulation leave of an order spectrum, in closed form."""

import numpy as np

from deboom.physics.order_tracking import penalty


def hann_noise_bandwidth(rpm, revolutions):
    """Return the noise bandwidth of a Hann window [Hz]."""
    return 1.5 * np.asarray(rpm, dtype=float) / (60 * revolutions)


def noise_amplitude(density, noise_bandwidth):
    """Return the rms of the peak amplitude that noise of a density G alone pretends, √(2 G B)."""
    return np.sqrt(2 * np.asarray(density, dtype=float) * noise_bandwidth)


def envelope_response(modulation, bandwidth, rate, poles=2):
    """Return the factor by which a Vold-Kalman filter passes a modulation [Hz] of an amplitude.

    ``H(f) = 1 / (1 + r² (2 sin(πf/rate))^{2p})``, so ``H(B/2) = 1/√2``.
    """
    step = 2 * np.sin(np.pi * np.asarray(modulation, dtype=float) / rate)
    return 1 / (1 + (penalty(bandwidth, rate, poles) * step**poles) ** 2)


def noise_bandwidth(bandwidth, poles=2):
    """Return the noise bandwidth of a Vold-Kalman filter far below the rate [Hz].

    ``∫ H² df = B (√2 − 1)^{−1/(2p)} · (π/2p) (1 − 1/2p) / sin(π/2p)``.
    """
    share = 1 / (2 * poles)
    factor = np.pi * share * (1 - share) / np.sin(np.pi * share) / (np.sqrt(2) - 1) ** share
    return factor * np.asarray(bandwidth, dtype=float)
