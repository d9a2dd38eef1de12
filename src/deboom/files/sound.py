"""Run-ups as WAV files, of one full scale for all that shall be compared."""

from __future__ import annotations

import io

import numpy as np
from scipy.io import wavfile
from scipy.signal.windows import tukey

from deboom.arrays import ComplexArray, RealArray
from deboom.physics.sound_level import full_scale, run_up_sound

FADE_S = 0.05
"""Fading in and out, against clicks at both ends [s]."""


def run_up_files(
    pressure: ComplexArray, frequency: RealArray, seconds: float, rate: int
) -> tuple[list[bytes], float]:
    """Return the run-ups of one order as WAV files, and their common full scale.

    Parameters
    ----------
    pressure : array, shape (n, n_frequency)
        Complex peak amplitudes of the order, a row for each file [Pa].
    frequency : array, shape (n_frequency,)
        Rising lines of the order [Hz].
    seconds : float
        Time from the first line to the last [s].
    rate : int
        Samples per second [Hz].

    Returns
    -------
    list of bytes, float
        A WAV file of 16 bit for each row, and the pressure that its full scale means [Pa].

    Raises
    ------
    InputError
        See `deboom.physics.sound_level.run_up_sound`.

    Examples
    --------
    >>> import numpy as np
    >>> files, scale = run_up_files(np.ones((1, 2)), np.array([20.0, 60.0]), 1.0, 8000)
    >>> files[0][:4], round(scale, 2)
    (b'RIFF', 1.25)
    """
    sounds = run_up_sound(np.asarray(pressure).T, frequency, seconds, rate)
    fade = tukey(len(sounds), 2 * FADE_S / seconds)
    scale = full_scale(sounds)
    return [_wav(fade * sound / (scale or 1.0), rate) for sound in sounds.T], scale


def _wav(signal: RealArray, rate: int) -> bytes:
    """Write a signal between −1 and 1 as 16 bit."""
    stream = io.BytesIO()
    wavfile.write(stream, rate, np.round(32767 * signal).astype(np.int16))
    return stream.getvalue()
