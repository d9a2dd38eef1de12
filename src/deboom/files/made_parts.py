"""Parts as made: their tolerances, measured or stated, what they share, and what they cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from deboom.arrays import PERCENT
from deboom.errors import InputError
from deboom.explore.scatter import PartNumber, ToleranceStructure, part_structure
from deboom.explore.space import SIGMAS_PER_TOLERANCE, DesignSpace
from deboom.explore.tolerance_allocation import ToleranceCost
from deboom.files.library_export import library_parts
from deboom.files.limits import MeasuredEntry, PartScatterFile, load_parts
from deboom.files.tables import row_of_each
from deboom.mounts.characterised_mount import CharacterisedMount
from deboom.mounts.part_scatter import LibraryScatter, ScatterPrior, library_scatter

REFERENCE = 0.15
"""Tolerance whose price is 1 per direction unless a table says otherwise [1]."""
NOTHING_SHARED = (
    "Every direction of every mount scatters on its own, left and right piece of a mount as one."
)


@dataclass(frozen=True, eq=False)
class MadeParts:
    """How the parts of a study scatter.

    - `space`: with their tolerances.
    - `structure`: what their scatter has in common; None without a file: nothing.
    - `scatter` or None: what was measured.
    - `inputs`: files read.
    """

    space: DesignSpace
    structure: ToleranceStructure | None = None
    scatter: LibraryScatter | None = None
    inputs: tuple[Path, ...] = ()

    @property
    def n_draws(self) -> int:
        """Columns that a tolerance sample needs."""
        return self.space.n_variables if self.structure is None else self.structure.n_draws

    @property
    def table(self) -> pd.DataFrame:
        """One row per variable that scatters: its tolerance and where that comes from."""
        rows = []
        for name, tolerance in zip(self.space.names, self.space.tolerance, strict=True):
            if tolerance == 0.0:
                continue
            row: dict[str, object] = {"variable": name, "tolerance ± [%]": PERCENT * tolerance}
            if self.scatter is not None:
                direction = self.scatter.direction(name)
                interval = (
                    (direction.sigma, direction.lower, direction.upper)
                    if direction
                    else (np.nan,) * 3
                )
                columns = ("sigma measured [%]", "from [%]", "to [%]")
                row |= dict(zip(columns, (PERCENT * value for value in interval), strict=True))
                row |= {
                    "parts": direction.n_parts if direction else 0,
                    "note": direction.note if direction else "",
                }
            rows.append(row)
        return pd.DataFrame(rows)

    @property
    def text(self) -> str:
        """What parts have in common, in words."""
        if self.structure is None:
            return NOTHING_SHARED
        correlation = self.structure.loadings @ self.structure.loadings.T
        size = np.sqrt(np.diag(correlation))
        linked = np.triu(correlation / np.outer(size, size), 1)
        words = [
            f"{self.n_draws} independent draws make one set of parts for {len(size)} variables; "
            f"the largest correlation of two variables is {linked.max():.2f}."
        ]
        even = [n for n, wide in zip(self.space.names, size, strict=True) if wide < 1.0 - 1e-9]
        if even:
            words.append(
                f"{', '.join(even)}: the mean of several pieces, which even out to "
                f"{PERCENT * size.min():.0f} % of the tolerance of one."
            )
        if self.scatter is not None and self.scatter.hardness is not None:
            share = self.scatter.hardness
            words.append(
                f"Measured share of the variance that the axes of a part have in common: "
                f"{share.value:.2f}, 95 % interval {share.lower:.2f} to {share.upper:.2f}."
            )
        return " ".join(words)


def made_parts(path: Path | None, space: DesignSpace) -> MadeParts:
    """Read how parts scatter.

    - `path`: see `deboom.files.limits`; None: variables scatter independently, with the tolerances
      of the space.
    - `space`: variables ``<mount> <axis>``. What is exactly made stays so unless the file says.
    - raises InputError: a file or library that cannot be read, a variable or place that there is
      not, or a place with two part numbers.
    """
    if path is None:
        return MadeParts(space)
    content = load_parts(path)
    scatter, inputs = None, [path]
    if content.measured is not None:
        inputs.append(path.parent / content.measured.library)
        scatter = _measured(inputs[-1], content, content.measured)
    try:
        structure = _structure(content, space, scatter)
        tolerance = _tolerance(content, space, scatter)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    return MadeParts(replace(space, tolerance=tolerance), structure, scatter, tuple(inputs))


def _measured(library: Path, content: PartScatterFile, entry: MeasuredEntry) -> LibraryScatter:
    """Estimate the scatter from a library, of the part numbers that the file names."""
    numbers = {place: part.number for part in content.parts for place in part.places}
    parts = [candidate for candidate in library_parts(library) if _wanted(candidate, numbers)]
    try:
        return library_scatter(parts, ScatterPrior(entry.prior_sigma, entry.prior_weight))
    except InputError as error:
        raise InputError(f"{library}: {error}") from None


def _wanted(part: CharacterisedMount, numbers: Mapping[str, str]) -> bool:
    """Whether a part may be of the number that its mount takes."""
    wanted, stated = numbers.get(part.mount.name, ""), part.identity.part_number
    return not wanted or stated in ("", wanted)


def _structure(
    content: PartScatterFile, space: DesignSpace, scatter: LibraryScatter | None
) -> ToleranceStructure:
    hardness = content.hardness_share
    if hardness is None:
        hardness = scatter.hardness.value if scatter and scatter.hardness else 0.0
    parts = []
    for entry in content.parts:
        batch = entry.batch_share if entry.batch_share is not None else content.batch_share
        if batch is None:
            batch = _measured_batch(entry.places, scatter)
        hardness_share = hardness if entry.hardness_share is None else entry.hardness_share
        parts.append(PartNumber(entry.number, entry.places, entry.pieces, hardness_share, batch))
    return part_structure(space.names, parts, hardness)


def _measured_batch(places: Sequence[str], scatter: LibraryScatter | None) -> float:
    """Mean of the batch shares of the mounts where they were measured; 0 if nowhere."""
    batches = scatter.batches if scatter else {}
    measured = [batches[place].value for place in places if place in batches]
    return float(np.mean(measured)) if measured else 0.0


def _tolerance(
    content: PartScatterFile, space: DesignSpace, scatter: LibraryScatter | None
) -> np.ndarray:
    stated = {entry.variable: entry.tolerance for entry in content.tolerances}
    unknown = [name for name in stated if name not in space.names]
    if unknown:
        raise InputError(
            f"there is a tolerance of '{unknown[0]}', which is no variable: use "
            f"{', '.join(space.names)}"
        )
    tolerance = space.tolerance.copy()
    for place, name in enumerate(space.names):
        direction = scatter.direction(name) if scatter else None
        if tolerance[place] > 0.0 and direction is not None:
            tolerance[place] = SIGMAS_PER_TOLERANCE * direction.sigma
        if name in stated:
            tolerance[place] = stated[name]
    return tolerance


def tolerance_cost(path: Path | None, variables: Sequence[str]) -> ToleranceCost:
    """Return the price of tolerances, by default 1 per direction at the tolerance `REFERENCE`.

    - `path` or None: table with the columns ``variable, weight, reference tolerance``, one row per
      variable, in any order; the weight is in any unit of money, the tolerance a plain number such
      as 0.15.
    - `variables`: of the stiffness factors.
    - raises InputError: a table that cannot be read, lacks a variable or names it twice.
    """
    if path is None:
        unit_cost = np.ones(len(variables))
        return ToleranceCost(tuple(variables), unit_cost, REFERENCE * unit_cost)
    rows = row_of_each(path, ("variable", "weight", "reference tolerance"), {}, variables)
    weight, reference = (
        np.array([row.number(column) for row in rows])
        for column in ("weight", "reference tolerance")
    )
    return ToleranceCost(tuple(variables), weight, reference)
