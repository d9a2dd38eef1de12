"""What a report says about motion and stiffness factors: which models, how far to trust them."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

from deboom.arrays import RealArray
from deboom.study.motion import PART_WARNING, Factor
from deboom.vehicles.amplitude_index import AmplitudeIndex
from deboom.vehicles.amplitude_uniqueness import SeveralSolutionsWarning, compare_starts
from deboom.vehicles.booming_index import BoomingIndex
from deboom.vehicles.load_case_index import LoadCaseIndex

MOTION_WARNING = (
    "The powertrain's motion is prescribed: it stays as measured while stiffnesses change. This "
    "understates the benefit by 20 to 25 % in high gears and is not good below 30 Hz in low gears."
)
FACTOR_WARNING = (
    "A stiffness factor scales the whole curve of dynamic stiffness over static force, with the "
    "stops re-tuned. A merely softer rubber in the same shape rides deeper into its stops and "
    "loses most of the benefit (on the virtual test bench about 1 dB is left of 3.5 dB)."
)


@dataclass(frozen=True)
class MotionReport:
    """Models behind a study's levels, in words and numbers.

    Parameters
    ----------
    warnings : tuple of str
        For the top of the page.
    text : str
        What was checked, for the page; empty if there is nothing to check.
    terms : dict of str to str
        Glossary entries that take the place of others.
    summary : dict of str to str or float
        Keys ``design_factor``, ``held_amplitude_share`` and ``held_preload_share``.
    """

    warnings: tuple[str, ...]
    text: str
    terms: dict[str, str]
    summary: dict[str, str | float]


def motion_name(index: LoadCaseIndex[Any, Any]) -> str:
    """In a word, how the powertrain answers a design."""
    if isinstance(index, BoomingIndex):
        return "prescribed"
    follows = isinstance(index, AmplitudeIndex) and index.follows_amplitude
    return "amplitude-dependent" if follows else "coupled"


def factor_name(index: LoadCaseIndex[Any, Any]) -> str:
    """In a word, what a stiffness factor means."""
    return index.factor.name if isinstance(index, AmplitudeIndex) else Factor.dynamic.value


def motion_report(index: LoadCaseIndex[Any, Any], designs: RealArray) -> MotionReport:
    """Check the models of a study at a few designs.

    Parameters
    ----------
    index : LoadCaseIndex
        What was evaluated.
    designs : array, shape (n, n_variable)
        Such as nominal and the picks of a front [1].
    """
    factor = factor_name(index)
    prescribed = (MOTION_WARNING,) if isinstance(index, BoomingIndex) else ()
    meaning = PART_WARNING if factor == Factor.part.value else FACTOR_WARNING
    summary: dict[str, str | float] = {"design_factor": factor}
    terms = {"prescribed motion": f"{motion_name(index)} motion"}
    if factor == Factor.part.value:
        terms["stiffness factor"] = "stiffness factor of a part"
    if not isinstance(index, AmplitudeIndex):
        return MotionReport((*prescribed, meaning), "", terms, summary)
    held = index.held(designs)
    summary["held_amplitude_share"] = held.amplitude
    summary["held_preload_share"] = held.preload
    texts, alarms = [], []
    if index.follows_amplitude:
        texts.append(
            f"Of the lines and directions of today's mounts and the named designs, "
            f"{100 * held.amplitude:.1f} % have an amplitude beyond what the response surfaces are "
            "backed for; there the stiffness keeps its value at the bound."
        )
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SeveralSolutionsWarning)
            comparisons = [compare_starts(case, designs) for case in index.contributions]
        texts += [f"Uniqueness: {one.text}." for one in comparisons if one.unique]
        alarms += [f"{one.text}." for one in comparisons if not one.unique]
    if factor == Factor.part.value:
        texts.append(
            f"{100 * held.preload:.1f} % have a static force beyond what the surfaces are backed "
            "for; there the stiffness of a powertrain mount follows the slope of its quasi-static "
            "curve, and that of a wishbone mount keeps its value at the bound. The stiffnesses "
            "named for the supplier are those at today's static deflection; under load the part "
            "rides elsewhere."
        )
    if held.worst:
        texts.append(f"Most often beyond: {held.worst} of the lines.")
    return MotionReport((meaning, *alarms), "\n\n".join(texts), terms, summary)
