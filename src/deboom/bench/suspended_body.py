"""A rigid body on mounts of the true law: static equilibrium, hysteresis, operating stiffness."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.frozen import freeze_arrays
from deboom.bench.mount_law import DirectionLaw

NEWTON_STEP = 0.5e-3
"""Longest change of a deflection in one Newton step [m]; the narrowest stage is 0.3 mm wide."""

NEWTON_STEPS = 500


@dataclass(frozen=True, eq=False)
class BenchMount:
    """One mount of the bench.

    Parameters
    ----------
    name : str
        Such as ``TSM``.
    forward : array, shape (n_axis, n_dof)
        Motion of the body to motion of the mount's axes; the first axis is the main one.
    laws : tuple of DirectionLaw
        One per axis.
    cross_deflection : float
        Main deflection at which half of the cross stiffening acts [m].
    """

    name: str
    forward: RealArray
    laws: tuple[DirectionLaw, ...]
    cross_deflection: float

    def __post_init__(self) -> None:
        freeze_arrays(self)


@dataclass(frozen=True, eq=False)
class SuspendedBody:
    """A rigid body (powertrain, wheel end) on its mounts.

    Parameters
    ----------
    mass_matrix : array, shape (n_dof, n_dof)
        At the origin of the coordinates [kg, kg m, kg m²].
    mounts : tuple of BenchMount
        Directions below are stacked in this order, then by axis.
    amplitude_coupling : float
        Weight of the other axes of a mount in the amplitude that softens one axis [1].
    play : float
        Half width of the hysteresis play of the static deflection [m].
    """

    mass_matrix: RealArray
    mounts: tuple[BenchMount, ...]
    amplitude_coupling: float
    play: float

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def forward(self) -> RealArray:
        """Motion of the body to motion of every direction, shape (n_direction, n_dof)."""
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
    """Find the static deflection of every direction under a generalised load.

    Parameters
    ----------
    body : SuspendedBody
        The body and its mounts.
    load : array, shape (f, n_dof)
        Static load at the origin of the body's coordinates, one row per line [N, N m].

    Returns
    -------
    array, shape (f, n_direction)
        From the unloaded position [m].

    Raises
    ------
    ArithmeticError
        No equilibrium within the allowed number of steps.

    Notes
    -----
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
    """Follow the deflection that the rubber remembers, with a hysteresis play.

    Parameters
    ----------
    deflection : array, shape (t, n_direction)
        In the order of time, starting from rest at zero [m].
    half_width : float
        Half width of the play [m].

    Returns
    -------
    array, shape (t, n_direction)
        Lags behind a rising deflection and stays above a falling one by `half_width` [m].
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
    """Evaluate the dynamic stiffness of every direction at an operating point.

    Parameters
    ----------
    body : SuspendedBody
        The body and its mounts.
    deflection : array, shape (f, n_direction)
        Static deflection the rubber remembers [m].
    amplitude : array, shape (f, n_direction)
        Peak displacement amplitude [m].
    frequency : array, shape (f,)
        [Hz].

    Returns
    -------
    array, shape (f, n_direction)
        Complex [N/m].

    Notes
    -----
    The amplitude that softens a direction is ``√(own² + γ Σ other axes²)``, so the truth lies
    slightly outside what a model in the own amplitude can describe.
    """
    stiffness = np.empty(deflection.shape, dtype=complex)
    for mount, block in zip(body.mounts, body.blocks, strict=True):
        squared = amplitude[:, block] ** 2
        others = squared.sum(axis=1, keepdims=True) - squared
        felt = np.sqrt(squared + body.amplitude_coupling * others)
        own = deflection[:, block]
        for axis, law in enumerate(mount.laws):
            tangent = law.tangent_stiffness(own[:, axis])
            tangent = tangent * law.cross_factor(own[:, 0], mount.cross_deflection)
            dynamic = law.dynamic_factor(felt[:, axis], frequency)
            stiffness[:, block.start + axis] = tangent * dynamic
    return stiffness
