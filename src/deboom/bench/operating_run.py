"""True runs on rigid ground and in the car: motion, stiffness and force of every mount."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import TypeVar

import numpy as np
from scipy.linalg import block_diag

from deboom.arrays import AXES, ComplexArray, RealArray
from deboom.bench import fleet
from deboom.bench.powertrain import (
    SIDES,
    TORQUE_AXIS,
    SuspendedBody,
    VirtualBench,
    operating_stiffness,
    play_operator,
    static_deflection,
    static_forces,
)
from deboom.bench.signals import complex_normal, ripple
from deboom.errors import InputError
from deboom.physics.forced_response import amplitude_dependent_response
from deboom.physics.order_tracking import rpm_of_frequency

Values = TypeVar("Values", RealArray, ComplexArray)

CONVERGED = 1e-12
"""Largest relative change of an amplitude in the last iteration [1]."""

BEFORE_FALLING = 2.0
"""Engine torque before a falling run, per largest torque of the run: far enough above it that the
rubber comes from the loaded side and its hysteresis play is taken up [1]."""


@dataclass(frozen=True)
class PlannedRun:
    """One run over the lines of the dominant order.

    - `gear`: gear, from 1.
    - `torque`: limit of a full-load ramp, engine torque of a slice [N m].
    - `full_load`: ramp with wide open throttle; else a slice at constant torque.
    - `rising`: direction of the engine speed; a falling run comes from a higher torque.
    """

    gear: int
    torque: float
    full_load: bool = True
    rising: bool = True

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


@dataclass(frozen=True)
class PlannedIdle:
    """One run at idle, on the lines of the orders 0.5 to 6.

    - `speed`: of the engine [1/min].
    - `gear`: gear from 1, engaged through a converter.
    - `torque`: of the engine against the converter [N m].
    """

    speed: float = 900.0
    gear: int = 1
    torque: float = 25.0

    name = "idle"

    @property
    def title(self) -> str:
        """Title, such as ``idle in drive, 900 rpm``."""
        return f"idle in drive, {self.speed:g} rpm"

    @property
    def frequency(self) -> RealArray:
        """Line of each order, shape (12,) [Hz]."""
        return np.asarray(IDLE_ORDERS * self.speed / 60.0)


IDLE_ORDERS = np.arange(1, 13) / 2.0
"""Orders of idle [1]."""
THROTTLED = 0.15
"""Gas torque at idle over that of the fit, which belongs to full load: a manifold at 0.3 bar in
place of 2 bar [1]; judgement."""
FIRING_HARMONICS = {1: 1.0, 2: 0.4, 3: 0.2, 4: 0.1}
"""Torque of each multiple of the firing order over that of the firing order [1]; judgement."""
UNEVEN_FIRING = (0.02, 0.08)
"""Bounds of the same of all other orders: cylinders burn unevenly at idle [1]; judgement."""


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

    Displacement and force are in vehicle axes, the stiffness is along the axes of the mounts.

    - `frequency` (f,): frequency of the engine order [Hz].
    - `engine_torque` (f,) [N m].
    - `powertrain`, `wheel_end`: steady states; the wheel end stands for both sides, which are
      alike.
    - `mount_names`: mounts of the powertrain in the order of its directions.
    - `turn` (n, n): their directions → vehicle axes; None where no mount is tilted.
    """

    frequency: RealArray
    engine_torque: RealArray
    powertrain: BodyState
    wheel_end: BodyState
    mount_names: tuple[str, ...]
    turn: RealArray | None = None

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of all directions, such as ``TSM x`` and ``Du left x``."""
        powertrain = [f"{mount} {axis}" for mount in self.mount_names for axis in AXES]
        return (*powertrain, *(f"Du {side} x" for side in SIDES))

    @property
    def displacement(self) -> ComplexArray:
        """Relative displacement at the virtual points, shape (f, n_channel) [m]."""
        moved = in_vehicle_axes(self.powertrain.displacement, self.turn)
        return _with_both_sides(moved, self.wheel_end.displacement)

    @property
    def powertrain_force(self) -> ComplexArray:
        """Force of the powertrain's mounts on the receiver, (f, n_direction) [N]."""
        return in_vehicle_axes(self.powertrain.force, self.turn)

    @property
    def stiffness(self) -> ComplexArray:
        """Dynamic stiffness, shape (f, n_channel) [N/m]."""
        return _with_both_sides(self.powertrain.stiffness, self.wheel_end.stiffness)

    @property
    def force(self) -> ComplexArray:
        """Force on the receiver, shape (f, n_channel) [N]."""
        return _with_both_sides(self.powertrain_force, self.wheel_end.force)

    @property
    def path_force(self) -> ComplexArray:
        """Force into the body per path, both wishbone mounts summed, shape (f, n_path) [N]."""
        return np.hstack([self.powertrain_force, len(SIDES) * self.wheel_end.force])


def in_vehicle_axes(values: Values, turn: RealArray | None) -> Values:
    """Turn values (f, n_direction) along the axes of the mounts into vehicle axes."""
    return values if turn is None else values @ turn.T


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

    Engine torque [N m] and frequency [Hz], each (f,), are in the order of time. A gear that does
    not exist is refused.
    """
    rpm = rpm_of_frequency(frequency, bench.order_torque.order)
    return _shaken(
        bench,
        gear,
        engine_torque,
        frequency,
        bench.order_torque.torque(engine_torque, rpm),
        bench.dynamic_load(engine_torque, rpm),
    )


def idle_run(
    bench: VirtualBench, planned: PlannedIdle, generator: np.random.Generator
) -> OperatingRun:
    """Run the bench at idle: every order shakes it at a line of its own.

    - `generator`: of the orders beside those of firing, and of all phases.
    """
    frequency = planned.frequency
    torque, rpm = np.full(frequency.size, planned.torque), np.full(frequency.size, planned.speed)
    multiples = IDLE_ORDERS / bench.order_torque.order
    low, high = np.log(UNEVEN_FIRING)
    uneven = np.exp(generator.uniform(low, high, IDLE_ORDERS.size))
    shares = np.array([FIRING_HARMONICS.get(m, u) for m, u in zip(multiples, uneven, strict=True)])
    phases = np.where(multiples == 1.0, 0.0, generator.uniform(-np.pi, np.pi, IDLE_ORDERS.size))
    order_torque = THROTTLED * bench.order_torque.torque(torque, rpm)
    order_torque = order_torque * shares * np.exp(1j * phases)
    load: ComplexArray = np.outer(order_torque, TORQUE_AXIS)
    if bench.reciprocating is not None:
        load[multiples == 1.0] += bench.reciprocating.load(rpm)[multiples == 1.0]
    return _shaken(bench, planned.gear, torque, frequency, order_torque, load)


def _shaken(
    bench: VirtualBench,
    gear: int,
    engine_torque: RealArray,
    frequency: RealArray,
    order_torque: ComplexArray,
    load: ComplexArray,
) -> OperatingRun:
    """Shake the bench by the order torque (f,) [N m] and the load on its powertrain (f, 6)."""
    ratio = total_ratio(bench, gear)
    wheel_torque = engine_torque * ratio
    powertrain = steady_state(
        bench.powertrain, np.outer(wheel_torque, TORQUE_AXIS), load, frequency
    )
    wheel_end = steady_state(
        bench.wheel_end,
        bench.driveline.preload(wheel_torque)[:, None],
        bench.driveline.load(order_torque, ratio, frequency)[:, None],
        frequency,
    )
    names = bench.mount_names
    return OperatingRun(frequency, engine_torque, powertrain, wheel_end, names, bench.turn)


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
    along = static_forces(bench.powertrain, run.powertrain.static_deflection)
    powertrain = in_vehicle_axes(along, bench.turn)
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


LOG_CONVERGED = 1e-11
"""Largest change of the logarithm of an amplitude in the last iteration [1]."""

MOST_ITERATIONS = 100


@dataclass(frozen=True)
class CarErrors:
    """What makes the car another one than bench and noise transfer functions say.

    - `mount_stiffness`, `mount_loss`: factor on every dynamic stiffness, and on its loss factor, of
      all channels or of each: the mounts are warmer than on the bench [1].
    - `other_paths`: pressure over paths that nobody measured: air, shafts, exhaust; rms over the
      lines against that of the mounts [1].
    - `n_ripple`: cosines over the band that make it up.
    - `torque`: standard deviation of the engine torque against the bench [1].
    - `microphone_floor`: deviation of real and imaginary part [Pa].
    """

    mount_stiffness: float | RealArray = 0.97
    other_paths: float = 0.06
    n_ripple: int = 10
    torque: float = 0.01
    microphone_floor: float = 1e-3
    mount_loss: float | RealArray = 1.0


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
    body: fleet.Body,
    cabin: fleet.Cabin,
    gear: int,
    engine_torque: RealArray,
    frequency: RealArray,
    mount_stiffness: float | RealArray = 1.0,
    mount_loss: float | RealArray = 1.0,
) -> CoupledRun:
    """Solve powertrain, mounts and flexible body together.

    - `bench`, `body`, `cabin`: powertrain, wheel ends and their mounts; body and air of the
      vehicle.
    - `gear`: gear, from 1.
    - `engine_torque`, `frequency` (f,): engine torque in the order of rising speed [N m], and
      frequency of the dominant order [Hz].
    - `mount_stiffness`, `mount_loss`: factor on every dynamic stiffness, and on its loss factor, of
      all channels or of each (n_channel,) [1].
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
    load[:, :n_rigid] = bench.dynamic_load(engine_torque, rpm)
    load[:, n_rigid : n_rigid + n_side] = wheel_load[:, None]

    relative, flexibility = _relative_motion(bench, body)
    turn = _turn_of_all(bench, len(relative))
    impedance = _without_mounts(bench, body, frequency)
    remembered = _static_states(bench, engine_torque * ratio)
    log_amplitude = np.full((frequency.size, len(relative)), np.log(1e-4))
    for _ in range(MOST_ITERATIONS):
        stiffness = mount_stiffness * _stiffness(
            bench, remembered, np.exp(log_amplitude), frequency
        )
        stiffness.imag *= mount_loss
        if turn is None:
            in_series = stiffness / (1 + stiffness * flexibility)
            matrix = impedance + (relative.T * in_series[:, None, :]) @ relative
        else:
            # the body gives way along its own axes, the mounts along theirs
            gives_way = np.eye(len(relative)) / stiffness[:, None, :]
            joined = np.linalg.inv(gives_way + (turn.T * flexibility) @ turn)
            matrix = impedance + relative.T @ joined @ relative
        motion: ComplexArray = np.asarray(np.linalg.solve(matrix, load[..., None])[..., 0], complex)
        moved = motion @ relative.T
        force = in_series * moved if turn is None else (joined @ moved[..., None])[..., 0]
        deflection = force / stiffness
        change = np.log(np.abs(deflection)) - log_amplitude
        log_amplitude = log_amplitude + change
        if np.max(np.abs(change)) < LOG_CONVERGED:
            break
    else:
        raise ArithmeticError(f"amplitudes do not settle within {MOST_ITERATIONS} iterations")
    modes = motion[:, n_rigid + n_side :]
    force, deflection = in_vehicle_axes(force, turn), in_vehicle_axes(deflection, turn)
    to_ears = fleet.panel_pressure(cabin, frequency) @ body.shapes_at_panels.T
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
    n_line, n_ear = run.frequency.size, len(fleet.EARS)
    smooth = ripple(n_line, errors.n_ripple, n_ear, generator)
    rms = np.sqrt(np.mean(np.abs(run.pressure) ** 2, axis=0))
    true = run.pressure + errors.other_paths * rms * smooth
    return true, true + errors.microphone_floor * complex_normal((n_line, n_ear), generator)


def _relative_motion(bench: VirtualBench, body: fleet.Body) -> tuple[RealArray, RealArray]:
    """Motion of everything → source minus body per channel; the body's local flexibility."""
    shapes, local = fleet.interface_shapes(body), fleet.local_flexibility(body)
    n_mount, n_side = len(bench.mount_names), len(SIDES)
    on_body = np.concatenate(
        [shapes[:, :n_mount, : len(AXES)].reshape(len(shapes), -1), shapes[:, n_mount:, 0]], axis=1
    )
    forward = bench.powertrain.forward
    if bench.turn is not None:
        n = len(forward)
        on_body = np.hstack([on_body[:, :n] @ bench.turn, on_body[:, n:]])
    source = np.zeros((len(forward) + n_side, forward.shape[1] + n_side))
    source[: len(forward), : forward.shape[1]] = forward
    source[len(forward) :, forward.shape[1] :] = np.eye(n_side)
    flexibility = np.concatenate([local[:n_mount].ravel(), local[n_mount:, 0]])
    return np.hstack([source, -on_body.T]), flexibility


def _turn_of_all(bench: VirtualBench, n_channel: int) -> RealArray | None:
    """Directions of all mounts → vehicle axes; wheel ends move along x as they are."""
    if bench.turn is None:
        return None
    return np.asarray(block_diag(bench.turn, np.eye(n_channel - len(bench.turn))))


def _without_mounts(bench: VirtualBench, body: fleet.Body, frequency: RealArray) -> ComplexArray:
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


def _body_motion(body: fleet.Body, modes: ComplexArray, force: ComplexArray) -> ComplexArray:
    """Motion of the interfaces: modes, and the patch that each mount pushes in."""
    motion: ComplexArray = np.einsum("fn,nia->fia", modes, fleet.interface_shapes(body))
    local = fleet.local_flexibility(body)
    n_side = len(SIDES)
    mounts = force[:, :-n_side].reshape(len(force), -1, len(AXES))
    motion[:, : mounts.shape[1], : len(AXES)] += local[:-n_side] * mounts
    motion[:, -n_side:, 0] += local[-n_side:, 0] * force[:, -n_side:]
    return motion
