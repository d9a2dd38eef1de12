"""The true law of a mount, and rigid bodies that are suspended on such mounts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import expit

from deboom.arrays import ComplexArray, RealArray

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

    Dynamic over elastic stiffness above the resonance of the fluid column [1]; resonance [Hz] and
    damping ratio [1].
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
    - `payne_storage`, `payne_loss`: storage drop and twice the loss maximum of the filler's
      network, per elastic stiffness [1].
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
