"""Noise transfer functions of one vehicle, acquired with a hammer and with a loudspeaker."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.body import Body, Cabin
from deboom.bench.ears import EARS, panel_pressure, source_motion
from deboom.bench.frozen import freeze_arrays
from deboom.bench.interfaces import point_receptance, point_shapes
from deboom.bench.parameters import VirtualBench
from deboom.bench.vehicle_layout import (
    body_sensor_places,
    impact_places,
    impact_rows,
    orientations,
    sensor_rows,
)
from deboom.physics.rigid_body import rotation_matrix


@dataclass(frozen=True)
class AcquisitionErrors:
    """Standard deviations of every error of both methods; judgement, after data sheets.

    Parameters
    ----------
    microphone_db : float
        Calibration of each microphone [dB].
    source_db : float
        Volume acceleration of the loudspeaker, drawn once per ear: it is set up anew [dB].
    hammer_gain, accelerometer_gain : float
        Of the hammer, and of each accelerometer channel [1].
    impact_position, sensor_position : float
        Of a blow, and of an accelerometer, against the position sheet, per axis [m].
    impact_angle, sensor_angle : float
        [rad].
    relative : float
        Noise left after averaging, of the function itself [1].
    pressure_floor : float
        Of pressure per force, real and imaginary part [Pa/N].
    acceleration_floor : float
        Of acceleration per volume acceleration, real and imaginary part [1/m²].
    accelerance_floor : float
        Of acceleration per force, real and imaginary part [m/s² per N].
    """

    microphone_db: float = 0.2
    source_db: float = 0.5
    hammer_gain: float = 0.01
    accelerometer_gain: float = 0.01
    impact_position: float = 0.003
    sensor_position: float = 0.002
    impact_angle: float = float(np.deg2rad(2.0))
    sensor_angle: float = float(np.deg2rad(1.0))
    relative: float = 0.01
    pressure_floor: float = 2e-5
    acceleration_floor: float = 2e-5
    accelerance_floor: float = 1e-4


NO_ACQUISITION_ERRORS = AcquisitionErrors(*[0.0] * 12)
"""Everything exact, for verification."""


@dataclass(frozen=True, eq=False)
class Setup:
    """How the vehicle is truly instrumented, and how its hammer and loudspeaker err.

    Parameters
    ----------
    impact_rows : tuple of array, shape (n_impact, 6)
        Per interface: what each blow truly pushes.
    sensor_rows : tuple of array, shape (n_channel, 6)
        Per interface: what each channel truly sees, gain included.
    microphone : array, shape (n_ear,)
        Gain [1].
    source : array, shape (n_ear,)
        True volume acceleration per stated one [1].
    hammer : float
        Gain [1].
    """

    impact_rows: tuple[RealArray, ...]
    sensor_rows: tuple[RealArray, ...]
    microphone: RealArray
    source: RealArray
    hammer: float

    def __post_init__(self) -> None:
        freeze_arrays(self)


def draw_setup(
    bench: VirtualBench, errors: AcquisitionErrors, generator: np.random.Generator
) -> Setup:
    """Instrument a vehicle: nominal places, with the errors of those who put the sensors there."""
    impacts, sensors = impact_places(bench), body_sensor_places(bench)
    nominal = orientations(sensors)
    blows = np.array([place.position for place in impacts])
    blows = blows + generator.normal(0, errors.impact_position, blows.shape)
    tilt = rotation_matrix(generator.normal(0, errors.impact_angle, blows.shape))
    pushes = np.einsum("cab,cb->ca", tilt, np.array([place.vector for place in impacts]))
    seats = np.array([place.position for place in sensors])
    seats = seats + generator.normal(0, errors.sensor_position, seats.shape)
    turn = rotation_matrix(generator.normal(0, errors.sensor_angle, seats.shape))
    gains = 1 + generator.normal(0, errors.accelerometer_gain, (len(sensors), 3))
    seen = sensor_rows(bench, seats, turn @ nominal)
    by_interface = gains.reshape(len(seen), -1)
    return Setup(
        impact_rows=impact_rows(bench, blows, pushes),
        sensor_rows=tuple(
            gain[:, None] * rows for gain, rows in zip(by_interface, seen, strict=True)
        ),
        microphone=10 ** (generator.normal(0, errors.microphone_db, len(EARS)) / 20),
        source=10 ** (generator.normal(0, errors.source_db, len(EARS)) / 20),
        hammer=1 + float(generator.normal(0, errors.hammer_gain)),
    )


def struck_pressure(setup: Setup, body: Body, cabin: Cabin, frequency: RealArray) -> ComplexArray:
    """Return the pressure at the ears per force of every blow, as stated, without noise.

    Returns
    -------
    array, shape (f, n_ear, n_impact)
        With the gains of microphones and hammer [Pa/N].
    """
    pushed = np.hstack([point_shapes(body, rows, k) for k, rows in enumerate(setup.impact_rows)])
    per_mode = panel_pressure(cabin, frequency) @ body.shapes_at_panels.T
    pressure = (per_mode * body.modal_receptance(frequency)[:, None, :]) @ pushed
    return np.asarray(setup.microphone[:, None] * pressure / setup.hammer)


def strike(
    setup: Setup,
    body: Body,
    cabin: Cabin,
    frequency: RealArray,
    errors: AcquisitionErrors,
    generator: np.random.Generator,
) -> tuple[ComplexArray, ComplexArray]:
    """Acquire with the hammer: pressure at the ears, acceleration on the body.

    Parameters
    ----------
    setup : Setup
        Of this vehicle.
    body, cabin
        The trimmed body without its powertrain, and its air.
    frequency : array, shape (f,)
        [Hz].
    errors : AcquisitionErrors
        The noise in them; the rest is in the setup.
    generator : Generator
        Draws the noise.

    Returns
    -------
    pressure : array, shape (f, n_ear, n_impact)
        [Pa/N].
    acceleration : array, shape (f, n_channel, n_impact)
        In sensor axes [m/s² per N].
    """
    receptance = point_receptance(body, frequency, setup.sensor_rows, setup.impact_rows)
    acceleration = -((2 * np.pi * frequency) ** 2)[:, None, None] * receptance
    return (
        _noisy(
            struck_pressure(setup, body, cabin, frequency),
            errors.relative,
            errors.pressure_floor,
            generator,
        ),
        _noisy(acceleration / setup.hammer, errors.relative, errors.accelerance_floor, generator),
    )


def breathe(
    setup: Setup,
    body: Body,
    cabin: Cabin,
    frequency: RealArray,
    errors: AcquisitionErrors,
    generator: np.random.Generator,
) -> ComplexArray:
    """Acquire with the loudspeaker at each ear in turn: acceleration per volume acceleration.

    Returns
    -------
    array, shape (f, n_channel, n_ear)
        In sensor axes [m/s² per m³/s²].

    Notes
    -----
    Acceleration per volume acceleration equals displacement per volume displacement.
    """
    motion = source_motion(body, cabin, frequency)
    seen = np.concatenate(
        [np.einsum("ca,fae->fce", rows, motion[:, k]) for k, rows in enumerate(setup.sensor_rows)],
        axis=1,
    )
    return _noisy(setup.source * seen, errors.relative, errors.acceleration_floor, generator)


def _noisy(
    exact: ComplexArray, relative: float, floor: float, generator: np.random.Generator
) -> ComplexArray:
    shape = (2, *exact.shape)
    own, flat = ((g[0] + 1j * g[1]) for g in (generator.normal(size=shape) for _ in range(2)))
    return np.asarray(exact * (1 + relative * own / np.sqrt(2)) + floor * flat)
