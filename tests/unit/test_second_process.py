"""What a second process does for a run is what the first one would do, to the byte."""

import os
import sys
import threading
import warnings
from concurrent.futures.process import BrokenProcessPool
from types import ModuleType

import numpy as np
import pytest

from deboom import plot
from deboom.errors import DataWarning, InputError
from deboom.report import Report
from deboom.runs.second_process import Pending, SecondProcess, begun


@pytest.fixture(scope="module")
def second():
    with SecondProcess(cores=2) as process:
        yield process


def report_of_pictures(offset=0.0):
    """Two pictures, one drawn by seaborn, and one that cannot be drawn."""
    x = np.linspace(0.0, 1.0, 30)
    report = Report("Two pictures")
    report.section("Pictures")
    labels = {"mean_label": "mean [dB(A)]", "sigma_label": "sigma [dB]"}
    front = {"front": (x, 1.0 - x + offset)}
    report.figure("front", lambda: plot.fronts(front, {}, {}, **labels), "A front.")
    groups = {"a": {"level [dB(A)]": x, "σ [dB]": x**2}, "b": {"level [dB(A)]": 1 - x, "σ [dB]": x}}
    colours = {"a": "#0072B2", "b": "#D55E00"}
    report.figure("pairs", lambda: plot.grouped_pairs(groups, colours), "Pairs.")
    report.figure("none", lambda: plot.fronts({}, {}, {}, **labels), "No front.")
    return report


def test_pictures_are_the_same_bytes_wherever_they_are_drawn(second):
    here, there = report_of_pictures(), report_of_pictures()
    second.draw(there.every_picture)
    for pending in list(second.pictures.values())[:2]:
        pending.future.result()  # waits: what has not begun is drawn here
    second.drawn(there.every_picture)
    assert [picture for picture in there.every_picture if "_drawn" not in vars(picture)] == []
    assert list(there.figures) == ["front", "pairs"]
    assert there.figures == here.figures
    assert there.failures == here.failures
    assert "there is no front to draw" in there.failures[0]


def test_a_task_is_done_by_another_process(second):
    pending = second.begin(os.getpid)
    there, warned = pending.future.result()  # waits: what has not begun is done here
    assert there != os.getpid()
    assert warned == []
    assert pending.result() == there


def test_an_error_of_a_task_is_raised_where_its_result_is_read(second):
    def refuse():
        warnings.warn("nobody states the angle", DataWarning, stacklevel=2)
        raise InputError("n = 7: take a power of two")

    pending = second.begin(refuse)
    assert isinstance(pending.future.exception(), InputError)
    with (
        pytest.warns(DataWarning, match="nobody states"),
        pytest.raises(InputError, match="n = 7"),
    ):
        pending.result()


def test_a_warning_of_a_task_is_shown_where_its_result_is_read(second):
    def assume():
        warnings.warn("nobody states the angle", DataWarning, stacklevel=2)
        return 1

    pending = second.begin(assume)
    assert len(pending.future.result()[1]) == 1
    with pytest.warns(DataWarning, match="nobody states"):
        assert pending.result() == 1


def test_what_cannot_travel_is_done_here(second):
    lock = threading.Lock()
    pending = second.begin(lambda: (lock, os.getpid())[1])
    assert pending.future is None
    assert pending.result() == os.getpid()


def test_a_result_that_cannot_travel_is_computed_here(second):
    pending = second.begin(threading.Lock)
    with pytest.raises(TypeError, match="pickle"):
        pending.future.result()
    assert pending.result().acquire(blocking=False)


def test_a_function_that_only_this_process_has_is_done_here(second, monkeypatch):
    module = ModuleType("deboom_study_of_mine")
    exec("import os\ndef compute():\n    return os.getpid()", vars(module))
    module.compute.__module__ = module.__name__
    monkeypatch.setitem(sys.modules, module.__name__, module)
    pending = second.begin(module.compute)
    with pytest.raises(ModuleNotFoundError, match=module.__name__):
        pending.future.result()
    assert pending.result() == os.getpid()


def test_what_a_dead_process_leaves_is_done_here():
    first = os.getpid()

    def die_elsewhere():
        if os.getpid() != first:
            os._exit(1)
        return "done here"

    with SecondProcess(cores=2) as process:
        tasks = [process.begin(die_elsewhere), process.begin(os.getpid)]
        assert isinstance(tasks[0].future.exception(), BrokenProcessPool)
        assert [task.result() for task in tasks] == ["done here", first]
        assert process.begin(os.getpid).result() == first  # and does not begin another one


def test_with_one_core_or_without_a_run_the_first_process_does_all():
    with SecondProcess(cores=1) as process:
        tasks = [process.begin(os.getpid), begun(None, os.getpid)]
        assert [task.result() for task in tasks] == [os.getpid()] * 2
        assert process.pool is None
        report = report_of_pictures()
        process.drawn(report.every_picture)
        assert list(report.figures) == ["front", "pairs"]


def test_what_is_done_here_may_show_its_progress():
    assert Pending(lambda: "silent", None).result(lambda: "with a bar") == "with a bar"
