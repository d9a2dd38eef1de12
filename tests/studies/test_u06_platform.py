"""The platform study at a tiny budget, through the same door as a user."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from deboom.errors import InputError
from deboom.files.platform import read_platform
from deboom.files.run_folder import read_run
from deboom.report.page import render_page
from deboom.study import correlation as group_correlation_result
from deboom.study import correlation as vehicle_correlation_result
from deboom.study import platform_study as room
from deboom.study import robust_front as robust_front_result
from deboom.study import sensitivity as sensitivity_result
from deboom.study import sensitivity as sensitivity_room
from deboom.study.correlation import DoeRequest, Plan
from deboom.study.platform_model import Motion, MountSource, motion_index, operation
from deboom.study.platform_study import platform_result
from deboom.study.progress import progress_bar
from deboom.study.rebuilt import rebuilt_model
from deboom.study.runner import load_study, run_study
from deboom.study.search import Budget
from deboom.study.sensitivity import Analysis, Ranked, SensitivityPlan
from deboom.vehicles.fleet import Fleet

STUDIES = Path(__file__).parents[2] / "studies"
PLATFORM = STUDIES / "data" / "u06_f39_f45"
SEARCH = {"seed": 1, "generations": 3, "population": 8, "samples": 8}
REST = {"doe": 32, "draws": 4, "n": 8, "resamples": 100}
SOURCE = {"mounts": MountSource.spectra}


def run(out, name="u06_platform", **asked):
    return run_study(load_study(STUDIES / f"{name}.py"), out, {**SEARCH, **SOURCE, **asked})


@pytest.fixture(scope="module", autouse=True)
def few_trajectories_and_pictures():
    """Leave out what takes long and is drawn in the tests of the single studies."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(vehicle_correlation_result, "scatter_figures", lambda *_: {})
        patch.setattr(group_correlation_result, "scatter_figures", lambda *_: {})
        patch.setattr(sensitivity_room, "TRAJECTORIES", 4)
        yield


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """One run that several tests look at."""
    return run(tmp_path_factory.mktemp("results"), **REST)


@pytest.fixture
def drawn_before(finished, monkeypatch):
    """Save the time of drawing: front and sensitivities get the pictures of the finished run."""
    pictures = {path.stem: path.read_bytes() for path in (finished / "figures").iterdir()}
    monkeypatch.setattr(robust_front_result, "front_figures", lambda _: pictures)
    monkeypatch.setattr(sensitivity_result, "sensitivity_figures", lambda _: pictures)


@pytest.fixture(scope="module")
def runs():
    return operation(read_platform(PLATFORM), None, MountSource.spectra, None, (20, 60))


def asked_of(runs, group, from_doe=False):
    """Run the study without a script, for any vehicles."""
    request = DoeRequest(Plan.sobol, 32, 1)
    return room.platform_study(
        runs,
        group,
        (Motion.prescribed, None),
        room.DoePlan(request, half_width=0.15, tolerance=0.15, draws=4, resamples=100),
        room.FrontPlan(Budget(8, 3), samples=8, from_doe=from_doe, workers=1),
        SensitivityPlan(*(Analysis.design, Ranked.decibels, 0.15, 0.20, 0.15, 8, 100, 1)),
        None,
        progress_bar,
    )


def test_one_run_says_what_the_four_studies_say(finished):
    summary = json.loads((finished / "summary.json").read_text())
    assert summary["r_group_min"] == pytest.approx(0.98, abs=0.02)
    assert summary["r_u06_1_4_min"] > 0.95
    assert 0.2 < summary["r_u06_5_mean"] < 0.8
    assert summary["st_TSM_x_U06-1"] > 0.5
    assert summary["st_Du_y_U06-1"] == 0.0
    assert summary["n_designs"] == 32
    assert summary["n_evaluated"] == 24
    assert (summary["n_failed"], summary["doe_n_failed"]) == (0, 0)


@pytest.mark.usefixtures("drawn_before")
def test_the_front_is_that_of_the_front_study(finished, tmp_path):
    front = run(tmp_path, "u06_robust_front")
    for name in ("front.csv", "designs.csv", "picks.csv", "stiffness.csv", "vehicles.csv"):
        assert (finished / name).read_bytes() == (front / name).read_bytes(), name
    keys, mine = (json.loads((at / "summary.json").read_text()) for at in (front, finished))
    assert {**mine, **keys, "seconds_search": 0} == {**mine, "seconds_search": 0}
    model = rebuilt_model(read_run(finished), load_study(STUDIES / "u06_platform.py"))
    designs = pd.read_csv(front / "designs.csv").iloc[:, 1:].to_numpy()
    searched = pd.read_csv(front / "front.csv")["SPLV mean sum in search [dB(A)]"]
    assert model(designs).mean_sum.tolist() == searched.tolist()


def test_the_vehicles_of_the_group_hear_the_same_model_as_the_fleet(finished, runs):
    doe = pd.read_csv(finished / "doe.csv", keep_default_na=False)
    index = motion_index(replace(runs, fleet=runs.fleet.group("U06")), Motion.prescribed, None)
    designs = doe[[f"{name} [1]" for name in index.variable_names]].to_numpy()
    heard = doe[[f"{name} [dB(A)]" for name in index.response_names]].to_numpy()
    assert np.abs(index(designs) - heard).max() < 1e-9 * heard.max()


def test_the_page_goes_through_the_steps_in_their_order(finished):
    page = (finished / "report.html").read_text(encoding="utf-8")
    titles = re.findall(r'<h2 id="section-\d+">(.*?)</h2>', page)
    parts = [title.split(" · ")[0] for title in titles]
    order = ["In short", "DOE and groups", "Vehicles of U06", "Front", "Sensitivity"]
    assert list(dict.fromkeys(parts)) == order
    assert page.count("carries a high-voltage battery") == 1  # the platform is described once
    for place in range(1, len(titles) + 1):
        assert f'href="#section-{place}"' in page
    for stem in ("group_matrix", "matrix", "pareto_front", "sobol", "convergence"):
        assert (finished / "figures" / f"{stem}.png").stat().st_size > 5000
    assert (finished / "figures" / "sobol_convergence.png").is_file()


def test_the_doe_may_be_the_first_population(runs):
    plain, seeded = (asked_of(runs, "U06", from_doe).front for from_doe in (False, True))
    assert seeded.search.front.mean_sum.min() < plain.search.front.mean_sum.min()
    assert "best designs of the DOE" in seeded.note
    assert plain.note == ""


def test_a_first_population_larger_than_the_doe_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"32 designs .* too few for a first population of 40"):
        run(tmp_path, **{**REST, "population": 40, "from_doe": True})


@pytest.mark.usefixtures("drawn_before")
def test_where_there_is_nothing_to_compare_the_page_says_so(runs):
    single = replace(runs, fleet=Fleet(runs.fleet.vehicles[-1:]))
    result = platform_result(asked_of(single, "F45"))
    page = render_page(result.page)
    assert "nothing to correlate" in page
    assert "F45-5 is the only vehicle" in page
    assert not {"doe", "matrix"} & set(result.tables)
    assert "st_TSM_x_F45-5" in result.summary
    pair = replace(runs, fleet=Fleet(runs.fleet.vehicles[:2]))
    study = asked_of(pair, "U06")
    assert study.fleet.by_group is None
    assert study.vehicles.names == ("U06-1", "U06-2")
    lone = room.within_group(study.fleet, single, motion_index(single, Motion.prescribed, None))
    assert lone is None
