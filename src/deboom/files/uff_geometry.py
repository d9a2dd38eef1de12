"""Geometry of UFF files: nodes (data sets 15 and 2411), their axes (18, 2420), trace lines (82)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from deboom.arrays import IntArray, RealArray
from deboom.errors import InputError
from deboom.files.rows import PlacedImpact, PlacedSensor
from deboom.files.schema import refuse_all
from deboom.files.uff import UffFunction, numbers_that_fit, read_sets
from deboom.files.units import parse_unit
from deboom.physics.rigid_body import rotation_angles

NODES, AXES_OF_TEST, AXES_OF_FE, TRACES = (15, 2411), 18, 2420, 82
_GLOBAL = np.eye(3)


@dataclass(frozen=True, eq=False)
class UffGeometry:
    """Nodes of a structure, as a UFF file states them.

    - `nodes` (n,): numbers, in the order of the file.
    - `positions` (n, 3): in the axes of the file [m].
    - `orientations` (n, 3, 3): axes along which the functions of a node point, columns, in those of
      the file [1].
    - `traces`: lines to be drawn, each a sequence of places in `nodes`.
    """

    nodes: IntArray
    positions: RealArray
    orientations: RealArray
    traces: tuple[tuple[int, ...], ...]

    def place(self, node: int) -> int:
        """Return where a node stands in `nodes`.

        - raises InputError: it is not there.
        """
        if node not in self._places:
            raise InputError(f"node {node} is not in the geometry: export it with all nodes")
        return self._places[node]

    @cached_property
    def _places(self) -> dict[int, int]:
        return {node: place for place, node in enumerate(self.nodes.tolist())}


def read_uff_geometry(path: Path | str, length: str | None = None) -> UffGeometry:
    """Read nodes, their axes and trace lines.

    Parameters
    ----------
    path : path
        UFF file with data sets 15 or 2411; 18 or 2420 turn the axes of nodes, 82 draws lines.
    length : str, optional
        Unit of the positions, such as ``"mm"``, where the file states none (data set 164).

    Returns
    -------
    UffGeometry
        In m.

    Raises
    ------
    InputError
        The file is damaged or has no nodes; a node comes twice; the unit of length is neither in
        the file nor given, or both differ; a coordinate system is missing, cylindrical or
        spherical; a trace line goes to a node that is not there.

    Examples
    --------
    >>> from deboom.files.uff_geometry import read_uff_geometry
    >>> read_uff_geometry("body.uff").positions.shape  # doctest: +SKIP
    (120, 3)
    """
    path = Path(path)
    sets, scale = read_sets(path, (*NODES, AXES_OF_TEST, AXES_OF_FE, TRACES))
    if not any(each["type"] in NODES for each in sets):
        raise InputError(f"{path} has no nodes (data sets 15 or 2411): export the geometry")
    with numbers_that_fit(path):
        return _geometry(path, sets, _length(path, scale, length))


def _geometry(path: Path, sets: Sequence[Mapping[str, Any]], factor: float) -> UffGeometry:
    blocks = [each for each in sets if each["type"] in NODES]
    systems = _systems(path, sets)
    nodes = np.concatenate([_whole(path, block["node_nums"]) for block in blocks])
    numbers, counts = np.unique(nodes, return_counts=True)
    if np.any(counts > 1):
        raise InputError(f"{path}: node {numbers[counts > 1][0]} comes twice: keep one")
    local = np.concatenate(
        [np.stack([np.asarray(block[axis], dtype=float) for axis in "xyz"], 1) for block in blocks]
    )
    stated = {
        name: np.concatenate([np.asarray(block[name], dtype=int) for block in blocks])
        for name in ("def_cs", "disp_cs")
    }
    refuse_all(_missing_systems(path, stated, systems))
    defined = [systems.get(int(number), (np.zeros(3), _GLOBAL)) for number in stated["def_cs"]]
    positions = np.array(
        [origin + axes @ place for (origin, axes), place in zip(defined, local, strict=True)]
    )
    if not np.isfinite(positions).all():
        raise InputError(f"{path}: a position is no finite number: export the geometry again")
    return UffGeometry(
        nodes=nodes,
        positions=factor * positions,
        orientations=np.array(
            [systems.get(int(n), (np.zeros(3), _GLOBAL))[1] for n in stated["disp_cs"]]
        ),
        traces=_traces(path, nodes, [each for each in sets if each["type"] == TRACES]),
    )


def placed_at_nodes(
    geometry: UffGeometry, functions: Iterable[UffFunction]
) -> tuple[tuple[PlacedSensor, ...], tuple[PlacedImpact, ...]]:
    """Return the sensor and impact tables of functions per force, for a hammer test.

    - `geometry`: with every node of the functions.
    - `functions`: their responses are triaxial sensors along the axes of their nodes, their
      references impacts.
    - returns: one sensor per response node, named ``N`` and its number; one impact per reference
      node and direction, ``N7 -z``. `deboom.files.rows.write_positions` writes both.
    - raises InputError: a node that the geometry lacks; a reference without direction, or a
      rotation.
    """
    listed = list(functions)
    sensors = [
        PlacedSensor(
            sensor=f"N{node}",
            node=node,
            position=_three(geometry.positions[geometry.place(node)]),
            angles=_three(rotation_angles(geometry.orientations[geometry.place(node)])),
        )
        for node in dict.fromkeys(function.response_node for function in listed)
    ]
    impacts = []
    struck = dict.fromkeys((each.reference_node, each.reference_direction) for each in listed)
    for node, direction in struck:
        if direction[1:] not in ("x", "y", "z"):
            raise InputError(
                f"reference node {node} has the direction '{direction}': export functions with "
                "the direction of each blow, +x to -z"
            )
        axes = geometry.orientations[geometry.place(node)]
        along = axes[:, "xyz".index(direction[1:])] * (-1.0 if direction[0] == "-" else 1.0)
        impacts.append(
            PlacedImpact(
                impact=f"N{node} {direction}",
                node=node,
                position=_three(geometry.positions[geometry.place(node)]),
                direction=_three(along),
            )
        )
    return tuple(sensors), tuple(impacts)


def _three(vector: RealArray) -> tuple[float, float, float]:
    x, y, z = map(float, vector)
    return x, y, z


def _length(path: Path, scale: tuple[float, float] | None, stated: str | None) -> float:
    """Metres per unit of the file."""
    given = None if stated is None else parse_unit(stated, "m")
    if given is not None and given.si != "m":
        raise InputError(f"'{stated}' is no unit of length: give one, such as mm")
    if scale is None and given is None:
        raise InputError(
            f"{path} states no unit of length (data set 164): export it with units, or give the "
            "length, such as length='mm'"
        )
    if scale is None:
        return given.factor if given else 1.0
    if given is not None and abs(given.factor * scale[0] - 1.0) > 1e-6:
        raise InputError(
            f"{path} states a length of {1 / scale[0]:g} m (data set 164), and '{stated}' is "
            f"given: leave it out, or correct the file"
        )
    return 1.0 / scale[0]


_Systems = dict[int, tuple[RealArray, RealArray]]
"""Number of a coordinate system to its origin (3,) and axes, columns (3, 3)."""


def _systems(path: Path, sets: Sequence[Mapping[str, Any]]) -> _Systems:
    systems: _Systems = {}
    for each in sets:
        if each["type"] == AXES_OF_FE:
            kinds = zip(each["CS_sys_labels"], each["CS_types"], each["CS_matrices"], strict=True)
            for number, kind, matrix in kinds:
                _refuse_curved(path, number, kind)
                # rows of the matrix are the axes, the last one the origin
                systems[int(number)] = np.asarray(matrix[3], float), np.asarray(matrix[:3], float).T
        elif each["type"] == AXES_OF_TEST:
            for k, number in enumerate(each["cs_num"]):
                _refuse_curved(path, number, each["cs_type"][k])
                if int(each["ref_cs_num"][k]) not in (0, int(number)):
                    raise InputError(
                        f"{path}: coordinate system {number:g} is stated in system "
                        f"{each['ref_cs_num'][k]:g}: export it in the global one"
                    )
                origin = np.asarray(each["ref_o"][k], dtype=float)
                along = np.asarray(each["x_point"][k], dtype=float) - origin
                plane = np.asarray(each["xz_point"][k], dtype=float) - origin
                systems[int(number)] = origin, _axes(path, int(number), along, plane)
    return systems


def _axes(path: Path, number: int, along: RealArray, plane: RealArray) -> RealArray:
    """Axes, columns, by a vector along x and another one in the plane of x and z."""
    across = np.cross(plane, along)
    if np.linalg.norm(across) < 1e-6 * np.linalg.norm(plane) * np.linalg.norm(along) or not (
        np.linalg.norm(along) > 0
    ):
        raise InputError(f"{path}: the points of coordinate system {number} lie on one line")
    x, y = along / np.linalg.norm(along), across / np.linalg.norm(across)
    return np.stack([x, y, np.cross(x, y)], axis=1)


def _refuse_curved(path: Path, number: float, kind: float) -> None:
    if int(kind) != 0:
        raise InputError(
            f"{path}: coordinate system {number:g} is cylindrical or spherical: export Cartesian "
            "ones"
        )


def _missing_systems(
    path: Path, stated: Mapping[str, IntArray], systems: _Systems
) -> Iterable[str]:
    """Give a sentence for each system that nodes name and the file lacks; 0 and 1 are global."""
    for number in sorted({int(each) for numbers in stated.values() for each in numbers}):
        if number not in (0, 1) and number not in systems:
            yield (
                f"{path}: nodes stand in coordinate system {number}, which is not in the file: "
                "export data sets 18 or 2420 with it"
            )


def _whole(path: Path, numbers: npt.ArrayLike) -> IntArray:
    """Return numbers of nodes, which the reader may take for decimals."""
    values = np.asarray(numbers, dtype=float)
    wrong = values[~(np.abs(values) < 2**31) | (values != np.rint(values))]
    if wrong.size:
        raise InputError(f"{path}: node {wrong[0]:g} is no whole number: export it again")
    return values.astype(int)


def _traces(
    path: Path, nodes: IntArray, sets: Sequence[Mapping[str, Any]]
) -> tuple[tuple[int, ...], ...]:
    places = {int(node): place for place, node in enumerate(nodes)}
    lines: list[tuple[int, ...]] = []
    for each in sets:
        line: list[int] = []
        for node in (*_whole(path, each["nodes"]).tolist(), 0):
            if node == 0:  # the pen goes up
                lines += [tuple(line)] if len(line) > 1 else []
                line = []
            elif node not in places:
                raise InputError(f"{path}: a trace line goes to node {node}, which is not there")
            else:
                line.append(places[node])
    return tuple(lines)
