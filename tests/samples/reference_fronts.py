"""Fronts of many starts in ``tests/data/converged_fronts``, and how near a search comes to them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import deboom
from deboom.explore.front import hypervolume, pareto_front, thinned
from deboom.explore.robust import RobustValues
from deboom.explore.search import SHOWN

REFERENCE = Path(__file__).parents[1] / "data" / "converged_fronts"


def figures(robust: deboom.Robust, front: RobustValues, reference: Path) -> dict[str, float]:
    """Return how near values come to a reference front, in mdB per line and vehicle and in %."""
    best = np.loadtxt(reference, delimiter=",", skiprows=1)
    per_line = 1.0 / (robust.evaluate.n_lines * len(robust.evaluate.response_names))
    low, span = best.min(axis=0), np.ptp(best, axis=0)

    def volume(points: np.ndarray) -> float:
        return hypervolume((points - low) / span, np.full(2, 1.1))

    whole = pareto_front(front)
    few = thinned(whole, SHOWN).objectives * per_line
    objectives = whole.objectives * per_line
    order = np.argsort(few[:, 1])
    gap = np.interp(best[:, 1], few[order, 1], few[order, 0]) - best[:, 0]
    above = 1e3 * (objectives.min(axis=0) - low)
    # how far the nearest point lies beyond each of the best in its worse objective
    beyond = np.max(objectives[:, np.newaxis] - best, axis=2).min(axis=0)
    return {
        "points": len(whole),
        "share [%]": 100.0 * volume(objectives) / volume(best),
        f"share of {SHOWN} points [%]": 100.0 * volume(few) / volume(best),
        "best mean above [mdB]": above[0],
        "best sigma above [mdB]": above[1],
        "largest gap at equal sigma [mdB]": 1e3 * gap.max(),
        "largest distance in both [mdB]": 1e3 * beyond.max(),
    }
