"""Write a folder of an impact test that `read_hammer_test` reads; in SI."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.files.campaign_tables import SensorRow, write_sensor_table
from deboom.files.hammer_test_tables import (
    HAMMER_QUANTITIES,
    HAMMER_TEST_FILE,
    HammerChannel,
    HammerPoint,
    HammerTestFile,
    write_hammer_channels,
    write_hammer_points,
)
from deboom.files.strict_toml import dump_toml
from deboom.files.uff import UffFunction, write_uff


@dataclass(frozen=True)
class HammerSheet:
    """All of an impact test but its blocks.

    Parameters
    ----------
    title : str
        Of the test.
    rate : float
        Samples per second [Hz].
    pretrigger : float
        From the first sample of a block to the trigger [s].
    points : sequence of HammerPoint
        Where the hammer strikes; each names its file.
    channels : sequence of HammerChannel
        Responses, in SI units.
    sensors : sequence of SensorRow
        Position sheet; none where responses have no position.
    force_range : float
        Largest force that the hammer's channel can hold [N]; infinite is not known.
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

    Parameters
    ----------
    folder : path
        Made if it is not there; the facts are written last.
    sheet : HammerSheet
        What the blocks are.
    hits : mapping of str to (array, array)
        Name of the impact to force, shape (n_hit, n_sample) [N], and response, shape (n_hit,
        n_sample, n_channel), along positive axes [SI units].
    binary : bool
        Data sets 58b; ASCII is three times as large.

    Raises
    ------
    InputError
        Impacts other than the sheet's, shapes that disagree, a unit that is not SI, or a file that
        cannot be written.
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
    write_hammer_points(folder / "impacts.csv", sheet.points)
    write_hammer_channels(folder / "channels.csv", sheet.channels)
    if sheet.sensors:
        write_sensor_table(folder / "sensors.csv", sheet.sensors)
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
        for channel, values in zip(sheet.channels, answer.T, strict=True):
            recorded.append(
                (
                    channel.quantity,
                    channel.channel,
                    channel.node,
                    channel.direction,
                    channel.sign * values,
                )
            )
        functions += [
            UffFunction(
                abscissa=time,
                values=values,
                function_type=1,
                response_node=node,
                response_direction=direction,
                reference_node=0,
                reference_direction="scalar",
                ordinate=quantity,
                ordinate_unit=HAMMER_QUANTITIES[quantity],
                denominator="none",
                denominator_unit="",
                id_lines=(f"hit {hit}", f"impact {point.impact}", name),
            )
            for quantity, name, node, direction, values in recorded
        ]
    return functions


def _stored_axis(sheet: HammerSheet, n_sample: int) -> RealArray:
    """Time with the six digits that UFF keeps; the exact rate stands in the facts."""
    start, step = (float(f"{number:.5e}") for number in (-sheet.pretrigger, 1.0 / sheet.rate))
    return np.asarray(start + step * np.arange(n_sample), dtype=np.float64)
