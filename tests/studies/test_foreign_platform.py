"""Every study that takes a platform runs on a foreign one: no count, name, order or unit is assumed.

A study that is added is run as well, with the smallest budget that its options know.
"""

import json
from pathlib import Path

import pandas as pd
import pytest
from foreign_platform_samples import (
    GROUP,
    LINES,
    ORDER,
    PLACES,
    VEHICLES,
    motion,
    pieces,
    write_foreign_platform,
)

from deboom.errors import InputError
from deboom.files.platform import read_platform
from deboom.study.motion import Kernel
from deboom.study.mount_source import MountSource
from deboom.study.platform_check import check_platform
from deboom.study.runner import load_study, run_study

STUDIES = Path(__file__).parents[2] / "studies"
VARIABLES = [f"{mount} {axis}" for mount in PLACES for axis in "xyz"]
BUDGET = {
    "seed": 3,
    "generations": 2,
    "population": 8,
    "samples": 4,
    "searches": 1,
    "designs": 24,
    "n": 8,
    "resamples": 100,
    "draws": 4,
    "polish": False,
    "every_set_up_to": 4,
    "group": GROUP,
    "kernel": Kernel.numpy,
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return write_foreign_platform(tmp_path_factory.mktemp("foreign") / "any", library=True)


def studies_of_a_platform():
    """Those whose mounts are the platform's; the scripts are not run for it."""
    text = {path: path.read_text(encoding="utf-8") for path in sorted(STUDIES.glob("*.py"))}
    options = ("    platform: Annotated", "    mounts: Annotated")
    return [path.stem for path, script in text.items() if all(one in script for one in options)]


@pytest.mark.parametrize("name", studies_of_a_platform())
def test_the_study_runs_on_a_foreign_platform(name, folder, tmp_path):
    study = load_study(STUDIES / f"{name}.py")
    asked = {key: value for key, value in BUDGET.items() if key in study.parameters}
    arguments = {**asked, "platform": folder}
    if "mounts" in study.parameters:
        arguments["mounts"] = MountSource.spectra
    try:
        run = run_study(study, tmp_path, arguments)
    except InputError as error:
        # what chooses parts needs their surfaces
        assert "--mounts library" in str(error)
        run = run_study(study, tmp_path, {**arguments, "mounts": MountSource.library_inside})
    said = " ".join(path.read_text(encoding="utf-8") for path in run.glob("*.csv"))
    said += (run / "summary.json").read_text(encoding="utf-8")
    page = (run / "report.html").read_text(encoding="utf-8")
    for stranger in ("U06", "EnM", "TSM", "F39"):
        assert stranger not in said
    assert all(vehicle in said + page for vehicle in VEHICLES)
    assert json.loads((run / "summary.json").read_text(encoding="utf-8"))
