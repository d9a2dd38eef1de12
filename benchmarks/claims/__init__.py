"""Claims that the documentation makes, each measured afresh by ``make validate``.

What follows from an equation, and what a single measurement shows, stands in tests/verification;
here stands what takes many draws, and what the shipped studies find.
"""

import os
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from deboom.explore.workers import process_pool

sys.path.append(str(Path(__file__).parents[2] / "tests"))  # where `samples` are


@dataclass(frozen=True)
class Claim:
    """One line of ``docs/validation.md``."""

    topic: str
    """What is claimed, in a few words with unit."""
    bound: str
    """The bound, as text."""
    measured: str
    """The figure, as text with its unit and sample."""
    holds: bool
    """Whether the figure meets the bound."""


def draws(few: int) -> int:
    """Return how many draws a claim takes: few, times the environment variable ``DRAWS``."""
    return max(1, round(few * float(os.environ.get("DRAWS", "1"))))


CASES = range(1, 2 + draws(20))
"""Seeds: the shipped case, which is no draw, and twenty draws."""


def in_processes(function: Callable[..., Any], *inputs: Iterable[object]) -> list[Any]:
    """Return what a function makes of each input; two processes, linear algebra in one thread."""
    with process_pool(2) as pool:
        return list(pool.map(function, *inputs))


def at_most(topic: str, limits: ArrayLike, values: ArrayLike, digits: int = 2) -> Claim:
    """Claim that no value lies above its limit; one limit may serve all values."""
    return _bounded(topic, "at most", limits, values, digits, np.all(values <= np.array(limits)))


def at_least(topic: str, limits: ArrayLike, values: ArrayLike, digits: int = 2) -> Claim:
    """Claim that no value lies below its limit; one limit may serve all values."""
    return _bounded(topic, "at least", limits, values, digits, np.all(values >= np.array(limits)))


def between(topic: str, limits: tuple[float, float], values: ArrayLike, digits: int = 2) -> Claim:
    """Claim that all values lie between two limits."""
    low, high = limits
    holds = np.all((low <= np.array(values)) & (np.array(values) <= high))
    return Claim(topic, f"{low:g} to {high:g}", listed(values, digits), bool(holds))


def over_draws(
    topic: str,
    cases: ArrayLike,
    limits: Mapping[float, ArrayLike] | None = None,
    digits: int = 2,
    *,
    least: bool = False,
) -> Claim:
    """Claim quantiles of figures over draws; nan is left out.

    - `cases` (1 + n_draw,) or (1 + n_draw, n_figure): the shipped case, which is no draw and may be
      nan, then the draws.
    - `limits`: of quantiles, one for all figures or one each; without them nothing is claimed.
    - `least`: whether the limits are lower ones.
    """
    shipped, *drawn = np.asarray(cases, dtype=float).reshape(len(np.asarray(cases)), -1)
    end = 0.0 if least else 1.0
    bounds_in_words, holds = [], True
    for share, limit in (limits or {}).items():
        quantile = np.nanquantile(drawn, share, axis=0)
        holds &= bool(np.all(quantile >= limit if least else quantile <= limit))
        what = {0.5: "median", end: "all"}.get(share, f"{100 * share:g} %")
        bounds = ", ".join(f"{bound:g}" for bound in np.atleast_1d(limit))
        bounds_in_words.append(f"{what} at {'least' if least else 'most'} {bounds}")
    measured = []
    for draws_of_figure, shipped_value in zip(np.transpose(drawn), shipped, strict=True):
        low, middle, high, worst = (
            f"{value:.{digits}f}" for value in np.nanquantile(draws_of_figure, (0.1, 0.5, 0.9, end))
        )
        last = f", worst {worst}" if limits and end in limits else ""
        beside = "" if np.isnan(shipped_value) else f"; shipped {shipped_value:.{digits}f}"
        measured.append(f"{middle} ({low} to {high}{last}{beside})")
    return Claim(topic, "; ".join(bounds_in_words) or "no claim", ", ".join(measured), holds)


def reported(topic: str, measured: str) -> Claim:
    """State a figure for which no bound is claimed."""
    return Claim(topic, "no claim", measured, True)


def listed(values: ArrayLike, digits: int) -> str:
    """Write numbers with a number of digits, separated by commas."""
    return ", ".join(f"{value:.{digits}f}" for value in np.atleast_1d(values))


def _bounded(
    topic: str, word: str, limits: ArrayLike, values: ArrayLike, digits: int, holds: np.bool
) -> Claim:
    bounds_in_words = ", ".join(f"{limit:g}" for limit in np.atleast_1d(limits))
    return Claim(topic, f"{word} {bounds_in_words}", listed(values, digits), bool(holds))
