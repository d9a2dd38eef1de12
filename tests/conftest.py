"""What tests of every kind share: a finished run of the front study, and pictures drawn once."""

import gc
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import pytest

from deboom.files import platform
from deboom.plot import style
from deboom.report import Report
from deboom.study.runner import load_study, run_study
from deboom.vehicles import booming_model

STUDIES = Path(__file__).parents[1] / "studies"


def pytest_collection_finish():
    """Collect no garbage among the modules and tests that stay: every round would pass them."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="session", autouse=True)
def shipped_files_once():
    """Read each universal file of the shipped platform once; studies read them again and again."""
    read = platform.read_uff
    kept = cache(read)
    with pytest.MonkeyPatch.context() as patch:
        shipped = STUDIES / "data"
        patch.setattr(
            platform, "read_uff", lambda path: (kept if shipped in path.parents else read)(path)
        )
        yield


@pytest.fixture(scope="session")
def drawn_pictures():
    """Pictures of reports by title, name and the code that draws them."""
    return {}


@pytest.fixture(scope="module")
def each_picture_once(drawn_pictures):
    """Draw a picture when it is shown first, see `pictures_once`."""
    with pictures_once(drawn_pictures):
        yield


@contextmanager
def pictures_once(drawn_pictures):
    """Draw a picture when it is shown first, in fewer dots, and show that one again later.

    Pictures are two thirds of a small study's time. What they show, and that the same numbers give
    the same bytes, is the business of the tests of `deboom.plot`.
    """
    figure = Report.figure

    def shown(self, stem, drawing, caption, **options):
        code = getattr(getattr(drawing, "func", drawing), "__code__", None)
        key = (self.title, stem, code)
        if stem is None or key not in drawn_pictures:
            figure(self, stem, drawing, caption, **options)
            drawn_pictures[key] = self.figures.get(stem)
            return
        if not callable(drawing) and not isinstance(drawing, bytes):
            style.close(drawing.get_figure(root=True))
        # a picture that failed fails again
        figure(self, stem, drawn_pictures[key] or drawing, caption, **options)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(style, "DPI", 100)
        patch.setattr(Report, "figure", shown)
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
def front_run(tmp_path_factory, drawn_pictures):
    """Folder of a finished run of the front study on a tiny budget, which nobody changes."""
    budget = {"generations": 2, "population": 12, "samples": 16}
    study = load_study(STUDIES / "u06_robust_front.py")
    with pictures_once(drawn_pictures):
        return run_study(study, tmp_path_factory.mktemp("results"), budget)
