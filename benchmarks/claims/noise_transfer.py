"""Noise transfer functions and the coupled car.

Hammer and loudspeaker on vehicles of drawn fleets, referred to virtual points, and the spread of
the shipped ones. Every vehicle is in one state, so that only the measuring chain errs.

Alike vehicles of the shipped fleet differ by 4 to 6 dB, those of the thesis by 10 to 20 dB: the
frozen bodies of one drawing scatter less, and the fleet stays as it was published. Fleets that are
drawn with `deboom bench write --body-scatter 2` spread as the literature says.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from claims import CASES, Claim, at_least, over_draws
from deboom.arrays import ComplexArray
from deboom.bench.fleet import (
    LITERATURE_SCATTER,
    NO_SPREAD,
    BenchFleet,
    ear_transfer,
    load_fleet,
    noise_transfer,
)
from deboom.bench.layout import FREQUENCY
from deboom.bench.operating_run import CarErrors, PlannedRun, at_ears, drive, true_run
from deboom.bench.powertrain import load_bench
from deboom.bench.vehicle_writer import VehicleErrors, write_vehicle
from deboom.files.vehicle import read_vehicle
from deboom.measurement.measured_vehicle import Method, point_noise_transfer
from deboom.measurement.uncertainty import level_spread
from deboom.physics.sound_level import spl

VEHICLES = tuple(f"U06-{k}" for k in range(1, 6))

ALIKE = {
    "F39": tuple(f"F39-{k}" for k in range(1, 6)),
    "F45": tuple(f"F45-{k}" for k in range(1, 6)),
    "U06 without its battery vehicle": VEHICLES[:4],
}
"""Vehicles of one drawing."""


def claims() -> list[Claim]:
    return [*_with_errors(), _structure_borne(), *_spread()]


def _with_errors() -> list[Claim]:
    cases = np.array([_errors_of(seed) for seed in CASES])
    return [
        over_draws(
            "measured at the virtual points, 5 vehicles of each fleet: median rms error of the "
            "forces' functions by hammer and by loudspeaker, and of the moments' [%]",
            cases[:, :3],
            {1.0: [10, 10, np.inf]},
            1,
        ),
        over_draws(
            "paths along x by hammer against loudspeaker: median difference of their contributions "
            "(figure 42) [dB]",
            cases[:, 3],
        ),
    ]


def _errors_of(seed: int) -> list[float]:
    names = ("hammer", "loudspeaker", "moments", "apart")
    errors: dict[str, list[float]] = {name: [] for name in names}
    fleet, plan = load_fleet(seed), VehicleErrors(state=NO_SPREAD)
    for name in VEHICLES:
        with TemporaryDirectory() as scratch:
            folder = Path(scratch) / "car"
            write_vehicle(folder, seed, name, errors=plan, load_cases=(), accelerance=False)
            vehicle = read_vehicle(folder)
        true = ear_transfer(fleet.bodies[name], fleet.cabin, FREQUENCY)[:, 0]
        along_x = []
        for method, words in ((Method.DIRECT, "hammer"), (Method.RECIPROCAL, "loudspeaker")):
            estimated = point_noise_transfer(vehicle, method).values[:, 0].reshape(true.shape)
            along_x.append(20 * np.log10(np.abs(estimated[:, :, 0])))
            relative = np.linalg.norm(estimated - true, axis=0) / np.linalg.norm(true, axis=0)
            errors[words] += relative[:3, :3].ravel().tolist()
            errors["moments"] += relative[:3, 3:].ravel().tolist()
        # a force is the same in both: contributions differ as the functions do
        errors["apart"] += np.abs(np.subtract(*along_x)).ravel().tolist()
    medians = {name: float(np.median(values)) for name, values in errors.items()}
    return [100 * medians[name] for name in names[:3]] + [medians["apart"]]


def _structure_borne() -> Claim:
    """Find what part of the sound at the ear of the coupled car comes through its mounts."""
    return over_draws(
        "share of the sound at the ear that comes through the mounts, 20 to 55 Hz, 5 vehicles of "
        "each fleet, median of the lines (section 2.4.2; thesis 90 to 95 by its literature) [%]",
        [_share_of(seed) for seed in CASES],
        digits=1,
    )


def _share_of(seed: int) -> float:
    bench, fleet, shares = load_bench(seed), load_fleet(seed), []
    torque = true_run(bench, PlannedRun(5, 220.0), FREQUENCY).engine_torque
    for name in VEHICLES:
        run = drive(bench, fleet.bodies[name], fleet.cabin, 5, torque, FREQUENCY)
        sound, _ = at_ears(run, CarErrors(), np.random.default_rng(seed))
        through, beside = np.abs(run.pressure), np.abs(sound - run.pressure)
        shares.append((through / (through + beside))[FREQUENCY <= 55.0])
    return 100 * float(np.median(shares))


def _spread() -> list[Claim]:
    force = true_run(load_bench(), PlannedRun(5, 220.0), FREQUENCY).path_force
    shipped = load_fleet(1)
    alike = [_median_spreads(shipped, names, force) for names in ALIKE.values()]
    drawn = {
        factor: [
            np.median(
                [
                    _median_spreads(load_fleet(seed, factor), names, force)
                    for names in ALIKE.values()
                ],
                axis=0,
            )
            for seed in CASES[1:]
        ]
        for factor in (1.0, LITERATURE_SCATTER)
    }
    middle = np.median(alike, axis=0)
    return [
        at_least(
            "spread over the five U06, one of which carries a battery: functions and SPL, median "
            "over the lines [dB] (figure 10; thesis 10 to 20 and 10 to 15)",
            10,
            _median_spreads(shipped, VEHICLES, force),
            1,
        ),
        at_least(
            f"the same over vehicles that are alike: {', '.join(ALIKE)}",
            10,
            np.concatenate(alike),
            1,
        ),
        over_draws(
            "the same in drawn fleets, median of those groups [dB]", [middle, *drawn[1.0]], digits=1
        ),
        over_draws(
            f"the same with bodies drawn wider, `--body-scatter {LITERATURE_SCATTER:g}` [dB]",
            [np.full(2, np.nan), *drawn[LITERATURE_SCATTER]],
            {0.5: 10.0},
            1,
            least=True,
        ),
    ]


def _median_spreads(fleet: BenchFleet, names: Sequence[str], force: ComplexArray) -> list[float]:
    """Find how far functions and levels of some vehicles spread, medians over the lines [dB]."""
    transfer = [noise_transfer(fleet.bodies[name], fleet.cabin, FREQUENCY) for name in names]
    sounds = [spl(np.sum(values * force, axis=1), FREQUENCY) for values in transfer]
    functions = [20 * np.log10(np.abs(values)) for values in transfer]
    return [level_spread(levels).quantile(0.5) for levels in (functions, sounds)]
