"""A catalogue of characterised parts for the mounts of a platform, as designs of a search."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.design_space import DesignSpace, stiffness_factor_space
from deboom.files.library_export import read_library_json
from deboom.files.platform import Platform
from deboom.mounts.characterised_mount import CharacterisedMount
from deboom.mounts.library import open_library
from deboom.mounts.surface_forces import Outside, surface_forces
from deboom.study.motion import Kernel, Motion, motion_index
from deboom.study.mount_source import LIBRARY_FILE, MountSource, Operation
from deboom.vehicles.catalogue_index import (
    CatalogueIndex,
    Composed,
    composed_contributions,
    composed_motion,
)

CATALOGUE_FILE = "catalogue.library.json"
"""Further parts in a platform folder, an exported mount library."""

TODAY = "today's"
_COMPOSED: dict[Motion, Composed] = {
    Motion.prescribed: composed_contributions,
    Motion.coupled: composed_motion,
}


@dataclass(frozen=True, eq=False)
class Catalogue:
    """Parts that may stand at each mount of a platform.

    Parameters
    ----------
    parts : mapping of str to tuple of CharacterisedMount
        By mount, in the platform's order; the first one is today's.
    inputs : tuple of Path
        Files they come from.
    """

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

    def space(self, names: Sequence[str], retuning: float, tolerance: float) -> DesignSpace:
        """Return the space of part numbers and stiffness factors.

        Parameters
        ----------
        names : sequence of str
            Variables of the catalogue's index.
        retuning : float
            Factors run from ``1 - retuning`` to ``1 + retuning``; 0 takes parts as they are [1].
        tolerance : float
            Manufacturing scatter of each stiffness, half width [1].
        """
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


def platform_catalogue(
    platform: Platform, path: Path | None, mounts: Sequence[str] | None = None
) -> Catalogue:
    """Read the parts that may stand at a platform's mounts.

    Parameters
    ----------
    platform : Platform
        Its own library has today's parts.
    path : Path or None
        Exported library (JSON) or library database with further parts; None takes
        `CATALOGUE_FILE` of the platform.
    mounts : sequence of str, optional
        Mounts whose part may change; default is all.

    Raises
    ------
    InputError
        A file that is missing or no library, a mount that the platform does not have, a part of
        other pieces, two parts with one label, or no further part at all.
    """
    own = platform.folder / LIBRARY_FILE
    further = path or platform.folder / CATALOGUE_FILE
    if not further.exists():
        raise InputError(
            f"{further}: there is no catalogue of further parts: export a mount library there "
            "(deboom library export), or name one with --catalogue"
        )
    today = {part.mount.name: part for part in read_library_json(own)[1]}
    names = [mount.name for mount in platform.mounts]
    unknown = [name for name in (mounts or ()) if name not in names]
    if unknown or not set(names) <= set(today):
        raise InputError(
            f"{platform.name}: no mount {unknown or sorted(set(names) - set(today))} with a "
            f"characterised part: the mounts are {names}"
        )
    parts: dict[str, tuple[CharacterisedMount, ...]] = {name: (today[name],) for name in names}
    for part in _parts_of(further):
        name = part.mount.name
        if name in (mounts or names) and name in parts and part.identity != today[name].identity:
            if part.mount.pieces != today[name].mount.pieces:
                raise InputError(f"{further}: {part.identity} has other pieces than today's part")
            parts[name] = (*parts[name], part)
    found = Catalogue(parts, (own, further))
    for name, count in zip(names, found.n_parts, strict=True):
        labels = [found.label(name, number) for number in range(count)]
        if len(set(labels)) < count:
            raise InputError(f"{further}: parts of {name} share a name: {labels}; number them")
    if found.n_sets == 1:
        raise InputError(f"{further}: there is no further part for any of {mounts or names}")
    return found


def catalogue_index(
    runs: Operation, catalogue: Catalogue, motion: Motion, kernel: Kernel | None, outside: Outside
) -> CatalogueIndex:
    """Build the booming index of all parts of a catalogue.

    Parameters
    ----------
    runs : Operation
        With today's parts.
    catalogue : Catalogue
        Of the same platform.
    motion, kernel
        As for `deboom.study.motion.motion_index`.
    outside : Outside
        Whether lines outside of the region that a part was measured in are refused or keep the
        force of today's part.

    Raises
    ------
    InputError
        Another motion; lines outside, if refused; see also
        `deboom.mounts.surface_forces.surface_forces`.

    Notes
    -----
    A direction that was not identified has today's force, whatever the part.
    """
    if motion not in _COMPOSED:
        raise InputError(
            f"parts of a catalogue cannot be combined under {motion.value} motion: use one of "
            f"{[one.value for one in _COMPOSED]}"
        )
    levels = [motion_index(runs, motion, kernel)]
    for number in range(1, max(catalogue.n_parts)):
        mounts = [parts[min(number, len(parts) - 1)] for parts in catalogue.parts.values()]
        cases = [
            (surface_forces(case, mounts, outside).load_case, weight) for case, weight in runs.cases
        ]
        levels.append(motion_index(replace(runs, cases=cases), motion, kernel))
    return CatalogueIndex(runs.platform.mounts, tuple(levels), catalogue.n_parts, _COMPOSED[motion])


def outside_of(source: MountSource) -> Outside:
    """Return what becomes of lines outside of the measured region.

    Raises
    ------
    InputError
        Forces from the spectra: only one set of parts was measured in the vehicle.
    """
    if source is MountSource.spectra:
        raise InputError(
            "parts of a catalogue are known by their surfaces alone: take --mounts library or "
            "--mounts library-inside"
        )
    return Outside.REFUSE if source is MountSource.library else Outside.KEEP_MEASURED


def _parts_of(path: Path) -> tuple[CharacterisedMount, ...]:
    if path.suffix.lower() == ".json":
        return read_library_json(path)[1]
    with open_library(path) as library:
        return tuple(library.load(identity) for identity in library.identities())
