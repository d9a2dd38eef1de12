"""TOML files with strict keys: all faults are told at once, and what is written reads back."""

from __future__ import annotations

import difflib
import json
import re
import tomllib
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, TypeAlias, TypeVar, Union, get_args, get_origin

import numpy as np
import tomlkit
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError
from tomlkit.exceptions import TOMLKitError

from deboom.errors import InputError, naming
from deboom.files.disk import MEBIBYTE, read_text, replace_text
from deboom.files.kinds import FolderKind
from deboom.names import is_inside, name_fault

Note = Callable[[InputError], None]
_Entry = TypeVar("_Entry")
_Content = TypeVar("_Content")

LARGEST_TOML = 8 * MEBIBYTE
"""Largest TOML file that is read; a MiB takes its parser a second [bytes]."""


@contextmanager
def noting(note: Note) -> Iterator[None]:
    """Tell the faults of the block to `note`, sentence by sentence; the block ends there."""
    try:
        yield
    except InputError as error:
        for sentence in error.sentences:
            note(InputError(sentence))


@contextmanager
def telling() -> Iterator[Note]:
    """Give what tells a fault; the block goes on, and its faults are raised together at its end.

    - raises InputError: a sentence for each fault that was told.
    """
    faults: list[InputError] = []
    with noting(faults.append):
        yield faults.append
    refuse_all(map(str, faults))


def refuse_all(sentences: Iterable[str]) -> None:
    """Refuse with all the sentences there are.

    - raises InputError: there is one.
    """
    if lines := list(sentences):
        raise InputError("\n".join(lines))


def for_each(read: Callable[[_Entry], _Content], entries: Iterable[_Entry]) -> tuple[_Content, ...]:
    """Return what is read for each entry, in order.

    - raises InputError: the faults of all entries.
    """
    contents = []
    with telling() as tell:
        for entry in entries:
            with noting(tell):
                contents.append(read(entry))
    return tuple(contents)


def doubled(what: str, names: Sequence[Hashable]) -> Iterator[str]:
    """Give the sentence for a name, or a tuple of them, that comes twice.

    - `what`: items of the names with a verb, such as ``[[mounts]] are named``.
    - `names`: names in the order of the file.
    """
    if len(set(names)) < len(names):
        name = next(name for name in names if names.count(name) > 1)
        words = " ".join(map(str, name)) if isinstance(name, tuple) else name
        yield f"two {what} '{words}': keep or rename one"


def same_file(what: str, key: str, entries: Iterable[StrictModel]) -> Iterator[str]:
    """Give a sentence for each file that two entries name: one measurement is not two.

    - `what`: the entries, such as ``load cases``.
    - `key`: of the file; an entry may lack it.
    """
    owners: dict[str, str] = {}
    for entry in entries:
        values = dict(entry)
        file, name = values[key], values["name"]
        if file and file in owners:
            yield (
                f"the {what} '{owners[file]}' and '{name}' have one file, {key} = '{file}': "
                "name the file of each"
            )
        elif file:
            owners[file] = name


def beyond_gears(
    what: str, gears: Iterable[tuple[str, int]], ratios: Sequence[float]
) -> Iterator[str]:
    """Give a sentence for every name, such as of a run, whose gear has no ratio."""
    for name, gear in gears:
        if gear > len(ratios):
            yield (
                f"{what} '{name}' is in gear {gear}, but total_ratios in [engine] has "
                f"{len(ratios)} gears: add the ratio"
            )


class StrictModel(BaseModel):
    """Keys of a TOML file or of one of its sections: no unknown key, no conversion of types."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)

    def faults(self) -> Iterator[str]:
        """Give a sentence for everything that does not fit together."""
        return iter(())


def _plain_name(name: str) -> str:
    if fault := name_fault(name):
        raise ValueError(fault)
    return name


def _inside(name: str) -> str:
    if not is_inside(name):
        raise ValueError("a file is named relative to the platform folder, with / and without ..")
    return name


def _symmetric_positive(rows: Matrix3) -> Matrix3:
    matrix = np.array(rows)
    if not np.array_equal(matrix, matrix.T) or np.any(np.linalg.eigvalsh(matrix) <= 0):
        raise ValueError("an inertia tensor is symmetric and positive definite")
    return rows


def within(lowest: float, highest: float, otherwise: str) -> AfterValidator:
    """Return a validator that refuses numbers outside of what the quantity has, ends included.

    - `otherwise`: why, and the likely mistake, such as ``no powertrain weighs that: is it in g?``.
    """

    def check(value: float) -> float:
        if not lowest <= value <= highest:
            raise ValueError(otherwise)
        return value

    return AfterValidator(check)


LARGEST_GYRATION = 3.0
"""Radius of gyration that no body in a car has [m]."""
SMALLEST_GYRATION = 0.003
"""The same, downwards [m]."""


def inertia_faults(mass: float, inertia: Sequence[Sequence[float]]) -> Iterator[str]:
    """Give a sentence for a tensor that no body of that mass has.

    - `mass` [kg].
    - `inertia` (3, 3): about the centre of gravity [kg m²].

    The largest principal moment of a body is at most the sum of the others.
    """
    moments = np.linalg.eigvalsh(np.array(inertia))
    if moments[2] > 1.01 * (moments[0] + moments[1]):
        yield (
            f"the inertia has principal moments of {_listed(moments)} kg m², and no body has one "
            "above the sum of the others: check its entries and the signs of its products"
        )
    radius = float(np.sqrt(max(moments[2], 0.0) / mass))
    if not SMALLEST_GYRATION <= radius <= LARGEST_GYRATION:
        yield (
            f"the inertia of {_listed(moments)} kg m² and the mass of {mass:g} kg make a radius "
            f"of gyration of {radius:.3g} m: is the inertia in kg mm², or the mass in g or t?"
        )


def _listed(values: Iterable[float]) -> str:
    return ", ".join(f"{value:.4g}" for value in values)


_T = TypeVar("_T")
# TOML has arrays only, no tuples: the container is converted, its items stay strict
Several: TypeAlias = Annotated[tuple[_T, ...], Field(strict=False)]
AtLeastOne: TypeAlias = Annotated[tuple[_T, ...], Field(strict=False, min_length=1)]
Name = Annotated[str, AfterValidator(_plain_name)]
Title = Annotated[str, Field(min_length=1)]
RelativePath = Annotated[str, AfterValidator(_inside)]
Positive = Annotated[float, Field(gt=0)]
GainTolerance = Annotated[
    Positive, within(0.0, 0.5, "a relative tolerance is below 0.5: is it in percent?")
]
PlaceTolerance = Annotated[
    Positive, within(0.0, 0.1, "nothing is placed that badly, in m: is it in mm?")
]
Temperature = Annotated[
    float, within(-60.0, 200.0, "rubber is used from -60 to 200 °C: is it in K or °F?")
]
NotNegative = Annotated[float, Field(ge=0)]
Number = Annotated[int, Field(ge=1)]
Share = Annotated[float, Field(ge=0, le=1)]
Axis = Literal["x", "y", "z"]
Row3 = Annotated[tuple[float, float, float], Field(strict=False)]
Matrix3 = Annotated[tuple[Row3, Row3, Row3], Field(strict=False)]
Inertia = Annotated[Matrix3, AfterValidator(_symmetric_positive)]

_UNIT = re.compile(r"_(deg|rad|hz|kg(_m2|_per_m)?|m(_s2)?|nm|n(_m2|_per_m)?)$")


def key_without_unit(key: str) -> str:
    """Return the name of what a key states, such as ``mass`` for ``mass_kg``."""
    return _UNIT.sub("", key)


def values_of(entry: StrictModel) -> dict[str, Any]:
    """Return the values of a section by their keys without the unit, in SI."""
    values = {}
    for key, value in entry:
        in_si = np.deg2rad(value).tolist() if key.endswith("_deg") else value
        values[key_without_unit(key)] = in_si
    return values


_Model = TypeVar("_Model", bound=StrictModel)


def load_toml(path: Path, model: type[_Model]) -> _Model:
    """Read and check a TOML file.

    - `path`: the file.
    - `model`: its keys; fields that are models, or tuples of models, are its sections.
    - raises InputError: the file is missing or no TOML; every key that is unknown, missing,
      mistyped or out of range; where there is none of these, every one that does not fit the
      others.
    """
    return _parsed(path, read_text(path, LARGEST_TOML), model)


def wrong_entries(model: type[BaseModel], document: Mapping[str, Any]) -> Iterator[str]:
    """Give a sentence for each entry of a JSON document that is not as the model says."""
    try:
        model.model_validate(document)
    except ValidationError as error:
        yield from _sentences(error, model)


def dump_toml(path: Path, content: StrictModel) -> None:
    """Write a TOML file; what is written is read back and compared first.

    - raises InputError: the content would be refused on reading, or the file cannot be written.
    """
    text = _toml(content)
    if _parsed(path, text, type(content)) != content:
        raise InputError(f"{path}: the text would not read back as it was given; nothing written")
    replace_text(path, text)


def append_toml(path: Path, content: _Model, section: str, entry: StrictModel) -> None:
    """Add an entry to a list of sections of a TOML file; the rest stays as it stands.

    - `path`: the file.
    - `content`: content of the file.
    - `section`: name of the list, such as ``runs``; an entry of ``[[runs]]`` goes to the end of the
      file, one of ``runs = [{...}]`` to the end of the array.
    - `entry`: new entry.
    - raises InputError: the new content would be refused, the file has changed meanwhile, or cannot
      be written. Then it stays as it was.
    """
    wanted = content.model_copy(update={section: (*getattr(content, section), entry)})
    text = read_text(path)
    try:
        text = _with_entry(text, section, entry.model_dump(exclude_none=True))
        written = _parsed(path, text, type(content))
    except (InputError, TOMLKitError):
        written = None
    if written != wanted:
        raise InputError(
            f"{path}: [[{section}]] cannot be added to it; write the list as [[{section}]] "
            "sections, and leave the file alone meanwhile"
        )
    replace_text(path, text)


def _with_entry(text: str, section: str, values: Mapping[str, Any]) -> str:
    """Text of a TOML file with one more entry in a list of sections."""
    document = tomlkit.parse(text)
    entries = document.get(section)
    if isinstance(entries, tomlkit.items.Array):
        inline = tomlkit.inline_table()
        inline.update(values)
        entries.append(inline)
        return tomlkit.dumps(document)
    # text at the end: tomlkit would put it between a comment and what that comment is about
    return f"{text.rstrip()}\n\n{tomlkit.dumps({section: [dict(values)]})}"


def _parsed(path: Path, text: str, model: type[_Model]) -> _Model:
    try:
        raw = tomllib.loads(text)
    except RecursionError:
        raise InputError(f"{path} is nested too deeply: write it as the guide shows") from None
    except ValueError as error:  # a fault of TOML, or an integer of thousands of digits
        raise InputError(f"{path} is not TOML: {error}") from None
    return checked_document(path, raw, model)


def checked_document(path: Path, raw: Mapping[str, Any], model: type[_Model]) -> _Model:
    """Check the entries of a document, such as of a JSON file.

    - `path`: file, for the errors.
    - `raw`: entries as read.
    - `model`: as for `load_toml`.
    - raises InputError: as `load_toml`.
    """
    with naming(path):
        try:
            content = model.model_validate(raw)
        except ValidationError as error:
            raise InputError("\n".join(_sentences(error, model))) from None
        refuse_all(content.faults())
    return content


def _sections(model: type[BaseModel]) -> dict[str, type[BaseModel]]:
    """Fields that are models or tuples of models."""
    models = {name: _model_in(field.annotation) for name, field in model.model_fields.items()}
    return {name: section for name, section in models.items() if section is not None}


def _model_in(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    if get_origin(annotation) in (tuple, Annotated, Union, UnionType):
        return next(filter(None, map(_model_in, get_args(annotation))), None)
    return None


def _sentences(error: ValidationError, model: type[BaseModel]) -> Iterator[str]:
    """Give a sentence for each of pydantic's errors, unknown keys first."""
    sections = _sections(model)
    explained: set[tuple[str, str]] = set()
    details = error.errors(include_url=False)
    for detail in sorted(details, key=lambda each: each["type"] != "extra_forbidden"):
        section, key = _place(detail["loc"], sections)
        where = f"key '{key}' in {section}"
        if detail["type"] == "extra_forbidden":
            keys = sections.get(str(detail["loc"][0]), model).model_fields
            close = difflib.get_close_matches(key[:100], keys, n=1)
            explained |= {(section, name) for name in close}
            remedy = f"did you mean '{close[0]}'?" if close else f"use {', '.join(keys)}"
            yield f"unknown {where}; {remedy}"
        elif detail["type"] == "missing":
            if (section, key) not in explained:
                yield f"{where} is missing: add it"
        # pydantic counts the right entries of a list alone: a wrong one is told itself
        elif detail["type"] != "too_short" or not any(
            other["loc"][: len(detail["loc"])] == detail["loc"] != other["loc"] for other in details
        ):
            rule = detail["msg"].removeprefix("Value error, ")
            if detail["type"] == "value_error" and isinstance(detail["input"], dict):
                yield f"{section}: {rule}"
                continue
            yield f"{where} is {_short(detail['input'])}: {rule[:1].lower()}{rule[1:]}"


def _short(value: Any) -> str:
    """JSON of a value, as far as an engineer needs it."""
    try:
        text = json.dumps(value, default=str)
    except (ValueError, RecursionError):
        text = type(value).__name__
    return text if len(text) <= 100 else f"{text[:60]} ... {text[-20:]}"


def _place(
    location: tuple[int | str, ...], sections: dict[str, type[BaseModel]]
) -> tuple[str, str]:
    first, *rest = location or ("",)
    section = "the top level"
    if rest and first in sections:
        section = f"[{first}]"
        if isinstance(rest[0], int):
            section = f"[[{first}]] {rest[0] + 1}"
            rest = rest[1:]
        first, *rest = rest or [first]
    return section, str(first) + "".join(f"[{i}]" for i in rest if isinstance(i, int))


def _toml(content: BaseModel) -> str:
    values = content.model_dump(exclude_none=True)
    sections = {key: values.pop(key) for key in _sections(type(content)) if key in values}
    return tomlkit.dumps(values | {key: entries for key, entries in sections.items() if entries})


@dataclass(frozen=True)
class FolderRecord:
    """A kind of folder with measurements: what makes it one, what it holds, and what takes it.

    - `file`: that makes it one; `keys`: of this file.
    - `command`: that takes the folder, ``{}`` in its place; `guide`: title of the guide to it.
    - `lines` or None: reads a folder, and gives name and text of each line on what it holds;
      InputError: something is missing or wrong. A platform is read in stages instead.
    - `parts`: folders inside it, and the kind of what they hold.
    """

    kind: FolderKind
    file: str
    keys: type[StrictModel]
    command: str
    guide: str
    lines: Callable[[Path], Iterator[tuple[str, str]]] | None = None
    parts: Mapping[str, FolderKind] = field(default_factory=dict)


def warning_lines(sentences: Iterable[str]) -> Iterator[tuple[str, str]]:
    """Give lines of what a check warns of."""
    for sentence in sentences:
        yield "WARNING", sentence


def assumed_lines(sentences: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Give lines of what nobody stated and defaults stand in for."""
    for sentence in sentences:
        yield "ASSUMED", sentence
