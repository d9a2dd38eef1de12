"""How a search survives its process: its state now and then, its evaluations always.

This room writes no files. It hands named arrays, and facts that JSON can hold, to a store, and a
search that gets its state back goes on bit for bit as if it had never stopped.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError

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
