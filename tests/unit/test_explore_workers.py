"""Whoever computes, the result is the same bits."""

import doctest
import os
import signal
import subprocess
import sys
import threading
from dataclasses import fields, replace

import numpy as np
import pytest
from threadpoolctl import threadpool_info

from deboom.errors import InputError
from deboom.explore import workers
from deboom.explore.robust import Robust
from deboom.explore.scatter import FreshGaussianSampler, sobol_sample
from deboom.explore.search import Search, nsga2
from deboom.explore.space import ResponseFunction, stiffness_factor_space
from deboom.explore.workers import SpreadResponse, workers_for
from samples.known_truth import quad2

MODEL = quad2(4, seed=1)
SPACE = stiffness_factor_space(MODEL.variable_names)
ROBUST = Robust(MODEL, SPACE, sobol_sample(4, 16, seed=1))


def same(first, other):
    for field in fields(first):
        np.testing.assert_array_equal(getattr(first, field.name), getattr(other, field.name))


class _Chunks(SpreadResponse):
    """Workers that stand in this process, last chunk first."""

    def __init__(self, robust, n_workers):
        super().__init__(robust)
        self.n_workers = n_workers

    def compute(self, chunks):
        assert len(chunks) <= self.n_workers
        return [self.robust(chunk) for chunk in reversed(chunks)][::-1]


@pytest.mark.parametrize("n_workers", [1, 2, 3, 7, 64])
@pytest.mark.parametrize(
    "robust", [ROBUST, replace(ROBUST, sample=FreshGaussianSampler(4, seed=1))]
)
def test_chunks_of_any_size_give_the_same_rows(n_workers, robust):
    designs = 0.8 + 0.4 * np.random.default_rng(1).random((23, 4))
    same(_Chunks(robust, n_workers)(designs), robust(designs))


@pytest.mark.slow("begins processes and kills one")
def test_a_pool_finds_the_same_front_although_a_worker_is_killed():
    whole = nsga2(ROBUST, Search(20, 6, seed=1))
    with workers_for(ROBUST, workers=2) as pooled:

        def progress(number, total, text):
            if number == 3:
                victim = next(iter(pooled.executor._processes))
                os.kill(victim, getattr(signal, "SIGKILL", signal.SIGTERM))

        search = nsga2(pooled, Search(20, 6, seed=1), progress=progress)
    same(search.front, whole.front)
    np.testing.assert_array_equal(search.hypervolume, whole.hypervolume)


def test_workers_leave_ctrl_c_to_their_parent_and_have_one_thread_of_linear_algebra():
    with workers.process_pool(1) as pool:
        assert pool.submit(signal.getsignal, signal.SIGINT).result() is signal.SIG_IGN
        libraries = pool.submit(threadpool_info).result()
    assert {each["num_threads"] for each in libraries if each["user_api"] == "blas"} == {1}


class _Deadly:
    """A model that takes its process with it."""

    variable_names, response_names, response_unit = ("x1",), ("y1",), "1"

    def __call__(self, _):
        os._exit(1)


@pytest.mark.slow("begins pairs of processes again and again")
def test_workers_that_always_die_end_the_search_with_a_sentence(monkeypatch):
    monkeypatch.setattr(workers, "ATTEMPTS", 2)
    space = stiffness_factor_space(("x1",))
    deadly = Robust(_Deadly(), space, sobol_sample(1, 2, seed=1))
    with (
        workers_for(deadly, workers=2) as pooled,
        pytest.raises(InputError, match="have died 2 times in a row"),
    ):
        pooled(np.ones((2, 1)))


def test_a_model_that_cannot_travel_is_refused():
    lock = threading.Lock()
    local = ResponseFunction(lambda x: (lock, MODEL(x))[1], MODEL.variable_names,
                             MODEL.response_names, "1")  # fmt: skip
    with (
        pytest.raises(InputError, match="cannot travel to other processes"),
        workers_for(replace(ROBUST, evaluate=local), workers=2),
    ):
        pass


SCRIPT = """
import numpy as np
import deboom

shift = 0.9

def small(x):
    return ((x - shift) ** 2).sum(axis=1)

function = deboom.ResponseFunction(small, ("a", "b"), ("y",), "dB")

class Table:
    variable_names, response_names, response_unit = ("a", "b"), ("y",), "dB"
    def __init__(self):
        self.rows = np.random.default_rng(1).normal(size=(400, 400))  # more than a pipe holds
    def __call__(self, x):
        return function(x) + 0.0 * self.rows[0, 0]

budget = dict(population=8, generations=2, polish=False, verified_with=16)
robust = deboom.Robust(Table(), function.design_space(), draws=16)
one, two = (deboom.search(robust, workers=n, **budget) for n in (1, 2))
print(np.array_equal(one.values.objectives, two.values.objectives))
"""


@pytest.mark.slow("begins a script and its two processes")
@pytest.mark.parametrize("from_file", [True, False])
def test_what_a_script_without_a_guard_or_a_notebook_defines_reaches_the_workers(
    tmp_path, from_file
):
    """A notebook, too, has a ``__main__`` that no worker can import."""
    (tmp_path / "script.py").write_text(SCRIPT)
    with (tmp_path / "script.py").open() as cells:
        done = subprocess.run(
            [sys.executable, tmp_path / "script.py" if from_file else "-"],
            stdin=None if from_file else cells,
            capture_output=True,
            text=True,
            check=False,
            timeout=300,
        )
    assert done.stdout == "True\n", done.stderr


class _Licensed:
    """A model that cannot be made again in another process."""

    variable_names, response_names, response_unit = ("x1",), ("y1",), "1"

    def __call__(self, designs):
        return designs

    def __setstate__(self, state):
        raise RuntimeError("no licence left")

    def __getstate__(self):
        return {"seat": 1}


def test_a_worker_that_cannot_have_the_model_says_why_at_once(capfd):
    robust = Robust(_Licensed(), stiffness_factor_space(("x1",)), sobol_sample(1, 2, seed=1))
    with (
        workers_for(robust, workers=2) as pooled,
        pytest.raises(InputError, match=r"worker process .*no licence left.* one worker"),
    ):
        pooled(np.ones((2, 1)))
    assert "Traceback" not in capfd.readouterr().err


def test_what_cannot_be_is_refused():
    with pytest.raises(InputError, match="0 workers"):
        workers_for(ROBUST, 0)
    with pytest.raises(InputError, match="give one of the two"):
        workers_for(ROBUST, 2, "tcp://127.0.0.1:8786")


def test_without_dask_the_remedy_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with (
        pytest.raises(InputError, match=r"pip install 'deboom\[cluster\]'"),
        workers_for(ROBUST, scheduler="tcp://127.0.0.1:8786"),
    ):
        pass


def test_the_example_in_the_docstring_holds():
    results = doctest.testmod(workers)
    assert (results.attempted > 0, results.failed) == (True, 0)
