"""The acceptance box of the shipped platform, found with few parts."""

from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from deboom.errors import InputError
from deboom.explore import selection
from deboom.explore.largest_box import BoxEffort, largest_box
from deboom.files.acceptance import read_solution_box
from deboom.runs.runner import load_study, run_study
from deboom.vehicles.booming_model import Motion
from pinned_pages import hold

STUDIES = Path(__file__).parents[2] / "studies"
STUDY = load_study("solution_box")
BUDGET = {"seed": 1, "motion": Motion.prescribed}
QUICK = BoxEffort(
    starts=1, coarse=((0.5, 256),), fine=((0.15, 512),), calibration=8192, verification=8192
)


@pytest.fixture(scope="module", autouse=True)
def few_parts():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(STUDY.module, "largest_box", partial(largest_box, effort=QUICK))
        patch.setattr(STUDY.module, "POPULATION", 20)
        # one generation without descents: a search forks on other processors
        patch.setattr(STUDY.module, "GENERATIONS", 1)
        patch.setattr(selection._Goal, "descend", lambda _goal, _name, start: start)
        yield


def run(tmp_path, **options):
    return run_study(STUDY, tmp_path, {**BUDGET, **options})


def test_the_box_keeps_its_share_and_its_file_says_what_a_supplier_needs(finished, summary):
    hold(finished, "solution_box")
    assert summary["share_verified"] >= summary["share_bound"] > 0.94
    vehicles = pd.read_csv(finished / "vehicles.csv")
    assert vehicles["limit [dB(A)]"].tolist() == vehicles["today [dB(A)]"].tolist()
    assert vehicles["parts that miss the limit [%]"].max() < 5.0
    box = read_solution_box(finished / "acceptance_box.json")
    assert box.together
    assert box.limit_below_today_db == 0.0
    assert summary["seconds"] < 60.0
    table = pd.read_csv(finished / "box.csv").set_index("variable")
    variable = read_solution_box(finished / "acceptance_box.json").variable("TSM x")
    assert variable.upper * variable.reference_stiffness_n_per_m == pytest.approx(
        1e3 * table.loc["TSM x", "to [N/mm]"]
    )


def test_a_peak_in_the_worst_vehicle_at_a_limit_of_its_own(tmp_path):
    options = {"quantity": STUDY.module.LimitedLevel.peak, "limit": 74.5, "worst_vehicle": True}
    folder = run(tmp_path, **options)
    box = read_solution_box(folder / "acceptance_box.json")
    assert box.together
    assert box.quantity == "peak level"
    assert box.band_hz == (25.0, 40.0)
    assert {response.limit for response in box.responses} == {74.5}
    assert box.limit_below_today_db is None
    assert box.share_verified > 0.94


def test_a_limit_below_today_is_one_of_each_vehicle(tmp_path):
    prices = tmp_path / "prices.csv"
    names = pd.read_csv(STUDIES / "data" / "u06_f39_f45" / "mounts.csv")["mount"].unique()
    rows = [f"{m} {a},{2 if m == 'TSM' else 1},0.15" for m in names for a in "xyz"]
    prices.write_text("variable,weight,reference tolerance\n" + "\n".join(rows) + "\n")
    folder = run(tmp_path, below_today=1.0, share=0.8, cost_table=prices)
    vehicles = pd.read_csv(folder / "vehicles.csv")
    gap = vehicles["today [dB(A)]"] - vehicles["limit [dB(A)]"]
    assert gap.to_numpy() == pytest.approx(np.ones(5))
    assert pd.read_csv(folder / "box.csv").set_index("variable").loc["TSM x", "weight [1]"] == 2.0


def test_the_point_of_a_finished_front_is_taken_if_its_variables_are_the_same(monkeypatch):
    space = SimpleNamespace(names=("EnM x", "EnM y"))
    front = SimpleNamespace(space=space, picked=np.array([0.9, 1.1]))
    points_searched = []

    def read(*arguments):
        points_searched.append(arguments)
        return front

    module = STUDY.module
    monkeypatch.setattr(module, "supplier_study", read)
    options = module.Options(front=Path("front"), pick=module.Pick.best_sigma)
    point = module.pareto_point(SimpleNamespace(space=space), options, None)
    assert point.tolist() == [0.9, 1.1]
    assert points_searched == [(Path("front"), None, module.Pick.best_sigma)]
    other = SimpleNamespace(space=SimpleNamespace(names=("EnM x",)))
    with pytest.raises(InputError, match="take a front of the same platform"):
        module.pareto_point(other, options, None)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"limit": 40.0}, "'U06-3', which binds"),
        ({"limit": 54.0, "below_today": 1.0}, "two limits at once"),
        ({"share": 1.0, "limit": 54.0}, "below 1"),
    ],
)
def test_what_cannot_be_asked_is_refused(tmp_path, options, sentence):
    with pytest.raises(InputError, match=sentence):
        run(tmp_path, **options)
