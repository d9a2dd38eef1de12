"""Functions of a file by DoF (UFF, Nastran's punch) or by name (CSV, xlsx, MATLAB's mat)."""

from __future__ import annotations

import math
import re
import warnings
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from operator import attrgetter
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray, RealOrComplexArray
from deboom.errors import DataWarning, InputError, naming
from deboom.files.binary_formats import MATLAB, MATLAB_73
from deboom.files.disk import LARGEST_FILE, blocks, opened_file
from deboom.files.kinds import FunctionFiles
from deboom.files.nastran_punch import read_punch
from deboom.files.reader_process import read_apart
from deboom.files.schema import noting, telling
from deboom.files.sdynpy_npz import read_sdynpy
from deboom.files.tables import Columns, name_and_unit, number_in, read_columns
from deboom.files.uff import QUANTITY_CODE, UffFunction, read_uff
from deboom.files.units import RANGES, Unit, parse_unit, refuse_beyond
from deboom.measurement.channels import ADDED_DECAY, Frf, Spectrum
from deboom.physics.order_tracking import frequency_of_order

TABLE_ENDINGS = tuple(f".{kind.value}" for kind in FunctionFiles if kind is not FunctionFiles.uff)
"""Files of functions that are tables; in any other, functions stand by node and direction."""


IN_SI = "in SI units, whatever the channel table says"
"""Last ID line of a function that was written into a campaign by deboom."""
ENTITY_NAME = 10
"""Characters of a channel's name that UFF keeps; the DoF is what counts."""
SAME_LINE = 1e-3
"""How far two lines may differ and still be the same, as a fraction of the least spacing."""
_ADDED_DECAY = re.compile(r"added decay rate\s+([-+.0-9eE]+)\s*1/s")
"""ID line of a function that was measured with an exponential window."""
TIME_SIGNAL, FRF = 1, 4
"""UFF function types: over time, and frequency response functions; all but 1 are over frequency."""
_QUANTITIES = {RANGES[name].unit: name for name in RANGES if name != "position"}
"""SI unit of functions → quantity in the table of ranges."""
SPEED_TOLERANCE = 0.5
"""Largest difference between a line and the tacho's speed times the order, in line spacings."""


@dataclass(frozen=True)
class Dof:
    """Degree of freedom of the files and what it stands for.

    - `name`: channel, blow or ear.
    - `node`: node in the UFF file.
    - `direction`: ``scalar``, or such as ``-y``.
    - `entity`: name that every function of this response must carry, such as the serial number of
      its microphone; ``""`` where any will do.
    - `sign`: −1 for a channel recorded against its axis.
    - `quantity`: name of the quantity for messages; ``""`` is the ordinate.
    - `unit`: unit of the channel table, which the file must have, too; None: the file's own counts.
    - `accepted`: directions that the file may state; by default `direction` alone. Against a
      response's direction the sign is turned.
    """

    name: str
    node: int
    direction: str
    entity: str = ""
    sign: float = 1.0
    quantity: str = ""
    unit: Unit | None = None
    accepted: tuple[str, ...] = ()

    @property
    def directions(self) -> tuple[str, ...]:
        """Directions that the file may state."""
        return self.accepted or (self.direction,)

    def function(
        self,
        abscissa: RealArray,
        values: RealOrComplexArray,
        function_type: int,
        ordinate: str,
        unit: str,
        id_lines: Sequence[str] = (),
    ) -> UffFunction:
        """Return the function of a response at this DoF, to be written."""
        return UffFunction(
            abscissa=abscissa,
            values=values if self.sign > 0 else -values,
            function_type=function_type,
            response_node=self.node,
            response_direction=self.direction,
            ordinate=ordinate,
            ordinate_unit=unit,
            id_lines=tuple(id_lines),
            response_name=self.name.replace(" ", "")[:ENTITY_NAME],
        )


ANY_REFERENCE = Dof("", 0, "scalar")
"""Reference of spectra, and of files whose functions share one."""


def same_lines(a: RealArray, b: RealArray) -> bool:
    """Tell whether lines are the same, but for the digits that a file keeps."""
    return a.size == b.size and not _differing(a, b).size


def first_difference(a: RealArray, b: RealArray) -> str:
    """Return in words where lines differ first."""
    n = min(a.size, b.size)
    different = _differing(a[:n], b[:n])
    if not different.size:
        return f"{a.size} and {b.size} lines"
    i = int(different[0])
    return f"line {i + 1} is {a[i]:.9g} Hz and {b[i]:.9g} Hz"


def _differing(a: RealArray, b: RealArray) -> npt.NDArray[np.intp]:
    largest = max((np.abs(a[part]).max() for part in blocks(a.size)), default=0.0)
    spacing = min(
        (np.diff(a[part.start : part.stop + 1]).min(initial=largest) for part in blocks(a.size)),
        default=largest,
    )
    different = [
        part.start + np.flatnonzero(np.abs(a[part] - b[part]) > SAME_LINE * spacing)
        for part in blocks(a.size)
    ]
    return np.concatenate(different) if different else np.zeros(0, dtype=np.intp)


def real_where_it_is(values: RealOrComplexArray) -> RealOrComplexArray:
    """Return real values where imaginary parts are 0: programs may store all as complex."""
    return values.real if np.iscomplexobj(values) and not np.any(values.imag) else values


def starts_at_0_hz(lines: RealArray, whose: object) -> bool:
    """Tell whether the first of at least three lines is at 0 Hz, and warn that it is left out."""
    if lines.size < 3 or lines[0] != 0:
        return False
    sentence = "the line at 0 Hz is left out: there sensors measure nothing, and ω divides by 0"
    warnings.warn(f"{whose}: {sentence}", DataWarning, stacklevel=3)
    return True


class FunctionMatrix:
    """Functions of a file, asked for by their DoF; all share one axis.

    - `path`: file of the functions.
    - `item`: item that it holds, for messages; may be ``""``.
    - `function_types`: UFF function types that are accepted.
    - `functions`: functions to choose from; by default those of the file.
    - raises InputError: no such file; functions of different axes, or over time without type 1.
    - warns DataWarning: a line at 0 Hz, where sensors measure nothing, was left out.
    """

    def __init__(
        self,
        path: Path,
        item: str,
        function_types: tuple[int, ...],
        functions: Sequence[UffFunction] | None = None,
    ) -> None:
        self.path = path
        self.item = item
        self.function_types = function_types
        self.functions = read_nodal(path) if functions is None else tuple(functions)
        self.axis: RealArray = self.functions[0].abscissa if self.functions else np.zeros(0)
        for function in self.functions:
            if TIME_SIGNAL not in function_types and function.abscissa_quantity != "frequency":
                raise self.error(
                    f"the abscissa of {function.dof} is {function.abscissa_quantity}: export it "
                    "over frequency in Hz"
                )
            rates = [(t.size - 1) / np.ptp(t) for t in (self.axis, function.abscissa)]
            if function_types == (TIME_SIGNAL,) and abs(rates[1] / rates[0] - 1) > SAME_LINE:
                raise self.error(
                    f"{self.functions[0].dof} is sampled at {rates[0]:.6g} Hz and {function.dof} "
                    f"at {rates[1]:.6g} Hz: export all at one rate"
                )
            if not same_lines(self.axis, function.abscissa):
                raise self.error(
                    f"the axes of {self.functions[0].dof} and {function.dof} differ: "
                    f"{first_difference(self.axis, function.abscissa)}; export all on the same "
                    "lines"
                )
        if TIME_SIGNAL not in function_types and starts_at_0_hz(self.axis, self.error("")):
            self.functions = tuple(
                replace(loaded, abscissa=loaded.abscissa[1:], values=loaded.values[1:])
                for loaded in self.functions
            )
            self.axis = self.functions[0].abscissa

    def error(self, sentence: str) -> InputError:
        """Return an error that names file and item."""
        return InputError(": ".join(filter(None, (str(self.path), self.item, sentence))))

    def values(
        self,
        responses: Sequence[Dof],
        references: Sequence[Dof] = (ANY_REFERENCE,),
        *,
        ordinate: str,
        unit: str,
        is_complex: bool = True,
    ) -> Any:
        """Return the functions of all pairs of DoF.

        - `responses`, `references`: rows and columns.
        - `ordinate`, `unit`: quantity in a word, and SI unit of the function, such as ``Pa/N``;
          ``""`` for any.
        - `is_complex`: the functions are spectra; otherwise real ones.
        - returns (n_line, n_response, n_reference): [unit].
        - raises InputError: functions that are missing, doubled, without unit, of another type,
          unit or microphone, beyond what a car has, or real instead of complex or vice versa.
        """
        shape = self.axis.size, len(responses), len(references)
        values: Any = np.zeros(shape, dtype=np.complex128 if is_complex else np.float64)
        with telling() as tell:
            for row, response in enumerate(responses):
                for column, reference in enumerate(references):
                    with noting(tell):
                        values[:, row, column] = self.function(
                            response, reference, ordinate=ordinate, unit=unit, is_complex=is_complex
                        )
        return values

    def frf(
        self,
        responses: Sequence[Dof],
        references: Sequence[Dof],
        ordinate: str,
        unit: str,
        label: str = "",
    ) -> Frf:
        """Return the functions of all pairs of DoF, see `values`; `label` writes their unit.

        An exponential window that their ID lines state comes as `Frf.added_decay_rate`.
        """
        values = self.values(responses, references, ordinate=ordinate, unit=unit)
        outputs, inputs = (tuple(dof.name for dof in dofs) for dofs in (responses, references))
        return Frf(self.axis, values, outputs, inputs, label or unit, self.added_decay_rate)

    @cached_property
    def added_decay_rate(self) -> float:
        """Decay of the exponential window that the ID lines state; 0 where none does [1/s].

        Functions that state different ones raise InputError.
        """
        stated: dict[float, str] = {}
        for function in self.functions:
            matches = [match for line in function.id_lines if (match := _ADDED_DECAY.search(line))]
            rate = number_in(matches[0][1]) if matches else 0.0
            if not 0 <= rate < math.inf:
                raise self.error(f"{function.dof}: '{matches[0][0]}' is no rate: correct it")
            stated.setdefault(rate, function.dof)
        if len(stated) > 1:
            (first, first_file), (second, other), *_ = stated.items()
            raise self.error(
                f"{first_file} states an added decay rate of {first:g} 1/s and {other} {second:g} "
                "1/s: measure all with one exponential window"
            )
        return next(iter(stated), 0.0)

    def spectrum(self, dofs: Sequence[Dof], ordinate: str, unit: str) -> Spectrum:
        """Return the spectra of all DoF, see `values`."""
        values = self.values(dofs, ordinate=ordinate, unit=unit)[:, :, 0]
        return Spectrum(self.axis, values, tuple(dof.name for dof in dofs), unit)

    def real(self, dofs: Sequence[Dof], ordinate: str, unit: str) -> RealArray:
        """Return the real functions of all DoF, (n_line, n_dof), see `values`; `dofs` may be ()."""
        values: RealArray = self.values(dofs, ordinate=ordinate, unit=unit, is_complex=False)
        return values[:, :, 0]

    def function(
        self, response: Dof, reference: Dof, *, ordinate: str, unit: str, is_complex: bool = True
    ) -> RealOrComplexArray:
        """Return the values of one pair of DoF, see `values`."""
        of = f" per {reference.name}" if reference.name else ""
        what = f"{response.quantity or ordinate or 'function'} '{response.name}'{of}"
        function = self._at(what, response, reference, ordinate)
        if response.entity and function.response_name != response.entity:
            raise self.error(
                f"{what} is of microphone '{function.response_name}', but '{response.name}' is "
                f"'{response.entity}': microphones must not be mixed, measure this one again"
            )
        if function.function_type not in self.function_types:
            kinds = " or ".join(map(str, self.function_types))
            raise self.error(
                f"{what} has UFF function type {function.function_type}: export it as {kinds}"
            )
        values = function.values
        values = values if is_complex else real_where_it_is(values)
        if np.iscomplexobj(values) != is_complex:
            remedy = (
                "real: export real and imaginary part, phase is needed"
                if is_complex
                else "complex: export it as real values"
            )
            raise self.error(f"{what} is {remedy}")
        self._check_unit(what, function, response.unit or reference.unit, unit)
        if unit in _QUANTITIES:
            with naming(self.error(what)):
                refuse_beyond(_QUANTITIES[unit], values)
        turned = function.response_direction not in ("scalar", response.direction)
        return values * (response.sign * reference.sign * (-1.0 if turned else 1.0))

    def check_known(self, responses: Sequence[Dof], references: Sequence[Dof] = ()) -> None:
        """Refuse functions that no table knows: they would be left out without a word.

        - raises InputError: a response, or a reference where any is given, at an unknown node or
          direction.
        """
        with telling() as tell:
            for what, dofs in (("response", responses), ("reference", references)):
                listed = {(dof.node, direction) for dof in dofs for direction in dof.directions}
                parts = (f"{what}_node", f"{what}_direction")
                places = dict.fromkeys(attrgetter(*parts)(each) for each in self.functions)
                for node, direction in [each for each in places if dofs and each not in listed]:
                    here = ", ".join(along for at, along in sorted(listed) if at == node)
                    remedy = "add it there, or export without it"
                    if here:
                        remedy = f"they have it along {here}: correct the wrong one"
                    place = f"{what} node".removeprefix("response ")
                    sentence = f"{place} {node} {direction} is not in the tables"
                    tell(self.error(f"{sentence}; {remedy}"))

    def check_order(self, order: float, remedy: str) -> None:
        """Refuse functions whose first ID line states another engine order.

        - raises InputError: there is one.
        """
        for function in self.functions:
            match = re.match(r"order\s+(\d+(?:\.\d+)?)", function.id_lines[0])
            if match and float(match[1]) != order:
                raise self.error(
                    f"{function.dof} is of order {match[1]}, not of order {order:g}: {remedy}"
                )

    def check_speed(self, speed: RealArray, order: float) -> None:
        """Refuse lines that are not the tacho's speed [rpm] times the order.

        - raises InputError: a line differs by more than half a spacing.
        """
        error = np.abs(frequency_of_order(speed, order) - self.axis)
        wrong = error > SPEED_TOLERANCE * np.diff(self.axis).min()
        if wrong.any():
            first = int(np.argmax(wrong))
            raise self.error(
                f"the tacho reads {speed[first]:.6g} rpm at {self.axis[first]:.6g} Hz, which is "
                f"not order {order:g}: a pulse may be missing; repair the tacho and track the "
                "order again"
            )

    def _at(self, what: str, response: Dof, reference: Dof, ordinate: str) -> UffFunction:
        """Return the one function of a pair of DoF."""
        here = self._by_node[response.node]
        matches = [
            function
            for function in here
            if function.ordinate == (ordinate or function.ordinate)
            and function.response_direction in response.directions
            and (
                not reference.name
                or (
                    function.reference_node == reference.node
                    and function.reference_direction in reference.directions
                )
            )
        ]
        if len(matches) == 1:
            return matches[0]
        dof = f"node {response.node} {response.direction}"
        if reference.name:
            dof += f", reference node {reference.node} {reference.direction}"
        if matches:
            raise self.error(f"{what} ({dof}) is in it {len(matches)} times: keep one")
        for other in here:
            if (
                ordinate in QUANTITY_CODE
                and other.ordinate in ("unknown", "general")
                and other.response_direction in response.directions
                and (not reference.name or other.reference_node == reference.node)
            ):
                stated = f"{QUANTITY_CODE[other.ordinate]}, {other.ordinate}"
                raise self.error(
                    f"{what} ({dof}) is not in it: the data type of the ordinate there is "
                    f"{stated}; write {QUANTITY_CODE[ordinate]}, {ordinate}"
                )
        near = [candidate for candidate in here if candidate.reference_node == reference.node]
        others = list(dict.fromkeys(candidate.dof for candidate in near or here or self.functions))
        more = f" and {len(others) - 3} more" if len(others) > 3 else ""
        there_are = f"; there are {'; '.join(others[:3])}{more}" if others else ""
        raise self.error(
            f"{what} ({dof}) is not in it: export it, or correct the tables{there_are}"
        )

    def _check_unit(self, what: str, function: UffFunction, table: Unit | None, unit: str) -> None:
        if unit and not function.ordinate_unit:
            says = f" (the channel table says '{table.label}')" if table else ""
            raise self.error(
                f"{what} has no unit: write a unit label or a data set 164 into the file{says}"
            )
        if unit and function.unit != unit:
            raise self.error(f"{what} is in '{function.unit}': export it in {unit}")
        if table is not None and function.id_lines[-1] != IN_SI:
            stated = parse_unit(function.file_unit, unit)
            if not math.isclose(stated.factor, table.factor, rel_tol=1e-9):
                raise self.error(
                    f"{what} is in '{function.file_unit}', but the channel table says "
                    f"'{table.label}': correct the wrong one, or leave the table's empty where "
                    "files differ"
                )

    @cached_property
    def _by_node(self) -> dict[int, list[UffFunction]]:
        by_node = defaultdict[int, list[UffFunction]](list)
        for function in self.functions:
            by_node[function.response_node].append(function)
        return by_node


def added_decay_line(rate: float) -> tuple[str, ...]:
    """Return the ID line that states the decay of an exponential window [1/s]; none for 0."""
    return (f"added decay rate {rate:.9g} 1/s",) if rate else ()


def frf_functions(
    frf: Frf, responses: Sequence[Dof], references: Sequence[Dof]
) -> tuple[UffFunction, ...]:
    """Return frequency response functions per force as functions to be written to a UFF file.

    - `frf`: outputs per force, such as [(m/s^2)/N] or [Pa/N]; the decay of its exponential window
      becomes an ID line, which is read back.
    - `responses`, `references`: degrees of freedom of its outputs and inputs, in their order.
    - raises InputError: other numbers of them, or a unit that is not one over N.
    """
    stated = frf.unit if isinstance(frf.unit, str) else ""
    above, _, below = stated.rpartition("/")
    unit = above.strip("()")
    quantity = next((name for name, si in _RESPONSES.items() if si == unit), "")
    if below != "N" or not quantity:
        raise InputError(f"functions in '{frf.unit}' are not written: give a motion or Pa per N")
    if (len(responses), len(references)) != frf.values.shape[1:]:
        raise InputError(
            f"{len(responses)} responses and {len(references)} references do not fit functions of "
            f"shape {frf.values.shape}"
        )
    notes = added_decay_line(frf.added_decay_rate)
    functions = []
    for o, response in enumerate(responses):
        for i, reference in enumerate(references):
            values = frf.values[:, o, i] * reference.sign
            plain = response.function(frf.frequency, values, FRF, quantity, unit, notes)
            functions.append(
                replace(
                    plain,
                    reference_node=reference.node,
                    reference_direction=reference.direction,
                    denominator="force",
                    denominator_unit=below,
                )
            )
    return tuple(functions)


_RESPONSES = {
    "displacement": "m",
    "velocity": "m/s",
    "acceleration": "m/s^2",
    "pressure": "Pa",
}
_FREQUENCY = "frequency"
_PARTS = ("real", "imag")
_HDF5 = b"\x89HDF"


@dataclass(frozen=True, eq=False)
class FunctionTable:
    """Functions of one file, as they stand there.

    - `frequency` (n,): [Hz].
    - `functions`: name to what reads unit label and complex values (n,) [that unit].
    - `added_decay_rate`: of an exponential window, from the column `ADDED_DECAY`; 0 without one
      [1/s].
    - `others`: columns that are part of no function, such as a magnitude.
    """

    frequency: RealArray
    functions: Mapping[str, Callable[[], tuple[str, ComplexArray]]]
    added_decay_rate: float = 0.0
    others: tuple[str, ...] = ()

    def spectrum(self, name: str) -> tuple[Unit, ComplexArray]:
        """Return unit and values of a function, in SI.

        - raises InputError: it is not there, or at fault.
        """
        if name not in self.functions:
            sentence = (
                f"the file has no function '{name}': add it, with real and imaginary part; there "
                f"are {_first_three(tuple(self.functions))}"
            )
            of_it = [each for each in self.others if each.startswith(name)]
            if others := of_it or ([] if self.functions else self.others):
                sentence += (
                    f"; {_first_three(others)} are neither: export real and imaginary part instead "
                    f"of magnitude or level and phase, as '{name} real [N]' and '{name} imag [N]'"
                )
            raise InputError(sentence)
        label, values = self.functions[name]()
        unit = parse_unit(label)
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            raise InputError(
                f"the value of line {bad[0] + 1} is {values[bad[0]]}; measure or export it again, "
                "deboom does not fill gaps"
            )
        return unit, values * unit.factor


def _first_three(names: Sequence[str]) -> str:
    more = f" and {len(names) - 3} more" if len(names) > 3 else ""
    return (", ".join(map(repr, names[:3])) or "none") + more


def _refuse_op2(path: Path) -> NoReturn:
    raise InputError(
        f"{path} is Nastran's OP2, which is not read: pyNastran needs a numpy below 2; ask for "
        "punch as well, DISPLACEMENT(PUNCH,REAL) = ..., or export UFF data set 58"
    )


_NODAL: Mapping[str, Callable[[Path], tuple[UffFunction, ...]]] = {
    ".pch": read_punch,
    ".op2": _refuse_op2,
    ".npz": read_sdynpy,
}
"""Endings of files with functions by node that are not UFF, and their readers."""


def is_nodal(path: Path) -> bool:
    """Tell by its ending whether a file that is not UFF has functions by node and direction."""
    return path.suffix.lower() in _NODAL


def read_nodal(path: Path) -> tuple[UffFunction, ...]:
    """Read functions by node and direction, in SI: punch or npz by its ending, else UFF.

    - raises InputError: as `read_uff`, `read_punch` or `read_sdynpy`.
    """
    return _NODAL.get(path.suffix.lower(), read_uff)(path)


def with_their_tables(paths: Iterable[Path]) -> tuple[Path, ...]:
    """Return files, each once, and behind each punch, npz or WAV its table of units.

    - `paths`: of functions and others.
    """
    files: dict[Path, None] = {}
    for path in paths:
        files |= {path: None}
        stated = is_nodal(path) or path.suffix.lower() == ".wav"
        files |= {path.with_suffix(".csv"): None} if stated else {}
    return tuple(files)


def is_table(path: Path) -> bool:
    """Tell by its ending whether functions of a file have names, instead of nodes as in UFF."""
    return path.suffix.lower() in TABLE_ENDINGS


def read_function_table(path: Path) -> FunctionTable:
    """Read every function of a table.

    - `path`: ``.csv``, ``.xlsx`` or ``.mat``.
    - raises InputError: the file is missing, damaged or no such table; it has no frequency in Hz,
      or one that is no finite number or does not increase. What is wrong with a single function is
      told when it is asked for.
    - warns DataWarning: a line at 0 Hz was left out.
    """
    table = _from_matlab(path) if path.suffix.lower() == ".mat" else _from_columns(path)
    lines = table.frequency
    wrong = [*np.flatnonzero(~np.isfinite(lines)), *(np.flatnonzero(np.diff(lines) <= 0) + 1)]
    if lines.size < 2 or wrong:
        k = int(wrong[0]) if wrong else 0
        fault = f"line {k + 1} is {lines[k]:g} Hz" if lines.size else "there is none"
        raise InputError(
            f"{path}: frequency needs two lines or more that increase: {fault}; export it again"
        )
    if starts_at_0_hz(lines, path):
        functions = {name: partial(_without_first, read) for name, read in table.functions.items()}
        return replace(table, frequency=lines[1:], functions=functions)
    return table


def _without_first(read: Callable[[], tuple[str, ComplexArray]]) -> tuple[str, ComplexArray]:
    label, values = read()
    return label, values[1:]


def _from_matlab(path: Path) -> FunctionTable:
    frequency, columns = matlab_table(path)
    # a constant column, as in the other tables
    _, rates = columns.pop(ADDED_DECAY, ("1/s", np.zeros(1)))
    functions = {name: partial(_as_complex, *column) for name, column in columns.items()}
    return FunctionTable(frequency, functions, _constant(path, rates.real))


def _as_complex(label: str, values: RealOrComplexArray) -> tuple[str, ComplexArray]:
    return label, values.astype(np.complex128, copy=False)


def _constant(path: Path, rates: RealArray) -> float:
    if np.ptp(rates) or not 0 <= rates[0] < math.inf:
        raise InputError(f"{path}: '{ADDED_DECAY}' needs one number for all lines, 0 or more")
    return float(rates[0])


def _from_columns(path: Path) -> FunctionTable:
    columns = read_columns(path, _FREQUENCY)
    by_name = {name_and_unit(header)[0]: header for header in columns.texts}
    header = by_name.get(_FREQUENCY, "")
    if header != "frequency [Hz]":
        separated = ", columns separated by commas" if path.suffix.lower() == ".csv" else ""
        raise InputError(f"{path}: there is no column 'frequency [Hz]': add it{separated}")
    with naming(path):
        (frequency,) = columns.numbers(header)
    parts = [name for name in by_name if name.rpartition(" ")[2] in _PARTS]
    stems = dict.fromkeys(name.rpartition(" ")[0] for name in parts)
    read = {stem: partial(_complex, stem, by_name, columns) for stem in stems}
    of_none = by_name.keys() - {*parts, _FREQUENCY, name_and_unit(ADDED_DECAY)[0]}
    rate = 0.0
    if ADDED_DECAY in columns.texts:
        with naming(path):
            (rates,) = columns.numbers(ADDED_DECAY)
        rate = _constant(path, rates)
    others = tuple(header for name, header in by_name.items() if name in of_none)
    return FunctionTable(frequency, read, rate, others)


def _complex(stem: str, by_name: Mapping[str, str], columns: Columns) -> tuple[str, ComplexArray]:
    for part in _PARTS:
        if f"{stem} {part}" not in by_name:
            raise InputError(f"there is no column '{stem} {part} [unit]': both parts are needed")
    real, imag = (by_name[f"{stem} {part}"] for part in _PARTS)
    label = name_and_unit(real)[1]
    if label is None or label != name_and_unit(imag)[1]:
        raise InputError(f"columns '{real}' and '{imag}' need one unit in brackets, the same")
    values = columns.numbers(real, imag)
    return label, values[0] + 1j * values[1]


def matlab_table(
    path: Path, axis: str = _FREQUENCY
) -> tuple[RealArray, dict[str, tuple[str, RealOrComplexArray]]]:
    """Read the columns of a MATLAB file.

    - `path`: file of any version from 5; 7.3 needs h5py.
    - `axis`: variable of the lines, ``frequency`` [Hz] or ``time`` [s].
    - returns (n,) `lines`; `columns`: name to unit label and values (n,) [that unit], complex where
      the file has an imaginary part that is not 0.
    - raises InputError: the file is damaged or no MATLAB file; a variable is missing, or does not
      fit the others; h5py is needed and not installed.
    """
    with opened_file(path, LARGEST_FILE) as file:
        start = file.read(516)
    if not start.strip():
        raise InputError(f"{path} is empty: export it again")
    is_hdf5 = start.startswith((b"MATLAB 7.3", _HDF5)) or start[512:] == _HDF5
    content, (lines, values) = read_apart(path, MATLAB_73 if is_hdf5 else MATLAB, [axis])
    names = zip(content["names"], content["units"], values.T, strict=True)
    return lines, {name: (unit, column) for name, unit, column in names}
