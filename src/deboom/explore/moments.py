"""Statistics of responses over their scatter: mean, standard deviation, objectives of a search."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from deboom.arrays import RealArray, checked
from deboom.errors import InputError
from deboom.explore.scatter import cut_normal_moments

CONFIDENCE = 0.95
"""Confidence of an interval that a page shows [1]."""


class Moments(NamedTuple):
    """Mean and sigma of each response, and standard errors of their sums [response unit]."""

    mean: RealArray
    sigma: RealArray
    mean_error: float
    sigma_error: float


@checked(degree=">=0 <=2")
class Estimator:
    """How mean and standard deviation are read from draws, perhaps with a control variate.

    What a simple function of the draws explains has known moments, whatever the draws were; only
    the rest is estimated from the sample. It costs no evaluation, and takes most of the error from
    responses that are nearly linear, or nearly sums of functions of one variable.

    - `degree`: degree of the control variate: 0 for the moments of the sample itself, 1 for a
      straight line, 2 for a parabola in each draw.
    - raises InputError: another degree.

    Least squares give ``y_t = a + β·φ_t + e_t``, with ``φ = z`` and, for degree 2, ``z² - m2``
    beside it. The mean is ``a`` and the variance ``Σ_p β_p² var(φ_p) + Σ_t e_t² / (n - 1 - p)``:
    the ``φ`` are not correlated, and their variances follow from the moments of the cut normal
    distribution (regression estimator, W. G. Cochran, "Sampling Techniques", 3rd ed., 1977, ch. 7).
    The standard errors come from the scatter of the influences ``Σ_r e_tr`` and
    ``Σ_r (2 β_r·φ_t e_tr + e_tr²) / (2 σ_r)``, which keeps the correlation between responses; with
    a control variate each ``e_t`` is divided by one minus its leverage (the jackknife; J. G.
    MacKinnon and H. White, Journal of Econometrics 29, 1985). A control variate needs independent
    standard-normal draws cut at ±3, such as those of `sobol_sample`.
    """

    degree: int = 0

    @property
    def kind(self) -> str:
        """Name of the estimator, for reports and run records."""
        if self.degree == 0:
            return "moments of the sample"
        return f"sample moments with a control variate of degree {self.degree}"

    def __call__(self, normals: RealArray) -> PreparedEstimator:
        """Return the estimator, prepared for draws (n_samples, m) [1]; too few are refused."""
        second, fourth = cut_normal_moments()
        n_samples, m = normals.shape
        powers = [normals, normals**2 - second][: self.degree]
        terms = np.hstack([np.empty((n_samples, 0)), *powers])
        variance = np.repeat([second, fourth - second**2][: self.degree], m)
        if n_samples < terms.shape[1] + 2:
            raise InputError(
                f"{n_samples} draws are too few for a control variate of degree {self.degree} in "
                f"{m} draws per part: take at least {terms.shape[1] + 2}"
            )
        spread = terms - terms.sum(axis=0) / n_samples
        # einsum, not @: the threads of a BLAS library may change the last bit
        gram = np.einsum("tp,tq->pq", spread, spread)
        solver = np.linalg.solve(gram, spread.T)
        leverage = 1.0 / n_samples + np.einsum("tp,pt->t", spread, solver)
        if self.degree == 0:
            leverage = np.zeros(n_samples)
        return PreparedEstimator(terms, variance, solver, leverage)


class Fit(NamedTuple):
    """A function of the draws through the responses of one design.

    - `intercept` (r,), `slope` (p, r): mean, and coefficients of the terms [response unit].
    - `curve` (n_samples, r): the terms with their coefficients, draw by draw [response unit].
    - `rest` (n_samples, r): part of the responses that the function leaves over [response unit].
    - `explained` (p, r), `unexplained` (r,): variance of a term and of the rest [response unit²].
    """

    intercept: RealArray
    slope: RealArray
    curve: RealArray
    rest: RealArray
    explained: RealArray
    unexplained: RealArray

    @property
    def sigma(self) -> RealArray:
        """Standard deviation of each response, shape (r,) [response unit]."""
        return np.asarray(np.sqrt(self.explained.sum(axis=0) + self.unexplained))


class Derivatives(NamedTuple):
    """Mean and sigma of each response, and their derivatives by the responses, draw by draw.

    - `mean`, `sigma` (r,): moments [response unit].
    - `by_mean` (n_samples,): derivative of a mean, the same for every response [1].
    - `by_sigma` (n_samples, r): derivative of each sigma, zero where nothing scatters [1].
    """

    mean: RealArray
    sigma: RealArray
    by_mean: RealArray
    by_sigma: RealArray


@dataclass(frozen=True, eq=False)
class PreparedEstimator:
    """An estimator, prepared for one set of draws.

    - `terms` (n_samples, p), `variance` (p,): terms of the control variate, of which p belongs to
      draw p modulo m, and their exact variances; their exact means are zero [1].
    - `solver` (p, n_samples): map from responses to the coefficients of the terms [1].
    - `leverage` (n_samples,): pull of each response on the function, 0 to 1 [1].
    """

    terms: RealArray
    variance: RealArray
    solver: RealArray
    leverage: RealArray

    def fit(self, values: RealArray) -> Fit:
        """Return the function through the responses, shape (n_samples, r)."""
        n_samples, n_terms = self.terms.shape
        with np.errstate(over="ignore", invalid="ignore"):
            # measured from the first draw, a response without scatter has a sigma of exactly zero
            offset = values - values[0]
            slope = np.einsum("pt,tr->pr", self.solver, offset)
            curve = np.einsum("tp,pr->tr", self.terms, slope)
            above = offset - curve
            intercept = above.sum(axis=0) / n_samples
            rest = above - intercept
            # n - 1 for Sobol points as well, whose mean hardly scatters: sigma is then 1/(2n) too
            # large, 0.4 % at 128 draws, on the safe side and alike for every design
            unexplained = (rest * rest).sum(axis=0) / (n_samples - 1 - n_terms)
            explained = slope * slope * self.variance[:, None]
        return Fit(values[0] + intercept, slope, curve, rest, explained, unexplained)

    def moments(self, values: RealArray, weights: RealArray | None = None) -> Moments:
        """Return the moments of responses, shape (n_samples, r), not finite where these are not.

        The errors are those of sums with weights, shape (r,).
        """
        fit = self.fit(values)
        with np.errstate(over="ignore", invalid="ignore"):
            sigma = fit.sigma
            weight = np.divide(0.5, sigma, out=np.zeros(sigma.size), where=sigma > 0.0)
            # as large as the rest would be, had its draw been left out of the fit
            rest = fit.rest / (1.0 - self.leverage)[:, None]
            if weights is not None:
                weight = weight * weights
            of_sum = rest.sum(axis=1) if weights is None else np.einsum("tr,r->t", rest, weights)
            mean_error = _standard_error(of_sum)
            influence = rest * (2.0 * fit.curve + rest)
            sigma_error = _standard_error(np.einsum("tr,r->t", influence, weight))
        return Moments(fit.intercept, sigma, mean_error, sigma_error)

    def derivatives(self, values: RealArray) -> Derivatives:
        """Return mean and sigma of responses (n_samples, r) with their derivatives by each."""
        n_samples, n_terms = self.terms.shape
        fit = self.fit(values)
        sigma = fit.sigma
        middle = self.terms.sum(axis=0) / n_samples
        by_mean = 1.0 / n_samples - np.einsum("p,pt->t", middle, self.solver)
        variance = fit.rest / (n_samples - 1 - n_terms)
        if n_terms:
            weighted = fit.slope * self.variance[:, None]
            variance = variance + np.einsum("pt,pr->tr", self.solver, weighted)
        by_sigma = variance * np.divide(1.0, sigma, out=np.zeros_like(sigma), where=sigma > 0.0)
        return Derivatives(fit.intercept, sigma, by_mean, by_sigma)


def _standard_error(influence: RealArray) -> float:
    """Return the standard error of a mean from its terms, shape (n_samples,)."""
    centred = influence - influence.sum() / influence.size
    spread = np.einsum("t,t->", centred, centred)
    return float(np.sqrt(spread / (influence.size * (influence.size - 1))))


class Draws(NamedTuple):
    """Responses of one design, draw by draw, and their moments as the estimator gave them.

    - `values` (n_samples, r), `mean`, `sigma` (r,) [response unit].
    - `nominal`: function that returns the responses of the design itself (r,) [response unit].
    """

    values: RealArray
    mean: RealArray
    sigma: RealArray
    nominal: Callable[[], RealArray]


@dataclass(frozen=True)
class Statistic:
    """How one number is computed of each response over its scatter, and how it is named.

    - `words`: name in tables; ``{below:g}`` and ``{beyond:g}`` are the shares of all parts in front
      of the number and beyond it [%], ``{above:g}`` is its level [response unit].
    - `of`: function that returns the number of each response (r,) [`unit`] for an `Objective`.
    - `by_draw`, optional: function that returns the derivatives of the numbers by the responses,
      (n_samples, r) or (n_samples, 1) [1]; searches then descend along gradients.
    - `short`: name in options and files of limits, where it is another one.
    - `unit`: unit, where it is not that of the responses.
    - `is_level`: whether it says how large a response is, not how far it scatters.
    - `takes_level`: whether it counts parts above a level, `Objective.above`.
    - `is_estimate`: whether its draws stand for all parts, so that new draws judge it again.
    """

    words: str
    of: Callable[[Draws, Objective], RealArray]
    by_draw: Callable[[Derivatives], RealArray] | None = None
    short: str = ""
    unit: str = ""
    is_level: bool = True
    takes_level: bool = False
    is_estimate: bool = True


def _tail_mean(draws: Draws, number: Objective) -> RealArray:
    """Return the mean of the worst parts (conditional value at risk, CVaR)."""
    limit = np.quantile(draws.values, number.share, axis=0, method="inverted_cdf")
    beyond = np.maximum(draws.values - limit, 0.0).sum(axis=0) / len(draws.values)
    return np.asarray(limit + beyond / (1.0 - number.share))


STATISTICS: dict[str, Statistic] = {
    "mean": Statistic(
        "mean",
        lambda draws, _: draws.mean,
        by_draw=lambda derivatives: derivatives.by_mean[:, np.newaxis],
    ),
    "sigma": Statistic(
        "sigma",
        lambda draws, _: draws.sigma,
        by_draw=lambda derivatives: derivatives.by_sigma,
        is_level=False,
    ),
    "quantile": Statistic(
        "{below:g} % quantile",
        lambda draws, number: np.asarray(np.quantile(draws.values, number.share, axis=0)),
    ),
    "tail mean": Statistic("mean of the worst {beyond:g} %", _tail_mean, short="tail"),
    "share above": Statistic(
        "share above {above:g}",
        lambda draws, number: np.asarray(np.mean(draws.values > (number.above or 0.0), axis=0)),
        unit="1",
        is_level=False,
        takes_level=True,
    ),
    "nominal": Statistic("nominal", lambda draws, _: draws.nominal(), is_estimate=False),
    "largest": Statistic(
        "largest of all parts", lambda draws, _: draws.values.max(axis=0), is_estimate=False
    ),
    "smallest": Statistic(
        "smallest of all parts", lambda draws, _: draws.values.min(axis=0), is_estimate=False
    ),
}
"""Statistics by name: an entry serves objectives, limits, their files and options, and descents."""


@checked(share=">0 <1")
class Objective:
    """One number of a design, to be minimised or limited: a statistic over the scatter.

    Parameters
    ----------
    statistic : str
        One of `STATISTICS`: ``mean``, ``sigma``, ``quantile``, ``tail mean``, ``share above``;
        ``nominal`` of the design itself, without scatter; ``largest`` or ``smallest`` of the parts
        that are drawn.
    worst : bool
        Take the largest over the responses, such as the loudest vehicle's, instead of the sum.
    share : float
        Share of all parts below the quantile, or in front of the tail, such as 0.95 [1].
    response : str or callable, optional
        A response by name; a function of the responses, (n, r) → (n,); or a model of its own, such
        as a `deboom.ResponseFunction`, of the designs as made, of whose responses the sum or the
        worst counts. By default all responses.
    above : float, optional
        Level beyond which ``share above`` counts a part [unit].
    unit, label : str
        Unit where it is not that of the responses, and name in tables; by default made up.

    Raises
    ------
    InputError
        A share outside 0 to 1; another statistic; a level without ``share above`` or the reverse.

    See Also
    --------
    deboom.Robust, deboom.search, deboom.BoxQuestion

    Notes
    -----
    The tail mean is ``q + mean(max(y - q, 0)) / (1 - share)`` with ``q`` the quantile (R. T.
    Rockafellar and S. Uryasev, "Optimization of conditional value-at-risk", Journal of Risk 2,
    2000).

    Examples
    --------
    >>> import deboom
    >>> deboom.Objective("quantile", share=0.9, response="U06-5").name
    '90 % quantile, U06-5'
    """

    statistic: str
    worst: bool = False
    share: float = 0.95
    response: str | Callable[[RealArray], RealArray] | None = None
    above: float | None = None
    unit: str = ""
    label: str = ""

    def __post_init__(self) -> None:
        if (self.above is not None) != self.rule.takes_level:
            raise InputError(
                "a level belongs to the share above it: Objective('share above', above=60.0)"
            )

    @property
    def rule(self) -> Statistic:
        """How the statistic is computed and named; InputError if there is none of that name."""
        try:
            return STATISTICS[self.statistic]
        except KeyError:
            raise InputError(
                f"there is no statistic '{self.statistic}': take {', '.join(STATISTICS)}"
            ) from None

    @property
    def name(self) -> str:
        """Objective in words, such as ``95 % quantile, sum``."""
        if self.label:
            return self.label
        statistic = self.rule.words.format(
            below=100 * self.share, beyond=100 * (1 - self.share), above=self.above or 0.0
        )
        if self.response is None:
            return f"{statistic}, {'worst response' if self.worst else 'sum'}"
        names = getattr(self.response, "response_names", None) or [
            getattr(self.response, "__name__", "own number")
        ]
        what = self.response if isinstance(self.response, str) else names[0]
        if len(names) > 1 and not isinstance(self.response, str):
            quantity = getattr(self.response, "quantity", "own number")
            what = f"{quantity}, {'worst' if self.worst else 'sum'}"
        return what if self.is_of_design else f"{statistic}, {what}"

    @property
    def has_own_model(self) -> bool:
        """Whether it is of a function of designs, not of responses of the model."""
        return hasattr(self.response, "variable_names")

    @property
    def is_of_design(self) -> bool:
        """Whether it follows from the design alone, without any draw or response of the model."""
        return self.statistic == "nominal" and self.has_own_model

    def shares(self, names: Sequence[str], weights: RealArray | None) -> RealArray | None:
        """Return the weight of each response (r,) in a number with derivatives; None of others.

        - `names`, `weights` (r,): of the responses of the model.
        """
        if self.rule.by_draw is None or self.worst:
            return None
        if self.response is None:
            return np.ones(len(names)) if weights is None else weights
        if not isinstance(self.response, str):
            return None
        return np.asarray(np.eye(len(names))[list(names).index(self.response)])

    def at_most(self, bound: float | str) -> Limit:
        """Return the limit that the number is at most a bound, or ``"today"`` [unit]."""
        return Limit(self, at_most=bound)

    def at_least(self, bound: float | str) -> Limit:
        """Return the limit that the number is at least a bound, or ``"today"`` [unit]."""
        return Limit(self, at_least=bound)

    def __call__(self, draws: Draws, weights: RealArray | None = None) -> float:
        """Return the objective of draws of its responses [response unit].

        - `weights` (r,), optional: of the responses in a sum [1].
        """
        numbers = self.rule.of(draws, self)
        if self.worst:
            return float(numbers.max())
        return float(numbers.sum() if weights is None else np.einsum("r,r->", weights, numbers))


TODAY = "today"
"""A bound that is the number of today's design."""


@dataclass(frozen=True)
class Limit:
    """A number of a design with bounds that are allowed values; infinite where there is none.

    Parameters
    ----------
    number : Objective
        What is limited; see `Objective.at_most`.
    at_least, at_most : float or str
        Bounds, or ``"today"`` for the number of today's design under the same draws [unit of the
        number].
    source : str
        Who stated the limit, such as a file and the place in it, or an option.
    n_lines : int
        Lines that the number is the sum of; sentences give the mean over them.

    Raises
    ------
    InputError
        No bound at all, another text, or bounds that leave no value between them.

    Examples
    --------
    >>> import deboom
    >>> deboom.Objective("mean", response="U06-5").at_most("today").at_most
    'today'
    """

    number: Objective
    at_least: float | str = -np.inf
    at_most: float | str = np.inf
    source: str = ""
    n_lines: int = 1

    def __post_init__(self) -> None:
        sides = (self.at_least, self.at_most)
        for bound in sides:
            if isinstance(bound, str) and bound != TODAY:
                raise self._fault(f"'{bound}' is no bound, give a number or '{TODAY}'")
        if TODAY in sides:
            return
        low, high = map(float, sides)
        if not low <= high:
            raise self._fault(f"at least {low:g} and at most {high:g} exclude each other")
        if np.isinf(low) and np.isinf(high):
            raise self._fault("give at_least, at_most or both")

    def _fault(self, words: str) -> InputError:
        stated = f"{self.source}: " if self.source else ""
        return InputError(f"{stated}limit of {self.number.name}: {words}")

    @property
    def needs_today(self) -> bool:
        """Whether a bound is the number of today's design."""
        return TODAY in (self.at_least, self.at_most)


MEAN_SUM = Objective("mean")
SIGMA_SUM = Objective("sigma")
