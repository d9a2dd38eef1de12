"""Array types, frozen dataclasses with checked arrays, and derivatives by differences."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any, TypeAlias, TypeVar, dataclass_transform

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError

RealArray: TypeAlias = npt.NDArray[np.float64]
ComplexArray: TypeAlias = npt.NDArray[np.complex128]
RealOrComplexArray: TypeAlias = RealArray | ComplexArray
BoolArray: TypeAlias = npt.NDArray[np.bool_]
IntArray: TypeAlias = npt.NDArray[np.int_]

AXES = ("x", "y", "z", "rx", "ry", "rz")
"""Degrees of freedom of a rigid body, in the order of every matrix."""

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
        asked = ", ".join(str(sizes.get(word, word)) for word in words)
        raise InputError(f"{item}: shape ({asked}) is needed, not {array.shape}")
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


@dataclass_transform(frozen_default=True, eq_default=False)
def checked(**axes: str) -> Callable[[type[_T]], type[_T]]:
    """Make a class a frozen dataclass with checked, copied and read-only arrays.

    Parameters
    ----------
    **axes : str
        Axes of each array field, as `checked_array` reads them; a name stands for the same length
        in all of them, in the order of the fields. The type of the numbers follows from the
        annotation (`ComplexArray`, `BoolArray`, `IntArray`, else float); of a ``tuple``, such as
        names of channels, the length alone is checked. A field of None is skipped.

    Returns
    -------
    callable
        A class decorator. Fields annotated as ``tuple`` accept any sequence. The class's own
        ``__post_init__`` runs afterwards, for checks that need more than shapes.

    Examples
    --------
    >>> @checked(channels="c", frequency="f", values="f c")
    ... class Spectrum:
    ...     channels: tuple[str, ...]
    ...     frequency: RealArray
    ...     values: ComplexArray
    >>> Spectrum(["a"], [1.0, 2.0], [[1j], [2j]]).values.flags.writeable
    False
    """

    def decorate(cls: type[_T]) -> type[_T]:
        own_check = cls.__dict__.get("__post_init__")

        def __post_init__(self: Any) -> None:
            sizes: dict[str, int] = {}
            for field in fields(self):
                value = getattr(self, field.name)
                annotation = str(field.type)
                if value is None:
                    continue
                name = getattr(self, "name", None)
                item = f"{name if isinstance(name, str) else cls.__name__}: {field.name}"
                if annotation.startswith("tuple"):
                    value = tuple(value)
                    axis = axes.get(field.name)
                    length = len(value) if axis is None else sizes.setdefault(axis, len(value))
                    if length != len(value):
                        raise InputError(f"{item}: {length} are needed, not {len(value)}")
                elif field.name in axes:
                    kind = next((t for k, t in _DTYPES.items() if k in annotation), float)
                    value = checked_array(value, axes[field.name], item, sizes, kind)
                object.__setattr__(self, field.name, value)
            if own_check is not None:
                own_check(self)

        cls.__post_init__ = __post_init__  # type: ignore[attr-defined]
        return dataclass(frozen=True, eq=False)(cls)

    return decorate
