"""Mean and standard deviation of every response over the manufacturing scatter."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Protocol

import numpy as np

from deboom.errors import InputError
from deboom.explore.arrays import BoolArray, RealArray, frozen_copy
from deboom.explore.design_space import DesignSpace
from deboom.explore.evaluate import Evaluate, responses
from deboom.explore.tolerance_samples import ToleranceSampler


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
    """

    designs: RealArray
    mean: RealArray
    sigma: RealArray
    mean_sum: RealArray
    sigma_sum: RealArray
    standard_error_mean_sum: RealArray
    standard_error_sigma_sum: RealArray
    failed: BoolArray

    def __post_init__(self) -> None:
        for field in fields(self):
            object.__setattr__(self, field.name, frozen_copy(np.asarray(getattr(self, field.name))))

    def __len__(self) -> int:
        return len(self.designs)

    @property
    def objectives(self) -> RealArray:
        """Both sums, shape (n, 2): what a search minimises."""
        return np.column_stack([self.mean_sum, self.sigma_sum])


class Robust(Protocol):
    """What a search drives: designs of a space in, `RobustValues` out."""

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

    Raises
    ------
    InputError
        Variables of the model, the space and the sample that differ.

    Notes
    -----
    A made design is ``x (1 + σ_rel z)``, with σ_rel a third of the tolerance. Standard deviations
    divide by ``n - 1``. The standard errors come from the scatter, over the draws ``t``, of the
    influence of one draw on the sum over the responses ``r``: ``Σ_r y_tr`` for the mean and
    ``Σ_r ((y_tr - mean_r)² - σ_r²) / (2 σ_r)`` for the standard deviation. Summing before taking
    the scatter keeps the correlation between responses. The draws count as independent: scrambled
    Sobol points do better, so for them the figures are upper bounds.
    """

    evaluate: Evaluate
    space: DesignSpace
    sample: ToleranceSampler
    nominal_mean: bool = False

    def __post_init__(self) -> None:
        if self.evaluate.variable_names != self.space.names:
            raise InputError(
                f"the model has the variables {list(self.evaluate.variable_names)}, the design "
                f"space {list(self.space.names)}: give both the same names in the same order"
            )
        if self.sample.n_variables != self.space.n_variables:
            raise InputError(
                f"the tolerance sample has {self.sample.n_variables} columns for "
                f"{self.space.n_variables} design variables: draw one column per variable"
            )

    def __call__(self, designs: RealArray) -> RobustValues:
        """Return the values of the designs, shape (n, k).

        Raises
        ------
        InputError
            Designs of another shape or not finite; a model that breaks its promised shape.
        """
        designs = self.space.checked(designs)
        n_responses = len(self.evaluate.response_names)
        rows = np.empty((len(designs), 2 * n_responses + 2))
        for row, design in zip(rows, designs, strict=True):
            row[:] = self._one_design(design)
        mean, sigma, errors = np.hsplit(rows, [n_responses, 2 * n_responses])
        return RobustValues(
            designs=designs,
            mean=mean,
            sigma=sigma,
            mean_sum=mean.sum(axis=1),
            sigma_sum=sigma.sum(axis=1),
            standard_error_mean_sum=errors[:, 0],
            standard_error_sigma_sum=errors[:, 1],
            failed=np.isnan(errors[:, 0]),
        )

    def made(self, design: RealArray) -> RealArray:
        """Return one design (k,) as it is made, draw by draw, shape (n_samples, k)."""
        return design * (1.0 + self.space.relative_sigma * self.sample.normals(design))

    def _one_design(self, design: RealArray) -> RealArray:
        """Return means, standard deviations and both standard errors; all NaN if it failed."""
        made = self.made(design)
        failed = np.full(2 * len(self.evaluate.response_names) + 2, np.nan)
        try:
            mean, sigma, mean_error, sigma_error = sample_statistics(responses(self.evaluate, made))
            if self.nominal_mean:
                mean, mean_error = responses(self.evaluate, design[None, :])[0], 0.0
        except (ArithmeticError, np.linalg.LinAlgError):
            return failed
        statistics = np.concatenate([mean, sigma, [mean_error, sigma_error]])
        return statistics if np.all(np.isfinite(statistics)) else failed


def sample_statistics(values: RealArray) -> tuple[RealArray, RealArray, float, float]:
    """Return mean, standard deviation and the standard errors of their sums.

    Parameters
    ----------
    values : array, shape (n_samples, r)
        Responses over the draws of one design.

    Returns
    -------
    mean, sigma : array, shape (r,)
        Of each response.
    mean_error, sigma_error : float
        Standard error of the sum of the means and of the sum of the standard deviations. All in
        the unit of the responses, and not finite where a value is not; see the notes of
        `RobustResponse`.
    """
    n_samples = len(values)
    with np.errstate(over="ignore", invalid="ignore"):
        # measured from the first draw, a response without scatter has a sigma of exactly zero
        offset = values - values[0]
        centre = offset.sum(axis=0) / n_samples
        deviation = offset - centre
        square = deviation * deviation
        sigma = np.sqrt(square.sum(axis=0) / (n_samples - 1))
        weight = np.divide(0.5, sigma, out=np.zeros(sigma.size), where=sigma > 0.0)
        # einsum, not @: the threads of a BLAS library may change the last bit
        mean_error = standard_error(deviation.sum(axis=1))
        sigma_error = standard_error(np.einsum("tr,r->t", square, weight))
    return values[0] + centre, sigma, mean_error, sigma_error


def standard_error(influence: RealArray) -> float:
    """Return the standard error of a mean from its terms, shape (n_samples,), ``n > 1``."""
    centred = influence - influence.sum() / influence.size
    spread = np.einsum("t,t->", centred, centred)
    return float(np.sqrt(spread / (influence.size * (influence.size - 1))))
