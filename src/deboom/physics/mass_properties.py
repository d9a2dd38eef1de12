"""Mass, centre of gravity and inertia out of a 6×6 mass matrix, and the torque roll axis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.physics.rigid_body import mass_matrix, skew


@dataclass(frozen=True, eq=False)
class RigidBody:
    """Mass properties of a rigid body.

    Parameters
    ----------
    mass : float
        [kg].
    centre : array, shape (3,)
        Centre of gravity, from the reference point [m].
    inertia : array, shape (3, 3)
        About the centre of gravity; off-diagonal entries are the matrix entries [kg m²].
    """

    mass: float
    centre: RealArray
    inertia: RealArray

    def __post_init__(self) -> None:
        for name in ("centre", "inertia"):
            copy = np.array(getattr(self, name), dtype=float)
            copy.setflags(write=False)
            object.__setattr__(self, name, copy)


def mass_properties(matrix: npt.ArrayLike, tolerance: float = 1e-6) -> RigidBody:
    """Mass, centre of gravity and inertia from a 6×6 mass matrix; the inverse of `mass_matrix`.

    Parameters
    ----------
    matrix : array, shape (6, 6)
        At any reference point [kg, kg m, kg m²].
    tolerance : float
        How far `matrix` may be from the mass matrix of any rigid body, relative to its mass, with
        lengths divided by the radius of gyration [1]. A measured apparent mass needs a wide one.

    Returns
    -------
    RigidBody

    Raises
    ------
    InputError
        Not positive definite, or further from a rigid body than `tolerance`.
    """
    matrix = np.asarray(matrix, dtype=float)
    if matrix.shape != (6, 6):
        raise InputError(f"a mass matrix has shape (6, 6), not {matrix.shape}")
    symmetric = (matrix + matrix.T) / 2
    if not np.all(np.linalg.eigvalsh(symmetric) > 0):
        raise InputError("the mass matrix is not positive definite, so it is not that of a body")
    mass = float(np.trace(symmetric[:3, :3])) / 3
    # the coupling block is mass · skew(centre), and Σ e_i × skew(c) e_i = 2 c
    centre = np.cross(np.eye(3), symmetric[3:, :3].T).sum(axis=0) / (2 * mass)
    inertia = symmetric[3:, 3:] - mass * skew(centre) @ skew(centre).T
    unit = np.repeat([1.0, np.sqrt(np.trace(symmetric[3:, 3:]) / (3 * mass))], 3)
    deviation = (matrix - mass_matrix(mass, inertia, centre)) / np.outer(unit, unit)
    worst = float(np.max(np.abs(deviation))) / mass
    if worst > tolerance:
        raise InputError(
            f"the mass matrix deviates by {worst:.2g} of its mass from that of a rigid body, "
            f"more than the tolerance of {tolerance:.2g}"
        )
    return RigidBody(mass, centre, inertia)


def characteristic_length(mass: float, inertia: npt.ArrayLike) -> float:
    """Radius of gyration, the length that makes rotations of a body comparable to translations.

    Parameters
    ----------
    mass : float
        [kg].
    inertia : array, shape (3, 3)
        About the centre of gravity [kg m²].

    Returns
    -------
    float
        ``√(tr J / 3 m)`` [m].
    """
    return float(np.sqrt(np.trace(np.asarray(inertia, dtype=float)) / (3 * mass)))


def torque_roll_axis(inertia: npt.ArrayLike, torque: npt.ArrayLike = (0.0, 1.0, 0.0)) -> RealArray:
    """Direction about which a free body turns under a torque.

    Parameters
    ----------
    inertia : array, shape (3, 3)
        About the centre of gravity [kg m²].
    torque : array, shape (3,)
        Direction of the torque, by default the crankshaft along y.

    Returns
    -------
    array, shape (3,)
        Unit vector ``J⁻¹ t / |J⁻¹ t|``; the axis passes through the centre of gravity.

    Notes
    -----
    Holds above the rigid-body modes, where the mounts no longer hold the body.
    """
    direction = np.linalg.solve(np.asarray(inertia, dtype=float), np.asarray(torque, dtype=float))
    return np.asarray(direction / np.linalg.norm(direction))
