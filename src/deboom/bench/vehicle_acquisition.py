"""Noise transfer functions of one vehicle, acquired with a hammer and with a loudspeaker."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from deboom.arrays import ComplexArray, RealArray, checked
from deboom.bench.fleet import Body, Cabin
from deboom.bench.interfaces import (
    EARS,
    panel_pressure,
    point_receptance,
    point_shapes,
    source_motion,
)
from deboom.bench.layout import FIRST_EAR_NODE, Place, Point, points
from deboom.bench.powertrain import AXES, VirtualBench
from deboom.bench.signals import complex_normal
from deboom.bench.writing import triple
from deboom.errors import InputError
from deboom.files.hammer_test import HammerSheet, write_hammer_test
from deboom.files.rows import HammerChannel, HammerPoint
from deboom.files.tables import parse_unit
from deboom.physics.rigid_body import forward_matrices, rotation_matrix

FIRST_IMPACT_NODE, FIRST_BODY_SENSOR_NODE = 301, 401
EAR_NODES = {ear: FIRST_EAR_NODE + number for number, ear in enumerate(EARS)}
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


@checked(position="3")
class ImpactPlace:
    """One blow of the hammer, such as ``I3 y``, around a virtual point.

    A positive force has a direction, such as ``-y``; the position (3,) counts from the powertrain's
    centre of gravity [m].
    """

    name: str
    point: Point
    node: int
    direction: str
    position: RealArray

    @property
    def vector(self) -> RealArray:
        """Unit vector along `direction`."""
        sign = -1.0 if self.direction.startswith("-") else 1.0
        return np.array([sign * (axis == self.direction[1:]) for axis in AXES])


def impact_places(bench: VirtualBench) -> tuple[ImpactPlace, ...]:
    """Return nine blows per interface: three points, three directions."""
    struck = [
        (point, offset, pushes)
        for point in points(bench)
        for offset, pushes in zip(IMPACT_OFFSETS, PUSHES, strict=True)
    ]
    return tuple(
        ImpactPlace(
            name=f"I{number + 1} {axis}",
            point=point,
            node=FIRST_IMPACT_NODE + number,
            direction=f"{'+' if push > 0 else '-'}{axis}",
            position=point.position + np.array(offset),
        )
        for number, (point, offset, pushes) in enumerate(struck)
        for axis, push in zip(AXES, pushes, strict=True)
    )


def body_sensor_places(bench: VirtualBench) -> tuple[Place, ...]:
    """Return three triaxial accelerometers per interface, on the body."""
    glued = [
        (point, offset, angles)
        for point in points(bench)
        for offset, angles in zip(BODY_SENSOR_OFFSETS, BODY_SENSOR_ANGLES, strict=True)
    ]
    return tuple(
        Place(
            f"B{number + 1}",
            point,
            FIRST_BODY_SENSOR_NODE + number,
            point.position + np.array(offset),
            angles,
        )
        for number, (point, offset, angles) in enumerate(glued)
    )


def impact_rows(
    bench: VirtualBench, positions: RealArray, directions: RealArray
) -> tuple[RealArray, ...]:
    """Return per interface what the given blows push: rows ``dᵀ V``, shape (9, 6) each."""
    forward = forward_matrices(_levers(bench, positions)).reshape(-1, 3, 6)
    rows = np.einsum("ca,cab->cb", directions, forward)
    return tuple(rows.reshape(len(points(bench)), -1, 6))


def sensor_rows(
    bench: VirtualBench, positions: RealArray, orientations: RealArray
) -> tuple[RealArray, ...]:
    """Return per interface what the given accelerometers see: rows ``Rᵀ V``, shape (9, 6) each."""
    rows = forward_matrices(_levers(bench, positions), orientations)
    return tuple(rows.reshape(len(points(bench)), -1, 6))


def _levers(bench: VirtualBench, positions: RealArray) -> RealArray:
    """Return positions from the virtual point of their interface, shape (n, 3) [m]."""
    virtual_points = np.array([point.position for point in points(bench)])
    levers = positions.reshape(len(virtual_points), -1, 3) - virtual_points[:, None]
    return np.asarray(levers.reshape(-1, 3))


def orientations(places: tuple[Place, ...]) -> RealArray:
    """Return the rotation of each sensor, columns are its axes, shape (n, 3, 3)."""
    return rotation_matrix(np.deg2rad([place.angles for place in places]))


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


@checked(microphone="ear", source="ear")
class Setup:
    """How the vehicle is truly instrumented, and how its hammer and loudspeaker err.

    - `impact_rows` (n_impact, 6): true load of each blow, per interface.
    - `sensor_rows` (n_channel, 6): true answer of each channel, gain included, per interface.
    - `microphone`, `source` (n_ear,): gain of the microphones, and true volume acceleration per
      stated one [1].
    - `hammer`: gain [1].
    """

    impact_rows: tuple[RealArray, ...]
    sensor_rows: tuple[RealArray, ...]
    microphone: RealArray
    source: RealArray
    hammer: float


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
    """Return the pressure at the ears per stated force of every blow, without noise.

    With the gains of microphones and hammer, shape (f, n_ear, n_impact) [Pa/N].
    """
    per_mode = panel_pressure(cabin, frequency) @ body.shapes_at_panels.T
    modal = per_mode * body.modal_receptance(frequency)[:, None, :]
    pressure = modal @ point_shapes(body, setup.impact_rows)
    return np.asarray(setup.microphone[:, None] * pressure / setup.hammer)


def strike(
    setup: Setup,
    body: Body,
    cabin: Cabin,
    frequency: RealArray,
    errors: AcquisitionErrors,
    generator: np.random.Generator,
) -> tuple[ComplexArray, ComplexArray]:
    """Acquire with the hammer on the trimmed body without its powertrain.

    Pressure at the ears (f, n_ear, n_impact) [Pa/N], and acceleration on the body in sensor axes
    (f, n_channel, n_impact) [m/s² per N].
    """
    receptance = point_receptance(body, frequency, setup.sensor_rows, setup.impact_rows)
    acceleration = -((2 * np.pi * frequency) ** 2)[:, None, None] * receptance / setup.hammer
    pressure = struck_pressure(setup, body, cabin, frequency)
    return (
        _noisy(pressure, errors.relative, errors.pressure_floor, generator),
        _noisy(acceleration, errors.relative, errors.accelerance_floor, generator),
    )


def breathe(
    setup: Setup,
    body: Body,
    cabin: Cabin,
    frequency: RealArray,
    errors: AcquisitionErrors,
    generator: np.random.Generator,
) -> ComplexArray:
    """Acquire with the loudspeaker at each ear in turn, (f, n_channel, n_ear) [m/s² per m³/s²].

    Acceleration per volume acceleration equals displacement per volume displacement.
    """
    motion = source_motion(body, cabin, frequency)
    seen = np.concatenate(
        [np.einsum("ca,fae->fce", rows, motion[:, k]) for k, rows in enumerate(setup.sensor_rows)],
        axis=1,
    )
    return _noisy(setup.source * seen, errors.relative, errors.acceleration_floor, generator)


def listen_at_panels(
    setup: Setup,
    body: Body,
    cabin: Cabin,
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
    raised = panel_pressure(cabin, frequency)
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


@dataclass(frozen=True)
class BlowPlan:
    """How the hammer strikes and how it is recorded.

    - `hits`: hits per blow of the position sheet.
    - `rate`, `duration`, `pretrigger`: rate [Hz] and duration of a block, whose inverse is the
      spacing of the lines, pretrigger [s].
    - `contact`, `lightest`, `hardest`: half sine of the tip [s], with peak forces even between the
      last two [N].
    - `force_noise`, `pressure_noise`: standard deviation per sample [N], [Pa].
    """

    hits: int = 5
    rate: float = 512.0
    duration: float = 4.0
    pretrigger: float = 0.25
    contact: float = 8e-3
    lightest: float = 150.0
    hardest: float = 400.0
    force_noise: float = 0.05
    pressure_noise: float = 2e-3


def blows(
    setup: Setup,
    body: Body,
    cabin: Cabin,
    columns: list[int],
    plan: BlowPlan,
    generator: np.random.Generator,
) -> tuple[RealArray, RealArray]:
    """Record the blows of some columns of `impact_places` over time.

    Force that the hammer states (n_blow, n_hit, n_sample) [N], and pressure that the microphones
    state (n_blow, n_hit, n_sample, n_ear) [Pa].

    The answer is the inverse Fourier transform of function times spectrum of the push: exact for
    the sampled push, since a block of some seconds outlasts every mode.
    """
    n_sample = round(plan.rate * plan.duration)
    time = np.arange(n_sample) / plan.rate
    shape = (len(columns), plan.hits)
    begin = plan.pretrigger + generator.uniform(0, 1 / plan.rate, shape)
    peak = generator.uniform(plan.lightest, plan.hardest, shape)
    since = (time - begin[..., None]) / plan.contact
    push = peak[..., None] * np.sin(np.pi * since) * ((since >= 0) & (since <= 1))
    frequency = np.asarray(np.fft.rfftfreq(n_sample, 1 / plan.rate), dtype=np.float64)
    function = struck_pressure(setup, body, cabin, frequency)[:, :, columns]
    spectrum = np.fft.rfft(push)
    answer = np.fft.irfft(np.einsum("fec,chf->chfe", function, spectrum), n_sample, axis=2)
    answer = answer * setup.hammer  # the function is per stated force, the push is the true one
    force = setup.hammer * push + generator.normal(0, plan.force_noise, push.shape)
    return force, answer + generator.normal(0, plan.pressure_noise, answer.shape)


def write_blows(
    folder: Path,
    bench: VirtualBench,
    setup: Setup,
    body: Body,
    cabin: Cabin,
    point: str,
    generator: np.random.Generator,
    plan: BlowPlan,
) -> None:
    """Write the blows around one mount or piece, such as ``Du left``, as a hammer test.

    A point that does not exist is refused.
    """
    columns = [k for k, place in enumerate(impact_places(bench)) if place.point.name == point]
    if not columns:
        known = ", ".join(place.name for place in points(bench))
        raise InputError(f"no mount or piece '{point}' to strike: use {known}")
    force, pressure = blows(setup, body, cabin, columns, plan, generator)
    struck = [impact_places(bench)[column] for column in columns]
    sheet = HammerSheet(
        title=f"hammer around {point}, pressure at the ears",
        rate=plan.rate,
        pretrigger=plan.pretrigger,
        points=tuple(
            HammerPoint(
                impact=place.name,
                node=place.node,
                file=f"hits/{place.name.replace(' ', '')}.uff",
                position=triple(place.position, 4),
                direction=triple(place.vector, 4),
            )
            for place in struck
        ),
        channels=tuple(
            HammerChannel(ear, "pressure", EAR_NODES[ear], "scalar", parse_unit("Pa"))
            for ear in EARS
        ),
    )
    hits = {place.name: (force[k], pressure[k]) for k, place in enumerate(struck)}
    write_hammer_test(folder, sheet, hits)
