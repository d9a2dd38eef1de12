"""Run a study: options from its dataclass, a report into a run folder, and on after a stop.

A study is a file with a docstring, whose first paragraph is its question, and three names:

- ``Options``: a frozen dataclass with a default for everything but a path that the user must name,
  which is an ``Argument``; a field ``seed`` where anything is drawn; ``COMMON``, optional, names
  the options that ``--help`` shows;
- ``prepare(options)``: reads files and builds the model, without running anything long;
- ``run(model, options)``: computes, and returns a `deboom.report.Report`. A third parameter,
  ``context``, gets the `deboom.runs.result.RunContext`, where a search is kept to go on with.

A docstring that is a command's help first says what the command does; the file's ``QUESTION`` is
the question then.
"""

from __future__ import annotations

import ast
import difflib
import importlib.util
import inspect
import math
import os
import shlex
import sys
import time
import traceback
import webbrowser
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, is_dataclass, replace
from enum import Enum
from itertools import chain
from pathlib import Path
from types import ModuleType
from typing import Annotated, Any, get_type_hints

import typer
from pydantic import TypeAdapter, ValidationError
from threadpoolctl import threadpool_limits
from typer.core import TyperCommand

from deboom.errors import IncompleteReport, InputError
from deboom.files.disk import read_text
from deboom.files.front_run import SAME_RESULT
from deboom.files.run_folder import (
    LOCK,
    PACKAGES,
    RECORD,
    UNFINISHED,
    Run,
    RunEntry,
    environment_record,
    find_run,
    finish_run,
    hash_files,
    held,
    readable_runs,
    start_run,
)
from deboom.files.shipped_studies import FORMER_STUDIES, MOVED, moved_imports, shipped_studies
from deboom.names import option_name
from deboom.report import PAGE, SUMMARY, Report, Step
from deboom.runs.options import (
    argument_for,
    bands_as_declared,
    expanded,
    filled,
    hidden,
    is_hidden,
    is_lone_flag,
    is_positional,
)
from deboom.runs.overview import command_of, refresh_overview
from deboom.runs.result import RunContext
from deboom.runs.second_process import SecondProcess
from deboom.runs.sentences import errors_as_sentences

BLAS_THREADS = 1
"""Threads of linear algebra in a run: sums in another order would change last bits."""
SHOWN_HEADLINES = 4
"""Headline numbers of a run without a verdict, at its end."""
SEED_WITHOUT_DRAWS = 1
"""Seed in the name and record of a run whose study draws nothing."""
SHORT_HASH = 12
"""Digits of a hash in a sentence."""


def study_files(folder: Path | None = None) -> list[Path]:
    """List the studies of a folder; by default those of ``studies`` here, else deboom's own."""
    if folder is None:
        here = Path("studies")
        folder = here if here.is_dir() else shipped_studies()
    return sorted(path for path in folder.glob("*.py") if not path.name.startswith("_"))


def find_study(wanted: str | Path, folder: Path | None = None) -> Path:
    """Return the file of a study that is given as a path or by its bare name.

    - `wanted`: ``studies/front.py`` or ``front``, or the name that it had in version 0.3.
    - `folder`, optional: folder where a bare name is looked up; see `study_files`.
    - raises InputError: there is no such study; the nearest name is given.
    """
    path = Path(wanted)
    if path.is_file():
        return path
    files = study_files(folder)
    names = [file.stem for file in files]
    if str(wanted) in names:
        return files[names.index(str(wanted))]
    if former := FORMER_STUDIES.get(path.stem):
        return find_study(former.today, folder)
    if path.stem in MOVED:
        raise InputError(f"{wanted}: {MOVED[path.stem]}")
    near = difflib.get_close_matches(path.stem, names, n=1)
    hint = f"; did you mean {near[0]}?" if near else ""
    raise InputError(f"{wanted}: there is no such study; `deboom studies` lists them{hint}")


def question_of(path: Path) -> str:
    """Return the question a study asks: the first paragraph of its docstring.

    The file is parsed, not run.

    - raises InputError: the file is missing, is not Python, or has no docstring.
    """
    path = find_study(path)
    try:
        tree = ast.parse(read_text(path))
        docstring = ast.get_docstring(tree)
    except SyntaxError as error:
        where = f": line {error.lineno}" if error.lineno else ""
        raise InputError(f"{path}{where} is not Python ({error.msg})") from error
    except (ValueError, RecursionError, MemoryError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path} is not Python ({error or 'nested too deeply'})") from None
    if not docstring:
        raise InputError(f"{path}: a study's docstring is its question, and this file has none")
    for node in tree.body:
        match node:
            case ast.Assign(targets=[ast.Name(id="QUESTION")], value=ast.Constant(value=str(said))):
                return said
    return " ".join(docstring.split("\n\n")[0].split())


@dataclass(frozen=True, eq=False)
class Study:
    """A study, imported.

    - `path`: its file.
    - `question`: what it asks.
    - `module`: with ``Options``, ``prepare`` and ``run``.
    - `defaults`: defaults of options that are not those of ``Options``, by name.
    """

    path: Path
    question: str
    module: ModuleType
    defaults: Mapping[str, Any] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Name of its file and of its folder of results."""
        return self.path.stem

    @property
    def description(self) -> str:
        """Its whole docstring."""
        return inspect.getdoc(self.module) or self.question

    @property
    def parameters(self) -> dict[str, inspect.Parameter]:
        """Options of the command line by name, with their types as annotations.

        A path that the user must name has no default.
        """
        return {
            name: parameter.replace(default=self.defaults[name])
            if name in self.defaults
            else parameter
            for name, parameter in expanded(self.module.Options).items()
        }

    @property
    def positional(self) -> list[str]:
        """Options that are typed by their place."""
        return [name for name, parameter in self.parameters.items() if is_positional(parameter)]

    def command(self, arguments: Mapping[str, Any]) -> str:
        """Return the command and its paths, without options; `arguments` has all by name."""
        paths = map(_recorded, self._named_paths(arguments))
        return " ".join(["deboom", self.name, *map(shlex.quote, paths)])

    def _named_paths(self, arguments: Mapping[str, Any]) -> list[Any]:
        """Return the paths that the user names; none where a study does without."""
        values = [arguments[name] for name in self.positional if arguments[name] is not None]
        return list(chain(*map(_items, values)))

    def inputs_from(self, arguments: Mapping[str, Any]) -> Path:
        """Return the folder from which input files are named.

        It is that of the study; that which the user names, or with several the working folder.
        """
        paths = self._named_paths(arguments)
        if not paths:
            return self.path.resolve().parent
        return Path(paths[0]) if len(paths) == 1 else Path.cwd()

    def _options(self, arguments: Mapping[str, Any]) -> Any:
        return filled(self.module.Options, {**self.defaults, **arguments})

    def effective(self, arguments: Mapping[str, Any]) -> dict[str, Any]:
        """Return all options by name as the study takes them: one may decide over others.

        - raises InputError: options that exclude each other.
        """
        options = expanded(self._options(arguments))
        return {name: option.default for name, option in options.items()}

    def model(self, arguments: Mapping[str, Any]) -> Any:
        """Build the model for these options, without a run."""
        return self.module.prepare(self._options(arguments))

    def report(self, arguments: Mapping[str, Any], context: RunContext | None = None) -> Report:
        """Run the study with these options; the others have their defaults."""
        options = self._options(arguments)
        run = self.module.run
        further = (context,) if len(inspect.signature(run).parameters) > 2 else ()
        report = run(self.module.prepare(options), options, *further)
        if not isinstance(report, Report):
            raise InputError(f"{self.path}: run(model, options) returns no Report")
        return report


def load_study(study: str | Path) -> Study:
    """Import a study by its path or name.

    - raises InputError: the file is missing, has no docstring, lacks ``Options``, ``prepare`` or
      ``run``, or has options without a default.
    """
    path = find_study(study)
    question = question_of(path)
    module = _module(path)
    missing = [n for n in ("Options", "prepare", "run") if not hasattr(module, n)]
    if missing:
        raise InputError(
            f"{path}: a study has a class Options, prepare(options) and run(model, options); "
            f"there is no {missing[0]}"
        )
    if not is_dataclass(module.Options):
        raise InputError(f"{path}: Options is a frozen dataclass; write @dataclass(frozen=True)")
    loaded = Study(path, question, module)
    try:
        options = loaded.parameters
    except (TypeError, NameError) as error:
        raise InputError(f"{path}: every option has a default and a type: {error}") from None
    for name, option in options.items():
        if option.default is option.empty and not is_positional(option):
            raise InputError(
                f"{path}: option {name} has no default: give it one, or make it an Argument"
            )
    former = FORMER_STUDIES.get(Path(study).stem)
    if former is not None and former.today == path.stem:
        return replace(loaded, defaults=former.defaults)
    return loaded


def _module(path: Path) -> ModuleType:
    """Import a file; deboom's own studies as modules of the package, which are imported once."""
    shipped = path.resolve().parent == shipped_studies().resolve()
    name = f"deboom.studies.{path.stem}" if shipped else f"deboom_study_{path.stem}"
    if shipped and name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise InputError(f"{path}: a study is a Python file (*.py)")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look their annotations up there
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        del sys.modules[name]
        if shipped or isinstance(error, InputError):
            raise
        if isinstance(error, ImportError) and (moved := moved_imports(read_text(path))):
            raise InputError(
                f"{path} imports names that have moved since it was written: {'; '.join(moved)}"
            ) from error
        here = [
            f.lineno for f in traceback.extract_tb(error.__traceback__) if f.filename == str(path)
        ]
        where = f" line {here[-1]}" if here else ""
        what = f"{type(error).__name__}: {error}"
        raise InputError(f"{path}{where} cannot be imported ({what}): correct it") from error
    return module


def _recorded(value: Any) -> Any:
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, Path):
        here = Path.cwd()
        inside = value.is_absolute() and value.is_relative_to(here)
        return (value.relative_to(here) if inside else value).as_posix()
    if isinstance(value, list | tuple):
        return [_recorded(item) for item in value]
    return value


def run_study(study: Study, out: Path, arguments: Mapping[str, Any]) -> Path:
    """Run one study and write its run folder.

    - `out`: folder that gets ``<study>/<run>/``.
    - `arguments`: options by name; the study's defaults complete them.
    - returns the finished run folder.
    - raises InputError: bad input, with nothing left in ``out`` unless there are evaluations to
      keep. These, and any other failure, leave ``<run>.unfinished`` for `resume_study`.
    - raises IncompleteReport: figures that failed; the run is finished all the same.
    """
    bound = inspect.Signature(list(study.parameters.values())).bind(**arguments)
    bound.apply_defaults()
    arguments = study.effective(bound.arguments)
    record = _record(study, arguments)
    run = start_run(out, study.name, seed=record["seed"], record=record)
    try:
        return _carry_out(study, run, arguments, record)
    except BaseException as error:
        # nobody goes on with a run that has nothing but its record; a failure may be looked into
        if study.positional or isinstance(error, InputError | KeyboardInterrupt):
            _discard_empty(run)
        raise


def run_once(study: Study, arguments: Mapping[str, Any], out: Path) -> Path:
    """Return a finished run of a study with these options: one that is there, or a new one.

    - `arguments`, `out`: as for `run_study`. A run in `out` of the same options, code and versions
      is taken as it is; one that was interrupted goes on. Files that the user names may have
      changed since: this is for studies of shipped and virtual data.
    - raises InputError: as `run_study` and `resume_study`.
    """
    record = _record(study, study.effective(arguments))
    runs = readable_runs(out)[0] if out.is_dir() else ()
    alike = [
        entry
        for entry in runs
        if entry.study == study.name
        and entry.record["arguments"] == record["arguments"]
        and not _changes_of_code(entry, record)
    ]
    for entry in reversed(alike):
        if entry.finished:
            return entry.folder
    for entry in alike:
        if entry.state == "unfinished" and not study.positional:
            return resume_study(study, out, entry.name, {})
    return run_study(study, out, arguments)


def resume_study(
    study: Study, out: Path, wanted: str, given: Mapping[str, Any], *, other_code: bool = False
) -> Path:
    """Go on with a run that was interrupted and return its finished folder.

    - `wanted`: name of the run, or its folder; `out`: folder of all results.
    - `given`: options that must be those of the run; the run's own complete them.
    - `other_code`: go on although the study, deboom or a package has changed; the record then names
      what the run began with.
    - raises InputError: no such run, or a run of another option, text, version or input file, each
      by its name. The run stays as it is.
    """
    entry = find_run(out, study.name, wanted)
    if entry.finished:
        if given:
            arguments_of(entry, study, given)  # of another question there is no result here
        return entry.folder
    arguments = arguments_of(entry, study, given)
    record = _record(study, arguments)
    changes = _changes_of_code(entry, record)
    if changes and not other_code:
        version = entry.record["environment"]["packages"].get("deboom", "unknown")
        raise InputError(
            f"run {entry.name} was started with {changes[0]}: resume it with the versions that "
            f"wrote it (deboom {version}), start a new run, or insist with --other-code"
        )
    if changes:
        record["begun_with"] = changes
    return _carry_out(study, entry.run(), arguments, record)


def arguments_of(
    entry: RunEntry, study: Study, given: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """Return the options of a run of a study.

    - `entry`: the run.
    - `study`: its study as it is today.
    - `given`, optional: options that a user gives with ``--resume``.
    - raises InputError: an option that is not the run's, or one that the study does not take any
      more.
    """
    recorded = {**entry.record.get("positional", {}), **entry.record["arguments"]}
    if entry.study in FORMER_STUDIES and entry.study != study.name:
        recorded = FORMER_STUDIES[entry.study].arguments(recorded)
    for name, value in (given or {}).items():
        plain = _recorded(value)
        if name in SAME_RESULT:
            recorded[name] = plain
        elif recorded.get(name) != plain:
            option = f"--{option_name(name)}"
            raise InputError(
                f"run {entry.name} was started with {option} {recorded.get(name)}, not {plain}: "
                "leave the option out or start a new run"
            )
    hints = {name: parameter.annotation for name, parameter in study.parameters.items()}
    try:
        return {
            name: TypeAdapter(hints[name]).validate_python(value)
            for name, value in recorded.items()
        }
    except (KeyError, ValidationError) as error:
        raise InputError(
            f"run {entry.name} has options that this study does not take ({error}): start a new run"
        ) from None


def _changes_of_code(entry: RunEntry, record: Mapping[str, Any]) -> list[str]:
    """Say what a run began with that is another thing now."""
    changes = []
    if entry.record["study_text"] != record["study_text"]:
        changes.append(
            f"another text of the study {entry.study} (its text is in {entry.folder / RECORD})"
        )
    now = dict(_versions(record["environment"]))
    for name, then in _versions(entry.record["environment"]):
        if now.get(name) != then:
            changes.append(f"{name} {then}, now it is {now.get(name)}")
    return changes


def _versions(environment: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    yield "Python", environment.get("python", "unknown")
    yield from environment.get("packages", {}).items()
    yield "sources of deboom", environment.get("sources_sha256", "unknown")[:SHORT_HASH]


def _record(study: Study, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Gather what is known of a run before it begins."""
    paths = {name: _recorded(arguments[name]) for name in study.positional}
    record: dict[str, Any] = {"study": study.name, "question": study.question}
    if paths:
        record |= {"command": study.command(arguments), "positional": paths}
    return {
        **record,
        "seed": arguments.get("seed", SEED_WITHOUT_DRAWS),
        "arguments": {
            name: _recorded(value)
            for name, value in arguments.items()
            if name not in paths and not (value is False and is_lone_flag(study.parameters[name]))
        },
        "environment": environment_record(PACKAGES),
        "study_text": study.path.read_text(encoding="utf-8"),
    }


def _items(value: Any) -> list[Any]:
    return list(value) if isinstance(value, list | tuple) else [value]


def _carry_out(
    study: Study, run: Run, arguments: Mapping[str, Any], record: Mapping[str, Any]
) -> Path:
    begin = time.perf_counter()
    here = study.inputs_from(arguments)
    try:
        with (
            held(run.folder),
            threadpool_limits(BLAS_THREADS, "blas"),
            SecondProcess() as second,
        ):
            context = RunContext(run, here, command_of(record), second)
            report = study.report(arguments, context)
            hashes = hash_files(report.inputs, relative_to=here)
            _save(run, report, record, hashes, begin, second)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(_kept(study, run)) from None
    folder = finish_run(run)
    refresh_overview(folder.parent.parent)
    _tell_answer(report, folder)
    _tell_failures(report, folder)
    return folder


def _kept(study: Study, run: Run) -> str:
    """Say what a run that is stopped keeps, and how it goes on."""
    every = run.folder.glob("*/evaluations/*.npz")
    n_kept = sum(path.stem.strip("0") != "" for path in every)  # 0 is what descents found
    kept = [f"{n_kept} generations"] if n_kept else []
    if (run.folder / SUMMARY).exists():
        kept.append("all tables")
    if not kept:
        return "stopped before anything was computed that could be kept"
    if study.positional:
        return f"stopped: {' and '.join(kept)} are kept in {run.folder}"
    name = run.folder.name.removesuffix(UNFINISHED)
    return (
        f"stopped: {' and '.join(kept)} are kept in {run.folder}; go on with "
        f"`deboom run {study.path.as_posix()} --out {run.folder.parents[1]} --resume {name}`"
    )


def _tell_answer(report: Report, folder: Path) -> None:
    """Say what came out, where its page is, and what may be done next."""
    headlines = [f"{value}: {label}" for label, value in report.headlines.items()]
    lines = [report.verdict] if report.verdict else headlines[:SHOWN_HEADLINES]
    lines.append(f"page: {(folder / PAGE).as_posix()}")
    steps = [block for part in report.panels for block in part.blocks if isinstance(block, Step)]
    lines += [f"next: {step.command}  ({step.purpose})" for step in steps[:1]]
    for line in lines:
        typer.echo(line, err=True)


def _tell_failures(report: Report, folder: Path) -> None:
    """Say which figures are missing from a folder that is complete otherwise."""
    for failure in report.failures:
        typer.echo(f"deboom: {folder}: {failure}", err=True)
    if report.failures:
        raise IncompleteReport(folder)


def _save(
    run: Run,
    report: Report,
    record: Mapping[str, Any],
    inputs: Mapping[str, str],
    begin: float,
    second: SecondProcess,
) -> None:
    """Save all that a report holds: results, then pictures, and last the record with all hashes.

    Drawing may take long, and whoever stops it keeps the results.
    """
    results = report.results()
    for name, content in results.items():
        run.save_bytes(name, content)
    second.drawn(report.every_picture)
    figures = {f"figures/{stem}.png": png for stem, png in report.figures.items()}
    for name, content in figures.items():
        run.save_bytes(name, content)
    used = {
        **record,
        "started": run.started,
        "facts": report.facts,
        "inputs_sha256": dict(inputs),
        "wall_time_s": round(time.perf_counter() - begin, 3),
    }
    pages = report.html_pages(_provenance(used))
    for name, content in pages.items():
        run.save_bytes(name, content)
    saved = [run.folder / name for name in (*results, *figures, *pages)]
    hashes = hash_files(saved, relative_to=run.folder)
    run.save_json(RECORD, {**used, "files_sha256": hashes})


def _discard_empty(run: Run) -> None:
    """Remove the folder of a run that holds nothing to keep."""
    if {path.name for path in run.folder.iterdir()} <= {RECORD, LOCK}:
        run.discard()


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


class _BandCommand(TyperCommand):
    """A command whose bands of frequency may be typed ``20 60``, ``20-60`` or ``20,60``."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read a command line."""
        widths = {name: option.nargs for option in self.params for name in option.opts}
        return super().parse_args(ctx, bands_as_declared(args, widths))


def study_command(wanted: str | Path, *, every_option: bool = False) -> typer.Typer:
    """Build the command of one study, by its path or name: its options are those typed.

    A study of paths that the user names is too short to be resumed. An option that its study hides,
    such as ``--platform``, is shown as an argument that is typed by its place.

    - `every_option`: the help shows also those that are not in ``Options.COMMON``.
    """
    study = load_study(wanted)
    if study.name != Path(wanted).stem:
        typer.echo(
            f"the study {Path(wanted).stem} is {study.name} now; from 0.5 on only this "
            "name is taken",
            err=True,
        )
    hints = get_type_hints(_common_options, include_extras=True)
    common = list(inspect.signature(_common_options).parameters)
    if study.positional:
        common = ["context", "out", "show_page"]
        hints["out"] = Annotated[
            Path, typer.Option(help=f"Folder in which {study.name}/<run>/ is made.")
        ]
    declared = inspect.signature(_common_options).parameters
    common_options = getattr(study.module.Options, "COMMON", study.parameters)
    typed_by_place = [name for name, option in study.parameters.items() if is_hidden(option)]
    rare = study.parameters.keys() - {*common_options, *typed_by_place}
    options = [
        hidden(option) if name in rare and not every_option else option
        for name, option in study.parameters.items()
    ]
    options += [declared[name].replace(annotation=hints[name]) for name in common]
    by_place = {f"{name}_": name for name in typed_by_place}
    options += [argument_for(study.parameters[n], named=place) for place, n in by_place.items()]

    def command(**arguments: Any) -> None:
        context, out = arguments.pop("context"), arguments.pop("out")
        placed = {name: arguments.pop(place) for place, name in by_place.items()}
        placed = {name: value for name, value in placed.items() if value is not None}
        resume, other_code = arguments.pop("resume", None), arguments.pop("other_code", False)
        shown = arguments.pop("show_page")
        _check_numbers(arguments)
        given = {
            name: value
            for name, value in arguments.items()
            if context.get_parameter_source(name).name != "DEFAULT"
        }
        arguments, given = {**arguments, **placed}, {**given, **placed}
        # the framework ends Ctrl-C of this inner command itself, without our sentence
        with errors_as_sentences():
            if resume is None:
                folder = run_study(study, out, arguments)
            else:
                folder = resume_study(study, out, resume, given, other_code=other_code)
        typer.echo(folder.as_posix())
        if shown:
            _open_page(folder / PAGE)

    command.__signature__ = inspect.Signature(options)  # type: ignore[attr-defined]
    command.__annotations__ = {option.name: option.annotation for option in options}
    command.__doc__ = study.description
    app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)
    more = f"`deboom run {study.name} --help-all` shows {len(rare)} more options." if rare else ""
    app.command(cls=_BandCommand, epilog="" if every_option else more)(command)
    return app


def _open_page(page: Path) -> None:
    """Open a page in the browser; without a display nothing is done, and said."""
    on_unix = sys.platform not in ("win32", "darwin")
    if on_unix and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        typer.echo(f"--open: there is no display; the page is {page.as_posix()}", err=True)
        return
    webbrowser.open(page.resolve().as_uri())


def _check_numbers(arguments: Mapping[str, Any]) -> None:
    """Refuse numbers that no option means, before any work."""
    for name, value in arguments.items():
        values = value if isinstance(value, tuple | list) else (value,)
        option = f"--{option_name(name)} {value}"
        if any(isinstance(each, float) and not math.isfinite(each) for each in values):
            raise InputError(f"{option}: give a finite number")
        if name == "tolerance" and not 0.0 < value < 1.0:
            raise InputError(f"{option}: a tolerance lies between 0 and 1, both excluded")


def _common_options(
    *,
    context: typer.Context,
    out: Annotated[
        Path, typer.Option(help="Folder in which <study>/<run>/ is made, with all results.")
    ] = Path("results"),
    show_page: Annotated[
        bool,
        typer.Option(
            "--open", help="Open the page in the browser at the end; this needs a display."
        ),
    ] = False,
    resume: Annotated[
        str | None,
        typer.Option(
            metavar="RUN",
            help="Continue an interrupted run, given by name, folder or latest, with its options.",
        ),
    ] = None,
    other_code: Annotated[
        bool,
        typer.Option(
            "--other-code",
            help="With --resume: continue although deboom, the study or a package has changed.",
        ),
    ] = False,
) -> None:
    """Declare what every study's command takes beside the study's own options."""
