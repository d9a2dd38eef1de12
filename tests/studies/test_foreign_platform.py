"""Every study of a platform runs on a foreign one: no count, name, order or unit is assumed.

A study that is added is run as well, with the smallest budget that its options know, over a band
so narrow that no level has a booming peak.
"""

import json
import re
import shutil
from functools import cache
from importlib import import_module
from pathlib import Path

import foreign_platform_samples
import pytest

from deboom.explore.choices import Pick
from deboom.files.check import check_platform
from deboom.files.platform import read_platform
from deboom.runs.interactive_page import write_interactive_page
from deboom.runs.listen import write_run_ups
from deboom.runs.runner import load_study, run_study, study_files
from deboom.vehicles.booming_model import Motion
from deboom.vehicles.platform import MountSource

STUDIES = Path(__file__).parents[2] / "studies"
VARIABLES = [f"{mount} {axis}" for mount in foreign_platform_samples.PLACES for axis in "xyz"]
BUDGET = {
    "seed": 3,
    "band": (30.0, 33.0),
    "generations": 2,
    "population": 8,
    "samples": 4,
    "searches": 1,
    "designs": 32,
    "doe": 16,
    "n": 8,
    "resamples": 100,
    "draws": 64,
    "polish": False,
    "checks": 64,
    "starts": 2,
    "every_set_up_to": 4,
    "group": (foreign_platform_samples.GROUP,),
}
EFFORT = {
    "deboom.studies.solution_box": {"GENERATIONS": 8, "DRAWS": 40, "PARTS": 256},
    "deboom.pages.solution_box": {"SHOWN_PARTS": 512},
    "deboom.studies.commonality": {"DRAWS": 1024, "ROUNDS": 1},
    "deboom.vehicles.expected_change": {"BODIES_TO_RANK": 2},
}
"""What studies have no options for."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return foreign_platform_samples.write_foreign_platform(
        tmp_path_factory.mktemp("foreign") / "any", library=True
    )


def studies_of_a_platform():
    """Those whose mounts are the platform's."""
    studies = [load_study(path) for path in study_files(STUDIES)]
    return [study.name for study in studies if {"platform", "mounts"} <= study.parameters.keys()]


@pytest.fixture(scope="module")
def run_of(folder, tmp_path_factory):
    """Run a study, once."""

    @cache
    def run(name):
        study = load_study(STUDIES / f"{name}.py")
        options = {key: value for key, value in BUDGET.items() if key in study.parameters}
        # what chooses parts needs their surfaces
        chooses = name == "mount_selection"
        source = MountSource.library_inside if chooses else MountSource.spectra
        if name in ("solution_box", "commonality"):  # coupled motion would take long
            options["motion"] = Motion.prescribed
        out = tmp_path_factory.mktemp("results")
        with pytest.MonkeyPatch.context() as patch:
            for module, constants in EFFORT.items():
                for constant, value in constants.items():
                    patch.setattr(import_module(module), constant, value)
            return run_study(study, out, {**options, "platform": folder, "mounts": source})

    return run


@pytest.mark.usefixtures("plain_loops")
@pytest.mark.parametrize("name", studies_of_a_platform())
def test_the_study_runs_on_a_foreign_platform(name, run_of):
    run = run_of(name)
    said = " ".join(path.read_text(encoding="utf-8") for path in run.glob("*.csv"))
    said += (run / "summary.json").read_text(encoding="utf-8")
    page = (run / "report.html").read_text(encoding="utf-8")
    for stranger in ("U06", "EnM", "TSM", "F39"):
        assert stranger not in said
    assert all(vehicle in said + page for vehicle in foreign_platform_samples.VEHICLES)
    assert json.loads((run / "summary.json").read_text(encoding="utf-8"))


def test_units_order_and_lines_are_those_of_the_files(folder):
    platform = read_platform(folder)
    displacement, force = foreign_platform_samples.motion(130.0)
    case = platform.load_case("high")
    assert case.order == foreign_platform_samples.ORDER
    assert case.force.frequency == pytest.approx(foreign_platform_samples.LINES)
    for k, piece in enumerate(foreign_platform_samples.pieces()):
        for a, axis in enumerate("xyz"):
            column = case.force.channels.index(piece.channel(axis))
            assert case.force.values[:, column] == pytest.approx(force[:, k, a])
            assert case.displacement.values[:, column] == pytest.approx(displacement[:, k, a])
    assert [name for mount in platform.mounts for name in mount.variables] == VARIABLES
    for vehicle in platform.fleet.vehicles:
        assert 1e-5 < abs(vehicle.noise_transfer.values).max() < 1.0


def test_the_check_sums_up_the_foreign_platform(folder):
    checked = check_platform(folder)
    assert checked.faults == ()
    summary = checked.summary  # computed anew each time
    assert "5, 15 variables" in summary
    assert "101, 14 to 83.3 Hz, unevenly spaced" in summary
    assert "of order 2" in summary
    assert "fits all mounts" in summary


def test_a_library_that_does_not_fit_is_found(folder, tmp_path):
    library = tmp_path / "any" / "mounts.library.json"
    shutil.copytree(folder, library.parent)
    text = library.read_text(encoding="utf-8").replace('"Roll"', '"Other"')
    library.write_text(text, encoding="utf-8")
    (fault,) = check_platform(library.parent).faults
    assert "mounts.library.json" in fault
    assert "Other" in fault


@pytest.mark.usefixtures("plain_loops")
def test_of_one_vehicle_the_platform_study_says_that_there_is_nothing_to_correlate(
    folder, tmp_path, monkeypatch
):
    alone = shutil.copytree(folder, tmp_path / "any")
    toml = alone / "platform.toml"
    first, second, rest = re.split(r"(?=\[\[vehicles\]\])", toml.read_text(encoding="utf-8"))
    toml.write_text(first + second + rest[rest.index("[[load_cases]]") :], encoding="utf-8")
    study = load_study("front")
    options = {key: value for key, value in BUDGET.items() if key in study.parameters}
    source = {"platform": alone, "mounts": MountSource.spectra}
    run = run_study(study, tmp_path / "results", {**options, **source})
    assert "nothing to correlate" in (run / "report.html").read_text(encoding="utf-8")
    assert not (run / "correlation_doe.csv").exists()
    assert "sensitivity_st_Roll_x_Wagon" in json.loads(
        (run / "summary.json").read_text(encoding="utf-8")
    )


@pytest.mark.usefixtures("plain_loops")
def test_vehicles_called_na_and_like_a_formula_reach_every_page(folder, tmp_path):
    names = ("NA", "=1+1")
    renamed = tmp_path / "any"
    shutil.copytree(folder, renamed)
    text = (renamed / "platform.toml").read_text(encoding="utf-8")
    for old, new in zip(foreign_platform_samples.VEHICLES, names, strict=True):
        text = text.replace(f'name = "{old}"', f'name = "{new}"')
    (renamed / "platform.toml").write_text(text, encoding="utf-8")
    study = load_study(STUDIES / "front.py")
    options = {key: value for key, value in BUDGET.items() if key in study.parameters}
    options |= {"motion": Motion.prescribed, "platform": renamed, "mounts": MountSource.spectra}
    run = run_study(study, tmp_path / "results", options)
    (header, *_), moved = (run / "front.csv").read_text().splitlines(), tmp_path / "mail" / "run"
    assert not any(cell.startswith("=") for cell in header.split(","))
    shutil.copytree(run, moved)  # the record says of which study it is
    page = write_interactive_page(moved, studies=None)
    assert all(f'"{name}"' in page.read_text(encoding="utf-8") for name in names)
    paths = write_run_ups(moved, pick=Pick.best_mean, seconds=1.0, studies=None)
    assert {path.parent for path in paths} == {moved / "listen"}
    assert {path.name.split()[0] for path in paths} == {*names, "listen.json"}
