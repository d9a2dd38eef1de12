"""Parts that may stand at a platform's mounts, and the levels with any of them."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.space import DesignSpace, stiffness_factor_space
from deboom.mounts.characterised_mount import CharacterisedMount
from deboom.mounts.surface_forces import Outside, surface_forces
from deboom.vehicles.booming_model import CatalogueModel, Motion
from deboom.vehicles.platform import Runs

TODAY = "today's"


@dataclass(frozen=True, eq=False)
class Catalogue:
    """Parts that may stand at each mount of a platform, today's first; and the files read."""

    parts: Mapping[str, tuple[CharacterisedMount, ...]]
    inputs: tuple[Path, ...]

    @property
    def n_parts(self) -> tuple[int, ...]:
        """Number of parts of each mount."""
        return tuple(len(parts) for parts in self.parts.values())

    @property
    def n_sets(self) -> int:
        """Number of sets that can be made of them."""
        return int(np.prod(self.n_parts))

    def all_sets(self) -> RealArray:
        """Return every set as part numbers, shape (n_sets, n_mount); today's is the first."""
        return np.array(list(itertools.product(*map(range, self.n_parts))), dtype=float)

    def label(self, mount: str, number: int) -> str:
        """Return what to order: the part number, or variant and serial where there is none."""
        identity = self.parts[mount][number].identity
        name = identity.part_number or f"{mount} {identity.variant} {identity.serial}".strip()
        return f"{name} ({TODAY})" if number == 0 else name

    def labels(self, numbers: RealArray) -> list[str]:
        """Return the part of each mount, from part numbers of shape (n_mount,)."""
        pairs = zip(self.parts, numbers.astype(int), strict=True)
        return [self.label(mount, number) for mount, number in pairs]

    def columns(self, designs: RealArray) -> dict[str, list[str]]:
        """Return a column per mount with the parts of designs, shape (n, k)."""
        return {
            f"{mount} part": [self.label(mount, int(row[place])) for row in designs]
            for place, mount in enumerate(self.parts)
        }

    def space(self, names: Sequence[str], retuning: float, tolerance: float) -> DesignSpace:
        """Return the space of part numbers and stiffness factors ``1 ± retuning``."""
        n = len(self.parts)
        factors = stiffness_factor_space(names[n:], half_width=retuning, tolerance=tolerance)
        none = np.zeros(n)
        return DesignSpace(
            names=tuple(names),
            units=("1",) * len(names),
            nominal=np.concatenate([none, factors.nominal]),
            lower=np.concatenate([none, factors.lower]),
            upper=np.concatenate([np.array(self.n_parts) - 1.0, factors.upper]),
            tolerance=np.concatenate([none, factors.tolerance]),
            integer=np.arange(len(names)) < n,
        )


def catalogue_index(
    runs: Runs, catalogue: Catalogue, motion: Motion, outside: Outside
) -> CatalogueModel:
    """Build the booming index of all parts of a catalogue.

    - raises InputError: a motion that parts cannot be combined under; see also `surface_forces`.
    """
    if motion is Motion.amplitude:
        raise InputError(
            "parts of a catalogue cannot be combined under amplitude motion: use one of "
            f"{[Motion.prescribed.value, Motion.coupled.value]}"
        )
    levels = tuple(each.model(motion) for each in runs_of_parts(runs, catalogue, outside))
    return CatalogueModel(runs.platform.mounts, levels, catalogue.n_parts)


def runs_of_parts(runs: Runs, catalogue: Catalogue, outside: Outside) -> list[Runs]:
    """Return the runs with the forces of each part number, today's first.

    A mount with fewer parts repeats its last one.
    """
    every = [runs]
    for number in range(1, max(catalogue.n_parts)):
        parts = tuple(mine[min(number, len(mine) - 1)] for mine in catalogue.parts.values())
        cases = [
            (surface_forces(case, parts, outside).load_case, weight) for case, weight in runs.cases
        ]
        by_name = {case.name: case for case, _ in cases}
        load_cases = tuple(by_name.get(case.name, case) for case in runs.platform.load_cases)
        platform = replace(runs.platform, load_cases=load_cases)
        every.append(replace(runs, platform=platform, cases=cases, parts=parts))
    return every


def ordered_stiffness(
    runs: Runs, catalogue: Catalogue, design: RealArray, outside: Outside
) -> RealArray:
    """Return the mean ``|K|`` of a set of parts, re-tuned, in operation of the first load case.

    - `design` (n_mount + k,): part numbers, then stiffness factors [1].
    - returns (k,): [N/m]; nan: not measured.
    - raises InputError: see `deboom.mounts.surface_forces.surface_forces`.
    """
    numbers, factors = np.split(design, [len(catalogue.parts)])
    mounts = [
        parts[int(number)] for parts, number in zip(catalogue.parts.values(), numbers, strict=True)
    ]
    case = surface_forces(runs.cases[0][0], mounts, outside).load_case
    return np.asarray(runs.stiffness(case, runs.band) * factors)
