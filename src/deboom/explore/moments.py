"""Mean and standard deviation from draws: as they come, or with what a straight line explains."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from deboom.errors import InputError
from deboom.explore.arrays import RealArray
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

    def __call__(self, values: RealArray, normals: RealArray) -> Moments:
        """Return the moments of the responses, shape (n_samples, r).

        Parameters
        ----------
        values : array, shape (n_samples, r)
            Responses, draw by draw; where one is not finite, neither are its moments.
        normals : array, shape (n_samples, m)
            The independent draws that they came from [1].
        """


@dataclass(frozen=True)
class SampleMoments:
    """Mean and standard deviation of the sample itself: the definition."""

    kind: str = "moments of the sample"

    def __call__(self, values: RealArray, normals: RealArray) -> Moments:  # noqa: ARG002
        """Return the moments."""
        return sample_statistics(values)


SAMPLE_MOMENTS = SampleMoments()


@dataclass(frozen=True)
class LinearControlVariate:
    """Moments with a straight line in the draws as control variate.

    What a line explains has known moments, whatever the draws were; only what is left over is
    estimated from the sample. It costs no evaluation, and of responses that are nearly linear
    within their scatter it takes most of the error.

    Notes
    -----
    Least squares give ``y_t = a + β·z_t + e_t``. The mean is ``a`` and the variance ``m2 |β|² +
    Σ e² / (n - 1 - m)``, with ``m2`` the exact variance of a draw, cut at ±3 (regression
    estimator, W. G. Cochran, "Sampling Techniques", 3rd ed., 1977, ch. 7). The standard errors
    come from the scatter of the influences ``Σ_r e_tr`` and ``Σ_r (2 β_r·z_t e_tr + e_tr² -
    mean(e_r²)) / (2 σ_r)``. The draws must be independent standard-normal columns cut at ±3, such
    as those of `sobol_sample`.
    """

    kind: str = "sample moments with a linear control variate"

    def __call__(self, values: RealArray, normals: RealArray) -> Moments:
        """Return the moments.

        Raises
        ------
        InputError
            Not more draws than a line has coefficients.
        """
        intercept, slope, rest = linear_fit(values, normals)
        n_samples, n_normals = normals.shape
        with np.errstate(over="ignore", invalid="ignore"):
            square = rest * rest
            spare = n_samples - 1 - n_normals
            explained = cut_normal_moments()[0] * np.einsum("mr,mr->r", slope, slope)
            sigma = np.sqrt(explained + square.sum(axis=0) / spare)
            weight = np.divide(0.5, sigma, out=np.zeros(sigma.size), where=sigma > 0.0)
            line = np.einsum("tm,mr->tr", normals, slope)
            influence = 2.0 * line * rest + square
            inflation = np.sqrt((n_samples - 1) / spare)
            mean_error = inflation * standard_error(rest.sum(axis=1))
            sigma_error = inflation * standard_error(np.einsum("tr,r->t", influence, weight))
        return Moments(intercept, sigma, mean_error, sigma_error)


def linear_fit(values: RealArray, normals: RealArray) -> tuple[RealArray, RealArray, RealArray]:
    """Return intercept (r,), slopes (m, r) and residuals (n, r) of a line through draws.

    Raises
    ------
    InputError
        Not more draws than a line has coefficients.
    """
    n_samples, n_normals = normals.shape
    if n_samples < n_normals + 2:
        raise InputError(
            f"{n_samples} draws of {n_normals} variables are too few for a linear control "
            f"variate: take at least {n_normals + 2}"
        )
    with np.errstate(over="ignore", invalid="ignore"):
        # measured from the first draw, a response without scatter has a slope of exactly zero
        offset = values - values[0]
        centre = offset.sum(axis=0) / n_samples
        middle = normals.sum(axis=0) / n_samples
        draws = normals - middle
        # einsum, not @: the threads of a BLAS library may change the last bit
        gram = np.einsum("tm,tl->ml", draws, draws)
        slope = np.linalg.solve(gram, np.einsum("tm,tr->mr", draws, offset))
        rest = offset - centre - np.einsum("tm,mr->tr", draws, slope)
        intercept = values[0] + centre - np.einsum("m,mr->r", middle, slope)
    return intercept, slope, rest


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


def standard_error(influence: RealArray) -> float:
    """Return the standard error of a mean from its terms, shape (n_samples,), ``n > 1``."""
    centred = influence - influence.sum() / influence.size
    spread = np.einsum("t,t->", centred, centred)
    return float(np.sqrt(spread / (influence.size * (influence.size - 1))))
