"""Cars drawn at random: contributions of paths, and powertrains that move on their mounts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from deboom.arrays import ComplexArray, RealArray
from deboom.physics.rigid_body import forward_matrices, mass_matrix
from deboom.vehicles.amplitude_motion import AmplitudeMotion
from deboom.vehicles.booming_model import Motion
from deboom.vehicles.coupled_motion import Body, CoupledMotion, FlexibleMotion
from deboom.vehicles.fleet import PathContributions

LARGEST = 2.0
"""Amplitude up to which the drawn stiffnesses soften [mm]."""

Case = PathContributions | CoupledMotion


@dataclass(frozen=True)
class Shape:
    """How much is one evaluation, and how many designs a call of the model gets."""

    title: str
    n_draws: int
    n_vehicles: int
    n_lines: int
    n_mounts: int
    n_wheel_ends: int
    n_designs: int

    @property
    def n_variables(self) -> int:
        """Stiffness factors, three per mount."""
        return 3 * (self.n_mounts + (self.n_wheel_ends > 0))


def prescribed_problem(shape: Shape, seed: int = 1) -> PathContributions:
    """Draw random contributions of about 1 mPa; two axes of wheel ends transmit nothing."""
    rng = np.random.default_rng(seed)
    size = (shape.n_vehicles, shape.n_lines, shape.n_variables)
    values = 1e-3 * (rng.normal(size=size) + 1j * rng.normal(size=size))
    values[:, :, 3 * shape.n_mounts + 1 :] = 0.0
    lines = np.linspace(20.0, 60.0, shape.n_lines)
    names = _names(shape)
    return PathContributions(f"drawn {seed}", lines, values, *names)


def coupled_problem(shape: Shape, seed: int = 1) -> CoupledMotion:
    """Draw a plausible powertrain: 200 kg, rigid-body modes of 8 to 35 Hz, losses of 10 to 20 %."""
    rng = np.random.default_rng(seed)
    lines = np.linspace(20.0, 60.0, shape.n_lines)
    place = (lines - 20.0) / 40.0
    corner = np.array([[0.05, 0.43, 0.2], [-0.03, -0.45, 0.19], [0.2, -0.06, -0.27]])
    extra = rng.uniform(-0.4, 0.4, (max(shape.n_mounts - 3, 0), 3))
    positions = np.vstack([corner, extra])[: shape.n_mounts]
    n = 3 * shape.n_mounts

    def stiffness(count: int) -> ComplexArray:
        real = rng.uniform(1e5, 6e5, count) * (1 + np.outer(place, rng.uniform(0.05, 0.25, count)))
        return np.asarray(real * (1 + 1j * rng.uniform(0.10, 0.20, count)))

    def smooth(*size: int) -> ComplexArray:
        ripples = np.cos(np.pi * np.outer(place, np.arange(8)))
        parts = rng.normal(size=(8, *size)) + 1j * rng.normal(size=(8, *size))
        return np.tensordot(ripples, parts, axes=1)

    inertia = [[11.0, -0.06, -0.26], [-0.06, 6.8, 0.53], [-0.26, 0.53, 9.6]]
    powertrain = Body(
        load=np.array([30.0, 10.0, 30.0, 20.0, 150.0, 10.0]) * smooth(6),
        mass_matrix=mass_matrix(195.0, inertia),
        forward=forward_matrices(positions),
        stiffness=stiffness(n),
        variables=np.arange(n),
        transfer=1e-3 * np.moveaxis(smooth(shape.n_vehicles, n), 0, 1),
    )
    springs = stiffness(shape.n_wheel_ends)
    loads = 50.0 * smooth(shape.n_wheel_ends)
    to_ear = 1e-3 * np.moveaxis(smooth(shape.n_vehicles, 1), 0, 1)
    wheel_ends = [
        Body(
            mass_matrix=np.full((1, 1), 40.0),
            forward=np.ones((1, 1)),
            stiffness=springs[:, [end]],
            load=loads[:, [end]],
            variables=np.array([n]),
            transfer=to_ear,
        )
        for end in range(shape.n_wheel_ends)
    ]
    names = _names(shape)
    return CoupledMotion(f"drawn {seed}", lines, (powertrain, *wheel_ends), *names)


def amplitude_problem(shape: Shape, seed: int = 1, softening: float = 0.30) -> AmplitudeMotion:
    """Draw a powertrain whose stiffnesses fall by about `softening` in the first millimetre.

    Beyond `LARGEST` they stay. The load is such that one amplitude in twenty is above 1 mm.
    """
    drawn = coupled_problem(shape, seed)
    gain = 1e-3 / np.quantile(drawn.nominal_amplitude, 0.95)
    coupled = replace(drawn, bodies=tuple(replace(b, load=gain * b.load) for b in drawn.bodies))
    amplitude = 1e3 * coupled.nominal_amplitude
    rng = np.random.default_rng(seed)
    slope = softening * rng.uniform(0.7, 1.3, amplitude.shape[1]) * (1 - 0.3j)
    law = np.stack(np.broadcast_arrays(1.0, -slope, 0.4 * slope, -0.05 * slope), axis=-1)
    cubic = law * amplitude[..., np.newaxis] ** np.arange(4)
    cubic /= cubic.sum(axis=-1, keepdims=True)
    cubic[amplitude > LARGEST] = [1.0, 0.0, 0.0, 0.0]
    highest = np.maximum(LARGEST / amplitude, 1.0)
    lowest = np.zeros(amplitude.shape)
    return AmplitudeMotion(**vars(coupled), cubic=cubic, lowest=lowest, highest=highest)


def tilted(case: CoupledMotion, seed: int = 3) -> CoupledMotion:
    """Turn every powertrain mount of a problem by up to 45 degrees about each axis."""
    rng = np.random.default_rng(seed)
    powertrain = case.bodies[0]
    forward = powertrain.forward.reshape(-1, 3, 6)
    angles = rng.uniform(-45.0, 45.0, (len(forward), 3))
    turns = Rotation.from_euler("xyz", angles, degrees=True).as_matrix()
    turned = (turns.swapaxes(1, 2) @ forward).reshape(-1, 6)
    return replace(case, bodies=(replace(powertrain, forward=turned), *case.bodies[1:]))


def tilted_problem(shape: Shape) -> CoupledMotion:
    """Draw the powertrain of `coupled_problem` on tilted mounts."""
    return tilted(coupled_problem(shape))


def flexible_problem(shape: Shape) -> FlexibleMotion:
    """Put the powertrain of `coupled_problem` on bodies of ten modes, another one per vehicle."""
    coupled = coupled_problem(shape)
    rng = np.random.default_rng(4)
    n_springs, squared = coupled.variables.size, coupled.angular_frequency_squared
    natural = (2 * np.pi * rng.uniform(15.0, 90.0, (shape.n_vehicles, 10))) ** 2 * (1 + 0.06j)
    shapes = 0.04 * rng.normal(size=(shape.n_vehicles, 10, n_springs))
    answer = 1.0 / (natural[:, np.newaxis] - squared[:, np.newaxis])
    receptance = np.einsum("vms,vfm,vmt->vfst", shapes, answer, shapes)
    body_of = np.arange(shape.n_vehicles)
    return FlexibleMotion(**vars(coupled), receptance=receptance, body_of=body_of)


PROBLEMS: dict[Motion, Callable[[Shape], Case]] = {
    Motion.prescribed: prescribed_problem,
    Motion.coupled: coupled_problem,
    Motion.amplitude: amplitude_problem,
}


def designs(shape: Shape, seed: int = 2) -> RealArray:
    """Draw designs within 20 % and their scatter of 5 %, shape (n_designs n_draws, n_variable)."""
    rng = np.random.default_rng(seed)
    nominal = rng.uniform(0.8, 1.2, (shape.n_designs, 1, shape.n_variables))
    scatter = 1 + 0.05 * rng.normal(size=(shape.n_draws, shape.n_variables))
    return np.asarray((nominal * scatter).reshape(-1, shape.n_variables))


def at_once(case: CoupledMotion, rows: RealArray) -> RealArray:
    """Return the sums of levels by one batched solution of all draws."""
    return np.asarray((20 * np.log10(np.abs(case.pressure(rows)))).sum(axis=-1))


def _names(shape: Shape) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the names of the vehicles and of the variables."""
    vehicles = tuple(f"vehicle {v}" for v in range(shape.n_vehicles))
    return vehicles, tuple(f"m{k // 3} {'xyz'[k % 3]}" for k in range(shape.n_variables))
