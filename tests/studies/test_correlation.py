"""The correlation studies at a tiny budget, through the same command as a user."""

import json

import numpy as np
import pandas as pd
import pytest

from deboom.errors import InputError
from deboom.explore.space import stiffness_factor_space
from deboom.pages.correlation import DoeRequest, Plan
from deboom.runs.runner import load_study, run_study
from deboom.vehicles.platform import MountSource
from pinned_pages import hold

WORDS = "a b c d abc abd acd bcd ab ac ad bc"
BUDGET = {"seed": 1, "designs": 64, "draws": 4, "resamples": 100, "mounts": MountSource.spectra}
GROUP = {"group": ["U06"]}


def run(out, **changes):
    return run_study(load_study("correlation"), out, {**BUDGET, **changes})


def summary_of(folder):
    return json.loads((folder / "summary.json").read_text())


@pytest.fixture(scope="module")
def vehicles(thesis_run):
    return thesis_run("vehicles")


def test_groups_go_together_and_all_vehicles_are_compared(thesis_run):
    hold(thesis_run("groups"), "correlation")


def test_the_battery_sets_one_vehicle_apart(vehicles):
    summary = summary_of(vehicles)
    assert summary["apart"] == "U06-5"
    assert summary["r_u06_1_4_min"] > 0.95
    assert 0.3 < summary["r_u06_5_mean"] < 0.8
    assert summary["r_u06_1_4_min_tolerance"] > 0.95
    families = pd.read_csv(vehicles / "families.csv")
    assert list(families["vehicles"]) == ["U06-1, U06-2, U06-3, U06-4", "U06-5"]


def test_each_factor_stands_beside_each_vehicle(vehicles):
    doe = pd.read_csv(vehicles / "doe.csv")
    pairs = pd.read_csv(vehicles / "factor_pairs.csv")
    assert len(pairs) == 12 * 5
    for factor, vehicle, r, low, high, _ in pairs.itertuples(index=False):
        true = np.corrcoef(doe[f"{factor} [1]"], doe[f"{vehicle} [dB(A)]"])[0, 1]
        assert r == pytest.approx(true, abs=1e-5)
        assert low <= r <= high
    assert "Stiffness factors" in (vehicles / "report.html").read_text()


def test_other_options(tmp_path):
    changes = {"apart": "U06-1", "load_case": ["g5_wot120=1", "g6_wot220=2"]}
    folder = run(tmp_path, **GROUP, plan=Plan.sobol, **changes)
    assert summary_of(folder)["apart"] == "U06-1"


@pytest.mark.parametrize(
    ("request_", "n_designs", "words"),
    [
        (DoeRequest(Plan.latin_hypercube, 30, 1), 30, "Latin hypercube, seed 1"),
        (DoeRequest(Plan.sobol, 32, 2), 32, "Sobol, seed 2"),
        (DoeRequest(Plan.box_behnken, 0, 1), 265, "box behnken"),
        (DoeRequest(Plan.full_factorial, 0, 1), 4096, "full factorial"),
        (DoeRequest(Plan.fractional_factorial, 0, 1, WORDS), 16, f"fractional factorial {WORDS}"),
        (DoeRequest(Plan.central_composite, 0, 1, WORDS), 41, f"central composite {WORDS}"),
    ],
)
def test_plans_of_twelve_variables(request_, n_designs, words):
    space = stiffness_factor_space([f"variable {n}" for n in range(12)], half_width=0.15)
    designs = request_.designs(space)
    assert designs.shape == (n_designs, 12)
    assert request_.words == words
    assert designs.min() >= 0.85
    assert designs.max() <= 1.15


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"plan": Plan.sobol, "designs": 300}, "300 Sobol points are not a power of two"),
        ({"plan": Plan.fractional_factorial}, "needs --generators"),
        ({"plan": Plan.fractional_factorial, "generators": "a b ab"}, "one column for each"),
        ({"designs": 8}, r"from 8 design\(s\) says nothing"),
        ({"apart": "F39-1", "designs": 10}, "--apart 'F39-1' is no vehicle of this study"),
    ],
)
def test_what_cannot_be_asked_is_said_in_a_sentence(tmp_path, changes, sentence):
    with pytest.raises(InputError, match=sentence):
        run(tmp_path, **GROUP, **changes)


def test_a_users_own_table(tmp_path, vehicles):
    doe = pd.read_csv(vehicles / "doe.csv")
    path = tmp_path / "own.xlsx"
    user_table = doe[[name for name in doe.columns if name.endswith("[1]")]].head(12)
    user_table.to_excel(path, index=False)
    space = stiffness_factor_space([name[:-4] for name in user_table.columns], half_width=0.15)
    request = DoeRequest(Plan.sobol, 0, 1, table=path)
    assert request.designs(space) == pytest.approx(user_table.to_numpy(), abs=1e-12)
    assert (request.words, request.inputs) == ("table own.xlsx", (path,))
    user_table.drop(columns="TSM x [1]").to_excel(path, index=False)
    with pytest.raises(InputError, match="column 'TSM x' is missing"):
        run(tmp_path, **GROUP, table=path)
