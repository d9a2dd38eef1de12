"""TOML files with strict keys: a wrong key is named, and what is written reads back."""

from __future__ import annotations

import difflib
import json
import tomllib
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic_core import ErrorDetails

from deboom.errors import InputError
from deboom.files.disk import read_text, replace_text

Note = Callable[[InputError], None]


def refuse(error: InputError) -> None:
    """Stop at the first fault.

    Raises
    ------
    InputError
        Always.
    """
    raise error


@contextmanager
def noting(note: Note) -> Iterator[None]:
    """Tell a fault of the block to `note`; the block ends there."""
    try:
        yield
    except InputError as error:
        note(error)


def refuse_doubled(path: Path, what: str, names: Sequence[Hashable], note: Note = refuse) -> None:
    """Refuse a name, or a tuple of them, that comes twice.

    Parameters
    ----------
    path : Path
        File of the names.
    what : str
        Items of the names with a verb, such as ``[[mounts]] are named``.
    names : sequence of str or tuple
        Names in the order of the file.
    note : callable
        Gets the fault; by default it is raised.

    Raises
    ------
    InputError
        A name comes twice.
    """
    if len(set(names)) < len(names):
        name = next(name for name in names if names.count(name) > 1)
        words = " ".join(map(str, name)) if isinstance(name, tuple) else name
        note(InputError(f"{path}: two {what} '{words}': keep or rename one"))


class StrictModel(BaseModel):
    """Keys of a TOML file or of one of its sections: no unknown key, no conversion of types."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


_UNNAMED = "[["
_Model = TypeVar("_Model", bound=StrictModel)


def load_toml(path: Path, model: type[_Model]) -> _Model:
    """Read and check a TOML file.

    Parameters
    ----------
    path : Path
        The file.
    model : type
        Its keys; fields that are models, or tuples of models, are its sections.

    Raises
    ------
    InputError
        The file is missing or no TOML; a key is unknown, missing, mistyped or out of range.
    """
    return _parsed(path, read_text(path), model)


def load_what_is_right(path: Path, model: type[_Model], note: Note) -> _Model:
    """Read a TOML file, tell all its faults, and return what is right of it.

    Parameters
    ----------
    path : Path
        The file.
    model : type
        As for `load_toml`.
    note : callable
        Gets an `InputError` for every key at fault.

    Returns
    -------
    StrictModel
        Without the keys at fault: ``getattr(content, key, None)``. Lists of sections are there;
        an entry without a name is called by its place, see `has_name`. Complete if nothing was
        told.

    Raises
    ------
    InputError
        The file is missing or no TOML.
    """
    text = read_text(path)
    try:
        return model.model_validate(_raw(path, text))
    except ValidationError as error:
        details = error.errors(include_url=False)
        # an unknown key first: it explains a missing one
        for detail in sorted(details, key=lambda one: one["type"] != "extra_forbidden"):
            # pydantic counts the right entries of a list alone
            if detail["type"] != "too_short" or not detail["input"]:
                note(InputError(f"{path}: {_detail_sentence(detail, model)}"))
    raw = _raw(path, text)
    right = _right_keys(model, raw)
    for name, section in _sections(model).items():
        content = raw.get(name)
        if get_origin(model.model_fields[name].annotation) is tuple:
            entries = content if isinstance(content, list) else []
            right[name] = tuple(
                section.model_construct(**{"name": f"{_UNNAMED}{name}]] {number}"} | keys)
                for number, keys in enumerate((_right_keys(section, entry) for entry in entries), 1)
            )
        elif isinstance(content, dict):
            right[name] = section.model_construct(**_right_keys(section, content))
    return model.model_construct(**right)


def has_name(name: str) -> bool:
    """Tell whether a section has a name of its own, or is called by its place."""
    return not name.startswith(_UNNAMED)


def dump_toml(path: Path, content: StrictModel) -> None:
    """Write a TOML file; what is written is read back and compared first.

    Raises
    ------
    InputError
        The content would be refused on reading, or the file cannot be written.
    """
    text = _toml(content)
    if _parsed(path, text, type(content)) != content:
        raise InputError(f"{path}: the text would not read back as it was given; nothing written")
    replace_text(path, text)


def append_toml(path: Path, content: _Model, section: str, entry: StrictModel) -> None:
    """Add an entry to a list of sections at the end of a TOML file; the rest stays as it stands.

    Parameters
    ----------
    path : Path
        The file.
    content : StrictModel
        What the file holds.
    section : str
        Name of the list, such as ``runs``.
    entry : StrictModel
        To add.

    Raises
    ------
    InputError
        The new content would be refused, the file has changed meanwhile, holds the list in another
        form than ``[[section]]``, or cannot be written. It stays as it was then.
    """
    wanted = content.model_copy(update={section: (*getattr(content, section), entry)})
    lines = ["", f"[[{section}]]", *_assignments(entry.model_dump(exclude_none=True))]
    text = read_text(path)
    text = f"{text.rstrip()}\n" + "\n".join(lines) + "\n"
    try:
        written = _parsed(path, text, type(content))
    except InputError:
        written = None
    if written != wanted:
        raise InputError(
            f"{path}: [[{section}]] cannot be added at its end; write the list as [[{section}]] "
            "sections, and leave the file alone meanwhile"
        )
    replace_text(path, text)


def _sections(model: type[BaseModel]) -> dict[str, type[BaseModel]]:
    """Fields that are models or tuples of models."""
    found = {name: _model_in(field.annotation) for name, field in model.model_fields.items()}
    return {name: section for name, section in found.items() if section is not None}


def _model_in(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    if get_origin(annotation) in (tuple, Annotated, Union, UnionType):
        return next(filter(None, map(_model_in, get_args(annotation))), None)
    return None


def _raw(path: Path, text: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise InputError(f"{path} is nested too deeply: write it as the guide shows") from None
    except ValueError as error:  # a fault of TOML, or an integer of thousands of digits
        raise InputError(f"{path} is not TOML: {error}") from None


def _right_keys(model: type[BaseModel], raw: Any) -> dict[str, Any]:
    """Keys of a section that pydantic has nothing against."""
    if not isinstance(raw, dict):
        return {}
    try:
        return dict(model.model_validate(raw))
    except ValidationError as error:
        wrong = {str(detail["loc"][0]) for detail in error.errors(include_url=False)}
        return {key: value for key, value in raw.items() if key not in wrong}


def _parsed(path: Path, text: str, model: type[_Model]) -> _Model:
    return checked_document(path, _raw(path, text), model)


def checked_document(path: Path, raw: Mapping[str, Any], model: type[_Model]) -> _Model:
    """Check the entries of a document, such as of a JSON file.

    Parameters
    ----------
    path : Path
        File, for the error.
    raw : mapping
        Entries as read.
    model : type
        As for `load_toml`.

    Raises
    ------
    InputError
        A key is unknown, missing, mistyped or out of range.
    """
    try:
        return model.model_validate(raw)
    except ValidationError as error:
        raise InputError(f"{path}: {_sentence(error, model)}") from None


def _sentence(error: ValidationError, model: type[BaseModel]) -> str:
    """Say the most helpful one of pydantic's errors: an unknown key explains a missing one."""
    details = error.errors(include_url=False)
    detail = next((d for d in details if d["type"] == "extra_forbidden"), details[0])
    return _detail_sentence(detail, model)


def _detail_sentence(detail: ErrorDetails, model: type[BaseModel]) -> str:
    sections = _sections(model)
    section, key = _place(detail["loc"] or ("",), sections)
    where = f"key '{key}' in {section}"
    if detail["type"] == "extra_forbidden":
        known = sections.get(str(detail["loc"][0]), model).model_fields
        close = difflib.get_close_matches(key, known, n=1)
        remedy = f"did you mean '{close[0]}'?" if close else f"use {', '.join(known)}"
        return f"unknown {where}; {remedy}"
    if detail["type"] == "missing":
        return f"{where} is missing: add it"
    rule = detail["msg"].removeprefix("Value error, ")
    if detail["type"] == "value_error" and isinstance(detail["input"], dict):
        return f"{section}: {rule}"
    return f"{where} is {json.dumps(detail['input'], default=str)}: {rule[:1].lower()}{rule[1:]}"


def _place(
    location: tuple[int | str, ...], sections: dict[str, type[BaseModel]]
) -> tuple[str, str]:
    first, *rest = location
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
    lines = _assignments(values)
    for section, entries in sections.items():
        is_list = not isinstance(entries, dict)
        for entry in entries if is_list else (entries,):
            lines += ["", f"[[{section}]]" if is_list else f"[{section}]"]
            lines += _assignments(entry)
    return "\n".join(lines) + "\n"


def _assignments(values: Mapping[str, Any]) -> list[str]:
    return [f"{key} = {_value(value)}" for key, value in values.items()]


def _value(value: Any) -> str:
    if isinstance(value, tuple | list):
        return f"[{', '.join(map(_value, value))}]"
    # JSON's numbers and strings are TOML's, too
    return json.dumps(value, ensure_ascii=False)
