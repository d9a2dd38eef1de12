"""Finished runs, opened with their model built again."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path, PurePosixPath

import numpy as np

from deboom.errors import InputError
from deboom.explore.choices import Pick
from deboom.explore.front import replicates
from deboom.explore.robust import Robust
from deboom.files.disk import read_text
from deboom.files.front_run import SAME_RESULT, ComparedRun, PlatformModel, RobustModel
from deboom.files.front_table import FRONT
from deboom.files.run_folder import RunEntry, check_files, hash_files, read_run
from deboom.files.shipped_studies import FORMER_STUDIES, shipped_studies
from deboom.pages.supplier_study import SupplierStudy
from deboom.runs.runner import Study, arguments_of, load_study, study_files
from deboom.runs.search import ThoroughSearchOptions
from deboom.vehicles.booming_model import BoomingModel

BUDGET = {*SAME_RESULT, *(item.name for item in fields(ThoroughSearchOptions))}
"""Options that say how long is searched: a model is built without them."""


def prepared_again(
    entry: RunEntry, study: Study, prepared: dict[str, object] | None = None
) -> object:
    """Prepare a run's model again with `study`, as it is today.

    - `prepared`, optional: models by study, options and files, which runs of one question share;
      this one is added.
    - raises InputError: an input file that has changed or is gone, options it does not take.
    """
    home = study.path.resolve().parent
    for name, wanted in (entry.record.get("inputs_sha256") or {}).items():
        if not (home / name).exists():
            raise InputError(
                f"{home / name} is not there, and run {entry.name} was computed from it: bring it "
                "back; if the script of the run lies in another folder than "
                f"{home}, say in which with --studies"
            )
        # the name that hash_files gives may be another one: a platform beside the working folder
        if wanted not in hash_files([home / name], relative_to=home).values():
            raise InputError(
                f"{home / name} has changed since run {entry.name}, which was computed from it: "
                "bring the file back as it was or run the study again"
            )
    arguments = {n: v for n, v in arguments_of(entry, study).items() if n not in SAME_RESULT}
    recorded = {n: v for n, v in entry.record["arguments"].items() if n not in BUDGET}
    key = json.dumps([study.path.read_text(encoding="utf-8"), recorded, _inputs(entry)])
    models = {} if prepared is None else prepared
    if key not in models:
        models[key] = study.model(arguments)
    return models[key]


def rebuilt_model(
    entry: RunEntry, study: Study, prepared: dict[str, object] | None = None
) -> RobustModel:
    """Build the model of a run again, with the draws of its search.

    - raises InputError: as `prepared_again`; a study that does not search for a front.
    """
    model = prepared_again(entry, study, prepared)
    if isinstance(model, RobustModel) and isinstance(model.robust, Robust):
        return model
    raise InputError(
        f"run {entry.folder} cannot be judged: its study {entry.study} does not search for a "
        "front of factors with scatter"
    )


def study_of(entry: RunEntry, folder: Path | None) -> Study:
    """Return the study of a run.

    A run may lie in an archive that somebody sent, with a script in its folder ``studies``: a
    script is imported only from deboom's own folder, or from one that the user names.

    - `folder` or None: folder with the studies; None: deboom's own.
    - raises InputError: there is none of this name in the folder, or the run is of the script in
      ``studies`` here: the user says so with ``--studies``.
    """
    here = Path("studies")
    scripts = {path.stem: path for path in study_files(folder or shipped_studies())}
    former = FORMER_STUDIES.get(entry.study)
    script = scripts.get(entry.study) or (scripts.get(former.today) if former else None)
    beside = here / f"{entry.study}.py"
    of_this = folder is None and beside in study_files(here) and _is_of(beside, entry)
    if of_this and not (script is not None and _is_of(script, entry)):
        raise InputError(
            f"{beside}: run {entry.name} was made by this script; deboom imports no script that "
            "lies beside results unless you say so: --studies studies"
        )
    if script is not None:
        return load_study(script)
    raise InputError(
        f"{(folder or here) / entry.study}.py: run {entry.name} is of the study "
        f"{entry.study}, whose script is not there: say with --studies in which folder it is"
    )


def _is_of(script: Path, entry: RunEntry) -> bool:
    """Tell whether a script is, letter by letter, the one that a run was made by."""
    return read_text(script) == entry.record.get("study_text")


REPRODUCED = 1e-6
"""Relative difference up to which a model built again is the run's own [1]."""
PLATFORM_FILE = "platform.toml"


def compared_run(
    folder: Path, studies: Path | None, prepared: dict[str, object] | None = None
) -> ComparedRun:
    """Read a run and build its model again.

    - `folder`: of the run.
    - `studies` or None: folder with the studies; see `study_of`.
    - `prepared`, optional: models that runs of one question share; see `prepared_again`.
    - raises InputError: a folder that is no finished run of a front study, a file of it that is
      missing or edited, an input file that has changed, or a model that does not give the run's own
      figures again.
    """
    entry = read_run(folder)
    check_files(entry)
    front = entry.front
    study = study_of(entry, studies)
    model = rebuilt_model(entry, study, prepared)
    missing = [label for label in model.robust.space.labels if label not in front.variables]
    if missing:
        raise InputError(f"{entry.folder / FRONT} has no column {missing[0]}")
    front = replace(front, variables=tuple(model.robust.space.labels))
    changed = study.path.read_text(encoding="utf-8") != entry.record["study_text"]
    run = ComparedRun(entry=entry, prepared=model, front=front, text_changed=changed)
    _check_reproduced(run)
    return run


def _check_reproduced(run: ComparedRun) -> None:
    """Refuse a model that does not give the verified figures of a few designs again."""
    entry = run.entry
    draws = entry.record.get("facts", {}).get("verification_draws")
    try:
        objectives = run.front.objectives
    except InputError as error:
        raise InputError(
            f"run {entry.folder} of {entry.study}: {error}: this command needs them; run the study "
            "again"
        ) from None
    if draws is None:
        raise InputError(
            f"run {entry.folder} of {entry.study} does not say with how many draws its front was "
            "verified: run the study again"
        )
    rows = np.unique([0, len(objectives) // 2, len(objectives) - 1])
    values = replicates(run.model, draws, seed=run.seed)(run.designs[rows])
    sums = np.column_stack([values.mean_sum, values.sigma_sum])
    if not np.allclose(sums, objectives[rows], rtol=REPRODUCED):
        raise InputError(
            f"the study {entry.study} of today does not give the figures of run {entry.folder} "
            "again: bring its script and deboom back as they were, or run it again"
        )


def check_same_platform(runs: Sequence[ComparedRun]) -> None:
    """Refuse runs whose common input files differ, or that have files but none in common.

    - raises InputError: names the first file that differs.
    """
    first = _inputs(runs[0].entry)
    for run in runs[1:]:
        other = _inputs(run.entry)
        both = sorted(first.keys() & other.keys())
        changed = [name for name in both if first[name] != other[name]]
        if changed or (not both and (first or other)):  # of virtual cars no run has files
            reason = f"{changed[0]} differs" if changed else "they share no input file"
            raise InputError(
                f"{runs[0].entry.folder} and {run.entry.folder} are runs of different platforms "
                f"({reason}): only runs of the same data can be compared"
            )


def check_same_question(runs: Sequence[ComparedRun]) -> None:
    """Refuse runs of other variables, responses or objectives, or of more than two objectives.

    - raises InputError: names what differs.
    """
    first = runs[0]
    for run in runs[1:]:
        for what, mine, theirs in (
            ("design variables", first.model.space.names, run.model.space.names),
            ("vehicles", first.model.evaluate.response_names, run.model.evaluate.response_names),
            ("objectives", _objectives(first), _objectives(run)),
        ):
            if mine != theirs:
                raise InputError(
                    f"{first.entry.folder} and {run.entry.folder} have different {what} "
                    f"({', '.join(mine)} and {', '.join(theirs)}): their fronts cannot be compared"
                )
    if len(_objectives(first)) != 2:
        raise InputError("only fronts of two objectives can be compared")


def distinct_models(runs: Sequence[ComparedRun]) -> list[ComparedRun]:
    """Return one run per model: the first of those whose models give the same figures."""
    distinct: list[ComparedRun] = []
    for run in runs:
        if not any(_same_model(run, other) for other in distinct):
            distinct.append(run)
    return distinct


def _same_model(run: ComparedRun, other: ComparedRun) -> bool:
    if run.model.n_draws != other.model.n_draws:
        return False
    rows = np.unique([0, len(run.designs) - 1])
    model = replace(other.model, sample=run.model.sample)
    mine, theirs = (evaluate(run.designs[rows]).objectives for evaluate in (run.model, model))
    return bool(np.allclose(mine, theirs, rtol=REPRODUCED))


def _objectives(run: ComparedRun) -> tuple[str, ...]:
    return tuple(objective.name for objective in run.model.objectives)


def _inputs(entry: RunEntry) -> dict[str, str]:
    """Return the hashes of a run's input files, those of its platform by their place in it."""
    hashes = entry.record["inputs_sha256"]
    homes = [PurePosixPath(n).parent for n in hashes if PurePosixPath(n).name == PLATFORM_FILE]
    named = {}
    for name, digest in hashes.items():
        path = PurePosixPath(name)
        inside = [home for home in homes if path.is_relative_to(home)]
        named[(path.relative_to(inside[0]) if inside else path).as_posix()] = digest
    return named


def supplier_study(folder: Path, studies: Path | None, pick: Pick | Path) -> SupplierStudy:
    """Read the run of a front study and build its model again.

    Parameters
    ----------
    folder : Path
        Of the finished run.
    studies : Path or None
        Folder with the script of the run; None: deboom's own.
    pick : Pick or Path
        The design that is wanted, or a file that holds it.

    Raises
    ------
    InputError
        See `deboom.runs.rebuilt.compared_run`; a study without platform and mounts.
    """
    return supplier_study_of(compared_run(folder, studies), pick)


def supplier_study_of(run: ComparedRun, pick: Pick | Path) -> SupplierStudy:
    """Return what a supplier needs of a run whose model is built again; see `supplier_study`."""
    prepared, model = run.prepared, run.model.evaluate
    if not isinstance(model, BoomingModel) or not isinstance(prepared, PlatformModel):
        raise InputError(
            f"run {run.entry.folder}: its study {run.entry.study} does not search for stiffnesses "
            "of a platform's mounts: this command takes such fronts, as of the study front"
        )
    first, last = float(model.frequency[0]), float(model.frequency[-1])
    # all vehicles: parts belong to the platform, and the model knows its own vehicles
    runs = replace(prepared.runs, fleet=prepared.runs.platform.fleet, band=(first, last))
    return SupplierStudy(run, runs, pick)
