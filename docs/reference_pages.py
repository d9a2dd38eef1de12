"""Write the reference from the code: a page per command, study and TOML file.

``conf.py`` writes the pages into ``docs/reference`` before each build, which cannot be stale.
"""

from __future__ import annotations

import ast
import inspect
import re
import tempfile
import typing
from collections.abc import Iterator
from enum import Enum
from pathlib import Path
from typing import Any

import click
from keys_of_summaries import numbers_of
from typer.main import get_command

import deboom
from deboom.bench import example
from deboom.cli import COMMANDS, StudyCommand, app
from deboom.files.acceptance import Programme
from deboom.files.component_test import ReceiverFile
from deboom.files.folders import FOLDERS, Names, new_folder
from deboom.files.kinds import FolderKind
from deboom.files.limits import ComponentLimitsFile
from deboom.files.schema import StrictModel
from deboom.files.shipped_studies import shipped_studies
from deboom.runs.runner import question_of, study_command, study_files

KEY = re.compile(r"^(?P<out># )?(?P<key>\w+) = (?P<value>.*?)(?:  # (?P<meaning>.*))?$")
SECTION = re.compile(r"^(?:# )?\[+(?P<name>[\w.]+)\]+(?:  # (?P<about>.*))?")
ALTERNATIVE = re.compile(r"^# (?P<key>[a-z]\w+): (?P<meaning>.*)")
CONTINUED = re.compile(r"^#  +(?P<text>.*)")

SOURCE = Path(deboom.__file__).parents[1]
_SAY_NUMBERS = ("deboom.pages.", "deboom.supplier.", "deboom.runs.")
_KEYS = """These are the numbers that the study, and the pages it is made of, can say. A name in
`<>` stands for a thing of your data, such as a vehicle. A number that a run has no reason to
state is missing in it."""


def write_reference(folder: Path) -> None:
    """Write all pages into a folder, in place of those of the last build."""
    folder.mkdir(exist_ok=True)
    groups = folder.with_name("names").glob("*.md")
    listed = "".join(path.read_text(encoding="utf-8") for path in groups)
    _write(folder / "types.md", types_page(listed))
    for name, title, pages in (
        ("commands", "Commands", dict(command_pages())),
        ("studies", "Studies", dict(study_pages())),
        ("toml-files", "TOML files", dict(toml_pages())),
    ):
        (folder / name).mkdir(exist_ok=True)
        for old in set((folder / name).glob("*.md")) - {folder / name / f"{p}.md" for p in pages}:
            old.unlink()
        for page, text in pages.items():
            _write(folder / name / f"{page}.md", text)
        rows = [
            f"| [{page}]({name}/{page}.md) | {_first_line(text)} |" for page, text in pages.items()
        ]
        tree = "\n".join(["```{toctree}", ":hidden:", "", *(f"{name}/{p}" for p in pages), "```"])
        heads = ["| name | what it does |", "|---|---|"]
        _write(folder / f"{name}.md", "\n".join([f"# {title}\n", *heads, *rows, "", tree, ""]))


def argument_types() -> list[str]:
    """Return the classes in arguments and results of the public names, by their full names."""
    kinds: dict[str, type] = {}
    for name in set(deboom.__all__) - {"plot", "bench"}:
        value = getattr(deboom, name)
        called = value.__init__ if inspect.isclass(value) else value
        try:
            hints = typing.get_type_hints(called)
        except NameError:  # a type that only a checker of types imports
            continue
        for hint in hints.values():
            kinds |= {f"{kind.__module__}.{kind.__qualname__}": kind for kind in _classes(hint)}
    public = {getattr(deboom, name) for name in deboom.__all__}
    return sorted(
        name for name, kind in kinds.items() if kind not in public and not issubclass(kind, Enum)
    )


def _classes(hint: Any) -> Iterator[type]:
    """Give the classes of deboom in an annotation."""
    for part in typing.get_args(hint):
        yield from _classes(part)
    if inspect.isclass(hint) and hint.__module__.startswith("deboom."):
        yield hint


def types_page(listed: str) -> str:
    """Return the page of the types that no group of names lists."""
    names = [name for name in argument_types() if name not in listed]
    lines = [
        "# Types of arguments and results",
        "",
        "Classes that the names of the API take or return.",
        "",
    ]
    lines += ["```{eval-rst}", ".. autosummary::", "   :toctree: ../api", ""]
    return "\n".join([*lines, *(f"   {name}" for name in names), "```", ""])


def command_pages() -> Iterator[tuple[str, str]]:
    """Give the name and the page of each command, with its help as it is printed."""
    group = get_command(app)
    for names in COMMANDS.values():
        for name in names:
            command = group.commands[name]
            below = getattr(command, "commands", {})
            entries = {name: command} | {f"{name} {each}": below[each] for each in below}
            for typed, each in entries.items():
                loaded = each.loaded() if isinstance(each, StudyCommand) else each
                sentence = " ".join((each.help or "").partition("\n\n")[0].split())
                text = f"# {typed}\n\n{sentence}\n\n```text\n{_help(loaded, typed)}\n```\n"
                yield typed.replace(" ", "-"), text


def study_pages() -> Iterator[tuple[str, str]]:
    """Give the name and the page of each study: question, help with all options, and its keys."""
    for path in study_files(shipped_studies()):
        command = get_command(study_command(path, every_option=True))
        typed = path.stem if path.stem in get_command(app).commands else f"run {path.stem}"
        lines = [f"# {path.stem}", question_of(path), f"```text\n{_help(command, typed)}\n```"]
        lines += ["## Keys of summary.json", _KEYS, keys_table(path), ""]
        yield path.stem, "\n\n".join(lines)


def keys_table(study: Path) -> str:
    """Return key, unit and meaning of each number that a study and its pages may say."""
    seen: set[Path] = set()
    waiting = [study]
    while waiting:
        path = waiting.pop()
        if path not in seen and path.is_file():
            seen.add(path)
            tree = ast.parse(path.read_text(encoding="utf-8"))
            names = {
                node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)
            }
            pages = {name for name in names if name.startswith(_SAY_NUMBERS)}
            waiting += [SOURCE / f"{name.replace('.', '/')}.py" for name in pages]
    rows = {
        f"| `{key}` | {unit} | {label.replace('|', '&#124;')} |"
        for path in seen
        for key, unit, label in numbers_of(path.read_text(encoding="utf-8"), path.name)
    }
    return "\n".join(["| key | unit | meaning |", "|---|---|---|", *sorted(rows)])


def toml_pages() -> Iterator[tuple[str, str]]:
    """Give the name and the page of each file that `deboom new` writes."""
    names = Names(mounts=("TSM", "Du=left,right"))
    with tempfile.TemporaryDirectory() as folder:
        for kind in FolderKind:
            made = new_folder(Path(folder) / kind.value, kind, names)
            for path in sorted(made.glob("*.toml")):
                if path.name == FOLDERS[kind].file:
                    about = f"`deboom new {kind.value} FOLDER` writes this file."
                    yield path.stem, f"# {path.name}\n\n{about}\n\n{key_list(path)}\n"
    shipped = shipped_studies() / "data"
    for name, about, path in (
        ("rig", "A mount on a rig, for `deboom library rig`.", example.DATA / "rig.toml"),
        ("limits", "Limits of designs, for `--limits`.", shipped / "u06_limits.toml"),
        ("parts", "What parts have in common, for `--parts`.", shipped / "u06_parts.toml"),
    ):
        text = path.read_text(encoding="utf-8")
        yield name, f"# {name}.toml\n\n{about}\n\n```toml\n{text}```\n"
    for name, about, model in (
        ("receiver", "Another body, for `deboom run component_tpa --receiver`.", ReceiverFile),
        (
            "programme",
            "What a sheet says of its parts, beside a platform.",
            Programme,
        ),
        ("component-limits", "Limits of a compressor, for `--limits`.", ComponentLimitsFile),
    ):
        yield name, f"# {name}.toml\n\n{about}\n\n{keys_of_model(model)}\n"


def keys_of_model(model: type[StrictModel], section: str = "") -> str:
    """Return the keys of a file that has no template, by section, from the model that reads it."""
    source = inspect.getsource(model)
    lines, inside = [f"## [{section}]", ""] if section else [], []
    for name, field in model.model_fields.items():
        parts = list(_strict_models(field.annotation))
        inside += [(f"{section}.{name}".lstrip("."), kind) for kind in parts]
        if parts:
            continue
        meaning = rf"^    {name}: .*?(?:  # (.*)|\n    \"\"\"(.*?)\"\"\")$"
        said = re.search(meaning, source, re.MULTILINE)
        state = f", by default `{field.default!r}`"
        if field.is_required() or field.default is None:
            state = ", to fill in" if field.is_required() else ", may be left out"
        lines += [f"`{name}`{state}"]
        lines += [f": {said[1] or said[2]}", ""] if said else [""]
    return "\n".join(["\n".join(lines), *(keys_of_model(kind, name) for name, kind in inside)])


def _strict_models(hint: Any) -> Iterator[type[StrictModel]]:
    """Give the models of sections in an annotation."""
    for part in typing.get_args(hint):
        yield from _strict_models(part)
    if inspect.isclass(hint) and issubclass(hint, StrictModel):
        yield hint


def key_list(path: Path) -> str:
    """Return the keys of a commented file by section: key and value, then the meaning.

    A key that the file has behind a ``#`` must be filled in, or may be left out.
    """
    lines: list[str] = []
    for line in path.read_text(encoding="utf-8").splitlines():
        if section := SECTION.match(line):
            if f"## [{section['name']}]" not in lines:
                lines += ["", f"## [{section['name']}]", "", *filter(None, [section["about"]])]
        elif key := KEY.match(line):
            meaning, state = key["meaning"] or "", ""
            if meaning.startswith("FILL IN"):
                state = ", to fill in"
            elif key["out"]:
                state = ", may be left out"
            lines += ["", f"`{key['key']} = {key['value']}`{state}"]
            if meaning := meaning.removeprefix("FILL IN").lstrip(": "):
                lines.append(f": {meaning}")
        elif (other := ALTERNATIVE.match(line)) and lines:
            lines += ["", f"`{other['key']}`, may be left out", f": {other['meaning']}"]
        elif (more := CONTINUED.match(line)) and lines:
            lines[-1] += f" {more['text']}"
    return "\n".join(lines)


def _help(command: click.Command, typed: str) -> str:
    """Return the help as a terminal of 78 columns shows it."""
    context = click.Context(command, info_name=f"deboom {typed}", max_content_width=78)
    context.terminal_width = 78
    return command.get_help(context).rstrip()


def _first_line(text: str) -> str:
    return text.split("\n\n")[1].replace("\n", " ")


def _write(path: Path, text: str) -> None:
    """Write a page only where it has changed, so that Sphinx reads no page in vain."""
    if not path.is_file() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    write_reference(Path(__file__).with_name("reference"))
