"""Which of a tacho's pulses are true, and which revolution each belongs to."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.ndimage import maximum_filter1d, median_filter, percentile_filter

from deboom.arrays import RealArray

WINDOW = 9
"""Intervals (and pulses) over which a shaft's speed is compared with itself."""
UNEVEN, MOST_UNEVEN = 0.1, 0.15
"""Deviation from a whole number of intervals that weighs as much as one bad pulse: in a clean
signal, and in one whose every interval scatters because few samples make an interval."""
LONGEST_GAP = 5
"""Pulses missing in a row that can still be counted."""
MOST_PASSES = 4
"""Two heal almost every signal; damage that lies close together takes a third."""
OUTLIER = 6.0
"""Robust standard deviations by which a displaced pulse is off."""
LEAST_OUTLIER = 0.005
"""Of an interval: smaller displacements are left in."""

IntArray = npt.NDArray[np.int64]


def number_pulses(times: RealArray) -> IntArray:
    """Count the pulses of a shaft whose speed changes smoothly.

    Parameters
    ----------
    times : array, shape (n,)
        Increasing, n ≥ 10 [s].

    Returns
    -------
    array of int, shape (n,)
        From 0; −1 for a pulse that is better left out. Missing pulses are skipped numbers.

    Notes
    -----
    Leaving a pulse out costs 1 and so does a missing one; from one pulse kept to the next, a step
    that is not a whole number of intervals costs the square of its excess over what is usual. The
    cheapest chain is found as a shortest path: first with the running median of all intervals, then
    with that of the pulses kept, until nothing changes.
    """
    number = _cheapest_chain(times, local_period(times, np.arange(times.size)))
    for _ in range(MOST_PASSES):
        kept = number >= 0
        if np.count_nonzero(kept) <= WINDOW:
            break
        period = local_period(times[kept], number[kept])
        before, number = number, _cheapest_chain(times, np.interp(times, times[kept], period))
        if np.array_equal(number, before):
            break
    return number


def local_period(times: RealArray, number: IntArray) -> RealArray:
    """Return the time from number to number about each pulse.

    Parameters
    ----------
    times : array, shape (n,)
        Increasing [s].
    number : array of int, shape (n,)
        Increasing.

    Returns
    -------
    array, shape (n,)
        Running median over nine intervals [s].
    """
    usual = median_filter(np.diff(times) / np.diff(number), size=WINDOW, mode="mirror")
    return np.concatenate([usual[:1], (usual[1:] + usual[:-1]) / 2, usual[-1:]])


def without_displaced(times: RealArray, number: IntArray) -> npt.NDArray[np.bool_]:
    """Tell the pulses that lie on a smooth course from those that are displaced.

    Parameters
    ----------
    times, number : array, shape (n,)
        As `number_pulses` takes and gives them.

    Returns
    -------
    array of bool, shape (n,)
        False for a displaced pulse and for one without a number.

    Notes
    -----
    The worst pulse of each neighbourhood goes, until all are within six robust standard deviations
    or 0.5 % of an interval of the cubic about them.
    """
    taken = number >= 0
    while np.count_nonzero(taken) > WINDOW:
        position = np.flatnonzero(taken)
        deviation, interval = _deviation_from_neighbours(times[position], number[position])
        # the median of unsigned normal deviations is 1/1.4826 of their standard deviation
        spread = 1.4826 * np.median(deviation)
        bad = deviation > np.maximum(OUTLIER * spread, LEAST_OUTLIER * interval)
        worst = np.flatnonzero(bad & (deviation >= maximum_filter1d(deviation, WINDOW)))
        if worst.size == 0:
            break
        # near an end a cubic cannot tell which pulse is off: the outermost goes
        worst[worst < WINDOW // 2] = 0
        worst[worst >= deviation.size - WINDOW // 2] = -1
        taken[position[worst]] = False
    return taken


def _deviation_from_neighbours(times: RealArray, number: IntArray) -> tuple[RealArray, RealArray]:
    """Studentised distance of each pulse from the cubic about it, and the interval there [s]."""
    begin = np.clip(np.arange(times.size) - WINDOW // 2, 0, times.size - WINDOW)
    neighbours = begin[:, np.newaxis] + np.arange(WINDOW)
    # few patterns of gaps occur: one small least-squares problem for each, not for each pulse
    near, pattern = np.unique(
        number[neighbours] - number[:, np.newaxis], axis=0, return_inverse=True
    )
    cubic = (near / np.abs(near).max(axis=1, keepdims=True))[:, :, np.newaxis] ** np.arange(4)
    # at the pulse itself the cubic has the value of its constant term
    own_row = np.linalg.pinv(cubic)[pattern.reshape(-1), 0]
    fitted = np.sum(own_row * (times[neighbours] - times[:, np.newaxis]), axis=1)
    leverage = own_row[np.arange(times.size), np.arange(times.size) - begin]
    interval = np.ptp(times[neighbours], axis=1) / np.ptp(number[neighbours], axis=1)
    return np.abs(fitted) / np.sqrt(1 - np.minimum(leverage, 0.999)), interval


def _cheapest_chain(times: RealArray, period: RealArray) -> IntArray:
    price, whole = _step_prices(times, period)
    cost, chosen = [0.0], [-1]
    for i, prices in enumerate(price.tolist()[1:], start=1):
        totals = [cost[i - 1 - skipped] + prices[skipped] for skipped in range(min(i, WINDOW))]
        best = min(totals)
        # to leave out all pulses before this one costs i
        cost.append(min(best, float(i)))
        chosen.append(totals.index(best) if best < i else -1)
    chain = [int(np.argmin(np.array(cost) - np.arange(times.size)))]
    while chosen[chain[-1]] >= 0:
        chain.append(chain[-1] - 1 - chosen[chain[-1]])
    chain.reverse()
    number = np.full(times.size, -1, dtype=np.int64)
    number[chain[0]] = 0
    number[chain[1:]] = np.cumsum([whole[i, chosen[i]] for i in chain[1:]])
    return number


def _step_prices(times: RealArray, period: RealArray) -> tuple[RealArray, IntArray]:
    """Price and count of the step to each pulse (row) if so many are skipped before it (column)."""
    unevenness = np.abs(np.diff(times, prepend=times[0] - period[0]) / period - 1)
    scatter = percentile_filter(unevenness, 75, size=4 * WINDOW, mode="mirror")
    uneven = np.clip(scatter, UNEVEN, MOST_UNEVEN)[:, np.newaxis]
    skipped = np.arange(WINDOW)
    before = np.maximum(np.arange(times.size)[:, np.newaxis] - 1 - skipped, 0)
    step = 2 * (times[:, np.newaxis] - times[before]) / (period[:, np.newaxis] + period[before])
    whole = np.maximum(1, np.rint(step)).astype(np.int64)
    missing = np.minimum(whole - 1, LONGEST_GAP + 1)
    return skipped + missing + ((step - whole) / uneven) ** 2, whole
