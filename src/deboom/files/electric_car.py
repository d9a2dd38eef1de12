"""The folder of an electric car: compressor, sweeps in the car, hammer on its body."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.files.function_table import Dof, FunctionMatrix
from deboom.files.inertance_test import (
    COHERENCE,
    FRF,
    Places,
    ToleranceSection,
    read_inertances,
    read_placed_impacts,
    read_placed_sensors,
)
from deboom.files.operating_test import read_operating_test
from deboom.files.platform import Name, RelativePath, Row3
from deboom.files.rows import PlacedImpact, PlacedSensor
from deboom.files.schema import StrictModel, dump_toml, load_toml, refuse_doubled
from deboom.files.uff import UffFunction, read_uff
from deboom.files.vehicle import EarEntry
from deboom.measurement.channels import Frf
from deboom.measurement.compressor_test import ACCELERATION_PER_FORCE
from deboom.measurement.electric_car import ElectricCar, PointKind, TransferPoint
from deboom.measurement.noise_transfer import PRESSURE_PER_FORCE
from deboom.measurement.sensors import Impact, PlacementTolerances, Sensor, SensorKind
from deboom.physics.rigid_body import rotation_matrix

ELECTRIC_CAR_FILE = "car.toml"

Title = Annotated[str, Field(min_length=1)]


class PointSection(StrictModel):
    """One place where the compressor or a hose meets the body."""

    name: Title
    """A mount is called as its holder in ``operation.toml``, a hose end as its hose."""
    kind: Literal["mount", "hose"]
    """What meets the body there."""
    position_m: Row3
    """Elastic centre of the mount, or end of the hose, from the compressor's virtual point."""
    sensors: Annotated[tuple[Title, ...], Field(strict=False, min_length=1)]
    """Accelerometers of the position sheet on the body around it."""
    impacts: Annotated[tuple[Title, ...], Field(strict=False, min_length=1)]
    """Impacts of the position sheet on the body around it."""


class ElectricCarFile(StrictModel):
    """The whole file ``car.toml``; ``operation.toml`` lies beside it."""

    format: Literal[1]
    """Version of this format."""
    name: Name
    """Such as ``EV-1``."""
    title: Title
    """In words, for the report."""
    sensor_table: RelativePath
    """Position sheet of the accelerometers on the body, CSV or sheet ``sensors`` of Excel."""
    impact_table: RelativePath
    """Position sheet of the impacts on the body, CSV or sheet ``impacts`` of Excel."""
    pressure: RelativePath
    """UFF: pressure at the ear per force of the hammer, and its ordinary coherence."""
    accelerance: RelativePath
    """UFF: acceleration on the body per force of the hammer."""
    hits_per_impact: Annotated[int, Field(ge=1)]
    """How many hits the functions average."""
    ear: EarEntry
    """The microphone, called as in ``operation.toml``."""
    tolerances: ToleranceSection
    """Of everything placed and struck on the body."""
    points: Annotated[tuple[PointSection, ...], Field(strict=False, min_length=1)]
    """All mounts, and the ends of the hoses."""


def load_electric_car_file(path: Path) -> ElectricCarFile:
    """Read and check ``car.toml``.

    Raises
    ------
    InputError
        The file is missing or is not TOML; a key is unknown, missing, mistyped or out of range; a
        point that comes twice, or a sensor or impact that belongs to two.
    """
    file = load_toml(path, ElectricCarFile)
    for what, names in (
        ("[[points]] are named", [point.name for point in file.points]),
        ("[[points]] have the sensor", [name for point in file.points for name in point.sensors]),
        ("[[points]] have the impact", [name for point in file.points for name in point.impacts]),
    ):
        refuse_doubled(path, what, names)
    return file


def dump_electric_car_file(path: Path, file: ElectricCarFile) -> None:
    """Write ``car.toml``; what is written is read back and compared first."""
    dump_toml(path, file)


__all__ = ["ELECTRIC_CAR_FILE", "read_electric_car"]


def read_electric_car(folder: Path | str) -> ElectricCar:
    """Read what was measured on a car and check that it fits together.

    Parameters
    ----------
    folder : path
        Holds ``car.toml`` and what it names, and ``operation.toml`` with the hammer test on the
        compressor and the sweeps in the car.

    Returns
    -------
    ElectricCar
        In SI, along positive axes.

    Raises
    ------
    InputError
        A file is missing, damaged or wrong in itself; a function that is missing, doubled, or of
        another microphone, type or unit; a mount without noise transfer functions; a sweep without
        the ear. The sentence names file, item and remedy.

    Examples
    --------
    >>> import deboom
    >>> deboom.read_electric_car("car").operation.sweeps[0].name  # doctest: +SKIP
    """
    folder = Path(folder)
    path = folder / ELECTRIC_CAR_FILE
    file = load_electric_car_file(path)
    tables = [folder / file.sensor_table, folder / file.impact_table]
    sensors = {row.sensor: row for row in read_placed_sensors(tables[0])}
    impacts = {row.impact: row for row in read_placed_impacts(tables[1])}
    for table, what, known, named in (
        (tables[0], "sensor", sensors, [n for p in file.points for n in p.sensors]),
        (tables[1], "impact", impacts, [n for p in file.points for n in p.impacts]),
    ):
        _check_named(path, table, what, list(known), named)
    placed = Places(
        tuple(sensors[name] for point in file.points for name in point.sensors),
        tuple(impacts[name] for point in file.points for name in point.impacts),
    )
    files = [folder / file.pressure, folder / file.accelerance]
    pressure, coherence = _pressure(files[0], file, placed.impacts)
    lines, accelerance = read_inertances(files[1], placed)
    operation = read_operating_test(folder)
    try:
        return ElectricCar(
            name=file.name,
            operation=operation,
            points=tuple(
                TransferPoint(
                    name=point.name,
                    kind=PointKind(point.kind),
                    position=np.array(point.position_m),
                    sensors=tuple(_sensor(sensors[name]) for name in point.sensors),
                    impacts=tuple(_impact(impacts[name]) for name in point.impacts),
                )
                for point in file.points
            ),
            ear=file.ear.name,
            pressure=pressure,
            coherence=coherence,
            n_averages=file.hits_per_impact,
            accelerance=Frf(
                lines, accelerance, placed.channels, pressure.inputs, ACCELERATION_PER_FORCE
            ),
            tolerances=_tolerances(file),
            input_files=tuple(dict.fromkeys([path, *tables, *files, *operation.input_files])),
        )
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _check_named(
    path: Path, table: Path, what: str, known: Sequence[str], named: Sequence[str]
) -> None:
    unknown = [name for name in named if name not in known]
    if unknown:
        raise InputError(
            f"{path}: [[points]]: {what} '{unknown[0]}' is not in {table.name}: add it there, or "
            "correct the name"
        )
    left = [name for name in known if name not in named]
    if left:
        raise InputError(
            f"{table}: {what} '{left[0]}' belongs to no point of {path.name}: name it there, or "
            "take it out of the sheet"
        )


def _pressure(
    path: Path, file: ElectricCarFile, impacts: Sequence[PlacedImpact]
) -> tuple[Frf, RealArray]:
    """Read pressure per force of every impact, and its coherence of shape (f, 1, n_impact)."""
    ear = Dof(file.ear.name, file.ear.node, "scalar", file.ear.microphone)
    blows = [Dof(row.impact, row.node, row.uff_direction) for row in impacts]
    matrix = FunctionMatrix(path, "hammer", (FRF,))
    values = matrix.values([ear], blows, ordinate="pressure", unit=PRESSURE_PER_FORCE)
    names = tuple(blow.name for blow in blows)
    frf = Frf(matrix.axis, values, (ear.name,), names, PRESSURE_PER_FORCE)
    found = {
        (function.reference_node, function.reference_direction): function
        for function in read_uff(path)
        if function.function_type == COHERENCE and function.response_node == ear.node
    }
    columns = [_coherence(path, found.get((blow.node, blow.direction)), blow) for blow in blows]
    return frf, np.stack(columns, axis=1)[:, None, :]


def _coherence(path: Path, function: UffFunction | None, blow: Dof) -> RealArray:
    what = f"{path}: the coherence of {blow.name} (reference node {blow.node} {blow.direction})"
    if function is None:
        raise InputError(
            f"{what} is missing: without it the noise of its function is not known, export it as "
            "UFF function type 6"
        )
    values = function.values
    if np.iscomplexobj(values) or np.any((values < 0) | (values > 1 + 1e-6)):
        raise InputError(f"{what} is not real between 0 and 1: this is another function")
    return np.minimum(np.asarray(values, dtype=np.float64), 1.0)


def _sensor(row: PlacedSensor) -> Sensor:
    return Sensor(
        name=row.sensor,
        kind=SensorKind.ACCELEROMETER,
        model="",
        mount="",
        piece="",
        position=np.array(row.position),
        orientation=rotation_matrix(row.angles),
    )


def _impact(row: PlacedImpact) -> Impact:
    return Impact(row.impact, np.array(row.position), np.array(row.direction))


def _tolerances(file: ElectricCarFile) -> PlacementTolerances:
    stated = file.tolerances
    return PlacementTolerances(
        sensor_gain=stated.sensor_gain,
        sensor_position=stated.sensor_position_m,
        sensor_angle=math.radians(stated.sensor_angle_deg),
        hammer_gain=stated.hammer_gain,
        impact_position=stated.impact_position_m,
        impact_angle=math.radians(stated.impact_angle_deg),
    )
