"""Noise transfer functions and the coupled car.

Hammer and loudspeaker on the bench's vehicles, virtual points, misplaced blows, the split of the
variance, and what the driven car makes of a prediction from bench forces. Level and shape are
judged from 20 to 55 Hz, as in the study that the virtual vehicles come from.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.signal import find_peaks

from claims import Claim
from deboom.arrays import ComplexArray, RealArray
from deboom.bench.fleet import (
    EARS,
    NO_SPREAD,
    Body,
    BodySpread,
    ear_transfer,
    load_fleet,
    noise_transfer,
    scattered_body,
    source_motion,
)
from deboom.bench.layout import FREQUENCY
from deboom.bench.layout import points as virtual_points
from deboom.bench.operating_run import CarErrors, OperatingRun, PlannedRun, at_ears, drive, true_run
from deboom.bench.powertrain import VirtualBench, load_bench, with_mount_set
from deboom.bench.sensors import TransferErrors, measured_noise_transfer
from deboom.bench.vehicle_acquisition import (
    NO_ACQUISITION_ERRORS,
    AcquisitionErrors,
    body_sensor_places,
    breathe,
    draw_setup,
    impact_places,
    strike,
)
from deboom.bench.vehicle_writer import NO_VEHICLE_ERRORS, write_vehicle
from deboom.files.vehicle import read_vehicle
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.measured_vehicle import Method, point_noise_transfer
from deboom.measurement.noise_transfer import (
    ACCELERATION_PER_VOLUME_ACCELERATION,
    noise_transfer_at_points,
    noise_transfer_of_paths,
    reciprocal_noise_transfer,
)
from deboom.measurement.sensors import Impact, Sensor, SensorKind
from deboom.measurement.uncertainty import level_spread, variance_split
from deboom.measurement.virtual_point import impact_geometry, sensor_geometry
from deboom.physics.frf import corr_f, corr_s
from deboom.physics.rigid_body import forward_matrices, rotation_matrix
from deboom.physics.sound_level import spl
from deboom.vehicles.path_analysis import analyse_paths

BENCH = load_bench()
FLEET = load_fleet(1)
VEHICLES = tuple(f"U06-{k}" for k in range(1, 6))
BAND = FREQUENCY <= 55.0
MODES = np.array([24.0, 30.0, 37.0, 40.0, 47.0])
PATHS = {path: [path] for path in FLEET.paths[:-1]} | {"Du x": ["Du left x", "Du right x"]}


def claims() -> list[Claim]:
    """Measure everything afresh; about 30 s on one core."""
    return [
        _sign(),
        *_exact_files(),
        *_with_errors(),
        _misplacement(),
        *_variance(),
        *_spread(),
        *_methods(),
        *_car(),
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


def _sign() -> Claim:
    worst = 0.0
    for body in FLEET.bodies.values():
        direct = ear_transfer(body, FLEET.cabin, FREQUENCY)
        breathing = source_motion(body, FLEET.cabin, FREQUENCY).transpose(0, 3, 1, 2)
        worst = max(worst, float(np.abs(direct + breathing).max() / np.abs(direct).max()))
    return Claim(
        "p/F = -a/Qdot, 15 vehicles, two ears, six loads at five points: largest error",
        "≤ 1e-12 (closed forms with and without waves: tests)",
        f"{worst:.0e}",
        worst <= 1e-12,
    )


def _exact_files() -> list[Claim]:
    with TemporaryDirectory() as scratch:
        folder = write_vehicle(Path(scratch) / "car", 1, errors=NO_VEHICLE_ERRORS, load_cases=())
        vehicle = read_vehicle(folder)
        true = _at_points(FLEET.bodies[vehicle.name])
        errors = [
            float(np.abs(point_noise_transfer(vehicle, method).values - true).max())
            / float(np.abs(true).max())
            for method in Method
        ]
    return [
        Claim(
            "exact files → six loads of five virtual points, hammer and loudspeaker",
            "≤ 1e-12",
            " and ".join(f"{e:.0e}" for e in errors),
            max(errors) <= 1e-12,
        )
    ]


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
    text = ", ".join(
        f"{what} {100 * np.median(v):.1f} ({100 * np.quantile(v, 0.9):.1f}) %"
        for what, v in found.items()
    )
    return [
        Claim(
            "measured at the virtual points, 5 vehicles x 4 set-ups: median (90 %) rms error of "
            "the forces' functions, and of the moments'",
            "forces: median ≤ 10 %; moments stated, no claim",
            text,
            bool(max(np.median(found["direct"]), np.median(found["reciprocal"])) <= 0.10),
        )
    ]


def _misplacement() -> Claim:
    single, virtual = _misplaced_triple(0.010)
    return Claim(
        "blows misplaced by 10 mm each: error of the nearest blow taken for the mount's own, "
        "and of the virtual point of nine (x and z, median)",
        "the virtual point is the better one",
        f"{100 * single:.1f} % and {100 * virtual:.1f} %",
        virtual < single,
    )


def _misplaced_triple(distance: float) -> tuple[float, float]:
    """Error of blows at the nearest point alone, and of the virtual point, all misplaced alike."""
    generator = np.random.default_rng(8)
    places = impact_places(BENCH)
    offsets = np.array([place.offset for place in places])
    vectors = np.array([place.vector for place in places])
    single, virtual = [], []
    for name in VEHICLES:
        body = FLEET.bodies[name]
        true = _at_points(body)[:, 0].reshape(FREQUENCY.size, -1, 6)[:, :3, :3]
        for _ in range(4):
            away = generator.normal(size=offsets.shape)
            away = distance * away / np.linalg.norm(away, axis=1, keepdims=True)
            setup = draw_setup(BENCH, NO_ACQUISITION_ERRORS, generator)
            forward = forward_matrices(offsets + away).reshape(-1, 3, 6)
            rows = np.einsum("ca,cab->cb", vectors, forward)
            moved = replace(setup, impact_rows=tuple(rows.reshape(len(setup.impact_rows), -1, 6)))
            found, _ = strike(
                *(moved, body, FLEET.cabin, FREQUENCY, NO_ACQUISITION_ERRORS, generator)
            )
            points = noise_transfer_at_points(
                Frf(FREQUENCY, found, EARS, BLOWS, "Pa/N"), GEOMETRY.impacts
            ).values[:, 0]
            at_points = points.reshape(FREQUENCY.size, -1, 6)[:, :3, :3]
            signed = found[:, 0] * vectors.sum(axis=1)
            nearest = signed.reshape(FREQUENCY.size, -1, 3, 3)[:, :3, 0]
            size = np.linalg.norm(true, axis=0)
            virtual.append(np.linalg.norm(at_points - true, axis=0) / size)
            single.append(np.linalg.norm(nearest - true, axis=0) / size)
    along = [0, 2]
    return tuple(float(np.median(np.array(errors)[..., along])) for errors in (single, virtual))


def _variance() -> list[Claim]:
    """Levels of TSM x at the driver: 5 vehicles, 4 states, 3 repeats, against what was drawn."""
    errors, column = AcquisitionErrors(), FLEET.paths.index("TSM x")
    generator = np.random.default_rng(12)

    def level(body: Body) -> ComplexArray:
        return noise_transfer(body, FLEET.cabin, FREQUENCY)[:, column]

    def repeated(exact: ComplexArray) -> RealArray:
        noise = generator.normal(size=(2, FREQUENCY.size)) / np.sqrt(2)
        noisy = exact * (1 + errors.relative * (noise[0] + 1j * noise[1]))
        return np.asarray(20 * np.log10(np.abs(noisy)))

    bodies = [FLEET.bodies[name] for name in VEHICLES]
    days = [[level(scattered_body(b, BodySpread(), generator)) for _ in range(4)] for b in bodies]
    values = np.array([[[repeated(exact) for _ in range(3)] for exact in day] for day in days])
    split = variance_split(values)
    found = np.sqrt(split.estimate.mean(axis=1).clip(0))
    many = [
        20
        * np.log10(np.abs([level(scattered_body(b, BodySpread(), generator)) for _ in range(60)]))
        for b in bodies
    ]
    vehicle = np.var([m.mean(axis=0) for m in many], axis=0, ddof=1).mean()
    state = np.mean([m.var(axis=0, ddof=1) for m in many])
    repeat = (20 / np.log(10) * errors.relative) ** 2 / 2
    true = np.sqrt([vehicle, state, repeat])
    return [
        Claim(
            "variance split of TSM x's level, 5 vehicles x 4 states x 3 repeats, rms over the "
            "lines: vehicle, state, repeat [dB]; drawn",
            "within 30 % of what was drawn",
            f"{', '.join(f'{v:.2f}' for v in found)}; {', '.join(f'{v:.2f}' for v in true)}",
            bool(np.all(np.abs(found / true - 1) <= 0.3)),
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
    asked = "thesis: functions 10-20, SPL 10-15"
    return [
        Claim(
            "spread over the five U06, one of which carries a battery: functions and SPL, median "
            "over the lines [dB] (figure 10)",
            asked,
            " and ".join(f"{value:.1f}" for value in with_battery),
            min(with_battery) >= 10.0,
        ),
        Claim(
            "the same over vehicles that are alike",
            asked,
            "; ".join(f"{group}: {a:.1f} and {b:.1f}" for group, (a, b) in found.items()),
            min(min(pair) for pair in found.values()) >= 10.0,
        ),
    ]


def _operated(number: int) -> tuple[VirtualBench, OperatingRun]:
    bench = with_mount_set(BENCH, f"M{number}")
    return bench, true_run(bench, PlannedRun(5, 220.0), FREQUENCY)


def _methods() -> list[Claim]:
    peaks, shapes, scales = [], [], []
    for number, name in enumerate(VEHICLES, 1):
        force = Spectrum(FREQUENCY, _operated(number)[1].path_force, tuple(PATHS), "N")
        for seed in range(1, 7):
            direct, reciprocal = _both_methods(FLEET.bodies[name], (seed, number))
            first, second = (
                analyse_paths(noise_transfer_of_paths(ntf, PATHS, EARS[0]), force).pressure[BAND]
                for ntf in (reciprocal, direct)
            )
            peaks.append(_peak_deviation(first, second))
            shapes.append(100 * float(corr_f(second, first)))
            scales.append(100 * float(corr_s(second, first)))
    return [
        Claim(
            "hammer against reciprocal, same forces, 5 vehicles x 6 set-ups: SPL at peaks, median "
            "(90 %) [dB]; corr_f, corr_s of the pressure, median [%] (figure 41)",
            "thesis: 1 to 2 dB at peaks",
            f"{np.median(peaks):.1f} ({np.quantile(peaks, 0.9):.1f}); {np.median(shapes):.1f}, "
            f"{np.median(scales):.1f}",
            bool(np.quantile(peaks, 0.9) <= 2.5),
        )
    ]


def _peak_deviation(measured: ComplexArray, other: ComplexArray) -> float:
    """Largest level difference at a peak, the other one's highest level within 1 Hz."""
    lines = FREQUENCY[BAND]
    first, second = (spl(p, lines) for p in (measured, other))
    at = find_peaks(first, prominence=2.0)[0]
    return max(abs(first[k] - second[np.abs(lines - lines[k]) <= 1.0].max()) for k in at)


def _car() -> list[Claim]:
    shapes, scales, peaks = [], [], []
    for number in range(1, 6):
        bench, run = _operated(number)
        for vehicle, name in enumerate(VEHICLES):
            generator = np.random.default_rng([number, vehicle])
            body, errors = FLEET.bodies[name], CarErrors()
            torque = run.engine_torque * (1 + generator.normal(0, errors.torque))
            car = drive(bench, body, FLEET.cabin, 5, torque, FREQUENCY, errors.mount_stiffness)
            measured = at_ears(car, errors, generator)[1][BAND, 0]
            transfer = noise_transfer(body, FLEET.cabin, FREQUENCY)
            transfer = measured_noise_transfer(transfer, TransferErrors(), generator)
            predicted = np.sum(transfer * run.path_force, axis=1)[BAND]
            shapes.append(100 * float(corr_f(predicted, measured)))
            scales.append(100 * float(corr_s(np.abs(predicted), np.abs(measured))))
            peaks.append(_peak_deviation(measured, predicted))
    within = f", {sum(peak <= 3 for peak in peaks)} of {len(peaks)} within 3 dB"
    return [
        Claim(
            "driven car against bench forces times functions with 5 % and 0.5 dB, 5 vehicles x 5 "
            f"mount sets: {what}, median (range)",
            asked,
            f"{np.median(found):.1f} ({min(found):.1f} to {max(found):.1f}) {unit}{beyond}",
            bool(holds),
        )
        for what, asked, found, unit, beyond, holds in (
            ("corr_f complex", "median ≤ 5 %", shapes, "%", "", np.median(shapes) <= 5),
            ("corr_s magnitude", "median ≤ 15 %", scales, "%", "", np.median(scales) <= 15),
            ("largest peak deviation", "≤ 3 dB", peaks, "dB", within, max(peaks) <= 3),
        )
    ]
