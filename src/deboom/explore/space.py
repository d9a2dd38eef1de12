"""What can be explored: a design space, an evaluation behind one seam,."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from deboom.arrays import BoolArray, RealArray, frozen_copy
from deboom.errors import InputError


def checked_seed(seed: int) -> int:
    """Return the seed, or refuse it.

    Raises
    ------
    InputError
        Anything but an integer from 1 upwards; some libraries read 0 as "no seed".
    """
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 1:
        raise InputError(f"seed {seed!r} is not an integer from 1 upwards: choose one, such as 1")
    return int(seed)


def generator(seed: int, purpose: str, *words: int) -> np.random.Generator:
    """Return the generator of one purpose.

    Parameters
    ----------
    seed : int
        From 1 upwards.
    purpose : str
        Such as ``"search sample"``. Streams of different purposes are independent, so that the
        verification never meets the numbers of the search although both are given one seed.
    *words : int
        Further entropy, such as the bytes of one design.

    Raises
    ------
    InputError
        A seed that is not an integer from 1 upwards.
    """
    entropy = [checked_seed(seed), *words]
    key = zlib.crc32(purpose.encode())
    return np.random.default_rng(np.random.SeedSequence(entropy, spawn_key=(key,)))


SIGMAS_PER_TOLERANCE = 3.0
"""A tolerance's half width is this many standard deviations of the scatter [1]."""


@dataclass(frozen=True, eq=False)
class DesignSpace:
    """Design variables with units, nominal values, bounds and tolerances.

    ``dataclasses.replace`` gives a changed copy.

    Parameters
    ----------
    names, units : sequence of str, length k
        Name and unit of each variable; ``"1"`` is a plain number.
    nominal, lower, upper : array, shape (k,)
        Today's design and the bounds of the search [units]. Equal bounds hold a variable fixed.
    tolerance : array, shape (k,)
        Half width of the manufacturing scatter as a fraction of the design's own value [1]. It
        stands for three standard deviations; 0 means exactly made.
    integer : array of bool, shape (k,), optional
        Variables that take whole numbers only, such as the number of a part in a catalogue; their
        bounds and nominal values are whole and they have no tolerance. Default is none.

    Raises
    ------
    InputError
        Names the variable that has reversed bounds, a nominal value outside of them, a value that
        is not finite, no unit, a name used twice, a tolerance outside 0 <= tolerance < 1 (from 1 on
        the scatter would change the sign of a design), or a whole-number variable with a fraction
        or a tolerance.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    nominal: RealArray
    lower: RealArray
    upper: RealArray
    tolerance: RealArray
    integer: BoolArray = field(default_factory=lambda: np.empty(0, dtype=bool))

    def __post_init__(self) -> None:
        if np.size(self.integer) == 0:
            object.__setattr__(self, "integer", np.zeros(len(self.names), dtype=bool))
        object.__setattr__(self, "names", tuple(self.names))
        object.__setattr__(self, "units", tuple(self.units))
        if not self.names:
            raise InputError("a design space needs at least one variable")
        for column in ("units", "nominal", "lower", "upper", "tolerance", "integer"):
            count = np.shape(getattr(self, column))
            if count != (len(self.names),):
                raise InputError(
                    f"the design space names {len(self.names)} variables, but its {column} have "
                    f"shape {count}: give one value per variable"
                )
        for column in ("nominal", "lower", "upper", "tolerance"):
            values = np.asarray(getattr(self, column), dtype=float)
            object.__setattr__(self, column, frozen_copy(values))
        object.__setattr__(self, "integer", frozen_copy(np.asarray(self.integer, dtype=bool)))
        for position, name in enumerate(self.names):
            self._check_variable(position, name)

    def _check_variable(self, position: int, name: str) -> None:
        if self.names.count(name) > 1:
            raise InputError(
                f"design variable '{name}' appears {self.names.count(name)} times: "
                "every variable needs a name of its own"
            )
        if not self.units[position].strip():
            raise InputError(
                f"design variable '{name}' has no unit: give one, '1' for a plain number"
            )
        nominal, lower, upper = (
            float(values[position]) for values in (self.nominal, self.lower, self.upper)
        )
        tolerance = float(self.tolerance[position])
        if not np.all(np.isfinite([nominal, lower, upper, tolerance])):
            raise InputError(
                f"design variable '{name}' has a nominal value, bound or tolerance that is not "
                "finite: give a number"
            )
        if lower > upper:
            raise InputError(
                f"design variable '{name}' has its bounds reversed: lower {lower:g} is above "
                f"upper {upper:g}"
            )
        if not lower <= nominal <= upper:
            raise InputError(
                f"design variable '{name}' has the nominal value {nominal:g} outside its bounds "
                f"{lower:g} to {upper:g}: move one of them"
            )
        if not 0.0 <= tolerance < 1.0:
            raise InputError(
                f"design variable '{name}' has the tolerance {tolerance:g}: give the half width "
                "as a fraction of the design's value, from 0 up to but not including 1"
            )
        whole = np.all(np.mod([nominal, lower, upper], 1.0) == 0.0)
        if self.integer[position] and not (whole and tolerance == 0.0):
            raise InputError(
                f"design variable '{name}' takes whole numbers: give whole bounds, a whole nominal "
                "value and the tolerance 0"
            )

    @property
    def n_variables(self) -> int:
        """Number k of variables."""
        return len(self.names)

    @property
    def labels(self) -> tuple[str, ...]:
        """Column headers, ``name [unit]``."""
        return tuple(f"{n} [{u}]" for n, u in zip(self.names, self.units, strict=True))

    @property
    def relative_sigma(self) -> RealArray:
        """Standard deviation of the scatter as a fraction of the design's value, shape (k,) [1]."""
        return self.tolerance / SIGMAS_PER_TOLERANCE

    def checked(self, designs: RealArray) -> RealArray:
        """Return the designs as a finite array of shape (n, k), or refuse them.

        Raises
        ------
        InputError
            Another number of columns, or a value that is not finite. Designs outside the bounds
            are allowed: what a search keeps out, a question may ask for.
        """
        array = np.asarray(designs, dtype=float)
        if array.ndim != 2 or array.shape[1] != self.n_variables:
            raise InputError(
                f"designs have shape {array.shape}, expected one row per design and "
                f"{self.n_variables} columns {list(self.names)}"
            )
        if not np.all(np.isfinite(array)):
            row, column = np.argwhere(~np.isfinite(array))[0]
            raise InputError(
                f"design {row} has a value for '{self.names[column]}' that is not finite"
            )
        return array


def stiffness_factor_space(
    names: Sequence[str], half_width: float = 0.20, tolerance: float = 0.15
) -> DesignSpace:
    """Return the space of factors on today's stiffnesses.

    Parameters
    ----------
    names : sequence of str
        One per factor, such as ``TSM x``.
    half_width : float
        The search runs from ``1 - half_width`` to ``1 + half_width`` [1].
    tolerance : float
        Manufacturing scatter of the design's own stiffness, half width = three standard
        deviations [1]. The default is ±15 % (σ = 5 %); 0.45 reads the same 15 % as one σ.

    Returns
    -------
    DesignSpace
        Nominal value 1 for every factor.

    Raises
    ------
    InputError
        See `DesignSpace`; also a half width that would reach a stiffness of zero.
    """
    if not 0.0 <= half_width < 1.0:
        raise InputError(
            f"stiffness factors in 1 ± {half_width:g}: give a half width from 0 up to but not "
            "including 1"
        )
    ones = np.ones(len(names))
    return DesignSpace(
        names=tuple(names),
        units=("1",) * len(names),
        nominal=ones,
        lower=ones - half_width,
        upper=ones + half_width,
        tolerance=ones * tolerance,
    )


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
