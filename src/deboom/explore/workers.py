"""Evaluation by this process, a pool of processes or a Dask cluster, with the same bits.

Every design is computed alone, so that a batch can be cut anywhere: it is cut into one chunk per
worker, and the rows come back in their order. A worker that dies costs time, nothing else.

Processes are those of loky (joblib): they do not run the main script again, so that it needs no
``if __name__ == "__main__"``, and what a script or a notebook defines travels by value.
"""

from __future__ import annotations

import math
import os
import pickle
import platform
import signal
import threading
import time
from abc import abstractmethod
from collections.abc import Iterator, Sequence
from concurrent.futures import CancelledError
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, contextmanager, nullcontext
from functools import cache
from importlib import import_module, metadata
from pickle import PicklingError
from typing import Any

import cloudpickle
import numpy as np
from joblib.externals.loky import ProcessPoolExecutor
from threadpoolctl import ThreadpoolController, threadpool_limits

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.robust import RobustEvaluation, RobustValues, RobustWrapper, joined

ATTEMPTS = 3
"""Times that one batch of designs may lose workers before the search gives up."""
CONNECT_S = 10.0
"""Wait for a cluster's scheduler [s]."""
RECOUNT_S = 2.0
"""How long a count of a cluster's workers holds [s]."""
WORKER_S = 60.0
"""Wait for a cluster's first worker, or for another one when the last has died [s]."""
PARENT_S = 1.0
"""Time between two looks of a worker process whether its parent is there [s]."""
SAME_ON_WORKERS = ("deboom", "numpy", "scipy")
"""Packages whose versions decide the last bit of a result."""


class SpreadResponse(RobustWrapper):
    """A robust response that is computed by workers: the values that one process would give."""

    n_workers: int
    lost: tuple[type[BaseException], ...] = (BrokenProcessPool,)
    where = "worker processes"

    def __init__(self, robust: RobustEvaluation) -> None:
        self.robust = robust
        self.start()

    def start(self) -> None:
        """Give the response to workers, also when some have died."""

    @abstractmethod
    def compute(self, chunks: Sequence[RealArray]) -> list[RobustValues]:
        """Return the values of every chunk of designs, in their order."""

    def __call__(self, designs: RealArray) -> RobustValues:
        """Return the values of the designs, shape (n, k)."""
        designs = self.space.checked(designs)
        chunks = np.array_split(designs, max(1, min(self.n_workers, len(designs))))
        for _ in range(ATTEMPTS):
            try:
                return joined(self.compute(chunks))
            except self.lost:
                self.start()
        raise InputError(
            f"{self.where} have died {ATTEMPTS} times in a row over the same designs: look for a "
            "lack of memory, in their logs if they have any, or take fewer workers"
        )


def workers_for(
    robust: RobustEvaluation, workers: int = 1, scheduler: str | None = None
) -> AbstractContextManager[RobustEvaluation]:
    """Return where a robust response is computed, as a context.

    - `robust`: response such as `Robust`, whose rows do not depend on each other.
    - `workers`: processes on this machine; 1 stays in this process.
    - `scheduler`, optional: address of an existing Dask cluster, such as ``tcp://node7:8786``.
    - raises InputError: workers and a cluster that cannot be; a response that cannot travel to
      another process.

    Examples
    --------
    >>> import numpy as np
    >>> from deboom.explore import robust, scatter, space
    >>> factors = space.stiffness_factor_space(("TSM x", "GeM x"))
    >>> model = space.ResponseFunction(np.square, factors.names, ("sedan", "tourer"), "dB")
    >>> alone = robust.Robust(model, factors, scatter.sobol_sample(2, seed=1))
    >>> with workers_for(alone, workers=1) as response:
    ...     response(factors.nominal[None, :]).sigma.shape
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
        return _dask_cluster(robust, scheduler)
    return _process_pool(robust, workers) if workers > 1 else nullcontext(robust)


@contextmanager
def _process_pool(robust: RobustEvaluation, workers: int) -> Iterator[RobustEvaluation]:
    """Compute on several processes of this machine."""
    try:
        carried = cloudpickle.dumps(robust)
    except (PicklingError, AttributeError, TypeError, ValueError) as error:
        raise InputError(
            f"the model cannot travel to other processes ({error}): let it open files, locks and "
            "connections when it is called, or take one worker"
        ) from None
    pool = _ProcessPool(robust, workers, carried)
    try:
        yield pool
    finally:
        pool.executor.shutdown(wait=True, kill_workers=True)


class _ProcessPool(SpreadResponse):
    """A pool of processes that is made anew when one of them dies."""

    def __init__(self, robust: RobustEvaluation, workers: int, carried: bytes) -> None:
        self.n_workers, self.carried = workers, carried
        super().__init__(robust)

    def start(self) -> None:
        self.executor = process_pool(self.n_workers, self.carried)

    def compute(self, chunks: Sequence[RealArray]) -> list[RobustValues]:
        return list(self.executor.map(_compute_carried, chunks))


# in a worker process of a pool: the one response that it computes, or why it has none
_carried: list[RobustEvaluation | str] = []


def process_pool(workers: int, carried: bytes = b"") -> ProcessPoolExecutor:
    """Return a pool of processes that end with this one, with a pickled response to compute."""
    # what stands in the working folder is no module of theirs
    safe = {"PYTHONSAFEPATH": "1"}
    return ProcessPoolExecutor(
        workers, initializer=_begin_worker, initargs=(os.getpid(), carried), env=safe
    )


def _begin_worker(parent: int, carried: bytes) -> None:
    # it ends with its parent, however that ends, and leaves Ctrl-C to it
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    import_module("scipy.linalg")  # what is loaded later would have threads of its own
    threadpool_limits(1, "blas")
    if carried:
        try:
            _carried[:] = [pickle.loads(carried)]
        except Exception as error:  # told with the first designs: a worker that dies says nothing
            _carried[:] = [f"{type(error).__name__}: {error}"]


def _end_with(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(PARENT_S)
    os._exit(1)


def _compute_carried(designs: RealArray) -> RobustValues:
    (robust,) = _carried
    if isinstance(robust, str):
        raise InputError(
            f"the model cannot be made again in a worker process ({robust}): let the module that "
            "defines it stand where any program finds it, such as an installed package, or take "
            "one worker"
        )
    return robust(designs)


@contextmanager
def _dask_cluster(robust: RobustEvaluation, scheduler: str) -> Iterator[RobustEvaluation]:
    """Compute on an existing Dask cluster."""
    try:
        from distributed import Client
    except ModuleNotFoundError:
        raise InputError(
            f"the cluster at {scheduler} needs Dask, which is not installed: "
            "pip install 'deboom[cluster]'"
        ) from None
    try:
        client = Client(scheduler, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:  # TypeError: tls:// without certificates
        raise InputError(
            f"no Dask scheduler answers at {scheduler} ({error}): start one with `dask scheduler` "
            "and give the address that it prints; tls:// needs Dask's own settings for certificates"
        ) from None
    with client:
        _wait_for_a_worker(client)
        _check_workers(client, scheduler)
        yield _DaskCluster(robust, client)


class _DaskCluster(SpreadResponse):
    """A cluster whose workers all hold the response."""

    where = "workers of the cluster"

    def __init__(self, robust: RobustEvaluation, client: Any) -> None:
        from distributed import KilledWorker

        self.client, self.counted = client, -math.inf
        self.lost = (CancelledError, KilledWorker)  # the last worker with the response died
        super().__init__(robust)

    def start(self) -> None:
        self.counted = -math.inf
        with _scheduler_answers(self.client):
            _wait_for_a_worker(self.client)
            # a list: a dataclass alone may be taken apart on its way
            self.scattered = self.client.scatter([self.robust], broadcast=True, hash=False)[0]

    @property
    def n_workers(self) -> int:  # type: ignore[override]  # a cluster grows and shrinks
        now = time.monotonic()
        if now > self.counted + RECOUNT_S:  # the scheduler's answer takes as long as some designs
            with _scheduler_answers(self.client):
                self.threads = max(1, int(sum(self.client.nthreads().values())))
            self.counted = now
        return self.threads

    def compute(self, chunks: Sequence[RealArray]) -> list[RobustValues]:
        with _scheduler_answers(self.client):
            # one message for all chunks: the scheduler's work on it counts where designs are quick
            robust = [self.scattered] * len(chunks)
            return list(self.client.gather(self.client.map(_compute, robust, chunks, pure=False)))


@contextmanager
def _scheduler_answers(client: Any) -> Iterator[None]:
    """Say in a sentence that a cluster's scheduler has gone; a failing model keeps its own."""
    try:
        yield
    except Exception as error:
        gone = isinstance(error, OSError) or client.status in ("closed", "closing")
        if not gone or isinstance(error, InputError):
            raise
        raise InputError(
            f"the scheduler of the cluster does not answer any more ({error}): finished "
            "generations are kept; start a scheduler again, or go on with --resume and --workers"
        ) from None


def _compute(robust: RobustEvaluation, designs: RealArray) -> RobustValues:
    with _linear_algebra().limit(limits=1, user_api="blas"):
        return robust(designs)


@cache
def _linear_algebra() -> ThreadpoolController:
    """Return the libraries whose threads are limited; looking for them takes longer than a task."""
    import_module("scipy.linalg")  # what is loaded later would have threads of its own
    return ThreadpoolController()


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
    for address, versions in client.run(_versions, on_error="return").items():
        if not isinstance(versions, dict):
            raise InputError(
                f"worker {address} of the cluster at {scheduler} cannot import deboom "
                f"({versions}): install the same version there"
            )
        for name, version in here.items():
            if versions[name] != version:
                raise InputError(
                    f"worker {address} of the cluster at {scheduler} has {name} {versions[name]}, "
                    f"this process {version}: identical results need the same version"
                )


def _versions() -> dict[str, str]:
    versions = {name: metadata.version(name) for name in SAME_ON_WORKERS}
    return {"Python": platform.python_version(), **versions}
