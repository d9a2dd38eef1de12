"""Run a study: options from its signature, results into a run folder, resume."""

from __future__ import annotations

import ast
import importlib.util
import inspect
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path
from typing import Annotated, Any, get_args, get_type_hints

import typer
from pydantic import TypeAdapter, ValidationError

from deboom.errors import InputError
from deboom.files.run_folder import (
    LOCK,
    RECORD,
    Run,
    RunEntry,
    environment_record,
    find_run,
    finish_run,
    hash_files,
    held,
    start_run,
)
from deboom.report.page import render_page
from deboom.study.overview import refresh_overview
from deboom.study.result import RunContext, StudyResult

SAME_RESULT = ("workers", "scheduler")
"""Options that say who computes, not what: a resumed run may have others."""


def resumed_arguments(
    entry: RunEntry, hints: Mapping[str, Any], given: Mapping[str, Any]
) -> dict[str, Any]:
    """Return the arguments of an unfinished run.

    Parameters
    ----------
    entry : RunEntry
        The run.
    hints : mapping of str to type
        Of the parameters of the study's ``main``.
    given : mapping of str to str, int, float, bool, list or None
        Options that the user gave this time, as a record would hold them.

    Returns
    -------
    dict
        What ``main`` takes.

    Raises
    ------
    InputError
        An option given that differs from the run's, unless it cannot change the result.
    """
    recorded = dict(entry.record["arguments"])
    for name, value in given.items():
        if name in SAME_RESULT:
            recorded[name] = value
        elif recorded.get(name) != value:
            option = f"--{name.replace('_', '-')}"
            raise InputError(
                f"run {entry.name} was started with {option} {recorded.get(name)}, not {value}: "
                "leave the option out or start a new run"
            )
    try:
        return {
            name: TypeAdapter(hints[name]).validate_python(value)
            for name, value in recorded.items()
        }
    except (KeyError, ValidationError) as error:
        raise InputError(
            f"run {entry.name} has options that this study does not take ({error}): start a new run"
        ) from None


def check_same_code(entry: RunEntry, record: Mapping[str, Any]) -> None:
    """Refuse to go on with a run that another code began.

    Parameters
    ----------
    entry : RunEntry
        The run.
    record : mapping
        What its record would say if it began now.

    Raises
    ------
    InputError
        Names what differs: the study's text, Python, a package, or deboom's own revision.
    """
    if entry.record["study_text"] != record["study_text"]:
        raise InputError(
            f"run {entry.name} was started with another text of the study {entry.study}: bring the "
            f"script back as it was (its text is in {entry.folder / 'run.json'}) or start a new run"
        )
    now = dict(_versions(record["environment"]))
    for name, then in _versions(entry.record["environment"]):
        if now.get(name) != then:
            raise InputError(
                f"run {entry.name} was started with {name} {then}, now it is {now.get(name)}: "
                "go back to the former or start a new run"
            )


def _versions(environment: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    yield "Python", environment["python"]
    yield from environment["packages"].items()
    yield "deboom revision", (environment["git"] or {}).get("revision")


PACKAGES = (
    "deboom",
    "numpy",
    "scipy",
    "pandas",
    "pymoo",
    "moocore",
    "SALib",
    "numba",
    "matplotlib",
)


@contextmanager
def one_sentence_errors() -> Iterator[None]:
    """Turn an :class:`InputError` into its sentence on standard error and exit code 2."""
    try:
        yield
    except InputError as error:
        typer.echo(f"deboom: {error}", err=True)
        raise typer.Exit(2) from error


def question_of(path: Path) -> str:
    """Return the question a study asks: the first paragraph of its docstring.

    The script is parsed, not run.

    Raises
    ------
    InputError
        The file is missing, is not Python, or has no docstring.
    """
    if not path.is_file():
        raise InputError(f"{path}: there is no such study; `deboom studies` lists them")
    try:
        docstring = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8")))
    except SyntaxError as error:
        raise InputError(f"{path}: line {error.lineno} is not Python ({error.msg})") from error
    if not docstring:
        raise InputError(f"{path}: a study's docstring is its question, and this file has none")
    return " ".join(docstring.split("\n\n")[0].split())


@dataclass(frozen=True)
class Study:
    """A study script, imported.

    Parameters
    ----------
    path : Path
        The script.
    question : str
        What it asks.
    description : str
        Its whole docstring.
    main : callable
        Typed arguments in, `StudyResult` out.
    """

    path: Path
    question: str
    description: str
    main: Callable[..., StudyResult]

    @property
    def parameters(self) -> dict[str, inspect.Parameter]:
        """Parameters of ``main`` that are options, by name, with their types as annotations."""
        hints = get_type_hints(self.main, include_extras=True)
        return {
            name: parameter.replace(annotation=hints[name])
            for name, parameter in inspect.signature(self.main).parameters.items()
            if name not in self.context_names
        }

    @property
    def context_names(self) -> tuple[str, ...]:
        """Parameters of ``main`` that take the `RunContext`."""
        return tuple(
            name
            for name, hint in get_type_hints(self.main).items()
            if RunContext in (hint, *get_args(hint))
        )


def load_study(path: Path) -> Study:
    """Import a study script by its path.

    Raises
    ------
    InputError
        The file is missing, has no docstring or no function ``main``.
    """
    question = question_of(path)
    spec = importlib.util.spec_from_file_location(f"deboom_study_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise InputError(f"{path}: a study is a Python file (*.py)")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    if not callable(getattr(module, "main", None)):
        raise InputError(f"{path}: a study has a function main(...) that returns a StudyResult")
    return Study(path, question, inspect.getdoc(module) or question, module.main)


def _plain(value: Any) -> Any:
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, Path):
        here = Path.cwd()
        inside = value.is_absolute() and value.is_relative_to(here)
        return (value.relative_to(here) if inside else value).as_posix()
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value


def run_study(study: Study, out: Path, arguments: Mapping[str, Any]) -> Path:
    """Run one study and write its run folder.

    Parameters
    ----------
    study : Study
        From `load_study`.
    out : Path
        Folder that gets ``<study>/<run>/``.
    arguments : mapping
        Keyword arguments of the study's ``main``; its defaults complete them.

    Returns
    -------
    Path
        The finished run folder.

    Raises
    ------
    InputError
        Bad input, with nothing left in ``out`` unless there are evaluations to keep. These, and
        any other failure, leave ``<run>.unfinished`` for `resume_study`.
    """
    bound = inspect.Signature(list(study.parameters.values())).bind(**arguments)
    bound.apply_defaults()
    record = _record(study, bound.arguments)
    run = start_run(out, study.path.stem, seed=bound.arguments["seed"], record=record)
    try:
        return _carry_out(study, run, bound.arguments, record)
    except InputError:
        if {path.name for path in run.folder.iterdir()} <= {RECORD, LOCK}:
            run.discard()
        raise


def resume_study(study: Study, out: Path, wanted: str, given: Mapping[str, Any]) -> Path:
    """Go on with a run that was interrupted.

    Parameters
    ----------
    study : Study
        From `load_study`.
    out : Path
        Folder of all results.
    wanted : str
        Name of the run, or its folder.
    given : mapping
        Arguments that must be those of the run; the run's own complete them.

    Returns
    -------
    Path
        The finished run folder; of a run that was finished already, at once.

    Raises
    ------
    InputError
        No such run, or a run of another option, text, version or input file, each by its name.
        The run stays as it is.
    """
    entry = find_run(out, study.path.stem, wanted)
    if entry.finished:
        return entry.folder
    hints = {name: parameter.annotation for name, parameter in study.parameters.items()}
    plain = {name: _plain(value) for name, value in given.items()}
    arguments = resumed_arguments(entry, hints, plain)
    record = _record(study, arguments)
    check_same_code(entry, record)
    return _carry_out(study, entry.run(), arguments, record)


def _record(study: Study, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Gather what is known of a run before it begins."""
    return {
        "study": study.path.stem,
        "question": study.question,
        "seed": arguments["seed"],
        "arguments": {name: _plain(value) for name, value in arguments.items()},
        "environment": environment_record(PACKAGES),
        "study_text": study.path.read_text(encoding="utf-8"),
    }


def _carry_out(
    study: Study, run: Run, arguments: Mapping[str, Any], record: Mapping[str, Any]
) -> Path:
    begin = time.perf_counter()
    here = study.path.resolve().parent
    context = RunContext(run, relative_to=here)
    with held(run.folder):
        result = study.main(**arguments, **dict.fromkeys(study.context_names, context))
        used = {
            "facts": dict(result.facts),
            "inputs_sha256": hash_files(result.inputs, relative_to=here),
            "wall_time_s": round(time.perf_counter() - begin, 3),
        }
        save_result(run, result, {**record, **used})
    folder = finish_run(run)
    refresh_overview(folder.parent.parent)
    return folder


def save_result(run: Run, result: StudyResult, record: Mapping[str, Any]) -> None:
    """Save everything that a result holds, and last the final record, which has all hashes.

    Parameters
    ----------
    run : Run
        Unfinished.
    result : StudyResult
    record : mapping
        What was asked for, with ``facts``, ``inputs_sha256`` and ``wall_time_s``; a ``command``
        where it was none of ``deboom run``.
    """
    for stem, table in result.tables.items():
        run.save_table(f"{stem}.csv", table)
    for stem, png in result.figures.items():
        run.save_bytes(f"figures/{stem}.png", png)
    for stem, document in result.documents.items():
        run.save_json(f"{stem}.json", document)
    for name, content in result.attachments.items():
        run.save_bytes(name, content)
    run.save_json("summary.json", dict(result.summary))
    page = replace(result.page, provenance=_provenance(record))
    run.save_text("report.html", render_page(page))
    names = [f"{stem}.csv" for stem in result.tables]
    names += [f"figures/{stem}.png" for stem in result.figures]
    names += [f"{stem}.json" for stem in result.documents]
    names += list(result.attachments)
    saved = [run.folder / name for name in (*names, "summary.json", "report.html")]
    shown = {
        "headlines": {headline.label: headline.value for headline in result.page.headlines},
        "files_sha256": hash_files(saved, relative_to=run.folder),
    }
    run.save_json(RECORD, {**record, **shown})


def _option(name: str, value: Any) -> str:
    """Write an option as it is typed."""
    if isinstance(value, bool):
        return f"--{name}" if value else f"--no-{name}"
    return f"--{name} {value}"


def command_of(record: Mapping[str, Any]) -> str:
    """Write the command that makes a run again, with all of its options."""
    options = " ".join(
        _option(name.replace("_", "-"), item)
        for name, value in record["arguments"].items()
        if value is not None
        for item in (value if isinstance(value, list) else [value])
    )
    command = record.get("command", f"deboom run studies/{record['study']}.py")
    return f"{command} {options}"


def _provenance(record: Mapping[str, Any]) -> dict[str, Any]:
    """Gather what the page's footer says of where its numbers come from."""
    return {
        "command": command_of(record),
        "seed": record["seed"],
        "facts": record["facts"],
        "environment": record["environment"],
        "inputs": record["inputs_sha256"],
        "wall_time_s": record["wall_time_s"],
    }


def study_command(path: Path) -> typer.Typer:
    """Build the command of one study: its ``main``'s typed arguments become options."""
    study = load_study(path)
    options = [
        parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY)
        for parameter in study.parameters.values()
    ]
    common = inspect.signature(_common_options).parameters.values()
    hints = get_type_hints(_common_options, include_extras=True)
    options += [parameter.replace(annotation=hints[parameter.name]) for parameter in common]

    def command(**arguments: Any) -> None:
        context, out, resume = (arguments.pop(name) for name in ("context", "out", "resume"))
        with one_sentence_errors():
            if resume is None:
                folder = run_study(study, out, arguments)
            else:
                given = {
                    name: value
                    for name, value in arguments.items()
                    if context.get_parameter_source(name).name != "DEFAULT"
                }
                folder = resume_study(study, out, resume, given)
            typer.echo(folder.as_posix())

    command.__signature__ = inspect.Signature(options)  # type: ignore[attr-defined]
    command.__annotations__ = {option.name: option.annotation for option in options}
    command.__doc__ = study.description
    app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)
    app.command()(command)
    return app


def _common_options(
    *,
    context: typer.Context,
    out: Annotated[
        Path, typer.Option(help="Folder that gets <study>/<run>/ with all results.")
    ] = Path("results"),
    resume: Annotated[
        str | None,
        typer.Option(
            metavar="RUN",
            help="Go on with an interrupted run, by its name or folder; it keeps its options.",
        ),
    ] = None,
) -> None:
    """Declare what every study's command takes beside the study's own options."""


def run_script(file: str) -> None:
    """Run the study that calls this from its ``__main__`` block: ``run_script(__file__)``."""
    study_command(Path(file))()


def run_command(
    out: Path,
    record: Mapping[str, Any],
    work: Callable[[], StudyResult],
    *,
    relative_to: Path | None,
    begin: float,
) -> Path:
    """Carry out a command and keep its result in ``<out>/<command>/<run>/``.

    Parameters
    ----------
    out : Path
    record : mapping
        What is known before it begins; ``study`` is the command's name, ``seed`` its seed.
    work : callable
        Gives the result.
    relative_to : Path or None
        Folder that the names of the inputs count from; None: each from its own.
    begin : float
        `time.perf_counter` when the command was called [s].

    Returns
    -------
    Path
        The finished run folder.

    Raises
    ------
    InputError
        The folder cannot be written, or what `work` raises; nothing is left behind then.
    """
    run = start_run(out, record["study"], seed=record["seed"], record=dict(record))
    try:
        with held(run.folder):
            result = work()
            hashes: dict[str, str] = {}
            for path in result.inputs:
                hashes |= hash_files([path], relative_to=relative_to or path.parent)
            used = {
                "facts": dict(result.facts),
                "inputs_sha256": hashes,
                "wall_time_s": round(time.perf_counter() - begin, 3),
            }
            save_result(run, result, {**record, **used})
    except Exception:
        if {path.name for path in run.folder.iterdir()} <= {RECORD, LOCK}:
            run.discard()
        raise
    return finish_run(run)
