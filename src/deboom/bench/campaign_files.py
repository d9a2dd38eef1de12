"""The campaign's recordings as UFF functions, its tables and campaign.toml."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.campaign_plan import CampaignErrors, CampaignPlan, PlannedRun
from deboom.bench.campaign_recording import CampaignSensors, RecordedRun
from deboom.bench.layout import (
    ACCELEROMETER_MODEL,
    CELL_MODEL,
    ENGINE_NODE,
    MOUNT_DESCRIPTIONS,
    TACHO_NODE,
    Place,
    PushPlace,
    accelerometer_places,
    cell_places,
    paths,
    points,
    push_places,
)
from deboom.bench.operating_run import SIDES
from deboom.bench.powertrain import AXES, VirtualBench, mount_names
from deboom.bench.sensors import CENTRE_TOLERANCE, INERTIA_TOLERANCE, MASS_TOLERANCE, DataSheet
from deboom.files.campaign import (
    Axis,
    CampaignFile,
    CampaignMount,
    CurveEntry,
    PushEntry,
    RunEntry,
    ShakerEntry,
    TimeRunEntry,
    ToleranceEntry,
)
from deboom.files.campaign_tables import CAMPAIGN_QUANTITIES, CampaignChannel, SensorRow
from deboom.files.platform import Engine
from deboom.files.platform import PowertrainEntry as Powertrain
from deboom.files.tables import parse_unit
from deboom.files.uff import UffFunction
from deboom.physics.order_tracking import rpm_of_frequency

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


MOUNT_TABLE = "mounts.csv"
SENSOR_TABLE = "sensors.csv"
CHANNEL_TABLE = "channels.csv"


def run_file(mount_set: str, run: PlannedRun) -> str:
    """Return the file of a run."""
    return f"runs/{mount_set}/{run.name}.uff"


def shaker_file(mount: str, axis: str, repeat: int) -> str:
    """Return the file of a run of the shaker."""
    return f"shaker/{mount}_{axis}_{repeat}.uff"


def push_file(push: PushPlace, repeat: int) -> str:
    """Return the file of a push beside a virtual point."""
    return f"shaker/{push.mount}_{push.name}_{repeat}.uff"


def curve_file(mount_set: str, mount: str, axis: str) -> str:
    """Return the file of a supplier's curve."""
    return f"static_curves/{mount_set}/{mount}_{axis}.csv"


def time_run_name(run: PlannedRun) -> str:
    """Return the name of a run over time."""
    return f"{run.name}_time"


def time_run_file(run: PlannedRun) -> str:
    """Return the file of a run over time."""
    return f"time/{time_run_name(run)}.uff"


def curve_directions(bench: VirtualBench) -> list[tuple[str, Axis]]:
    """Return mount and axis of every direction that has a law, powertrain first."""
    return [
        (mount.name, axis)
        for body in (bench.powertrain, bench.wheel_end)
        for mount in body.mounts
        for axis, _ in zip(AXES, mount.laws, strict=False)
    ]


def sensor_rows(bench: VirtualBench, sensors: CampaignSensors, sheet: DataSheet) -> list[SensorRow]:
    """Return the position sheet: nominal places from the stated centre of gravity."""
    rows = []
    for kind, model, places, all_angles in (
        (
            "accelerometer",
            ACCELEROMETER_MODEL,
            accelerometer_places(bench),
            sensors.accelerometer_angles,
        ),
        (
            "force cell",
            CELL_MODEL,
            cell_places(bench, sensors.third_cell),
            sensors.cell_angles,
        ),
    ):
        for place, angles in zip(places, all_angles, strict=True):
            rows.append(_sensor_row(place, kind, model, angles, sheet))
    return rows


def _sensor_row(
    place: Place, kind: str, model: str, angles: RealArray, sheet: DataSheet
) -> SensorRow:
    x, y, z = np.round(place.position + sheet.centre_error, 4).tolist()
    rx, ry, rz = np.deg2rad(angles).tolist()
    return SensorRow(place.sensor, kind, model, place.mount, place.piece, (x, y, z), (rx, ry, rz))


def campaign_file(
    bench: VirtualBench,
    sheet: DataSheet,
    plan: CampaignPlan,
    errors: CampaignErrors,
    cylinders: int,
    seed: int,
) -> CampaignFile:
    """Return the content of ``campaign.toml``.

    Parameters
    ----------
    bench : VirtualBench
        What was measured.
    sheet : DataSheet
        What is stated of its powertrain.
    plan : CampaignPlan
        The runs.
    errors : CampaignErrors
        Whose sizes are the stated tolerances.
    cylinders : int
        Of the engine.
    seed : int
        Of the errors.
    """
    (jxx, jxy, jxz), (jyx, jyy, jyz), (jzx, jzy, jzz) = sheet.inertia.tolist()
    exact = not errors.data_sheet
    return CampaignFile(
        format=1,
        name=f"virtual_bench_{seed}",
        title=f"Virtual bench, seed {seed}",
        description=(
            "Virtual measurements of the deboom bench, with the errors of real sensors; nobody "
            "measured this. The exact truth lies in truth/."
        ),
        mount_table=MOUNT_TABLE,
        sensor_table=SENSOR_TABLE,
        channel_table=CHANNEL_TABLE,
        engine=Engine(
            cylinders=cylinders,
            dominant_order=bench.order_torque.order,
            total_ratios=bench.total_ratios,
        ),
        powertrain=Powertrain(
            mass_kg=sheet.mass,
            mass_tolerance_kg=0.0 if exact else MASS_TOLERANCE,
            inertia_kg_m2=((jxx, jxy, jxz), (jyx, jyy, jyz), (jzx, jzy, jzz)),
            inertia_tolerance=0.0 if exact else INERTIA_TOLERANCE,
            centre_of_gravity_tolerance_m=0.0 if exact else CENTRE_TOLERANCE,
        ),
        tolerances=_tolerances(errors),
        mounts=tuple(_mount(name, bench) for name in mount_names(bench)),
        runs=tuple(
            RunEntry(
                name=run.name,
                mount_set=mount_set,
                gear=run.gear,
                full_load=run.full_load,
                torque_nm=run.torque,
                rising=run.rising,
                file=run_file(mount_set, run),
            )
            for mount_set in plan.mount_sets
            for run in plan.runs
        ),
        shaker_runs=tuple(
            ShakerEntry(
                mount=mount, piece="", axis=axis, repeat=n, file=shaker_file(mount, axis, n)
            )
            for mount in bench.mount_names
            for axis in AXES
            for n in range(1, plan.shaker_repeats + 1)
        ),
        static_curves=tuple(
            CurveEntry(
                mount=mount,
                axis=axis,
                mount_set=mount_set,
                force_uncertainty=errors.curve_scale,
                file=curve_file(mount_set, mount, axis),
            )
            for mount_set in plan.mount_sets
            for mount, axis in curve_directions(bench)
        ),
        time_runs=_time_runs(plan),
        pushes=_pushes(bench, sheet, plan) if plan.third_cell else (),
    )


def _pushes(bench: VirtualBench, sheet: DataSheet, plan: CampaignPlan) -> tuple[PushEntry, ...]:
    entries = []
    for push in push_places(bench):
        x, y, z = np.round(push.position + sheet.centre_error, 4).tolist()
        for repeat in range(1, plan.shaker_repeats + 1):
            file = push_file(push, repeat)
            entries.append(
                PushEntry(
                    name=push.name,
                    mount=push.mount,
                    piece="",
                    position_m=(x, y, z),
                    axis=AXES[push.axis],
                    repeat=repeat,
                    file=file,
                )
            )
    return tuple(entries)


def _time_runs(plan: CampaignPlan) -> tuple[TimeRunEntry, ...]:
    if plan.time_run is None:
        return ()
    run = plan.time_run.run
    return (
        TimeRunEntry(
            name=time_run_name(run),
            mount_set=plan.time_run.mount_set,
            gear=run.gear,
            full_load=run.full_load,
            torque_nm=run.torque,
            rising=run.rising,
            file=time_run_file(run),
            pulses_per_revolution=plan.time_run.pulses_per_revolution,
        ),
    )


def _mount(name: str, bench: VirtualBench) -> CampaignMount:
    pieces = tuple(point.piece for point in points(bench.mount_names) if point.mount == name)
    axes = {path.axis for path in paths(bench.mount_names) if path.mount == name}
    return CampaignMount(
        name=name,
        description=MOUNT_DESCRIPTIONS[name],
        pieces=pieces if len(pieces) > 1 else None,
        transfer_axes=tuple(axis for axis in AXES if axis in axes),
        on_powertrain=name in bench.mount_names,
    )


def _tolerances(errors: CampaignErrors) -> ToleranceEntry:
    chain = errors.chain
    return ToleranceEntry(
        sensor_position_m=chain.position,
        sensor_angle_rad=chain.angle,
        sensor_gain=chain.gain,
        sensor_cross_axis=chain.cross_axis,
        acceleration_own=chain.acceleration_own,
        acceleration_norm=chain.acceleration_norm,
        acceleration_floor_m_s2=chain.acceleration_floor,
        cell_gain=errors.side_cell_gain,
        force_own=chain.force_own,
        force_norm=chain.force_norm,
        force_floor_n=chain.force_floor,
        shaker_angle_rad=chain.shaker_angle,
        shaker_gain=chain.shaker_gain,
        torque_nm=errors.torque,
        static_force_n=errors.static_force,
    )
