"""Pareto fronts: which designs no other design beats, and how far the figures can be trusted."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import moocore
import numpy as np
import numpy.typing as npt

from deboom.arrays import BoolArray, RealArray, frozen_copy
from deboom.errors import InputError
from deboom.explore.robust import RobustResponse, RobustValues, joined
from deboom.explore.tolerance_samples import sobol_sample


@dataclass(frozen=True, eq=False)
class ParetoFront(RobustValues):
    """Feasible designs of which none beats another in all objectives.

    Sorted by the first objective; of two, the second then falls from row to row. `pareto_front`
    makes it.

    Raises
    ------
    InputError
        Rows that are not such a front.
    """

    def __post_init__(self) -> None:
        super().__post_init__()
        steps = np.diff(self.objectives, axis=0)
        if self.objectives.shape[1] == 2:
            ordered = np.all(steps[:, 0] > 0.0) and np.all(steps[:, 1] < 0.0)
        else:
            ordered = np.all(steps[:, 0] >= 0.0) and nondominated(self.objectives).all()
        if not (self.feasible.all() and ordered):
            raise InputError(
                "these rows are not a sorted Pareto front: make one with pareto_front(values)"
            )


def pareto_front(*values: RobustValues) -> ParetoFront:
    """Return the Pareto front of all feasible rows of all arguments.

    Of designs with equal objectives the one with the smallest first variable (then second, ...)
    stays, so that the order of rows and arguments does not matter.

    Parameters
    ----------
    *values : RobustValues
        At least one; fronts of several runs merge in the same way.
    """
    merged = joined(values)
    keys = np.column_stack([merged.objectives, merged.designs])
    order = np.lexsort(keys.T[::-1])
    order = order[merged.feasible[order]]
    order = order[nondominated(merged.objectives[order])]
    columns = (field.name for field in fields(RobustValues))
    return ParetoFront(**{name: getattr(merged, name)[order] for name in columns})


def nondominated(objectives: RealArray) -> BoolArray:
    """Return which rows, shape (n, m), no other row dominates; of equal rows the first."""
    if len(objectives) == 0:
        return np.zeros(0, dtype=bool)
    return np.asarray(moocore.is_nondominated(objectives), dtype=bool)


def pareto_rank(objectives: RealArray) -> npt.NDArray[np.intp]:
    """Return how many fronts stand before each row's own, shape (n,), for objectives (n, m)."""
    if len(objectives) == 0:
        return np.zeros(0, dtype=np.intp)
    return np.asarray(moocore.pareto_rank(objectives), dtype=np.intp)


def hypervolume(objectives: RealArray, reference_point: npt.ArrayLike) -> float:
    """Return the volume that points dominate, up to a reference point.

    Parameters
    ----------
    objectives : array, shape (n, m)
        To be minimised, finite; points beyond the reference point add nothing.
    reference_point : array, shape (m,)
        State it beside every figure: hypervolumes of different reference points do not compare.

    Returns
    -------
    float
        Product of the objectives' units.

    Raises
    ------
    InputError
        A value that is not finite.
    """
    reference = np.asarray(reference_point, dtype=float)
    if not (np.all(np.isfinite(objectives)) and np.all(np.isfinite(reference))):
        raise InputError("a hypervolume needs finite objectives: leave failed designs out")
    if len(objectives) == 0:
        return 0.0
    return float(moocore.hypervolume(objectives, ref=reference))


@dataclass(frozen=True, eq=False)
class Verification:
    """A front evaluated again, with draws that the search never saw.

    Parameters
    ----------
    values : RobustValues
        Row by row the designs of the front.
    nondominated : array of bool, shape (n,)
        Rows that no other row beats under the new draws.
    n_samples, seed : int
        Of the new draws.
    mean_bias : float
        Mean over the front of search minus verified `mean_sum` [response unit]; negative means
        that the search was optimistic.
    sigma_bias_percent : float
        Mean over the front of (search - verified) / verified `sigma_sum` [%]; negative means that
        the search was optimistic.
    """

    values: RobustValues
    nondominated: BoolArray
    n_samples: int
    seed: int
    mean_bias: float
    sigma_bias_percent: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "nondominated", frozen_copy(self.nondominated))


def verification_response(
    robust: RobustResponse, n_samples: int = 1024, *, seed: int
) -> RobustResponse:
    """Return a robust response with draws that a search never saw.

    Parameters
    ----------
    robust : RobustResponse
        Of the search: model, space and the meaning of the mean are taken from it, its sample is
        not.
    n_samples : int
        Scrambled Sobol points, a power of two.
    seed : int
        From 1 upwards. The same seed as the search's gives independent draws all the same.

    Raises
    ------
    InputError
        See `sobol_sample`.
    """
    sample = sobol_sample(robust.n_draws, n_samples, seed=seed, purpose="verification sample")
    return replace(robust, sample=sample)


def verify(
    front: ParetoFront, robust: RobustResponse, n_samples: int = 1024, *, seed: int
) -> Verification:
    """Evaluate a front again with an independent scrambled Sobol sample.

    Parameters
    ----------
    front : ParetoFront
        Of the search.
    robust : RobustResponse
        Of the search.
    n_samples, seed : int
        See `verification_response`.

    Raises
    ------
    InputError
        See `sobol_sample`; an empty front; a front that fails altogether under the new draws.
    """
    values = verification_response(robust, n_samples, seed=seed)(front.designs)
    ok = np.flatnonzero(~values.failed)
    if ok.size == 0:
        raise InputError(
            f"none of the {len(front)} designs of the front could be computed with the "
            "verification sample: check the model near the bounds of the design space"
        )
    survivors = np.zeros(len(front), dtype=bool)
    survivors[ok[nondominated(values.objectives[ok])]] = True
    verified = values.sigma_sum[ok]
    excess = front.sigma_sum[ok] - verified
    scattered = verified > 0.0
    relative = np.divide(excess, verified, out=np.zeros_like(excess), where=scattered)
    return Verification(
        values=values,
        nondominated=survivors,
        n_samples=n_samples,
        seed=seed,
        mean_bias=float(np.mean(front.mean_sum[ok] - values.mean_sum[ok])),
        sigma_bias_percent=float(100.0 * np.mean(relative)),
    )
