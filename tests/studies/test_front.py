"""The front study at a tiny budget, through the same command as a user."""

import json
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from deboom.studies.front import FurtherOptions

from deboom.errors import InputError
from deboom.explore import search as search_module
from deboom.explore import selection
from deboom.files.platform import read_platform
from deboom.files.run_folder import read_run
from deboom.files.shipped_studies import FORMER_STUDIES
from deboom.runs.options import Sampler
from deboom.runs.rebuilt import rebuilt_model
from deboom.runs.runner import load_study, run_study, study_command
from deboom.vehicles.booming_model import Motion
from deboom.vehicles.platform import LIBRARY_FILE, MountSource
from pinned_pages import hold, hold_numbers, pictures_described, run_aloud

STUDY = Path(__file__).parents[2] / "studies" / "front.py"
PLATFORM = STUDY.parent / "data" / "u06_f39_f45"
BUDGET = {"seed": 1, "generations": 2, "population": 8, "samples": 16, "polish": False}
BUDGET |= {"with_": "prescribed"}


def run(out, **changes):
    return run_study(load_study(STUDY), out, {**BUDGET, "checks": 64, **changes})


def _four_designs(robust, **_):
    space = robust.space
    return robust(np.linspace(space.nominal, space.lower + 0.7 * (space.upper - space.lower), 4))


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    options = {**BUDGET, "population": 12, "polish": True}
    with pytest.MonkeyPatch.context() as patch, pictures_described():
        # descents to almost equal designs would order a front by the processor's rounding
        patch.setattr(selection._Goal, "descend", lambda _goal, _name, start: start)
        patch.setattr(search_module, "converged_front", _four_designs)
        return run_aloud(load_study(STUDY), tmp_path_factory.mktemp("results"), options)


def test_a_front_shows_what_it_showed(finished):
    hold(finished, "front")


def test_coupled_motion_is_at_least_as_good_as_the_prescribed_optimum(front_run):
    summary = json.loads((front_run / "summary.json").read_text())
    assert summary["benefit_db"] >= summary["benefit_prescribed_db"]
    assert max(summary[f"splv_change_db_per_line_U06-{n}"] for n in range(1, 6)) < -1.5
    table = pd.read_csv(front_run / "vehicles.csv")
    change = table["level after [dB(A)]"] - table["level before [dB(A)]"]
    np.testing.assert_allclose(table["change [dB]"], change, atol=1e-12)
    front, per_vehicle = (pd.read_csv(front_run / f"{n}.csv") for n in ("front", "per_vehicle"))
    total = per_vehicle.groupby("point")["SPLV mean [dB(A)]"].sum().to_numpy()
    assert total == pytest.approx(front["SPLV mean sum [dB(A)]"].to_numpy(), rel=1e-12)


def test_picks_keep_what_they_promise_when_verified(front_run):
    picks = pd.read_csv(front_run / "picks.csv").set_index("design")
    today = picks.iloc[0]
    change = picks["mean level [dB(A)]"] - today["mean level [dB(A)]"]
    assert picks["change [dB]"].to_numpy() == pytest.approx(change.to_numpy(), abs=1e-9)
    sigma = picks["sigma of the level [dB]"] / today["sigma of the level [dB]"]
    assert picks["change of sigma [%]"].to_numpy() == pytest.approx(100 * (sigma - 1), abs=1e-9)
    assert picks.loc["sigma-kept", "change of sigma [%]"] <= 0


def test_the_thesis_searched_prescribed_motion_with_fresh_draws(tmp_path):
    folder = run(tmp_path, motion=Motion.prescribed, sampler=Sampler.fresh)
    record = json.loads((folder / "run.json").read_text())
    facts = record["facts"]
    assert facts["motion"] == "prescribed"
    assert "fresh" in facts["tolerance_sample"]
    assert facts["tolerance_draws"] == 16
    assert set(record["environment"]["packages"]) >= {"scikit-learn", "SALib", "pyDOE3"}
    assert all(record["environment"]["packages"].values())


def test_a_former_name_has_its_defaults_and_says_what_went(capsys):
    study = load_study("u06_robust_front")
    assert study.name == "front"
    options = study.effective({"population": 8})
    assert (options["with_"], options["generations"], options["population"]) == (
        "prescribed",
        50,
        8,
    )
    study_command("u06_robust_front")
    assert "the study u06_robust_front is front now" in capsys.readouterr().err
    former = FORMER_STUDIES["u06_robust_front"].arguments
    assert former({"as_thesis": True, "samples": 100})["samples"] == 100
    with pytest.raises(InputError, match=r"front has no --free-tolerances: .*tolerance_allocation"):
        former({"free_tolerances": True})


def test_a_further_question_that_there_is_not_is_refused():
    with pytest.raises(InputError, match="--with correlation,price: price is no question; write"):
        run("nowhere", with_="correlation,price")
    assert FurtherOptions("none").questions == frozenset()


@pytest.mark.parametrize("group", [["all"], ["F39", "U06"]])
def test_a_front_of_several_groups_serves_all_their_vehicles(tmp_path, group):
    small = {"generations": 1, "samples": 4, "motion": Motion.prescribed, "band": (25.0, 35.0)}
    folder = run(tmp_path, **small, group=group)
    served = list(pd.read_csv(folder / "vehicles.csv")["vehicle"])
    every = read_platform(PLATFORM).fleet
    assert served == list((every if group == ["all"] else every.group(*group)).names)
    assert json.loads((folder / "run.json").read_text())["arguments"]["group"] == group


def test_surfaces_agree_with_the_spectra_at_the_peaks(front_run):
    check = pd.read_csv(front_run / "surface_check.csv")
    assert check["largest difference at peaks [dB]"].max() <= 0.3
    assert not check["peaks of one curve only"].any()


def test_the_same_seed_gives_the_same_bytes_another_does_not_and_truth_is_never_read(tmp_path):
    platform = tmp_path / "platform"
    shutil.copytree(PLATFORM, platform, ignore=shutil.ignore_patterns("truth"))
    assert (PLATFORM / "truth").is_dir()
    small = {"generations": 1, "samples": 4, "motion": Motion.prescribed, "band": (25.0, 35.0)}
    first = run(tmp_path / "first", **small)
    again = run(tmp_path / "again", **small, platform=platform)
    other = run(tmp_path / "other", **small, seed=2)
    for name in ("front.csv", "per_vehicle.csv", "stiffness.csv", "peaks.csv"):
        assert (again / name).read_bytes() == (first / name).read_bytes(), name
    assert (other / "front.csv").read_bytes() != (first / "front.csv").read_bytes()


def test_the_model_of_a_run_is_built_again_without_a_search(front_run):
    before = sorted(path.as_posix() for path in front_run.rglob("*"))
    model = rebuilt_model(read_run(front_run), load_study(STUDY)).robust
    designs = read_run(front_run).front.designs
    front, searched = pd.read_csv(front_run / "front.csv"), model(designs)
    assert searched.mean_sum.tolist() == front["SPLV mean sum in search [dB(A)]"].tolist()
    assert searched.sigma_sum.tolist() == front["SPLV sigma sum in search [dB]"].tolist()
    assert sorted(path.as_posix() for path in front_run.rglob("*")) == before


@pytest.mark.parametrize(
    ("changes", "name", "objectives"),
    [
        (
            {"load_case": ["g5_wot120=1", "g6_wot220=0.5"], "nominal_mean": True},
            "numbers_of_load_cases_at_nominal",
            "Two objectives, both as small as possible: the sum over the vehicles of the mean SPLV",
        ),
        (
            {"group": ["F39"], "tolerance": 0.45, "objective": "tail", "control_variate": True},
            "numbers_of_the_worst_parts",
            "The search minimised mean of the worst 5 %, sum and sigma, sum; picks are those",
        ),
    ],
    ids=["nominal", "worst parts"],
)
def test_options_change_what_is_asked(tmp_path, changes, name, objectives):
    folder = run(tmp_path, **changes, samples=32, generations=1, band=(30.0, 35.0))
    hold_numbers(folder, name)
    assert json.loads((folder / "summary.json").read_text())["n_evaluated"] == 8
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert objectives in page
    assert page.count("objectives, both") + page.count("The search minimised") == 1


def test_spectra_as_source_need_no_library(tmp_path):
    platform = tmp_path / "platform"
    shutil.copytree(PLATFORM, platform, ignore=shutil.ignore_patterns("truth", LIBRARY_FILE))
    small = {"generations": 1, "platform": platform, "motion": Motion.prescribed}
    small["band"] = (38.0, 42.0)
    with pytest.raises(InputError, match=r"has no mount library: export one .*--mounts spectra"):
        run(tmp_path, **small)
    folder = run(tmp_path, **small, mounts=MountSource.spectra)
    assert not (folder / "surface_check.csv").exists()
    assert len(json.loads((folder / "run.json").read_text())["inputs_sha256"]) == 30


@pytest.mark.filterwarnings("ignore:.*engine torque reaches")  # no run has this torque
def test_lines_that_no_surface_knows_are_refused_or_measured_by_choice(tmp_path):
    platform = tmp_path / "platform"
    shutil.copytree(PLATFORM, platform, ignore=shutil.ignore_patterns("truth"))
    path = platform / "operating" / "g5_wot220_torque.csv"
    lines = path.read_text(encoding="utf-8").splitlines()
    lines[81] = f"{lines[81].partition(',')[0]},900"  # line 80 at 40 Hz
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    small = {"generations": 1, "platform": platform, "motion": Motion.prescribed}
    small["band"] = (38.0, 42.0)
    with pytest.raises(InputError, match=r"1 of 241 lines, from 40 to 40 Hz, .* library-inside"):
        run(tmp_path, **small)
    folder = run(tmp_path, **small, mounts=MountSource.library_inside)
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "TSM x (1 of 241 lines are outside)" in page


def test_the_answer_is_two_pages_of_paper(finished, browser, tmp_path):
    """What stands behind the answer begins on a page of its own, and is left out here."""
    page = (finished / "report.html").read_text(encoding="utf-8")
    assert 'class="behind"' in page
    hidden = "<style>.behind, .behind ~ *, footer { display: none !important; }</style></head>"
    answer = tmp_path / "answer.html"
    answer.write_text(page.replace("</head>", hidden), encoding="utf-8")
    browser.open(answer)
    assert browser.printed_pages() == 2
