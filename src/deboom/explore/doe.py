"""Designs of experiments: plans, and every design with its responses or its failure."""

from __future__ import annotations

import string
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from enum import Enum
from itertools import combinations, count, product
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt
from scipy.spatial.distance import cdist, pdist
from scipy.stats import qmc

from deboom.arrays import BoolArray, RealArray, frozen_copy
from deboom.errors import InputError
from deboom.explore.archive import Arrays, Store, check_same_search
from deboom.explore.space import DesignSpace, Evaluate, checked_seed, generator, responses

SAME = 1e-9
"""Designs closer than this part of the bounds' width in every variable are one design [1]."""
AGREEMENT = 1e-6
"""A kept design that is evaluated again gives its responses up to this relative change [1]."""


class Failure(Enum):
    """Why a design has no responses."""

    NONE = ""
    NOT_FINITE = "not finite"
    """The model gave a value that is no number."""
    ARITHMETIC = "arithmetic"
    """The model gave up with an arithmetic error."""
    SINGULAR = "singular"
    """A system of equations had no solution."""


@dataclass(frozen=True, eq=False)
class Doe:
    """Designs with their responses.

    Parameters
    ----------
    name : str
        Of the model and of what it was evaluated for; only a DOE of the same name is continued.
    space : DesignSpace
        The designs lie within its bounds.
    response_names : tuple of str
        Columns of the responses.
    response_unit : str
        Of all responses.
    designs : array, shape (n, k)
        [units of the space].
    responses : array, shape (n, r)
        NaN where the design failed [response_unit].
    failures : tuple of Failure, length n
        `Failure.NONE` for a design with responses.
    plans : tuple of str, length n
        Which plan each design came from, in words.

    Raises
    ------
    InputError
        Lengths that do not fit, a design outside the bounds, responses that do not fit the failure
        code, a design that comes twice.
    """

    name: str
    space: DesignSpace
    response_names: tuple[str, ...]
    response_unit: str
    designs: RealArray
    responses: RealArray
    failures: tuple[Failure, ...]
    plans: tuple[str, ...]

    def __post_init__(self) -> None:
        designs = checked_within(self.space, self.designs)
        object.__setattr__(self, "designs", frozen_copy(designs))
        values = np.asarray(self.responses, dtype=float)
        object.__setattr__(self, "responses", frozen_copy(values))
        object.__setattr__(self, "failures", tuple(self.failures))
        object.__setattr__(self, "plans", tuple(self.plans))
        n = len(designs)
        shape = (n, len(self.response_names))
        if values.shape != shape or {len(self.failures), len(self.plans)} != {n}:
            raise InputError(
                f"a DOE of {n} designs has responses of shape {values.shape}, "
                f"{len(self.failures)} failure codes and {len(self.plans)} plans: expected {shape} "
                "and one code and plan per design"
            )
        wrong = np.isfinite(values).all(axis=1) == self.failed
        if wrong.any():
            raise InputError(
                f"design {int(np.flatnonzero(wrong)[0]) + 1} of the DOE has a failure code and "
                "responses, or neither: one of them is wrong"
            )
        twice = _repeated(self.space, designs, np.empty((0, self.space.n_variables)))
        if twice.any():
            raise InputError(
                f"design {int(np.flatnonzero(twice)[0]) + 1} of the DOE repeats an earlier one: "
                "remove it"
            )

    def __len__(self) -> int:
        return len(self.designs)

    @property
    def failed(self) -> BoolArray:
        """Designs without responses, shape (n,)."""
        return np.array([failure is not Failure.NONE for failure in self.failures], dtype=bool)

    @property
    def n_failed(self) -> int:
        """Number of designs without responses."""
        return int(self.failed.sum())

    @property
    def computed(self) -> RealArray:
        """Responses of the designs that have them, shape (n - n_failed, r) [response_unit]."""
        return np.asarray(self.responses[~self.failed])

    @property
    def computed_designs(self) -> RealArray:
        """Designs that have responses, shape (n - n_failed, k)."""
        return np.asarray(self.designs[~self.failed])


def run_doe(
    evaluate: Evaluate, space: DesignSpace, designs: RealArray, *, name: str, plan: str
) -> Doe:
    """Evaluate designs and keep them all.

    Parameters
    ----------
    evaluate : Evaluate
        The model.
    space : DesignSpace
        Of its variables; all designs lie within its bounds.
    designs : array, shape (n, k)
        A design that comes twice is evaluated and kept once.
    name, plan : str
        See `Doe`.

    Returns
    -------
    Doe
        In the order of the designs.

    Raises
    ------
    InputError
        No design, one outside of the bounds, or a model of other variables.
    """
    empty = Doe(
        name=name,
        space=space,
        response_names=evaluate.response_names,
        response_unit=evaluate.response_unit,
        designs=np.empty((0, space.n_variables)),
        responses=np.empty((0, len(evaluate.response_names))),
        failures=(),
        plans=(),
    )
    doe, _ = continue_doe(empty, evaluate, space, designs, name=name, plan=plan)
    if len(doe) == 0:
        raise InputError("the plan has no design: there is nothing to evaluate")
    return doe


def continue_doe(
    doe: Doe, evaluate: Evaluate, space: DesignSpace, designs: RealArray, *, name: str, plan: str
) -> tuple[Doe, int]:
    """Add designs to a DOE, without repeating those that it holds.

    Parameters
    ----------
    doe : Doe
        What there is; its failed designs are not tried again.
    evaluate, space, designs, name, plan
        As for `run_doe`.

    Returns
    -------
    doe : Doe
        The old designs, then the new ones.
    n_known : int
        Designs that were not evaluated, because the DOE holds them or the plan repeats them.

    Raises
    ------
    InputError
        A DOE of another name, space or model: says what differs; also if the first design it holds
        has other responses now.
    """
    if evaluate.variable_names != space.names:
        raise InputError(
            f"the model has the variables {list(evaluate.variable_names)}, the design space "
            f"{list(space.names)}: give both the same names in the same order"
        )
    designs = checked_within(space, designs)
    _check_same(doe, evaluate, space, name)
    known = _repeated(space, designs, doe.designs)
    new = designs[~known]
    values, failures = _evaluated(evaluate, new)
    longer = replace(
        doe,
        designs=np.concatenate([doe.designs, new]),
        responses=np.concatenate([doe.responses, values]),
        failures=(*doe.failures, *failures),
        plans=(*doe.plans, *[plan] * len(new)),
    )
    return longer, int(known.sum())


def checked_within(space: DesignSpace, designs: RealArray) -> RealArray:
    """Return designs of the right shape within the bounds, or refuse them.

    Raises
    ------
    InputError
        See `DesignSpace.checked`; also a value outside its bounds: names design and variable.
    """
    array = space.checked(designs)
    slack = SAME * (space.upper - space.lower)
    outside = (array < space.lower - slack) | (array > space.upper + slack)
    if outside.any():
        row, column = (int(place) for place in np.argwhere(outside)[0])
        raise InputError(
            f"design {row + 1} has {array[row, column]:g} for '{space.names[column]}', outside its "
            f"bounds {space.lower[column]:g} to {space.upper[column]:g}: correct it or widen the "
            "bounds"
        )
    return array


def _check_same(doe: Doe, evaluate: Evaluate, space: DesignSpace, name: str) -> None:
    if doe.name != name:
        raise InputError(
            f"the DOE at hand is named '{doe.name}', the new one '{name}': start a new DOE"
        )
    if doe.space.names != space.names or doe.response_names != evaluate.response_names:
        raise InputError(
            f"the DOE '{name}' has the variables {list(doe.space.names)} and responses "
            f"{list(doe.response_names)}, the model {list(space.names)} and "
            f"{list(evaluate.response_names)}: start a new DOE"
        )
    for column in ("lower", "upper"):
        if not np.array_equal(getattr(doe.space, column), getattr(space, column)):
            raise InputError(
                f"the DOE '{name}' has other {column} bounds than the design space: start a new DOE"
            )
    if not doe.failed.all():
        row = int(np.flatnonzero(~doe.failed)[0])
        again, _ = _evaluated(evaluate, doe.designs[row : row + 1])
        if not np.allclose(again[0], doe.responses[row], rtol=AGREEMENT, atol=0.0):
            raise InputError(
                f"design {row + 1} of the DOE '{name}' gives other responses now than when it was "
                "kept, so it comes from other data: start a new DOE"
            )


def _repeated(space: DesignSpace, designs: RealArray, held: RealArray) -> npt.NDArray[np.bool_]:
    """Designs that are held already or come earlier in the list, shape (n,)."""
    width = np.where(space.upper > space.lower, space.upper - space.lower, 1.0)
    both = np.round((np.concatenate([held, designs]) - space.lower) / width / SAME)
    _, first = np.unique(both, axis=0, return_index=True)
    repeated = np.ones(len(both), dtype=bool)
    repeated[first] = False
    return np.asarray(repeated[len(held) :])


def _evaluated(evaluate: Evaluate, designs: RealArray) -> tuple[RealArray, list[Failure]]:
    """Return responses and failure codes; one bad design does not take the others with it."""
    if len(designs) == 0:
        return np.empty((0, len(evaluate.response_names))), []
    try:
        values, failure = responses(evaluate, designs), Failure.NOT_FINITE
    except (ArithmeticError, np.linalg.LinAlgError) as error:
        if len(designs) > 1:
            parts = [_evaluated(evaluate, design[np.newaxis]) for design in designs]
            return (
                np.concatenate([part[0] for part in parts]),
                [code for part in parts for code in part[1]],
            )
        singular = isinstance(error, np.linalg.LinAlgError)
        failure = Failure.SINGULAR if singular else Failure.ARITHMETIC
        values = np.full((1, len(evaluate.response_names)), np.nan)
    failed = np.asarray(~np.isfinite(values).all(axis=1))
    values = np.where(failed[:, np.newaxis], np.nan, values)
    return values, [failure if bad else Failure.NONE for bad in failed]


MOST_DESIGNS = 1_000_000
"""A plan of more designs is refused: it is a slip of the keyboard."""

_INCOMPLETE_BLOCKS = {
    6: ((1, 2, 4), (2, 3, 5), (3, 4, 6), (1, 4, 5), (2, 5, 6), (1, 3, 6)),
    7: ((4, 5, 6), (1, 6, 7), (2, 5, 7), (1, 2, 4), (3, 4, 7), (1, 3, 5), (2, 3, 6)),
    12: tuple(tuple((member + shift) % 12 + 1 for member in (0, 1, 4, 6)) for shift in range(12)),
}


def full_factorial(n_variables: int, levels: int = 2) -> RealArray:
    """Return every combination of equally spaced levels.

    Parameters
    ----------
    n_variables : int
        Columns k, at least 1.
    levels : int
        Per variable, at least 2.

    Returns
    -------
    array, shape (levels**k, k)
        In standard order: the first column alternates fastest [1].

    Raises
    ------
    InputError
        No variable, fewer than two levels, or more than `MOST_DESIGNS` designs.
    """
    if n_variables < 1 or levels < 2:
        raise InputError(
            f"a full factorial of {n_variables} variables at {levels} levels has nothing to vary: "
            "take at least 1 variable and 2 levels"
        )
    if levels**n_variables > MOST_DESIGNS:
        raise InputError(
            f"a full factorial of {n_variables} variables at {levels} levels has "
            f"{levels**n_variables:,} designs: take fewer levels, a fractional factorial or a "
            "space-filling plan"
        )
    grid = np.array(list(product(np.linspace(-1.0, 1.0, levels), repeat=n_variables)))
    return np.ascontiguousarray(grid[:, ::-1])


def fractional_factorial(generators: str) -> RealArray:
    """Return a regular two-level fraction.

    Parameters
    ----------
    generators : str
        One word per variable, separated by blanks: a single letter is a base variable with its own
        full factorial, a longer word the product of base variables, a minus in front turns it.
        ``"a b c abc"`` is the half fraction of four variables.

    Returns
    -------
    array, shape (2**n_base, k)
        In standard order of the base variables, which are sorted by letter [1].

    Raises
    ------
    InputError
        No word, a word that is no letters, a letter without a column of its own, or two columns
        that are the same up to their sign.

    Notes
    -----
    Box, Hunter and Hunter, "Statistics for Experimenters", 2nd ed., ch. 6.
    """
    words = _words(generators)
    base = sorted(letters for _, letters in words if len(letters) == 1)
    table = full_factorial(len(base))
    columns = {letter: table[:, place] for place, letter in enumerate(base)}
    return np.column_stack(
        [sign * np.prod([columns[letter] for letter in letters], axis=0) for sign, letters in words]
    )


def resolution(generators: str) -> int | None:
    """Return the resolution of a regular fraction: the length of its shortest defining word.

    Parameters
    ----------
    generators : str
        As for `fractional_factorial`.

    Returns
    -------
    int or None
        3: main effects are mixed with interactions of two variables; 4: only those with each
        other; 5 and more: neither. None for a full factorial, which mixes nothing.
    """
    words = _words(generators)
    defining = [
        frozenset(letters) ^ {f"column {place}"}
        for place, (_, letters) in enumerate(words)
        if len(letters) > 1
    ]
    lengths = []
    for size in range(1, len(defining) + 1):
        for chosen in combinations(defining, size):
            together: frozenset[str] = frozenset()
            for word in chosen:
                together = together ^ word
            lengths.append(len(together))
    return min(lengths, default=None)


def box_behnken(n_variables: int, n_centre: int = 1) -> RealArray:
    """Return a Box-Behnken design: no variable at its limit together with all others.

    Parameters
    ----------
    n_variables : int
        Columns k, at least 3.
    n_centre : int
        Runs in the middle; more than one say nothing about a model without noise.

    Returns
    -------
    array, shape (n, k)
        Levels -1, 0 and 1 [1].

    Raises
    ------
    InputError
        Fewer than three variables or a negative count.

    Notes
    -----
    Box and Behnken, Technometrics 2 (1960) 455-475: two-level factorials of the variables of each
    block of an incomplete block design, all others at 0. For 6, 7 and 12 variables these are the
    blocks of the paper; for all other counts every pair of variables is a block, which is the paper
    again for 3, 4 and 5.
    """
    if n_variables < 3 or n_centre < 0:
        raise InputError(
            f"a Box-Behnken design of {n_variables} variables with {n_centre} runs in the middle: "
            "take at least 3 variables and no negative count"
        )
    pairs = tuple(combinations(range(1, n_variables + 1), 2))
    blocks = _INCOMPLETE_BLOCKS.get(n_variables, pairs)
    rows = [np.zeros((n_centre, n_variables))]
    for block in blocks:
        part = np.zeros((2 ** len(block), n_variables))
        part[:, np.array(block) - 1] = full_factorial(len(block))
        rows.insert(-1, part)
    return np.concatenate(rows)


def central_composite(
    factorial: RealArray, star_distance: float | None = None, n_centre: int = 1
) -> RealArray:
    """Return a factorial with a star of axial points and a middle.

    Parameters
    ----------
    factorial : array, shape (n, k)
        Two-level part, full or fractional, in levels -1 and 1 [1].
    star_distance : float, optional
        Of the axial points from the middle, above 0; 1 puts them on the faces. By default the
        fourth root of n, which makes the design rotatable [1].
    n_centre : int
        Runs in the middle.

    Returns
    -------
    array, shape (n + 2 k + n_centre, k)
        Factorial, star (low and high by variable), middle [1].

    Raises
    ------
    InputError
        A factorial with other levels, a distance that is not above 0, a negative count.

    Notes
    -----
    Box and Wilson, J. R. Stat. Soc. B 13 (1951) 1-45; rotatability: Box and Hunter, Ann. Math.
    Stat. 28 (1957) 195-241.
    """
    part = np.asarray(factorial, dtype=float)
    if part.ndim != 2 or part.size == 0 or not np.all(np.abs(part) == 1.0):
        raise InputError("the factorial part of a central composite design has levels -1 and 1")
    distance = len(part) ** 0.25 if star_distance is None else star_distance
    if not (np.isfinite(distance) and distance > 0.0) or n_centre < 0:
        raise InputError(
            f"a star at {distance:g} with {n_centre} runs in the middle: give a distance above 0 "
            "and no negative count"
        )
    n_variables = part.shape[1]
    star = np.kron(np.eye(n_variables), [[-distance], [distance]])
    return np.concatenate([part, star, np.zeros((n_centre, n_variables))])


def within_bounds(space: DesignSpace, coded: RealArray) -> RealArray:
    """Return the designs of a coded plan, its outermost levels on the bounds.

    Parameters
    ----------
    space : DesignSpace
        Its bounds.
    coded : array, shape (n, k)
        Levels around 0; a star beyond ±1 shrinks the rest of its plan [1].

    Returns
    -------
    array, shape (n, k)
        [units of the space].

    Raises
    ------
    InputError
        Another number of variables, or a level between whole numbers for a variable of these.
    """
    levels = np.asarray(coded, dtype=float)
    if levels.ndim != 2 or levels.shape[1] != space.n_variables:
        raise InputError(
            f"the plan has shape {levels.shape} for {space.n_variables} design variables "
            f"{list(space.names)}: it needs one column for each"
        )
    middle, half = (space.lower + space.upper) / 2.0, (space.upper - space.lower) / 2.0
    designs = middle + half * levels / np.abs(levels).max()
    designs = np.clip(designs, space.lower, space.upper)  # against rounding
    broken = space.integer & np.any(np.mod(designs, 1.0) != 0.0, axis=0)
    if broken.any():
        raise InputError(
            f"'{space.names[int(np.argmax(broken))]}' takes whole numbers, and the plan has levels "
            "between them: take a space-filling plan"
        )
    return np.asarray(designs)


def _words(generators: str) -> list[tuple[float, str]]:
    words = [
        (-1.0 if text.startswith("-") else 1.0, text.lstrip("+-")) for text in generators.split()
    ]
    for _, letters in words:
        if not letters or set(letters) - set(string.ascii_letters):
            raise InputError(
                f"generators '{generators}': write one word of letters per variable, such as "
                "'a b c abc'"
            )
        if len(set(letters)) != len(letters):
            raise InputError(
                f"generators '{generators}': '{letters}' names a letter twice, which cancels"
            )
    base = {letters for _, letters in words if len(letters) == 1}
    if not base:
        raise InputError(f"generators '{generators}' have no base variable: add single letters")
    for _, letters in words:
        missing = sorted(set(letters) - base)
        if missing:
            raise InputError(
                f"generators '{generators}': '{letters}' needs columns {missing} of their own"
            )
    columns = [frozenset(letters) for _, letters in words]
    if len(set(columns)) != len(columns):
        raise InputError(
            f"generators '{generators}': two variables would have the same column, up to its sign"
        )
    return words


DRAWS = 50
"""Latin hypercubes that are drawn; the one with the largest smallest distance is improved."""
SWAPS = 2000
"""Exchanges that are tried to improve it."""


def sobol_designs(space: DesignSpace, n_designs: int, *, seed: int) -> RealArray:
    """Return scrambled Sobol points.

    Parameters
    ----------
    space : DesignSpace
        Its bounds.
    n_designs : int
        A power of two, which keeps the balance of the points.
    seed : int
        From 1 upwards.

    Returns
    -------
    array, shape (n_designs, k)
        [units of the space].

    Raises
    ------
    InputError
        A count that is not a power of two, seed 0.
    """
    exponent = max(n_designs, 1).bit_length() - 1
    if n_designs != 2**exponent:
        raise InputError(
            f"{n_designs} Sobol points are not a power of two and would be unbalanced: take "
            f"{2**exponent} or {2 ** (exponent + 1)}, or another plan"
        )
    points = qmc.Sobol(space.n_variables, rng=generator(seed, "designs")).random_base2(exponent)
    return _within(space, points)


def latin_hypercube(space: DesignSpace, n_designs: int, *, seed: int) -> RealArray:
    """Return a Latin hypercube whose closest designs are far apart (maximin).

    Parameters
    ----------
    space : DesignSpace
        Its bounds.
    n_designs : int
        At least 2.
    seed : int
        From 1 upwards.

    Returns
    -------
    array, shape (n_designs, k)
        Every variable has exactly one design in each of `n_designs` equal intervals
        [units of the space].

    Raises
    ------
    InputError
        Fewer than two designs, seed 0.

    Notes
    -----
    The best of `DRAWS` hypercubes, then `SWAPS` exchanges: one of the two closest designs trades
    one coordinate with a third design, and keeps it if the smallest distance does not fall. After
    Morris and Mitchell, J. Stat. Plan. Inference 43 (1995) 381-402, without their annealing. Each
    trade keeps the hypercube.
    """
    if n_designs < 2:
        raise InputError(f"a Latin hypercube of {n_designs} designs: take at least 2")
    random = generator(seed, "designs")
    sampler = qmc.LatinHypercube(space.n_variables, rng=random)
    draws = [sampler.random(n_designs) for _ in range(DRAWS)]
    best = draws[int(np.argmax([pdist(points).min() for points in draws]))]
    return _within(space, _spread(best, random))


def _spread(points: RealArray, random: np.random.Generator) -> RealArray:
    """Exchange coordinates of close designs until they are further apart."""
    points = points.copy()
    n, k = points.shape
    distances = cdist(points, points)
    np.fill_diagonal(distances, np.inf)
    for _ in range(SWAPS):
        smallest = distances.min()
        pair = np.unravel_index(int(np.argmin(distances)), distances.shape)
        one, other = int(pair[random.integers(2)]), int(random.integers(n))
        column = int(random.integers(k))
        rows = [one, other]
        if one == other:
            continue
        points[rows, column] = points[rows[::-1], column]
        moved = cdist(points[rows], points)
        moved[[0, 1], rows] = np.inf
        if moved.min() < smallest:
            points[rows, column] = points[rows[::-1], column]
        else:
            distances[rows], distances[:, rows] = moved, moved.T
    return points


def _within(space: DesignSpace, points: RealArray) -> RealArray:
    """Map points of the unit cube to the bounds; whole numbers all get the same share."""
    width = space.upper - space.lower
    whole = np.floor(space.lower + points * (width + 1.0))
    return np.where(space.integer, whole, space.lower + points * width)


Progress = Callable[[int, int, str], None]
"""Called after each chunk with its number, the number of chunks, and a line of text."""


class DesignSource(Protocol):
    """Designs by their place in a list that never exists as a whole."""

    @property
    def space(self) -> DesignSpace:
        """Where the designs lie."""

    @property
    def facts(self) -> dict[str, Any]:
        """All that the designs follow from, as JSON can hold it."""

    def __len__(self) -> int:
        """Return how many designs there are."""

    def part(self, start: int, stop: int) -> RealArray:
        """Return the designs from one place up to another, shape (stop - start, k)."""


@dataclass(frozen=True, eq=False)
class SobolDesigns:
    """Scrambled Sobol points over the bounds of a design space.

    Parameters
    ----------
    space : DesignSpace
        Its bounds.
    n_designs : int
        A power of two keeps the balance of the points; any count is taken.
    seed : int
        From 1 upwards.

    Raises
    ------
    InputError
        No design, or seed 0.
    """

    space: DesignSpace
    n_designs: int
    seed: int

    def __post_init__(self) -> None:
        checked_seed(self.seed)
        if self.n_designs < 1:
            raise InputError(f"{self.n_designs} designs cannot be evaluated: take at least 1")

    @property
    def facts(self) -> dict[str, Any]:
        """All that the designs follow from."""
        return {
            "designs": "scrambled Sobol",
            "n_designs": self.n_designs,
            "seed": self.seed,
            "variables": list(self.space.names),
            "lower": self.space.lower.tolist(),
            "upper": self.space.upper.tolist(),
        }

    def __len__(self) -> int:
        return self.n_designs

    def part(self, start: int, stop: int) -> RealArray:
        """Return the designs from one place up to another, shape (stop - start, k)."""
        points = qmc.Sobol(self.space.n_variables, rng=generator(self.seed, "designs"))
        if start == 0:  # apart from the rest: scipy warns of a first part that is no power of two
            drawn = np.vstack([points.random(1), points.random(stop - 1)])
        else:
            drawn = points.fast_forward(start).random(stop - start)
        return np.asarray(self.space.lower + drawn * (self.space.upper - self.space.lower))


def evaluate_to_store(
    evaluate: Evaluate,
    designs: DesignSource,
    store: Store,
    chunk: int = 8192,
    progress: Progress | None = None,
) -> int:
    """Evaluate many designs into a store, chunk by chunk.

    Parameters
    ----------
    evaluate : Evaluate
        The model.
    designs : DesignSource
        Such as `SobolDesigns`.
    store : Store
        Chunk after chunk is kept in it; chunks that it holds are not computed again.
    chunk : int
        Designs per chunk: what is in memory at a time.
    progress : callable, optional
        See `Progress`.

    Returns
    -------
    int
        Number of chunks that were computed now.

    Raises
    ------
    InputError
        Chunks without designs; a store that holds other designs, responses or chunks, by name; a
        model of other variables.
    """
    if chunk < 1:
        raise InputError(f"chunks of {chunk} designs: take at least 1")
    if evaluate.variable_names != designs.space.names:
        raise InputError(
            f"the model has the variables {list(evaluate.variable_names)}, the designs "
            f"{list(designs.space.names)}: give both the same names in the same order"
        )
    asked = {**designs.facts, "responses": list(evaluate.response_names), "chunk": chunk}
    found = store.load()
    if found is None:
        store.save({}, asked)
    else:
        check_same_search(found[1], asked)
    n_chunks = -(-len(designs) // chunk)
    computed = 0
    for number in range(1, n_chunks + 1):
        if store.kept(number) is None:
            part = designs.part((number - 1) * chunk, min(number * chunk, len(designs)))
            store.keep(number, {"designs": part, "responses": responses(evaluate, part)})
            computed += 1
        if progress is not None:
            progress(number, n_chunks, f"{min(number * chunk, len(designs))} designs")
    return computed


def stored_chunks(store: Store) -> Iterator[Arrays]:
    """Yield what `evaluate_to_store` has kept, chunk by chunk, from the first to the last."""
    for number in count(1):
        arrays = store.kept(number)
        if arrays is None:
            return
        yield arrays
