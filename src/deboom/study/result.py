"""What a study gets from its runner, and what other commands ask of its model."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from deboom.explore.robust import Robust
from deboom.files.run_folder import LATEST, UNFINISHED, CheckpointFolder, Run, hash_files
from deboom.vehicles.platform import Runs


@dataclass(frozen=True)
class RunContext:
    """The run that a study is part of.

    The runner gives it to ``run(model, options, context)``; without a runner it is None.

    - `run`: its folder.
    - `relative_to`: input files are named by their path from here.
    """

    run: Run
    relative_to: Path

    def checkpoint(self, inputs: Iterable[Path], name: str = "search") -> CheckpointFolder:
        """Return where a search of this run is kept.

        - `inputs`: every file that the search depends on.
        - `name`: folder within the run; each search of a run has its own.
        - raises InputError: an input file that has changed since the run began, or cannot be read.
        """
        hashes = hash_files(inputs, relative_to=self.relative_to)
        return CheckpointFolder(self.run.folder / name, hashes)


def run_name(context: RunContext | None, study: str) -> str:
    """Return the folder of a run once it has finished, or its name, as it is typed in a command.

    - `context`: of the run; without it the study's latest one in ``results`` is meant.
    """
    if context is None:
        return f"results/{study}/{LATEST}"
    folder = context.run.folder
    beside = folder.parents[1] == Path("results")
    return (folder.name if beside else folder.as_posix()).removesuffix(UNFINISHED)


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
