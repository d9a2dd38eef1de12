"""Functions that SDynPy saved with ``NDDataArray.save``: npz files, of which nothing is unpickled.

SDynPy states no units and no quantities. A table beside the file does, with the same name and the
ending ``.csv`` and the columns ``role`` (``response`` or ``reference``), ``node``, ``quantity`` and
``unit``, and ``direction`` where one node has several quantities; a row without a direction holds
for all directions of its node that have no row of their own, one without a node for all nodes.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError, naming
from deboom.files.disk import read_arrays
from deboom.files.schema import for_each
from deboom.files.tables import MayBeEmpty, Optional, TableRow, number_in, read_table
from deboom.files.uff import DIRECTIONS, UffFunction, numbers_that_fit
from deboom.files.units import Unit, parse_unit

_FIELDS = ("abscissa", "ordinate", "coordinate", *(f"comment{n}" for n in range(1, 6)))
_TYPES = (0, 1, 2, 3, 4, 6, 9, 12, 27)
"""Function types that SDynPy and UFF have in common."""
_SI = {
    "displacement": "m",
    "velocity": "m/s",
    "acceleration": "m/s^2",
    "force": "N",
    "pressure": "Pa",
    "general": "1",
}
_RESPONSE, _REFERENCE = "response", "reference"


@dataclass(frozen=True)
class SignalRow(TableRow):
    """Quantity and unit of responses or references.

    - `role`: ``response`` or ``reference``.
    - `node`: number; ``""`` for all others of the role.
    - `direction`: ``+x`` … ``-rz`` or ``scalar``, with a node; ``""`` for all others of it. The
      sign does not count.
    - `quantity`: such as ``acceleration``, ``pressure`` or ``force``.
    - `unit`: of the values in the file, such as ``g`` or ``N``.
    """

    unique = ("{0.role} '{0.node}' {0.along}",)
    role: str
    node: Annotated[str, MayBeEmpty]
    quantity: str
    unit: str
    direction: Annotated[str, Optional("")] = ""

    @property
    def along(self) -> str:
        """Direction without its sign."""
        return self.direction.lstrip("+-")

    def _check(self) -> None:
        if self.role not in (_RESPONSE, _REFERENCE):
            raise InputError(f"role '{self.role}': use {_RESPONSE} or {_REFERENCE}")
        if self.node and not number_in(self.node) >= 1:
            raise InputError(f"node '{self.node}' is no whole number from 1")
        if self.direction and (not self.node or self.direction not in DIRECTIONS.values()):
            raise InputError(
                f"direction '{self.direction}': state it beside a node, as one of "
                f"{', '.join(DIRECTIONS.values())}"
            )
        if self.quantity not in _SI:
            raise InputError(f"unknown quantity '{self.quantity}', use {', '.join(_SI)}")
        si = _SI[self.quantity]
        if parse_unit(self.unit, si).si != si:
            raise InputError(f"'{self.unit}' is no unit of {self.quantity}: use {si} or a multiple")


def read_sdynpy(path: Path) -> tuple[UffFunction, ...]:
    """Read the functions of an npz file of SDynPy.

    Parameters
    ----------
    path : Path
        Written by ``NDDataArray.save``, with its table of quantities and units beside it.

    Returns
    -------
    tuple of UffFunction
        In SI, in the order of the file.

    Raises
    ------
    InputError
        No table; a damaged file, or one that is not SDynPy's; a type of function or a direction
        that UFF does not have; a node without its row.

    Examples
    --------
    >>> from pathlib import Path
    >>> from deboom.files.sdynpy_npz import read_sdynpy
    >>> read_sdynpy(Path("wagon.npz"))[0].dof  # doctest: +SKIP
    'node 1 +x acceleration, reference node 101 -z'
    """
    content = read_arrays(path, "save it again with SDynPy")
    data, kind = content.get("data"), content.get("function_type")
    if data is None or kind is None or not set(_FIELDS) <= set(data.dtype.names or ()):
        raise InputError(
            f"{path} holds {', '.join(content) or 'nothing'}, and no functions of SDynPy: save "
            "them with NDDataArray.save, or export UFF data set 58"
        )
    code = int(kind.item()) if kind.size == 1 and kind.dtype.kind in "iu" else -1
    if code not in _TYPES:
        raise InputError(
            f"{path} is of SDynPy's function type {kind}: save frequency responses, spectra or "
            "time responses"
        )
    table = path.with_suffix(".csv")
    if not table.is_file():
        raise InputError(
            f"{path} states no units: write {table.name} beside it with the columns role, node, "
            "quantity, unit, such as 'response,,acceleration,m/s^2' and 'reference,,force,N'"
        )
    rows = {(row.role, row.node, row.along): row for row in read_table(table, SignalRow)}
    with numbers_that_fit(path):
        return for_each(lambda record: _function(path, code, rows, record), np.ravel(data))


_Rows = dict[tuple[str, str, str], SignalRow]


def _function(path: Path, code: int, rows: _Rows, record: npt.NDArray[Any]) -> UffFunction:
    places = np.ravel(record["coordinate"])
    if places.size not in (1, 2):
        raise InputError(
            f"{path}: a function has {places.size} coordinates: save it with a response, and a "
            "reference if it has one"
        )
    nodes = [int(place["node"]) for place in places]
    for place in places:
        if int(place["direction"]) not in DIRECTIONS:
            raise InputError(
                f"{path}: node {place['node']} has direction {place['direction']}, which is none "
                "of -6 to 6"
            )
    directions = [DIRECTIONS[int(place["direction"])] for place in places]
    above, unit = _signal(path, rows, _RESPONSE, nodes[0], directions[0])
    values, below, per, label = record["ordinate"] * unit.factor, "none", "", unit.label
    if len(nodes) > 1:
        below, reference = _signal(path, rows, _REFERENCE, nodes[1], directions[1])
        values, per = values / reference.factor, reference.si
        label = f"{unit.label}/{reference.label}"
    with naming(path):
        return UffFunction(
            abscissa=record["abscissa"],
            values=values,
            function_type=code,
            response_node=nodes[0],
            response_direction=directions[0],
            reference_node=nodes[1] if per else 0,
            reference_direction=directions[1] if per else "scalar",
            ordinate=above,
            ordinate_unit=unit.si,
            denominator=below,
            denominator_unit=per,
            id_lines=tuple(str(record[f"comment{n}"]).strip() for n in range(1, 6)),
            file_unit=label,
        )


def _signal(path: Path, rows: _Rows, role: str, node: int, direction: str) -> tuple[str, Unit]:
    keys = ((str(node), direction.lstrip("+-")), (str(node), ""), ("", ""))
    row = next((rows[role, *key] for key in keys if (role, *key) in rows), None)
    if row is None:
        raise InputError(
            f"{path}: {role} node {node} {direction} has no row in "
            f"{path.with_suffix('.csv').name}: add one, or one without a node for all {role}s"
        )
    return row.quantity, parse_unit(row.unit, _SI[row.quantity])
