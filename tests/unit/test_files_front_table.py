"""A front is written into a folder and read back; what is damaged is refused."""

import numpy as np
import pandas as pd
import pytest

import deboom
from deboom.errors import InputError
from deboom.explore.result import FrontColumns
from deboom.files.front_table import FrontTable, tables_of
from deboom.tabled import csv_text

MODEL = deboom.ResponseFunction(lambda x: (x - 0.9) ** 2, ("a", "b"), ("y", "z"), "dB")


@pytest.fixture(scope="module")
def front():
    robust = deboom.Robust(MODEL, MODEL.design_space(), draws=16)
    return deboom.search(robust, population=8, generations=3, verified_with=16)


def saved(front, folder):
    """Write the files of a front into a folder."""
    for name, table in tables_of(front).items():
        (folder / f"{name}.csv").write_text(csv_text(table), encoding="utf-8")


def test_a_front_comes_back_as_it_was(front, tmp_path):
    saved(front, tmp_path)
    table = FrontTable.read(tmp_path)
    assert table.variables == ("a [1]", "b [1]")
    np.testing.assert_array_equal(table.designs, front.values.designs)
    sums = np.column_stack([front.values.mean_sum, front.values.sigma_sum])
    np.testing.assert_array_equal(table.objectives, sums)
    assert dict(table.picks) == dict(front.picks)
    np.testing.assert_array_equal(table.convergence, front.search.hypervolume)
    pd.testing.assert_frame_equal(table.table, FrontTable.of(front).table)


def test_objectives_of_a_user_are_no_variables(tmp_path):
    aims = [deboom.Objective("mean", response=name) for name in ("y", "z")]
    aims.append(deboom.Objective("share above", above=0.01))
    model = deboom.ResponseFunction(MODEL.function, ("a", "b"), ("y", "z"), "mm")
    robust = deboom.Robust(model, model.design_space(), objectives=aims, draws=16)
    front = deboom.search(robust, population=8, generations=3, verified_with=16)
    saved(front, tmp_path)
    table = FrontTable.read(tmp_path)
    assert table.variables == ("a [1]", "b [1]")
    assert dict(table.picks) == dict(front.picks)
    assert "best-share above 0.01, sum" in table.picks
    # a volume of two lengths and a share
    assert "hypervolume [mm²]" in tables_of(front)["convergence"]
    pd.testing.assert_frame_equal(table.table, FrontTable.of(front).table)


def test_every_column_of_a_front_has_one_of_the_names(front):
    names = FrontColumns("dB").names
    assert {name for name in front.table.columns if name.endswith("]")} <= names
    assert FrontColumns.of_table(list(front.table.columns)) == FrontColumns("dB")
    assert FrontColumns("dB(A)").mean_sum == "SPLV mean sum [dB(A)]"


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda f: (f / "front.csv").unlink(), "front.csv cannot be read"),
        (lambda f: (f / "front.csv").write_text(""), "front.csv is no table"),
        (lambda f: (f / "front.csv").write_text("point,pick\n1,\n"), "has no design variables"),
    ],
)
def test_damage_is_refused(front, tmp_path, spoil, message):
    saved(front, tmp_path)
    spoil(tmp_path)
    with pytest.raises(InputError, match=message):
        FrontTable.read(tmp_path)


def test_a_table_without_sums_has_no_objectives(tmp_path):
    (tmp_path / "front.csv").write_text("point,a [1]\n1,0.5\n")
    table = FrontTable.read(tmp_path)
    assert table.designs.tolist() == [[0.5]]
    with pytest.raises(InputError, match=r"SPLV mean sum \[dB\(A\)\]"):
        _ = table.objectives
