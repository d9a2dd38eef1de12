"""Designs, with or without responses, from a table or from the interactive page.

A table has a column per design variable with its unit in the header, such as ``TSM x [1]``.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.doe import SAME, Doe, Experiment
from deboom.explore.space import DesignSpace
from deboom.files.disk import read_json
from deboom.files.schema import doubled, refuse_all
from deboom.files.tables import Columns, name_and_unit, number_in, read_columns, read_rows
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
        lower, upper = float(space.lower[column]), float(space.upper[column])
        slack = SAME * (upper - lower)
        for place, row in enumerate(rows):
            value = row.number(name) / unit.factor
            if not lower - slack <= value <= upper + slack:
                raise row.error(
                    f"'{name}' is {value:g}, outside its bounds {lower:g} to {upper:g} "
                    f"[{unit.label}]: correct it or widen the bounds"
                )
            designs[place, column] = value
    return designs


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
    path: str | Path, responses: Sequence[str], *, variables: Sequence[str] | None = None
) -> Experiment:
    r"""Read designs that were evaluated elsewhere, such as a table of modeFRONTIER.

    Parameters
    ----------
    path : path
        ``.csv`` or ``.xlsx`` (first sheet), a row per design, units in the headers, such as
        ``TSM x [N/mm]``; a header without a unit is a plain number.
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
        number, by line; responses of several units; no response at all.

    Examples
    --------
    >>> import deboom, tempfile, pathlib
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "designs.csv"
    >>> _ = path.write_text("ID;a [N/mm];y [dB]\n1;200;60.5\n2;250;59.0\n3;300;\n")
    >>> deboom.read_designs(path, ["y"]).doe.failures
    ('', '', 'not computed')
    """
    path = Path(path)
    if not responses:
        raise InputError(f"{path}: name at least one response column")
    columns = read_columns(path, responses[0])
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
    of_responses = {units[name] for name in responses}
    if len(of_responses) > 1:
        raise InputError(
            f"{path}: the responses have the units {', '.join(sorted(of_responses))}: read those "
            "of one unit at a time"
        )
    designs = columns.numbers(*(headers[name] for name in variables)).T
    values = _computed(columns, [headers[name] for name in responses])
    failed = np.asarray(~np.isfinite(values).all(axis=1))
    if failed.all():
        raise InputError(f"{path}: no design has all of its responses: fill them in")
    k = len(variables)
    space = DesignSpace(
        names=tuple(variables),
        units=tuple(units[name] for name in variables),
        nominal=designs[0],
        lower=designs.min(axis=0),
        upper=designs.max(axis=0),
        tolerance=np.zeros(k),
    )
    values[failed] = np.nan
    return Experiment(
        Doe(
            name=path.stem,
            space=space,
            response_names=tuple(responses),
            response_unit=of_responses.pop(),
            designs=designs,
            responses=values,
            failures=tuple("not computed" if bad else "" for bad in failed.tolist()),
            plan=path.name,
        )
    )


def _computed(columns: Columns, headers: Sequence[str]) -> RealArray:
    """Return responses (n, r), NaN where an entry is no number."""
    return np.array([[number_in(text) for text in columns.texts[each]] for each in headers]).T
