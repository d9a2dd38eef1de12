"""Sensitivity analyses: Sobol indices, elementary effects of Morris, PAWN and delta."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any

import numpy as np
from scipy.special import ndtri
from threadpoolctl import threadpool_limits

from deboom.arrays import BoolArray, RealArray, frozen_copy
from deboom.errors import InputError
from deboom.explore.scatter import TRUNCATION
from deboom.explore.space import DesignSpace, checked_seed


@dataclass(frozen=True, eq=False)
class SensitivityInputs:
    """Independent variables with their distributions: all uniform, or all gaussian and cut.

    Parameters
    ----------
    names : tuple of str, length k
        Variables, in the order of a design's columns.
    lower, upper : array, shape (k,)
        Bounds, outside of which no variable comes [units of the variables].
    sigma : array, shape (k,), optional
        Standard deviations before the cut of gaussian variables, whose mean lies midway between
        the bounds [units of the variables]. By default the variables are uniform.
    groups : tuple of str, length k, optional
        Group that each variable belongs to: the members of a group vary together, and one index
        stands for all. By default each variable stands for itself.

    Raises
    ------
    InputError
        Names the variable with reversed or equal bounds, or without a standard deviation; names
        used twice; not one value per variable; one group only.
    """

    names: tuple[str, ...]
    lower: RealArray
    upper: RealArray
    sigma: RealArray | None = None
    groups: tuple[str, ...] = field(default=())

    def __post_init__(self) -> None:
        object.__setattr__(self, "names", tuple(self.names))
        object.__setattr__(self, "groups", tuple(self.groups))
        doubled = sorted({name for name in self.names if self.names.count(name) > 1})
        if doubled or not self.names:
            raise InputError(
                f"a sensitivity analysis of the variables {list(self.names)}: give at least one, "
                "each with a name of its own"
            )
        given = {"lower": self.lower, "upper": self.upper, "sigma": self.sigma}
        for column, values in given.items():
            if values is not None:
                self._keep(column, np.asarray(values, dtype=float))
        if self.groups and len(self.groups) != len(self.names):
            raise InputError(
                f"{len(self.groups)} groups for {len(self.names)} variables: name one per variable"
            )
        if self.groups and len(set(self.groups)) == 1:
            raise InputError(
                f"all variables are in the group '{self.groups[0]}': there is nothing to compare, "
                "name at least two groups"
            )
        for place, name in enumerate(self.names):
            self._check_spread(place, name)

    def _keep(self, column: str, values: RealArray) -> None:
        if values.shape != (len(self.names),) or not np.isfinite(values).all():
            raise InputError(
                f"{column} of shape {values.shape} for {len(self.names)} variables: give one "
                "finite number per variable"
            )
        object.__setattr__(self, column, frozen_copy(values))

    def _check_spread(self, place: int, name: str) -> None:
        low, high = float(self.lower[place]), float(self.upper[place])
        fixed = self.sigma is not None and not self.sigma[place] > 0.0
        if not low < high or fixed:
            raise InputError(
                f"variable '{name}' does not vary (from {low:g} to {high:g}): give it a range, or "
                "leave it out of the sensitivity analysis"
            )

    @property
    def n_variables(self) -> int:
        """Number k of variables."""
        return len(self.names)

    @property
    def factors(self) -> tuple[str, ...]:
        """What indices are given for: the groups in the order they appear, or the variables."""
        return tuple(dict.fromkeys(self.groups)) or self.names

    @property
    def description(self) -> str:
        """Distribution and range in words, for reports and run records."""
        low, high = (self._listed(values) for values in (self.lower, self.upper))
        kind = "uniform" if self.sigma is None else f"gaussian, cut at ±{TRUNCATION:g} σ,"
        return f"{kind} from {low} to {high}"

    def _listed(self, values: RealArray) -> str:
        """One number if all are equal, else the range of them."""
        ends = dict.fromkeys(f"{value:g}" for value in (values.min(), values.max()))
        return "…".join(ends)

    def grouped(self, groups: Sequence[str]) -> SensitivityInputs:
        """Return the same variables in groups, see `SensitivityInputs`."""
        return SensitivityInputs(self.names, self.lower, self.upper, self.sigma, tuple(groups))


def design_inputs(space: DesignSpace) -> SensitivityInputs:
    """Return variables that are uniform within the bounds of a space: what a designer may choose.

    Raises
    ------
    InputError
        A variable that is fixed.
    """
    return SensitivityInputs(space.names, space.lower, space.upper)


def tolerance_inputs(space: DesignSpace) -> SensitivityInputs:
    """Return variables that scatter around the nominal design: what manufacturing does.

    Gaussian, with the tolerance as three standard deviations, cut there by the inverse distribution
    function.

    Raises
    ------
    InputError
        A variable without a tolerance.
    """
    sigma = np.abs(space.nominal) * space.relative_sigma
    reach = TRUNCATION * sigma
    return SensitivityInputs(space.names, space.nominal - reach, space.nominal + reach, sigma)


@dataclass(frozen=True, eq=False)
class MorrisEffects:
    """Elementary effects: change of an output over a step of one factor, per unit of its range.

    Parameters
    ----------
    factors, outputs : tuple of str
        Lengths d and r.
    mu, mu_star, mu_star_interval : array, shape (d, r)
        Mean of the effects, mean of their magnitudes and half width of its interval
        [unit of the output].
    sigma : array, shape (d, r)
        Standard deviation of the effects: curvature and coupling; nan for groups of several
        variables [unit of the output].
    """

    factors: tuple[str, ...]
    outputs: tuple[str, ...]
    mu: RealArray
    mu_star: RealArray
    mu_star_interval: RealArray
    sigma: RealArray


@dataclass(frozen=True, eq=False)
class DistributionIndices:
    """What fixing a factor does to the whole distribution of an output, 0 to 1.

    Parameters
    ----------
    factors, outputs : tuple of str
        Lengths d and r.
    index : array, shape (d, r)
        [1].
    interval : array, shape (d, r)
        Half width of its interval; nan where the method gives none [1].
    """

    factors: tuple[str, ...]
    outputs: tuple[str, ...]
    index: RealArray
    interval: RealArray


CONFIDENCE = 0.95
"""Share of cases in which an interval is to hold the true index [1]."""
NO_VARIATION = 64.0 * np.finfo(float).eps
"""An output that varies by less than this part of its size is constant but for rounding [1]."""
FEWEST = 8  # base points; with fewer a resample may have no variance at all
FLAT = 1e-2  # part of the variance of all designs that a resample may have by difference
BLOCK = 16  # outputs that are laid out at a time


@dataclass(frozen=True, eq=False)
class SobolIndices:
    """Shares of the variance of each output, with half widths of their intervals; all [1].

    Parameters
    ----------
    factors : tuple of str, length d
        Variables or groups.
    outputs : tuple of str, length r
        What was analysed.
    first, total : array, shape (d, r)
        Share of a factor alone, and with all that it does together with others.
    coupled : array, shape (d, r)
        Total minus first.
    first_interval, total_interval, coupled_interval : array, shape (d, r)
        Half widths at the confidence `CONFIDENCE`.
    pairs : tuple of (int, int)
        Places of the factors of each pair; empty without second order.
    second, second_interval : array, shape (len(pairs), r)
        Share of a pair beyond what both do alone.
    n_base : int
        Base points N of the scheme.
    n_resamples : int
        Bootstrap resamples behind the intervals.
    """

    factors: tuple[str, ...]
    outputs: tuple[str, ...]
    first: RealArray
    first_interval: RealArray
    total: RealArray
    total_interval: RealArray
    coupled: RealArray
    coupled_interval: RealArray
    pairs: tuple[tuple[int, int], ...]
    second: RealArray
    second_interval: RealArray
    n_base: int
    n_resamples: int

    @property
    def zero(self) -> BoolArray:
        """Whether a total index is not above its own interval, shape (d, r)."""
        return np.less_equal(self.total, self.total_interval)

    @property
    def pair_names(self) -> tuple[tuple[str, str], ...]:
        """Factors of each pair by name."""
        return tuple((self.factors[j], self.factors[k]) for j, k in self.pairs)

    def difference(self, other: SobolIndices) -> float:
        """Return the largest difference of any index or interval from those of the same outputs.

        Relative to one plus the number's size: intervals of a handful of points may be large.
        """
        columns = ("first", "total", "coupled", "second")
        names = [*columns, *(f"{column}_interval" for column in columns)]
        pairs = [(getattr(self, name), getattr(other, name)) for name in names]
        gaps = [np.abs(one - two) / (1.0 + np.abs(two)) for one, two in pairs]
        return max(float(gap.max(initial=0.0)) for gap in gaps)


def n_rows(n_factors: int, second_order: bool) -> int:
    """Return how many designs belong to one base point."""
    return (2 * n_factors if second_order else n_factors) + 2


def first_and_total(values: RealArray, n_factors: int) -> RealArray:
    """Return of second-order values, shape (n, r), those that first and total indices need."""
    rows = values.reshape(-1, n_rows(n_factors, True), values.shape[1])
    keep = [*range(n_factors + 1), -1]
    return np.ascontiguousarray(rows[:, keep]).reshape(-1, values.shape[1])


def base_rows(values: RealArray, n_factors: int, second_order: bool) -> RealArray:
    """Return the values at the 2N independent points of the scheme, shape (2N, r)."""
    rows = values.reshape(-1, n_rows(n_factors, second_order), values.shape[1])
    return np.concatenate([rows[:, 0], rows[:, -1]])


def checked_values(
    values: RealArray, outputs: Sequence[str], step: int
) -> tuple[RealArray, tuple[str, ...]]:
    """Return responses that an analysis can use, or say which design or output it cannot.

    Parameters
    ----------
    values : array, shape (n, r)
        Responses, in the order of the designs.
    outputs : sequence of str, length r
    step : int
        n is a multiple of this; of the scheme of Saltelli, ``n / step`` is a power of two.

    Raises
    ------
    InputError
        Another shape; a value that is not finite, by the number of its design; an output that does
        not vary, by name.
    """
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
    spread, size = np.ptp(array, axis=0), np.abs(array).max(axis=0)
    constant = [names[place] for place in np.flatnonzero(spread <= NO_VARIATION * size)]
    if constant:
        raise InputError(
            f"no variation over the designs in output {_named(constant)}: there is no variance to "
            "share out, leave it out"
        )
    return array, names


def sobol_indices(
    values: RealArray,
    factors: Sequence[str],
    outputs: Sequence[str],
    *,
    seed: int,
    second_order: bool = True,
    n_resamples: int = 100,
) -> SobolIndices:
    """Return the Sobol indices of all outputs, with bootstrap intervals.

    Parameters
    ----------
    values : array, shape (n, r)
        Responses to the designs of `deboom.explore.sensitivity.sobol_designs`, in their order;
        ``n = N (2d + 2)``, without second order ``N (d + 2)``.
    factors : sequence of str, length d
        Variables, or groups of them.
    outputs : sequence of str, length r
    seed : int
        Of the resampling, from 1 upwards; the resamples are those of SALib with this seed, and all
        outputs share them.
    second_order : bool
        Whether the designs are those for second order.
    n_resamples : int
        At least 2.

    Raises
    ------
    InputError
        See `checked_values`; N not a power of two, fewer than two resamples, seed 0.

    Notes
    -----
    With ``f_A``, ``f_B``, ``f_AB,j``, ``f_BA,j`` the output at the base points A and B and with
    factor j taken from the other, ``V`` the variance of ``f_A`` and ``f_B`` together and all values
    centred: ``S_j = mean(f_B (f_AB,j - f_A)) / V`` and ``ST_j = mean((f_A - f_AB,j)²) / 2V``
    (Saltelli et al., Computer Physics Communications 181, 2010),
    ``S_jk = mean(f_BA,j f_AB,k - f_A f_B) / V - S_j - S_k`` (Saltelli, ibid. 145, 2002). An
    interval is the standard deviation over the resamples times the gaussian quantile.
    """
    d = len(factors)
    array, names = checked_values(values, outputs, n_rows(d, second_order))
    n_base = len(array) // n_rows(d, second_order)
    checked_base(n_base)
    weights = resample_weights(n_base, n_resamples, seed)
    pairs = tuple(combinations(range(d), 2)) if second_order else ()
    parts: list[tuple[RealArray, RealArray]] = []
    with threadpool_limits(1, user_api="blas"):  # threads may change the last bit
        for start in range(0, len(names), BLOCK):
            block = array[:, start : start + BLOCK].reshape(n_base, n_rows(d, second_order), -1)
            laid = np.ascontiguousarray(block.transpose(2, 1, 0))
            parts += [_one_output(rows, weights, d, pairs) for rows in laid]
    index, interval = (np.stack(column, axis=1) for column in zip(*parts, strict=True))
    cuts = (d, 2 * d, 3 * d)
    first, total, coupled, second = np.split(index, cuts)
    first_i, total_i, coupled_i, second_i = np.split(interval, cuts)
    return SobolIndices(
        tuple(factors),
        names,
        *(first, first_i, total, total_i, coupled, coupled_i),
        pairs,
        *(second, second_i),
        n_base,
        n_resamples,
    )


def checked_base(n_base: int) -> int:
    """Return the number of base points, or refuse one that is not a power of two from 8 upwards."""
    exponent = max(n_base, 1).bit_length() - 1
    if n_base < FEWEST or n_base != 2**exponent:
        low = max(2**exponent, FEWEST)
        raise InputError(
            f"{n_base} base points of a Sobol analysis are not a power of two from {FEWEST} "
            f"upwards and would be unbalanced or too few: take {low} or {2 * low}"
        )
    return n_base


def checked_resamples(n_resamples: int) -> int:
    """Return the number of resamples, or refuse fewer than two."""
    if n_resamples < 2:
        raise InputError(
            f"{n_resamples} resamples cannot give an interval: take at least 2, better 100"
        )
    return n_resamples


def resample_weights(n_base: int, n_resamples: int, seed: int) -> RealArray:
    """Return how often each base point is drawn, the point itself first, (1 + n_resamples, N).

    Raises
    ------
    InputError
        Fewer than two resamples, seed 0.
    """
    checked_resamples(n_resamples)
    drawn = np.random.default_rng(checked_seed(seed)).integers(n_base, size=(n_base, n_resamples))
    offset = drawn + n_base * np.arange(n_resamples)
    counts = np.bincount(offset.ravel(), minlength=n_base * n_resamples)
    return np.vstack([np.ones(n_base), counts.reshape(n_resamples, n_base)])


def _one_output(
    rows: RealArray, weights: RealArray, d: int, pairs: tuple[tuple[int, int], ...]
) -> tuple[RealArray, RealArray]:
    """Return indices and intervals of one output: first, total, coupled, second in a row.

    ``rows``: shape (rows of a base point, N).
    """
    scaled = (rows - rows.mean()) / rows.std()
    a, b = scaled[0], scaled[-1]
    ab, ba = scaled[1 : d + 1], scaled[d + 1 : 2 * d + 1]
    terms = np.empty((2 * d + len(pairs) + 2, rows.shape[1]))
    np.subtract(ab, a, out=terms[:d])
    np.multiply(0.5 * terms[:d], terms[:d], out=terms[d : 2 * d])
    terms[:d] *= b
    for term, (j, k) in zip(terms[2 * d : -2], pairs, strict=True):
        np.multiply(ba[j], ab[k], out=term)
    terms[2 * d : -2] -= a * b
    terms[-2], terms[-1] = 0.5 * (a + b), 0.5 * (a * a + b * b)
    means = weights @ terms.T / rows.shape[1]
    variance = means[:, -1] - means[:, -2] ** 2
    for row in np.flatnonzero(variance < FLAT):  # the difference has lost its digits
        centred = (a - means[row, -2]) ** 2 + (b - means[row, -2]) ** 2
        variance[row] = 0.5 * np.mean(weights[row] * centred)
    shares = means[:, :-2] / variance[:, None]
    first, total, both = shares[:, :d], shares[:, d : 2 * d], shares[:, 2 * d :]
    if pairs:
        j, k = np.array(pairs).T
        both = both - first[:, j] - first[:, k]
    every = np.hstack([first, total, total - first, both])
    return every[0], interval_of(every[1:])


def interval_of(resampled: RealArray) -> RealArray:
    """Return the half widths of the intervals from resampled indices, shape (n_resamples, ...)."""
    return np.asarray(ndtri(0.5 + CONFIDENCE / 2.0) * resampled.std(axis=0, ddof=1))


def _named(names: Sequence[str]) -> str:
    """Write a few names out and count the rest."""
    shown = ", ".join(f"'{name}'" for name in names[:3])
    return shown if len(names) <= 3 else f"{shown} and {len(names) - 3} more"


LEVELS = 4
"""Levels of each variable in the designs of Morris."""


def sobol_designs(
    inputs: SensitivityInputs, n_base: int, *, seed: int, second_order: bool = True
) -> RealArray:
    """Return the designs of Saltelli's scheme on scrambled Sobol points.

    Parameters
    ----------
    inputs : SensitivityInputs
        k variables in d groups; without groups d = k.
    n_base : int
        Base points N, a power of two. The first points of more points are the same ones.
    seed : int
        From 1 upwards.
    second_order : bool
        Whether pairs are to be analysed.

    Returns
    -------
    array, shape (n, k)
        ``n = N (2d + 2)``, without second order ``N (d + 2)``.

    Raises
    ------
    InputError
        N not a power of two, seed 0.
    """
    from SALib.sample import sobol

    checked_base(n_base)
    with _nothing_global():
        designs = sobol.sample(
            _problem(inputs), n_base, calc_second_order=second_order, seed=checked_seed(seed)
        )
    return np.asarray(designs)


def sobol_analysis(
    values: RealArray,
    factors: Sequence[str],
    outputs: Sequence[str],
    *,
    seed: int,
    second_order: bool = True,
    n_resamples: int = 100,
) -> SobolIndices:
    """Return SALib's Sobol indices, one output after another.

    `deboom.explore.sensitivity.sobol_indices` has the same parameters, exceptions and results,
    and is many times faster.
    """
    from SALib.analyze import sobol

    d, step = len(factors), n_rows(len(factors), second_order)
    array, names = checked_values(values, outputs, step)
    n_base = checked_base(len(array) // step)
    resampling = {"num_resamples": checked_resamples(n_resamples), "seed": checked_seed(seed)}
    pairs = tuple(zip(*np.triu_indices(d, 1), strict=True)) if second_order else ()
    problem = {"num_vars": d, "names": [f"x{place}" for place in range(d)]}

    def one(column: RealArray) -> list[RealArray]:
        found = sobol.analyze(
            dict(problem),
            column,
            calc_second_order=second_order,
            conf_level=CONFIDENCE,
            keep_resamples=True,
            **resampling,
        )
        coupled = interval_of(found["ST_conf_all"] - found["S1_conf_all"])
        rows = [found["S1"], found["S1_conf"], found["ST"], found["ST_conf"]]
        rows += [found["ST"] - found["S1"], coupled]
        for key in ("S2", "S2_conf"):
            rows.append(np.array([found[key][pair] for pair in pairs], dtype=float))
        return rows

    first, first_i, total, total_i, coupled, coupled_i, second, second_i = _by_output(one, array)
    return SobolIndices(
        tuple(factors),
        names,
        *(first, first_i, total, total_i, coupled, coupled_i),
        tuple((int(j), int(k)) for j, k in pairs),
        *(second, second_i),
        n_base,
        n_resamples,
    )


def morris_designs(inputs: SensitivityInputs, n_trajectories: int, *, seed: int) -> RealArray:
    """Return the designs of Morris's method: paths that change one factor after another.

    Parameters
    ----------
    inputs : SensitivityInputs
        k variables in d groups; without groups d = k.
    n_trajectories : int
        At least 2.
    seed : int
        From 1 upwards.

    Returns
    -------
    array, shape (n_trajectories * (d + 1), k)

    Raises
    ------
    InputError
        Fewer than two paths, seed 0.
    """
    from SALib.sample.morris import morris

    if n_trajectories < 2:
        raise InputError(f"{n_trajectories} paths of Morris's method: take at least 2, better 50")
    with _nothing_global():
        designs = morris.sample(
            _problem(inputs), n_trajectories, num_levels=LEVELS, seed=checked_seed(seed)
        )
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
    inputs : SensitivityInputs
        Of the designs.
    designs : array, shape (n, k)
        From `morris_designs`.
    values : array, shape (n, r)
        Responses to them.
    outputs : sequence of str, length r
    seed : int
        Of the resampling, from 1 upwards.
    n_resamples : int
        Behind the intervals.

    Raises
    ------
    InputError
        See `deboom.explore.sensitivity.checked_values`; seed 0.

    Notes
    -----
    M. D. Morris, Technometrics 33, 1991; F. Campolongo et al., Environmental Modelling & Software
    22, 2007.
    """
    from SALib.analyze import morris

    array, names = _same_length(inputs, designs, values, outputs, len(inputs.factors) + 1)

    def one(column: RealArray) -> list[RealArray]:
        found = morris.analyze(
            _problem(inputs),
            designs,
            column,
            num_levels=LEVELS,
            num_resamples=n_resamples,
            conf_level=CONFIDENCE,
            seed=checked_seed(seed),
        )
        keys = ("mu", "mu_star", "mu_star_conf", "sigma")
        return [np.asarray(np.ma.getdata(found[key]), dtype=float) for key in keys]

    return MorrisEffects(inputs.factors, names, *_by_output(one, array))


def pawn_analysis(
    inputs: SensitivityInputs, designs: RealArray, values: RealArray, outputs: Sequence[str]
) -> DistributionIndices:
    """Return PAWN indices: the median distance of cumulative distributions over ten slices.

    Parameters and exceptions as for `delta_analysis`; nothing is drawn. A group has the mean of its
    variables.

    Notes
    -----
    F. Pianosi and T. Wagener, Environmental Modelling & Software 67, 2015. Even a variable without
    effect has an index above zero, about ``0.8 sqrt(10 / n)``.
    """
    from SALib.analyze import pawn

    array, names = _same_length(inputs, designs, values, outputs, 1)

    def one(column: RealArray) -> list[RealArray]:
        found = pawn.analyze(_problem(inputs), designs, column)
        return [np.asarray(found["median"], dtype=float)]

    (index,) = _by_output(one, array)
    return DistributionIndices(inputs.factors, names, index, np.full(index.shape, np.nan))


def delta_analysis(
    inputs: SensitivityInputs,
    designs: RealArray,
    values: RealArray,
    outputs: Sequence[str],
    *,
    seed: int,
    n_resamples: int = 20,
) -> DistributionIndices:
    """Return Borgonovo's delta: half the mean change of an output's density, bias removed.

    Parameters
    ----------
    inputs : SensitivityInputs
        Of the designs; without groups.
    designs : array, shape (n, k)
        Independent ones, such as `deboom.explore.sensitivity.base_rows` of a Sobol analysis.
    values : array, shape (n, r)
        Responses to them.
    outputs : sequence of str, length r
    seed : int
        Of the resampling, from 1 upwards.
    n_resamples : int
        Behind bias and interval; time grows with it and with ``n k r``, a few hundred designs take
        seconds.

    Raises
    ------
    InputError
        See `deboom.explore.sensitivity.checked_values`; groups, designs that are too few, seed 0.

    Notes
    -----
    E. Borgonovo, Reliability Engineering & System Safety 92, 2007.
    """
    from SALib.analyze import delta

    if inputs.groups:
        raise InputError("delta has no meaning for groups: analyse the variables themselves")
    array, names = _same_length(inputs, designs, values, outputs, 1)
    checked_seed(seed)

    def one(column: RealArray) -> list[RealArray]:
        with warnings.catch_warnings(record=True):  # of ways of resampling that are not used here
            found = delta.analyze(
                _problem(inputs),
                designs,
                column,
                num_resamples=n_resamples,
                conf_level=CONFIDENCE,
                seed=seed,
                method="delta",
            )
        rows = [np.asarray(found[key], dtype=float) for key in ("delta_raw", "delta_raw_conf")]
        if not np.isfinite(rows).all():
            raise InputError(f"{len(column)} designs are too few for delta: bring at least 100")
        return rows

    return DistributionIndices(inputs.factors, names, *_by_output(one, array))


def _problem(inputs: SensitivityInputs) -> dict[str, Any]:
    """Return what SALib wants to know, afresh: it writes into it, and some names it refuses."""
    problem: dict[str, Any] = {
        "num_vars": inputs.n_variables,
        "names": [f"x{place}" for place in range(inputs.n_variables)],
    }
    low, high = inputs.lower.tolist(), inputs.upper.tolist()
    if inputs.sigma is None:
        problem["bounds"] = [list(pair) for pair in zip(low, high, strict=True)]
    else:
        middle = (0.5 * (inputs.lower + inputs.upper)).tolist()
        rows = zip(low, high, middle, inputs.sigma.tolist(), strict=True)
        problem["bounds"] = [list(row) for row in rows]
        problem["dists"] = ["truncnorm"] * inputs.n_variables
    if inputs.groups:
        problem["groups"] = list(inputs.groups)
    return problem


def _same_length(
    inputs: SensitivityInputs,
    designs: RealArray,
    values: RealArray,
    outputs: Sequence[str],
    step: int,
) -> tuple[RealArray, tuple[str, ...]]:
    array, names = checked_values(values, outputs, step)
    if designs.shape != (len(array), inputs.n_variables):
        raise InputError(
            f"designs of shape {designs.shape} with {len(array)} rows of responses and "
            f"{inputs.n_variables} variables: bring the designs that gave the responses"
        )
    return array, names


def _by_output(
    one: Callable[[RealArray], list[RealArray]], values: RealArray
) -> tuple[RealArray, ...]:
    """Analyse column by column; each kind of row becomes an array of shape (rows, r)."""
    with _nothing_global():
        found = [one(np.ascontiguousarray(column)) for column in values.T]
    return tuple(np.stack(rows, axis=1) for rows in zip(*found, strict=True))


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
