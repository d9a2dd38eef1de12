"""Whose tolerance makes the scatter: the share of each draw in the variance, at any design."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import RealArray, frozen_copy
from deboom.errors import InputError
from deboom.explore.evaluate import responses
from deboom.explore.moments import ControlVariate
from deboom.explore.robust import RobustResponse


@dataclass(frozen=True, eq=False)
class SigmaShares:
    """Where the variance of one design comes from.

    Parameters
    ----------
    names : tuple of str, length m
        The draws: the variables, or what they share.
    of_response : array, shape (m, r)
        Share of each draw alone in the variance of each response [1].
    rest : array, shape (r,)
        What no draw explains alone: draws together, and what is not a line or parabola [1].
    of_sum : array, shape (m,)
        Share of each draw in the sum of the standard deviations, each response counting with its
        own standard deviation [1].
    """

    names: tuple[str, ...]
    of_response: RealArray
    rest: RealArray
    of_sum: RealArray

    def __post_init__(self) -> None:
        for name in ("of_response", "rest", "of_sum"):
            object.__setattr__(self, name, frozen_copy(np.asarray(getattr(self, name))))


def sigma_shares(robust: RobustResponse, design: RealArray, degree: int = 1) -> SigmaShares:
    """Return the share of each draw in the variance of one design.

    Parameters
    ----------
    robust : RobustResponse
        Whose draws are used; no further evaluations than those of one design are needed.
    design : array, shape (k,)
        [units of the space]
    degree : int
        See `ControlVariate`.

    Returns
    -------
    SigmaShares
        Shares of a response add up to 1 with its rest. A response without any scatter has the
        shares 0 and the rest 0.

    Raises
    ------
    InputError
        A design that fails, or too few draws.

    Notes
    -----
    The share in the sum of the standard deviations is ``Σ_r var_rk / σ_r / Σ_r σ_r``: the part by
    which the sum falls, to first order in the variance, when that draw no longer scatters, doubled.
    """
    base = robust.space.checked(np.atleast_2d(design))[0]
    values = responses(robust.evaluate, robust.made(base))
    if not np.all(np.isfinite(values)):
        raise InputError("the design whose scatter is to be shared out fails itself")
    normals = robust.sample.normals(base)
    fit = ControlVariate(degree)(normals).fit(values)
    own = fit.explained.reshape(degree, normals.shape[1], -1).sum(axis=0)
    variance = own.sum(axis=0) + fit.unexplained
    sigma = np.sqrt(variance)
    scatters = variance > 0.0
    total = sigma.sum()
    per_sigma = np.divide(own, sigma, out=np.zeros_like(own), where=scatters)
    return SigmaShares(
        names=_names(robust),
        of_response=np.divide(own, variance, out=np.zeros_like(own), where=scatters),
        rest=np.divide(fit.unexplained, variance, out=np.zeros_like(variance), where=scatters),
        of_sum=np.divide(per_sigma.sum(axis=1), total or 1.0),
    )


def _names(robust: RobustResponse) -> tuple[str, ...]:
    return robust.space.names if robust.structure is None else robust.structure.draw_names
