"""The model of a run, built again from its study, options and input files."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from deboom.errors import InputError
from deboom.explore.checkpoint import Checkpoint
from deboom.explore.robust import RobustResponse
from deboom.files.run_folder import Run, hash_files
from deboom.files.run_list import RunEntry
from deboom.study.context import EVERY, RunContext
from deboom.study.resume import SAME_RESULT, resumed_arguments

if TYPE_CHECKING:
    from deboom.study.runner import Study


class _ModelReady(Exception):
    """Ends a study where its search would begin."""

    def __init__(self, model: RobustResponse) -> None:
        super().__init__("the model is ready")
        self.model = model


@dataclass(frozen=True)
class _ModelOnly(RunContext):
    """The context of a run that is over when its model is ready."""

    def search_begins(self, model: RobustResponse) -> None:
        """Take the model and leave the study."""
        raise _ModelReady(model)

    def checkpoint(
        self,
        inputs: Iterable[Path],  # noqa: ARG002
        name: str = "search",  # noqa: ARG002
        every: int = EVERY,  # noqa: ARG002
    ) -> Checkpoint:
        """Refuse a search that has not shown its model: it would write into the run."""
        raise InputError(_no_front(self.run.folder))


def rebuilt_model(entry: RunEntry, study: Study) -> RobustResponse:
    """Return the model of a run, with the draws of its search.

    The study's own ``main`` builds it with the run's options and is left before its search; nothing
    is written.

    Parameters
    ----------
    entry : RunEntry
        The run.
    study : Study
        Its script as it is today.

    Returns
    -------
    RobustResponse

    Raises
    ------
    InputError
        An input file that has changed or is gone, options that the script does not take, or a
        study that does not search for a front.
    """
    home = study.path.resolve().parent
    for name, wanted in entry.record.get("inputs_sha256", {}).items():
        # the name that hash_files gives may be another one: a platform beside the working folder
        if wanted not in hash_files([home / name], relative_to=home).values():
            raise InputError(
                f"{home / name} has changed since run {entry.name}, which was computed from it: "
                "bring the file back as it was or run the study again"
            )
    hints = {name: parameter.annotation for name, parameter in study.parameters.items()}
    arguments = {
        name: value
        for name, value in resumed_arguments(entry, hints, {}).items()
        if name not in SAME_RESULT
    }
    context = _ModelOnly(Run(entry.folder, entry.record["seed"], created=()), relative_to=home)
    try:
        study.main(**arguments, **dict.fromkeys(study.context_names, context))
    except _ModelReady as ready:
        return ready.model
    raise InputError(_no_front(entry.folder))


def _no_front(folder: Path) -> str:
    return (
        f"run {folder} cannot be judged: its study {folder.parent.name} does not search for a "
        "front of factors with scatter"
    )


def study_script(entry: RunEntry, folder: Path) -> Path:
    """Return the script of a run's study.

    Raises
    ------
    InputError
        There is none of this name in the folder.
    """
    path = folder / f"{entry.study}.py"
    if not path.is_file():
        raise InputError(
            f"{path}: run {entry.name} is of the study {entry.study}, whose script is not there: "
            "say with --studies in which folder it is"
        )
    return path
