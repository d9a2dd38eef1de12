"""Mean and standard deviation of every response over the manufacturing scatter, within limits."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from deboom.arrays import BoolArray, RealArray, TextArray, checked, frozen_copy, short_repr
from deboom.choices import Distribution
from deboom.errors import InputError
from deboom.explore.moments import (
    MEAN_SUM,
    SIGMA_SUM,
    Estimator,
    Objective,
    PreparedEstimator,
    RobustLimit,
)
from deboom.explore.scatter import (
    ToleranceSample,
    ToleranceSampler,
    ToleranceStructure,
    made_terms,
    sobol_sample,
)
from deboom.explore.space import (
    DesignSpace,
    Evaluate,
    Requirements,
    check_fits,
    check_same_names,
    checked_model,
    not_finite,
    real_numbers,
    responses,
    said,
    units_of,
)

MOST_OBJECTIVES = 5
"""Objectives of a search: of more, nearly every design is on the front."""


@dataclass(frozen=True, eq=False)
class RobustValues:
    """Designs and what their scatter does to the responses, one row per design.

    All but `designs`, `failed` and `excess` are in the unit of the responses; the rows of failed
    designs hold NaN there.

    - `designs` (n, k): designs as made without scatter.
    - `mean`, `sigma` (n, r): mean (or the nominal design's response) and standard deviation of each
      response.
    - `mean_sum`, `sigma_sum` (n,): sums over the responses.
    - `standard_error_mean_sum`, `standard_error_sigma_sum` (n,): standard errors of the two sums
      for independent draws; upper bounds for Sobol points.
    - `failed` (n,): designs with a response that could not be computed somewhere in the scatter.
    - `objectives` (n, m), optional: numbers that a search minimises; by default the two sums.
    - `excess` (n, c), optional: distance beyond each of c limits, negative where room is left [unit
      of the limit].
    - `message` (n,), optional: what the model said of a design that failed; empty elsewhere.
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
    message: TextArray = field(default_factory=lambda: np.empty(0, dtype=str))

    __repr__ = short_repr

    def __post_init__(self) -> None:
        if self.excess.shape[1] == 0:
            object.__setattr__(self, "excess", np.empty((len(self.designs), 0)))
        if self.objectives.shape[1] == 0:
            both = np.column_stack([self.mean_sum, self.sigma_sum])
            object.__setattr__(self, "objectives", both)
        if len(self.message) != len(self.designs):
            object.__setattr__(self, "message", np.full(len(self.designs), "", dtype="<U1"))
        for column in fields(self):
            array = np.asarray(getattr(self, column.name))
            object.__setattr__(self, column.name, frozen_copy(array))

    def __len__(self) -> int:
        return len(self.designs)

    @property
    def feasible(self) -> BoolArray:
        """Designs that could be computed and keep all limits, shape (n,)."""
        return np.asarray(~self.failed & np.all(self.excess <= 0.0, axis=1))


def kept_values(arrays: Mapping[str, npt.NDArray[Any]]) -> RobustValues:
    """Return values from their arrays by name, as an archive on disk holds them.

    - raises InputError: an array that is missing, or of other dimensions or another type.
    """
    table, number = np.empty((0, 0)), np.empty(0)
    example = RobustValues(
        designs=table,
        mean=table,
        sigma=table,
        mean_sum=number,
        sigma_sum=number,
        standard_error_mean_sum=number,
        standard_error_sigma_sum=number,
        failed=np.empty(0, dtype=bool),
    )
    for column in fields(RobustValues):
        wanted, array = getattr(example, column.name), arrays.get(column.name)
        if array is None or (array.ndim, array.dtype.kind) != (wanted.ndim, wanted.dtype.kind):
            raise InputError(f"kept evaluations have no {column.name}: start a new run")
    return RobustValues(**{column.name: arrays[column.name] for column in fields(RobustValues)})


def joined(parts: Sequence[RobustValues]) -> RobustValues:
    """Put the rows of several values below each other; at least one."""
    return RobustValues(
        **{
            column.name: np.concatenate([getattr(part, column.name) for part in parts])
            for column in fields(RobustValues)
        }
    )


def chosen(values: RobustValues, rows: Sequence[int] | npt.NDArray[np.intp]) -> RobustValues:
    """Return some rows of values, in their order."""
    return RobustValues(
        **{c.name: getattr(values, c.name)[np.asarray(rows, int)] for c in fields(RobustValues)}
    )


class RobustEvaluation(Protocol):
    """What a search drives: designs of a space in, `RobustValues` out.

    A class that derives from it has two objectives and no limits unless it says otherwise.
    """

    @property
    def space(self) -> DesignSpace:
        """The designs that may be asked for."""

    @property
    def n_objectives(self) -> int:
        """Number m of objectives."""
        return 2

    @property
    def limits(self) -> Limits | None:
        """Limits that the designs must keep; None without."""
        return None

    def __call__(self, designs: RealArray) -> RobustValues:
        """Return the values of the designs, shape (n, k)."""


class Around(RobustEvaluation):
    """A robust response around another one, with its space, objectives and limits."""

    robust: RobustEvaluation

    @property
    def space(self) -> DesignSpace:
        """The designs that may be asked for."""
        return self.robust.space

    @property
    def n_objectives(self) -> int:
        """Number m of objectives."""
        return self.robust.n_objectives

    @property
    def limits(self) -> Limits | None:
        """Limits that the designs must keep; None without."""
        return self.robust.limits


@dataclass(frozen=True, eq=False, init=False)
class Robust:
    """A model with manufacturing scatter: a design x is made as ``x (1 + σ_rel z)``.

    Variables with an absolute tolerance or with another distribution follow their `DesignSpace`.

    ``robust(designs)`` gives mean and standard deviation of each response, shape (n, r) [unit of
    the responses], and their sums, which a search minimises.

    Parameters
    ----------
    evaluate : BoomingModel, ResponseFunction or any other evaluation
        Designs, shape (n, k) → responses, shape (n, r); called with all draws of a design at once.
    space : DesignSpace
        Bounds of its k variables, in the model's order, and their tolerances, three times σ_rel.
    sample : ToleranceSampler, optional
        The draws ``z``; by default scrambled Sobol points.
    nominal_mean : bool
        Take the response of the design itself in place of the mean over the sample.
    estimator : Estimator
        How mean and standard deviation are estimated from the draws.
    objectives : tuple of Objective
        Numbers that a search minimises, at least two: by default the sums over the responses of
        mean and σ.
    structure : ToleranceStructure, optional
        What the variables' scatter has in common; by default it is independent. The sample then has
        one column per draw of the structure.
    draws : int
        Draws of the scatter if no sample is given, a power of two; all designs have the same
        draws.
    seed : int
        Seed of these draws, from 1.
    limits : sequence of RobustLimit, optional
        What designs must keep, such as ``Objective("mean", response="U06-5").at_most("today")``.
    weights : array, shape (r,), optional
        Weights of the responses in sums; only their ratios count [1].

    Raises
    ------
    InputError
        An objective or limit of a response that there is not; weights that are negative or none.
        Variables of the model, the space, the structure and the sample that differ; a structure
        that would let a variable change its sign; fewer than two objectives; a model without
        names; a number of draws that is no power of two; a seed below 1.

    Examples
    --------
    >>> import deboom
    >>> square = deboom.ResponseFunction(lambda x: x**2, ("a",), ("y",), "dB")
    >>> robust = deboom.Robust(square, square.design_space(), draws=64)
    >>> robust([[1.0]]).mean.round(3)
    array([[1.002]])
    """

    evaluate: Evaluate
    space: DesignSpace
    sample: ToleranceSampler
    nominal_mean: bool
    estimator: Estimator
    objectives: tuple[Objective, ...]
    structure: ToleranceStructure | None
    limits: RobustLimits | None
    weights: RealArray | None

    __repr__ = short_repr

    def __init__(
        self,
        evaluate: Evaluate,
        space: DesignSpace,
        sample: ToleranceSampler | None = None,
        nominal_mean: bool = False,
        estimator: Estimator | None = None,
        objectives: Sequence[Objective] = (MEAN_SUM, SIGMA_SUM),
        structure: ToleranceStructure | None = None,
        *,
        draws: int = 128,
        seed: int = 1,
        limits: Sequence[RobustLimit] | RobustLimits | None = None,
        weights: npt.ArrayLike | None = None,
    ) -> None:
        if sample is None:
            check_fits(evaluate, space)
            n_draws = space.n_variables if structure is None else structure.n_draws
            sample = sobol_sample(n_draws, draws, seed=seed)
        for name, value in (
            ("evaluate", evaluate),
            ("space", space),
            ("sample", sample),
            ("nominal_mean", nominal_mean),
            ("estimator", estimator or Estimator()),
            ("objectives", tuple(objectives)),
            ("structure", structure),
            ("limits", None),
            ("weights", None),
        ):
            object.__setattr__(self, name, value)
        self._check()
        object.__setattr__(self, "weights", self._normalised(weights))
        numbers = limits.numbers if isinstance(limits, RobustLimits) else tuple(limits or ())
        for number in (*self.objectives, *(limit.objective for limit in numbers)):
            self._check_number(number)
        object.__setattr__(self, "limits", self._resolved(numbers))

    def _check(self) -> None:
        if len(self.objectives) < 2:
            raise InputError("a search for a front needs at least two objectives")
        if len(self.objectives) > MOST_OBJECTIVES:
            raise InputError(
                f"a search for a front of {len(self.objectives)} objectives finds hardly a design "
                f"that another one beats: take at most {MOST_OBJECTIVES}, and limits for the others"
            )
        labels = [objective.name for objective in self.objectives]
        for label in labels:
            if labels.count(label) > 1:
                raise InputError(
                    f"two objectives are named '{label}': give each a label of its own, such as "
                    "Objective(..., label='peak level')"
                )
        names = self.space.names
        model = checked_model(self.evaluate)
        check_same_names("the model has the variables", model.variable_names, names)
        if self.structure is not None:
            check_same_names(
                "the tolerance structure has the variables", self.structure.names, names
            )
            self._check_reach(self.structure)
        if self.sample.n_variables != self.n_draws:
            raise InputError(
                f"the tolerance sample has {self.sample.n_variables} columns for {self.n_draws} "
                f"draws of {len(names)} design variables: draw one column for each"
            )

    def _check_reach(self, structure: ToleranceStructure) -> None:
        space = self.space
        reach = space.tolerance * structure.largest
        is_normal = np.array([each == Distribution.normal for each in space.distribution])
        # the mean of several pieces scatters less than a draw
        mean_of_pieces = np.linalg.norm(structure.loadings, axis=1) < 1.0 - 1e-9
        for name in np.asarray(space.names)[mean_of_pieces & ~is_normal]:
            raise InputError(
                f"'{name}' is the mean of several pieces, whose distribution is not theirs: take "
                f"'{Distribution.normal}' for it"
            )
        for name, value in zip(space.names, np.where(space.absolute, 0.0, reach), strict=True):
            if value >= 1.0 and is_normal[space.names.index(name)]:
                raise InputError(
                    f"the scatter of '{name}' could change its sign: its tolerance, with all draws "
                    f"of the structure at their limit, is {value:g}; it must stay below 1"
                )

    def _normalised(self, weights: npt.ArrayLike | None) -> RealArray | None:
        """Return weights whose mean is 1, so that sums keep their size."""
        if weights is None:
            return None
        given = np.asarray(weights, dtype=float)
        names = tuple(self.evaluate.response_names)
        usable = given.shape == (len(names),) and np.isfinite(given).all() and (given >= 0.0).all()
        if not usable or not given.sum() > 0.0:
            raise InputError(
                f"weights {np.ravel(given).tolist()} of the responses {list(names)}: give each one "
                "of at least 0, and at least one above 0"
            )
        return np.asarray(given / given.mean())

    def _check_number(self, number: Objective) -> None:
        names = tuple(self.evaluate.response_names)
        units = dict.fromkeys(units_of(names, self.evaluate.response_unit))
        if number.response is None and len(units) > 1:
            raise InputError(
                f"'{number.name}' adds or compares responses in {' and '.join(units)}: name the "
                f"response of each objective and limit, such as Objective('{number.statistic}', "
                f"response='{names[0]}')"
            )
        if isinstance(number.response, str) and number.response not in names:
            raise InputError(f"no response '{number.response}': use one of {list(names)}")

    def _resolved(self, numbers: tuple[RobustLimit, ...]) -> RobustLimits | None:
        """Return limits with today's numbers, under these draws, where bounds say so."""
        if not numbers:
            return None
        today = np.full(len(numbers), np.nan)
        if any("today" in (entry.at_most, entry.at_least) for entry in numbers):
            wanted = tuple(entry.objective for entry in numbers)
            today = self._numbers(self.space.nominal, wanted)
        bounds = []
        for limit, value in zip(numbers, today, strict=True):
            sides = []
            for bound in (limit.at_least, limit.at_most):
                if isinstance(bound, str) and bound != "today":
                    raise InputError(
                        f"limit of {limit.objective.name}: '{bound}' is no bound, give a number "
                        "or 'today'"
                    )
                sides.append(float(value) if bound == "today" else float(bound))
            name, unit = limit.objective.name, self.unit_of(limit.objective)
            low, high = sides
            bounds.append(Limit(name, unit, low, high, limit.source, limit.n_lines))
        return RobustLimits(tuple(bounds), numbers)

    def unit_of(self, number: Objective) -> str:
        """Return the unit of an objective or of a limited number."""
        unit = number.rule.unit or number.unit or getattr(number.response, "response_unit", "")
        names = tuple(self.evaluate.response_names)
        at = names.index(number.response) if number.response in names else 0
        return str(unit or units_of(names, self.evaluate.response_unit)[at])

    @property
    def objective_labels(self) -> tuple[str, ...]:
        """Name and unit of each objective, ``name [unit]``."""
        return tuple(
            f"{objective.name} [{self.unit_of(objective)}]" for objective in self.objectives
        )

    @property
    def n_objectives(self) -> int:
        """Number m of objectives."""
        return len(self.objectives)

    @property
    def begins_with_level_and_sigma(self) -> bool:
        """Whether it minimises first a level and a sigma of all responses, as each `Pick` does."""
        pair = self.objectives[:2]
        if any(each.response is not None for each in pair):
            return False
        level, sigma = pair
        return level.rule.is_level and sigma.statistic == "sigma"

    @property
    def weight_ratios(self) -> RealArray:
        """Weights of the responses over the smallest above 0, shape (r,) [1]."""
        if self.weights is None:
            return np.ones(len(self.evaluate.response_names))
        return np.asarray(np.round(self.weights / self.weights[self.weights > 0.0].min(), 9))

    @property
    def n_draws(self) -> int:
        """Number of independent draws that make one part: columns of its sample."""
        return self.space.n_variables if self.structure is None else self.structure.n_draws

    @property
    def draw_names(self) -> tuple[str, ...]:
        """Meaning of each draw: the variables, or what they share."""
        return self.space.names if self.structure is None else self.structure.draw_names

    def __call__(self, designs: RealArray) -> RobustValues:
        """Return the values of the designs, shape (n, k)."""
        designs = self.space.checked(designs)
        r = len(self.evaluate.response_names)
        m, n_limits = self.n_objectives, len(self.limits.numbers) if self.limits else 0
        rows = np.empty((len(designs), 2 * r + 2 + m + n_limits))
        messages = []
        for row, design in zip(rows, designs, strict=True):
            row[:], message = self._statistics(design)
            messages.append(message)
        parts = np.hsplit(rows, [r, 2 * r, 2 * r + 2, 2 * r + 2 + m])
        mean, sigma, errors, objectives, limited = parts
        sums = (
            [part.sum(axis=1) for part in (mean, sigma)]
            if self.weights is None
            else [np.einsum("nr,r->n", part, self.weights) for part in (mean, sigma)]
        )
        return RobustValues(
            designs=designs,
            mean=mean,
            sigma=sigma,
            mean_sum=sums[0],
            sigma_sum=sums[1],
            standard_error_mean_sum=errors[:, 0],
            standard_error_sigma_sum=errors[:, 1],
            failed=np.isnan(errors[:, 0]),
            objectives=objectives,
            excess=self.limits.excess(limited) if self.limits else np.empty((len(designs), 0)),
            message=np.array(messages, dtype=str),
        )

    def scatter(self, design: RealArray) -> RealArray:
        """Return the scatter of the variables of one design, shape (n_samples, k) [1]."""
        normals = self.sample.normals(design)
        return normals if self.structure is None else self.structure.scatter(normals)

    def made_terms(self, design: RealArray) -> tuple[RealArray, RealArray]:
        """Return what the scatter multiplies one design (k,) by, and what it adds to it.

        - returns (n_samples, k) twice: see `deboom.explore.scatter.made_terms`.
        """
        return self._shared_terms or made_terms(self.space, self.scatter(design))

    @cached_property
    def _shared_terms(self) -> tuple[RealArray, RealArray] | None:
        """The terms, computed once for draws that all designs share."""
        if isinstance(self.sample, ToleranceSample):
            return made_terms(self.space, self.scatter(self.space.nominal))
        return None

    def made(self, design: RealArray) -> RealArray:
        """Return one design (k,) as it is made, draw by draw, shape (n_samples, k)."""
        factor, added = self.made_terms(design)
        return np.asarray(design * factor + added)

    def made_responses(self, design: RealArray) -> tuple[RealArray, RealArray]:
        """Return one design (k,) as it is made, (n_samples, k), and its responses (n_samples, r).

        - raises InputError: a design that fails somewhere in its scatter.
        """
        made = self.made(design)
        values = responses(self.evaluate, made)
        if not np.all(np.isfinite(values)):
            raise InputError(
                "the design fails somewhere in its scatter: choose another one, or tighter bounds"
            )
        return made, values

    def survivors(self, design: RealArray) -> tuple[float, float]:
        """Return what is left of one design (k,) that fails in some draws.

        - returns: share of draws that failed [1], and sum over the responses of their means over
          the other draws, NaN without any [response unit]. It flatters the design, so that neither
          a front nor a pick may rest on it.
        """
        try:
            values = responses(self.evaluate, self.made(design))
        except Exception as error:
            said(error)
            return 1.0, np.nan
        computed = np.isfinite(values).all(axis=1)
        mean = values[computed].mean(axis=0).sum() if computed.any() else np.nan
        return float(1.0 - computed.mean()), float(mean)

    def prepared(self, design: RealArray) -> PreparedEstimator:
        """Return the estimator, prepared for the draws of a design (k,)."""
        return self._shared_estimator or self.estimator(self.sample.normals(design))

    @cached_property
    def _shared_estimator(self) -> PreparedEstimator | None:
        """The estimator, prepared once for draws that all designs share."""
        if isinstance(self.sample, ToleranceSample):
            return self.estimator(self.sample.values)
        return None

    def _statistics(self, design: RealArray) -> tuple[RealArray, str]:
        """Moments, their standard errors and the objectives; all NaN, and why, if it failed."""
        limited = [limit.objective for limit in self.limits.numbers] if self.limits else []
        n_numbers = 2 * len(self.evaluate.response_names) + 2 + self.n_objectives + len(limited)
        failed = np.full(n_numbers, np.nan)
        try:
            made = self.made(design)
            values = responses(self.evaluate, made)
            if not np.all(np.isfinite(values)):
                return failed, not_finite(values, self.evaluate.response_names)
            moments = self.prepared(design).moments(values, self.weights)
            mean, sigma, mean_error, sigma_error = moments
            if self.nominal_mean:
                mean, mean_error = responses(self.evaluate, design[None, :])[0], 0.0
            objectives = [
                self._number(entry, design, made, values, mean, sigma)
                for entry in (*self.objectives, *limited)
            ]
        except Exception as error:
            return failed, said(error)
        statistics = np.concatenate([mean, sigma, [mean_error, sigma_error], objectives])
        if not np.all(np.isfinite(statistics)):
            names = [entry.name for entry in (*self.objectives, *limited)]
            lost = [n for n, x in zip(names, objectives, strict=True) if not np.isfinite(x)]
            return failed, f"not finite: {', '.join(lost) or 'a mean or a sigma'}"
        return statistics, ""

    def _number(
        self,
        objective: Objective,
        design: RealArray,
        made: RealArray,
        values: RealArray,
        mean: RealArray,
        sigma: RealArray,
    ) -> float:
        """Return one number of a design whose responses and their moments are there."""
        if objective.response is None:
            return objective(values, mean, sigma, self.weights)
        if isinstance(objective.response, str):
            at = [tuple(self.evaluate.response_names).index(objective.response)]
            return objective(values[:, at], mean[at], sigma[at])
        of_designs = hasattr(objective.response, "variable_names")
        given = np.array(made) if of_designs else np.array(values)
        # a model of its own may have several responses, whose sum or worst counts
        names = getattr(objective.response, "response_names", (objective.name,))
        columns, n_columns = real_numbers(objective.response(given), names), len(names)
        if columns.size != len(values) * n_columns:
            raise InputError(
                f"the objective '{objective.name}' gave an array of shape {columns.shape} for "
                f"{len(values)} draws: return one number for each"
            )
        columns = columns.reshape(-1, n_columns)
        moments = self.prepared(design).moments(columns)
        return objective(columns, moments.mean, moments.sigma)

    def _numbers(self, design: RealArray, numbers: Sequence[Objective]) -> RealArray:
        """Return numbers of a design that does not fail, shape (n,)."""
        made, values = self.made_responses(design)
        moments = self.prepared(design).moments(values)
        mean, sigma = moments.mean, moments.sigma
        if self.nominal_mean:
            mean = responses(self.evaluate, design[None, :])[0]
        return np.array(
            [self._number(objective, design, made, values, mean, sigma) for objective in numbers]
        )


@checked(of_response="m r", rest="r", of_sum="m")
class SigmaShares:
    """Where the variance of one design comes from.

    - `names`: draws: the variables, or what they share.
    - `of_response`, `rest` (m, r): share of each draw alone in the variance of each response, and
      what no draw explains alone [1].
    - `of_sum` (m,): share of each draw in the sum of the standard deviations of the responses,
      with their weights [1].
    """

    names: tuple[str, ...]
    of_response: RealArray
    rest: RealArray
    of_sum: RealArray


def sigma_shares(robust: Robust, design: RealArray, degree: int = 1) -> SigmaShares:
    """Return the share of each draw in the variance of one design (k,).

    The shares of a response add up to 1 with its rest; all are 0 without any scatter. The degree is
    that of the control variate, see `Estimator`: 1 or 2.

    - raises InputError: a design that fails, or too few draws.

    The share in the sum of the standard deviations is ``Σ_r var_rk / σ_r / Σ_r σ_r``: twice the
    part by which the sum falls, to first order, when that draw no longer scatters.
    """
    base = robust.space.checked(np.atleast_2d(design))[0]
    _, values = robust.made_responses(base)
    normals = robust.sample.normals(base)
    fit = Estimator(degree)(normals).fit(values)
    alone = fit.explained.reshape(degree, normals.shape[1], -1).sum(axis=0)
    variance = alone.sum(axis=0) + fit.unexplained
    sigma = np.sqrt(variance)
    scatters = variance > 0.0
    per_sigma = np.divide(alone, sigma, out=np.zeros_like(alone), where=scatters)
    if robust.weights is not None:
        per_sigma, sigma = per_sigma * robust.weights, sigma * robust.weights
    return SigmaShares(
        names=robust.draw_names,
        of_response=np.divide(alone, variance, out=np.zeros_like(alone), where=scatters),
        rest=np.divide(fit.unexplained, variance, out=np.zeros_like(variance), where=scatters),
        of_sum=np.divide(per_sigma.sum(axis=1), sigma.sum() or 1.0),
    )


@dataclass(frozen=True)
class Limit:
    """One response with bounds that are allowed values; infinite where there is none.

    - `response`, `unit`: name of the response, and unit of response and bounds; ``"1"`` is a plain
      number.
    - `at_least`, `at_most`: bounds [unit].
    - `source`: who stated the limit, such as a file and the place in it, or an option.
    - `n_lines`: lines that the response is the sum of; sentences give the mean over them.
    - raises InputError: no bound at all, or bounds that leave no value between them.
    """

    response: str
    unit: str
    at_least: float = -np.inf
    at_most: float = np.inf
    source: str = ""
    n_lines: int = 1

    def __post_init__(self) -> None:
        if not self.at_least <= self.at_most:
            raise InputError(
                f"limit of {self.response}: at least {self.at_least:g} {self.unit} and at most "
                f"{self.at_most:g} {self.unit} exclude each other"
            )
        if np.isinf(self.at_least) and np.isinf(self.at_most):
            raise InputError(f"limit of {self.response}: give at_least, at_most or both")


@checked(limits="some")
class Limits:
    """Several limits as one-sided bounds, the columns of `RobustValues.excess`."""

    limits: tuple[Limit, ...]

    @property
    def _bounds(self) -> list[tuple[int, float, float]]:
        """Column of the response, sign (1: at most, -1: at least) and bound of each side."""
        return [
            (column, sign, bound)
            for column, limit in enumerate(self.limits)
            for sign, bound in ((-1.0, limit.at_least), (1.0, limit.at_most))
            if np.isfinite(bound)
        ]

    @property
    def names(self) -> tuple[str, ...]:
        """Each bound in words, such as ``EnM z sag at most 4 mm``."""
        return tuple(
            f"{self.limits[column].response} at {'most' if sign > 0 else 'least'} {bound:g} "
            f"{self.limits[column].unit}"
            for column, sign, bound in self._bounds
        )

    @property
    def scale(self) -> RealArray:
        """Size of each bound, or 1 where it is 0, shape (c,) [unit of the limit]."""
        return np.array([abs(bound) or 1.0 for *_, bound in self._bounds])

    def excess(self, values: RealArray) -> RealArray:
        """Return how far responses, shape (n, r), miss each bound, shape (n, c).

        Negative where room is left [unit of the limit]; infinite where a response could not be
        computed.
        """
        columns = [sign * (values[:, column] - bound) for column, sign, bound in self._bounds]
        beyond = np.column_stack(columns)
        return np.where(np.isnan(beyond), np.inf, beyond)

    def responses(self, excess: RealArray) -> RealArray:
        """Return the limited responses, (n, r) [unit of the limit], from their excess (n, c)."""
        values = np.empty((len(excess), len(self.limits)))
        for place, (column, sign, bound) in enumerate(self._bounds):
            values[:, column] = bound + sign * excess[:, place]
        return values

    def excess_slopes(self, gradient: RealArray) -> RealArray:
        """Return the derivatives of the excess, (c, k), from those of the responses, (r, k)."""
        columns = [column for column, *_ in self._bounds]
        signs = np.array([sign for _, sign, _ in self._bounds])
        return np.asarray(signs[:, np.newaxis] * gradient[columns])

    def closest(self, designs_excess: RealArray) -> str:
        """Say what the closest of designs that all miss a limit lacks, and what none keeps."""
        relative = designs_excess / self.scale
        row = int(np.argmin(relative.max(axis=1)))
        binding = int(np.argmax(relative[row]))
        column, sign, bound = self._bounds[binding]
        limit, missed = self.limits[column], float(designs_excess[row, binding])
        if np.isinf(missed):
            text = f"{self._stated(binding)} could not be computed for any"
        else:
            has = (bound + sign * missed) / limit.n_lines
            text = (
                f"the closest one misses {self._stated(binding)} by {missed / limit.n_lines:.3g} "
                f"{limit.unit} (it has {has:.4g} {limit.unit})"
            )
        never = np.flatnonzero(np.all(designs_excess > 0.0, axis=0))
        others = ", ".join(self._stated(int(side)) for side in never if side != binding)
        return f"{text}; none keeps {others} either" if others else text

    def _stated(self, side: int) -> str:
        """Return a bound in words, and who stated it."""
        column, sign, bound = self._bounds[side]
        limit, words = self.limits[column], self.names[side]
        if limit.n_lines > 1:
            words = (
                f"{limit.response}, at {'most' if sign > 0 else 'least'} "
                f"{bound / limit.n_lines:.6g} {limit.unit} per line"
            )
        return f"'{words}' ({limit.source})" if limit.source else f"'{words}'"


@checked(limits="some")
class RobustLimits(Limits):
    """Limits of numbers over the scatter, which a `Robust` carries.

    - `numbers`: what is limited, as it was stated.
    """

    numbers: tuple[RobustLimit, ...]


@dataclass(frozen=True, eq=False)
class LimitedResponse:
    """A robust response whose designs must keep limits, put around what `workers_for` gives.

    - `robust`: response to be minimised; its own limits come first.
    - `response`: responses that are limited, of the same variables, in the units of the limits.
    - `stated`: limits of the responses, by name.
    - `made`, optional: map from a design, shape (k,), to the designs as they are made, shape
      (n_samples, k), such as `Robust.made`: then the worst of them must keep each limit.
    - raises InputError: other variables, or other responses than limits.
    """

    robust: RobustEvaluation
    response: Requirements
    stated: Limits
    made: Callable[[RealArray], RealArray] | None = None

    __repr__ = short_repr

    def __post_init__(self) -> None:
        names, limited = self.response.variable_names, self.response.response_names
        check_same_names("the limited responses have the variables", names, self.robust.space.names)
        wanted = [limit.response for limit in self.stated.limits]
        check_same_names("the limited responses have the responses", limited, wanted)

    @property
    def space(self) -> DesignSpace:
        """The designs that may be asked for."""
        return self.robust.space

    @property
    def n_objectives(self) -> int:
        """Number m of objectives."""
        return self.robust.n_objectives

    @property
    def limits(self) -> Limits:
        """Limits of the robust response, then those of the limited responses."""
        before = self.robust.limits
        return self.stated if before is None else Limits(before.limits + self.stated.limits)

    def excess(self, designs: RealArray) -> RealArray:
        """Return how far designs, shape (n, k), miss each bound of `stated` (n, c) [its unit]."""
        if self.made is None:
            return self.stated.excess(self.response(designs))
        rows = [
            self.stated.excess(self.response(self.made(design))).max(axis=0) for design in designs
        ]
        return np.array(rows).reshape(len(designs), len(self.stated.names))

    def __call__(self, designs: RealArray) -> RobustValues:
        """Return the values of the designs, shape (n, k), with their excess."""
        values = self.robust(designs)
        excess = np.hstack([values.excess, self.excess(values.designs)])
        return replace(values, excess=excess)


@dataclass(frozen=True, eq=False)
class DesignLimits:
    """What the designs of a search must keep.

    - `requirements`, `limits`: the limited numbers of a design, and one limit for each.
    - `every_part`: whose draws must keep the limits; None: the design itself.
    - `inputs`: files that they come from.
    """

    requirements: Requirements
    limits: Limits
    every_part: Robust | None = None
    inputs: tuple[Path, ...] = ()

    def around(self, robust: RobustEvaluation) -> RobustEvaluation:
        """Return a response whose designs must keep the limits, and those that it has."""
        made = self.every_part.made if self.every_part else None
        return LimitedResponse(robust, self.requirements, self.limits, made)
