"""Loudness and roughness of recorded sound, by MoSQITo."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from scipy.signal import resample_poly

from deboom.arrays import RealArray
from deboom.errors import InputError

RATE = 48_000
"""Samples per second that both methods are stated for [Hz]."""
LONGEST_SECONDS = 60.0
"""Longest recording that is judged; the methods take about as long as it lasts [s]."""
SHORTEST_SECONDS = 1.0
"""Shortest recording that is judged [s]."""


@dataclass(frozen=True)
class SoundQuality:
    """How loud and how rough a recording is heard.

    - `loudness`: exceeded in 5 % of the time, N5 [sone].
    - `roughness`: mean over the recording [asper].
    """

    loudness: float
    roughness: float


def sound_quality(pressure: RealArray, rate: float) -> SoundQuality:
    """Return loudness and roughness of a recorded sound pressure.

    Parameters
    ----------
    pressure : array, shape (n_sample,)
        Sound pressure [Pa].
    rate : float
        Samples per second [Hz]; other rates than 48 000 are resampled.

    Returns
    -------
    SoundQuality
        Loudness N5 of ISO 532-1:2017 (Zwicker, varying in time, free field) and roughness by Daniel
        and Weber, "Psychoacoustical roughness", Acustica 83, 1997.

    Raises
    ------
    InputError
        MoSQITo is not installed; a recording shorter than a second or longer than a minute.

    Notes
    -----
    ISO 532-1 begins with the third octave at 25 Hz: what lies below 22 Hz is not heard by it. A
    recording of a low rate has nothing above its own band, and is judged without it.
    """
    seconds = len(pressure) / rate
    if not SHORTEST_SECONDS <= seconds <= LONGEST_SECONDS:
        raise InputError(
            f"loudness is told of recordings of {SHORTEST_SECONDS:g} to {LONGEST_SECONDS:g} s, and "
            f"this one has {seconds:.2g} s: cut it"
        )
    try:
        from mosqito.sq_metrics.loudness.loudness_zwtv.loudness_zwtv import loudness_zwtv
        from mosqito.sq_metrics.roughness.roughness_dw.roughness_dw import roughness_dw
    except ImportError as error:
        raise InputError(
            "loudness and roughness need MoSQITo: pip install 'deboom[sound-quality]'"
        ) from error
    ratio = Fraction(RATE / rate).limit_denominator(10_000)
    sound = np.asarray(pressure, dtype=float)
    sound = resample_poly(sound, ratio.numerator, ratio.denominator) if ratio != 1 else sound
    loudness, *_ = loudness_zwtv(sound, RATE)
    roughness, *_ = roughness_dw(sound, RATE, overlap=0)
    return SoundQuality(float(np.percentile(loudness, 95)), float(np.mean(roughness)))
