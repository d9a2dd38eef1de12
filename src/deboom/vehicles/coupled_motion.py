"""Coupled motion: the powertrain and the wheel ends, solved again when stiffnesses change."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement.channels import LoadCase
from deboom.mounts.mount import AXES, Mount
from deboom.physics import rigid_body
from deboom.physics.dynamic_stiffness import dynamic_stiffness
from deboom.vehicles.fleet import Band, Fleet, lines_inside, path_transfer, refuse_doubled
from deboom.vehicles.powertrain import Powertrain

BLOCK = 128
"""Designs solved at once; bounds the memory."""


@dataclass(frozen=True, eq=False)
class CoupledMotion:
    """Equations of motion of one load case, and the paths from its mounts to the ears.

    The powertrain moves in six degrees of freedom on all directions of its mounts. Every other
    piece (wishbone mount) carries a body of its own, which moves along each transfer axis.

    Parameters
    ----------
    load_case : str
        Name of the load case.
    frequency : array, shape (n_frequency,)
        Lines of the band [Hz].
    forward : array, shape (n_direction, 6)
        Motion of the powertrain to displacement of each direction [1, m/rad].
    mass_matrix : array, shape (6, 6)
        Of the powertrain, at the origin of the positions [kg, kg m, kg m²].
    stiffness : array, shape (n_frequency, n_direction)
        Complex dynamic stiffness at factor 1 [N/m].
    load : array, shape (n_frequency, 6)
        External load on the powertrain [N, N m].
    variables : array, shape (n_direction,)
        Design variable of each direction.
    transfer : array, shape (n_vehicle, n_frequency, n_direction)
        Force in each direction to pressure; zero where an axis does not transmit [Pa/N].
    own_mass : array, shape (n_own,)
        Bodies that move in one direction: mass [kg].
    own_stiffness, own_load : array, shape (n_frequency, n_own)
        Their complex stiffness at factor 1 [N/m] and external load [N].
    own_variables : array, shape (n_own,)
        Their design variables.
    own_transfer : array, shape (n_vehicle, n_frequency, n_own)
        [Pa/N].
    rigid_residual : float
        RMS over lines and directions of the measured motion that the rigid motion leaves, relative
        to that of the motion [1].
    vehicle_names, variable_names : tuple of str
        Names of vehicles and design variables.
    """

    load_case: str
    frequency: RealArray
    forward: RealArray
    mass_matrix: RealArray
    stiffness: ComplexArray
    load: ComplexArray
    variables: npt.NDArray[np.intp]
    transfer: ComplexArray
    own_mass: RealArray
    own_stiffness: ComplexArray
    own_load: ComplexArray
    own_variables: npt.NDArray[np.intp]
    own_transfer: ComplexArray
    rigid_residual: float
    vehicle_names: tuple[str, ...]
    variable_names: tuple[str, ...]

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if isinstance(value, np.ndarray):
                frozen = value.copy()
                frozen.setflags(write=False)
                object.__setattr__(self, name, frozen)
        n_line, n_direction, n_own = self.frequency.size, len(self.forward), self.own_mass.size
        n_vehicle = len(self.vehicle_names)
        shapes = {
            "forward": (n_direction, 6),
            "mass_matrix": (6, 6),
            "stiffness": (n_line, n_direction),
            "load": (n_line, 6),
            "variables": (n_direction,),
            "transfer": (n_vehicle, n_line, n_direction),
            "own_mass": (n_own,),
            "own_stiffness": (n_line, n_own),
            "own_load": (n_line, n_own),
            "own_variables": (n_own,),
            "own_transfer": (n_vehicle, n_line, n_own),
        }
        for name, shape in shapes.items():
            if getattr(self, name).shape != shape:
                raise InputError(
                    f"load case {self.load_case}: {name} of shape {getattr(self, name).shape}, "
                    f"expected {shape}"
                )

    @property
    def nominal_amplitude(self) -> RealArray:
        """Peak displacement with all factors 1, (n_frequency, n_direction + n_own) [m]."""
        nominal = np.ones((1, len(self.variable_names)))
        body = self.motion(nominal)[0] @ self.forward.T
        return np.asarray(np.abs(np.hstack([body, self.own_motion(nominal)[0]])))

    @property
    def angular_frequency_squared(self) -> RealArray:
        """ω² of each line [rad²/s²]."""
        return (2.0 * np.pi * self.frequency) ** 2

    def impedance(self, designs: RealArray) -> ComplexArray:
        """Return ``Σ_i x_i K_i v_i v_iᵀ − ω² M`` of designs (n, n_variable).

        Returns
        -------
        array, shape (n, n_frequency, 6, 6)
            Symmetric [N/m, N/rad, N m/rad].
        """
        scaled = designs[:, np.newaxis, self.variables] * self.stiffness
        mass = self.angular_frequency_squared[:, np.newaxis, np.newaxis] * self.mass_matrix
        springs = self.forward.T @ (scaled[..., np.newaxis] * self.forward)
        return np.asarray(springs - mass)

    def motion(self, designs: RealArray) -> ComplexArray:
        """Return the motion of the powertrain for designs (n, n_variable).

        Returns
        -------
        array, shape (n, n_frequency, 6)
            Complex peak amplitudes at the origin of the positions [m, rad].
        """
        load = self.load[..., np.newaxis]
        return np.asarray(np.linalg.solve(self.impedance(designs), load)[..., 0])

    def own_motion(self, designs: RealArray) -> ComplexArray:
        """Return the motion of the other bodies, shape (n, n_frequency, n_own) [m]."""
        return np.asarray(self.own_load / self._own_impedance(designs))

    @property
    def own_parts(self) -> tuple[tuple[npt.NDArray[np.intp], ComplexArray], ...]:
        """What the springs of the other bodies are the sum of: variables, stiffness at factor 1."""
        return ((self.own_variables, self.own_stiffness),)

    def _own_springs(self, designs: RealArray) -> ComplexArray:
        springs = [designs[:, np.newaxis, columns] * part for columns, part in self.own_parts]
        return np.asarray(sum(springs[1:], springs[0]))

    def _own_impedance(self, designs: RealArray) -> ComplexArray:
        inertia = self.angular_frequency_squared[:, np.newaxis] * self.own_mass
        return np.asarray(self._own_springs(designs) - inertia)

    def forces(self, designs: RealArray) -> tuple[ComplexArray, ComplexArray]:
        """Return the forces on the bodywork for designs (n, n_variable).

        Returns
        -------
        array, shape (n, n_frequency, n_direction)
            Of the powertrain's mounts, ``x K v q`` [N].
        array, shape (n, n_frequency, n_own)
            Of the other pieces [N].
        """
        displacement = self.motion(designs) @ self.forward.T
        springs = designs[:, np.newaxis, self.variables] * self.stiffness
        return springs * displacement, self._own_springs(designs) * self.own_motion(designs)

    def pressure(self, designs: RealArray) -> ComplexArray:
        """Return the pressure at the ears for designs (n, n_variable).

        Returns
        -------
        array, shape (n, n_vehicle, n_frequency)
            Complex peak amplitudes [Pa].
        """
        found = np.empty((len(designs), *self.transfer.shape[:2]), dtype=complex)
        for rows in _blocks(len(designs)):
            powertrain, own = self.forces(designs[rows])
            found[rows] = np.einsum("vfi,dfi->dvf", self.transfer, powertrain)
            found[rows] += np.einsum("vfj,dfj->dvf", self.own_transfer, own)
        return found

    def neper_gradient(self, designs: RealArray) -> RealArray:
        """Return ``Σ_f Re(∂p/∂x_k / p)`` for designs (n, n_variable), by the adjoint.

        Returns
        -------
        array, shape (n, n_vehicle, n_variable)
            [1].

        Notes
        -----
        With ``t_v = Z⁻¹ Σ_i x_i K_i Y_vi v_i`` (Z is symmetric),
        ``∂p_v/∂x_i = K_i (v_iᵀ q) (Y_vi − v_iᵀ t_v)``; of a body of its own
        ``∂p_v/∂x = −Y_v K L ω² m / (x K − ω² m)²``.
        """
        return self.weighted_gradient(designs, 1.0 / self.pressure(designs))

    def weighted_gradient(self, designs: RealArray, factor: ComplexArray) -> RealArray:
        """Return ``Σ_f Re(a_f ∂p/∂x_k)`` for designs (n, n_variable), see `neper_gradient`.

        Parameters
        ----------
        designs : array, shape (n, n_variable)
            Stiffness factors [1].
        factor : array, shape (n, n_vehicle, n_frequency)
            The factor a of each line [1/Pa].

        Returns
        -------
        array, shape (n, n_vehicle, n_variable)
            [1].
        """
        found = np.zeros((len(designs), len(self.vehicle_names), len(self.variable_names)))
        for rows in _blocks(len(designs)):
            self._add_weighted_gradient(designs[rows], factor[rows], found[rows])
        return found

    def _add_weighted_gradient(
        self, designs: RealArray, factor: ComplexArray, total: RealArray
    ) -> None:
        springs = designs[:, np.newaxis, self.variables] * self.stiffness
        excitation = (springs[:, np.newaxis] * self.transfer) @ self.forward
        load = np.broadcast_to(self.load, (len(designs), *self.load.shape))
        both = np.concatenate([load[..., np.newaxis], np.moveaxis(excitation, 1, -1)], axis=-1)
        solved = self.forward @ np.linalg.solve(self.impedance(designs), both)
        displacement, answer = solved[..., 0], np.moveaxis(solved[..., 1:], -1, 1)
        direct = (self.stiffness * displacement)[:, np.newaxis] * (self.transfer - answer)
        by_direction = np.einsum("dvf,dvfi->dvi", factor, direct).real
        _add_columns(total, self.variables, by_direction)
        inertia = self.angular_frequency_squared[:, np.newaxis] * self.own_mass
        for columns, part in self.own_parts:
            change = -part * self.own_load * inertia / self._own_impedance(designs) ** 2
            own = np.einsum("dvf,vfj,dfj->dvj", factor, self.own_transfer, change).real
            _add_columns(total, columns, own)


def _blocks(n_designs: int) -> Iterator[slice]:
    for start in range(0, n_designs, BLOCK):
        yield slice(start, start + BLOCK)


def _add_columns(total: RealArray, variables: npt.NDArray[np.intp], values: RealArray) -> None:
    """Add the last axis of `values` to the columns of the variables, which may repeat."""
    for column, variable in enumerate(variables):
        total[..., variable] += values[..., column]


LARGEST_RESIDUAL = 0.1
"""Largest part of the mounts' motion that no rigid motion explains; beyond it, positions or
channels are wrong rather than noisy [1]."""

Direction = tuple[Mount, int, str, str]
"""Mount, number of its piece, axis, channel."""


def coupled_motion(
    fleet: Fleet,
    mounts: Sequence[Mount],
    powertrain: Powertrain,
    load_case: LoadCase,
    band: Band = (20.0, 60.0),
) -> CoupledMotion:
    """Identify the equations of motion of one load case from its measured motion and forces.

    Parameters
    ----------
    fleet : Fleet
        Noise transfer functions of each vehicle.
    mounts : sequence of Mount
        Powertrain mounts, with all three axes measured, and mounts with a body mass of their own.
    powertrain : Powertrain
        Mass matrix from the data sheet.
    load_case : LoadCase
        Operating motion and force.
    band : (lower, upper)
        Both edges belong to the band [Hz].

    Returns
    -------
    CoupledMotion

    Raises
    ------
    InputError
        A channel that was not measured; powertrain mounts that leave a rigid motion undetermined;
        measured motion that is not rigid; a direction without any motion; see also
        `deboom.vehicles.fleet.path_contributions`.

    Notes
    -----
    Per line, the powertrain's motion q is the least-squares fit ``V q ≈ s`` to the displacements of
    its mounts, and ``K_i = f_i / (V q)_i``: the stiffness belongs to the fitted displacement, which
    is closer to the truth than a single channel. The external load is what keeps the measured
    motion going, ``F = Vᵀ f − ω² M q``, with the nominal mass matrix M; a body of its own has
    ``L = f − ω² m s``. Then the factors change with K and F fixed per line:
    ``(Σ x_i K_i v_i v_iᵀ − ω² M) q(x) = F``. At all factors 1 this gives the measured forces and
    the fitted motion exactly, whatever the data sheet's errors and the residual of the fit.

    K does not feel the new amplitude or the new static position (that would be another model of
    the motion), and the body stays at rest: blocked forces on a trimmed body.
    """
    variables = [variable for mount in mounts for variable in mount.variables]
    refuse_doubled(variables, "design variable")
    inside = lines_inside(load_case.force.frequency, band, f"load case {load_case.name}")
    frequency = load_case.force.frequency[inside]
    paths = [path for mount in mounts for path in mount.paths]
    if not paths:
        raise InputError("no mount transmits anything: give transfer_axes to at least one")
    transfer = path_transfer(fleet, paths, frequency, band, load_case.name)

    on_powertrain = list(_directions([m for m in mounts if m.body_mass is None], AXES))
    own = [
        direction
        for mount in mounts
        if mount.body_mass is not None
        for direction in _directions([mount], mount.transfer_axes)
    ]
    displacement, force = (
        _measured([name for *_, name in (*on_powertrain, *own)], load_case, quantity)[inside]
        for quantity in ("displacement", "force")
    )
    n_on = len(on_powertrain)
    forward = np.array(
        [
            rigid_body.forward_matrix(mount.positions[piece])[AXES.index(axis)]
            for mount, piece, axis, _ in on_powertrain
        ]
    ).reshape(n_on, 6)
    motion, residual = _rigid_motion(forward, displacement[:, :n_on], load_case.name)
    squared = (2.0 * np.pi * frequency[:, np.newaxis]) ** 2
    mass = np.array([float(mount.body_mass or 0.0) for mount, *_ in own])
    fitted = np.hstack([motion @ forward.T, displacement[:, n_on:]])
    _refuse_rest(fitted, [name for *_, name in (*on_powertrain, *own)], frequency, load_case.name)
    stiffness = dynamic_stiffness(force, fitted)

    def columns(directions: Sequence[Direction]) -> tuple[ComplexArray, npt.NDArray[np.intp]]:
        found = np.zeros((*transfer.shape[:2], len(directions)), dtype=complex)
        for column, (mount, _, axis, _) in enumerate(directions):
            if axis in mount.transfer_axes:
                found[..., column] = transfer[..., paths.index(f"{mount.name} {axis}")]
        names = [f"{mount.name} {axis}" for mount, _, axis, _ in directions]
        return found, np.array([variables.index(name) for name in names], dtype=np.intp)

    to_ear, variable = columns(on_powertrain)
    own_to_ear, own_variable = columns(own)
    return CoupledMotion(
        load_case=load_case.name,
        frequency=frequency,
        forward=forward,
        mass_matrix=powertrain.mass_matrix,
        stiffness=stiffness[:, :n_on],
        load=force[:, :n_on] @ forward - squared * (motion @ powertrain.mass_matrix),
        variables=variable,
        transfer=to_ear,
        own_mass=mass,
        own_stiffness=stiffness[:, n_on:],
        own_load=force[:, n_on:] - squared * mass * displacement[:, n_on:],
        own_variables=own_variable,
        own_transfer=own_to_ear,
        rigid_residual=residual,
        vehicle_names=fleet.names,
        variable_names=tuple(variables),
    )


def _directions(mounts: Sequence[Mount], axes: Sequence[str]) -> Iterator[Direction]:
    for mount in mounts:
        for piece in range(len(mount.pieces)):
            for axis in axes:
                yield mount, piece, axis, mount.channels(axis)[piece]


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


def _rigid_motion(
    forward: RealArray, displacement: ComplexArray, load_case: str
) -> tuple[ComplexArray, float]:
    """Fit the rigid motion (f, 6) to displacements (f, n_direction); say what is left."""
    if np.linalg.matrix_rank(forward) < 6:
        raise InputError(
            f"load case {load_case}: the powertrain's mounts do not determine its motion: it needs "
            "three that do not lie on one line; give body_mass_kg to mounts that do not carry it"
        )
    found = np.linalg.lstsq(forward, displacement.T, rcond=None)[0].T
    motion = np.asarray(found, dtype=np.complex128)
    left = np.linalg.norm(displacement - motion @ forward.T)
    residual = float(left / max(np.linalg.norm(displacement), np.finfo(float).tiny))
    if residual > LARGEST_RESIDUAL:
        raise InputError(
            f"load case {load_case}: {100 * residual:.0f} % of the motion of the powertrain's "
            "mounts is not that of a rigid body: check the positions, axes and signs of its mounts"
        )
    return motion, residual


def _refuse_rest(
    displacement: ComplexArray, names: Sequence[str], frequency: RealArray, load_case: str
) -> None:
    still = np.argwhere(displacement == 0)
    if still.size:
        line, column = still[0]
        raise InputError(
            f"load case {load_case}: no displacement of {names[column]} at {frequency[line]:g} Hz, "
            "so its stiffness is unknown: repair the measurement or choose a band without that line"
        )
