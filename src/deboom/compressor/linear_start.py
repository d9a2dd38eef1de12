"""Start values without any drawing: the equation of motion is linear in mass and stiffness."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.gain_parameters import gain_from_parameters
from deboom.compressor.mass_parameters import (
    mass_matrix_of_pseudo_inertia,
    parameters_of_pseudo_inertia,
)
from deboom.compressor.minimal_parameters import MinimalParameters
from deboom.errors import InputError

START_GAIN = (np.log(0.35), np.log(0.03), 0.27, np.log(0.25), np.log(0.05))
"""A rubber of medium stiffening and loss, in the order of `GAIN_SHAPE_NAMES`."""
SMALLEST_SPREAD = 1e-3
"""Smallest eigenvalue of the scaled pseudo-inertia against its largest one."""
PASSES = 3
_PSEUDO_ENTRIES = [(i, j) for i in range(4) for j in range(i, 4)]


def linear_start(
    parametrisation: MinimalParameters, frequency: npt.ArrayLike, inertance: npt.ArrayLike
) -> RealArray:
    """Estimate mass and stiffness by weighted linear least squares.

    Parameters
    ----------
    parametrisation : MinimalParameters
        Gives the characteristic length and the scale of the stiffness.
    frequency : array, shape (n_frequency,)
        Above 0, with lines both near and above the rigid-body modes [Hz].
    inertance : array, shape (n_frequency, 6, 6)
        Measured at the virtual point [1/kg, 1/(kg m), 1/(kg m²)].

    Returns
    -------
    array, shape (35,)
        Parameters of `parametrisation`, with the gain of a medium rubber.

    Raises
    ------
    InputError
        Data whose mass line has no positive mass: a channel or an impact of the wrong sign.

    Notes
    -----
    ``(M − v'(f) K'/ω² − j K''/ω²) H = 1`` with a stiffening v' of medium rubber is linear in the
    entries of M, K' and K''. The first pass weights the lines by ``1/|H|``, the next by the model
    found (Sanathanan and Koerner), which turns the error of the equation into one of H. A mass
    matrix that no body can have is moved to the nearest pseudo-inertia with positive eigenvalues.
    """
    lines = np.asarray(frequency, dtype=float)
    squared = (2 * np.pi * lines) ** 2
    unit = np.repeat([1.0, parametrisation.length], 3)
    scaled = np.asarray(inertance) * np.outer(unit, unit)
    mass_basis = _pseudo_basis(parametrisation.length) / np.outer(unit, unit)
    stiffness_basis = parametrisation.stiffness_basis / np.outer(unit, unit)
    stiffening = gain_from_parameters(START_GAIN, parametrisation.reference_frequency).real
    over_frequency = [
        (mass_basis, np.ones_like(squared)),
        (stiffness_basis, -stiffening.at(lines) / squared),
        (stiffness_basis, -1j / squared),
    ]
    terms = np.concatenate(
        [
            factor[:, np.newaxis, np.newaxis] * (basis[:, np.newaxis] @ scaled)
            for basis, factor in over_frequency
        ]
    )
    unity = np.broadcast_to(np.eye(6), scaled.shape)
    weight: ComplexArray = (
        np.eye(6) / np.linalg.norm(scaled, axis=(1, 2))[:, np.newaxis, np.newaxis]
    )
    for _ in range(PASSES):
        columns, right = _real_rows(weight @ terms), _real_rows((weight @ unity)[np.newaxis])
        solution = np.linalg.lstsq(columns, right[:, 0])[0]
        apparent = sum(
            factor[:, np.newaxis, np.newaxis] * np.tensordot(part, basis, axes=1)
            for part, (basis, factor) in zip(
                np.split(solution, [10, 30]), over_frequency, strict=True
            )
        )
        model = np.linalg.inv(np.asarray(apparent))
        weight = model / np.linalg.norm(model, axis=(1, 2))[:, np.newaxis, np.newaxis]
    mass, real, imaginary = np.split(solution, [10, 30])
    gain = np.array(START_GAIN)
    loss = float(real @ imaginary / (real @ real))
    typical = float(gain_from_parameters(START_GAIN, 20.0).imaginary.at(20.0))
    gain[2] *= loss / typical
    gain[3] += np.log(max(loss, 0.05 * typical) / typical)
    return np.concatenate([_mass_numbers(mass, parametrisation.length), real, gain])


def _pseudo_basis(length: float) -> RealArray:
    """6×6 mass matrix of each free entry of the pseudo-inertia in units of length, (10, 6, 6)."""
    unit = np.array([length, length, length, 1.0])
    basis = np.zeros((len(_PSEUDO_ENTRIES), 4, 4))
    for number, (row, column) in enumerate(_PSEUDO_ENTRIES):
        basis[number, row, column] = basis[number, column, row] = unit[row] * unit[column]
    return mass_matrix_of_pseudo_inertia(basis)


def _mass_numbers(entries: RealArray, length: float) -> RealArray:
    """Parameters of the body that lies nearest to a linear estimate."""
    pseudo = np.zeros((4, 4))
    for value, (row, column) in zip(entries, _PSEUDO_ENTRIES, strict=True):
        pseudo[row, column] = pseudo[column, row] = value
    if pseudo[3, 3] <= 0:
        raise InputError(
            "the inertance at the virtual point belongs to a negative mass: look for a channel or "
            "an impact of the wrong sign (the quality report names it)"
        )
    values, vectors = np.linalg.eigh(pseudo)
    possible = (vectors * np.maximum(values, SMALLEST_SPREAD * values.max())) @ vectors.T
    unit = np.array([length, length, length, 1.0])
    return parameters_of_pseudo_inertia(possible * np.outer(unit, unit), length)


def _real_rows(terms: ComplexArray) -> RealArray:
    """One column per term, real over imaginary rows."""
    flat = terms.reshape(terms.shape[0], -1)
    return np.concatenate([flat.real, flat.imag], axis=1).T
