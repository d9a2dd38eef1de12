"""Run-ups as WAV files, of one full scale for all that shall be compared."""

from __future__ import annotations

import io

import numpy as np
from scipy.io import wavfile
from scipy.signal.windows import tukey

from deboom.arrays import ComplexArray, RealArray
from deboom.physics.sound_level import run_up_sound

FADE_S = 0.05
"""Fading in and out, against clicks at both ends [s]."""


def run_up_files(
    pressure: ComplexArray, frequency: RealArray, seconds: float, rate: int, scale: float
) -> list[bytes]:
    """Return the run-ups of one order as WAV files.

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
    scale : float
        Full scale, see `deboom.physics.sound_level.full_scale` [Pa].

    Returns
    -------
    list of bytes
        A WAV file of 16 bit for each row.

    Raises
    ------
    InputError
        See `deboom.physics.sound_level.run_up_sound`.

    Examples
    --------
    >>> import numpy as np
    >>> files = run_up_files(np.ones((1, 2)), np.array([20.0, 60.0]), 1.0, 8000, scale=1.25)
    >>> files[0][:4]
    b'RIFF'
    """
    sounds = run_up_sound(np.asarray(pressure).T, frequency, seconds, rate)
    fade = tukey(len(sounds), 2 * FADE_S / seconds)
    return [_wav(fade * sound / (scale or 1.0), rate) for sound in sounds.T]


def _wav(signal: RealArray, rate: int) -> bytes:
    """Write a signal between −1 and 1 as 16 bit."""
    stream = io.BytesIO()
    wavfile.write(stream, rate, np.round(32767 * signal).astype(np.int16))
    return stream.getvalue()
