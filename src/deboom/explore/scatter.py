"""Manufacturing scatter: draws, what parts have in common, and what measured pieces say.

All draws are standard normal, cut at three standard deviations by the inverse distribution
function: no draw is thrown away and no heap forms at the cut, which lowers the standard deviation
of the draws to 0.9866. Variables of another distribution follow from them by their quantiles.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
import numpy.typing as npt
from scipy.linalg import block_diag
from scipy.special import ndtr, ndtri
from scipy.stats import chi2, invwishart, norm, shapiro

from deboom.arrays import RealArray, checked
from deboom.errors import InputError
from deboom.explore.choices import Distribution
from deboom.explore.space import LARGEST_UNCUT, DesignSpace, checked_seed, generator, sobol_points

FEWEST_FOR_LAW, NOT_NORMAL = 8, 1e-3
"""Pieces that say something about a law, and the p-value below which it is not the normal one."""
TRUNCATION = 3.0
"""Largest size of a draw, in standard deviations [1]."""


@checked(values="t m")
class ToleranceSample:
    """One set of draws that all designs share ("common random numbers").

    Two designs then differ by what they are, not by what they drew: a search cannot win by luck.

    - `values` (n_samples, m): at least two standard-normal draws [1].
    - `kind`, `seed`: kind of draws in words, for reports, and their seed from 1 upwards.
    """

    values: RealArray
    kind: str
    seed: int
    warning = ""

    def __post_init__(self) -> None:
        checked_seed(self.seed)
        _check_size(self.n_variables, self.n_samples)

    @property
    def n_samples(self) -> int:
        """Draws per design."""
        return len(self.values)

    @property
    def n_variables(self) -> int:
        """Number m of independent draws per part."""
        return int(self.values.shape[1])

    def normals(self, design: RealArray) -> RealArray:  # noqa: ARG002
        """Return the draws, shape (n_samples, m) [1], the same for every design."""
        return self.values


@dataclass(frozen=True)
class FreshGaussianSampler:
    """Gaussian draws of its own for every design: the literal reading of the thesis.

    The draws follow from the seed and the design's own bytes alone, so that neither the order of
    the designs nor the worker that computes them matters.

    - `n_variables`: number m of independent draws per part.
    - `n_samples`: draws per design, at least 2.
    - `seed`: seed from 1 upwards.
    """

    n_variables: int
    n_samples: int = 100
    seed: int = field(kw_only=True)
    kind = "gaussian, fresh for every design"
    warning = (
        "Every design had tolerance draws of its own. A search then prefers designs that drew "
        "luckily: on problems with a known front it keeps 12 to 92 % of the hypervolume and "
        "under-reports the standard deviation by 13 to 18 %. Shared draws avoid this."
    )

    def __post_init__(self) -> None:
        checked_seed(self.seed)
        _check_size(self.n_variables, self.n_samples)

    def normals(self, design: RealArray) -> RealArray:
        """Return the draws for one design (k,), shape (n_samples, m) [1]."""
        words = (np.asarray(design) + 0.0).astype("<f8").view("<u4")  # + 0.0 turns -0.0 into 0.0
        draws = generator(self.seed, "search sample", *words.tolist())
        return truncated_normal(draws.random((self.n_samples, self.n_variables)))


ToleranceSampler: TypeAlias = ToleranceSample | FreshGaussianSampler
"""Source of the draws that give a design its scatter."""


def sobol_sample(
    n_variables: int, n_samples: int = 128, *, seed: int, purpose: str = "search sample"
) -> ToleranceSample:
    """Return scrambled Sobol draws, (n_samples, n_variables), shared by all designs: the default.

    Samples of different purposes are independent under one seed.

    - raises InputError: a count that is not a power of two, no variable, seed 0.
    """
    _check_size(n_variables, n_samples)
    points = sobol_points(n_variables, n_samples, seed=seed, purpose=purpose)
    return ToleranceSample(truncated_normal(points), "scrambled Sobol, shared", seed)


def gaussian_sample(n_variables: int, n_samples: int = 100, *, seed: int) -> ToleranceSample:
    """Return plain gaussian draws, shared by all designs; parameters as of `sobol_sample`."""
    _check_size(n_variables, n_samples)
    draws = generator(seed, "search sample").random((n_samples, n_variables))
    return ToleranceSample(truncated_normal(draws), "gaussian, shared", seed)


def cut_normal_moments() -> tuple[float, float]:
    """Return the second and fourth moment of the normal distribution cut at ±3 [1]."""
    inside = 1.0 - 2.0 * ndtr(-TRUNCATION)
    edge = 2.0 * TRUNCATION * np.exp(-(TRUNCATION**2) / 2.0) / np.sqrt(2.0 * np.pi) / inside
    second = 1.0 - edge
    return float(second), float(3.0 * second - TRUNCATION**2 * edge)


def truncated_normal(uniform: RealArray) -> RealArray:
    """Map uniform draws in [0, 1) to the standard normal distribution cut at ±3."""
    below = ndtr(-TRUNCATION)
    return np.asarray(ndtri(below + uniform * (1.0 - 2.0 * below)))


def made_terms(space: DesignSpace, scatter: RealArray) -> tuple[RealArray, RealArray]:
    """Return what the scatter multiplies designs by, and what it adds to them.

    Parameters
    ----------
    space : DesignSpace
        Tolerances and distributions of its k variables.
    scatter : array, shape (n, k)
        Normal draws, cut at ±3, or what parts have in common of them [1].

    Returns
    -------
    factor, added : array, shape (n, k)
        A design x is made as ``x factor + added`` [1, units of the variables].

    Notes
    -----
    With ``σ = tolerance/3`` a variable is made as ``x (1 + σ s)``, ``x + σ s`` where its tolerance
    is absolute, or ``x exp(σ s)`` where its logarithm scatters; ``s`` is the draw, or the quantile
    of the variable's distribution at the draw's probability. Variables with correlated draws are
    then joined by the Gaussian copula, and a draw beyond ±3 by several parts counts as ±3.
    """
    sigma, shaped = space.relative_sigma, np.array(scatter)
    for column, distribution in enumerate(space.distribution):
        if distribution == Distribution.uniform:
            shaped[:, column] = TRUNCATION * (2.0 * _probability(scatter[:, column]) - 1.0)
        elif not Distribution(distribution).is_cut:
            # a Sobol point may be 0, whose quantile is not finite
            uncut = np.asarray(ndtri(_probability(scatter[:, column])))
            shaped[:, column] = np.clip(uncut, -LARGEST_UNCUT, LARGEST_UNCUT)
    logarithmic = [Distribution(each).is_logarithmic for each in space.distribution]
    factor = np.where(logarithmic, np.exp(sigma * shaped), 1.0 + sigma * shaped)
    return (
        np.where(space.absolute, 1.0, factor),
        np.where(space.absolute, sigma * shaped, 0.0),
    )


def _probability(cut_normal: RealArray) -> RealArray:
    """Return the distribution function of the normal distribution cut at ±3; 0 or 1 beyond [1]."""
    below = ndtr(-TRUNCATION)
    return np.asarray(np.clip((ndtr(cut_normal) - below) / (1.0 - 2.0 * below), 0.0, 1.0))


def _check_size(n_variables: int, n_samples: int) -> None:
    if n_variables < 1 or n_samples < 2:
        raise InputError(
            f"a tolerance sample of {n_samples} draws for {n_variables} variables cannot give a "
            "standard deviation: take at least 2 draws for at least 1 variable"
        )


@checked(loadings="k m")
class ToleranceStructure:
    """A linear map from independent standard-normal draws to the scatter of the variables.

    Draws are cut at three standard deviations one by one. A variable that is made of several may go
    beyond three standard deviations of its own, in a few cases in a thousand.

    - `names`: design variables.
    - `loadings` (k, m): scatter of each variable per draw, in its own standard deviations [1]. A
      row has length 1, or less where the variable is the mean of several pieces, which even out.
    - `draw_names`: meaning of each draw, such as a part or a batch.
    """

    names: tuple[str, ...]
    loadings: RealArray
    draw_names: tuple[str, ...]

    @property
    def n_draws(self) -> int:
        """Number m of independent draws per part."""
        return int(self.loadings.shape[1])

    @property
    def largest(self) -> RealArray:
        """Reach of each variable when all draws are at 1, shape (k,) [1]."""
        return np.asarray(np.abs(self.loadings).sum(axis=1))

    def scatter(self, draws: RealArray) -> RealArray:
        """Return the scatter of the variables, shape (n, k), from draws, shape (n, m) [1]."""
        return np.asarray(np.einsum("tm,km->tk", draws, self.loadings))


@dataclass(frozen=True)
class PartNumber:
    """A part number: where its pieces sit, and what their scatter has in common.

    - `name`, `places`: name such as ``bush 4711``, and the mounts that take pieces of one batch of
      it.
    - `pieces`: pieces behind the variables of one place, such as 2 for a left and a right one: a
      variable is then the mean of its pieces.
    - `hardness_share`, `batch_share`: share of the variance that all axes of a piece, and that all
      pieces of a batch have in common, 0 to 1 [1].

    Correlations are products: ``h`` between two axes of a piece, ``b`` between one axis of two
    pieces, ``b h`` between two axes of two pieces. Hardness (compound and cure) is common to all
    axes, geometry is each axis's own; of both, the batch settles one part and the piece the rest.
    """

    name: str
    places: tuple[str, ...]
    pieces: int = 1
    hardness_share: float = 0.0
    batch_share: float = 0.0


def part_structure(
    names: Sequence[str],
    parts: Sequence[PartNumber],
    hardness_share: float = 0.0,
    batch_share: float = 0.0,
) -> ToleranceStructure:
    """Return how variables, ``<place> <axis>``, scatter that are directions of parts.

    A place of none of the parts has a part number of its own, of one piece, with the given shares;
    of a single piece nobody can tell what comes from its batch.

    - raises InputError: a place that no variable has, or that takes two part numbers.

    Examples
    --------
    >>> names = ("TSM x", "Du x", "Du z")
    >>> both = PartNumber("bush", ("Du",), pieces=2, hardness_share=0.5, batch_share=0.2)
    >>> structure = part_structure(names, [both])
    >>> (structure.loadings @ structure.loadings.T).round(3)
    array([[1. , 0. , 0. ],
           [0. , 0.6, 0.3],
           [0. , 0.3, 0.6]])
    """
    places = tuple(dict.fromkeys(_place(name) for name in names))
    taken: dict[str, str] = {}
    for part in parts:
        for place in part.places:
            if place not in places:
                raise InputError(
                    f"part number '{part.name}' sits at '{place}', which no variable has: use "
                    f"{', '.join(places)}"
                )
            if place in taken:
                raise InputError(
                    f"place '{place}' takes the part numbers '{taken[place]}' and '{part.name}': "
                    "give it one"
                )
            taken[place] = part.name
    alone = [
        PartNumber(place, (place,), 1, hardness_share, batch_share)
        for place in places
        if place not in taken
    ]
    order: list[str] = []
    draw_names: list[str] = []
    blocks = []
    for part in (*parts, *alone):
        members = [n for place in part.places for n in names if _place(n) == place]
        draws = _draws_of(part, members)
        order += members
        blocks.append(np.column_stack(list(draws.values())))
        draw_names += draws
    loadings = block_diag(*blocks)[[order.index(name) for name in names]]
    return ToleranceStructure(tuple(names), loadings, tuple(draw_names))


def _draws_of(part: PartNumber, names: Sequence[str]) -> dict[str, RealArray]:
    """Return the loadings (k,) of each draw of a part number that has a share of the variance."""
    n_pieces = part.pieces * len(part.places)
    batch = part.batch_share if n_pieces > 1 else 0.0
    sides = [f" {side}" for side in range(1, part.pieces + 1)] if part.pieces > 1 else [""]
    axes = tuple(dict.fromkeys(_axis(name) for name in names))
    of_batch = np.sqrt(batch)
    of_piece = np.sqrt(1.0 - batch) / part.pieces
    hardness, geometry = np.sqrt(part.hardness_share), np.sqrt(1.0 - part.hardness_share)

    def on(marked: Sequence[bool], loading: float) -> RealArray:
        return np.where(marked, loading, 0.0)

    at = {place: [_place(name) == place for name in names] for place in part.places}
    pieces = [(place, place + side) for place in part.places for side in sides]
    draws = {f"part {part.name}, batch": np.full(len(names), of_batch * hardness)}
    for axis in axes:
        along = [_axis(name) == axis for name in names]
        draws[f"part {part.name}, {axis} of the batch"] = on(along, of_batch * geometry)
    for place, piece in pieces:
        draws[f"part {piece}, hardness"] = on(at[place], of_piece * hardness)
    for place, piece in pieces:
        for name in (name for name in names if _place(name) == place):
            only = [other == name for other in names]
            draws[f"{piece} {_axis(name)}"] = on(only, of_piece * geometry)
    return {name: loading for name, loading in draws.items() if loading.any()}


def _place(name: str) -> str:
    return name.rpartition(" ")[0]


def _axis(name: str) -> str:
    return name.rpartition(" ")[2]


@dataclass(frozen=True)
class Capability:
    """Capability of one characteristic of a process.

    - `n`: number of measured pieces.
    - `mean`, `sigma`: mean and standard deviation of the pieces, with n − 1 [unit of the interval].
    - `cp`, `cp_bound`: width of the interval over six standard deviations, and its one-sided lower
      bound [1].
    - `cpk`, `cpk_bound`: the same with the distance of the mean to the nearer end over three;
      negative outside [1].
    - `expected_outside`, `confidence`: share of a normal process outside of the interval, and
      confidence of the bounds [1].
    - `normality`: p-value of the test of Shapiro and Wilk, nan of fewer than 8 pieces [1].
    """

    n: int
    mean: float
    sigma: float
    cp: float
    cp_bound: float
    cpk: float
    cpk_bound: float
    expected_outside: float
    confidence: float
    normality: float = float("nan")

    @property
    def normal(self) -> bool:
        """False where the pieces contradict a normal process, on which bounds and shares rest."""
        return not self.normality < NOT_NORMAL


def capability(
    values: npt.ArrayLike, lower: float, upper: float, confidence: float = 0.95
) -> Capability:
    """Return the capability of a process from two pieces or more, with one-sided lower bounds.

    Raises
    ------
    InputError
        Values that are equal or not finite, an interval without width, a confidence outside 0.5 to
        1.

    Notes
    -----
    ``Cp = (upper − lower)/6σ``, ``Cpk = min(upper − mean, mean − lower)/3σ``. Lower bounds:
    ``Cp √(χ²_{1−c, n−1}/(n − 1))``, exact for a normal process, and
    ``Cpk − z_c √(1/9n + Cpk²/2(n − 1))``, Bissell, Applied Statistics 39 (1990) 331, an
    approximation from about 20 pieces upwards. A process that is not normal has other shares
    outside: two cavities of a mould, with little scatter each, have none where a normal law has
    many.
    """
    sample = np.asarray(values, dtype=float)
    if sample.ndim != 1 or sample.size < 2 or not np.all(np.isfinite(sample)):
        raise InputError("a capability needs at least 2 finite values in one row")
    if not lower < upper:
        raise InputError(f"an interval from {lower:g} to {upper:g} has no width")
    if not 0.5 <= confidence < 1.0:
        raise InputError(f"a confidence of {confidence:g}: give one from 0.5 to below 1")
    n, mean, sigma = sample.size, float(sample.mean()), float(sample.std(ddof=1))
    if not sigma > 0.0:
        raise InputError(f"all {n} pieces have the value {mean:g}: look for the copied measurement")
    cp = (upper - lower) / (6.0 * sigma)
    cpk = min(upper - mean, mean - lower) / (3.0 * sigma)
    spread = np.sqrt(1.0 / (9.0 * n) + cpk**2 / (2.0 * (n - 1)))
    outside = norm.cdf(lower, mean, sigma) + norm.sf(upper, mean, sigma)
    return Capability(
        n=n,
        mean=mean,
        sigma=sigma,
        cp=cp,
        cp_bound=float(cp * np.sqrt(chi2.ppf(1.0 - confidence, n - 1) / (n - 1))),
        cpk=cpk,
        cpk_bound=float(cpk - norm.ppf(confidence) * spread),
        expected_outside=float(outside),
        confidence=confidence,
        normality=float(shapiro(sample).pvalue) if n >= FEWEST_FOR_LAW else float("nan"),
    )


def fewest_pieces(n_axes: int) -> int:
    """Return how many measured pieces a prediction of so many axes needs at least."""
    return n_axes + 2


def predicted_pieces(
    measured: npt.ArrayLike, n_processes: int, n_pieces: int, *, seed: int
) -> RealArray:
    """Draw pieces of processes that the measured pieces, (n, k), may have come from.

    There are `n_processes` means and covariances with `n_pieces` each: (n_processes, n_pieces, k).

    - raises InputError: fewer than `fewest_pieces`, pieces that do not scatter in some combination
      of axes, seed 0.

    Normal scatter with unknown mean and covariance, Jeffreys' prior: ``Σ ~ W⁻¹(S, n − 1)``,
    ``µ | Σ ~ N(x̄, Σ/n)`` with S the sum of squares about the mean (Gelman et al., "Bayesian Data
    Analysis", 3rd ed., section 3.6). Few pieces give wide tails, as they should.
    """
    pieces = np.asarray(measured, dtype=float)
    n, k = pieces.shape
    if n < fewest_pieces(k):
        raise InputError(
            f"{n} pieces with {k} axes say too little of the next ones: measure at least "
            f"{fewest_pieces(k)}"
        )
    centred = pieces - pieces.mean(axis=0)
    squares = centred.T @ centred
    if np.linalg.matrix_rank(squares, hermitian=True) < k:
        raise InputError(f"{n} pieces do not scatter in every axis: look for copied measurements")
    random = generator(seed, "predicted pieces")
    covariance = invwishart(df=n - 1, scale=squares).rvs(n_processes, random_state=random)
    roots = np.linalg.cholesky(np.reshape(covariance, (n_processes, k, k)))
    means = pieces.mean(axis=0) + np.einsum(
        "pij,pj->pi", roots, random.standard_normal((n_processes, k)) / np.sqrt(n)
    )
    normals = random.standard_normal((n_processes, n_pieces, k))
    return np.asarray(means[:, np.newaxis] + np.einsum("pij,pnj->pni", roots, normals))
