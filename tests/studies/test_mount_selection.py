"""The selection of mounts from the catalogue at a tiny budget, and what its catalogue refuses."""

import json
import shutil
from html import unescape
from pathlib import Path

import pytest

from deboom.errors import InputError
from deboom.files.catalogue import platform_catalogue
from deboom.files.library_export import read_library_json
from deboom.files.platform import CATALOGUE_FILE, read_platform
from deboom.files.tables import read_frame
from deboom.mounts.library import open_library
from deboom.report.report import Picture
from deboom.runs.interactive_page import write_interactive_page
from deboom.runs.runner import load_study, run_study
from deboom.runs.search import SearchOptions
from deboom.vehicles.booming_model import Motion
from deboom.vehicles.platform import MountSource
from pinned_pages import hold

STUDIES = Path(__file__).parents[2] / "studies"
STUDY = load_study("mount_selection")
PLATFORM = STUDIES / "data" / "u06_f39_f45"
BUDGET = {"seed": 1, "generations": 8, "population": 16, "samples": 16}
BUDGET |= {"mount": ["TSM", "Du"], "motion": Motion.prescribed}


@pytest.fixture(scope="module")
def budget():
    """Two mounts, parts as they are: 36 sets, which the search must all but see."""
    return {**BUDGET, "retuning": 0.0}


def test_a_front_of_parts_has_no_interactive_page(finished):
    with pytest.raises(InputError, match="does not search for stiffnesses of a platform's mounts"):
        write_interactive_page(finished, studies=STUDIES)


def test_the_search_finds_the_front_of_all_sets(finished, summary):
    hold(finished, "mount_selection")
    assert summary["n_sets"] == 36
    assert summary["n_front"] == summary["n_set_front"]
    as_they_are = summary["change_parts_as_they_are_db_per_line"]
    assert summary["change_db_per_line"] == pytest.approx(as_they_are, rel=1e-3)  # other draws
    assert as_they_are < 0.0


def test_the_loudest_car_is_drawn_over_the_engines_speed():
    """Order 1.5 of its three cylinders: 60 Hz are 2400 rpm, not 3600."""
    options = STUDY.module.Options(
        search=SearchOptions(generations=1, population=8),
        samples=8,
        mount=["TSM"],
        motion=Motion.prescribed,
    )
    report = STUDY.module.run(STUDY.module.prepare(options), options)
    (picture,) = (b for panel in report.panels for b in panel.blocks if isinstance(b, Picture))
    axes = picture.drawing().axes[0]
    axes.figure.canvas.draw()
    assert axes.get_xlim()[1] == 60.0
    assert axes.child_axes[0].get_xlim()[1] == pytest.approx(2400.0)


def test_re_tuned_parts_in_coupled_motion_do_no_worse(tmp_path, finished):
    run = run_study(
        STUDY,
        tmp_path,
        {**BUDGET, "retuning": 0.05, "motion": Motion.coupled, "mount": ["TSM"], "generations": 6},
    )
    summary = json.loads((run / "summary.json").read_text())
    assert summary["change_db_per_line"] < summary["change_parts_as_they_are_db_per_line"]
    low, expected, high = (
        summary[f"expected_change_db_mean{end}"] for end in ("_low", "", "_high")
    )
    assert low < expected < high
    # a car brings part of what its model promises, and the same parts
    assert 0.3 * summary["change_db_per_line"] > expected > 1.2 * summary["change_db_per_line"]
    table = read_frame(run / "expected.csv").set_index(["design", "vehicle"])
    as_they_are = table.loc["quietest parts as they are", "change, expected [dB]"]
    re_tuned = table.loc["best-mean", "change, expected [dB]"]
    assert re_tuned.mean() == pytest.approx(expected)
    assert re_tuned.mean() < as_they_are.mean()
    page = (run / "report.html").read_text(encoding="utf-8")
    assert "dB expected on average" in page
    assert "The loudest line of a car may change by" in page


def test_prescribed_motion_has_no_expected_change(finished, summary):
    assert not [key for key in summary if key.startswith("expected_")]
    page = unescape((finished / "report.html").read_text(encoding="utf-8"))
    assert "How sure: no expected change, because the powertrain's motion is prescribed" in page


def test_a_library_database_serves_as_catalogue(tmp_path):
    platform = read_platform(PLATFORM)
    campaigns, parts = read_library_json(PLATFORM / CATALOGUE_FILE)
    wanted = [part for part in parts if part.mount.name == "TSM"][:2]
    with open_library(tmp_path / "parts.db", create=True) as library:
        library.add(campaigns, wanted)
    catalogue = platform_catalogue(platform, tmp_path / "parts.db")
    assert catalogue.n_parts == (1, 1, 3, 1)
    assert catalogue.label("TSM", 2) == "TSM-M2"


def test_what_is_no_catalogue_is_refused(tmp_path):
    platform = read_platform(PLATFORM)
    with pytest.raises(InputError, match="there is no catalogue"):
        platform_catalogue(platform, tmp_path / "none.json")
    with pytest.raises(InputError, match=r"no mount \['Q'\]"):
        platform_catalogue(platform, None, ["Q"])
    shutil.copy(PLATFORM / "mounts.library.json", tmp_path / "own.json")
    with pytest.raises(InputError, match="no further part"):
        platform_catalogue(platform, tmp_path / "own.json")
    with pytest.raises(InputError, match="known by their surfaces alone"):
        run_study(STUDY, tmp_path, {**BUDGET, "mounts": MountSource.spectra})
