"""A specification as a box of independent intervals,."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
import numpy.typing as npt
from scipy.special import ndtr
from scipy.stats import qmc

from deboom.arrays import BoolArray, RealArray, frozen_copy
from deboom.errors import InputError
from deboom.explore.scatter import TRUNCATION, truncated_normal
from deboom.explore.selection import Differentiable
from deboom.explore.space import checked_seed, generator, responses

CHUNK = 4096
"""Parts evaluated at a time: what is in memory."""


class PartLaw(Protocol):
    """How parts lie between the two ends of their intervals; variables are independent."""

    @property
    def name(self) -> str:
        """In words, for reports and records."""

    def places(self, unit: RealArray) -> RealArray:
        """Return places from 0 (lower end) to 1 (upper end) of uniform draws, both (n, k) [1]."""


@dataclass(frozen=True)
class UniformParts:
    """Parts lie anywhere in their interval, evenly: what an acceptance test allows at its worst."""

    name: str = "uniform in the box"

    def places(self, unit: RealArray) -> RealArray:
        """Return the draws themselves."""
        return unit


@dataclass(frozen=True)
class CutNormalParts:
    """Normal about the middle of their interval, whose ends lie three standard deviations off."""

    name: str = "normal, ends of the box at ±3 σ"

    def places(self, unit: RealArray) -> RealArray:
        """Return places of uniform draws, both of shape (n, k) [1]."""
        return 0.5 + truncated_normal(unit) / (2.0 * TRUNCATION)


@dataclass(frozen=True, eq=False)
class Box:
    """Product of intervals.

    Parameters
    ----------
    names : tuple of str, length k
        Variables.
    lower, upper : array, shape (k,)
        Ends of the intervals, both inside [units of the variables].

    Raises
    ------
    InputError
        Ends of another number, not finite or reversed.
    """

    names: tuple[str, ...]
    lower: RealArray
    upper: RealArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "names", tuple(self.names))
        for end in ("lower", "upper"):
            values = np.asarray(getattr(self, end), dtype=float)
            if values.shape != (len(self.names),) or not np.all(np.isfinite(values)):
                raise InputError(
                    f"a box of the {len(self.names)} variables {list(self.names)} needs one finite "
                    f"{end} end for each, not {values.tolist()}"
                )
            object.__setattr__(self, end, frozen_copy(values))
        for name, low, high in zip(self.names, self.lower, self.upper, strict=True):
            if low > high:
                raise InputError(
                    f"the interval of '{name}' has its ends reversed: {low:g} is above {high:g}"
                )

    @property
    def width(self) -> RealArray:
        """Of the intervals, shape (k,) [units of the variables]."""
        return np.asarray(self.upper - self.lower)

    @property
    def centre(self) -> RealArray:
        """Middle of the intervals, shape (k,) [units of the variables]."""
        return np.asarray(0.5 * (self.lower + self.upper))

    def at(self, places: RealArray) -> RealArray:
        """Return the designs at places from 0 to 1 of the intervals, both of shape (n, k)."""
        return np.asarray(self.lower + places * self.width)

    def contains(self, designs: RealArray) -> BoolArray:
        """Say which designs, shape (n, k), lie inside, shape (n,)."""
        return np.asarray(np.all((designs >= self.lower) & (designs <= self.upper), axis=1))


@dataclass(frozen=True, eq=False)
class BoxQuestion:
    """Which box is asked for.

    Parameters
    ----------
    response : Differentiable
        The model, such as the level in every vehicle.
    limit : array, shape (r,)
        Largest value that is kept, of each response [response_unit].
    share : float
        Of parts and responses that keep their limit at least, above 0 and below 1 [1].
    lower, upper : array, shape (k,)
        Where parts may lie at all; equal bounds hold a variable fixed [units of the variables].
    weight : array, shape (k,), optional
        What a per cent of tolerance costs, above 0; only ratios count. Default is 1 [1].
    together : bool
        A part counts as a whole: it must keep all its limits (worst vehicle). Otherwise every pair
        of part and response counts.
    law : PartLaw
        How parts lie in the box.

    Raises
    ------
    InputError
        A model without gradient; limits, bounds or weights of another number or value; a share
        outside 0 to 1; bounds that leave nothing free.

    Notes
    -----
    The box maximises ``Σ_k weight_k log(upper_k - lower_k)``. A value that could not be computed
    keeps no limit.
    """

    response: Differentiable
    limit: RealArray
    share: float
    lower: RealArray
    upper: RealArray
    weight: RealArray = field(default_factory=lambda: np.empty(0))
    together: bool = False
    law: PartLaw = field(default_factory=UniformParts)

    def __post_init__(self) -> None:
        names, outputs = self.response.variable_names, self.response.response_names
        if not hasattr(self.response, "gradient"):
            raise InputError(
                f"{type(self.response).__name__} offers no gradient: a box is found with one only"
            )
        if np.size(self.weight) == 0:
            object.__setattr__(self, "weight", np.ones(len(names)))
        for column, wanted in (
            ("limit", outputs),
            ("lower", names),
            ("upper", names),
            ("weight", names),
        ):
            values = np.asarray(getattr(self, column), dtype=float)
            if values.shape != (len(wanted),) or not np.all(np.isfinite(values)):
                raise InputError(
                    f"{column} of a box: give one finite number for each of {list(wanted)}, not "
                    f"{values.tolist()}"
                )
            object.__setattr__(self, column, frozen_copy(values))
        self._check_values(names)

    def _check_values(self, names: tuple[str, ...]) -> None:
        if not 0.0 < self.share < 1.0:
            raise InputError(
                f"a share of {self.share:g} of the parts: give one above 0 and below 1, such as "
                "0.95; that all parts keep a limit no sample can show"
            )
        for name, low, high, weight in zip(names, self.lower, self.upper, self.weight, strict=True):
            if low > high:
                raise InputError(f"the bounds of '{name}' are reversed: {low:g} is above {high:g}")
            if not weight > 0.0:
                raise InputError(
                    f"the weight of '{name}' is {weight:g}: give one above 0, or its interval "
                    "would shrink to nothing"
                )
        if not np.any(self.free):
            raise InputError("the bounds hold every variable fixed: a box needs one that is free")

    @property
    def names(self) -> tuple[str, ...]:
        """Of the variables."""
        return self.response.variable_names

    @property
    def free(self) -> BoolArray:
        """Variables that are not held fixed, shape (k,)."""
        return np.asarray(self.upper > self.lower)

    @property
    def bounds(self) -> Box:
        """The largest box that may be asked for."""
        return Box(self.names, self.lower, self.upper)

    @property
    def least_kept(self) -> int:
        """How many responses of one part must keep their limit for the share to be kept."""
        n_responses = self.limit.size
        least = int(np.ceil(self.share * n_responses - 1e-12))
        return n_responses if self.together else least

    def lowered(self, step: float) -> BoxQuestion:
        """Return the same question with all limits lowered by a step [response_unit]."""
        return replace(self, limit=self.limit - step)

    def parts(self, box: Box, unit: RealArray) -> RealArray:
        """Return the parts of a box that uniform draws, shape (n, k), stand for, shape (n, k)."""
        return box.at(self.law.places(unit))

    def excess(self, designs: RealArray) -> RealArray:
        """Return how far designs, (n, k), are above each limit, (n, r) [response_unit]."""
        found = np.empty((len(designs), self.limit.size))
        for start in range(0, len(designs), CHUNK):
            rows = slice(start, start + CHUNK)
            found[rows] = responses(self.response, designs[rows]) - self.limit
        return np.where(np.isnan(found), np.inf, found)

    def part_shares(self, excess: RealArray) -> RealArray:
        """Return the share of its limits that each part keeps, shape (n,), of its excess (n, r).

        With `together` it is 1 or 0.
        """
        kept = excess <= 0.0
        return np.asarray(kept.all(axis=1) if self.together else kept.mean(axis=1), dtype=float)

    def share_of(self, box: Box, unit: RealArray) -> float:
        """Return the share over the parts that uniform draws, shape (n, k), stand for [1]."""
        return float(self.part_shares(self.excess(self.parts(box, unit))).mean())

    def log_volume(self, box: Box) -> float:
        """Return ``Σ weight log width`` over the free variables."""
        return float(self.weight[self.free] @ np.log(box.width[self.free]))


def checked_point(question: BoxQuestion, point: npt.ArrayLike) -> RealArray:
    """Return a design inside the bounds of a question, shape (k,), or refuse it.

    Raises
    ------
    InputError
        Another shape, or a value outside the bounds.
    """
    values = np.asarray(point, dtype=float)
    if values.shape != question.lower.shape:
        raise InputError(
            f"a design of shape {values.shape} for the variables {list(question.names)}: give one "
            "number each"
        )
    inside = (values >= question.lower) & (values <= question.upper)
    if not np.all(inside):
        column = int(np.argmin(inside))
        raise InputError(
            f"'{question.names[column]}' of the design is {values[column]:g}, outside the bounds "
            f"{question.lower[column]:g} to {question.upper[column]:g}: widen them"
        )
    return values


CONFIDENCE = 0.95
"""Of the one-sided bound on a verified share [1]."""
VERIFICATION = 131072
"""Parts of a verification."""
FAR = 5.0
"""Parts that lie farther from the limit, in softnesses, have no slope worth a gradient [1]."""
GRADIENTS = 512
"""Parts whose gradients are in memory at a time."""


def box_sample(n_variables: int, n_parts: int, *, seed: int, purpose: str) -> RealArray:
    """Return scrambled Sobol points in the unit cube, shared by all boxes, shape (n_parts, k) [1].

    Parameters
    ----------
    n_variables, n_parts : int
        A power of two of parts keeps the balance of the points.
    seed : int
        From 1 upwards.
    purpose : str
        Samples of different purposes are independent under one seed.
    """
    points = qmc.Sobol(n_variables, rng=generator(seed, purpose))
    return np.asarray(points.random_base2(n_parts.bit_length() - 1))


def typical_spread(question: BoxQuestion, box: Box, unit: RealArray) -> float:
    """Return the standard deviation of the responses over the parts of a box [response_unit].

    Root mean square over the responses; parts that could not be computed are left out.
    """
    excess = question.excess(question.parts(box, unit))
    known = excess[np.isfinite(excess).all(axis=1)]
    spread = float(np.sqrt(known.var(axis=0).mean())) if len(known) > 1 else 0.0
    return spread if spread > 0.0 else 1.0


def smooth_share(
    question: BoxQuestion, box: Box, unit: RealArray, softness: float
) -> tuple[float, RealArray]:
    """Return a smoothed share and its derivatives by the ends of the box.

    Parameters
    ----------
    question : BoxQuestion
    box : Box
        It may be larger than the bounds.
    unit : array, shape (n, k)
        Uniform draws that stand for the parts [1].
    softness : float
        Standard deviation of the normal distribution that the step from kept to missed is smoothed
        with, above 0 [response_unit].

    Returns
    -------
    share : float
        Mean of ``Φ(-excess / softness)`` over parts and responses [1].
    gradient : array, shape (2, k)
        Its derivatives by the lower and by the upper ends [1 / units of the variables].

    Notes
    -----
    A part is ``l + t (u - l)`` with its place t from the shared draws, thus ``∂x/∂l = 1 - t`` and
    ``∂x/∂u = t``: the model's gradient is all that is needed, and of parts near the limit only.
    With ``question.together`` the excess is the largest of the part.
    """
    places = question.law.places(unit)
    designs = box.at(places)
    excess = question.excess(designs)
    if question.together:
        worst = excess.argmax(axis=1)
        counted = np.zeros(excess.shape, dtype=bool)
        counted[np.arange(len(excess)), worst] = True
    else:
        counted = np.ones(excess.shape, dtype=bool)
    scaled = excess / softness
    kept = np.where(counted, ndtr(-scaled), 0.0)
    slope = np.where(counted & (np.abs(scaled) < FAR), -np.exp(-0.5 * scaled**2), 0.0)
    slope /= np.sqrt(2.0 * np.pi) * softness * counted.sum()
    by_end = np.zeros((2, designs.shape[1]))
    matters = np.flatnonzero(slope.any(axis=1))
    for start in range(0, len(matters), GRADIENTS):
        rows = matters[start : start + GRADIENTS]
        gradient = np.nan_to_num(question.response.gradient(designs[rows]), posinf=0.0, neginf=0.0)
        by_part = np.einsum("nr,nrk->nk", slope[rows], gradient)
        by_end[0] += np.einsum("nk,nk->k", by_part, 1.0 - places[rows])
        by_end[1] += np.einsum("nk,nk->k", by_part, places[rows])
    return float(kept.sum() / counted.sum()), by_end


@dataclass(frozen=True, eq=False)
class VerifiedShare:
    """What independent parts say about a box.

    Parameters
    ----------
    share : float
        Of parts and responses (or of parts) that keep the limit [1].
    bound : float
        The true share is above it with the stated confidence [1].
    confidence : float
        One-sided [1].
    n_parts : int
        Parts drawn.
    by_response : array, shape (r,)
        Share of the parts that keep the limit of each response [1].
    standard_error : float
        Of the share, over parts [1].
    """

    share: float
    bound: float
    confidence: float
    n_parts: int
    by_response: RealArray
    standard_error: float


def lower_bound(part_shares: RealArray, confidence: float) -> float:
    """Return a one-sided lower confidence bound on the mean of the shares of single parts.

    Parameters
    ----------
    part_shares : array, shape (n,)
        Of independent parts, 0 to 1. The vehicles of one part are not independent, therefore each
        part counts once [1].
    confidence : float
        Above 0 and below 1 [1].

    Returns
    -------
    float
        At least 0 [1].

    Raises
    ------
    InputError
        Fewer than two parts, or a confidence outside 0 to 1.

    Notes
    -----
    The empirical Bernstein bound, ``mean - sqrt(2 V ln(2/δ) / n) - 7 ln(2/δ) / (3 (n - 1))`` with
    ``δ = 1 - confidence`` and the variance V of the shares (A. Maurer and M. Pontil, "Empirical
    Bernstein bounds and sample-variance penalization", COLT 2009, theorem 4). It holds for every
    number of parts and every distribution of their shares, one as well as none that misses.
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


def verified_share(
    question: BoxQuestion,
    box: Box,
    *,
    seed: int,
    n_parts: int = VERIFICATION,
    confidence: float = CONFIDENCE,
) -> VerifiedShare:
    """Verify a box with independent random parts that no search has seen.

    Parameters
    ----------
    question : BoxQuestion
    box : Box
    seed : int
        From 1 upwards; the draws are those of the purpose "verification of a box".
    n_parts : int
    confidence : float
        Of the bound [1].

    Raises
    ------
    InputError
        See `lower_bound`; seed 0.
    """
    draws = generator(checked_seed(seed), "verification of a box")
    shares = np.empty(n_parts)
    kept = np.zeros(question.limit.size)
    for start in range(0, n_parts, CHUNK):
        rows = slice(start, min(start + CHUNK, n_parts))
        unit = draws.random((rows.stop - rows.start, len(question.names)))
        excess = question.excess(question.parts(box, unit))
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


def face_shares(question: BoxQuestion, box: Box, unit: RealArray) -> RealArray:
    """Return the share of the parts that lie in each face of the box, shape (2, k) [1].

    Parameters
    ----------
    question : BoxQuestion
    box : Box
    unit : array, shape (n, k)
        Uniform draws that stand for the parts [1].

    Returns
    -------
    array, shape (2, k)
        First row: parts exactly at the lower end of one variable; second row: at the upper end.

    Notes
    -----
    Where parts lie evenly, ``∂share/∂u_k = (share of the upper face - share) / (u_k - l_k)``, by
    Leibniz' rule, without any smoothing. In the largest box each face that is not a bound of the
    question therefore has a share that is lower than that of the box by the same multiple of the
    weight: the check of an optimum that needs no gradient of the model.
    """
    found = np.empty((2, len(question.names)))
    places = question.law.places(unit)
    for column in range(len(question.names)):
        for end in (0, 1):
            moved = places.copy()
            moved[:, column] = end
            found[end, column] = question.part_shares(question.excess(box.at(moved))).mean()
    return found
