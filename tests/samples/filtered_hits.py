"""Hammer blows behind the steep filters of an analyzer: what rings and what hits twice.

Pushes are drawn on sixteen times the sampling rate, filtered there, and sampled. The filters are
those of analyzers: Butterworth, Chebyshev and elliptic ones of order 4 to 8 with at most 0.3 dB of
ripple, and linear-phase ones, all with their edge at 0.4 to 0.8 of half the sampling rate.
"""

from __future__ import annotations

import numpy as np
from scipy import signal

from deboom.measurement.impact_test import HammerMeasurement

RATE, N_SAMPLE, N_BEFORE = 4096.0, 4096, 256
OVER = 16


def filtered(force, generator):
    """Return a force (n_fine,) behind a drawn filter, at the sampling rate."""
    kind, order = generator.integers(4), int(generator.integers(4, 9))
    edge, ripple = generator.uniform(0.4, 0.8) / OVER, generator.uniform(0.05, 0.3)
    if kind == 3:
        taps = signal.firwin(64 * OVER + 1, edge, window=("kaiser", generator.uniform(4, 10)))
        return np.convolve(force, taps, "same")[::OVER]
    designs = (
        lambda: signal.butter(order, edge, output="sos"),
        lambda: signal.cheby1(order, ripple, edge, output="sos"),
        lambda: signal.ellip(order, ripple, generator.uniform(60, 90), edge, output="sos"),
    )
    return signal.sosfilt(designs[kind](), force)[::OVER]


def blow(generator, second=None):
    """Draw one block of force; `second` is (samples later, share) of another push [N]."""
    time = np.arange(N_SAMPLE * OVER) / OVER - N_BEFORE - generator.uniform()
    duration, power = generator.uniform(1.0, 12.0), generator.integers(1, 3)
    force = np.zeros(time.size)
    for later, share in ((0.0, 1.0), *([second] if second else [])):
        phase = np.clip((time - later) / duration, 0.0, 1.0)
        force += 100.0 * share * np.sin(np.pi * phase) ** power
    sampled = filtered(force, generator)
    noise = generator.choice([0.0, 1e-4, 1e-3]) * sampled.max()
    return sampled + noise * generator.normal(size=N_SAMPLE)


def blows(n, *, double, seed):
    """Measure `n` hits; a second push of 5 % to all of the first comes 50 samples later or more."""
    generator = np.random.default_rng(seed)
    force = []
    for number in range(n):
        later = 50.0 if number % 3 == 0 else generator.uniform(50.0, N_SAMPLE - N_BEFORE - 100.0)
        share = np.exp(generator.uniform(np.log(0.05), 0.0))
        force.append(blow(generator, (later, share) if double else None))
    return hammered(force)


def hammered(force, response=None):
    """Return a measurement of one channel, silent unless its response is given."""
    response = np.zeros((*np.shape(force), 1)) if response is None else response
    return HammerMeasurement(
        "I1", force, response, ("A1 x",), ("m/s^2",), (np.inf,), RATE, (N_BEFORE - 16) / RATE
    )


def struck_through(sos, n_hit=2):
    """Measure separate hits on an oscillator (200 Hz, 1 %); both channels pass one steep filter."""
    time = np.arange(N_SAMPLE * OVER) / OVER - N_BEFORE
    force = np.array(
        [
            80.0 * (1 + 0.3 * hit) * np.sin(np.pi * np.clip(time / 2.0, 0, 1)) ** 2
            for hit in range(n_hit)
        ]
    )
    omega, seconds = 2 * np.pi * 200.0, np.arange(time.size) / (OVER * RATE)
    answer = np.exp(-0.01 * omega * seconds) * np.sin(omega * seconds) / omega
    response = signal.fftconvolve(force, answer[np.newaxis], axes=1)[:, : time.size] / (OVER * RATE)
    seen = [signal.sosfilt(sos, channel)[:, ::OVER] for channel in (force, response)]
    return hammered(seen[0], seen[1][:, :, np.newaxis])
