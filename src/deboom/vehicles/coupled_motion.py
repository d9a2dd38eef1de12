"""The motion that answers: powertrain and wheel ends re-solved when stiffnesses change."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError

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
