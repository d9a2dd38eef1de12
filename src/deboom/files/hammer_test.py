"""A folder of an impact test: facts, tables, and one UFF file of time blocks per impact."""

from __future__ import annotations

import math
import re
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.files.function_table import ANY_REFERENCE, TIME_SIGNAL, FunctionMatrix
from deboom.files.rows import (
    HAMMER_QUANTITIES,
    HammerChannel,
    HammerPoint,
    SensorRow,
    impact_of,
    read_table,
    sensor_of,
    struck,
    write_table,
)
from deboom.files.schema import (
    NotNegative,
    Positive,
    RelativePath,
    StrictModel,
    dump_toml,
    load_toml,
    noting,
    telling,
)
from deboom.files.uff import UffFunction, read_uff, write_uff
from deboom.measurement.impact_test import HammerMeasurement, HammerTest
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
    points = read_table(folder / facts.impact_table, HammerPoint)
    channels = read_table(folder / facts.channel_table, HammerChannel)
    sensors: tuple[Sensor, ...] = ()
    if facts.sensor_table is not None:
        sensors = tuple(map(sensor_of, read_table(folder / facts.sensor_table, SensorRow)))
    return HammerTest(
        title=facts.title,
        impacts=tuple(map(impact_of, points)),
        sensors=sensors,
        measurements=tuple(
            _measurement(folder / point.file, point, channels, facts) for point in points
        ),
    )


def _measurement(
    path: Path, point: HammerPoint, channels: tuple[HammerChannel, ...], facts: HammerTestFile
) -> HammerMeasurement:
    item = f"impact '{point.impact}'"
    push, responses = struck(point, alone=True), [channel.dof for channel in channels]
    hits: dict[int, list[UffFunction]] = defaultdict(list)
    with telling(None) as tell:
        for function in read_uff(path):
            try:
                hits[_hit_of(function, facts)].append(function)
            except InputError as error:
                tell(InputError(f"{path}: {item}: {function.dof}: {error}"))
    if sorted(hits) != list(range(1, len(hits) + 1)):
        raise InputError(
            f"{path}: {item}: it holds hits {sorted(hits)}: number them from 1 without a gap"
        )
    force, response = [], []
    with telling(None) as tell:
        for hit in sorted(hits):
            with noting(tell):
                blocks = FunctionMatrix(path, f"{item}: hit {hit}", (TIME_SIGNAL,), hits[hit])
                blocks.check_known([push, *responses])
                columns = [
                    blocks.function(
                        channel.dof,
                        ANY_REFERENCE,
                        ordinate=channel.quantity,
                        unit=HAMMER_QUANTITIES[channel.quantity],
                        is_complex=False,
                    )
                    for channel in channels
                ]
                force.append(
                    blocks.function(
                        push, ANY_REFERENCE, ordinate="force", unit="N", is_complex=False
                    )
                )
                response.append(np.column_stack(columns))
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


@dataclass(frozen=True)
class HammerSheet:
    """All of an impact test but its blocks.

    - `title`: of the test.
    - `rate`: samples per second [Hz].
    - `pretrigger`: from the first sample of a block to the trigger [s].
    - `points`: where the hammer strikes; each names its file.
    - `channels`: responses, in SI units.
    - `sensors`: position sheet; none where responses have no position.
    - `force_range`: largest force that the hammer's channel can hold [N]; infinite is not known.
    """

    title: str
    rate: float
    pretrigger: float
    points: tuple[HammerPoint, ...]
    channels: tuple[HammerChannel, ...]
    sensors: tuple[SensorRow, ...] = ()
    force_range: float = math.inf


def write_hammer_test(
    folder: Path | str,
    sheet: HammerSheet,
    hits: Mapping[str, tuple[npt.ArrayLike, npt.ArrayLike]],
    *,
    binary: bool = True,
) -> None:
    """Write facts, tables and one UFF file per impact.

    - `folder`: made if it is not there; the facts are written last.
    - `sheet`: what the blocks are.
    - `hits`: name of the impact to force, shape (n_hit, n_sample) [N], and response, shape (n_hit,
      n_sample, n_channel), along positive axes [SI units].
    - `binary`: data sets 58b; ASCII is three times as large.
    - raises InputError: impacts other than the sheet's, shapes that disagree, a unit that is not
      SI, or a file that cannot be written.
    """
    folder = Path(folder)
    names = [point.impact for point in sheet.points]
    if sorted(names) != sorted(hits):
        raise InputError(f"{folder}: hits of {sorted(hits)}, the sheet has {sorted(names)}")
    foreign = [c.channel for c in sheet.channels if c.unit.factor != 1.0]
    if foreign:
        raise InputError(f"{folder}: channels {foreign} are not in SI: convert them first")
    for point in sheet.points:
        path = folder / point.file
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"{path.parent} cannot be made ({error.strerror})") from None
        force, response = (np.asarray(part, dtype=np.float64) for part in hits[point.impact])
        if force.ndim != 2 or response.shape != (*force.shape, len(sheet.channels)):
            raise InputError(
                f"{path}: force of shape {force.shape} and response of shape {response.shape} are "
                f"no hits of {len(sheet.channels)} channels"
            )
        write_uff(path, _functions(sheet, point, force, response), binary=binary)
    write_table(folder / "impacts.csv", HammerPoint, sheet.points)
    write_table(folder / "channels.csv", HammerChannel, sheet.channels)
    if sheet.sensors:
        write_table(folder / "sensors.csv", SensorRow, sheet.sensors)
    facts = HammerTestFile(
        format=1,
        title=sheet.title,
        sample_rate_hz=sheet.rate,
        pretrigger_s=sheet.pretrigger,
        force_range_n=None if math.isinf(sheet.force_range) else sheet.force_range,
        impact_table="impacts.csv",
        channel_table="channels.csv",
        sensor_table="sensors.csv" if sheet.sensors else None,
    )
    dump_toml(folder / HAMMER_TEST_FILE, facts)


def _functions(
    sheet: HammerSheet, point: HammerPoint, force: RealArray, response: RealArray
) -> list[UffFunction]:
    time = _stored_axis(sheet, force.shape[1])
    functions = []
    for hit, (push, answer) in enumerate(zip(force, response, strict=True), 1):
        recorded = [("force", point.impact, point.node, point.uff_direction, push)]
        recorded += [
            (channel.quantity, channel.channel, channel.node, channel.direction, values)
            for channel, values in zip(
                sheet.channels, (answer * [c.sign for c in sheet.channels]).T, strict=True
            )
        ]
        functions += [
            UffFunction(
                abscissa=time,
                values=values,
                function_type=TIME_SIGNAL,
                response_node=node,
                response_direction=direction,
                ordinate=quantity,
                ordinate_unit=HAMMER_QUANTITIES[quantity],
                id_lines=(f"hit {hit}", f"impact {point.impact}", name),
            )
            for quantity, name, node, direction, values in recorded
        ]
    return functions


def _stored_axis(sheet: HammerSheet, n_sample: int) -> RealArray:
    """Time with the six digits that UFF keeps; the exact rate stands in the facts."""
    start, step = (float(f"{number:.5e}") for number in (-sheet.pretrigger, 1.0 / sheet.rate))
    return np.asarray(start + step * np.arange(n_sample), dtype=np.float64)
