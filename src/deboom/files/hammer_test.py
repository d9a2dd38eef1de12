"""A folder of an impact test: facts, tables, and one UFF file of time blocks per impact."""

from __future__ import annotations

import math
import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np

from deboom.arrays import RealArray, RealOrComplexArray
from deboom.errors import InputError, naming
from deboom.files.disk import made_folder
from deboom.files.function_table import ANY_REFERENCE, TIME_SIGNAL, Dof, FunctionMatrix
from deboom.files.kinds import FolderKind
from deboom.files.rows import (
    HAMMER_QUANTITIES,
    HammerChannel,
    HammerPoint,
    SensorRow,
    impact_of,
    sensor_of,
    struck,
    uff_direction,
)
from deboom.files.schema import (
    FolderRecord,
    NotNegative,
    Positive,
    RelativePath,
    StrictModel,
    dump_toml,
    for_each,
    load_toml,
    noting,
    telling,
)
from deboom.files.tables import read_table, write_table
from deboom.files.uff import UffFunction, read_uff, write_uff
from deboom.measurement.driving_points import fault_of_hammer_test
from deboom.measurement.impact_test import HammerMeasurement, HammerOptions, HammerTest, hammer_frfs
from deboom.measurement.sensors import Sensor

HAMMER_TEST_FILE = "hammer_test.toml"


class HammerTestFile(StrictModel):
    """The whole file ``hammer_test.toml``."""

    format: Literal[1]
    title: str  # what a reader calls the test
    sample_rate_hz: Positive  # of every block; UFF itself keeps six digits of its inverse
    pretrigger_s: NotNegative  # from the first sample to the trigger
    force_range_n: Positive | None = None  # largest force that the hammer's channel can hold
    impact_table: RelativePath  # where the hammer struck, and the UFF file of its hits; CSV
    channel_table: RelativePath  # which UFF node and direction is which response; CSV
    sensor_table: RelativePath | None = None  # position sheet of triaxial sensors; CSV


STEP_DIGITS = 1e-5
"""Relative error of a time step that six digits may cause."""
_HIT = re.compile(r"hit\s+(\d+)\b")


def read_hammer_test(folder: Path | str) -> HammerTest:
    """Read all impacts, in SI and along positive axes.

    - `folder`: with ``hammer_test.toml`` and what it names.
    - raises InputError: a file is missing or damaged; a block is missing, doubled, of another
      channel, type, unit, rate, length or direction than the tables say; a block that names no hit.
    """
    folder = Path(folder)
    facts = load_toml(folder / HAMMER_TEST_FILE, HammerTestFile)
    sensors: tuple[Sensor, ...] = ()
    with telling() as tell:
        with noting(tell):
            points = read_table(folder / facts.impact_table, HammerPoint)
        with noting(tell):
            channels = read_table(folder / facts.channel_table, HammerChannel)
        if facts.sensor_table is not None:
            with noting(tell):
                sensors = tuple(map(sensor_of, read_table(folder / facts.sensor_table, SensorRow)))
    return HammerTest(
        title=facts.title,
        impacts=tuple(map(impact_of, points)),
        sensors=sensors,
        measurements=for_each(
            lambda point: _measurement(folder / point.file, point, channels, facts), points
        ),
    )


def _measurement(
    path: Path, point: HammerPoint, channels: tuple[HammerChannel, ...], facts: HammerTestFile
) -> HammerMeasurement:
    """Read the hits of one impact; they have one length and no number is missing."""
    item = f"impact '{point.impact}'"
    hits: dict[int, list[UffFunction]] = defaultdict(list)
    with telling() as tell:
        for function in read_uff(path):
            with noting(tell), naming(f"{path}: {item}: {function.dof}"):
                hits[_hit_of(function, facts)].append(function)
    if sorted(hits) != list(range(1, len(hits) + 1)):
        raise InputError(
            f"{path}: {item}: it holds hits {sorted(hits)}: number them from 1 without a gap"
        )
    dofs = [(struck(point, alone=True), "force"), *((row.dof, row.quantity) for row in channels)]
    signals = for_each(
        lambda hit: _signals(
            FunctionMatrix(path, f"{item}: hit {hit}", (TIME_SIGNAL,), hits[hit]), dofs
        ),
        sorted(hits),
    )
    force = [blow for blow, *_ in signals]
    response = [np.column_stack(columns) for _, *columns in signals]
    lengths = sorted({values.size for values in force})
    if len(lengths) > 1:
        sentence = f"its blocks have {lengths} samples: export all with one length"
        raise InputError(f"{path}: {item}: {sentence}")
    return HammerMeasurement(
        impact=point.impact,
        force=np.stack(force).real,
        response=np.stack(response).real,
        channels=tuple(c.channel for c in channels),
        units=tuple(HAMMER_QUANTITIES[c.quantity] for c in channels),
        rate=facts.sample_rate_hz,
        pretrigger=facts.pretrigger_s,
        force_range=math.inf if facts.force_range_n is None else facts.force_range_n,
        ranges=tuple(c.range for c in channels),
    )


def _signals(blocks: FunctionMatrix, dofs: Sequence[tuple[Dof, str]]) -> list[RealOrComplexArray]:
    """Return the time signal of each degree of freedom of one hit; its quantity gives the unit."""
    blocks.check_known([dof for dof, _ in dofs])
    return [
        blocks.function(
            dof, ANY_REFERENCE, ordinate=what, unit=HAMMER_QUANTITIES[what], is_complex=False
        )
        for dof, what in dofs
    ]


def _hit_of(function: UffFunction, facts: HammerTestFile) -> int:
    """Return the number of the hit of a block that is one."""
    if function.function_type != TIME_SIGNAL:
        raise InputError(
            f"it is of UFF function type {function.function_type}: export real time blocks, type 1"
        )
    named = _HIT.match(function.id_lines[0])
    if not named:
        raise InputError(
            f"its first ID line is '{function.id_lines[0]}': let it name the hit, such as 'hit 3'"
        )
    step = (function.abscissa[-1] - function.abscissa[0]) / (function.abscissa.size - 1)
    if abs(step * facts.sample_rate_hz - 1.0) > STEP_DIGITS:
        raise InputError(
            f"it is sampled at {1 / step:.6g} Hz, {HAMMER_TEST_FILE} says "
            f"{facts.sample_rate_hz:g} Hz: correct the wrong one"
        )
    # measuring systems count either from the trigger or from the first sample
    begin = float(function.abscissa[0])
    if min(abs(begin), abs(begin + facts.pretrigger_s)) > 0.5 * step:
        raise InputError(
            f"it starts at {begin:.6g} s, {HAMMER_TEST_FILE} says {facts.pretrigger_s:g} s before "
            "the trigger: let it start there, or at 0, or correct the file"
        )
    return int(named[1])


def write_hammer_test(
    folder: Path | str,
    facts: HammerTestFile,
    points: Sequence[HammerPoint],
    channels: Sequence[HammerChannel],
    hits: Mapping[str, tuple[RealArray, RealArray]],
    sensors: Sequence[SensorRow] = (),
    *,
    binary: bool = True,
) -> None:
    """Write facts, tables and one UFF file per impact.

    - `folder`: made if it is not there; the facts are written last.
    - `points`: where the hammer strikes; each names its file.
    - `channels`: responses, in SI units.
    - `hits`: name of the impact to force, shape (n_hit, n_sample) [N], and response, shape (n_hit,
      n_sample, n_channel), along positive axes [SI units].
    - `sensors`: position sheet; none where responses have no position.
    - `binary`: data sets 58b; ASCII is three times as large.
    - raises InputError: a file that cannot be written.
    """
    folder = Path(folder)
    for point in points:
        made_folder((folder / point.file).parent)
        functions = _functions(facts, point, channels, *hits[point.impact])
        write_uff(folder / point.file, functions, binary=binary)
    write_table(folder / facts.impact_table, HammerPoint, points)
    write_table(folder / facts.channel_table, HammerChannel, channels)
    if facts.sensor_table is not None:
        write_table(folder / facts.sensor_table, SensorRow, sensors)
    dump_toml(folder / HAMMER_TEST_FILE, facts)


def _functions(
    facts: HammerTestFile,
    point: HammerPoint,
    channels: Sequence[HammerChannel],
    force: RealArray,
    response: RealArray,
) -> list[UffFunction]:
    # six digits are what UFF keeps; the exact rate stands in the facts
    start, step = (float(f"{x:.5e}") for x in (-facts.pretrigger_s, 1.0 / facts.sample_rate_hz))
    time = np.asarray(start + step * np.arange(force.shape[1]), dtype=np.float64)
    push = Dof(point.impact, point.node, uff_direction(point.direction), quantity="force")
    functions = []
    for hit, (blow, answer) in enumerate(zip(force, response, strict=True), 1):
        recorded = [(push, blow)]
        recorded += [(row.dof, column) for row, column in zip(channels, answer.T, strict=True)]
        for dof, values in recorded:
            lines = (f"hit {hit}", f"impact {point.impact}", dof.name)
            unit = HAMMER_QUANTITIES[dof.quantity]
            function = dof.function(time, values, TIME_SIGNAL, dof.quantity, unit, lines)
            functions.append(replace(function, response_name=""))
    return functions


CHECKED_LINES = 200.0
"""Last line of the functions that the check of a hammer test makes of its hits [Hz]."""


def _lines(folder: Path) -> Iterator[tuple[str, str]]:
    """Give name and text of each line on what a folder holds."""
    test = read_hammer_test(folder)
    first = test.measurements[0]
    # lines of a car; beyond them a push may have zeros
    options = HammerOptions(band=(0.0, CHECKED_LINES), minimum_hits=1)
    with naming(folder):
        estimate = hammer_frfs(test, options)
    if fault := fault_of_hammer_test(test, estimate):
        raise InputError(f"{folder}: {fault}")
    yield "test", test.title
    yield "impacts", f"{len(test.impacts)}, {sum(len(m.force) for m in test.measurements)} hits"
    yield "channels", f"{len(first.channels)}, {first.rate:g} samples per second"


HAMMER: FolderRecord = FolderRecord(
    kind=FolderKind.hammer,
    file=HAMMER_TEST_FILE,
    keys=HammerTestFile,
    command="deboom look {}",
    guide="Your own data",
    lines=_lines,
)
