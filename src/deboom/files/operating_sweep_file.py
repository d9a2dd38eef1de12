"""One UFF file of a sweep, asked for its channels by quantity, node and axis."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from deboom.arrays import ComplexArray, RealArray, RealOrComplexArray
from deboom.errors import InputError
from deboom.files.uff import read_uff

SPEED_TOLERANCE = 0.5
"""Largest difference between a line and the tacho's speed, in line spacings."""

Row = tuple[str, int, str]
"""Name, node and direction of a channel."""


class SweepFile:
    """One UFF file of a sweep.

    Parameters
    ----------
    path : Path
        UFF file.
    types : tuple of int
        UFF function types that are accepted.
    is_complex : bool
        Whether its channels are spectra, or samples over time.

    Raises
    ------
    InputError
        The file cannot be read as UFF, or its functions have different axes.
    """

    def __init__(self, path: Path, types: tuple[int, ...], *, is_complex: bool) -> None:
        self.path = path
        self.types = types
        self.is_complex = is_complex
        self.functions = read_uff(path)
        self.axis: RealArray = self.functions[0].abscissa
        for function in self.functions:
            if not np.array_equal(function.abscissa, self.axis):
                raise self.error(
                    f"the axes of {self.functions[0].dof} and {function.dof} differ: export all on "
                    "the same lines"
                )

    def error(self, sentence: str) -> InputError:
        """Return an error that names the file."""
        return InputError(f"{self.path}: {sentence}")

    def columns(self, rows: Sequence[Row], ordinate: str, unit: str) -> ComplexArray:
        """Return channels along positive axes, shape (n_line, n_channel).

        Raises
        ------
        InputError
            A channel is missing, doubled, dead, real where it should be complex or the other way
            round, or of another type or unit.
        """
        found = [self._column(*row, ordinate, unit) for row in rows]
        return np.array(found, dtype=np.complex128).T

    def tacho(self, node: int, ordinate: str) -> RealOrComplexArray:
        """Return speed or pulses, which programs call by various quantities, shape (n_line,).

        Raises
        ------
        InputError
            The tacho is missing, doubled or complex.
        """
        found = [f for f in self.functions if f.response_node == node]
        if not found:
            raise self.error(
                f"there is no tacho (node {node} scalar, {ordinate}) in it: without its pulse the "
                "channels have no phase; export it, or correct tacho_node"
            )
        if len(found) > 1:
            raise self.error(f"the tacho (node {node}) is in it {len(found)} times: keep one")
        if np.iscomplexobj(found[0].values):
            raise self.error(f"the tacho (node {node}) is complex: correct tacho_node")
        return found[0].values

    def _column(
        self, name: str, node: int, direction: str, ordinate: str, unit: str
    ) -> RealOrComplexArray:
        what = f"{ordinate} '{name}' (node {node} {direction})"
        found = [
            function
            for function in self.functions
            if (function.response_node, function.ordinate) == (node, ordinate)
            and function.response_direction.lstrip("+-") == direction.lstrip("+-")
        ]
        if len(found) != 1:
            state = f"is in it {len(found)} times: keep one" if found else "is not in it: export it"
            raise self.error(f"{what} {state}, or correct the position sheet or operation.toml")
        function = found[0]
        if function.function_type not in self.types:
            known = " or ".join(map(str, self.types))
            raise self.error(
                f"{what} has UFF function type {function.function_type}: export it as {known}"
            )
        if np.iscomplexobj(function.values) != self.is_complex:
            kind, remedy = (
                ("real", "phase is needed, export both parts")
                if self.is_complex
                else ("complex", "export samples over time")
            )
            raise self.error(f"{what} is {kind}: {remedy}")
        if function.unit != unit:
            raise self.error(f"{what} is in '{function.unit}': export it in {unit}")
        if not np.any(function.values):
            raise self.error(f"{what} is dead, 0 throughout: repair the channel and measure again")
        values = function.values
        return -values if function.response_direction.startswith("-") else values

    def check_order(self) -> None:
        """Refuse spectra that say they are of another order than the first."""
        for function in self.functions:
            match = re.match(r"order\s+(\d+(?:\.\d+)?)", function.id_lines[0])
            if match and float(match[1]) != 1.0:
                raise self.error(
                    f"{function.dof} is of order {match[1]}: an unbalance is of order 1, export "
                    "that"
                )

    def check_speed(self, node: int) -> None:
        """Refuse lines that are not the tacho's speed."""
        speed = self.tacho(node, "speed in rpm")
        wrong = np.abs(speed / 60.0 - self.axis) > SPEED_TOLERANCE * np.diff(self.axis).min()
        if wrong.any():
            first = int(np.argmax(wrong))
            raise self.error(
                f"the tacho reads {speed[first]:.6g} rpm at {self.axis[first]:.6g} Hz, which is "
                "not order 1: a pulse may be missing; repair the tacho and track the order again"
            )
