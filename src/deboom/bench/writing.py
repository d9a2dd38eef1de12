"""What all writers of the bench share: seeds, functions with their nodes, texts and truth."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray, RealOrComplexArray
from deboom.bench.layout import Place
from deboom.errors import InputError
from deboom.files.disk import replace_text
from deboom.files.rows import SensorRow
from deboom.files.uff import UffFunction

SPECTRUM, TIME_SIGNAL, FRF, COHERENCE = 0, 1, 4, 6
"""UFF function types."""

UNIT = {
    "displacement": "m",
    "acceleration": "m/s^2",
    "force": "N",
    "pressure": "Pa",
    "general": "1",
}
"""Words of the UFF ordinates and their units, where nothing else is said."""


ABOUT = "Virtual measurements with the errors of real sensors. Nobody measured this."
CONVENTIONS = (
    "SI units, complex peak amplitudes, time factor e^{{+jwt}}; UFF files are data set 58. Tables "
    "say where every node is and what it measures; truth/ holds the exact values behind, for "
    "verification only. {file} names every other file; 'deboom new {kind}' writes such a folder "
    "with every file and key explained."
)
VEHICLE_AXES = (
    "x points rearward, y to the right, z up; positions count from the powertrain's centre of "
    "gravity."
)


class Dof(NamedTuple):
    """A degree of freedom in the files: node, direction, entity name, quantity and its unit."""

    node: int
    direction: str
    name: str
    quantity: str
    unit: str = ""


def check_seed(seed: int) -> None:
    """Refuse a seed below 1."""
    if seed < 1:
        raise InputError(f"seed {seed} is refused: seeds are whole numbers from 1")


def function(
    kind: int,
    abscissa: RealArray,
    values: RealOrComplexArray,
    response: Dof,
    reference: Dof | None,
    *id_lines: str,
) -> UffFunction:
    """Return a function (n,) in SI at a response, over a reference where it has one.

    A coherence states no unit, but is that of its two channels.
    """
    over = reference if reference is not None and kind != COHERENCE else None
    return UffFunction(
        abscissa=abscissa,
        values=values,
        function_type=kind,
        response_node=response.node,
        response_direction=response.direction,
        reference_node=reference.node if reference else 0,
        reference_direction=reference.direction if reference else "scalar",
        ordinate="general" if kind == COHERENCE else response.quantity,
        ordinate_unit="1" if kind == COHERENCE else response.unit or UNIT[response.quantity],
        denominator=over.quantity if over else "none",
        denominator_unit=(over.unit or UNIT[over.quantity]) if over else "",
        id_lines=id_lines,
        response_name=response.name,
        reference_name=reference.name if reference else "",
    )


def triple(values: npt.ArrayLike, digits: int | None = None) -> tuple[float, float, float]:
    """Return three numbers of a table, rounded where digits are given."""
    array = np.asarray(values)
    # + 0.0 turns a rounded -0.0 into 0.0
    x, y, z = (array if digits is None else np.round(array, digits) + 0.0).tolist()
    return x, y, z


def sensor_row(
    place: Place, kind: str, model: str, position: npt.ArrayLike, angles: npt.ArrayLike
) -> SensorRow:
    """Return a row of a position sheet, to 0.1 mm, with angles [rad]."""
    return SensorRow(
        sensor=place.name,
        kind=kind,
        model=model,
        mount=place.point.mount,
        piece=place.point.piece,
        position=triple(position, 4),
        angles=triple(angles),
    )


def write_readme(folder: Path, title: str, about: str, kind: str, file: str) -> None:
    """Write ``README.txt``: title, what was measured and how, and where every file is explained."""
    lines = [title, "=" * len(title), ""]
    for text in (ABOUT, about, CONVENTIONS.format(kind=kind, file=file)):
        lines += [*textwrap.wrap(text, 88), ""]
    replace_text(folder / "README.txt", "\n".join(lines))


def stacked(parts: Iterable[Any], *names: str) -> dict[str, Any]:
    """Return some arrays that all parts have, stacked along a new first axis."""
    parts = list(parts)
    return {name: np.array([getattr(part, name) for part in parts]) for name in names}


def write_json(path: Path, content: dict[str, Any]) -> None:
    """Write a truth as JSON: arrays as lists, complex numbers as pairs."""
    replace_text(path, json.dumps(content, indent=1, default=_as_lists) + "\n")


def _as_lists(value: Any) -> Any:
    """Return what JSON has of an array or a complex number."""
    return [value.real, value.imag] if isinstance(value, complex) else value.tolist()
