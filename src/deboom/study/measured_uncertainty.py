"""How surely levels, changes and rankings are known, by drawing the measurements again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.robust import RobustResponse
from deboom.measurement.propagated_interval import (
    LEAST_DRAWS,
    Interval,
    pivotal_interval,
    probability_below,
)
from deboom.study.progress import Progress
from deboom.study.uncertain_index import UncertainIndex

TODAY = "today's"


@dataclass(frozen=True, eq=False)
class Drawn:
    """What one index says of the designs; levels are means over the lines.

    Parameters
    ----------
    level : array, shape (..., n_design, n_vehicle)
        Without scatter [dB(A)].
    loudest : array, shape (..., n_design, n_vehicle)
        Loudest line of the first load case [dB(A)].
    mean, sigma : array, shape (..., n_design + n_front, n_vehicle)
        Over the scatter of parts, of the designs and of the front [dB(A)], [dB].
    share : array, shape (..., n_vehicle, n_variable)
        Of each direction in the variance by its tolerance, to first order, at today's design [1].
    """

    level: RealArray
    loudest: RealArray
    mean: RealArray
    sigma: RealArray
    share: RealArray


@dataclass(frozen=True, eq=False)
class MeasuredUncertainty:
    """Designs of a front, and what measuring again does to them.

    Parameters
    ----------
    uncertain : UncertainIndex
        Of the study.
    robust : RobustResponse
        How parts scatter; its model is the index of `uncertain`.
    designs : mapping of str to array, shape (k,)
        Named designs, `TODAY` first [1].
    front : array, shape (n, k)
        Designs of the front [1].
    cases : index
        Of the same data over every load case of the platform, to see how load cases differ.
    n_draws : int
        Measurements that are drawn, at least 40.
    seed : int
        From 1.

    Raises
    ------
    InputError
        No design besides today's; fewer draws than `LEAST_DRAWS`.
    """

    uncertain: UncertainIndex
    robust: RobustResponse
    designs: Mapping[str, RealArray]
    front: RealArray
    cases: Any
    n_draws: int
    seed: int

    def __post_init__(self) -> None:
        if list(self.designs)[:1] != [TODAY] or len(self.designs) < 2:
            raise InputError("name today's design first, then at least one other")
        if self.n_draws < LEAST_DRAWS:
            raise InputError(
                f"{self.n_draws} draws do not give an interval: take at least {LEAST_DRAWS}"
            )

    @property
    def index(self) -> Any:
        """The study's index, from the data as measured."""
        return self.uncertain.index

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the designs."""
        return tuple(self.designs)

    @property
    def vehicles(self) -> tuple[str, ...]:
        """Names of the vehicles."""
        return tuple(self.index.response_names)

    @cached_property
    def rows(self) -> RealArray:
        """The designs, shape (n_design, k) [1]."""
        return np.stack(list(self.designs.values()))

    @cached_property
    def measured(self) -> Drawn:
        """From the data as measured."""
        return self._drawn(self.index)

    def measure_again(self, progress: Progress) -> MeasuredAgain:
        """Draw all measurements, and those of each source alone.

        Parameters
        ----------
        progress : callable
            ``progress(done, total, text)``.
        """
        names = self.uncertain.data.names
        total = (1 + len(names)) * self.n_draws
        every, alone = [], {}
        for done, index in enumerate(self.uncertain.draws(self.n_draws, self.seed)):
            progress(done, total, "all errors")
            every.append(self._drawn(index))
        for place, name in enumerate(names, 1):
            levels = []
            for done, index in enumerate(self.uncertain.draws(self.n_draws, self.seed, [name])):
                progress(place * self.n_draws + done, total, name)
                levels.append(index(self.rows) / self.index.n_lines)
            alone[name] = np.stack(levels)
        progress(total, total, "done")
        fields = {name: np.stack([getattr(one, name) for one in every]) for name in vars(every[0])}
        return MeasuredAgain(self, Drawn(**fields), alone)

    def _drawn(self, index: Any) -> Drawn:
        n_lines = index.n_lines
        scattered = replace(self.robust, evaluate=index)(np.concatenate([self.rows, self.front]))
        if scattered.failed.any():
            raise InputError("a design could not be computed from data that were measured again")
        space = self.robust.space
        slope = index.gradient(self.rows[:1])[0] * self.rows[0] * space.relative_sigma
        squared = slope**2
        return Drawn(
            level=index(self.rows) / n_lines,
            loudest=index.levels(self.rows).max(axis=2),
            mean=scattered.mean / n_lines,
            sigma=scattered.sigma / n_lines,
            share=squared / squared.sum(axis=1, keepdims=True),
        )


@dataclass(frozen=True, eq=False)
class MeasuredAgain:
    """Intervals, probabilities and shares of variance.

    Parameters
    ----------
    study : MeasuredUncertainty
        Of what.
    again : Drawn
        With a leading axis of draws.
    alone : mapping of str to array, shape (n_draws, n_design, n_vehicle)
        Source → mean level if nothing else errs [dB(A)].
    """

    study: MeasuredUncertainty
    again: Drawn
    alone: Mapping[str, RealArray]

    @property
    def measured(self) -> Drawn:
        """From the data as measured."""
        return self.study.measured

    @cached_property
    def level(self) -> Interval:
        """Mean level of each design and vehicle, shape (n_design, n_vehicle) [dB(A)]."""
        return pivotal_interval(self.measured.level, self.again.level)

    @cached_property
    def loudest(self) -> Interval:
        """Loudest line, shape (n_design, n_vehicle) [dB(A)]."""
        return pivotal_interval(self.measured.loudest, self.again.loudest)

    @cached_property
    def change(self) -> Interval:
        """Change of the mean level against today's, shape (n_design, n_vehicle) [dB]."""
        return pivotal_interval(_change(self.measured.level), _change(self.again.level))

    @cached_property
    def change_of_loudest(self) -> Interval:
        """Change of the loudest line, shape (n_design, n_vehicle) [dB]."""
        return pivotal_interval(_change(self.measured.loudest), _change(self.again.loudest))

    @cached_property
    def mean_level(self) -> Interval:
        """Mean over the vehicles, shape (n_design,) [dB(A)]."""
        return pivotal_interval(self.measured.level.mean(-1), self.again.level.mean(-1))

    @cached_property
    def mean_change(self) -> Interval:
        """Its change against today's, shape (n_design,) [dB]."""
        return pivotal_interval(
            _change(self.measured.level).mean(-1), _change(self.again.level).mean(-1)
        )

    @cached_property
    def sigma(self) -> Interval:
        """Scatter by tolerance, mean over the vehicles, shape (n_design,) [dB]."""
        n = len(self.study.designs)
        return pivotal_interval(self.measured.sigma[:n].mean(-1), self.again.sigma[:, :n].mean(-1))

    @cached_property
    def front_change(self) -> Interval:
        """First objective of the front against today's, shape (n_front,) [dB]."""
        return pivotal_interval(self._front(self.measured.mean), self._front(self.again.mean))

    @cached_property
    def front_level(self) -> Interval:
        """First objective of the front, shape (n_front,) [dB(A)]."""
        n = len(self.study.designs)
        return pivotal_interval(self.measured.mean[n:].mean(-1), self.again.mean[:, n:].mean(-1))

    @cached_property
    def front_sigma(self) -> Interval:
        """Second objective of the front, shape (n_front,) [dB]."""
        n = len(self.study.designs)
        return pivotal_interval(self.measured.sigma[n:].mean(-1), self.again.sigma[:, n:].mean(-1))

    @cached_property
    def front_kept(self) -> RealArray:
        """Share of draws in which a point of the front is not dominated, (n_front,) [1]."""
        n = len(self.study.designs)
        objectives = np.stack(
            [self.again.mean[:, n:].mean(-1), self.again.sigma[:, n:].mean(-1)], axis=-1
        )
        return np.asarray(np.mean([_nondominated(values) for values in objectives], axis=0))

    @cached_property
    def quieter(self) -> RealArray:
        """Probability that design A is quieter than B, mean of the vehicles, (A, B) [1]."""
        mean, again = self.measured.level.mean(-1), self.again.level.mean(-1)
        return probability_below(
            mean[:, np.newaxis] - mean, again[:, :, np.newaxis] - again[:, np.newaxis]
        )

    @cached_property
    def leads(self) -> RealArray:
        """Share of draws in which a direction scatters a vehicle most, (n_vehicle, k) [1]."""
        first = self.again.share.argmax(axis=2)
        columns = np.arange(self.again.share.shape[2])
        return np.asarray((first[..., np.newaxis] == columns).mean(axis=0))

    @cached_property
    def rank_kept(self) -> RealArray:
        """Share of draws in which a direction keeps its place as measured, (n_vehicle, k) [1]."""
        return np.asarray((_ranks(self.again.share) == _ranks(self.measured.share)).mean(axis=0))

    def variances(self, design: str | None) -> dict[str, RealArray]:
        """Variance of the level, or of a design's change, by each source alone, (n_vehicle + 1,).

        Parameters
        ----------
        design : str or None
            Whose change against today's; None: level of today's.

        Returns
        -------
        dict of str to array
            Of every vehicle, and last of their mean [dB²].
        """
        found = {}
        for name, levels in self.alone.items():
            values = levels[:, 0]
            if design is not None:
                values = _change(levels)[:, self.study.names.index(design)]
            both = np.concatenate([values, values.mean(axis=1, keepdims=True)], axis=1)
            found[name] = both.var(axis=0, ddof=1)
        return found

    def _front(self, mean: RealArray) -> RealArray:
        n, of_vehicles = len(self.study.designs), mean.mean(axis=-1)
        return np.asarray(of_vehicles[..., n:] - of_vehicles[..., :1])


def _change(level: RealArray) -> RealArray:
    """Against today's, the first design, shape (..., n_design, n_vehicle)."""
    return np.asarray(level - level[..., :1, :])


def _ranks(share: RealArray) -> RealArray:
    return np.asarray((-share).argsort(axis=-1, kind="stable").argsort(axis=-1))


def _nondominated(values: RealArray) -> npt.NDArray[np.bool_]:
    """Say which rows (n, 2) no other row beats in both columns."""
    difference = values[:, np.newaxis] - values
    beaten = np.all(difference >= 0.0, axis=2) & np.any(difference > 0.0, axis=2)
    return np.asarray(~beaten.any(axis=1))
