"""Two cables or two lines of the sheet mistaken for each other: every pair is tried."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.measurement.channels import Frf
from deboom.measurement.culprit import PERFECT
from deboom.measurement.virtual_point import VirtualPoint, channel_values

HALVED = 0.5
"""An exchange is named if, undone, less than this share of the disagreement (rms) is left."""


@dataclass(frozen=True)
class Exchange:
    """Two items that agree with all others once they are exchanged.

    Parameters
    ----------
    first, second : str
        Channels, or whole sensors or impacts.
    disagreement : float
        Rms of what no rigid motion explains, relative to the rms signal [1].
    left : float
        The same with the exchange undone [1].
    """

    first: str
    second: str
    disagreement: float
    left: float

    @property
    def verdict(self) -> str:
        """One sentence."""
        return (
            f"{self.first} and {self.second} are exchanged: {self.disagreement:.0%} of the signal "
            f"contradict a rigid body, {self.left:.1%} once they are changed back"
        )


def exchanged_responses(point: VirtualPoint, measured: Frf) -> Exchange | None:
    """Find two channels or two sensors that were exchanged.

    Parameters
    ----------
    point : VirtualPoint
        Of the motion sensors.
    measured : Frf
        With their channels as outputs.

    Returns
    -------
    Exchange or None
        None where no exchange halves the disagreement.

    Raises
    ------
    InputError
        A missing channel.

    Notes
    -----
    An exchange contradicts the rest at two places, so that no single sensor can be left out to make
    the rest agree (`deboom.measurement.culprit` finds nothing). With a right sheet every exchange
    makes matters worse, whatever the tolerances. Two axes of one sensor are a matter of `culprit`.
    """
    return _best_exchange(point, channel_values(point, measured).reshape(-1, len(point.channels)))


def exchanged_impacts(point: VirtualPoint, measured: Frf) -> Exchange | None:
    """Find two impacts that were exchanged; see `exchanged_responses`.

    Parameters
    ----------
    point : VirtualPoint
        Of the impacts.
    measured : Frf
        With them as inputs.

    Returns
    -------
    Exchange or None

    Raises
    ------
    InputError
        A missing impact.
    """
    values = measured.select(inputs=point.channels).values
    return _best_exchange(point, values.reshape(-1, len(point.channels)))


def _best_exchange(point: VirtualPoint, states: ComplexArray) -> Exchange | None:
    energy: RealArray = (states.T @ states.conj()).real
    unexplained = np.eye(len(energy)) - point.forward @ point.inverse
    scale = float(np.trace(energy))

    def left(order: list[int]) -> float:
        part = unexplained @ energy[np.ix_(order, order)] @ unexplained.T
        return float(np.sqrt(max(np.trace(part), 0.0) / scale))

    before = left(list(range(len(energy))))
    if before < PERFECT:
        return None
    tried = [(left(order), names) for names, order in _orders(point)]
    after, (first, second) = min(tried, default=(before, ("", "")))
    return Exchange(first, second, before, after) if after < HALVED * before else None


def _orders(point: VirtualPoint) -> Iterator[tuple[tuple[str, str], list[int]]]:
    """Order of the channels after each exchange of two channels or of two whole sensors."""
    owners = point.geometry.owners
    rows = {name: [n for n, owner in enumerate(owners) if owner == name] for name in owners}
    pairs = [
        ((point.channels[a], point.channels[b]), [a], [b])
        for a, b in combinations(range(len(owners)), 2)
        if owners[a] != owners[b]
    ]
    pairs += [
        ((one, other), rows[one], rows[other])
        for one, other in combinations(rows, 2)
        if len(rows[one]) == len(rows[other]) > 1
    ]
    for names, these, those in pairs:
        order = list(range(len(owners)))
        for a, b in zip(these, those, strict=True):
            order[a], order[b] = b, a
        yield names, order
