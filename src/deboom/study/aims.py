"""What a study's search minimises, and how it reads mean and sigma from its draws."""

from __future__ import annotations

from enum import Enum

from deboom.explore.design_space import DesignSpace
from deboom.explore.evaluate import Evaluate
from deboom.explore.moments import SAMPLE_MOMENTS, ControlVariate
from deboom.explore.objectives import (
    MEAN_SUM,
    SIGMA_SUM,
    Mean,
    Objective,
    Quantile,
    Sigma,
    TailMean,
    Total,
    Worst,
)
from deboom.explore.robust import RobustResponse
from deboom.explore.tolerance_samples import ToleranceSampler
from deboom.explore.tolerance_structure import ToleranceStructure

TAIL = 0.95
"""Share of all parts below the quantile, and above which the worst parts are [1]."""


class Aim(Enum):
    """First and second objective of a search."""

    mean = "mean"
    """Sums over the vehicles of mean and sigma: the thesis."""
    quantile = "quantile"
    """Sum of the levels that 95 % of all parts stay below, and of sigma."""
    tail = "tail"
    """Sum of the means of the worst 5 % of all parts, and of sigma."""
    worst = "worst"
    """Mean of the loudest vehicle, and largest sigma of a vehicle."""


_OBJECTIVES: dict[Aim, tuple[Objective, Objective]] = {
    Aim.mean: (MEAN_SUM, SIGMA_SUM),
    Aim.quantile: (Total(Quantile(TAIL)), SIGMA_SUM),
    Aim.tail: (Total(TailMean(TAIL)), SIGMA_SUM),
    Aim.worst: (Worst(Mean()), Worst(Sigma())),
}


def robust_response(
    evaluate: Evaluate,
    space: DesignSpace,
    sample: ToleranceSampler,
    aim: Aim = Aim.mean,
    nominal_mean: bool = False,
    control_variate: bool = False,
    structure: ToleranceStructure | None = None,
) -> RobustResponse:
    """Wrap a model with scatter as a study's options ask for.

    Parameters
    ----------
    evaluate, space, sample, nominal_mean
        See `deboom.explore.robust.RobustResponse`.
    aim : Aim
        What the search minimises.
    control_variate : bool
        Read mean and sigma with a parabola of the draws as control variate.
    structure : ToleranceStructure, optional
        What the scatter of the variables has in common.

    Raises
    ------
    InputError
        As `deboom.explore.robust.RobustResponse`.
    """
    estimator = ControlVariate(2) if control_variate else SAMPLE_MOMENTS
    return RobustResponse(
        evaluate, space, sample, nominal_mean, estimator, _OBJECTIVES[aim], structure
    )


def aim_note(robust: RobustResponse) -> str:
    """Say what a report must say about objectives that are not the two sums; empty otherwise."""
    if robust.objectives == (MEAN_SUM, SIGMA_SUM):
        return ""
    first, second = (objective.name for objective in robust.objectives)
    return (
        f"The search minimised {first}, and {second}; picks are those of these objectives. Tables "
        "and figures show mean and sigma, in which the front is not a front."
    )
