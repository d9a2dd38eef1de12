"""The bench's measurements as UFF functions, and as the tables that name them."""

from __future__ import annotations

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.data_sheet import (
    CENTRE_TOLERANCE,
    INERTIA_TOLERANCE,
    MASS_TOLERANCE,
    WHEEL_END_TOLERANCE,
    DataSheet,
)
from deboom.bench.fleet import BenchFleet
from deboom.bench.laboratory import MeasuredRun
from deboom.bench.parameters import AXES, VirtualBench
from deboom.bench.platform_layout import (
    CYLINDERS,
    DEFAULT_LOAD_CASE,
    DESCRIPTION,
    FIRST_EAR_NODE,
    LOAD_CASES,
    MOUNT_DESCRIPTIONS,
    NAME,
    TITLE,
    WISHBONE_POSITIONS,
    LoadCasePlan,
    paths,
    points,
)
from deboom.files.platform_file import (
    Engine,
    LoadCaseEntry,
    MountEntry,
    PlatformFile,
    Powertrain,
    VehicleEntry,
)
from deboom.files.platform_tables import NOISE_TRANSFER, QUANTITY_UNIT, ChannelRow, MountRow
from deboom.files.uff import UffFunction
from deboom.files.units import parse_unit

MOUNT_TABLE = "mounts.csv"
CHANNEL_TABLE = "channels.csv"


def noise_transfer_file(vehicle: str) -> str:
    """Return the file of a vehicle's noise transfer functions."""
    return f"noise_transfer/{vehicle}.uff"


def operating_file(load_case: LoadCasePlan) -> str:
    """Return the file of a load case's operating spectra."""
    return f"operating/{load_case.name}.uff"


def torque_file(load_case: LoadCasePlan) -> str:
    """Return the file of a load case's engine torque."""
    return f"operating/{load_case.name}_torque.csv"


def ear_nodes(fleet: BenchFleet) -> dict[str, int]:
    """Assign each vehicle the node of its driver's ear."""
    return {vehicle: FIRST_EAR_NODE + k for k, vehicle in enumerate(fleet.bodies)}


def operating_functions(
    measured: MeasuredRun,
    frequency: RealArray,
    load_case: LoadCasePlan,
    mount_names: tuple[str, ...],
    order: float,
) -> list[UffFunction]:
    """Return displacement and force of one run at every virtual point, UFF type 0."""
    columns = [(point, axis) for point in points(mount_names) for axis in point.axes]
    return [
        UffFunction(
            abscissa=frequency,
            values=values[:, column],
            function_type=0,
            response_node=point.node,
            response_direction=f"+{axis}",
            reference_node=0,
            reference_direction="scalar",
            ordinate=quantity,
            ordinate_unit=QUANTITY_UNIT[quantity],
            denominator="none",
            denominator_unit="",
            id_lines=(
                f"order {order:g}, {quantity} at the virtual point, {point.channel(axis)}",
                load_case.title,
                "complex peak amplitude, phase referred to the tacho",
            ),
            response_name=point.channel("").strip(),
        )
        for quantity, values in (("displacement", measured.displacement), ("force", measured.force))
        for column, (point, axis) in enumerate(columns)
    ]


def noise_transfer_functions(
    measured: ComplexArray,
    frequency: RealArray,
    vehicle: str,
    ear_node: int,
    mount_names: tuple[str, ...],
) -> list[UffFunction]:
    """Return the pressure at the driver's ear per force at every path, UFF type 4."""
    return [
        UffFunction(
            abscissa=frequency,
            values=measured[:, column],
            function_type=4,
            response_node=ear_node,
            response_direction="scalar",
            reference_node=path.node,
            reference_direction=f"+{path.axis}",
            ordinate="pressure",
            ordinate_unit="Pa",
            denominator="force",
            denominator_unit="N",
            id_lines=(
                f"noise transfer function, {vehicle}, {path.name}",
                "driver's ear; a mount of several pieces: per newton of their summed force",
            ),
            response_name="driver ear",
            reference_name=path.mount,
        )
        for column, path in enumerate(paths(mount_names))
    ]


def channel_rows(mount_names: tuple[str, ...]) -> list[ChannelRow]:
    """Return the channel table: operating channels first, then noise transfer functions."""
    operating = [
        ChannelRow(
            channel=point.channel(axis),
            quantity=quantity,
            mount=point.mount,
            piece=point.piece,
            axis=axis,
            node=point.node,
            direction=f"+{axis}",
            unit=parse_unit(QUANTITY_UNIT[quantity]),
        )
        for quantity in ("displacement", "force")
        for point in points(mount_names)
        for axis in point.axes
    ]
    transfer = [
        ChannelRow(
            channel=path.name,
            quantity=NOISE_TRANSFER,
            mount=path.mount,
            piece="",
            axis=path.axis,
            node=path.node,
            direction=f"+{path.axis}",
            unit=parse_unit(QUANTITY_UNIT[NOISE_TRANSFER]),
        )
        for path in paths(mount_names)
    ]
    return [*operating, *transfer]


def mount_rows(bench: VirtualBench, sheet: DataSheet) -> list[MountRow]:
    """Return the mount table: positions from the centre of gravity of the data sheet."""
    true = [*bench.positions, *np.array(WISHBONE_POSITIONS)]
    stated = np.round(np.array(true) + sheet.centre_error, 4).tolist()
    return [
        MountRow(point.mount, point.piece, (x, y, z))
        for point, (x, y, z) in zip(points(bench.mount_names), stated, strict=True)
    ]


def platform_file(
    bench: VirtualBench, sheet: DataSheet, wheel_end_mass: float, fleet: BenchFleet
) -> PlatformFile:
    """Return the content of ``platform.toml``, with the stated mass of a wheel end [kg]."""
    nodes = ear_nodes(fleet)
    (jxx, jxy, jxz), (jyx, jyy, jyz), (jzx, jzy, jzz) = sheet.inertia.tolist()
    return PlatformFile(
        format=1,
        name=NAME,
        title=TITLE,
        description=DESCRIPTION,
        mount_table=MOUNT_TABLE,
        channel_table=CHANNEL_TABLE,
        default_load_case=DEFAULT_LOAD_CASE,
        engine=Engine(
            cylinders=CYLINDERS,
            dominant_order=bench.order_torque.order,
            total_ratios=bench.total_ratios,
        ),
        powertrain=Powertrain(
            mass_kg=sheet.mass,
            mass_tolerance_kg=MASS_TOLERANCE,
            inertia_kg_m2=((jxx, jxy, jxz), (jyx, jyy, jyz), (jzx, jzy, jzz)),
            inertia_tolerance=INERTIA_TOLERANCE,
            centre_of_gravity_tolerance_m=CENTRE_TOLERANCE,
        ),
        mounts=(
            *(_mount_entry(name, bench) for name in bench.mount_names),
            _mount_entry("Du", bench, wheel_end_mass),
        ),
        vehicles=tuple(
            VehicleEntry(
                name=vehicle,
                group=vehicle.rpartition("-")[0],
                noise_transfer=noise_transfer_file(vehicle),
                ear_node=nodes[vehicle],
            )
            for vehicle in fleet.bodies
        ),
        load_cases=tuple(
            LoadCaseEntry(
                name=case.name,
                title=case.title,
                gear=case.gear,
                torque_limit_nm=case.torque_limit,
                operating=operating_file(case),
                torque_table=torque_file(case),
            )
            for case in LOAD_CASES
        ),
    )


def _mount_entry(name: str, bench: VirtualBench, body_mass: float | None = None) -> MountEntry:
    pieces = tuple(point.piece for point in points(bench.mount_names) if point.mount == name)
    axes = {path.axis for path in paths(bench.mount_names) if path.mount == name}
    return MountEntry(
        name=name,
        description=MOUNT_DESCRIPTIONS[name],
        pieces=pieces if len(pieces) > 1 else None,
        transfer_axes=tuple(axis for axis in AXES if axis in axes),
        body_mass_kg=body_mass,
        body_mass_tolerance_kg=None if body_mass is None else WHEEL_END_TOLERANCE,
    )
