"""Functions and signals of any file that deboom reads, by name, to be looked at."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from deboom.arrays import RealArray, RealOrComplexArray
from deboom.errors import InputError
from deboom.files.disk import kind_of
from deboom.files.function_table import (
    is_nodal,
    is_table,
    read_function_table,
    read_nodal,
    real_where_it_is,
)
from deboom.files.tables import name_and_unit, read_columns
from deboom.files.time_data import read_time_signals
from deboom.files.uff import UffFunction
from deboom.files.units import parse_unit


class CurveKind(Enum):
    """What a curve is over, and how it is drawn."""

    function = "function over frequency"
    coherence = "coherence"
    signal = "signal over time"


@dataclass(frozen=True, eq=False)
class Curve:
    """One function or signal of a file.

    - `name`: of the channel, or response and reference of a function by node.
    - `abscissa` (n,) [Hz] or [s]; `values` (n,): [unit].
    - `unit`: SI label; that of the file where deboom does not know it, ``""`` without one.
    - `response`, `reference`: node and direction, ``""`` where the file has names instead.
    """

    name: str
    kind: CurveKind
    abscissa: RealArray
    values: RealOrComplexArray
    unit: str
    response: str = ""
    reference: str = ""


_COHERENCE, _TIME = 6, 1


def read_curves(path: Path) -> list[Curve]:
    """Read everything of a file that is a function over frequency or a signal over time.

    - `path`: UFF, Nastran punch, SDynPy, CSV, xlsx, MATLAB, MDF, TDMS, HDF5, LVM or WAV.
    - returns: in the order of the file, in SI where the unit is known.
    - raises InputError: as the readers of these files; a file with nothing to look at.
    """
    if kind_of(path) == "a UFF file" or is_nodal(path):
        curves = [_of_node(function) for function in read_nodal(path)]
    elif is_table(path) and _over_frequency(path):
        table = read_function_table(path)
        curves = []
        for name in table.functions:
            unit, values = table.spectrum(name)
            curves.append(Curve(name, CurveKind.function, table.frequency, values, unit.si))
    else:
        curves = []
        for name, signal in read_time_signals(path, None).items():
            si, factor = signal.unit, 1.0
            try:
                unit = parse_unit(signal.unit)
                si, factor = unit.si, unit.factor
            except InputError:  # a unit that deboom does not know stays as the file has it
                pass
            scaled = factor * signal.values
            curves.append(Curve(name, CurveKind.signal, signal.time, scaled, si))
    if not curves:
        raise InputError(f"{path} has neither functions over frequency nor signals over time")
    return curves


def _of_node(function: UffFunction) -> Curve:
    response = f"{function.response_node} {function.response_direction}"
    reference = f"{function.reference_node} {function.reference_direction}"
    kinds = {_TIME: CurveKind.signal, _COHERENCE: CurveKind.coherence}
    return Curve(
        function.dof,
        kinds.get(function.function_type, CurveKind.function),
        function.abscissa,
        real_where_it_is(function.values),
        function.unit,
        response,
        reference if function.reference_node else "",
    )


def _over_frequency(path: Path) -> bool:
    """Tell whether a table is over frequency, not over time."""
    if path.suffix.lower() in (".csv", ".xlsx"):
        headers = read_columns(path, "frequency").texts
        return any(name_and_unit(header)[0] == "frequency" for header in headers)
    try:
        read_function_table(path)
    except InputError as error:
        if "frequency" in str(error):
            return False
        raise
    return True
