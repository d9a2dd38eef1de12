"""A hammer test of a rigid body on soft mounts, with known truth and at most one fault.

Written with cross products instead of deboom's forward matrices, so that truth and evaluation share
no formula. Lengths of an electric compressor: 0.22 m x 0.13 m x 0.13 m, 7 kg.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from deboom.measurement.channels import Frf
from deboom.measurement.culprit import Fault
from deboom.measurement.sensors import SENSOR_AXES, Impact, Sensor, SensorKind, Tolerances
from deboom.physics.rigid_body import mass_matrix, mount_stiffness_matrix

HALF_SIZE = np.array([0.11, 0.065, 0.065])
EXACT = Tolerances(sensor_position=0.0, sensor_angle=0.0, sensor_gain=0.0, sensor_cross_axis=0.0)
"""A position sheet without errors: nothing but noise may disagree."""
CAREFUL = Tolerances(
    sensor_position=1e-3, sensor_angle=np.deg2rad(1.0), sensor_gain=0.01, sensor_cross_axis=0.0
)
"""1 mm, 1° and 1 %: what a careful laboratory reaches on a body of this size."""
OFFSET = 0.01


@dataclass(frozen=True, eq=False)
class HammerTest:
    """Position sheet and truth."""

    sensors: tuple[Sensor, ...]
    impacts: tuple[Impact, ...]
    frequency: np.ndarray
    inertance: np.ndarray
    """At the origin, shape (n_frequency, 6, 6) [m/s² and rad/s² per N and N m]."""


@dataclass(frozen=True, eq=False)
class InjectedFault:
    """What is wrong with one sensor."""

    kind: Fault
    sensor: str
    channels: tuple[str, ...]
    offset: np.ndarray


def draw_hammer_test(
    generator: np.random.Generator, n_sensor: int = 6, n_impact: int = 18
) -> HammerTest:
    """Sensors and impacts at random places on the surface, all motions well determined."""
    frequency = np.arange(10.0, 151.0, 4.0)
    while True:
        places = [_on_surface(generator) for _ in range(n_sensor)]
        if _spread([np.eye(3)] * n_sensor, [r for r, _ in places]) < 5:
            break
    while True:
        hits = [_on_surface(generator) for _ in range(n_impact)]
        if _spread([d[np.newaxis] for _, d in hits], [r for r, _ in hits]) < 8:
            break
    turns = Rotation.random(n_sensor, random_state=generator).as_matrix()
    return HammerTest(
        sensors=tuple(
            Sensor(f"A{k + 1}", SensorKind.ACCELEROMETER, "356A", "", "", r, turn)
            for k, ((r, _), turn) in enumerate(zip(places, turns, strict=True))
        ),
        impacts=tuple(Impact(f"I{k + 1:02d}", r, d) for k, (r, d) in enumerate(hits)),
        frequency=frequency,
        inertance=_inertance(generator, frequency),
    )


def draw_fault(test: HammerTest, kind: Fault, generator: np.random.Generator) -> InjectedFault:
    """One reversed channel, two swapped axes of one sensor, or one sensor 10 mm off."""
    sensor = test.sensors[generator.integers(len(test.sensors))]
    direction = generator.normal(size=3)
    count = {Fault.SIGN: 1, Fault.AXES: 2, Fault.OFFSET: 3}[kind]
    axes = sorted(generator.permutation(3)[:count])
    return InjectedFault(
        kind,
        sensor.name,
        tuple(sensor.channels[axis] for axis in axes),
        OFFSET * direction / np.linalg.norm(direction),
    )


def measure(
    test: HammerTest,
    generator: np.random.Generator,
    *,
    fault: InjectedFault | None = None,
    noise: float = 0.01,
    errors: Tolerances = EXACT,
) -> Frf:
    """Frequency response functions with noise relative to each of them, and with the fault."""
    push = np.array([np.r_[i.direction, np.cross(i.position, i.direction)] for i in test.impacts])
    body = np.einsum("fab,ib->fia", test.inertance, push)
    shown = [_readings(sensor, body, generator, fault, errors) for sensor in test.sensors]
    values = np.concatenate(np.moveaxis(shown, -1, -2), axis=1)
    scatter = generator.normal(size=(2, *values.shape)) / np.sqrt(2)
    values = values * (1 + noise * (scatter[0] + 1j * scatter[1]))
    return Frf(
        test.frequency,
        values,
        tuple(channel for sensor in test.sensors for channel in sensor.channels),
        tuple(impact.name for impact in test.impacts),
        "m/s^2/N",
    )


def _readings(
    sensor: Sensor,
    body: np.ndarray,
    generator: np.random.Generator,
    fault: InjectedFault | None,
    errors: Tolerances,
) -> np.ndarray:
    """Return what one sensor shows of the motion (…, n_impact, 6), shape (…, n_impact, 3)."""
    placed = sensor.position + generator.normal(0, errors.sensor_position, 3)
    turned = (
        sensor.orientation
        @ Rotation.from_rotvec(generator.normal(0, errors.sensor_angle, 3)).as_matrix()
    )
    gain = 1 + generator.normal(0, errors.sensor_gain, 3)
    faulty = fault is not None and fault.sensor == sensor.name
    if faulty and fault.kind is Fault.OFFSET:
        placed = placed + fault.offset
    here = body[..., :3] + np.cross(body[..., 3:], placed)
    shown = gain * (here @ turned)
    if faulty and fault.kind is not Fault.OFFSET:
        axes = [SENSOR_AXES.index(channel.split()[-1]) for channel in fault.channels]
        shown[..., axes] = -shown[..., axes] if fault.kind is Fault.SIGN else shown[..., axes[::-1]]
    return shown


def _on_surface(generator: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return a point on the surface and the direction into the body."""
    axis, side = generator.integers(3), generator.choice([-1.0, 1.0])
    point = generator.uniform(-0.9, 0.9, 3) * HALF_SIZE
    point[axis] = side * HALF_SIZE[axis]
    return point, -side * np.eye(3)[axis]


def _spread(directions, points) -> float:
    """Condition number of the rows [d, r × d], rotations counted at 0.1 m."""
    rows = [
        np.r_[d, np.cross(r, d) / 0.1] for ds, r in zip(directions, points, strict=True) for d in ds
    ]
    return float(np.linalg.cond(np.array(rows)))


def _inertance(generator: np.random.Generator, frequency: np.ndarray) -> np.ndarray:
    mass = 7.2 * generator.uniform(0.9, 1.1)
    inertia = np.diag([0.0158, 0.0291, 0.0302]) * generator.uniform(0.9, 1.1)
    centre = generator.uniform(-3e-3, 3e-3, 3)
    drawn = [(generator.uniform(-0.1, 0.1, 3), generator.uniform(1e4, 3e4, 3)) for _ in range(3)]
    stiffness = mount_stiffness_matrix(*map(np.array, zip(*drawn, strict=True)))
    squared = (2 * np.pi * frequency) ** 2
    return np.linalg.inv(
        mass_matrix(mass, inertia, centre) - (1 + 0.15j) * stiffness / squared[:, None, None]
    )
