"""Words that commands and functions accept; a light module, so that help starts at once."""

from __future__ import annotations

import re
from enum import Enum, StrEnum
from pathlib import Path

_FLOAT = re.compile(r"(?<=\d)\.(?=\d)")


class Pick(StrEnum):
    """A named design of the front, spelled like this in files, options and pages."""

    best_mean = "best-mean"
    """Least mean level."""
    none_louder = "none-louder"
    """Least mean level of the designs in which no vehicle and no booming peak is louder than today.
    """
    sigma_kept = "sigma-kept"
    """Least mean level of those that, besides, scatter no more in sum than today's design."""
    best_sigma = "best-sigma"
    """Least scatter."""


def pick_or_file(text: str) -> Pick | Path:
    """Return a pick by its name, or the file of a design that the interactive page saved.

    - raises ValueError: neither; the command line says so with the name of the option.
    """
    if text in set(Pick):
        return Pick(text)
    if Path(text).is_file():
        return Path(text)
    raise ValueError(f"'{text}' is neither a pick ({', '.join(Pick)}) nor a file with a design")


class Distribution(StrEnum):
    """How a variable scatters about the value that it is made to have."""

    normal = "normal"
    """Normal, cut at the tolerance, three standard deviations."""
    normal_uncut = "normal-uncut"
    """Normal, of which 0.27 % lie beyond the tolerance."""
    uniform = "uniform"
    """Any value within the tolerance alike."""
    lognormal = "lognormal"
    """Normal logarithm about the value, cut at the tolerance: never changes its sign."""
    lognormal_uncut = "lognormal-uncut"
    """The same without the cut."""

    @property
    def is_cut(self) -> bool:
        """Whether no value lies beyond the tolerance."""
        return self not in (Distribution.normal_uncut, Distribution.lognormal_uncut)

    @property
    def is_logarithmic(self) -> bool:
        """Whether the logarithm scatters."""
        return self in (Distribution.lognormal, Distribution.lognormal_uncut)


class SearchAlgorithm(StrEnum):
    """An algorithm of pymoo for several objectives, as options spell it."""

    nsga2 = "nsga2"
    nsga3 = "nsga3"
    age_moea = "age-moea"
    sms_emoa = "sms-emoa"
    moead = "moead"

    @property
    def label(self) -> str:
        """Name in texts."""
        labels = {"nsga2": "NSGA-II", "nsga3": "NSGA-III", "moead": "MOEA/D"}
        return labels.get(self.value, self.value.upper())


class Language(StrEnum):
    """Language of a supplier's sheet."""

    en = "en"
    de = "de"

    def say(self, english: str, german: str) -> str:
        """Choose the words of the language."""
        return german if self is Language.de else english

    def local(self, text: str) -> str:
        """Return a text with the decimal sign of the language."""
        return _FLOAT.sub(",", text) if self is Language.de else text


class FolderKind(Enum):
    """Kinds of folders with measurements."""

    platform = "platform"
    campaign = "campaign"
    vehicle = "vehicle"
    compressor = "compressor"
    operation = "operation"
    car = "car"
    component = "component"
    hammer = "hammer"


class FunctionFiles(Enum):
    """Endings of the files.

    ``uff`` chooses functions by node and direction, the others by name: see
    `deboom.files.function_table`.
    """

    uff = "uff"
    csv = "csv"
    xlsx = "xlsx"
    mat = "mat"


class CompressorCase(Enum):
    """Where the true compressor comes from."""

    TABLE11 = "table11"
    """Mounts of the thesis's table 11."""
    RANDOM = "random"
    """Drawn around table 10, inside the tolerances of a drawing."""


class CalibrationLevel(Enum):
    """How well sensors and impacts are calibrated and placed, 1 σ, places per axis."""

    C05 = "C0.5"
    """0.5 %, 0.5 mm, 0.5°, hammer 0.5 %: calibrated and digitised."""
    C1 = "C1"
    """1 %, 1 mm, 1°, hammer 1 %."""
    C2 = "C2"
    """2 %, 1.5 mm, 1.5°, hammer 1 %: catalogue sensitivities, a tape measure."""
    C3 = "C3"
    """3 %, 2 mm, 2°, hammer 1 %."""


class SofteningLaw(Enum):
    """How a compressor's mount softens with its own stroke s."""

    PARABOLA = "parabola"
    """δ = a + b lg s + c lg² s with complex numbers."""
    HYPERBOLA = "hyperbola"
    """v_s∞ + 1/(m_s s + s_0) for real and imaginary part (thesis, eq. 54 and 55)."""


class HoseCase(Enum):
    """Where the true hoses come from."""

    DRAWN = "drawn"
    """Exactly as drawn and catalogued."""
    SCATTERED = "scattered"
    """Stiffness, mass and loss from 0.75 to 1.3 times the catalogue's."""
    DISPLACED = "displaced"
    """Scattered, and off by at most: ports 4 mm per axis, lengths 4 %, directions 9°."""
