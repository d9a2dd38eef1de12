"""Sensitivity analyses: Sobol indices and elementary effects; the only module with SALib.

SALib 1.6 gives zeros when one response is not finite, reads seed 0 as "no seed", changes the global
random state, the format of warnings and the problem it is given, and takes a single group for none.
Here such input is refused in words and what is global is put back. SALib is imported when it is
first needed: it takes two seconds.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pandas as pd
from scipy.special import ndtr, ndtri
from threadpoolctl import threadpool_limits

from deboom.arrays import BoolArray, RealArray, checked, short_repr
from deboom.errors import InputError
from deboom.explore.choices import Distribution
from deboom.explore.moments import CONFIDENCE
from deboom.explore.scatter import TRUNCATION
from deboom.explore.space import (
    DesignSpace,
    Evaluate,
    check_fits,
    check_repeats,
    checked_seed,
    responses,
    said,
    units_of,
    whole_number,
)
from deboom.tabled import Tabled

LEVELS = 4
"""Levels of each variable in the designs of Morris."""

_NO_VARIATION = 64.0 * np.finfo(float).eps  # relative: constant but for rounding
_ENDLESS = ("norm", "lognorm", "weibull")  # SALib's distributions with an end at infinity
_FEWEST = 8  # base points; with fewer a resample may have no variance at all


@checked(lower="k", upper="k", sigma="k")
class SensitivityInputs:
    """Independent variables with their distributions: uniform, gaussian and cut, or as stated.

    - `names`: variables, in the order of a design's columns.
    - `lower`, `upper` (k,): bounds, outside of which no variable comes [units of the variables].
    - `sigma` (k,), optional: standard deviations before the cut of gaussian variables, whose mean
      lies midway between the bounds [units of the variables]. By default the variables are uniform.
    - `groups`, optional: group that each variable belongs to: the members of a group vary together,
      and one index stands for all. By default each variable stands for itself.
    - `stated`, optional: SALib's distribution of a variable by its name, with its numbers, such as
      ``("triang", 0.8, 1.2, 0.5)``; the others as above.
    - raises InputError: names the variable with reversed or equal bounds, or without a standard
      deviation; one group only.
    """

    names: tuple[str, ...]
    lower: RealArray
    upper: RealArray
    sigma: RealArray | None = None
    groups: tuple[str, ...] = ()
    stated: Mapping[str, Sequence[Any]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        unknown = [name for name in self.stated if name not in self.names]
        if unknown:
            raise InputError(f"no variable '{unknown[0]}': use some of {list(self.names)}")
        if self.groups and len(set(self.groups)) == 1:
            raise InputError(
                f"all variables are in the group '{self.groups[0]}': there is nothing to compare, "
                "name at least two groups"
            )
        varies = self.lower < self.upper
        varies |= np.array([name in self.stated for name in self.names])
        if self.sigma is not None:
            varies &= self.sigma > 0.0
        if not varies.all():
            place = int(np.argmin(varies))
            raise InputError(
                f"variable '{self.names[place]}' does not vary (from {self.lower[place]:g} to "
                f"{self.upper[place]:g}): give it a range, or leave it out of the sensitivity "
                "analysis"
            )

    @property
    def n_variables(self) -> int:
        """Number k of variables."""
        return len(self.names)

    @property
    def factors(self) -> tuple[str, ...]:
        """Names that indices are given for: the groups in order of appearance, or the variables."""
        return tuple(dict.fromkeys(self.groups)) or self.names

    @property
    def description(self) -> str:
        """Distribution and range in words, for reports and run records."""
        low, high = (
            "…".join(dict.fromkeys(f"{value:g}" for value in (values.min(), values.max())))
            for values in (self.lower, self.upper)
        )
        kind = "uniform" if self.sigma is None else f"gaussian, cut at ±{TRUNCATION:g} σ,"
        stated = [f"{name} {' '.join(map(str, each))}" for name, each in self.stated.items()]
        return "; ".join([f"{kind} from {low} to {high}", *stated])

    def grouped(self, groups: Sequence[str]) -> SensitivityInputs:
        """Return the same variables in groups, see `SensitivityInputs`."""
        return replace(self, groups=tuple(groups))


def design_inputs(space: DesignSpace) -> SensitivityInputs:
    """Return variables that are uniform within the bounds of a space: a designer's choice.

    Whole numbers reach half an option beyond, so that rounding gives all options the same chance.

    - raises InputError: a variable with equal bounds: it has no share, leave it out of the space.
    """
    reach = np.where(space.integer, 0.5, 0.0)
    return SensitivityInputs(space.names, space.lower - reach, space.upper + reach)


def tolerance_inputs(space: DesignSpace) -> SensitivityInputs:
    """Return variables that scatter around the nominal design: what manufacturing does.

    Gaussian, with the tolerance as three standard deviations, and cut there, unless the space says
    otherwise.

    - raises InputError: a lognormal variable with a cut, which SALib does not draw.
    """
    sigma = space.sigma(space.nominal)
    reach = TRUNCATION * sigma
    lower, upper = space.nominal - reach, space.nominal + reach
    stated: dict[str, Sequence[Any]] = {}
    for column, (name, distribution) in enumerate(
        zip(space.names, space.distribution, strict=True)
    ):
        value, spread = space.nominal[column], sigma[column]
        match distribution:
            case Distribution.uniform:
                stated[name] = ("unif", lower[column], upper[column])
            case Distribution.normal_uncut:
                stated[name] = ("norm", value, spread)
            case Distribution.lognormal_uncut if value > 0.0:
                stated[name] = ("lognorm", np.log(value), space.relative_sigma[column])
            case Distribution.lognormal | Distribution.lognormal_uncut:
                raise InputError(
                    f"the scatter of '{name}' for sensitivities: of lognormal variables only "
                    f"'{Distribution.lognormal_uncut}' ones with a nominal value above 0 can be "
                    "drawn; state another distribution with inputs"
                )
    return SensitivityInputs(space.names, lower, upper, sigma, stated=stated)


@dataclass(frozen=True, eq=False)
class SobolIndices:
    """Shares of the variance of each output, with half widths of their intervals; all [1].

    - `factors`, `outputs`: variables or groups, and outputs, d and r of them.
    - `n_base`, `n_resamples`: base points N of the scheme, and bootstrap resamples behind the
      intervals.
    - `first`, `total`, `interaction` (d, r): share of a factor alone, with all that it does
      together with others, and their difference.
    - `first_interval`, `total_interval`, `interaction_interval` (d, r): half widths at the
      confidence `CONFIDENCE`.
    """

    factors: tuple[str, ...]
    outputs: tuple[str, ...]
    n_base: int
    n_resamples: int
    first: RealArray
    total: RealArray
    interaction: RealArray
    first_interval: RealArray
    total_interval: RealArray
    interaction_interval: RealArray

    __repr__ = short_repr

    @property
    def zero(self) -> BoolArray:
        """Whether a total index is not above its own interval, shape (d, r)."""
        return np.less_equal(self.total, self.total_interval)


@dataclass(frozen=True, eq=False)
class PairIndices:
    """Shares of the variance of each output that two factors are behind together only; all [1].

    - `factors`, `outputs`: variables or groups, and outputs, d and r of them.
    - `first` (d, r), `second` (d, d, r): share of a factor alone; second-order indices, symmetric,
      0 on the diagonal.
    - `second_interval` (d, d, r): half widths at the confidence `CONFIDENCE`.
    """

    factors: tuple[str, ...]
    outputs: tuple[str, ...]
    first: RealArray
    second: RealArray
    second_interval: RealArray


@dataclass(frozen=True, eq=False)
class MorrisEffects:
    """Elementary effects: change of an output over a step of one factor, per unit of its range.

    - `factors`, `outputs`: names, d and r of them.
    - `mu`, `mu_star`, `mu_star_interval` (d, r): mean of the effects, of their magnitudes and half
      width of its interval [unit of the output].
    - `sigma` (d, r): standard deviation of the effects: curvature and interaction; nan for groups
      of several variables [unit of the output].
    """

    factors: tuple[str, ...]
    outputs: tuple[str, ...]
    mu: RealArray
    mu_star: RealArray
    mu_star_interval: RealArray
    sigma: RealArray

    __repr__ = short_repr


def sobol_designs(
    inputs: SensitivityInputs, n_base: int, *, seed: int, pairs: bool = False
) -> RealArray:
    """Return the designs of Saltelli's scheme on scrambled Sobol points.

    For N base points, a power of two from 8, and d factors there are ``N (d + 2)`` designs, for
    `pair_indices` ``N (2 d + 2)``. Those of fewer base points are the first ones of more.
    """
    from SALib.sample import sobol

    _check_base(n_base)
    with _nothing_global(), _distributions_in_words():
        designs = sobol.sample(
            salib_problem(inputs), n_base, calc_second_order=pairs, seed=checked_seed(seed)
        )
    return np.asarray(designs)


def sobol_indices(
    values: RealArray,
    factors: Sequence[str],
    outputs: Sequence[str],
    *,
    seed: int,
    n_resamples: int = 100,
) -> SobolIndices:
    """Return SALib's Sobol indices of all outputs, with bootstrap intervals.

    Parameters
    ----------
    values : array, shape (n, r)
        Responses to the designs of `sobol_designs`, in their order.
    factors, outputs : sequence of str
        Variables, or groups of them, and names of the responses, d and r of them.
    seed, n_resamples : int
        Seed from 1 upwards and number of the resamples, at least 2, which all outputs share.

    Raises
    ------
    InputError
        A value that is not finite or an output that does not vary, by name; another shape or count.

    Notes
    -----
    With ``f_A``, ``f_B``, ``f_AB,j`` the output at the base points A and B and at A with factor j
    taken from B, ``V`` the variance of ``f_A`` and ``f_B`` together and all values
    centred: ``S_j = mean(f_B (f_AB,j - f_A)) / V`` and ``ST_j = mean((f_A - f_AB,j)²) / 2V``
    (Saltelli et al., Computer Physics Communications 181, 2010). An interval is the standard
    deviation over the resamples times the gaussian quantile. SALib takes one output at a time;
    `fast_sobol_indices` gives the same numbers for hundreds of them.
    """
    from SALib.analyze import sobol

    d = len(factors)
    array, names, n_base = _checked_sobol(values, outputs, d + 2, n_resamples)
    problem = {"num_vars": d, "names": [f"x{place}" for place in range(d)]}

    def analyse(column: RealArray) -> list[RealArray]:
        result = sobol.analyze(
            dict(problem),
            column,
            calc_second_order=False,
            num_resamples=n_resamples,
            conf_level=CONFIDENCE,
            keep_resamples=True,
            seed=checked_seed(seed),
        )
        interaction = _interval_of(result["ST_conf_all"] - result["S1_conf_all"])
        indices = [result["S1"], result["ST"], result["ST"] - result["S1"]]
        return [*indices, result["S1_conf"], result["ST_conf"], interaction]

    columns = _by_output(analyse, array)
    return SobolIndices(tuple(factors), names, n_base, n_resamples, *columns)


def without_pairs(values: RealArray, n_factors: int) -> RealArray:
    """Return the responses that `sobol_indices` takes of those to designs with ``pairs=True``."""
    blocks = values.reshape(-1, 2 * n_factors + 2, values.shape[1])
    kept = np.concatenate([blocks[:, : n_factors + 1], blocks[:, -1:]], axis=1)
    return np.asarray(kept.reshape(-1, values.shape[1]))


def pair_indices(
    values: RealArray,
    factors: Sequence[str],
    outputs: Sequence[str],
    *,
    seed: int,
    n_resamples: int = 100,
) -> PairIndices:
    """Return SALib's second-order indices of all outputs, with bootstrap intervals.

    Parameters
    ----------
    values : array, shape (n, r)
        Responses to the designs of `sobol_designs` with ``pairs=True``, in their order.
    factors, outputs, seed, n_resamples
        As for `sobol_indices`.

    Raises
    ------
    InputError
        As `sobol_indices`; fewer than two factors.

    Notes
    -----
    ``S_jk = mean(f_BA,j f_AB,k - f_A f_B)/V - S_j - S_k`` with ``f_BA,j`` the output at B with
    factor j taken from A (A. Saltelli, Computer Physics Communications 145, 2002).
    """
    from SALib.analyze import sobol

    d = len(factors)
    if d < 2:
        raise InputError("pair indices need at least two factors")
    array, names, _ = _checked_sobol(values, outputs, 2 * d + 2, n_resamples)
    problem = {"num_vars": d, "names": [f"x{place}" for place in range(d)]}

    def analyse(column: RealArray) -> list[RealArray]:
        result = sobol.analyze(
            dict(problem),
            column,
            calc_second_order=True,
            num_resamples=n_resamples,
            conf_level=CONFIDENCE,
            seed=checked_seed(seed),
        )
        halves = [np.triu(result[key], 1) for key in ("S2", "S2_conf")]
        return [result["S1"], *((half + half.T).ravel() for half in halves)]

    first, second, interval = _by_output(analyse, array)
    square = (d, d, len(names))
    return PairIndices(
        tuple(factors), names, first, second.reshape(square), interval.reshape(square)
    )


def fast_sobol_indices(
    values: RealArray,
    factors: Sequence[str],
    outputs: Sequence[str],
    *,
    seed: int,
    n_resamples: int = 100,
) -> SobolIndices:
    """Return the same as `sobol_indices`, with one matrix product for all resamples of an output.

    Estimators and resamples are SALib's, so that the numbers agree up to rounding; for the level of
    every line of a fleet it is about a hundred times as fast.
    """
    d = len(factors)
    array, names, n_base = _checked_sobol(values, outputs, d + 2, n_resamples)
    drawn = np.random.default_rng(checked_seed(seed)).integers(n_base, size=(n_base, n_resamples))
    counts = np.stack([np.bincount(column, minlength=n_base) for column in drawn.T])
    weights = np.vstack([np.ones(n_base), counts])
    with threadpool_limits(1, user_api="blas"):  # threads may change the last bit
        rows = [np.ascontiguousarray(column.reshape(n_base, d + 2).T) for column in array.T]
        tables = [_one_output(output, weights, d) for output in rows]
    columns = [part for table in np.stack(tables, axis=2) for part in np.split(table, 3)]
    return SobolIndices(tuple(factors), names, n_base, n_resamples, *columns)


def _one_output(rows: RealArray, weights: RealArray, d: int) -> RealArray:
    """First, total and interaction indices of an output, then their intervals, (2, 3 d)."""
    scaled = (rows - rows.mean()) / rows.std()
    a, ab, b = scaled[0], scaled[1:-1], scaled[-1]
    halves = 0.5 * np.stack([a + b, a * a + b * b])
    terms = np.concatenate([b * (ab - a), 0.5 * (ab - a) ** 2, halves])
    means = weights @ terms.T / rows.shape[1]
    variance = means[:, -1] - means[:, -2] ** 2
    shares = means[:, :-2] / variance[:, np.newaxis]
    every = np.hstack([shares, shares[:, d:] - shares[:, :d]])
    return np.stack([every[0], _interval_of(every[1:])])


def morris_designs(inputs: SensitivityInputs, n_trajectories: int, *, seed: int) -> RealArray:
    """Return Morris's designs (n_trajectories (d + 1), k): two paths or more, factor by factor.

    A distribution without ends, such as ``norm``, begins and ends where a normal one has 3 σ.
    """
    from SALib.sample.morris import morris
    from SALib.util import scale_samples

    if n_trajectories < 2:
        raise InputError(f"{n_trajectories} paths of Morris's method: take at least 2, better 50")
    problem = salib_problem(inputs)
    unit = {"bounds": [[0.0, 1.0]] * inputs.n_variables, "dists": ["unif"] * inputs.n_variables}
    with _nothing_global(), _distributions_in_words():
        levels = morris.sample(
            {**problem, **unit}, n_trajectories, num_levels=LEVELS, seed=checked_seed(seed)
        )
        endless = [inputs.stated.get(name, ("",))[0] in _ENDLESS for name in inputs.names]
        within = np.clip(levels, ndtr(-TRUNCATION), ndtr(TRUNCATION))
        designs = scale_samples(np.where(endless, within, levels), problem)
    return np.asarray(designs)


def morris_analysis(
    inputs: SensitivityInputs,
    designs: RealArray,
    values: RealArray,
    outputs: Sequence[str],
    *,
    seed: int,
    n_resamples: int = 100,
) -> MorrisEffects:
    """Return the elementary effects of every factor on every output.

    Parameters
    ----------
    inputs, designs : SensitivityInputs, array, shape (n, k)
        Variables and the designs of `morris_designs`.
    values, outputs : array, shape (n, r), sequence of str
        Responses to them with their names.
    seed, n_resamples : int
        Seed from 1 upwards and number of the bootstrap resamples.

    Raises
    ------
    InputError
        A value that is not finite or an output that does not vary, by name; another shape; seed 0.

    Notes
    -----
    M. D. Morris, Technometrics 33, 1991; F. Campolongo et al., Environmental Modelling & Software
    22, 2007.
    """
    from SALib.analyze import morris

    array, names = _checked(values, outputs, len(inputs.factors) + 1)
    if designs.shape != (len(array), inputs.n_variables):
        raise InputError(
            f"designs of shape {designs.shape} with {len(array)} rows of responses and "
            f"{inputs.n_variables} variables: bring the designs that gave the responses"
        )

    def analyse(column: RealArray) -> list[RealArray]:
        result = morris.analyze(
            salib_problem(inputs),
            designs,
            column,
            num_levels=LEVELS,
            num_resamples=n_resamples,
            conf_level=CONFIDENCE,
            seed=checked_seed(seed),
        )
        keys = ("mu", "mu_star", "mu_star_conf", "sigma")
        return [np.asarray(np.ma.getdata(result[key]), dtype=float) for key in keys]

    return MorrisEffects(inputs.factors, names, *_by_output(analyse, array))


def salib_problem(inputs: SensitivityInputs) -> dict[str, Any]:
    """Return SALib's problem dictionary, afresh: SALib writes into it, and refuses some names."""
    problem: dict[str, Any] = {
        "num_vars": inputs.n_variables,
        "names": [f"x{place}" for place in range(inputs.n_variables)],
    }
    columns = [inputs.lower, inputs.upper]
    if inputs.sigma is not None:
        columns += [0.5 * (inputs.lower + inputs.upper), inputs.sigma]
        problem["dists"] = ["truncnorm"] * inputs.n_variables
    bounds = np.column_stack(columns).tolist()
    if inputs.stated:
        kinds = problem.get("dists", ["unif"] * inputs.n_variables)
        for place, name in enumerate(inputs.names):
            if name in inputs.stated:
                kinds[place], *bounds[place] = inputs.stated[name]
        problem["dists"] = kinds
    problem["bounds"] = bounds
    if inputs.groups:
        problem["groups"] = list(inputs.groups)
    return problem


def _checked(
    values: RealArray, outputs: Sequence[str], step: int
) -> tuple[RealArray, tuple[str, ...]]:
    """Responses that an analysis can use, a multiple of `step` rows, with the outputs' names."""
    array, names = np.asarray(values, dtype=float), tuple(outputs)
    if array.ndim != 2 or array.shape[1] != len(names) or len(array) == 0 or len(array) % step:
        raise InputError(
            f"responses of shape {array.shape} for {len(names)} outputs: give one column per "
            f"output and one row per design, a multiple of {step} rows"
        )
    bad = np.argwhere(~np.isfinite(array))
    if bad.size:
        raise InputError(
            f"design {bad[0, 0]} has no finite {names[bad[0, 1]]}, and {len(set(bad[:, 0]))} of "
            f"{len(array)} designs are like that: one is enough to make every index wrong, so "
            "narrow the range or repair the model"
        )
    flat = np.flatnonzero(np.ptp(array, axis=0) <= _NO_VARIATION * np.abs(array).max(axis=0))
    if flat.size:
        shown = ", ".join(f"'{names[place]}'" for place in flat[:3])
        more = f" and {flat.size - 3} more" if flat.size > 3 else ""
        raise InputError(
            f"no variation over the designs in output {shown}{more}: there is no variance to "
            "share out, leave it out"
        )
    return array, names


def _checked_sobol(
    values: RealArray, outputs: Sequence[str], step: int, n_resamples: int
) -> tuple[RealArray, tuple[str, ...], int]:
    """Responses, names of the outputs and number of base points, of `step` designs each."""
    array, names = _checked(values, outputs, step)
    n_base = _check_base(len(array) // step)
    if n_resamples < 2:
        raise InputError(
            f"{n_resamples} resamples cannot give an interval: take at least 2, better 100"
        )
    return array, names, n_base


def _check_base(n_base: int) -> int:
    exponent = max(n_base, 1).bit_length() - 1
    if n_base < _FEWEST or n_base != 2**exponent:
        low = max(2**exponent, _FEWEST)
        raise InputError(
            f"{n_base} base points of a Sobol analysis are not a power of two from {_FEWEST} "
            f"upwards and would be unbalanced or too few: take {low} or {2 * low}"
        )
    return n_base


def _interval_of(resampled: RealArray) -> RealArray:
    """Half widths of the intervals from resampled indices, shape (n_resamples, ...)."""
    return np.asarray(ndtri(0.5 + CONFIDENCE / 2.0) * resampled.std(axis=0, ddof=1))


def _by_output(
    analyse: Callable[[RealArray], list[RealArray]], values: RealArray
) -> tuple[RealArray, ...]:
    """Analyse column by column; each kind of row becomes an array of shape (rows, r)."""
    with _nothing_global():
        tables = [analyse(np.ascontiguousarray(column)) for column in values.T]
    return tuple(np.stack(rows, axis=1) for rows in zip(*tables, strict=True))


@contextmanager
def _nothing_global() -> Iterator[None]:
    """Put the global random state and the ways of warnings back afterwards."""
    state, layout = np.random.get_state(), warnings.formatwarning  # noqa: NPY002
    try:
        with warnings.catch_warnings():
            yield
    finally:
        np.random.set_state(state)  # noqa: NPY002
        warnings.formatwarning = layout


@contextmanager
def _distributions_in_words() -> Iterator[None]:
    """Turn what SALib says of a distribution into a refusal."""
    try:
        yield
    except (ValueError, TypeError, IndexError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            f"a distribution of the inputs cannot be ({' '.join(str(error).split())}): give its "
            "name and numbers as SALib takes them, such as ('triang', 0.8, 1.2, 0.5)"
        ) from error


SUM = "sum of the responses"
"""Output beside several responses: what a search minimises."""


def _moving(space: DesignSpace, inputs: Mapping[str, Sequence[Any]] | None) -> BoolArray:
    """Return which variables vary, by their bounds or a distribution of their own, shape (k,)."""
    stated = np.array([name in (inputs or {}) for name in space.names])
    moving = np.asarray((space.upper > space.lower) | stated)
    if not moving.any():
        raise InputError("no variable varies: give at least one of them bounds that differ")
    return moving


def _fixed(space: DesignSpace, inputs: Mapping[str, Sequence[Any]] | None) -> tuple[str, ...]:
    moving = _moving(space, inputs)
    return tuple(name for name, moves in zip(space.names, moving, strict=True) if not moves)


def _varied(
    space: DesignSpace,
    groups: Mapping[str, Sequence[str]] | None,
    inputs: Mapping[str, Sequence[Any]] | None,
) -> SensitivityInputs:
    """Return variables within their bounds, or as stated, perhaps in groups; no fixed ones."""
    moving, reach = _moving(space, inputs), np.where(space.integer, 0.5, 0.0)
    result = SensitivityInputs(
        names=tuple(np.array(space.names, dtype=object)[moving]),
        lower=(space.lower - reach)[moving],
        upper=(space.upper + reach)[moving],
        stated=dict(inputs or {}),
    )
    if not groups:
        return result
    of: dict[str, str] = {}
    for group, members in groups.items():
        for name in members:
            if name not in space.names:
                raise InputError(f"group '{group}': no variable '{name}' in {list(space.names)}")
            if name in of:
                raise InputError(f"variable '{name}' is in the groups '{of[name]}' and '{group}'")
            of[name] = group
    return result.grouped([of.get(name, name) for name in result.names])


def _values(
    model: Evaluate,
    space: DesignSpace,
    inputs: Mapping[str, Sequence[Any]] | None,
    varied: RealArray,
) -> RealArray:
    """Return the responses to designs (n, m) of the variables that vary; refuse a failing model."""
    designs = np.tile(space.nominal, (len(varied), 1))
    designs[:, _moving(space, inputs)] = varied
    designs = space.made_whole(designs)
    try:
        return responses(model, designs)
    except Exception as error:
        words = said(error)
        failing = next((row for row in designs if _fails(model, row)), designs[0])
        at = ", ".join(f"{n} {x:.6g}" for n, x in zip(space.names, failing, strict=True))
        raise InputError(
            f"the model fails with '{words}', at one of {len(designs)} designs ({at}): one is "
            "enough to make every index wrong, so narrow the range or repair the model"
        ) from error


def _fails(model: Evaluate, design: RealArray) -> bool:
    try:
        responses(model, design[np.newaxis])
    except Exception:
        return True
    return False


def _with_sum(values: RealArray, model: Evaluate) -> tuple[RealArray, tuple[str, ...]]:
    """Add the sum to several responses of one unit."""
    names = tuple(model.response_names)
    several_units = len(set(units_of(names, model.response_unit))) > 1
    if len(names) == 1 or several_units or np.ptp(values.sum(axis=1)) == 0.0:
        return values, names
    return np.column_stack([values, values.sum(axis=1)]), (*names, SUM)


def _named_problem(inputs: SensitivityInputs) -> dict[str, Any]:
    """Return SALib's problem dictionary with the variables' own names."""
    return salib_problem(inputs) | {"names": list(inputs.names)}


@dataclass(frozen=True, eq=False)
class Sensitivities(Tabled):
    """Indices of an analysis by SALib.

    Parameters
    ----------
    problem : mapping
        SALib's own problem dictionary.
    indices : SobolIndices or MorrisEffects
        As arrays, (factor, output).
    unit : str
        Unit of the responses.
    n_lines : int
        Lines that each response is the sum of.
    pairs : PairIndices, optional
        Second-order indices.
    fixed : tuple of str
        Variables that were left out, because their bounds are equal.
    """

    problem: Mapping[str, Any]
    indices: SobolIndices | MorrisEffects
    unit: str
    n_lines: int = 1
    pairs: PairIndices | None = None
    fixed: tuple[str, ...] = ()

    @property
    def table(self) -> pd.DataFrame:
        """One row per variable, or group, and response; intervals are half widths."""
        indices = self.indices
        if isinstance(indices, SobolIndices):
            columns = {
                "first [1]": indices.first,
                "total [1]": indices.total,
                "total ± 95 % [1]": indices.total_interval,
                "first ± 95 % [1]": indices.first_interval,
                "interaction [1]": indices.interaction,
                "interaction ± 95 % [1]": indices.interaction_interval,
            }
        else:
            unit = "see unit" if self._units else self.unit
            columns = {
                f"mu* [{unit}]": indices.mu_star,
                f"sigma [{unit}]": indices.sigma,
                f"mu* per line [{unit}]": indices.mu_star / self.n_lines,
                f"mu* ± 95 % [{unit}]": indices.mu_star_interval,
            }
        rows = pd.MultiIndex.from_product(
            (indices.factors, indices.outputs), names=("variable", "response")
        ).to_frame(index=False)
        if self._units and not isinstance(indices, SobolIndices):
            rows["unit"] = np.tile(self._units, len(indices.factors))
        return rows.assign(**{name: values.ravel() for name, values in columns.items()})

    @property
    def _units(self) -> tuple[str, ...]:
        """Unit of each response where they differ."""
        units = units_of(self.indices.outputs, self.unit) if "," in self.unit else ()
        return units if len(set(units)) > 1 else ()

    @property
    def pair_table(self) -> pd.DataFrame:
        """One row per pair of variables and response: what both do together only.

        - raises InputError: without second-order indices.
        """
        if self.pairs is None:
            raise InputError("there are no second-order indices: ask with second_order=True")
        names, places = self.pairs.factors, np.triu_indices(len(self.pairs.factors), 1)
        first, second = (np.take(names, each) for each in places)
        rows = {
            "variable": np.repeat(first, len(self.pairs.outputs)),
            "with": np.repeat(second, len(self.pairs.outputs)),
            "response": np.tile(self.pairs.outputs, len(first)),
            "second [1]": self.pairs.second[places].ravel(),
            "second ± 95 % [1]": self.pairs.second_interval[places].ravel(),
        }
        return pd.DataFrame(rows)


def sobol(
    model: Evaluate,
    space: DesignSpace,
    *,
    n: int = 1024,
    seed: int = 1,
    resamples: int = 100,
    groups: Mapping[str, Sequence[str]] | None = None,
    inputs: Mapping[str, Sequence[Any]] | None = None,
    second_order: bool = False,
) -> Sensitivities:
    """Return Sobol indices of every response, computed by SALib.

    Parameters
    ----------
    model : BoomingModel or any other evaluation
        Designs, shape (n, k) → responses, shape (n, r).
    space : DesignSpace
        Range of the variables; those with equal bounds are left out: the result's ``fixed``.
    n : int
        Base points, a power of two from 8; n (k + 2) designs are evaluated.
    seed, resamples : int
        Seed from 1 and bootstrap resamples of the intervals, at least 2.
    groups : mapping of str to sequence of str, optional
        Variables that vary together and have one index, by the name of the group; the others stand
        for themselves.
    inputs : mapping of str to sequence, optional
        SALib's distribution of a variable with its numbers, such as
        ``{"TSM x": ("norm", 1.0, 0.05)}``; the others are uniform within their bounds.
    second_order : bool
        Whether pairs have indices, too, in ``pair_table``; n (2 k + 2) designs are evaluated.

    Returns
    -------
    Sensitivities
        First and total indices, shape (k, r) [1], with 95 % intervals, also of the sum of several
        responses; ``problem`` is SALib's dictionary.

    Raises
    ------
    InputError
        Wrong names, groups, distributions, counts or seed; a model that fails, with what it said; a
        response that does not vary or is not finite, by name.

    See Also
    --------
    deboom.morris, deboom.correlation, deboom.doe

    Examples
    --------
    >>> import deboom, numpy as np
    >>> add = deboom.ResponseFunction(lambda x: x @ [[1.0], [2.0]], ("a", "b"), ("y",), "dB")
    >>> table = deboom.sobol(add, add.design_space(), n=256).table
    >>> table["total [1]"].round(1).tolist()
    [0.2, 0.8]
    """
    check_fits(model, space)
    n, resamples = whole_number(n, "n, the base points"), whole_number(resamples, "resamples")
    check_repeats(model, space)
    varied = _varied(space, groups, inputs)
    designs = sobol_designs(varied, n, seed=seed, pairs=second_order)
    values = _values(model, space, inputs, designs)
    values, outputs = _with_sum(values, model)
    names, pairs, alone = varied.factors, None, values
    if second_order:
        pairs = pair_indices(values, names, outputs, seed=seed, n_resamples=resamples)
        alone = without_pairs(values, len(names))
    indices = sobol_indices(alone, names, outputs, seed=seed, n_resamples=resamples)
    lines = getattr(model, "n_lines", 1)
    return Sensitivities(
        problem=_named_problem(varied),
        indices=indices,
        unit=model.response_unit,
        n_lines=lines,
        pairs=pairs,
        fixed=_fixed(space, inputs),
    )


def morris(
    model: Evaluate,
    space: DesignSpace,
    *,
    trajectories: int = 50,
    seed: int = 1,
    groups: Mapping[str, Sequence[str]] | None = None,
    inputs: Mapping[str, Sequence[Any]] | None = None,
) -> Sensitivities:
    """Return the elementary effects of Morris of every response, computed by SALib.

    Parameters
    ----------
    model : BoomingModel or any other evaluation
        Designs, shape (n, k) → responses, shape (n, r).
    space : DesignSpace
        Range of the variables; those with equal bounds are left out: the result's ``fixed``.
    trajectories : int
        Trajectories, at least 2; each takes k + 1 designs.
    seed : int
        Seed from 1.
    groups : mapping of str to sequence of str, optional
        Variables that vary together and have one index, by the name of the group; the others stand
        for themselves.
    inputs : mapping of str to sequence, optional
        SALib's distribution of a variable with its numbers, such as
        ``{"TSM x": ("norm", 1.0, 0.05)}``; the others are uniform within their bounds. The steps
        are those of the cumulative distribution, from −3 σ to 3 σ where it has no ends.

    Returns
    -------
    Sensitivities
        ``mu*`` and ``sigma``, shape (k, r) [unit of the responses], also of the sum of several
        responses; sigma of a group is NaN. ``problem`` is SALib's dictionary.

    Raises
    ------
    InputError
        Wrong names, groups, distributions, counts or seed; a model that fails, with what it said; a
        response that does not vary or is not finite, by name.

    See Also
    --------
    deboom.sobol, deboom.doe

    Examples
    --------
    >>> import deboom
    >>> add = deboom.ResponseFunction(lambda x: x @ [[1.0], [2.0]], ("a", "b"), ("y",), "dB")
    >>> table = deboom.morris(add, add.design_space(), trajectories=8).table
    >>> (table["mu* [dB]"] / table["mu* [dB]"][0]).round(6).tolist()
    [1.0, 2.0]
    """
    check_fits(model, space)
    trajectories = whole_number(trajectories, "trajectories")
    check_repeats(model, space)
    varied = _varied(space, groups, inputs)
    designs = morris_designs(varied, trajectories, seed=seed)
    values = _values(model, space, inputs, designs)
    values, outputs = _with_sum(values, model)
    effects = morris_analysis(varied, designs, values, outputs, seed=seed)
    lines = getattr(model, "n_lines", 1)
    return Sensitivities(
        problem=_named_problem(varied),
        indices=effects,
        unit=model.response_unit,
        n_lines=lines,
        fixed=_fixed(space, inputs),
    )
