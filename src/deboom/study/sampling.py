"""The tolerance draws that a study may ask for."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum

from deboom.explore.tolerance_samples import (
    FreshGaussianSampler,
    ToleranceSampler,
    gaussian_sample,
    sobol_sample,
)


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
