"""How much regularisation an inversion needs, read from the responses of one line."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from functools import cached_property

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError

LAMBDAS: RealArray = np.logspace(-12, 0, 145)
"""Tikhonov's λ that are tried, as fractions of the largest singular value; twelve per decade."""

NO_REDUNDANCY = 1e-9
"""Share of an indicator's own error in its residual below which it cannot be left out."""


class Choice(Enum):
    """How much regularisation, from the responses of each line alone.

    `L_CURVE` takes the corner of the curve of solution norm over residual norm; the other two the
    amount that best predicts indicators left out of the inversion, one by one, or in an average
    over them that does not depend on the directions of the sensors (generalised). On a severely
    ill-posed problem cross-validation now and then holds back far too little, the corner does not.
    """

    L_CURVE = "L-curve"
    GENERALISED_CROSS_VALIDATION = "generalised cross-validation"
    LEAVE_ONE_OUT = "leave-one-out cross-validation"


@dataclass(frozen=True, eq=False)
class Decomposition:
    """Responses in the singular directions of a matrix, line by line.

    Parameters
    ----------
    left : array, shape (n_frequency, n_indicator, n_path)
        Left singular vectors [1].
    singular : array, shape (n_frequency, n_path)
        Falling, above 0.
    responses : array, shape (n_frequency, n_indicator)
        Scaled as the rows of the matrix.
    """

    left: ComplexArray
    singular: RealArray
    responses: ComplexArray

    @cached_property
    def coefficients(self) -> ComplexArray:
        """Responses along the singular directions, shape (n_frequency, n_path)."""
        return np.asarray(np.einsum("fmn,fm->fn", self.left.conj(), self.responses))

    @cached_property
    def outside(self) -> ComplexArray:
        """What no force can explain, shape (n_frequency, n_indicator)."""
        explained = np.einsum("fmn,fn->fm", self.left, self.coefficients)
        return np.asarray(self.responses - explained)

    @property
    def relative(self) -> RealArray:
        """Singular values as fractions of the largest of the line."""
        return np.asarray(self.singular / self.singular[:, :1])


def tikhonov_filters(relative: RealArray, lambdas: RealArray) -> RealArray:
    """Return ``s²/(s² + λ²)``, shape (n_frequency, n_lambda, n_path).

    Parameters
    ----------
    relative : array, shape (n_frequency, n_path)
        Singular values.
    lambdas : array, shape (n_lambda,) or (n_frequency, n_lambda)
        As fractions of the same.
    """
    squared = relative[:, np.newaxis, :] ** 2
    return np.asarray(squared / (squared + lambdas[..., np.newaxis] ** 2))


def truncating_filters(n_path: int) -> RealArray:
    """Return the filters that keep 1, 2, … n_path singular values, shape (n_path, n_path)."""
    return np.tri(n_path)


def l_curve_curvature(data: Decomposition) -> RealArray:
    """Return the curvature of the L-curve of Tikhonov's solutions.

    Returns
    -------
    array, shape (n_frequency, n_lambda)
        Of ``lg‖f‖`` over ``lg‖Y f − a‖``, positive at the corner [1].

    Notes
    -----
    From the closed derivatives over ``ln λ``: with ``dφ/dln λ = −2φ(1 − φ)``, those of
    ``η = Σ φ²|β|²/s²`` and ``ρ = Σ (1 − φ)²|β|² + ρ₀``.

    References
    ----------
    Hansen and O'Leary, "The use of the L-curve in the regularization of discrete ill-posed
    problems", SIAM Journal on Scientific Computing 14, 1993.
    """
    kept = tikhonov_filters(data.relative, LAMBDAS)
    # not 1 − kept, which rounds to nothing where λ is small
    lost = kept * (LAMBDAS[:, np.newaxis] / data.relative[:, np.newaxis, :]) ** 2
    energy = np.abs(data.coefficients[:, np.newaxis, :]) ** 2
    force = energy / data.relative[:, np.newaxis, :] ** 2
    outside = np.sum(np.abs(data.outside) ** 2, axis=1)[:, np.newaxis]

    eta = np.sum(kept**2 * force, axis=2)
    eta_1 = -4 * np.sum(kept**2 * lost * force, axis=2)
    eta_2 = 8 * np.sum(kept**2 * lost * (2 - 3 * kept) * force, axis=2)
    rho = np.sum(lost**2 * energy, axis=2) + outside
    rho_1 = 4 * np.sum(kept * lost**2 * energy, axis=2)
    rho_2 = -8 * np.sum(kept * lost**2 * (1 - 3 * kept) * energy, axis=2)

    # a line of zeros, or without any rest, has no corner: divide by the smallest number instead
    tiny = np.finfo(float).tiny
    eta, rho = np.maximum(eta, tiny), np.maximum(rho, tiny)
    x_1, y_1 = rho_1 / rho / 2, eta_1 / eta / 2
    x_2 = (rho_2 / rho - (rho_1 / rho) ** 2) / 2
    y_2 = (eta_2 / eta - (eta_1 / eta) ** 2) / 2
    speed = np.maximum((x_1**2 + y_1**2) ** 1.5, tiny)
    return np.asarray((x_1 * y_2 - y_1 * x_2) / speed)


def cross_validation_scores(
    data: Decomposition, filters: RealArray, *, generalised: bool
) -> RealArray:
    """Return how badly each set of filters predicts indicators left out of the inversion.

    Parameters
    ----------
    data : Decomposition
        Of n_indicator responses, more than there are paths.
    filters : array, shape (n_frequency or 1, n_candidate, n_path)
        Filter factors [1].
    generalised : bool
        ``‖r‖²/(n − Σφ)²`` instead of ``Σ (r_i/(1 − h_i))²``.

    Returns
    -------
    array, shape (n_frequency, n_candidate)

    Raises
    ------
    InputError
        An indicator that cannot be left out.

    Notes
    -----
    h_i, the share of an indicator in its own prediction, is ``Σ_k |U_ik|² φ_k``; the second form is
    the exact error of all inversions with one indicator left out (PRESS), the first its average
    over rotations of the responses.

    References
    ----------
    Golub, Heath and Wahba, "Generalized cross-validation as a method for choosing a good ridge
    parameter", Technometrics 21, 1979.
    """
    n_indicator = data.left.shape[1]
    filters = np.broadcast_to(filters, (len(data.singular), *filters.shape[1:]))
    lost = (1 - filters) * data.coefficients[:, np.newaxis, :]
    if generalised:
        outside = np.sum(np.abs(data.outside) ** 2, axis=1)[:, np.newaxis]
        residual = np.sum(np.abs(lost) ** 2, axis=2) + outside
        return np.asarray(residual / (n_indicator - filters.sum(axis=2)) ** 2)
    weight = np.abs(data.left) ** 2
    spare = 1 - weight.sum(axis=2)
    if np.any(spare < NO_REDUNDANCY):
        line, indicator = (int(index) for index in np.argwhere(spare < NO_REDUNDANCY)[0])
        raise InputError(
            f"indicator {indicator} cannot be left out (line {line}): it alone sees one of the "
            "forces; add a sensor near it, or choose by generalised cross-validation"
        )
    score = np.empty(filters.shape[:2])
    for candidate in range(filters.shape[1]):
        factor = filters[:, candidate]
        residual = data.outside + np.einsum("fmn,fn->fm", data.left, lost[:, candidate])
        own = 1 - np.einsum("fmn,fn->fm", weight, factor)
        score[:, candidate] = np.sum(np.abs(residual / own) ** 2, axis=1)
    return score
