"""Read the folder of a test on a running compressor: hammer tests, sweeps, hoses."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.files.inertance_test import read_inertance_test
from deboom.files.inertance_test_tables import PlacedSensor, read_placed_sensors
from deboom.files.operating_sweeps import SweepNodes, read_sweep, read_sweep_record
from deboom.files.operating_test_file import (
    OPERATING_TEST_FILE,
    DeviationSection,
    OperatingTestFile,
    SweepSection,
    load_operating_test_file,
)
from deboom.measurement.inertance_test import InertanceTest
from deboom.measurement.operating_sweep import HoseDrawing, HoseState, OperatingSweep, OperatingTest
from deboom.measurement.tracked_sweep import tracked_sweep
from deboom.physics.rigid_body import rotation_matrix

SAME_PLACE = 1e-4
"""Largest difference of a place between two position sheets [m]: rounding."""
SAME_ANGLE = 2e-4
"""Largest difference of a direction between two position sheets [rad]: rounding."""

_BAR = 1e5
_HAMMER = "the hammer test"

__all__ = ["OPERATING_TEST_FILE", "read_operating_test"]


def read_operating_test(folder: Path | str) -> OperatingTest:
    """Read hammer tests, sweeps and what is stated besides.

    Parameters
    ----------
    folder : path
        Holds ``operation.toml`` and what it names.

    Returns
    -------
    OperatingTest
        In SI, along positive axes. A sweep over time has been tracked.

    Raises
    ------
    InputError
        A file is missing, damaged or wrong in itself; a sweep without its tacho; sensors that stand
        elsewhere than in the hammer test. The sentence names file, item and remedy.

    Notes
    -----
    The deviation of a tracked sweep is the stated share of the amplitude and, instead of the stated
    floor, what the filter lets through at order 1.5.
    """
    folder = Path(folder)
    path = folder / OPERATING_TEST_FILE
    file = load_operating_test_file(path)
    table = folder / file.sensor_table
    sensors = read_placed_sensors(table)
    hammer = read_inertance_test(folder / file.hammer)
    _check_sensors(table, sensors, hammer)
    with_hoses = None
    if file.hammer_with_hoses is not None:
        with_hoses = read_inertance_test(folder / file.hammer_with_hoses)
        _check_sensors(table, sensors, with_hoses, "the hammer test with hoses")
        _check_impacts(folder / file.hammer_with_hoses, with_hoses, hammer)
    nodes = SweepNodes(
        sensors,
        file.tacho_node,
        tuple((entry.name, entry.node) for entry in file.holders),
        tuple((entry.name, entry.node) for entry in file.microphones),
    )
    sweeps = tuple(_sweep(folder, entry, file.deviations, nodes) for entry in file.sweeps)
    read = [path, table, *hammer.input_files, *(with_hoses.input_files if with_hoses else ())]
    read += [folder / (entry.spectra or entry.record or "") for entry in file.sweeps]
    try:
        return OperatingTest(
            name=file.title,
            hammer=hammer,
            hammer_with_hoses=with_hoses,
            sweeps=sweeps,
            rotor_inertia=file.rotor_inertia_kg_m2,
            hoses=_hoses(file),
            input_files=tuple(dict.fromkeys(read)),
        )
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _sweep(
    folder: Path, entry: SweepSection, stated: DeviationSection, nodes: SweepNodes
) -> OperatingSweep:
    try:
        if entry.spectra is not None:
            found = read_sweep(folder / entry.spectra, nodes)
            acceleration, holder, sound = found.acceleration, found.holder, found.sound
            corner = stated.corner_hz / acceleration.frequency
            floor = (stated.floor_m_s2 * np.sqrt(1 + corner**2))[:, np.newaxis]
        else:
            # loading made sure that a record and its rate are there
            assert entry.record is not None
            assert entry.sample_rate_hz is not None
            record = read_sweep_record(folder / entry.record, nodes, entry.sample_rate_hz)
            parts = [one for one in (record.acceleration, record.holder, record.sound) if one]
            try:
                tracked = tracked_sweep(record.tacho, parts)
            except InputError as error:
                raise InputError(f"{folder / entry.record}: {error}") from None
            acceleration, *rest = tracked.spectra
            holder = rest.pop(0) if record.holder else None
            sound = rest.pop(0) if record.sound else None
            floor = np.maximum(tracked.noise[0], np.finfo(float).tiny)
        return OperatingSweep(
            name=entry.name,
            hoses=HoseState(entry.hoses),
            pressure=_BAR * entry.pressure_bar,
            acceleration=acceleration,
            deviation=np.hypot(stated.relative * np.abs(acceleration.values), floor),
            holder=holder,
            sound=sound,
        )
    except InputError as error:
        raise InputError(f"sweep '{entry.name}': {error}") from None


def _hoses(file: OperatingTestFile) -> tuple[HoseDrawing, ...]:
    return tuple(
        HoseDrawing(
            name=hose.name,
            position=np.array(hose.position_m),
            direction=np.array(hose.direction),
            length=hose.length_m,
            tension=hose.tension_n,
            torsion=hose.torsion_n_m2,
            bending=hose.bending_n_m2,
            line_mass=hose.line_mass_kg_per_m,
            loss_factor=hose.loss_factor,
            torsion_radius=hose.torsion_radius_m,
        )
        for hose in file.hoses
    )


def _check_sensors(
    table: Path, sensors: tuple[PlacedSensor, ...], test: InertanceTest, which: str = _HAMMER
) -> None:
    """Refuse sensors that were moved, turned, added or left out between the tests."""
    there = tuple(sensor.sensor for sensor in sensors)
    struck = tuple(sensor.name for sensor in test.sensors)
    if there != struck:
        raise InputError(
            f"{table}: the sensors {', '.join(there)} are not those of {which}, "
            f"{', '.join(struck)}, in their order: leave the sensors where they were struck"
        )
    for placed, sensor in zip(sensors, test.sensors, strict=True):
        off = float(np.abs(np.array(placed.position) - sensor.position).max())
        turned = _largest_turn(rotation_matrix(placed.angles), sensor.orientation)
        if off > SAME_PLACE or turned > SAME_ANGLE:
            raise InputError(
                f"{table}: sensor {placed.sensor} stands {1e3 * off:.3g} mm and "
                f"{np.rad2deg(turned):.3g}° from where it stood in {which}: errors of placement no "
                "longer cancel; strike again with the sensors as they are, or correct the sheet"
            )


def _check_impacts(folder: Path, test: InertanceTest, hammer: InertanceTest) -> None:
    # other names are refused with the operating test itself
    for impact, other in zip(test.impacts, hammer.impacts, strict=False):
        off = np.abs([impact.position - other.position, impact.direction - other.direction])
        if impact.name == other.name and off.max() > SAME_PLACE:
            raise InputError(
                f"{folder}: {impact.name} has another place or direction than in {_HAMMER}: strike "
                "the same points with hoses and without, or correct the sheet"
            )


def _largest_turn(one: RealArray, other: RealArray) -> float:
    """Angle between two orientations [rad]."""
    # ‖A − B‖ = 2√2 sin(θ/2), which is exact for small angles where the trace is not
    half = min(float(np.linalg.norm(one - other)) / np.sqrt(8), 1.0)
    return float(2 * np.arcsin(half))
