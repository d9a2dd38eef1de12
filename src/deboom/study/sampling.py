"""The tolerance draws that a study may ask for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from enum import Enum

import numpy as np

from deboom.explore.design_space import DesignSpace, stiffness_factor_space
from deboom.explore.tolerance_samples import (
    FreshGaussianSampler,
    ToleranceSampler,
    gaussian_sample,
    sobol_sample,
)
from deboom.vehicles.kernel_split_numpy import SUFFIX


class Sampler(Enum):
    """How manufacturing scatter is drawn."""

    sobol = "sobol"
    """Scrambled Sobol points, shared by all designs."""
    gaussian = "gaussian"
    """Gaussian draws, shared by all designs."""
    fresh = "fresh"
    """Gaussian draws of its own for every design: the literal thesis."""


_MAKERS: dict[Sampler, Callable[..., ToleranceSampler]] = {
    Sampler.sobol: sobol_sample,
    Sampler.gaussian: gaussian_sample,
    Sampler.fresh: FreshGaussianSampler,
}


def factor_space(names: Sequence[str], half_width: float, tolerance: float) -> DesignSpace:
    """Return the space of a study's factors: stiffnesses that scatter, loss factors that do not.

    Parameters
    ----------
    names : sequence of str
        Variables of the booming index; those of loss factors end in ``loss``.
    half_width, tolerance : float
        As for `deboom.explore.design_space.stiffness_factor_space` [1].

    Raises
    ------
    InputError
        See there.
    """
    space = stiffness_factor_space(names, half_width, tolerance)
    made = [0.0 if name.endswith(SUFFIX) else tolerance for name in names]
    return replace(space, tolerance=np.array(made))


def tolerance_sample(
    sampler: Sampler, n_variables: int, n_samples: int, *, seed: int
) -> ToleranceSampler:
    """Draw the manufacturing scatter of a study.

    Parameters
    ----------
    sampler : Sampler
        How.
    n_variables, n_samples : int
        Columns, and draws per design.
    seed : int
        From 1 upwards.

    Raises
    ------
    InputError
        Seed 0, or a number of draws that the sampler refuses.
    """
    return _MAKERS[sampler](n_variables, n_samples, seed=seed)
