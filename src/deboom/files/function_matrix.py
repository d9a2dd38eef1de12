"""Matrices of functions out of one UFF file, chosen by response and reference DoF."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.files.uff import UffFunction, read_uff


@dataclass(frozen=True)
class Dof:
    """A degree of freedom of the files and what it stands for.

    Parameters
    ----------
    name : str
        Channel, blow or ear.
    node : int
        In the UFF file.
    direction : str
        ``scalar``, or such as ``-y``.
    entity : str
        Name that every function of this response must carry, such as the serial number of its
        microphone; ``""`` where any will do.
    sign : float
        −1 for a channel recorded against its axis.
    """

    name: str
    node: int
    direction: str
    entity: str = ""
    sign: float = 1.0


NO_REFERENCE = Dof("", 0, "scalar")
"""Of spectra."""


class FunctionMatrix:
    """One UFF file, asked for functions by both of their DoF.

    Parameters
    ----------
    path : Path
        UFF file.
    item : str
        What it holds, for messages.
    function_types : tuple of int
        UFF function types that are accepted.

    Raises
    ------
    InputError
        The file cannot be read as UFF; its functions have different lines.
    """

    def __init__(self, path: Path, item: str, function_types: tuple[int, ...]) -> None:
        self.path = path
        self.item = item
        self.function_types = function_types
        self._by_dof: dict[tuple[str, int, str, int, str], list[UffFunction]] = {}
        functions = read_uff(path)
        self.frequency: RealArray = functions[0].abscissa
        for function in functions:
            if not np.array_equal(function.abscissa, self.frequency):
                raise self.error(f"{function.dof} has other lines than {functions[0].dof}")
            self._by_dof.setdefault(_key(function), []).append(function)

    def error(self, sentence: str) -> InputError:
        """Return an error that names file and item."""
        return InputError(f"{self.path}: {self.item}: {sentence}")

    def values(
        self,
        responses: Sequence[Dof],
        references: Sequence[Dof] = (NO_REFERENCE,),
        *,
        ordinate: str,
        unit: str,
    ) -> ComplexArray:
        """Return the functions of all pairs of DoF.

        Parameters
        ----------
        responses, references : sequence of Dof
            Rows and columns.
        ordinate, unit : str
            Quantity in a word, and SI unit of the function, such as ``Pa/N``.

        Returns
        -------
        array, shape (n_frequency, n_response, n_reference)
            [unit].

        Raises
        ------
        InputError
            A function that is missing, doubled, real, of another type, unit or microphone.
        """
        rows = [
            [
                self._function(response, reference, ordinate, unit).values * response.sign
                for reference in references
            ]
            for response in responses
        ]
        return np.moveaxis(np.array(rows, dtype=np.complex128), 2, 0)

    def _function(self, response: Dof, reference: Dof, ordinate: str, unit: str) -> UffFunction:
        of = f" per {reference.name}" if reference.name else ""
        what = f"{ordinate} '{response.name}'{of}"
        dof = f"node {response.node} {response.direction}"
        if reference.name:
            dof += f", reference node {reference.node} {reference.direction}"
        key = (ordinate, response.node, response.direction, reference.node, reference.direction)
        found = self._by_dof.get(key, [])
        if len(found) != 1:
            state = f"is in it {len(found)} times: keep one" if found else "is not in it: export it"
            raise self.error(f"{what} ({dof}) {state}, or correct the tables")
        function = found[0]
        if response.entity and function.response_name != response.entity:
            raise self.error(
                f"{what} is of microphone '{function.response_name}', but '{response.name}' is "
                f"'{response.entity}': microphones must not be mixed, measure this one again"
            )
        if function.function_type not in self.function_types:
            known = " or ".join(map(str, self.function_types))
            raise self.error(
                f"{what} has UFF function type {function.function_type}: export it as {known}"
            )
        if not np.iscomplexobj(function.values):
            raise self.error(f"{what} is real: export real and imaginary part, phase is needed")
        if function.unit != unit:
            raise self.error(f"{what} is in '{function.unit}': export it in {unit}")
        return function


def _key(function: UffFunction) -> tuple[str, int, str, int, str]:
    return (
        function.ordinate,
        function.response_node,
        function.response_direction,
        function.reference_node,
        function.reference_direction,
    )
