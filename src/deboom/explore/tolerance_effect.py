"""What the tolerances of one design do to its responses, with exact derivatives."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.special import ndtr

from deboom.arrays import RealArray, frozen_copy
from deboom.errors import InputError
from deboom.explore.design_space import SIGMAS_PER_TOLERANCE
from deboom.explore.evaluate import responses
from deboom.explore.moments import moment_weights
from deboom.explore.robust import RobustResponse
from deboom.explore.tolerance_samples import ToleranceSample

SOFTNESS = 0.2
"""Width of the step with which parts within a limit are counted, in standard deviations [1]."""


@dataclass(frozen=True, eq=False)
class Scattered:
    """Responses of one design over its scatter, and their derivatives by the tolerances.

    Parameters
    ----------
    tolerance : array, shape (k,)
        Half widths [1].
    values : array, shape (n_samples, r)
        Responses, draw by draw.
    by_tolerance : array, shape (n_samples, r, k)
        Their derivatives [response unit per unit tolerance].
    sigma : array, shape (r,)
        Standard deviations.
    sigma_by_tolerance : array, shape (r, k)
        Their derivatives [response unit per unit tolerance].
    """

    tolerance: RealArray
    values: RealArray
    by_tolerance: RealArray
    sigma: RealArray
    sigma_by_tolerance: RealArray

    def share(self, limit: RealArray) -> RealArray:
        """Return the share of parts within the limits, shape (r,) → (r,) [1]."""
        return np.asarray((self.values <= limit).mean(axis=0))

    def soft_share(
        self, limit: RealArray, softness: float = SOFTNESS
    ) -> tuple[RealArray, RealArray]:
        """Return a share that can be differentiated, shape (r,), with its derivatives (r, k).

        Parameters
        ----------
        limit : array, shape (r,)
            Of each response [response unit].
        softness : float
            Width of the step, in standard deviations of the response [1].

        Notes
        -----
        ``mean Φ((limit − y) / w)`` with ``w`` the softness times the standard deviation: the share
        of responses with a further normal scatter ``w``. Of more than half it is slightly less
        than the share itself.
        """
        scatters = self.sigma > 0.0
        width = np.where(scatters, softness * self.sigma, 1.0)
        place = (limit - self.values) / width
        soft = np.where(scatters, ndtr(place), self.values <= limit)
        density = np.where(scatters, np.exp(-0.5 * place**2) / np.sqrt(2.0 * np.pi), 0.0) / width
        by_width = place * density * np.where(scatters, softness, 0.0)
        count = len(self.values)
        slope = -np.einsum("tr,trk->rk", density, self.by_tolerance)
        slope -= by_width.sum(axis=0)[:, None] * self.sigma_by_tolerance
        return np.asarray(soft.mean(axis=0)), np.asarray(slope / count)


@dataclass(frozen=True, eq=False)
class ToleranceEffect:
    """One design whose tolerances can be chosen.

    Parameters
    ----------
    robust : RobustResponse
        Model with a gradient, draws that all tolerances share, and perhaps a structure.
    design : array, shape (k,)
        [units of the space]

    Raises
    ------
    InputError
        A model without gradient, draws that are not shared, or whole-number variables.
    """

    robust: RobustResponse
    design: RealArray

    def __post_init__(self) -> None:
        design = self.robust.space.checked(np.atleast_2d(self.design))[0]
        object.__setattr__(self, "design", frozen_copy(design))
        model = self.robust.evaluate
        if not hasattr(model, "gradient"):
            raise InputError(
                f"{type(model).__name__} offers no gradient: tolerances can be chosen only with one"
            )
        if not isinstance(self.robust.sample, ToleranceSample):
            raise InputError("tolerances are chosen with draws that they share: take sobol_sample")
        if self.robust.space.integer.any():
            raise InputError("whole-number variables have no tolerance that could be chosen")

    @property
    def names(self) -> tuple[str, ...]:
        """Of the variables."""
        return self.robust.space.names

    @property
    def response_names(self) -> tuple[str, ...]:
        """Of the responses."""
        return self.robust.evaluate.response_names

    @property
    def today(self) -> RealArray:
        """Tolerances of the space, shape (k,) [1]."""
        return self.robust.space.tolerance

    def with_draws(self, robust: RobustResponse) -> ToleranceEffect:
        """Return the same design with the draws of another response of the same model."""
        return replace(self, robust=replace(self.robust, sample=robust.sample))

    def values(self, tolerance: RealArray) -> RealArray:
        """Return the responses, shape (n_samples, r), at tolerances (k,)."""
        return self._values(self._response(tolerance))[1]

    def at(self, tolerance: RealArray) -> Scattered:
        """Return the responses with their derivatives at tolerances, shape (k,).

        Raises
        ------
        InputError
            A design that fails, tolerances outside 0 to 1 or so wide that a structure's scatter
            could change a sign.

        Notes
        -----
        A made design is ``x (1 + t/3 s)`` with the scatter ``s`` of the draws, so that ``∂y/∂t =
        ∂y/∂x · x s / 3``; the standard deviation's derivatives follow by the chain rule through
        its estimator and are exact for these draws.
        """
        robust = self._response(tolerance)
        made, values = self._values(robust)
        normals = robust.sample.normals(self.design)
        scatter = normals if robust.structure is None else robust.structure.scatter(normals)
        model: Any = robust.evaluate
        by_tolerance = (
            model.gradient(made) * (self.design * scatter / SIGMAS_PER_TOLERANCE)[:, None]
        )
        moments = robust.estimator(normals)
        sigma = moments(values)[1]
        weights = moment_weights(moments, values, sigma)[1]
        slope = np.einsum("tr,trk->rk", weights, by_tolerance)
        return Scattered(np.asarray(tolerance), values, by_tolerance, sigma, slope)

    def _response(self, tolerance: RealArray) -> RobustResponse:
        space = replace(self.robust.space, tolerance=np.asarray(tolerance, dtype=float))
        return replace(self.robust, space=space)

    def _values(self, robust: RobustResponse) -> tuple[RealArray, RealArray]:
        made = robust.made(self.design)
        values = responses(robust.evaluate, made)
        if not np.all(np.isfinite(values)):
            raise InputError(
                "the design fails somewhere in its scatter: choose another one, or tighter bounds"
            )
        return made, values
