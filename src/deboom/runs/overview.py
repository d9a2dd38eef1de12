"""Content of a results folder: a line for each run, one run in full, and a page of all runs."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote

from deboom.answer import Answer, Number
from deboom.errors import InputError
from deboom.files.disk import read_json, replace_text
from deboom.files.run_folder import RunEntry, check_files, readable_runs
from deboom.names import option_name, path_inside
from deboom.report import PAGE, SUMMARY
from deboom.report.overview import RunCard, render_overview

INDEX = "index.html"
INTERACTIVE = "interactive.html"
THUMBNAILS = ("spl_curves", "who_gains", "pareto_front", "sobol", "box", "families", "allocation")
"""Pictures that stand for a run, the first of them that it has."""
SHEETS = ("supplier/*.html", "supplier_sheet.html")
"""Pages for a supplier in a run's folder."""


def run_cards(entries: Sequence[RunEntry], results: Path) -> list[RunCard]:
    """Return what an overview of a results folder says of its runs.

    - `entries`: the runs.
    - `results`: folder that links start from.
    """
    options_of_study: dict[str, list[dict[str, Any]]] = {}
    for entry in entries:
        options_of_study.setdefault(entry.study, []).append(options(entry.record))
    cards = []
    for entry in entries:
        mine = options(entry.record)
        special = {
            name: value
            for name, value in mine.items()
            if name != "seed"
            and any(other.get(name) != value for other in options_of_study[entry.study])
        }
        cards.append(_card(entry, results, special))
    return cards


def _card(entry: RunEntry, results: Path, special: Mapping[str, Any]) -> RunCard:
    record, answer = entry.record, answer_of(entry)
    folder = quote(entry.folder.relative_to(results).as_posix())
    links = {
        name: f"{folder}/{name}" if any(files_of(entry, name)) else ""
        for name in (PAGE, INTERACTIVE)
    }
    return RunCard(
        study=entry.study,
        name=entry.name,
        question=str(record.get("question", "")),
        state=entry.state,
        started=entry.started,
        seed=int(record.get("seed", 0)),
        headlines=answer.headlines,
        folder=folder,
        report=links[PAGE],
        interactive=links[INTERACTIVE],
        special=", ".join(f"{name} {value}" for name, value in special.items()),
        call=command_of({**record, "study": entry.study}),
        platform=Path(str(record.get("arguments", {}).get("platform") or "")).name,
        verdict=answer.verdict,
        thumbnail=_thumbnail(entry, folder),
        sheets={
            sheet.stem: f"{folder}/{quote(sheet.relative_to(entry.folder).as_posix())}"
            for place in SHEETS
            for sheet in files_of(entry, place)
        },
    )


def files_of(entry: RunEntry, pattern: str) -> Iterator[Path]:
    """Yield the files of a run by their names; none that a link leads out of it."""
    for path in sorted(entry.folder.glob(pattern)):
        try:
            path_inside(entry.folder, path.relative_to(entry.folder).as_posix())
        except InputError:
            continue
        if path.is_file():
            yield path


def _thumbnail(entry: RunEntry, folder: str) -> str:
    """Return the link to the picture that stands for a run; empty where it has none."""
    pictures = {path.stem: path for path in files_of(entry, "figures/*.png")}
    stem = next((stem for stem in THUMBNAILS if stem in pictures), next(iter(pictures), ""))
    return f"{folder}/figures/{quote(pictures[stem].name)}" if stem else ""


def answer_of(entry: RunEntry) -> Answer:
    """Return the answer of a run; of one of 0.3 what its record says of it, without keys.

    Where its file is missing or edited, the verdict says so.
    """
    question = str(entry.record.get("question", ""))
    try:
        answer = entry.answer
    except InputError as error:
        return Answer("", question, verdict=str(error))
    if answer is not None:
        return answer
    kept = entry.record.get("headlines") or {}
    numbers = (Number("", None, "", str(label), str(value)) for label, value in kept.items())
    verdict = str(entry.record.get("verdict") or "")
    return Answer("", question, verdict=verdict, numbers=tuple(numbers))


def options(record: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options that a run was given, by the names of the command line."""
    return {
        option_name(name): value
        for name, value in record.get("arguments", {}).items()
        if value is not None
    }


def command_of(record: Mapping[str, Any]) -> str:
    """Write the command that makes a run again, with all of its options."""
    typed = (_typed(name, value) for name, value in options(record).items())
    command = record.get("command", f"deboom run studies/{record['study']}.py")
    return " ".join([command, *filter(None, typed)])


def _typed(name: str, value: Any) -> str:
    """Write an option as it is typed: texts of a list repeat it, two numbers follow it."""
    if isinstance(value, bool):
        return f"--{name}" if value else f"--no-{name}"
    words = [shlex.quote(str(item)) for item in (value if isinstance(value, list) else [value])]
    if isinstance(value, list) and any(isinstance(item, str) for item in value):
        return " ".join(f"--{name} {word}" for word in words)
    return " ".join([f"--{name}", *words]) if value not in ("", []) else ""


def refresh_overview(results: Path) -> Path | None:
    """Write the page of all runs anew, in one step.

    - `results`: folder of all results; gets ``index.html``.
    - returns the page; None, with a line on standard error, where it cannot be written: a run that
      has ended well must not fail for it.
    """
    try:
        entries, damaged = readable_runs(results)
        page = render_overview(run_cards(entries, results), [str(error) for error in damaged])
        replace_text(results / INDEX, page)
    # whatever stands in the folder beside it: a run that has ended well does not fail for a page
    except Exception as error:
        print(f"deboom: no overview: {error}", file=sys.stderr)
        return None
    return results / INDEX


def list_lines(results: Path) -> Iterator[str]:
    """Yield the runs of a results folder as text, by study and time, and what is damaged.

    - raises InputError: there is no such folder.
    """
    entries, damaged = readable_runs(results)
    study = None
    for entry, card in zip(entries, run_cards(entries, results), strict=True):
        if card.study != study:
            study = card.study
            yield f"{study}: {card.question}"
        yield f"{card.state:10}  {study}  {entry.folder.as_posix()}"
        numbers = "; ".join(f"{value} ({label})" for label, value in card.headlines.items())
        about = ", ".join(filter(None, (card.started, f"seed {card.seed}", card.special)))
        yield f"            {about}{': ' if numbers else ''}{numbers}"
    for error in damaged:
        yield f"damaged     {error}"


def show_lines(entry: RunEntry) -> Iterator[str]:
    """Yield everything that there is to say of a run, as text."""
    record, answer = entry.record, answer_of(entry)
    units = {number.key: number.unit.removeprefix("1") for number in answer.numbers}
    yield f"{entry.folder.as_posix()}  ({entry.state}, seed {record.get('seed')})"
    yield str(record.get("question", ""))
    yield from filter(None, (answer.verdict, *answer.remarks))
    yield from _block("Options", options(record))
    yield from _block("Headlines", answer.headlines)
    numbers = _summary(entry).items()
    yield from _block(
        SUMMARY, {key: f"{_number(value)} {units.get(key, '')}".strip() for key, value in numbers}
    )
    yield from _block("Settled by the study", record.get("facts", {}))
    environment = record.get("environment", {})
    git = environment.get("git") or {}
    versions = {"Python": environment.get("python"), **environment.get("packages", {})}
    if git:
        versions["revision"] = f"{git['revision']}{', changed' if git['dirty'] else ''}"
    yield from _block("Versions", {name: text for name, text in versions.items() if text})
    yield ""
    yield _whole(entry)


def key_lines(entry: RunEntry) -> Iterator[str]:
    """Yield the keys of a run's ``summary.json`` with unit and meaning.

    - raises InputError: a run of 0.3, whose keys only the documentation explains; an answer that is
      missing or edited.
    """
    answer = entry.answer
    if answer is None:
        raise InputError(
            f"run {entry.folder} does not say what its numbers are, an older deboom wrote it: run "
            "the study again, or read the page of keys in the documentation"
        )
    units = {number.key: f"[{number.unit}]" * bool(number.unit) for number in answer.numbers}
    widths = [max(map(len, words), default=0) for words in (units, units.values())]
    for number in answer.numbers:
        yield f"{number.key:{widths[0]}}  {units[number.key]:{widths[1]}}  {number.label}"


def _whole(entry: RunEntry) -> str:
    try:
        check_files(entry)
    except InputError as error:
        return str(error)
    return "All files are as the run wrote them."


def _block(title: str, facts: Mapping[str, Any]) -> Iterator[str]:
    if not facts:
        return
    yield ""
    yield title
    width = max(len(name) for name in facts)
    for name, value in facts.items():
        yield f"  {name:{width}}  {value}"


def _summary(entry: RunEntry) -> dict[str, Any]:
    try:
        return read_json(entry.folder / SUMMARY, "it names no headlines")
    except InputError:
        return {}


def _number(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
