"""The powertrain as a rigid body, and its static equilibrium on the curves of its mounts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.interpolate import PchipInterpolator

from deboom.arrays import AXES, BoolArray, RealArray, checked, short_repr
from deboom.errors import InputError
from deboom.measurement.campaign import StaticCurve
from deboom.mounts.characterised_mount import CharacterisedMount
from deboom.mounts.mount import Mount
from deboom.physics import rigid_body
from deboom.physics.rigid_body import forward_matrices


@checked(inertia="3 3", centre="3")
class Powertrain:
    """Mass, inertia and centre of gravity with their tolerances.

    - `mass` [kg].
    - `inertia` (3, 3): matrix entries about the centre of gravity, vehicle axes [kg m²].
    - `centre` (3,): centre of gravity from the origin of the mounts' positions, which is the stated
      one [m].
    - `mass_tolerance`: half width [kg].
    - `inertia_tolerance`: half width of entry ij relative to ``√(J_ii J_jj)`` [1].
    - `centre_tolerance`: half width per axis [m].
    """

    mass: float
    inertia: RealArray
    centre: RealArray = field(default_factory=lambda: np.zeros(3))
    mass_tolerance: float = 0.0
    inertia_tolerance: float = 0.0
    centre_tolerance: float = 0.0

    @property
    def mass_matrix(self) -> RealArray:
        """6×6 mass matrix at the origin of the mounts' positions [kg, kg m, kg m²]."""
        return rigid_body.mass_matrix(self.mass, self.inertia, self.centre)


NEWTON_STEPS = 100
HALVINGS = 30
BALANCED = 1e-9
"""Unbalanced load at which the equilibrium counts as found, relative to the load [1]."""

Curve = Callable[[RealArray], RealArray]
"""From the deflection of every direction, shape (n, n_direction) [m], to a value of each."""


def balanced_deflection(
    load: RealArray, forward: RealArray, force: Curve, tangent: Curve
) -> RealArray:
    """Find the deflections at which springs carry a load.

    - `load` (n, 6): one row per case [N, N m].
    - `forward` (n_direction, 6): motion of the body → deflection of every direction.
    - `force`: force of every direction, increasing with its deflection [N].
    - `tangent`: derivative of the force, above 0 [N/m].
    - returns (n, n_direction) [m].
    - raises ArithmeticError: no equilibrium found.

    Newton's method on ``Vᵀ F(V q) = load`` for all rows at once, with the step halved until the
    unbalanced load shrinks. Every tangent is positive, so the equilibrium is unique. A row that has
    come to rest stays: it depends on its load alone, bit for bit.
    """
    # rotations in radians are small numbers: weigh their load by the size of the body
    length = float(np.sqrt(np.mean(np.sum(forward[:, 3:] ** 2, axis=1))))
    scale = np.array([1.0] * 3 + [1 / length] * 3)

    # row by row: a product of matrices would round a case by the cases beside it
    def moved(position: RealArray) -> RealArray:
        return np.asarray((forward @ position[..., np.newaxis])[..., 0])

    def unbalanced(position: RealArray) -> RealArray:
        carried = force(moved(position))[..., np.newaxis]
        return np.asarray(load - (forward.T @ carried)[..., 0])

    def size(residual: RealArray) -> RealArray:
        return np.asarray(np.linalg.norm(residual * scale, axis=1))

    position = np.zeros_like(load)
    residual = unbalanced(position)
    enough = BALANCED * (1.0 + size(load))
    for _ in range(NEWTON_STEPS):
        moving = size(residual) > enough
        if not moving.any():
            return moved(position)
        stiffness = forward.T @ (tangent(moved(position))[..., np.newaxis] * forward)
        step = np.linalg.solve(stiffness, residual[..., np.newaxis])[..., 0]
        share = np.where(moving, 1.0, 0.0)[:, np.newaxis]
        for _ in range(HALVINGS):
            tried = unbalanced(position + share * step)
            worse = size(tried) > (1 - 0.1 * share[:, 0]) * size(residual)
            worse &= moving & (size(tried) > enough)
            if not worse.any():
                break
            share[worse] /= 2
        position = position + share * step
        residual = unbalanced(position)
    raise ArithmeticError(f"no static equilibrium within {NEWTON_STEPS} Newton steps")


ABOUT_CRANKSHAFT = (0.0, 0.0, 0.0, 0.0, 1.0, 0.0)
"""Load per wheel torque: about +y, as the wheels react [1]."""

LEAST_SLOPE = 1e-6
"""Of the mean slope: a monotone interpolant may be flat at its very ends [1]."""


class MonotoneCurve:
    """A curve through measured points that rises everywhere, straight beyond its ends.

    - `curve`: measured points.
    - `lowest`, `highest`: first and last measured deflection [m].
    - `nodes` (n,), `cubics` (n - 1, 4): measured deflections [m], and coefficients of the force
      between them by powers of the distance from the left one, the third power first [N/m³ … N].
    - `first_secant`, `last_secant`: slopes beyond the ends; `least_slope`: of any tangent [N/m].
    - raises InputError: a force that does not increase with the deflection.

    Piecewise cubic Hermite interpolation without overshoot (Fritsch and Carlson, SIAM J. Numer.
    Anal. 17, 1980). Beyond the ends it goes on with the last secant, for iterations on their way:
    compare with `lowest` and `highest` what came out.
    """

    def __init__(self, curve: StaticCurve) -> None:
        secants = np.diff(curve.force) / np.diff(curve.deflection)
        if np.any(secants <= 0):
            raise InputError(
                f"the static force of {curve.mount} {curve.axis} of {curve.mount_set} does not "
                "increase with the deflection: check its curve"
            )
        self.lowest, self.highest = float(curve.deflection[0]), float(curve.deflection[-1])
        self._force = PchipInterpolator(curve.deflection, curve.force)
        self._slope = self._force.derivative()
        self.nodes, self.cubics = self._force.x, self._force.c.T
        self.first_secant, self.last_secant = float(secants[0]), float(secants[-1])
        self.least_slope = LEAST_SLOPE * float(np.mean(secants))

    def force(self, deflection: RealArray) -> RealArray:
        """Force [N] at `deflection` [m]."""
        inside = np.clip(deflection, self.lowest, self.highest)
        secant = np.where(deflection < self.lowest, self.first_secant, self.last_secant)
        return np.asarray(self._force(inside) + secant * (deflection - inside))

    def slope(self, deflection: RealArray) -> RealArray:
        """Tangent stiffness [N/m] at `deflection` [m]; above 0."""
        inside = np.clip(deflection, self.lowest, self.highest)
        slope = np.maximum(self._slope(inside), self.least_slope)
        slope = np.where(deflection < self.lowest, self.first_secant, slope)
        return np.asarray(np.where(deflection > self.highest, self.last_secant, slope))


def mount_forward(mounts: Sequence[Mount]) -> RealArray:
    """Return motion of the powertrain → displacement along the axes of each mount.

    - returns (n_direction, 6): x, y, z of each piece, one below the other [1, m/rad].
    """
    positions = [place for mount in mounts for place in mount.positions]
    forward = forward_matrices(positions)
    for row, (mount, piece) in enumerate((m, p) for m in mounts for p in range(len(m.pieces))):
        if piece in mount.tilted_pieces:
            rows = slice(3 * row, 3 * row + 3)
            forward[rows] = mount.orientation(piece).T @ forward[rows]
    return forward


@dataclass(frozen=True, eq=False)
class KinematicModel:
    """A powertrain on nonlinear mounts under a static torque.

    - `mounts`: mounts that carry the powertrain; their positions in one frame, whose origin does
      not matter.
    - `curves`: curves by ``<mount> <axis>``, for every axis of every mount; pieces of a mount share
      them.
    - raises InputError: a direction without curve, a force that does not increase with the
      deflection, or mounts that leave the powertrain free to move.
    """

    mounts: tuple[Mount, ...]
    curves: Mapping[str, StaticCurve]

    __repr__ = short_repr

    def __post_init__(self) -> None:
        for mount in self.mounts:
            for axis in AXES:
                if f"{mount.name} {axis}" not in self.curves:
                    raise InputError(
                        f"the kinematic model needs a force-deflection curve of {mount.name} "
                        f"{axis}: ask the supplier"
                    )
        _ = self.springs
        if np.linalg.matrix_rank(self.forward) < 6:
            raise InputError(
                f"the mounts {[mount.name for mount in self.mounts]} leave the powertrain free to "
                "move: it needs three points that are not on one line"
            )

    @property
    def names(self) -> tuple[str, ...]:
        """Directions ``<mount> [<piece>] <axis>``."""
        return tuple(
            " ".join(filter(None, (mount.name, piece, axis)))
            for mount in self.mounts
            for piece in mount.pieces
            for axis in AXES
        )

    @property
    def forward(self) -> RealArray:
        """Motion of the powertrain → deflection along each mount's axes, (n_direction, 6)."""
        return mount_forward(self.mounts)

    def column(self, direction: str) -> int:
        """Return the place of a direction among `names`; refuse an unknown one."""
        if direction not in self.names:
            raise InputError(
                f"the kinematic model has no direction '{direction}': use one of {list(self.names)}"
            )
        return self.names.index(direction)

    def force(self, deflection: RealArray) -> RealArray:
        """Return the forces (..., n_direction) on the receiver at deflections [N]."""
        curves = enumerate(self.springs)
        return np.stack([curve.force(deflection[..., k]) for k, curve in curves], axis=-1)

    def slope(self, deflection: RealArray) -> RealArray:
        """Return the tangent stiffnesses (..., n_direction) at deflections [N/m]."""
        curves = enumerate(self.springs)
        return np.stack([curve.slope(deflection[..., k]) for k, curve in curves], axis=-1)

    def outside(self, deflection: RealArray) -> BoolArray:
        """Say which deflections (n, n_direction) lie beyond what a curve was measured to."""
        lowest = [spring.lowest for spring in self.springs]
        highest = [spring.highest for spring in self.springs]
        return np.asarray((deflection < lowest) | (deflection > highest))

    def equilibrium(self, wheel_torque: npt.ArrayLike) -> RealArray:
        """Find the deflection of every direction from the unloaded position.

        - `wheel_torque` (n,): engine torque times total ratio [N m].
        - returns (n, n_direction) [m]; `force` gives the static forces there.
        - raises InputError: a torque that needs more deflection than a curve was measured to.

        ``Vᵀ F(V q) = (0, T e)``, see `deboom.vehicles.powertrain.balanced_deflection`. Curves are
        interpolated monotonically (Fritsch and Carlson), so every tangent stiffness is positive and
        the equilibrium is unique. Weight is left out: deflections count from the position under it,
        as the supplier's curves do.
        """
        return np.asarray(self.deflections(wheel_torque, np.ones((1, len(self.names))))[0])

    def deflections(self, wheel_torque: npt.ArrayLike, factors: RealArray) -> RealArray:
        """Find the deflections with other parts: each direction's force times a factor.

        - `wheel_torque` (n_torque,): engine torque times total ratio [N m].
        - `factors` (n, n_direction): factors of the force at a deflection, ``x F(u)``, above 0 [1].
        - returns (n, n_torque, n_direction): deflection from the unloaded position [m]. The rows of
          a design depend on it alone, bit for bit.
        - raises InputError: a torque that needs more deflection than a curve was measured to.
        """
        torque = np.atleast_1d(np.asarray(wheel_torque, dtype=float))
        each = np.tile(torque, len(factors))
        deflection = self.balanced(each, 1.0, np.repeat(factors, torque.size, axis=0))
        outside = self.outside(deflection)
        if outside.any():
            k = int(np.argmax(outside.any(axis=0)))
            line = int(np.argmax(np.where(outside[:, k], np.abs(deflection[:, k]), -1.0)))
            spring = self.springs[k]
            raise InputError(
                f"at a wheel torque of {each[line]:.0f} N m {self.names[k]} deflects by "
                f"{1e3 * deflection[line, k]:.1f} mm, its curve was measured from "
                f"{1e3 * spring.lowest:.1f} to {1e3 * spring.highest:.1f} mm: measure further, "
                "or ask for less torque"
            )
        return deflection.reshape(len(factors), torque.size, -1)

    def balanced(
        self, torque: RealArray, stretch: RealArray | float, gain: RealArray | float
    ) -> RealArray:
        """Find deflections (n, n_direction) at torques (n,) with the forces ``gain F(stretch u)``.

        Both factors (n, n_direction) are above 0. What lies `outside` of a curve is not refused.
        """
        return balanced_deflection(
            np.outer(torque, ABOUT_CRANKSHAFT),
            self.forward,
            lambda deflection: gain * self.force(stretch * deflection),
            lambda deflection: gain * stretch * self.slope(stretch * deflection),
        )

    @cached_property
    def springs(self) -> tuple[MonotoneCurve, ...]:
        """Static curve of every direction, in the order of `names`."""
        of_direction = {name: MonotoneCurve(curve) for name, curve in self.curves.items()}
        return tuple(
            of_direction[f"{mount.name} {axis}"]
            for mount in self.mounts
            for _ in mount.pieces
            for axis in AXES
        )


def library_model(parts: Sequence[CharacterisedMount]) -> KinematicModel:
    """Build the kinematic model of a powertrain on mounts from the library.

    - `parts`: parts of the mounts that carry the powertrain, with their static curves.
    - raises InputError: a mount twice, or a direction without static curve.
    """
    names = [part.mount.name for part in parts]
    if len(set(names)) < len(names):
        raise InputError(f"the kinematic model needs every mount once, not {names}")
    curves = {
        f"{part.mount.name} {direction.axis}": direction.static_curve
        for part in parts
        for direction in part.directions
        if direction.static_curve is not None
    }
    return KinematicModel(tuple(part.mount for part in parts), curves)
