"""From the functions of one UFF file to the channels that a campaign's table names."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.files.campaign_tables import CAMPAIGN_QUANTITIES, CampaignChannel
from deboom.files.uff import UffFunction, read_uff
from deboom.files.units import parse_unit

IN_SI = "in SI units, whatever the channel table says"
"""Last ID line of a function that was written into a campaign by deboom."""


class ChannelFile:
    """One UFF file of a campaign, asked for channels by their node, direction and quantity.

    Parameters
    ----------
    path : Path
        UFF file.
    item : str
        What it holds, for messages, such as ``run 'g5_wot220'``.
    function_types : tuple of int
        UFF function types that are accepted.

    Raises
    ------
    InputError
        The file cannot be read as UFF.
    """

    def __init__(self, path: Path, item: str, function_types: tuple[int, ...]) -> None:
        self.path = path
        self.item = item
        self.function_types = function_types
        self.functions = read_uff(path)
        self._by_dof: dict[tuple[int, str, str], list[UffFunction]] = {}
        for function in self.functions:
            key = (function.response_node, function.response_direction, function.ordinate)
            self._by_dof.setdefault(key, []).append(function)

    def error(self, sentence: str) -> InputError:
        """Return an error that names file and item."""
        return InputError(f"{self.path}: {self.item}: {sentence}")

    @property
    def abscissa(self) -> RealArray:
        """The lines that all functions share.

        Raises
        ------
        InputError
            They do not share them.
        """
        first = self.functions[0]
        for function in self.functions:
            if not np.array_equal(first.abscissa, function.abscissa):
                raise self.error(
                    f"the axes of {first.dof} and {function.dof} differ: export both on the same "
                    "lines"
                )
        return first.abscissa

    def real(self, channels: Sequence[CampaignChannel]) -> RealArray:
        """Return real channels, shape (n_line, n_channel), in SI along the positive axes.

        Raises
        ------
        InputError
            A channel is missing, doubled, complex, or of another type or unit.
        """
        columns = [c.sign * self._function(c, is_complex=False).values for c in channels]
        return np.stack(columns, axis=1).astype(np.float64)

    def complex(self, channels: Sequence[CampaignChannel]) -> ComplexArray:
        """Return complex channels, shape (n_line, n_channel), in SI along the positive axes.

        Raises
        ------
        InputError
            A channel is missing, doubled, real, or of another type or unit.
        """
        columns = [c.sign * self._function(c, is_complex=True).values for c in channels]
        return np.stack(columns, axis=1).astype(np.complex128)

    def _function(self, channel: CampaignChannel, is_complex: bool) -> UffFunction:
        ordinate = CAMPAIGN_QUANTITIES[channel.quantity][0]
        what = f"{channel.quantity} '{channel.channel}'"
        dof = f"node {channel.node} {channel.direction}"
        found = self._by_dof.get((channel.node, channel.direction, ordinate), [])
        if not found:
            raise self.error(
                f"{what} ({dof}) is not in it: export it, or correct the channel table"
            )
        if len(found) > 1:
            raise self.error(f"{what} ({dof}) is in it {len(found)} times: keep one")
        function = found[0]
        if function.function_type not in self.function_types:
            known = " or ".join(map(str, self.function_types))
            raise self.error(
                f"{what} has UFF function type {function.function_type}: export it as {known}"
            )
        if np.iscomplexobj(function.values) != is_complex:
            remedy = "export real and imaginary part" if is_complex else "export it as real values"
            raise self.error(f"{what} is {'real' if is_complex else 'complex'}: {remedy}")
        in_si = function.id_lines[-1] == IN_SI
        if not in_si and parse_unit(function.file_unit or "1").factor != channel.unit.factor:
            raise self.error(
                f"{what} is in '{function.file_unit}', but the channel table says "
                f"'{channel.unit.label}': correct the wrong one"
            )
        return function
