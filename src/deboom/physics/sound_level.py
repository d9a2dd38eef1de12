"""Sound pressure levels: A-weighting, the level of a line, and one number per curve.

Levels have shape (n_frequency, ...) and their frequency axis first, unless `axis` names another.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.interpolate import make_interp_spline

from deboom.arrays import RealArray
from deboom.errors import InputError

REFERENCE_PRESSURE = 2e-5
"""Reference of sound pressure levels, rms [Pa]."""
RUN_UP_SECONDS = 10.0
"""Time of a run-up from the first to the last frequency, unless another one is asked for [s]."""
RUN_UP_RATE = 44100
"""Samples of a run-up per second [Hz]."""
HEADROOM = 1.25
"""Full scale of run-ups over the largest pressure in them [1]."""

# IEC 61672-1, annex E: the poles of the A-weighting [Hz], to the digits that its defining
# relations give (the standard prints 20.60, 107.7, 737.9 and 12194).
_POLES = (20.598997057618316, 107.65264864304629, 737.8622307362901, 12194.217147998012)


def _amplitude_ratio(frequency: RealArray) -> RealArray:
    """R_A(f) of IEC 61672-1, not yet normalised to 1 kHz [1]."""
    squared = frequency**2
    first, second, third, fourth = (pole**2 for pole in _POLES)
    denominator = (
        (squared + first) * np.sqrt((squared + second) * (squared + third)) * (squared + fourth)
    )
    return np.asarray(fourth * squared**2 / denominator)


def a_weighting(frequency: npt.ArrayLike) -> RealArray:
    """Return the A-weighting of pure tones, to be added to the unweighted level [dB].

    Parameters
    ----------
    frequency : array_like, any shape
        The line's own frequency, not the nominal name of its band [Hz]; positive and finite, else
        InputError.

    Notes
    -----
    ``A(f) = 20 lg(R_A(f) / R_A(1000 Hz))`` with
    ``R_A = f4² f⁴ / ((f² + f1²) sqrt(f² + f2²) sqrt(f² + f3²) (f² + f4²))``, IEC 61672-1, annex E.
    The thesis (section 2.1) prints R_A itself, an amplitude ratio, and leaves the normalisation of
    2.00 dB out. The standard's table holds for the exact mid-band frequencies 1000·10^(n/10); at
    the nominal ones it is up to 0.28 dB away.
    """
    values = np.asarray(frequency, dtype=float)
    wrong = ~((values > 0) & np.isfinite(values))
    if wrong.any():
        raise InputError(
            f"the A-weighting of {values[wrong][0]} Hz does not exist: give positive, finite "
            "frequencies, without the line at 0 Hz"
        )
    at_1_khz = _amplitude_ratio(np.asarray(1000.0))
    return np.asarray(20 * np.log10(_amplitude_ratio(values) / at_1_khz))


def unweighted_level(pressure: npt.ArrayLike) -> RealArray:
    """Return the level of complex peak amplitudes [Pa], ``20 lg(|p| / (√2 · 20 µPa))`` [dB].

    Silence (exactly 0 Pa) is minus infinity.
    """
    with np.errstate(divide="ignore"):
        return np.asarray(20 * np.log10(np.abs(pressure) / (np.sqrt(2) * REFERENCE_PRESSURE)))


def spl(pressure: npt.ArrayLike, frequency: npt.ArrayLike, axis: int = 0) -> RealArray:
    """Return the A-weighted sound pressure level of each line [dB(A)].

    Parameters
    ----------
    pressure : array_like, shape (n_frequency, ...)
        Complex peak amplitudes [Pa]; exactly 0 Pa is minus infinity.
    frequency : array_like, shape (n_frequency,)
        Lines [Hz].
    axis : int
        Frequency axis of `pressure`.

    Returns
    -------
    array, shape of `pressure`
        Levels [dB(A)].

    Raises
    ------
    InputError
        A frequency axis of another length than `pressure` has, or of lines without a weighting.

    See Also
    --------
    deboom.BoomingModel, deboom.analyse_paths, deboom.Spectrum

    Notes
    -----
    ``SPL = 20 lg(|p| / (√2 · 20 µPa)) + A(f)``; what the thesis calls SPL_d in eq. 12 and 13 is the
    pressure p. A(f) is that of IEC 61672-1.

    Examples
    --------
    >>> import deboom
    >>> deboom.spl([1.0, 1.0], [30.0, 1000.0]).round(2)
    array([50.37, 90.97])
    """
    level = unweighted_level(pressure)
    weighting = a_weighting(frequency)
    _check_lines(level, weighting, axis)
    return np.moveaxis(np.moveaxis(level, axis, -1) + weighting, -1, axis)


# ISO 226:2003, table 1: threshold of hearing of pure tones, unweighted
_HEARD_FROM = {
    **{20.0: 78.5, 25.0: 68.7, 31.5: 59.5, 40.0: 51.1, 50.0: 44.0, 63.0: 37.5, 80.0: 31.5},
    **{100.0: 26.5, 125.0: 22.1, 160.0: 17.9, 200.0: 14.4, 250.0: 11.4, 315.0: 8.6, 400.0: 6.2},
    **{500.0: 4.4, 630.0: 3.0, 800.0: 2.2, 1000.0: 2.4},
}


def hearing_threshold(frequency: npt.ArrayLike) -> RealArray:
    """Return the level from which a tone is heard in silence by half of young listeners [dB(A)].

    Parameters
    ----------
    frequency : array_like, any shape
        From 20 to 1000 Hz [Hz]; below 20 Hz the threshold of 20 Hz counts, unweighted.

    Raises
    ------
    InputError
        A frequency above 1000 Hz, or without a weighting.

    Notes
    -----
    ISO 226:2003, table 1, between its frequencies linear over their logarithm, and the A-weighting
    of `a_weighting`. What lies below adds nothing to what anybody hears: a mean over lines that
    counts it follows notches.

    Examples
    --------
    >>> hearing_threshold([25.0, 100.0]).round(1)
    array([24. ,  7.4])
    """
    values = np.asarray(frequency, dtype=float)
    if np.any(values > max(_HEARD_FROM)):
        raise InputError(
            f"the threshold of hearing is known here up to {max(_HEARD_FROM):g} Hz, not at "
            f"{values.max():g} Hz"
        )
    lines, levels = np.array(list(_HEARD_FROM.items())).T
    weighting = a_weighting(values)
    return np.asarray(np.interp(np.log(values), np.log(lines), levels) + weighting)


def splv(level: npt.ArrayLike, axis: int = 0) -> RealArray:
    """Return the sum of the levels over the lines of the band, ``SPLV = Σ_p SPL(f_p)`` [dB(A)].

    Notes
    -----
    Thesis, eq. 35, over 20 to 60 Hz. It grows with the number of lines; see `mean_level`. A sum of
    decibels: a fall of 1 dB counts the same in a notch and at a peak. `energy_sum` and `peak_level`
    rank vehicles and designs otherwise.
    """
    return np.asarray(np.sum(np.asarray(level, dtype=float), axis=axis))


def mean_level(level: npt.ArrayLike, axis: int = 0) -> RealArray:
    """Return the mean of the levels over the lines, SPLV over the number of lines [dB(A)]."""
    return np.asarray(np.mean(np.asarray(level, dtype=float), axis=axis))


def energy_sum(level: npt.ArrayLike, axis: int = 0) -> RealArray:
    """Return the level of the summed energy of the lines, ``10 lg Σ_p 10^(L_p / 10)`` [dB].

    Minus infinity if all lines are silent. Of the lines of an engine order, which stand for
    different engine speeds, the sum is no sound that anybody hears at once: use differences.
    """
    with np.errstate(divide="ignore"):
        energy = np.sum(10 ** (np.asarray(level, dtype=float) / 10), axis=axis)
        return np.asarray(10 * np.log10(energy))


def peak_level(level: npt.ArrayLike, axis: int = 0) -> RealArray:
    """Return the highest level of the lines [dB]."""
    return np.asarray(np.max(np.asarray(level, dtype=float), axis=axis))


def band_energy_level(
    level: npt.ArrayLike,
    frequency: npt.ArrayLike,
    band: tuple[float, float],
    axis: int = 0,
) -> RealArray:
    """Return the energy sum of the lines of one band, both edges included [dB].

    Raises InputError: a band [Hz] without a line, or a frequency axis of another length than
    `level` has.
    """
    levels, lines = np.asarray(level, dtype=float), np.asarray(frequency, dtype=float)
    _check_lines(levels, lines, axis)
    inside = (lines >= band[0]) & (lines <= band[1])
    if not inside.any():
        raise InputError(
            f"no line between {band[0]} and {band[1]} Hz: give a band inside the measured "
            f"{lines.min()} to {lines.max()} Hz, lower edge first"
        )
    return energy_sum(np.compress(inside, levels, axis=axis), axis=axis)


def _check_lines(level: RealArray, lines: RealArray, axis: int) -> None:
    if lines.ndim != 1 or level.shape[axis] != lines.size:
        raise InputError(
            f"axis {axis} of shape {level.shape} is not a frequency axis of shape {lines.shape}: "
            "give the axis that holds the lines"
        )


def run_up_sound(
    pressure: npt.ArrayLike, frequency: npt.ArrayLike, seconds: float, rate: float
) -> RealArray:
    """Return the sound of one engine order while the speed rises evenly [Pa].

    Parameters
    ----------
    pressure : array_like, shape (n_frequency, ...) — complex peak amplitudes of the order [Pa]
    frequency : array_like, shape (n_frequency,) — rising lines of the order [Hz]
    seconds : float — time from the first line to the last [s]
    rate : float — samples per second, above four times the last line [Hz]

    Returns
    -------
    array, shape (n_sample, ...)
        Sound pressure from the first line to the last, nothing beyond.

    Raises
    ------
    InputError
        Lines that do not rise, another number of pressures, a time or rate too small.

    Notes
    -----
    ``p(t) = Re{P(f(t)) e^{jφ(t)}}`` with ``f(t) = f_1 + (f_n − f_1) t/T`` and ``φ = 2π ∫ f dt``, so
    that the phase is continuous; P is interpolated linearly between the lines. Slow enough that
    the structure is in steady state: each resonance takes its time in the measured run, too.
    """
    lines, values = np.asarray(frequency, dtype=float), np.asarray(pressure, dtype=complex)
    _check_lines(np.abs(values), lines, 0)
    if lines.size < 2 or not np.all(np.diff(lines) > 0):
        raise InputError("a run-up needs two lines or more, in rising order")
    if not (seconds > 0 and rate > 4 * lines[-1]):
        raise InputError(
            f"{seconds:g} s at {rate:g} samples a second: give a time above 0 and more than "
            f"{4 * lines[-1]:g} samples a second"
        )
    time = np.arange(round(seconds * rate)) / rate
    slope = (lines[-1] - lines[0]) / seconds
    phase = 2 * np.pi * (lines[0] * time + slope * time**2 / 2)
    amplitude = make_interp_spline(lines, values, k=1, axis=0)(lines[0] + slope * time)
    turn = np.exp(1j * phase).reshape(-1, *(1,) * (values.ndim - 1))
    return np.asarray((amplitude * turn).real)


def full_scale(pressure: npt.ArrayLike) -> float:
    """Return the full scale of run-ups that shall be compared by ear, whatever their length [Pa].

    - `pressure`: complex peak amplitudes of all lines of all of them [Pa].
    """
    return HEADROOM * float(np.abs(np.asarray(pressure)).max())
