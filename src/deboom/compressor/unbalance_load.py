"""Load of a rotor and of its gas at the virtual point, and the gyroscopic moment of the rotor."""

from __future__ import annotations

from enum import Enum

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray
from deboom.errors import InputError
from deboom.physics.rigid_body import skew

GAS_UNITS = ("N", "N m", "N")
"""Of the axial gas force, the gas moment and the rotating gas force."""
N_GAS = len(GAS_UNITS)


class RotationSense(Enum):
    """Sense of the rotor about x."""

    POSITIVE = 1
    """From y to z."""
    NEGATIVE = -1
    """From z to y."""


def unbalance_load(
    static: npt.ArrayLike,
    arm: npt.ArrayLike,
    frequency: npt.ArrayLike,
    sense: RotationSense = RotationSense.POSITIVE,
) -> ComplexArray:
    """Compute the load of first order at a virtual point on the rotor's axis.

    `static` (n_source,): unbalance of each source (crank, orbiting scroll, balance weight) as a
    rotating vector: its argument is the angle from y, counted in the sense of rotation, complex
    [kg m]; `arm` (n_source,): distance of each source along x, from the virtual point [m];
    `frequency` (n_frequency,): frequency of the rotation [Hz]. Returns (n_frequency, 6) complex
    amplitudes [N, N m]. InputError: not one arm per source.

    Thesis, eq. 36 and 37, with what they leave open: ``u = Σ u_i``, ``u_d = Σ arm_i u_i`` over
    sources, not over the six directions; ``F_y = u ω²``, ``F_z = −j u ω²``, ``M_z = u_d ω²``, ``M_y
    = +j u_d ω²`` for rotation from y to z, conjugate signs for the other sense. Gas forces and
    moments (eq. 38) add to it and do not grow with ω².
    """
    sources, arms = np.atleast_1d(static).astype(complex), np.atleast_1d(arm).astype(float)
    if sources.shape != arms.shape or sources.ndim != 1:
        raise InputError(f"{sources.size} unbalances and {arms.size} arms: give each its own")
    force, moment = sources.sum(), (arms * sources).sum()
    turn = -1j * sense.value
    directions = np.array([0, force, turn * force, 0, -turn * moment, moment])
    squared = (2 * np.pi * np.asarray(frequency, dtype=float)) ** 2
    return np.asarray(squared[:, np.newaxis] * directions)


def rotor_columns(frequency: npt.ArrayLike, sense: RotationSense) -> ComplexArray:
    """Compute the load per static and per dynamic unbalance, shape (n_frequency, 6, 2) [1/s²].

    Thesis, eq. 36; see `unbalance_load`.
    """
    # an unbalance of 1 on an arm of 0, and the pair (1, −1) on arms 1 and 0
    static = unbalance_load([1.0], [0.0], frequency, sense)
    dynamic = unbalance_load([1.0, -1.0], [1.0, 0.0], frequency, sense)
    return np.stack([static, dynamic], axis=-1)


def gas_columns(sense: RotationSense) -> ComplexArray:
    """Compute the load per axial gas force, per gas moment and per rotating gas force.

    Returns (6, 3) the same at every speed [1].

    Thesis, eq. 38: the moment acts about x. The rotating force, ``F_y = g``, ``F_z = ∓j g``, passes
    as unbalance in y and z alike; only that it does not grow with ω² tells it apart.
    """
    columns = np.zeros((6, N_GAS), dtype=complex)
    columns[0, 0] = columns[3, 1] = columns[1, 2] = 1
    columns[2, 2] = -1j * sense.value
    return columns


def gyroscopic_mass(rotor_inertia: float | None, sense: RotationSense) -> ComplexArray:
    """Compute what a turning rotor adds to the apparent mass at first order, shape (6, 6) [kg m²].

    `rotor_inertia`: polar moment of the rotor; None leaves the gyroscopic moment out [kg m²].

    ``M = I θ̈ + θ̇ × h`` with the spin ``h = J ω e_x`` and ``θ̇ = θ̈/(jω)``: the rotational block
    gains ``+j J skew(e_x)``, whatever the speed.
    """
    mass = np.zeros((6, 6), dtype=complex)
    if rotor_inertia is not None:
        mass[3:, 3:] = 1j * sense.value * rotor_inertia * skew([1.0, 0.0, 0.0])
    return mass
