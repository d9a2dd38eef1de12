"""The hammer test on the compressor as UFF functions, position sheets and blocks over time."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from deboom.arrays import ComplexArray, RealArray, RealOrComplexArray
from deboom.bench.compressor_hits import Blows, HitPlan
from deboom.bench.compressor_rig import Sheet
from deboom.bench.parameters import AXES
from deboom.files.hammer_test_tables import HammerChannel, HammerPoint
from deboom.files.hammer_test_writer import HammerSheet, write_hammer_test
from deboom.files.inertance_test_tables import PlacedImpact, PlacedSensor
from deboom.files.uff import UffFunction
from deboom.files.units import parse_unit

FIRST_SENSOR_NODE, FIRST_IMPACT_NODE = 101, 201
FRF, COHERENCE = 4, 6
"""UFF function types."""


def placed_sensors(sheet: Sheet) -> tuple[PlacedSensor, ...]:
    """Return the rows of the accelerometers."""
    return tuple(
        PlacedSensor(name, FIRST_SENSOR_NODE + number, _three(position), _three(angles))
        for number, (name, position, angles) in enumerate(
            zip(sheet.sensors, sheet.sensor_positions, sheet.sensor_angles, strict=True)
        )
    )


def placed_impacts(sheet: Sheet) -> tuple[PlacedImpact, ...]:
    """Return the rows of the impacts."""
    return tuple(
        PlacedImpact(name, FIRST_IMPACT_NODE + number, _three(position), _three(direction))
        for number, (name, position, direction) in enumerate(
            zip(sheet.impacts, sheet.impact_positions, sheet.impact_directions, strict=True)
        )
    )


def frf_functions(sheet: Sheet, frequency: RealArray, inertance: ComplexArray) -> list[UffFunction]:
    """Return the FRFs from all impacts to all channels, UFF type 4.

    Parameters
    ----------
    sheet : Sheet
        What the nodes are.
    frequency : array, shape (f,)
        [Hz].
    inertance : array, shape (f, n_channel, n_impact)
        [m/s² per N].
    """
    return _functions(sheet, frequency, inertance, FRF)


def coherence_functions(
    sheet: Sheet, frequency: RealArray, coherence: RealArray
) -> list[UffFunction]:
    """Return the ordinary coherences of all channels and impacts, UFF type 6.

    Parameters
    ----------
    sheet : Sheet
        What the nodes are.
    frequency : array, shape (f,)
        [Hz].
    coherence : array, shape (f, n_channel, n_impact)
        [1].
    """
    return _functions(sheet, frequency, coherence, COHERENCE)


def write_hits(folder: Path, sheet: Sheet, blows: Blows, plan: HitPlan, title: str) -> None:
    """Write all hits over time as a hammer test.

    Parameters
    ----------
    folder : Path
        Of the hammer test; made if it is not there.
    sheet : Sheet
        Of sensors and impacts.
    blows, plan
        What was recorded, and how.
    title : str
        Of the test.
    """
    write_hammer_test(
        folder,
        HammerSheet(
            title=title,
            rate=plan.rate,
            pretrigger=plan.pretrigger,
            points=tuple(
                HammerPoint(row.impact, row.node, f"{row.impact}.uff", row.position, row.direction)
                for row in placed_impacts(sheet)
            ),
            channels=tuple(
                HammerChannel(
                    f"{row.sensor} {axis}",
                    "acceleration",
                    row.node,
                    f"+{axis}",
                    parse_unit("m/s^2"),
                )
                for row in placed_sensors(sheet)
                for axis in AXES
            ),
        ),
        {
            name: (force, response)
            for name, force, response in zip(
                sheet.impacts, blows.force, blows.response, strict=True
            )
        },
    )


def _functions(
    sheet: Sheet, frequency: RealArray, values: RealOrComplexArray, kind: int
) -> list[UffFunction]:
    channels = [(row, axis) for row in placed_sensors(sheet) for axis in AXES]
    # a coherence has no unit, but the quantities of its two channels
    ordinate, above, below = (
        ("acceleration", "m/s^2", "N") if kind == FRF else ("general", "1", "1")
    )
    return [
        UffFunction(
            abscissa=frequency,
            values=values[:, row, column],
            function_type=kind,
            response_node=sensor.node,
            response_direction=f"+{axis}",
            reference_node=impact.node,
            reference_direction=impact.uff_direction,
            ordinate=ordinate,
            ordinate_unit=above,
            denominator="force" if kind == FRF else "none",
            denominator_unit=below if kind == FRF else "",
            id_lines=(f"{sensor.sensor} {axis} per {impact.impact}", "roving hammer, H1"),
            response_name=sensor.sensor,
            reference_name=impact.impact,
        )
        for column, impact in enumerate(placed_impacts(sheet))
        for row, (sensor, axis) in enumerate(channels)
    ]


def _three(values: RealArray) -> tuple[float, float, float]:
    x, y, z = np.asarray(values).tolist()
    return x, y, z
