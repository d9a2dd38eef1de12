"""What all tests of whole studies share."""

import json
from contextlib import nullcontext

import pytest

from pinned_pages import pictures_described, run_aloud

WHOLE_PICTURES = ("study_resume", "thesis_page")
"""Modules that look at all files of runs."""

PICTURES_IN_WORDS = (
    "accept",
    "compare_runs",
    "driven",
    "supplier_sheet",
    "synthesis_validation",
    "sensitivity",
)
"""Modules in which pictures of many runs are looked at."""

PINNED_IN_WORDS = (
    "commonality",
    "component_tpa",
    "measured_uncertainty",
    "mount_selection",
    "solution_box",
    "tolerance_allocation",
)
"""Modules whose pinned run has pictures; all others look at numbers and words alone."""


@pytest.fixture(scope="module", autouse=True)
def few_pictures(request):
    """Describe the pictures of pinned pages, and make none where tests look at numbers alone."""
    name = request.module.__name__.removeprefix("test_")
    if name in PICTURES_IN_WORDS:
        request.getfixturevalue("described_pictures")
    elif name not in WHOLE_PICTURES:
        request.getfixturevalue("no_pictures")


@pytest.fixture(scope="module")
def budget(request):
    return request.module.BUDGET


@pytest.fixture(scope="module")
def finished(request, budget, tmp_path_factory):
    """One run of a module's study that several tests look at."""
    in_words = request.module.__name__.removeprefix("test_") in PINNED_IN_WORDS
    with pictures_described() if in_words else nullcontext():
        return run_aloud(request.module.STUDY, tmp_path_factory.mktemp("results"), budget)


@pytest.fixture(scope="module")
def summary(finished):
    return json.loads((finished / "summary.json").read_text(encoding="utf-8"))
