"""The six forms of a matrix of frequency response functions, and its condition number."""

from __future__ import annotations

from enum import Enum

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError


class FrfForm(Enum):
    """What stands over what: motion per force, or its inverse (thesis, table 9).

    Each value is the pair (order of the time derivative of the displacement, inverse or not).
    """

    RECEPTANCE = (0, False)
    MOBILITY = (1, False)
    INERTANCE = (2, False)
    DYNAMIC_STIFFNESS = (0, True)
    IMPEDANCE = (1, True)
    APPARENT_MASS = (2, True)

    @property
    def derivative(self) -> int:
        """Order of the time derivative: 0 displacement, 1 velocity, 2 acceleration."""
        return self.value[0]

    @property
    def is_inverse(self) -> bool:
        """Whether it is force per motion."""
        return self.value[1]


def convert(
    values: npt.ArrayLike, frequency: npt.ArrayLike, source: FrfForm, target: FrfForm
) -> ComplexArray:
    """Matrix of frequency response functions from one form to another.

    Parameters
    ----------
    values : array, shape (n_frequency, n_output, n_input)
        In the form `source`, factor e^{+jωt}, SI units.
    frequency : array, shape (n_frequency,)
        [Hz]; above 0 where a power of ω has to be divided by.
    source, target : FrfForm

    Returns
    -------
    array, shape (n_frequency, n_output, n_input)
        In the form `target`; outputs and inputs change places when it is an inverse of the source.

    Raises
    ------
    InputError
        Shapes that disagree, 0 Hz where it is divided by, or a matrix without an inverse.

    Notes
    -----
    Each derivative of the motion multiplies by jω. The inverse is that of the whole matrix, line
    by line: an element of an apparent mass is not one over the element of the inertance.
    """
    matrix = np.asarray(values, dtype=complex)
    lines = np.asarray(frequency, dtype=float)
    if matrix.ndim != 3 or lines.shape != matrix.shape[:1]:
        raise InputError(
            "frequency response functions have shape (n_frequency, n_output, n_input) = "
            f"({lines.size}, n, m), not {matrix.shape}"
        )
    power = target.derivative - source.derivative
    if source.is_inverse:
        power = -power
    matrix = matrix * _power_of_j_omega(lines, power)[:, np.newaxis, np.newaxis]
    return matrix if source.is_inverse == target.is_inverse else _inverse(matrix, lines)


def scaled_condition_number(values: npt.ArrayLike, form: FrfForm, length: float) -> RealArray:
    """Condition number of 6×6 functions, with rotations made comparable to translations.

    Parameters
    ----------
    values : array, shape (..., 6, 6)
        In the form `form`, order x y z rx ry rz, SI units.
    form : FrfForm
        Motions are multiplied, and loads divided, by `length` where they rotate.
    length : float
        Characteristic length, such as the radius of gyration [m]; to be printed with the result.

    Returns
    -------
    array, shape (...)
        [1].

    Raises
    ------
    InputError
        Not 6×6, or a length that is not positive.

    Notes
    -----
    Without the scaling the number depends on the unit of length: the thesis's 450 of a compressor
    in SI units is mass over smallest moment of inertia, and 2 when scaled by √(J/m).
    """
    matrix = np.asarray(values)
    if matrix.shape[-2:] != (6, 6):
        raise InputError(f"the scaling needs 6×6 functions, not shape {matrix.shape}")
    scale = _rotation_scale(length)
    factor = np.outer(scale, scale)
    scaled = matrix / factor if form.is_inverse else matrix * factor
    return np.asarray(np.linalg.cond(scaled))


def scaled_forward_condition_number(forward: npt.ArrayLike, length: float) -> float:
    """Condition number of a stack of forward matrices, per metre of motion at a stated distance.

    Parameters
    ----------
    forward : array, shape (n, 6)
        Motion of the body → motion at the sensors [1, m/rad].
    length : float
        Characteristic length, such as the mean distance of the sensors [m]; to be printed with the
        result.

    Returns
    -------
    float
        [1]; infinite or above 1e12 where the sensors do not determine the motion.

    Raises
    ------
    InputError
        Not six columns, or a length that is not positive.
    """
    matrix = np.asarray(forward, dtype=float)
    if matrix.ndim != 2 or matrix.shape[1] != 6:
        raise InputError(f"forward matrices have six columns, not shape {matrix.shape}")
    return float(np.linalg.cond(matrix / _rotation_scale(length)))


def _rotation_scale(length: float) -> RealArray:
    if not length > 0:
        raise InputError(f"a characteristic length is positive, not {length} m")
    return np.repeat([1.0, length], 3)


def _power_of_j_omega(frequency: RealArray, power: int) -> ComplexArray:
    if power < 0 and np.any(frequency == 0):
        raise InputError(
            "the conversion divides by the frequency: leave the line at 0 Hz out first"
        )
    # j^power as an exact table: complex powers would leave rounding in the other component
    unit = (1, 1j, -1, -1j)[power % 4]
    return np.asarray(unit * (2 * np.pi * frequency) ** float(power), dtype=complex)


def _inverse(matrix: ComplexArray, frequency: RealArray) -> ComplexArray:
    if matrix.shape[1] != matrix.shape[2]:
        raise InputError(
            f"only square matrices have an inverse, not {matrix.shape[1]} outputs by "
            f"{matrix.shape[2]} inputs"
        )
    rank = np.linalg.matrix_rank(matrix)
    singular = np.flatnonzero(rank < matrix.shape[1])
    if singular.size:
        raise InputError(
            f"the matrix has no inverse at {singular.size} lines, the first at "
            f"{frequency[singular[0]]} Hz (rank {rank[singular[0]]} of {matrix.shape[1]})"
        )
    return np.asarray(np.linalg.inv(matrix), dtype=complex)
