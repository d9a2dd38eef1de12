"""Kinematic model: from wheel torque to the static force that preloads each mount direction.

The powertrain is a rigid body on the quasi-static force-deflection curves of its mounts. The wheel
torque turns it until the mounts carry it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.measurement.campaign import StaticCurve
from deboom.mounts.characterised_mount import CharacterisedMount
from deboom.mounts.mount import AXES, Mount
from deboom.physics.rigid_body import forward_matrices
from deboom.vehicles.static_balance import balanced_deflection
from deboom.vehicles.static_curves import MonotoneCurve

CRANKSHAFT = (0.0, 1.0, 0.0)
"""A transverse engine that drives forward is turned about +y by the reaction of its wheels."""


@dataclass(frozen=True, eq=False)
class StaticState:
    """Static equilibrium of a powertrain over wheel torque.

    Parameters
    ----------
    wheel_torque : array, shape (n,)
        [N m].
    names : tuple of str
        Directions ``<mount> [<piece>] <axis>``.
    deflection : array, shape (n, n_direction)
        From the unloaded position [m].
    force : array, shape (n, n_direction)
        On the receiver [N].
    """

    wheel_torque: RealArray
    names: tuple[str, ...]
    deflection: RealArray
    force: RealArray

    def of(self, name: str) -> RealArray:
        """Return the static force of one direction, shape (n,) [N].

        Raises
        ------
        InputError
            No such direction.
        """
        if name not in self.names:
            raise InputError(f"the kinematic model has no direction '{name}', use {self.names}")
        return self.force[:, self.names.index(name)]


@dataclass(frozen=True, eq=False)
class KinematicModel:
    """A powertrain on nonlinear mounts under a static torque.

    Parameters
    ----------
    mounts : tuple of Mount
        That carry the powertrain; their positions in one frame, whose origin does not matter.
    curves : mapping of str to StaticCurve
        By ``<mount> <axis>``, for every axis of every mount; pieces of a mount share them.
    torque_axis : tuple of float
        Unit vector about which a positive wheel torque turns the powertrain [1].

    Raises
    ------
    InputError
        A direction without curve, a force that does not increase with the deflection, or mounts
        that leave the powertrain free to move.
    """

    mounts: tuple[Mount, ...]
    curves: Mapping[str, StaticCurve]
    torque_axis: tuple[float, float, float] = CRANKSHAFT

    def __post_init__(self) -> None:
        for mount in self.mounts:
            for axis in AXES:
                if f"{mount.name} {axis}" not in self.curves:
                    raise InputError(
                        f"the kinematic model needs a force-deflection curve of {mount.name} "
                        f"{axis}: ask the supplier, or take static_curve_from_stiffness"
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
        """Motion of the powertrain → deflection of every direction, shape (n_direction, 6)."""
        return forward_matrices([r for mount in self.mounts for r in mount.positions])

    def with_mount_at(self, mount: str, position: tuple[float, float, float]) -> KinematicModel:
        """Move a mount of a single piece, such as the strut from its lateral to a central place.

        Parameters
        ----------
        mount : str
            Which.
        position : (x, y, z)
            Of its virtual point [m].

        Raises
        ------
        InputError
            No such mount, or one of several pieces.
        """
        if mount not in [one.name for one in self.mounts if len(one.pieces) == 1]:
            raise InputError(f"the kinematic model has no mount '{mount}' of a single piece")
        return replace(
            self,
            mounts=tuple(
                replace(one, positions=(position,)) if one.name == mount else one
                for one in self.mounts
            ),
        )

    def with_curve_scales(self, scales: Mapping[str, float]) -> KinematicModel:
        """Multiply the forces of the named curves ``<mount> <axis>`` by factors [1]."""
        return replace(
            self,
            curves={
                name: replace(curve, force=scales.get(name, 1.0) * curve.force)
                for name, curve in self.curves.items()
            },
        )

    def equilibrium(self, wheel_torque: npt.ArrayLike) -> StaticState:
        """Find deflection and force of every direction.

        Parameters
        ----------
        wheel_torque : array, shape (n,)
            Engine torque times total ratio [N m].

        Returns
        -------
        StaticState

        Raises
        ------
        InputError
            A torque that needs more deflection than a curve was measured to.

        Notes
        -----
        ``Vᵀ F(V q) = (0, T e)``, see `deboom.vehicles.static_balance.balanced_deflection`. Curves
        are interpolated monotonically (Fritsch and Carlson), so every tangent stiffness is positive
        and the equilibrium is unique. Weight is left out: deflections count from the position under
        it, as the supplier's curves do.
        """
        torque = np.atleast_1d(np.asarray(wheel_torque, dtype=float))
        ones = np.ones((torque.size, len(self.names)))
        deflection = self._solved(torque, ones)
        forces = [spring.force(deflection[:, k]) for k, spring in enumerate(self.springs)]
        return StaticState(torque, self.names, deflection, np.stack(forces, axis=1))

    def deflections(self, wheel_torque: npt.ArrayLike, factors: RealArray) -> RealArray:
        """Find the deflections with other parts: each direction's force times a factor.

        Parameters
        ----------
        wheel_torque : array, shape (n_torque,)
            Engine torque times total ratio [N m].
        factors : array, shape (n, n_direction)
            Of the force at a deflection, ``x F(u)``, above 0 [1].

        Returns
        -------
        array, shape (n, n_torque, n_direction)
            From the unloaded position [m]. The rows of a design depend on it alone, bit for bit.

        Raises
        ------
        InputError
            A torque that needs more deflection than a curve was measured to.
        """
        torque = np.atleast_1d(np.asarray(wheel_torque, dtype=float))
        each = np.tile(torque, len(factors))
        found = self._solved(each, np.repeat(factors, torque.size, axis=0))
        return found.reshape(len(factors), torque.size, -1)

    def _solved(self, torque: RealArray, factors: RealArray) -> RealArray:
        """Deflections (n, n_direction) at torques (n,), forces times factors (n, n_direction)."""
        load = np.zeros((torque.size, 6))
        load[:, 3:] = torque[:, np.newaxis] * np.array(self.torque_axis)
        springs = self.springs

        def force(deflection: RealArray) -> RealArray:
            forces = [spring.force(deflection[:, k]) for k, spring in enumerate(springs)]
            return np.asarray(factors * np.stack(forces, axis=1))

        def tangent(deflection: RealArray) -> RealArray:
            slopes = [spring.slope(deflection[:, k]) for k, spring in enumerate(springs)]
            return np.asarray(factors * np.stack(slopes, axis=1))

        deflection = balanced_deflection(load, self.forward, force, tangent)
        self._refuse_extrapolation(torque, deflection)
        return deflection

    def force_deviation(
        self, wheel_torque: npt.ArrayLike, *, seed: int, n_draws: int = 100
    ) -> RealArray:
        """Propagate the stated errors of the curves into the static forces.

        Parameters
        ----------
        wheel_torque : array, shape (n,)
            [N m].
        seed : int
            From 1.
        n_draws : int
            Of the scale errors, one per curve.

        Returns
        -------
        array, shape (n, n_direction)
            Standard deviation [N].

        Raises
        ------
        InputError
            A seed below 1, or a torque beyond the curves.
        """
        if seed < 1:
            raise InputError(f"seed {seed} is refused: seeds are whole numbers from 1")
        generator = np.random.default_rng(seed)
        forces = []
        for _ in range(n_draws):
            scales = {
                name: float(np.exp(curve.force_uncertainty * generator.standard_normal()))
                for name, curve in self.curves.items()
            }
            forces.append(self.with_curve_scales(scales).equilibrium(wheel_torque).force)
        return np.asarray(np.std(forces, axis=0))

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

    def _refuse_extrapolation(self, torque: RealArray, deflection: RealArray) -> None:
        for k, spring in enumerate(self.springs):
            outside = (deflection[:, k] < spring.lowest) | (deflection[:, k] > spring.highest)
            if outside.any():
                line = int(np.argmax(np.where(outside, np.abs(deflection[:, k]), -1.0)))
                raise InputError(
                    f"at a wheel torque of {torque[line]:.0f} N m {self.names[k]} deflects by "
                    f"{1e3 * deflection[line, k]:.1f} mm, its curve was measured from "
                    f"{1e3 * spring.lowest:.1f} to {1e3 * spring.highest:.1f} mm: measure further, "
                    "or ask for less torque"
                )


def library_model(
    parts: Sequence[CharacterisedMount], torque_axis: tuple[float, float, float] = CRANKSHAFT
) -> KinematicModel:
    """Build the kinematic model of a powertrain on mounts from the library.

    Parameters
    ----------
    parts : sequence of CharacterisedMount
        One for each mount that carries the powertrain, with their static curves.
    torque_axis : tuple of float
        As in `KinematicModel`.

    Raises
    ------
    InputError
        A mount twice, or a direction without static curve.
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
    return KinematicModel(tuple(part.mount for part in parts), curves, torque_axis)
