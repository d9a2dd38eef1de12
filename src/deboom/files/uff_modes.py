"""Mode shapes in UFF files: data set 55, read and written."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from deboom.arrays import ComplexArray, IntArray, RealArray
from deboom.errors import InputError
from deboom.files.disk import refuse_announced
from deboom.files.function_table import Dof
from deboom.files.uff import numbers_that_fit, read_sets, write_sets
from deboom.files.uff_geometry import UffGeometry
from deboom.measurement.modal import ModalModel

MODES = 55
_NORMAL, _COMPLEX = 2, (3, 7)
"""Analysis types: real modes; complex ones of first and second order."""
_DISPLACEMENT = 8


@dataclass(frozen=True, eq=False)
class UffModes:
    """Modes at nodes.

    - `frequency` (n_mode,): natural frequencies [Hz].
    - `damping` (n_mode,): damping ratios [1].
    - `nodes` (n_node,): numbers.
    - `shapes` (n_mode, n_node, 3): displacement along the axes of each node [any unit].
    """

    frequency: RealArray
    damping: RealArray
    nodes: IntArray
    shapes: ComplexArray

    @property
    def titles(self) -> tuple[str, ...]:
        """Frequency and damping of each mode in words."""
        pairs = zip(self.frequency, self.damping, strict=True)
        return tuple(f"{f:.1f} Hz, ζ {100 * zeta:.1f} %" for f, zeta in pairs)

    def on(self, geometry: UffGeometry) -> ComplexArray:
        """Return the motion of all nodes of a geometry along its axes, (n_mode, n_node, 3).

        A node without a shape stays where it is.

        - raises InputError: a shape at a node that the geometry lacks.
        """
        motion = np.zeros((len(self.frequency), len(geometry.nodes), 3), dtype=complex)
        for column, node in enumerate(self.nodes):
            place = geometry.place(int(node))
            motion[:, place] = self.shapes[:, column] @ geometry.orientations[place].T
        return motion


def read_uff_modes(path: Path | str) -> UffModes:
    """Read mode shapes.

    Parameters
    ----------
    path : path
        UFF file with a data set 55 for each mode: normal or complex modes, displacements along
        three axes of each node; rotations beside them are refused unless they are 0.

    Returns
    -------
    UffModes
        By rising frequency.

    Raises
    ------
    InputError
        The file is damaged or has no modes; data of another kind, such as stresses or operating
        deflections; a node that comes twice in a mode.

    Examples
    --------
    >>> from deboom.files.uff_modes import read_uff_modes
    >>> read_uff_modes("modes.uff").titles[0]  # doctest: +SKIP
    '23.7 Hz, ζ 2.8 %'
    """
    path = Path(path)
    sets, _ = read_sets(path, (MODES,))
    if not sets:
        raise InputError(f"{path} has no modes (data set 55): export the shapes of the modes")
    with numbers_that_fit(path):
        return _modes(path, sets)


def _modes(path: Path, sets: Sequence[Mapping[str, Any]]) -> UffModes:
    facts = [_mode(path, number, content) for number, content in enumerate(sets, 1)]
    nodes = np.unique(np.concatenate([np.asarray(each["node_nums"], dtype=int) for each in sets]))
    # two numbers for each of three motions; nodes that few modes have take as much as others
    refuse_announced(f"{path}: its modes at all nodes of the file", 6 * len(sets) * nodes.size)
    shapes = np.zeros((len(sets), nodes.size, 3), dtype=complex)
    for row, content in enumerate(sets):
        columns = np.searchsorted(nodes, np.asarray(content["node_nums"], dtype=int))
        if len(set(columns)) < len(columns):
            raise InputError(f"{path}: mode {row + 1} has a node twice: export it again")
        for axis, name in enumerate(("r1", "r2", "r3")):
            shapes[row, columns, axis] = content[name]
    if not np.isfinite(shapes).all():
        raise InputError(f"{path}: a shape holds what is no finite number: export it again")
    frequency, damping = np.array(facts).T
    order = np.argsort(frequency, kind="stable")
    return UffModes(frequency[order], damping[order], nodes, shapes[order])


def write_uff_modes(path: Path | str, modes: UffModes) -> None:
    """Write modes as complex ones of first order, displacements with six digits.

    - `path`: UFF file; one that exists is replaced.
    - `modes`: with a frequency above 0 and a damping ratio below 1.
    - raises InputError: other modes; the file cannot be written.
    """
    path = Path(path)
    if not (np.all(modes.frequency > 0) and np.all(np.abs(modes.damping) < 1)):
        raise InputError(f"{path}: a mode has a frequency above 0 and a damping ratio below 1")
    omega = 2 * np.pi * modes.frequency
    poles = omega * (-modes.damping + 1j * np.sqrt(1 - modes.damping**2))
    write_sets(
        path,
        [
            {
                "type": MODES,
                "id1": "NONE",
                "id2": "NONE",
                "id3": "NONE",
                "id4": "NONE",
                "id5": "NONE",
                "model_type": 1,
                "analysis_type": _COMPLEX[0],
                "data_ch": 2,
                "spec_data_type": _DISPLACEMENT,
                "load_case": 1,
                "mode_n": number,
                "eig": complex(pole),
                "node_nums": modes.nodes,
                **{f"r{axis + 1}": shape[:, axis].astype(complex) for axis in range(3)},
            }
            for number, (pole, shape) in enumerate(zip(poles, modes.shapes, strict=True), 1)
        ],
    )


def modes_at_nodes(model: ModalModel, dofs: Sequence[Dof]) -> UffModes:
    """Return the shapes of a modal model at the nodes of its outputs.

    - `model`: its shapes are those of displacement, whatever the form of its functions.
    - `dofs`: node and direction of each output, in their order; axes without an output are 0.
    - raises InputError: another number of them; a direction that is none of ``+x`` to ``-z``; two
      outputs along one axis of a node.
    """
    if len(dofs) != len(model.outputs):
        raise InputError(
            f"{len(dofs)} nodes do not fit {len(model.outputs)} outputs: give one each"
        )
    nodes = np.unique([dof.node for dof in dofs])
    shapes = np.zeros((len(model.clusters), nodes.size, 3), dtype=complex)
    seen: set[tuple[int, str]] = set()
    for column, dof in enumerate(dofs):
        axis = dof.direction[1:]
        if axis not in ("x", "y", "z") or (dof.node, axis) in seen:
            raise InputError(
                f"output '{dof.name}' at node {dof.node} {dof.direction}: give each output an axis "
                "of its own, +x to -z"
            )
        seen.add((dof.node, axis))
        sign = -1.0 if dof.direction.startswith("-") else 1.0
        place = int(np.searchsorted(nodes, dof.node))
        shapes[:, place, "xyz".index(axis)] = sign * model.shapes[:, column]
    return UffModes(model.frequency, model.damping, nodes, shapes)


def _mode(path: Path, number: int, content: Mapping[str, Any]) -> tuple[float, float]:
    """Frequency [Hz] and damping ratio [1] of a data set 55."""
    kind = content["analysis_type"]
    if kind not in (_NORMAL, *_COMPLEX) or content["data_ch"] not in (2, 3):
        raise InputError(
            f"{path}: data set 55 number {number} holds no mode shape (analysis type {kind}, data "
            f"characteristic {content['data_ch']}): export modes, displacements of nodes"
        )
    if content["spec_data_type"] not in (0, 1, _DISPLACEMENT):
        raise InputError(
            f"{path}: mode {number} is of data type {content['spec_data_type']}, not displacement "
            "(8): export displacements"
        )
    if any(np.any(content[name]) for name in ("r4", "r5", "r6") if name in content):
        raise InputError(
            f"{path}: mode {number} has rotations of its nodes, which are not read: export "
            "translations"
        )
    if kind == _NORMAL:
        return float(content["freq"]), float(content["modal_damp_vis"])
    pole = complex(content["eig"])
    size = abs(pole)
    return size / (2 * np.pi), (-pole.real / size + 0.0 if size else 0.0)
