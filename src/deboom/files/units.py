"""Units of files and their way into SI, and the magnitudes that quantities have in a car."""

from __future__ import annotations

import itertools
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError

STANDARD_GRAVITY = 9.80665
"""Acceleration that the label ``g`` stands for [m/s²]."""
_INCH, _FOOT, _POUND, _DEGREE = 0.0254, 0.3048, 0.45359237, np.pi / 180.0
_POUND_FORCE = _POUND * STANDARD_GRAVITY

UNITS: Mapping[str, Mapping[str, float]] = {
    "1": {"1": 1.0, "-": 1.0, "%": 1e-2},
    "m": {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "in": _INCH, "ft": _FOOT, "mil": 2.54e-5},
    "m^2": {"m^2": 1.0, "cm^2": 1e-4, "mm^2": 1e-6},
    "m/s": {
        **{"m/s": 1.0, "mm/s": 1e-3, "cm/s": 1e-2, "in/s": _INCH, "ft/s": _FOOT},
        **{"km/h": 1 / 3.6, "mph": 0.44704},
    },
    "m/s^2": {
        **{"m/s^2": 1.0, "mm/s^2": 1e-3, "cm/s^2": 1e-2, "in/s^2": _INCH, "ft/s^2": _FOOT},
        **{"g": STANDARD_GRAVITY},
    },
    "rad": {"rad": 1.0, "deg": _DEGREE},
    "rad/s": {"rad/s": 1.0, "deg/s": _DEGREE},
    "rad/s^2": {"rad/s^2": 1.0, "deg/s^2": _DEGREE},
    "N": {
        **{"N": 1.0, "mN": 1e-3, "daN": 10.0, "kN": 1e3, "lbf": _POUND_FORCE},
        **{"kgf": STANDARD_GRAVITY},
    },
    "N m": {
        **{"N m": 1.0, "N mm": 1e-3, "kN m": 1e3},
        **{"lbf ft": _POUND_FORCE * _FOOT, "lbf in": _POUND_FORCE * _INCH},
    },
    "N/m": {"N/m": 1.0, "N/mm": 1e3},
    "N s/m": {"N s/m": 1.0, "N s/mm": 1e3},
    "kg": {"kg": 1.0, "t": 1e3, "lbm": _POUND},
    "Pa": {
        **{"Pa": 1.0, "uPa": 1e-6, "mPa": 1e-3, "hPa": 1e2, "kPa": 1e3, "MPa": 1e6},
        **{"mbar": 1e2, "bar": 1e5, "psi": _POUND_FORCE / _INCH**2},
    },
    "Hz": {"Hz": 1.0, "kHz": 1e3},
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0},
    "rpm": {"rpm": 1.0, "1/min": 1.0},
    "dB(A)": {"dB(A)": 1.0},
}
"""SI unit → labels that files may use and what each is in it: the one table of units."""
_TO_SI = {label: (si, each) for si, labels in UNITS.items() for label, each in labels.items()}
SEVERAL_MEANINGS: Mapping[str, Mapping[str, float]] = {
    "g": {"m/s^2": STANDARD_GRAVITY, "kg": 1e-3},
    "mg": {"m/s^2": 1e-3 * STANDARD_GRAVITY, "kg": 1e-6},
    "G": {"m/s^2": STANDARD_GRAVITY, "T": 1e-4},
    "lb": {"kg": _POUND, "N": _POUND_FORCE},
    "nm": {"m": 1e-9, "N m": 1.0},
    "kn": {"N": 1e3, "m/s": 1852 / 3600},
    "1/s": {"Hz": 1.0, "rad/s": 1.0},
    '"': {"m": _INCH, "rad": _DEGREE / 3600},
}
"""Label → its meanings, of which the quantity takes one; ``g`` alone is the acceleration."""
_WORDS = {
    word: label
    for label, words in {
        "N": "newton newtons Newton Newtons NEWTON NEWTONS",
        "m": "meter meters metre metres Meter Meters Metre",
        "mm": "millimeter millimetre millimeters millimetres",
        "um": "micron microns micrometer micrometre",
        "in": "inch inches Inch",
        "ft": "foot feet",
        "mil": "mils",
        "s": "sec second seconds Second Seconds",
        "ms": "msec millisecond milliseconds",
        "min": "minute minutes Min MIN",
        "g": "gn g_n g0 gs g's grav gee",
        "lb": "lbs",
        "lbf": "LBF Lbf lbsf lb_f",
        "kgf": "kp kg_f",
        "Pa": "pascal pascals Pascal Pascals",
        "uPa": "micropascal",
        "Hz": "hz HZ hertz Hertz cps",
        "kHz": "khz KHz KHZ",
        "deg": "degree degrees Grad",
        "rad": "radian radians",
        "rpm": "RPM Rpm upm Upm UPM",
        "N m": "Nm",
        "N mm": "Nmm",
        "kN m": "kNm",
        "N s": "Ns",
    }.items()
    for word in words.split()
}
_WHOLE = {
    **dict.fromkeys(("rev/min", "r/min", "U/min", "Upm"), "rpm"),
    **dict.fromkeys(("1/ms^2", "m/s/s"), "m/s^2"),  # B&K's ms⁻² is m·s⁻², not 1/(ms)²
    **{
        "mm/s/s": "mm/s^2",
        "in/s/s": "in/s^2",
        "ft/s/s": "ft/s^2",
        "ips": "in/s",
        "ips^2": "in/s^2",
    },
    **{"N/m^2": "Pa", "kN/m^2": "kPa", "N/mm^2": "MPa"},
    **dict.fromkeys(("kmh", "kph", "km/hr"), "km/h"),
    **dict.fromkeys(("dBA", "dB A", "dB[A]"), "dB(A)"),
    **dict.fromkeys(("ft lbf", "lb ft", "ft lb"), "lbf ft"),
    **dict.fromkeys(("in lbf", "lb in", "in lb"), "lbf in"),
}


def _in_capitals() -> dict[str, str]:
    """Return labels in capital letters, as older programs write them, with what each means.

    Left out is what may mean two units: MPA, MN, GN (gravity, giga) and T (tesla).
    """
    meant: dict[str, set[str]] = {}
    for label in (*_TO_SI, *SEVERAL_MEANINGS, *_WORDS, *_WHOLE):
        meant.setdefault(label.upper(), set()).add(_WHOLE.get(label, _WORDS.get(label, label)))
    several = {name: labels & SEVERAL_MEANINGS.keys() for name, labels in meant.items()}
    chosen = {name: several[name] or labels for name, labels in meant.items()}
    left_out = ("MN", "GN", "T")
    return {
        name: labels.pop()
        for name, labels in chosen.items()
        if len(labels) == 1 and name not in left_out
    }


_CAPITALS = _in_capitals()
_CHARACTERS = str.maketrans(
    {
        **{"µ": "u", "μ": "u", "°": "deg", "·": " ", "⋅": " ", "×": " ", "*": " ", "’": "'"},
        **{"⁻": "^-", "¹": "1", "²": "^2", "³": "^3", "−": "-", "–": "-"},
        **{"[": "(", "]": ")"},
    }
)
_AMPLITUDE = re.compile(r"[\s_(](rms|RMS|pk|PK|peak|Peak|p-p|pkpk|eff)\)?$")
_ELECTRICAL = re.compile(r"[mµu]?V(olts?)?|EU|[Cc]ounts?|[Dd]igits?")


LONGEST_LABEL, MOST_RATIOS = 80, 5
"""Characters and ratios of a label; of more, every reading would take without end."""


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


@lru_cache(maxsize=1024)  # a campaign names a few units some hundred thousand times
def parse_unit(label: str, si: str = "") -> Unit:
    """Return the unit that a label names.

    - `label`: such as ``mm``, ``N``, ``m/s^2`` or, as a ratio of two known units, ``Pa/N`` or
      ``m/s^2/N``; products, powers and parentheses in the spellings that laboratories use.
    - `si`: SI unit of the quantity, where it is known: it chooses among several meanings.
    - returns: its SI unit and factor; another quantity's unit is returned as well.
    - raises InputError: an unknown label, one of several meanings, or none at all. A unit is never
      guessed.
    """
    if len(label) > LONGEST_LABEL or label.count("/") > MOST_RATIOS:
        raise InputError(f"unknown unit {label[:20]!r} ...: use one such as mm, N or Pa/N")
    text = _plain(label)
    if not text:
        raise InputError("a unit is missing: write one, such as mm, N or Pa/N")
    fitting = _meanings(text, every=True) if si else {}
    meanings = {si: fitting[si]} if si in fitting else _meanings(text, every=False)
    if len(meanings) == 1:
        ((unit, factor),) = meanings.items()
        return Unit(label, unit, factor)
    if meanings:
        either = " or ".join(f"{factor:.6g} {unit}" for unit, factor in meanings.items())
        raise InputError(f"unit {label!r} may mean {either}: write {' or '.join(meanings)}")
    if _AMPLITUDE.search(label.strip()):
        raise InputError(
            f"unit {label!r} states how an amplitude is counted, which is no unit: export signals, "
            "or spectra as peak values, and write the plain unit"
        )
    if is_unscaled(label):
        raise InputError(
            f"unit {label!r} is that of no mechanical quantity: apply the sensor's sensitivity "
            "before the export, and write the unit of what it measures"
        )
    labels = ", ".join(UNITS.get(si, UNITS))
    raise InputError(f"unknown unit {label!r}: use one of {labels} or a ratio of two, such as Pa/N")


def is_unscaled(label: str) -> bool:
    """Tell a label of what is no quantity yet, such as ``V``: that of a tacho does not matter."""
    return bool(_ELECTRICAL.fullmatch(label.strip()))


def is_label(text: str) -> bool:
    """Tell whether a text is the label of a unit, of an unscaled signal, or dB."""
    try:
        return is_unscaled(text) or text == "dB" or bool(parse_unit(text))
    except InputError:
        return False


def _plain(label: str) -> str:
    """Return a label in the spelling of the table, where there is one."""
    text = label.replace("**", "^").translate(_CHARACTERS).replace("^-^", "^-")
    text = re.sub(r"\s*([/^()])\s*", r"\1", " ".join(text.split()))
    if text in _TO_SI or text in SEVERAL_MEANINGS or text in _WHOLE:
        return _WHOLE.get(text, text)
    text = re.sub(r"(?<=[A-Za-z])(-?[1-4])(?![\w.])", r"^\1", text)  # s2, min-1
    text = re.sub(r"(?<=[A-Za-z])[-.](?=[A-Za-z])", " ", text)  # N-m, N.m
    if text != "M":  # alone it may be mega
        text = _CAPITALS.get(text, re.sub(r"[A-Za-z_'][\w']*", _word, text))
    text = re.sub(r" ?([A-Za-z]+)\^-(\d)", r"/\1^\2", text).replace("^1", "")  # m s^-2
    text = re.sub(
        r"\(1/([^()/]+)\) ?\(([^()]+)\)", r"\2/\1", f"1{text}" if text[:1] == "/" else text
    )
    text = re.sub(r"/\(([^() /]+) ([^() /]+)\)", _each_below, text)
    text = text.replace("(", "").replace(")", "")
    return _WHOLE.get(text, text)


def _word(match: re.Match[str]) -> str:
    return _WORDS.get(match[0], _CAPITALS.get(match[0], match[0]))


def _each_below(product: re.Match[str]) -> str:
    """Divide by each factor of a denominator, but for a unit such as N m."""
    whole = f"{product[1]} {product[2]}"
    return f"/{whole}" if whole in _TO_SI else f"/{product[1]}/{product[2]}"


def _meanings(text: str, *, every: bool) -> dict[str, float]:
    """SI units of a plain label, or a ratio of two, to their factors; of g every one if wanted."""

    def single(part: str) -> Mapping[str, float]:
        part = _WHOLE.get(part, part)
        if part in _TO_SI and not (every and part in SEVERAL_MEANINGS):
            return dict([_TO_SI[part]])
        return SEVERAL_MEANINGS.get(part, {})

    meanings = dict(single(text))
    first, *below = text.split("/")
    for order in itertools.permutations(below) if not meanings else ():
        parts = (first, *order)
        for place in range(1, len(parts)):
            above, under = ("/".join(each) for each in (parts[:place], parts[place:]))
            for pair in itertools.product(single(above).items(), single(under).items()):
                (unit_above, factor_above), (unit_under, factor_under) = pair
                meanings[f"{unit_above}/{unit_under}"] = factor_above / factor_under
        if meanings:
            break
    return meanings


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
