"""The front study with its further questions at a tiny budget."""

import json
import re
from dataclasses import replace
from html import unescape

import numpy as np
import pandas as pd
import pytest

from deboom.files.run_folder import read_run
from deboom.pages import correlation
from deboom.runs import second_process
from deboom.runs.platform_options import PlatformOptions
from deboom.runs.rebuilt import rebuilt_model
from deboom.runs.runner import load_study, run_study
from deboom.vehicles.booming_model import Motion
from deboom.vehicles.platform import MountSource

STUDY = load_study("front")
SEARCH = {"seed": 1, "generations": 3, "population": 8, "samples": 8, "polish": False, "checks": 64}
SEARCH |= {"mounts": MountSource.spectra, "motion": Motion.prescribed}
BUDGET = {**SEARCH, "doe": 32, "draws": 4, "n": 8, "resamples": 100}


@pytest.fixture(scope="module", autouse=True)
def few_trajectories_and_pictures():
    """Leave out what takes long and is drawn in the tests of the single studies."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(correlation, "_append_clouds", lambda *_: None)
        yield


@pytest.fixture(scope="module")
def runs():
    return PlatformOptions(group=None, mounts=MountSource.spectra).runs()


def test_numbers_of_a_further_question_begin_with_its_name(summary):
    assert summary["correlation_r_group_min"] == pytest.approx(0.98, abs=0.02)
    assert summary["correlation_within_group_r_u06_1_4_min"] > 0.95
    assert 0.2 < summary["correlation_within_group_r_u06_5_mean"] < 0.8
    assert summary["sensitivity_st_TSM_x_U06-1"] > 0.5
    assert summary["sensitivity_st_Du_y_U06-1"] == 0.0
    assert summary["correlation_n_designs"] == 32
    assert summary["n_evaluated"] == 24
    assert (summary["n_failed"], summary["correlation_n_failed"]) == (0, 0)


def test_what_a_question_says_in_full_is_a_link_to_its_page(finished):
    html = (finished / "report.html").read_text(encoding="utf-8")
    said = json.loads((finished / "answer.json").read_text())["panels"]["Further questions"]
    files = re.findall(r'<a href="([\w.]+\.html)"', html)
    assert files == ["correlation.html", "correlation_within_group.html", "sensitivity.html"]
    for name, sentence in zip(("correlation", "sensitivity"), said, strict=True):
        page = (finished / f"{name}.html").read_text(encoding="utf-8")
        assert unescape(page.partition('class="verdict">')[2].partition("<")[0]) == sentence
        assert "<h2" in page
    assert "Correlation" not in re.findall(r"<h2[^>]*>([^<]*)</h2>", html)
    record = json.loads((finished / "run.json").read_text())["files_sha256"]
    assert {"report.html", *files} <= set(record)


CUT = """[...document.querySelectorAll('main *')].filter((part) => part.clientWidth > 0
  && part.scrollWidth > part.clientWidth + 1 && getComputedStyle(part).display !== 'inline'
  && getComputedStyle(part).overflowX !== 'visible')
  .map((part) => part.textContent.trim().slice(0, 60))"""
"""Parts of a page whose text goes on beyond their edge."""


@pytest.mark.parametrize("name", ["report", "correlation", "sensitivity"])
def test_nothing_of_a_page_is_cut_and_a_phone_scrolls_none_sideways(finished, browser, name):
    browser.open(finished / f"{name}.html", width=1440)
    assert browser.value(CUT) == []
    browser.resize(400)
    browser.wait("document.documentElement.clientWidth === 400")
    assert browser.value("document.documentElement.scrollWidth") == 400


def test_the_front_is_that_of_the_front_study(finished, tmp_path):
    front = run_study(STUDY, tmp_path, {**SEARCH, "with_": "none"})
    for name in ("front.csv", "picks.csv", "stiffness.csv", "vehicles.csv"):
        assert (finished / name).read_bytes() == (front / name).read_bytes(), name
    keys, mine = (json.loads((at / "summary.json").read_text()) for at in (front, finished))
    assert {**mine, **keys, "seconds_search": 0} == {**mine, "seconds_search": 0}
    model = rebuilt_model(read_run(finished), STUDY).robust
    designs = read_run(front).front.designs
    searched = pd.read_csv(front / "front.csv")["SPLV mean sum in search [dB(A)]"]
    assert model(designs).mean_sum.tolist() == searched.tolist()


@pytest.mark.slow("begins a second process")
def test_two_processes_write_the_same_tables(finished, tmp_path, monkeypatch):
    monkeypatch.setattr(second_process, "cpu_count", lambda: 2)
    # pictures are described here; those of two processes are held in the tests of the second one
    monkeypatch.setattr(second_process.SecondProcess, "draw", lambda *_: None)
    folder = run_study(STUDY, tmp_path, BUDGET)
    names = {
        path.relative_to(folder) for path in folder.rglob("*") if path.suffix in (".csv", ".gz")
    }
    assert len(names) > 20
    for name in names:
        assert (folder / name).read_bytes() == (finished / name).read_bytes(), name


def test_the_vehicles_of_the_group_hear_the_same_model_as_the_fleet(finished, runs):
    doe = pd.read_csv(finished / "correlation_doe.csv", keep_default_na=False)
    index = replace(runs, fleet=runs.fleet.group("U06")).model(Motion.prescribed)
    designs = doe[[f"{name} [1]" for name in index.variable_names]].to_numpy()
    heard = doe[[f"{name} [dB(A)]" for name in index.response_names]].to_numpy()
    assert np.abs(index(designs) - heard).max() < 1e-9 * heard.max()


@pytest.mark.usefixtures("plain_loops")
def test_loss_factors_have_sensitivities_beside_the_stiffnesses_of_their_mount(tmp_path):
    small = {"load_case": ["g6_wot160"], "band": (30.0, 33.0), "with_": "sensitivity"}
    folder = run_study(STUDY, tmp_path, {**BUDGET, **small, "generations": 1, "loss_factors": True})
    indices = pd.read_csv(folder / "sensitivity_sobol.csv")
    assert {"EnM x", "EnM x loss"} <= set(indices["variable"])
    mounts = pd.read_csv(folder / "sensitivity_sobol_mounts.csv")
    assert set(mounts["mount"]) == {"EnM", "GeM", "TSM", "Du"}
