"""A short run over time: order components that ride on the tacho, other orders, and noise.

The run is so slow that every speed is a steady state of its own; amplitude and phase of each
channel change smoothly with the speed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.special import expit

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.campaign_operation import static_direction_forces, true_run
from deboom.bench.campaign_plan import CampaignErrors, TimeRunPlan
from deboom.bench.campaign_sensors import CampaignSensors, clean_channels
from deboom.bench.frozen import freeze_arrays
from deboom.bench.operating_run import OperatingRun
from deboom.bench.parameters import VirtualBench
from deboom.physics.orders import frequency_of_order

SPEED_STEP = 10.0
"""Between the steady states that a run passes through [rpm]."""

OTHER_ORDERS = ((0.5, 0.10, 0.7), (3.0, 0.30, -1.1), (6.0, 0.15, 2.0))
"""Engine order, amplitude per amplitude of the dominant order, and phase against it [rad]."""

ANALYSIS_SECONDS = 1.0
"""Record over which the noise of a channel falls to the floor of its order spectra [s]."""

PULSE_SHARE = 0.25
"""Share of a tacho period that its pulse takes [1]."""

EDGE_SAMPLES = 1.5
"""Width of a pulse's edges in samples [1]: the recorder's filter."""


@dataclass(frozen=True, eq=False)
class TimeSignals:
    """Everything recorded in one run over time, and its truth.

    Parameters
    ----------
    time : array, shape (n_sample,)
        [s].
    tacho : array, shape (n_sample,)
        Pulses from 0 to 1; the first rising edge is the origin of all phases.
    engine_torque : array, shape (n_sample,)
        [N m].
    acceleration, cell_force : array, shape (n_sample, n_channel)
        In sensor axes [m/s²], [N].
    static_force : array, shape (n_sample, n_channel)
        Quasi-static force of every direction [N].
    speed : array, shape (n_sample,)
        True engine speed [rpm].
    steady : OperatingRun
        True steady states that the run passes through, over the dominant order's frequency.
    steady_acceleration, steady_cell_force : array, shape (f, n_channel)
        Their channels without noise [m/s²], [N].
    """

    time: RealArray
    tacho: RealArray
    engine_torque: RealArray
    acceleration: RealArray
    cell_force: RealArray
    static_force: RealArray
    speed: RealArray
    steady: OperatingRun
    steady_acceleration: ComplexArray
    steady_cell_force: ComplexArray

    def __post_init__(self) -> None:
        freeze_arrays(self)


def record_over_time(
    bench: VirtualBench,
    sensors: CampaignSensors,
    plan: TimeRunPlan,
    errors: CampaignErrors,
    generator: np.random.Generator,
) -> TimeSignals:
    """Run up or down and record over time.

    Parameters
    ----------
    bench : VirtualBench
        With its mount set.
    sensors : CampaignSensors
        Of the bench.
    plan : TimeRunPlan
        Speeds, duration, sampling, tacho.
    errors : CampaignErrors
        Noise, and the flexibility of the bench.
    generator : Generator
        Draws the noise.

    Notes
    -----
    ``x(t) = Re Σ_q A_q(n(t)) e^{jqθ(t)}`` with the revolution angle θ, zero at the first pulse.
    """
    order = bench.order_torque.order
    low, high = sorted((plan.first_speed, plan.last_speed))
    rpm = np.arange(low, high + SPEED_STEP, SPEED_STEP)
    steady = true_run(bench, plan.run, frequency_of_order(rpm, order))
    acceleration, cell_force = clean_channels(sensors, steady, errors.chain)

    time = np.arange(round(plan.duration * plan.sample_rate)) / plan.sample_rate
    slope = (plan.last_speed - plan.first_speed) / plan.duration
    speed = plan.first_speed + slope * time
    turns = (plan.first_speed * time + slope * time**2 / 2) / 60
    # the record starts between two pulses
    angle = 2 * np.pi * (turns - 0.5 / plan.pulses_per_revolution)

    rotations = np.exp(1j * order * angle)
    for other, share, phase in OTHER_ORDERS:
        rotations = rotations + share * np.exp(1j * (other * angle + phase))
    chain = errors.chain
    per_floor = np.sqrt(plan.sample_rate * ANALYSIS_SECONDS) / 2
    torque = CubicSpline(rpm, steady.engine_torque)(speed)
    preload = CubicSpline(rpm, static_direction_forces(bench, steady))(speed)
    return TimeSignals(
        time=time,
        tacho=_pulses(angle, plan),
        engine_torque=torque + generator.normal(0, errors.torque, time.shape),
        acceleration=_signals(
            CubicSpline(rpm, acceleration)(speed),
            rotations,
            per_floor * chain.acceleration_floor,
            generator,
        ),
        cell_force=_signals(
            CubicSpline(rpm, cell_force)(speed),
            rotations,
            per_floor * chain.force_floor,
            generator,
        ),
        static_force=preload + generator.normal(0, errors.static_force, preload.shape),
        speed=speed,
        steady=steady,
        steady_acceleration=acceleration,
        steady_cell_force=cell_force,
    )


def _signals(
    amplitude: ComplexArray,
    rotations: ComplexArray,
    noise: float,
    generator: np.random.Generator,
) -> RealArray:
    clean = np.real(amplitude * rotations[:, None])
    return np.asarray(clean + generator.normal(0, noise, clean.shape))


def _pulses(angle: RealArray, plan: TimeRunPlan) -> RealArray:
    """One smooth pulse per tacho period; the middle of its rising edge is at the period's start."""
    period = 2 * np.pi / plan.pulses_per_revolution
    within = np.mod(angle / period + 0.5, 1.0) - 0.5
    edge = EDGE_SAMPLES * np.gradient(angle) / period
    return np.asarray(expit(within / edge) * expit((PULSE_SHARE - within) / edge))
