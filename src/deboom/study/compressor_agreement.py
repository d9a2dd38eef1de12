"""How well the model of a compressor's mounts predicts designs that nobody has measured."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import RealArray
from deboom.explore.design_space import DesignSpace
from deboom.explore.seeds import generator
from deboom.study.compressor_fleet import FleetTruth, bar_of
from deboom.study.compressor_mounts import Hoses, MountedFleet


@dataclass(frozen=True, eq=False)
class Agreement:
    """Predicted and exact levels of designs within the bounds, in the first case.

    Parameters
    ----------
    designs : array, shape (n, k)
        The first one is today's.
    predicted, exact : array, shape (n, v, f)
        [dB(A)]
    """

    designs: RealArray
    predicted: RealArray
    exact: RealArray

    @property
    def peak_errors(self) -> RealArray:
        """Predicted minus exact level at the local maxima of the exact curves [dB]."""
        middle = self.exact[..., 1:-1]
        peaks = (middle > self.exact[..., :-2]) & (middle >= self.exact[..., 2:])
        return np.asarray((self.predicted - self.exact)[..., 1:-1][peaks])

    @property
    def changes(self) -> tuple[RealArray, RealArray]:
        """Change of the mean level against today, predicted and exact, each (n - 1, v) [dB]."""
        predicted, exact = (
            np.asarray((levels[1:] - levels[:1]).mean(axis=-1))
            for levels in (self.predicted, self.exact)
        )
        return predicted, exact


def agreement(model: MountedFleet, space: DesignSpace, n: int, *, seed: int) -> Agreement | None:
    """Compare with the bench's exact coupled solution.

    Parameters
    ----------
    model : MountedFleet
    space : DesignSpace
        Designs are drawn uniformly within its bounds; mounts stand where they are drawn.
    n : int
        Designs beside today's.
    seed : int
        From 1.

    Returns
    -------
    Agreement or None
        None for cars that were measured: their truth is not known.
    """
    if model.fleet.truth is None:
        return None
    drawn = generator(seed, "agreement").uniform(space.lower, space.upper, (n, space.n_variables))
    designs = np.vstack([space.nominal, drawn])
    exact = _exact(model, model.fleet.truth, designs, model.index.case_names[0])
    return Agreement(designs, model.index.levels(designs), exact)


def exact_change(model: MountedFleet, today: RealArray, design: RealArray) -> RealArray | None:
    """Return what a design truly changes: mean level of the lines, all cases.

    Parameters
    ----------
    model : MountedFleet
    today, design : array, shape (k,)
        Mounts stand where they are drawn.

    Returns
    -------
    array, shape (v,), or None
        [dB]; None for cars that were measured.
    """
    if model.fleet.truth is None:
        return None
    total = np.zeros(len(model.index.response_names))
    for case, weight in zip(model.index.case_names, model.index.weights, strict=True):
        before, after = _exact(model, model.fleet.truth, np.stack([today, design]), case)
        total += weight * (after - before).mean(axis=-1)
    return total


def _exact(model: MountedFleet, truth: FleetTruth, designs: RealArray, case: str) -> RealArray:
    """Levels of the bench's coupled cars, shape (n, v, f) [dB(A)]."""
    return truth.levels(
        model.index.variables.factors(designs),
        model.index.frequency,
        bar_of(case),
        with_hoses=model.question.hoses is Hoses.identified,
    )
