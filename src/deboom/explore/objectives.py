"""What a robust search minimises: a statistic of each response, then one number of them all."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError


class Statistic(Protocol):
    """One number of each response over its scatter."""

    @property
    def name(self) -> str:
        """In words."""

    def __call__(self, values: RealArray, mean: RealArray, sigma: RealArray) -> RealArray:
        """Return the statistic, shape (r,) [response unit].

        Parameters
        ----------
        values : array, shape (n_samples, r)
            Responses, draw by draw.
        mean, sigma : array, shape (r,)
            As the estimator found them.
        """


@dataclass(frozen=True)
class Mean:
    """The mean."""

    name: str = "mean"

    def __call__(self, values: RealArray, mean: RealArray, sigma: RealArray) -> RealArray:  # noqa: ARG002
        """Return the mean of each response."""
        return mean


@dataclass(frozen=True)
class Sigma:
    """The standard deviation."""

    name: str = "sigma"

    def __call__(self, values: RealArray, mean: RealArray, sigma: RealArray) -> RealArray:  # noqa: ARG002
        """Return the standard deviation of each response."""
        return sigma


@dataclass(frozen=True)
class Quantile:
    """The level that a share of all parts stays below.

    Parameters
    ----------
    share : float
        Between 0 and 1, such as 0.95 [1].
    """

    share: float

    def __post_init__(self) -> None:
        _check_share(self.share)

    @property
    def name(self) -> str:
        """In words."""
        return f"{100 * self.share:g} % quantile"

    def __call__(self, values: RealArray, mean: RealArray, sigma: RealArray) -> RealArray:  # noqa: ARG002
        """Return the quantile of each response."""
        return np.asarray(np.quantile(values, self.share, axis=0))


@dataclass(frozen=True)
class TailMean:
    """The mean of the worst parts (conditional value at risk, CVaR).

    Parameters
    ----------
    share : float
        The worst ``1 - share`` of all parts count, such as the worst 5 % at 0.95 [1].

    Notes
    -----
    ``q + mean(max(y - q, 0)) / (1 - share)`` with ``q`` the quantile (R. T. Rockafellar and
    S. Uryasev, "Optimization of conditional value-at-risk", Journal of Risk 2, 2000).
    """

    share: float

    def __post_init__(self) -> None:
        _check_share(self.share)

    @property
    def name(self) -> str:
        """In words."""
        return f"mean of the worst {100 * (1 - self.share):g} %"

    def __call__(self, values: RealArray, mean: RealArray, sigma: RealArray) -> RealArray:  # noqa: ARG002
        """Return the tail mean of each response."""
        limit = np.quantile(values, self.share, axis=0, method="inverted_cdf")
        beyond = np.maximum(values - limit, 0.0).sum(axis=0) / len(values)
        return np.asarray(limit + beyond / (1.0 - self.share))


class Objective(Protocol):
    """One number of a design, to be minimised."""

    @property
    def name(self) -> str:
        """In words."""

    def __call__(self, values: RealArray, mean: RealArray, sigma: RealArray) -> float:
        """Return the objective [response unit]; arguments as of `Statistic`."""


@dataclass(frozen=True)
class Total:
    """A statistic, summed over the responses."""

    statistic: Statistic

    @property
    def name(self) -> str:
        """In words."""
        return f"{self.statistic.name}, sum"

    def __call__(self, values: RealArray, mean: RealArray, sigma: RealArray) -> float:
        """Return the sum."""
        return float(self.statistic(values, mean, sigma).sum())


@dataclass(frozen=True)
class Worst:
    """A statistic of that response which has most of it, such as the loudest vehicle's mean."""

    statistic: Statistic

    @property
    def name(self) -> str:
        """In words."""
        return f"{self.statistic.name}, worst response"

    def __call__(self, values: RealArray, mean: RealArray, sigma: RealArray) -> float:
        """Return the largest."""
        return float(self.statistic(values, mean, sigma).max())


MEAN_SUM = Total(Mean())
SIGMA_SUM = Total(Sigma())


def _check_share(share: float) -> None:
    if not 0.0 < share < 1.0:
        raise InputError(f"a share of {share:g} of all parts: take one between 0 and 1")
