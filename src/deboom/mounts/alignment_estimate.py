"""What is known of a measuring chain: by its stated tolerances, or better by its own data."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import RealArray
from deboom.mounts.alignment import Alignment
from deboom.mounts.named_arrays import freeze


@dataclass(frozen=True, eq=False)
class AlignmentEstimate:
    """A normal distribution of the parameters of a measuring chain.

    Parameters
    ----------
    alignment : Alignment
        Whose n parameters.
    mean : array, shape (n,)
        Best values.
    covariance : array, shape (n, n)
        About them.
    misfit : tuple of (str, float)
        Reduced χ² of each group of equations that they follow from; empty for stated tolerances.
    """

    alignment: Alignment
    mean: RealArray
    covariance: RealArray
    misfit: tuple[tuple[str, float], ...] = ()

    def __post_init__(self) -> None:
        freeze(self, "mean", "covariance")

    @property
    def motion_matrix(self) -> RealArray:
        """Channels → motion of the points, with the best values, (3 n_point, n_channel)."""
        return self.alignment.motion_matrix(self.mean)

    @property
    def force_matrix(self) -> RealArray:
        """Cell channels → force at the points, with the best values."""
        return self.alignment.force_matrix(self.mean)

    def draw(self, n_draws: int, generator: np.random.Generator) -> RealArray:
        """Draw parameters, shape (n_draws, n)."""
        values, vectors = np.linalg.eigh(self.covariance)
        factor = vectors * np.sqrt(np.maximum(values, 0.0))
        normals = generator.standard_normal((n_draws, self.mean.size))
        return np.asarray(self.mean + normals @ factor.T)


def stated_alignment(alignment: Alignment) -> AlignmentEstimate:
    """Take a chain as its position sheet states it, within the tolerances."""
    return AlignmentEstimate(
        alignment=alignment,
        mean=np.zeros_like(alignment.tolerance),
        covariance=np.diag(alignment.tolerance**2),
    )
