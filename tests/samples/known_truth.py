"""Robust problems whose means, standard deviations and Pareto fronts are known exactly.

They have the shape of the real thing (stiffness factors around 1, a relative scatter, a sum over
responses), so that a search, a sampler or a new optimiser can be measured against truth.

Both are sums of functions of one variable each, with independent scatter. Mean and variance are
therefore sums of terms per variable, and a design that minimises ``Σ mean + Σ λ variance`` is
found variable by variable.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.special import ndtr

from deboom.arrays import RealArray
from deboom.explore.descent import PullBack
from deboom.explore.front import nondominated
from deboom.explore.scatter import TRUNCATION, cut_normal_moments
from deboom.explore.space import DesignSpace, Evaluate, generator


class SeparableProblem(Evaluate, Protocol):
    """An evaluation whose mean and variance are known, as sums over the variables."""

    def exact_terms(self, designs: RealArray, sigma: RealArray) -> tuple[RealArray, RealArray]:
        """Return the terms of mean and variance, each of shape (n, r, k).

        Parameters
        ----------
        designs : array, shape (n, k)
        sigma : array, shape (k,)
            Relative standard deviation of the scatter before it is cut [1].
        """


@dataclass(frozen=True, eq=False)
class Quad2:
    """QUAD2: two responses, quadratic in every variable, with targets that disagree.

    Parameters
    ----------
    weights, targets : array, shape (2, k)

    Notes
    -----
    ``y_r = Σ_k w_rk (x_k - c_rk)²``. With the moments m2 and m4 of the cut normal distribution a
    term of the mean is ``w ((x - c)² + s² x² m2)`` and a term of the variance
    ``w² (4 (x - c)² s² x² m2 + s⁴ x⁴ (m4 - m2²))``.
    """

    weights: RealArray
    targets: RealArray
    response_unit: str = "1"

    @property
    def variable_names(self) -> tuple[str, ...]:
        """``x1`` to ``xk``."""
        return tuple(f"x{k + 1}" for k in range(self.weights.shape[1]))

    @property
    def response_names(self) -> tuple[str, ...]:
        """``y1`` and ``y2``."""
        return tuple(f"y{r + 1}" for r in range(self.weights.shape[0]))

    def __call__(self, designs: RealArray) -> RealArray:
        """Return the responses, shape (n, 2)."""
        return np.column_stack(
            [(designs - c) ** 2 @ w for w, c in zip(self.weights, self.targets, strict=True)]
        )

    def gradient(self, designs: RealArray) -> RealArray:
        """Return the derivatives of the responses, shape (n, 2, k)."""
        return 2.0 * self.weights * (designs[:, None, :] - self.targets)

    def exact_terms(self, designs: RealArray, sigma: RealArray) -> tuple[RealArray, RealArray]:
        """Return the terms of mean and variance, each of shape (n, 2, k)."""
        second, fourth = cut_normal_moments()
        squared_distance = (designs[:, None, :] - self.targets) ** 2
        spread = ((sigma * designs) ** 2)[:, None, :]
        mean = self.weights * (squared_distance + spread * second)
        variance = self.weights**2 * (
            4.0 * squared_distance * spread * second + spread**2 * (fourth - second**2)
        )
        return mean, variance


@dataclass(frozen=True, eq=False)
class Exp1:
    """EXP1: one response that falls exponentially, the faster the more it scatters.

    Parameters
    ----------
    weights, rates : array, shape (k,)

    Notes
    -----
    ``y = -Σ_k w_k exp(b_k x_k)``. With the moment-generating function ``M`` of the cut normal
    distribution and ``t = b x s``, a term of the mean is ``-w exp(b x) M(t)`` and a term of the
    variance ``w² exp(2 b x) (M(2t) - M(t)²)``.
    """

    weights: RealArray
    rates: RealArray
    response_unit: str = "1"
    response_names: tuple[str, ...] = ("y1",)

    @property
    def variable_names(self) -> tuple[str, ...]:
        """``x1`` to ``xk``."""
        return tuple(f"x{k + 1}" for k in range(self.weights.size))

    def __call__(self, designs: RealArray) -> RealArray:
        """Return the response, shape (n, 1)."""
        return -(np.exp(designs * self.rates) @ self.weights)[:, None]

    def gradient(self, designs: RealArray) -> RealArray:
        """Return the derivatives of the response, shape (n, 1, k)."""
        return -(np.exp(designs * self.rates) * self.weights * self.rates)[:, None, :]

    def exact_terms(self, designs: RealArray, sigma: RealArray) -> tuple[RealArray, RealArray]:
        """Return the terms of mean and variance, each of shape (n, 1, k)."""
        height = self.weights * np.exp(self.rates * designs)
        argument = self.rates * designs * sigma
        first = cut_normal_mgf(argument)
        mean = -height * first
        variance = height**2 * (cut_normal_mgf(2.0 * argument) - first**2)
        return mean[:, None, :], variance[:, None, :]


@dataclass(frozen=True, eq=False)
class WithSlopes:
    """A problem of known truth whose front may converge along its own gradient."""

    problem: Quad2 | Exp1
    is_linearisable: bool = True

    @property
    def variable_names(self) -> tuple[str, ...]:
        """Names of the problem's variables."""
        return self.problem.variable_names

    @property
    def response_names(self) -> tuple[str, ...]:
        """Names of the problem's responses."""
        return self.problem.response_names

    @property
    def response_unit(self) -> str:
        """Unit of the problem's responses."""
        return self.problem.response_unit

    def __call__(self, designs: RealArray) -> RealArray:
        """Return the problem's responses."""
        return self.problem(designs)

    def linearised(self, designs: RealArray) -> tuple[RealArray, PullBack]:
        """Return the responses, and the pull-back of weights."""
        slopes = self.problem.gradient(designs)

        def pull_back(weights: RealArray) -> RealArray:
            return np.asarray(np.einsum("onr,nrk->onk", weights, slopes))

        return self.problem(designs), pull_back


def quad2(n_variables: int, *, seed: int) -> Quad2:
    """Return an instance of QUAD2: weights in 0.5 to 1.5, targets in 0.7 to 1.3."""
    draw = generator(seed, "quad2").random((2, 2, n_variables))
    return Quad2(weights=0.5 + draw[0], targets=0.7 + 0.6 * draw[1])


def exp1(n_variables: int, *, seed: int) -> Exp1:
    """Return an instance of EXP1: rates in 2 to 5, weights that give 0.5 to 1.5 at ``x = 1``."""
    draw = generator(seed, "exp1").random((2, n_variables))
    rates = 2.0 + 3.0 * draw[1]
    return Exp1(weights=(0.5 + draw[0]) * np.exp(-rates), rates=rates)


def exact_objectives(
    problem: SeparableProblem, space: DesignSpace, designs: RealArray
) -> RealArray:
    """Return the true sums of means and of standard deviations, shape (n, 2)."""
    mean, variance = problem.exact_terms(designs, space.relative_sigma)
    return np.column_stack(
        [mean.sum(axis=(1, 2)), np.sqrt(variance.sum(axis=2)).sum(axis=1)],
    )


def exact_front(
    problem: SeparableProblem,
    space: DesignSpace,
    n_weights: int = 1000,
    n_shares: int = 40,
    n_grid: int = 801,
) -> RealArray:
    """Return points of the true Pareto front, shape (n, 2), sorted by the first objective.

    With the defaults their hypervolume is within 0.2 % of the limit of many points.

    Parameters
    ----------
    problem : SeparableProblem
    space : DesignSpace
        Its bounds, apart, and tolerances, above 0.
    n_weights : int
        Weights between mean and variance, denser where designs change faster.
    n_shares : int
        Steps in which the weight of the variance is shared out between the responses.
    n_grid : int
        Values per variable, evenly from bound to bound.

    Notes
    -----
    Minimisers of ``Σ_r mean_r + λ Σ_r share_r variance_r``. A design that minimises
    ``Σ_r mean_r + μ Σ_r σ_r`` is among them, with ``λ share_r = μ / (2 σ_r)``, because a square
    root lies below its tangents.
    """
    grid = np.linspace(space.lower, space.upper, n_grid)
    mean_terms, variance_terms = problem.exact_terms(grid, space.relative_sigma)
    mean = mean_terms.sum(axis=1)
    n_responses = mean_terms.shape[1]
    designs = []
    for parts in itertools.product(range(n_shares + 1), repeat=n_responses):
        if sum(parts) != n_shares:
            continue
        variance = np.einsum("r,nrk->nk", np.array(parts) / n_shares, variance_terms)
        exchange = -np.diff(mean, axis=0) / np.diff(variance, axis=0)
        # each rate of exchange is the weight at which one variable moves by one step of the grid
        for weight in np.quantile(exchange[exchange > 0.0], np.linspace(0.0, 1.0, n_weights)):
            best = np.argmin(mean + weight * variance, axis=0)
            designs.append(grid[best, np.arange(space.n_variables)])
    objectives = exact_objectives(problem, space, np.array(designs))
    front = objectives[nondominated(objectives)]
    return front[np.argsort(front[:, 0])]


def cut_normal_mgf(argument: RealArray) -> RealArray:
    """Return the mean of ``exp(argument z)`` for z normal, cut at ±3 [1]."""
    inside = 1.0 - 2.0 * ndtr(-TRUNCATION)
    shifted = ndtr(TRUNCATION - argument) - ndtr(-TRUNCATION - argument)
    return np.asarray(np.exp(argument**2 / 2.0) * shifted / inside)
