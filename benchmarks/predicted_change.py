"""Predicted changes against those of the flexible cars of drawn benches, with and without bodies.

Run it with the seeds of fleets: ``python benchmarks/predicted_change.py 4001 4020``. Each draws a
powertrain, a fleet and its measurements, goes to a good design by the model's gradient, and drives
today's and the new parts in every car of the group, solved with the body's modes by the bench. It
prints a table: seed, car, whether receptances were there, predicted and true change, and the
standard deviation over repeated measurements [dB].

Fleets 3001 to 3020, 4001 to 4020 and 7001 to 7044 are for choosing the constants of
`deboom.vehicles.predicted_change`. The last were named here before they were drawn, to judge a
constant of 0.03 dB that had been chosen on the others: with bodies at rest its 90 % intervals held
78 % of 220 true changes, with receptances 92 %. So what the model leaves out grows with the change,
and they were given up to choosing. Fleets 8001 to 8044 judge what was chosen then: they are named
here before any is drawn, and no constant may be chosen after a look at them.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from deboom.arrays import RealArray
from deboom.bench.fleet import load_fleet
from deboom.bench.layout import FREQUENCY
from deboom.bench.operating_run import drive
from deboom.bench.platform_writer import write_platform
from deboom.bench.powertrain import load_bench
from deboom.files.platform import read_platform
from deboom.files.uncertain_index import uncertain_index
from deboom.physics.order_tracking import rpm_of_frequency
from deboom.physics.sound_level import spl
from deboom.vehicles.booming_model import BoomingModel, Motion, booming_model
from deboom.vehicles.fleet import Fleet

GROUP, CASE, GEAR, TORQUE, BAND = "U06", "g5_wot220", 5, 220.0, (20.0, 60.0)
TRUTH = 20_000
"""Added to the seed of a fleet for that of its powertrain."""
JUDGES = range(8001, 8045)
"""Fleets on which nothing may be chosen."""
DRAWS, STEPS, PATHS = 16, 25, 10


def better(model: BoomingModel) -> RealArray:
    """Step along the signs of the gradient of the group's mean level, within 20 %."""
    design = np.ones(len(model.variable_names))
    for step in range(STEPS):
        slope = model.gradient(design[np.newaxis])[0].mean(axis=0)
        slope[PATHS:] = 0.0
        design = np.clip(design - 0.08 / (1.0 + step / 8.0) * np.sign(slope), 0.8, 1.2)
    return design


def changes(seed: int) -> Iterator[dict[str, object]]:
    """Predict and drive one fleet."""
    with tempfile.TemporaryDirectory() as folder:
        path = write_platform(Path(folder) / "p", seed, truth_seed=TRUTH + seed, receptance=True)
        platform = read_platform(path)
    bench, drawn = load_bench(TRUTH + seed), load_fleet(seed)
    lines = FREQUENCY[(BAND[0] <= FREQUENCY) & (BAND[1] >= FREQUENCY)]
    torque = bench.ramp.torque(TORQUE, rpm_of_frequency(lines, bench.order_torque.order))
    group = platform.fleet.group(GROUP)
    at_rest = Fleet(tuple(replace(vehicle, receptance=None) for vehicle in group.vehicles))
    for receptance, fleet in ((False, at_rest), (True, group)):
        model = booming_model(
            fleet,
            platform.mounts,
            [(platform.load_case(CASE), 1.0)],
            BAND,
            motion=Motion.coupled,
            powertrain=platform.powertrain,
        )
        design = better(model)
        both = np.stack([np.ones_like(design), design])
        predicted = np.diff(model(both) / model.n_lines, axis=0)[0]
        again = uncertain_index(model, replace(platform, fleet=fleet), ()).draws(DRAWS, 1)
        repeats = [np.diff(draw(both) / model.n_lines, axis=0)[0] for draw in again]
        deviation = np.std(repeats, axis=0, ddof=1)
        factors = np.append(design[: PATHS - 1], [design[PATHS - 1]] * 2)
        for place, car in enumerate(fleet.names):
            body = drawn.bodies[car]
            runs = [
                drive(bench, body, drawn.cabin, GEAR, torque, lines, mount_stiffness=scale)
                for scale in (np.ones_like(factors), factors)
            ]
            levels = [float(spl(run.pressure[:, 0], lines, axis=-1).mean()) for run in runs]
            yield {
                "seed": seed,
                "car": car,
                "receptance": receptance,
                "predicted [dB]": float(predicted[place]),
                "true [dB]": levels[1] - levels[0],
                "deviation [dB]": float(deviation[place]),
            }


if __name__ == "__main__":
    first, last = map(int, sys.argv[1:3])
    rows = [row for seed in range(first, last + 1) for row in changes(seed)]
    pd.DataFrame(rows).round(4).to_csv(sys.stdout, index=False)
