"""Array types and axes, frozen dataclasses with checked arrays, and derivatives by differences."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, is_dataclass
from inspect import get_annotations
from typing import Any, Literal, TypeAlias, TypeVar, dataclass_transform

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError

AXES: tuple[Literal["x"], Literal["y"], Literal["z"]] = ("x", "y", "z")
"""Axes of a vehicle, a mount or a sensor, in the order of every array."""
DOFS = (*AXES, "rx", "ry", "rz")
"""Degrees of freedom of a rigid body, in the order of every matrix."""
PERCENT = 100.0
"""From a share to per cent."""

RealArray: TypeAlias = npt.NDArray[np.float64]
ComplexArray: TypeAlias = npt.NDArray[np.complex128]
RealOrComplexArray: TypeAlias = RealArray | ComplexArray
BoolArray: TypeAlias = npt.NDArray[np.bool_]
IntArray: TypeAlias = npt.NDArray[np.int_]
TextArray: TypeAlias = npt.NDArray[np.str_]

_T = TypeVar("_T")
_S = TypeVar("_S", bound=np.generic)
_N = TypeVar("_N", np.float64, np.complex128)
_DTYPES = {"Complex": complex, "Bool": bool, "Int": int}


def frozen_copy(array: npt.NDArray[_S]) -> npt.NDArray[_S]:
    """Return a read-only copy; freezing in place would freeze the caller's array."""
    copy = array.copy()
    copy.setflags(write=False)
    return copy


def checked_array(
    value: npt.ArrayLike,
    axes: str,
    item: str,
    sizes: dict[str, int] | None = None,
    dtype: type = float,
) -> npt.NDArray[Any]:
    """Return a read-only copy of an array whose shape and numbers are as its axes say.

    Parameters
    ----------
    value : array_like
        Numbers of any shape that `axes` allows.
    axes : str
        One word per axis, such as ``"f v"`` or ``"n 3"``: a number is a fixed length, a name a
        length that is the same wherever the name stands, ``...`` any leading axes. A trailing
        ``?`` allows numbers that are not finite.
    item : str
        Name of the array in the error.
    sizes : dict, optional
        Lengths of the named axes so far; lengths that are met first are added.
    dtype : type
        Type of the numbers.

    Raises
    ------
    InputError
        Another shape, or numbers that are not finite.
    """
    sizes = {} if sizes is None else sizes
    words = axes.split()
    finite = words[-1:] != ["?"]
    words = words if finite else words[:-1]
    array: npt.NDArray[Any] = np.array(value, dtype=dtype)
    shape = array.shape
    if words[:1] == ["..."]:
        words = words[1:]
        shape = shape[max(len(shape) - len(words), 0) :]
    wanted = [
        int(word) if word.isdigit() else sizes.setdefault(word, length)
        for word, length in zip(words, shape, strict=False)
    ]
    if len(words) != len(shape) or wanted != list(shape):
        axes_wanted = ", ".join(str(sizes.get(word, word)) for word in words)
        raise InputError(f"{item}: shape ({axes_wanted}) is needed, not {array.shape}")
    if finite and array.dtype.kind in "fc" and not np.all(np.isfinite(array)):
        where = tuple(int(index) for index in np.argwhere(~np.isfinite(array))[0])
        raise InputError(f"{item}: a number is not finite at index {where}")
    array.setflags(write=False)
    return array


def derivatives(
    function: Callable[[RealArray], npt.NDArray[_N]], point: RealArray, steps: npt.ArrayLike
) -> npt.NDArray[_N]:
    """Differentiate by each number of a point, by central differences of fourth order.

    `function`: rows of points (n, k) to values (n, ...); `point` (k,); `steps` (k,) or (): of each
    number, in its unit. Returns (k, ...); the error is the fourth power of a step over the size on
    which the function changes, and rounding over the step.
    """
    moves = np.diag(np.broadcast_to(np.asarray(steps, dtype=float), point.shape))
    near = function(point + moves) - function(point - moves)
    far = function(point + 2 * moves) - function(point - 2 * moves)
    scale = 12 * np.diag(moves)
    return np.asarray((8 * near - far) / scale.reshape(-1, *(1,) * (near.ndim - 1)))


LONGEST_TEXT = 60
"""Letters of a text that `short_repr` shows."""
MOST_SHOWN = 6
"""Numbers of an array that `short_repr` writes out."""


def short_repr(value: Any) -> str:
    """Return the repr of a dataclass in a line or two: large arrays and parts by their size.

    A platform that is typed at a prompt would otherwise fill it with all of its numbers.
    """
    parts = [
        f"{field.name}={_short(getattr(value, field.name, None))}"
        for field in fields(value)
        if field.repr
    ]
    return f"{type(value).__name__}({', '.join(parts)})"


def _short(value: Any) -> str:
    """Return the repr of a field, or what it is and how large."""
    if isinstance(value, np.ndarray):
        shape = " x ".join(map(str, value.shape))
        return repr(value.tolist()) if value.size <= MOST_SHOWN else f"<{shape} {value.dtype}>"
    if isinstance(value, str):
        return repr(value if len(value) <= LONGEST_TEXT else f"{value[: LONGEST_TEXT - 1]}…")
    if is_dataclass(value) and not isinstance(value, type):
        name = getattr(value, "name", "")
        return f"<{type(value).__name__}{f' {name}' if isinstance(name, str) and name else ''}>"
    if isinstance(value, tuple | list | dict):
        shown = list(value.values()) if isinstance(value, dict) else list(value)
        if not any(is_dataclass(part) or isinstance(part, np.ndarray) for part in shown):
            text = repr(value)
            if len(text) <= 2 * LONGEST_TEXT:
                return text
        kinds = sorted({type(part).__name__ for part in shown})
        return f"<{len(shown)} {' or '.join(kinds)}>"
    text = repr(value)
    return text if len(text) <= 2 * LONGEST_TEXT else f"<{type(value).__name__}>"


_COMPARISONS = {
    ">=": (np.greater_equal, "at least"),
    "<=": (np.less_equal, "at most"),
    ">": (np.greater, "above"),
    "<": (np.less, "below"),
}


def check_conditions(value: Any, conditions: Sequence[str], item: str) -> None:
    """Refuse a value that does not keep the conditions of its field, see `checked`."""
    names = [getattr(part, "name", part) for part in value] if "distinct" in conditions else []
    if doubled := sorted({name for name in names if names.count(name) > 1}):
        raise InputError(f"{item}: duplicated {doubled}: each needs a name of its own")
    if "some" in conditions and not len(value):
        raise InputError(f"{item}: give at least one")
    if "increasing" in conditions and (not len(value) or np.any(np.diff(value) <= 0.0)):
        raise InputError(f"{item}: numbers must be finite and increase from one to the next")
    compared = [
        (*_COMPARISONS[sign], float(condition.removeprefix(sign)))
        for condition in conditions
        if (sign := next((sign for sign in _COMPARISONS if condition.startswith(sign)), ""))
    ]
    inside = [compare(np.asarray(value, dtype=float), bound) for compare, _, bound in compared]
    if not np.all(inside):
        outside = np.asarray(value)[~np.logical_and.reduce(inside)]
        wanted = " and ".join(
            f"{words} {bound:g}" if np.isfinite(bound) else "finite" for _, words, bound in compared
        )
        raise InputError(f"{item} is {outside.flat[0]}: give a number {wanted}")


@dataclass_transform(frozen_default=True, eq_default=False)
def checked(each: str = "", /, **axes: str) -> Callable[[type[_T]], type[_T]]:
    """Make a class a frozen dataclass whose fields keep what is declared of them.

    Parameters
    ----------
    each : str
        What is declared of every field that `axes` does not name, such as ``>=0``.
    **axes : str
        Of each array field its axes, as `checked_array` reads them; a name stands for the same
        length in all of them, in the order of the fields. The type of the numbers follows from the
        annotation (`ComplexArray`, `BoolArray`, `IntArray`, else float); of a ``tuple``, such as
        names of channels, the length alone is checked. Then conditions, of single numbers too:
        ``>0``, ``>=0``, ``<1`` or ``<=1``; ``increasing``; ``some``, which is not empty;
        ``distinct`` names. A field of None is skipped.

    Returns
    -------
    callable
        A class decorator. Fields annotated as ``tuple`` accept any sequence. The class's own
        ``__post_init__`` runs afterwards, for checks of several fields together. Instances are
        equal where their fields are, unless one of them is an array.

    Examples
    --------
    >>> @checked(channels="c distinct", frequency="f increasing", values="f c", weight=">0 <1")
    ... class Spectrum:
    ...     channels: tuple[str, ...]
    ...     frequency: RealArray
    ...     values: ComplexArray
    ...     weight: float
    >>> Spectrum(["a"], [1.0, 2.0], [[1j], [2j]], 0.5).values.flags.writeable
    False
    """
    declared, every = {name: _declared(text) for name, text in axes.items()}, _declared(each)

    def decorate(cls: type[_T]) -> type[_T]:
        own_check = cls.__dict__.get("__post_init__")
        owner = re.sub("(?<=[a-z])(?=[A-Z])", " ", cls.__name__).lower()

        def __post_init__(self: Any) -> None:
            sizes: dict[str, int] = {}
            for field in fields(self):
                value, annotation = getattr(self, field.name), str(field.type)
                shape, conditions = declared.get(field.name, every)
                is_tuple = annotation.startswith("tuple")
                if value is None or not (is_tuple or shape or conditions):
                    continue
                name = getattr(self, "name", None)
                item = f"{name if isinstance(name, str) else owner}: {field.name}"
                if is_tuple:
                    value = tuple(value)
                    length = sizes.setdefault(shape, len(value)) if shape else len(value)
                    if length != len(value):
                        raise InputError(f"{item}: {length} are needed, not {len(value)}")
                elif shape:
                    kind = next((t for k, t in _DTYPES.items() if k in annotation), float)
                    value = checked_array(value, shape, item, sizes, kind)
                if conditions:
                    check_conditions(value, conditions, item)
                object.__setattr__(self, field.name, value)
            if own_check is not None:
                own_check(self)

        cls.__post_init__ = __post_init__  # type: ignore[attr-defined]
        if "__repr__" not in cls.__dict__:
            cls.__repr__ = short_repr  # type: ignore[method-assign]
        kinds = [str(kind) for base in cls.__mro__ for kind in get_annotations(base).values()]
        # a function of arrays is no array
        arrays = ["Array" in re.sub(r"Callable\[.*\]", "", kind) for kind in kinds]
        return dataclass(frozen=True, eq=not any(arrays))(cls)

    return decorate


def _declared(text: str) -> tuple[str, tuple[str, ...]]:
    """Split what is declared of a field into axes and conditions."""
    words = text.split()
    conditions = tuple(w for w in words if w in ("distinct", "increasing", "some") or w[0] in "<>")
    return " ".join(word for word in words if word not in conditions), conditions
