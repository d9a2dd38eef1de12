"""One measured function (UFF data set 58) as a value, and the choice of one by its DoF."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError

DIRECTIONS: dict[int, str] = {0: "scalar"} | {
    sign * (axis + 1): f"{'+' if sign > 0 else '-'}{name}"
    for axis, name in enumerate(("x", "y", "z", "rx", "ry", "rz"))
    for sign in (1, -1)
}
"""UFF direction codes and their words, ``+x`` … ``-rz``; 0 is ``scalar``."""


@dataclass(frozen=True, eq=False)
class UffFunction:
    """One function at a nodal DoF: UFF data set 58, in SI.

    Parameters
    ----------
    abscissa : array, shape (n,)
        Increasing, n ≥ 2 [Hz] or [s].
    values : array, shape (n,)
        Real or complex, finite [ordinate_unit, over denominator_unit where there is one].
    function_type : int
        UFF code: 0 general, 1 time, 2 auto spectrum, 3 cross spectrum, 4 frequency response,
        6 coherence, 9 power spectral density.
    response_node, reference_node : int
        Node numbers; 0 is none.
    response_direction, reference_direction : str
        ``+x -x +y … +rz -rz``, or ``scalar`` for none.
    ordinate, denominator : str
        Quantity in a word: ``displacement``, ``velocity``, ``acceleration``, ``force``,
        ``pressure``, ``general``, ``unknown``, …; the denominator may be ``none``.
    ordinate_unit, denominator_unit : str
        SI label, such as ``m``, ``N``, ``Pa``. A function that was read keeps the file's own label
        where deboom does not know it, and has ``""`` where the file states no unit.
    id_lines : sequence of str
        Up to five lines of text; filled up to five.
    response_name, reference_name : str
        Entity names, at most 10 characters.
    abscissa_quantity : str
        ``frequency``, ``time``, …; left out, it is ``time`` for function type 1 and ``frequency``
        for the others.
    file_unit : str
        The unit label as it stood in the file, such as ``mm`` or ``Pa/N``; ``""`` for a function
        that was not read, or whose file states none.

    Raises
    ------
    InputError
        Arrays of different lengths, an abscissa that does not increase, a value that is not finite
        (node, direction and line are named), an unknown direction, more than five ID lines.
    """

    abscissa: RealArray = field(repr=False)
    values: RealArray | ComplexArray = field(repr=False)
    function_type: int
    response_node: int
    response_direction: str
    reference_node: int
    reference_direction: str
    ordinate: str
    ordinate_unit: str
    denominator: str
    denominator_unit: str
    id_lines: tuple[str, ...] = ()
    response_name: str = ""
    reference_name: str = ""
    abscissa_quantity: str = ""
    file_unit: str = ""

    def __post_init__(self) -> None:
        for direction in (self.response_direction, self.reference_direction):
            if direction not in DIRECTIONS.values():
                raise InputError(
                    f"unknown direction {direction!r}: use one of {', '.join(DIRECTIONS.values())}"
                )
        if len(self.id_lines) > 5:
            raise InputError(f"{self.dof}: {len(self.id_lines)} ID lines, a function has five")
        abscissa = np.array(self.abscissa, dtype=np.float64)
        is_complex = np.iscomplexobj(self.values)
        values = np.array(self.values, dtype=np.complex128 if is_complex else np.float64)
        if abscissa.ndim != 1 or abscissa.shape != values.shape or abscissa.size < 2:
            raise InputError(
                f"{self.dof}: abscissa and values need one equal length of at least 2, they have "
                f"shapes {abscissa.shape} and {values.shape}"
            )
        for array, what in ((abscissa, "abscissa"), (values, "value")):
            bad = np.flatnonzero(~np.isfinite(array))
            if bad.size:
                raise InputError(
                    f"{self.dof}: the {what} of line {bad[0] + 1} is {array[bad[0]]}; measure or "
                    "export it again, deboom does not fill gaps"
                )
        falling = np.flatnonzero(np.diff(abscissa) <= 0)
        if falling.size:
            raise InputError(
                f"{self.dof}: the abscissa does not increase after line {falling[0] + 1} "
                f"({abscissa[falling[0]]:g}, then {abscissa[falling[0] + 1]:g})"
            )
        for array in (abscissa, values):
            array.setflags(write=False)
        object.__setattr__(self, "abscissa", abscissa)
        object.__setattr__(self, "values", values)
        object.__setattr__(self, "id_lines", (*self.id_lines, *[""] * (5 - len(self.id_lines))))
        if not self.abscissa_quantity:
            quantity = "time" if self.function_type == 1 else "frequency"
            object.__setattr__(self, "abscissa_quantity", quantity)

    @property
    def dof(self) -> str:
        """Response and reference in words, for messages."""
        text = f"node {self.response_node} {self.response_direction} {self.ordinate}"
        if self.reference_node or self.reference_direction != "scalar":
            text += f", reference node {self.reference_node} {self.reference_direction}"
        return text

    @property
    def unit(self) -> str:
        """SI unit of the values, such as ``m`` or ``Pa/N``."""
        return "/".join(filter(None, (self.ordinate_unit, self.denominator_unit)))


def find(
    functions: Sequence[UffFunction],
    *,
    response_node: int | None = None,
    response_direction: str | None = None,
    reference_node: int | None = None,
    reference_direction: str | None = None,
    ordinate: str | None = None,
) -> UffFunction:
    """Return the one function of a DoF; what is left out is not asked for.

    Parameters
    ----------
    functions : sequence of UffFunction
        Such as ``read_uff`` returns.
    response_node, reference_node : int, optional
        Node numbers.
    response_direction, reference_direction : str, optional
        ``+x`` … ``-rz`` or ``scalar``.
    ordinate : str, optional
        Quantity in a word, such as ``force``.

    Raises
    ------
    InputError
        No function of this DoF, or more than one: the order in the file never decides.
    """
    asked = {
        "response_node": response_node,
        "response_direction": response_direction,
        "reference_node": reference_node,
        "reference_direction": reference_direction,
        "ordinate": ordinate,
    }
    asked = {name: value for name, value in asked.items() if value is not None}
    found = [f for f in functions if all(getattr(f, name) == v for name, v in asked.items())]
    if len(found) == 1:
        return found[0]
    wish = ", ".join(f"{name.replace('_', ' ')} {value}" for name, value in asked.items())
    if found:
        raise InputError(f"{len(found)} functions have {wish or 'no condition'}: keep one of them")
    there = sorted({f.dof for f in functions})
    more = f" and {len(there) - 3} more" if len(there) > 3 else ""
    raise InputError(
        f"no function has {wish}: export it or correct the DoF; there are "
        f"{'; '.join(there[:3])}{more}"
    )
