"""Tolerances with a price at a tiny budget."""

import json
from pathlib import Path

import pandas as pd
import pytest

from deboom.errors import InputError
from deboom.study.made_parts import tolerance_cost
from deboom.study.runner import load_study, run_study

STUDY = Path(__file__).parents[2] / "studies" / "tolerance_allocation.py"
BUDGET = {"stiffness": True, "seed": 1, "generations": 15, "population": 20, "samples": 16}
NAMES = ("EnM x", "EnM y")


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """One run that several tests look at."""
    return run_study(load_study(STUDY), tmp_path_factory.mktemp("results"), BUDGET)


def test_paying_more_never_scatters_more(finished):
    budgets = pd.read_csv(finished / "budgets.csv")
    chosen = budgets.iloc[1:]
    assert chosen["cost [1]"].is_monotonic_increasing
    sigma = chosen["sigma of the level [dB]"]
    assert sigma.iloc[-1] < 0.9 * sigma.iloc[0]
    assert budgets["design"][0] == "today's"
    assert budgets["cost [1]"][0] == 12.0


def test_the_front_has_three_objectives_and_tolerances_within_their_bounds(finished):
    front, designs = (pd.read_csv(finished / f"{name}.csv") for name in ("front", "designs"))
    assert len(front) == len(designs)
    assert {"SPLV mean sum [dB(A)]", "SPLV sigma sum [dB]", "cost [1]"} <= set(front.columns)
    tolerances = designs.filter(like="tolerance [1]")
    assert tolerances.shape[1] == 12
    assert tolerances.stack().between(0.05, 0.30).all()
    expected = (0.15 / tolerances).sum(axis=1)
    assert front["cost [1]"].to_numpy() == pytest.approx(expected.to_numpy(), abs=1e-12)


def test_summary_and_page_are_there(finished):
    summary = json.loads((finished / "summary.json").read_text())
    assert summary["n_evaluated"] == 300
    assert summary["sigma_change_percent_most_precise"] < 0.0
    figures = {path.stem for path in (finished / "figures").iterdir()}
    assert figures == {"cost_of_scatter"}


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
        ("EnM x,1,0.15\nEnM y,-1,0.15\n", "weights of at least 0"),
    ],
)
def test_a_bad_table_of_prices_is_refused(tmp_path, rows, sentence):
    path = tmp_path / "prices.csv"
    path.write_text("variable,weight,reference tolerance\n" + rows)
    with pytest.raises(InputError, match=sentence):
        tolerance_cost(path, NAMES)
