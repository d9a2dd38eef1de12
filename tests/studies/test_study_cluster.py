"""A real Dask cluster on loopback finds the front of one process, also when a worker is killed."""

import os
import signal
from dataclasses import fields

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.explore import workers
from deboom.explore.design_space import stiffness_factor_space
from deboom.explore.known_truth import quad2
from deboom.explore.problems import nsga2
from deboom.explore.robust import RobustResponse
from deboom.explore.tolerance_samples import sobol_sample
from deboom.explore.workers import workers_for

distributed = pytest.importorskip("distributed")

MODEL = quad2(4, seed=1)
SPACE = stiffness_factor_space(MODEL.variable_names)
ROBUST = RobustResponse(MODEL, SPACE, sobol_sample(4, 16, seed=1))


@pytest.fixture(scope="module")
def cluster():
    """Two workers, each a process of its own, restarted when they die."""
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None, host="127.0.0.1"
    ) as running:
        yield running


def test_a_worker_killed_mid_run_changes_nothing(cluster):
    whole = nsga2(ROBUST, 20, 8, seed=1)
    with workers_for(ROBUST, scheduler=cluster.scheduler_address) as spread:

        def progress(number, total, text):
            if number == 3:
                victim = next(iter(spread.pool.client.run(os.getpid).values()))
                os.kill(victim, getattr(signal, "SIGKILL", signal.SIGTERM))

        search = nsga2(spread, 20, 8, seed=1, progress=progress)
    for field in fields(whole.front):
        np.testing.assert_array_equal(
            getattr(search.front, field.name), getattr(whole.front, field.name)
        )
    np.testing.assert_array_equal(search.hypervolume, whole.hypervolume)


def test_when_all_workers_lose_the_response_it_is_sent_again(cluster):
    designs = 0.8 + 0.4 * np.random.default_rng(1).random((9, 4))
    with workers_for(ROBUST, scheduler=cluster.scheduler_address) as spread:
        expected = spread(designs)
        spread.pool.client.restart()
        np.testing.assert_array_equal(spread(designs).sigma, expected.sigma)


def test_a_worker_of_another_version_is_refused(cluster, monkeypatch):
    monkeypatch.setattr(workers.metadata, "version", lambda _: "0.0")
    with (
        pytest.raises(InputError, match=r"has deboom .*, this process 0\.0"),
        workers_for(ROBUST, scheduler=cluster.scheduler_address),
    ):
        pass


def test_nobody_at_the_address(monkeypatch):
    monkeypatch.setattr(workers, "CONNECT_S", 0.2)
    with (
        pytest.raises(InputError, match="no Dask scheduler answers at tcp://127"),
        workers_for(ROBUST, scheduler="tcp://127.0.0.1:9"),
    ):
        pass
