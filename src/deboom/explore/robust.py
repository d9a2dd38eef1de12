"""Mean and standard deviation of every response over the manufacturing scatter,."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np

from deboom.arrays import BoolArray, RealArray, frozen_copy
from deboom.errors import InputError
from deboom.explore.scatter import (
    ToleranceSample,
    ToleranceSampler,
    ToleranceStructure,
    cut_normal_moments,
)
from deboom.explore.space import DesignSpace, Evaluate, responses


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


@dataclass(frozen=True, eq=False)
class RobustValues:
    """Designs and what their scatter does to the responses, one row per design.

    All but `designs` and `failed` are in the unit of the responses; the rows of failed designs
    hold NaN there.

    Parameters
    ----------
    designs : array, shape (n, k)
        As made without scatter.
    mean, sigma : array, shape (n, r)
        Mean (or the nominal design's response) and standard deviation of each response.
    mean_sum, sigma_sum : array, shape (n,)
        Their sums over the responses: the two objectives.
    standard_error_mean_sum, standard_error_sigma_sum : array, shape (n,)
        Of the two sums, for independent draws; an upper bound for Sobol points.
    failed : array of bool, shape (n,)
        Designs with a response that could not be computed somewhere in the scatter.
    objectives : array, shape (n, m), optional
        What a search minimises; default are the two sums, ``[mean_sum, sigma_sum]``.
    excess : array, shape (n, c), optional
        How far each of c limits is missed, negative where room is left [unit of the limit]; see
        `deboom.explore.limits`. Default is no limit.
    """

    designs: RealArray
    mean: RealArray
    sigma: RealArray
    mean_sum: RealArray
    sigma_sum: RealArray
    standard_error_mean_sum: RealArray
    standard_error_sigma_sum: RealArray
    failed: BoolArray
    objectives: RealArray = field(default_factory=lambda: np.empty((0, 0)))
    excess: RealArray = field(default_factory=lambda: np.empty((0, 0)))

    def __post_init__(self) -> None:
        if self.excess.shape[1] == 0:
            object.__setattr__(self, "excess", np.empty((len(self.designs), 0)))
        if self.objectives.shape[1] == 0:
            both = np.column_stack([self.mean_sum, self.sigma_sum])
            object.__setattr__(self, "objectives", both)
        for column in fields(self):
            array = np.asarray(getattr(self, column.name))
            object.__setattr__(self, column.name, frozen_copy(array))

    def __len__(self) -> int:
        return len(self.designs)

    @property
    def feasible(self) -> BoolArray:
        """Designs that could be computed and keep all limits, shape (n,)."""
        return np.asarray(~self.failed & np.all(self.excess <= 0.0, axis=1))


def joined(parts: Sequence[RobustValues]) -> RobustValues:
    """Put the rows of several values below each other; at least one."""
    return RobustValues(
        **{
            column.name: np.concatenate([getattr(part, column.name) for part in parts])
            for column in fields(RobustValues)
        }
    )


class Robust(Protocol):
    """What a search drives: designs of a space in, `RobustValues` out.

    It may say how many objectives these have, in an attribute ``n_objectives``; without it there
    are two. A response with limits names them in an attribute ``limits``.
    """

    @property
    def space(self) -> DesignSpace:
        """The designs that may be asked for."""

    def __call__(self, designs: RealArray) -> RobustValues:
        """Return the values of the designs, shape (n, k)."""


@dataclass(frozen=True, eq=False)
class RobustResponse:
    """An evaluation wrapped with manufacturing scatter.

    Parameters
    ----------
    evaluate : Evaluate
        The model; it is called once per design, with all draws of that design.
    space : DesignSpace
        Its variables, in the model's order, with their tolerances.
    sample : ToleranceSampler
        The draws ``z``.
    nominal_mean : bool
        Take the response of the design itself for its mean, instead of the mean over the sample.
    estimator : Estimator
        How mean and standard deviation are read from the draws.
    objectives : tuple of Objective
        What a search minimises, at least two.
    structure : ToleranceStructure, optional
        What the variables' scatter has in common; default is independent scatter. The sample then
        has one column per draw of the structure.

    Raises
    ------
    InputError
        Variables of the model, the space, the structure and the sample that differ; a structure
        that would let a variable change its sign; fewer than two objectives.

    Notes
    -----
    A made design is ``x (1 + σ_rel z)``, with σ_rel a third of the tolerance. The standard errors
    take the draws for independent: scrambled Sobol points do better, so for them the figures are
    upper bounds.
    """

    evaluate: Evaluate
    space: DesignSpace
    sample: ToleranceSampler
    nominal_mean: bool = False
    estimator: Estimator = SAMPLE_MOMENTS
    objectives: tuple[Objective, ...] = (MEAN_SUM, SIGMA_SUM)
    structure: ToleranceStructure | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "objectives", tuple(self.objectives))
        if len(self.objectives) < 2:
            raise InputError("a search for a front needs at least two objectives")
        if self.evaluate.variable_names != self.space.names:
            raise InputError(
                f"the model has the variables {list(self.evaluate.variable_names)}, the design "
                f"space {list(self.space.names)}: give both the same names in the same order"
            )
        if self.structure is not None:
            self._check_structure(self.structure)
        elif self.sample.n_variables != self.space.n_variables:
            raise InputError(
                f"the tolerance sample has {self.sample.n_variables} columns for "
                f"{self.space.n_variables} design variables: draw one column per variable"
            )

    def _check_structure(self, structure: ToleranceStructure) -> None:
        if structure.names != self.space.names:
            raise InputError(
                f"the tolerance structure has the variables {list(structure.names)}, the design "
                f"space {list(self.space.names)}: give both the same names in the same order"
            )
        if self.sample.n_variables != structure.n_draws:
            raise InputError(
                f"the tolerance sample has {self.sample.n_variables} columns for a structure of "
                f"{structure.n_draws} draws: draw one column for each"
            )
        reach = self.space.tolerance * structure.largest
        for name, value in zip(self.space.names, reach, strict=True):
            if value >= 1.0:
                raise InputError(
                    f"the scatter of '{name}' could change its sign: its tolerance, with all draws "
                    f"of the structure at their limit, is {value:g}; it must stay below 1"
                )

    @property
    def n_objectives(self) -> int:
        """Number m of objectives."""
        return len(self.objectives)

    def __call__(self, designs: RealArray) -> RobustValues:
        """Return the values of the designs, shape (n, k).

        Raises
        ------
        InputError
            Designs of another shape or not finite; a model that breaks its promised shape.
        """
        designs = self.space.checked(designs)
        n_responses = len(self.evaluate.response_names)
        rows = np.empty((len(designs), 2 * n_responses + 2 + self.n_objectives))
        for row, design in zip(rows, designs, strict=True):
            row[:] = self._one_design(design)
        mean, sigma, errors, objectives = np.hsplit(
            rows, [n_responses, 2 * n_responses, 2 * n_responses + 2]
        )
        return RobustValues(
            designs=designs,
            mean=mean,
            sigma=sigma,
            mean_sum=mean.sum(axis=1),
            sigma_sum=sigma.sum(axis=1),
            standard_error_mean_sum=errors[:, 0],
            standard_error_sigma_sum=errors[:, 1],
            failed=np.isnan(errors[:, 0]),
            objectives=objectives,
        )

    @property
    def n_draws(self) -> int:
        """Number of independent draws that make one part: columns of its sample."""
        return self.space.n_variables if self.structure is None else self.structure.n_draws

    def made(self, design: RealArray) -> RealArray:
        """Return one design (k,) as it is made, draw by draw, shape (n_samples, k)."""
        return self._made(design, self.sample.normals(design))

    def _made(self, design: RealArray, normals: RealArray) -> RealArray:
        scatter = normals if self.structure is None else self.structure.scatter(normals)
        return design * (1.0 + self.space.relative_sigma * scatter)

    @cached_property
    def _shared_moments(self) -> Callable[[RealArray], Moments] | None:
        """The estimator, prepared once for draws that all designs share."""
        return (
            self.estimator(self.sample.values) if isinstance(self.sample, ToleranceSample) else None
        )

    def _one_design(self, design: RealArray) -> RealArray:
        """Return moments, their standard errors and the objectives; all NaN if it failed."""
        normals = self.sample.normals(design)
        size = 2 * len(self.evaluate.response_names) + 2 + self.n_objectives
        failed = np.full(size, np.nan)
        try:
            values = responses(self.evaluate, self._made(design, normals))
            if not np.all(np.isfinite(values)):
                return failed
            moments = self._shared_moments or self.estimator(normals)
            mean, sigma, mean_error, sigma_error = moments(values)
            if self.nominal_mean:
                mean, mean_error = responses(self.evaluate, design[None, :])[0], 0.0
            objectives = [objective(values, mean, sigma) for objective in self.objectives]
        except (ArithmeticError, np.linalg.LinAlgError):
            return failed
        statistics = np.concatenate([mean, sigma, [mean_error, sigma_error], objectives])
        return statistics if np.all(np.isfinite(statistics)) else failed


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
