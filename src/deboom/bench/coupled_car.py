"""The car: powertrain and wheel ends on their mounts, on a body that gives way."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.fleet import Body, Cabin
from deboom.bench.interfaces import (
    EARS,
    interface_shapes,
    local_flexibility,
    panel_pressure,
)
from deboom.bench.mount_law import operating_stiffness, play_operator, static_deflection
from deboom.bench.operating_run import SIDES, TORQUE_AXIS, total_ratio
from deboom.bench.powertrain import AXES, VirtualBench
from deboom.bench.signals import complex_normal, ripple
from deboom.physics.order_tracking import rpm_of_frequency

CONVERGED = 1e-11
"""Largest change of the logarithm of an amplitude in the last iteration [1]."""

MOST_ITERATIONS = 100


@dataclass(frozen=True)
class CarErrors:
    """What makes the car another one than bench and noise transfer functions say.

    - `mount_stiffness`: factor on every dynamic stiffness: the mounts are warmer than on the bench
      [1].
    - `other_paths`: pressure over paths that nobody measured: air, shafts, exhaust; rms over the
      lines against that of the mounts [1].
    - `n_ripple`: cosines over the band that make it up.
    - `torque`: standard deviation of the engine torque against the bench [1].
    - `microphone_floor`: deviation of real and imaginary part [Pa].
    """

    mount_stiffness: float = 0.97
    other_paths: float = 0.06
    n_ripple: int = 10
    torque: float = 0.01
    microphone_floor: float = 1e-3


NO_CAR_ERRORS = CarErrors(1.0, 0.0, 10, 0.0, 0.0)
"""A car that differs from the bench by its flexible body alone."""


@dataclass(frozen=True, eq=False)
class CoupledRun:
    """The truth of one run in the car; channels as in `OperatingRun.channels`.

    - `frequency`, `engine_torque` (f,): [Hz], [N m].
    - `powertrain` (f, 6): motion at the centre of gravity [m, rad].
    - `wheel_ends` (f, n_side): motion along x [m].
    - `modes` (f, n_mode): modal coordinates of the body [m kg^½].
    - `deflection`, `stiffness`, `force` (f, n_channel): deflection and stiffness of each mount, and
      its force on the body [m], [N/m], [N].
    - `body_motion` (f, n_interface, 6): motion of the body at the virtual points [m, rad].
    - `pressure` (f, n_ear): pressure through the mounts [Pa].
    """

    frequency: RealArray
    engine_torque: RealArray
    powertrain: ComplexArray
    wheel_ends: ComplexArray
    modes: ComplexArray
    deflection: ComplexArray
    stiffness: ComplexArray
    force: ComplexArray
    body_motion: ComplexArray
    pressure: ComplexArray

    @property
    def path_force(self) -> ComplexArray:
        """Force into the body per path, both wishbone mounts summed, shape (f, n_path) [N]."""
        sides = self.force[:, -len(SIDES) :].sum(axis=1, keepdims=True)
        return np.hstack([self.force[:, : -len(SIDES)], sides])


def drive(
    bench: VirtualBench,
    body: Body,
    cabin: Cabin,
    gear: int,
    engine_torque: RealArray,
    frequency: RealArray,
    mount_stiffness: float = 1.0,
) -> CoupledRun:
    """Solve powertrain, mounts and flexible body together.

    - `bench`, `body`, `cabin`: powertrain, wheel ends and their mounts; body and air of the
      vehicle.
    - `gear`: gear, from 1.
    - `engine_torque`, `frequency` (f,): engine torque in the order of rising speed [N m], and
      frequency of the dominant order [Hz].
    - `mount_stiffness`: factor on every dynamic stiffness [1].
    - raises InputError, ArithmeticError: no such gear; amplitudes that do not settle.

    Equations of motion of the powertrain (6), the wheel ends (2) and the body's modes. A mount acts
    in series with the local flexibility of the body, ``1/K' = 1/K + 1/k_local``, on the relative
    motion, and its stiffness belongs to the amplitude of its own deflection ``K' δ/K``. Static
    deflections are those on the bench: a body gives way little under a static torque.
    """
    ratio = total_ratio(bench, gear)
    rpm = rpm_of_frequency(frequency, bench.order_torque.order)
    order_torque = bench.order_torque.torque(engine_torque, rpm)
    n_side, n_rigid = len(SIDES), TORQUE_AXIS.size
    wheel_load = bench.driveline.load(order_torque, ratio, frequency)
    load = np.zeros((frequency.size, n_rigid + n_side + body.frequencies.size), dtype=complex)
    load[:, :n_rigid] = np.outer(order_torque, TORQUE_AXIS)
    load[:, n_rigid : n_rigid + n_side] = wheel_load[:, None]

    relative, flexibility = _relative_motion(bench, body)
    impedance = _without_mounts(bench, body, frequency)
    remembered = _static_states(bench, engine_torque * ratio)
    log_amplitude = np.full((frequency.size, len(relative)), np.log(1e-4))
    for _ in range(MOST_ITERATIONS):
        stiffness = mount_stiffness * _stiffness(
            bench, remembered, np.exp(log_amplitude), frequency
        )
        in_series = stiffness / (1 + stiffness * flexibility)
        matrix = impedance + (relative.T * in_series[:, None, :]) @ relative
        motion: ComplexArray = np.asarray(np.linalg.solve(matrix, load[..., None])[..., 0], complex)
        force = in_series * (motion @ relative.T)
        deflection = force / stiffness
        change = np.log(np.abs(deflection)) - log_amplitude
        log_amplitude = log_amplitude + change
        if np.max(np.abs(change)) < CONVERGED:
            break
    else:
        raise ArithmeticError(f"amplitudes do not settle within {MOST_ITERATIONS} iterations")
    modes = motion[:, n_rigid + n_side :]
    to_ears = panel_pressure(cabin, frequency) @ body.shapes_at_panels.T
    return CoupledRun(
        frequency=frequency,
        engine_torque=engine_torque,
        powertrain=motion[:, :n_rigid],
        wheel_ends=motion[:, n_rigid : n_rigid + n_side],
        modes=modes,
        deflection=deflection,
        stiffness=stiffness,
        force=force,
        body_motion=_body_motion(body, modes, force),
        pressure=np.einsum("fen,fn->fe", to_ears, modes),
    )


def at_ears(
    run: CoupledRun, errors: CarErrors, generator: np.random.Generator
) -> tuple[ComplexArray, ComplexArray]:
    """Return the pressure at the ears (f, n_ear) with all paths, and as it is measured [Pa]."""
    n_line, n_ear = run.frequency.size, len(EARS)
    smooth = ripple(n_line, errors.n_ripple, n_ear, generator)
    rms = np.sqrt(np.mean(np.abs(run.pressure) ** 2, axis=0))
    true = run.pressure + errors.other_paths * rms * smooth
    return true, true + errors.microphone_floor * complex_normal((n_line, n_ear), generator)


def _relative_motion(bench: VirtualBench, body: Body) -> tuple[RealArray, RealArray]:
    """Motion of everything → source minus body per channel; the body's local flexibility."""
    shapes, local = interface_shapes(body), local_flexibility(body)
    n_mount, n_side = len(bench.mount_names), len(SIDES)
    on_body = np.concatenate(
        [shapes[:, :n_mount, : len(AXES)].reshape(len(shapes), -1), shapes[:, n_mount:, 0]], axis=1
    )
    forward = bench.powertrain.forward
    source = np.zeros((len(forward) + n_side, forward.shape[1] + n_side))
    source[: len(forward), : forward.shape[1]] = forward
    source[len(forward) :, forward.shape[1] :] = np.eye(n_side)
    flexibility = np.concatenate([local[:n_mount].ravel(), local[n_mount:, 0]])
    return np.hstack([source, -on_body.T]), flexibility


def _without_mounts(bench: VirtualBench, body: Body, frequency: RealArray) -> ComplexArray:
    """Dynamic stiffness of powertrain, wheel ends and modes side by side, (f, n, n)."""
    n_rigid, n_side = bench.powertrain.mass_matrix.shape[0], len(SIDES)
    n = n_rigid + n_side + body.frequencies.size
    squared = (2 * np.pi * frequency) ** 2
    mass = np.zeros((n, n))
    mass[:n_rigid, :n_rigid] = bench.powertrain.mass_matrix
    for side in range(n_rigid, n_rigid + n_side):
        mass[side, side] = bench.wheel_end.mass_matrix[0, 0]
    matrix = (-squared[:, None, None] * mass).astype(complex)
    modes = np.arange(n_rigid + n_side, n)
    matrix[:, modes, modes] = 1 / body.modal_receptance(frequency)
    return matrix


def _static_states(bench: VirtualBench, wheel_torque: RealArray) -> tuple[RealArray, RealArray]:
    """Deflections that powertrain mounts and wishbone mounts remember."""
    powertrain = static_deflection(bench.powertrain, np.outer(wheel_torque, TORQUE_AXIS))
    wheel_end = static_deflection(
        bench.wheel_end, bench.driveline.preload(wheel_torque)[:, np.newaxis]
    )
    return (
        play_operator(powertrain, bench.powertrain.play),
        play_operator(wheel_end, bench.wheel_end.play),
    )


def _stiffness(
    bench: VirtualBench,
    remembered: tuple[RealArray, RealArray],
    amplitude: RealArray,
    frequency: RealArray,
) -> ComplexArray:
    """Dynamic stiffness of all channels at their amplitudes, shape (f, n_channel) [N/m]."""
    n_side = len(SIDES)
    powertrain = operating_stiffness(
        bench.powertrain, remembered[0], amplitude[:, :-n_side], frequency
    )
    sides = [
        operating_stiffness(bench.wheel_end, remembered[1], amplitude[:, [column]], frequency)
        for column in range(-n_side, 0)
    ]
    return np.hstack([powertrain, *sides])


def _body_motion(body: Body, modes: ComplexArray, force: ComplexArray) -> ComplexArray:
    """Motion of the interfaces: modes, and the patch that each mount pushes in."""
    motion: ComplexArray = np.einsum("fn,nia->fia", modes, interface_shapes(body))
    local = local_flexibility(body)
    n_side = len(SIDES)
    mounts = force[:, :-n_side].reshape(len(force), -1, len(AXES))
    motion[:, : mounts.shape[1], : len(AXES)] += local[:-n_side] * mounts
    motion[:, -n_side:, 0] += local[-n_side:, 0] * force[:, -n_side:]
    return motion
