"""The only door to SALib, with its traps closed.

SALib 1.6 gives zeros when one response is not finite, reads seed 0 as "no seed", changes the global
random state, the format of warnings and the problem it is given, and takes a single group for none.
Here such input is refused in words and what is global is put back. SALib is imported when it is
first needed: it takes two seconds.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.seeds import checked_seed
from deboom.explore.sensitivity_inputs import SensitivityInputs
from deboom.explore.sensitivity_measures import DistributionIndices, MorrisEffects
from deboom.explore.sobol_indices import (
    CONFIDENCE,
    SobolIndices,
    checked_base,
    checked_resamples,
    checked_values,
    interval_of,
    n_rows,
)

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

    `deboom.explore.sobol_indices.sobol_indices` has the same parameters, exceptions and results,
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
        See `deboom.explore.sobol_indices.checked_values`; seed 0.

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
        Independent ones, such as `deboom.explore.sobol_indices.base_rows` of a Sobol analysis.
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
        See `deboom.explore.sobol_indices.checked_values`; groups, designs that are too few, seed 0.

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
