"""Unknown forces from measured responses: inversion of a matrix that may be nearly singular.

The columns of the matrix are divided by their norms first. The condition number, and what
regularisation holds back, then depend on neither the units of forces and moments nor on how lively
a path is; no other scaling of the columns lowers the number by more than √n (van der Sluis 1969).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.physics.regularisation_choice import (
    LAMBDAS,
    Choice,
    Decomposition,
    cross_validation_scores,
    l_curve_curvature,
    tikhonov_filters,
    truncating_filters,
)

SINGULAR = 1e10
"""Scaled condition number from which paths count as moving the indicators in one common way."""


class Regularisation(Enum):
    """What is done about directions of force that the indicators hardly see."""

    NONE = "none"
    TRUNCATED = "truncated singular values"
    TIKHONOV = "Tikhonov"


@dataclass(frozen=True)
class Inversion:
    """How to invert.

    Parameters
    ----------
    regularisation : Regularisation
        Nothing, a cut, or a smooth damping of small singular values.
    amount : Choice or float
        Chosen per line, or the same on all lines as a fraction of the largest singular value:
        singular values below it are left out, or it is Tikhonov's λ [1]. Without meaning where
        nothing is regularised.

    Raises
    ------
    InputError
        A fraction outside 0 … 1.
    """

    regularisation: Regularisation = Regularisation.TIKHONOV
    amount: Choice | float = Choice.GENERALISED_CROSS_VALIDATION

    def __post_init__(self) -> None:
        if not isinstance(self.amount, Choice) and not 0 <= self.amount <= 1:
            raise InputError(
                f"a regularisation of {self.amount}: give a fraction of the largest singular "
                "value, 0 to 1"
            )


PLAIN = Inversion(Regularisation.NONE)
"""Least squares, nothing held back."""

CROSS_VALIDATED = Inversion()
"""Tikhonov, its λ of each line by generalised cross-validation."""


@dataclass(frozen=True, eq=False)
class InvertedForces:
    """Forces out of an inversion, and how much of them to believe.

    Parameters
    ----------
    force : array, shape (n_frequency, n_path)
        Complex peak [N].
    condition_number : array, shape (n_frequency,)
        Of the matrix with columns (and rows, where their noise was given) scaled [1].
    amount : array, shape (n_frequency,)
        Regularisation of each line as a fraction of the largest singular value: Tikhonov's λ, or
        the smallest singular value that was kept; 0 where nothing was regularised [1].
    freedom : array, shape (n_frequency,)
        Directions of force that took part, sum of the filter factors: n_path where nothing was
        held back [1].
    residual : array, shape (n_frequency,)
        Part of the responses that the forces do not explain, norm over norm [1].
    noise_gain : array, shape (n_frequency, n_path)
        Standard deviation of each force for responses with a noise of 1 [N per unit of the
        responses], or for the noise that was given [N]. What regularisation takes away from the
        force itself comes on top.
    """

    force: ComplexArray
    condition_number: RealArray
    amount: RealArray
    freedom: RealArray
    residual: RealArray
    noise_gain: RealArray

    def __post_init__(self) -> None:
        for name in (
            "force",
            "condition_number",
            "amount",
            "freedom",
            "residual",
            "noise_gain",
        ):
            array = np.array(getattr(self, name))
            array.setflags(write=False)
            object.__setattr__(self, name, array)


def invert_for_forces(
    matrix: npt.ArrayLike,
    response: npt.ArrayLike,
    inversion: Inversion = CROSS_VALIDATED,
    noise: npt.ArrayLike | None = None,
    path_names: Sequence[str] = (),
) -> InvertedForces:
    """Find the forces that explain the responses of the indicators.

    Parameters
    ----------
    matrix : array_like, shape (n_frequency, n_indicator, n_path)
        Response per force [unit per N]. Of the receiver on its own it gives interface forces, of
        the assembled bodies blocked forces.
    response : array_like, shape (n_frequency, n_indicator)
        In operation, complex peak [unit].
    inversion : Inversion
        Regularisation.
    noise : array_like, shape (n_indicator,) or (n_frequency, n_indicator), optional
        Standard deviation of each response [unit]; by default all alike. Rows are divided by it.
    path_names : sequence of str, optional
        For messages; by default ``path 0``, …

    Returns
    -------
    InvertedForces

    Raises
    ------
    InputError
        Shapes that disagree, values that are not finite, more unknown forces than indicators,
        paths that no indicator sees or tells apart, noise that is not positive, a choice of the
        amount without an indicator to spare.

    Notes
    -----
    ``f = Y⁺ a`` with ``Y = U S Vᴴ`` after scaling, ``f = V Φ S⁻¹ Uᴴ a``: Φ = 1 for none, 1 or 0 for
    truncated, ``s²/(s² + λ²)`` for Tikhonov. The thesis (section 2.4.2) names the method and its
    ill-conditioning, and gives no equation. With truncation the L-curve is that of Tikhonov:
    singular values above the λ of its corner are kept, as both filters cut there.

    References
    ----------
    Hansen, "Rank-Deficient and Discrete Ill-Posed Problems", SIAM, 1998.
    Thite and Thompson, "The quantification of structure-borne transmission paths by inverse
    methods", Journal of Sound and Vibration 264, 2003.
    """
    transfer, responses = _checked(matrix, response)
    n_path = transfer.shape[2]
    names = tuple(path_names) or tuple(f"path {path}" for path in range(n_path))
    if noise is not None:
        row_scale = 1 / _checked_noise(noise, responses.shape)
        transfer, responses = transfer * row_scale[:, :, np.newaxis], responses * row_scale
    columns = np.linalg.norm(transfer, axis=1)
    _refuse_unseen(columns, names)
    left, singular, right = np.linalg.svd(transfer / columns[:, np.newaxis, :], full_matrices=False)
    _refuse_dependent(singular, right, names)
    data = Decomposition(left, singular, responses)
    amount, filters = _filters(data, inversion)
    solution = np.swapaxes(right.conj(), 1, 2) / columns[:, :, np.newaxis]
    gains = solution * (filters / singular)[:, np.newaxis, :]
    force = np.einsum("fnk,fk->fn", gains, data.coefficients)
    unexplained = responses - np.einsum("fmn,fn->fm", transfer, force)
    size = np.linalg.norm(responses, axis=1)
    return InvertedForces(
        force=force,
        condition_number=singular[:, 0] / singular[:, -1],
        amount=amount,
        freedom=filters.sum(axis=1),
        residual=np.linalg.norm(unexplained, axis=1) / np.where(size > 0, size, 1.0),
        noise_gain=np.linalg.norm(gains, axis=2),
    )


def _filters(data: Decomposition, inversion: Inversion) -> tuple[RealArray, RealArray]:
    """Return the amount of each line and the filter factors that follow from it."""
    relative = data.relative
    if inversion.regularisation is Regularisation.NONE:
        return np.zeros(len(relative)), np.ones_like(relative)
    truncate = inversion.regularisation is Regularisation.TRUNCATED
    if isinstance(inversion.amount, Choice):
        amount = _chosen_amount(data, inversion.amount, truncate)
    else:
        amount = np.full(len(relative), float(inversion.amount))
    if not truncate:
        return amount, tikhonov_filters(relative, amount[:, np.newaxis])[:, 0]
    kept = relative >= amount[:, np.newaxis]
    return np.where(kept, relative, 1.0).min(axis=1), kept.astype(float)


def _chosen_amount(data: Decomposition, choice: Choice, truncate: bool) -> RealArray:
    """Choose a fraction per line; truncation cuts just below one of the singular values."""
    relative = data.relative
    if data.left.shape[1] == data.left.shape[2]:
        raise InputError(
            f"{relative.shape[1]} unknown forces from as many indicators explain every noise, so "
            "nothing tells how much to regularise: add sensors, or give the amount"
        )
    if choice is Choice.L_CURVE:
        return np.asarray(LAMBDAS[np.argmax(l_curve_curvature(data), axis=1)])
    generalised = choice is Choice.GENERALISED_CROSS_VALIDATION
    candidates = relative if truncate else np.broadcast_to(LAMBDAS, (len(relative), LAMBDAS.size))
    filters = (
        truncating_filters(relative.shape[1])[np.newaxis]
        if truncate
        else tikhonov_filters(relative, LAMBDAS)
    )
    best = np.argmin(cross_validation_scores(data, filters, generalised=generalised), axis=1)
    return np.take_along_axis(candidates, best[:, np.newaxis], axis=1)[:, 0]


def _checked(matrix: npt.ArrayLike, response: npt.ArrayLike) -> tuple[ComplexArray, ComplexArray]:
    transfer, responses = np.asarray(matrix, dtype=complex), np.asarray(response, dtype=complex)
    if transfer.ndim != 3 or responses.shape != transfer.shape[:2] or not transfer.size:
        raise InputError(
            f"a matrix of shape {transfer.shape} and responses of shape {responses.shape} do not "
            "belong together: give (n_frequency, n_indicator, n_path) and (n_frequency, "
            "n_indicator)"
        )
    n_indicator, n_path = transfer.shape[1:]
    if n_path > n_indicator:
        raise InputError(
            f"{n_path} unknown forces from {n_indicator} indicators: measure at least as many "
            "responses as there are paths, better twice as many"
        )
    for array, what in ((transfer, "matrix"), (responses, "responses")):
        if not np.isfinite(array).all():
            where = tuple(int(index) for index in np.argwhere(~np.isfinite(array))[0])
            raise InputError(f"the {what} of the inversion is not finite at index {where}")
    return transfer, responses


def _checked_noise(noise: npt.ArrayLike, shape: tuple[int, ...]) -> RealArray:
    values = np.asarray(noise, dtype=float)
    if values.shape not in (shape, shape[1:]):
        raise InputError(
            f"noise of shape {values.shape} for responses of shape {shape}: give one standard "
            "deviation per indicator, or per line and indicator"
        )
    if not np.all(values > 0) or not np.isfinite(values).all():
        raise InputError("the noise of every indicator is above 0 and finite")
    return np.asarray(np.broadcast_to(values, shape))


def _refuse_unseen(columns: RealArray, names: Sequence[str]) -> None:
    if not np.all(columns > 0):
        line, path = (int(index) for index in np.argwhere(~(columns > 0))[0])
        raise InputError(
            f"a force at {names[path]} moves no indicator (line {line}): place a sensor that it "
            "moves, or leave the path out"
        )


def _refuse_dependent(singular: RealArray, right: ComplexArray, names: Sequence[str]) -> None:
    dependent = np.flatnonzero(singular[:, -1] * SINGULAR <= singular[:, 0])
    if dependent.size:
        share = np.abs(right[dependent[0], -1])
        together = [
            name for name, size in zip(names, share, strict=True) if size > 0.1 * share.max()
        ]
        raise InputError(
            f"singular positions: forces at {together} move all indicators in a common way "
            f"({dependent.size} lines, first line {dependent[0]}), so their values have no answer: "
            "place sensors between them, or leave one of the paths out"
        )
