"""Designs by the million, a chunk at a time: constant memory, and no chunk computed twice."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import count
from typing import Any, Protocol

import numpy as np
from scipy.stats import qmc

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.checkpoint import Arrays, Store, check_same_search
from deboom.explore.design_space import DesignSpace
from deboom.explore.evaluate import Evaluate, responses
from deboom.explore.seeds import checked_seed, generator

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
