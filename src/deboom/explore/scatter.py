"""Manufacturing scatter: draws, what parts have in common,."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
import numpy.typing as npt
from scipy.linalg import block_diag
from scipy.special import ndtr, ndtri
from scipy.stats import chi2, invwishart, norm, qmc

from deboom.arrays import RealArray, frozen_copy
from deboom.errors import InputError
from deboom.explore.space import checked_seed, generator

TRUNCATION = 3.0
"""Draws lie within plus and minus this many standard deviations [1]."""


class ToleranceSampler(Protocol):
    """What gives a design its scatter."""

    @property
    def kind(self) -> str:
        """In words, for reports and run records."""

    @property
    def seed(self) -> int:
        """Of the draws."""

    @property
    def n_samples(self) -> int:
        """Draws per design."""

    @property
    def n_variables(self) -> int:
        """Columns of the draws."""

    @property
    def warning(self) -> str:
        """What a reader of the results must know; empty when there is nothing."""

    def normals(self, design: RealArray) -> RealArray:
        """Return the draws for one design (k,), shape (n_samples, k) [1]."""


@dataclass(frozen=True, eq=False)
class ToleranceSample:
    """One set of draws that all designs share ("common random numbers").

    Two designs then differ by what they are, not by what they drew: a search cannot win by luck.

    Parameters
    ----------
    values : array, shape (n_samples, k)
        Standard-normal draws [1].
    kind : str
        In words.
    seed : int
        From 1 upwards.

    Raises
    ------
    InputError
        Fewer than two draws, a value that is not finite, seed 0.
    """

    values: RealArray
    kind: str
    seed: int

    def __post_init__(self) -> None:
        checked_seed(self.seed)
        values = np.asarray(self.values, dtype=float)
        if values.ndim != 2 or len(values) < 2 or not np.all(np.isfinite(values)):
            raise InputError(
                f"a tolerance sample of shape {values.shape} cannot give a standard deviation: "
                "bring at least two rows of finite draws, one column per variable"
            )
        object.__setattr__(self, "values", frozen_copy(values))

    @property
    def n_samples(self) -> int:
        """Draws per design."""
        return len(self.values)

    @property
    def n_variables(self) -> int:
        """Columns of the draws."""
        return int(self.values.shape[1])

    @property
    def warning(self) -> str:
        """Nothing to warn of."""
        return ""

    def normals(self, design: RealArray) -> RealArray:  # noqa: ARG002
        """Return the shared draws, whatever the design."""
        return self.values


@dataclass(frozen=True)
class FreshGaussianSampler:
    """Gaussian draws of its own for every design: the literal reading of the thesis.

    The draws follow from the seed and from the design's own bytes alone, so that neither the order
    of the designs nor the worker that has them can matter.

    Parameters
    ----------
    n_variables : int
        Columns k of the draws.
    n_samples : int
        Draws per design, at least 2.
    seed : int
        From 1 upwards.

    Raises
    ------
    InputError
        Fewer than two draws, no variable, seed 0.
    """

    n_variables: int
    n_samples: int = 100
    seed: int = field(kw_only=True)

    def __post_init__(self) -> None:
        checked_seed(self.seed)
        _check_size(self.n_variables, self.n_samples)

    @property
    def kind(self) -> str:
        """In words."""
        return "gaussian, fresh for every design"

    @property
    def warning(self) -> str:
        """What fresh draws do to a search."""
        return (
            "Every design had tolerance draws of its own. A search then prefers designs that drew "
            "luckily: on problems with a known front it keeps 12 to 92 % of the hypervolume and "
            "under-reports the standard deviation by 13 to 18 %. Shared draws avoid this."
        )

    def normals(self, design: RealArray) -> RealArray:
        """Return the draws for one design (k,), shape (n_samples, k) [1]."""
        words = (np.asarray(design) + 0.0).astype("<f8").view("<u4")  # + 0.0 turns -0.0 into 0.0
        draws = generator(self.seed, "search sample", *words.tolist())
        return truncated_normal(draws.random((self.n_samples, self.n_variables)))


def sobol_sample(
    n_variables: int, n_samples: int = 128, *, seed: int, purpose: str = "search sample"
) -> ToleranceSample:
    """Return scrambled Sobol points, shared by all designs: the default.

    Parameters
    ----------
    n_variables : int
        Columns k of the draws.
    n_samples : int
        A power of two; other counts lose the balance of the points, 100 half of their gain.
    seed : int
        From 1 upwards.
    purpose : str
        Samples of different purposes are independent under one seed.

    Returns
    -------
    ToleranceSample
        Standard normal, cut at ±3.

    Raises
    ------
    InputError
        A count that is not a power of two, no variable, seed 0.
    """
    _check_size(n_variables, n_samples)
    exponent = n_samples.bit_length() - 1
    if n_samples != 2**exponent:
        raise InputError(
            f"{n_samples} Sobol points are not a power of two and would be unbalanced: "
            f"take {2**exponent} or {2 ** (exponent + 1)}"
        )
    points = qmc.Sobol(n_variables, rng=generator(seed, purpose)).random_base2(exponent)
    return ToleranceSample(truncated_normal(points), "scrambled Sobol, shared", seed)


def gaussian_sample(
    n_variables: int, n_samples: int = 100, *, seed: int, purpose: str = "search sample"
) -> ToleranceSample:
    """Return plain gaussian draws, shared by all designs.

    Parameters and exceptions as in `sobol_sample`; any count from 2 upwards.

    Returns
    -------
    ToleranceSample
        Standard normal, cut at ±3.
    """
    _check_size(n_variables, n_samples)
    draws = generator(seed, purpose).random((n_samples, n_variables))
    return ToleranceSample(truncated_normal(draws), "gaussian, shared", seed)


def cut_normal_moments() -> tuple[float, float]:
    """Return the second and fourth moment of the normal distribution cut at ±3 [1]."""
    inside = 1.0 - 2.0 * ndtr(-TRUNCATION)
    edge = 2.0 * TRUNCATION * np.exp(-(TRUNCATION**2) / 2.0) / np.sqrt(2.0 * np.pi) / inside
    second = 1.0 - edge
    return float(second), float(3.0 * second - TRUNCATION**2 * edge)


def _check_size(n_variables: int, n_samples: int) -> None:
    if n_variables < 1 or n_samples < 2:
        raise InputError(
            f"a tolerance sample of {n_samples} draws for {n_variables} variables cannot give a "
            "standard deviation: take at least 2 draws for at least 1 variable"
        )


def truncated_normal(uniform: RealArray) -> RealArray:
    """Map uniform draws in [0, 1) to the standard normal distribution cut at ±3."""
    below = ndtr(-TRUNCATION)
    return np.asarray(ndtri(below + uniform * (1.0 - 2.0 * below)))


@dataclass(frozen=True, eq=False)
class ToleranceStructure:
    """A linear map from independent standard-normal draws to the scatter of the variables.

    Parameters
    ----------
    names : tuple of str, length k
        The design variables.
    loadings : array, shape (k, m)
        Scatter of the variables is ``loadings @ draws``, in standard deviations of each [1]. A row
        has length 1, so that the variable keeps its own tolerance, or less where it is the mean of
        several pieces, which even out.
    draw_names : tuple of str, length m
        What each draw stands for, such as a part or a batch.

    Raises
    ------
    InputError
        Another shape, a value that is not finite, or a row of length 0 or longer than 1.

    Notes
    -----
    Draws are cut at three standard deviations one by one. A variable that is made of several may
    go beyond three standard deviations of its own, in a few cases in a thousand.
    """

    names: tuple[str, ...]
    loadings: RealArray
    draw_names: tuple[str, ...]

    def __post_init__(self) -> None:
        loadings = np.asarray(self.loadings, dtype=float)
        if loadings.shape != (len(self.names), len(self.draw_names)):
            raise InputError(
                f"loadings of shape {loadings.shape} for {len(self.names)} variables and "
                f"{len(self.draw_names)} draws: give one row per variable and one column per draw"
            )
        length = np.sqrt(np.einsum("km,km->k", loadings, loadings))
        for name, size in zip(self.names, length, strict=True):
            if not 0.0 < size < 1.0 + 1e-9:
                raise InputError(
                    f"the loadings of '{name}' have the length {size:g}: scale them to 1, or the "
                    "variable's tolerance would grow"
                )
        object.__setattr__(self, "loadings", frozen_copy(loadings))

    @property
    def n_draws(self) -> int:
        """Number m of independent draws per part."""
        return int(self.loadings.shape[1])

    @property
    def largest(self) -> RealArray:
        """How far each variable can go for every unit that all draws can go, shape (k,) [1]."""
        return np.asarray(np.abs(self.loadings).sum(axis=1))

    def scatter(self, draws: RealArray) -> RealArray:
        """Return the scatter of the variables, shape (n, k), from draws, shape (n, m) [1]."""
        return np.asarray(np.einsum("tm,km->tk", draws, self.loadings))


def shared_parts(names: Sequence[str], parts: Mapping[str, Sequence[str]]) -> ToleranceStructure:
    """Return the structure of variables that share part numbers.

    Parameters
    ----------
    names : sequence of str
        All variables.
    parts : mapping of str to sequence of str
        Part → the variables that scatter as one, such as one bush used at two mounts. Variables
        of no part scatter on their own.

    Raises
    ------
    InputError
        An unknown variable, or one that belongs to two parts.
    """
    _check_groups(names, parts)
    of = {name: f"part {part}" for part, members in parts.items() for name in members}
    draws = list(dict.fromkeys(of.get(name, name) for name in names))
    loadings = np.zeros((len(names), len(draws)))
    for row, name in enumerate(names):
        loadings[row, draws.index(of.get(name, name))] = 1.0
    return ToleranceStructure(tuple(names), loadings, tuple(draws))


def batches(
    names: Sequence[str], parts: Mapping[str, Sequence[str]], correlation: float
) -> ToleranceStructure:
    """Return the structure of axes that share a batch of rubber and scatter on their own besides.

    Parameters
    ----------
    names : sequence of str
        All variables.
    parts : mapping of str to sequence of str
        Mount → its variables.
    correlation : float
        Between any two variables of one mount, 0 to 1 [1]: the batch's share of the variance.

    Raises
    ------
    InputError
        An unknown variable, one that belongs to two mounts, or a correlation outside 0 to 1.
    """
    _check_groups(names, parts)
    if not 0.0 <= correlation <= 1.0:
        raise InputError(
            f"a correlation of {correlation:g} between the axes of a mount: take one from 0 to 1"
        )
    shared = np.array([[name in members for members in parts.values()] for name in names], float)
    shared = shared.reshape(len(names), len(parts))
    own = np.diag(np.sqrt(1.0 - correlation * shared.sum(axis=1)))
    loadings = np.hstack([own, np.sqrt(correlation) * shared])
    draws = (*names, *(f"batch {part}" for part in parts))
    return ToleranceStructure(tuple(names), loadings, draws)


def correlated(names: Sequence[str], correlation: RealArray) -> ToleranceStructure:
    """Return the structure of variables with a given correlation.

    Parameters
    ----------
    names : sequence of str
        All variables.
    correlation : array, shape (k, k)
        Symmetric, ones on its diagonal, no negative eigenvalue [1].

    Raises
    ------
    InputError
        No such matrix.
    """
    matrix = np.asarray(correlation, dtype=float)
    size = len(names)
    if matrix.shape != (size, size) or not (
        np.allclose(matrix, matrix.T) and np.allclose(np.diag(matrix), 1.0)
    ):
        raise InputError(
            f"the correlation of {size} variables must be a symmetric {size} x {size} matrix with "
            "ones on its diagonal"
        )
    value, vector = np.linalg.eigh(matrix)
    if value[0] < -1e-9:
        raise InputError(
            f"the correlation matrix has the eigenvalue {value[0]:g}: no parts scatter like that; "
            "check the correlations against each other"
        )
    loadings = (vector * np.sqrt(np.maximum(value, 0.0))) @ vector.T
    length = np.sqrt(np.einsum("km,km->k", loadings, loadings))
    draws = tuple(f"draw {number}" for number in range(1, size + 1))
    return ToleranceStructure(tuple(names), loadings / length[:, None], draws)


def independent(names: Sequence[str]) -> ToleranceStructure:
    """Return the structure of variables that have nothing in common."""
    return ToleranceStructure(tuple(names), np.eye(len(names)), tuple(names))


def blended(parts: Sequence[tuple[float, ToleranceStructure]]) -> ToleranceStructure:
    """Return the sum of independent kinds of scatter, such as that of batches and of pieces.

    Parameters
    ----------
    parts : sequence of (float, ToleranceStructure)
        Share of each kind in the variance of every variable, and how the variables scatter by it.
        Draws are its own, even where another kind has one of the same name.

    Returns
    -------
    ToleranceStructure
        Its correlation is the mean of theirs, weighted with the shares. A kind without a share has
        no draws.

    Raises
    ------
    InputError
        No kind, shares that are negative or do not sum to 1, variables that differ.
    """
    shares = [share for share, _ in parts]
    if not parts or not all(share >= 0.0 for share in shares) or not abs(sum(shares) - 1.0) < 1e-9:
        raise InputError(
            f"kinds of scatter with the shares {shares} of the variance: give shares of at least 0 "
            "that sum to 1"
        )
    names = parts[0][1].names
    if any(structure.names != names for _, structure in parts):
        raise InputError("kinds of scatter that are added must be those of the same variables")
    used = [(share, structure) for share, structure in parts if share > 0.0]
    loadings = np.hstack([np.sqrt(share) * structure.loadings for share, structure in used])
    draws = tuple(name for _, structure in used for name in structure.draw_names)
    return ToleranceStructure(names, loadings, draws)


def beside(structures: Sequence[ToleranceStructure]) -> ToleranceStructure:
    """Return several structures of different variables as one: they have nothing in common.

    Raises
    ------
    InputError
        No structure, or a variable in two of them.
    """
    names = tuple(name for structure in structures for name in structure.names)
    twice = [name for name in names if names.count(name) > 1]
    if not names or twice:
        raise InputError(f"structures side by side need variables of their own: {twice or 'none'}")
    loadings = block_diag(*(structure.loadings for structure in structures))
    draws = tuple(name for structure in structures for name in structure.draw_names)
    return ToleranceStructure(names, loadings, draws)


def averaged(
    structure: ToleranceStructure, pieces: Mapping[str, Sequence[str]]
) -> ToleranceStructure:
    """Return the structure of variables that are the mean of several pieces.

    Parameters
    ----------
    structure : ToleranceStructure
        Of the pieces' variables.
    pieces : mapping of str to sequence of str
        Variable → the variables of its pieces, at least one.

    Raises
    ------
    InputError
        A variable without pieces, or an unknown one.

    Notes
    -----
    A factor on the stiffness of a mount with a left and a right piece is the mean of both pieces'
    factors, exactly so where both contribute the same force.
    """
    rows = []
    for name, members in pieces.items():
        unknown = [member for member in members if member not in structure.names]
        if unknown or not members:
            raise InputError(f"variable '{name}' has no pieces, or unknown ones {unknown}")
        places = [structure.names.index(member) for member in members]
        rows.append(structure.loadings[places].sum(axis=0) / len(places))
    return ToleranceStructure(tuple(pieces), np.array(rows), structure.draw_names)


def _check_groups(names: Sequence[str], parts: Mapping[str, Sequence[str]]) -> None:
    seen: dict[str, str] = {}
    for part, members in parts.items():
        for name in members:
            if name not in names:
                raise InputError(
                    f"part '{part}' has the variable '{name}', which the design space has not: "
                    f"there are {list(names)}"
                )
            if name in seen:
                raise InputError(f"variable '{name}' is part of '{seen[name]}' and of '{part}'")
            seen[name] = part


@dataclass(frozen=True)
class PartNumber:
    """A part number: where its pieces sit, and what their scatter has in common.

    Parameters
    ----------
    name : str
        Such as ``bush 4711``.
    places : tuple of str
        Mounts that take it, such as ``("Du",)``; all of them get pieces of one batch.
    pieces : int
        How many pieces stand behind the variables of one place, such as 2 for a left and a right
        one: a variable is then the mean of its pieces.
    hardness_share : float
        Share of the variance that all axes of a piece have in common, 0 to 1 [1].
    batch_share : float
        Share of the variance that all pieces of a batch have in common, 0 to 1 [1].

    Raises
    ------
    InputError
        No place, a place twice, no piece, or a share outside 0 to 1.

    Notes
    -----
    Correlations are products: ``h`` between two axes of a piece, ``b`` between one axis of two
    pieces, ``b h`` between two axes of two pieces. Hardness (compound and cure) is common to all
    axes, geometry is each axis's own; of both, the batch settles one part and the piece the rest.
    """

    name: str
    places: tuple[str, ...]
    pieces: int = 1
    hardness_share: float = 0.0
    batch_share: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "places", tuple(self.places))
        if not self.places or len(set(self.places)) < len(self.places):
            raise InputError(
                f"part number '{self.name}' sits at {list(self.places)}: name every place once"
            )
        if self.pieces < 1:
            raise InputError(f"part number '{self.name}' has {self.pieces} pieces: at least 1")
        for what, share in (("hardness", self.hardness_share), ("batch", self.batch_share)):
            if not 0.0 <= share <= 1.0:
                raise InputError(
                    f"part number '{self.name}': a {what} share of {share:g}: take one from 0 to 1"
                )

    def structure(self, names: Sequence[str]) -> ToleranceStructure:
        """Return how its variables scatter.

        Parameters
        ----------
        names : sequence of str
            ``<place> <axis>`` of all its places and no other.
        """
        numbers = range(1, self.pieces + 1)
        of_piece = {
            f"{place} {number}" if self.pieces > 1 else place: [
                name for name in names if _place(name) == place
            ]
            for place in self.places
            for number in numbers
        }
        own = {
            piece: [f"{piece} {_axis(name)}" for name in members]
            for piece, members in of_piece.items()
        }
        directions = [direction for members in own.values() for direction in members]
        hardness, geometry = self.hardness_share, 1.0 - self.hardness_share
        piece = blended(
            [
                (hardness, shared_parts(directions, {f"{p}, hardness": m for p, m in own.items()})),
                (geometry, independent(directions)),
            ]
        )
        # of a single piece nobody can tell what comes from its batch
        batch_share = self.batch_share if len(own) > 1 else 0.0
        by_axis = {
            f"{self.name}, {axis} of the batch": [d for d in directions if _axis(d) == axis]
            for axis in dict.fromkeys(map(_axis, directions))
        }
        batch = blended(
            [
                (hardness, shared_parts(directions, {f"{self.name}, batch": directions})),
                (geometry, shared_parts(directions, by_axis)),
            ]
        )
        made = blended([(batch_share, batch), (1.0 - batch_share, piece)])
        pieces = {
            name: [
                f"{place} {_axis(name)}" for place, members in of_piece.items() if name in members
            ]
            for name in names
        }
        return averaged(made, pieces)


def part_structure(
    names: Sequence[str],
    parts: Sequence[PartNumber],
    hardness_share: float = 0.0,
    batch_share: float = 0.0,
) -> ToleranceStructure:
    """Return how variables scatter that are directions of parts.

    Parameters
    ----------
    names : sequence of str
        All variables, ``<place> <axis>``.
    parts : sequence of PartNumber
        A place of none of them has a part number of its own, of one piece.
    hardness_share, batch_share : float
        Of those places.

    Returns
    -------
    ToleranceStructure
        For a place of one piece that shares its number with no other, the batch share is without
        effect.

    Raises
    ------
    InputError
        A place that no variable has, or that takes two part numbers.

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
    places = tuple(dict.fromkeys(map(_place, names)))
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
    structures = [
        part.structure([name for name in names if _place(name) in part.places])
        for part in (*parts, *alone)
    ]
    return averaged(beside(structures), {name: (name,) for name in names})


def _place(name: str) -> str:
    return name.rpartition(" ")[0]


def _axis(name: str) -> str:
    return name.rpartition(" ")[2]


def fewest_pieces(n_axes: int) -> int:
    """Return how many pieces a prediction of so many axes needs at least."""
    return n_axes + 2


def predicted_pieces(
    measured: npt.ArrayLike, n_processes: int, n_pieces: int, *, seed: int
) -> RealArray:
    """Draw pieces of processes that the measured pieces may have come from.

    Parameters
    ----------
    measured : array, shape (n, k)
        Characteristics of the measured pieces, such as stiffness factors per axis.
    n_processes : int
        Means and covariances that are drawn.
    n_pieces : int
        Pieces of each.
    seed : int
        From 1.

    Returns
    -------
    array, shape (n_processes, n_pieces, k)
        [units of the measured].

    Raises
    ------
    InputError
        Fewer than `fewest_pieces`, pieces that do not scatter in some combination of axes, seed 0.

    Notes
    -----
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


FEWEST = 2
"""Pieces below which a scatter is not known at all."""


@dataclass(frozen=True)
class Capability:
    """Capability of one characteristic.

    Parameters
    ----------
    n : int
        Measured pieces.
    mean, sigma : float
        Of the pieces, with n − 1 [unit of the interval].
    cp, cp_bound : float
        Width of the interval over six standard deviations, and its one-sided lower bound [1].
    cpk, cpk_bound : float
        The same with the distance of the mean to the nearer end over three [1]; negative where the
        mean lies outside.
    expected_outside : float
        Share of a normal process with this mean and sigma outside of the interval [1].
    confidence : float
        Of the bounds [1].
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


def capability(
    values: npt.ArrayLike, lower: float, upper: float, confidence: float = 0.95
) -> Capability:
    """Return the capability of a process from a sample of its pieces.

    Parameters
    ----------
    values : array, shape (n,)
        Of the pieces [unit of the interval].
    lower, upper : float
        Ends of the interval.
    confidence : float
        Of the one-sided lower bounds, between 0.5 and 1 [1].

    Returns
    -------
    Capability

    Raises
    ------
    InputError
        Fewer than `FEWEST` values or one that is not finite, all values equal, an interval without
        width, a confidence outside 0.5 to 1.

    Notes
    -----
    ``Cp = (upper − lower)/6σ``, ``Cpk = min(upper − mean, mean − lower)/3σ``. Lower bounds:
    ``Cp √(χ²_{1−c, n−1}/(n − 1))``, exact for a normal process, and ``Cpk − z_c √(1/9n +
    Cpk²/2(n − 1))``, Bissell, Applied Statistics 39 (1990) 331, an approximation from about 20
    pieces upwards. A process that is not normal has other shares outside.
    """
    sample = np.asarray(values, dtype=float)
    if sample.ndim != 1 or sample.size < FEWEST or not np.all(np.isfinite(sample)):
        raise InputError(f"a capability needs at least {FEWEST} finite values in one row")
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
    )
