"""Who computes: this process, a pool of processes, or a Dask cluster. The result is the same.

The robust response travels to each worker once. Then every batch of designs is cut into one chunk
per worker, and the rows come back in their order. A worker that dies costs time, nothing else.
"""

from __future__ import annotations

import platform
from collections.abc import Iterator, Sequence
from concurrent.futures import CancelledError, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from importlib import metadata
from multiprocessing import get_context
from multiprocessing.reduction import ForkingPickler
from pickle import PicklingError
from typing import Any, Protocol

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.robust import Robust, RobustValues, joined
from deboom.explore.space import DesignSpace

ATTEMPTS = 3
"""Times that one batch of designs may lose workers before the search gives up."""

CONNECT_S = 10.0
"""Wait for a cluster's scheduler [s]."""

WORKER_S = 60.0
"""Wait for a cluster's first worker, or for another one when the last has died [s]."""

SAME_ON_WORKERS = ("deboom", "numpy", "scipy")
"""Packages whose versions decide the last bit of a result."""


class Pool(Protocol):
    """Workers that hold one robust response."""

    @property
    def n_workers(self) -> int:
        """How many there are now, at least 1."""

    def compute(self, chunks: Sequence[RealArray]) -> list[RobustValues]:
        """Return the values of each chunk of designs, in their order."""


@dataclass(frozen=True, eq=False)
class SpreadResponse:
    """A robust response that is computed by workers.

    Parameters
    ----------
    space : DesignSpace
        Of the response that the workers hold.
    pool : Pool
        The workers.
    n_objectives : int
        Of that response.
    """

    space: DesignSpace
    pool: Pool
    n_objectives: int = 2

    def __call__(self, designs: RealArray) -> RobustValues:
        """Return the values of the designs, shape (n, k): those that one process would give.

        Raises
        ------
        InputError
            Workers that die again and again, and what the response itself refuses.
        """
        designs = self.space.checked(designs)
        n_chunks = max(1, min(self.pool.n_workers, len(designs)))
        parts = self.pool.compute(np.array_split(designs, n_chunks))
        return joined(parts)


def workers_for(
    robust: Robust, workers: int = 1, scheduler: str | None = None
) -> AbstractContextManager[Robust]:
    """Return where a robust response is computed, as a context.

    Parameters
    ----------
    robust : Robust
        Such as `RobustResponse`. Its rows do not depend on each other. Beyond one process it
        consists of objects of importable modules.
    workers : int
        Processes on this machine; 1 stays in this process.
    scheduler : str, optional
        Address of an existing Dask cluster, such as ``tcp://node7:8786``.

    Returns
    -------
    context manager
        Its value is the response to use inside: the same bits, whoever computes them.

    Raises
    ------
    InputError
        Fewer than one worker, or both a pool and a cluster; see also `process_pool` and
        `dask_cluster`.

    Examples
    --------
    >>> from deboom.explore import design_space, known_truth, robust, tolerance_samples
    >>> model = known_truth.quad2(4, seed=1)
    >>> space = design_space.stiffness_factor_space(model.variable_names)
    >>> alone = robust.RobustResponse(model, space, tolerance_samples.sobol_sample(4, seed=1))
    >>> with workers_for(alone, workers=1) as response:
    ...     response(space.nominal[None, :]).sigma.shape
    (1, 2)
    """
    if workers < 1:
        raise InputError(f"{workers} workers cannot compute anything: take a whole number from 1")
    if scheduler is not None:
        if workers > 1:
            raise InputError(
                f"{workers} workers here and the cluster at {scheduler} cannot both compute: "
                "give one of the two"
            )
        return dask_cluster(robust, scheduler)
    return process_pool(robust, workers) if workers > 1 else nullcontext(robust)


@contextmanager
def process_pool(robust: Robust, workers: int) -> Iterator[Robust]:
    """Compute on several processes of this machine.

    Raises
    ------
    InputError
        A response that cannot travel to another process.
    """
    try:
        ForkingPickler.dumps(robust)
    except (PicklingError, AttributeError, TypeError) as error:
        raise InputError(
            f"the model cannot travel to other processes ({error}): make it of classes and "
            "functions of an importable module, outside of the study script, or take one worker"
        ) from None
    pool = _ProcessPool(robust, workers)
    try:
        yield SpreadResponse(robust.space, pool, getattr(robust, "n_objectives", 2))
    finally:
        pool.close()


@contextmanager
def dask_cluster(robust: Robust, scheduler: str) -> Iterator[Robust]:
    """Compute on an existing Dask cluster.

    Raises
    ------
    InputError
        Dask is not installed, nothing answers at the address, no worker is there, or a worker has
        other versions of what decides the last bit.
    """
    try:
        from distributed import Client
    except ModuleNotFoundError:
        raise InputError(
            f"the cluster at {scheduler} needs Dask, which is not installed: "
            "pip install 'deboom[cluster]'"
        ) from None
    try:
        client = Client(scheduler, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError(
            f"no Dask scheduler answers at {scheduler} ({error}): start one with `dask scheduler` "
            "and give the address that it prints"
        ) from None
    with client:
        _wait_for_a_worker(client)
        _check_workers(client, scheduler)
        pool = _DaskCluster(robust, client)
        yield SpreadResponse(robust.space, pool, getattr(robust, "n_objectives", 2))


class _ProcessPool:
    """A pool of spawned processes that is made anew when one of them dies."""

    def __init__(self, robust: Robust, workers: int) -> None:
        self.robust = robust
        self.n_workers = workers
        self._start()

    def _start(self) -> None:
        self._executor = ProcessPoolExecutor(
            self.n_workers, get_context("spawn"), initializer=_carry, initargs=(self.robust,)
        )

    def compute(self, chunks: Sequence[RealArray]) -> list[RobustValues]:
        done: dict[int, RobustValues] = {}
        for _ in range(ATTEMPTS):
            try:
                futures = {
                    number: self._executor.submit(_compute_carried, chunk)
                    for number, chunk in enumerate(chunks)
                    if number not in done
                }
                for number, future in futures.items():
                    done[number] = future.result()
            except BrokenProcessPool:
                self.close()
                self._start()
            else:
                return [done[number] for number in range(len(chunks))]
        raise InputError(
            f"worker processes have died {ATTEMPTS} times in a row over the same designs: look for "
            "a lack of memory, or take fewer workers"
        )

    def close(self) -> None:
        self._executor.shutdown(wait=True, cancel_futures=True)


_carried: list[Robust] = []
"""In a worker process of a pool: the one response that it computes."""


def _carry(robust: Robust) -> None:
    _carried[:] = [robust]


def _compute_carried(designs: RealArray) -> RobustValues:
    return _carried[0](designs)


class _DaskCluster:
    """A cluster whose workers all hold the response."""

    def __init__(self, robust: Robust, client: Any) -> None:
        self.robust = robust
        self.client = client
        self._scatter()

    def _scatter(self) -> None:
        # a list: a dataclass alone may be taken apart on its way
        self._held = self.client.scatter([self.robust], broadcast=True, hash=False)[0]

    @property
    def n_workers(self) -> int:
        return max(1, int(sum(self.client.nthreads().values())))

    def compute(self, chunks: Sequence[RealArray]) -> list[RobustValues]:
        from distributed import KilledWorker

        for _ in range(ATTEMPTS):
            futures = [
                self.client.submit(_compute, self._held, chunk, pure=False) for chunk in chunks
            ]
            try:
                return list(self.client.gather(futures))
            except (CancelledError, KilledWorker):  # the last worker that held the response died
                _wait_for_a_worker(self.client)
                self._scatter()
        raise InputError(
            f"workers of the cluster have died {ATTEMPTS} times in a row over the same designs: "
            "look for a lack of memory in their logs"
        )


def _compute(robust: Robust, designs: RealArray) -> RobustValues:
    return robust(designs)


def _wait_for_a_worker(client: Any) -> None:
    try:
        client.wait_for_workers(1, timeout=WORKER_S)
    except TimeoutError:
        address = client.scheduler.address
        raise InputError(
            f"the cluster at {address} has no worker: start one with `dask worker {address}`"
        ) from None


def _check_workers(client: Any, scheduler: str) -> None:
    """Refuse workers whose results might differ in the last bit."""
    here = _versions()
    for address, there in client.run(_versions, on_error="return").items():
        if not isinstance(there, dict):
            raise InputError(
                f"worker {address} of the cluster at {scheduler} cannot import deboom ({there}): "
                "install the same version there"
            )
        for name, version in here.items():
            if there[name] != version:
                raise InputError(
                    f"worker {address} of the cluster at {scheduler} has {name} {there[name]}, "
                    f"this process {version}: identical results need the same version"
                )


def _versions() -> dict[str, str]:
    versions = {name: metadata.version(name) for name in SAME_ON_WORKERS}
    return {"Python": platform.python_version(), **versions}
