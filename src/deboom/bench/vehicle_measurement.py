"""Noise transfer functions as they are measured in a vehicle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import ComplexArray


@dataclass(frozen=True)
class TransferErrors:
    """Errors of a reciprocal measurement of noise transfer functions.

    Parameters
    ----------
    calibration_db : float
        Standard deviation of the source's level, common to all paths of a vehicle [dB].
    relative : float
        RMS of the smooth complex error per path: position, direction [1].
    floor : float
        Of the real and of the imaginary part [Pa/N].
    n_ripple : int
        Cosines over the band that make up the smooth error.
    """

    calibration_db: float = 0.5
    relative: float = 0.05
    floor: float = 2e-5
    n_ripple: int = 6


def measured_noise_transfer(
    true: ComplexArray, errors: TransferErrors, generator: np.random.Generator
) -> ComplexArray:
    """Measure the noise transfer functions of one vehicle.

    Parameters
    ----------
    true : array, shape (f, n_path)
        [Pa/N].
    errors : TransferErrors
        How well it is measured.
    generator : Generator
        Draws the errors.

    Returns
    -------
    array, shape (f, n_path)
        [Pa/N].
    """
    n_line, n_path = true.shape
    calibration = 10 ** (generator.normal(0, errors.calibration_db) / 20)
    place = np.linspace(0, 1, n_line)
    ripples = np.cos(np.pi * np.outer(place, np.arange(errors.n_ripple)))
    smooth = ripples @ _complex_normal((errors.n_ripple, n_path), generator)
    smooth = smooth / np.sqrt(2 * errors.n_ripple)
    floor = errors.floor * _complex_normal((n_line, n_path), generator)
    measured: ComplexArray = true * calibration * (1 + errors.relative * smooth) + floor
    return measured


def _complex_normal(shape: tuple[int, int], generator: np.random.Generator) -> ComplexArray:
    """Draw standard-normal real and imaginary parts."""
    return np.asarray(generator.normal(size=shape) + 1j * generator.normal(size=shape))
