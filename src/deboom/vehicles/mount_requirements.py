"""What a mount design must do beside being quiet: carry the weight and the torque, place the modes.

Every class here is a function of the stiffness factors with named columns; `MountRequirements`
joins several. Which values are allowed is not said here, see `deboom.explore.robust.Limits`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.mounts.mount import AXES, Mount
from deboom.physics import rigid_body
from deboom.vehicles.booming_model import checked_designs
from deboom.vehicles.design_factor import Factor
from deboom.vehicles.powertrain import (
    KinematicModel,
    MonotoneCurve,
    Powertrain,
    balanced_deflection,
)

GRAVITY = 9.80665
"""Standard acceleration of free fall [m/s²]."""
MILLIMETRES = 1e3
N_PER_MM = 1e-3


class Quantity(Protocol):
    """Some numbers of a design."""

    @property
    def names(self) -> tuple[str, ...]:
        """One per column."""

    @property
    def unit(self) -> str:
        """Of all columns."""

    def __call__(self, factors: Mapping[str, RealArray]) -> RealArray:
        """Return the columns, shape (n, c), from the factors by variable, each of shape (n,)."""


@dataclass(frozen=True, eq=False)
class MountRequirements:
    """Several quantities as one function of designs.

    Parameters
    ----------
    variable_names : tuple of str
        Columns of the designs. A variable that no quantity knows has no effect, a direction that
        is no variable keeps its factor 1.
    quantities : tuple of Quantity
        At least one.
    """

    variable_names: tuple[str, ...]
    quantities: tuple[Quantity, ...]

    @property
    def response_names(self) -> tuple[str, ...]:
        """Name of each column of the result."""
        return tuple(name for one in self.quantities for name in one.names)

    @property
    def response_units(self) -> tuple[str, ...]:
        """Unit of each column of the result."""
        return tuple(one.unit for one in self.quantities for _ in one.names)

    def __call__(self, designs: npt.ArrayLike) -> RealArray:
        """Return the quantities of designs.

        Parameters
        ----------
        designs : array_like, shape (n, n_variable)
            Stiffness factors, above 0 [1].

        Returns
        -------
        array, shape (n, n_response)
            [response_units]; nan where a curve was not measured that far.

        Raises
        ------
        InputError
            Designs of another shape, not finite or not above 0.
        """
        rows = checked_designs(designs, self.variable_names)
        if np.any(rows <= 0.0):
            raise InputError("a stiffness factor of 0 or less carries nothing: give more than 0")
        factors = dict(zip(self.variable_names, rows.T, strict=True))
        factors[""] = np.ones(len(rows))
        return np.hstack([one(factors) for one in self.quantities])


@dataclass(frozen=True, eq=False)
class WeightSag:
    """How far mounts sink under the weight of the powertrain [mm].

    Parameters
    ----------
    model : KinematicModel
        Quasi-static curves of the mounts that carry the powertrain.
    powertrain : Powertrain
        Mass and centre of gravity.
    mounts : tuple of str
        Whose sag, ``<mount> [<piece>]``; downward counts positive, from the unloaded mounts.

    Notes
    -----
    Linear: the tangents of the curves at no torque stand for the way down to there, which no curve
    shows, because suppliers count deflections from the position under the weight. Both meanings of
    a factor have the same tangent there.
    """

    model: KinematicModel
    powertrain: Powertrain
    mounts: tuple[str, ...]
    unit: str = "mm"

    def __post_init__(self) -> None:
        for mount in self.mounts:
            _index(self.model, f"{mount} z")

    @property
    def names(self) -> tuple[str, ...]:
        """Such as ``EnM sag``."""
        return tuple(f"{mount} sag" for mount in self.mounts)

    def __call__(self, factors: Mapping[str, RealArray]) -> RealArray:
        """Return the sag, shape (n, n_mount) [mm]."""
        forward = self.model.forward
        here = np.zeros(1)
        tangents = np.array([spring.slope(here)[0] for spring in _springs(self.model)])
        stiffness = _of_directions(self.model.mounts, factors) * tangents
        weight = np.array([0.0, 0.0, -self.powertrain.mass * GRAVITY])
        load = np.concatenate([weight, np.cross(self.powertrain.centre, weight)])
        matrix = forward.T @ (stiffness[..., np.newaxis] * forward)
        position = np.linalg.solve(matrix, load[:, np.newaxis])[..., 0]
        columns = [_index(self.model, f"{mount} z") for mount in self.mounts]
        return np.asarray(-MILLIMETRES * (position @ forward.T)[:, columns])


@dataclass(frozen=True, eq=False)
class TorqueTravel:
    """How far mounts deflect under a wheel torque, from the position under the weight [mm].

    Parameters
    ----------
    model : KinematicModel
        Quasi-static curves of the mounts that carry the powertrain.
    wheel_torque : float
        Engine torque times total ratio [N m].
    directions : tuple of str
        ``<mount> [<piece>] <axis>``.
    factor : Factor
        What a stiffness factor means for the curves.
    """

    model: KinematicModel
    wheel_torque: float
    directions: tuple[str, ...]
    factor: Factor = Factor.dynamic
    unit: str = "mm"

    def __post_init__(self) -> None:
        for direction in self.directions:
            _index(self.model, direction)

    @property
    def names(self) -> tuple[str, ...]:
        """Such as ``TSM x travel at 1400 N m``."""
        return tuple(f"{name} travel at {self.wheel_torque:g} N m" for name in self.directions)

    def __call__(self, factors: Mapping[str, RealArray]) -> RealArray:
        """Return the travel, shape (n, n_direction) [mm]; nan beyond what was measured."""
        springs = _springs(self.model)
        scale = _of_directions(self.model.mounts, factors)
        stretch, gain = scale, np.ones_like(scale)
        if self.factor is Factor.part:
            stretch, gain = gain, stretch

        def force(deflection: RealArray) -> RealArray:
            at = stretch * deflection
            return gain * np.stack([one.force(at[:, k]) for k, one in enumerate(springs)], axis=1)

        def tangent(deflection: RealArray) -> RealArray:
            at = stretch * deflection
            slopes = np.stack([one.slope(at[:, k]) for k, one in enumerate(springs)], axis=1)
            return np.asarray(scale * slopes)

        load = np.zeros((len(scale), 6))
        load[:, 3:] = self.wheel_torque * np.array(self.model.torque_axis)
        deflection = balanced_deflection(load, self.model.forward, force, tangent)
        at = stretch * deflection
        measured = [
            (one.lowest <= at[:, k]) & (at[:, k] <= one.highest) for k, one in enumerate(springs)
        ]
        travel = np.where(np.all(measured, axis=0)[:, np.newaxis], deflection, np.nan)
        return MILLIMETRES * travel[:, [_index(self.model, name) for name in self.directions]]


@dataclass(frozen=True, eq=False)
class NaturalFrequencies:
    """Undamped natural frequencies of the powertrain on its mounts [Hz].

    Parameters
    ----------
    mounts : tuple of Mount
        That carry the powertrain.
    powertrain : Powertrain
        Mass matrix.
    stiffness : mapping of str to float
        Real part of the dynamic stiffness of one piece at factor 1, by variable [N/m].
    modes : tuple of int
        From 1, the lowest, to 6.

    Raises
    ------
    InputError
        Another mode, or a direction without stiffness.
    """

    mounts: tuple[Mount, ...]
    powertrain: Powertrain
    stiffness: Mapping[str, float]
    modes: tuple[int, ...] = (1, 2, 3, 4, 5, 6)
    unit: str = "Hz"

    def __post_init__(self) -> None:
        if not set(self.modes) <= set(range(1, 7)):
            raise InputError(f"a rigid body has the modes 1 to 6, not {list(self.modes)}")
        for name in (name for mount in self.mounts for name in mount.variables):
            if not np.isfinite(self.stiffness.get(name, np.nan)):
                raise InputError(
                    f"natural frequencies need the stiffness of {name}, which was not measured: "
                    "measure all axes of the mounts that carry the powertrain"
                )

    @property
    def names(self) -> tuple[str, ...]:
        """Such as ``mode 1``."""
        return tuple(f"mode {mode}" for mode in self.modes)

    def __call__(self, factors: Mapping[str, RealArray]) -> RealArray:
        """Return the natural frequencies, shape (n, n_mode) [Hz]."""
        positions = [position for mount in self.mounts for position in mount.positions]
        base = _of_directions(
            self.mounts,
            {name: np.array([k]) for name, k in self.stiffness.items()} | {"": np.ones(1)},
        )
        stiffness = base * _of_directions(self.mounts, factors)
        matrix = rigid_body.mount_stiffness_matrix(positions, stiffness).real
        frequency = rigid_body.rigid_body_modes(self.powertrain.mass_matrix, matrix)[0]
        return np.asarray(frequency[:, [mode - 1 for mode in self.modes]])


@dataclass(frozen=True, eq=False)
class OperatingStiffness:
    """Magnitude of the dynamic stiffness, of a variable or of a sum of variables [N/mm].

    Parameters
    ----------
    stiffness : mapping of str to float
        Of one piece at factor 1, by variable [N/m].
    sums : mapping of str to sequence of str
        Name of each column → the variables it is the sum of, once per piece.

    Raises
    ------
    InputError
        A variable without stiffness.
    """

    stiffness: Mapping[str, float]
    sums: Mapping[str, Sequence[str]]
    unit: str = "N/mm"

    def __post_init__(self) -> None:
        for name in (name for variables in self.sums.values() for name in variables):
            if not np.isfinite(self.stiffness.get(name, np.nan)):
                raise InputError(
                    f"there is no measured stiffness of {name} to limit: use one of "
                    f"{[name for name, k in self.stiffness.items() if np.isfinite(k)]}"
                )

    @property
    def names(self) -> tuple[str, ...]:
        """Such as ``EnM z stiffness``."""
        return tuple(f"{name} stiffness" for name in self.sums)

    def __call__(self, factors: Mapping[str, RealArray]) -> RealArray:
        """Return the stiffnesses, shape (n, n_sum) [N/mm]."""
        one = factors[""]
        columns = [
            sum((factors.get(name, one) * self.stiffness[name] for name in variables), 0.0 * one)
            for variables in self.sums.values()
        ]
        return N_PER_MM * np.column_stack(columns)


def _springs(model: KinematicModel) -> list[MonotoneCurve]:
    curves = {name: MonotoneCurve(curve) for name, curve in model.curves.items()}
    return [
        curves[f"{mount.name} {axis}"]
        for mount in model.mounts
        for _ in mount.pieces
        for axis in AXES
    ]


def _of_directions(mounts: Sequence[Mount], factors: Mapping[str, RealArray]) -> RealArray:
    """Return the factor of every direction of every piece, shape (n, n_direction)."""
    return np.column_stack(
        [
            factors.get(name, factors[""])
            for mount in mounts
            for _ in mount.pieces
            for name in mount.variables
        ]
    )


def _index(model: KinematicModel, direction: str) -> int:
    if direction not in model.names:
        raise InputError(
            f"the kinematic model has no direction '{direction}': use one of {list(model.names)}"
        )
    return model.names.index(direction)
