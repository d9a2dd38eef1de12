"""Words that searches and their options accept; a light module, so that help starts at once."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path


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
