"""What deboom 0.2.0 wrote still opens, or is refused with the remedy."""

import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import deboom
from command_line import call

OLD = Path(__file__).parents[1] / "data" / "deboom-0.2.0"
FINISHED = OLD / "results" / "u06_robust_front" / "2026-11-26_184520_seed1"
UNFINISHED = "2026-11-26_184652_seed1"
STUDIES = Path(__file__).parents[2] / "studies"


def test_a_run_opens_with_designs_beside_objectives_and_picks_of_todays_spelling():
    front = deboom.read_run(FINISHED).front
    designs = pd.read_csv(FINISHED / "designs.csv")
    assert list(designs.columns[1:]) == list(front.variables)
    np.testing.assert_array_equal(front.designs, designs.iloc[:, 1:])
    np.testing.assert_array_equal(
        front.objectives,
        pd.read_csv(FINISHED / "front.csv")[["SPLV mean sum [dB(A)]", "SPLV sigma sum [dB]"]],
    )
    assert dict(front.picks) == {
        "best-mean": 0,
        "none-louder": 0,
        "sigma-kept": 1,
        "best-sigma": 9,
    }
    assert front.convergence.shape == (4,)


def test_pages_for_a_supplier_and_to_explore_are_made_of_a_run_box_and_sheet(tmp_path):
    box, sheet = OLD / "acceptance_box.json", OLD / "supplier_sheet_TSM.xlsx"
    words = ("--supplier", "--box", box, "--since", sheet, "--mount", "TSM", "--out", tmp_path)
    call("report", FINISHED, *words, "--studies", STUDIES)
    page = (tmp_path / "supplier_sheet_TSM.html").read_text(encoding="utf-8")
    assert FINISHED.name in page
    call("report", FINISHED, "--interactive", "--out", tmp_path, "--studies", STUDIES)
    assert "best-mean = none-louder" in (tmp_path / "interactive.html").read_text("utf-8")


def test_an_unfinished_run_is_refused_with_the_remedy_and_goes_on_with_it(tmp_path):
    shutil.copytree(OLD / "results", tmp_path / "out")
    command = ("run", STUDIES / "u06_robust_front.py", "--out", tmp_path / "out")
    refused = call(*command, "--resume", UNFINISHED, code=2).stderr
    assert "another text of the study" in refused
    assert "--other-code" in refused
    call(*command, "--resume", UNFINISHED, "--other-code")
    run = deboom.read_run(tmp_path / "out" / "u06_robust_front" / UNFINISHED)
    assert "begun_with" in run.record
    kept = run.folder / "search" / "evaluations" / "000002.npz"
    old = OLD / "results" / "u06_robust_front" / f"{UNFINISHED}.unfinished" / "search"
    assert kept.read_bytes() == (old / "evaluations" / "000002.npz").read_bytes()


def test_box_and_library_open():
    assert deboom.read_solution_box(OLD / "acceptance_box.json").group == "U06"
    with deboom.open_library(OLD / "tsm.db") as library:
        (identity,) = library.identities()
        assert library.load(identity).mount.name == "TSM"


@pytest.mark.parametrize("name", ["index", "vehicles", "splv_change"])
def test_names_of_a_front_that_moved_say_where_to(name):
    model = deboom.ResponseFunction(lambda x: x**2, ("a",), ("y",), "dB")
    robust = deboom.Robust(model, model.design_space(), draws=16)
    front = deboom.search(robust, population=4, generations=1, verified_with=16)
    with pytest.raises(AttributeError, match=r"take (model|responses|deboom\.vehicles)"):
        getattr(front, name)
    with pytest.raises(deboom.InputError, match="a pick is spelled 'best-mean', not 'best mean'"):
        front.picks["best mean"]
