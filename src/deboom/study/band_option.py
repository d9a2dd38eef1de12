"""A band of frequencies as it is typed."""

from __future__ import annotations

import math

from deboom.errors import InputError


def band_of(text: str) -> tuple[float, float]:
    """Read ``10-30`` [Hz].

    Raises
    ------
    InputError
        Not two numbers with a dash between, or a band that does not rise from above 0 Hz.
    """
    try:
        low, high = (float(part) for part in text.split("-"))
    except ValueError:
        raise InputError(f"--band {text}: write it as LOW-HIGH in Hz, such as 10-30") from None
    if not (0 < low < high and math.isfinite(high)):
        raise InputError(f"--band {text}: the band must rise from above 0 Hz")
    return low, high
