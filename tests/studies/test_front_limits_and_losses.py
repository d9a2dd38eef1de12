"""The front study within limits, and with loss factors as variables."""

import html
import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from deboom.errors import InputError
from deboom.runs.runner import load_study, run_study
from deboom.vehicles.booming_model import Motion
from deboom.vehicles.limits import NaturalFrequencies
from pinned_pages import hold_numbers

STUDY = Path(__file__).parents[2] / "studies" / "front.py"
LIMITS = STUDY.parent / "data" / "u06_limits.toml"
BUDGET = {
    "seed": 1,
    "generations": 5,
    "population": 16,
    "samples": 16,
    "checks": 64,
    "with_": "prescribed",
}


def run(out, **changes):
    return run_study(load_study(STUDY), out, {**BUDGET, **changes})


def limits_of(tmp_path, text):
    path = tmp_path / "limits.toml"
    path.write_text(f"format = 1\n{text}", encoding="utf-8")
    return path


@pytest.mark.usefixtures("plain_loops")
def test_every_pick_keeps_every_limit_and_what_does_not_is_listed(tmp_path):
    band = {"band": (30.0, 36.0)}
    # descents within limits have their own tests; each of their designs costs static equilibria
    wanted = {"limits": LIMITS, "loss_factors": True, "polish": False}
    finished = run(tmp_path, **wanted, **band)
    hold_numbers(finished, "numbers_of_limits_and_losses")
    summary = json.loads((finished / "summary.json").read_text())
    table = pd.read_csv(finished / "limits.csv")
    low, high = table["at least"].fillna(-np.inf), table["at most"].fillna(np.inf)
    for design in ("today's", "best-mean", "best-sigma"):
        assert table[design].between(low, high).all()
    beyond = pd.read_csv(finished / "beyond_limits.csv")
    assert 0 < len(beyond) == summary["n_beyond_limits"] < summary["n_evaluated"]
    assert (beyond.filter(like="beyond").max(axis=1) > 0.0).all()
    losses = pd.read_csv(finished / "loss_factors.csv")
    assert list(losses["variable"][:2]) == ["EnM x loss", "EnM y loss"]
    assert losses["best-mean factor [1]"].between(0.8, 1.2).all()
    assert len(pd.read_csv(finished / "stiffness.csv")) == 12
    record = json.loads((finished / "run.json").read_text())
    assert any(path.endswith("u06_limits.toml") for path in record["inputs_sha256"])


@pytest.mark.usefixtures("plain_loops")
def test_no_booming_peak_of_the_front_rises_by_more_than_is_allowed(tmp_path):
    """Named designs keep the limit, beside those of the mounts, and others miss it."""
    band = {"band": (30.0, 60.0), "motion": Motion.prescribed}
    finished = run(tmp_path, limits=LIMITS, peak_rise=0.2, **band)
    number = "rise of a booming peak [dB]"
    rise = pd.read_csv(finished / "limits.csv").set_index("number").loc[number]
    assert rise["at most"] == 0.2
    for design in ("today's", "best-mean", "best-sigma"):
        assert rise[design] <= 0.2
    beyond = pd.read_csv(finished / "beyond_limits.csv")
    assert beyond.filter(like="rise of a booming peak").to_numpy().max() > 0.0
    page = (finished / "report.html").read_text(encoding="utf-8")
    assert "Limits of 'rise of a booming peak' have no gradient" in html.unescape(page)


@pytest.mark.parametrize("peak_rise", [-0.1, np.inf])
def test_a_rise_that_cannot_be_is_refused(tmp_path, peak_rise):
    with pytest.raises(InputError, match=r"--peak-rise .* from 0 dB"):
        run(tmp_path, peak_rise=peak_rise)


def test_a_powertrain_that_is_not_held_stably_costs_its_modes_only(tmp_path, monkeypatch):
    def unstable(*_):
        raise InputError("the stiffness has a negative direction")

    monkeypatch.setattr(NaturalFrequencies, "solved", unstable)
    small = {"generations": 1, "population": 4, "samples": 2, "band": (30.0, 33.0)}
    page = (run(tmp_path, **small) / "report.html").read_text(encoding="utf-8")
    assert "Sag, travel and modes are not known: the stiffness has a negative direction" in page
    assert "modes of the powertrain are not known: the stiffness has a negative" in page


def test_a_limit_out_of_reach_ends_in_a_sentence_that_names_it(tmp_path):
    path = limits_of(tmp_path, '[[sag]]\nmount = "EnM"\nat_most_mm = 3.0\n')
    with pytest.raises(
        InputError, match=r"'EnM sag at most 3 mm' \(limits.toml, \[\[sag\]\] 1\) by 1"
    ):
        run(tmp_path / "results", limits=path)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ('[[sag]]\nmount = "Du"\nat_most_mm = 3.0\n', r"\[\[sag\]\] 1: .*no direction 'Du z'"),
        (
            '[[travel]]\ndirection = "TSM x"\nwheel_torque_nm = 9e4\nat_most_mm = 9.0\n',
            r"limits.toml: \[\[travel\]\] 1: .* beyond its measured curve",
        ),
        ('[[stiffness]]\nvariable = "Q x"\nat_least_n_per_mm = 1.0\n', "no measured stiffness"),
    ],
)
def test_what_cannot_be_limited_is_refused_before_the_search(tmp_path, text, sentence):
    with pytest.raises(InputError, match=sentence):
        run(tmp_path / "results", limits=limits_of(tmp_path, text))


def test_loss_factors_are_refused_where_mounts_settle_elsewhere(tmp_path):
    with pytest.raises(InputError, match="--motion prescribed or coupled"):
        run(tmp_path, loss_factors=True, motion=Motion.amplitude)


@pytest.mark.usefixtures("plain_loops")
def test_vehicles_have_weights_limits_of_levels_and_objectives_of_their_own(tmp_path):
    """Means are averages with the weights, and no vehicle of a pick is louder than today."""
    path = limits_of(tmp_path, '[[level]]\nat_most_db = "today"\n')
    small = {"band": (30.0, 36.0), "motion": Motion.prescribed, "weight": ["U06-5=3"]}
    small["polish"] = False
    finished = run(tmp_path, limits=path, also=["mean=U06-5"], **small)
    hold_numbers(finished, "numbers_of_weights_and_further_objectives")
    levels = pd.read_csv(finished / "level_limits.csv").set_index("number")
    assert len(levels) == 5
    picks = pd.read_csv(finished / "picks.csv").set_index("design")
    last = "best-mean of SPLV, U06-5"
    for pick in ("best-mean", "best-sigma", last):
        assert (levels[pick] <= levels["at most"]).all()
    np.testing.assert_allclose(levels["today's"], levels["at most"], rtol=1e-12)
    for design, column in (("baseline", "today's"), ("best-mean", "best-mean"), (last, last)):
        mean = np.average(levels[column], weights=[1, 1, 1, 1, 3])
        assert picks.loc[design, "mean level [dB(A)]"] == pytest.approx(mean, rel=1e-12)
    single = picks["mean of SPLV, U06-5 [dB(A)]"]
    assert single.min() == single[last] < single["best-sigma"]
    summary = json.loads((finished / "summary.json").read_text())
    assert summary["n_beyond_limits"] == len(pd.read_csv(finished / "beyond_limits.csv")) > 0
    assert summary["mean_change_db_best_mean_of_SPLV_U06_5"] == picks.loc[last, "change [dB]"]
    page = (finished / "report.html").read_text(encoding="utf-8")
    assert "In each mean of the vehicles the weights are U06-5 3, every other one 1." in page
    assert "weighted mean" in page
    assert "Beside the mean level and its σ the search minimised mean of SPLV, U06-5." in page
    assert "Two objectives" not in page
    record = json.loads((finished / "run.json").read_text())
    assert any(name.endswith("limits.toml") for name in record["inputs_sha256"])
