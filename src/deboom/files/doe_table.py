"""Designs, with or without responses, from a table or from the interactive page.

A table has a column per design variable with its unit in the header, such as ``TSM x [1]``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.doe import (
    RESERVED,
    SAME,
    Doe,
    Experiment,
    checked_within,
    designs_of,
    latin_hypercube,
)
from deboom.explore.space import DesignSpace
from deboom.files.disk import read_json, replace_bytes
from deboom.files.schema import doubled, noting, refuse_all, telling
from deboom.files.tables import (
    Columns,
    name_and_unit,
    number_in,
    read_columns,
    read_rows,
    workbook_bytes,
    write_frame,
)
from deboom.files.units import Unit, parse_unit

BOOKKEEPING = {
    "id",
    "rid",
    "m",
    "#",
    "design",
    "design id",
    "doe",
    "plan",
    "failure",
    "category",
    "generation",
    "feasible",
    "time",
    "date",
    "remark",
    "note",
    "pareto",
}
"""Columns of tables of designs that are neither variable nor response, in small letters."""


def read_plan(path: Path, space: DesignSpace) -> RealArray:
    """Read a user's table of designs.

    - `path`: ``.csv`` or ``.xlsx`` (first sheet), one column per design variable, in any order; or
      ``.json`` as the interactive page saves it: its design first, then those that are pinned.
    - `space`: its variables.
    - returns (n, k): [units of the space].
    - raises InputError: the file is missing or no table, a column is missing, unknown or without
      its unit, an entry is no number or outside its bounds: names line and column. A saved state
      of other variables.
    """
    if path.suffix.lower() == ".json":
        return _saved_designs(path, space)
    units = {name: _unit(unit) for name, unit in zip(space.names, space.units, strict=True)}
    si_units = {name: unit.si for name, unit in units.items() if unit.si}
    rows = read_rows(path, [name for name in units if name not in si_units], si_units)
    designs = np.empty((len(rows), space.n_variables))
    for column, (name, unit) in enumerate(units.items()):
        for place, row in enumerate(rows):
            value = row.number(name) / unit.factor
            if fault := _outside(space, column, value):
                raise row.error(fault)
            designs[place, column] = value
    return designs


def _outside(space: DesignSpace, column: int, value: float) -> str:
    """Say that a value is outside the bounds of its variable; empty if it is not."""
    lower, upper = float(space.lower[column]), float(space.upper[column])
    slack = SAME * (upper - lower)
    if lower - slack <= value <= upper + slack:
        return ""
    return (
        f"'{space.names[column]}' is {value:g}, outside its bounds {lower:g} to {upper:g} "
        f"[{space.units[column]}]: correct it or widen the bounds"
    )


@dataclass(frozen=True)
class DesignColumns:
    """Where the variables of a space stand in rows of texts, which are read one by one.

    - `space`: its variables.
    - `places` (k,): column of each.
    - `factors` (k,): value in the unit of the space per value in that of the column.
    """

    space: DesignSpace
    places: tuple[int, ...]
    factors: tuple[float, ...]

    @classmethod
    def of(cls, space: DesignSpace, headers: Sequence[str]) -> DesignColumns:
        """Return the columns of headers ``name [unit]``; others may stand beside them.

        - raises InputError: a variable has no column, or two; its unit is missing or another one's.
        """
        pairs = [name_and_unit(header) for header in headers]
        names = [name for name, _ in pairs]
        places, factors = [], []
        with telling() as tell:
            for name, label, unit in zip(space.names, space.labels, space.units, strict=True):
                with noting(tell):
                    if names.count(name) != 1:
                        state = "comes twice" if name in names else "is missing"
                        raise InputError(f"column '{label}' {state}: every variable needs one")
                    places.append(names.index(name))
                    factors.append(_factor(headers[places[-1]], pairs[places[-1]][1], unit))
        return cls(space, tuple(places), tuple(factors))

    def design(self, row: Sequence[str]) -> RealArray:
        """Return the design of a row, nan where it has no number, (k,) [units of the space]."""
        numbers = [number_in(row[place]) for place in self.places]
        return np.array(numbers) * self.factors

    def fault(self, row: Sequence[str]) -> str:
        """Say what is wrong with a row; empty if nothing is."""
        for column, value in enumerate(self.design(row).tolist()):
            name, text = self.space.names[column], row[self.places[column]]
            if not np.isfinite(value):
                return f"'{name}' is '{text}', no finite number"
            if self.space.integer[column] and not value.is_integer():
                return f"'{name}' is {text}, no whole number"
            if fault := _outside(self.space, column, value):
                return fault
        return ""


def _factor(header: str, label: str | None, unit: str) -> float:
    """Return the factor from the unit of a column to another one, 1 where both are the same."""
    if (label or "1") == unit:
        return 1.0
    column, wanted = _unit(label or "1"), _unit(unit)
    if not column.si or column.si != wanted.si:
        raise InputError(f"column '{header}' is not in {unit}: state its unit, [{unit}]")
    return column.factor / wanted.factor


def _unit(label: str) -> Unit:
    """Return the unit of a variable; one that only a foreign model knows has no SI unit."""
    try:
        return parse_unit(label)
    except InputError:
        return Unit(label, "", 1.0)


def _saved_designs(path: Path, space: DesignSpace) -> RealArray:
    """Read the designs of a state that the interactive page saved, (n, k)."""
    remedy = "save one with the button “Save” of the interactive page"
    content = read_json(path, remedy)
    try:
        names = [str(name) for name in content["variables"]]
        designs = [("its design", content["design"])]
        designs += [(f"its pin {pin['name']}", pin["design"]) for pin in content["pinned"]]
        rows = [np.asarray(design, dtype=float).reshape(len(names)) for _, design in designs]
    except (ValueError, KeyError, TypeError, OverflowError) as error:
        raise InputError(
            f"{path} is no state that the interactive page saved ({error}): {remedy}"
        ) from None
    refuse_all(f"{path}: {words}" for words in doubled("variables are named", names))
    if set(names) != set(space.names):
        odd = min(set(names) ^ set(space.names))
        raise InputError(
            f"{path} has designs of other variables: '{odd}' is in only one of both; save a design "
            "on the page of a run with the same variables"
        )
    table = np.stack(rows)[:, [names.index(name) for name in space.names]]
    for (name, _), row in zip(designs, table, strict=True):
        slack = SAME * (space.upper - space.lower)
        outside = ~((row >= space.lower - slack) & (row <= space.upper + slack))
        if outside.any():
            k = int(np.argmax(outside))
            raise InputError(
                f"{path}: {name} has '{space.names[k]}' {row[k]:g}, outside its bounds "
                f"{space.lower[k]:g} to {space.upper[k]:g}: widen the bounds or save another design"
            )
    return np.asarray(np.clip(table, space.lower, space.upper))


def read_designs(
    path: str | Path | pd.DataFrame,
    responses: Sequence[str],
    *,
    variables: Sequence[str] | None = None,
) -> Experiment:
    r"""Read designs that were evaluated elsewhere, such as a table of modeFRONTIER.

    Parameters
    ----------
    path : path or DataFrame
        ``.csv`` or ``.xlsx`` (first sheet), or the table itself: a row per design, units in the
        headers, such as ``TSM x [N/mm]``; a header without a unit is a plain number.
    responses : sequence of str
        Names of the response columns, without their unit.
    variables : sequence of str, optional
        Names of the columns of variables; by default all others but `BOOKKEEPING`.

    Returns
    -------
    Experiment
        As `deboom.doe` gives it: ``deboom.correlation(experiment)``, ``experiment.front()``. A
        design whose response is empty or no number has failed. The space reaches from the smallest
        to the largest value of each variable, and its nominal design is the first row.

    Raises
    ------
    InputError
        A file that is missing or no table; a column that is not there, or a variable that is no
        number, by line; no response at all.

    See Also
    --------
    deboom.write_designs, deboom.ResponseFunction, deboom.doe

    Examples
    --------
    >>> import deboom, tempfile, pathlib
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "designs.csv"
    >>> _ = path.write_text("ID;a [N/mm];y [dB]\n1;200;60.5\n2;250;59.0\n3;300;\n")
    >>> deboom.read_designs(path, ["y"]).doe.failures
    ('', '', 'not computed')
    """
    table = path if isinstance(path, pd.DataFrame) else None
    path = Path("DataFrame") if isinstance(path, pd.DataFrame) else Path(path)
    if not responses:
        raise InputError(f"{path}: name at least one response column")
    columns = read_columns(path, responses[0]) if table is None else Columns.of(table)
    headers = columns.by_name(path)
    if variables is None:
        variables = [
            name for name in headers if name not in responses and name.lower() not in BOOKKEEPING
        ]
    for name in (*responses, *variables):
        if name not in headers:
            raise InputError(f"{path}: there is no column '{name}', only {', '.join(headers)}")
    if not variables:
        raise InputError(f"{path} has no column beside the responses: add one per variable")
    units = {name: name_and_unit(header)[1] or "1" for name, header in headers.items()}
    designs = columns.numbers(*(headers[name] for name in variables)).T
    values = _computed(columns, [headers[name] for name in responses])
    failed = np.asarray(~np.isfinite(values).all(axis=1))
    if failed.all():
        raise InputError(f"{path}: no design has all of its responses: fill them in")
    values[failed] = np.nan
    return Experiment(
        Doe(
            name=path.stem,
            space=_space_around(variables, [units[name] for name in variables], designs),
            response_names=tuple(responses),
            response_unit=_unit_of_all([units[name] for name in responses]),
            designs=designs,
            responses=values,
            failures=tuple("not computed" if bad else "" for bad in failed.tolist()),
            plan=path.name,
        )
    )


def _unit_of_all(units: Sequence[str]) -> str:
    """Return the unit of all responses, or one of each; see `deboom.ResponseFunction`."""
    return units[0] if len(set(units)) == 1 else ", ".join(units)


def _space_around(names: Sequence[str], units: Sequence[str], designs: RealArray) -> DesignSpace:
    """Return the space that reaches as far as designs (n, k), the first of them nominal."""
    return DesignSpace(
        names=tuple(names),
        units=tuple(units),
        nominal=designs[0],
        lower=designs.min(axis=0),
        upper=designs.max(axis=0),
        tolerance=np.zeros(len(names)),
    )


def write_designs(
    path: str | Path,
    space: DesignSpace,
    responses: Sequence[str],
    *,
    designs: Any = None,
    n: int = 256,
    seed: int = 1,
) -> pd.DataFrame:
    """Write designs to be evaluated elsewhere, in the form that `read_designs` reads.

    Parameters
    ----------
    path : path
        ``.csv`` or ``.xlsx``; a file that is there is replaced.
    space : DesignSpace
        Variables of the designs.
    responses : sequence of str
        Headers of the columns to be filled in, with their unit, such as ``van [dB(A)]``.
    designs : array, shape (n, k), DataFrame, Front or what `read_run` gives, optional
        Designs [units of the space]; by default a Latin hypercube.
    n : int
        Number of designs of the Latin hypercube, at least 2.
    seed : int
        Seed of the Latin hypercube, from 1.

    Returns
    -------
    DataFrame
        What the file has: a row per design, its number, variables, and empty responses.

    Raises
    ------
    InputError
        No response, or one with the name of another column; designs outside of the bounds; another
        ending; a folder that is not there.

    See Also
    --------
    deboom.read_designs, deboom.doe, deboom.DesignSpace

    Examples
    --------
    >>> import deboom, tempfile, pathlib
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "designs.csv"
    >>> space = deboom.DesignSpace(("k",), ("N/mm",), [250.0], [200.0], [300.0], [0.15])
    >>> list(deboom.write_designs(path, space, ["van [dB(A)]"], n=32))
    ['design', 'k [N/mm]', 'van [dB(A)]']
    """
    path = Path(path)
    rows = designs_of(designs, space)
    rows = latin_hypercube(space, n, seed=seed) if rows is None else checked_within(space, rows)
    if not responses:
        raise InputError(f"{path}: name at least one response to be filled in")
    headers = ["design", *space.labels, *responses]
    names = [name_and_unit(header)[0] for header in headers]
    refuse_all(f"{path}: {words}" for words in doubled("columns are named", names))
    table = pd.DataFrame({"design": np.arange(1, len(rows) + 1)})
    table[list(space.labels)] = rows
    table[list(responses)] = np.nan
    write_design_table(path, table)
    return table


def write_design_table(path: Path, table: pd.DataFrame) -> None:
    """Write a table with a row per design.

    - `path`: ``.csv`` or ``.xlsx``.
    - raises InputError: another ending; a file that cannot be written.
    """
    match path.suffix.lower():
        case ".csv":
            write_frame(path, table)
        case ".xlsx":
            replace_bytes(path, workbook_bytes({"designs": table}, path.stem))
        case _:
            raise InputError(f"{path}: designs are written as .csv or .xlsx")


def experiment_of(
    path: Path,
    table: pd.DataFrame,
    responses: Sequence[str] | None = None,
    n_lines: int | None = None,
) -> Experiment:
    """Return the experiment of a table that `deboom.explore.doe.doe_frame` made.

    - `path`: of the table, for the error.
    - `responses`, optional: their names; by default those of the last columns of one unit.
    - `n_lines`, optional: lines that each response is the sum of.
    - raises InputError: responses that cannot be told from variables.
    """
    labels = {name_and_unit(name)[0]: name for name in table.columns if name not in RESERVED}
    units = {name: str(name_and_unit(label)[1]) for name, label in labels.items()}
    if responses is None:
        unit = list(units.values())[-1]
        responses = [name for name in units if units[name] == unit]
        if len(responses) == len(units):
            raise InputError(
                f"{path}: variables and responses have the same unit: say which are responses, "
                "deboom.read_designs(path, responses)"
            )
    names = [name for name in labels if name not in responses]
    designs = table[[labels[name] for name in names]].to_numpy(float)
    return Experiment(
        Doe(
            name=str(table["doe"].iloc[0]),
            space=_space_around(names, [units[name] for name in names], designs),
            response_names=tuple(responses),
            response_unit=_unit_of_all([units[name] for name in responses]),
            designs=designs,
            responses=table[[labels[name] for name in responses]].to_numpy(float),
            failures=tuple("" if pd.isna(said) else str(said) for said in table["failure"]),
            plan=str(table["plan"].iloc[0]),
        ),
        n_lines,
    )


def _computed(columns: Columns, headers: Sequence[str]) -> RealArray:
    """Return responses (n, r), NaN where an entry is no number."""
    return np.array([[number_in(text) for text in columns.texts[each]] for each in headers]).T
