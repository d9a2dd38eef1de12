"""A front study's picked design, as far as the supplier of its mounts needs it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from deboom.arrays import AXES, IntArray, RealArray
from deboom.errors import InputError
from deboom.explore.choices import Pick
from deboom.explore.front import verification_response
from deboom.explore.robust import Robust
from deboom.explore.selection import at_nominal, variables_without_effect
from deboom.explore.space import DesignSpace
from deboom.files.front_run import ComparedRun
from deboom.measurement.channels import LoadCase
from deboom.mounts.characterised_mount import CharacterisedDirection, CharacterisedMount
from deboom.mounts.mount import Mount
from deboom.vehicles.fleet_front import sound_rows
from deboom.vehicles.free_directions import DirectionFreedom, Need, free_directions
from deboom.vehicles.platform import Platform, Runs

DRAWS = 1024
"""Draws of the tolerance behind every scatter on the page; no search has seen them."""
LOSS = " loss"
"""End of the name of a variable that is a loss factor."""


@dataclass(frozen=True, eq=False)
class Direction:
    """One direction of a mount, a design variable.

    Parameters
    ----------
    mount : Mount
        On the platform.
    axis : str
        ``x``, ``y`` or ``z``.
    column : int
        Of its stiffness factor in a design.
    loss_column : int or None
        Of its loss factor, where that is a variable.
    characterised : CharacterisedDirection or None
        Where its force comes from; None where that is the measured spectrum.
    need : Need
        What is asked of it.
    """

    mount: Mount
    axis: str
    column: int
    loss_column: int | None
    characterised: CharacterisedDirection | None
    need: Need

    @property
    def name(self) -> str:
        """Name of the design variable."""
        return f"{self.mount.name} {self.axis}"


@dataclass(frozen=True, eq=False)
class SupplierStudy:
    """A front study, as far as the supplier of its mounts needs it.

    Parameters
    ----------
    run : ComparedRun
        Finished, checked, with its model built again.
    runs : Runs
        Platform and load cases with the forces of the run.
    pick : Pick or Path
        The design that is wanted, or a file that holds it.
    """

    run: ComparedRun
    runs: Runs
    pick: Pick | Path

    @property
    def platform(self) -> Platform:
        """With the forces of the run."""
        return self.runs.platform

    @property
    def parts(self) -> tuple[CharacterisedMount, ...]:
        """Parts that the forces come from; empty if they are the measured ones."""
        return self.runs.parts

    @property
    def model(self) -> Robust:
        """Of the run, with the draws of its search."""
        return self.run.model

    @property
    def space(self) -> DesignSpace:
        """Design variables and their tolerances."""
        return self.model.space

    @property
    def index(self) -> Any:
        """What the run evaluated."""
        return self.model.evaluate

    def mean(self, values: RealArray) -> RealArray:
        """Return the mean over the vehicles, weighted as in the run, of values (..., v)."""
        return self.model.mean(values)

    @property
    def ears(self) -> IntArray:
        """Numbers of the responses that are sounds."""
        return sound_rows(self.index)

    @property
    def vehicles(self) -> tuple[str, ...]:
        """Names of the vehicles that were served, and of further ears."""
        return tuple(self.index.response_names[row] for row in self.ears)

    @property
    def per_vehicle(self) -> float:
        """Factor from SPLV to the mean level of one line [1]."""
        return float(1.0 / self.index.n_lines)

    @property
    def band(self) -> tuple[float, float]:
        """First and last line [Hz]."""
        return float(self.index.frequency[0]), float(self.index.frequency[-1])

    @property
    def load_cases(self) -> tuple[tuple[LoadCase, float], ...]:
        """Load cases that count, with their weights; the levels shown are those of the first."""
        names = self.index.load_case_names
        pairs = zip(names, self.index.weights, strict=True)
        return tuple((self.platform.load_case(name), float(weight)) for name, weight in pairs)

    @cached_property
    def picked(self) -> RealArray:
        """The design as the search found it, shape (k,) [1]."""
        return self.run.picked(self.pick)

    @cached_property
    def without_effect(self) -> tuple[str, ...]:
        """Variables that no vehicle depends on."""
        return variables_without_effect(self.index, self.space)

    @cached_property
    def unidentified(self) -> tuple[str, ...]:
        """Variables whose direction nobody knows well enough to ask for a number."""
        names = []
        for mount in self.platform.mounts if self.parts else ():
            for name, axis in zip(mount.variables, AXES, strict=True):
                if not self.runs.identified(mount.name, axis):
                    names += [n for n in (name, name + LOSS) if n in self.space.names]
        return tuple(name for name in names if name not in self.without_effect)

    @cached_property
    def wanted(self) -> RealArray:
        """The picked design with today's value where nothing can be asked, shape (k,) [1]."""
        back = (*self.without_effect, *self.unidentified)
        return np.asarray(at_nominal(self.picked[np.newaxis], self.space, back)[0])

    @cached_property
    def freedom(self) -> DirectionFreedom:
        """How far each variable may leave `wanted` before a vehicle changes noticeably."""
        return free_directions(
            self.index, self.wanted, self.space, without_effect=self.without_effect
        )

    @cached_property
    def directions(self) -> tuple[Direction, ...]:
        """All stiffness factors, in the order of the design."""
        directions = []
        names = self.space.names
        for mount in self.platform.mounts:
            for name, axis in zip(mount.variables, AXES, strict=True):
                if name not in names:
                    raise InputError(
                        f"run {self.run.entry.folder} has no stiffness factor '{name}': a page for "
                        "suppliers needs one for every mount and axis of its platform"
                    )
                column = names.index(name)
                loss = names.index(name + LOSS) if name + LOSS in names else None
                part = self.runs.characterised(mount.name, axis)
                directions.append(
                    Direction(mount, axis, column, loss, part, self._need(name, column))
                )
        return tuple(directions)

    @cached_property
    def check(self) -> Robust:
        """The model with draws that the search never saw."""
        return verification_response(self.model, DRAWS, seed=self.run.seed)

    def of(self, mount: str | None) -> tuple[Direction, ...]:
        """Return the directions of a mount; of all for None.

        Raises
        ------
        InputError
            No such mount.
        """
        names = [carrier.name for carrier in self.platform.mounts]
        if mount is not None and mount not in names:
            raise InputError(
                f"run {self.run.entry.folder} has no mount '{mount}': use {', '.join(names)}"
            )
        return tuple(d for d in self.directions if mount in (None, d.mount.name))

    def only(self, mount: str, wanted: RealArray) -> RealArray:
        """Return today's design with one mount as in another design, shape (k,) [1]."""
        design = np.array(self.space.nominal)
        for direction in self.of(mount):
            for column in (direction.column, direction.loss_column):
                if column is not None:
                    design[column] = wanted[column]
        return design

    def _need(self, name: str, column: int) -> Need:
        if name in self.unidentified:
            return Need.unknown
        return self.freedom.needs[column]
