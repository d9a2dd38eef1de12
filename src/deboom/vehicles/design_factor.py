"""The meaning of a stiffness factor: the dynamic stiffness is scaled, or the rubber itself.

`Factor.dynamic` scales the dynamic stiffness at every static force, stops re-tuned (the thesis).
`Factor.part` scales the force at every deflection, stops where they were: the powertrain settles
elsewhere under the same torque, and the stiffness there is another one (`PartRatio`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from enum import Enum
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.polynomial import chebyshev

from deboom.arrays import AXES, BoolArray, ComplexArray, IntArray, RealArray, checked
from deboom.errors import InputError
from deboom.explore.space import DesignSpace, stiffness_factor_space
from deboom.measurement.channels import LoadCase
from deboom.mounts.response_surface import DynamicStiffnessSurface, operating_points
from deboom.vehicles.coupled_motion import CoupledMotion
from deboom.vehicles.fleet import LOSS_SUFFIX
from deboom.vehicles.powertrain import KinematicModel

TORQUE_NODES = 16
"""Wheel torques at which a design's equilibrium is solved; between them it is interpolated."""

TORQUE_STEPS = 1001
"""Torques at which nominal deflections are tabulated, for the way back to the torque."""

SURFACE_NODES = 65
"""Wheel torques per line and direction at which surfaces are tabulated."""

RANGE_STEPS = 41
"""Values on either side of a line's own one at which a surface is asked how far it goes, in equal
ratios."""


class Factor(Enum):
    """What a stiffness factor means."""

    dynamic = "dynamic"
    """The dynamic stiffness at every static force is scaled, stops are re-tuned (the thesis): of
    the quasi-static curve ``F(u)`` it makes ``F(x u)``."""
    part = "part"
    """The rubber itself is scaled, ``x F(u)``: it settles elsewhere, nearer to or further from its
    stops."""


@checked(nodes="m", to_lines="f m", torque="t", nominal="t s")
class StaticPosition:
    """Static deflections of the powertrain's mounts over the lines of a run.

    - `model`: powertrain on the quasi-static curves of its mounts.
    - `nodes` (m,): wheel torques that are solved [N m].
    - `to_lines` (f, m): interpolates from them to the lines [1].
    - `torque` (t,): increasing wheel torques of the table [N m].
    - `nominal` (t, s): deflections with factor 1 at these torques [m].

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

        - `model`: powertrain on its mounts.
        - `torque` (f,): wheel torque of each line, above 0 [N m].
        - `highest`: torque up to which deflections are turned back into torques [N m]; larger ones
          only read as larger.
        - raises InputError: a torque that needs more deflection than a curve was measured to.
        """
        low, high = float(torque.min()), float(torque.max())
        half = (high - low) / 2
        n = TORQUE_NODES if half > 0 else 1
        points = np.cos(np.pi * (np.arange(n) + 0.5) / n)
        scaled = (torque - (low + high) / 2) / (half or 1.0)
        from_nodes = np.linalg.inv(chebyshev.chebvander(points, n - 1))
        to_lines = chebyshev.chebvander(scaled, n - 1) @ from_nodes
        steps = np.linspace(0.0, 1.1 * highest, TORQUE_STEPS)
        nominal = model.equilibrium(steps)
        return cls(model, (low + high) / 2 + half * points, to_lines, steps, nominal)

    @property
    def rises(self) -> BoolArray:
        """Directions whose deflection goes one way as the torque grows, shape (s,)."""
        steps = np.diff(self.nominal, axis=0)
        return np.asarray((steps > 0).all(axis=0) | (steps < 0).all(axis=0))

    def deflection(self, factors: RealArray) -> RealArray:
        """Return the deflections of designs with `factors` (n, s), shape (n, f, s) [m].

        - raises InputError: a design that sinks further than a curve was measured to.
        """
        return np.asarray(self.to_lines @ self.model.deflections(self.nodes, factors))

    def nominal_deflection(self, torque: RealArray) -> RealArray:
        """Return nominal deflections at wheel torques (..., s), one per direction [m]."""
        columns = [
            np.interp(torque[..., k], self.torque, nominal)
            for k, nominal in enumerate(self.nominal.T)
        ]
        return np.stack(columns, axis=-1)

    def nominal_torque(self, deflection: RealArray) -> RealArray:
        """Return wheel torques at which directions ride at `deflection` (..., s) [N m]."""
        columns = []
        for k, nominal in enumerate(self.nominal.T):
            side = 1.0 if nominal[-1] > nominal[0] else -1.0
            columns.append(np.interp(side * deflection[..., k], side * nominal, self.torque))
        return np.stack(columns, axis=-1)


@checked(variables="s", torque="f", lowest="f s", highest="f s", tables="f s node")
class PartRatio:
    """Stiffness of scaled parts at their own static position over that at the nominal one.

    - `position`: where the powertrain's mounts ride.
    - `variables` (s,): design variable of each spring: those of the powertrain, then wheel ends.
    - `torque` (f,): wheel torque of each line [N m].
    - `lowest`, `highest` (f, s): wheel torques between which measurements back a surface at the
      line; both are the line's own where there is none [N m].
    - `tables` (f, s, SURFACE_NODES): stiffness at equal steps between those torques, over that at
      the line's own, complex [1].

    The scaled part at the static force F0 rides where the nominal one rides at ``F0/x``. Hence its
    stiffness is ``x S(T')`` with the wheel torque T' at which the nominal mount deflects as far as
    the scaled one does under the line's torque. The surface S speaks between `lowest` and
    `highest`. Beyond, the stiffness follows the slope of the quasi-static curve from there on:
    ``S(T_bound) k(u)/k(u_bound)``. The load on a wheel end (wishbone mount) is statically
    determined and proportional to the wheel torque, so ``T' = T/x``; beyond the bounds, where
    nothing is known of its deflection, its stiffness stays. `clipped` says where either happens.
    """

    position: StaticPosition
    variables: IntArray
    torque: RealArray
    lowest: RealArray
    highest: RealArray
    tables: ComplexArray

    def __call__(self, designs: RealArray) -> ComplexArray:
        """Return ratios of designs (n, k), shape (n, f, s) [1].

        - raises InputError: a design that sinks further than a curve was measured to.
        """
        return np.asarray(self._stiffness(designs) / self._nominal)

    def clipped(self, designs: RealArray) -> BoolArray:
        """Say where a preload lies beyond what measurements back, shape (n, f, s)."""
        torque, _ = self._equivalent(designs)
        tabulated = self.highest > self.lowest
        return np.asarray(((torque < self.lowest) | (torque > self.highest)) & tabulated)

    @property
    def _n_body(self) -> int:
        return int(self.position.nominal.shape[1])

    @cached_property
    def _nominal(self) -> ComplexArray:
        """Stiffness with all factors 1, as interpolated."""
        return self._stiffness(np.ones((1, 1 + int(np.max(self.variables)))))

    def _equivalent(self, designs: RealArray) -> tuple[RealArray, RealArray]:
        """Return wheel torques T' of each line and spring, and deflections of the powertrain's."""
        factors = designs[:, self.variables]
        deflection = self.position.deflection(factors[:, : self._n_body])
        body = self.position.nominal_torque(deflection)
        wheel_ends = self.torque[:, np.newaxis] / factors[:, np.newaxis, self._n_body :]
        return np.concatenate([body, wheel_ends], axis=2), deflection

    def _stiffness(self, designs: RealArray) -> ComplexArray:
        torque, deflection = self._equivalent(designs)
        bounded = np.clip(torque, self.lowest, self.highest)
        span = np.where(self.highest > self.lowest, self.highest - self.lowest, 1.0)
        place = (bounded - self.lowest) / span * (SURFACE_NODES - 1)
        before = np.minimum(place.astype(np.intp), SURFACE_NODES - 2)
        share = place - before
        line, spring = np.ogrid[: self.torque.size, : torque.shape[2]]
        stiffness = (1.0 - share) * self.tables[line, spring, before]
        stiffness += share * self.tables[line, spring, before + 1]
        on_body = slice(0, self._n_body)
        bound = self.position.nominal_deflection(bounded[..., on_body])
        beyond = bounded[..., on_body] != torque[..., on_body]
        slopes = self.position.model.slope(deflection) / self.position.model.slope(bound)
        stiffness[..., on_body] *= np.where(beyond, slopes, 1.0)
        return np.asarray(stiffness)


def part_ratio(
    model: KinematicModel,
    coupled: CoupledMotion,
    surfaces: Mapping[str, DynamicStiffnessSurface],
    load_case: LoadCase,
) -> PartRatio:
    """Prepare the stiffness of scaled parts in one load case.

    - `model`: powertrain on the quasi-static curves of its mounts.
    - `coupled`: motion identified from the load case.
    - `surfaces`: surfaces by design variable, over wheel torque.
    - `load_case`: load case with its engine torque.
    - raises InputError: other directions than those of the kinematic model; no engine torque; a
      line outside of where a mount was measured; a torque beyond a static curve.
    """
    names = [coupled.variable_names[k] for k in coupled.variables]
    on_body = names[: coupled.bodies[0].variables.size]
    carried = [f"{m.name} {axis}" for m in model.mounts for _ in m.pieces for axis in AXES]
    if carried != on_body:
        raise InputError(
            f"load case {load_case.name}: the kinematic model carries {carried}, the powertrain "
            f"hangs on {on_body}: take the same mounts in the same order"
        )
    inside = np.isin(load_case.displacement.frequency, coupled.frequency)
    torque = load_case.wheel_torque[inside]
    amplitude = coupled.nominal_amplitude
    trained = [surface.ranges["preload"][1] for surface in surfaces.values()]
    position = StaticPosition.of(model, torque, max([float(torque.max()), *trained]))
    tables = []
    for column, name in enumerate(names):
        # where a direction turns back, a deflection does not tell the torque
        tells = column >= len(on_body) or position.rises[column]
        surface = surfaces.get(name) if tells else None
        where = f"load case {load_case.name}, {name}"
        line = (torque, amplitude[:, column], coupled.frequency)
        tables.append(_preload_table(surface, *line, where))
    lowest, highest, stiffness = (np.stack(part, axis=1) for part in zip(*tables, strict=True))
    return PartRatio(position, coupled.variables, torque, lowest, highest, stiffness)


def backed_range(
    surface: DynamicStiffnessSurface,
    torque: RealArray,
    amplitude: RealArray,
    frequency: RealArray,
    variable: Literal["preload", "amplitude"],
    where: str,
) -> tuple[RealArray, RealArray]:
    """Find between which values of one variable a surface is backed, the others as in the run.

    - `surface`: surface over wheel torque.
    - `torque`, `amplitude`, `frequency` (f,): lines of a run [N m], [m], [Hz].
    - `variable`: ``preload`` or ``amplitude``.
    - `where`: run and direction, for a complaint.
    - returns `lowest`, `highest` (f,): range about the line's own value; the nearest that are not
      backed end the range [N m] or [m].
    - raises InputError: a line that is not backed itself; a wheel torque that is not above 0.
    """
    backed = surface.supported(operating_points(torque, amplitude, frequency))
    if not backed.all():
        outside = frequency[~backed]
        raise InputError(
            f"{where}: {outside.size} of {frequency.size} lines, from {outside[0]:g} to "
            f"{outside[-1]:g} Hz, lie outside of the region that the mount was measured in, so "
            f"nothing says how it follows the {variable}: characterise it with runs of that torque "
            "and amplitude"
        )
    nominal = torque if variable == "preload" else amplitude
    low, high = surface.ranges[variable]
    if np.any(nominal <= 0.0) or low <= 0.0:
        raise InputError(
            f"{where}: a {variable} of 0 or less: take a run whose wheel torque is above 0"
        )
    bounds = []
    for end in (np.minimum(low, nominal), np.maximum(high, nominal)):
        ratio = (end / nominal)[:, np.newaxis] ** np.linspace(0.0, 1.0, RANGE_STEPS)
        tried = nominal[:, np.newaxis] * ratio
        if variable == "preload":
            points = operating_points(tried, amplitude[:, np.newaxis], frequency[:, np.newaxis])
        else:
            points = operating_points(torque[:, np.newaxis], tried, frequency[:, np.newaxis])
        backed = surface.supported(points)
        backed[:, 0] = True
        last = np.logical_and.accumulate(backed, axis=1).sum(axis=1) - 1
        bounds.append(tried[np.arange(nominal.size), last])
    return np.minimum(bounds[0], nominal), np.maximum(bounds[1], nominal)


def _preload_table(
    surface: DynamicStiffnessSurface | None,
    torque: RealArray,
    amplitude: RealArray,
    frequency: RealArray,
    where: str,
) -> tuple[RealArray, RealArray, ComplexArray]:
    """Return bounds (f,) of the wheel torque and relative stiffness (f, nodes) between them."""
    if surface is None:
        return torque, torque, np.ones((torque.size, SURFACE_NODES), dtype=complex)
    low, high = backed_range(surface, torque, amplitude, frequency, "preload", where)
    steps = np.linspace(0.0, 1.0, SURFACE_NODES)
    tried = low[:, np.newaxis] + steps * (high - low)[:, np.newaxis]
    points = operating_points(tried, amplitude[:, np.newaxis], frequency[:, np.newaxis])
    nominal = surface.predict(operating_points(torque, amplitude, frequency), extrapolate=True)
    return low, high, surface.predict(points, extrapolate=True) / nominal[:, np.newaxis]


def with_brackets(factors: RealArray, softness: RealArray) -> RealArray:
    """Return what factors of the rubber make of the mounts with their brackets.

    - `factors` (..., k): stiffness factors x of the rubber [1].
    - `softness` (k,): stiffness of today's mount over that of its bracket, r; 0 of a rigid one [1].
    - returns (..., k): stiffness in the car over today's there, ``(1 + r)/(1/x + r)`` [1].
    """
    return np.asarray((1.0 + softness) / (1.0 / factors + softness))


def factor_space(names: Sequence[str], half_width: float, tolerance: float) -> DesignSpace:
    """Return the space of a study's factors: stiffnesses scatter, loss factors do not.

    - `names`: variables of the booming index; those of loss factors end in ``loss``.
    - `half_width`, `tolerance`, errors: as for `deboom.explore.space.stiffness_factor_space` [1].
    """
    space = stiffness_factor_space(names, half_width, tolerance)
    made = [0.0 if name.endswith(LOSS_SUFFIX) else tolerance for name in names]
    return replace(space, tolerance=np.array(made))
