"""Engine orders: from revolutions per minute to hertz and back."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.errors import InputError


def frequency_of_order(rpm: npt.ArrayLike, order: float) -> RealArray:
    """Return the frequency of an order at a speed.

    Parameters
    ----------
    rpm : array_like, any shape
        Shaft speed [1/min].
    order : float
        Cycles per revolution [1].

    Returns
    -------
    array, same shape
        [Hz].

    Raises
    ------
    InputError
        An order that is not positive.

    Notes
    -----
    ``f = order · rpm / 60``.
    """
    return np.asarray(_checked_order(order) * np.asarray(rpm, dtype=float) / 60)


def rpm_of_frequency(frequency: npt.ArrayLike, order: float) -> RealArray:
    """Return the speed at which an order has a frequency, the inverse of `frequency_of_order`.

    Parameters
    ----------
    frequency : array_like, any shape
        [Hz].
    order : float
        Cycles per revolution [1].

    Returns
    -------
    array, same shape
        Shaft speed [1/min].

    Raises
    ------
    InputError
        An order that is not positive.
    """
    return np.asarray(60 * np.asarray(frequency, dtype=float) / _checked_order(order))


def dominant_order(cylinders: int) -> float:
    """Return the firing order of a four-stroke engine.

    Parameters
    ----------
    cylinders : int
        Number of cylinders, at least 1.

    Returns
    -------
    float
        Firings per revolution [1]: 1.5 for three cylinders, 2 for four.

    Raises
    ------
    InputError
        A number of cylinders that is not a whole number of at least 1.

    Notes
    -----
    Each cylinder fires once in two revolutions, hence ``cylinders / 2``; valid for evenly spaced
    firing.
    """
    if cylinders < 1 or not float(cylinders).is_integer():
        raise InputError(
            f"an engine with {cylinders} cylinders has no firing order: give a whole number of at "
            "least 1"
        )
    return cylinders / 2


def _checked_order(order: float) -> float:
    if not (order > 0 and np.isfinite(order)):
        raise InputError(f"order {order} is not positive and finite: give cycles per revolution")
    return order
