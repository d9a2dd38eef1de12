"""Prescribed against coupled motion at a tiny budget, through the same door as a user."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd
import pytest

from deboom.errors import InputError
from deboom.study.platform_model import Motion
from deboom.study.runner import load_study, run_study

STUDY = Path(__file__).parents[2] / "studies" / "prescribed_or_coupled.py"
BUDGET = {
    "generations": 3,
    "population": 8,
    "samples": 8,
    "designs": 32,
    "polish": False,
}


def run(out, **changes):
    return run_study(load_study(STUDY), out, {**BUDGET, **changes})


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """One run that several tests look at."""
    return run(tmp_path_factory.mktemp("results"))


def test_prescribed_motion_ranks_alike_and_understates(finished):
    summary = json.loads((finished / "summary.json").read_text())
    assert summary["r_min"] >= 0.95  # 32 designs only
    assert 1.05 < summary["slope_min"] < summary["slope_max"] < 1.4
    assert summary["n_compared"] == 90
    assert summary["benefit_prescribed_db"] > summary["promised_prescribed_db"] > 0


def test_every_design_of_both_fronts_stands_under_both_motions(finished):
    fronts = pd.read_csv(finished / "fronts.csv")
    assert set(fronts["found with"]) == {"prescribed", "coupled"}
    assert fronts.groupby("found with")["optimum"].sum().eq(1).all()
    prescribed, coupled = (
        fronts[f"SPLV mean sum, {motion} [dB(A)]"] for motion in ("prescribed", "coupled")
    )
    assert (prescribed != coupled).all()


def test_benefits_add_up(finished):
    summary = json.loads((finished / "summary.json").read_text())
    vehicles = pd.read_csv(finished / "vehicles.csv")
    true = vehicles[vehicles["judged with"] == "coupled"]
    mean = true.groupby("optimum found with")["benefit [dB]"].mean()
    assert mean["prescribed"] == pytest.approx(summary["benefit_prescribed_db"], abs=1e-12)
    assert mean["coupled"] == pytest.approx(summary["benefit_coupled_db"], abs=1e-12)
    optima = pd.read_csv(finished / "optima.csv").set_index("variable")
    assert (optima.loc[["Du y", "Du z"]] == 1.0).all(axis=None)


def test_page_pictures_and_record(finished):
    names = {path.relative_to(finished).as_posix() for path in finished.rglob("*")}
    assert {"figures/prescribed_against_coupled.png", "figures/fronts.png", "report.html"} <= names
    facts = json.loads((finished / "run.json").read_text())["facts"]
    assert facts["kernel_prescribed"] == "numba"
    assert facts["truth"] == "coupled"


def test_prescribed_motion_cannot_be_the_truth(tmp_path):
    with pytest.raises(InputError, match="cannot judge itself"):
        run(tmp_path, truth=Motion.prescribed)
