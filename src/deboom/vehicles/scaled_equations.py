"""The equations of motion without units: what every kernel for coupled motion computes with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.vehicles.coupled_motion import CoupledMotion
from deboom.vehicles.kernel_numpy import line_exponents


@dataclass(frozen=True, eq=False)
class ScaledEquations:
    """Equations of motion divided by ω² and by the square roots of masses and inertias.

    With ``d = 1/√diag M``: ``(Σ x_i K_i v_i v_iᵀ − M) q = F`` in the scaled quantities below, and
    the pressure of a line is a power of two times ``Σ_i Y_i x_i (v_iᵀ q)``, plus
    ``Σ_j Y_j x_j a_j / (x_j k_j − 1)`` of the bodies of their own. All numbers of the solution are
    of the order of 1 to 100, as single precision needs it.

    Parameters
    ----------
    forward : array, shape (n_direction, 6)
        ``v d``.
    mass_matrix : array, shape (6, 6)
        ``d M d``.
    stiffness : array, shape (n_frequency, n_direction)
        ``K/ω²``.
    load : array, shape (n_frequency, 6)
        ``d F/ω²``.
    variables : array, shape (n_direction,)
        Design variable of each direction.
    transmitting : array of int
        Directions that reach an ear.
    transfer : array, shape (n_vehicle, n_frequency, n_transmitting)
        ``Y K`` over the line's power of two.
    own_stiffness, own_load : array, shape (n_frequency, n_own)
        ``K/(ω² m)`` and ``K L/(ω² m)`` [N].
    own_variables : array, shape (n_own,)
        Design variable of each body of its own.
    own_transfer : array, shape (n_vehicle, n_frequency, n_own)
        Y over the line's power of two.
    power : array, shape (n_vehicle, n_frequency)
        One over the line's power of two [1].
    scale_level : array, shape (n_vehicle,)
        Sum over the lines of what the powers of two took out [dB re 1 Pa].
    """

    forward: RealArray
    mass_matrix: RealArray
    stiffness: ComplexArray
    load: ComplexArray
    variables: npt.NDArray[np.intp]
    transmitting: npt.NDArray[np.intp]
    transfer: ComplexArray
    own_stiffness: ComplexArray
    own_load: ComplexArray
    own_variables: npt.NDArray[np.intp]
    own_transfer: ComplexArray
    power: RealArray
    scale_level: RealArray


def scaled_equations(motion: CoupledMotion) -> ScaledEquations:
    """Scale the equations of motion of one load case."""
    squared = motion.angular_frequency_squared[:, np.newaxis]
    scale = 1.0 / np.sqrt(np.diag(motion.mass_matrix))
    force, own_force = motion.forces(np.ones((1, len(motion.variable_names))))
    nominal = [motion.transfer * force[0], motion.own_transfer * own_force[0]]
    exponents = line_exponents(np.concatenate(nominal, axis=2))
    power = np.ldexp(1.0, -exponents)[..., np.newaxis]
    transmitting = np.flatnonzero(motion.transfer.any(axis=(0, 1)))
    return ScaledEquations(
        forward=motion.forward * scale,
        mass_matrix=motion.mass_matrix * np.outer(scale, scale),
        stiffness=motion.stiffness / squared,
        load=motion.load * scale / squared,
        variables=motion.variables,
        transmitting=transmitting,
        transfer=(motion.transfer * motion.stiffness * power)[..., transmitting],
        own_stiffness=motion.own_stiffness / (squared * motion.own_mass),
        own_load=motion.own_stiffness * motion.own_load / (squared * motion.own_mass),
        own_variables=motion.own_variables,
        own_transfer=motion.own_transfer * power,
        power=power[..., 0],
        scale_level=20.0 * np.log10(2.0) * exponents.sum(axis=1),
    )
