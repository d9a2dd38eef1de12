"""Verdicts on a component in words and in the units of its limits."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pandas as pd

from deboom.compressor.acceptance import Decision, Verdict
from deboom.compressor.component_acceptance import DYNAMIC, STATIC

AFFORDABLE = 20
"""Repetitions beyond which a part counts as lying on its limit."""


def verdict_table(verdicts: Sequence[Verdict]) -> pd.DataFrame:
    """Write one row per limit.

    Parameters
    ----------
    verdicts : sequence of Verdict

    Returns
    -------
    DataFrame
        Values in the unit of each row; from and to are the value, guard band to each side.
    """
    rows = []
    for verdict in verdicts:
        unit, size = unit_of(verdict)
        low, high = verdict.bounds.low, verdict.bounds.high
        rows.append(
            {
                "characteristic": _place(verdict),
                "unit": unit,
                "at least": low / size if np.isfinite(low) else np.nan,
                "at most": high / size if np.isfinite(high) else np.nan,
                "measured": verdict.value / size,
                "guard band ±": verdict.pass_guard / size,
                "from": verdict.interval[0] / size,
                "to": verdict.interval[1] / size,
                "verdict": verdict.decision.value,
            }
        )
    return pd.DataFrame(rows)


def shown_verdicts(verdicts: Sequence[Verdict]) -> pd.DataFrame:
    """Write the same for a page: four columns of words.

    Parameters
    ----------
    verdicts : sequence of Verdict

    Returns
    -------
    DataFrame
        Characteristic, limit, measured value with its guard band, verdict.
    """
    rows = []
    for verdict in verdicts:
        unit, size = unit_of(verdict)
        digits = decimals(verdict.pass_guard / size)
        bounds = [
            f"{sign} {bound / size:.5g}"
            for sign, bound in (("≥", verdict.bounds.at_least), ("≤", verdict.bounds.at_most))
            if bound is not None
        ]
        value, guard = verdict.value / size, verdict.pass_guard / size
        rows.append(
            {
                "characteristic": _place(verdict),
                "limit": f"{', '.join(bounds)} {unit}",
                "measured ± guard band": f"{value:.{digits}f} ± {guard:.{digits}f} {unit}",
                "verdict": verdict.decision.value,
            }
        )
    return pd.DataFrame(rows)


def decimals(uncertainty: float) -> int:
    """Decimals that show two digits of an uncertainty."""
    return max(1 - math.floor(math.log10(uncertainty)), 0)


def _place(verdict: Verdict) -> str:
    """Name the characteristic, and the line that decides where it has several."""
    if not verdict.line or "–" not in verdict.name or verdict.doubt:
        return verdict.name
    return f"{verdict.name}; decided at {verdict.line:.3g} Hz"


def unit_of(verdict: Verdict) -> tuple[str, float]:
    """Return the unit of a verdict's table, and its size in SI."""
    if verdict.name == STATIC:
        return "g mm", 1e-6
    if verdict.name == DYNAMIC:
        return "g mm²", 1e-9
    return ("N m/rad", 1.0) if "stiffness r" in verdict.name else ("N/mm", 1e3)


def open_points(verdicts: Sequence[Verdict]) -> pd.DataFrame:
    """Say what was not decided, and which measurement would decide it.

    Parameters
    ----------
    verdicts : sequence of Verdict

    Returns
    -------
    DataFrame
        One row per limit that is undecided.
    """
    rows = [
        {"not decided": _place(verdict), "what would decide it": _remedy(verdict)}
        for verdict in verdicts
        if verdict.decision is Decision.UNDECIDED
    ]
    return pd.DataFrame(rows, columns=["not decided", "what would decide it"])


def _remedy(verdict: Verdict) -> str:
    if verdict.doubt:
        return f"{verdict.doubt[:1].upper()}{verdict.doubt[1:].rstrip('.')}."
    if verdict.repetitions > AFFORDABLE:
        return (
            "The value lies on its limit: no affordable measurement will decide it. Agree on the "
            "limit, or on who bears the uncertainty."
        )
    unit, size = unit_of(verdict)
    guard = verdict.pass_guard / size
    return (
        f"A guard band of ± {verdict.shrinkage * guard:.2g} {unit} instead of ± {guard:.2g}, if "
        f"the value stays: the mean of {verdict.repetitions} set-ups, sensors glued and impacts "
        f"placed anew, or sensors and impacts {1 / verdict.shrinkage:.2g} times better calibrated "
        "and placed."
    )
