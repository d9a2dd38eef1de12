"""The classical experimental designs, in coded levels from -1 to 1: the textbook's tables.

They are made for fitting polynomials by hand-sized tables; for correlations and sensitivities the
space-filling designs of `deboom.explore.space_filling` say more per design.
"""

from __future__ import annotations

import string
from itertools import combinations, product

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.design_space import DesignSpace

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
    for count in range(1, len(defining) + 1):
        for chosen in combinations(defining, count):
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
