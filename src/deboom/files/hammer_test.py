"""Read a folder of an impact test: facts, tables, and one UFF file of time blocks per impact.

A block is a data set 58 of function type 1 whose first ID line names its hit, ``hit 3``. The force
stands at the node of the impact, each response at its own node.
"""

from __future__ import annotations

import math
import re
from collections import defaultdict
from pathlib import Path

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.files.campaign_tables import read_sensor_table
from deboom.files.hammer_test_tables import (
    HAMMER_QUANTITIES,
    HAMMER_TEST_FILE,
    HammerChannel,
    HammerPoint,
    HammerTestFile,
    check_force_direction,
    read_hammer_channels,
    read_hammer_points,
)
from deboom.files.sensor_rows import sensor_of
from deboom.files.strict_toml import load_toml
from deboom.files.uff import UffFunction, read_uff
from deboom.files.units import parse_unit
from deboom.measurement.hammer_measurement import HammerMeasurement, HammerTest
from deboom.measurement.impacts import Impact
from deboom.measurement.sensors import Sensor

TIME_SIGNAL = 1
STEP_DIGITS = 1e-5
"""Relative error of a time step that six digits may cause."""
_FORCE = ""
"""Key of the force among the responses, none of which has an empty name."""
_HIT = re.compile(r"hit\s+(\d+)\b")


def read_hammer_test(folder: Path | str) -> HammerTest:
    """Read all impacts, in SI and along positive axes.

    Parameters
    ----------
    folder : path
        With ``hammer_test.toml`` and what it names.

    Returns
    -------
    HammerTest

    Raises
    ------
    InputError
        A file is missing or damaged; a block is missing, doubled, of another channel, type, unit,
        rate, length or direction than the tables say; a block that names no hit.
    """
    folder = Path(folder)
    facts = load_toml(folder / HAMMER_TEST_FILE, HammerTestFile)
    points = read_hammer_points(folder / facts.impact_table)
    channels = read_hammer_channels(folder / facts.channel_table)
    sensors: tuple[Sensor, ...] = ()
    if facts.sensor_table is not None:
        sensors = tuple(map(sensor_of, read_sensor_table(folder / facts.sensor_table)))
    return HammerTest(
        title=facts.title,
        impacts=tuple(
            Impact(point.impact, np.array(point.position), np.array(point.direction))
            for point in points
        ),
        sensors=sensors,
        measurements=tuple(
            _measurement(folder / point.file, point, channels, facts) for point in points
        ),
    )


def _measurement(
    path: Path, point: HammerPoint, channels: tuple[HammerChannel, ...], facts: HammerTestFile
) -> HammerMeasurement:
    def error(sentence: str) -> InputError:
        return InputError(f"{path}: impact '{point.impact}': {sentence}")

    by_dof = {(c.node, c.direction, c.quantity): c for c in channels}
    blocks: dict[int, dict[str, RealArray]] = defaultdict(dict)
    for function in read_uff(path):
        try:
            hit = _hit_of(function, facts)
            dof = (function.response_node, function.response_direction, function.ordinate)
            name, sign = _FORCE, 1.0
            if dof in by_dof:
                _check_unit(function, by_dof[dof])
                name, sign = by_dof[dof].channel, by_dof[dof].sign
            elif function.response_node == point.node and function.ordinate == "force":
                check_force_direction(point, function.response_direction)
                if function.ordinate_unit != "N":
                    raise InputError("its unit is not stated: write N into the file")
            else:
                raise InputError(
                    f"it is neither the force at node {point.node} nor a response of the channel "
                    "table: add it there, or export without it"
                )
            if name in blocks[hit]:
                raise InputError(f"it comes twice for hit {hit}: keep one")
        except InputError as reason:
            raise error(f"{function.dof}: {reason}") from None
        blocks[hit][name] = sign * np.asarray(function.values, dtype=np.float64)
    names = [_FORCE, *(channel.channel for channel in channels)]
    hits = sorted(blocks)
    if hits != list(range(1, len(hits) + 1)):
        raise error(f"it holds hits {hits}: number them from 1 without a gap")
    for hit in hits:
        missing = [name or "the force" for name in names if name not in blocks[hit]]
        if missing:
            raise error(f"hit {hit} has no block of {', '.join(missing)}: export every channel")
    lengths = sorted({values.size for block in blocks.values() for values in block.values()})
    if len(lengths) > 1:
        raise error(f"its blocks have {lengths} samples: export all with one length")
    response = [np.column_stack([blocks[hit][name] for name in names[1:]]) for hit in hits]
    return HammerMeasurement(
        impact=point.impact,
        force=np.stack([blocks[hit][_FORCE] for hit in hits]),
        response=np.stack(response),
        channels=tuple(c.channel for c in channels),
        units=tuple(HAMMER_QUANTITIES[c.quantity] for c in channels),
        rate=facts.sample_rate_hz,
        pretrigger=facts.pretrigger_s,
        force_range=math.inf if facts.force_range_n is None else facts.force_range_n,
        ranges=tuple(c.range for c in channels),
    )


def _hit_of(function: UffFunction, facts: HammerTestFile) -> int:
    """Return the number of the hit of a block that is one."""
    if function.function_type != TIME_SIGNAL or np.iscomplexobj(function.values):
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


def _check_unit(function: UffFunction, channel: HammerChannel) -> None:
    stated = parse_unit(function.file_unit) if function.file_unit else None
    if stated is None or stated.si != channel.unit.si:
        raise InputError(
            f"it is in '{function.file_unit}', the channel table says '{channel.unit.label}': "
            "state the unit in the file, and the same in both"
        )
    if not math.isclose(stated.factor, channel.unit.factor, rel_tol=1e-9):
        raise InputError(
            f"it is in '{function.file_unit}', the channel table says '{channel.unit.label}': "
            "correct the wrong one"
        )
