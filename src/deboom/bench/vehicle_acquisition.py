"""Noise transfer functions of one vehicle, acquired with a hammer and with a loudspeaker."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import AXES, ComplexArray, RealArray
from deboom.bench import fleet
from deboom.bench.layout import FIRST_EAR_NODE, Place, accelerometer_places, points
from deboom.bench.powertrain import SIDES, VirtualBench
from deboom.bench.signals import complex_normal
from deboom.physics.rigid_body import forward_matrices, rotation_matrix

FIRST_IMPACT_NODE, FIRST_BODY_SENSOR_NODE = 301, 401
EAR_NODES = {ear: FIRST_EAR_NODE + number for number, ear in enumerate(fleet.EARS)}
"""The driver's ear has the node of the first vehicle of a platform; a folder holds one vehicle."""

MICROPHONES = {"driver ear": "MIC2101", "passenger ear": "MIC2102"}
"""Serial numbers: one microphone per ear, the same in all of its functions."""

IMPACT_OFFSETS = ((0.05, 0.02, 0.0), (-0.03, 0.05, 0.02), (-0.02, -0.05, -0.03))
"""Three points around a mount that a hammer reaches, from the virtual point [m]."""

PUSHES = ((1, 1, -1), (-1, 1, -1), (1, -1, 1))
"""To which side each point is hit along x, y and z: the hammer comes from where there is room."""

BODY_SENSOR_OFFSETS = ((0.06, -0.02, 0.01), (-0.04, 0.05, -0.02), (-0.02, -0.06, 0.03))
"""Three triaxial accelerometers on the body around a mount, from the virtual point [m]."""

BODY_SENSOR_ANGLES = ((0.0, 0.0, 0.0), (0.0, 0.0, 90.0), (180.0, 0.0, 0.0))
"""How they are glued on, known: about the fixed axes x, then y, then z [deg]."""


def impact_places(bench: VirtualBench) -> tuple[Place, ...]:
    """Return nine blows per interface: three points, three directions."""
    struck = [
        (point, np.array(offset), pushes)
        for point in points(bench)
        for offset, pushes in zip(IMPACT_OFFSETS, PUSHES, strict=True)
    ]
    return tuple(
        Place(
            f"I{number + 1} {axis}",
            point,
            FIRST_IMPACT_NODE + number,
            offset,
            direction=f"{'+' if push > 0 else '-'}{axis}",
        )
        for number, (point, offset, pushes) in enumerate(struck)
        for axis, push in zip(AXES, pushes, strict=True)
    )


def body_sensor_places(bench: VirtualBench) -> tuple[Place, ...]:
    """Return three triaxial accelerometers per interface, on the body."""
    glued = [
        (point, np.array(offset), angles)
        for point in points(bench)
        for offset, angles in zip(BODY_SENSOR_OFFSETS, BODY_SENSOR_ANGLES, strict=True)
    ]
    return tuple(
        Place(f"B{number + 1}", point, FIRST_BODY_SENSOR_NODE + number, offset, angles)
        for number, (point, offset, angles) in enumerate(glued)
    )


@dataclass(frozen=True)
class AcquisitionErrors:
    """Standard deviations of every error of both methods; judgement, after data sheets.

    - `microphone_db`: calibration of each microphone [dB].
    - `source_db`: volume acceleration of the loudspeaker, drawn once per ear: it is set up anew
      [dB].
    - `hammer_gain`, `accelerometer_gain`: gain of the hammer, and of each accelerometer channel
      [1].
    - `impact_position`, `sensor_position`: place of a blow, and of an accelerometer, against the
      position sheet, per axis [m].
    - `impact_angle`, `sensor_angle`: directions of the same [rad].
    - `relative`: noise left after averaging, of the function itself [1].
    - `pressure_floor`, `acceleration_floor`, `accelerance_floor`: real and imaginary part of
      pressure per force [Pa/N], of acceleration per volume acceleration [1/m²], and of acceleration
      per force [m/s² per N].
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

    - `impact_rows` (n_impact, 6): true load of each blow, per interface.
    - `sensor_rows` (n_channel, 6): true answer of each channel, gain included, per interface.
    - `powertrain_rows` (n_channel, 6), `wheel_rows` (n_side, 3): true answer of each channel above
      the mounts, of the powertrain's motion and of a wheel end's along x.
    - `microphone`, `source` (n_ear,): gain of the microphones, and true volume acceleration per
      stated one [1].
    - `hammer`: gain [1].
    """

    impact_rows: tuple[RealArray, ...]
    sensor_rows: tuple[RealArray, ...]
    powertrain_rows: RealArray
    wheel_rows: RealArray
    microphone: RealArray
    source: RealArray
    hammer: float


def draw_setup(
    bench: VirtualBench, errors: AcquisitionErrors, generator: np.random.Generator
) -> Setup:
    """Instrument a vehicle: nominal places, with the errors of those who put the sensors there."""
    impacts, sensors = impact_places(bench), body_sensor_places(bench)
    n_interface = len(points(bench))
    blows = np.array([place.offset for place in impacts])
    blows = blows + generator.normal(0, errors.impact_position, blows.shape)
    tilt = rotation_matrix(generator.normal(0, errors.impact_angle, blows.shape))
    pushes = np.einsum("cab,cb->ca", tilt, np.array([place.vector for place in impacts]))
    pushed = np.einsum("ca,cab->cb", pushes, forward_matrices(blows).reshape(-1, 3, 6))
    seats = np.array([place.offset for place in sensors])
    seats = seats + generator.normal(0, errors.sensor_position, seats.shape)
    nominal = rotation_matrix(np.deg2rad([place.angles for place in sensors]))
    turn = rotation_matrix(generator.normal(0, errors.sensor_angle, seats.shape))
    gains = 1 + generator.normal(0, errors.accelerometer_gain, (3 * len(sensors), 1))
    seen = gains * forward_matrices(seats, turn @ nominal)
    microphone = 10 ** (generator.normal(0, errors.microphone_db, len(fleet.EARS)) / 20)
    source = 10 ** (generator.normal(0, errors.source_db, len(fleet.EARS)) / 20)
    hammer = 1 + float(generator.normal(0, errors.hammer_gain))
    above = np.array([place.position for place in accelerometer_places(bench)])
    above = above + generator.normal(0, errors.sensor_position, above.shape)
    askew = rotation_matrix(generator.normal(0, errors.sensor_angle, above.shape))
    gains = 1 + generator.normal(0, errors.accelerometer_gain, (3 * len(above), 1))
    moved = (gains * forward_matrices(above, askew)).reshape(len(above), 3, 6)
    return Setup(
        impact_rows=tuple(pushed.reshape(n_interface, -1, 6)),
        sensor_rows=tuple(seen.reshape(n_interface, -1, 6)),
        powertrain_rows=moved[: -len(SIDES)].reshape(-1, 6),
        wheel_rows=moved[-len(SIDES) :, :, 0],
        microphone=microphone,
        source=source,
        hammer=hammer,
    )


def strike(
    setup: Setup,
    body: fleet.Body,
    cabin: fleet.Cabin,
    frequency: RealArray,
    errors: AcquisitionErrors,
    generator: np.random.Generator,
) -> tuple[ComplexArray, ComplexArray]:
    """Acquire with the hammer on the trimmed body without its powertrain.

    Pressure at the ears (f, n_ear, n_impact) [Pa/N], and acceleration on the body in sensor axes
    (f, n_channel, n_impact) [m/s² per N].
    """
    receptance = fleet.point_receptance(body, frequency, setup.sensor_rows, setup.impact_rows)
    acceleration = -((2 * np.pi * frequency) ** 2)[:, None, None] * receptance / setup.hammer
    per_mode = fleet.panel_pressure(cabin, frequency) @ body.shapes_at_panels.T
    modal = per_mode * body.modal_receptance(frequency)[:, None, :]
    pressure = modal @ fleet.point_shapes(body, setup.impact_rows)
    pressure = np.asarray(setup.microphone[:, None] * pressure / setup.hammer)
    return (
        _noisy(pressure, errors.relative, errors.pressure_floor, generator),
        _noisy(acceleration, errors.relative, errors.accelerance_floor, generator),
    )


def breathe(
    setup: Setup,
    body: fleet.Body,
    cabin: fleet.Cabin,
    frequency: RealArray,
    errors: AcquisitionErrors,
    generator: np.random.Generator,
) -> ComplexArray:
    """Acquire with the loudspeaker at each ear in turn, (f, n_channel, n_ear) [m/s² per m³/s²].

    Acceleration per volume acceleration equals displacement per volume displacement.
    """
    motion = fleet.source_motion(body, cabin, frequency)
    seen = np.concatenate(
        [np.einsum("ca,fae->fce", rows, motion[:, k]) for k, rows in enumerate(setup.sensor_rows)],
        axis=1,
    )
    return _noisy(setup.source * seen, errors.relative, errors.acceleration_floor, generator)


def listen_at_panels(
    setup: Setup,
    body: fleet.Body,
    cabin: fleet.Cabin,
    frequency: RealArray,
    errors: AcquisitionErrors,
    generator: np.random.Generator,
) -> tuple[ComplexArray, ComplexArray]:
    """Acquire motion of and pressure at the panels, with the loudspeaker at each ear in turn.

    Acceleration inwards [(m/s²)/(m³/s²)] and pressure [Pa/(m³/s²)] per volume acceleration, both
    (f, n_panel, n_ear).

    The raised pressure pushes every panel outwards, against its shape. A cabin answers alike with
    source and receiver exchanged: what a panel raises at the ear per volume displacement, the ear
    raises at the panel.
    """
    n_panel = cabin.panel_areas.size
    gains = 1 + generator.normal(0, errors.accelerometer_gain, n_panel)
    microphones = 10 ** (generator.normal(0, errors.microphone_db, n_panel) / 20)
    raised = fleet.panel_pressure(cabin, frequency)
    modal = (-raised @ body.shapes_at_panels.T) * body.modal_receptance(frequency)[:, None, :]
    motion = np.swapaxes(modal @ body.shapes_at_panels, 1, 2)
    per_acceleration = -((2 * np.pi * frequency) ** 2)[:, None, None]
    pressure = np.swapaxes(raised / cabin.panel_areas / per_acceleration, 1, 2)

    def averaged(exact: ComplexArray) -> ComplexArray:
        noise = complex_normal(exact.shape, generator) * (1 / np.sqrt(2))
        return np.asarray(exact * (1 + errors.relative * noise))

    return (
        averaged(gains[:, None] * setup.source * motion),
        averaged(microphones[:, None] * setup.source * pressure),
    )


def _noisy(
    exact: ComplexArray, relative: float, floor: float, generator: np.random.Generator
) -> ComplexArray:
    """Add noise that is relative to the function, and a floor."""
    scaled, flat = (complex_normal(exact.shape, generator) for _ in range(2))
    return np.asarray(exact * (1 + relative * scaled / np.sqrt(2)) + floor * flat)
