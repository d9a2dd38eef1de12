"""Mean and standard deviation from draws: as they come, or with a control variate."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.tolerance_samples import cut_normal_moments


class Moments(NamedTuple):
    """Of the responses of one design; all in the unit of the responses.

    Attributes
    ----------
    mean, sigma : array, shape (r,)
        Of each response.
    mean_error, sigma_error : float
        Standard error of the sum of the means and of the sum of the standard deviations.
    """

    mean: RealArray
    sigma: RealArray
    mean_error: float
    sigma_error: float


class Estimator(Protocol):
    """How moments are read from draws."""

    @property
    def kind(self) -> str:
        """In words, for reports and run records."""

    def __call__(self, normals: RealArray) -> Callable[[RealArray], Moments]:
        """Return the function that reads the moments of responses to given draws.

        Parameters
        ----------
        normals : array, shape (n_samples, m)
            The independent draws [1].

        Returns
        -------
        callable
            From responses, shape (n_samples, r), to their moments; where a response is not finite,
            neither are its moments.
        """


@dataclass(frozen=True)
class SampleMoments:
    """Mean and standard deviation of the sample itself: the definition."""

    kind: str = "moments of the sample"

    def __call__(self, normals: RealArray) -> Callable[[RealArray], Moments]:  # noqa: ARG002
        """Return `sample_statistics`."""
        return sample_statistics


SAMPLE_MOMENTS = SampleMoments()


@dataclass(frozen=True)
class ControlVariate:
    """Moments with a simple function of the draws as control variate.

    What the function explains has known moments, whatever the draws were; only what is left over
    is estimated from the sample. It costs no evaluation, and of responses that are nearly linear,
    or nearly sums of functions of one variable, it takes most of the error.

    Parameters
    ----------
    degree : int
        1: a straight line. 2: a parabola in each draw.

    Raises
    ------
    InputError
        Another degree.

    Notes
    -----
    Least squares give ``y_t = a + β·φ_t + e_t``, with ``φ = z`` and, for degree 2, ``z² - m2``
    beside it. The mean is ``a`` and the variance ``Σ_p β_p² var(φ_p) + Σ_t e_t² / (n - 1 - p)``:
    the ``φ`` are not correlated, and their variances follow from the moments of the cut normal
    distribution (regression estimator, W. G. Cochran, "Sampling Techniques", 3rd ed., 1977,
    ch. 7). The standard errors come from the scatter of the influences ``Σ_r e_tr`` and
    ``Σ_r (2 β_r·φ_t e_tr + e_tr²) / (2 σ_r)``, each ``e_t`` divided by one minus its leverage (the
    jackknife; J. G. MacKinnon and H. White, Journal of Econometrics 29, 1985). The draws must be
    independent standard-normal columns cut at ±3, such as those of `sobol_sample`.
    """

    degree: int = 1

    def __post_init__(self) -> None:
        if self.degree not in (1, 2):
            raise InputError(f"a control variate of degree {self.degree}: take 1 or 2")

    @property
    def kind(self) -> str:
        """In words."""
        return f"sample moments with a control variate of degree {self.degree}"

    def __call__(self, normals: RealArray) -> FittedMoments:
        """Prepare the fit to given draws, shape (n_samples, m).

        Raises
        ------
        InputError
            Not more draws than the function has coefficients.
        """
        second, fourth = cut_normal_moments()
        terms, variance = normals, np.full(normals.shape[1], second)
        if self.degree == 2:
            terms = np.hstack([normals, normals**2 - second])
            variance = np.concatenate([variance, np.full(normals.shape[1], fourth - second**2)])
        n_samples, n_terms = terms.shape
        if n_samples < n_terms + 2:
            raise InputError(
                f"{n_samples} draws are too few for a control variate of degree {self.degree} in "
                f"{normals.shape[1]} draws per part: take at least {n_terms + 2}"
            )
        spread = terms - terms.sum(axis=0) / n_samples
        # einsum, not @: the threads of a BLAS library may change the last bit
        gram = np.einsum("tp,tq->pq", spread, spread)
        solver = np.linalg.solve(gram, spread.T)
        leverage = 1.0 / n_samples + np.einsum("tp,pt->t", spread, solver)
        return FittedMoments(terms, variance, solver, leverage)


class Fit(NamedTuple):
    """A function of the draws through the responses of one design.

    Attributes
    ----------
    intercept : array, shape (r,)
        Mean of the function [response unit].
    slope : array, shape (p, r)
        Coefficients of the terms [response unit].
    rest : array, shape (n_samples, r)
        What is left over [response unit].
    explained : array, shape (p, r)
        Variance of each term [response unit squared].
    unexplained : array, shape (r,)
        Variance of what is left over [response unit squared].
    """

    intercept: RealArray
    slope: RealArray
    rest: RealArray
    explained: RealArray
    unexplained: RealArray


@dataclass(frozen=True, eq=False)
class FittedMoments:
    """A control variate, prepared for one set of draws.

    Parameters
    ----------
    terms : array, shape (n_samples, p)
        What the function is made of, draw by draw; term p belongs to draw p modulo m [1].
    variance : array, shape (p,)
        Exact variance of each term; their exact means are zero [1].
    solver : array, shape (p, n_samples)
        From responses to the coefficients of the terms [1].
    leverage : array, shape (n_samples,)
        How much each response draws the function to itself, 0 to 1 [1].
    """

    terms: RealArray
    variance: RealArray
    solver: RealArray
    leverage: RealArray

    def fit(self, values: RealArray) -> Fit:
        """Return the function through the responses, shape (n_samples, r)."""
        n_samples, n_terms = self.terms.shape
        with np.errstate(over="ignore", invalid="ignore"):
            # measured from the first draw, a response without scatter has a slope of exactly zero
            offset = values - values[0]
            slope = np.einsum("pt,tr->pr", self.solver, offset)
            above = offset - np.einsum("tp,pr->tr", self.terms, slope)
            intercept = above.sum(axis=0) / n_samples
            rest = above - intercept
            unexplained = (rest * rest).sum(axis=0) / (n_samples - 1 - n_terms)
            explained = slope * slope * self.variance[:, None]
        return Fit(values[0] + intercept, slope, rest, explained, unexplained)

    def __call__(self, values: RealArray) -> Moments:
        """Return the moments of the responses, shape (n_samples, r)."""
        fit = self.fit(values)
        with np.errstate(over="ignore", invalid="ignore"):
            sigma = np.sqrt(fit.explained.sum(axis=0) + fit.unexplained)
            weight = np.divide(0.5, sigma, out=np.zeros(sigma.size), where=sigma > 0.0)
            curve = np.einsum("tp,pr->tr", self.terms, fit.slope)
            # as large as the rest would be, had its draw been left out of the fit
            rest = fit.rest / (1.0 - self.leverage)[:, None]
            mean_error = standard_error(rest.sum(axis=1))
            influence = rest * (2.0 * curve + rest)
            sigma_error = standard_error(np.einsum("tr,r->t", influence, weight))
        return Moments(fit.intercept, sigma, mean_error, sigma_error)


def sample_statistics(values: RealArray) -> Moments:
    """Return mean, standard deviation and the standard errors of their sums.

    Parameters
    ----------
    values : array, shape (n_samples, r)
        Responses over the draws of one design.

    Returns
    -------
    Moments
        Not finite where a value is not.

    Notes
    -----
    Standard deviations divide by ``n - 1``. The standard errors come from the scatter, over the
    draws ``t``, of the influence of one draw on the sum over the responses ``r``: ``Σ_r y_tr`` for
    the mean and ``Σ_r ((y_tr - mean_r)² - σ_r²) / (2 σ_r)`` for the standard deviation. Summing
    before taking the scatter keeps the correlation between responses.
    """
    n_samples = len(values)
    with np.errstate(over="ignore", invalid="ignore"):
        # measured from the first draw, a response without scatter has a sigma of exactly zero
        offset = values - values[0]
        centre = offset.sum(axis=0) / n_samples
        deviation = offset - centre
        square = deviation * deviation
        sigma = np.sqrt(square.sum(axis=0) / (n_samples - 1))
        weight = np.divide(0.5, sigma, out=np.zeros(sigma.size), where=sigma > 0.0)
        # einsum, not @: the threads of a BLAS library may change the last bit
        mean_error = standard_error(deviation.sum(axis=1))
        sigma_error = standard_error(np.einsum("tr,r->t", square, weight))
    return Moments(values[0] + centre, sigma, mean_error, sigma_error)


def moment_weights(
    moments: Callable[[RealArray], Moments], values: RealArray, sigma: RealArray
) -> tuple[RealArray, RealArray]:
    """Return the derivatives of mean and sigma by the response to each draw.

    Parameters
    ----------
    moments : callable
        What an `Estimator` prepared.
    values : array, shape (n_samples, r)
        Responses.
    sigma : array, shape (r,)
        Their standard deviations.

    Returns
    -------
    mean : array, shape (n_samples,)
        The same for every response [1].
    sigma : array, shape (n_samples, r)
        Zero for a response without scatter [1].
    """
    n_samples = len(values)
    per_sigma = np.divide(1.0, sigma, out=np.zeros_like(sigma), where=sigma > 0.0)
    if isinstance(moments, FittedMoments):
        fit = moments.fit(values)
        middle = moments.terms.sum(axis=0) / n_samples
        spare = n_samples - 1 - moments.terms.shape[1]
        mean = 1.0 / n_samples - np.einsum("p,pt->t", middle, moments.solver)
        along = fit.slope * moments.variance[:, None]
        variance = np.einsum("pt,pr->tr", moments.solver, along) + fit.rest / spare
        return mean, variance * per_sigma
    deviation = values - values.sum(axis=0) / n_samples
    return np.full(n_samples, 1.0 / n_samples), deviation * per_sigma / (n_samples - 1)


def standard_error(influence: RealArray) -> float:
    """Return the standard error of a mean from its terms, shape (n_samples,), ``n > 1``."""
    centred = influence - influence.sum() / influence.size
    spread = np.einsum("t,t->", centred, centred)
    return float(np.sqrt(spread / (influence.size * (influence.size - 1))))
