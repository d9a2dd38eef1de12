"""Hits of a hammer on nothing in particular: pushes with stated faults."""

import numpy as np

from deboom.measurement.hammer_measurement import HammerMeasurement

RATE, N_SAMPLE, PRETRIGGER = 2048.0, 2048, 0.0625
TIME = np.arange(N_SAMPLE) / RATE - PRETRIGGER


def push(at=0.0, peak=100.0, duration=4 / 2048):
    inside = (at < TIME) & (at + duration > TIME)
    return np.where(inside, peak * np.sin(np.pi * (TIME - at) / duration) ** 2, 0.0)


def hits(forces, **changes):
    """Two responses that ring after each push."""
    forces = np.array(forces)
    ringing = np.exp(-8 * TIME) * np.sin(2 * np.pi * 40 * TIME) * (TIME > 0)
    response = np.stack(
        [
            [np.convolve(force, gain * ringing)[:N_SAMPLE] / RATE for gain in (30.0, 0.5)]
            for force in forces
        ]
    ).transpose(0, 2, 1)
    values = {
        "impact": "I1",
        "force": forces,
        "response": response,
        "channels": ("A1 x", "ear"),
        "units": ("m/s^2", "Pa"),
        "rate": RATE,
        "pretrigger": PRETRIGGER,
    }
    return HammerMeasurement(**values | changes)
