"""The seam: designs in, responses out.

Everything in this room drives an object of this shape and knows nothing of what is behind it: the
booming index of a vehicle fleet, a supplier's finite-element model, a spreadsheet.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError


class Evaluate(Protocol):
    """What can be explored: ``evaluate(designs (n, k)) -> responses (n, r)``.

    Rows are independent of each other, and the same design always gives the same responses. An
    object of a module-level class can be carried by a process pool, a closure cannot. A design
    that cannot be computed gives a row that is not finite, or raises ``ArithmeticError`` or
    ``numpy.linalg.LinAlgError``.
    """

    @property
    def variable_names(self) -> tuple[str, ...]:
        """Name of each column of the designs."""

    @property
    def response_names(self) -> tuple[str, ...]:
        """Name of each column of the responses."""

    @property
    def response_unit(self) -> str:
        """Unit of all responses."""

    def __call__(self, designs: RealArray) -> RealArray:
        """Return the responses, shape (n, r) [response_unit], of the designs, shape (n, k)."""


@dataclass(frozen=True)
class ResponseFunction:
    """A plain function with the names that make it explorable.

    Parameters
    ----------
    function : callable
        From designs, shape (n, k), to responses, shape (n, r) [response_unit].
    variable_names, response_names : tuple of str
        Name of each column of the designs and of the responses.
    response_unit : str
        Unit of all responses.

    Examples
    --------
    >>> import numpy as np
    >>> def levels(designs):
    ...     return 60.0 + 20.0 * np.log10(designs @ np.array([[0.7, 0.2], [0.3, 0.8]]))
    >>> cabin = ResponseFunction(levels, ("TSM x", "GeM x"), ("sedan", "tourer"), "dB")
    >>> cabin(np.ones((1, 2)))
    array([[60., 60.]])
    """

    function: Callable[[RealArray], RealArray]
    variable_names: tuple[str, ...]
    response_names: tuple[str, ...]
    response_unit: str

    def __call__(self, designs: RealArray) -> RealArray:
        """Return the function's responses."""
        return self.function(designs)


def responses(evaluate: Evaluate, designs: RealArray) -> RealArray:
    """Evaluate designs and hold the answer to the shape that was promised.

    Parameters
    ----------
    evaluate : Evaluate
        With k variables and r responses.
    designs : array, shape (n, k)

    Returns
    -------
    array, shape (n, r)
        [evaluate.response_unit]; rows that could not be computed are not finite.

    Raises
    ------
    InputError
        A result of another shape.
    """
    values = np.asarray(evaluate(designs), dtype=float)
    promised = (len(designs), len(evaluate.response_names))
    if values.shape != promised:
        raise InputError(
            f"{type(evaluate).__name__} gave an array of shape {values.shape} for {promised[0]} "
            f"designs and {promised[1]} named responses: return shape {promised}"
        )
    return values
