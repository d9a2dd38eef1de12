"""Read the folder of a roving-hammer test on a mounted body, as a laboratory delivers it."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.files.hammer_test import read_hammer_test
from deboom.files.inertance_functions import Places, read_coherences, read_inertances
from deboom.files.inertance_test_file import (
    INERTANCE_TEST_FILE,
    InertanceTestFile,
    load_inertance_test_file,
)
from deboom.files.inertance_test_tables import read_placed_impacts, read_placed_sensors
from deboom.measurement.channels import Frf
from deboom.measurement.hammer_frf import HammerOptions, hammer_frfs
from deboom.measurement.hammer_measurement import HammerTest
from deboom.measurement.impacts import Impact
from deboom.measurement.inertance_test import (
    ACCELERATION_PER_FORCE,
    CompressorMount,
    Drawing,
    InertanceTest,
    check_enough,
)
from deboom.measurement.placement_tolerances import PlacementTolerances
from deboom.measurement.sensors import Sensor, SensorKind
from deboom.physics.rigid_body import rotation_matrix

SAME_PLACE = 1e-4
"""Largest difference of an impact between position sheet and hits [m, 1]: rounding."""

__all__ = ["INERTANCE_TEST_FILE", "read_inertance_test"]


def read_inertance_test(folder: Path | str, *, from_hits: bool = False) -> InertanceTest:
    """Read FRFs, coherences, position sheets and what is stated besides.

    Parameters
    ----------
    folder : path
        Holds ``compressor_test.toml`` and what it names.
    from_hits : bool
        Make the FRFs of the hits over time, although FRFs are there as well. Where only hits are
        there, they are taken anyway.

    Returns
    -------
    InertanceTest
        In SI, along positive axes.

    Raises
    ------
    InputError
        A file is missing, damaged or wrong in itself; a length without a unit; an unknown node; an
        FRF or a coherence that is missing or doubled; fewer than three sensors or six impacts; a
        line at 0 Hz; hits that do not belong to the position sheet. The sentence names file, item
        and remedy.
    """
    folder = Path(folder)
    path = folder / INERTANCE_TEST_FILE
    file = load_inertance_test_file(path)
    tables = [folder / file.sensor_table, folder / file.impact_table]
    places = Places(read_placed_sensors(tables[0]), read_placed_impacts(tables[1]))
    try:
        sensors, impacts = _sensors(places), _impacts(places)
        check_enough(sensors, impacts)
    except InputError as error:
        where = " and ".join(dict.fromkeys(map(str, tables)))
        raise InputError(f"{where}: {error}") from None
    if from_hits and file.hits is None:
        raise InputError(f"{path}: key 'hits' is missing: name the folder of the hits over time")
    if from_hits or file.frf is None:
        frf, coherence, n_averages, read = _from_hits(folder, file, impacts, places.channels)
    else:
        frf, coherence, n_averages, read = _from_frfs(folder, file, places)
    try:
        return InertanceTest(
            name=file.title,
            sensors=sensors,
            impacts=impacts,
            frf=frf,
            coherence=coherence,
            n_averages=n_averages,
            tolerances=_tolerances(file),
            weighed_mass=file.weighed_mass_kg,
            weighed_mass_deviation=file.weighed_mass_deviation_kg or 0.0,
            drawing=_drawing(file),
            input_files=tuple(dict.fromkeys([path, *tables, *read])),
        )
    except InputError as error:
        raise InputError(f"{folder}: {error}") from None


def _sensors(places: Places) -> tuple[Sensor, ...]:
    return tuple(
        Sensor(
            name=row.sensor,
            kind=SensorKind.ACCELEROMETER,
            model="",
            mount="",
            piece="",
            position=np.array(row.position),
            orientation=rotation_matrix(row.angles),
        )
        for row in places.sensors
    )


def _impacts(places: Places) -> tuple[Impact, ...]:
    return tuple(
        Impact(row.impact, np.array(row.position), np.array(row.direction))
        for row in places.impacts
    )


_Measured = tuple[Frf, RealArray, int, list[Path]]


def _from_frfs(folder: Path, file: InertanceTestFile, places: Places) -> _Measured:
    # loading made sure that the three come together
    assert file.frf is not None
    assert file.coherence is not None
    assert file.hits_per_impact is not None
    paths = [folder / file.frf, folder / file.coherence]
    frequency, values = read_inertances(paths[0], places)
    lines, coherence = read_coherences(paths[1], places)
    if not np.array_equal(lines, frequency):
        raise InputError(f"{paths[1]} has other lines than {paths[0]}: export both with the same")
    impacts = tuple(impact.impact for impact in places.impacts)
    frf = Frf(frequency, values, places.channels, impacts, ACCELERATION_PER_FORCE)
    return frf, coherence, file.hits_per_impact, paths


def _from_hits(
    folder: Path, file: InertanceTestFile, impacts: tuple[Impact, ...], channels: tuple[str, ...]
) -> _Measured:
    assert file.hits is not None
    hits = folder / file.hits
    test = read_hammer_test(hits)
    _check_same_places(hits, test, impacts)
    estimate = hammer_frfs(test, HammerOptions(band=file.band_hz))
    estimate = estimate.select(channels, tuple(impact.name for impact in impacts))
    read = sorted(path for path in hits.rglob("*") if path.is_file())
    return estimate.frf, estimate.coherence, int(min(estimate.n_averages)), read


def _check_same_places(hits: Path, test: HammerTest, impacts: tuple[Impact, ...]) -> None:
    struck = {impact.name: impact for impact in test.impacts}
    for impact in impacts:
        if impact.name not in struck:
            raise InputError(
                f"{hits}: no hits on {impact.name} of the position sheet: deliver them, or take it "
                "out of the sheet"
            )
        other = struck[impact.name]
        off = np.abs([impact.position - other.position, impact.direction - other.direction])
        if off.max() > SAME_PLACE:
            raise InputError(
                f"{hits}: {impact.name} has another place or direction than in the position "
                "sheet: correct the wrong one"
            )


def _tolerances(file: InertanceTestFile) -> PlacementTolerances:
    stated = file.tolerances
    return PlacementTolerances(
        sensor_gain=stated.sensor_gain,
        sensor_position=stated.sensor_position_m,
        sensor_angle=math.radians(stated.sensor_angle_deg),
        hammer_gain=stated.hammer_gain,
        impact_position=stated.impact_position_m,
        impact_angle=math.radians(stated.impact_angle_deg),
    )


def _drawing(file: InertanceTestFile) -> Drawing | None:
    if file.drawing is None:
        return None
    return Drawing(
        mass=file.drawing.mass_kg,
        centre=np.array(file.drawing.centre_of_gravity_m),
        inertia=np.array(file.drawing.inertia_kg_m2),
        mounts=tuple(
            CompressorMount(
                mount.name,
                np.array(mount.position_m),
                np.deg2rad(mount.rotation_deg),
                np.array(mount.stiffness_n_per_m),
            )
            for mount in file.mounts
        ),
    )
