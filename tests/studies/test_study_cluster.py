"""A real Dask cluster on loopback finds the front of one process, also when a worker is killed."""

import os
import signal
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.explore import workers
from deboom.explore.robust import RobustResponse
from deboom.explore.scatter import sobol_sample
from deboom.explore.search import nsga2
from deboom.explore.space import stiffness_factor_space
from deboom.explore.workers import workers_for
from deboom.study.runner import load_study, run_study
from known_truth import quad2

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
                victim = next(iter(spread.client.run(os.getpid).values()))
                os.kill(victim, getattr(signal, "SIGKILL", signal.SIGTERM))

        search = nsga2(spread, 20, 8, seed=1, progress=progress)
    for field in fields(whole.front):
        np.testing.assert_array_equal(
            getattr(search.front, field.name), getattr(whole.front, field.name)
        )
    np.testing.assert_array_equal(search.hypervolume, whole.hypervolume)


def test_one_process_two_and_a_cluster_write_the_same_files(cluster, tmp_path):
    study = load_study(Path(__file__).parents[2] / "benchmarks" / "quad2_front.py")
    folders = [
        run_study(study, tmp_path / name, {"generations": 4, "population": 12, **who})
        for name, who in (
            ("alone", {}),
            ("pool", {"workers": 2}),
            ("cluster", {"scheduler": cluster.scheduler_address}),
        )
    ]
    files = [
        {
            path.relative_to(folder): path.read_bytes()
            for path in folder.rglob("*")
            # these hold times
            if path.is_file() and path.name not in ("run.json", "report.html", "search.json")
        }
        for folder in folders
    ]
    assert Path("front.csv") in files[0]
    assert files[0] == files[1] == files[2]


def test_when_all_workers_lose_the_response_it_is_sent_again(cluster):
    designs = 0.8 + 0.4 * np.random.default_rng(1).random((9, 4))
    with workers_for(ROBUST, scheduler=cluster.scheduler_address) as spread:
        expected = spread(designs)
        spread.client.restart()
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
