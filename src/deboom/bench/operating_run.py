"""True operating runs: motion, forces and moments at the mounts on rigid ground."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.frozen import freeze_arrays
from deboom.bench.mount_law import (
    SuspendedBody,
    operating_stiffness,
    play_operator,
    static_deflection,
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


@dataclass(frozen=True, eq=False)
class BodyState:
    """Steady state of one suspended body over the lines of a run.

    Parameters
    ----------
    motion : array, shape (f, n_dof)
        Of the body [m, rad].
    displacement : array, shape (f, n_direction)
        Of each direction of the mounts [m].
    stiffness : array, shape (f, n_direction)
        True complex dynamic stiffness [N/m].
    static_deflection : array, shape (f, n_direction)
        Without the hysteresis play [m].
    """

    motion: ComplexArray
    displacement: ComplexArray
    stiffness: ComplexArray
    static_deflection: RealArray

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def force(self) -> ComplexArray:
        """Dynamic force of each direction on the receiver [N]."""
        return self.stiffness * self.displacement


@dataclass(frozen=True, eq=False)
class OperatingRun:
    """The truth of one run.

    Parameters
    ----------
    frequency : array, shape (f,)
        Of the engine order [Hz].
    engine_torque : array, shape (f,)
        [N m].
    powertrain, wheel_end : BodyState
        The wheel end stands for both sides, which are alike.
    mount_names : tuple of str
        Of the powertrain, in the order of its directions.
    """

    frequency: RealArray
    engine_torque: RealArray
    powertrain: BodyState
    wheel_end: BodyState
    mount_names: tuple[str, ...]

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the columns of displacement, stiffness and force: every mount and piece."""
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


def _with_both_sides(powertrain: ComplexArray, wheel_end: ComplexArray) -> ComplexArray:
    return np.hstack([powertrain, *[wheel_end] * len(SIDES)])


def steady_state(
    body: SuspendedBody, static_load: RealArray, load: ComplexArray, frequency: RealArray
) -> BodyState:
    """Find the steady state of a body whose mounts feel preload and amplitude.

    Parameters
    ----------
    body : SuspendedBody
        The body and its mounts.
    static_load : array, shape (f, n_dof)
        In the order of time, from rest [N, N m].
    load : array, shape (f, n_dof)
        Complex peak amplitudes [N, N m].
    frequency : array, shape (f,)
        [Hz].

    Notes
    -----
    Fixed point on the logarithm of the amplitudes; unique for this law from 1 µm to 5 mm.
    """
    forward = body.forward
    deflection = static_deflection(body, static_load)
    remembered = play_operator(deflection, body.play)

    def directions(amplitude: RealArray) -> ComplexArray:
        return operating_stiffness(body, remembered, amplitude, frequency)

    def matrix(amplitude: RealArray) -> ComplexArray:
        stiffness = directions(amplitude)
        return np.asarray(np.einsum("ka,fk,kb->fab", forward, stiffness, forward))

    state = amplitude_dependent_response(
        body.mass_matrix, matrix, load, frequency, forward, tolerance=CONVERGED
    )
    return BodyState(
        motion=state.displacement,
        displacement=state.displacement @ forward.T,
        stiffness=directions(state.amplitude),
        static_deflection=deflection,
    )


def operate(
    bench: VirtualBench, gear: int, engine_torque: RealArray, frequency: RealArray
) -> OperatingRun:
    """Run the bench in one gear with a given torque at every line of the engine order.

    Parameters
    ----------
    bench : VirtualBench
        What runs.
    gear : int
        From 1.
    engine_torque : array, shape (f,)
        In the order of time, which is that of rising speed [N m].
    frequency : array, shape (f,)
        Of the dominant order [Hz].

    Returns
    -------
    OperatingRun
        The truth.

    Raises
    ------
    InputError
        No such gear.
    """
    if not 1 <= gear <= len(bench.total_ratios):
        raise InputError(f"gear {gear}: the gearbox has the gears 1 to {len(bench.total_ratios)}")
    ratio = bench.total_ratios[gear - 1]
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


def full_load_run(
    bench: VirtualBench, gear: int, torque_limit: float, frequency: RealArray
) -> OperatingRun:
    """Run up with wide open throttle and the engine torque limited to `torque_limit` [N m]."""
    rpm = rpm_of_frequency(frequency, bench.order_torque.order)
    return operate(bench, gear, bench.ramp.torque(torque_limit, rpm), frequency)


RUBBER_RADIUS = 0.015
"""Radius of gyration of a mount's rubber about its virtual point, each axis [m]; judgement."""


def mount_moments(run: OperatingRun) -> ComplexArray:
    """Find the moment of every powertrain mount on its receiver, about its virtual point.

    Parameters
    ----------
    run : OperatingRun
        The truth.

    Returns
    -------
    array, shape (f, n_mount, 3)
        [N m].

    Notes
    -----
    Rubber that lies around the virtual point, ρ per axis, turns with the powertrain::

        M = ρ² diag(k_y + k_z, k_z + k_x, k_x + k_y) θ

    The moments are below 1 % of the engine's and are not fed back into its motion.
    """
    stiffness = run.powertrain.stiffness.reshape(run.frequency.size, -1, 3)
    turning = stiffness.sum(axis=2, keepdims=True) - stiffness
    rotation = run.powertrain.motion[:, np.newaxis, 3:]
    return np.asarray(RUBBER_RADIUS**2 * turning * rotation)
