"""A run that is killed goes on, by the same command, and ends with the same files."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from dataclasses import fields
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import command_line
from command_line import call
from deboom.errors import InputError
from deboom.explore import search as searches
from deboom.explore import workers
from deboom.explore.robust import Robust
from deboom.explore.scatter import sobol_sample
from deboom.explore.search import Search, nsga2
from deboom.explore.space import stiffness_factor_space
from deboom.explore.workers import workers_for
from deboom.files import run_folder as run_lock
from deboom.runs import runner
from deboom.runs.runner import load_study, resume_study, run_study
from samples.known_truth import quad2

STUDY = Path(__file__).parents[1] / "samples" / "quad2_front.py"
BUDGET = {"seed": 2, "generations": 12, "population": 20}


@pytest.fixture(scope="module")
def study():
    return load_study(STUDY)


@pytest.fixture
def note(tmp_path):
    """Make a file that counts as an input."""
    path = tmp_path / "note.txt"
    path.write_text("as measured")
    return path


def interrupt(error=KeyboardInterrupt):
    raise error


def kill():
    os.kill(os.getpid(), signal.SIGKILL)


def stopped(until, end=interrupt):
    """Return a search that comes to an end after some generations."""

    def stopped(*arguments, progress, **options):
        def told(number, total, text):
            if number == until:
                end()

        return nsga2(*arguments, progress=told, **options)

    return stopped


def interrupted(monkeypatch, study, out, note, error=KeyboardInterrupt):
    """Leave a run that ended after six generations, without the cost of a process."""
    with monkeypatch.context() as patch:
        patch.setattr(searches, "nsga2", stopped(6, partial(interrupt, error)))
        with pytest.raises(type(error) if isinstance(error, InputError) else error):
            run_study(study, out, {**BUDGET, "note": note})
    (folder,) = (out / "quad2_front").iterdir()
    assert folder.name.endswith(".unfinished")
    return folder


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="there is no kill -9 on this system")
@pytest.mark.parametrize("until", [0, 7, 12])
def test_after_kill_9_the_run_goes_on_to_the_identical_front(study, tmp_path, note, until):
    """Killed before its search, after some generations, and after its search."""
    out = tmp_path / "results"
    if not (child := os.fork()):
        try:
            searches.nsga2 = stopped(until, kill) if until else lambda *_, **__: kill()
            run_study(study, out, {**BUDGET, "note": note})
        finally:
            os._exit(1)
    assert os.WTERMSIG(os.waitpid(child, 0)[1]) == signal.SIGKILL
    (folder,) = (out / "quad2_front").iterdir()
    assert (folder / "search" / "search.json").exists() == (until > 0)
    finished = resume_study(study, out, folder.name, {})
    assert finished == folder.with_name(folder.name.removesuffix(".unfinished"))
    assert not folder.exists()
    whole = run_study(study, tmp_path / "whole", {**BUDGET, "note": note})
    files = sorted(path.relative_to(whole) for path in whole.rglob("*") if path.is_file())
    assert files == sorted(p.relative_to(finished) for p in finished.rglob("*") if p.is_file())
    for name in files:
        if name.name not in ("run.json", "report.html", "search.json"):  # these hold times
            assert (finished / name).read_bytes() == (whole / name).read_bytes(), name
    kept = (finished / "search" / "evaluations").glob("*.npz")
    assert sum(len(np.load(path)["designs"]) for path in kept) == 240


def test_a_finished_run_prints_its_folder(study, tmp_path):
    finished = run_study(study, tmp_path, BUDGET)
    before = sorted(tmp_path.rglob("*"))
    for wanted in (finished, finished.name, f"{finished.name}.unfinished"):
        done = call("run", STUDY, "--out", tmp_path, "--resume", wanted)
        assert done.stdout.strip() == finished.as_posix()
    longer = ("run", STUDY, "--out", tmp_path, "--resume", finished.name, "--generations", "99")
    assert "was started with --generations" in call(*longer, code=2).stderr
    assert sorted(tmp_path.rglob("*")) == before


def test_a_run_may_end_where_it_stands_still_and_its_record_says_so(study, tmp_path):
    long = ("--generations", "60", "--population", "20", "--out", tmp_path, "--algorithm", "nsga3")
    folder = Path(call("run", STUDY, *long, "--until-gain", "0.05").stdout.strip())
    record = json.loads((folder / "search" / "search.json").read_text())
    n = len(list((folder / "search" / "evaluations").iterdir()))
    assert 10 < n < 60
    assert record["stopped"] == f"{n} generations, ended by a gain below 0.05 over 10 generations"
    assert record["algorithm"] == "nsga3"
    arguments = json.loads((folder / "run.json").read_text())["arguments"]
    assert (arguments["until_gain"], arguments["algorithm"]) == (0.05, "nsga3")
    folder = Path(call("run", STUDY, *long, "--until-seconds", "0.001").stdout.strip())
    record = json.loads((folder / "search" / "search.json").read_text())
    assert record["stopped"] == "1 generation, ended after 0.001 s"
    command_line.refused(("run", STUDY, *long, "--until-gain", "0"), "below a positive gain")


def test_list_shows_finished_running_and_unfinished_runs(study, tmp_path, note, monkeypatch):
    out = tmp_path / "results"
    command_line.refused(("list", out), "no such folder")
    folder = interrupted(monkeypatch, study, out, note)
    finished = run_study(study, out, BUDGET)
    shown = call("list", out)
    assert f"unfinished  quad2_front  {folder.as_posix()}" in shown.stdout
    assert re.search(rf"finished +quad2_front  {finished.as_posix()}\n", shown.stdout)
    with run_lock.held(folder):
        assert f"running     quad2_front  {folder.as_posix()}" in call("list", out).stdout
        with pytest.raises(InputError, match="is being worked on by another process"):
            resume_study(study, out, folder.name, {})
    assert resume_study(study, out, str(folder), {}).is_dir()
    assert "unfinished" not in call("list", out).stdout


def refused(folder, *words, options=()):
    """One sentence that names what differs; the run stays as it is."""
    before = {p: p.read_bytes() for p in folder.rglob("*") if p.is_file() and p.name != ".lock"}
    command = ("run", STUDY, "--out", folder.parents[1], "--resume", folder.name, *options)
    command_line.refused(command, *words)
    after = {p: p.read_bytes() for p in folder.rglob("*") if p.is_file() and p.name != ".lock"}
    assert after == before


def test_another_option_input_version_or_text_is_refused_by_name(
    study, tmp_path, note, monkeypatch
):
    folder = interrupted(monkeypatch, study, tmp_path / "results", note)
    refused(folder, "--generations 12, not 13", options=["--generations", "13"])
    refused(folder, "--seed 2, not 3", options=["--seed", "3"])
    note.write_text("measured again")
    refused(folder, "note.txt has changed")
    note.write_text("as measured")

    environment = runner.environment_record
    for name, change in (
        ("numpy", lambda r: r["packages"].update(numpy="1.0")),
        ("deboom", lambda r: r["packages"].update(deboom="9.9")),
        ("Python", lambda r: r.update(python="3.1")),
        ("sources of deboom", lambda r: r.update(sources_sha256="abc")),
    ):

        def other(packages, change=change):
            record = environment(packages)
            change(record)
            return record

        with monkeypatch.context() as patch:
            patch.setattr(runner, "environment_record", other)
            refused(folder, f"was started with {name} ")

    record = json.loads((folder / "run.json").read_text())
    (folder / "run.json").write_text(json.dumps({**record, "study_text": "another"}))
    refused(folder, "another text of the study quad2_front")
    (folder / "run.json").write_text(json.dumps({**record, "study": "other"}))
    refused(folder, "belongs to the study other")
    (folder / "run.json").write_text(json.dumps({**record, "arguments": {"seed": 2, "old": 1}}))
    refused(folder, "options that this study does not take")
    (folder / "run.json").write_text("{")
    refused(folder, "run.json is not JSON")


def test_options_that_change_nothing_may_change(study, tmp_path, note, monkeypatch):
    """The run keeps its own options; who computes may be another."""
    folder = interrupted(monkeypatch, study, tmp_path / "results", note)
    given = {"workers": 2, "seed": 2}
    finished = resume_study(study, tmp_path / "results", folder.name, given)
    record = json.loads((finished / "run.json").read_text())
    assert record["arguments"]["workers"] == 2
    assert record["arguments"]["generations"] == 12
    whole = run_study(study, tmp_path / "whole", {**BUDGET, "note": note})
    assert (finished / "front.csv").read_bytes() == (whole / "front.csv").read_bytes()


def test_other_code_goes_on_only_when_insisted_and_is_recorded(study, tmp_path, note, monkeypatch):
    folder = interrupted(monkeypatch, study, tmp_path / "results", note)
    record = json.loads((folder / "run.json").read_text())
    record["environment"]["sources_sha256"] = "0" * 64
    (folder / "run.json").write_text(json.dumps(record))
    refused(folder, "sources of deboom 000000000000, now it is", "--other-code")
    result = call("run", STUDY, "--out", tmp_path / "results", "--resume", folder, "--other-code")
    (then,) = json.loads((Path(result.stdout.strip()) / "run.json").read_text())["begun_with"]
    assert then.startswith("sources of deboom 000000000000")


def test_ctrl_c_says_what_is_kept_and_how_to_go_on(study, tmp_path, monkeypatch):
    monkeypatch.setattr(searches, "nsga2", stopped(3))
    monkeypatch.setattr(runner, "load_study", lambda _: study)
    out = tmp_path / "results"
    result = call("run", STUDY, "--out", out, "--seed", "2", "--generations", "4", code=130)
    (folder,) = (out / "quad2_front").iterdir()
    name = folder.name.removesuffix(".unfinished")
    assert f"3 generations are kept in {folder}" in result.stderr
    assert f"deboom run {STUDY} --out {out} --resume {name}" in result.stderr


@pytest.mark.slow("begins processes")
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="processes are read from /proc")
def test_workers_end_with_their_parent(tmp_path):
    options = ("--generations", "100000", "--workers", "2", "--out", str(tmp_path))
    path = os.pathsep.join([str(STUDY.parents[1]), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, "-m", "deboom", "run", str(STUDY), *options]
    parent = subprocess.Popen(command, env={**os.environ, "PYTHONPATH": path})
    deadline = time.monotonic() + 120.0
    while not list(tmp_path.glob("*/*/search/evaluations/000002.npz")):
        assert parent.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.1)
    workers = children(parent.pid)
    assert len(workers) >= 2
    parent.send_signal(signal.SIGKILL)
    parent.wait(timeout=10.0)
    deadline = time.monotonic() + 5.0
    while alive := [pid for pid in workers if Path(f"/proc/{pid}/stat").exists()]:
        assert time.monotonic() < deadline, alive
        time.sleep(0.1)


def children(parent):
    """Return the processes whose parent is this one."""
    pids = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            after_name = path.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(after_name[1]) == parent and after_name[0] != "Z":
            pids.append(int(path.parent.name))
    return pids


def test_a_figure_that_fails_costs_only_itself(study, tmp_path, monkeypatch):
    def broken(*arguments, **options):
        raise ValueError("no finite level")

    report = study.module.run

    def run(model, options, context):
        written = report(model, options, context)
        written.figure("broken", broken, "A figure.")
        return written

    monkeypatch.setattr(study.module, "run", run)
    monkeypatch.setattr(runner, "load_study", lambda _: study)
    result = call("run", STUDY, "--out", tmp_path, "--seed", "2", "--generations", "2", code=3)
    assert "the figure broken could not be drawn (no finite level)" in result.stderr
    folder = Path(result.stdout.strip())
    assert (folder / "front.csv").is_file()
    assert "could not be drawn" in (folder / "report.html").read_text()


def drawing(study, monkeypatch, end):
    """Make drawing the last picture of the study end its run."""
    report = study.module.run

    def run(model, options, context):
        written = report(model, options, context)
        written.figure("last", end, "A figure.")
        return written

    monkeypatch.setattr(study.module, "run", run)


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="there is no kill -9 on this system")
def test_a_run_killed_while_it_draws_leaves_its_front_and_goes_on(study, tmp_path, monkeypatch):
    out = tmp_path / "results"
    if not (child := os.fork()):
        try:
            drawing(study, monkeypatch, kill)
            run_study(study, out, BUDGET)
        finally:
            os._exit(1)
    assert os.WTERMSIG(os.waitpid(child, 0)[1]) == signal.SIGKILL
    (folder,) = (out / "quad2_front").iterdir()
    assert not (folder / "report.html").exists()
    whole = run_study(study, tmp_path / "whole", BUDGET)
    tables = sorted(path.name for path in whole.glob("*.csv"))
    assert "front.csv" in tables
    for name in (*tables, "summary.json"):
        assert (folder / name).read_bytes() == (whole / name).read_bytes(), name
    assert (resume_study(study, out, folder.name, {}) / "report.html").exists()


def test_whoever_stops_the_drawing_reads_that_the_tables_are_kept(study, tmp_path, monkeypatch):
    drawing(study, monkeypatch, interrupt)
    with pytest.raises(KeyboardInterrupt, match="12 generations and all tables are kept in "):
        run_study(study, tmp_path, BUDGET)


def test_half_written_files_of_a_killed_process_go(study, tmp_path, note, monkeypatch):
    folder = interrupted(monkeypatch, study, tmp_path / "results", note)
    scratch = folder / "search" / ".write-abc"
    scratch.mkdir()
    (scratch / "search.json").write_bytes(b"{")
    finished = resume_study(study, tmp_path / "results", folder.name, {})
    assert not [path for path in finished.rglob("*") if path.name.startswith(".")]


def test_bad_input_after_evaluations_keeps_them(study, tmp_path, note, monkeypatch):
    lost = InputError("the cluster is gone")
    folder = interrupted(monkeypatch, study, tmp_path / "results", note, lost)
    assert len(list((folder / "search" / "evaluations").iterdir())) == 6


distributed = pytest.importorskip("distributed")

MODEL = quad2(4, seed=1)
SPACE = stiffness_factor_space(MODEL.variable_names)
ROBUST = Robust(MODEL, SPACE, sobol_sample(4, 16, seed=1))


@pytest.fixture(scope="module")
def cluster():
    """Two workers, each a process of its own, restarted when they die."""
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=":0", host="127.0.0.1"
    ) as running:
        yield running


def test_a_worker_killed_mid_run_changes_nothing(cluster):
    whole = nsga2(ROBUST, Search(20, 8, seed=1))
    with workers_for(ROBUST, scheduler=cluster.scheduler_address) as spread:

        def progress(number, total, text):
            if number == 3:
                victim = next(iter(spread.client.run(os.getpid).values()))
                os.kill(victim, getattr(signal, "SIGKILL", signal.SIGTERM))

        search = nsga2(spread, Search(20, 8, seed=1), progress=progress)
    for field in fields(whole.front):
        np.testing.assert_array_equal(
            getattr(search.front, field.name), getattr(whole.front, field.name)
        )
    np.testing.assert_array_equal(search.hypervolume, whole.hypervolume)


def test_one_process_two_and_a_cluster_write_the_same_files(cluster, tmp_path):
    study = load_study(Path(__file__).parents[1] / "samples" / "quad2_front.py")
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


def test_what_a_notebook_defines_reaches_the_workers_of_a_cluster(cluster, monkeypatch):
    cell = {"np": np, "__name__": "__main__"}
    exec(
        "class Table:\n"
        "    variable_names, response_names, response_unit = ('a',), ('y',), 'dB'\n"
        "    rows = np.full((400, 400), 0.9)\n"
        "    def __call__(self, designs):\n"
        "        return (designs - self.rows[0, 0]) ** 2\n",
        cell,
    )
    monkeypatch.setattr(sys.modules["__main__"], "Table", cell["Table"], raising=False)
    robust = Robust(cell["Table"](), stiffness_factor_space(("a",)), sobol_sample(1, 16, seed=1))
    designs = np.linspace(0.8, 1.2, 7)[:, np.newaxis]
    with workers_for(robust, scheduler=cluster.scheduler_address) as spread:
        np.testing.assert_array_equal(spread(designs).mean, robust(designs).mean)


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


@pytest.mark.slow("starts a cluster of Dask as its users do")
def test_a_killed_scheduler_leaves_a_run_that_resume_takes(study, tmp_path, monkeypatch):
    file = tmp_path / "scheduler.json"
    program = (sys.executable, "-m")
    where = ("--port", "0", "--host", "127.0.0.1", "--no-dashboard", "--scheduler-file", str(file))
    here = os.pathsep.join([str(STUDY.parents[1]), os.environ.get("PYTHONPATH", "")])
    quiet = {"env": {**os.environ, "PYTHONPATH": here}, "stderr": subprocess.DEVNULL}
    scheduler = subprocess.Popen([*program, "distributed.cli.dask_scheduler", *where], **quiet)
    started = [scheduler]
    try:
        deadline = time.monotonic() + 120.0
        while not file.exists() or not file.read_text():
            assert time.monotonic() < deadline
            time.sleep(0.1)
        address = json.loads(file.read_text())["address"]
        of_worker = (address, "--no-nanny", "--nthreads", "1", "--no-dashboard")
        worker = [*program, "distributed.cli.dask_worker", *of_worker]
        started.append(subprocess.Popen(worker, **quiet))
        with distributed.Client(address) as client:
            client.wait_for_workers(1, timeout=120)
        with monkeypatch.context() as patch:
            patch.setattr(workers, "WORKER_S", 2.0)
            patch.setattr(searches, "nsga2", stopped(5, scheduler.kill))
            with pytest.raises(InputError, match="scheduler of the cluster does not answer"):
                run_study(study, tmp_path / "results", {**BUDGET, "scheduler": address})
    finally:
        for process in started:
            process.kill()
            process.wait()
    (folder,) = (tmp_path / "results" / "quad2_front").iterdir()
    assert len(list((folder / "search" / "evaluations").iterdir())) >= 5
    finished = resume_study(study, tmp_path / "results", folder.name, {"scheduler": None})
    whole = run_study(study, tmp_path / "whole", BUDGET)
    assert (finished / "front.csv").read_bytes() == (whole / "front.csv").read_bytes()
