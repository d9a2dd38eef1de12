"""Units of files and their way into SI, and the magnitudes that quantities have in a car."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError

_TO_SI: dict[str, tuple[str, float]] = {
    "1": ("1", 1.0),
    "%": ("1", 1e-2),
    "m": ("m", 1.0),
    "mm": ("m", 1e-3),
    "um": ("m", 1e-6),
    "m^2": ("m^2", 1.0),
    "cm^2": ("m^2", 1e-4),
    "m/s": ("m/s", 1.0),
    "mm/s": ("m/s", 1e-3),
    "m/s^2": ("m/s^2", 1.0),
    "m/s2": ("m/s^2", 1.0),
    "mm/s^2": ("m/s^2", 1e-3),
    "g": ("m/s^2", 9.80665),
    "rad": ("rad", 1.0),
    "rad/s": ("rad/s", 1.0),
    "rad/s^2": ("rad/s^2", 1.0),
    "N": ("N", 1.0),
    "kN": ("N", 1e3),
    "N m": ("N m", 1.0),
    "Nm": ("N m", 1.0),
    "N/m": ("N/m", 1.0),
    "N/mm": ("N/m", 1e3),
    "kg": ("kg", 1.0),
    "Pa": ("Pa", 1.0),
    "kPa": ("Pa", 1e3),
    "Hz": ("Hz", 1.0),
    "s": ("s", 1.0),
    "ms": ("s", 1e-3),
    "rpm": ("rpm", 1.0),
    "dB(A)": ("dB(A)", 1.0),
}
_SPELLING = str.maketrans({"µ": "u", "μ": "u", "²": "^2", "·": " ", "*": " "})


@dataclass(frozen=True)
class Unit:
    """A unit label and its way into SI.

    - `label`: as it stands in the file, such as ``mm``.
    - `si`: the SI unit of the same quantity, such as ``m``.
    - `factor`: ``value [si] = factor · value [label]``.
    """

    label: str
    si: str
    factor: float


def parse_unit(label: str) -> Unit:
    """Return the unit that a label names.

    - `label`: such as ``mm``, ``N``, ``m/s^2`` or, as a ratio of two known units, ``Pa/N``.
    - returns: its SI unit and factor.
    - raises InputError: an unknown label, or none at all. A unit is never guessed.
    """
    text = " ".join(label.translate(_SPELLING).split())
    if text in _TO_SI:
        return Unit(label, *_TO_SI[text])
    numerator, _, denominator = text.partition("/")
    if numerator in _TO_SI and denominator in _TO_SI:
        (above, factor_above), (below, factor_below) = _TO_SI[numerator], _TO_SI[denominator]
        return Unit(label, f"{above}/{below}", factor_above / factor_below)
    if not text:
        raise InputError("a unit is missing: write one, such as mm, N or Pa/N")
    raise InputError(
        f"unknown unit {label!r}: use one of {', '.join(_TO_SI)} or a ratio of two, such as Pa/N"
    )


@dataclass(frozen=True)
class Range:
    """Magnitudes that a quantity has in a car.

    - `unit`: SI unit of the limits.
    - `usual`: limits between which it lies as a rule.
    - `largest`: limit above which its unit or the file is wrong.
    - `shown`, `factor`: unit in which it is shown, and the factor to it.
    """

    unit: str
    usual: tuple[float, float]
    largest: float
    shown: str
    factor: float = 1.0

    def sentence(self, lowest: float, highest: float) -> str:
        """Return magnitudes beside the usual ones, and a warning where they lie outside."""
        low, high = (self.factor * limit for limit in self.usual)
        text = f"{self.factor * lowest:.3g} to {self.factor * highest:.3g} {self.shown}"
        wrong = lowest < self.usual[0] or highest > self.usual[1]
        warning = "; WARNING, unusual: is a unit wrong?" if wrong else ""
        return f"{text} (usual {low:g} to {high:g}){warning}"


RANGES = {
    "position": Range("m", (0.0, 5.0), 50.0, "m"),
    "displacement": Range("m", (1e-9, 5e-3), 10.0, "mm", 1e3),
    "force": Range("N", (1e-3, 1e4), 1e8, "N"),
    "acceleration": Range("m/s^2", (1e-6, 1e3), 1e7, "m/s²"),
    "pressure": Range("Pa", (1e-7, 1e2), 1e6, "Pa"),
    "noise transfer function": Range("Pa/N", (1e-6, 0.3), 1e4, "Pa/N"),
    "stiffness": Range("N/m", (5e3, 2e7), 1e12, "N/mm", 1e-3),
    "engine torque": Range("N m", (0.0, 1500.0), 1e5, "N m"),
    "level": Range("dB(A)", (10.0, 110.0), 200.0, "dB(A)"),
}
"""Quantity → its range, the one table of them."""


def refuse_beyond(quantity: str, values: npt.ArrayLike) -> None:
    """Refuse magnitudes that no car has.

    - `quantity`: key of `RANGES`.
    - `values`: finite values of any shape, in SI.
    - raises InputError: the largest magnitude is above the limit.
    """
    size, limit = float(np.max(np.abs(values), initial=0.0)), RANGES[quantity]
    if size > limit.largest:
        raise InputError(
            f"its {quantity} is up to {size:.3g} {limit.unit}, and none is above "
            f"{limit.largest:g} {limit.unit}: is the unit right?"
        )
