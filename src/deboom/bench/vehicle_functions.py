"""What was measured on a vehicle as UFF functions, and as the tables that name them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.campaign_layout import ACCELEROMETER_MODEL
from deboom.bench.ears import EARS
from deboom.bench.parameters import AXES, VirtualBench
from deboom.bench.vehicle_layout import (
    EAR_NODES,
    MICROPHONES,
    SensorPlace,
    body_sensor_places,
    impact_places,
    source_sensor_places,
)
from deboom.files.campaign_tables import CampaignChannel, SensorRow
from deboom.files.uff import UffFunction
from deboom.files.units import parse_unit
from deboom.files.vehicle_tables import ImpactRow

SPECTRUM, FRF = 0, 4
"""UFF function types."""


def impact_table(bench: VirtualBench) -> list[ImpactRow]:
    """Return the position sheet of the blows."""
    return [
        ImpactRow(
            place.name, place.mount, place.piece, place.node, place.direction, _at(place.position)
        )
        for place in impact_places(bench)
    ]


def sensor_table(bench: VirtualBench) -> list[SensorRow]:
    """Return the position sheet of the accelerometers: source side, then body side."""
    return [
        SensorRow(
            sensor=place.name,
            kind="accelerometer",
            model=ACCELEROMETER_MODEL,
            mount=place.mount,
            piece=place.piece,
            position=_at(place.position),
            angles=_at(np.deg2rad(place.angles), digits=12),
        )
        for place in (*source_sensor_places(bench), *body_sensor_places(bench))
    ]


def channel_table(bench: VirtualBench) -> list[CampaignChannel]:
    """Return the nodes of all accelerometer channels."""
    return [
        CampaignChannel(
            f"{place.name} {axis}", "acceleration", place.node, f"+{axis}", parse_unit("m/s^2")
        )
        for place in (*source_sensor_places(bench), *body_sensor_places(bench))
        for axis in AXES
    ]


def direct_functions(
    bench: VirtualBench, pressure: ComplexArray, frequency: RealArray, vehicle: str
) -> list[UffFunction]:
    """Return pressure at the ears per force of every blow, UFF type 4.

    Parameters
    ----------
    pressure : array, shape (f, n_ear, n_impact)
        [Pa/N].
    """
    return [
        _frf(
            frequency,
            pressure[:, row, column],
            response=(EAR_NODES[ear], "scalar", MICROPHONES[ear], "pressure", "Pa"),
            reference=(place.node, place.direction, place.mount, "force", "N"),
            title=f"noise transfer function, {vehicle}, {ear}, hammer at {place.name}",
        )
        for row, ear in enumerate(EARS)
        for column, place in enumerate(impact_places(bench))
    ]


def reciprocal_functions(
    bench: VirtualBench, acceleration: ComplexArray, frequency: RealArray, vehicle: str
) -> list[UffFunction]:
    """Return acceleration on the body per volume acceleration at the ears, UFF type 4.

    Parameters
    ----------
    acceleration : array, shape (f, n_channel, n_ear)
        [(m/s²)/(m³/s²)].

    Notes
    -----
    Data set 58 knows no volume acceleration: it is a ``general`` quantity in ``m^3/s^2``.
    """
    return [
        _frf(
            frequency,
            acceleration[:, row, column],
            response=(place.node, f"+{axis}", place.name, "acceleration", "m/s^2"),
            reference=(EAR_NODES[ear], "scalar", "LOUDSP 1", "general", "m^3/s^2"),
            title=f"reciprocal measurement, {vehicle}, loudspeaker at {ear}, {place.name} {axis}",
        )
        for row, (place, axis) in enumerate(_channels(body_sensor_places(bench)))
        for column, ear in enumerate(EARS)
    ]


def accelerance_functions(
    bench: VirtualBench, acceleration: ComplexArray, frequency: RealArray, vehicle: str
) -> list[UffFunction]:
    """Return acceleration on the body per force of every blow, UFF type 4.

    Parameters
    ----------
    acceleration : array, shape (f, n_channel, n_impact)
        [m/s² per N].
    """
    return [
        _frf(
            frequency,
            acceleration[:, row, column],
            response=(place.node, f"+{axis}", place.name, "acceleration", "m/s^2"),
            reference=(blow.node, blow.direction, blow.mount, "force", "N"),
            title=f"accelerance, {vehicle}, hammer at {blow.name}, {place.name} {axis}",
        )
        for row, (place, axis) in enumerate(_channels(body_sensor_places(bench)))
        for column, blow in enumerate(impact_places(bench))
    ]


def run_functions(
    bench: VirtualBench,
    pressure: ComplexArray,
    acceleration: ComplexArray,
    frequency: RealArray,
    title: str,
) -> list[UffFunction]:
    """Return order spectra of one run, UFF type 0.

    Parameters
    ----------
    pressure : array, shape (f, n_ear)
        [Pa].
    acceleration : array, shape (f, n_channel)
        Source side, then body side [m/s²].
    title : str
        Of the run.
    """
    sensors = (*source_sensor_places(bench), *body_sensor_places(bench))
    columns = [
        (EAR_NODES[ear], "scalar", MICROPHONES[ear], "pressure", "Pa", pressure[:, k])
        for k, ear in enumerate(EARS)
    ]
    columns += [
        (place.node, f"+{axis}", place.name, "acceleration", "m/s^2", acceleration[:, k])
        for k, (place, axis) in enumerate(_channels(sensors))
    ]
    return [
        UffFunction(
            abscissa=frequency,
            values=values,
            function_type=SPECTRUM,
            response_node=node,
            response_direction=direction,
            reference_node=0,
            reference_direction="scalar",
            ordinate=quantity,
            ordinate_unit=unit,
            denominator="none",
            denominator_unit="",
            id_lines=(
                f"order {bench.order_torque.order:g}, {quantity}, {name}",
                title,
                "complex peak amplitude, phase referred to the tacho",
            ),
            response_name=name,
        )
        for node, direction, name, quantity, unit, values in columns
    ]


def _frf(
    frequency: RealArray,
    values: ComplexArray,
    response: tuple[int, str, str, str, str],
    reference: tuple[int, str, str, str, str],
    title: str,
) -> UffFunction:
    return UffFunction(
        abscissa=frequency,
        values=values,
        function_type=FRF,
        response_node=response[0],
        response_direction=response[1],
        reference_node=reference[0],
        reference_direction=reference[1],
        ordinate=response[3],
        ordinate_unit=response[4],
        denominator=reference[3],
        denominator_unit=reference[4],
        id_lines=(title,),
        response_name=response[2],
        reference_name=reference[2],
    )


def _channels(places: Sequence[SensorPlace]) -> list[tuple[SensorPlace, str]]:
    return [(place, axis) for place in places for axis in AXES]


def _at(position: RealArray, digits: int = 4) -> tuple[float, float, float]:
    x, y, z = np.round(position, digits).tolist()
    return x, y, z
