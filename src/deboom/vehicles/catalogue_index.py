"""Parts from a catalogue as design variables: which part at each mount, and how much re-tuned."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.mounts.mount import Mount
from deboom.vehicles.coupled_motion import CoupledMotion
from deboom.vehicles.fleet import PathContributions
from deboom.vehicles.load_case_index import LoadCaseIndex
from deboom.vehicles.synthesis import checked_designs

SUFFIX = " part"
"""What the name of a choice's variable adds to that of its mount."""

Options = npt.NDArray[np.intp]
"""Number of the part of each stiffness factor, shape (n_variable,)."""

Composed = Callable[[Sequence[Any], Options], Any]
"""From one load case of every level, and the part of every factor, to that of a mixed set."""


@dataclass(frozen=True, eq=False)
class CatalogueIndex:
    """SPLV of every vehicle, as a function of the parts chosen and of their stiffness factors.

    Designs are one part number per mount, from 0, then one stiffness factor per mount and axis.

    Parameters
    ----------
    mounts : tuple of Mount
        In the order of the factors.
    levels : tuple of LoadCaseIndex
        Index number o has part number o at every mount; a mount with fewer parts repeats any.
        Number 0 has today's parts.
    n_parts : tuple of int
        How many parts there are for each mount.
    composed : Composed
        `composed_contributions` or `composed_motion`.

    Raises
    ------
    InputError
        Not one number of parts per mount, or more parts than levels.
    """

    mounts: tuple[Mount, ...]
    levels: tuple[LoadCaseIndex[Any, Any], ...]
    n_parts: tuple[int, ...]
    composed: Composed

    def __post_init__(self) -> None:
        fits = len(self.n_parts) == len(self.mounts) and min(self.n_parts, default=0) >= 1
        if not fits or max(self.n_parts) > len(self.levels):
            raise InputError(
                f"{list(self.n_parts)} parts for the mounts {[one.name for one in self.mounts]} "
                f"and {len(self.levels)} indices: give each mount at least one part, and one index "
                "per part number"
            )

    @property
    def variable_names(self) -> tuple[str, ...]:
        """``<mount> part`` of every mount, then the stiffness factors."""
        choices = tuple(f"{mount.name}{SUFFIX}" for mount in self.mounts)
        return (*choices, *self.levels[0].variable_names)

    @property
    def response_names(self) -> tuple[str, ...]:
        """Name of each vehicle."""
        return self.levels[0].response_names

    @property
    def response_unit(self) -> str:
        """Unit of all responses."""
        return self.levels[0].response_unit

    @property
    def n_lines(self) -> int:
        """Number of lines in each sum."""
        return self.levels[0].n_lines

    def of_parts(self, parts: Sequence[int]) -> LoadCaseIndex[Any, Any]:
        """Return the index of one set of parts, as a function of the stiffness factors.

        Raises
        ------
        InputError
            Not one number per mount, or a number that is no part's.
        """
        numbers = list(parts)
        there = len(numbers) == len(self.n_parts) and all(
            0 <= number < count for number, count in zip(numbers, self.n_parts, strict=True)
        )
        if not there:
            raise InputError(
                f"there is no set of parts {numbers}: give one number per mount, each below "
                f"{list(self.n_parts)}"
            )
        option = np.repeat(
            np.array(numbers, dtype=np.intp), [len(m.variables) for m in self.mounts]
        )
        cases = zip(*(level.contributions for level in self.levels), strict=True)
        return replace(
            self.levels[0], contributions=tuple(self.composed(case, option) for case in cases)
        )

    def __call__(self, designs: npt.ArrayLike) -> RealArray:
        """Return SPLV of each design in each vehicle.

        Parameters
        ----------
        designs : array_like, shape (n, n_mount + n_variable)
            Part numbers and stiffness factors [1].

        Returns
        -------
        array, shape (n, n_vehicle)
            [dB(A)].

        Raises
        ------
        InputError
            Designs of another shape or not finite; a part number with a fraction, or of no part.
        """
        rows = checked_designs(designs, self.variable_names)
        parts, factors = rows[:, : len(self.mounts)], rows[:, len(self.mounts) :]
        if np.any(parts != np.floor(parts)):
            raise InputError("part numbers are whole: round them, or search whole-number variables")
        found = np.empty((len(rows), len(self.response_names)))
        chosen, where = np.unique(parts, axis=0, return_inverse=True)
        for number, numbers in enumerate(chosen.astype(int).tolist()):
            rows_of = np.flatnonzero(where.ravel() == number)
            found[rows_of] = self.of_parts(numbers)(factors[rows_of])
        return found


def composed_contributions(
    levels: Sequence[PathContributions], option: Options
) -> PathContributions:
    """Return the contributions of a mixed set: each factor's column from its own part's level."""
    values = np.stack([level.values for level in levels])
    columns = np.arange(option.size)
    return replace(levels[0], values=np.moveaxis(values[option, :, :, columns], 0, -1))


def composed_motion(levels: Sequence[CoupledMotion], option: Options) -> CoupledMotion:
    """Return the motion of a mixed set: stiffnesses of its parts, external loads of level 0.

    Notes
    -----
    The loads come from the motion and forces that were measured with today's parts; the stiffness
    of another part is that of its surface at today's amplitude.
    """
    first = levels[0]

    def stiffness(name: str, variables: Options) -> npt.NDArray[np.complex128]:
        stacked = np.stack([getattr(level, name) for level in levels])
        return np.asarray(stacked[option[variables], :, np.arange(variables.size)].T)

    return replace(
        first,
        stiffness=stiffness("stiffness", first.variables),
        own_stiffness=stiffness("own_stiffness", first.own_variables),
    )
