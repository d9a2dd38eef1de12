"""What a study gets from its runner, and what other commands need from its model."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from deboom.files.run_folder import LATEST, UNFINISHED, CheckpointFolder, Run, hash_files
from deboom.names import path_inside
from deboom.runs.second_process import SecondProcess


@dataclass(frozen=True)
class RunContext:
    """The run that a study is part of.

    The runner gives it to ``run(model, options, context)``; without a runner it is None.

    - `run`: its folder.
    - `relative_to`: input files are named by their path from here.
    - `command`: that makes this run again.
    - `second`: a process for what can be done beside the study.
    """

    run: Run
    relative_to: Path
    command: str = ""
    second: SecondProcess | None = None

    def checkpoint(self, inputs: Iterable[Path], name: str = "search") -> CheckpointFolder:
        """Return where a search of this run is kept.

        - `inputs`: every file that the search depends on.
        - `name`: folder within the run; each search of a run has its own.
        - raises InputError: an input file that has changed since the run began, or cannot be read;
          a link that leads out of the run.
        """
        hashes = hash_files(inputs, relative_to=self.relative_to)
        return CheckpointFolder(path_inside(self.run.folder, name), hashes)


def run_name(context: RunContext | None, study: str) -> str:
    """Return the folder of a run once it has finished, or its name, as it is typed in a command.

    - `context`: of the run; without it the study's latest one in ``results`` is meant.
    """
    if context is None:
        return f"results/{study}/{LATEST}"
    folder = context.run.folder
    beside = folder.parents[1] == Path("results")
    return (folder.name if beside else folder.as_posix()).removesuffix(UNFINISHED)
