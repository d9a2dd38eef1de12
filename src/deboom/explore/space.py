"""Design spaces, models as functions of designs, and seeded random streams."""

from __future__ import annotations

import numbers
import re
import warnings
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt
from scipy.stats import qmc

from deboom.arrays import BoolArray, RealArray, checked, checked_array
from deboom.errors import DataWarning, InputError
from deboom.explore.choices import Distribution

SIGMAS_PER_TOLERANCE = 3.0
"""Standard deviations of the scatter in the half width of a tolerance [1]."""
LARGEST_UNCUT = 6.3
"""Bound of a draw that is not cut, in standard deviations: 1.5e-10 of all lie beyond [1]."""


@checked(nominal="k ?", lower="k ?", upper="k ?", tolerance="k ?")
class DesignSpace:
    """Design variables with units, nominal values, bounds and tolerances.

    Parameters
    ----------
    names, units : tuple of str, length k
        Name and unit of each variable; ``"1"`` is a plain number.
    nominal, lower, upper : array, shape (k,)
        Today's design and the bounds of the search [units]. Equal bounds hold a variable fixed.
    tolerance : array, shape (k,)
        Half width of the manufacturing scatter as a fraction of the design's own value, three
        standard deviations; 0 means exactly made [1].
    integer : array of bool, shape (k,), optional
        Variables that take whole numbers only, such as the number of a part in a catalogue.
    absolute : array of bool, shape (k,), optional
        Variables whose tolerance is in their unit, whatever their value, such as an offset of
        0 mm ± 3 mm; by default none.
    distribution : sequence of str, length k, optional
        ``normal`` (cut at the tolerance, the default), ``normal-uncut``, ``uniform`` (within the
        tolerance), ``lognormal`` (``x exp(σ z)``, cut) or ``lognormal-uncut``.

    Raises
    ------
    InputError
        Names the variable whose bounds, nominal value, unit, name or tolerance cannot be: a
        relative tolerance of a variable that could change its sign lies in 0 <= tolerance < 1, or
        below 0.476 without cut; of a whole-number variable it is 0, all else whole.

    See Also
    --------
    deboom.ResponseFunction, deboom.Robust, deboom.doe, deboom.read_designs

    Examples
    --------
    >>> import deboom
    >>> space = deboom.DesignSpace(("TSM x",), ("1",), [1.0], [0.8], [1.2], [0.15])
    >>> space.labels, space.relative_sigma
    (('TSM x [1]',), array([0.05]))
    >>> offset = deboom.DesignSpace(("y",), ("mm",), [0.0], [-5.0], [5.0], [3.0], absolute=[True])
    >>> offset.sigma([0.0])
    array([1.])
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    nominal: RealArray
    lower: RealArray
    upper: RealArray
    tolerance: RealArray
    integer: BoolArray = field(default_factory=lambda: np.empty(0, dtype=bool))
    absolute: BoolArray = field(default_factory=lambda: np.empty(0, dtype=bool))
    distribution: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not self.names:
            raise InputError("a design space needs at least one variable")
        counts = (len(self.units), self.nominal.size)
        if counts != (len(self.names),) * 2:
            raise InputError(
                f"the design space names {len(self.names)} variables, but has {counts[0]} units "
                f"and {counts[1]} nominal values: give one value per variable"
            )
        for name in ("integer", "absolute"):
            given = getattr(self, name)
            marked = given if np.size(given) else np.zeros(len(self.names))
            marked = checked_array(marked, "k", name, {"k": len(self.names)}, bool)
            object.__setattr__(self, name, marked)
        self._set_distribution()
        for column, name in enumerate(self.names):
            self._check_variable(column, name)

    def _set_distribution(self) -> None:
        given = self.distribution or (Distribution.normal,) * len(self.names)
        if len(given) != len(self.names) or not set(given) <= set(Distribution):
            raise InputError(
                f"distributions {list(given)} of the variables {list(self.names)}: give each "
                f"variable one of {', '.join(Distribution)}"
            )
        object.__setattr__(self, "distribution", tuple(Distribution(each) for each in given))

    def _check_variable(self, column: int, name: str) -> None:
        nominal, lower, upper, tolerance = (
            float(values[column])
            for values in (self.nominal, self.lower, self.upper, self.tolerance)
        )
        shape, absolute = Distribution(self.distribution[column]), bool(self.absolute[column])
        most = SIGMAS_PER_TOLERANCE / LARGEST_UNCUT if shape is Distribution.normal_uncut else 1.0
        keeps_sign = absolute or shape.is_logarithmic
        whole = tolerance == 0.0 and all(value % 1.0 == 0.0 for value in (nominal, lower, upper))
        faults = {
            f"appears {self.names.count(name)} times: every variable needs a name of its own": (
                self.names.count(name) > 1
            ),
            "has no unit: give one, '1' for a plain number": not self.units[column].strip(),
            "has a nominal value, bound or tolerance that is not finite: give a number": (
                not np.isfinite([nominal, lower, upper, tolerance]).all()
            ),
            f"has its bounds reversed: lower {lower:g} is above upper {upper:g}": lower > upper,
            f"has the nominal value {nominal:g} outside its bounds {lower:g} to {upper:g}: move "
            "one of them": not lower <= nominal <= upper,
            f"has the tolerance {tolerance:g}: give the half width as a fraction of the design's "
            f"value, from 0 up to but not including {most:.3g}, or in its unit with absolute": (
                not 0.0 <= tolerance < (np.inf if keeps_sign else most)
            ),
            "scatters by its logarithm, and so by a fraction of its value: give a relative "
            "tolerance": absolute and shape.is_logarithmic,
            "takes whole numbers: give whole bounds, a whole nominal value and the tolerance 0": (
                bool(self.integer[column]) and not whole
            ),
        }
        for words, wrong in faults.items():
            if wrong:
                raise InputError(f"design variable '{name}' {words}")

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
        """Standard deviation of the scatter as a fraction of the design's value, shape (k,) [1].

        Of an absolute tolerance it is in the unit of the variable.
        """
        return self.tolerance / SIGMAS_PER_TOLERANCE

    @property
    def is_relative_normal(self) -> bool:
        """Whether all variables are made as ``x (1 + σ_rel z)`` with normal, cut draws ``z``."""
        return not self.absolute.any() and set(self.distribution) == {Distribution.normal}

    def sigma(self, design: npt.ArrayLike) -> RealArray:
        """Return a third of the half width of the tolerances of designs (..., k) [units]."""
        size = np.where(self.absolute, 1.0, np.abs(np.asarray(design, dtype=float)))
        return np.asarray(size * self.relative_sigma)

    def checked(self, designs: npt.ArrayLike) -> RealArray:
        """Return designs as a finite array (n, k), inside or outside the bounds, or refuse them."""
        return checked_designs(designs, self.names)

    def made_whole(self, designs: RealArray) -> RealArray:
        """Return designs (n, k) whose whole-number variables have the nearest of their options."""
        whole = np.clip(np.round(designs), self.lower, self.upper)
        return np.where(self.integer, whole, designs)


def checked_designs(designs: npt.ArrayLike, names: Sequence[str]) -> RealArray:
    """Return designs as a finite array (n, k), one row per design, or refuse them."""
    rows = np.asarray(designs, dtype=float)
    if rows.ndim != 2 or rows.shape[1] != len(names):
        raise InputError(
            f"designs of shape {rows.shape}: give one row per design with the {len(names)} columns "
            f"{list(names)}"
        )
    if not np.isfinite(rows).all():
        row, column = np.argwhere(~np.isfinite(rows))[0]
        raise InputError(
            f"design {row}: {names[column]} is {rows[row, column]}, give a finite number"
        )
    return rows


def stiffness_factor_space(
    names: Sequence[str], half_width: float = 0.20, tolerance: float = 0.15
) -> DesignSpace:
    """Return the space of factors on today's stiffnesses, each with the nominal value 1.

    - `names`: names of the factors, such as ``TSM x``.
    - `half_width`: half width of the search about 1, below 1 [1].
    - `tolerance`: half width of the manufacturing scatter, three standard deviations [1]. The
      default is ±15 % (σ = 5 %); 0.45 reads the same 15 % as one σ.
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

    Rows are independent of each other, and the same design always gives the same responses. A
    design that cannot be computed gives a row that is not finite, or raises any error of its own. A
    process pool carries objects of importable classes, no closures.
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
        """Return the responses, shape (n, r), of the designs, shape (n, k)."""


class Differentiable(Evaluate, Protocol):
    """An evaluation with exact derivatives."""

    def gradient(self, designs: RealArray) -> RealArray:
        """Return the derivatives of the responses by the variables, shape (n, r, k)."""


@dataclass(frozen=True)
class ResponseFunction:
    """A function of designs with the names and the unit that an exploration needs.

    Parameters
    ----------
    function : callable
        Responses, shape (n, r) [response_unit], of designs, shape (n, k).
    variable_names, response_names : tuple of str
        Name of each column of the designs and of the responses.
    response_unit : str
        Unit of all responses, or one of each, such as ``"dB(A), kg"``: objectives and limits are
        then of single responses.
    n_lines : int
        Number of lines if each response is a sum over lines, such as SPLV; results then have the
        mean over the lines as well.
    smooth : bool
        Whether searches may follow gradients from differences of the function; not where it has
        steps or noise.

    Raises
    ------
    InputError
        At a call: the function does not accept designs of k columns.

    See Also
    --------
    deboom.DesignSpace, deboom.Robust, deboom.surrogate_search, deboom.BoomingModel

    Examples
    --------
    >>> import deboom, numpy as np
    >>> def levels(designs):
    ...     return 60.0 + 20.0 * np.log10(designs @ np.array([[0.7, 0.2], [0.3, 0.8]]))
    >>> cabin = deboom.ResponseFunction(levels, ("TSM x", "GeM x"), ("sedan", "tourer"), "dB")
    >>> cabin(np.ones((1, 2)))
    array([[60., 60.]])
    """

    function: Callable[[RealArray], RealArray]
    variable_names: tuple[str, ...]
    response_names: tuple[str, ...]
    response_unit: str
    n_lines: int = 1
    smooth: bool = True

    def __call__(self, designs: RealArray) -> RealArray:
        """Return the function's responses; of a single one a plain vector will do."""
        try:
            # a function that writes into its argument does not change the designs
            values = real_numbers(
                self.function(self._argument(np.array(designs, dtype=float))), self.response_names
            )
        except (InputError, np.linalg.LinAlgError):
            raise
        except (TypeError, ValueError) as error:
            raise InputError(
                f"the function of {list(self.response_names)} refuses designs of shape "
                f"{np.shape(designs)}, one column for each of {list(self.variable_names)}: {error}"
            ) from error
        return values[:, np.newaxis] if values.ndim == len(self.response_names) == 1 else values

    def _argument(self, designs: RealArray) -> Any:
        """Return designs, as a DataFrame for a regressor that was fitted on one."""
        fitted_on = getattr(getattr(self.function, "__self__", None), "feature_names_in_", None)
        if fitted_on is None:
            return designs
        from pandas import DataFrame

        columns = {str(label): label for label in fitted_on}
        if set(columns) != set(self.variable_names):  # names may stand with their units
            columns = {re.sub(r"\s*\[.*\]$", "", name): label for name, label in columns.items()}
        if set(columns) != set(self.variable_names):
            raise InputError(
                f"the regressor was fitted on the columns {list(fitted_on)}, and the variables are "
                f"{list(self.variable_names)}: give both the same names"
            )
        frame = DataFrame(designs, columns=[columns[name] for name in self.variable_names])
        return frame[list(fitted_on)]

    def design_space(self, *, bounds: float = 0.20, tolerance: float = 0.15) -> DesignSpace:
        """Return the space of factors within 1 ± `bounds`, see `stiffness_factor_space`."""
        return stiffness_factor_space(self.variable_names, bounds, tolerance)


def units_of(responses: Sequence[str], unit: str) -> tuple[str, ...]:
    """Return the unit of each response, such as of ``"dB(A), kg"``; refuse more or fewer."""
    units = tuple(each.strip() for each in unit.split(","))
    if len(units) not in (1, len(responses)):
        raise InputError(
            f"{len(units)} units '{unit}' of the responses {list(responses)}: give one for all, or "
            "one for each"
        )
    return units * len(responses) if len(units) == 1 else units


def spread_unit(unit: str) -> str:
    """Return the unit of differences and of scatter: ``dB`` of any level, else the same."""
    return "dB" if unit.startswith("dB") else unit


def responses(evaluate: Evaluate, designs: RealArray) -> RealArray:
    """Return responses (n, r) to designs (n, k), not finite if one fails; refuse other shapes."""
    # a model that writes into its argument does not change the designs
    values = real_numbers(evaluate(np.array(designs, dtype=float)), evaluate.response_names)
    promised = (len(designs), len(evaluate.response_names))
    if values.shape != promised:
        raise InputError(
            f"{type(evaluate).__name__} gave an array of shape {values.shape} for {promised[0]} "
            f"designs and {promised[1]} named responses: return shape {promised}"
        )
    return values


def real_numbers(given: Any, names: Sequence[str]) -> RealArray:
    """Return what a model gave as real numbers; refuse complex ones and text by response."""
    values = np.asarray(given)
    if values.dtype.kind in "biuf":
        return np.asarray(values, dtype=float)
    rows = np.atleast_2d(values.T).T if values.ndim < 2 else values
    for place in np.ndindex(rows.shape):
        entry: Any = rows[place]
        if not isinstance(entry, numbers.Real | np.bool_):
            column = place[-1]
            name = f"'{names[column]}'" if rows.shape[-1] == len(names) else f"one of {list(names)}"
            raise InputError(
                f"the model gives {entry!r} for {name}, and a response is a real number: return a "
                "level or a magnitude of complex values, and text as numbers"
            )
    return np.asarray(values, dtype=float)


def not_finite(values: RealArray, names: Sequence[str]) -> str:
    """Say which responses (n, r) are not finite, and of how many of the n."""
    counts = np.count_nonzero(~np.isfinite(values), axis=0)
    words = [f"'{name}' in {count}" for name, count in zip(names, counts, strict=True) if count]
    return f"not finite of {len(values)} parts: {', '.join(words)}"


def check_repeats(model: Evaluate, space: DesignSpace) -> None:
    """Warn of a model that does not give the same responses for today's design twice.

    A model that fails there, or whose outputs are no numbers, says so where it is explored.
    """
    try:
        first, second = (responses(model, space.nominal[np.newaxis])[0] for _ in range(2))
    except Exception:
        return
    change = np.nan_to_num(np.abs(second - first))
    if np.any(change > SAME_TWICE * np.abs(first)):
        row = int(change.argmax())
        unit = f" {units_of(model.response_names, model.response_unit)[row]}".removesuffix(" 1")
        warnings.warn(
            f"the model does not repeat: called twice with today's design, "
            f"'{model.response_names[row]}' differs by {change[row]:.3g}{unit}; "
            "searches take such noise for an effect of the design and select lucky designs, "
            "gradients follow it, and no result can be repeated: give the model a fixed seed",
            DataWarning,
            stacklevel=3,
        )


SAME_TWICE = 1e-9
"""Relative change up to which a model gives the same response twice: that of threads [1]."""
LONGEST_MESSAGE = 400
"""Characters that are kept of what a model said of a design that failed."""


def said(error: Exception) -> str:
    """Return what a model said of a design; raise what is wrong with the question itself.

    An `InputError` is about the question, unless it words an error of the user's own function.
    """
    cause = error.__cause__ if isinstance(error, InputError) else error
    if cause is None or isinstance(cause, InputError):
        raise error
    words = str(error) if isinstance(error, InputError) else f"{type(error).__name__}: {error}"
    words = words.removesuffix(": ")
    return words[:LONGEST_MESSAGE]


def checked_model(model: Evaluate) -> Evaluate:
    """Return a model that says its names and unit, or refuse it with the remedy."""
    needed = ("variable_names", "response_names", "response_unit")
    missing = [name for name in needed if not hasattr(model, name)]
    if missing or not callable(model):
        raise InputError(
            f"{type(model).__name__} has no {', '.join(missing) or 'call'}: wrap it, "
            "deboom.ResponseFunction(function, variable_names, response_names, response_unit); of "
            "a scikit-learn regressor the function is its predict"
        )
    units_of(model.response_names, model.response_unit)
    return model


def check_fits(model: Evaluate, space: DesignSpace) -> None:
    """Refuse a model that does not say its names, or has not the variables of the space."""
    names = checked_model(model).variable_names
    check_same_names("the model has the variables", names, space.names)


def check_same_names(what: str, names: Sequence[str], expected: Sequence[str]) -> None:
    """Refuse names that differ from those of the design space or of the limits: show both lists."""
    if tuple(names) != tuple(expected):
        raise InputError(
            f"{what} {list(names)}, expected {list(expected)}: give both the same names in the "
            "same order"
        )


def check_gradient(evaluate: Evaluate, remedy: str) -> None:
    """Refuse a model without a gradient, with the remedy."""
    if not hasattr(evaluate, "gradient"):
        raise InputError(f"{type(evaluate).__name__} offers no gradient: {remedy}")


def checked_seed(seed: int) -> int:
    """Return the seed, an integer from 1, or refuse it: some libraries read 0 as "no seed"."""
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 1:
        raise InputError(f"seed {seed!r} is not an integer from 1 upwards: choose one, such as 1")
    return int(seed)


def whole_number(value: Any, item: str) -> int:
    """Return a count as an integer, also of 1024.0, or refuse it by name."""
    if isinstance(value, int | np.integer) and not isinstance(value, bool):
        return int(value)
    if isinstance(value, float) and value.is_integer():
        return int(value)
    raise InputError(f"{item}: {value!r} is not a whole number, give one such as 1024")


def generator(seed: int, purpose: str, *words: int) -> np.random.Generator:
    """Return the random generator of one purpose, such as ``"search sample"``.

    Streams of different purposes are independent under one seed: a verification never meets the
    draws of its search.
    """
    entropy = [checked_seed(seed), *words]
    key = zlib.crc32(purpose.encode())
    return np.random.default_rng(np.random.SeedSequence(entropy, spawn_key=(key,)))


def sobol_points(n_variables: int, n_points: int, *, seed: int, purpose: str) -> RealArray:
    """Return a power of two of scrambled Sobol points in the unit cube, (n_points, n_variables)."""
    exponent = max(n_points, 1).bit_length() - 1
    if n_points != 2**exponent:
        raise InputError(
            f"{n_points} Sobol points are not a power of two and would be unbalanced: take "
            f"{2**exponent} or {2 ** (exponent + 1)}"
        )
    sampler = qmc.Sobol(n_variables, rng=generator(seed, purpose))
    return np.asarray(sampler.random_base2(exponent))
