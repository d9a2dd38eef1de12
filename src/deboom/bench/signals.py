"""Noise and order signals: what all virtual recorders share."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.special import expit

from deboom.arrays import ComplexArray, RealArray

ANALYSIS_SECONDS = 1.0
"""Record over which the noise of a channel falls to the floor of its order spectra [s]."""


def complex_normal(shape: tuple[int, ...], generator: np.random.Generator) -> ComplexArray:
    """Draw standard-normal real parts, then imaginary parts."""
    real, imaginary = generator.standard_normal((2, *shape))
    return np.asarray(real + 1j * imaginary)


def order_noise(
    signal: ComplexArray,
    n_axis: int,
    levels: tuple[float, float, float],
    generator: np.random.Generator,
) -> ComplexArray:
    """Draw order-tracking leakage and floor of one kind of channel.

    - `signal` (f, n_channel): spectra without noise, sensor after sensor.
    - `n_axis`: channels per sensor.
    - `levels` (own, norm, floor): noise per own amplitude [1], per norm of the sensor's axes [1],
      floor [unit of `signal`].
    - `generator`: source of the noise.

    Neighbouring lines share part of their time window, hence the weights 1/2, 1, 1/2.
    """
    relative, of_norm, floor = levels
    n_line, n_channel = signal.shape
    white = complex_normal((n_line + 2, n_channel), generator) / np.sqrt(2)
    leaked = (0.5 * white[:-2] + white[1:-1] + 0.5 * white[2:]) / np.sqrt(1.5)
    per_sensor = np.linalg.norm(signal.reshape(n_line, -1, n_axis), axis=2)
    norm = np.repeat(per_sensor, n_axis, axis=1)
    amplitude = np.sqrt((relative * np.abs(signal)) ** 2 + (of_norm * norm) ** 2 + floor**2)
    return np.asarray(leaked * amplitude)


def ripple(
    n_line: int, n_ripple: int, n_channel: int, generator: np.random.Generator
) -> ComplexArray:
    """Draw a smooth complex error over the lines out of cosines, shape (n_line, n_channel) [1]."""
    ripples = np.cos(np.pi * np.outer(np.linspace(0, 1, n_line), np.arange(n_ripple)))
    return np.asarray(
        ripples @ complex_normal((n_ripple, n_channel), generator) / np.sqrt(2 * n_ripple)
    )


def rotations(
    angle: RealArray, order: float, others: Iterable[tuple[float, float, float]]
) -> ComplexArray:
    """Return the sum of an order and others that ride on it over the angle, shape (n_sample,) [1].

    The angle of the revolution is zero at the first pulse [rad]; others are (order, amplitude per
    amplitude of `order` [1], phase against it [rad]).
    """
    total = np.exp(1j * order * angle)
    for other, share, phase in others:
        total = total + share * np.exp(1j * (other * angle + phase))
    return np.asarray(total)


def over_time(
    steady: tuple[RealArray, ComplexArray],
    speed: RealArray,
    turning: ComplexArray,
    floor: float,
    rate: float,
    generator: np.random.Generator | None,
) -> RealArray:
    """Record channels whose order follows its steady states while the speed changes slowly.

    - `steady` (n_grid,): speeds, and the order spectra there.
    - `speed`, `turning` (n_sample,): speed over time, in the unit of the grid, and `rotations`.
    - `floor`, `rate`: deviation of a complex order spectrum of each channel, and samples per second
      [Hz].
    - `generator`, optional: source of the noise; without it, there is none.

    ``x(t) = Re Σ_q A_q(n(t)) e^{jqθ(t)}`` with the revolution angle θ, zero at the first pulse.
    """
    clean = np.asarray(np.real(CubicSpline(*steady)(speed) * turning[:, None]))
    if generator is None:
        return clean
    noise = floor * np.sqrt(rate * ANALYSIS_SECONDS) / 2
    return np.asarray(clean + noise * generator.standard_normal(clean.shape))


def tacho_pulses(periods: RealArray, edge: RealArray, share: float) -> RealArray:
    """Return one smooth pulse per tacho period; the middle of its rising edge is at its start.

    Over the periods so far (n_sample,) [1]; width of the edges and share of the pulse in periods
    [1].
    """
    within = np.mod(periods + 0.5, 1.0) - 0.5
    return np.asarray(expit(within / edge) * expit((share - within) / edge))
