"""Coupled motion: the powertrain and the wheel ends, solved again when stiffnesses change."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg import block_diag

from deboom.arrays import AXES, BoolArray, ComplexArray, IntArray, RealArray, checked
from deboom.errors import InputError
from deboom.measurement.channels import Band, LoadCase, lines_inside, refuse_doubled
from deboom.mounts.mount import SIDES, Mount, Side, in_mount_axes, not_identified
from deboom.physics.dynamic_stiffness import dynamic_stiffness
from deboom.physics.rigid_body import LARGEST_RESIDUAL, forward_matrices, not_rigid
from deboom.vehicles.fleet import Fleet, path_transfer, paths_into, spring_transfer, with_loss_names
from deboom.vehicles.powertrain import Powertrain, mount_forward

BLOCK = 16
"""Designs solved at once; bounds the memory."""

CLEARLY_LESS = 3.0
"""How many times less of the motion a reversed channel's right sign leaves over [1]."""

_Direction = tuple[Mount, int, str, str]
"""Mount, number of its piece, axis, channel."""


@checked(
    mass_matrix="q q",
    forward="s q",
    stiffness="f s",
    load="f q",
    variables="s",
    transfer="v f s",
)
class Body:
    """A rigid body on springs under an external load.

    - `mass_matrix` (q, q): mass matrix of its q degrees of freedom [kg, kg m, kg m²].
    - `forward` (s, q): forward matrix: motion of the body to displacement of each spring
      [1, m/rad].
    - `stiffness` (f, s): complex dynamic stiffness of each spring at factor 1 [N/m].
    - `load` (f, q): external load [N, N m].
    - `variables` (s,): design variable that scales each spring.
    - `transfer` (v, f, s): force of each spring to the pressure of each response; zero where an
      axis does not transmit [Pa/N].
    """

    mass_matrix: RealArray
    forward: RealArray
    stiffness: ComplexArray
    load: ComplexArray
    variables: IntArray
    transfer: ComplexArray

    def solve(self, springs: ComplexArray, squared: RealArray, load: ComplexArray) -> ComplexArray:
        """Return the spring displacements of loads (..., q, n), shape (..., s, n) [m].

        `springs` (..., s) are stiffnesses [N/m], `squared` (...) is ω² [rad²/s²].
        """
        inertia = squared[..., np.newaxis, np.newaxis] * self.mass_matrix
        impedance = self.forward.T @ (springs[..., np.newaxis] * self.forward) - inertia
        if len(self.mass_matrix) == 1:
            return np.asarray(self.forward @ (load / impedance))
        return np.asarray(self.forward @ np.linalg.solve(impedance, load))


@checked(frequency="f")
class CoupledMotion:
    """Equations of motion of one load case, and the paths from its springs to the ears.

    The first body is the powertrain with six degrees of freedom on all directions of its mounts.
    Each piece of any other mount (wishbone mount) carries a wheel end that moves along each
    transfer axis, or along each axis of a tilted mount: a body with one degree of freedom. All
    arrays over springs hold those of the first body first. Springs lie along the axes of their
    mounts.

    - `load_case`: name of the load case.
    - `frequency` (f,): lines of the band [Hz].
    - `bodies`: powertrain, then wheel ends.
    - `vehicle_names`, `variable_names`: names of responses, each of a receiver in a vehicle, and of
      design variables.
    """

    load_case: str
    frequency: RealArray
    bodies: tuple[Body, ...]
    vehicle_names: tuple[str, ...]
    variable_names: tuple[str, ...]

    @property
    def stiffness(self) -> ComplexArray:
        """Stiffness of all springs at factor 1, shape (f, s) [N/m]."""
        return np.concatenate([body.stiffness for body in self.bodies], axis=1)

    @property
    def variables(self) -> IntArray:
        """Design variable of each spring, shape (s,)."""
        return np.concatenate([body.variables for body in self.bodies])

    @property
    def transfer(self) -> ComplexArray:
        """Force of each spring to pressure, shape (v, f, s) [Pa/N]."""
        return np.concatenate([body.transfer for body in self.bodies], axis=2)

    @property
    def transmits(self) -> BoolArray:
        """Lines at which any path reaches the ear, shape (v, f)."""
        return np.asarray(self.transfer.any(axis=2))

    @property
    def nominal_amplitude(self) -> RealArray:
        """Peak displacement of each spring with all factors 1, shape (f, s) [m]."""
        return np.asarray(np.abs(self.displacement(self.stiffness[np.newaxis])[0]))

    @property
    def angular_frequency_squared(self) -> RealArray:
        """ω² of each line [rad²/s²]."""
        return np.asarray((2.0 * np.pi * self.frequency) ** 2)

    def springs(self, designs: RealArray) -> ComplexArray:
        """Return the stiffnesses of designs (n, k), shape (n, f, s) [N/m]."""
        return np.asarray(designs[:, np.newaxis, self.variables] * self.stiffness)

    def displacement(self, springs: ComplexArray, lines: IntArray | None = None) -> ComplexArray:
        """Return the complex peak displacement of springs with given stiffnesses.

        - `springs` (..., f, s): stiffness of every spring [N/m].
        - `lines`, optional: line of each entry of the last but one axis; by default all lines.
        - returns (..., f, s) [m].

        ``(Σ_i k_i v_i v_iᵀ − ω² M) q = F`` for each body, and ``v_iᵀ q``.
        """
        at = slice(None) if lines is None else lines
        squared = self.angular_frequency_squared[at]
        moved = [
            body.solve(springs[..., columns], squared, body.load[at][..., np.newaxis])[..., 0]
            for body, columns in self._columns()
        ]
        return np.concatenate(moved, axis=-1)

    def force(self, designs: RealArray) -> ComplexArray:
        """Return the force of every spring of designs (n, k), shape (n, f, s) [N]."""
        springs = self.springs(designs)
        # named: numpy multiplies into large temporaries in place, with other last bits
        displacement = self.displacement(springs)
        return springs * displacement

    def force_in(self, designs: RealArray, response: int) -> ComplexArray:
        """Return the force of every spring of designs (n, k) for one response, (n, f, s) [N]."""
        del response  # bodies at rest are alike
        return self.force(designs)

    def pressure(self, designs: RealArray) -> ComplexArray:
        """Return the pressure at the ears for designs (n, k).

        - returns (n, v, f): complex peak amplitudes [Pa].
        """
        pressure = np.empty((len(designs), *self.transfer.shape[:2]), dtype=complex)
        for rows in _blocks(len(designs)):
            pressure[rows] = self.heard(self.force(designs[rows]))
        return pressure

    def heard(self, force: ComplexArray) -> ComplexArray:
        """Return the pressure of spring forces (n, f, s) [N], shape (n, v, f) [Pa]."""
        # line by line: an einsum over all would round a design by the designs beside it
        by_line = np.moveaxis(self.transfer, 0, 1) @ force[..., np.newaxis]
        return np.moveaxis(by_line[..., 0], 1, 2)

    def neper_gradient(self, designs: RealArray) -> RealArray:
        """Return ``Σ_f Re(∂p/∂x_k / p)`` for designs (n, k), shape (n, v, k) [1]."""
        return self.weighted_gradient(designs, 1.0 / self.pressure(designs))

    def weighted_gradient(self, designs: RealArray, factor: ComplexArray) -> RealArray:
        """Return ``Σ_f Re(a_f ∂p/∂x_k)`` for designs (n, k), by the adjoint.

        - `designs` (n, k): stiffness factors [1].
        - `factor` (n, v, f): the factor a of each line [1/Pa].
        - returns (n, v, k) [1].

        With ``t_v = Z⁻¹ Σ_i x_i K_i Y_vi v_i`` of each body (Z is symmetric),
        ``∂p_v/∂x_i = K_i (v_iᵀ q) (Y_vi − v_iᵀ t_v)``.
        """
        gradient = np.zeros((len(designs), len(self.vehicle_names), len(self.variable_names)))
        squared = self.angular_frequency_squared
        for rows in _blocks(len(designs)):
            springs = self.springs(designs[rows])
            for body, columns in self._columns():
                scaled = springs[..., columns]
                adjoint = (scaled[:, np.newaxis] * body.transfer) @ body.forward
                load = np.broadcast_to(body.load, (len(scaled), *body.load.shape))
                both = [load[..., np.newaxis], np.moveaxis(adjoint, 1, -1)]
                solved = body.solve(scaled, squared, np.concatenate(both, axis=-1))
                displacement, answer = solved[..., 0], np.moveaxis(solved[..., 1:], -1, 1)
                slope = (body.stiffness * displacement)[:, np.newaxis] * (body.transfer - answer)
                by_spring = np.einsum("dvf,dvfi->dvi", factor[rows], slope).real
                for column, variable in enumerate(body.variables):
                    gradient[rows, :, variable] += by_spring[..., column]
        return gradient

    def with_stiffness(self, stiffness: ComplexArray) -> CoupledMotion:
        """Return the same equations of motion with other stiffnesses (f, s) at factor 1 [N/m]."""
        bodies = [
            replace(body, stiffness=stiffness[:, columns]) for body, columns in self._columns()
        ]
        return replace(self, bodies=tuple(bodies))

    def at_lines(self, lines: IntArray) -> CoupledMotion:
        """Return the equations of motion of some lines only."""
        bodies = [
            replace(
                body,
                stiffness=body.stiffness[lines],
                load=body.load[lines],
                transfer=body.transfer[:, lines],
            )
            for body in self.bodies
        ]
        return replace(self, frequency=self.frequency[lines], bodies=tuple(bodies))

    def with_loss_factors(self) -> CoupledMotion:
        """Split every spring into ``x K' + z j K''``, as a function of (x, z)."""
        n_variable = len(self.variable_names)
        bodies = [
            replace(
                body,
                forward=np.concatenate([body.forward, body.forward]),
                stiffness=np.hstack([body.stiffness.real, 1j * body.stiffness.imag]),
                variables=np.concatenate([body.variables, body.variables + n_variable]),
                transfer=np.concatenate([body.transfer, body.transfer], axis=2),
            )
            for body in self.bodies
        ]
        names = with_loss_names(self.variable_names)
        return replace(self, bodies=tuple(bodies), variable_names=names)

    def with_parts(self, others: Sequence[CoupledMotion], part: IntArray) -> CoupledMotion:
        """Return the motion with other parts: stiffness of variable k from ``others[part[k]]``.

        The loads stay: they come from the motion and forces that were measured with the parts of
        this motion. The stiffness of another part is that of its surface at today's amplitude.
        """
        stacked = np.stack([other.stiffness for other in others])
        springs = np.arange(self.variables.size)
        return self.with_stiffness(stacked[part[self.variables], :, springs].T)

    def _columns(self) -> Iterator[tuple[Body, slice]]:
        """Yield every body with the columns of its springs."""
        first = 0
        for body in self.bodies:
            yield body, slice(first, first + body.variables.size)
            first += body.variables.size


@checked(frequency="f", receptance="b f s s", body_of="v")
class FlexibleMotion(CoupledMotion):
    """Coupled motion whose springs stand on a body that gives way.

    - `receptance` (b, f, s, s): displacement of each body at every spring per force of every
      spring, along the springs, and on the diagonal what brackets give way besides [m/N].
    - `body_of` (v,): number of the body in which each response is heard.

    Loads are those of `CoupledMotion`: what keeps the measured motion going on a body at rest, such
    as a bench. Each vehicle moves on its own, so forces are those in one vehicle.
    """

    receptance: ComplexArray
    body_of: IntArray

    @cached_property
    def source(self) -> ComplexArray:
        """Receptance of the bodies on the springs, without them: ``V (−ω² M)⁻¹ Vᵀ``, (f, s, s)."""
        each = [
            body.forward @ np.linalg.solve(body.mass_matrix, body.forward.T)
            for body, _ in self._columns()
        ]
        inverse = -1.0 / self.angular_frequency_squared
        return np.asarray(inverse[:, np.newaxis, np.newaxis] * block_diag(*each), dtype=complex)

    @cached_property
    def free(self) -> ComplexArray:
        """Displacement at the springs under the bodies' loads, without springs, (f, s) [m]."""
        moved = [
            np.linalg.solve(body.mass_matrix, body.load.T).T @ body.forward.T
            for body, _ in self._columns()
        ]
        return np.asarray(-np.hstack(moved) / self.angular_frequency_squared[:, np.newaxis])

    def force_in(self, designs: RealArray, response: int) -> ComplexArray:
        """Return the force of every spring on the body of a response for designs (n, k).

        - returns (n, f, s) [N].

        ``(diag(1/(x K)) + Y_S + Y_B) g = u_free``.
        """
        joined = self._joined(designs, int(self.body_of[response]))
        return np.asarray(np.linalg.solve(joined, self.free[..., np.newaxis])[..., 0])

    def pressure(self, designs: RealArray) -> ComplexArray:
        """Return the pressure at the ears for designs (n, k), shape (n, v, f) [Pa]."""
        pressure = np.empty((len(designs), *self.transfer.shape[:2]), dtype=complex)
        transfer = self.transfer
        for rows in _blocks(len(designs)):
            for responses in self._of_bodies():
                force = self.force_in(designs[rows], responses[0])
                for response in responses:
                    heard = np.einsum("dfs,fs->df", force, transfer[response])
                    pressure[rows, response] = heard
        return pressure

    def weighted_gradient(self, designs: RealArray, factor: ComplexArray) -> RealArray:
        """Return ``Σ_f Re(a_f ∂p/∂x_k)`` for designs (n, k), by the adjoint, (n, v, k) [1].

        With ``A = diag(1/(x K)) + Y_S + Y_B`` and ``t = A⁻¹ Y`` (A is symmetric),
        ``∂p/∂x_i = t_i g_i / (x_i² K_i)``.
        """
        gradient = np.zeros((len(designs), len(self.vehicle_names), len(self.variable_names)))
        transfer, compliance = self.transfer, 1.0 / self.stiffness
        for rows in _blocks(len(designs)):
            scale = compliance / designs[rows][:, np.newaxis, self.variables] ** 2
            for vehicle, heard in enumerate(transfer):
                right = np.stack([self.free, heard], axis=-1)
                joined = self._joined(designs[rows], int(self.body_of[vehicle]))
                solved = np.linalg.solve(joined, right)
                slope = solved[..., 0] * solved[..., 1] * scale
                by_spring = np.einsum("df,dfi->di", factor[rows, vehicle], slope).real
                for column, variable in enumerate(self.variables):
                    gradient[rows, vehicle, variable] += by_spring[:, column]
        return gradient

    def at_lines(self, lines: IntArray) -> FlexibleMotion:
        """Return the equations of motion of some lines only."""
        rigid = CoupledMotion(**vars_of(self)).at_lines(lines)
        receptance = self.receptance[:, lines]
        return FlexibleMotion(**vars_of(rigid), receptance=receptance, body_of=self.body_of)

    def with_loss_factors(self) -> FlexibleMotion:
        """Split every spring into ``x K' + z j K''``, as a function of (x, z)."""
        rigid, order, first = super().with_loss_factors(), [], 0
        for body in self.bodies:
            columns = np.arange(first, first + body.variables.size)
            order += [*columns, *columns]
            first += body.variables.size
        both = self.receptance[:, :, order][..., order]
        return FlexibleMotion(**vars_of(rigid), receptance=both, body_of=self.body_of)

    def _of_bodies(self) -> list[list[int]]:
        """Return the numbers of the responses in each body that has any."""
        of_bodies = [np.flatnonzero(self.body_of == body) for body in range(len(self.receptance))]
        return [responses.tolist() for responses in of_bodies if responses.size]

    def _joined(self, designs: RealArray, body: int) -> ComplexArray:
        """Return ``diag(1/(x K)) + Y_S + Y_B`` of designs (n, k), shape (n, f, s, s) [m/N]."""
        compliance = 1.0 / self.springs(designs)
        springs = np.eye(self.variables.size) * compliance[..., np.newaxis]
        return np.asarray(springs + (self.source + self.receptance[body]))


def vars_of(motion: CoupledMotion) -> dict[str, Any]:
    """Return the fields of coupled motion itself, to build another kind of motion of."""
    return {item.name: getattr(motion, item.name) for item in fields(CoupledMotion)}


def coupled_motion(
    fleet: Fleet,
    mounts: Sequence[Mount],
    powertrain: Powertrain | None,
    load_case: LoadCase,
    band: Band = (20.0, 60.0),
    *,
    with_drawn_errors: bool = False,
) -> CoupledMotion:
    """Identify the equations of motion of one load case from its measured motion and forces.

    Parameters
    ----------
    fleet : Fleet
        Noise transfer functions of each vehicle, and the receptances of all bodies or of none.
    mounts : sequence of Mount
        Powertrain mounts, with all three axes measured, and mounts with a body mass.
    powertrain : Powertrain or None
        Mass matrix from the data sheet, without which motion cannot answer.
    load_case : LoadCase
        Operating motion and force.
    band : (lower, upper)
        Both edges belong to the band [Hz].
    with_drawn_errors : bool
        Whether errors of sensors were drawn into the data, which may then leave a motion that is
        not rigid; measured data of that kind are refused.

    Raises
    ------
    InputError
        No powertrain; a channel that was not measured; powertrain mounts that leave a rigid motion
        undetermined; measured motion that is not rigid; a direction without any motion; receptances
        of some vehicles alone, or of other lines; a bracket softer than its mount; see also
        `deboom.vehicles.fleet.path_contributions`.

    Notes
    -----
    Per line, the powertrain's motion q is the least-squares fit ``V q ≈ s`` to the displacements of
    its mounts, and ``K_i = f_i / (V q)_i``: the stiffness belongs to the fitted displacement, which
    is closer to the truth than a single channel. The external load is what keeps the measured
    motion going, ``F = Vᵀ f − ω² M q``, with the nominal mass matrix M; a wheel end has
    ``L = f − ω² m s``. Then the factors change with K and F fixed per line:
    ``(Σ x_i K_i v_i v_iᵀ − ω² M) q(x) = F``, with v along the mount's own axes. At all factors 1
    this gives the measured forces and the fitted motion exactly, whatever the data sheet's errors
    and the residual of the fit.

    K does not feel the new amplitude or the new static position (that would be another model of
    the motion). Without receptances the car body stays at rest: blocked forces on a trimmed body.
    With them powertrain, wheel ends and body move together, see `FlexibleMotion`, and the measured
    forces are taken as those on a bench at rest. So they are with brackets: K is that of the mount
    as tested, and the car has a bracket's K_b in series with x k K, k of the rubber in the car.
    """
    if powertrain is None:
        raise InputError(
            "motion can answer only where mass and inertia of the powertrain are known: fill in "
            "[powertrain] of platform.toml"
        )
    variables = [variable for mount in mounts for variable in mount.variables]
    refuse_doubled(variables, "design variable")
    load_case = in_mount_axes(mounts, load_case)
    inside = lines_inside(load_case.force.frequency, band, f"load case {load_case.name}")
    frequency = load_case.force.frequency[inside]
    paths = list(paths_into(mounts, fleet.vehicles[0].noise_transfer.inputs))
    transfer = path_transfer(fleet, paths, frequency, band, load_case.name)
    squared = (2.0 * np.pi * frequency[:, np.newaxis]) ** 2
    on_powertrain = [mount for mount in mounts if mount.carries_powertrain]

    def body(directions: Sequence[_Direction], mass: RealArray) -> Body:
        channels = [channel for *_, channel in directions]
        displacement = _measured(channels, load_case, "displacement")[inside]
        force = _measured(channels, load_case, "force")[inside]
        forward, motion = np.ones((1, 1)), displacement
        if len(mass) == 6:
            forward = mount_forward(on_powertrain)
            motion = _rigid_motion(forward, displacement, load_case.name)
            if not with_drawn_errors:
                _refuse_other_motion(forward, displacement, channels, load_case.name)
            displacement = motion @ forward.T
        _refuse_rest(displacement, channels, frequency, load_case.name)
        to_ear = np.zeros((*transfer.shape[:2], len(directions)), dtype=complex)
        for column, (mount, piece, axis, _) in enumerate(directions):
            to_ear[..., column] = spring_transfer(mount, piece, axis, paths, transfer)
        names = [f"{mount.name} {axis}" for mount, _, axis, _ in directions]
        return Body(
            mass_matrix=mass,
            forward=forward,
            stiffness=dynamic_stiffness(force, displacement),
            load=force @ forward - squared * (motion @ mass),
            variables=np.array([variables.index(name) for name in names], dtype=np.intp),
            transfer=to_ear,
        )

    wheel_ends = [
        body([direction], np.full((1, 1), float(direction[0].body_mass or 0.0)))
        for direction in _of_wheel_ends(mounts)
    ]
    motion = CoupledMotion(
        load_case=load_case.name,
        frequency=frequency,
        bodies=(body(_of_powertrain(mounts), powertrain.mass_matrix), *wheel_ends),
        vehicle_names=fleet.response_names,
        variable_names=tuple(variables),
    )
    rubber = np.array([mount.rubber.factor if mount.rubber else 1.0 for mount in mounts])
    if np.any(rubber != 1.0):
        of_variable = np.repeat(rubber, len(AXES))
        motion = motion.with_stiffness(motion.stiffness * of_variable[motion.variables])
    receptance = _receptance(fleet, paths, frequency, band, load_case.name)
    brackets = bracket_compliance(mounts, frequency)
    if receptance is None and not brackets.any():
        return motion
    if not with_drawn_errors:
        _refuse_soft_brackets(mounts, motion, not_identified(load_case))
    n_spring = brackets.shape[1]
    joined = np.zeros((len(fleet.names), frequency.size, n_spring, n_spring), dtype=complex)
    if receptance is not None:
        share = spring_shares(mounts, paths)
        joined += share @ receptance @ share.T
    joined[..., np.arange(n_spring), np.arange(n_spring)] += brackets
    body_of = np.array(fleet.vehicle_of)
    return FlexibleMotion(**vars_of(motion), receptance=joined, body_of=body_of)


def spring_shares(mounts: Sequence[Mount], paths: Sequence[str]) -> RealArray:
    """Return the parts of the force of every spring that enter the paths.

    - `paths`: ``<mount> [<piece>] <axis>`` in vehicle axes.
    - returns (s, n_path): springs in the order of `CoupledMotion`: 1 where spring and path are the
      same direction, the cosine between them at a tilted mount [1].
    """
    unit = np.eye(len(paths), dtype=complex)
    rows = [
        spring_transfer(mount, piece, axis, paths, unit).real
        for mount, piece, axis, _ in (*_of_powertrain(mounts), *_of_wheel_ends(mounts))
    ]
    return np.stack(rows)


def bracket_compliance(
    mounts: Sequence[Mount], frequency: RealArray, sides: Collection[Side] = SIDES
) -> ComplexArray:
    """Return what the brackets on some sides give way at every spring, (f, s) [m/N].

    Springs are in the order of `CoupledMotion`. Raises InputError: see `Bracket.compliance`.
    """
    columns = [
        sum(
            (
                bracket.compliance(frequency)[:, AXES.index(axis)]
                for bracket in mount.brackets
                if bracket.side in sides
            ),
            np.zeros(frequency.size, dtype=complex),
        )
        for mount, _, axis, _ in (*_of_powertrain(mounts), *_of_wheel_ends(mounts))
    ]
    return np.stack(columns, axis=1)


def _refuse_soft_brackets(
    mounts: Sequence[Mount], motion: CoupledMotion, unknown: Collection[str]
) -> None:
    """Refuse a bracket that is softer than its mount; nothing is judged at `unknown` channels."""
    directions = [*_of_powertrain(mounts), *_of_wheel_ends(mounts)]
    for side in SIDES:
        compliance = bracket_compliance(mounts, motion.frequency, [side])
        ratio = np.median(np.abs(motion.stiffness * compliance), axis=0)
        for (mount, _, axis, channel), softer in zip(directions, ratio, strict=True):
            if softer > 1.0 and channel not in unknown:
                raise InputError(
                    f"load case {motion.load_case}: the {side} bracket of {mount.name} is "
                    f"{softer:.3g} times as soft along {axis} as the mount itself: a bracket is "
                    "stiffer; is its stiffness in N/mm?"
                )


def _receptance(
    fleet: Fleet, paths: Sequence[str], frequency: RealArray, band: Band, load_case: str
) -> ComplexArray | None:
    """Return the reciprocal part of all bodies' receptances, (v, f, path, path) [m/N]; or None."""
    given = {vehicle.name: vehicle.receptance for vehicle in fleet.vehicles}
    without = [name for name, receptance in given.items() if receptance is None]
    if len(without) == len(given):
        return None
    if without:
        raise InputError(
            f"vehicles {without} have neither receptance nor driving points, the others have one: "
            "give it for all, or none"
        )
    values = []
    for name, receptance in given.items():
        assert receptance is not None
        lines = lines_inside(receptance.frequency, band, f"receptance of vehicle {name}")
        if not np.array_equal(receptance.frequency[lines], frequency):
            raise InputError(
                f"vehicle {name}: its receptance has other lines than load case {load_case} "
                f"between {band[0]:g} and {band[1]:g} Hz: bring both to the same lines"
            )
        inside = receptance.select(outputs=paths, inputs=paths).values[lines]
        values.append((inside + inside.swapaxes(1, 2)) / 2.0)
    return np.stack(values)


def _of_powertrain(mounts: Sequence[Mount]) -> list[_Direction]:
    """Directions of the springs on the powertrain, in the order of `CoupledMotion`."""
    return [
        direction
        for mount in mounts
        if mount.body_mass is None
        for direction in _directions(mount, AXES, range(len(mount.pieces)))
    ]


def _of_wheel_ends(mounts: Sequence[Mount]) -> list[_Direction]:
    """Directions of the springs on wheel ends, in the order of `CoupledMotion`."""
    return [
        direction
        for mount in mounts
        if mount.body_mass is not None
        for piece in range(len(mount.pieces))
        # a mass point has the same inertia along any axes, those of the mount too
        for direction in _directions(
            mount, AXES if piece in mount.tilted_pieces else mount.transfer_axes, [piece]
        )
    ]


def _directions(mount: Mount, axes: Sequence[str], pieces: Sequence[int]) -> list[_Direction]:
    return [(mount, piece, axis, mount.channels(axis)[piece]) for piece in pieces for axis in axes]


def refuse_reversed_channel(mounts: Sequence[Mount], load_case: LoadCase) -> None:
    """Refuse a channel of a powertrain mount whose reversal makes the measured motion rigid.

    Displacement and force that are reversed together leave a mount passive: only the body that all
    of its mounts hold tells. Nothing is judged where a direction was not measured, or the mounts
    leave a motion undetermined. Raises InputError: such a channel, by name.
    """
    carriers = [mount for mount in mounts if mount.carries_powertrain]
    pieces = [(mount, piece) for mount in carriers for piece in range(len(mount.pieces))]
    channels = [mount.channels(axis)[piece] for mount, piece in pieces for axis in AXES]
    if not channels or not set(channels) <= set(load_case.displacement.channels):
        return
    # channels are along vehicle axes, however the mounts stand
    forward = forward_matrices([mount.positions[piece] for mount, piece in pieces])
    displacement = load_case.displacement.select(channels).values
    residual = not_rigid(forward, displacement)
    if np.linalg.matrix_rank(forward) == 6 and residual > LARGEST_RESIDUAL:
        words = reversed_channel(forward, displacement, channels, residual)
        if words:
            raise InputError(f"load case {load_case.name}: {_in_words(residual)}: {words}")


def _in_words(residual: float) -> str:
    share = f"{100 * residual:.0f} % of the motion of the powertrain's mounts"
    return f"{share} is not that of a rigid body"


def reversed_channel(
    forward: RealArray, displacement: ComplexArray, channels: Sequence[str], residual: float
) -> str:
    """Name the channel whose reversal makes the motion rigid; empty where none does.

    - `residual`: part of the displacements (f, s) that is not rigid [1].
    """
    signs = 1.0 - 2.0 * np.eye(len(channels))
    left = [not_rigid(forward, displacement * row) for row in signs]
    best = int(np.argmin(left))
    if left[best] > min(LARGEST_RESIDUAL, residual / CLEARLY_LESS):
        return ""
    return (
        f"with '{channels[best]}' reversed {100 * left[best]:.1f} % are left; turn the sign of its "
        "displacement and its force, in channels.csv by the direction"
    )


def _measured(names: Sequence[str], load_case: LoadCase, quantity: str) -> ComplexArray:
    spectrum = load_case.force if quantity == "force" else load_case.displacement
    missing = [name for name in names if name not in spectrum.channels]
    if missing:
        raise InputError(
            f"load case {load_case.name}: no {quantity} of {missing}: motion can answer only where "
            "all axes of the powertrain mounts are measured; measure them, or give a mount that "
            "does not carry the powertrain its body_mass_kg"
        )
    return spectrum.select(names).values


def _rigid_motion(forward: RealArray, displacement: ComplexArray, load_case: str) -> ComplexArray:
    """Fit the rigid motion (f, 6) to displacements (f, s)."""
    if np.linalg.matrix_rank(forward) < 6:
        raise InputError(
            f"load case {load_case}: the powertrain's mounts do not determine its motion: it needs "
            "three that do not lie on one line; give body_mass_kg to mounts that do not carry it"
        )
    fit = np.linalg.lstsq(forward, displacement.T, rcond=None)[0].T
    return np.asarray(fit, dtype=np.complex128)


def _refuse_other_motion(
    forward: RealArray, displacement: ComplexArray, channels: Sequence[str], load_case: str
) -> None:
    """Refuse displacements (f, s) of which a rigid motion leaves much over."""
    residual = not_rigid(forward, displacement)
    if residual > LARGEST_RESIDUAL:
        words = reversed_channel(forward, displacement, channels, residual)
        remedy = words or "check the positions, axes and signs of its mounts"
        raise InputError(f"load case {load_case}: {_in_words(residual)}: {remedy}")


def _refuse_rest(
    displacement: ComplexArray, channels: Sequence[str], frequency: RealArray, load_case: str
) -> None:
    still = np.argwhere(displacement == 0)
    if still.size:
        line, column = still[0]
        raise InputError(
            f"load case {load_case}: no displacement of {channels[column]} at "
            f"{frequency[line]:g} Hz, so its stiffness is unknown: repair the measurement or "
            "choose a band without that line"
        )


def _blocks(n_designs: int) -> Iterator[slice]:
    return (slice(first, first + BLOCK) for first in range(0, n_designs, BLOCK))
