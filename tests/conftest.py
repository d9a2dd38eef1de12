"""What tests of every kind share: a finished run of the front study, and pictures in words."""

import gc
import os
from copy import deepcopy
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from filelock import FileLock
from matplotlib.pyplot import close

from browser_samples import Browser
from deboom.bench.campaign import CampaignPlan
from deboom.bench.campaign_writer import write_campaign
from deboom.files import platform, reader_process
from deboom.mounts import characterise
from deboom.pages import look
from deboom.pages.thesis import read_thesis
from deboom.report import Report
from deboom.runs import platform_options, runner, second_process
from deboom.runs.runner import load_study, run_study
from deboom.runs.thesis import typed
from deboom.vehicles import booming_model
from pinned_pages import captions_alone, pictures_described, run_aloud
from samples.campaign_runs import SEVEN_RUNS
from samples.thesis_runs import BUDGETS, FURTHER, IN_WORDS

pytest_plugins = ["processor_time", "pytester"]
STUDIES = Path(__file__).parents[1] / "studies"
# thousands of tests stay in memory, and every round of the garbage collector passes all of them
gc.set_threshold(50_000, 20, 50)


@pytest.fixture(scope="session")
def made_once(tmp_path_factory):
    """Return a function that makes a folder once for all workers; nobody changes what is in it."""
    top = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        top = top.parent

    def made(name, make):
        """Return the folder that ``make(folder)`` returned, to whichever worker called it."""
        answer = top / f"{name}.path"
        with FileLock(top / f"{name}.lock"):
            if not answer.exists():
                folder = make(top / name)
                answer.write_text(os.fspath(folder), encoding="utf-8")
        return Path(answer.read_text(encoding="utf-8"))

    return made


@pytest.fixture(scope="session", autouse=True)
def shipped_files_once():
    # studies read and check the shipped platform, and describe their environment, again and again
    read = platform.read_platform
    kept = cache(read)

    def read_once(folder):
        path = platform.platform_folder(folder)
        return (kept if STUDIES / "data" in path.parents else read)(path)

    with pytest.MonkeyPatch.context() as patch:
        for module in (platform, platform_options, look):
            patch.setattr(module, "read_platform", read_once)
        record = cache(runner.environment_record)
        patch.setattr(runner, "environment_record", lambda packages: deepcopy(record(packages)))
        yield


@pytest.fixture(scope="session", autouse=True)
def first_process_alone():
    # a second one of each run takes longer to start than a test's study, and would draw for real
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(second_process, "cpu_count", lambda: 1)
        yield


@pytest.fixture(scope="session")
def reader_of_each_folder():
    """Return what starts a process for the files of each folder, as outside of tests."""
    return reader_process._reader_of


@pytest.fixture(scope="session", autouse=True)
def one_reader(reader_of_each_folder):
    # every test has a folder of its own, and starting a process takes longer than most files
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(reader_process, "_reader_of", lambda _: reader_of_each_folder(Path()))
        yield


@pytest.fixture(autouse=True)
def closed_figures():
    """Close what a test drew and did not keep: matplotlib complains of many open figures."""
    yield
    close("all")


@pytest.fixture(scope="module")
def browser():
    """Open a real browser; tests are skipped where there is none."""
    opened = Browser()
    yield opened
    opened.close()


@pytest.fixture(scope="module")
def few_chains():
    """Draw fewer measuring chains for the error budgets of mounts, which nobody looks at."""
    budget = characterise.error_budget
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            characterise, "error_budget", lambda *a, **k: budget(*a, **k | {"n_draws": 20})
        )
        yield


@pytest.fixture(scope="module")
def described_pictures():
    """See `pictures_described`."""
    with pictures_described():
        yield


@pytest.fixture(scope="module")
def no_pictures():
    """Draw nothing where tests look at numbers alone: pictures take longer than they do."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Report, "figure", lambda *_, **__: None)
        yield


@pytest.fixture
def plain_loops(monkeypatch):
    """Sum levels in numpy: compiling for one small platform takes longer than its search."""
    summed = booming_model.level_sum
    monkeypatch.setattr(booming_model, "level_sum", lambda case, **_: summed(case, compiled=False))


@pytest.fixture(scope="session")
def front_run(made_once):
    """Folder of a finished run of the front study on a tiny budget, which nobody changes."""
    budget = {"generations": 2, "population": 12, "samples": 16, "checks": 128}
    budget |= {"with_": "prescribed"}

    def run(out):
        with captions_alone():
            return run_study(load_study(STUDIES / "front.py"), out, budget)

    return made_once("front", run)


@pytest.fixture(scope="session")
def seven_runs(made_once):
    """Folder of a campaign of seven runs on one bench, which nobody changes."""
    plan = CampaignPlan(("M1",), SEVEN_RUNS, 2, frequency=np.arange(20.0, 80.5, 1.0))
    return made_once("seven_runs", lambda out: write_campaign(out / "seven_runs", 1, plan))


@pytest.fixture(scope="session")
def thesis_run(made_once, request):
    """Return what gives the finished run of one of the thesis's commands, made once for all."""

    def finished(name):
        if name == "front":  # of coupled motion, which has the same page
            return request.getfixturevalue("front_run")
        budget = BUDGETS.get(name, {})
        if name == "mounts":
            budget = {"campaign": request.getfixturevalue("seven_runs")}

        def run(out):
            study, options = typed({**read_thesis().runs, **FURTHER}[name])
            with pictures_described() if name in IN_WORDS else captions_alone():
                return run_aloud(study, out, {**options, **budget})

        return made_once(f"thesis_{name}", run)

    return finished
