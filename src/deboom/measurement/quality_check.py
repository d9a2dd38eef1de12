"""One line of a quality report: a number, its limit, and who is to blame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from deboom.measurement.coherence import CHANCE

HALFWAY = (1.0 + CHANCE) / 2.0
"""Between two functions that are equal and two that have nothing to do with each other."""


@dataclass(frozen=True)
class QualityLimits:
    """Limits from which a quality report asks for a look; measured data are never near perfect.

    Parameters
    ----------
    condition_number : float
        Largest scaled condition number: the worst-seen motion has this much more noise than the
        best-seen one [1].
    redundancy : float
        Smallest share of a channel's error that shows [1].
    repeat_coherence : float
        Smallest coherence of repeats, mean over the lines [1].
    geometric_consistency : float
        Largest mean error of a channel [1]; the thesis's metric flags inverted channels (0.09) and
        swapped axes (0.27) safely from 0.02.
    specific_consistency, reciprocity : float
        Smallest coherence criterion, mean over the lines [1]. Chance gives 0.5: the default lies
        halfway to 1 and means 60° or a factor of 3.7.
    active_share : float
        Largest share of the lines at which power comes out of a driving point [1].
    """

    condition_number: float = 10.0
    redundancy: float = 0.05
    repeat_coherence: float = 0.8
    geometric_consistency: float = 0.02
    specific_consistency: float = HALFWAY
    reciprocity: float = HALFWAY
    active_share: float = 0.05


@dataclass(frozen=True)
class QualityCheck:
    """One check.

    Parameters
    ----------
    name : str
        What was checked.
    number : float or None
        Its figure [1]; None where the data do not allow the check.
    limit : float or None
        Its limit.
    at_most : bool
        Whether the limit is an upper one.
    passed : bool or None
        Whether the limit is kept; None where nothing was checked.
    culprit : str
        Channel, sensor, pair or motion with the worst figure; without a number, what is missing.
    """

    name: str
    number: float | None
    limit: float | None
    at_most: bool
    passed: bool | None
    culprit: str


def at_most(name: str, figures: Mapping[str, float], limit: float) -> QualityCheck:
    """Check the largest of several figures, by channel or pair, against an upper limit."""
    culprit = max(figures, key=lambda key: figures[key])
    number = float(figures[culprit])
    return QualityCheck(name, number, limit, True, number <= limit, culprit)


def at_least(name: str, figures: Mapping[str, float], limit: float) -> QualityCheck:
    """Check the smallest of several figures, by channel or pair, against a lower limit."""
    culprit = min(figures, key=lambda key: figures[key])
    number = float(figures[culprit])
    return QualityCheck(name, number, limit, False, number >= limit, culprit)


def not_checked(name: str, missing: str) -> QualityCheck:
    """List a check that the data do not allow."""
    return QualityCheck(name, None, None, True, None, missing)


def quality_table(checks: Sequence[QualityCheck]) -> list[dict[str, object]]:
    """Return the checks as rows of a table for a report.

    Parameters
    ----------
    checks : sequence of QualityCheck

    Returns
    -------
    list of dict
        Columns ``check``, ``number [1]``, ``limit``, ``verdict`` and ``worst``.
    """
    verdicts = {True: "kept", False: "look here", None: "not checked"}
    return [
        {
            "check": check.name,
            "number [1]": check.number,
            "limit": _limit(check),
            "verdict": verdicts[check.passed],
            "worst": check.culprit,
        }
        for check in checks
    ]


def _limit(check: QualityCheck) -> str:
    if check.limit is None:
        return ""
    return f"{'≤' if check.at_most else '≥'} {check.limit:.3g}"
