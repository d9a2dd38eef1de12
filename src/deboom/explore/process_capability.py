"""How well a process keeps an interval: Cp and Cpk with the confidence that a sample allows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.stats import chi2, norm

from deboom.errors import InputError

FEWEST = 2
"""Pieces below which a scatter is not known at all."""


@dataclass(frozen=True)
class Capability:
    """Capability of one characteristic.

    Parameters
    ----------
    n : int
        Measured pieces.
    mean, sigma : float
        Of the pieces, with n − 1 [unit of the interval].
    cp, cp_bound : float
        Width of the interval over six standard deviations, and its one-sided lower bound [1].
    cpk, cpk_bound : float
        The same with the distance of the mean to the nearer end over three [1]; negative where the
        mean lies outside.
    expected_outside : float
        Share of a normal process with this mean and sigma outside of the interval [1].
    confidence : float
        Of the bounds [1].
    """

    n: int
    mean: float
    sigma: float
    cp: float
    cp_bound: float
    cpk: float
    cpk_bound: float
    expected_outside: float
    confidence: float


def capability(
    values: npt.ArrayLike, lower: float, upper: float, confidence: float = 0.95
) -> Capability:
    """Return the capability of a process from a sample of its pieces.

    Parameters
    ----------
    values : array, shape (n,)
        Of the pieces [unit of the interval].
    lower, upper : float
        Ends of the interval.
    confidence : float
        Of the one-sided lower bounds, between 0.5 and 1 [1].

    Returns
    -------
    Capability

    Raises
    ------
    InputError
        Fewer than `FEWEST` values or one that is not finite, all values equal, an interval without
        width, a confidence outside 0.5 to 1.

    Notes
    -----
    ``Cp = (upper − lower)/6σ``, ``Cpk = min(upper − mean, mean − lower)/3σ``. Lower bounds:
    ``Cp √(χ²_{1−c, n−1}/(n − 1))``, exact for a normal process, and ``Cpk − z_c √(1/9n +
    Cpk²/2(n − 1))``, Bissell, Applied Statistics 39 (1990) 331, an approximation from about 20
    pieces upwards. A process that is not normal has other shares outside.
    """
    sample = np.asarray(values, dtype=float)
    if sample.ndim != 1 or sample.size < FEWEST or not np.all(np.isfinite(sample)):
        raise InputError(f"a capability needs at least {FEWEST} finite values in one row")
    if not lower < upper:
        raise InputError(f"an interval from {lower:g} to {upper:g} has no width")
    if not 0.5 <= confidence < 1.0:
        raise InputError(f"a confidence of {confidence:g}: give one from 0.5 to below 1")
    n, mean, sigma = sample.size, float(sample.mean()), float(sample.std(ddof=1))
    if not sigma > 0.0:
        raise InputError(f"all {n} pieces have the value {mean:g}: look for the copied measurement")
    cp = (upper - lower) / (6.0 * sigma)
    cpk = min(upper - mean, mean - lower) / (3.0 * sigma)
    spread = np.sqrt(1.0 / (9.0 * n) + cpk**2 / (2.0 * (n - 1)))
    outside = norm.cdf(lower, mean, sigma) + norm.sf(upper, mean, sigma)
    return Capability(
        n=n,
        mean=mean,
        sigma=sigma,
        cp=cp,
        cp_bound=float(cp * np.sqrt(chi2.ppf(1.0 - confidence, n - 1) / (n - 1))),
        cpk=cpk,
        cpk_bound=float(cpk - norm.ppf(confidence) * spread),
        expected_outside=float(outside),
        confidence=confidence,
    )
