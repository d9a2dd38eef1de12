"""The folder of an electric car: compressor, sweeps in the car, hammer on its body."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Literal

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import naming
from deboom.files.function_table import FRF, Dof, FunctionMatrix, with_their_tables
from deboom.files.inertance_test import (
    Places,
    ToleranceSection,
    read_coherences,
    read_inertances,
    read_placed,
)
from deboom.files.kinds import FolderKind
from deboom.files.operating_test import read_operating_test, sweep_lines
from deboom.files.rows import PlacedImpact, PlacedSensor, impact_of, sensor_of
from deboom.files.schema import (
    AtLeastOne,
    FolderRecord,
    Name,
    Number,
    RelativePath,
    Row3,
    StrictModel,
    Title,
    assumed_lines,
    doubled,
    load_toml,
    noting,
    refuse_all,
    telling,
)
from deboom.files.vehicle import EarEntry, far_from_its_point
from deboom.measurement.channels import Frf, refuse_window
from deboom.measurement.electric_car import (
    ElectricCar,
    PointKind,
    TransferPoint,
    refuse_contradictions_of_car,
)
from deboom.measurement.noise_transfer import PRESSURE_PER_FORCE

ELECTRIC_CAR_FILE = "car.toml"


class PointSection(StrictModel):
    """One place where the compressor or a hose meets the body."""

    name: Title  # a mount is called as its holder in operation.toml, a hose end as its hose
    kind: Literal["mount", "hose"]
    position_m: Row3  # elastic centre, or end of the hose, from the compressor's virtual point
    sensors: AtLeastOne[Title]  # accelerometers of the position sheet on the body around it
    impacts: AtLeastOne[Title]  # impacts of the position sheet on the body around it


class ElectricCarFile(StrictModel):
    """The whole file ``car.toml``; ``operation.toml`` lies beside it."""

    format: Literal[1]
    name: Name  # such as EV-1
    title: Title  # in words, for the report
    sensor_table: RelativePath  # on the body, CSV or sheet "sensors" of an Excel file
    impact_table: RelativePath  # on the body, CSV or sheet "impacts" of an Excel file
    pressure: RelativePath  # UFF: pressure at the ear per force of the hammer, and its coherence
    accelerance: RelativePath  # UFF: acceleration on the body per force of the hammer
    hits_per_impact: Number  # how many hits the functions average
    ear: EarEntry  # the microphone, called as in operation.toml
    tolerances: ToleranceSection = ToleranceSection()  # of everything placed and struck on the body
    points: AtLeastOne[PointSection]  # all mounts, and the ends of the hoses

    def faults(self) -> Iterator[str]:
        """Give a sentence for points that come twice, and what belongs to two of them."""
        yield from doubled("[[points]] are named", [point.name for point in self.points])
        yield from doubled(
            "[[points]] have the sensor", [n for p in self.points for n in p.sensors]
        )
        yield from doubled(
            "[[points]] have the impact", [n for p in self.points for n in p.impacts]
        )


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
        the ear; under 3 sensors or 6 impacts at a point. The sentence names file, item and remedy.

    See Also
    --------
    deboom.running_in_car, deboom.cabin_noise, deboom.CompressorProblem

    Examples
    --------
    >>> import deboom
    >>> deboom.read_electric_car("car").operation.sweeps[0].name  # doctest: +SKIP
    """
    folder = Path(folder)
    path = folder / ELECTRIC_CAR_FILE
    file = load_toml(path, ElectricCarFile)
    tables = [folder / file.sensor_table, folder / file.impact_table]
    with telling() as tell:
        with noting(tell):
            sensors = {row.sensor: row for row in read_placed(tables[0], PlacedSensor)}
        with noting(tell):
            impacts = {row.impact: row for row in read_placed(tables[1], PlacedImpact)}
    measured = [name for point in file.points for name in point.sensors]
    struck = [name for point in file.points for name in point.impacts]
    _check_named(path, tables[0], "sensor", list(sensors), measured)
    _check_named(path, tables[1], "impact", list(impacts), struck)
    beside = [
        (tables[0], point.name, name, sensors[name].position)
        for point in file.points
        for name in point.sensors
    ]
    beside += [
        (tables[1], point.name, name, impacts[name].position)
        for point in file.points
        for name in point.impacts
    ]
    refuse_all(far_from_its_point({p.name: p.position_m for p in file.points}, beside))
    placed = Places(
        tuple(map(sensors.__getitem__, measured)), tuple(map(impacts.__getitem__, struck))
    )
    files = [folder / file.pressure, folder / file.accelerance]
    pressure, coherence = _pressure(files[0], file, placed.references)
    accelerance = read_inertances(files[1], placed)
    for file_path, functions in zip(files, (pressure, accelerance), strict=True):
        refuse_window(functions.added_decay_rate, str(file_path))
    operation = read_operating_test(folder)
    tolerances, assumed = file.tolerances.placement(ELECTRIC_CAR_FILE)
    with naming(path):
        return ElectricCar(
            name=file.name,
            operation=operation,
            points=tuple(
                TransferPoint(
                    name=point.name,
                    kind=PointKind(point.kind),
                    position=np.array(point.position_m),
                    sensors=tuple(sensor_of(sensors[name]) for name in point.sensors),
                    impacts=tuple(impact_of(impacts[name]) for name in point.impacts),
                )
                for point in file.points
            ),
            ear=file.ear.name,
            pressure=pressure,
            coherence=coherence,
            n_averages=file.hits_per_impact,
            accelerance=accelerance,
            tolerances=tolerances,
            assumed=(*assumed, *operation.hammer.assumed),
            input_files=with_their_tables([path, *tables, *files, *operation.input_files]),
        )


def _check_named(
    path: Path, table: Path, what: str, available: Sequence[str], named: Sequence[str]
) -> None:
    refuse_all(
        f"{path}: [[points]]: {what} '{name}' is not in {table.name}: add it there, or correct the "
        "name"
        for name in named
        if name not in available
    )
    refuse_all(
        f"{table}: {what} '{name}' belongs to no point of {path.name}: name it there, or take it "
        "out of the sheet"
        for name in available
        if name not in named
    )


def _pressure(path: Path, file: ElectricCarFile, blows: Sequence[Dof]) -> tuple[Frf, RealArray]:
    """Read pressure per force of every impact, and its coherence of shape (f, 1, n_impact)."""
    ear = Dof(file.ear.name, file.ear.node, "scalar", file.ear.microphone)
    matrix = FunctionMatrix(path, "hammer", (FRF,))
    frf = matrix.frf([ear], blows, "pressure", PRESSURE_PER_FORCE)
    return frf, read_coherences(path, [ear], blows)[1]


def _lines(folder: Path) -> Iterator[tuple[str, str]]:
    """Give name and text of each line on what a folder holds."""
    car = read_electric_car(folder)
    with naming(folder):
        refuse_contradictions_of_car(car)
    yield "car", f"{car.name}, {car.ear}"
    yield "points", ", ".join(f"{point.name} ({point.kind.value})" for point in car.points)
    yield from sweep_lines(folder, car.operation)
    yield from assumed_lines(car.assumed)


CAR: FolderRecord = FolderRecord(
    kind=FolderKind.car,
    file=ELECTRIC_CAR_FILE,
    keys=ElectricCarFile,
    command="deboom run compressor_noise --car {}",
    guide="Your own data",
    lines=_lines,
    parts={".": FolderKind.operation, "hammer": FolderKind.compressor},
)
