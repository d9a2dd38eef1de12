"""Mounts, powertrain, wheel ends and driveline: the frozen truth and its mount sets."""

from __future__ import annotations

import json
import re
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from importlib import resources
from typing import Any

import numpy as np
from scipy.linalg import block_diag
from scipy.spatial.transform import Rotation
from scipy.special import expit

from deboom.arrays import AXES, ComplexArray, RealArray
from deboom.errors import InputError
from deboom.physics.rigid_body import forward_matrix, mass_matrix, rotation_matrix

CROSS_WIDTH = 1.0e-3
"""Deflection over which the transverse directions stiffen [m]; an engineering judgement."""

CROSS_SLOPE = 0.15
"""Part of the transverse stiffening that grows linearly with the deflection [1]."""

NEWTON_STEP = 0.5e-3
"""Longest change of a deflection in one Newton step [m]; the narrowest stage is 0.3 mm wide."""

NEWTON_STEPS = 500


@dataclass(frozen=True)
class Stage:
    """A stop that comes in softly.

    Half of its stiffness [N/m] acts at the onset, whose sign is the side, and it comes in over a
    width of the deflection [m].
    """

    onset: float
    width: float
    stiffness: float


@dataclass(frozen=True)
class FluidBranch:
    """The fluid track of a hydromount.

    Stiffness of the branch over the elastic one, far above the resonance of the fluid column [1];
    resonance [Hz] and damping ratio [1].
    """

    stiffness_ratio: float
    frequency: float
    damping_ratio: float

    def factor(self, frequency: RealArray) -> ComplexArray:
        """Return the branch's stiffness per elastic stiffness at `frequency` [Hz]."""
        r = 1j * frequency / self.frequency
        return np.asarray(
            self.stiffness_ratio * r**2 / (r**2 + 2 * self.damping_ratio * r + 1), dtype=complex
        )


@dataclass(frozen=True)
class DirectionLaw:
    """True law of one mount along one axis.

    - `stiffness`: static tangent stiffness far from every stage [N/m].
    - `stages`: stops on both sides.
    - `dynamic_ratio`: factor on the dynamic stiffness that leaves the static curve alone [1].
    - `payne_storage`, `payne_loss`: storage drop and loss maximum of the filler's network,
      per elastic stiffness [1].
    - `payne_amplitude`, `payne_exponent`: amplitude at the loss maximum [m] and exponent [1].
    - `fractional_weight`, `fractional_order`, `fractional_frequency`: weight [1], order [1] and
      reference frequency [Hz] of the fractional Kelvin-Voigt branch.
    - `cross_stiffening`: relative stiffening by the deflection along the mount's main axis [1].
    - `fluid`: fluid track of a hydromount.

    With the elastic part ``k_t(u)``, amplitude X and frequency f (Kraus's model of the Payne
    effect and a fractional Kelvin-Voigt branch)::

        K(u, X, f) = λ k_t(u) [1 + P/(1 + z²) + 2jL z/(1 + z²) + b (jf/f0)^α + h(f)],
        z = (X/X_c)^m

    Made for 5 µm to 2 mm and 15 to 140 Hz.
    """

    stiffness: float
    stages: tuple[Stage, ...]
    dynamic_ratio: float
    payne_storage: float
    payne_amplitude: float
    payne_exponent: float
    payne_loss: float
    fractional_weight: float
    fractional_order: float
    fractional_frequency: float
    cross_stiffening: float
    fluid: FluidBranch | None

    def static_force(self, deflection: RealArray) -> RealArray:
        """Return the static force [N] at the static `deflection` [m]; zero at zero.

        ``F(u) = k0 u + Σ s dk w [sp((s u - |u_i|)/w) - sp(-|u_i|/w)]``, with sp the softplus and s
        the side of the stage: the integral of :meth:`tangent_stiffness`.
        """
        force = self.stiffness * deflection
        for stage in self.stages:
            side, width = np.sign(stage.onset), stage.width
            beyond = np.logaddexp(0.0, (side * deflection - abs(stage.onset)) / width)
            at_rest = np.logaddexp(0.0, -abs(stage.onset) / width)
            force = force + side * stage.stiffness * width * (beyond - at_rest)
        return force

    def tangent_stiffness(self, deflection: RealArray) -> RealArray:
        """Return the slope of the static curve [N/m] at `deflection` [m]; always positive."""
        tangent = np.full(np.shape(deflection), self.stiffness)
        for stage in self.stages:
            side = np.sign(stage.onset)
            reach = (side * deflection - abs(stage.onset)) / stage.width
            tangent = tangent + stage.stiffness * expit(reach)
        return tangent

    def dynamic_factor(self, amplitude: RealArray, frequency: RealArray) -> ComplexArray:
        """Return the dynamic over the tangent stiffness at peak `amplitude` [m] and `frequency`."""
        z = (amplitude / self.payne_amplitude) ** self.payne_exponent
        payne = (self.payne_storage + 2j * self.payne_loss * z) / (1 + z**2)
        fractional = (
            self.fractional_weight
            * (1j * frequency / self.fractional_frequency) ** self.fractional_order
        )
        factor = 1 + payne + fractional
        if self.fluid is not None:
            factor = factor + self.fluid.factor(frequency)
        return np.asarray(self.dynamic_ratio * factor, dtype=complex)

    def cross_factor(self, main_deflection: RealArray, cross_deflection: float) -> RealArray:
        """Return the stiffening by the static deflection along the main axis [1].

        ``1 + c [sigmoid((|u| - U)/1 mm) + 0.15 |u|/U]``, both deflections in m; half of it acts at
        ``|u| = U``.
        """
        reach = np.abs(main_deflection)
        grown = expit((reach - cross_deflection) / CROSS_WIDTH)
        return np.asarray(
            1 + self.cross_stiffening * (grown + CROSS_SLOPE * reach / cross_deflection)
        )


@dataclass(frozen=True, eq=False)
class BenchMount:
    """One mount of the bench.

    - `name`: name, such as ``TSM``.
    - `forward` (n_axis, n_dof): motion of the body → motion of the mount's axes; the first axis is
      the main one.
    - `laws`: law along each axis.
    - `cross_deflection`: main deflection at which half of the cross stiffening acts [m].
    """

    name: str
    forward: RealArray
    laws: tuple[DirectionLaw, ...]
    cross_deflection: float


@dataclass(frozen=True, eq=False)
class SuspendedBody:
    """A rigid body (powertrain, wheel end) on its mounts.

    - `mass_matrix` (n_dof, n_dof): mass matrix at the origin of the coordinates [kg, kg m, kg m²].
    - `mounts`: mounts; directions are stacked in their order, then by axis.
    - `amplitude_coupling`: weight of a mount's other axes in the amplitude that softens one axis
      [1].
    - `play`: half width of the hysteresis play of the static deflection [m].
    """

    mass_matrix: RealArray
    mounts: tuple[BenchMount, ...]
    amplitude_coupling: float
    play: float

    @property
    def forward(self) -> RealArray:
        """Motion of the body → motion of every direction, shape (n_direction, n_dof)."""
        return np.vstack([mount.forward for mount in self.mounts])

    @property
    def laws(self) -> tuple[DirectionLaw, ...]:
        """Law of every direction."""
        return tuple(law for mount in self.mounts for law in mount.laws)

    @property
    def blocks(self) -> tuple[slice, ...]:
        """Directions of each mount."""
        ends = np.cumsum([len(mount.laws) for mount in self.mounts])
        return tuple(
            slice(int(end) - len(mount.laws), int(end))
            for mount, end in zip(self.mounts, ends, strict=True)
        )


def static_forces(body: SuspendedBody, deflection: RealArray) -> RealArray:
    """Return the static force of every direction [N] at `deflection` (f, n_direction) [m]."""
    forces = [law.static_force(deflection[:, k]) for k, law in enumerate(body.laws)]
    return np.stack(forces, axis=1)


def static_deflection(body: SuspendedBody, load: RealArray) -> RealArray:
    """Find the static deflection of every direction from the unloaded one, (f, n_direction) [m].

    - `load` (f, n_dof): static load at the body's origin, one row per line [N, N m].
    - raises ArithmeticError: no equilibrium within the allowed number of steps.

    Newton's method on ``Vᵀ F(V q) = load`` with a limited step. Every tangent stiffness is
    positive, so the energy is convex and the equilibrium is unique.
    """
    forward = body.forward
    position = np.zeros_like(load)
    tolerance = 1e-10 * (1.0 + np.linalg.norm(load, axis=1))
    for _ in range(NEWTON_STEPS):
        deflection = position @ forward.T
        residual = load - static_forces(body, deflection) @ forward
        if np.all(np.linalg.norm(residual, axis=1) <= tolerance):
            return deflection
        tangent = np.stack(
            [law.tangent_stiffness(deflection[:, k]) for k, law in enumerate(body.laws)], axis=1
        )
        jacobian = np.einsum("ka,fk,kb->fab", forward, tangent, forward)
        step = np.linalg.solve(jacobian, residual[..., None])[..., 0]
        reach = np.max(np.abs(step @ forward.T), axis=1, keepdims=True)
        position = position + step * np.minimum(1.0, NEWTON_STEP / np.maximum(reach, 1e-30))
    raise ArithmeticError(f"no static equilibrium within {NEWTON_STEPS} Newton steps")


def play_operator(deflection: RealArray, half_width: float) -> RealArray:
    """Follow the deflection that the rubber remembers, with a hysteresis play [m].

    The deflection (t, n_direction) is in the order of time, from rest at zero; the memory lags
    behind a rising one, and leads over a falling one, by half of the play's width.
    """
    remembered = np.empty_like(deflection)
    state = np.zeros(deflection.shape[1])
    for line, now in enumerate(deflection):
        state = np.clip(state, now - half_width, now + half_width)
        remembered[line] = state
    return remembered


def operating_stiffness(
    body: SuspendedBody, deflection: RealArray, amplitude: RealArray, frequency: RealArray
) -> ComplexArray:
    """Evaluate the complex dynamic stiffness of every direction, (f, n_direction) [N/m].

    - `deflection`, `amplitude` (f, n_direction): static deflection the rubber remembers, and peak
      displacement amplitude [m].
    - `frequency` (f,) [Hz].

    The amplitude that softens a direction is ``√(own² + γ Σ other axes²)``, so the truth lies
    slightly outside what a model in the own amplitude can describe.
    """
    stiffness = np.empty(deflection.shape, dtype=complex)
    for mount, block in zip(body.mounts, body.blocks, strict=True):
        squared = amplitude[:, block] ** 2
        others = squared.sum(axis=1, keepdims=True) - squared
        felt = np.sqrt(squared + body.amplitude_coupling * others)
        static = deflection[:, block]
        for axis, law in enumerate(mount.laws):
            tangent = law.tangent_stiffness(static[:, axis])
            tangent = tangent * law.cross_factor(static[:, 0], mount.cross_deflection)
            dynamic = law.dynamic_factor(felt[:, axis], frequency)
            stiffness[:, block.start + axis] = tangent * dynamic
    return stiffness


SIDES = ("left", "right")

AMPLITUDE_COUPLING = 0.15
"""Weight of a mount's other axes in the amplitude that softens one axis; judgement."""

PLAY = 0.25e-3
"""Half width of the hysteresis play of the powertrain's static deflection [m]; judgement."""

STIFFNESS_SPREAD = 0.05
"""Standard deviation of a direction's stiffness from unit to unit, cut at three of it [1]."""

LOSS_SPREAD = 0.08
LARGEST_LOSS_CHANGE = 0.20
"""Standard deviation of a direction's losses from unit to unit, and where it is cut [1]."""

DRAWING = "M0"
"""The set without spread: the parts that the virtual platform was measured with."""

MIX = "EnM1-GeM2-TSM3-Du4"
"""A virtual design whose parts all stand in the sets ``M1`` to ``M4``."""


@dataclass(frozen=True)
class OrderTorque:
    """Torque reaction of the engine block at one engine order.

    - `order`: engine order [1].
    - `at_no_load`, `per_torque`: amplitude at zero engine torque [N m], and its growth per engine
      torque [1].
    - `phase`, `low_speed_phase`: phase against the tacho at high speed, and what is added to it at
      `low_speed` [rad].
    - `low_speed`, `speed_scale`: speed at which, and scale over which, the phase settles [rpm].
    - `inertia`: reciprocating inertia torque per squared angular speed [kg m²]: ``2 m r²`` at order
      2 of four cylinders with the reciprocating mass m per cylinder and the crank radius r.

    With the gas torque ``a + b T`` and, a quarter turn ahead of the tacho, the inertia J::

        M = (a + b T) e^{jφ(n)} + j J ω²

    A fit to a zero-dimensional cycle with Wiebe heat release of a 1.5 l three-cylinder engine with
    turbocharger. Order 1.5 of a three-cylinder engine is gas torque alone: its reciprocating
    inertia gives only the orders 3, 6, … Overrun (negative torque) counts as no load.
    """

    order: float
    at_no_load: float
    per_torque: float
    phase: float
    low_speed_phase: float
    low_speed: float
    speed_scale: float
    inertia: float

    def torque(self, engine_torque: RealArray, rpm: RealArray) -> ComplexArray:
        """Return the complex peak amplitude [N m] at engine torque [N m] and speed [rpm]."""
        amplitude = self.at_no_load + self.per_torque * np.maximum(engine_torque, 0.0)
        settling = np.exp(-(rpm - self.low_speed) / self.speed_scale)
        phase = self.phase + self.low_speed_phase * settling
        reciprocating = 1j * self.inertia * (2 * np.pi * rpm / 60) ** 2
        return np.asarray(amplitude * np.exp(1j * phase) + reciprocating, dtype=complex)


TORQUE_AXIS = np.array([0.0, 0.0, 0.0, 0.0, 1.0, 0.0])
"""The crankshaft lies along y, and the bench drives forward: the reaction turns about +y."""


@dataclass(frozen=True)
class ReciprocatingForce:
    """Vertical mass force of four cylinders in line at order 2, which balancer shafts take away.

    - `mass`: reciprocating mass per cylinder [kg].
    - `crank_radius`, `rod_ratio`: radius of the crank [m], and over the length of the rod [1].
    - `centre`: middle of the cylinders from the powertrain's centre of gravity [m].
    """

    mass: float
    crank_radius: float
    rod_ratio: float
    centre: tuple[float, float, float]

    def load(self, rpm: RealArray) -> RealArray:
        """Return the peak load at the centre of gravity, shape (f, 6) [N, N m].

        ``F_z = 4 m r λ ω² cos 2θ`` acts upwards at top dead centre, where the tacho has its zero;
        beside the centre of gravity it turns about x and y.
        """
        per_squared_speed = 4 * self.mass * self.crank_radius * self.rod_ratio
        force = per_squared_speed * (2 * np.pi * rpm / 60) ** 2
        return np.outer(force, forward_matrix(np.array(self.centre))[2])


@dataclass(frozen=True)
class FullLoadRamp:
    """Engine torque over a run-up with wide open throttle.

    Speed at which, and scale over which, it builds up [rpm]; torque the charge would reach [N m],
    and exponent of its build-up [1].
    """

    start: float
    scale: float
    natural_torque: float
    exponent: float

    def torque(self, limit: float, rpm: RealArray) -> RealArray:
        """Return the engine torque [N m] at `rpm`, limited to `limit` [N m].

        ``T = T_lim tanh(T_n s^e / T_lim) / tanh(T_n / T_lim)``, ``s = 1 - exp(-(n - n_0)/n_s)``,
        zero below the start.
        """
        built_up = 1 - np.exp(-np.maximum(rpm - self.start, 0.0) / self.scale)
        natural = self.natural_torque * built_up**self.exponent
        reached: RealArray = np.tanh(natural / limit) / np.tanh(self.natural_torque / limit)
        return limit * reached


@dataclass(frozen=True)
class Driveline:
    """From engine torque to the load on one wheel end along x.

    - `wheel_radius` [m].
    - `factor`: share of the order torque that the drive shafts pass at low frequency [1].
    - `frequency`, `damping_ratio`: isolation mode of flywheel and drive shafts [Hz], [1].
    - `traction_share`: share of a wheel's traction force that preloads the wishbone mount [1]; half
      of it, through the rear one, is judgement.
    """

    wheel_radius: float
    factor: float
    frequency: float
    damping_ratio: float
    traction_share: float

    def preload(self, wheel_torque: RealArray) -> RealArray:
        """Return the static load on one wishbone mount [N] at the torque of both wheels [N m]."""
        return self.traction_share * wheel_torque / (2 * self.wheel_radius)

    def transmission(self, frequency: RealArray) -> ComplexArray:
        """Return the order torque at the wheels per engine order torque times the ratio [1]."""
        r = frequency / self.frequency
        return np.asarray(self.factor / (1 - r**2 + 2j * self.damping_ratio * r), dtype=complex)

    def load(
        self, order_torque: ComplexArray, total_ratio: float, frequency: RealArray
    ) -> ComplexArray:
        """Return the dynamic load on one wheel end [N] from the engine's order torque [N m]."""
        at_wheels = order_torque * total_ratio * self.transmission(frequency)
        return at_wheels / (2 * self.wheel_radius)


@dataclass(frozen=True, eq=False)
class VirtualBench:
    """Powertrain and wheel ends on their true mounts, with what excites them.

    - `mass`: mass of the powertrain [kg].
    - `inertia` (3, 3): inertia of the powertrain about its centre of gravity [kg m²].
    - `positions` (n_mount, 3): positions of the powertrain mounts from the centre of gravity [m].
    - `powertrain`, `wheel_end`: powertrain with six degrees of freedom; wheel end of one side along
      x.
    - `driveline`: path from engine torque to the wheel end.
    - `total_ratios`: engine speed over wheel speed, gear 1 first [1].
    - `order_torque`: dominant order of the engine.
    - `ramp`: torque over a run-up.
    - `cylinders`: number of cylinders of the engine.
    - `rotations` (n_mount, 3): turns of vehicle axes into the axes of each powertrain mount, about
      the fixed axes x, then y, then z; laws are along the axes of the mounts [rad].
    - `reciprocating`: mass force at the dominant order; None where there is none, or where balancer
      shafts take it away.
    """

    mass: float
    inertia: RealArray
    positions: RealArray
    powertrain: SuspendedBody
    wheel_end: SuspendedBody
    driveline: Driveline
    total_ratios: tuple[float, ...]
    order_torque: OrderTorque
    ramp: FullLoadRamp
    cylinders: int
    rotations: RealArray = field(default_factory=lambda: np.zeros((3, 3)))
    reciprocating: ReciprocatingForce | None = None

    @property
    def turn(self) -> RealArray | None:
        """Directions of the powertrain's mounts → vehicle axes, (n, n); None: none is tilted."""
        if not self.rotations.any():
            return None
        return np.asarray(block_diag(*rotation_matrix(self.rotations)))

    def dynamic_load(self, engine_torque: RealArray, rpm: RealArray) -> ComplexArray:
        """Return what shakes the powertrain at the dominant order, shape (f, 6) [N, N m].

        - `engine_torque`, `rpm` (f,): [N m], [1/min].
        """
        torque = self.order_torque.torque(engine_torque, rpm)
        load: ComplexArray = np.outer(torque, TORQUE_AXIS)
        return load if self.reciprocating is None else load + self.reciprocating.load(rpm)

    @property
    def mount_names(self) -> tuple[str, ...]:
        """Names of the powertrain mounts."""
        return tuple(mount.name for mount in self.powertrain.mounts)

    @property
    def mounts(self) -> tuple[BenchMount, ...]:
        """Mounts of the powertrain, then that of a wheel end."""
        return (*self.powertrain.mounts, *self.wheel_end.mounts)


def read_data(name: str) -> dict[str, Any]:
    """Read one of the bench's own JSON files, such as ``powertrain.json``."""
    text = resources.files("deboom.bench").joinpath("data", name).read_text(encoding="utf-8")
    data: dict[str, Any] = json.loads(text)
    return data


TILT_DIGITS = 1
"""Mounts stand at angles of whole tenths of a degree, as their table states them."""


def load_bench(truth_seed: int = 1, tilt: float = 0.0) -> VirtualBench:
    """Build the bench with the frozen truth of ``data/powertrain.json``, or one drawn around it.

    Its mass is that of the thesis, table 3; its cells stand as in figures 12 and 13.

    - `truth_seed`: 1 is the frozen truth; every other seed draws from a prior around it.
    - `tilt`: angle by which each powertrain mount stands away from the vehicle's axes, about an
      axis that the seed draws [deg].
    - raises InputError: a tilt below 0 or above 90 degrees.
    """
    if not 0.0 <= tilt <= 90.0:
        raise InputError(f"a tilt of {tilt:g} deg: give 0 to 90")
    data = read_data("powertrain.json")
    bench = _bench(data if truth_seed == 1 else _drawn(data, truth_seed))
    return _tilted(bench, tilt, truth_seed) if tilt > 0.0 else bench


def _tilted(bench: VirtualBench, tilt: float, truth_seed: int) -> VirtualBench:
    """Turn every powertrain mount, with its laws, by an angle about an axis of its own."""
    generator = np.random.default_rng([truth_seed, zlib.crc32(b"tilt")])
    about = generator.normal(size=(len(bench.mount_names), len(AXES)))
    about *= np.deg2rad(tilt) / np.linalg.norm(about, axis=1, keepdims=True)
    angles = np.rad2deg(Rotation.from_rotvec(about).as_euler("xyz"))
    rotations = np.deg2rad(np.round(angles, TILT_DIGITS))
    mounts = tuple(
        replace(mount, forward=turn.T @ mount.forward)
        for mount, turn in zip(bench.powertrain.mounts, rotation_matrix(rotations), strict=True)
    )
    return replace(bench, powertrain=replace(bench.powertrain, mounts=mounts), rotations=rotations)


def _drawn(data: dict[str, Any], truth_seed: int) -> dict[str, Any]:
    """Draw a bench around the frozen truth; stiffness of no direction depends on the engine.

    The prior is judgement. Half of the benches have the second engine. Standard deviation of the
    logarithm: 0.2 of a direction's stiffness with its stops, 0.25 of storage drop and amplitude of
    its filler and of its losses. Half widths: a tenth of the mass and of each moment of inertia,
    40 % of the gas torque at no load and of its growth with the load, each by itself, and 0.5 rad
    of its phase, 15 % of the run-up's torque and speed, 8 % of each gear.
    """
    generator = np.random.default_rng([truth_seed, zlib.crc32(b"bench")])
    if generator.random() < 0.5:
        data = data | read_data("second_engine.json")

    def within(width: float) -> float:
        return 1 + width * float(generator.uniform(-1, 1))

    def around(spread: float) -> float:
        return float(np.exp(spread * generator.normal()))

    directions = {}
    for name, law in data["directions"].items():
        stiffness, loss = around(0.2), around(0.25)
        stages = [[onset, width, stiffness * step] for onset, width, step in law["stages"]]
        factors = {"stiffness": stiffness, "payne_storage": around(0.25)}
        factors |= {"payne_amplitude": around(0.25), "payne_loss": loss, "fractional_weight": loss}
        directions[name] = law | _times(law, factors) | {"stages": stages}
    root = np.sqrt([within(0.1) for _ in AXES])
    at_no_load, order, ramp = within(0.4), data["order_torque"], data["ramp"]
    drawn = data | {
        "mass_kg": within(0.1) * data["mass_kg"],
        "inertia_kg_m2": np.array(data["inertia_kg_m2"]) * np.outer(root, root),
        "directions": directions,
        "total_gear_ratio": [within(0.08) * ratio for ratio in data["total_gear_ratio"]],
        "ramp": ramp | _times(ramp, {"scale": within(0.15), "natural_torque": within(0.15)}),
    }
    gas = _times(order, {"at_no_load": at_no_load, "per_torque": within(0.4)})
    turned = {"phase": order["phase"] + 0.5 * float(generator.uniform(-1, 1))}
    return drawn | {"order_torque": order | gas | turned}


def _times(numbers: Mapping[str, Any], factors: Mapping[str, float]) -> dict[str, float]:
    """Return the numbers that have a factor, times it."""
    return {name: factor * numbers[name] for name, factor in factors.items()}


def load_second_engine(*, balancer_shafts: bool = True) -> VirtualBench:
    """Put a second engine on the bench: four cylinders, order 2, with inertia.

    - `balancer_shafts`: whether shafts balance the vertical force of its pistons.

    Mass, mount positions, gears and excitation are those of ``data/second_engine.json``; mounts and
    wheel ends are as drawn for the virtual platform. Whoever knows the mounts, and measures the
    motion of this powertrain, must find its forces: the mounts do not know what they carry.
    """
    data = read_data("second_engine.json")
    bench = _bench(read_data("powertrain.json") | data)
    unbalanced = None if balancer_shafts else ReciprocatingForce(**data["reciprocating"])
    return replace(bench, reciprocating=unbalanced)


def _bench(data: Mapping[str, Any]) -> VirtualBench:
    """Build the bench of one engine; the keys of the data are the fields of the classes."""

    def law(name: str) -> DirectionLaw:
        numbers = dict(data["directions"][name])
        stages = tuple(Stage(*stage) for stage in numbers.pop("stages"))
        track = numbers.pop("fluid")
        return DirectionLaw(**numbers, stages=stages, fluid=FluidBranch(*track) if track else None)

    positions = {name: np.array(place) for name, place in data["mount_position_m"].items()}
    inertia = np.array(data["inertia_kg_m2"])
    powertrain = SuspendedBody(
        mass_matrix=mass_matrix(data["mass_kg"], inertia),
        mounts=tuple(
            BenchMount(
                name=name,
                forward=forward_matrix(position),
                laws=tuple(law(f"{name} {axis}") for axis in AXES),
                cross_deflection=data["cross_amplitude_m"][name],
            )
            for name, position in positions.items()
        ),
        amplitude_coupling=AMPLITUDE_COUPLING,
        play=PLAY,
    )
    wheel_end = SuspendedBody(
        mass_matrix=np.array([[data["wheel_end_mass_kg"]]]),
        mounts=(BenchMount("Du", np.eye(1), (law("Du x"),), cross_deflection=np.inf),),
        amplitude_coupling=0.0,
        play=0.0,
    )
    return VirtualBench(
        mass=data["mass_kg"],
        inertia=inertia,
        positions=np.array(list(positions.values())),
        powertrain=powertrain,
        wheel_end=wheel_end,
        driveline=Driveline(**data["driveline"]),
        total_ratios=tuple(data["total_gear_ratio"]),
        order_torque=OrderTorque(**data["order_torque"]),
        ramp=FullLoadRamp(**data["ramp"]),
        cylinders=data["cylinders"],
    )


def with_mount_set(bench: VirtualBench, name: str) -> VirtualBench:
    """Put a mount set on the bench: parts of one drawing that differ from unit to unit.

    - `bench`: bench with parts as drawn.
    - `name`: ``M<unit>`` for the same unit number of all mounts, or a mix ``<mount><unit>-…``, such
      as ``EnM1-GeM2-TSM3-Du4``; unit 0 is a part exactly as drawn.
    - raises InputError: a name of another form, or a mix that does not name every mount once.

    A unit depends on its mount and number alone, never on a seed of the measurement: unit 1 of a
    mount is the same part in every campaign and in every mix. Left and right piece are alike.
    """
    units = _units(name, [mount.name for mount in bench.mounts])
    return replace(
        bench,
        powertrain=_with_units(bench.powertrain, units),
        wheel_end=_with_units(bench.wheel_end, units),
    )


def _units(name: str, mounts: list[str]) -> dict[str, int]:
    """Return the unit number of every mount in a named set."""
    if match := re.fullmatch(r"M(\d+)", name):
        return dict.fromkeys(mounts, int(match[1]))
    parts = [re.fullmatch(r"([A-Za-z]+)(\d+)", part) for part in name.split("-")]
    units = {part[1]: int(part[2]) for part in parts if part is not None}
    if len(parts) != len(mounts) or sorted(units) != sorted(mounts):
        example = "-".join(f"{mount}{unit}" for unit, mount in enumerate(mounts, 1))
        raise InputError(f"unknown mount set '{name}': name it M1, M2, … or a mix like {example}")
    return units


def _with_units(body: SuspendedBody, units: Mapping[str, int]) -> SuspendedBody:
    """Replace the laws of a body's mounts by those of the units."""
    mounts = []
    for mount in body.mounts:
        unit = units[mount.name]
        generator = np.random.default_rng([unit, zlib.crc32(mount.name.encode())])
        laws = tuple(_unit_law(law, generator) for law in mount.laws) if unit else mount.laws
        mounts.append(replace(mount, laws=laws))
    return replace(body, mounts=tuple(mounts))


def _unit_law(law: DirectionLaw, generator: np.random.Generator) -> DirectionLaw:
    """Draw the law of one unit around that of the drawing."""

    def around(spread: float, largest: float) -> float:
        return 1 + float(np.clip(generator.normal(0, spread), -largest, largest))

    stiffness = around(STIFFNESS_SPREAD, 3 * STIFFNESS_SPREAD)
    loss = around(LOSS_SPREAD, LARGEST_LOSS_CHANGE)
    return replace(
        law,
        stiffness=stiffness * law.stiffness,
        stages=tuple(replace(stage, stiffness=stiffness * stage.stiffness) for stage in law.stages),
        payne_loss=loss * law.payne_loss,
        fractional_weight=loss * law.fractional_weight,
    )
