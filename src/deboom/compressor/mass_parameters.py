"""Ten numbers for the mass of a body, such that every choice of them is a body that can exist."""

from __future__ import annotations

import numpy as np

from deboom.arrays import RealArray
from deboom.physics.mass_properties import RigidBody
from deboom.physics.rigid_body import mass_matrix

MASS_PARAMETER_NAMES = (
    "ln √mass",
    "x of the centre / length",
    "y of the centre / length",
    "z of the centre / length",
    "ln spread z",
    "shear yz",
    "ln spread y",
    "shear xz",
    "shear xy",
    "ln spread x",
)
_LAST = 3


def _factor(values: RealArray, length: float) -> RealArray:
    """Upper triangular U of the pseudo-inertia ``J = U Uᵀ``."""
    (mass, cx, cy, cz, szz, syz, syy, sxz, sxy, sxx) = values
    root = np.exp(mass)
    scale = root * length
    return np.array(
        [
            [scale * np.exp(sxx), scale * sxy, scale * sxz, scale * cx],
            [0.0, scale * np.exp(syy), scale * syz, scale * cy],
            [0.0, 0.0, scale * np.exp(szz), scale * cz],
            [0.0, 0.0, 0.0, root],
        ]
    )


def _factor_derivatives(values: RealArray, length: float) -> RealArray:
    """Differentiate `_factor`, shape (10, 4, 4)."""
    derivatives = np.zeros((10, 4, 4))
    derivatives[0] = _factor(values, length)
    scale = np.exp(values[0]) * length
    for parameter, (row, column) in enumerate(
        [(0, 3), (1, 3), (2, 3), (2, 2), (1, 2), (1, 1), (0, 2), (0, 1), (0, 0)], start=1
    ):
        logarithmic = row == column
        slope = np.exp(values[parameter]) if logarithmic else 1.0
        derivatives[parameter, row, column] = scale * slope
    return derivatives


def mass_matrix_of_pseudo_inertia(pseudo: RealArray) -> RealArray:
    """Read the 6×6 mass matrix off a pseudo-inertia; the map is linear.

    Parameters
    ----------
    pseudo : array, shape (..., 4, 4)
        ``∫ [r; 1] [r; 1]ᵀ dm``, symmetric [kg m², kg m, kg].

    Returns
    -------
    array, shape (..., 6, 6)
        At the same point [kg, kg m, kg m²].
    """
    second, first, mass = pseudo[..., :3, :3], pseudo[..., :3, _LAST], pseudo[..., _LAST, _LAST]
    matrix = np.zeros((*pseudo.shape[:-2], 6, 6))
    for axis in range(3):
        matrix[..., axis, axis] = mass
    x, y, z = np.moveaxis(first, -1, 0)
    for (row, column), entry in {(0, 1): -z, (0, 2): y, (1, 2): -x}.items():
        matrix[..., 3 + row, column], matrix[..., 3 + column, row] = entry, -entry
    matrix[..., :3, 3:] = np.swapaxes(matrix[..., 3:, :3], -1, -2)
    trace = np.trace(second, axis1=-2, axis2=-1)[..., np.newaxis, np.newaxis]
    matrix[..., 3:, 3:] = trace * np.eye(3) - second
    return matrix


def mass_matrix_from_parameters(values: RealArray, length: float) -> RealArray:
    """Compute the 6×6 mass matrix at the virtual point.

    Parameters
    ----------
    values : array, shape (10,)
        In the order of `MASS_PARAMETER_NAMES` [1].
    length : float
        Characteristic length of the body, such as its radius of gyration [m].

    Returns
    -------
    array, shape (6, 6)
        Positive definite [kg, kg m, kg m²].

    Notes
    -----
    Pseudo-inertia ``J = ∫ [r; 1] [r; 1]ᵀ dm = U Uᵀ`` with U upper triangular and a positive
    diagonal: the log-Cholesky parameters of Rucker and Wensing (2022). Every distribution of mass
    has one such U, and every such U has a distribution of mass.
    """
    factor = _factor(values, length)
    return mass_matrix_of_pseudo_inertia(factor @ factor.T)


def mass_matrix_derivatives(values: RealArray, length: float) -> RealArray:
    """Differentiate `mass_matrix_from_parameters`.

    Parameters
    ----------
    values, length
        As there.

    Returns
    -------
    array, shape (10, 6, 6)
        [kg, kg m, kg m²] per unit of each parameter.
    """
    factor = _factor(values, length)
    half = _factor_derivatives(values, length) @ factor.T
    return mass_matrix_of_pseudo_inertia(half + np.swapaxes(half, -1, -2))


def mass_parameters(body: RigidBody, length: float) -> RealArray:
    """Find the ten numbers of a body, the inverse of `mass_matrix_from_parameters`.

    Parameters
    ----------
    body : RigidBody
        Physically consistent: positive principal moments that obey the triangle inequality.
    length : float
        As there [m].

    Returns
    -------
    array, shape (10,)
        [1].

    Raises
    ------
    numpy.linalg.LinAlgError
        A body that cannot exist.
    """
    at_point = mass_matrix(body.mass, body.inertia, body.centre)[3:, 3:]
    pseudo = np.empty((4, 4))
    pseudo[:3, :3] = np.trace(at_point) / 2 * np.eye(3) - at_point
    pseudo[:3, _LAST] = pseudo[_LAST, :3] = body.mass * np.asarray(body.centre)
    pseudo[_LAST, _LAST] = body.mass
    return parameters_of_pseudo_inertia(pseudo, length)


def parameters_of_pseudo_inertia(pseudo: RealArray, length: float) -> RealArray:
    """Find the ten numbers of a pseudo-inertia.

    Parameters
    ----------
    pseudo : array, shape (4, 4)
        Positive definite [kg m², kg m, kg].
    length : float
        Characteristic length [m].

    Returns
    -------
    array, shape (10,)
        [1].

    Raises
    ------
    numpy.linalg.LinAlgError
        Not positive definite.
    """
    # an upper triangular factor is the lower one of the matrix read backwards
    factor = np.linalg.cholesky(pseudo[::-1, ::-1])[::-1, ::-1]
    root = factor[_LAST, _LAST]
    shape = factor[:3] / (root * length)
    return np.array(
        [
            np.log(root),
            *shape[:, _LAST],
            np.log(shape[2, 2]),
            shape[1, 2],
            np.log(shape[1, 1]),
            shape[0, 2],
            shape[0, 1],
            np.log(shape[0, 0]),
        ]
    )
