"""What brackets, temperatures and further measurements are worth in benches.

    python benchmarks/next_measurement.py state 9    # brackets and temperatures, stated or not
    python benchmarks/next_measurement.py rank 20    # the ranked measurements, really made

Families, cars and picks are those of ``expected_change.py``, with seeds of their own.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from deboom.arrays import AXES, RealArray
from deboom.bench.families import draw_family
from deboom.bench.operating_run import drive
from deboom.bench.platform_writer import write_platform
from deboom.bench.powertrain import load_bench
from deboom.files.platform import read_platform
from deboom.files.uncertain_index import uncertain_index
from deboom.mounts.mount import Bracket, Mount, RubberInCar, mean_operating_stiffness
from deboom.physics.order_tracking import rpm_of_frequency
from deboom.physics.sound_level import spl
from deboom.vehicles.change_prior import RUBBER_AGE
from deboom.vehicles.expected_change import CarMeasurement, ExpectedChange, expected_change
from deboom.vehicles.fleet import Fleet
from deboom.vehicles.platform import Platform
from expected_change import (
    APART,
    FAMILIES,
    GEAR,
    GROUP,
    PATHS,
    REPETITIONS,
    RUN,
    TORQUE,
    coupled_model,
    of_driving_points,
    quieter_design,
    words_of,
)

STATED, RANKED = 7_000_000, 5_000_000
"""First seeds."""
KINDS = ("brackets", "attachments", "battery")
MULTIPLES = (2.0, 5.0, 10.0, np.inf)
"""Stiffness of the brackets over that of their mounts [1]."""
WARMER = (-10.0, 10.0)
"""Temperature in the car over that of the test [K], of rubber that softens by 1 % per kelvin."""
CARS = 3


def expected(
    platform: Platform, fleet: Fleet, mounts: Sequence[Mount], pick: RealArray
) -> ExpectedChange:
    """State the expected change in a fleet, with what is stated of the mounts."""
    other = replace(platform, mounts=tuple(mounts))
    at_rest = Fleet(tuple(replace(vehicle, receptance=None) for vehicle in fleet.vehicles))
    model = coupled_model(other, at_rest)
    uncertain = uncertain_index(model, replace(other, fleet=at_rest), ())
    again = list(uncertain.on_bodies_at_rest.draws(REPETITIONS, 1))
    return expected_change(model, again, fleet, mounts, pick)


def on_brackets(mounts: Sequence[Mount], stiffness: dict[str, float]) -> list[Mount]:
    """Return mounts whose brackets of the body have a stiffness by direction [N/m]."""
    return [
        replace(mount, brackets=(Bracket("body", np.empty(0), np.array([of_axes], complex)),))
        for mount in mounts
        for of_axes in [[stiffness.get(f"{mount.name} {axis}", 1e12) for axis in AXES]]
    ]


def written(family: str, seed: int, *, receptance: bool) -> Platform:
    """Write and read a platform of the bench."""
    with tempfile.TemporaryDirectory() as folder:
        options = {"load_cases": RUN, "groups": (GROUP,), "family": family}
        path = write_platform(
            Path(folder) / "p", seed, truth_seed=seed, receptance=receptance, **options
        )
        return read_platform(path)


def stated(kind: str, seed: int) -> Iterator[tuple[str, str, RealArray, ExpectedChange]]:
    """Give what is in the car, whether it is stated, true changes (v,) [dB] and expected ones."""
    platform, family = written(kind, seed, receptance=False), draw_family(kind, seed, seed)
    fleet = Fleet(platform.fleet.group(GROUP).vehicles[:CARS])
    model = coupled_model(platform, fleet)
    pick = quieter_design(model)
    cars, bench = family.fleet(), family.bench(load_bench(family.truth_seed))
    torque = bench.ramp.torque(TORQUE, rpm_of_frequency(model.frequency, bench.order_torque.order))
    rubber, loss = family.in_car(len(bench.mount_names))
    band = (float(model.frequency[0]), float(model.frequency[-1]))
    case = platform.load_case(RUN[0].name)
    of_mounts = {
        f"{mount.name} {axis}": float(value)
        for mount in platform.mounts
        for axis, value in zip(AXES, mean_operating_stiffness(mount, case, band), strict=True)
        if f"{mount.name} {axis}" in cars.paths
    }
    pieces = np.array([2.0 if path.startswith("Du") else 1.0 for path in cars.paths])
    of_paths = pieces * [of_mounts[path] for path in cars.paths]

    def level(car: str, design: RealArray, multiple: float, softer: float) -> float:
        body = cars.bodies[car]
        local = 1.0 / (1.0 / body.local_stiffness + 1.0 / (multiple * of_paths))
        scale = softer * rubber * np.append(design[: PATHS - 1], [design[PATHS - 1]] * 2)
        body = replace(body, local_stiffness=local)
        lines = model.frequency
        run = drive(bench, body, cars.cabin, GEAR, torque, lines, scale, loss)
        return float(spl(run.pressure[:, 0], lines, axis=-1).mean())

    def true(multiple: float = np.inf, softer: float = 1.0) -> RealArray:
        today = np.ones_like(pick)
        return np.array(
            [
                level(car, pick, multiple, softer) - level(car, today, multiple, softer)
                for car in fleet.names
            ]
        )

    unstated = expected(platform, fleet, platform.mounts, pick)
    for multiple in MULTIPLES:
        changes, name = true(multiple=multiple), f"bracket of {multiple:g} mounts"
        yield name, "unstated", changes, unstated
        if np.isfinite(multiple):
            brackets = {path: multiple * value for path, value in of_mounts.items()}
            bracketed = on_brackets(platform.mounts, brackets)
            yield name, "stated", changes, expected(platform, fleet, bracketed, pick)
    for warmer in WARMER:
        changes, name = true(softer=float(np.exp(-0.01 * warmer))), f"{warmer:+g} K"
        yield name, "unstated", changes, unstated
        rubber_in_car = RubberInCar((-0.012, -0.008), (warmer - 2.0, warmer + 2.0))
        warm = [replace(mount, rubber=rubber_in_car) for mount in platform.mounts]
        yield name, "stated", changes, expected(platform, fleet, warm, pick)


def state(n_platform: int) -> None:
    """Print what is brought, errors and widths for brackets and temperatures, stated or not."""
    rows: dict[tuple[str, str], list[tuple[RealArray, ...]]] = {}
    for number in range(n_platform):
        kind = KINDS[number % len(KINDS)]
        for name, how, true, change in stated(kind, STATED + number):
            cars = (each[0] for each in vars(change.cars).values())
            rows.setdefault((name, how), []).append((true, change.predicted[0], *cars))
    for (name, how), parts in rows.items():
        true, model, middle, low, high = (np.concatenate(each) for each in zip(*parts, strict=True))
        print(
            f"{name}, {how}: true over model {true.sum() / model.sum():.2f}; rms of true less "
            f"model {np.sqrt(np.mean((true - model) ** 2)):.2f} dB, less expected "
            f"{np.sqrt(np.mean((true - middle) ** 2)):.2f} dB; width {np.mean(high - low):.2f} dB "
            f"holds {100 * np.mean((low <= true) & (true <= high)):.0f} %"
        )


def ranked(family: str, seed: int) -> tuple[dict[Any, float], dict[Any, float]]:
    """Return widths of the interval by measurement: as ranked, and when it is really made [dB]."""
    words = words_of(family, seed)
    platform, drawn = written(words, seed, receptance=True), draw_family(words, seed, seed)
    group = platform.fleet.group(GROUP)
    at_rest = Fleet(tuple(replace(vehicle, receptance=None) for vehicle in group.vehicles))
    points = Fleet(tuple(map(of_driving_points, group.vehicles)))
    model = coupled_model(platform, at_rest)
    pick = quieter_design(model)[np.newaxis]
    widths = uncertain_index(model, replace(platform, fleet=at_rest), ()).widths_if_measured(pick)
    cars, (rubber, _) = drawn.fleet(), drawn.in_car(len(platform.mounts))
    flexibility = np.mean([1.0 / cars.bodies[car].local_stiffness for car in group.names], axis=0)
    pieces = np.array([2.0 if path.startswith("Du") else 1.0 for path in cars.paths])
    local = dict(zip(cars.paths, 1.0 / (pieces * flexibility), strict=True))
    per_mount = np.broadcast_to(rubber, 3 * len(platform.mounts) + 2)[:: len(AXES)]
    in_car = [
        replace(mount, rubber=RubberInCar(on_the_road=float(factor), spread=RUBBER_AGE))
        for mount, factor in zip(platform.mounts, per_mount, strict=False)
    ]
    measured = {
        None: (at_rest, platform.mounts),
        CarMeasurement.driving_points: (points, platform.mounts),
        CarMeasurement.receptances: (group, platform.mounts),
        CarMeasurement.brackets: (at_rest, on_brackets(platform.mounts, local)),
        CarMeasurement.temperature: (at_rest, in_car),
    }
    real = {}
    for step, (fleet, mounts) in measured.items():
        mean = expected(platform, fleet, mounts, pick).mean
        real[step] = float(mean.high[0] - mean.low[0])
    return {step: float(width[0]) for step, width in widths.items()}, real


def rank(n_platform: int) -> None:
    """Print how often the measurement that is ranked first narrows most when it is made."""
    hits, among_others = 0, 0
    for number in range(n_platform):
        family = FAMILIES[number % len(FAMILIES)]
        offset = APART * (number % len(FAMILIES)) + number // len(FAMILIES)
        before, real = ranked(family, RANKED + offset)
        steps = [step for step in CarMeasurement if step in before]
        others = [step for step in steps if step is not CarMeasurement.receptances]
        hits += min(steps, key=before.__getitem__) is min(steps, key=real.__getitem__)
        among_others += min(others, key=before.__getitem__) is min(others, key=real.__getitem__)
        left = "; ".join(
            f"{step.name} {before[step] / before[None]:.2f}, {real[step] / real[None]:.2f}"
            for step in steps
        )
        print(f"{family}: width that is left, ranked and real: {left}", flush=True)
    print(f"first: {hits} of {n_platform}; without receptances {among_others} of {n_platform}")


if __name__ == "__main__":
    {"state": state, "rank": rank}[sys.argv[1]](int(sys.argv[2]))
