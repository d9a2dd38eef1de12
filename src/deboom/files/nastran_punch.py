"""Functions of a finite-element model: Nastran's punch file of a frequency response.

A punch file states neither units nor what a subcase loads. A table beside it does, with the same
name and the ending ``.csv``: one row per subcase with the columns ``subcase``, ``node``,
``direction`` and ``force [N]`` of the load, and ``length`` and ``pressure``, the units of the
model, such as ``mm`` and ``MPa``. A column ``acoustic_points`` names the scalar points whose result
is a pressure: the file prints it under displacements and does not tell it from that of another
scalar point. Results follow exp(+iωt), as Nastran's and deboom's do.
"""

from __future__ import annotations

import math
import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError, naming
from deboom.files.disk import read_text
from deboom.files.schema import refuse_all
from deboom.files.tables import Numbers, Optional, TableRow, read_table
from deboom.files.uff import UffFunction
from deboom.files.units import parse_unit

FRF = 4
"""UFF function type of a frequency response."""
_AXES = ("x", "y", "z")
_PARTS = 12
"""Numbers of a point at a frequency: three translations and rotations, real, then imaginary."""
_QUANTITIES = {
    "DISPLACEMENTS": "displacement",
    "VELOCITY": "velocity",
    "VELOCITIES": "velocity",
    "ACCELERATION": "acceleration",
    "ACCELERATIONS": "acceleration",
    "PRESSURE": "pressure",
    "PRESSURES": "pressure",
}
"""Title of a block to what it holds."""
_SI = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s^2", "pressure": "Pa"}
MOST_LINES = 2_000_000
"""Lines of a file that is read; of full length, the largest text has half of them."""
_SHORT_EXPONENT = re.compile(r"(?<=\d)([+-]\d{3})$")
"""Exponents of three digits, which are written without an E."""


@dataclass(frozen=True)
class LoadRow(TableRow):
    """What a subcase of a frequency response loads.

    - `subcase`: number of the subcase.
    - `node`: grid point of the force.
    - `direction`: ``+x`` … ``-z``, along the axes of the results.
    - `force`: amplitude, the same at all frequencies [N].
    - `length`, `pressure`: units of the model, such as ``mm`` and ``MPa``.
    - `acoustic_points`: numbers of the scalar points of type S whose result is a pressure, with
      blanks between; empty where the cavity is printed under its own title or not at all.
    """

    unique = ("subcase {0.subcase}", "force at node {0.node} along {0.direction}")
    subcase: int
    node: int
    direction: str
    force: Annotated[float, Numbers(("force",), "N")]
    length: str
    pressure: str
    acoustic_points: Annotated[str, Optional("")] = ""

    @property
    def acoustic(self) -> frozenset[int]:
        """Numbers of the acoustic points."""
        return frozenset(map(int, self.acoustic_points.split()))

    def _check(self) -> None:
        if not re.fullmatch("[+-][xyz]", self.direction):
            raise InputError(f"direction '{self.direction}': use one of +x, -x to -z")
        if not self.force > 0:
            raise InputError("the force is not positive: turn its direction instead")
        for what, si in (("length", "m"), ("pressure", "Pa")):
            if parse_unit(getattr(self, what), si).si != si:
                raise InputError(f"'{getattr(self, what)}' is no unit of {what}: use {si} or such")
        if not re.fullmatch(r"[1-9][0-9]{0,8}( +[1-9][0-9]{0,8})*|", self.acoustic_points):
            raise InputError(
                f"acoustic_points '{self.acoustic_points[:40]}': give numbers of points with "
                "blanks between, such as '900001 900002'"
            )


def loads_of(path: Path) -> dict[int, LoadRow]:
    """Read the table of loads beside a file of results, by subcase.

    - `path`: of the results; the table has its name and the ending ``.csv``.
    - raises InputError: there is no such table, or it is at fault.
    """
    table = path.with_suffix(".csv")
    if not table.is_file():
        raise InputError(
            f"{path} states neither loads nor units: write {table.name} beside it with the columns "
            "subcase, node, direction, force [N], length, pressure and one row per subcase, such "
            "as '1,101,+x,1,mm,MPa'"
        )
    return {row.subcase: row for row in read_table(table, LoadRow)}


def read_punch(path: Path) -> tuple[UffFunction, ...]:
    """Read the functions per force of a punch file.

    Parameters
    ----------
    path : Path
        Punch file of displacements, velocities, accelerations and pressures in SORT1 or SORT2,
        real and imaginary part or magnitude and phase, with its table of loads beside it.

    Returns
    -------
    tuple of UffFunction
        Translations of each grid point along the axes of the results, and the pressure of each
        acoustic point, per force, in SI. Rotations, other scalar points and results of elements
        are passed over.

    Raises
    ------
    InputError
        No table of loads; scalar points where no acoustic one is named; a subcase without its row,
        or a row without its subcase; results of another analysis, such as modes; a file that is cut
        off or damaged.

    Examples
    --------
    >>> from pathlib import Path
    >>> from deboom.files.nastran_punch import read_punch
    >>> read_punch(Path("wagon.pch"))[0].unit  # doctest: +SKIP
    'm/N'
    """
    loads = loads_of(path)
    values = _values(path, loads, _entries(path, read_text(path)))
    return functions_of_results(path, loads, values)


Results = Mapping[tuple[int, str, int], tuple[RealArray, ComplexArray]]
"""Subcase, quantity and node to frequencies (f,) [Hz] and translations (f, 3), or pressure (f, 1),
in units of the model."""


def functions_of_results(
    path: Path, loads: Mapping[int, LoadRow], results: Results
) -> tuple[UffFunction, ...]:
    """Return the functions per force of the results of a model, in SI.

    - raises InputError: a subcase without its load, or a load without its subcase; results that
      are no finite numbers, or not over rising frequencies.
    """
    table, subcases = path.with_suffix(".csv"), {subcase for subcase, _, _ in results}
    refuse_all(
        [
            *(
                f"{path}: subcase {number} is not in {table.name}: add its row"
                for number in sorted(subcases - loads.keys())
            ),
            *(
                f"{table}: subcase {number} has no results over frequency in {path.name}: correct "
                "its number, or take the row out"
                for number in sorted(loads.keys() - subcases)
            ),
            *(
                f"{table}: subcase {number}: acoustic point {point} has no pressure in "
                f"{path.name}: correct its number, or print it"
                for number, load in sorted(loads.items())
                if number in subcases
                for point in sorted(load.acoustic)
                if (number, "pressure", point) not in results
            ),
        ]
    )
    functions = []
    for (subcase, quantity, node), (frequency, values) in results.items():
        load = loads[subcase]
        if quantity == "pressure":
            factor = parse_unit(load.pressure, "Pa").factor
        else:
            factor = parse_unit(load.length, "m").factor
        directions = ["scalar"] if quantity == "pressure" else [f"+{axis}" for axis in _AXES]
        for direction, column in zip(directions, values.T, strict=True):
            with naming(f"{path}: subcase {subcase}"):
                functions.append(
                    UffFunction(
                        abscissa=frequency,
                        values=column * factor / load.force,
                        function_type=FRF,
                        response_node=node,
                        response_direction=direction,
                        reference_node=load.node,
                        reference_direction=load.direction,
                        ordinate=quantity,
                        ordinate_unit=_SI[quantity],
                        denominator="force",
                        denominator_unit="N",
                        file_unit=f"{_SI[quantity]}/N",
                    )
                )
    return tuple(functions)


@dataclass(frozen=True)
class _Block:
    """What the title lines above numbers say; `modes`: that they are those of eigenvalues."""

    title: str = ""
    polar: bool | None = None
    subcase: int = 1
    frequency: float | None = None
    point: int | None = None
    modes: bool = False


@dataclass(frozen=True)
class _Entry:
    """Numbers of a point at a frequency, and the line of the file where they begin."""

    subcase: int
    quantity: str
    polar: bool
    point: int
    scalar: bool
    frequency: float
    numbers: Sequence[float]


def _entries(path: Path, text: str) -> Iterator[_Entry]:
    block, seen = _Block(), set[str]()
    lines = text.replace("\r\n", "\n").split("\n", MOST_LINES)
    if len(lines) > MOST_LINES:
        raise InputError(f"{path} has more than {MOST_LINES} lines, of 80 characters: punch again")
    number = 0
    while number < len(lines):
        line = lines[number]
        if line.startswith("$"):
            block = _titled(path, number + 1, block, line[:72])
            number += 1
            continue
        if not line.strip():
            number += 1
            continue
        end = number + 1
        while end < len(lines) and lines[end].startswith("-CONT-"):
            end += 1
        seen.add(block.title)
        if block.title in _QUANTITIES:
            yield _entry(path, number + 1, block, lines[number:end])
        number = end
    if not seen & _QUANTITIES.keys():
        kinds = ", ".join(sorted(filter(None, seen))).lower() or "nothing"
        raise InputError(
            f"{path} holds {kinds}: punch displacements, velocities, accelerations or pressures of "
            "a frequency response (SOL 108 or 111, DISPLACEMENT(PUNCH)=...)"
        )


def _titled(path: Path, number: int, block: _Block, line: str) -> _Block:
    """Take in a title line; a TITLE begins another block."""
    key, has_value, value = (part.strip() for part in line[1:].partition("="))
    key = key.upper()
    if key == "TITLE":
        return _Block()
    if key == "SUBCASE ID":
        return replace(block, subcase=int(_number(path, number, value)))
    if key == "FREQUENCY":
        return replace(block, frequency=_number(path, number, value), point=None)
    if key == "POINT ID":
        return replace(
            block, point=int(_number(path, number, (value.split() or [""])[0])), frequency=None
        )
    if key.endswith(" OUTPUT"):
        forms = {"REAL-IMAGINARY": False, "MAGNITUDE-PHASE": True}
        return replace(block, polar=forms.get(key.removesuffix(" OUTPUT")))
    if has_value:
        return replace(block, modes=True) if "EIGENVALUE" in key else block
    return replace(block, title=key)


def _entry(path: Path, number: int, block: _Block, lines: Sequence[str]) -> _Entry:
    where = f"{path} line {number}"
    if block.polar is None or (block.frequency is None and block.point is None):
        kind = "modes" if block.modes else "results that are not over frequency"
        raise InputError(
            f"{where}: {block.title.lower()} of {kind}: punch the complex results of a frequency "
            "response"
        )
    numbers = [
        _number(path, number + row, line[place : place + 18].strip())
        for row, line in enumerate(lines)
        for place in (18, 36, 54)
        if line[place : place + 18].strip()
    ]
    if len(numbers) != _PARTS:
        raise InputError(
            f"{where}: a point has {len(numbers)} numbers instead of {_PARTS}: the file is cut off "
            "or damaged, punch it again"
        )
    first = _number(path, number, lines[0][:17].strip())
    return _Entry(
        subcase=block.subcase,
        quantity=_QUANTITIES[block.title],
        polar=block.polar,
        point=int(first) if block.point is None else block.point,
        scalar=lines[0][17:18] == "S",
        frequency=first if block.frequency is None else block.frequency,
        numbers=numbers,
    )


def _number(path: Path, line: int, text: str) -> float:
    try:
        value = float(_SHORT_EXPONENT.sub(r"E\1", text))
        if not math.isfinite(value):
            raise ValueError
        return value
    except ValueError:
        raise InputError(
            f"{path} line {line}: '{text[:30]}' is no number: punch it again"
        ) from None


def _values(path: Path, loads: Mapping[int, LoadRow], entries: Iterator[_Entry]) -> Results:
    """Complex values by subcase, quantity and node, over rising frequencies.

    - raises InputError: a scalar point of which nobody says whether it is acoustic.
    """
    acoustic = frozenset[int]().union(*(load.acoustic for load in loads.values()))
    collected = defaultdict[tuple[int, str, int], dict[float, ComplexArray]](dict)
    for entry in entries:
        first, second = np.reshape(entry.numbers, (2, 6))
        values = first * np.exp(1j * np.deg2rad(second)) if entry.polar else first + 1j * second
        quantity = entry.quantity
        if entry.scalar and quantity != "pressure":
            if not acoustic:
                raise InputError(
                    f"{path}: scalar point {entry.point} may be acoustic, with a pressure, or a "
                    "degree of freedom of a substructure: name the acoustic points in a column "
                    f"'acoustic_points' of {path.with_suffix('.csv').name}, with blanks between, "
                    "such as '900001 900002'; others are then passed over"
                )
            # its pressure stands where a grid point has its first translation
            if quantity != "displacement" or entry.point not in acoustic:
                continue
            quantity = "pressure"
        lines = collected[entry.subcase, quantity, entry.point]
        if entry.frequency in lines:
            raise InputError(
                f"{path}: subcase {entry.subcase}: node {entry.point} has its {quantity} at "
                f"{entry.frequency:g} Hz twice: punch each result once"
            )
        lines[entry.frequency] = values[:1] if quantity == "pressure" else values[:3]
    return {
        key: (np.array(sorted(lines)), np.array([lines[each] for each in sorted(lines)]))
        for key, lines in collected.items()
    }
