"""A robust search of costly models: Gaussian processes, infill, and the true model as judge.

The budget is counted in rows of the true model. Most of them train one Gaussian process of
scikit-learn per response; a search with all draws runs on these along their gradients, more rows
are computed where its front is uncertain, and the rest of the budget lets the true model judge the
picks.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from scipy.spatial.distance import cdist
from scipy.stats import qmc
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel
from sklearn.model_selection import KFold, cross_val_predict

from deboom.arrays import RealArray, short_repr
from deboom.errors import InputError
from deboom.explore.descent import PullBack, converged_front
from deboom.explore.doe import SAME
from deboom.explore.front import verification_response
from deboom.explore.result import Front
from deboom.explore.robust import Robust
from deboom.explore.scatter import TRUNCATION, made_terms
from deboom.explore.search import Store, search
from deboom.explore.space import (
    DesignSpace,
    Evaluate,
    check_fits,
    checked_seed,
    generator,
    responses,
    said,
    spread_unit,
)
from deboom.explore.workers import process_pool
from deboom.progress import Progress
from deboom.tabled import Tabled

FIRST = 0.7
"""Share of the training rows that fill the space; uncertain parts of the front get the rest [1]."""
ROUNDS = 3
"""Rounds of infill."""
ROUGH = 32
"""Draws of the search between two rounds."""
VERIFIED = 256
"""Draws of each scramble with which the surrogate judges its front."""
FEWEST = 5
"""Rows for each judged pick, at least."""
RESTARTS = 2
"""Further starts of the likelihood, from random length scales."""
FOLDS = 10
"""Parts of the rows, each of which is predicted from the others."""
JITTER, LARGEST = 1e-8, 1e5
"""Variance that is added to each row, and largest variance of a process, both of responses of
variance 1: a smooth kernel makes the matrix nearly singular, to within the rounding of the largest.
"""


@dataclass(frozen=True, eq=False)
class GaussianProcessModel:
    """Responses predicted by one Gaussian process each, as any other model.

    - `variable_names`, `response_names`, `response_unit`, `n_lines`: of the true model.
    - `lower`, `upper` (k,): box of the rows, which is scaled to 0 to 1 [units of the space].
    - `processes`: one fitted regressor per response, over scaled rows, of the response about
      `offset` (r,) in units of `size` (r,) [response unit].
    - `errors` (r,): root mean square error of each response, cross-validated [response unit].
    - `n_rows`: rows of the true model behind it.
    """

    variable_names: tuple[str, ...]
    response_names: tuple[str, ...]
    response_unit: str
    n_lines: int
    lower: RealArray
    upper: RealArray
    processes: tuple[GaussianProcessRegressor, ...]
    offset: RealArray
    size: RealArray
    errors: RealArray
    n_rows: int

    __repr__ = short_repr

    @property
    def judges(self) -> str:
        """What judges a front of this model, in words; see `Front.judged_by`."""
        return f"Gaussian processes of {self.n_rows} rows"

    @property
    def is_linearisable(self) -> bool:
        """Whether derivatives are exact: those of the kernel are, everywhere."""
        return True

    def __call__(self, designs: RealArray) -> RealArray:
        """Return the predicted responses, shape (n, r) [response unit]."""
        scaled = self._scaled(designs)
        return self._summed([terms.sum(axis=1) for terms in self._terms(scaled)])

    def linearised(self, designs: RealArray) -> tuple[RealArray, PullBack]:
        """Return the predicted responses of designs (n, k), shape (n, r), and their pull-back.

        Row m adds ``a_m = size α_m c² exp(−Σ_k (u_k − u_mk)² / 2 l_k²)`` to a response, whose
        derivative by ``u_k`` is ``Σ_m a_m (u_mk − u_k) / l_k²``.
        """
        scaled, span = self._scaled(designs), self.upper - self.lower
        every = list(self._terms(scaled))
        sums = [terms.sum(axis=1) for terms in every]

        def pull_back(weights: RealArray) -> RealArray:
            slopes = [
                (terms @ process.X_train_ - total[:, np.newaxis] * scaled) / _lengths(process) ** 2
                for terms, total, process in zip(every, sums, self.processes, strict=True)
            ]
            return np.asarray(np.einsum("onr,rnk->onk", weights, np.array(slopes) / span))

        return self._summed(sums), pull_back

    def deviation(self, designs: RealArray) -> RealArray:
        """Return the standard deviation of the prediction of the sum, shape (n,)."""
        scaled = self._scaled(designs)
        with warnings.catch_warnings():
            # at a row itself the variance is zero but for rounding
            warnings.filterwarnings("ignore", "Predicted variances smaller than 0")
            parts = [process.predict(scaled, return_std=True)[1] for process in self.processes]
        return np.asarray(np.sqrt(np.sum(np.square(self.size * np.transpose(parts)), axis=1)))

    def _terms(self, scaled: RealArray) -> Iterator[RealArray]:
        """Give what each row adds to the responses of scaled designs, (n, m) [response unit]."""
        for process, size in zip(self.processes, self.size, strict=True):
            lengths = _lengths(process)
            terms = cdist(scaled / lengths, process.X_train_ / lengths, "sqeuclidean")
            np.exp(np.multiply(terms, -0.5, out=terms), out=terms)
            terms *= size * process.kernel_.k1.constant_value * process.alpha_
            yield terms

    def _summed(self, sums: Sequence[RealArray]) -> RealArray:
        return np.asarray(self.offset + np.column_stack(sums))

    def _scaled(self, designs: RealArray) -> RealArray:
        return np.asarray((np.asarray(designs) - self.lower) / (self.upper - self.lower))


def _lengths(process: GaussianProcessRegressor) -> RealArray:
    """Return the length scale of each scaled variable, shape (k,) [1]."""
    return np.asarray(process.kernel_.k2.length_scale)


@dataclass(frozen=True, eq=False)
class SurrogateFront(Tabled):
    """A front that was searched on Gaussian processes, and what the true model says of its picks.

    Parameters
    ----------
    front : Front
        Searched and verified on the surrogate, as its ``table`` and ``text`` say.
    surrogate : GaussianProcessModel
        The surrogate, with its cross-validated errors.
    designs, responses : array, shape (n, k) and (n, r)
        All rows that the true model computed; NaN where it failed.
    judged : pandas.DataFrame
        One row per pick: mean and sigma sums by the model with their standard errors, and by the
        surrogate alone.
    """

    front: Front
    surrogate: GaussianProcessModel
    designs: RealArray
    responses: RealArray
    judged: pd.DataFrame

    __repr__ = short_repr

    @property
    def table(self) -> pd.DataFrame:
        """One row per pick, as the true model judges it with the surrogate as control variate."""
        return self.judged

    @property
    def errors(self) -> pd.DataFrame:
        """Cross-validated error of each response, and as a share of what varies over the rows."""
        unit, values = self.surrogate.response_unit, self.responses
        spread = np.nanstd(values, axis=0)
        share = np.divide(
            self.surrogate.errors, spread, out=np.zeros(spread.size), where=spread > 0
        )
        return pd.DataFrame(
            {
                "response": list(self.surrogate.response_names),
                f"cross-validated error [{unit}]": self.surrogate.errors,
                "share of the standard deviation [%]": 100.0 * share,
            }
        )


def surrogate_search(
    model: Evaluate,
    space: DesignSpace,
    *,
    budget: int = 300,
    judged: float = 0.2,
    draws: int = 128,
    population: int = 100,
    generations: int = 60,
    seed: int = 1,
    workers: int = 1,
    progress: Progress | None = None,
    checkpoint: Store | None = None,
) -> SurrogateFront:
    """Search the robust front of a costly model on Gaussian processes that it trains.

    Parameters
    ----------
    model : any evaluation
        Designs, shape (n, k) → responses, shape (n, r); called with one row at a time.
    space : DesignSpace
        Bounds and tolerances of its k variables, none of whole numbers.
    budget : int
        Rows that the true model computes, for training and for its judgement of the picks.
    judged : float
        Share of them that judges, below 1; 0: none, for models so costly that a few dozen rows are
        all there is. The table then holds what the surrogate says alone.
    draws : int
        Draws of the scatter on the surrogate, a power of two.
    population, generations : int
        Of the search on the surrogate, whose algorithm gives way to descents as in `deboom.search`.
    seed : int
        Seed from 1.
    workers : int
        Processes that compute rows at the same time.
    progress : callable, optional
        Called with the number of rows so far, the budget and a line of text.
    checkpoint : Store, optional
        Where every row is kept, and taken from when the search is started again.

    Returns
    -------
    SurrogateFront
        ``front``, judged by the surrogate; ``table``, its picks judged by the true model; and
        ``errors`` of the surrogate.

    Raises
    ------
    InputError
        Names that differ; a whole-number variable; a budget too small for the variables or for
        the judgement; a model that fails at nearly all rows; a seed below 1.

    See Also
    --------
    deboom.search, deboom.ResponseFunction, deboom.doe, deboom.Robust

    Notes
    -----
    Rows lie in the box of the designs as they are made, tolerances included. The kernel is
    ``c² exp(−Σ_k (u_k − u'_k)² / 2 l_k²)`` over scaled variables, with a length scale for each; the
    likelihood is maximised from several starts (C. E. Rasmussen, C. K. I. Williams, "Gaussian
    Processes for Machine Learning", 2006, ch. 5).

    A pick is judged at n of the draws of the verification with the surrogate s as control variate:
    ``mean = mean_all(s) + mean_n(y − s)``, and likewise for the squares about the mean; the errors
    are those of these differences.

    Examples
    --------
    >>> import deboom
    >>> square = deboom.ResponseFunction(lambda x: (x - 0.9) ** 2, ("a", "b"), ("y", "z"), "dB")
    >>> result = deboom.surrogate_search(
    ...     square, square.design_space(), budget=100, draws=16, population=12, generations=4
    ... )
    >>> len(result.designs) <= 100
    True
    """
    check_fits(model, space)
    checked_seed(seed)
    k = space.n_variables
    if not 0.0 <= judged < 1.0:
        raise InputError(f"judged={judged:g}: a share of the rows from 0 to below 1")
    n_judged = int(judged * budget)
    n_train = budget - n_judged
    if space.integer.any():
        raise InputError(
            f"'{space.names[int(np.argmax(space.integer))]}' takes whole numbers, which a Gaussian "
            "process has no order for: search the model itself"
        )
    least = 2 * k / FIRST / (1.0 - judged)
    if judged:
        least = max(least, 4 * FEWEST / judged)
    if budget < least:
        raise InputError(
            f"a budget of {budget} rows is too small for {k} variables, of which {100 * judged:g} "
            f"% judge the picks: give at least {np.ceil(least):.0f}, or judged=0"
        )
    corners = np.stack([space.lower, space.upper])
    factor, added = made_terms(space, np.outer([-TRUNCATION, TRUNCATION], np.ones(k)))
    reached = corners[:, np.newaxis] * factor + added
    lower, upper = reached.min(axis=(0, 1)), reached.max(axis=(0, 1))
    upper = np.where(upper > lower, upper, lower + 1.0)
    with _rows(model, budget, workers, progress, checkpoint) as rows:
        plan = qmc.LatinHypercube(k, optimization="random-cd", rng=generator(seed, "surrogate"))
        points = plan.random(int(FIRST * n_train))
        rows.compute(lower + points * (upper - lower), "training rows")
        surrogate = _fitted(model, rows, lower, upper, seed)
        for number in range(ROUNDS):
            count = (n_train - len(rows.designs)) // (ROUNDS - number)
            if count < 1:
                continue
            robust = Robust(surrogate, space, draws=min(draws, ROUGH), seed=seed)
            rough = converged_front(robust, seed=seed + number).designs
            rows.compute(_infill(robust, surrogate, rough, count, seed, number),
                         f"infill {number + 1}")  # fmt: skip
            surrogate = _fitted(model, rows, lower, upper, seed, surrogate)
        robust = Robust(surrogate, space, draws=draws, seed=seed)
        front = search(
            robust,
            population=population,
            generations=generations,
            seed=seed,
            verified_with=VERIFIED,
        )
        n_trained = len(rows.designs)
        table = _judged(front, rows, n_judged, seed)
    n_rows = len(rows.designs) - n_trained
    how = f"The model itself judged the picks with {n_rows} further rows."
    if not judged:
        how = "The surrogate alone judged the picks."
    front = replace(front, note=f"{front.note} {how}")
    return SurrogateFront(front, surrogate, rows.designs, rows.values, table)


class _Rows:
    """Rows of the true model, kept as soon as they are computed."""

    def __init__(
        self,
        model: Evaluate,
        budget: int,
        pool: Any,
        progress: Progress | None,
        store: Store | None,
    ) -> None:
        self.model, self.budget, self.pool = model, budget, pool
        self.progress, self.store = progress, store
        self.designs = np.empty((0, len(model.variable_names)))
        self.values = np.empty((0, len(model.response_names)))
        self.messages: list[str] = []

    def compute(self, designs: RealArray, words: str) -> RealArray:
        """Return the responses of designs (n, k), NaN where the model fails, shape (n, r)."""
        first = len(self.designs)
        kept = [self._kept(first + place + 1, row) for place, row in enumerate(designs)]
        missing = [row for row, values in zip(designs, kept, strict=True) if values is None]
        fresh = (
            map(_row, [self.model] * len(missing), missing)
            if self.pool is None
            else self.pool.map(_row, [self.model] * len(missing), missing)
        )
        for design, values in zip(designs, kept, strict=True):
            if values is None:
                values, message = next(fresh)
                self.messages += [message] if message else []
                if self.store is not None:
                    arrays = {"designs": design[np.newaxis], "responses": values[np.newaxis]}
                    self.store.keep(len(self.designs) + 1, arrays)
            self.designs = np.vstack([self.designs, design])
            self.values = np.vstack([self.values, values])
            if self.progress is not None:
                self.progress(len(self.designs), self.budget, words)
        return self.values[first:]

    def _kept(self, number: int, design: RealArray) -> RealArray | None:
        kept = self.store.kept(number) if self.store is not None else None
        if kept is None or not np.array_equal(kept["designs"][0], design):
            return None
        return np.asarray(kept["responses"][0])


def _row(model: Evaluate, design: RealArray) -> tuple[RealArray, str]:
    """Return the responses (r,) of one design, NaN and the error where the model fails."""
    try:
        values, message = responses(model, design[np.newaxis])[0], ""
    except Exception as error:
        values, message = np.full(len(model.response_names), np.nan), said(error)
    if not np.isfinite(values).all():
        return np.full(len(values), np.nan), message or "a response is not finite"
    return values, message


@contextmanager
def _rows(
    model: Evaluate, budget: int, workers: int, progress: Progress | None, store: Store | None
) -> Iterator[_Rows]:
    if workers < 1:
        raise InputError(f"{workers} workers cannot compute anything: take a whole number from 1")
    if workers == 1:
        yield _Rows(model, budget, None, progress, store)
        return
    pool = process_pool(workers)
    try:
        yield _Rows(model, budget, pool, progress, store)
    finally:
        pool.shutdown(wait=True, kill_workers=True)


def _fitted(
    model: Evaluate,
    rows: _Rows,
    lower: RealArray,
    upper: RealArray,
    seed: int,
    before: GaussianProcessModel | None = None,
) -> GaussianProcessModel:
    """Return Gaussian processes through all rows that could be computed.

    Those of fewer rows, if there are any, are where the likelihood is maximised from.
    """
    ok = np.isfinite(rows.values).all(axis=1)
    if ok.sum() < 2 * len(lower):
        why = f", such as by '{rows.messages[0]}'" if rows.messages else ""
        raise InputError(
            f"only {ok.sum()} of {ok.size} rows could be computed{why}: evaluate the nominal "
            "design alone and check the bounds of the design space"
        )
    scaled = (rows.designs[ok] - lower) / (upper - lower)
    offset, spread = rows.values[ok].mean(axis=0), rows.values[ok].std(axis=0)
    size = np.where(spread > 0.0, spread, 1.0)
    kernels = [None] * size.size if before is None else [each.kernel_ for each in before.processes]
    with warnings.catch_warnings():
        # a likelihood that stops a little early does no harm, and the errors tell
        warnings.simplefilter("ignore", ConvergenceWarning)
        pairs = [
            _process(scaled, values, seed, kernel)
            for values, kernel in zip(((rows.values[ok] - offset) / size).T, kernels, strict=True)
        ]
    return GaussianProcessModel(
        variable_names=tuple(model.variable_names),
        response_names=tuple(model.response_names),
        response_unit=model.response_unit,
        n_lines=int(getattr(model, "n_lines", 1)),
        lower=lower,
        upper=upper,
        processes=tuple(process for process, _ in pairs),
        offset=offset,
        size=size,
        errors=size * [error for _, error in pairs],
        n_rows=int(ok.sum()),
    )


def _process(
    scaled: RealArray, values: RealArray, seed: int, before: Any = None
) -> tuple[GaussianProcessRegressor, float]:
    """Return the process through values (n,) over scaled rows, and its cross-validated error.

    - `before`: kernel of fewer rows, from which the likelihood is maximised alone.
    """
    first = ConstantKernel(1.0, (1e-3, LARGEST)) * RBF(np.ones(scaled.shape[1]), (0.05, 1e3))
    process = GaussianProcessRegressor(
        before or first,
        alpha=JITTER,
        n_restarts_optimizer=RESTARTS if before is None else 0,
        random_state=seed,
    ).fit(scaled, values)
    fixed = GaussianProcessRegressor(process.kernel_, alpha=JITTER, optimizer=None)
    folds = KFold(FOLDS, shuffle=True, random_state=seed)
    beyond = cross_val_predict(fixed, scaled, values, cv=folds) - values
    return process, float(np.sqrt(np.mean(beyond**2)))


def _infill(
    robust: Robust,
    surrogate: GaussianProcessModel,
    designs: RealArray,
    count: int,
    seed: int,
    number: int,
) -> RealArray:
    """Return rows near the front of the surrogate whose prediction is least certain, (count, k).

    Candidates are parts as made of designs on the front; each that is taken lets those beside it
    wait.
    """
    random = generator(seed, "infill", number)
    candidates = np.vstack([designs, *(robust.made(row)[random.integers(robust.sample.n_samples,
                            size=4)] for row in designs)])  # fmt: skip
    deviation = surrogate.deviation(candidates)
    scaled = (candidates - surrogate.lower) / (surrogate.upper - surrogate.lower)
    scales = np.mean([_lengths(process) for process in surrogate.processes], axis=0)
    taken: list[int] = []
    for _ in range(min(count, len(candidates))):
        best = int(np.argmax(deviation))
        taken.append(best)
        distance = np.sum(((scaled - scaled[best]) / scales) ** 2, axis=1)
        deviation = deviation * np.sqrt(1.0 - np.exp(-distance) + SAME)
        deviation[taken] = -1.0
    return np.asarray(candidates[taken])


def _judged(front: Front, rows: _Rows, n_rows: int, seed: int) -> pd.DataFrame:
    """Let the true model judge the picks of a front."""
    of_design: dict[int, list[str]] = {}
    for name, row in front.picks.items():
        of_design.setdefault(row, []).append(name)
    judge = verification_response(front.robust, seed=seed)
    per_pick = min(n_rows // len(of_design), judge.sample.n_samples)
    unit = front.robust.sum_unit
    spread = spread_unit(unit)
    table = []
    for number, (row, names) in enumerate(of_design.items()):
        made = judge.made(front.values.designs[row])
        at = generator(seed, "judge", number).choice(len(made), per_pick, replace=False)
        predicted = front.model(made)
        true = rows.compute(made[at], "picks judged")
        ok = np.isfinite(true).all(axis=1)
        numbers = [np.nan] * 4
        if ok.sum() >= 2:
            numbers = _controlled(predicted, predicted[at][ok], true[ok])
        table.append(
            {
                "pick": " = ".join(names),
                f"mean sum by the model [{unit}]": numbers[0],
                f"standard error of mean sum [{spread}]": numbers[1],
                f"sigma sum by the model [{spread}]": numbers[2],
                f"standard error of sigma sum [{spread}]": numbers[3],
                f"mean sum by the surrogate [{unit}]": front.values.mean_sum[row],
                f"sigma sum by the surrogate [{spread}]": front.values.sigma_sum[row],
                "rows": int(ok.sum()),
            }
        )
    return pd.DataFrame(table)


def _controlled(every: RealArray, predicted: RealArray, true: RealArray) -> list[float]:
    """Return mean and sigma sums with their errors, with the surrogate as control variate.

    - `every` (t, r): predictions at all draws; `predicted`, `true` (n, r): at some of them.
    """
    n = len(true)
    beyond = true - predicted
    mean = every.mean(axis=0) + beyond.mean(axis=0)
    mean_error = beyond.sum(axis=1).std(ddof=1) / np.sqrt(n)
    excess = (true - mean) ** 2 - (predicted - every.mean(axis=0)) ** 2
    variance = np.maximum(every.var(axis=0, ddof=1) + excess.mean(axis=0), 0.0)
    sigma = np.sqrt(variance)
    weight = np.divide(0.5, sigma, out=np.zeros_like(sigma), where=sigma > 0.0)
    sigma_error = (excess * weight).sum(axis=1).std(ddof=1) / np.sqrt(n)
    return [float(mean.sum()), float(mean_error), float(sigma.sum()), float(sigma_error)]
