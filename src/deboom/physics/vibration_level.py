"""Vibration levels: weightings for people who sit or hold a wheel, and references."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.errors import InputError

REFERENCES: Mapping[str, float] = {"acceleration": 1e-6, "velocity": 1e-9, "displacement": 1e-12}
"""References of vibration levels, rms, ISO 1683 [m/s², m/s, m]."""

# band limits f1, f2, transition f3 = f4 with its quality Q4, and the step f5, Q5, f6, Q6
# where there is one [Hz, 1]; the quality of both band limits is 1/√2
_PARAMETERS: Mapping[str, tuple[float, ...]] = {
    "Wk": (0.4, 100.0, 12.5, 0.63, 2.37, 0.91, 3.35, 0.91),
    "Wd": (0.4, 100.0, 2.0, 0.63),
    "Wh": (10.0**0.8, 10.0**3.1, 100.0 / (2.0 * np.pi), 0.64),
}
WEIGHTINGS = tuple(_PARAMETERS)
"""``Wk`` (seat, vertical) and ``Wd`` (seat, horizontal) of ISO 2631-1, ``Wh`` (hand) of ISO 5349-1.
"""


def human_weighting(name: str, frequency: npt.ArrayLike) -> RealArray:
    """Return what a weighting for people multiplies accelerations by [1].

    Parameters
    ----------
    name : str
        One of `WEIGHTINGS`.
    frequency : array_like, any shape
        Lines, above 0 [Hz].

    Raises
    ------
    InputError
        Another name; a frequency that is not above 0 and finite.

    Notes
    -----
    Magnitude of the product of a high and a low pass, of the transition from acceleration to
    velocity ``(1 + s/ω3) / (1 + s/(Q4 ω3) + (s/ω3)²)``, and of W_k's step ``(f5/f6)²
    (1 + s/(Q5 ω5) + (s/ω5)²) / (1 + s/(Q6 ω6) + (s/ω6)²)``. Parameters are those of ISO 8041, as
    table 3.1 of the reference manual of the Larson Davis HVM200 quotes them. They meet table 3 of
    ISO 2631-1 (at the nominal frequencies) and table A.2 of ISO 5349-1 (at the exact ones) within
    1 %.

    Examples
    --------
    >>> human_weighting("Wk", [8.0, 25.0]).round(2)
    array([1.04, 0.51])
    """
    if name not in _PARAMETERS:
        raise InputError(f"there is no weighting '{name}': take one of {', '.join(WEIGHTINGS)}")
    lines = np.asarray(frequency, dtype=float)
    if not np.all((lines > 0.0) & np.isfinite(lines)):
        raise InputError(f"the weighting {name} needs frequencies above 0 Hz: leave out others")
    low, high, transition, quality, *step = _PARAMETERS[name]
    s = 1j * lines
    factor = (1.0 + s / transition) / _second_order(s / transition, quality)
    factor = factor / _second_order(low / s, np.sqrt(0.5)) / _second_order(s / high, np.sqrt(0.5))
    if step:
        f5, q5, f6, q6 = step
        factor = factor * (f5 / f6) ** 2 * _second_order(s / f5, q5) / _second_order(s / f6, q6)
    return np.abs(factor)


def rms_of_level(level: npt.ArrayLike, quantity: str) -> RealArray:
    """Return the rms amplitude of a vibration level [m/s², m/s or m].

    - `level`: of any shape, ``20 lg(rms / reference)`` [dB].
    - `quantity`: one of `REFERENCES`.
    """
    return np.asarray(REFERENCES[quantity] * 10.0 ** (np.asarray(level, dtype=float) / 20.0))


def _second_order(ratio: npt.NDArray[np.complex128], quality: float) -> npt.NDArray[np.complex128]:
    return np.asarray(1.0 + ratio / quality + ratio**2)
