"""Noise transfer functions and the coupled car.

Hammer and loudspeaker on the bench's vehicles, virtual points and the spread of vehicles.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from claims import Claim, at_least, at_most
from deboom.arrays import ComplexArray
from deboom.bench.fleet import (
    EARS,
    NO_SPREAD,
    Body,
    BodySpread,
    ear_transfer,
    load_fleet,
    noise_transfer,
    scattered_body,
)
from deboom.bench.layout import FREQUENCY
from deboom.bench.layout import points as virtual_points
from deboom.bench.operating_run import PlannedRun, true_run
from deboom.bench.powertrain import load_bench
from deboom.bench.vehicle_acquisition import (
    AcquisitionErrors,
    body_sensor_places,
    breathe,
    draw_setup,
    impact_places,
    strike,
)
from deboom.measurement.channels import Frf
from deboom.measurement.noise_transfer import (
    ACCELERATION_PER_VOLUME_ACCELERATION,
    noise_transfer_at_points,
    reciprocal_noise_transfer,
)
from deboom.measurement.sensors import Impact, Sensor, SensorKind
from deboom.measurement.uncertainty import level_spread
from deboom.measurement.virtual_point import impact_geometry, sensor_geometry
from deboom.physics.rigid_body import rotation_matrix
from deboom.physics.sound_level import spl

BENCH = load_bench()
FLEET = load_fleet(1)
VEHICLES = tuple(f"U06-{k}" for k in range(1, 6))
MODES = np.array([24.0, 30.0, 37.0, 40.0, 47.0])


def claims() -> list[Claim]:
    """Measure everything afresh; about 30 s on one core."""
    return [
        *_with_errors(),
        *_spread(),
    ]


@dataclass(frozen=True)
class Geometry:
    """Position sheets as the laboratory has them."""

    impacts: dict
    sensors: dict


def _geometry() -> Geometry:
    turned = rotation_matrix(np.deg2rad([place.angles for place in body_sensor_places(BENCH)]))
    impacts, sensors = {}, {}
    for place in virtual_points(BENCH):
        impacts[place.name] = impact_geometry(
            [
                Impact(p.name, p.position, p.vector)
                for p in impact_places(BENCH)
                if p.point.name == place.name
            ],
            place.position,
        )
        sensors[place.name] = sensor_geometry(
            [
                Sensor(
                    p.name,
                    SensorKind.ACCELEROMETER,
                    "",
                    place.mount,
                    place.piece,
                    p.position,
                    turn,
                )
                for p, turn in zip(body_sensor_places(BENCH), turned, strict=True)
                if p.point.name == place.name
            ],
            place.position,
        )
    return Geometry(impacts, sensors)


GEOMETRY = _geometry()
CHANNELS = tuple(channel for place in body_sensor_places(BENCH) for channel in place.channels)
BLOWS = tuple(place.name for place in impact_places(BENCH))


def _both_methods(
    body: Body,
    seed: Sequence[int],
    errors: AcquisitionErrors | None = None,
    state: BodySpread | None = None,
) -> tuple[Frf, Frf]:
    """Hammer and loudspeaker at the virtual points, each on a day of its own."""
    errors, state = errors or AcquisitionErrors(), state or BodySpread()
    generator = np.random.default_rng(seed)
    setup, cabin = draw_setup(BENCH, errors, generator), FLEET.cabin
    first, second = (scattered_body(body, state, generator) for _ in range(2))
    pressure, _ = strike(setup, first, cabin, FREQUENCY, errors, generator)
    answer = breathe(setup, second, cabin, FREQUENCY, errors, generator)
    direct = Frf(FREQUENCY, pressure, EARS, BLOWS, "Pa/N")
    measured = Frf(FREQUENCY, answer, CHANNELS, EARS, ACCELERATION_PER_VOLUME_ACCELERATION)
    return (
        noise_transfer_at_points(direct, GEOMETRY.impacts),
        noise_transfer_at_points(reciprocal_noise_transfer(measured), GEOMETRY.sensors),
    )


def _at_points(body: Body) -> ComplexArray:
    return ear_transfer(body, FLEET.cabin, FREQUENCY).reshape(FREQUENCY.size, len(EARS), -1)


def _with_errors() -> list[Claim]:
    """Every vehicle in one state, so that only the measuring chain errs."""
    forces = [k for k in range(18) if k % 6 < 3]
    moments = [k for k in range(18) if k % 6 >= 3]
    found: dict[str, list[float]] = {"direct": [], "reciprocal": [], "moments": []}
    for number, name in enumerate(VEHICLES):
        body = FLEET.bodies[name]
        true = _at_points(body)[:, 0]
        for seed in range(1, 5):
            pair = _both_methods(body, (seed, number), state=NO_SPREAD)
            for which, points in zip(("direct", "reciprocal"), pair, strict=True):
                error = np.linalg.norm(points.values[:, 0] - true, axis=0)
                relative = error[:18] / np.linalg.norm(true[:, :18], axis=0)
                found[which] += relative[forces].tolist()
                found["moments"] += relative[moments].tolist()
    return [
        at_most(
            "measured at the virtual points, 5 vehicles x 4 set-ups: median rms error of the "
            "forces' functions by hammer and loudspeaker, and of the moments' [%]",
            [10, 10, np.inf],
            [100 * np.median(values) for values in found.values()],
            1,
        )
    ]


def _spread() -> list[Claim]:
    force = true_run(BENCH, PlannedRun(5, 220.0), FREQUENCY).path_force
    groups = {group: [f"{group}-{k}" for k in range(1, 6)] for group in ("U06", "F39", "F45")}
    found = {}
    for group, names in {**groups, "U06 without its battery vehicle": groups["U06"][:4]}.items():
        frfs = [
            Frf(
                FREQUENCY,
                noise_transfer(FLEET.bodies[name], FLEET.cabin, FREQUENCY)[:, None],
                EARS[:1],
                FLEET.paths,
                "Pa/N",
            )
            for name in names
        ]
        sounds = [spl(np.sum(frf.values[:, 0] * force, axis=1), FREQUENCY) for frf in frfs]
        functions = [20 * np.log10(np.abs(frf.values)) for frf in frfs]
        spreads = level_spread(functions), level_spread(sounds)
        found[group] = [spread.quantile(0.5) for spread in spreads]
    with_battery = found.pop("U06")
    return [
        at_least(
            "spread over the five U06, one of which carries a battery: functions and SPL, median "
            "over the lines [dB] (figure 10; thesis 10 to 20 and 10 to 15)",
            10,
            with_battery,
            1,
        ),
        *(
            at_least(f"the same over alike vehicles, {group}", 10, pair, 1)
            for group, pair in found.items()
        ),
    ]
