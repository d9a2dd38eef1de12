"""Files by which Dakota calls a model: parameters of one evaluation in, its results out.

Formats as in Dakota's User Manual, "Parameters file format" and "Simulation Failure Capturing".
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from deboom.errors import InputError
from deboom.files.disk import opened_file, replace_text, text_of
from deboom.files.tables import name_and_unit

_BEGIN = re.compile(rb"\s*(\d+\s+variables\b|\{\s*DAKOTA_VARS\s*=)")
_STANDARD = re.compile(r"\s*(?P<value>\S+)\s+(?P<tag>\S+)\s*")
_APREPRO = re.compile(r"\s*\{\s*(?P<tag>\S+)\s*=\s*\"?(?P<value>[^\"}]*?)\"?\s*\}\s*")
_SECTIONS = {
    "DAKOTA_VARS": "variables",
    "DAKOTA_FNS": "functions",
    "DAKOTA_DER_VARS": "derivative_variables",
    "DAKOTA_AN_COMPS": "analysis_components",
    "DAKOTA_METADATA": "metadata",
}
"""Tags of counts in the format of APREPRO, and in the standard one."""
VALUE = 1
"""Code of a function of which the value is wanted, and no derivative; 0 is nothing."""


@dataclass(frozen=True)
class DakotaParameters:
    """What Dakota wants of one evaluation.

    - `variables`: descriptor to its value as text.
    - `responses`: descriptor to whether its value is wanted.
    """

    variables: Mapping[str, str]
    responses: Mapping[str, bool]


def is_dakota(path: Path) -> bool:
    """Tell by its beginning whether a file has parameters of Dakota."""
    with opened_file(path) as file:
        return bool(_BEGIN.match(file.read(512)))


def read_dakota(path: Path) -> DakotaParameters:
    """Read a file of parameters, in the standard format or that of APREPRO.

    - raises InputError: the file is missing, damaged or cut; derivatives or metadata are wanted.
    """
    lines = [line for line in text_of(path).splitlines() if line.strip()]
    form = _APREPRO if lines and lines[0].lstrip().startswith("{") else _STANDARD
    pairs = [form.fullmatch(line) for line in lines]
    sections: dict[str, list[tuple[str, str]]] = {}
    place = 0
    while place < len(pairs) and (head := pairs[place]) is not None:
        name = _SECTIONS.get(head["tag"], head["tag"])
        count = int(head["value"]) if head["value"].isdigit() and name in _SECTIONS.values() else 0
        rows = [row for row in pairs[place + 1 : place + 1 + count] if row is not None]
        if len(rows) < count:
            break
        sections[name] = [(row["tag"], row["value"]) for row in rows]
        place += 1 + count
    if place < len(pairs) or not {"variables", "functions"} <= sections.keys():
        raise InputError(f"{path} is no whole file of Dakota's parameters: let Dakota write it")
    if sections.get("metadata"):
        raise InputError(f"{path}: Dakota wants metadata, and deboom has none: take them out")
    responses = {tag.partition(":")[2]: code for tag, code in sections["functions"]}
    derived = [name for name, code in responses.items() if code not in ("0", str(VALUE))]
    if derived:
        raise InputError(
            f"{path}: Dakota wants derivatives of {derived[0]}, and deboom gives values only: take "
            "numerical_gradients and no_hessians"
        )
    wanted = {name: code == str(VALUE) for name, code in responses.items()}
    return DakotaParameters(dict(sections["variables"]), wanted)


def write_dakota(path: Path, values: Mapping[str, float] | None, error: str = "") -> None:
    """Write a file of results.

    - `values`: number of each descriptor; None: the evaluation failed, and `error` says why.
    - raises InputError: the file cannot be written.
    """
    if values is None:
        replace_text(path, f"FAIL\n{error}\n")
    else:
        replace_text(path, "".join(f"{value!r} {name}\n" for name, value in values.items()))


def dakota_name(label: str) -> str:
    """Return a column as a descriptor: without its unit, letters and digits between underlines."""
    return re.sub(r"[^A-Za-z0-9]+", "_", name_and_unit(label)[0]).strip("_")
