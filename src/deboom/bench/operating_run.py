"""True runs on rigid ground: motion, stiffness, force and moment of every mount."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.mount_law import (
    SuspendedBody,
    operating_stiffness,
    play_operator,
    static_deflection,
    static_forces,
)
from deboom.bench.powertrain import AXES, VirtualBench
from deboom.errors import InputError
from deboom.physics.forced_response import amplitude_dependent_response
from deboom.physics.order_tracking import rpm_of_frequency

TORQUE_AXIS = np.array([0.0, 0.0, 0.0, 0.0, 1.0, 0.0])
"""The crankshaft lies along y, and the bench drives forward: the reaction turns about +y."""

SIDES = ("left", "right")

CONVERGED = 1e-12
"""Largest relative change of an amplitude in the last iteration [1]."""

BEFORE_FALLING = 2.0
"""Engine torque before a falling run, per largest torque of the run: far enough above it that the
rubber comes from the loaded side and its hysteresis play is taken up [1]."""

RUBBER_RADIUS = 0.015
"""Radius of gyration of a mount's rubber about its virtual point, each axis [m]; judgement."""


@dataclass(frozen=True)
class PlannedRun:
    """One run over the lines of the dominant order.

    - `gear`: gear, from 1.
    - `torque`: limit of a full-load ramp, engine torque of a slice [N m].
    - `full_load`: ramp with wide open throttle; else a slice at constant torque.
    - `rising`: direction of the engine speed; a falling run comes from a higher torque.
    - raises InputError: a torque that is not positive.
    """

    gear: int
    torque: float
    full_load: bool = True
    rising: bool = True

    def __post_init__(self) -> None:
        if not self.torque > 0:
            raise InputError(f"a run needs an engine torque above 0 N m, not {self.torque}")

    @property
    def name(self) -> str:
        """Short key, such as ``g5_wot220``, ``g6_slice060`` or ``g5_wot220_falling``."""
        kind = "wot" if self.full_load else "slice"
        return f"g{self.gear}_{kind}{self.torque:03g}{'' if self.rising else '_falling'}"

    @property
    def title(self) -> str:
        """Title of a rising ramp, such as ``5th gear, full load, 220 Nm``."""
        ordinal = {1: "1st", 2: "2nd", 3: "3rd"}.get(self.gear, f"{self.gear}th")
        return f"{ordinal} gear, full load, {self.torque:.0f} Nm"


@dataclass(frozen=True, eq=False)
class BodyState:
    """Steady state of one suspended body over the lines of a run.

    Motion of the body (f, n_dof) [m, rad]; displacement [m], true complex stiffness [N/m] and
    static deflection without the hysteresis play [m] of each direction (f, n_direction).
    """

    motion: ComplexArray
    displacement: ComplexArray
    stiffness: ComplexArray
    static_deflection: RealArray

    @property
    def force(self) -> ComplexArray:
        """Dynamic force of each direction on the receiver [N]."""
        return self.stiffness * self.displacement


@dataclass(frozen=True, eq=False)
class OperatingRun:
    """The truth of one run; `channels` names the columns of displacement, stiffness and force.

    - `frequency` (f,): frequency of the engine order [Hz].
    - `engine_torque` (f,) [N m].
    - `powertrain`, `wheel_end`: steady states; the wheel end stands for both sides, which are
      alike.
    - `mount_names`: mounts of the powertrain in the order of its directions.
    """

    frequency: RealArray
    engine_torque: RealArray
    powertrain: BodyState
    wheel_end: BodyState
    mount_names: tuple[str, ...]

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of all directions, such as ``TSM x`` and ``Du left x``."""
        powertrain = [f"{mount} {axis}" for mount in self.mount_names for axis in AXES]
        return (*powertrain, *(f"Du {side} x" for side in SIDES))

    @property
    def displacement(self) -> ComplexArray:
        """Relative displacement at the virtual points, shape (f, n_channel) [m]."""
        return _with_both_sides(self.powertrain.displacement, self.wheel_end.displacement)

    @property
    def stiffness(self) -> ComplexArray:
        """Dynamic stiffness, shape (f, n_channel) [N/m]."""
        return _with_both_sides(self.powertrain.stiffness, self.wheel_end.stiffness)

    @property
    def force(self) -> ComplexArray:
        """Force on the receiver, shape (f, n_channel) [N]."""
        return _with_both_sides(self.powertrain.force, self.wheel_end.force)

    @property
    def path_force(self) -> ComplexArray:
        """Force into the body per path, both wishbone mounts summed, shape (f, n_path) [N]."""
        return np.hstack([self.powertrain.force, len(SIDES) * self.wheel_end.force])

    @property
    def moment(self) -> ComplexArray:
        """Moment of every powertrain mount on its receiver, shape (f, n_mount, 3) [N m].

        Rubber that lies around the virtual point, ρ per axis, turns with the powertrain::

            M = ρ² diag(k_y + k_z, k_z + k_x, k_x + k_y) θ

        The moments are below 1 % of the engine's and are not fed back into its motion.
        """
        stiffness = self.powertrain.stiffness.reshape(self.frequency.size, -1, 3)
        turning = stiffness.sum(axis=2, keepdims=True) - stiffness
        rotation = self.powertrain.motion[:, np.newaxis, 3:]
        return np.asarray(RUBBER_RADIUS**2 * turning * rotation)


def steady_state(
    body: SuspendedBody, static_load: RealArray, load: ComplexArray, frequency: RealArray
) -> BodyState:
    """Find the steady state of a body whose mounts feel preload and amplitude.

    Static load in the order of time, from rest, and complex peak amplitudes of the dynamic load,
    each (f, n_dof) [N, N m].

    Fixed point on the logarithm of the amplitudes; unique for this law from 1 µm to 5 mm.
    """
    forward = body.forward
    deflection = static_deflection(body, static_load)
    remembered = play_operator(deflection, body.play)

    def directions(amplitude: RealArray) -> ComplexArray:
        return operating_stiffness(body, remembered, amplitude, frequency)

    def matrix(amplitude: RealArray) -> ComplexArray:
        return np.asarray(np.einsum("ka,fk,kb->fab", forward, directions(amplitude), forward))

    state = amplitude_dependent_response(
        body.mass_matrix, matrix, load, frequency, forward, tolerance=CONVERGED
    )
    return BodyState(
        motion=state.displacement,
        displacement=state.displacement @ forward.T,
        stiffness=directions(state.amplitude),
        static_deflection=deflection,
    )


def total_ratio(bench: VirtualBench, gear: int) -> float:
    """Return engine speed over wheel speed in a gear from 1 [1]; any other gear is refused."""
    if not 1 <= gear <= len(bench.total_ratios):
        raise InputError(f"gear {gear}: the gearbox has the gears 1 to {len(bench.total_ratios)}")
    return bench.total_ratios[gear - 1]


def operate(
    bench: VirtualBench, gear: int, engine_torque: RealArray, frequency: RealArray
) -> OperatingRun:
    """Run the bench in one gear with a given torque at every line of the engine order.

    The engine torque (f,) [N m] is in the order of time, which is that of rising speed. A gear that
    does not exist is refused.
    """
    ratio = total_ratio(bench, gear)
    order_torque = bench.order_torque.torque(
        engine_torque, rpm_of_frequency(frequency, bench.order_torque.order)
    )
    wheel_torque = engine_torque * ratio
    powertrain = steady_state(
        bench.powertrain,
        np.outer(wheel_torque, TORQUE_AXIS),
        np.outer(order_torque, TORQUE_AXIS),
        frequency,
    )
    wheel_end = steady_state(
        bench.wheel_end,
        bench.driveline.preload(wheel_torque)[:, None],
        bench.driveline.load(order_torque, ratio, frequency)[:, None],
        frequency,
    )
    return OperatingRun(frequency, engine_torque, powertrain, wheel_end, bench.mount_names)


def true_run(bench: VirtualBench, planned: PlannedRun, frequency: RealArray) -> OperatingRun:
    """Run the bench as planned, in either direction of the speed.

    The frequency of the dominant order (f,) [Hz] increases, whichever way the speed goes. A gear
    that does not exist is refused.
    """
    torque = np.full(frequency.shape, planned.torque)
    if planned.full_load:
        rpm = rpm_of_frequency(frequency, bench.order_torque.order)
        torque = bench.ramp.torque(planned.torque, rpm)
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


def static_direction_forces(bench: VirtualBench, run: OperatingRun) -> RealArray:
    """Return the static force of every channel of a run, both sides, shape (f, n_channel) [N]."""
    powertrain = static_forces(bench.powertrain, run.powertrain.static_deflection)
    side = static_forces(bench.wheel_end, run.wheel_end.static_deflection)
    return np.hstack([powertrain, *[side] * len(SIDES)])


def _without_first_backwards(state: BodyState) -> BodyState:
    """Drop the line before a falling run and turn the others round."""
    return replace(
        state, **{field.name: getattr(state, field.name)[:0:-1] for field in fields(state)}
    )


def _with_both_sides(powertrain: ComplexArray, wheel_end: ComplexArray) -> ComplexArray:
    """Stack the channels of the powertrain and of both wheel ends."""
    return np.hstack([powertrain, *[wheel_end] * len(SIDES)])
