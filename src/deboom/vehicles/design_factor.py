"""The meaning of a stiffness factor: the dynamic stiffness is scaled, or the rubber itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from typing import Literal, Protocol

import numpy as np
import numpy.typing as npt
from numpy.polynomial import chebyshev

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement.channels import LoadCase
from deboom.mounts.mount import AXES
from deboom.mounts.response_surface import DynamicStiffnessSurface, operating_points
from deboom.vehicles.coupled_motion import CoupledMotion
from deboom.vehicles.powertrain import KinematicModel

NODES = 16
"""Wheel torques at which a design's equilibrium is solved; between them it is interpolated."""

STEPS = 1001
"""Torques at which nominal deflections are tabulated, for the way back to the torque."""


@dataclass(frozen=True, eq=False)
class StaticPosition:
    """Static deflections over the lines of a run.

    Parameters
    ----------
    model : KinematicModel
        Powertrain on the quasi-static curves of its mounts.
    nodes : array, shape (n_node,)
        Wheel torques that are solved [N m].
    to_lines : array, shape (n_frequency, n_node)
        Interpolates from them to the lines [1].
    torque : array, shape (n_step,)
        Increasing [N m].
    nominal : array, shape (n_step, n_direction)
        Deflections with factor 1 there [m].

    Notes
    -----
    Polynomial through Chebyshev's points; with 16 of them the tangent stiffness at the interpolated
    deflections is within 1e-3 of that at the solved ones.
    """

    model: KinematicModel
    nodes: RealArray
    to_lines: RealArray
    torque: RealArray
    nominal: RealArray

    @classmethod
    def of(cls, model: KinematicModel, torque: RealArray, highest: float) -> StaticPosition:
        """Prepare the lines of a run.

        Parameters
        ----------
        model : KinematicModel
            Powertrain on its mounts.
        torque : array, shape (n_frequency,)
            Wheel torque of each line, above 0 [N m].
        highest : float
            Torque up to which deflections are turned back into torques [N m]; larger ones only
            read as larger.

        Raises
        ------
        InputError
            A torque that needs more deflection than a curve was measured to.
        """
        low, high = float(torque.min()), float(torque.max())
        half = (high - low) / 2
        n = NODES if half > 0 else 1
        points = np.cos(np.pi * (np.arange(n) + 0.5) / n)
        scaled = (torque - (low + high) / 2) / (half or 1.0)
        from_nodes = np.linalg.inv(chebyshev.chebvander(points, n - 1))
        to_lines: RealArray = chebyshev.chebvander(scaled, n - 1) @ from_nodes
        steps = np.linspace(0.0, 1.1 * highest, STEPS)
        nominal = model.equilibrium(steps).deflection
        nodes = (low + high) / 2 + half * points
        return cls(model, nodes, to_lines, steps, nominal)

    @property
    def rises(self) -> npt.NDArray[np.bool_]:
        """Directions whose deflection goes one way as the torque grows, shape (n_direction,)."""
        steps = np.diff(self.nominal, axis=0)
        return np.asarray((steps > 0).all(axis=0) | (steps < 0).all(axis=0))

    def deflection(self, factors: RealArray) -> RealArray:
        """Deflections of designs whose directions have `factors` (n, n_direction).

        Returns
        -------
        array, shape (n, n_frequency, n_direction)
            [m].

        Raises
        ------
        InputError
            A design that sinks further than a curve was measured to.
        """
        return np.asarray(self.to_lines @ self.model.deflections(self.nodes, factors))

    def nominal_deflection(self, torque: RealArray) -> RealArray:
        """Nominal deflections at wheel torques (..., n_direction), one per direction [m]."""
        columns = [
            np.interp(torque[..., k], self.torque, self.nominal[:, k])
            for k in range(self.nominal.shape[1])
        ]
        return np.stack(columns, axis=-1)

    def nominal_torque(self, deflection: RealArray) -> RealArray:
        """Wheel torques at which each direction rides at `deflection` (..., n_direction) [N m]."""
        columns = []
        for k, column in enumerate(self.nominal.T):
            side = 1.0 if column[-1] > column[0] else -1.0
            columns.append(np.interp(side * deflection[..., k], side * column, self.torque))
        return np.stack(columns, axis=-1)

    def slope(self, deflection: RealArray) -> RealArray:
        """Slope of the quasi-static curve at `deflection` (..., n_direction) [N/m]."""
        curves = self.model.springs
        return np.stack([c.slope(deflection[..., k]) for k, c in enumerate(curves)], axis=-1)


STEPS_2 = 41
"""Values on either side of a line's own one at which a surface is asked how far it goes, in equal
ratios."""


def backed_range(
    surface: DynamicStiffnessSurface,
    torque: RealArray,
    amplitude: RealArray,
    frequency: RealArray,
    variable: Literal["preload", "amplitude"],
    where: str,
) -> tuple[RealArray, RealArray]:
    """Find between which values of one variable a surface is backed, the others as in the run.

    Parameters
    ----------
    surface : DynamicStiffnessSurface
        Over wheel torque.
    torque, amplitude, frequency : array, shape (n_frequency,)
        Lines of a run [N m], [m], [Hz].
    variable : str
        ``preload`` or ``amplitude``.
    where : str
        Run and direction, for a complaint.

    Returns
    -------
    lowest, highest : array, shape (n_frequency,)
        About the line's own value; the nearest that are not backed end the range [N m] or [m].

    Raises
    ------
    InputError
        A line that is not backed itself; a wheel torque that is not above 0.
    """
    at_own = surface.supported(operating_points(torque, amplitude, frequency))
    if not at_own.all():
        outside = frequency[~at_own]
        raise InputError(
            f"{where}: {outside.size} of {frequency.size} lines, from {outside[0]:g} to "
            f"{outside[-1]:g} Hz, lie outside of the region that the mount was measured in, so "
            f"nothing says how it follows the {variable}: characterise it with runs of that torque "
            "and amplitude"
        )
    own = torque if variable == "preload" else amplitude
    low, high = surface.ranges[variable]
    if np.any(own <= 0.0) or low <= 0.0:
        raise InputError(
            f"{where}: a {variable} of 0 or less: take a run whose wheel torque is above 0"
        )
    bounds = []
    for end in (np.minimum(low, own), np.maximum(high, own)):
        ratio = (end / own)[:, np.newaxis] ** np.linspace(0.0, 1.0, STEPS_2)
        tried = own[:, np.newaxis] * ratio
        if variable == "preload":
            points = operating_points(tried, amplitude[:, np.newaxis], frequency[:, np.newaxis])
        else:
            points = operating_points(torque[:, np.newaxis], tried, frequency[:, np.newaxis])
        backed = surface.supported(points)
        backed[:, 0] = True
        last = np.logical_and.accumulate(backed, axis=1).sum(axis=1) - 1
        bounds.append(tried[np.arange(own.size), last])
    return np.minimum(bounds[0], own), np.maximum(bounds[1], own)


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


NODES_3 = 65
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
        place = (bounded - self.lowest) / span * (NODES_3 - 1)
        before = np.minimum(place.astype(np.intp), NODES_3 - 2)
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
        return torque, torque, np.ones((torque.size, NODES_3), dtype=complex)
    low, high = backed_range(surface, torque, amplitude, frequency, "preload", where)
    steps = np.linspace(0.0, 1.0, NODES_3)
    tried = low[:, np.newaxis] + steps * (high - low)[:, np.newaxis]
    points = operating_points(tried, amplitude[:, np.newaxis], frequency[:, np.newaxis])
    nominal = surface.predict(operating_points(torque, amplitude, frequency), extrapolate=True)
    return low, high, surface.predict(points, extrapolate=True) / nominal[:, np.newaxis]
