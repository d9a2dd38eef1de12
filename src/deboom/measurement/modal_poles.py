"""Poles of measured FRFs over the order of the polynomial, and the clusters that are modes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError

LARGEST_DAMPING = 0.3
"""Poles damped more than this belong to the polynomial, not to a structure [1]."""


@dataclass(frozen=True)
class StabilityLimits:
    """How little a pole may move from one order to the next to be called stable.

    Parameters
    ----------
    frequency : float
        Relative change [1].
    damping : float
        Relative change [1]. Damping scatters ten times as much as frequency; twice that keeps the
        weak modes of a body at 3 % noise.
    """

    frequency: float = 0.01
    damping: float = 0.2


@dataclass(frozen=True, eq=False)
class StabilisationChart:
    """Every pole of every order inside a band.

    Parameters
    ----------
    order : int array, shape (n_pole,)
        Of the polynomial [1].
    pole : array, shape (n_pole,)
        Complex, ``−ζω₀ + jω₀√(1−ζ²)`` [rad/s].
    stable : bool array, shape (n_pole,)
        Whether the order below has a pole of nearly equal frequency and damping.
    orders : tuple of int
        All orders computed, increasing.
    band : tuple of float
        From, to [Hz].
    """

    order: npt.NDArray[np.int64]
    pole: ComplexArray
    stable: npt.NDArray[np.bool_]
    orders: tuple[int, ...]
    band: tuple[float, float]

    @property
    def frequency(self) -> RealArray:
        """Natural frequency of each pole [Hz]."""
        return np.asarray(np.abs(self.pole) / (2 * np.pi))

    @property
    def damping(self) -> RealArray:
        """Damping ratio of each pole [1]."""
        return np.asarray(-self.pole.real / np.abs(self.pole))


@dataclass(frozen=True)
class PoleCluster:
    """One mode as the orders agree on it.

    Parameters
    ----------
    frequency, frequency_spread : float
        Median natural frequency over the orders and its standard deviation [Hz].
    damping, damping_spread : float
        Median damping ratio over the orders and its standard deviation [1].
    share : float
        Part of the orders that have a stable pole here [1].
    """

    frequency: float
    frequency_spread: float
    damping: float
    damping_spread: float
    share: float

    @property
    def pole(self) -> complex:
        """Complex pole [rad/s]."""
        omega = 2 * np.pi * self.frequency
        return complex(-self.damping * omega, omega * np.sqrt(1 - self.damping**2))


def stabilisation_chart(
    poles_by_order: dict[int, ComplexArray],
    band: tuple[float, float],
    limits: StabilityLimits | None = None,
) -> StabilisationChart:
    """Keep the poles that a structure may have and mark the stable ones.

    Parameters
    ----------
    poles_by_order : dict of int to array, shape (n,)
        Poles of each polynomial order [rad/s].
    band : tuple of float
        From, to [Hz].
    limits : StabilityLimits, optional

    Returns
    -------
    StabilisationChart

    Notes
    -----
    Dropped by rule: poles at 0 Hz or outside the band, with negative or excessive damping, the
    conjugates, and duplicates of one order.
    """
    limits = limits or StabilityLimits()
    numbers: list[int] = []
    kept: list[complex] = []
    stable: list[bool] = []
    below = np.empty(0, dtype=complex)
    for order in sorted(poles_by_order):
        possible = _physical(poles_by_order[order], band)
        for pole in possible:
            numbers.append(order)
            kept.append(complex(pole))
            stable.append(_has_twin(pole, below, limits))
        below = possible
    return StabilisationChart(
        np.array(numbers, dtype=np.int64),
        np.array(kept, dtype=complex),
        np.array(stable, dtype=bool),
        tuple(sorted(poles_by_order)),
        band,
    )


def pole_clusters(
    chart: StabilisationChart, width: float = 0.01, smallest_share: float = 0.25
) -> tuple[PoleCluster, ...]:
    """Gather the stable poles into modes.

    Parameters
    ----------
    chart : StabilisationChart
    width : float
        Largest relative gap in frequency between neighbours of one cluster [1]. Where modes lie
        closer, so that one order has two poles in a cluster, it is divided at its widest gap.
    smallest_share : float
        Part of the orders that must agree [1].

    Returns
    -------
    tuple of PoleCluster
        Increasing in frequency.

    Raises
    ------
    InputError
        No cluster: a band without modes, too low an order, or too much noise.
    """
    frequency, damping = chart.frequency[chart.stable], chart.damping[chart.stable]
    order = chart.order[chart.stable]
    sequence = np.argsort(frequency)
    frequency, damping, order = frequency[sequence], damping[sequence], order[sequence]
    cuts = np.flatnonzero(np.diff(frequency) > width * frequency[1:]) + 1
    groups = [
        part
        for members in np.split(np.arange(frequency.size), cuts)
        for part in _one_pole_per_order(members, frequency, order)
    ]
    clusters = []
    for members in groups:
        share = len(set(order[members].tolist())) / len(chart.orders)
        if members.size == 0 or share < smallest_share:
            continue
        clusters.append(
            PoleCluster(
                float(np.median(frequency[members])),
                float(np.std(frequency[members])),
                float(np.median(damping[members])),
                float(np.std(damping[members])),
                share,
            )
        )
    if not clusters:
        low, high = chart.band
        raise InputError(
            f"no pole between {low:g} and {high:g} Hz is stable over {smallest_share:.0%} of the "
            "orders: widen the band, raise the order, or measure with less noise"
        )
    return tuple(clusters)


def _one_pole_per_order(
    members: npt.NDArray[np.intp], frequency: RealArray, order: npt.NDArray[np.int64]
) -> list[npt.NDArray[np.intp]]:
    """Divide a cluster at its widest gap until no order has two poles in a part."""
    if len(set(order[members].tolist())) == members.size:
        return [members]
    widest = int(np.argmax(np.diff(frequency[members]))) + 1
    return [
        part
        for half in (members[:widest], members[widest:])
        for part in _one_pole_per_order(half, frequency, order)
    ]


def _physical(poles: ComplexArray, band: tuple[float, float]) -> ComplexArray:
    """Poles above 0 Hz inside the band with positive, moderate damping, each once."""
    frequency = np.abs(poles) / (2 * np.pi)
    inside = (frequency >= band[0]) & (frequency <= band[1]) & (frequency > 0)
    damping = -poles.real / np.where(inside, np.abs(poles), 1.0)
    inside &= (poles.imag > 0) & (damping > 0) & (damping < LARGEST_DAMPING)
    found = poles[inside]
    found = found[np.argsort(np.abs(found))]
    apart = np.ones(found.size, dtype=bool)
    apart[1:] = np.abs(np.diff(found)) > 1e-6 * np.abs(found[1:])
    return np.asarray(found[apart])


def _has_twin(pole: complex, others: ComplexArray, limits: StabilityLimits) -> bool:
    near = np.abs(np.abs(others) - abs(pole)) <= limits.frequency * abs(pole)
    damping, theirs = -pole.real / abs(pole), -others.real / np.abs(others)
    return bool(np.any(near & (np.abs(theirs - damping) <= limits.damping * damping)))
