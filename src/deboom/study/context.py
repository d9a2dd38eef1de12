"""What a study gets from its runner beside its options."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from deboom.explore.checkpoint import Checkpoint
from deboom.explore.robust import RobustResponse
from deboom.files.checkpoint import CheckpointFolder
from deboom.files.run_folder import Run, hash_files

EVERY = 5
"""Generations between two states of a search."""


@dataclass(frozen=True)
class RunContext:
    """The run that a study is part of.

    A study whose ``main`` has a parameter of this type gets it from the runner; it is no option of
    the command line. Its default is None, so that ``main`` works without a runner:
    ``main(..., run: RunContext | None = None)``.

    Parameters
    ----------
    run : Run
        Its folder.
    relative_to : Path
        Input files are named by their path from here.
    """

    run: Run
    relative_to: Path

    def search_begins(self, model: RobustResponse) -> None:
        """Learn what a search for a front is about to evaluate.

        A run goes on; `deboom.study.rebuilt` wants no more than the model.

        Parameters
        ----------
        model : RobustResponse
            Model, design space and draws of the search.
        """

    def checkpoint(
        self, inputs: Iterable[Path], name: str = "search", every: int = EVERY
    ) -> Checkpoint:
        """Return where a search of this run is kept.

        Parameters
        ----------
        inputs : iterable of Path
            Every file that the search depends on.
        name : str
            Folder within the run; each search of a run has its own.
        every : int
            Generations between two states.

        Raises
        ------
        InputError
            An input file that has changed since the run began, or cannot be read.
        """
        hashes = hash_files(inputs, relative_to=self.relative_to)
        return Checkpoint(CheckpointFolder(self.run.folder / name, hashes), every)
