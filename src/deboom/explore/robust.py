"""Mean and standard deviation of every response over the manufacturing scatter."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Protocol

import numpy as np

from deboom.arrays import BoolArray, RealArray, frozen_copy
from deboom.errors import InputError
from deboom.explore.design_space import DesignSpace
from deboom.explore.evaluate import Evaluate, responses
from deboom.explore.moments import SAMPLE_MOMENTS, Estimator, Moments
from deboom.explore.objectives import MEAN_SUM, SIGMA_SUM, Objective
from deboom.explore.tolerance_samples import ToleranceSample, ToleranceSampler
from deboom.explore.tolerance_structure import ToleranceStructure


@dataclass(frozen=True, eq=False)
class RobustValues:
    """Designs and what their scatter does to the responses, one row per design.

    All but `designs` and `failed` are in the unit of the responses; the rows of failed designs
    hold NaN there.

    Parameters
    ----------
    designs : array, shape (n, k)
        As made without scatter.
    mean, sigma : array, shape (n, r)
        Mean (or the nominal design's response) and standard deviation of each response.
    mean_sum, sigma_sum : array, shape (n,)
        Their sums over the responses: the two objectives.
    standard_error_mean_sum, standard_error_sigma_sum : array, shape (n,)
        Of the two sums, for independent draws; an upper bound for Sobol points.
    failed : array of bool, shape (n,)
        Designs with a response that could not be computed somewhere in the scatter.
    objectives : array, shape (n, m), optional
        What a search minimises; default are the two sums, ``[mean_sum, sigma_sum]``.
    excess : array, shape (n, c), optional
        How far each of c limits is missed, negative where room is left [unit of the limit]; see
        `deboom.explore.limits`. Default is no limit.
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

    def __post_init__(self) -> None:
        if self.excess.shape[1] == 0:
            object.__setattr__(self, "excess", np.empty((len(self.designs), 0)))
        if self.objectives.shape[1] == 0:
            both = np.column_stack([self.mean_sum, self.sigma_sum])
            object.__setattr__(self, "objectives", both)
        for column in fields(self):
            array = np.asarray(getattr(self, column.name))
            object.__setattr__(self, column.name, frozen_copy(array))

    def __len__(self) -> int:
        return len(self.designs)

    @property
    def feasible(self) -> BoolArray:
        """Designs that could be computed and keep all limits, shape (n,)."""
        return np.asarray(~self.failed & np.all(self.excess <= 0.0, axis=1))


def joined(parts: Sequence[RobustValues]) -> RobustValues:
    """Put the rows of several values below each other; at least one."""
    return RobustValues(
        **{
            column.name: np.concatenate([getattr(part, column.name) for part in parts])
            for column in fields(RobustValues)
        }
    )


class Robust(Protocol):
    """What a search drives: designs of a space in, `RobustValues` out.

    It may say how many objectives these have, in an attribute ``n_objectives``; without it there
    are two. A response with limits names them in an attribute ``limits``.
    """

    @property
    def space(self) -> DesignSpace:
        """The designs that may be asked for."""

    def __call__(self, designs: RealArray) -> RobustValues:
        """Return the values of the designs, shape (n, k)."""


@dataclass(frozen=True, eq=False)
class RobustResponse:
    """An evaluation wrapped with manufacturing scatter.

    Parameters
    ----------
    evaluate : Evaluate
        The model; it is called once per design, with all draws of that design.
    space : DesignSpace
        Its variables, in the model's order, with their tolerances.
    sample : ToleranceSampler
        The draws ``z``.
    nominal_mean : bool
        Take the response of the design itself for its mean, instead of the mean over the sample.
    estimator : Estimator
        How mean and standard deviation are read from the draws.
    objectives : tuple of Objective
        What a search minimises, at least two.
    structure : ToleranceStructure, optional
        What the variables' scatter has in common; default is independent scatter. The sample then
        has one column per draw of the structure.

    Raises
    ------
    InputError
        Variables of the model, the space, the structure and the sample that differ; a structure
        that would let a variable change its sign; fewer than two objectives.

    Notes
    -----
    A made design is ``x (1 + σ_rel z)``, with σ_rel a third of the tolerance. The standard errors
    take the draws for independent: scrambled Sobol points do better, so for them the figures are
    upper bounds.
    """

    evaluate: Evaluate
    space: DesignSpace
    sample: ToleranceSampler
    nominal_mean: bool = False
    estimator: Estimator = SAMPLE_MOMENTS
    objectives: tuple[Objective, ...] = (MEAN_SUM, SIGMA_SUM)
    structure: ToleranceStructure | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "objectives", tuple(self.objectives))
        if len(self.objectives) < 2:
            raise InputError("a search for a front needs at least two objectives")
        if self.evaluate.variable_names != self.space.names:
            raise InputError(
                f"the model has the variables {list(self.evaluate.variable_names)}, the design "
                f"space {list(self.space.names)}: give both the same names in the same order"
            )
        if self.structure is not None:
            self._check_structure(self.structure)
        elif self.sample.n_variables != self.space.n_variables:
            raise InputError(
                f"the tolerance sample has {self.sample.n_variables} columns for "
                f"{self.space.n_variables} design variables: draw one column per variable"
            )

    def _check_structure(self, structure: ToleranceStructure) -> None:
        if structure.names != self.space.names:
            raise InputError(
                f"the tolerance structure has the variables {list(structure.names)}, the design "
                f"space {list(self.space.names)}: give both the same names in the same order"
            )
        if self.sample.n_variables != structure.n_draws:
            raise InputError(
                f"the tolerance sample has {self.sample.n_variables} columns for a structure of "
                f"{structure.n_draws} draws: draw one column for each"
            )
        reach = self.space.tolerance * structure.largest
        for name, value in zip(self.space.names, reach, strict=True):
            if value >= 1.0:
                raise InputError(
                    f"the scatter of '{name}' could change its sign: its tolerance, with all draws "
                    f"of the structure at their limit, is {value:g}; it must stay below 1"
                )

    @property
    def n_objectives(self) -> int:
        """Number m of objectives."""
        return len(self.objectives)

    def __call__(self, designs: RealArray) -> RobustValues:
        """Return the values of the designs, shape (n, k).

        Raises
        ------
        InputError
            Designs of another shape or not finite; a model that breaks its promised shape.
        """
        designs = self.space.checked(designs)
        n_responses = len(self.evaluate.response_names)
        rows = np.empty((len(designs), 2 * n_responses + 2 + self.n_objectives))
        for row, design in zip(rows, designs, strict=True):
            row[:] = self._one_design(design)
        mean, sigma, errors, objectives = np.hsplit(
            rows, [n_responses, 2 * n_responses, 2 * n_responses + 2]
        )
        return RobustValues(
            designs=designs,
            mean=mean,
            sigma=sigma,
            mean_sum=mean.sum(axis=1),
            sigma_sum=sigma.sum(axis=1),
            standard_error_mean_sum=errors[:, 0],
            standard_error_sigma_sum=errors[:, 1],
            failed=np.isnan(errors[:, 0]),
            objectives=objectives,
        )

    @property
    def n_draws(self) -> int:
        """Number of independent draws that make one part: columns of its sample."""
        return self.space.n_variables if self.structure is None else self.structure.n_draws

    def made(self, design: RealArray) -> RealArray:
        """Return one design (k,) as it is made, draw by draw, shape (n_samples, k)."""
        return self._made(design, self.sample.normals(design))

    def _made(self, design: RealArray, normals: RealArray) -> RealArray:
        scatter = normals if self.structure is None else self.structure.scatter(normals)
        return design * (1.0 + self.space.relative_sigma * scatter)

    @cached_property
    def _shared_moments(self) -> Callable[[RealArray], Moments] | None:
        """The estimator, prepared once for draws that all designs share."""
        return (
            self.estimator(self.sample.values) if isinstance(self.sample, ToleranceSample) else None
        )

    def _one_design(self, design: RealArray) -> RealArray:
        """Return moments, their standard errors and the objectives; all NaN if it failed."""
        normals = self.sample.normals(design)
        size = 2 * len(self.evaluate.response_names) + 2 + self.n_objectives
        failed = np.full(size, np.nan)
        try:
            values = responses(self.evaluate, self._made(design, normals))
            if not np.all(np.isfinite(values)):
                return failed
            moments = self._shared_moments or self.estimator(normals)
            mean, sigma, mean_error, sigma_error = moments(values)
            if self.nominal_mean:
                mean, mean_error = responses(self.evaluate, design[None, :])[0], 0.0
            objectives = [objective(values, mean, sigma) for objective in self.objectives]
        except (ArithmeticError, np.linalg.LinAlgError):
            return failed
        statistics = np.concatenate([mean, sigma, [mean_error, sigma_error], objectives])
        return statistics if np.all(np.isfinite(statistics)) else failed
