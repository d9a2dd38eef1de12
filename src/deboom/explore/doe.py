"""A design of experiments: every design that was evaluated, with its responses or its failure."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
import numpy.typing as npt

from deboom.arrays import BoolArray, RealArray, frozen_copy
from deboom.errors import InputError
from deboom.explore.design_space import DesignSpace
from deboom.explore.evaluate import Evaluate, responses

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
