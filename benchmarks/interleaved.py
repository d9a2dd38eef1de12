"""Timing of rivals side by side on a machine that others use as well."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Mapping

import numpy as np


def quiet_seconds(
    rivals: Mapping[str, Callable[[], object]], seconds: float, calls: int = 4
) -> dict[str, float]:
    """Return the seconds of one quiet call of each rival.

    The rivals take turns, a few short calls each, until the time is used up; the first call of each
    turn warms the caches and does not count. The 10th percentile of a rival's calls is its quiet
    time: a loaded machine makes calls longer, never shorter.
    """
    times: dict[str, list[float]] = {name: [] for name in rivals}
    end = time.perf_counter() + seconds
    collecting = gc.isenabled()
    gc.disable()
    try:
        while time.perf_counter() < end or not all(times.values()):
            for name, call in rivals.items():
                call()
                for _ in range(calls):
                    start = time.perf_counter()
                    call()
                    times[name].append(time.perf_counter() - start)
    finally:
        if collecting:
            gc.enable()
    return {name: float(np.percentile(row, 10)) for name, row in times.items()}
