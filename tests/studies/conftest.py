"""What all tests of whole studies share."""

from pathlib import Path

import pytest
from summary_keys import described, undefined

from deboom.report import Report
from deboom.study.runner import Study, load_study

STUDIES = Path(__file__).parents[2] / "studies"
FRONT_STUDY = STUDIES / "u06_robust_front.py"

WHOLE_PICTURES = ("test_interactive_front", "test_study_cluster", "test_study_resume")
"""Modules that hold the size of a page against its limit, or all files of two runs together."""

WITHOUT_PICTURES = (
    "compressor_identification",
    "compressor_unbalance",
    "mount_characterisation",
)
"""Studies whose tests look at numbers alone: their pictures take longer than they do."""


@pytest.fixture(scope="module", autouse=True)
def few_pictures(request):
    """Draw every picture of a study once, and none where the tests look at numbers alone."""
    name = request.module.__name__
    if name not in WHOLE_PICTURES:
        request.getfixturevalue("each_picture_once")
    with pytest.MonkeyPatch.context() as patch:
        if name.removeprefix("test_") in WITHOUT_PICTURES:
            patch.setattr(Report, "figure", lambda *_, **__: None)
        yield


@pytest.fixture(scope="session", autouse=True)
def defined_summaries():
    """Hold the summary of every run of a shipped study against the docstring that defines it."""
    made = Study.report

    def report(self, *arguments, **options):
        whole = made(self, *arguments, **options)
        if self.path.resolve().parent == STUDIES.resolve():
            missing = undefined(whole.summary, described(self.name))
            assert not missing, f"{self.name}: the docstring does not define {missing}"
        return whole

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Study, "report", report)
        yield


@pytest.fixture
def quick_front(monkeypatch):
    """Return the front study with 64 draws behind every verified number instead of 1024.

    For tests of its options and words; those of its numbers verify in full.
    """
    study = load_study(FRONT_STUDY)

    monkeypatch.setattr(study.module, "VERIFIED", 64)
    return study
