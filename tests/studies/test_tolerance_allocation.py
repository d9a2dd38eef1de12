"""The study of the cheapest tolerances at a tiny budget."""

import json
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from deboom.errors import InputError
from deboom.explore.choices import Pick
from deboom.explore.tolerance_allocation import Verified
from deboom.files.made_parts import tolerance_cost
from deboom.files.run_folder import read_run
from deboom.pages.tolerance_allocation import ToleranceSets
from deboom.runs.options import target_limits
from deboom.runs.runner import load_study, run_study
from deboom.vehicles.booming_model import Motion
from pinned_pages import hold

STUDIES = Path(__file__).parents[2] / "studies"
STUDY = load_study("tolerance_allocation")
PARTS = STUDIES / "data" / "u06_parts.toml"
BUDGET = {"generations": 4, "population": 12, "samples": 32, "checks": 512}
NAMES = ("EnM x", "EnM y")


def test_the_same_sigma_costs_less(finished, summary):
    hold(finished, "tolerance_allocation")
    assert summary["sigma_cheapest_db"] == pytest.approx(summary["sigma_today_db"], rel=1e-6)
    assert summary["sigma_verified_db"] == pytest.approx(summary["sigma_today_db"], rel=0.2)
    table = pd.read_csv(finished / "allocation.csv")
    tolerance = table["cheapest ± [%]"]
    assert tolerance.between(5.0 - 1e-9, 30.0 + 1e-9).all()
    np.testing.assert_allclose(table["cost cheapest [1]"], 15.0 / tolerance)


def test_a_limit_that_new_draws_miss_is_said():
    """0.481 dB misses a stated 0.474, not today's 0.485 in the same draws; 0.4741 does not."""
    verified = {"today's": Verified(0.485, 0.99, 0.98), "cheapest": Verified(0.481, 0.94, 0.93)}
    nothing = dict.fromkeys(field.name for field in fields(ToleranceSets))
    of_today = ToleranceSets(**{**nothing, "by_sigma": True, "verified": verified, "share": 0.95})
    stated = replace(of_today, sigma=0.474)
    close = {**verified, "cheapest": Verified(0.4741, 0.95, 0.93)}
    assert of_today.missed == replace(stated, verified=close).missed == ""
    assert stated.missed.startswith("New draws find σ 0.481 dB, more than 0.474 dB:")
    of_share = replace(of_today, by_sigma=False)
    assert "94.0 % within the limits, less than the 95 % asked for" in of_share.missed
    assert replace(of_share, verified=close).missed == ""


@pytest.mark.slow("allocates tolerances twice more")
def test_a_share_within_limits_is_reached_with_parts_that_have_something_in_common(tmp_path):
    options = {**BUDGET, "limit": ["+0.5"], "share": 0.85, "parts": PARTS, "pick": Pick.best_sigma}
    run = run_study(STUDY, tmp_path, options)
    summary = json.loads((run / "summary.json").read_text())
    assert summary["design"] == "best-sigma"
    assert summary["target"] == "share"
    assert summary["share_verified"] >= 0.85
    assert summary["share_lower_bound"] <= summary["share_verified"]
    assert summary["cost_cheapest"] <= summary["cost_uniform"]
    names = json.loads((run / "run.json").read_text())["inputs_sha256"]
    assert any(name.endswith("u06_parts.toml") for name in names)
    assert (run / "parts.csv").is_file()
    assert "How parts scatter" in (run / "report.html").read_text()


def test_a_design_of_a_finished_run_keeps_the_runs_parts(tmp_path):
    search = {"generations": 3, "population": 12, "samples": 16, "polish": False, "checks": 64}
    budget = {**search, "parts": PARTS, "motion": Motion.prescribed, "with_": "none"}
    run = run_study(load_study("front"), tmp_path, budget)
    model = STUDY.model({"from_run": run, "point": 2})
    np.testing.assert_array_equal(model.picked, read_run(run).front.designs[1])
    assert model.robust.structure is not None
    assert model.made is model.runs is None
    with pytest.raises(InputError, match="has its own parts"):
        STUDY.model({"from_run": run, "parts": PARTS})
    with pytest.raises(InputError, match="no point 999 on the front"):
        STUDY.model({"from_run": run, "point": 999})


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"sigma": 0.3, "limit": ["50"]}, "not both"),
        ({"limit": ["loud"]}, "write a level in dB"),
        ({"limit": ["Q=50"]}, "with one of a, b"),
        ({"limit": ["50", "a=51"]}, "a has one already"),
        ({"limit": ["a=51"]}, "no limit of b"),
    ],
)
def test_bad_targets_are_refused(given, words):
    def limits():
        return target_limits(STUDY.module.Options(**given).limit, ("a", "b"), np.zeros(2))

    with pytest.raises(InputError, match=words):
        limits()


def test_limits_may_be_relative_to_the_design():
    limits = target_limits(["a=52", "b=+0.5"], ("a", "b"), np.array([50.0, 48.0]))
    assert limits.tolist() == [52.0, 48.5]


def test_a_table_of_prices_is_read(tmp_path):
    path = tmp_path / "prices.csv"
    path.write_text("variable,weight,reference tolerance\nEnM y,2,0.2\nEnM x,1.5,0.15\n")
    cost = tolerance_cost(path, NAMES)
    assert cost.weight.tolist() == [1.5, 2.0]
    assert cost.reference.tolist() == [0.15, 0.2]
    assert tolerance_cost(None, NAMES).reference.tolist() == [0.15, 0.15]


@pytest.mark.parametrize(
    ("rows", "sentence"),
    [
        ("EnM x,1,0.15\n", r"no row for \['EnM y'\]"),
        ("EnM x,1,0.15\nEnM x,1,0.15\n", "named twice"),
        ("EnM x,1,0.15\nQ x,1,0.15\n", "none of"),
        ("EnM x,1,0.15\nEnM y,-1,0.15\n", "weight is -1.0: give a number at least 0"),
    ],
)
def test_a_bad_table_of_prices_is_refused(tmp_path, rows, sentence):
    path = tmp_path / "prices.csv"
    path.write_text("variable,weight,reference tolerance\n" + rows)
    with pytest.raises(InputError, match=sentence):
        tolerance_cost(path, NAMES)


def test_tolerances_may_be_variables_too(tmp_path):
    budget = {"generations": 3, "population": 12, "motion": Motion.prescribed, "checks": 256}
    folder = run_study(STUDY, tmp_path, {**budget, "free_tolerances": True})
    table = pd.read_csv(folder / "free_tolerances.csv")
    price = table["price over today's [1]"]
    tolerances = table.filter(regex="^tolerance")
    assert list(tolerances.columns) == [f"tolerance {m} ± [%]" for m in ("EnM", "GeM", "TSM", "Du")]
    assert "mean level against today [dB]" in table
    assert tolerances.min().min() >= 5.0
    assert tolerances.max().max() <= 25.0
    directions = np.array([3, 3, 3, 3])
    expected = (15.0 / tolerances.to_numpy()) @ directions / directions.sum()
    np.testing.assert_allclose(price, expected, rtol=1e-9)
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "At no higher price than today" in page
