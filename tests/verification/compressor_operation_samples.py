"""A compressor of the virtual bench that is struck and run in memory, with errors of any size."""

from dataclasses import replace

import numpy as np

from deboom.bench.compressor_rig import (
    PlacementErrors,
    exact_inertance,
    place,
    position_sheet,
    running,
    true_source,
)
from deboom.bench.compressor_truth import CompressorPlan, true_compressor
from deboom.bench.powertrain import read_data
from deboom.measurement import compressor_test
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.sensors import Impact, PlacementTolerances, Sensor, SensorKind
from deboom.physics.rigid_body import rotation_matrix

HAMMER_LINES = np.concatenate([np.arange(10.0, 60.0, 1.0), np.arange(60.0, 151.0, 5.0)])
SPEED_LINES = np.concatenate([np.arange(17.0, 60.0, 1.0), np.arange(60.0, 151.0, 5.0)])
SHEET, SOURCE, TOLERANCES = position_sheet(), true_source(), PlacementTolerances()
STATIC, DYNAMIC, ROTOR = SOURCE.static_unbalance, SOURCE.dynamic_unbalance, SOURCE.rotor_inertia
GAS = np.array([SOURCE.gas_force, SOURCE.gas_moment, SOURCE.rotating_gas_force])
LOW, HIGH = 7.5e5, 13.5e5
GAS_FACTOR = {LOW: 1.0, HIGH: 1.6}
AVERAGES = 5
FLOOR, SHARE = 4e-4, 3e-3
"""Of the accelerometers [m/s²], and from run to run [1]."""


def drawing():
    """Mounts as the drawing has them: no sample's."""
    drawn = read_data("compressor.json")["start_table10"]
    stiffness = drawn["mount_static_stiffness_N_per_m_axial_radial1_radial2"]
    mounts = tuple(
        compressor_test.CompressorMount(f"M{i + 1}", *map(np.array, values))
        for i, values in enumerate(
            zip(
                drawn["mount_position_m"],
                np.deg2rad(drawn["mount_rotation_deg"]),
                np.broadcast_to(stiffness, (3, 3)),
                strict=True,
            )
        )
    )
    return compressor_test.Drawing(
        drawn["mass_kg"], np.zeros(3), np.diag([0.015, 0.03, 0.029]), mounts
    )


SENSORS = tuple(
    Sensor(
        row.sensor,
        SensorKind.ACCELEROMETER,
        "",
        "",
        "",
        np.array(row.position),
        rotation_matrix(np.array(row.angles)),
    )
    for row in SHEET.sensors
)
IMPACTS = tuple(
    Impact(row.impact, np.array(row.position), np.array(row.direction)) for row in SHEET.impacts
)


def complex_noise(rng, shape):
    return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)


def sample(
    seed,
    *,
    errors=1.0,
    noise=1.0,
    lines=SPEED_LINES,
    drawn=False,
    storage=1.0,
    loss=1.0,
    each_mount=(1.0, 1.0, 1.0),
    softening=False,
    receiver=False,
    hoses=(),
    sense=1,
):
    """Test, and the compressor behind it as it runs; `errors` times the tolerances.

    `noise` times a laboratory's; `drawn`: the test brings a drawing of the mounts; `storage`,
    `loss`: of the running mounts over those struck; `each_mount`: of each besides; `hoses` are
    joined where it is said they are not.
    """
    rng = np.random.default_rng(seed)
    struck = true_compressor(CompressorPlan(flexible_receiver=receiver), rng)
    stated = (
        TOLERANCES.sensor_gain,
        TOLERANCES.sensor_position,
        TOLERANCES.sensor_angle,
        TOLERANCES.hammer_gain,
    )
    placed = place(SHEET, PlacementErrors(*(errors * np.array(stated))), rng)
    exact = exact_inertance(struck, placed, HAMMER_LINES, np.ones((len(SHEET.impacts), 3)))
    sigma = noise * 1e-3 * np.sqrt(1 + (20 / HAMMER_LINES) ** 2)[:, None, None]
    values = exact + sigma * complex_noise(rng, exact.shape)
    ratio = 2 * (AVERAGES - 1) * np.maximum(sigma, 1e-9) ** 2 / np.abs(values) ** 2
    channels = tuple(name for sensor in SENSORS for name in sensor.channels)
    test = compressor_test.InertanceTest(
        "sample",
        SENSORS,
        IMPACTS,
        Frf(HAMMER_LINES, values, channels, tuple(i.name for i in IMPACTS), "(m/s^2)/N"),
        1 / (1 + ratio),
        AVERAGES,
        TOLERANCES,
        struck.mass * (1 + 1e-3 * noise * rng.standard_normal()),
        1e-3 * struck.mass,
        drawing() if drawn else None,
    )
    # a hyperbola times a factor is one again
    factors = np.array([[storage, 1 / storage, 1 / storage], [loss, 1 / loss, 1 / loss]]).ravel()
    law = true_compressor(CompressorPlan(softening=True), np.random.default_rng(1)).softening
    body = replace(
        struck,
        stiffness=np.array(each_mount)[:, np.newaxis] * struck.stiffness,
        gain=struck.gain * factors,
        hoses=hoses,
        softening=law if softening else None,
    )
    sweeps = []
    for pressure, factor in GAS_FACTOR.items():
        motion = running(body, true_source(sense), lines, factor).displacement
        seen = -((2 * np.pi * lines[:, None]) ** 2) * motion @ placed.response_rows().T
        floor = FLOOR * np.sqrt(1 + (20 / lines) ** 2)[:, None]
        deviation = np.sqrt((SHARE * np.abs(seen)) ** 2 + floor**2)
        measured = seen + noise * deviation * complex_noise(rng, seen.shape)
        sweeps.append(
            compressor_test.OperatingSweep(
                f"soft {pressure / 1e5:g} bar",
                compressor_test.HoseState.SOFT,
                pressure,
                Spectrum(lines, measured, channels, "m/s^2"),
                max(noise, 1e-6) * deviation,
            )
        )
    return compressor_test.OperatingTest("sample", test, None, tuple(sweeps), ROTOR), body


def passing_as_unbalance(lines, factor):
    """Add to the static unbalance what the rotating gas force passes off as one."""
    return STATIC + factor * GAS[2] / (2 * np.pi * lines) ** 2
