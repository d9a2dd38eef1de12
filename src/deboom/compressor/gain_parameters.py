"""Five numbers for the shape of a gain factor: its scale is left to the stiffness."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.gain import GainFactor, HyperbolicGain

GAIN_SHAPE_NAMES = ("ln rise", "ln slope", "loss limit", "ln loss rise", "ln loss slope")


def gain_from_parameters(values: npt.ArrayLike, reference: float) -> GainFactor:
    """Build the gain factor whose real part is 1 at the reference line.

    Parameters
    ----------
    values : array, shape (5,)
        In the order of `GAIN_SHAPE_NAMES` [1, ln Hz⁻¹, 1, 1, ln Hz⁻¹].
    reference : float
        Line at which the real part is 1 [Hz].

    Returns
    -------
    GainFactor

    Notes
    -----
    ``v' = 1 − A/(b f + 1) + A/(b f_ref + 1)``, ``v'' = c − A''/(b'' f + 1)`` with A, b, A'', b''
    positive for any values: `HyperbolicGain` written in numbers that no optimiser can make invalid.
    """
    rise, slope, loss_limit, loss_rise, loss_slope = (float(v) for v in np.asarray(values))
    at_reference = np.exp(slope) * reference + 1
    return GainFactor(
        HyperbolicGain(
            float(1 + np.exp(rise) / at_reference),
            float(np.exp(slope - rise)),
            float(np.exp(-rise)),
        ),
        HyperbolicGain(
            loss_limit, float(np.exp(loss_slope - loss_rise)), float(np.exp(-loss_rise))
        ),
    )


def gain_derivatives(
    values: npt.ArrayLike, reference: float, frequency: npt.ArrayLike
) -> ComplexArray:
    """Differentiate the gain of `gain_from_parameters`.

    Parameters
    ----------
    values, reference
        As there.
    frequency : array, shape (n_frequency,)
        [Hz].

    Returns
    -------
    array, shape (5, n_frequency)
        Complex, per unit of each parameter.
    """
    lines = np.asarray(frequency, dtype=float)
    numbers = np.asarray(values, dtype=float)
    rise, slope, loss_rise, loss_slope = np.exp(numbers[[0, 1, 3, 4]])
    here, there = slope * lines + 1, slope * reference + 1
    loss = loss_slope * lines + 1
    by_slope = slope * (lines / here**2 - reference / there**2)
    return np.stack(
        [
            rise * (1 / there - 1 / here) + 0j,
            rise * by_slope + 0j,
            np.full(lines.shape, 1j),
            -1j * loss_rise / loss,
            1j * loss_rise * loss_slope * lines / loss**2,
        ]
    )


def gain_parameters(gain: GainFactor, reference: float) -> RealArray:
    """Find the five numbers of a gain factor, whatever its scale.

    Parameters
    ----------
    gain : GainFactor
    reference : float
        Line at which the real part becomes 1 [Hz].

    Returns
    -------
    array, shape (5,)
        In the order of `GAIN_SHAPE_NAMES`.
    """
    scale = float(gain.real.at(reference))
    return np.array(
        [
            -np.log(gain.real.offset * scale),
            np.log(gain.real.slope / gain.real.offset),
            gain.imaginary.limit / scale,
            -np.log(gain.imaginary.offset * scale),
            np.log(gain.imaginary.slope / gain.imaginary.offset),
        ]
    )
