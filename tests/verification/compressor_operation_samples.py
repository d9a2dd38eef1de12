"""A compressor that is struck and run in memory; shares no equation with the code under test."""

from dataclasses import dataclass

import numpy as np

from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.compressor_test import (
    CompressorMount,
    Drawing,
    HoseState,
    InertanceTest,
    OperatingSweep,
    OperatingTest,
)
from deboom.measurement.sensors import Impact, PlacementTolerances, Sensor, SensorKind

HAMMER_LINES = np.concatenate([np.arange(10.0, 60.0, 1.0), np.arange(60.0, 151.0, 5.0)])
SPEED_LINES = np.concatenate([np.arange(17.0, 60.0, 1.0), np.arange(60.0, 151.0, 5.0)])
STATIC = 20e-6 * np.exp(1j * np.deg2rad(40))
DYNAMIC = 1200e-9 * np.exp(-1j * np.deg2rad(60))
GAS = np.array([0.5 * np.exp(0.7j), 0.08 * np.exp(-1.1j), 0.05 * np.exp(2j)])
ROTOR = 1.5e-4
AVERAGES = 5
LOW, HIGH = 7.5e5, 13.5e5
GAS_FACTOR = {LOW: 1.0, HIGH: 1.6}
FLOOR, SHARE = 4e-4, 3e-3
PLACES = np.array([[-143.41, 0.1, 8.16], [-14.83, -67.94, 76.49], [-14.84, 67.09, 76.49]])
ANGLES = np.array([[0, 0, 180], [0, 45, 90], [0, 135, 90.0]])


def cross(r):
    x, y, z = r
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0.0]])


def turn(angles):
    """R_z R_y R_x of three angles [rad]."""
    result = np.eye(3)
    for axis, angle in enumerate(angles):
        i, k = (axis + 1) % 3, (axis + 2) % 3
        one = np.eye(3)
        one[i, i] = one[k, k] = np.cos(angle)
        one[k, i] = np.sin(angle)
        one[i, k] = -np.sin(angle)
        result = one @ result
    return result


def rows_at(r):
    return np.hstack([np.eye(3), cross(r).T])


@dataclass
class Body:
    """Mass, mounts, rubber; what happens in operation; what carries it."""

    mass: float
    centre: np.ndarray
    inertia: np.ndarray
    places: np.ndarray
    angles: np.ndarray
    stiffness: np.ndarray
    gain: np.ndarray
    storage: float = 1.0
    loss: float = 1.0
    softening: float = 0.0
    receiver: bool = False
    hose: float = 0.0
    sense: int = 1

    @classmethod
    def drawn(cls, rng, **options):
        """Draw one around the thesis's table 10."""
        inertia = np.diag(np.array([0.015, 0.03, 0.029]) * (1 + 0.05 * rng.uniform(-1, 1, 3)))
        for i, k in ((0, 1), (0, 2), (1, 2)):
            inertia[i, k] = inertia[k, i] = 2.5e-4 * rng.uniform(-1, 1)
        return cls(
            6.8 + 0.45 * rng.uniform(-1, 1),
            2.5e-3 * rng.uniform(-1, 1, 3),
            inertia,
            1e-3 * (PLACES + 8 * rng.uniform(-1, 1, (3, 3))),
            np.deg2rad(ANGLES + 4 * rng.uniform(-1, 1, (3, 3))),
            1e3 * np.array([23, 13, 13]) * (1 + 0.15 * rng.uniform(-1, 1, (3, 3))),
            np.array([1.85, 0.06, 2.2, 0.42, 0.15, 2.5]) * (1 + 0.08 * rng.uniform(-1, 1, 6)),
            **options,
        )

    def mass_matrix(self):
        """At the virtual point."""
        c = cross(self.centre)
        return np.block(
            [
                [self.mass * np.eye(3), self.mass * c.T],
                [self.mass * c, self.inertia + self.mass * c @ c.T],
            ]
        )

    def rubber(self, f, running):
        """Gain over frequency, as struck or as run."""
        real = self.gain[0] - 1 / (self.gain[1] * f + self.gain[2])
        imaginary = self.gain[3] - 1 / (self.gain[4] * f + self.gain[5])
        return (
            (self.storage * real + 1j * self.loss * imaginary) if running else real + 1j * imaginary
        )

    def softened(self, amplitude):
        """Factor of a mount; 1 at the amplitude of a hit."""
        return 1 + self.softening * (1 / (1 + amplitude / 30e-6) - 1 / (1 + 200 / 30))

    def stiffness_matrix(self, f, running, amplitudes):
        """At one line, with the amplitudes of the mounts."""
        total = np.zeros((6, 6), complex)
        w = 2 * np.pi * f
        soft = 1 / (1.5e6 * (1 + 0.05j)) + 1 / 8 / ((2 * np.pi * 38) ** 2 * (1 + 0.06j) - w**2)
        for r, angle, k, s in zip(
            self.places, self.angles, self.stiffness, amplitudes, strict=True
        ):
            own = self.rubber(f, running) * k * (self.softened(s) if running else 1)
            if self.receiver:
                own = own / (1 + own * soft)
            axes = turn(angle)
            total += rows_at(r).T @ (axes * own) @ axes.T @ rows_at(r)
        return total

    def hose_matrix(self, f):
        """Apparent mass of two tuned masses on springs at the ports."""
        total = np.zeros((6, 6), complex)
        for r, mass, natural in (
            ((-0.07, 0.035, 0.05), 0.1, 106.0),
            ((0.06, -0.04, 0.045), 0.07, 118.0),
        ):
            swing = mass / (1 - (f / natural) ** 2 / (1 + 0.12j))
            total += self.hose * swing * rows_at(r).T @ rows_at(r)
        return total

    def apparent_mass(self, f, running=False, amplitudes=(0.0, 0.0, 0.0)):
        """At the virtual point; with rotor and hoses where it runs."""
        held = self.stiffness_matrix(f, running, amplitudes)
        result = self.mass_matrix() - held / (2 * np.pi * f) ** 2
        if running:
            result[3:, 3:] += 1j * self.sense * ROTOR * cross([1, 0, 0])
            if self.hose:
                result += self.hose_matrix(f)
        return result

    def load(self, f, factor):
        """Of rotor and gas: vectors that turn from y to z, or back."""
        w2 = (2 * np.pi * f) ** 2
        force = STATIC * w2 + factor * GAS[2]
        moment = DYNAMIC * w2
        back = -1j * self.sense
        return np.array(
            [factor * GAS[0], force, back * force, factor * GAS[1], -back * moment, moment]
        )

    def running(self, f, factor):
        """Acceleration of the virtual point, mounts as soft as their own motion makes them."""
        amplitudes = np.zeros(3)
        for _ in range(80):
            motion = np.linalg.solve(self.apparent_mass(f, True, amplitudes), self.load(f, factor))
            if not self.softening:
                break
            now = np.array([np.linalg.norm(rows_at(r) @ motion) for r in self.places])
            now /= (2 * np.pi * f) ** 2
            if np.max(np.abs(now - amplitudes)) < 1e-10:
                break
            amplitudes = 0.5 * (amplitudes + now)
        return motion


def drawing():
    """Mounts as the drawing has them: no sample's."""
    mounts = tuple(
        CompressorMount(f"M{i + 1}", place, angle, np.array([23e3, 13e3, 13e3]))
        for i, (place, angle) in enumerate(zip(1e-3 * PLACES, np.deg2rad(ANGLES), strict=True))
    )
    return Drawing(6.8, np.zeros(3), np.diag([0.015, 0.03, 0.029]), mounts)


def complex_noise(rng, shape):
    return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)


def sheet():
    """Six sensors of any orientation and three impacts on each side, by the position sheet."""
    rng = np.random.default_rng(3)
    places = 1e-3 * np.array(
        [[80, 40, 45], [80, -45, -40], [-95, 42, -42], [-95, -40, 45], [0, 60, -20], [10, -5, -62]]
    )
    sensors = tuple(
        Sensor(
            f"A{i + 1}",
            SensorKind.ACCELEROMETER,
            "",
            "",
            "",
            place,
            turn(rng.uniform(-0.4, 0.4, 3)),
        )
        for i, place in enumerate(places)
    )
    impacts = []
    for axis in range(3):
        for side in (-1.0, 1.0):
            for _ in range(3):
                place = 0.06 * rng.uniform(-1, 1, 3)
                place[axis] = 0.09 * side
                impacts.append(Impact(f"I{len(impacts) + 1:02d}", place, -side * np.eye(3)[axis]))
    return sensors, tuple(impacts)


def sample(
    seed,
    *,
    errors=1.0,
    noise=1.0,
    hoses=HoseState.SOFT,
    pressures=(LOW, HIGH),
    lines=SPEED_LINES,
    rotor=ROTOR,
    hammer_lines=HAMMER_LINES,
    drawn=False,
    **options,
):
    """Test, and the body behind it; `errors` times the tolerances, `noise` times a laboratory's.

    `drawn`: the test brings a drawing of the mounts, as good as the thesis's table 10.
    """
    rng = np.random.default_rng(seed)
    body = Body.drawn(rng, **options)
    tolerances = PlacementTolerances()
    sensors, impacts = sheet()
    forward = []
    for sensor in sensors:
        true = sensor.orientation @ turn(errors * tolerances.sensor_angle * rng.standard_normal(3))
        moved = sensor.position + errors * tolerances.sensor_position * rng.standard_normal(3)
        gains = 1 + errors * tolerances.sensor_gain * rng.standard_normal(3)
        forward.append(gains[:, None] * (true.T @ rows_at(moved)))
    forward = np.concatenate(forward)
    wrenches = []
    hammer = 1 + errors * tolerances.hammer_gain * rng.standard_normal()
    for impact in impacts:
        across = impact.direction == 0
        off = across * errors * tolerances.impact_position * rng.standard_normal(3)
        leaning = (
            impact.direction + across * errors * tolerances.impact_angle * rng.standard_normal(3)
        )
        true = leaning / np.linalg.norm(leaning)
        wrenches.append(np.concatenate([true, np.cross(impact.position + off, true)]) / hammer)
    wrenches = np.array(wrenches)
    inertance = np.array([np.linalg.inv(body.apparent_mass(f)) for f in hammer_lines])
    exact = forward @ inertance @ wrenches.T
    sigma = noise * 1e-3 * np.sqrt(1 + (20 / hammer_lines) ** 2)[:, None, None]
    values = exact + sigma * complex_noise(rng, exact.shape)
    ratio = 2 * (AVERAGES - 1) * np.maximum(sigma, 1e-9) ** 2 / np.abs(values) ** 2
    test = InertanceTest(
        "sample",
        sensors,
        impacts,
        Frf(
            hammer_lines,
            values,
            tuple(name for sensor in sensors for name in sensor.channels),
            tuple(impact.name for impact in impacts),
            "(m/s^2)/N",
        ),
        1 / (1 + ratio),
        AVERAGES,
        tolerances,
        body.mass * (1 + 1e-3 * noise * rng.standard_normal()),
        1e-3 * body.mass,
        drawing() if drawn else None,
    )
    sweeps = []
    for pressure in pressures:
        motion = np.array([body.running(f, GAS_FACTOR[pressure]) for f in lines])
        channels = motion @ forward.T
        floor = FLOOR * np.sqrt(1 + (20 / lines) ** 2)[:, None]
        deviation = np.sqrt((SHARE * np.abs(channels)) ** 2 + floor**2)
        sweeps.append(
            OperatingSweep(
                f"{hoses.value} {pressure / 1e5:g} bar",
                hoses,
                pressure,
                Spectrum(
                    lines,
                    channels + noise * deviation * complex_noise(rng, channels.shape),
                    test.frf.outputs,
                    "m/s^2",
                ),
                max(noise, 1e-6) * deviation,
            )
        )
    return OperatingTest("sample", test, None, tuple(sweeps), rotor), body


def passing_as_unbalance(lines, factor):
    """Add to the static unbalance what the rotating gas force passes off as one."""
    return STATIC + factor * GAS[2] / (2 * np.pi * lines) ** 2
