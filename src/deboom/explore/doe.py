"""Designs of experiments: plans, and every design with its responses or its failure.

Plans of fixed levels are pyDOE's, made for fitting polynomials; for correlations and sensitivities
the space-filling plans say more per design.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import qmc

from deboom.arrays import BoolArray, RealArray, checked
from deboom.errors import InputError
from deboom.explore.front import nondominated
from deboom.explore.space import (
    DesignSpace,
    Evaluate,
    check_fits,
    check_repeats,
    check_same_names,
    generator,
    responses,
    said,
    sobol_points,
    units_of,
    whole_number,
)
from deboom.tabled import Tabled

SAME = 1e-9
"""Designs closer than this part of the bounds' width in every variable are one design [1]."""
MOST_CORNERS = 16
"""Variables of the largest full factorial: a plan of more designs is a slip of the keyboard."""
RESERVED = ("doe", "design", "plan", "failure")
"""Columns of a DOE's table that are neither variable nor response."""


def sobol_designs(space: DesignSpace, n_designs: int, *, seed: int) -> RealArray:
    """Return scrambled Sobol designs within the bounds, shape (n_designs, k) [units of the space].

    The number of designs is a power of two, or it is refused.
    """
    points = sobol_points(space.n_variables, n_designs, seed=seed, purpose="designs")
    return _within(space, points)


def latin_hypercube(space: DesignSpace, n_designs: int, *, seed: int) -> RealArray:
    """Return a Latin hypercube that fills the bounds evenly, shape (n_designs, k).

    Every variable has exactly one design in each of `n_designs` equal intervals [units of the
    space]. Coordinates are exchanged as long as the centred discrepancy falls (scipy's
    ``random-cd``).

    - raises InputError: fewer than two designs, seed 0.
    """
    if n_designs < 2:
        raise InputError(f"a Latin hypercube of {n_designs} designs: take at least 2")
    random = generator(seed, "designs")
    sampler = qmc.LatinHypercube(space.n_variables, optimization="random-cd", rng=random)
    return _within(space, sampler.random(n_designs))


def _within(space: DesignSpace, points: RealArray) -> RealArray:
    """Map points of the unit cube to the bounds; whole numbers all get the same share."""
    width = space.upper - space.lower
    whole = np.floor(space.lower + points * (width + 1.0))
    return np.where(space.integer, whole, space.lower + points * width)


def full_factorial(space: DesignSpace) -> RealArray:
    """Return all corners of the bounds, (2**k, k), at most `MOST_CORNERS` variables."""
    from pyDOE3 import ff2n

    if space.n_variables > MOST_CORNERS:
        raise InputError(
            f"a full factorial of {space.n_variables} variables has {2**space.n_variables:,} "
            "designs: take a fractional factorial or a space-filling plan"
        )
    return _levels(space, ff2n(space.n_variables))


def fractional_factorial(space: DesignSpace, generators: str) -> RealArray:
    """Return the corners of a regular fraction, (2**n_base, k).

    - `generators`: one word per variable: a single letter is a base variable, a longer word the
      product of base variables. ``"a b c abc"`` is the half fraction of four variables.
    - raises InputError: words that make no plan, two equal columns, or another number of words.
    """
    from pyDOE3 import fracfact

    try:
        levels = fracfact(generators)
    except (ValueError, IndexError) as error:
        raise InputError(
            f"generators '{generators}' make no plan ({error}): write one word of letters per "
            "variable, such as 'a b c abc'"
        ) from error
    return _levels(space, levels)


def box_behnken(space: DesignSpace) -> RealArray:
    """Return the edges' middles of every pair of at least 3 variables, and one middle, (n, k)."""
    from pyDOE3 import bbdesign

    if space.n_variables < 3:
        raise InputError(
            f"a Box-Behnken design of {space.n_variables} variables: take at least 3 variables"
        )
    return _levels(space, bbdesign(space.n_variables, center=1))


def central_composite(space: DesignSpace, generators: str | None = None) -> RealArray:
    """Return corners (all, or those of a fraction), a rotatable star and the middle, (n, k).

    The star lies on the bounds; the corners shrink.
    """
    part = fractional_factorial(space, generators) if generators else full_factorial(space)
    corners = np.where(part == space.upper, 1.0, -1.0)
    star = np.kron(np.eye(space.n_variables), [[-1.0], [1.0]]) * len(corners) ** 0.25
    return _levels(space, np.concatenate([corners, star, np.zeros((1, space.n_variables))]))


def _levels(space: DesignSpace, levels: RealArray) -> RealArray:
    """Put the outermost of coded levels on the bounds; whole numbers have none between."""
    if levels.shape[1] != space.n_variables:
        raise InputError(
            f"the plan has {levels.shape[1]} columns for {space.n_variables} design variables "
            f"{list(space.names)}: it needs one column for each"
        )
    middle, half = (space.lower + space.upper) / 2.0, (space.upper - space.lower) / 2.0
    designs = np.clip(middle + half * levels / np.abs(levels).max(), space.lower, space.upper)
    broken = space.integer & np.any(np.mod(designs, 1.0) != 0.0, axis=0)
    if broken.any():
        raise InputError(
            f"'{space.names[int(np.argmax(broken))]}' takes whole numbers, and the plan has levels "
            "between them: take a space-filling plan"
        )
    return np.asarray(designs)


@checked(designs="n k", responses="n r ?")
class Doe:
    """Designs with their responses.

    - `name`: name of the model and its purpose.
    - `space`: variables, with bounds around the designs.
    - `response_names`, `response_unit`: columns of the responses, and their unit or that of each,
      see `deboom.ResponseFunction`.
    - `designs` (n, k): designs, each once [units of the space].
    - `responses` (n, r): responses, NaN where the design failed [response_unit].
    - `failures`: reason why a design has no responses: ``not finite``, a value that is no number,
      or the error that the model raised with its message; else empty.
    - `plan`: plan that the designs came from, in words.
    """

    name: str
    space: DesignSpace
    response_names: tuple[str, ...]
    response_unit: str
    designs: RealArray
    responses: RealArray
    failures: tuple[str, ...]
    plan: str

    def __len__(self) -> int:
        return len(self.designs)

    @property
    def response_labels(self) -> tuple[str, ...]:
        """Column headers of the responses, ``name [unit]``."""
        pairs = zip(
            self.response_names, units_of(self.response_names, self.response_unit), strict=True
        )
        return tuple(f"{name} [{unit}]" for name, unit in pairs)

    @property
    def failed(self) -> BoolArray:
        """Designs without responses, shape (n,)."""
        return np.array([failure != "" for failure in self.failures], dtype=bool)

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

    - raises InputError: no design, one outside of the bounds, or a model of other variables; a
      model that raises an error for every design, which the text shows.
    """
    check_same_names("the model has the variables", evaluate.variable_names, space.names)
    designs = checked_within(space, designs)
    if len(designs) == 0:
        raise InputError("the plan has no design: there is nothing to evaluate")
    designs = designs[~_repeated(space, designs)]
    values, failures = _evaluated(evaluate, designs)
    if not set(failures) & {"", "not finite"}:
        raise InputError(
            f"the model fails at every design ({len(designs)}), at the first one with "
            f"'{failures[0]}': evaluate the nominal design alone"
        )
    return Doe(
        name=name,
        space=space,
        response_names=evaluate.response_names,
        response_unit=evaluate.response_unit,
        designs=designs,
        responses=values,
        failures=tuple(failures),
        plan=plan,
    )


def designs_of(given: Any, space: DesignSpace) -> RealArray | None:
    """Return designs (n, k) as they are, or of a front, an experiment, a run or a table of them.

    - returns: None for None; of a DataFrame the columns of the variables, ``name [unit]`` or
      ``name``.
    - raises InputError: a table without one of the variables.
    """
    if given is None:
        return None
    if isinstance(given, pd.DataFrame):
        pairs = zip(space.names, space.labels, strict=True)
        columns = [label if label in given else name for name, label in pairs]
        for column, label in zip(columns, space.labels, strict=True):
            if column not in given:
                raise InputError(
                    f"the table of designs has no column '{label}', only "
                    f"{', '.join(map(str, given.columns))}"
                )
        return given[columns].to_numpy(float)
    if isinstance(given, Experiment):
        return given.doe.designs
    given = getattr(given, "front", given)
    given = getattr(given, "values", given)  # designs of a front as it was verified
    return np.atleast_2d(np.asarray(getattr(given, "designs", given), dtype=float))


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


def _repeated(space: DesignSpace, designs: RealArray) -> BoolArray:
    """Which designs, (n, k), come earlier in the list, shape (n,)."""
    width = np.where(space.upper > space.lower, space.upper - space.lower, 1.0)
    scaled = np.round((designs - space.lower) / width / SAME)
    repeated = np.ones(len(designs), dtype=bool)
    repeated[np.unique(scaled, axis=0, return_index=True)[1]] = False
    return repeated


def _evaluated(evaluate: Evaluate, designs: RealArray) -> tuple[RealArray, list[str]]:
    """Responses and reasons of failures; one bad design does not take the others with it."""
    try:
        values, failure = responses(evaluate, designs), "not finite"
    except Exception as error:
        words = said(error)
        if len(designs) > 1:
            parts = [_evaluated(evaluate, design[np.newaxis]) for design in designs]
            reasons = [reason for _, part in parts for reason in part]
            return np.concatenate([part for part, _ in parts]), reasons
        failure = words
        values = np.full((1, len(evaluate.response_names)), np.nan)
    failed = np.asarray(~np.isfinite(values).all(axis=1))
    values = np.where(failed[:, np.newaxis], np.nan, values)
    return values, [failure if bad else "" for bad in failed]


def doe_frame(doe: Doe) -> pd.DataFrame:
    """Return a DOE as a table.

    - raises InputError: a response with the name of a variable or of one of the table's own
      columns.
    """
    taken = [*RESERVED, *doe.space.names]
    for name in doe.response_names:
        if name in taken:
            raise InputError(f"response '{name}' has the name of another column: rename it")
    return pd.DataFrame(
        {
            "doe": doe.name,
            "design": np.arange(1, len(doe) + 1),
            "plan": doe.plan,
            **dict(zip(doe.space.labels, doe.designs.T, strict=True)),
            **{
                label: column
                for label, column in zip(doe.response_labels, doe.responses.T, strict=True)
            },
            "failure": list(doe.failures),
        }
    )


@dataclass(frozen=True, eq=False)
class Experiment(Tabled):
    """Designs with their responses.

    Parameters
    ----------
    doe : Doe
        Designs, responses, failures.
    n_lines : int or None
        Lines that each response is the sum of; None where that is not kept.
    """

    doe: Doe
    n_lines: int | None = 1

    @property
    def table(self) -> pd.DataFrame:
        """One row per design: variables, responses, their sum, and mean per response and line.

        Responses of several units have neither sum nor mean.
        """
        unit, *others = dict.fromkeys(units_of(self.doe.response_names, self.doe.response_unit))
        names, table = self.doe.response_names, doe_frame(self.doe)
        if others:
            return table
        total = table[list(self.doe.response_labels)].sum(axis=1, skipna=False)
        table = table.assign(**{f"sum [{unit}]": total})
        if self.n_lines is None:
            return table
        return table.assign(**{f"mean per line [{unit}]": total / (len(names) * self.n_lines)})

    def front(self, minimised: Sequence[str] | None = None) -> pd.DataFrame:
        """Return the rows of the table that no other design beats.

        - `minimised`: names of the responses that are to be small; by default all.
        - raises InputError: a name that is no response; no design with responses.
        """
        names = self.doe.response_names
        wanted = tuple(minimised) if minimised is not None else names
        missing = [name for name in wanted if name not in names]
        if missing or not wanted:
            raise InputError(f"no response {missing}: minimise some of {list(names)}")
        if self.doe.failed.all():
            raise InputError("no design has responses: there is no front")
        columns = [names.index(name) for name in wanted]
        rows = np.flatnonzero(~self.doe.failed)
        best = nondominated(self.doe.responses[rows][:, columns])
        return pd.DataFrame(self.table.iloc[rows[best]])


def doe(model: Evaluate, space: DesignSpace, *, n: int = 256, seed: int = 1) -> Experiment:
    """Evaluate a Latin hypercube of designs.

    Parameters
    ----------
    model : BoomingModel or any other evaluation
        Designs, shape (n, k) → responses, shape (n, r).
    space : DesignSpace
        Bounds of the designs.
    n : int
        Number of designs, at least 2.
    seed : int
        Seed from 1.

    Returns
    -------
    Experiment
        ``table``: variables [units of the space], responses, their sums; ``doe``: the arrays.

    Raises
    ------
    InputError
        A model without names; variables that differ; fewer than 2 designs; a seed below 1.

    See Also
    --------
    deboom.correlation, deboom.read_designs, deboom.sobol, deboom.surrogate_search

    Examples
    --------
    >>> import deboom
    >>> square = deboom.ResponseFunction(lambda x: x**2, ("a",), ("y",), "dB")
    >>> deboom.doe(square, square.design_space(), n=16).table.shape[0]
    16
    """
    check_fits(model, space)
    check_repeats(model, space)
    n = whole_number(n, "n, the number of designs")
    designs = latin_hypercube(space, n, seed=seed)
    run = run_doe(model, space, designs, name="notebook", plan=f"{n} designs, seed {seed}")
    return Experiment(run, getattr(model, "n_lines", 1))
