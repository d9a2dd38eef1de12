"""A platform in a notebook: from its folder to model, front, tolerances and sensitivities.

Each function does in one call what a study does with its options; words are checked here, and the
rooms below get types. `import deboom` offers all of them.
"""

from __future__ import annotations

from dataclasses import replace
from enum import Enum
from typing import TypeVar

import numpy as np

from deboom.errors import InputError
from deboom.explore import front as fronts
from deboom.explore.robust import RobustResponse
from deboom.explore.scatter import sobol_sample
from deboom.explore.search import nsga2
from deboom.explore.space import DesignSpace, Evaluate, check_fits
from deboom.explore.workers import workers_for
from deboom.study.compare import common_judges
from deboom.study.front import Front

_Choice = TypeVar("_Choice", bound=Enum)


def Robust(
    model: Evaluate, space: DesignSpace, *, draws: int = 128, seed: int = 1
) -> RobustResponse:
    """Wrap a model with the scatter of manufacture: ΣSPLV and Σσ(SPLV) over shared draws.

    Parameters
    ----------
    model : BoomingModel, ResponseFunction or any other evaluation
        Designs, shape (n, k) → responses, shape (n, r); called with all draws of a design at once.
    space : DesignSpace
        Bounds and tolerances of its k variables.
    draws : int
        Draws of the scatter, a power of two; every design meets the same ones.
    seed : int
        Seed of the draws, from 1.

    Returns
    -------
    RobustResponse
        Designs → mean and standard deviation of each response, shape (n, r) [unit of the
        responses], and their sums.

    Raises
    ------
    InputError
        A model without names; variables that differ; a number of draws that is no power of two; a
        seed below 1.

    Examples
    --------
    >>> import deboom
    >>> square = deboom.ResponseFunction(lambda x: x**2, ("a",), ("y",), "dB")
    >>> robust = deboom.Robust(square, square.design_space(), draws=64)
    >>> robust([[1.0]]).mean.round(3)
    array([[1.002]])
    """
    check_fits(model, space)
    return RobustResponse(model, space, sobol_sample(space.n_variables, draws, seed=seed))


def search(
    robust: RobustResponse,
    *,
    population: int = 100,
    generations: int = 100,
    seed: int = 1,
    workers: int = 1,
    verified_with: int = 1024,
) -> Front:
    """Search the robust front with NSGA-II, and evaluate it again with draws it never saw.

    Parameters
    ----------
    robust : RobustResponse
        Mean and scatter of the responses.
    population, generations : int
        Designs per generation, at least 4, and generations, at least 1.
    seed : int
        Seed from 1; the same seed gives the same front for any number of workers.
    workers : int
        Processes that evaluate a generation.
    verified_with : int
        Draws of the verification, a power of two.

    Returns
    -------
    Front
        ``front.table``, one row per design: sums over vehicles and lines [dB(A)], and means per
        line and vehicle; ``front.designs()`` [units of the space]; ``front.picks``.

    Raises
    ------
    InputError
        A budget, draws or a seed that cannot be; a front that fails under the new draws.

    Examples
    --------
    >>> import deboom
    >>> model = deboom.ResponseFunction(lambda x: (x - 0.9) ** 2, ("a",), ("y",), "dB")
    >>> robust = deboom.Robust(model, model.design_space(), draws=64)
    >>> front = deboom.search(robust, population=8, generations=4)
    >>> abs(front.search.front.designs[front.picks["best-mean"], 0] - 0.9) < 0.1
    np.True_
    """
    with workers_for(robust, workers) as evaluation:
        searched = nsga2(evaluation, population, generations, seed=seed)
    judge = fronts.replicates(robust, verified_with, seed=seed)
    return Front(robust, searched, searched.front, judge, fronts.verify(searched.front, judge))


def verify(front: Front, *, draws: int = 1024, seed: int) -> Front:
    """Evaluate the designs of a front again, with draws that its search never saw.

    Parameters
    ----------
    front : Front
        As `search` found it.
    draws : int
        Draws of the scatter, a power of two.
    seed : int
        Seed from 1; take another than in `search`, whose verification it would only repeat.

    Returns
    -------
    Front
        The same designs under the new draws, with ``mean_bias`` and ``sigma_bias_percent``.

    Raises
    ------
    InputError
        A front that fails altogether under the new draws; draws or a seed that cannot be.

    Examples
    --------
    >>> import deboom
    >>> model = deboom.ResponseFunction(lambda x: (x - 0.9) ** 2, ("a",), ("y",), "dB")
    >>> robust = deboom.Robust(model, model.design_space(), draws=64)
    >>> front = deboom.search(robust, population=8, generations=4)
    >>> bool(deboom.verify(front, draws=512, seed=2).nondominated.any())
    True
    """
    judge = fronts.replicates(front.robust, draws, seed=seed)
    return replace(front, judge=judge, values=fronts.verify(front.searched, judge))


def compare(first: Front, second: Front, *, draws: int = 1024, seed: int = 1) -> fronts.Difference:
    """Say whether one front is really better than another, or whether it could be chance.

    Parameters
    ----------
    first, second : Front
        Fronts of the same variables and responses; the model of the first one judges both.
    draws : int
        Common draws of the scatter that both meet, a power of two of at least 16.
    seed : int
        Seed of these draws, from 1.

    Returns
    -------
    Difference
        First minus second, as a share of the hypervolume of their common box [1]; ``noise``, the
        largest difference that 99 % still call chance; ``verdict``.

    Raises
    ------
    InputError
        Fronts of other variables or responses; draws that cannot be.

    Examples
    --------
    >>> import deboom
    >>> model = deboom.ResponseFunction(lambda x: (x - 0.9) ** 2, ("a",), ("y",), "dB")
    >>> robust = deboom.Robust(model, model.design_space(), draws=64)
    >>> front = deboom.search(robust, population=8, generations=4)
    >>> deboom.compare(front, front).verdict.value
    'within noise'
    """
    names = [(one.variables, one.vehicles) for one in (first, second)]
    if names[0] != names[1]:
        raise InputError(f"fronts of {names[0]} and {names[1]} do not compare: search both alike")
    judges = common_judges(first.robust, draws, seed)
    by_set = [
        [values.objectives for values in judges.by_set(front.search.front.designs)]
        for front in (first, second)
    ]
    box = fronts.common_box([np.mean(values, axis=0) for values in by_set])
    return fronts.difference(
        *(
            fronts.Contestant(
                name,
                np.array([[box.hypervolume(values) for values in sets]]),
                np.array([box.share(fronts.last_gain(front.search.hypervolume))]),
            )
            for name, sets, front in zip(("first", "second"), by_set, (first, second), strict=True)
        )
    )
