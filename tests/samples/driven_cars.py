"""What a design is predicted to change in drawn cars, and what it does in their bench.

The cars of one group, coupled motion; today's and the new parts are driven in every car, which the
bench solves with the modes of its body.
"""

from __future__ import annotations

import numpy as np

from deboom.arrays import RealArray
from deboom.bench.fleet import BenchFleet
from deboom.bench.layout import FREQUENCY
from deboom.bench.operating_run import drive
from deboom.bench.powertrain import VirtualBench
from deboom.physics.order_tracking import rpm_of_frequency
from deboom.physics.sound_level import spl
from deboom.vehicles.booming_model import BoomingModel, Motion, booming_model
from deboom.vehicles.fleet import Fleet
from deboom.vehicles.platform import Platform

GROUP, CASE, GEAR, TORQUE, BAND = "U06", "g5_wot220", 5, 220.0, (20.0, 60.0)
STEPS, PATHS = 25, 10


def coupled_model(platform: Platform, fleet: Fleet) -> BoomingModel:
    """Return the model of cars of a platform in `CASE`."""
    return booming_model(
        fleet,
        platform.mounts,
        [(platform.load_case(CASE), 1.0)],
        BAND,
        motion=Motion.coupled,
        powertrain=platform.powertrain,
    )


def quieter_design(model: BoomingModel) -> RealArray:
    """Step along the signs of the gradient of the mean level of all cars, within 20 %."""
    design = np.ones(len(model.variable_names))
    for step in range(STEPS):
        slope = model.gradient(design[np.newaxis])[0].mean(axis=0)
        slope[PATHS:] = 0.0
        design = np.clip(design - 0.08 / (1.0 + step / 8.0) * np.sign(slope), 0.8, 1.2)
    return design


def predicted_change(model: BoomingModel, design: RealArray) -> RealArray:
    """Return the change of the mean level of each car against today's design, (v,) [dB]."""
    both = np.stack([np.ones_like(design), design])
    return np.asarray(np.diff(model(both) / model.n_lines, axis=0)[0])


def driven_change(
    bench: VirtualBench, drawn: BenchFleet, cars: tuple[str, ...], design: RealArray
) -> RealArray:
    """Return the same of cars that are driven in the bench, (v,) [dB]."""
    lines = FREQUENCY[(BAND[0] <= FREQUENCY) & (BAND[1] >= FREQUENCY)]
    torque = bench.ramp.torque(TORQUE, rpm_of_frequency(lines, bench.order_torque.order))
    factors = np.append(design[: PATHS - 1], [design[PATHS - 1]] * 2)

    def level(car: str, scale: RealArray) -> float:
        body = drawn.bodies[car]
        run = drive(bench, body, drawn.cabin, GEAR, torque, lines, mount_stiffness=scale)
        return float(spl(run.pressure[:, 0], lines, axis=-1).mean())

    return np.array([level(car, factors) - level(car, np.ones_like(factors)) for car in cars])
