"""Sensitivity beside the shares of variance: elementary effects and changes of distribution."""

from __future__ import annotations

from dataclasses import dataclass

from deboom.arrays import RealArray


@dataclass(frozen=True, eq=False)
class MorrisEffects:
    """Elementary effects: change of an output over a step of one factor, per unit of its range.

    Parameters
    ----------
    factors, outputs : tuple of str
        Lengths d and r.
    mu, mu_star, mu_star_interval : array, shape (d, r)
        Mean of the effects, mean of their magnitudes and half width of its interval
        [unit of the output].
    sigma : array, shape (d, r)
        Standard deviation of the effects: curvature and coupling; nan for groups of several
        variables [unit of the output].
    """

    factors: tuple[str, ...]
    outputs: tuple[str, ...]
    mu: RealArray
    mu_star: RealArray
    mu_star_interval: RealArray
    sigma: RealArray


@dataclass(frozen=True, eq=False)
class DistributionIndices:
    """What fixing a factor does to the whole distribution of an output, 0 to 1.

    Parameters
    ----------
    factors, outputs : tuple of str
        Lengths d and r.
    index : array, shape (d, r)
        [1].
    interval : array, shape (d, r)
        Half width of its interval; nan where the method gives none [1].
    """

    factors: tuple[str, ...]
    outputs: tuple[str, ...]
    index: RealArray
    interval: RealArray
