"""A model as a node of another program: designs in, a row of numbers for each out."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path

import numpy as np
import pandas as pd

from deboom.arrays import RealArray
from deboom.errors import InputError, naming
from deboom.explore.front import Replicates, replicates
from deboom.explore.moments import MEAN_SUM, SIGMA_SUM
from deboom.explore.result import FrontColumns, label_in_search
from deboom.explore.robust import Robust, RobustValues
from deboom.explore.search import VERIFIED
from deboom.explore.space import DesignSpace, spread_unit, units_of
from deboom.files.dakota import dakota_name, read_dakota, write_dakota
from deboom.files.doe_table import DesignColumns, write_design_table
from deboom.files.platform import platform_folder
from deboom.files.shipped_studies import shipped_studies
from deboom.files.tables import read_columns
from deboom.pages.limits import beyond_labels
from deboom.runs.rebuilt import PLATFORM_FILE, compared_run
from deboom.runs.runner import load_study
from deboom.tabled import csv_text
from deboom.vehicles.fleet_front import PeakRise
from deboom.vehicles.level_objectives import LoudestLine

DRAWS, SEED = 128, 1
"""Draws of the scatter, and their seed, where no run has others."""
DESIGN, ERROR = "design", "error"
"""Columns of a row's number or name, and of why it has no numbers."""


@dataclass(frozen=True, eq=False)
class Node:
    """A robust model that another program calls.

    - `robust`: model with the draws that its search meets, and its limits.
    - `judge`, optional: model with the draws that verify a front.
    """

    robust: Robust
    judge: Replicates | None = None

    @property
    def space(self) -> DesignSpace:
        """Variables of the designs."""
        return self.robust.space

    @property
    def labels(self) -> tuple[str, ...]:
        """Columns of the numbers, ``name [unit]``."""
        return tuple(label for labels, _ in self._parts for label in labels)

    def numbers(self, design: RealArray) -> RealArray:
        """Return the numbers of a design (k,), one for each of `labels`.

        - raises InputError: it could not be computed; says why.
        """
        values = self.robust(design[np.newaxis])
        if values.failed[0]:
            raise InputError(str(values.message[0]))
        return np.concatenate([of_values(values) for _, of_values in self._parts])

    @cached_property
    def _parts(self) -> list[tuple[Sequence[str], Callable[[RobustValues], RealArray]]]:
        """Columns, and what computes their numbers from the values of one design."""
        model, columns = self.robust.evaluate, FrontColumns(self.robust.sum_unit)
        n_lines = int(getattr(model, "n_lines", 1))
        names = tuple(model.response_names)
        units = dict(zip(names, units_of(names, model.response_unit), strict=True))
        level = "level" if self.robust.sum_unit == "dB(A)" else "mean"
        parts: list[tuple[Sequence[str], Callable[[RobustValues], RealArray]]] = [
            ((columns.searched_mean_sum, columns.searched_sigma_sum), _sums),
            (
                [f"{level} of {name} [{unit}]" for name, unit in units.items()],
                lambda values: values.mean[0] / n_lines,
            ),
            (
                [f"sigma of {name} [{spread_unit(unit)}]" for name, unit in units.items()],
                lambda values: values.sigma[0] / n_lines,
            ),
        ]
        further = self.robust.objectives != (MEAN_SUM, SIGMA_SUM)
        if further:
            labels = [label_in_search(label) for label in self.robust.objective_labels]
            parts.insert(1, (labels, lambda values: values.objectives[0]))
        if self.robust.limits:
            parts.append((beyond_labels(self.robust.limits), lambda values: values.excess[0]))
        if hasattr(model, "levels"):
            loudest = LoudestLine(model, tuple(model.response_names))
            rise = PeakRise(model, self.space.nominal)
            labels = [f"loudest line of {name} [{unit}]" for name, unit in units.items()]
            parts.append((labels, lambda values: loudest(values.designs)[0]))
            labels = [f"{name} [dB]" for name in rise.response_names]
            parts.append((labels, lambda values: rise(values.designs)[0]))
        if self.judge is not None:
            labels = [columns.mean_sum, columns.sigma_sum, columns.mean_error, columns.sigma_error]
            labels += self.robust.objective_labels if further else ()
            parts.append((labels, partial(_verified, self.judge, further=further)))
        return parts


def _sums(values: RobustValues) -> RealArray:
    return np.array([values.mean_sum[0], values.sigma_sum[0]])


def _verified(judge: Replicates, values: RobustValues, *, further: bool) -> RealArray:
    """Return the sums of one design, their errors and its objectives, under draws of a judge."""
    verified = judge(values.designs)
    if verified.failed[0]:
        raise InputError(f"under the draws of the verification: {verified.message[0]}")
    errors = verified.standard_error_mean_sum, verified.standard_error_sigma_sum
    objectives = verified.objectives[0] if further else np.empty(0)
    return np.concatenate([_sums(verified), *errors, objectives])


def opened_node(
    source: Path,
    *,
    draws: int | None = None,
    seed: int | None = None,
    verified: bool = False,
    studies: Path | None = None,
) -> Node:
    """Build the model of a platform or of a finished run.

    Parameters
    ----------
    source : Path
        Folder with ``platform.toml``, or ``u06`` for the demonstration, which the study ``front``
        takes with its defaults; or a finished run of a front study, whose options, draws and limits
        are taken.
    draws, seed : int or None
        Draws of the scatter and their seed, of a platform; None: `DRAWS` and `SEED`.
    verified : bool
        Whether the numbers under the draws of the verification are wanted as well.
    studies : Path or None
        Folder with the script of the run; None: deboom's own.

    Raises
    ------
    InputError
        Neither platform nor run; draws or a seed for a run; see `deboom.runs.rebuilt.compared_run`.
    """
    source = platform_folder(source)
    if (source / PLATFORM_FILE).is_file():
        first, checks = SEED if seed is None else seed, VERIFIED
        options = {"platform": source, "samples": DRAWS if draws is None else draws, "seed": first}
        prepared = load_study(shipped_studies() / "front.py").model(options | {"with_": "none"})
    else:
        if draws is not None or seed is not None:
            raise InputError(f"--draws and --seed belong to a platform: run {source} has its own")
        run = compared_run(source, studies)
        prepared, first = run.prepared, run.seed
        checks = run.entry.record["facts"]["verification_draws"]
    robust: Robust = prepared.robust
    return Node(
        robust=robust,
        judge=replicates(robust, checks, seed=first) if verified else None,
    )


@dataclass(frozen=True)
class _Row:
    """What a design has in its row: its texts, and its numbers or why there are none."""

    name: str
    design: RealArray
    numbers: RealArray
    error: str


def _evaluated(node: Node, columns: DesignColumns, name: str, row: Sequence[str]) -> _Row:
    """Evaluate one row of texts."""
    design, error = columns.design(row), columns.fault(row)
    if not error:
        try:
            return _Row(name, design, node.numbers(design), "")
        except InputError as refusal:
            error = "; ".join(refusal.sentences)
    return _Row(name, design, np.full(len(node.labels), np.nan), error)


def _frame(node: Node, rows: Sequence[_Row]) -> pd.DataFrame:
    """Table of rows: number or name, variables, numbers, and errors."""
    names = pd.Series([row.name for row in rows], dtype=object)
    table = {DESIGN: names}
    designs = np.array([row.design for row in rows]).reshape(len(rows), len(node.space.labels))
    numbers = np.array([row.numbers for row in rows]).reshape(len(rows), len(node.labels))
    table |= dict(zip(node.space.labels, designs.T, strict=True))
    table |= dict(zip(node.labels, numbers.T, strict=True))
    return pd.DataFrame(table | {ERROR: [row.error for row in rows]})


def evaluate_table(node: Node, designs: Path, out: Path) -> int:
    """Evaluate a table of designs; return how many could not be computed.

    - `designs`: ``.csv`` or ``.xlsx``, as `deboom.write_designs` writes it.
    - `out`: ``.csv`` or ``.xlsx``, a row for each design in its order.
    - raises InputError: no such table; a column of a variable is missing; `out` cannot be written.
    """
    texts = read_columns(designs, node.space.names[0]).texts
    headers = list(texts)
    with naming(designs):
        columns = DesignColumns.of(node.space, headers)
    lines = list(zip(*texts.values(), strict=True))
    names = texts.get(DESIGN, [str(number) for number in range(1, len(lines) + 1)])
    rows = [_evaluated(node, columns, name, line) for name, line in zip(names, lines, strict=True)]
    write_design_table(out, _frame(node, rows))
    return sum(bool(row.error) for row in rows)


def evaluate_lines(node: Node, lines: Iterable[str]) -> Iterator[tuple[str, bool]]:
    """Evaluate lines of CSV as they come: the first has the headers, and so has its answer.

    - returns: for each line one, and whether its design could not be computed.
    - raises InputError: a column of a variable is missing.
    """
    columns: DesignColumns | None = None
    headers: list[str] = []
    count = 0
    for line in lines:
        texts = _cells(line)
        if columns is None:
            with naming("standard input"):
                columns, headers = DesignColumns.of(node.space, texts), texts
            yield csv_text(_frame(node, [])), False
            continue
        count += 1
        filled = texts if len(texts) == len(headers) else [""] * len(headers)
        name = filled[headers.index(DESIGN)] if DESIGN in headers else ""
        row = _evaluated(node, columns, name or str(count), filled)
        if filled is not texts:
            words = f"the line has {len(texts)} cells, and the first one {len(headers)}"
            row = replace(row, error=words)
        yield csv_text(_frame(node, [row])).partition("\n")[2], bool(row.error)


def _cells(line: str) -> list[str]:
    """Return the cells of one line of CSV; none of a line that is none."""
    try:
        return [cell.strip() for cell in next(csv.reader([line], skipinitialspace=True), [])]
    except csv.Error:
        return []


def evaluate_dakota(node: Node, parameters: Path, results: Path) -> int:
    """Evaluate a file of Dakota's parameters; return 1 if the design could not be computed, else 0.

    - `parameters`: descriptors are the columns without their unit, with an underline in place of
      anything but letters and digits, such as ``TSM_x`` and ``SPLV_mean_sum_in_search``.
    - `results`: the values that are wanted, or ``FAIL`` and the reason.
    - raises InputError: no such file, descriptors of nothing, derivatives or metadata are wanted;
      no results are written then, which ends Dakota.
    """
    wanted = read_dakota(parameters)
    variables = [dakota_name(label) for label in node.space.labels]
    numbers = [dakota_name(label) for label in node.labels]
    with naming(parameters):
        _check_descriptors("variables", [*wanted.variables], variables)
        _check_descriptors("variables", variables, [*wanted.variables])
        _check_descriptors("responses", [*wanted.responses], numbers)
    columns = DesignColumns.of(node.space, node.space.labels)
    row = _evaluated(node, columns, "", [wanted.variables[name] for name in variables])
    values = {
        name: float(row.numbers[numbers.index(name)])
        for name, is_wanted in wanted.responses.items()
        if is_wanted
    }
    write_dakota(results, None if row.error else values, row.error)
    return int(bool(row.error))


def _check_descriptors(what: str, names: Sequence[str], known: Sequence[str]) -> None:
    """Refuse descriptors that are not known, or of two columns."""
    for name in names:
        if known.count(name) != 1:
            raise InputError(
                f"descriptors of {what}: '{name}' is not one of {', '.join(known)}: name them so"
            )
