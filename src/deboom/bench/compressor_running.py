"""How the virtual compressor moves while it runs: one steady state per speed."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.compressor_sources import Source
from deboom.bench.compressor_truth import Compressor
from deboom.bench.frozen import freeze_arrays

LARGEST_SWEEPS = 200
AMPLITUDE_TOLERANCE = 1e-12
"""Between two sweeps of the search for the amplitudes [m]."""


@dataclass(frozen=True, eq=False)
class Running:
    """Steady states over speed.

    Parameters
    ----------
    load : array, shape (f, 6)
        Of the source at the virtual point [N, N m].
    dynamic_stiffness : array, shape (f, 6, 6)
        With mounts as they are then, hoses and the turning rotor [N/m, N/rad, N m/rad].
    displacement : array, shape (f, 6)
        Of the virtual point [m, rad].
    amplitudes : array, shape (f, n_mount)
        Largest displacement of the body at each mount over a turn [m].
    factors : array, shape (f, n_mount)
        Of softening [1].
    """

    load: ComplexArray
    dynamic_stiffness: ComplexArray
    displacement: ComplexArray
    amplitudes: RealArray
    factors: RealArray

    def __post_init__(self) -> None:
        freeze_arrays(self)


def in_operation(compressor: Compressor, storage: float = 1.0, loss: float = 1.0) -> Compressor:
    """Return the compressor with its mounts in another state than the hammer found them in.

    Parameters
    ----------
    compressor : Compressor
        As struck.
    storage, loss : float
        Factors on the real and on the imaginary part of the dynamic stiffness: warmth, preload,
        amplitude [1].

    Notes
    -----
    A hyperbola times a factor is one again: ``c (v∞ − 1/(m f + w₀)) = c v∞ − 1/(m f/c + w₀/c)``.
    """
    factors = np.array([storage, loss])[:, None]
    hyperbolas = compressor.gain.reshape(2, 3) * np.hstack([factors, 1 / factors, 1 / factors])
    return replace(compressor, gain=hyperbolas.ravel())


def running(
    compressor: Compressor, source: Source, frequency: RealArray, gas_factor: float = 1.0
) -> Running:
    """Run a rigid compressor at many speeds.

    Parameters
    ----------
    compressor : Compressor
        With mounts in the state of operation, and with its hoses.
    source : Source
        What shakes it.
    frequency : array, shape (f,)
        Of the rotation [Hz].
    gas_factor : float
        On force and moment of the gas [1].

    Returns
    -------
    Running

    Notes
    -----
    ``Z(f, s) x = F`` with ``s_i`` the largest stroke of each mount: a fixed point per speed, taken
    half-way at a time, since near a resonance stiffness and stroke drive each other.
    """
    load = source.load(frequency, gas_factor)
    turning = source.gyroscopic(frequency)
    amplitudes = np.zeros((len(load), len(compressor.positions)))
    for _ in range(LARGEST_SWEEPS):
        factors = _factors(compressor, amplitudes)
        stiffness = compressor.dynamic_stiffness(frequency, factors) + turning
        displacement = np.asarray(
            np.linalg.solve(stiffness, load[:, :, None])[:, :, 0], dtype=np.complex128
        )
        seen = strokes(displacement @ compressor.mount_rows.T)
        settled = np.all(np.abs(seen - amplitudes) < AMPLITUDE_TOLERANCE)
        if settled or compressor.softening is None:
            return Running(load, stiffness, displacement, seen, factors)
        amplitudes = (amplitudes + seen) / 2
    raise ArithmeticError("the amplitudes of a running compressor do not settle")


def strokes(displacement: ComplexArray) -> RealArray:
    """Largest length over a turn of vectors that each go round an ellipse.

    Parameters
    ----------
    displacement : array, shape (f, 3 n)
        Complex amplitudes, three rows per vector [m].

    Returns
    -------
    array, shape (f, n)
        [m].

    Notes
    -----
    ``|Re(x e^{jφ})|² = (x*·x + Re(e^{2jφ} x·x))/2`` is largest at ``(|x|² + |x·x|)/2``.
    """
    vectors = displacement.reshape(len(displacement), -1, 3)
    squares = np.sum(np.abs(vectors) ** 2, axis=2) + np.abs(np.sum(vectors**2, axis=2))
    return np.asarray(np.sqrt(squares / 2))


def _factors(compressor: Compressor, amplitudes: RealArray) -> RealArray:
    if compressor.softening is None:
        return np.ones_like(amplitudes)
    return compressor.softening.factor(amplitudes)
