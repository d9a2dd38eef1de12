"""Do vehicles rise and fall together when mounts change, and when parts scatter?"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.correlation_study import (
    Correlations,
    Families,
    correlations,
    families,
    tolerance_scatter,
)
from deboom.explore.doe import Doe
from deboom.study.doe import DoeRequest, doe_name, study_doe
from deboom.study.mount_source import Operation
from deboom.study.sampling import factor_space
from deboom.vehicles.load_case_index import LoadCaseIndex


@dataclass(frozen=True, eq=False)
class CorrelationSet:
    """The same responses correlated in three ways.

    Parameters
    ----------
    designs : Correlations
        Of the designs as they are: the thesis.
    means : Correlations
        Of the designs' means over their manufacturing scatter.
    scatter : Correlations
        Of the scatter alone: each draw less its design's mean, all designs pooled.
    """

    designs: Correlations
    means: Correlations
    scatter: Correlations

    @property
    def kinds(self) -> dict[str, Correlations]:
        """The three, with the words for them."""
        return {
            "designs": self.designs,
            "means over the tolerance": self.means,
            "tolerance scatter": self.scatter,
        }


@dataclass(frozen=True, eq=False)
class Levels:
    """Mean level of the lines of several listeners, for designs and for their scatter.

    Parameters
    ----------
    names : tuple of str
        Vehicles, or sums of vehicles.
    designs : array, shape (n, r)
        Of the designs as they are [dB(A)].
    means : array, shape (n_toleranced, r)
        Of the designs whose draws could all be computed, mean over the draws [dB(A)].
    scatter : array, shape (n_toleranced, m, r)
        Draws less those means [dB].
    """

    names: tuple[str, ...]
    designs: RealArray
    means: RealArray
    scatter: RealArray

    def summed(self, groups: Mapping[str, Sequence[str]]) -> Levels:
        """Return the sums over groups of names."""
        member = np.array(
            [[float(name in members) for members in groups.values()] for name in self.names]
        )
        return Levels(
            tuple(groups), self.designs @ member, self.means @ member, self.scatter @ member
        )

    def correlated(self, seed: int, resamples: int) -> CorrelationSet:
        """Correlate all pairs of names in all three ways.

        Raises
        ------
        InputError
            See `deboom.explore.correlation_study.correlations`.
        """
        return CorrelationSet(
            *(
                correlations(values, self.names, seed=seed, resamples=resamples)
                for values in (self.designs, self.means, self.scatter)
            )
        )


@dataclass(frozen=True, eq=False)
class CorrelationStudy:
    """A DOE over a platform's mounts, and who goes with whom in it.

    Parameters
    ----------
    runs : Operation
        Vehicles, load cases and band.
    index : LoadCaseIndex
        What was evaluated.
    doe : Doe
        All designs with their responses.
    plan : str
        Of the designs, in words.
    n_known : int
        Asked designs that were known already.
    vehicles : Levels
        Vehicle by vehicle.
    seed, resamples : int
        Of the bootstrap.
    cut : float
        Least correlation within a family [1].
    inputs : tuple of Path
        Files that the designs came from.
    """

    runs: Operation
    index: LoadCaseIndex[Any, Any]
    doe: Doe
    plan: str
    n_known: int
    vehicles: Levels
    seed: int
    resamples: int
    cut: float
    inputs: tuple[Any, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the vehicles."""
        return self.vehicles.names

    @property
    def n_untoleranced(self) -> int:
        """Designs that were computed, but not all of their tolerance draws."""
        return len(self.vehicles.designs) - len(self.vehicles.means)

    @property
    def group_of(self) -> dict[str, str]:
        """Group of every vehicle."""
        return {vehicle.name: vehicle.group for vehicle in self.runs.fleet.vehicles}

    @cached_property
    def groups(self) -> dict[str, tuple[str, ...]]:
        """Vehicles of every group, in the platform's order."""
        of = self.group_of
        return {
            group: tuple(name for name in self.names if of[name] == group)
            for group in dict.fromkeys(of.values())
        }

    @cached_property
    def by_vehicle(self) -> CorrelationSet:
        """All pairs of vehicles."""
        return self.vehicles.correlated(self.seed, self.resamples)

    @cached_property
    def group_levels(self) -> Levels:
        """Sums over the vehicles of each group."""
        return self.vehicles.summed(self.groups)

    @cached_property
    def by_group(self) -> CorrelationSet | None:
        """All pairs of groups; None if there is only one."""
        if len(self.groups) < 2:
            return None
        return self.group_levels.correlated(self.seed, self.resamples)

    @cached_property
    def families(self) -> Families:
        """Vehicles that can share one mount set."""
        return families(self.names, self.by_vehicle.designs.pearson, self.cut)

    def mean_with_others(self, name: str) -> float:
        """Return the mean correlation of one vehicle with all others [1]."""
        others = [other for other in self.names if other != name]
        return float(self.by_vehicle.designs.between(name, others).mean())

    def least_alike(self) -> str:
        """Return the vehicle with the lowest mean correlation with the others."""
        return min(self.names, key=self.mean_with_others)


def correlation_study(
    runs: Operation,
    index: LoadCaseIndex[Any, Any],
    request: DoeRequest,
    *,
    motion: str,
    half_width: float,
    tolerance: float,
    draws: int,
    resamples: int,
    cut: float,
) -> CorrelationStudy:
    """Evaluate a DOE, let its designs scatter, and prepare their correlation.

    Parameters
    ----------
    runs : Operation
        Vehicles, load cases and band.
    index : LoadCaseIndex
        Of these runs.
    request : DoeRequest
        Which designs, with the seed of everything that is drawn.
    motion : str
        Of the powertrain, for the name of the DOE.
    half_width, tolerance : float
        Of the designs' bounds and of their scatter [1].
    draws : int
        Of the scatter per design, a power of two.
    resamples : int
        Of the bootstrap.
    cut : float
        Least correlation within a family [1].

    Raises
    ------
    InputError
        Fewer than two vehicles; see also `deboom.study.doe.study_doe`.
    """
    names = index.response_names
    if len(names) < 2:
        raise InputError(f"only vehicle {names[0]} was asked for: a correlation needs two")
    space = factor_space(index.variable_names, half_width, tolerance)
    doe, n_known = study_doe(index, space, request, doe_name(runs, motion, space))
    means, scatter = tolerance_scatter(
        index, space, doe.computed_designs, n_draws=draws, seed=request.seed
    )
    whole = np.isfinite(scatter).all(axis=(1, 2))
    scale = 1.0 / index.n_lines
    levels = Levels(names, doe.computed * scale, means[whole] * scale, scatter[whole] * scale)
    return CorrelationStudy(
        runs=runs,
        index=index,
        doe=doe,
        plan=request.words,
        n_known=n_known,
        vehicles=levels,
        seed=request.seed,
        resamples=resamples,
        cut=cut,
        inputs=request.inputs,
    )


def key_of(names: Sequence[str]) -> str:
    """Return a short name of several vehicles for summary keys, ``u06_1_4`` for U06-1 to U06-4."""
    head = re.match(r"(.*\W)?", names[0])
    shared = head[0] if head and all(name.startswith(head[0]) for name in names) else ""
    parts = [names[0], names[-1].removeprefix(shared)][: len(names)]
    return re.sub(r"\W+", "_", " ".join(parts)).strip("_").lower()
