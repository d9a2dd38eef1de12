"""What a stiffness factor means: the curve K(F0) scaled, or the rubber itself.

``DYNAMIC`` scales the dynamic stiffness at every static force, stops re-tuned (the thesis). A
`PartFactor` scales the force at every deflection, stops where they were: the powertrain settles
elsewhere under the same torque, and the stiffness there is another one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from typing import Protocol

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement.load_case import LoadCase
from deboom.mounts.mount import AXES
from deboom.mounts.response_surface import DynamicStiffnessSurface
from deboom.vehicles.coupled_motion import CoupledMotion
from deboom.vehicles.kinematic_model import KinematicModel
from deboom.vehicles.static_position import StaticPosition
from deboom.vehicles.surface_limits import backed_range


class Factor(Enum):
    """What a stiffness factor means."""

    dynamic = "dynamic"
    """The dynamic stiffness at every static force is scaled, stops are re-tuned (the thesis): of
    the quasi-static curve ``F(u)`` it makes ``F(x u)``."""
    part = "part"
    """The rubber itself is scaled, ``x F(u)``: it settles elsewhere, nearer to or further from its
    stops."""


class StiffnessRatio(Protocol):
    """How the stiffness of each line and direction changes because a mount rides elsewhere."""

    def __call__(self, designs: RealArray) -> ComplexArray | None:
        """Return ratios of designs (n, n_variable), shape (n, n_frequency, n_direction) [1].

        None where no design changes any.
        """

    def held(self, designs: RealArray) -> npt.NDArray[np.bool_]:
        """Where a preload lies beyond what measurements back, (n, n_frequency, n_direction)."""


class DesignFactor(Protocol):
    """A meaning of the stiffness factors."""

    @property
    def name(self) -> str:
        """What the run's record calls it."""

    def ratio(
        self,
        coupled: CoupledMotion,
        surfaces: Mapping[str, DynamicStiffnessSurface],
        load_case: LoadCase,
        /,
    ) -> StiffnessRatio:
        """Say what factors do in one load case beside scaling the stiffness."""


@dataclass(frozen=True)
class DynamicRatio:
    """The factor scales ``K(F0)`` at the same static force: no further change."""

    def __call__(self, designs: RealArray) -> None:
        """Return None."""

    def held(self, designs: RealArray) -> npt.NDArray[np.bool_]:
        """Return False, shape (n, 1, 1)."""
        return np.zeros((len(designs), 1, 1), dtype=bool)


@dataclass(frozen=True)
class DynamicFactor:
    """``K(F0) → x K(F0)``: the dynamic stiffness at every static force, stops re-tuned."""

    name: str = Factor.dynamic.value

    def ratio(
        self,
        _coupled: CoupledMotion,
        _surfaces: Mapping[str, DynamicStiffnessSurface],
        _load_case: LoadCase,
        /,
    ) -> DynamicRatio:
        """Return a ratio that changes nothing."""
        return DynamicRatio()


DYNAMIC = DynamicFactor()
"""The thesis's meaning, and the default."""


@dataclass(frozen=True, eq=False)
class PartFactor:
    """``F(u) → x F(u)``: the rubber itself, its stops where they were.

    Parameters
    ----------
    model : KinematicModel
        Powertrain on the quasi-static curves of its mounts.
    name : str
        What the run's record calls it.
    """

    model: KinematicModel
    name: str = Factor.part.value

    def ratio(
        self,
        coupled: CoupledMotion,
        surfaces: Mapping[str, DynamicStiffnessSurface],
        load_case: LoadCase,
        /,
    ) -> PartRatio:
        """Prepare one load case.

        Parameters
        ----------
        coupled : CoupledMotion
            Identified from the load case.
        surfaces : mapping of str to DynamicStiffnessSurface
            By design variable, over wheel torque.
        load_case : LoadCase
            With its engine torque.

        Raises
        ------
        InputError
            A powertrain direction that the kinematic model lacks; a run without engine torque; a
            line outside of the region in which a mount was measured.
        """
        names = [coupled.variable_names[k] for k in coupled.variables]
        own = [coupled.variable_names[k] for k in coupled.own_variables]
        known = [f"{m.name} {axis}" for m in self.model.mounts for _ in m.pieces for axis in AXES]
        if known != names:
            raise InputError(
                f"load case {load_case.name}: the kinematic model carries {known}, the powertrain "
                f"hangs on {names}: take the same mounts in the same order"
            )
        inside = np.isin(load_case.displacement.frequency, coupled.frequency)
        torque = load_case.wheel_torque[inside]
        amplitude = coupled.nominal_amplitude
        trained = [surface.ranges["preload"][1] for surface in surfaces.values()]
        position = StaticPosition.of(self.model, torque, max([float(torque.max()), *trained]))
        tables = []
        for column, name in enumerate([*names, *own]):
            # where a direction turns back, a deflection does not tell the torque
            tells = column >= len(names) or position.rises[column]
            surface = surfaces.get(name) if tells else None
            where = f"load case {load_case.name}, {name}"
            line = (torque, amplitude[:, column], coupled.frequency)
            tables.append(_preload_table(surface, *line, where))
        return PartRatio(
            position=position,
            variables=coupled.variables,
            own_variables=coupled.own_variables,
            torque=torque,
            lowest=np.stack([low for low, _, _ in tables], axis=1),
            highest=np.stack([high for _, high, _ in tables], axis=1),
            tables=np.stack([table for _, _, table in tables], axis=1),
        )


NODES = 65
"""Wheel torques per line and direction at which surfaces are tabulated."""


@dataclass(frozen=True, eq=False)
class PartRatio:
    """Stiffness of scaled parts at their own static position over that at the nominal one.

    Parameters
    ----------
    position : StaticPosition
        Where the powertrain's mounts ride.
    variables, own_variables : array of int
        Design variable of each direction of the powertrain, and of bodies of their own.
    torque : array, shape (n_frequency,)
        Wheel torque of each line [N m].
    lowest, highest : array, shape (n_frequency, n_direction)
        Wheel torques between which measurements back a surface at the line; both are the line's
        own where there is none [N m].
    tables : array, shape (n_frequency, n_direction, NODES)
        Stiffness at equal steps between those torques, over that at the line's own, complex [1].

    Notes
    -----
    The scaled part at the static force F0 rides where the nominal one rides at ``F0/x``. Hence its
    stiffness is ``x S(T')`` with the wheel torque T' at which the nominal mount deflects as far as
    the scaled one does under the line's torque. The surface S speaks between `lowest` and
    `highest`. Beyond, the stiffness follows the slope of the quasi-static curve from there on:
    ``S(T_bound) k(u)/k(u_bound)``. The load on a body of its own (wishbone mount) is statically
    determined and proportional to the wheel torque, so ``T' = T/x``; beyond the bounds, where
    nothing is known of its deflection, its stiffness stays. `held` says where either happens.
    """

    position: StaticPosition
    variables: npt.NDArray[np.intp]
    own_variables: npt.NDArray[np.intp]
    torque: RealArray
    lowest: RealArray
    highest: RealArray
    tables: ComplexArray

    def __call__(self, designs: RealArray) -> ComplexArray:
        """Return ratios of designs (n, n_variable), shape (n, n_frequency, n_direction) [1].

        Raises
        ------
        InputError
            A design that sinks further than a curve was measured to.
        """
        return np.asarray(self._stiffness(designs) / self._nominal)

    @cached_property
    def _nominal(self) -> ComplexArray:
        """Stiffness with all factors 1, as interpolated."""
        n_variable = 1 + int(np.max([*self.variables, *self.own_variables]))
        return self._stiffness(np.ones((1, n_variable)))

    def held(self, designs: RealArray) -> npt.NDArray[np.bool_]:
        """Where a preload lies beyond what measurements back, (n, n_frequency, n_direction)."""
        torque, _ = self._equivalent(designs)
        tabulated = self.highest > self.lowest
        return np.asarray(((torque < self.lowest) | (torque > self.highest)) & tabulated)

    def _equivalent(self, designs: RealArray) -> tuple[RealArray, RealArray]:
        """Wheel torques T' of each line and direction, and deflections of the powertrain's."""
        deflection = self.position.deflection(designs[:, self.variables])
        body = self.position.nominal_torque(deflection)
        own = self.torque[:, np.newaxis] / designs[:, np.newaxis, self.own_variables]
        return np.concatenate([body, own], axis=2), deflection

    def _stiffness(self, designs: RealArray) -> ComplexArray:
        torque, deflection = self._equivalent(designs)
        bounded = np.clip(torque, self.lowest, self.highest)
        span = np.where(self.highest > self.lowest, self.highest - self.lowest, 1.0)
        place = (bounded - self.lowest) / span * (NODES - 1)
        before = np.minimum(place.astype(np.intp), NODES - 2)
        share = place - before
        line, direction = np.ogrid[: self.torque.size, : torque.shape[2]]
        found = (1.0 - share) * self.tables[line, direction, before]
        found += share * self.tables[line, direction, before + 1]
        n_body = self.variables.size
        bound = self.position.nominal_deflection(bounded[..., :n_body])
        beyond = bounded[..., :n_body] != torque[..., :n_body]
        slopes = self.position.slope(deflection) / self.position.slope(bound)
        found[..., :n_body] *= np.where(beyond, slopes, 1.0)
        return np.asarray(found)


def _preload_table(
    surface: DynamicStiffnessSurface | None,
    torque: RealArray,
    amplitude: RealArray,
    frequency: RealArray,
    where: str,
) -> tuple[RealArray, RealArray, ComplexArray]:
    """Bounds (f,) of the wheel torque and relative stiffness (f, NODES) between them."""
    if surface is None:
        return torque, torque, np.ones((torque.size, NODES), dtype=complex)
    low, high = backed_range(surface, torque, amplitude, frequency, "preload", where)
    steps = np.linspace(0.0, 1.0, NODES)
    tried = low[:, np.newaxis] + steps * (high - low)[:, np.newaxis]
    line = (amplitude[:, np.newaxis], frequency[:, np.newaxis])
    stiffness, _ = surface.predict_masked(tried, *line)
    own, _ = surface.predict_masked(torque, amplitude, frequency)
    return low, high, stiffness / own[:, np.newaxis]
