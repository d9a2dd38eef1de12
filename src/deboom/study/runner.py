"""Run a study script: options from the signature of its ``main``, results into a run folder."""

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
from typing import Annotated, Any, get_type_hints

import typer

from deboom.errors import InputError
from deboom.files.run_folder import Run, environment_record, finish_run, hash_files, start_run
from deboom.report.page import render_page
from deboom.study.result import StudyResult

PACKAGES = ("deboom", "numpy", "scipy", "pandas", "pymoo", "moocore", "matplotlib", "seaborn")


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
        Bad input, with nothing left in ``out``. Any other failure leaves ``<run>.unfinished``.
    """
    path = study.path
    bound = inspect.signature(study.main).bind(**arguments)
    bound.apply_defaults()
    arguments = bound.arguments
    run = start_run(out, path.stem, seed=arguments["seed"])
    begin = time.perf_counter()
    try:
        result = study.main(**arguments)
    except InputError:
        run.discard()
        raise
    record = {
        "study": path.stem,
        "question": study.question,
        "seed": arguments["seed"],
        "arguments": {name: _plain(value) for name, value in arguments.items()},
        "environment": environment_record(PACKAGES),
        "inputs_sha256": hash_files(result.inputs, relative_to=path.resolve().parent),
        "wall_time_s": round(time.perf_counter() - begin, 3),
        "study_text": path.read_text(encoding="utf-8"),
    }
    _save(run, result, record)
    return finish_run(run)


def _save(run: Run, result: StudyResult, record: Mapping[str, Any]) -> None:
    for stem, table in result.tables.items():
        run.save_table(f"{stem}.csv", table)
    for stem, png in result.figures.items():
        run.save_bytes(f"figures/{stem}.png", png)
    run.save_json("summary.json", dict(result.summary))
    run.save_json("run.json", dict(record))
    page = replace(result.page, provenance=_provenance(record))
    run.save_text("report.html", render_page(page))


def _provenance(record: Mapping[str, Any]) -> dict[str, Any]:
    """Gather what the page's footer says of where its numbers come from."""
    environment = record["environment"]
    options = " ".join(
        f"--{name.replace('_', '-')} {item}"
        for name, value in record["arguments"].items()
        if value is not None
        for item in (value if isinstance(value, list) else [value])
    )
    return {
        "command": f"deboom run studies/{record['study']}.py {options}",
        "seed": record["seed"],
        "environment": environment,
        "inputs": record["inputs_sha256"],
        "wall_time_s": record["wall_time_s"],
    }


def study_command(path: Path) -> typer.Typer:
    """Build the command of one study: its ``main``'s typed arguments become options."""
    study = load_study(path)
    hints = get_type_hints(study.main, include_extras=True)
    parameters = [
        parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY, annotation=hints[name])
        for name, parameter in inspect.signature(study.main).parameters.items()
    ]
    out = inspect.Parameter(
        "out",
        inspect.Parameter.KEYWORD_ONLY,
        default=Path("results"),
        annotation=Annotated[
            Path, typer.Option(help="Folder that gets <study>/<run>/ with all results.")
        ],
    )

    def command(**options: Any) -> None:
        folder = options.pop("out")
        with one_sentence_errors():
            typer.echo(run_study(study, folder, options).as_posix())

    command.__signature__ = inspect.Signature([*parameters, out])  # type: ignore[attr-defined]
    command.__annotations__ = {**{p.name: p.annotation for p in parameters}, "out": out.annotation}
    command.__doc__ = study.description
    app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)
    app.command()(command)
    return app


def run_script(file: str) -> None:
    """Run the study that calls this from its ``__main__`` block: ``run_script(__file__)``."""
    study_command(Path(file))()
