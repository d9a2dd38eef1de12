"""A search of the shipped platform on two workers against one process.

A generation of 100 designs with coupled motion, evaluated by this process, by two processes
(`--workers 2`) and by a Dask cluster of two workers (`--scheduler`), in turns; with 128 draws, and
with 1024, where a design costs some 6 ms. What NSGA-II takes beside is measured by the processor's
clock and added to all three. Asked of Dask, on two quiet cores: the whole search 1.6 times as fast
as one process with 128 draws, 1.8 times with 1024. The ceiling is what two workers would reach that
cost nothing.
"""

from __future__ import annotations

import time

import numpy as np
import pandas as pd
from distributed import LocalCluster
from threadpoolctl import threadpool_limits

import deboom
from deboom.arrays import RealArray
from deboom.explore.robust import Robust, RobustValues, RobustWrapper
from deboom.explore.scatter import sobol_sample
from deboom.explore.search import Search, nsga2
from deboom.explore.workers import workers_for
from interleaved import quiet_seconds

POPULATION = 100
SEARCHED = 20
"""Generations over which the time of NSGA-II is measured."""
SECONDS = {128: 10.0, 1024: 30.0}
"""Draws to the seconds in which the three take turns."""


def report() -> str:
    """Time the three and return the table as text."""
    with threadpool_limits(1, user_api="blas"):
        rows = {f"{draws} draws": _row(draws) for draws in SECONDS}
    columns = ["design [ms]", "NSGA-II [ms]", "one", "two processes", "Dask"]
    columns += ["x two processes", "x Dask", "ceiling"]
    table = pd.DataFrame(rows, columns).T
    return f"generations in ms\n{table.to_string(float_format='{:.2f}'.format)}"


def _row(draws: int) -> tuple[float, ...]:
    model = deboom.read_platform("u06").model(vehicles="U06", motion="coupled")
    space = model.design_space()
    robust = Robust(model, space, sobol_sample(space.n_variables, draws, seed=1))
    share = np.random.default_rng(1).random((POPULATION, space.n_variables))
    designs = space.lower + share * (space.upper - space.lower)
    with (
        LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=":0", host="127.0.0.1"
        ) as cluster,
        workers_for(robust, workers=2) as processes,
        workers_for(robust, scheduler=cluster.scheduler_address) as spread,
    ):
        times = quiet_seconds(
            {
                "one": lambda: robust(designs),
                "processes": lambda: processes(designs),
                "Dask": lambda: spread(designs),
            },
            SECONDS[draws],
            calls=2,
        )
    one, processes_ms, dask = (1e3 * times[name] for name in ("one", "processes", "Dask"))
    serial = 1e3 * _of_nsga2(robust)
    ratios = [(one + serial) / (each + serial) for each in (processes_ms, dask, one / 2)]
    return one / POPULATION, serial, one, processes_ms, dask, *ratios


class _Timed(RobustWrapper):
    """A response that adds up the processor seconds of its evaluations."""

    def __init__(self, robust: Robust) -> None:
        self.robust, self.seconds = robust, 0.0

    def __call__(self, designs: RealArray) -> RobustValues:
        begin = time.thread_time()
        values = self.robust(designs)
        self.seconds += time.thread_time() - begin
        return values


def _of_nsga2(robust: Robust) -> float:
    """Processor seconds of a generation beside the evaluation of its designs."""
    timed = _Timed(robust)
    begin = time.thread_time()
    nsga2(timed, Search(POPULATION, SEARCHED, seed=1))
    return (time.thread_time() - begin - timed.seconds) / SEARCHED


if __name__ == "__main__":
    print(report())
