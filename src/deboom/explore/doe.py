"""Designs of experiments: plans, and every design with its responses or its failure.

The classical plans are the textbook's tables in coded levels from -1 to 1, made for fitting
polynomials; for correlations and sensitivities the space-filling plans say more per design.
"""

from __future__ import annotations

import string
from dataclasses import replace
from enum import Enum
from itertools import combinations, product

import numpy as np
from scipy.spatial.distance import cdist, pdist
from scipy.stats import qmc

from deboom.arrays import BoolArray, RealArray, checked
from deboom.errors import InputError
from deboom.explore.space import (
    DesignSpace,
    Evaluate,
    check_same_names,
    generator,
    responses,
    sobol_points,
)

SAME = 1e-9
"""Designs closer than this part of the bounds' width in every variable are one design [1]."""
DRAWS = 50
"""Latin hypercubes that are drawn; the one with the largest smallest distance is improved."""
MOST_DESIGNS = 1_000_000
"""Largest full factorial; a plan of more designs is a slip of the keyboard."""

_AGREEMENT = 1e-6  # relative change of responses that are computed again
_SWAPS = 2000  # exchanges that are tried to improve a Latin hypercube
_INCOMPLETE_BLOCKS = {
    6: ((1, 2, 4), (2, 3, 5), (3, 4, 6), (1, 4, 5), (2, 5, 6), (1, 3, 6)),
    7: ((4, 5, 6), (1, 6, 7), (2, 5, 7), (1, 2, 4), (3, 4, 7), (1, 3, 5), (2, 3, 6)),
    12: tuple(tuple((member + shift) % 12 + 1 for member in (0, 1, 4, 6)) for shift in range(12)),
}


def sobol_designs(space: DesignSpace, n_designs: int, *, seed: int) -> RealArray:
    """Return scrambled Sobol designs within the bounds, shape (n_designs, k) [units of the space].

    The number of designs is a power of two, or it is refused.
    """
    points = sobol_points(space.n_variables, n_designs, seed=seed, purpose="designs")
    return _within(space, points)


def latin_hypercube(space: DesignSpace, n_designs: int, *, seed: int) -> RealArray:
    """Return a Latin hypercube whose closest designs are far apart, shape (n_designs, k).

    Every variable has exactly one design in each of `n_designs` equal intervals [units of the
    space].

    - raises InputError: fewer than two designs, seed 0.

    The best of `DRAWS` hypercubes of scipy, then exchanges: one of the two closest designs trades
    one coordinate with a third design, and keeps it if the smallest distance does not fall. After
    Morris and Mitchell, J. Stat. Plan. Inference 43 (1995) 381-402, without their annealing.
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
    for _ in range(_SWAPS):
        smallest = distances.min()
        pair = np.unravel_index(int(np.argmin(distances)), distances.shape)
        rows = [int(pair[random.integers(2)]), int(random.integers(n))]
        column = int(random.integers(k))
        if rows[0] == rows[1]:
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


def full_factorial(n_variables: int, levels: int = 2) -> RealArray:
    """Return every combination of equally spaced levels, shape (levels**k, k) [1].

    The runs are in standard order: the first column alternates fastest. Nothing to vary, or more
    than `MOST_DESIGNS` designs, is refused.
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
    """Return a regular two-level fraction, shape (2**n_base, k), in standard order [1].

    - `generators`: one word per variable, separated by blanks: a single letter is a base variable
      with its own full factorial, a longer word the product of base variables, a minus in front
      turns it. ``"a b c abc"`` is the half fraction of four variables.
    - raises InputError: words that are no letters, letters without a column of their own, or two
      equal columns.

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

    3: main effects are mixed with interactions of two variables; 4: only those with each other; 5
    and more: neither. None for a full factorial, which mixes nothing.
    """
    defining = [
        frozenset(letters) ^ {f"column {place}"}
        for place, (_, letters) in enumerate(_words(generators))
        if len(letters) > 1
    ]
    lengths = []
    for count in range(1, len(defining) + 1):
        for chosen in combinations(defining, count):
            together: frozenset[str] = frozenset()
            for word in chosen:
                together = together ^ word
            lengths.append(len(together))
    return min(lengths, default=None)


def _words(generators: str) -> list[tuple[float, str]]:
    """Sign and letters of each word."""
    words = [
        (-1.0 if text.startswith("-") else 1.0, text.lstrip("+-")) for text in generators.split()
    ]
    base = {letters for _, letters in words if len(letters) == 1}
    faults: list[str] = []
    for _, letters in words:
        missing = sorted(set(letters) - base)
        if not letters or set(letters) - set(string.ascii_letters):
            faults.append("write one word of letters per variable, such as 'a b c abc'")
        elif len(set(letters)) != len(letters):
            faults.append(f"'{letters}' names a letter twice, which cancels")
        elif base and missing:
            faults.append(f"'{letters}' needs columns {missing} of their own")
    if not base:
        faults.append("there is no base variable, add single letters")
    if len({frozenset(letters) for _, letters in words}) != len(words):
        faults.append("two variables would have the same column, up to its sign")
    if faults:
        raise InputError(f"generators '{generators}': {faults[0]}")
    return words


def box_behnken(n_variables: int) -> RealArray:
    """Return a Box-Behnken design (n, k): no variable at its limit together with all others [1].

    At least 3 variables, with one run in the middle: more say nothing about a model without noise.
    Box and Behnken, Technometrics 2 (1960) 455-475: two-level factorials of the variables of each
    block of an incomplete block design, all others at 0. For 6, 7 and 12 variables these are the
    blocks of the paper; for all other counts every pair of variables is a block, which is the paper
    again for 3, 4 and 5.
    """
    if n_variables < 3:
        raise InputError(
            f"a Box-Behnken design of {n_variables} variables: take at least 3 variables"
        )
    pairs = tuple(combinations(range(1, n_variables + 1), 2))
    rows = []
    for block in _INCOMPLETE_BLOCKS.get(n_variables, pairs):
        part = np.zeros((2 ** len(block), n_variables))
        part[:, np.array(block) - 1] = full_factorial(len(block))
        rows.append(part)
    return np.concatenate([*rows, np.zeros((1, n_variables))])


def central_composite(factorial: RealArray) -> RealArray:
    """Return a factorial, its star (low and high by variable) and its middle as coded levels [1].

    - `factorial` (n, k): two-level part, full or fractional, in levels -1 and 1 [1].

    The axial points lie the fourth root of n from the middle, which makes the design rotatable.
    Box and Wilson, J. R. Stat. Soc. B 13 (1951) 1-45; rotatability: Box and Hunter, Ann. Math.
    Stat. 28 (1957) 195-241.
    """
    part = np.asarray(factorial, dtype=float)
    if part.ndim != 2 or part.size == 0 or not np.all(np.abs(part) == 1.0):
        raise InputError("the factorial part of a central composite design has levels -1 and 1")
    distance = len(part) ** 0.25
    star = np.kron(np.eye(part.shape[1]), [[-distance], [distance]])
    return np.concatenate([part, star, np.zeros((1, part.shape[1]))])


def within_bounds(space: DesignSpace, coded: RealArray) -> RealArray:
    """Return the designs of a coded plan, (n, k), its outermost levels on the bounds.

    A star beyond ±1 shrinks the rest of its plan.

    - raises InputError: another number of variables, or a level between whole numbers for a
      variable of these.
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


class Failure(Enum):
    """Why a design has no responses."""

    NONE = ""
    NOT_FINITE = "not finite"
    """The model gave a value that is no number."""
    ARITHMETIC = "arithmetic"
    """The model gave up with an arithmetic error."""
    SINGULAR = "singular"
    """A system of equations had no solution."""


@checked(designs="n k", responses="n r ?")
class Doe:
    """Designs with their responses.

    - `name`: name of the model and its purpose; only a DOE of the same name is continued.
    - `space`: variables, with bounds around the designs.
    - `response_names`, `response_unit`: columns of the responses and their unit.
    - `designs` (n, k): designs, each once [units of the space].
    - `responses` (n, r): responses, NaN where the design failed [response_unit].
    - `failures`: `Failure.NONE` for a design with responses.
    - `plans`: plan that each design came from, in words.
    - raises InputError: a design outside the bounds, one that comes twice, or one with a failure
      code and responses.
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
        checked_within(self.space, self.designs)
        wrong = np.isfinite(self.responses).all(axis=1) == self.failed
        if wrong.any():
            raise InputError(
                f"design {int(np.flatnonzero(wrong)[0]) + 1} of the DOE has a failure code and "
                "responses, or neither: one of them is wrong"
            )
        repeated = _repeated(self.space, self.designs, self.designs[:0])
        if repeated.any():
            raise InputError(
                f"design {int(np.flatnonzero(repeated)[0]) + 1} of the DOE repeats an earlier "
                "one: remove it"
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
        """Designs that have responses, shape (n - n_failed, k) [units of the space]."""
        return np.asarray(self.designs[~self.failed])


def run_doe(
    evaluate: Evaluate, space: DesignSpace, designs: RealArray, *, name: str, plan: str
) -> Doe:
    """Evaluate designs (n, k) within the bounds and keep them all, in their order, each once.

    - raises InputError: no design, one outside of the bounds, or a model of other variables.
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
    """Add designs (n, k) to a DOE, without repeating those that it holds.

    - returns `doe`: the old designs, then the new ones; failed designs are not tried again.
    - returns `n_known`: designs that were not evaluated, because the DOE holds them or the plan
      repeats them.
    - raises InputError: a DOE of another name, space or model: says what differs; also if the first
      design it holds has other responses now.
    """
    check_same_names("the model has the variables", evaluate.variable_names, space.names)
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
    """Return designs (n, k) within the bounds, or refuse them by design and variable."""
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
    """Refuse to continue a DOE of another name, space or model."""
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
        if not np.allclose(again[0], doe.responses[row], rtol=_AGREEMENT, atol=0.0):
            raise InputError(
                f"design {row + 1} of the DOE '{name}' gives other responses now than when it was "
                "kept, so it comes from other data: start a new DOE"
            )


def _repeated(space: DesignSpace, designs: RealArray, known: RealArray) -> BoolArray:
    """Which designs, (n, k), are known already or come earlier in the list, shape (n,)."""
    width = np.where(space.upper > space.lower, space.upper - space.lower, 1.0)
    both = np.round((np.concatenate([known, designs]) - space.lower) / width / SAME)
    _, first = np.unique(both, axis=0, return_index=True)
    repeated = np.ones(len(both), dtype=bool)
    repeated[first] = False
    return np.asarray(repeated[len(known) :])


def _evaluated(evaluate: Evaluate, designs: RealArray) -> tuple[RealArray, list[Failure]]:
    """Responses and failure codes; one bad design does not take the others with it."""
    if len(designs) == 0:
        return np.empty((0, len(evaluate.response_names))), []
    try:
        values, failure = responses(evaluate, designs), Failure.NOT_FINITE
    except (ArithmeticError, np.linalg.LinAlgError) as error:
        if len(designs) > 1:
            parts = [_evaluated(evaluate, design[np.newaxis]) for design in designs]
            codes = [code for _, part in parts for code in part]
            return np.concatenate([part for part, _ in parts]), codes
        singular = isinstance(error, np.linalg.LinAlgError)
        failure = Failure.SINGULAR if singular else Failure.ARITHMETIC
        values = np.full((1, len(evaluate.response_names)), np.nan)
    failed = np.asarray(~np.isfinite(values).all(axis=1))
    values = np.where(failed[:, np.newaxis], np.nan, values)
    return values, [failure if bad else Failure.NONE for bad in failed]
