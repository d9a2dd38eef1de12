"""Mounts that vehicles share, at a tiny budget."""

import json

import pandas as pd
import pytest

from deboom.errors import InputError
from deboom.files.tables import read_frame
from deboom.runs.runner import load_study, run_study
from deboom.vehicles.booming_model import Motion
from pinned_pages import hold

STUDY = load_study("commonality")
BUDGET = {"motion": Motion.prescribed, "group": ["U06"], "starts": 3, "allowed": 0.3}


def test_shared_mounts_keep_the_limit_of_every_vehicle(finished, summary):
    hold(finished, "commonality")
    # U06-5 has another engine mount and another gearbox mount than its sisters
    assert summary["part_numbers_lower_bound"] <= summary["part_numbers_min"] == 6
    assert 0.0 <= summary["price_db"] <= summary["price_worst_db"] <= 0.3 + 1e-6
    assert summary["share_verified_min"] >= 0.95
    vehicles = pd.read_csv(finished / "vehicles.csv")
    assert (vehicles["shared mounts [dB(A)]"] <= vehicles["limit as drawn [dB(A)]"] + 1e-6).all()


def test_cars_are_told_what_their_own_shared_mounts_are_expected_to_change(tmp_path):
    options = {**BUDGET, "motion": Motion.coupled, "starts": 1}
    run = run_study(STUDY, tmp_path, {**options, "allowed": 0.5})
    summary = json.loads((run / "summary.json").read_text())
    table = read_frame(run / "expected.csv").set_index("vehicle")
    changes = pd.read_csv(run / "vehicles.csv").set_index("vehicle")["change against today [dB]"]
    for name, row in table.iterrows():
        key = f"expected_change_db_{name}"
        assert row["change, from [dB]"] < row["change, expected [dB]"] < row["change, to [dB]"]
        assert summary[key] == pytest.approx(row["change, expected [dB]"])
        # its own design: in the model without the energy of the scatter
        assert row["change in the model [dB]"] == pytest.approx(changes[name], abs=0.3)
    assert summary["expected_change_db_worst"] > summary["expected_change_db_mean"]
    assert "dB expected on average" in (run / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"together": ["TSM"]}, "write a mount and at least two vehicles"),
        ({"together": ["CTSM=U06-1,U06-2"]}, "there is no part 'CTSM'"),
        ({"allowed": -0.1}, "costs 0 dB or more"),
        ({"share": 0.2}, "at least half of the cars"),
    ],
)
def test_bad_options_are_one_sentence_and_leave_nothing(tmp_path, options, sentence):
    with pytest.raises(InputError, match=sentence):
        run_study(STUDY, tmp_path, {**BUDGET, "starts": 1, **options})
    assert not list(tmp_path.rglob("summary.json"))


def test_a_limit_out_of_reach_names_the_vehicle(tmp_path):
    table = tmp_path / "limits.csv"
    rows = [f"U06-{n},{50 if n < 5 else 40}" for n in range(1, 6)]
    table.write_text("vehicle,limit [dB(A)]\n" + "\n".join(rows) + "\n")
    with pytest.raises(InputError, match=r"limits\.csv: U06-3 .* limit of 50 dB\(A\)"):
        run_study(STUDY, tmp_path / "out", {**BUDGET, "starts": 1, "limits": table})
    table.write_text("vehicle,limit [dB(A)]\nU06-1,50\n")
    with pytest.raises(InputError, match=r"no row for \['U06-2'"):
        run_study(STUDY, tmp_path / "out", {**BUDGET, "starts": 1, "limits": table})
