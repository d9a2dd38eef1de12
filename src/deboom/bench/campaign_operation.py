"""What really happens on the bench in one planned run, in either direction of the speed."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np

from deboom.arrays import RealArray
from deboom.bench.campaign_plan import PlannedRun
from deboom.bench.operating_run import BodyState, OperatingRun, operate
from deboom.bench.parameters import VirtualBench
from deboom.bench.suspended_body import static_forces
from deboom.physics.orders import rpm_of_frequency

BEFORE_FALLING = 2.0
"""Engine torque before a falling run, per largest torque of the run: far enough above it that the
rubber comes from the loaded side and its hysteresis play is taken up [1]."""


def true_run(bench: VirtualBench, planned: PlannedRun, frequency: RealArray) -> OperatingRun:
    """Run the bench as planned.

    Parameters
    ----------
    bench : VirtualBench
        With its mount set.
    planned : PlannedRun
        Gear, torque, direction.
    frequency : array, shape (f,)
        Of the dominant order, increasing [Hz].

    Returns
    -------
    OperatingRun
        The truth over `frequency`, whichever way the speed went.

    Raises
    ------
    InputError
        No such gear.
    """
    torque = engine_torque(bench, planned, frequency)
    if planned.rising:
        return operate(bench, planned.gear, torque, frequency)
    before = BEFORE_FALLING * torque.max()
    in_time = operate(
        bench,
        planned.gear,
        np.concatenate([[before], torque[::-1]]),
        np.concatenate([frequency[-1:], frequency[::-1]]),
    )
    return replace(
        in_time,
        frequency=frequency,
        engine_torque=torque,
        powertrain=_without_first_backwards(in_time.powertrain),
        wheel_end=_without_first_backwards(in_time.wheel_end),
    )


def engine_torque(bench: VirtualBench, planned: PlannedRun, frequency: RealArray) -> RealArray:
    """Return the engine torque of a planned run at every line [N m]."""
    if not planned.full_load:
        return np.full(frequency.shape, planned.torque)
    rpm = rpm_of_frequency(frequency, bench.order_torque.order)
    return bench.ramp.torque(planned.torque, rpm)


def static_direction_forces(bench: VirtualBench, run: OperatingRun) -> RealArray:
    """Return the static force of every channel of a run, both sides, shape (f, n_channel) [N]."""
    powertrain = static_forces(bench.powertrain, run.powertrain.static_deflection)
    side = static_forces(bench.wheel_end, run.wheel_end.static_deflection)
    n_side = len(run.channels) - powertrain.shape[1]
    return np.hstack([powertrain, *[side] * n_side])


def _without_first_backwards(state: BodyState) -> BodyState:
    return replace(
        state, **{field.name: getattr(state, field.name)[:0:-1] for field in fields(state)}
    )
