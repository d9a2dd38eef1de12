"""An acceptance box as a plain JSON file, and the measured parts of a delivery."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from deboom.errors import InputError
from deboom.files.disk import read_document, replace_text
from deboom.files.tables import read_rows, refuse_second

FORMAT = "deboom acceptance box"
VERSION = 1
_AGAIN = "run the study solution_box again"


@dataclass(frozen=True)
class BoxVariable:
    """Interval of one stiffness factor.

    Parameters
    ----------
    name : str
        ``<mount> <axis>``.
    lower, upper : float
        Ends of the interval, both accepted [1].
    nominal : float
        Factor of the design that the box was asked for about [1].
    reference_stiffness : float or None
        Magnitude of the dynamic stiffness of one piece at factor 1 [N/m]; None: not measured.
    condition : str
        At which the reference was read, in words.
    weight : float
        Of the interval in the search, above 0 [1].
    required : bool
        False where no vehicle depends on the variable: its interval is that of the bounds.
    """

    name: str
    lower: float
    upper: float
    nominal: float
    reference_stiffness: float | None
    condition: str
    weight: float
    required: bool

    @property
    def lower_stiffness(self) -> float | None:
        """Lower end [N/m]; None where the reference was not measured."""
        return None if self.reference_stiffness is None else self.lower * self.reference_stiffness

    @property
    def upper_stiffness(self) -> float | None:
        """Upper end [N/m]; None where the reference was not measured."""
        return None if self.reference_stiffness is None else self.upper * self.reference_stiffness


@dataclass(frozen=True)
class BoxResponse:
    """Limit of one vehicle.

    Parameters
    ----------
    name : str
        Of the vehicle.
    limit : float
        Largest value that is kept [unit of the box].
    share : float
        Of the verified parts that keep it [1].
    """

    name: str
    limit: float
    share: float


@dataclass(frozen=True)
class AcceptanceBox:
    """A box with the limit that it keeps, and everything it follows from.

    Parameters
    ----------
    title : str
        For people.
    platform : str
        Name of the platform.
    platform_sha256 : str
        Hash over the platform's input files.
    group : str
        Vehicles that were served.
    motion, mounts : str
        Models behind the responses, as the study's options name them.
    load_cases : tuple of (str, float)
        Names and weights [1].
    band : (float, float)
        Lines that count [Hz].
    quantity, unit : str
        What is limited, such as ``mean level of the lines``, in dB(A).
    together : bool
        A part counts as a whole: all vehicles must keep their limits. Otherwise every pair of part
        and vehicle counts.
    variables : tuple of BoxVariable
    responses : tuple of BoxResponse
    share_stated, share_verified, share_bound : float
        Share asked for, found with independent parts, and its one-sided lower bound [1].
    confidence : float
        Of the bound [1].
    n_parts : int
        Independent parts.
    law : str
        How parts were taken to lie in the box.
    seed : int
        Of search and verification.
    """

    title: str
    platform: str
    platform_sha256: str
    group: str
    motion: str
    mounts: str
    load_cases: tuple[tuple[str, float], ...]
    band: tuple[float, float]
    quantity: str
    unit: str
    together: bool
    variables: tuple[BoxVariable, ...]
    responses: tuple[BoxResponse, ...]
    share_stated: float
    share_verified: float
    share_bound: float
    confidence: float
    n_parts: int
    law: str
    seed: int

    def __post_init__(self) -> None:
        _refuse_doubled("variable", [one.name for one in self.variables])
        _refuse_doubled("response", [one.name for one in self.responses])
        for one in self.variables:
            if not 0.0 < one.lower < one.upper:
                raise InputError(
                    f"variable '{one.name}': the interval {one.lower:g} to {one.upper:g} is none "
                    "of stiffness factors: the lower end is above 0 and below the upper one"
                )
            if one.reference_stiffness is not None and not one.reference_stiffness > 0.0:
                raise InputError(
                    f"variable '{one.name}': the reference stiffness "
                    f"{one.reference_stiffness:g} N/m is not above 0"
                )
        for name in ("share_stated", "share_verified", "share_bound", "confidence"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise InputError(f"{name} is {getattr(self, name):g}: give a share from 0 to 1")

    def variable(self, name: str) -> BoxVariable:
        """Return a variable by name.

        Raises
        ------
        InputError
            There is none.
        """
        for one in self.variables:
            if one.name == name:
                return one
        raise InputError(
            f"the box has no variable '{name}': use one of {[one.name for one in self.variables]}"
        )


def box_document(box: AcceptanceBox) -> dict[str, Any]:
    """Put a box into words and numbers that JSON knows; units stand in the keys."""
    document: dict[str, Any] = {"format": FORMAT, "version": VERSION}
    return document | {_KEYS.get(name, name): value for name, value in _plain(box).items()}


def write_solution_box(path: Path, box: AcceptanceBox) -> None:
    """Write a box; the file appears complete or not at all.

    Parameters
    ----------
    path : Path
        Replaced if it is there.
    box : AcceptanceBox

    Raises
    ------
    InputError
        A folder that cannot be written.
    """
    text = json.dumps(box_document(box), indent=1, ensure_ascii=False, allow_nan=False)
    replace_text(path, text + "\n")


def read_solution_box(path: Path) -> AcceptanceBox:
    """Read what `write_solution_box` wrote.

    Parameters
    ----------
    path : Path
        ``solution_box.json`` of a run of the study solution_box.

    Returns
    -------
    AcceptanceBox
        Intervals as factors on today's stiffness [1] with the reference stiffness [N/m], and the
        limits of the vehicles.

    Raises
    ------
    InputError
        The file is missing, no JSON, of another format or version, lacks an entry, has one too
        many or one of the wrong kind, or holds an interval that is none.

    Examples
    --------
    >>> import deboom
    >>> box = deboom.read_solution_box(
    ...     "results/solution_box/RUN/solution_box.json"
    ... )  # doctest: +SKIP
    """
    kind = "acceptance box: the study solution_box writes one"
    document = read_document(path, FORMAT, VERSION, kind, _AGAIN)
    try:
        return _box(document)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


_KEYS = {"band": "band_hz", "reference_stiffness": "reference_stiffness_n_per_m"}
"""Names of entries that carry a unit."""


def _plain(value: Any) -> dict[str, Any]:
    found = asdict(value)
    found["load_cases"] = [{"name": name, "weight": weight} for name, weight in value.load_cases]
    found["variables"] = [
        {_KEYS.get(name, name): entry for name, entry in one.items()} for one in found["variables"]
    ]
    return found


def _box(document: dict[str, Any]) -> AcceptanceBox:
    entries = _entries(AcceptanceBox, document, "the box")
    entries["variables"] = tuple(
        BoxVariable(**_entries(BoxVariable, one, f"variable {number}"))
        for number, one in enumerate(_list(entries["variables"], "variables"), start=1)
    )
    entries["responses"] = tuple(
        BoxResponse(**_entries(BoxResponse, one, f"response {number}"))
        for number, one in enumerate(_list(entries["responses"], "responses"), start=1)
    )
    cases = []
    for one in _list(entries["load_cases"], "load_cases"):
        if not isinstance(one, dict) or set(one) != {"name", "weight"}:
            raise InputError(f"a load case needs name and weight, not {one!r}")
        cases.append((_text(one["name"], "load case"), _number(one["weight"], "weight")))
    entries["load_cases"] = tuple(cases)
    band = [_number(edge, "band_hz") for edge in _list(entries["band"], "band_hz")]
    if len(band) != 2:
        raise InputError(f"band_hz holds {len(band)} numbers: give its two edges")
    entries["band"] = (band[0], band[1])
    return AcceptanceBox(**entries)


def _entries(kind: Any, document: Any, where: str) -> dict[str, Any]:
    """Check the keys of an entry and the kind of its plain values."""
    if not isinstance(document, dict):
        raise InputError(f"{where} is no object with entries: {_AGAIN}")
    wanted = {_KEYS.get(one.name, one.name): one for one in fields(kind)}
    missing = [name for name in wanted if name not in document]
    surplus = [name for name in document if name not in wanted]
    if missing or surplus:
        what = f"lacks the entry '{missing[0]}'" if missing else f"has an unknown '{surplus[0]}'"
        raise InputError(f"{where} {what}: {_AGAIN}")
    found: dict[str, Any] = {}
    for key, one in wanted.items():
        value, place = document[key], f"{where}, '{key}'"
        if one.type == "str":
            value = _text(value, place)
        elif one.type == "float":
            value = _number(value, place)
        elif one.type == "float | None":
            value = None if value is None else _number(value, place)
        elif one.type == "bool" and not isinstance(value, bool):
            raise InputError(f"{place}: {value!r} is neither true nor false")
        elif one.type == "int" and (isinstance(value, bool) or not isinstance(value, int)):
            raise InputError(f"{place}: {value!r} is no whole number")
        found[one.name] = value
    return found


def _number(value: Any, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise InputError(f"{where}: {value!r} is no finite number")
    return float(value)


def _text(value: Any, where: str) -> str:
    if not isinstance(value, str):
        raise InputError(f"{where}: {value!r} is no text")
    return value


def _list(value: Any, where: str) -> list[Any]:
    if not isinstance(value, list) or not value:
        raise InputError(f"{where} is no list with at least one entry")
    return value


def _refuse_doubled(what: str, names: list[str]) -> None:
    if not names:
        raise InputError(f"a box needs at least one {what}")
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{what} '{name}' appears {names.count(name)} times")


PLAIN = ("part", "batch", "mount")
AXES = ("x", "y", "z")


@dataclass(frozen=True)
class DeliveredPart:
    """One measured part.

    Parameters
    ----------
    name : str
        Serial number.
    batch : str
    mount : str
    stiffness : mapping of str to float
        Axis → magnitude of the dynamic stiffness [N/m], or over that of today's part at the same
        state [1]; axes that were not measured are missing.
    """

    name: str
    batch: str
    mount: str
    stiffness: Mapping[str, float]


def read_delivered_parts(
    path: Path, required: Mapping[str, tuple[str, ...]], *, over_today: bool = False
) -> tuple[DeliveredPart, ...]:
    """Read the parts of a delivery.

    Parameters
    ----------
    path : Path
        ``.xlsx`` or ``.csv`` with the columns ``part, batch, mount, x [N/mm], y [N/mm], z [N/mm]``
        in any order; N/m is read as well. A cell may be empty where the axis is not required.
    required : mapping of str to tuple of str
        Mount → axes that must be measured.
    over_today : bool
        The columns are ``x [1], y [1], z [1]``: stiffness over that of today's part, both measured
        at one state on one machine.

    Returns
    -------
    tuple of DeliveredPart
        In the order of the table.

    Raises
    ------
    InputError
        A column that is missing, or in another quantity's unit; a part named twice, of an unknown
        mount, without a required axis, or with a stiffness that is not positive.

    Examples
    --------
    >>> import deboom
    >>> deboom.read_delivered_parts("parts.csv", {"TSM": ("x", "z")})  # doctest: +SKIP
    """
    parts, seen = [], dict[str, int]()
    for row in read_rows(path, PLAIN, dict.fromkeys(AXES, "1" if over_today else "N/m")):
        name, mount = row.filled("part"), row.filled("mount")
        refuse_second(seen, f"part '{name}'", row)
        if mount not in required:
            raise row.error(
                f"part '{name}': the box knows no mount '{mount}', only {', '.join(required)}"
            )
        stiffness = {}
        for axis in AXES:
            if not row.cells[axis] and axis not in required[mount]:
                continue
            if not row.cells[axis]:
                raise row.error(
                    f"part '{name}': {mount} {axis} was not measured, and the box limits it: "
                    "measure it"
                )
            stiffness[axis] = row.number(axis)
            if not stiffness[axis] > 0.0:
                raise row.error(
                    f"part '{name}': {mount} {axis} is {stiffness[axis]:g} N/m, a stiffness is "
                    "above 0: correct the measurement"
                )
        parts.append(DeliveredPart(name, row.filled("batch"), mount, stiffness))
    if not parts:
        raise InputError(f"{path} holds no part: one row per part")
    return tuple(parts)
