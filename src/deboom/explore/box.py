"""A specification as a box of independent intervals, and the share of its parts that keep a limit.

A part that lies in its box is accepted, whatever the other variables of the same part are; that is
what a drawing can say. Parts are taken to lie evenly: an acceptance test says no more than that
they lie inside. Where they are used, one factor may change all variables of a part together, as
temperature changes all rubber of a car; it is drawn as evenly, apart from the places. The share
counts parts and responses, or whole parts, that keep the limit; a share below 1 leaves out the
corners of the box that parts hardly ever reach.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt
from scipy.special import ndtr

from deboom.arrays import BoolArray, RealArray, checked, checked_array
from deboom.errors import InputError
from deboom.explore.moments import CONFIDENCE
from deboom.explore.space import Differentiable, check_gradient, checked_seed, generator, responses

VERIFICATION = 131072
"""Parts of a verification."""

_CHUNK = 4096  # parts evaluated at a time: what is in memory
_GRADIENTS = 512  # parts whose gradients are in memory at a time
_FAR = 5.0  # distance from the limit, in softnesses, beyond which a part has no slope


@checked(names="k", lower="k", upper="k")
class Box:
    """Product of intervals.

    - `names`: variables.
    - `lower`, `upper` (k,): ends of the intervals, both inside, finite and in order [units of the
      variables].
    """

    names: tuple[str, ...]
    lower: RealArray
    upper: RealArray

    @property
    def width(self) -> RealArray:
        """Widths of the intervals, shape (k,) [units of the variables]."""
        return np.asarray(self.upper - self.lower)

    @property
    def centre(self) -> RealArray:
        """Middles of the intervals, shape (k,) [units of the variables]."""
        return np.asarray(0.5 * (self.lower + self.upper))

    @property
    def ends(self) -> RealArray:
        """Lower and upper ends, shape (2, k) [units of the variables]."""
        return np.stack([self.lower, self.upper])

    def at(self, places: RealArray) -> RealArray:
        """Return the designs at places from 0 to 1 of the intervals, both of shape (n, k)."""
        return np.asarray(self.lower + places * self.width)

    def contains(self, designs: RealArray) -> BoolArray:
        """Return which designs, shape (n, k), lie inside, shape (n,)."""
        return np.asarray(np.all((designs >= self.lower) & (designs <= self.upper), axis=1))


@checked(limit="r", lower="k", upper="k")
class BoxQuestion:
    """The question that asks for the box with the largest ``Σ_k weight_k log(upper_k - lower_k)``.

    Parameters
    ----------
    response : BoomingModel or another evaluation with a gradient
        Designs, shape (n, k) → responses, shape (n, r); a failed design keeps no limit.
    limit : array, shape (r,)
        Largest value of each response that is kept [unit of the responses].
    share : float
        Least share of parts and responses that keep their limit, between 0 and 1 [1].
    lower, upper : array, shape (k,)
        Bounds of all parts; equal bounds hold a variable fixed [units of the variables].
    weight : array, shape (k,), optional
        Cost of a per cent of tolerance, above 0; only ratios count. Default is 1 [1].
    together : bool
        Whether a part must keep all limits; otherwise pairs of part and response are counted.
    common : float
        Half width of the factor about 1 by which all variables of a part differ in use from what
        they are in the box, at least 0 and below 1 [1].

    Raises
    ------
    InputError
        Impossible limits, bounds, weights, share or common factor; a model without gradient; no
        free variable.

    See Also
    --------
    deboom.largest_box, deboom.Objective, deboom.allocate_tolerances

    Examples
    --------
    >>> import deboom, numpy as np
    >>> model = deboom.read_platform("u06").model(vehicles="U06", motion="prescribed")
    >>> space = model.design_space(bounds=0.3)
    >>> today = model(np.ones((1, 12)))[0]
    >>> deboom.BoxQuestion(model, today - 81.0, 0.9, space.lower, space.upper).least_kept
    5
    """

    response: Differentiable
    limit: RealArray
    share: float
    lower: RealArray
    upper: RealArray
    weight: RealArray = field(default_factory=lambda: np.empty(0))
    together: bool = False
    common: float = 0.0

    def __post_init__(self) -> None:
        check_gradient(self.response, "a box is found with one only")
        sizes = {"k": len(self.names), "r": len(self.response.response_names)}
        weight = self.weight if np.size(self.weight) else np.ones(sizes["k"])
        checked_array(self.limit, "r", "limits of a box", sizes)
        checked_array(self.lower, "k", "bounds of a box", sizes)
        weight = checked_array(weight, "k", "weights of a box", sizes)
        object.__setattr__(self, "weight", weight)
        if not 0.0 < self.share < 1.0:
            raise InputError(
                f"a share of {self.share:g} of the parts: give one above 0 and below 1, such as "
                "0.95; that all parts keep a limit no sample can show"
            )
        if not 0.0 <= self.common < 1.0:
            raise InputError(
                f"a common factor of 1 ± {self.common:g}: give a half width from 0 and below 1, "
                "such as 0.05"
            )
        for name, low, high, price in zip(self.names, self.lower, self.upper, weight, strict=True):
            if low > high:
                raise InputError(f"the bounds of '{name}' are reversed: {low:g} is above {high:g}")
            if not price > 0.0:
                raise InputError(
                    f"the weight of '{name}' is {price:g}: give one above 0, or its interval "
                    "would shrink to nothing"
                )
        if not np.any(self.free):
            raise InputError("the bounds hold every variable fixed: a box needs one that is free")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the variables."""
        return self.response.variable_names

    @property
    def free(self) -> BoolArray:
        """Variables that are not held fixed, shape (k,)."""
        return np.asarray(self.upper > self.lower)

    @property
    def n_draws(self) -> int:
        """Uniform draws that stand for one part: its places, and a common factor."""
        return len(self.names) + (self.common > 0.0)

    def parts(self, ends: RealArray, unit: RealArray) -> RealArray:
        """Return parts in use, (n, k), of a box with ends (2, k) at draws (n, n_draws) [1]."""
        places = unit[:, : len(self.names)]
        return np.asarray(self.factor(unit) * (ends[0] + places * (ends[1] - ends[0])))

    def factor(self, unit: RealArray) -> RealArray:
        """Return the common factor of each draw, (n, 1) [1]."""
        if self.common == 0.0:
            return np.ones((len(unit), 1))
        return np.asarray(1.0 + self.common * (2.0 * unit[:, len(self.names) :] - 1.0))

    @property
    def bounds(self) -> Box:
        """The largest box that may be asked for."""
        return Box(self.names, self.lower, self.upper)

    @property
    def least_kept(self) -> int:
        """How many responses of one part must keep their limit for the share to be kept."""
        least = int(np.ceil(self.share * self.limit.size - 1e-12))
        return self.limit.size if self.together else least

    def lowered(self, step: float) -> BoxQuestion:
        """Return the same question with all limits lowered by a step [response_unit]."""
        return replace(self, limit=self.limit - step)

    def excess(self, designs: RealArray) -> RealArray:
        """Return how far designs, (n, k), are above each limit, (n, r) [response_unit]."""
        excess = np.empty((len(designs), self.limit.size))
        for start in range(0, len(designs), _CHUNK):
            rows = slice(start, start + _CHUNK)
            excess[rows] = responses(self.response, designs[rows]) - self.limit
        return np.where(np.isnan(excess), np.inf, excess)

    def part_shares(self, excess: RealArray) -> RealArray:
        """Return the share of its limits that each part keeps, shape (n,), of its excess (n, r).

        With `together` it is 1 or 0.
        """
        kept = excess <= 0.0
        return np.asarray(kept.all(axis=1) if self.together else kept.mean(axis=1), dtype=float)

    def share_of(self, box: Box, unit: RealArray) -> float:
        """Return the share over the parts that uniform draws, (n, n_draws), stand for [1]."""
        return float(self.part_shares(self.excess(self.parts(box.ends, unit))).mean())

    def log_volume(self, box: Box) -> float:
        """Return ``Σ weight log width`` over the free variables."""
        return float(self.weight[self.free] @ np.log(box.width[self.free]))

    def checked(self, point: npt.ArrayLike) -> RealArray:
        """Return a design (k,) inside the bounds, or refuse it by the name of the variable."""
        values = np.asarray(point, dtype=float)
        if values.shape != self.lower.shape:
            raise InputError(
                f"a design of shape {values.shape} for the variables {list(self.names)}: give one "
                "number each"
            )
        inside = (values >= self.lower) & (values <= self.upper)
        if not np.all(inside):
            column = int(np.argmin(inside))
            raise InputError(
                f"'{self.names[column]}' of the design is {values[column]:g}, outside the bounds "
                f"{self.lower[column]:g} to {self.upper[column]:g}: widen them"
            )
        return values


def smooth_share(
    question: BoxQuestion, ends: RealArray, unit: RealArray, softness: float
) -> tuple[float, RealArray]:
    """Return a smoothed share and its derivatives by the ends of a box.

    - `ends` (2, k): lower and upper ends, of which any pair may be crossed [units of the
      variables].
    - `unit` (n, n_draws): uniform draws that stand for the parts [1].
    - `softness`: width of the normal distribution that smooths the step [response_unit].
    - returns `share`: mean of ``Φ(-excess / softness)`` over parts and responses or, with
      ``question.together``, of the largest excess of each part [1].
    - returns `gradient` (2, k): derivatives of the share by the ends [1 / units of the variables].

    A part is ``f (l + t (u - l))`` with its place t and common factor f from the shared draws, thus
    ``∂x/∂l = f (1 - t)`` and ``∂x/∂u = f t``: the model's gradient of parts near the limit is all
    that is needed.
    """
    designs = question.parts(ends, unit)
    excess = question.excess(designs)
    counted = np.ones(excess.shape, dtype=bool)
    if question.together:
        counted = np.arange(excess.shape[1]) == excess.argmax(axis=1)[:, np.newaxis]
    scaled = excess / softness
    kept = np.where(counted, ndtr(-scaled), 0.0)
    slope = np.where(counted & (np.abs(scaled) < _FAR), -np.exp(-0.5 * scaled**2), 0.0)
    slope /= np.sqrt(2.0 * np.pi) * softness * counted.sum()
    by_end = np.zeros((2, designs.shape[1]))
    rows = np.flatnonzero(slope.any(axis=1))
    if len(rows):
        by_part = _pulled_back(question.response, designs[rows], slope[rows])
        by_part *= question.factor(unit[rows])
        places = unit[rows, : designs.shape[1]]
        by_end[0] = np.einsum("nk,nk->k", by_part, 1.0 - places)
        by_end[1] = np.einsum("nk,nk->k", by_part, places)
    return float(kept.sum() / counted.sum()), by_end


def _pulled_back(response: Differentiable, designs: RealArray, weights: RealArray) -> RealArray:
    """Return ``Σ_r w_nr ∂y_nr/∂x_nk`` of weights (n, r), shape (n, k).

    One adjoint solution gives it where the response has a pull-back. All derivatives are needed
    where it has none, and of a part whose sum is not finite: the others count where one is lost.
    """
    by_part, rest = np.zeros(designs.shape), np.arange(len(designs))
    if hasattr(response, "linearised"):
        by_part = response.linearised(designs)[1](weights[np.newaxis])[0]
        rest = np.flatnonzero(~np.isfinite(by_part).all(axis=1))
    for start in range(0, len(rest), _GRADIENTS):
        rows = rest[start : start + _GRADIENTS]
        gradient = np.nan_to_num(response.gradient(designs[rows]), posinf=0.0, neginf=0.0)
        by_part[rows] = np.einsum("nr,nrk->nk", weights[rows], gradient)
    return by_part


def face_shares(question: BoxQuestion, box: Box, unit: RealArray) -> RealArray:
    """Return the share that parts exactly at each lower and each upper end keep, shape (2, k) [1].

    Parts lie evenly, at ``unit`` of shape (n, n_draws):
    ``∂share/∂u_k = (share of the upper face - share) / (u_k - l_k)``, by Leibniz' rule, without any
    smoothing. In the largest box each face that is no bound has a share that is lower than that of
    the box by the same multiple of the weight: the check of an optimum that needs no gradient of
    the model.
    """
    shares = np.empty((2, len(question.names)))
    for end, column in np.ndindex(*shares.shape):
        moved = unit.copy()
        moved[:, column] = end
        shares[end, column] = question.share_of(box, moved)
    return shares


@dataclass(frozen=True, eq=False)
class VerifiedShare:
    """What independent parts say about a box.

    - `share`, `standard_error`: share of parts and responses (or of parts) that keep the limit, and
      its error over parts [1].
    - `bound`, `confidence`: lower bound of the true share with a one-sided confidence [1].
    - `n_parts`: parts drawn.
    - `by_response` (r,): share of the parts that keep the limit of each response [1].
    """

    share: float
    bound: float
    confidence: float
    n_parts: int
    by_response: RealArray
    standard_error: float


def verified_share(
    question: BoxQuestion,
    box: Box,
    *,
    seed: int,
    n_parts: int = VERIFICATION,
    confidence: float = CONFIDENCE,
) -> VerifiedShare:
    """Verify a box with independent random parts that no search has seen.

    - `seed`, `n_parts`: seed from 1 upwards and number of the parts.
    - `confidence`: confidence of the bound of `lower_bound` [1].
    """
    draws = generator(checked_seed(seed), "verification of a box")
    shares = np.empty(n_parts)
    kept = np.zeros(question.limit.size)
    for start in range(0, n_parts, _CHUNK):
        rows = slice(start, min(start + _CHUNK, n_parts))
        unit = draws.random((rows.stop - rows.start, question.n_draws))
        excess = question.excess(question.parts(box.ends, unit))
        shares[rows] = question.part_shares(excess)
        kept += (excess <= 0.0).sum(axis=0)
    return VerifiedShare(
        share=float(shares.mean()),
        bound=lower_bound(shares, confidence),
        confidence=confidence,
        n_parts=n_parts,
        by_response=kept / n_parts,
        standard_error=float(shares.std(ddof=1) / np.sqrt(n_parts)),
    )


def lower_bound(part_shares: RealArray, confidence: float) -> float:
    """Return a one-sided lower confidence bound on the mean of the shares of single parts [1].

    - `part_shares` (n,): shares of at least two independent parts; vehicles of one part are not
      independent [1].
    - `confidence`: confidence between 0 and 1 [1].

    The empirical Bernstein bound, ``mean - sqrt(2 V ln(2/δ) / n) - 7 ln(2/δ) / (3 (n - 1))`` with
    ``δ = 1 - confidence`` and the variance V of the shares (A. Maurer and M. Pontil, "Empirical
    Bernstein bounds and sample-variance penalization", COLT 2009, theorem 4). It holds for every
    number of parts and every distribution of their shares, also where one part or none misses.
    """
    n_parts = len(part_shares)
    if n_parts < 2 or not 0.0 < confidence < 1.0:
        raise InputError(
            f"a bound from {n_parts} parts with confidence {confidence:g}: take at least 2 parts "
            "and a confidence above 0 and below 1"
        )
    gap = bernstein_gap(float(part_shares.var(ddof=1)), n_parts, confidence)
    return max(0.0, float(part_shares.mean()) - gap)


def bernstein_gap(variance: float, n_parts: int, confidence: float) -> float:
    """Return how far the bound of `lower_bound` lies below the mean [1]."""
    tail = np.log(2.0 / (1.0 - confidence))
    return float(np.sqrt(2.0 * variance * tail / n_parts) + 7.0 * tail / (3.0 * (n_parts - 1)))
