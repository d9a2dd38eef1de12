"""A front study's finished run with its model, and what a study's model offers to other pages."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.choices import Pick
from deboom.explore.robust import Robust
from deboom.files.doe_table import read_plan
from deboom.files.front_table import FILES, FRONT, FrontTable
from deboom.files.run_folder import RECORD, RunEntry
from deboom.vehicles.platform import Runs

if TYPE_CHECKING:  # a front of a powertrain needs no compressor
    from deboom.compressor.mounted_fleet import MountedFleet

SAME_RESULT = ("workers", "scheduler")
"""Options that say who computes, not what: a resumed run may have others."""
NOT_THE_CONFIGURATION = {"seed", "platform", *SAME_RESULT}
"""Options in which runs of one configuration may differ; the platform goes by its files."""


@runtime_checkable
class RobustModel(Protocol):
    """What `prepare` returns where fronts of the study shall be compared.

    - `robust`: model of the search with its draws.
    """

    @property
    def robust(self) -> Robust:
        """Model of the search with its draws."""


@runtime_checkable
class PlatformModel(RobustModel, Protocol):
    """What `prepare` returns where the front is one of a platform's mounts.

    - `runs`: platform, vehicles and load cases of the model.
    """

    @property
    def runs(self) -> Runs:
        """Platform, vehicles and load cases of the model."""


@runtime_checkable
class MountedModel(RobustModel, Protocol):
    """What `prepare` returns where the front is one of a compressor's mounts.

    - `mounted`: the cars on these mounts.
    """

    @property
    def mounted(self) -> MountedFleet:
        """The cars on the compressor's mounts."""


@runtime_checkable
class FleetModel(Protocol):
    """What `prepare` returns where designs of an experiment shall be explored.

    - `index`: model of the levels; `runs`: platform, vehicles and load cases.
    """

    @property
    def index(self) -> Any:
        """Model of the levels."""

    @property
    def runs(self) -> Runs:
        """Platform, vehicles and load cases of the model."""


@dataclass(frozen=True, eq=False, kw_only=True)
class ComparedRun:
    """A finished front study.

    - `entry`: its folder and record.
    - `prepared`: what its study prepared again from the run's options.
    - `front`: as the run keeps it.
    - `text_changed`: whether the study's script is another one today.
    """

    entry: RunEntry
    prepared: RobustModel
    front: FrontTable
    text_changed: bool = False

    @property
    def model(self) -> Robust:
        """Built again from the run's options, with the draws of its search."""
        return self.prepared.robust

    @property
    def designs(self) -> RealArray:
        """Designs of the front, shape (n, k) [units of the space]."""
        return self.front.designs

    @property
    def seed(self) -> int:
        """Seed of the search."""
        return int(self.entry.record["seed"])

    @property
    def assumed(self) -> tuple[str, ...]:
        """Which defaults its model rests on, in words, as its record says."""
        said = self.entry.record.get("facts", {}).get("assumed", "")
        return (said,) if said else ()

    @cached_property
    def configuration(self) -> str:
        """Everything that was asked for but the seed, as text that can be compared."""
        options = {
            name: value
            for name, value in self.entry.record["arguments"].items()
            if name not in NOT_THE_CONFIGURATION and value is not None
        }
        return json.dumps([self.entry.study, options], sort_keys=True)

    def picked(self, pick: Pick | Path) -> RealArray:
        """Return a design of the front by name, as the search found it, (k,) [units of the space].

        Of a file of designs, see `deboom.files.doe_table.read_plan`, the first one counts.

        Raises
        ------
        InputError
            The front has no design of this name; a file that cannot be read.
        """
        if isinstance(pick, Path):
            return np.asarray(read_plan(pick, self.model.space)[0])
        if pick not in self.front.picks:
            raise InputError(
                f"{self.entry.folder / FRONT} names no design '{pick}': none is better than "
                f"today's, or the study picks none; use {Pick.best_mean}"
            )
        return np.asarray(self.designs[self.front.picks[pick]])

    @property
    def files(self) -> tuple[Path, ...]:
        """Files that a comparison reads."""
        names = (RECORD, *FILES)
        return tuple(p for name in names if (p := self.entry.folder / name).is_file())


def design_name(pick: Pick | Path) -> str:
    """Return the name of a design in words and file names: its pick, or its file."""
    return pick.stem if isinstance(pick, Path) else pick.value
