"""The acceptance box of the shipped platform, found with few parts."""

import json
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from deboom.errors import InputError
from deboom.explore import selection
from deboom.explore.largest_box import BoxEffort, NoBoxFound, largest_box
from deboom.files.acceptance import read_solution_box
from deboom.files.run_folder import read_run
from deboom.pages.solution_box import BoxStudy
from deboom.runs.platform_options import MotionOptions
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


def test_about_a_front_each_vehicle_keeps_80_percent_of_its_gain(tmp_path, monkeypatch):
    model = STUDY.module.prepare(STUDY.module.Options(motion=MotionOptions(Motion.prescribed)))
    picked = np.where(np.isin(model.space.names, ["TSM x", "Du x"]), 0.8, 1.0)
    monkeypatch.setattr(
        STUDY.module,
        "supplier_study",
        lambda *_: SimpleNamespace(space=model.space, picked=picked),
    )
    folder = run(tmp_path, front=tmp_path)
    vehicles = pd.read_csv(folder / "vehicles.csv")
    today, limit = vehicles["today [dB(A)]"], vehicles["limit [dB(A)]"]
    new = vehicles["Pareto point [dB(A)]"]
    gain = today - new
    assert gain.max() > 1.0
    expected = np.where(gain < 0.3, new + 0.1, today - 0.8 * gain)
    assert limit.to_numpy() == pytest.approx(expected, abs=1e-9)
    box = read_solution_box(folder / "acceptance_box.json")
    assert (box.gain_kept, box.limit_below_today_db) == (0.8, None)
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["change_of_design_db"] == pytest.approx(-gain.mean())
    inside = (vehicles["in the box, mean [dB(A)]"] - today).mean()
    assert summary["change_inside_db"] == pytest.approx(inside)
    words = read_run(folder).answer.verdict + " ".join(read_run(folder).answer.remarks)
    assert f"by the design itself −{gain.mean():.1f} dB" in words


def test_where_no_box_keeps_80_percent_the_largest_share_with_one_is_taken(monkeypatch):
    module, asked = STUDY.module, []
    model = SimpleNamespace(
        space=SimpleNamespace(nominal=np.ones(1)),
        response=lambda designs: 50.0 + 10.0 * np.asarray(designs) * [1.0, 0.02],
    )
    monkeypatch.setattr(module, "question", lambda _model, limit, _options: limit)

    def box(_model, _point, limit, *_):
        asked.append(limit.tolist())
        if limit[0] < 58.99:
            raise NoBoxFound("none")
        return BoxStudy(*[None] * 5, seed=1, limit_below_today=None)

    monkeypatch.setattr(module, "box_study", box)
    study = module.box_about(model, np.array([0.8]), module.Options(front=Path("front")), None)
    assert study.gain_kept == 0.5
    assert [first for first, _ in asked] == pytest.approx([58.4, 58.6, 58.8, 59.0])
    # a gain of 0.04 dB is none: the limit is 0.1 dB above the design
    assert asked[-1][1] == pytest.approx(50.26)


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
