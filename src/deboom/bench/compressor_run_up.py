"""A short run-up of the virtual compressor over time, with the pulses of its tacho.

All of 1000 to 9000 1/min at 1 Hz/s would take more than two minutes and 20 MB; 50 to 60 Hz lie
above the modes of the mounts, where a run-up of 1 Hz/s passes through steady states only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.special import expit

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.frozen import freeze_arrays

RATE = 2000.0
"""Samples per second [Hz]."""
FIRST, LAST, DURATION = 49.5, 60.5, 11.0
"""Of the rotation [Hz], [s]; a filter of 3 Hz leaves the lines 50 to 60 Hz."""
GRID_STEP = 0.5
"""Between the steady states that the run passes [Hz]."""
OTHER_ORDERS = ((2, 0.20, 0.7), (3, 0.10, -1.1))
"""Order, amplitude per amplitude of the first, and phase against it [rad]: gas pulsation."""
ANALYSIS_SECONDS = 1.0
"""Record over which the noise of a channel falls to the floor of its order spectra [s]."""
PULSE_SHARE = 0.5
"""Share of a revolution that the pulse takes [1]."""
EDGE_SAMPLES = 1.0
"""Width of a pulse's edges in samples [1]: the recorder's filter."""


@dataclass(frozen=True, eq=False)
class RunUp:
    """What the recorder holds.

    Parameters
    ----------
    tacho : array, shape (n_sample,)
        One pulse per revolution, 0 to 1; the rotor's mark is on the y axis half-way up its edge.
    acceleration : array, shape (n_sample, n_channel)
        [m/s²].
    """

    tacho: RealArray
    acceleration: RealArray

    def __post_init__(self) -> None:
        freeze_arrays(self)


def grid() -> RealArray:
    """Return the speeds at which `run_up` wants the steady states [Hz]."""
    return np.arange(FIRST, LAST + GRID_STEP / 2, GRID_STEP)


def run_up(
    steady: ComplexArray, floor: float, generator: np.random.Generator | None = None
) -> RunUp:
    """Run up and record.

    Parameters
    ----------
    steady : array, shape (n_grid, n_channel)
        First order of the channels on the `grid` [m/s²].
    floor : float
        Deviation of a complex order spectrum of each channel [m/s²].
    generator : Generator, optional
        Draws the noise; left out, there is none.

    Notes
    -----
    ``a(t) = Re Σ_q A_q(f(t)) e^{jqθ(t)}`` with the angle θ of the rotor, 0 at a pulse.
    """
    time = np.arange(round(DURATION * RATE)) / RATE
    slope = (LAST - FIRST) / DURATION
    # the record starts between two pulses
    angle = 2 * np.pi * (FIRST * time + slope * time**2 / 2 - 0.5)
    rotations = np.exp(1j * angle)
    for order, share, phase in OTHER_ORDERS:
        rotations = rotations + share * np.exp(1j * (order * angle + phase))
    clean = np.real(CubicSpline(grid(), steady)(FIRST + slope * time) * rotations[:, None])
    if generator is not None:
        noise = floor * np.sqrt(RATE * ANALYSIS_SECONDS) / 2
        clean = clean + noise * generator.standard_normal(clean.shape)
    return RunUp(_pulses(angle), clean)


def _pulses(angle: RealArray) -> RealArray:
    turns = angle / (2 * np.pi)
    within = np.mod(turns + 0.5, 1.0) - 0.5
    edge = EDGE_SAMPLES * np.gradient(turns)
    return np.asarray(expit(within / edge) * expit((PULSE_SHARE - within) / edge))
