"""Which hits of an impact test may be averaged, and why the others may not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import find_peaks

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.measurement.block_records import BlockRecord
from deboom.measurement.hammer_measurement import HammerMeasurement

NOISE_PEAKS = 5.0
"""Peaks of a noise reach this many times its rms; lower second peaks say nothing."""


@dataclass(frozen=True)
class HitChecks:
    """Limits of a good hit.

    Parameters
    ----------
    double_hit : float
        Largest second push, over the main one [1].
    overload : float
        Largest value of a channel, over its range [1].
    smallest_force : float
        Least peak force; a hit is never accepted without any [N].
    latest : float
        Time by which the main push has its peak, over the duration of the block [1].

    Raises
    ------
    InputError
        A limit that makes no sense.
    """

    double_hit: float = 0.05
    overload: float = 0.99
    smallest_force: float = 0.0
    latest: float = 0.5

    def __post_init__(self) -> None:
        fractions = (self.double_hit, self.overload, self.latest)
        if not all(0 < limit <= 1 for limit in fractions) or not self.smallest_force >= 0:
            raise InputError(
                "limits of hits: double_hit, overload and latest are above 0 and at most 1, "
                "smallest_force is not negative"
            )


def check_hits(
    measurement: HammerMeasurement, checks: HitChecks | None = None
) -> tuple[BlockRecord, ...]:
    """Judge every hit.

    Parameters
    ----------
    measurement : HammerMeasurement
        n hits.
    checks : HitChecks, optional
        Limits; by default `HitChecks()`.

    Returns
    -------
    tuple of BlockRecord
        One per hit, in their order.

    Notes
    -----
    A double hit is a second maximum of the force of more than the stated share, in height and
    above its surroundings; pulls do not count, since filters and amplifiers swing through zero. A
    hit whose own noise before the push reaches that share cannot be checked, and is rejected.
    """
    limits = HitChecks() if checks is None else checks
    loudest = float(measurement.force.max())
    records = []
    for index, force in enumerate(measurement.force):
        before = force[: measurement.n_before]
        push = force - (before.mean() if before.size else 0.0)
        reasons = [
            *_force_faults(measurement, push, loudest, limits),
            *_overloads(measurement, index, limits.overload),
        ]
        records.append(BlockRecord(index + 1, float(push.max()), not reasons, tuple(reasons)))
    return tuple(records)


def _force_faults(
    measurement: HammerMeasurement, push: RealArray, loudest: float, limits: HitChecks
) -> list[str]:
    peak = float(push.max())
    before = push[: measurement.n_before]
    noise = float(np.sqrt(np.mean(before**2))) if before.size else 0.0
    # a hammer that was not used shows noise: far below the other hits, or no peak above its own
    if peak <= max(limits.smallest_force, NOISE_PEAKS * noise, 1e-3 * loudest):
        return [f"no force: peak of {peak:.3g} N"]
    faults = []
    threshold = limits.double_hit * peak
    if noise * NOISE_PEAKS > threshold:
        faults.append(
            f"too weak for its noise: {noise:.2g} N rms against a peak of {peak:.3g} N hides a "
            "double hit"
        )
    else:
        # zeros around it: a push at the block's edge is a peak, too
        peaks, _ = find_peaks(np.pad(push, 1), height=threshold, prominence=threshold)
        others = [int(i) - 1 for i in peaks if i - 1 != int(np.argmax(push))]
        if others:
            second = max(others, key=lambda i: push[i])
            apart = (second - int(np.argmax(push))) / measurement.rate
            faults.append(
                f"double hit: {100 * push[second] / peak:.0f} % again, {1e3 * apart:.1f} ms from "
                "the main push"
            )
    at = int(np.argmax(push)) / measurement.rate
    duration = measurement.n_sample / measurement.rate
    if at > limits.latest * duration:
        faults.append(f"late: its peak comes {at:.3g} s into a block of {duration:.3g} s")
    return faults


def _overloads(measurement: HammerMeasurement, index: int, limit: float) -> list[str]:
    peaks = np.concatenate(
        [
            [np.abs(measurement.force[index]).max()],
            np.abs(measurement.response[index]).max(axis=0),
        ]
    )
    names = ("force", *measurement.channels)
    units = ("N", *measurement.units)
    ranges = (measurement.force_range, *measurement.ranges)
    return [
        f"overload of '{name}': {peak:.4g} {unit} in a range of {bound:.4g} {unit}"
        for name, unit, bound, peak in zip(names, units, ranges, peaks, strict=True)
        if peak >= limit * bound
    ]
