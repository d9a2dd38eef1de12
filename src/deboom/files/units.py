"""Unit labels of files and their way into SI."""

from __future__ import annotations

from dataclasses import dataclass

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

    Parameters
    ----------
    label : str
        As it stands in the file, such as ``mm``.
    si : str
        The SI unit of the same quantity, such as ``m``.
    factor : float
        ``value [si] = factor · value [label]``.
    """

    label: str
    si: str
    factor: float


def parse_unit(label: str) -> Unit:
    """Return the unit that a label names.

    Parameters
    ----------
    label : str
        Such as ``mm``, ``N``, ``m/s^2`` or, as a ratio of two known units, ``Pa/N``.

    Returns
    -------
    Unit
        Its SI unit and factor.

    Raises
    ------
    InputError
        An unknown label, or none at all. A unit is never guessed.
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
