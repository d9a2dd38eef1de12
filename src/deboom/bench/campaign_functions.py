"""The campaign's recordings as UFF functions, and the table that names their channels."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.campaign_layout import (
    ENGINE_NODE,
    TACHO_NODE,
    PushPlace,
    accelerometer_places,
    cell_places,
)
from deboom.bench.campaign_sensors import RecordedRun
from deboom.bench.operating_run import SIDES
from deboom.bench.parameters import AXES, VirtualBench
from deboom.bench.platform_layout import points
from deboom.files.campaign_tables import CAMPAIGN_QUANTITIES, CampaignChannel
from deboom.files.uff import UffFunction
from deboom.files.units import parse_unit
from deboom.physics.orders import rpm_of_frequency

ORDER_SPECTRUM, TIME_SIGNAL, FRF = 0, 1, 4
"""UFF function types."""


def channel_table(bench: VirtualBench, third_cell: bool = False) -> tuple[CampaignChannel, ...]:
    """Return every channel of every run: sensors, static forces, engine, tacho."""
    static = [
        (point.channel(axis), "static force", point.node, f"+{axis}")
        for point in points(bench.mount_names)
        for axis in point.axes
    ]
    sensors = [
        (f"{place.sensor} {axis}", quantity, place.node, f"+{axis}")
        for quantity, places in (
            ("acceleration", accelerometer_places(bench)),
            ("cell force", cell_places(bench, third_cell)),
        )
        for place in places
        for axis in AXES
    ]
    engine = [
        ("engine torque", "engine torque", ENGINE_NODE, "+ry"),
        ("engine speed", "engine speed", ENGINE_NODE, "scalar"),
        ("tacho", "tacho", TACHO_NODE, "scalar"),
    ]
    return tuple(
        CampaignChannel(
            name, quantity, node, direction, parse_unit(CAMPAIGN_QUANTITIES[quantity][1])
        )
        for name, quantity, node, direction in (*sensors, *static, *engine)
    )


def order_functions(
    bench: VirtualBench,
    recorded: RecordedRun,
    frequency: RealArray,
    title: str,
    third_cell: bool = False,
) -> list[UffFunction]:
    """Return the spectra and slow channels of one run over the lines of its order.

    Parameters
    ----------
    bench : VirtualBench
        Its channels and order.
    recorded : RecordedRun
        What was recorded.
    frequency : array, shape (f,)
        [Hz].
    title : str
        Of the run.
    third_cell : bool
        Whether three cells are below every powertrain mount.
    """
    order = bench.order_torque.order
    columns: dict[str, RealArray | ComplexArray] = {
        "acceleration": recorded.acceleration,
        "cell force": recorded.cell_force,
        "static force": recorded.static_force,
        "engine torque": recorded.engine_torque[:, None],
        "engine speed": rpm_of_frequency(frequency, order)[:, None],
    }
    lines = (f"order {order:g}", title, "complex peak amplitude, phase referred to the tacho")
    return [
        _function(channel, frequency, values, ORDER_SPECTRUM, lines)
        for channel, values in _by_channel(bench, columns, third_cell)
    ]


def time_functions(
    bench: VirtualBench,
    time: RealArray,
    columns: Mapping[str, RealArray],
    title: str,
    third_cell: bool = False,
) -> list[UffFunction]:
    """Return the channels of one run over time.

    Parameters
    ----------
    bench : VirtualBench
        Its channels.
    time : array, shape (n_sample,)
        [s].
    columns : mapping of str to array, shape (n_sample, n_channel)
        Quantity of the channel table to its channels.
    title : str
        Of the run.
    third_cell : bool
        Whether three cells are below every powertrain mount.
    """
    return [
        _function(channel, time, values, TIME_SIGNAL, (title,))
        for channel, values in _by_channel(bench, columns, third_cell)
    ]


def shaker_functions(
    bench: VirtualBench,
    mount: int,
    axis: int,
    answer: ComplexArray,
    frequency: RealArray,
    third_cell: bool = False,
) -> list[UffFunction]:
    """Return the answer of a mount's cells to the shaker, per newton that it states.

    Parameters
    ----------
    bench : VirtualBench
        Its channels.
    mount, axis : int
        Where the shaker pushes, and along which axis.
    answer : array, shape (f, n_channel)
        [N/N].
    frequency : array, shape (f,)
        [Hz].
    third_cell : bool
        Whether three cells are below every powertrain mount.
    """
    point = points(bench.mount_names)[mount]
    title = f"shaker at the virtual point, {point.channel(AXES[axis])}"
    reference = (point.node, axis, title)
    return _answer_functions(bench, point.mount, reference, answer, frequency, third_cell)


def push_functions(
    bench: VirtualBench, push: PushPlace, answer: ComplexArray, frequency: RealArray
) -> list[UffFunction]:
    """Return the answer of a mount's three cells to a push beside its virtual point.

    Parameters
    ----------
    bench : VirtualBench
        Its channels.
    push : PushPlace
        Where and along which axis.
    answer : array, shape (f, n_channel)
        Per newton that is stated [N/N].
    frequency : array, shape (f,)
        [Hz].
    """
    reference = (push.node, push.axis, f"push {push.name} beside the virtual point of {push.mount}")
    return _answer_functions(bench, push.mount, reference, answer, frequency, True)


def _answer_functions(
    bench: VirtualBench,
    mount: str,
    reference: tuple[int, int, str],
    answer: ComplexArray,
    frequency: RealArray,
    third_cell: bool,
) -> list[UffFunction]:
    node, axis, title = reference
    places = [place for place in cell_places(bench, third_cell) if place.mount == mount]
    below = [f"{place.sensor} {a}" for place in places for a in AXES]
    channels = [c for c in channel_table(bench, third_cell) if c.channel in below]
    return [
        UffFunction(
            abscissa=frequency,
            values=values,
            function_type=FRF,
            response_node=channel.node,
            response_direction=channel.direction,
            reference_node=node,
            reference_direction=f"+{AXES[axis]}",
            ordinate="force",
            ordinate_unit="N",
            denominator="force",
            denominator_unit="N",
            id_lines=(title,),
            response_name=channel.channel,
            reference_name=mount,
        )
        for channel, values in zip(channels, answer.T, strict=True)
    ]


def _by_channel(
    bench: VirtualBench, columns: Mapping[str, RealArray | ComplexArray], third_cell: bool
) -> Iterator[tuple[CampaignChannel, RealArray | ComplexArray]]:
    channels = channel_table(bench, third_cell)
    for quantity, values in columns.items():
        of_quantity = [channel for channel in channels if channel.quantity == quantity]
        yield from zip(of_quantity, np.asarray(values).T, strict=True)


def _function(
    channel: CampaignChannel,
    abscissa: RealArray,
    values: RealArray | ComplexArray,
    function_type: int,
    id_lines: tuple[str, ...],
) -> UffFunction:
    ordinate, unit = CAMPAIGN_QUANTITIES[channel.quantity]
    return UffFunction(
        abscissa=abscissa,
        values=values,
        function_type=function_type,
        response_node=channel.node,
        response_direction=channel.direction,
        reference_node=0,
        reference_direction="scalar",
        ordinate=ordinate,
        ordinate_unit=unit,
        denominator="none",
        denominator_unit="",
        id_lines=id_lines,
        response_name=_entity(channel.channel),
    )


def _entity(channel: str) -> str:
    """Shorten a channel's name to the ten characters of UFF; the DoF is what counts."""
    for side in SIDES:
        channel = channel.replace(side, side[0])
    return channel.removeprefix("engine ")
