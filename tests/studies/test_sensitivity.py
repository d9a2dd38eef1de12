"""The sensitivity study at a tiny budget, through the same command as a user."""

import json
from dataclasses import replace

import pandas as pd
import pytest

from deboom.errors import InputError
from deboom.files.platform import read_platform
from deboom.pages import sensitivity as analysis
from deboom.pages.sensitivity import Analysis, sensitivity_report
from deboom.runs.runner import load_study, run_study
from deboom.vehicles.booming_model import BoomingModel, booming_model
from deboom.vehicles.fleet import Fleet
from deboom.vehicles.platform import MountSource
from pinned_pages import hold

STUDY = load_study("sensitivity")
BUDGET = {"seed": 1, "n": 64, "resamples": 20, "mounts": MountSource.spectra}
LOUD = [f"U06-{number}" for number in range(1, 5)]
PLATFORM = STUDY.path.parent / "data" / "u06_f39_f45"


def run(out, **changes):
    return run_study(STUDY, out, {**BUDGET, **changes})


@pytest.fixture(scope="module")
def finished(thesis_run):
    return thesis_run("ranking")


def test_the_ranking_is_that_of_the_thesis(finished, summary):
    hold(finished, "sensitivity")
    table = pd.read_csv(finished / "sobol.csv")
    leading = {
        vehicle: list(rows.sort_values("rank")["variable"][:2])
        for vehicle, rows in table.groupby("vehicle")
    }
    assert all(leading[vehicle] == ["TSM x", "Du x"] for vehicle in LOUD)
    assert leading["U06-5"][0] == "GeM x"
    assert (table[table["variable"].isin(["Du y", "Du z"])]["total [1]"] == 0.0).all()
    # 64 base points: 14 rows each of the variables (three ranges, lines), 6 by mount
    assert summary["n_runs"] == 64 * (4 * 14 + 6)


def test_other_questions_change_places_with_what_stands_beside(thesis_run):
    folder = thesis_run("sensitivity")
    table = pd.read_csv(folder / "sobol_beside.csv")
    assert [name for name in table.columns if name.startswith("total")] == [
        "total, tolerance ±15 % (3 σ) [1]",
        "total, design ±15 % [1]",
        "total, design ±20 % [1]",
    ]
    facts = json.loads((folder / "run.json").read_text())["facts"]
    assert facts["motion"] == "coupled"
    pairs = pd.read_csv(folder / "sobol_pairs.csv")
    assert len(pairs) == table["vehicle"].nunique() * 12 * 11 / 2
    motions = pd.read_csv(folder / "sobol_motion.csv")
    assert (motions["total, coupled [1]"] == table["total, tolerance ±15 % (3 σ) [1]"]).all()
    assert (motions["total, prescribed [1]"] != motions["total, coupled [1]"]).any()
    assert (folder / "figures" / "sobol_pairs.png").is_file()
    assert facts["variables"] == "tolerance: gaussian, cut at ±3 σ, from 0.85 to 1.15"


@pytest.mark.usefixtures("plain_loops")
def test_one_mount_one_vehicle_and_few_lines_are_enough():
    data = read_platform(PLATFORM)
    small = replace(data, mounts=data.mounts[:1])
    fleet = Fleet(data.fleet.vehicles[-1:])
    cases = [(data.load_case(data.default_load_case), 1.0)]
    (paths,) = booming_model(fleet, data.mounts, cases, (20.0, 20.5)).cases
    few = replace(paths, values=paths.values[..., :3], variable_names=paths.variable_names[:3])
    index = BoomingModel((few,), (1.0,))
    plan = analysis.SensitivityPlan(
        Analysis.design, 0.1, 0.1, 0.1, n_base=32, n_resamples=10, seed=2
    )
    indices = analysis.sensitivity(small, index, plan)
    assert indices.by_mount is None
    assert [*indices.beside] == ["tolerance ±10 % (3 σ)"]
    report = sensitivity_report(indices)
    assert "sobol_mounts" not in report.figures
    assert len(report.tables["sobol_lines"]) == 3
    assert len(report.tables["sobol"]) == 3
    assert set(report.summary) >= {f"st_EnM_{axis}_{fleet.names[0]}" for axis in "xyz"}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"n": 100}, r"100 base points .* take 64 or 128"),
        ({"seed": 0}, "seed 0"),
        ({"bounds": 0.0}, "variable 'EnM x' does not vary"),
        ({"tolerance": 0.0}, "variable 'EnM x' does not vary"),
        ({"beside": 1.5}, "give a half width from 0 up to"),
        ({"resamples": 1}, "cannot give an interval"),
    ],
)
def test_bad_options_give_one_sentence(tmp_path, changes, message):
    with pytest.raises(InputError, match=message):
        run(tmp_path, **{"n": 8, **changes})
    assert not list(tmp_path.rglob("*.csv"))
