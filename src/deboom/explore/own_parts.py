"""Vehicles that are built from pieces of their own, perhaps of one part number and batch."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from deboom.arrays import RealArray
from deboom.explore.space import DesignSpace, Evaluate


@dataclass(frozen=True)
class OwnParts:
    """A model in which every response has variables of its own.

    One draw then stands for a set of vehicles, each with its own pieces. Only numbers of several
    responses together depend on it, such as how often all vehicles of a set stay within a limit:
    mean, standard deviation and share of one response are those of the model itself.

    Parameters
    ----------
    evaluate : Evaluate
        With k variables and r responses.
    """

    evaluate: Evaluate

    @property
    def variable_names(self) -> tuple[str, ...]:
        """``<response> <variable>``, the variables of the first response first; r k of them."""
        inner = self.evaluate
        return tuple(f"{r} {name}" for r in inner.response_names for name in inner.variable_names)

    @property
    def response_names(self) -> tuple[str, ...]:
        """Those of the model."""
        return self.evaluate.response_names

    @property
    def response_unit(self) -> str:
        """That of the model."""
        return self.evaluate.response_unit

    def __call__(self, designs: RealArray) -> RealArray:
        """Return the responses, shape (n, r), of designs, shape (n, r k)."""
        own = [self.evaluate(part)[:, place] for place, part in enumerate(self._split(designs))]
        return np.column_stack(own)

    def gradient(self, designs: RealArray) -> RealArray:
        """Return the derivatives of the responses, shape (n, r, r k)."""
        parts = self._split(designs)
        model: Any = self.evaluate
        width = parts[0].shape[1]
        found = np.zeros((len(designs), len(parts), designs.shape[1]))
        for place, part in enumerate(parts):
            own = slice(place * width, (place + 1) * width)
            found[:, place, own] = model.gradient(part)[:, place]
        return found

    def widened(self, space: DesignSpace) -> DesignSpace:
        """Return the design space of all vehicles, from that of the model."""
        count = len(self.response_names)
        return replace(
            space,
            names=self.variable_names,
            units=space.units * count,
            **{
                column: np.tile(getattr(space, column), count)
                for column in ("nominal", "lower", "upper", "tolerance", "integer")
            },
        )

    def _split(self, designs: RealArray) -> list[RealArray]:
        return np.split(np.asarray(designs), len(self.response_names), axis=1)
