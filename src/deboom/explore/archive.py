"""What a search keeps: its front, its failures, and every evaluation, also beyond its process."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray, frozen_copy
from deboom.errors import InputError
from deboom.explore.front import ParetoFront, hypervolume, pareto_front
from deboom.explore.limits import Limits
from deboom.explore.robust import Robust, RobustValues
from deboom.explore.space import DesignSpace

AnyArray = npt.NDArray[Any]
Arrays = Mapping[str, AnyArray]
"""Arrays by name: numbers, booleans or text, never objects."""


class Store(Protocol):
    """Where one search keeps what must survive, such as a folder."""

    def save(self, arrays: Arrays, facts: Mapping[str, Any]) -> None:
        """Replace the state in one step; `facts` is what JSON can hold."""

    def load(self) -> tuple[Arrays, Mapping[str, Any]] | None:
        """Return the last state saved; None before the first."""

    def keep(self, number: int, arrays: Arrays) -> None:
        """Keep the evaluations of one generation, the first being number 1."""

    def kept(self, number: int) -> Arrays | None:
        """Return the evaluations of one generation; None if they were not kept."""


@dataclass(frozen=True)
class Checkpoint:
    """Keep a search's state in a store, and start from the state found there.

    Evaluations are kept after every generation, whatever `every` says: a search that goes on from
    an older state takes them from the store instead of computing them again.

    Parameters
    ----------
    store : Store
        Of this search alone.
    every : int
        Generations between two states.

    Raises
    ------
    InputError
        Fewer than one generation.
    """

    store: Store
    every: int = 5

    def __post_init__(self) -> None:
        if self.every < 1:
            raise InputError(
                f"a checkpoint every {self.every} generations: take a whole number from 1"
            )

    def due(self, generation: int, last: int) -> bool:
        """Return whether the state after a generation is to be saved."""
        return generation == last or generation % self.every == 0


def generator_state(random: np.random.Generator) -> dict[str, Any]:
    """Return the state of a random generator as facts that JSON can hold."""
    return dict(random.bit_generator.state)


def restore_generator(random: np.random.Generator, state: Mapping[str, Any]) -> None:
    """Put a random generator into a state of `generator_state`.

    Raises
    ------
    InputError
        A state of another kind of generator.
    """
    try:
        random.bit_generator.state = dict(state)
    except (ValueError, TypeError, KeyError):
        raise InputError(
            f"the checkpoint holds no state of a {type(random.bit_generator).__name__} random "
            "generator: it was made by another version; start the search anew"
        ) from None


def check_same_search(facts: Mapping[str, Any], asked: Mapping[str, Any]) -> None:
    """Refuse to go on from the state of another search.

    Parameters
    ----------
    facts : mapping
        Of the state.
    asked : mapping
        What the search is asked for now, by name.

    Raises
    ------
    InputError
        Names the first difference.
    """
    for name, value in asked.items():
        if facts.get(name) != value:
            raise InputError(
                f"what was kept belongs to {name} {facts.get(name)!r}, not {value!r}: "
                "go on with the former or start anew"
            )


COLUMNS = tuple(column.name for column in fields(RobustValues))


@dataclass(frozen=True, eq=False)
class SearchResult:
    """What a search found and how.

    Parameters
    ----------
    front : ParetoFront
        Of all designs seen, not only of the last population.
    n_evaluated : int
        Designs evaluated.
    failed_designs : array, shape (n_failed, k)
        Designs that could not be computed.
    hypervolume : array, shape (n_generations,)
        Of the front after each generation [product of the objectives' units].
    reference_point : array, shape (m,)
        Of the hypervolume: the worst objectives in the first generation [their units].
    seed : int
        Of the search.
    seconds : float
        Wall time; of a resumed search, of all its parts up to their last checkpoints [s].
    infeasible_designs : array, shape (n_infeasible, k)
        Designs that were computed and miss a limit.
    infeasible_excess : array, shape (n_infeasible, c)
        By how much they miss each limit, see `RobustValues.excess`.
    """

    front: ParetoFront
    n_evaluated: int
    failed_designs: RealArray
    hypervolume: RealArray
    reference_point: RealArray
    seed: int
    seconds: float
    infeasible_designs: RealArray = field(default_factory=lambda: np.empty((0, 0)))
    infeasible_excess: RealArray = field(default_factory=lambda: np.empty((0, 0)))

    def __post_init__(self) -> None:
        for name in (
            "failed_designs",
            "hypervolume",
            "reference_point",
            "infeasible_designs",
            "infeasible_excess",
        ):
            object.__setattr__(self, name, frozen_copy(np.asarray(getattr(self, name))))

    @property
    def n_failed(self) -> int:
        """Designs that could not be computed."""
        return len(self.failed_designs)

    @property
    def n_infeasible(self) -> int:
        """Designs that were computed and miss a limit."""
        return len(self.infeasible_designs)


def merge(searches: Sequence[SearchResult]) -> SearchResult:
    """Return several searches of one problem, such as of several seeds, as one.

    Parameters
    ----------
    searches : sequence of SearchResult
        At least one.

    Returns
    -------
    SearchResult
        With the front of all fronts, the seed of the first search, counts, failures and seconds
        added up, and of the hypervolumes only the final one, up to the worst reference point.

    Raises
    ------
    InputError
        No search.
    """
    if not searches:
        raise InputError("there are no searches to merge: bring at least one")
    front = pareto_front(*(search.front for search in searches))
    reference = np.max([search.reference_point for search in searches], axis=0)
    return SearchResult(
        front=front,
        n_evaluated=sum(search.n_evaluated for search in searches),
        failed_designs=np.concatenate([search.failed_designs for search in searches]),
        hypervolume=np.array([hypervolume(front.objectives, reference)]),
        reference_point=reference,
        seed=searches[0].seed,
        seconds=sum(search.seconds for search in searches),
        infeasible_designs=np.concatenate([search.infeasible_designs for search in searches]),
        infeasible_excess=np.concatenate([search.infeasible_excess for search in searches]),
    )


class Archive:
    """Hands designs on to a robust response and keeps what a search must not lose.

    A search asks once per generation. With a store, each generation's values are kept at once, and
    a generation that the store already holds is not computed again.

    Parameters
    ----------
    robust : Robust
        What is searched.
    store : Store, optional
        Where values survive the process.
    """

    def __init__(self, robust: Robust, store: Store | None = None) -> None:
        self.robust = robust
        self.store = store
        self.front: ParetoFront | None = None
        self.n_evaluated = 0
        self.failed_designs = np.empty((0, robust.space.n_variables))
        self.infeasible_designs = np.empty((0, robust.space.n_variables))
        self.infeasible_excess = np.empty((0, len(self.limits.names) if self.limits else 0))
        self.reference_point = np.empty(0)
        self.hypervolume: list[float] = []

    @property
    def space(self) -> DesignSpace:
        """The designs that may be asked for."""
        return self.robust.space

    @property
    def n_objectives(self) -> int:
        """How many objectives the values have."""
        return int(getattr(self.robust, "n_objectives", 2))

    @property
    def limits(self) -> Limits | None:
        """What the designs must keep."""
        return getattr(self.robust, "limits", None)

    @property
    def generation(self) -> int:
        """Number of generations seen."""
        return len(self.hypervolume)

    def __call__(self, designs: RealArray) -> RobustValues:
        """Return the values of one generation, and keep them."""
        values = self._values(designs)
        self.n_evaluated += len(values)
        self.failed_designs = np.concatenate([self.failed_designs, values.designs[values.failed]])
        missing = ~values.failed & ~values.feasible
        for name in ("designs", "excess"):
            kept = getattr(self, f"infeasible_{name}")
            more = getattr(values, name)[missing]
            setattr(self, f"infeasible_{name}", np.concatenate([kept, more]))
        if self.front is None:
            self.reference_point = _worst_objectives(values)
            self.front = pareto_front(values)
        else:
            self.front = pareto_front(self.front, values)
        self.hypervolume.append(hypervolume(self.front.objectives, self.reference_point))
        return values

    def _values(self, designs: RealArray) -> RobustValues:
        if self.store is None:
            return self.robust(designs)
        number = self.generation + 1
        kept = self.store.kept(number)
        if kept is not None and np.array_equal(kept["designs"], designs):
            return RobustValues(**{name: kept[name] for name in COLUMNS})
        values = self.robust(designs)
        self.store.keep(number, {name: getattr(values, name) for name in COLUMNS})
        return values

    def summary(self) -> str:
        """Return one line of text about the last generation."""
        n_failed = len(self.failed_designs)
        failed = f", {n_failed} failed" if n_failed else ""
        n_missing = len(self.infeasible_designs)
        missing = f", {n_missing} beyond limits" if n_missing else ""
        return f"hypervolume {self.hypervolume[-1]:.5g}{failed}{missing}"

    def result(self, seed: int, seconds: float) -> SearchResult:
        """Return what was found; at least one generation must have been seen.

        Raises
        ------
        InputError
            No design keeps all limits: says which limit binds and by how much.
        """
        assert self.front is not None
        if len(self.front) == 0 and self.limits is not None:
            raise InputError(
                f"none of the {self.n_evaluated} designs of this search keeps all limits: "
                f"{self.limits.closest(self.infeasible_excess)}; relax that limit or widen the "
                "bounds of the design space"
            )
        return SearchResult(
            front=self.front,
            n_evaluated=self.n_evaluated,
            failed_designs=self.failed_designs,
            hypervolume=np.asarray(self.hypervolume),
            reference_point=self.reference_point,
            seed=seed,
            seconds=seconds,
            infeasible_designs=self.infeasible_designs,
            infeasible_excess=self.infeasible_excess,
        )

    def state(self) -> tuple[dict[str, AnyArray], dict[str, Any]]:
        """Return everything kept, as named arrays and as facts that JSON can hold."""
        assert self.front is not None
        arrays: dict[str, AnyArray] = {
            "failed_designs": self.failed_designs,
            "reference_point": self.reference_point,
            "hypervolume": np.asarray(self.hypervolume),
            "infeasible_designs": self.infeasible_designs,
            "infeasible_excess": self.infeasible_excess,
        }
        arrays |= {f"front.{name}": getattr(self.front, name) for name in COLUMNS}
        return arrays, {"n_evaluated": self.n_evaluated}

    def restore(self, arrays: Arrays, facts: Mapping[str, Any]) -> None:
        """Go back to a state of `state`."""
        self.front = ParetoFront(**{name: arrays[f"front.{name}"] for name in COLUMNS})
        self.failed_designs = arrays["failed_designs"]
        self.infeasible_designs = arrays["infeasible_designs"]
        self.infeasible_excess = arrays["infeasible_excess"]
        self.reference_point = arrays["reference_point"]
        self.hypervolume = arrays["hypervolume"].tolist()
        self.n_evaluated = facts["n_evaluated"]


def _worst_objectives(values: RobustValues) -> RealArray:
    if np.all(values.failed):
        raise InputError(
            f"none of the {len(values)} designs of the first generation could be computed: "
            "evaluate the nominal design alone and check the bounds of the design space"
        )
    return np.asarray(values.objectives[~values.failed].max(axis=0))
