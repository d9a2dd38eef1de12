"""How well noise transfer functions are known, from measuring them in two ways."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement.channels import Frf

DB_PER_NEPER = 20.0 / np.log(10.0)

SWEEPS = 50
"""Of the most likely variance; it converges within ten."""

TINY = 1e-12
"""Of the magnitude around: below, a function has no phase [1]."""

WINDOW = 3.0
"""Standard deviation of the window of `local_magnitude`: about a resonance of a body [Hz]."""


@dataclass(frozen=True)
class MethodDifference:
    """Errors of the mean of two methods, such as hammer and loudspeaker.

    Parameters
    ----------
    calibration_db : float
        Level common to all paths of a vehicle, standard deviation [dB].
    calibration_degrees_of_freedom : int
        Vehicles behind it.
    body : float
        Smooth complex error that all paths of a vehicle share, root mean square [1].
    body_length : float
        Correlation length of that error over frequency [Hz].
    path : float
        Smooth complex error of every path over its local magnitude, root mean square [1].
    path_degrees_of_freedom : int
        Paths of all vehicles behind it.
    length : float
        Correlation length of that error over frequency [Hz].
    floor : float
        White noise of the real and of the imaginary part [unit of the functions].
    """

    calibration_db: float
    calibration_degrees_of_freedom: int
    body: float
    body_length: float
    path: float
    path_degrees_of_freedom: int
    length: float
    floor: float


def local_magnitude(values: ComplexArray, frequency: RealArray) -> RealArray:
    """Return the root mean square of |Y| around each line.

    An error of place, or another day, moves an antiresonance and does not scale what is left in it:
    errors go with the magnitude around.

    Parameters
    ----------
    values : array, shape (..., n_frequency, n_path)
        Transfer functions.
    frequency : array, shape (n_frequency,)
        [Hz].

    Returns
    -------
    array, of the shape of `values`
        With a gaussian window of `WINDOW`, normalised at the ends of the band.
    """
    distance = (frequency[:, np.newaxis] - frequency) / WINDOW
    weight = np.exp(-(distance**2) / 2.0)
    weight /= weight.sum(axis=1, keepdims=True)
    return np.asarray(np.sqrt(weight @ np.abs(values) ** 2))


def method_difference(pairs: Sequence[tuple[Frf, Frf]]) -> MethodDifference:
    """Estimate the errors of noise transfer functions from two measurements per vehicle.

    Parameters
    ----------
    pairs : sequence of (Frf, Frf)
        Of each vehicle: one ear, the same paths and lines, by two methods with errors of the same
        size and independent of each other [Pa/N].

    Returns
    -------
    MethodDifference
        Of the mean of both.

    Raises
    ------
    InputError
        No pair, functions that differ in ears, paths or lines; fewer than two paths or five lines;
        a path without any answer.

    Notes
    -----
    Half of the difference, ``h = (A - B)/2``, errs as the mean M of both does. Calibration: the
    mean over paths of ``Re Σ h M* / Σ |M|²``, taken about 0: neither method is louder on average.
    Floor: from second differences along the lines, which smooth errors do not reach, with the
    median that outliers do not reach. The rest over `local_magnitude`, turned into the phase of M,
    is e, with ``|e|² ≈ c + p + n``: n of the floor is known; c, of the body, multiplies all paths
    as another damping does, so it is the mean product of different paths; p, of the path, is what
    remains. All means have the weights ``1/(v + n)²`` of the most likely common variance v of
    complex normal errors, ``Σ (|e|² - v - n)/(v + n)² = 0``, so that paths in the noise hardly
    count. The integral of a correlation over the lag, which rules sums over lines, gives the
    lengths. What both methods have in common, such as the virtual point of a mount, does not show;
    and the mean of an error over the band counts as calibration. Valid where smooth errors last ten
    lines or more: else a part of them counts as floor.
    """
    middle, half = _checked(pairs)
    frequency = pairs[0][0].frequency
    energy = np.sum(np.abs(middle) ** 2, axis=1)
    per_path = np.sum(half * middle.conj(), axis=1).real / energy
    common = per_path.mean(axis=1)
    rest = half - common[:, np.newaxis, np.newaxis] * middle
    second = rest[:, 2:] - 2.0 * rest[:, 1:-1] + rest[:, :-2]
    # |z|² of complex noise is exponential, its median ln 2 times its mean; 1 + 4 + 1 of them
    white = float(np.median(np.abs(second) ** 2)) / np.log(2.0) / 6.0
    magnitude = local_magnitude(middle, frequency)
    # in the direction of each function itself, as a factor changes it
    error = rest / magnitude * middle.conj() / np.maximum(np.abs(middle), TINY * magnitude)
    noise, gain = white / magnitude**2, np.abs(middle) / magnitude
    total = _power_beside_noise(np.abs(error) ** 2, noise)
    weight = 1.0 / (total + noise) if total > 0.0 else np.ones_like(noise)
    lags = range(error.shape[1] - 1)
    between = np.array(
        [_between_paths(weight * error, lag) / _between_paths(weight * gain, lag) for lag in lags]
    )
    body = max(float(between[0]), 0.0)
    within = np.array(
        [
            (_within(weight * error, lag) - between[lag] * _within(weight * gain, lag))
            / _within(weight, lag)
            for lag in lags
        ]
    )
    floor = float(np.sum(weight**2 * noise) / np.sum(weight**2))
    own = max(float(within[0]) - floor, 0.0)
    step = float(np.median(np.diff(frequency)))
    return MethodDifference(
        calibration_db=float(DB_PER_NEPER * np.sqrt(np.mean(common**2))),
        calibration_degrees_of_freedom=len(pairs),
        body=float(np.sqrt(body)),
        body_length=_length(between, body, step),
        path=float(np.sqrt(own)),
        path_degrees_of_freedom=error.shape[0] * error.shape[2],
        length=_length(within, own, step),
        floor=float(np.sqrt(white / 2.0)),
    )


def _checked(pairs: Sequence[tuple[Frf, Frf]]) -> tuple[ComplexArray, ComplexArray]:
    """Mean and half difference of both methods, (n_vehicle, n_frequency, n_path)."""
    if not pairs:
        raise InputError("no pair of transfer functions to compare: give at least one vehicle")
    first = pairs[0][0]
    for number, pair in enumerate(pairs, 1):
        for frf in pair:
            same = frf.outputs == first.outputs and frf.inputs == first.inputs
            if not (same and np.array_equal(frf.frequency, first.frequency)):
                raise InputError(
                    f"vehicle {number}: its two transfer functions differ in ear, paths or lines "
                    "from each other or from those of the first vehicle: select() the same ones"
                )
    if len(first.outputs) != 1 or len(first.inputs) < 2 or first.frequency.size < 5:
        raise InputError("one ear, at least two paths and five lines are needed to part errors")
    both = np.stack([np.stack([one.values[:, 0], two.values[:, 0]]) for one, two in pairs])
    middle, half = both.mean(axis=1), (both[:, 0] - both[:, 1]) / 2.0
    if not np.all(np.any(middle != 0.0, axis=1)):
        raise InputError("a path without any answer at the ear: leave it out")
    return middle, half


def _power_beside_noise(squared: RealArray, noise: RealArray) -> float:
    """Return the most likely common variance of complex errors beside a known one of each."""
    power = float(np.median(squared))
    for _ in range(SWEEPS):
        weight = 1.0 / (power + noise) ** 2 if power > 0.0 else np.ones_like(noise)
        power = max(float(np.sum(weight * (squared - noise)) / np.sum(weight)), 0.0)
    return power


def _between_paths(values: ComplexArray | RealArray, lag: int) -> float:
    """Sum of the products of different paths of a vehicle, lines apart by a lag."""
    one, other = values[:, lag:], values[:, : values.shape[1] - lag].conj()
    every = one.sum(axis=2) * other.sum(axis=2)
    return float(np.real(every.sum() - np.sum(one * other)))


def _within(values: ComplexArray | RealArray, lag: int) -> float:
    """Sum of the products of the same path."""
    return float(np.real(np.sum(values[:, lag:] * values[:, : values.shape[1] - lag].conj())))


def _length(covariance: RealArray, power: float, step: float) -> float:
    """Length of the gaussian correlation with the same integral, to its first zero [Hz]."""
    total = 0.5
    for value in covariance[1:]:
        if power == 0.0 or value <= 0.0:
            break
        total += min(value / power, 1.0)
    return float(2.0 * total * step / np.sqrt(2.0 * np.pi))
