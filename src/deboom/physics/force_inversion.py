"""Unknown forces from measured responses: inversion of a matrix that may be nearly singular.

The columns of the matrix are divided by their norms first. The condition number, and what
regularisation holds back, then depend on neither the units of forces and moments nor on how lively
a path is; no other scaling of the columns lowers the number by more than √n (van der Sluis 1969).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cached_property

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray, checked, checked_array
from deboom.errors import InputError

FUNCTION_ERROR = 0.05
"""Standard error of a measured transfer function unless stated, relative [1]: hammer tests that are
repeated after sensors were mounted anew differ by 3 to 10 %."""
SINGULAR = 1e10
"""Scaled condition number from which paths count as moving the indicators in one common way."""

LAMBDAS: RealArray = np.logspace(-12, 0, 145)
"""Tikhonov's λ that are tried, as fractions of the largest singular value; twelve per decade."""


class Regularisation(Enum):
    """Treatment of directions of force that the indicators hardly see."""

    NONE = "none"
    TRUNCATED = "truncated singular values"
    TIKHONOV = "Tikhonov"


class Choice(Enum):
    """Way to choose the amount of regularisation from the responses of each line alone.

    `L_CURVE` takes the corner of the curve of solution norm over residual norm; cross-validation
    the amount that best predicts indicators left out of the inversion, in an average over them that
    does not depend on the directions of the sensors. On a severely ill-posed problem it now and
    then holds back far too little, the corner does not.
    """

    L_CURVE = "L-curve"
    GENERALISED_CROSS_VALIDATION = "generalised cross-validation"


@dataclass(frozen=True)
class Inversion:
    """How to invert.

    - `regularisation`.
    - `amount`: choice per line, or the same fraction of the largest singular value on all lines, 0
      to 1, else InputError: singular values below it are left out, or it is Tikhonov's λ [1].
      Without meaning where nothing is regularised.
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


@checked(
    force="f p",
    condition_number="f",
    amount="f",
    freedom="f",
    residual="f",
    noise_gain="f p",
    half_width="f p",
    gain="f p m",
)
class InvertedForces:
    """Forces out of an inversion, and how much of them to believe.

    - `force` (n_frequency, n_path): complex peak [N].
    - `condition_number` (n_frequency,): condition number of the matrix with columns (and rows,
      where their noise was given) scaled [1].
    - `amount` (n_frequency,): regularisation of each line as a fraction of the largest singular
      value: Tikhonov's λ, or the smallest singular value that was kept; 0 where nothing was
      regularised [1].
    - `freedom` (n_frequency,): directions of force that took part, sum of the filter factors:
      n_path where nothing was held back [1].
    - `residual` (n_frequency,): part of the responses that the forces do not explain, norm over
      norm [1].
    - `noise_gain` (n_frequency, n_path): standard deviation of each force for responses with a
      noise of 1 [N per unit of the responses], or for the noise that was given [N]. What
      regularisation takes away from the force itself comes on top, and so do errors of the matrix.
    - `half_width` (n_frequency, n_path): distance within which the true force lies at 90 %, with
      errors of matrix and responses and with what regularisation takes away [N].
    - `gain` (n_frequency, n_path, n_indicator): force per response at the chosen amounts, the
      regularised inverse of the matrix [N per unit of the responses].
    """

    force: ComplexArray
    condition_number: RealArray
    amount: RealArray
    freedom: RealArray
    residual: RealArray
    noise_gain: RealArray
    half_width: RealArray
    gain: ComplexArray


def invert_for_forces(
    matrix: npt.ArrayLike,
    response: npt.ArrayLike,
    inversion: Inversion = CROSS_VALIDATED,
    noise: npt.ArrayLike | None = None,
    path_names: Sequence[str] = (),
    function_error: float = FUNCTION_ERROR,
) -> InvertedForces:
    """Find the forces that explain the responses of the indicators.

    Raises InputError: shapes that disagree, values that are not finite, more unknown forces than
    indicators, paths that no indicator sees or tells apart, noise that is not positive, a choice of
    the amount without an indicator to spare.

    Parameters
    ----------
    matrix : array_like, shape (n_frequency, n_indicator, n_path)
        Response per force [unit per N]. Of the receiver on its own it gives interface forces, of
        the assembled bodies blocked forces.
    response : array_like, shape (n_frequency, n_indicator) — in operation, complex peak [unit]
    inversion : Inversion — regularisation
    noise : array_like, shape (n_indicator,) or (n_frequency, n_indicator), optional
        Standard deviation of each response [unit]; by default all alike. Rows are divided by it.
    path_names : sequence of str, optional — names for messages
    function_error : float — standard error of each entry of the matrix, relative [1]

    Notes
    -----
    The half width: a circular complex error is within ``σ √ln 10`` at 90 %. Of each singular
    direction σ² is the larger of two. Noise, ``1/(1/τ² + s₀²/σ_a²)``: σ_a² is the larger of what
    the forces leave unexplained, per degree of freedom, and of errors of the matrix times the
    forces plus the stated noise. Bias, of regularisation, ``(1 − φ)/φ``, and of errors ε of the
    matrix, which make small singular values larger, ``ε²/s₀²``, times the force. There
    ``s₀² = s² − 2ε²``. A force along a direction that the indicators do not see is taken to be
    drawn as the largest along the others, of which it is within 3 times at 90 %; opposed forces of
    stiff neighbours may be larger.

    ``f = Y⁺ a`` with ``Y = U S Vᴴ`` after scaling, ``f = V Φ S⁻¹ Uᴴ a``: Φ = 1 for none, 1 or 0 for
    truncated, ``s²/(s² + λ²)`` for Tikhonov (Hansen, "Rank-Deficient and Discrete Ill-Posed
    Problems", SIAM, 1998; Thite and Thompson, Journal of Sound and Vibration 264, 2003). The thesis
    (section 2.4.2) names the method and its ill-conditioning, and gives no equation. With
    truncation the L-curve is that of Tikhonov: singular values above the λ of its corner are kept,
    as both filters cut there.
    """
    sizes: dict[str, int] = {}
    transfer: ComplexArray = checked_array(matrix, "f m p", "matrix to invert", sizes, complex)
    responses: ComplexArray = checked_array(response, "f m", "responses", sizes, complex)
    n_indicator, n_path = transfer.shape[1:]
    if n_path > n_indicator or not transfer.size:
        raise InputError(
            f"{n_path} unknown forces from {n_indicator} indicators: measure at least as many "
            "responses as there are paths, better twice as many"
        )
    row_scale: RealArray = np.ones(responses.shape)
    names = tuple(path_names) or tuple(f"path {path}" for path in range(n_path))
    if noise is not None:
        axes = "m" if np.ndim(noise) == 1 else "f m"
        deviation: RealArray = checked_array(noise, axes, "noise of the indicators", sizes)
        if not np.all(deviation > 0):
            raise InputError("the noise of every indicator is above 0")
        row_scale = 1 / np.broadcast_to(deviation, responses.shape)
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
    freedom = filters.sum(axis=1)
    spare = n_indicator - freedom
    left_over = np.linalg.norm(unexplained, axis=1) ** 2 / np.where(spare > 0.5, spare, np.inf)
    of_matrix = np.einsum("fmn,fn->fm", np.abs(transfer) ** 2, np.abs(force) ** 2).mean(axis=1)
    variance = np.maximum(left_over, function_error**2 * of_matrix + (noise is not None))
    along = _errors_along(
        np.abs(filters * data.coefficients / singular), filters, variance, singular, function_error
    )
    return InvertedForces(
        force=force,
        condition_number=singular[:, 0] / singular[:, -1],
        amount=amount,
        freedom=freedom,
        residual=np.linalg.norm(unexplained, axis=1) / np.where(size > 0, size, 1.0),
        noise_gain=np.linalg.norm(gains, axis=2),
        half_width=np.sqrt(np.log(10)) * np.linalg.norm(solution * along[:, np.newaxis], axis=2),
        gain=np.einsum("fnk,fmk,fm->fnm", gains, left.conj(), row_scale),
    )


@dataclass(frozen=True, eq=False)
class Decomposition:
    """Responses in the singular directions of a matrix, line by line.

    - `left` (n_frequency, n_indicator, n_path): left singular vectors, one per column.
    - `singular` (n_frequency, n_path): singular values, decreasing.
    - `responses` (n_frequency, n_indicator): responses, scaled as the rows of the matrix.
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


def _errors_along(
    force: RealArray, filters: RealArray, variance: RealArray, singular: RealArray, error: float
) -> RealArray:
    """Return the standard error of the force along each singular direction, (f, p), scaled.

    See the notes of `invert_for_forces`; `force`, `filters`, `singular` (f, p), `variance` (f,).
    """
    tiny = np.finfo(float).tiny
    # of two circular normal numbers the ratio is within 3 at 90 %
    beyond = 3 / np.sqrt(np.log(10))
    largest = np.broadcast_to(beyond * force.max(axis=1, keepdims=True), force.shape)
    seen = singular**2 - 2 * error**2
    is_seen = (seen > 0) & (filters > 0)
    seen, kept = np.where(is_seen, seen, 1.0), np.where(is_seen, filters, 1.0)
    noise = largest * np.sqrt(
        1 / (1 + largest**2 * seen / np.maximum(variance, tiny)[:, np.newaxis])
    )
    bias = np.minimum(force * ((1 - kept) / kept + error**2 / seen), largest)
    return np.where(is_seen, np.maximum(noise, bias), largest)


def tikhonov_filters(relative: RealArray, lambdas: RealArray) -> RealArray:
    """Return ``s²/(s² + λ²)``, shape (n_frequency, n_lambda, n_path).

    Singular values have shape (n_frequency, n_path), λ shape (n_lambda,) or (n_frequency, n_lambda)
    as fractions of the same.
    """
    squared = relative[:, np.newaxis, :] ** 2
    return np.asarray(squared / (squared + lambdas[..., np.newaxis] ** 2))


def l_curve_curvature(data: Decomposition) -> RealArray:
    """Return the curvature of the L-curve of Tikhonov's solutions, shape (n_frequency, n_lambda).

    Notes
    -----
    Curvature of ``lg‖f‖`` over ``lg‖Y f − a‖``, positive at the corner [1], from the closed
    derivatives over ``ln λ``: with ``dφ/dln λ = −2φ(1 − φ)``, those of ``η = Σ φ²|β|²/s²`` and
    ``ρ = Σ (1 − φ)²|β|² + ρ₀`` (Hansen and O'Leary, SIAM Journal on Scientific Computing 14, 1993).
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


def cross_validation_scores(data: Decomposition, filters: RealArray) -> RealArray:
    """Return how badly each set of filters predicts indicators left out of the inversion.

    Filters have shape (n_frequency or 1, n_candidate, n_path), scores (n_frequency, n_candidate).

    Notes
    -----
    ``‖r‖²/(n − Σφ)²`` (generalised: Golub, Heath and Wahba, Technometrics 21, 1979), the average
    over rotations of the responses of the error of all inversions with one indicator left out.
    """
    filters = np.broadcast_to(filters, (len(data.singular), *filters.shape[1:]))
    lost = (1 - filters) * data.coefficients[:, np.newaxis, :]
    outside = np.sum(np.abs(data.outside) ** 2, axis=1)[:, np.newaxis]
    residual = np.sum(np.abs(lost) ** 2, axis=2) + outside
    return np.asarray(residual / (data.left.shape[1] - filters.sum(axis=2)) ** 2)


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
    """Choose a fraction per line; truncation keeps the singular values that reach it."""
    relative = data.relative
    n_line, n_path = relative.shape
    if data.left.shape[1] == n_path:
        raise InputError(
            f"{n_path} unknown forces from as many indicators explain every noise, so "
            "nothing tells how much to regularise: add sensors, or give the amount"
        )
    if choice is Choice.L_CURVE:
        return np.asarray(LAMBDAS[np.argmax(l_curve_curvature(data), axis=1)])
    if truncate:
        # keep 1, 2, … n_path singular values
        candidates, filters = relative, np.tri(n_path)[np.newaxis]
    else:
        candidates = np.broadcast_to(LAMBDAS, (n_line, LAMBDAS.size))
        filters = tikhonov_filters(relative, LAMBDAS)
    best = np.argmin(cross_validation_scores(data, filters), axis=1)
    return np.take_along_axis(candidates, best[:, np.newaxis], axis=1)[:, 0]


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
