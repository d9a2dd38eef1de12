"""Mean and standard deviation of every response over the manufacturing scatter, within limits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any, NamedTuple, Protocol, cast

import numpy as np
import numpy.typing as npt

from deboom.arrays import (
    BoolArray,
    IntArray,
    RealArray,
    TextArray,
    checked,
    frozen_copy,
    short_repr,
)
from deboom.errors import InputError
from deboom.explore.choices import Distribution
from deboom.explore.moments import (
    MEAN_SUM,
    SIGMA_SUM,
    TODAY,
    Draws,
    Estimator,
    Limit,
    Objective,
    PreparedEstimator,
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
    def limits(self) -> Limits:
        """Limits that the designs must keep."""
        return Limits()

    def __call__(self, designs: RealArray) -> RobustValues:
        """Return the values of the designs, shape (n, k)."""


class RobustWrapper(RobustEvaluation):
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
    def limits(self) -> Limits:
        """Limits that the designs must keep."""
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
    limits : sequence of Limit, optional
        What designs must keep, such as ``Objective("mean", response="U06-5").at_most("today")``, or
        ``Objective("nominal", response=price).at_most(5.0)`` of a function of the design.
    weights : array, shape (r,), optional
        Weights of the responses in sums; only their ratios count; by default the model's
        ``response_weights``, such as none of vibrations beside levels of sound, or all alike [1].

    Raises
    ------
    InputError
        An objective or limit of a response that there is not, or of a function with other
        variables; bounds that exclude each other; weights that are negative or none. Variables of
        the model, the space, the structure and the sample that differ; a structure
        that would let a variable change its sign; fewer than two objectives; a model without
        names; a number of draws that is no power of two; a seed below 1.

    See Also
    --------
    deboom.Objective, deboom.search, deboom.RobustProblem, deboom.verify

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
    limits: Limits
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
        limits: Sequence[Limit] | Limits = (),
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
            ("limits", Limits()),
            ("weights", None),
        ):
            object.__setattr__(self, name, value)
        self._check()
        given = getattr(evaluate, "response_weights", None) if weights is None else weights
        object.__setattr__(self, "weights", self._normalised(given))
        stated = limits.stated if isinstance(limits, Limits) else tuple(limits)
        for number in (*self.objectives, *(limit.number for limit in stated)):
            self._check_number(number)
        object.__setattr__(self, "limits", self._resolved(stated))

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
        units = self.weighted_units
        if number.response is None and len(units) > 1:
            raise InputError(
                f"'{number.name}' adds or compares responses in {' and '.join(units)}: name the "
                f"response of each objective and limit, such as Objective('{number.statistic}', "
                f"response='{names[0]}')"
            )
        if isinstance(number.response, str) and number.response not in names:
            raise InputError(f"no response '{number.response}': use one of {list(names)}")
        variables = getattr(number.response, "variable_names", self.space.names)
        check_same_names(f"'{number.name}' is of the variables", variables, self.space.names)

    def _resolved(self, stated: tuple[Limit, ...]) -> Limits:
        """Return limits with today's numbers, under these draws, where bounds say so."""
        todays = [limit.number for limit in stated if limit.needs_today]
        numbers = iter(self.numbers(self.space.nominal[np.newaxis], todays)[0].tolist())
        limits = []
        for limit in stated:
            low, high = limit.at_least, limit.at_most
            if limit.needs_today:
                today = next(numbers)
                if not np.isfinite(today):
                    raise InputError(
                        f"limit of {limit.number.name}: today's design fails somewhere in its "
                        "scatter, give a number as the bound"
                    )
                low, high = (today if bound == TODAY else bound for bound in (low, high))
            with_unit = replace(limit.number, unit=self.unit_of(limit.number))
            limits.append(replace(limit, number=with_unit, at_least=low, at_most=high))
        return Limits(tuple(limits), stated)

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
    def weighted_units(self) -> tuple[str, ...]:
        """Units of the responses that have a weight above 0."""
        units = units_of(self.evaluate.response_names, self.evaluate.response_unit)
        weights = np.ones(len(units)) if self.weights is None else self.weights
        return tuple(dict.fromkeys(unit for unit, w in zip(units, weights, strict=True) if w > 0.0))

    @property
    def sum_unit(self) -> str:
        """Unit of sums over the responses, and of the worst of them."""
        return self.weighted_units[0]

    @cached_property
    def is_compared(self) -> BoolArray:
        """Which responses have the unit of sums: the worst of all is one of these, (r,)."""
        units = units_of(self.evaluate.response_names, self.evaluate.response_unit)
        return np.array([unit == self.sum_unit for unit in units])

    @property
    def weight_ratios(self) -> RealArray:
        """Weights of the responses over the smallest above 0, shape (r,) [1]."""
        if self.weights is None:
            return np.ones(len(self.evaluate.response_names))
        return np.asarray(np.round(self.weights / self.weights[self.weights > 0.0].min(), 9))

    def mean(self, values: npt.ArrayLike, rows: Sequence[int] | None = None) -> RealArray:
        """Return the mean over the responses, weighted as in the objectives, of values (..., r).

        - `rows`: those of the responses that count, alike if none of them has a weight; by default
          all of them.
        """
        values, weights = np.asarray(values), self.weights
        if rows is not None:
            values = values[..., rows]
            weights = None if weights is None else weights[list(rows)]
        if weights is not None and not weights.any():
            weights = None
        return np.asarray(np.average(values, axis=-1, weights=weights))

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
        r, m = len(self.evaluate.response_names), self.n_objectives
        numbers = [limit.number for limit in self.limits.limits]
        drawn = np.array([not number.is_of_design for number in numbers], dtype=bool)
        of_draws = [number for number in numbers if not number.is_of_design]
        rows = np.empty((len(designs), 2 * r + 2 + m + len(of_draws)))
        messages = []
        for row, design in zip(rows, designs, strict=True):
            row[:], message = self._statistics(design, of_draws)
            messages.append(message)
        parts = np.hsplit(rows, [r, 2 * r, 2 * r + 2, 2 * r + 2 + m])
        mean, sigma, errors, objectives, by_draws = parts
        limited = np.empty((len(designs), len(numbers)))
        limited[:, drawn] = by_draws
        of_design = [number for number in numbers if number.is_of_design]
        limited[:, ~drawn] = numbers_of_designs(of_design, designs)
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
            excess=self.limits.excess(limited),
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
        mean = values[computed].mean(axis=0)[self.is_compared].sum() if computed.any() else np.nan
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

    def numbers(self, designs: RealArray, numbers: Sequence[Objective]) -> RealArray:
        """Return numbers (n, o) of designs (n, k); NaN of a design that fails in its scatter."""
        if all(number.is_of_design for number in numbers):
            return numbers_of_designs(numbers, designs)
        rows = np.full((len(designs), len(numbers)), np.nan)
        for row, design in zip(rows, designs, strict=True):
            try:
                made = self._made_design(design)
                row[:] = [made.number(number) for number in numbers]
            except Exception as error:
                said(error)
        return rows

    def own_number(self, number: Objective, design: RealArray) -> float:
        """Return a number of one design (k,) whose model is its own, without the responses."""
        if number.is_of_design:
            columns = columns_of(number, design[np.newaxis])
            return float(columns.max() if number.worst else columns.sum())
        columns = columns_of(number, self.made(design))
        mean, sigma, *_ = self.prepared(design).moments(columns)
        return number(
            Draws(columns, mean, sigma, lambda: columns_of(number, design[np.newaxis])[0])
        )

    def _made_design(self, design: RealArray) -> _MadeDesign:
        """Return one design (k,) as it is made, with its responses, not finite where it fails."""
        values = responses(self.evaluate, self.made(design))
        mean, sigma, mean_error, sigma_error = self.prepared(design).moments(values, self.weights)

        def nominal() -> RealArray:
            return np.asarray(responses(self.evaluate, design[np.newaxis])[0])

        if self.nominal_mean:
            mean, mean_error = nominal(), 0.0
        draws = Draws(values, mean, sigma, nominal)
        return _MadeDesign(self, design, draws, (mean_error, sigma_error))

    def _statistics(self, design: RealArray, limited: Sequence[Objective]) -> tuple[RealArray, str]:
        """Moments, their standard errors, objectives and limited numbers.

        All NaN, and why, if a response, a moment or an objective failed.
        """
        n_numbers = 2 * len(self.evaluate.response_names) + 2 + self.n_objectives
        failed = np.full(n_numbers + len(limited), np.nan)
        try:
            made = self._made_design(design)
            if not np.all(np.isfinite(made.draws.values)):
                return failed, not_finite(made.draws.values, self.evaluate.response_names)
            numbers = [made.number(number) for number in (*self.objectives, *limited)]
        except Exception as error:
            return failed, said(error)
        statistics = np.concatenate([made.draws.mean, made.draws.sigma, made.errors, numbers])
        if not np.all(np.isfinite(statistics[:n_numbers])):
            names = [number.name for number in self.objectives]
            lost = [n for n, x in zip(names, numbers, strict=False) if not np.isfinite(x)]
            return failed, f"not finite: {', '.join(lost) or 'a mean or a sigma'}"
        return statistics, ""


class _MadeDesign(NamedTuple):
    """One design as it is made.

    - `design` (k,): as drawn [units of the space].
    - `draws`: responses of the model, whose mean may be the design's own response.
    - `errors` (2,): standard errors of the sums of mean and sigma [response unit].
    """

    robust: Robust
    design: RealArray
    draws: Draws
    errors: tuple[float, float]

    def number(self, number: Objective) -> float:
        """Return a number of the design."""
        if number.response is None and (not number.worst or self.robust.is_compared.all()):
            return number(self.draws, self.robust.weights)
        if number.response is None:
            return number(self._of(np.flatnonzero(self.robust.is_compared)))
        if isinstance(number.response, str):
            names = tuple(self.robust.evaluate.response_names)
            return number(self._of(np.array([names.index(number.response)])))
        if number.has_own_model:
            return self.robust.own_number(number, self.design)
        columns = columns_of(number, self.draws.values)
        moments = self.robust.prepared(self.design).moments(columns)
        return number(
            Draws(
                columns,
                moments.mean,
                moments.sigma,
                lambda: columns_of(number, self.draws.nominal()[np.newaxis])[0],
            )
        )

    def _of(self, at: IntArray) -> Draws:
        """Return the draws of some responses."""
        values, mean, sigma, _ = self.draws
        return Draws(values[:, at], mean[at], sigma[at], lambda: self.draws.nominal()[at])


def numbers_of_designs(numbers: Sequence[Objective], designs: RealArray) -> RealArray:
    """Return numbers (n, o) that follow from designs (n, k) without any draw."""
    columns: dict[int, RealArray] = {}
    for number in numbers:
        if id(number.response) not in columns:
            columns[id(number.response)] = columns_of(number, designs)
    totals = [
        columns[id(number.response)].max(axis=1)
        if number.worst
        else columns[id(number.response)].sum(axis=1)
        for number in numbers
    ]
    return np.array(totals).reshape(len(numbers), len(designs)).T


def columns_of(number: Objective, given: RealArray) -> RealArray:
    """Return the responses of a number's own function or model, (n, c), of n rows."""
    # a function that writes into its argument changes a copy
    # a model of its own may have several responses, whose sum or worst counts
    names = getattr(number.response, "response_names", (number.name,))
    n_columns = len(names)
    columns = real_numbers(cast(Any, number.response)(np.array(given)), names)
    if columns.size != len(given) * n_columns:
        raise InputError(
            f"'{number.name}' gave an array of shape {columns.shape} for {len(given)} designs or "
            "draws: return one number for each"
        )
    return columns.reshape(len(given), n_columns)


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


@dataclass(frozen=True, eq=False)
class Limits:
    """Limits of a robust response as one-sided bounds, the columns of `RobustValues.excess`.

    - `limits`: with bounds that are numbers; `stated`: the same as they were stated.
    """

    limits: tuple[Limit, ...] = ()
    stated: tuple[Limit, ...] = ()

    def __len__(self) -> int:
        return len(self.limits)

    @property
    def of_estimates(self) -> Limits:
        """Those of numbers that other draws judge again."""
        return self._some(of_estimates=True)

    @property
    def of_designs(self) -> Limits:
        """Those of numbers of the design itself, and of its drawn parts."""
        return self._some(of_estimates=False)

    def _some(self, *, of_estimates: bool) -> Limits:
        limits, stated = (
            tuple(each for each in some if each.number.rule.is_estimate is of_estimates)
            for some in (self.limits, self.stated)
        )
        return Limits(limits, stated)

    @cached_property
    def _sides(self) -> list[tuple[int, float, float]]:
        """Row of the limit, sign (1: at most, -1: at least) and bound of each side."""
        return [
            (row, sign, float(bound))
            for row, limit in enumerate(self.limits)
            for sign, bound in ((-1.0, limit.at_least), (1.0, limit.at_most))
            if np.isfinite(float(bound))
        ]

    @cached_property
    def rows(self) -> IntArray:
        """Row of the limit of each bound, shape (c,)."""
        return np.array([row for row, *_ in self._sides], dtype=np.intp)

    @cached_property
    def _signs(self) -> RealArray:
        return np.array([sign for _, sign, _ in self._sides])

    @cached_property
    def _bounds(self) -> RealArray:
        return np.array([bound for *_, bound in self._sides])

    @property
    def names(self) -> tuple[str, ...]:
        """Each bound in words, such as ``EnM z sag at most 4 mm``."""
        return tuple(
            f"{self.limits[row].number.name} at {'most' if sign > 0 else 'least'} {bound:g} "
            f"{self.limits[row].number.unit}"
            for row, sign, bound in self._sides
        )

    @property
    def scale(self) -> RealArray:
        """Size of each bound, or 1 where it is 0, shape (c,) [unit of the limit]."""
        return np.where(self._bounds == 0.0, 1.0, np.abs(self._bounds))

    def excess(self, numbers: RealArray) -> RealArray:
        """Return how far limited numbers, shape (n, l), miss each bound, shape (n, c).

        Negative where room is left [unit of the limit]; infinite where a number could not be
        computed.
        """
        beyond = self._signs * (numbers[:, self.rows] - self._bounds)
        return np.where(np.isnan(beyond), np.inf, beyond)

    def numbers(self, excess: RealArray) -> RealArray:
        """Return the limited numbers, (n, l) [unit of the limit], from their excess (n, c)."""
        numbers = np.empty((len(excess), len(self.limits)))
        numbers[:, self.rows] = self._bounds + self._signs * excess
        return numbers

    def excess_slopes(self, gradients: RealArray) -> RealArray:
        """Return the derivatives of the excess, (c, k), from those of the numbers, (l, k)."""
        return np.asarray(self._signs[:, np.newaxis] * gradients[self.rows])

    def closest(self, designs_excess: RealArray) -> str:
        """Say what the closest of designs that all miss a limit lacks, and what none keeps."""
        relative = designs_excess / self.scale
        row = int(np.argmin(relative.max(axis=1)))
        binding = int(np.argmax(relative[row]))
        limit, missed = self.limits[self.rows[binding]], float(designs_excess[row, binding])
        if np.isinf(missed):
            text = f"{self.in_words(binding)} could not be computed for any"
        else:
            has = (self._bounds[binding] + self._signs[binding] * missed) / limit.n_lines
            text = (
                f"the closest one misses {self.in_words(binding)} by {missed / limit.n_lines:.3g} "
                f"{limit.number.unit} (it has {has:.4g} {limit.number.unit})"
            )
        never = np.flatnonzero(np.all(designs_excess > 0.0, axis=0))
        others = ", ".join(self.in_words(int(side)) for side in never if side != binding)
        return f"{text}; none keeps {others} either" if others else text

    def in_words(self, side: int) -> str:
        """Return a bound, by its column of the excess, in words, and who stated it."""
        row, sign, bound = self._sides[side]
        limit, words = self.limits[row], self.names[side]
        if limit.n_lines > 1:
            words = (
                f"{limit.number.name}, at {'most' if sign > 0 else 'least'} "
                f"{bound / limit.n_lines:.6g} {limit.number.unit} per line"
            )
        return f"'{words}' ({limit.source})" if limit.source else f"'{words}'"
