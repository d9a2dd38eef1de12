"""Tables of designs: a user's own, and a whole DOE there and back."""

import json

import numpy as np
import pandas as pd
import pytest

import deboom
from deboom.errors import InputError
from deboom.explore.doe import doe_frame, run_doe
from deboom.explore.space import DesignSpace, ResponseFunction, stiffness_factor_space
from deboom.files.doe_table import read_plan

SPACE = stiffness_factor_space(("EnM x", "TSM x"), half_width=0.15)
DESIGNS = np.array([[1.0, 1.0], [0.9, 1.1], [1.15, 0.85]])


def levels(designs):
    values = designs @ np.array([[1.0, 0.3], [2.0, 0.1]])
    values[designs[:, 0] > 1.1] = np.nan
    return values


MODEL = ResponseFunction(levels, SPACE.names, ("U06-1", "U06-5"), "dB(A)")


@pytest.fixture
def doe():
    return run_doe(MODEL, SPACE, DESIGNS, name="platform", plan="table")


@pytest.mark.parametrize("suffix", ["csv", "xlsx"])
def test_designs_in_any_column_order(tmp_path, suffix):
    path = tmp_path / f"designs.{suffix}"
    frame = pd.DataFrame({"TSM x [1]": DESIGNS[:, 1], "EnM x [1]": DESIGNS[:, 0]})
    frame.to_csv(path, index=False) if suffix == "csv" else frame.to_excel(path, index=False)
    assert np.array_equal(read_plan(path, SPACE), DESIGNS)


def test_units_are_converted_and_foreign_ones_kept(tmp_path):
    space = DesignSpace(
        ("k", "hardness"), ("N/mm", "shore A"), *np.array([[200, 50], [100, 40], [300, 60], [0, 0]])
    )
    path = tmp_path / "designs.csv"
    path.write_text("k [N/m],hardness [shore A]\n250000,55\n", encoding="utf-8")
    assert read_plan(path, space) == pytest.approx(np.array([[250.0, 55.0]]))


def state(**changes):
    """Return what the interactive page saves, variables in an order of its own."""
    pinned = [{"name": "P1", "design": [0.9, 1.1]}]
    whole = {"variables": ["TSM x", "EnM x"], "design": [1.1, 0.9], "pinned": pinned}
    return json.dumps({**whole, **changes})


def test_saved_designs_come_with_their_pins(tmp_path):
    path = tmp_path / "saved.json"
    path.write_text(state(), encoding="utf-8")
    assert np.array_equal(read_plan(path, SPACE), [[0.9, 1.1], [1.1, 0.9]])
    alike = [{"name": "P1", "design": [0.9, 1.1]}, {"name": "P1", "design": [1.0, 1.0]}]
    path.write_text(state(pinned=alike), encoding="utf-8")
    assert len(read_plan(path, SPACE)) == 3


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("[1]", "saved.json holds no JSON object: save one with the button"),
        ("{", "saved.json is not JSON"),
        ("[" * 100_000, "saved.json is nested too deeply"),
        (state(design=[10**400, 1.0]), "saved.json is no state that the interactive page saved"),
        (
            state(variables=["TSM x", "EnM x", "TSM x"], design=[1.0] * 3, pinned=[]),
            "two variables are named 'TSM x'",
        ),
        (state(design=[1.0]), "saved.json is no state that the interactive page saved"),
        (state(variables=["TSM x", "Du x"]), "'Du x' is in only one of both"),
        (state(design=[1.0, 1.2]), "its design has 'EnM x' 1.2, outside its bounds 0.85 to 1.15"),
        (state(design=[1.0, None]), "its design has 'EnM x' nan, outside its bounds"),
    ],
)
def test_a_state_that_does_not_fit_is_refused_in_one_sentence(tmp_path, text, sentence):
    path = tmp_path / "saved.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=sentence):
        read_plan(path, SPACE)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("EnM x [1]\n1\n", "column 'TSM x' is missing"),
        ("EnM x [1],TSM x [1]\n1,1\n1,1.2\n", "line 3: 'TSM x' is 1.2, outside its bounds 0.85 to"),
    ],
)
def test_bad_tables_are_refused_in_one_sentence(tmp_path, text, sentence):
    path = tmp_path / "designs.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=sentence):
        read_plan(path, SPACE)


def test_a_whole_doe_is_a_table(doe):
    frame = doe_frame(doe)
    assert frame[list(SPACE.labels)].to_numpy() == pytest.approx(doe.designs)
    levels = frame[[f"{name} [dB(A)]" for name in MODEL.response_names]].to_numpy()
    assert levels == pytest.approx(doe.responses, nan_ok=True)
    assert list(frame["failure"]) == ["", "", "not finite"]


def test_names_that_would_collide_are_refused():
    model = ResponseFunction(levels, SPACE.names, ("EnM x", "plan"), "dB(A)")
    with pytest.raises(InputError, match="'EnM x' has the name of another column"):
        doe_frame(run_doe(model, SPACE, DESIGNS, name="n", plan="p"))


TABLE = pd.DataFrame(
    {
        "ID": np.arange(12),
        "a [N/mm]": np.linspace(200.0, 300.0, 12),
        "b": [3.0, 1.0, 2.0] * 4,
        "y [dB]": [*np.linspace(60.0, 49.0, 11), np.nan],
        "z [dB]": [*np.linspace(40.0, 50.0, 11), 30.0],
    }
)


@pytest.mark.parametrize("suffix", ["csv", "xlsx"])
def test_designs_evaluated_elsewhere_correlate_and_have_a_front(tmp_path, suffix):
    path = tmp_path / f"table.{suffix}"
    TABLE.to_csv(path, index=False) if suffix == "csv" else TABLE.to_excel(path, index=False)
    experiment = deboom.read_designs(path, ["y", "z"])
    assert experiment.doe.space.labels == ("a [N/mm]", "b [1]")
    assert experiment.doe.n_failed == 1
    assert deboom.correlation(experiment, resamples=100).pearson[0, 1] == pytest.approx(-1.0)
    assert len(experiment.front()) == 11
    assert experiment.front(["y"])["y [dB]"].tolist() == [49.0]
    with pytest.raises(InputError, match="no response"):
        experiment.front(["x"])


@pytest.mark.parametrize("separator", ["\t", ";", ","])
def test_a_table_of_modefrontier_is_an_experiment(tmp_path, separator):
    """Its designs table: an ID, marks, a category and the generation beside the variables."""
    lines = [
        ("ID", "M", "CATEGORY", "RID", "k_front", "k_rear", "level", "GENERATION"),
        *((n, "", "NSGA2_0", n, 200 + 5 * n, 300 - n, 60.5 - n, n // 4) for n in range(12)),
        (12, "x", "ERROR", 12, 270, 280, "", 3),
    ]
    path = tmp_path / "designs.csv"
    path.write_text("\n".join(separator.join(map(str, line)) for line in lines) + "\n")
    experiment = deboom.read_designs(path, ["level"])
    assert experiment.doe.space.names == ("k_front", "k_rear")
    assert experiment.doe.failures[-1] == "not computed"
    assert experiment.front()["level [1]"].tolist() == [49.5]
    correlated = deboom.correlation(experiment, inputs=True, resamples=100).matrix
    assert correlated.loc["k_front", "level"] == pytest.approx(-1.0)


@pytest.mark.parametrize("suffix", ["csv", "xlsx"])
def test_designs_go_out_to_be_filled_in_and_come_back(tmp_path, suffix):
    path = tmp_path / f"designs.{suffix}"
    headers = [f"{name} [dB(A)]" for name in MODEL.response_names]
    table = deboom.write_designs(path, SPACE, headers, n=16, seed=2)
    assert table[headers].isna().all(axis=None)
    with pytest.raises(InputError, match="no design has all of its responses: fill them in"):
        deboom.read_designs(path, MODEL.response_names)
    designs = table[list(SPACE.labels)].to_numpy()
    table[headers] = MODEL(designs)
    table.to_csv(path, index=False) if suffix == "csv" else table.to_excel(path, index=False)
    here = deboom.doe(MODEL, SPACE, n=16, seed=2)
    back = deboom.read_designs(path, MODEL.response_names)
    # a workbook keeps 16 digits
    np.testing.assert_allclose(back.doe.designs, here.doe.designs, rtol=1e-15)
    np.testing.assert_allclose(back.doe.responses, here.doe.responses)
    assert back.doe.n_failed == here.doe.n_failed > 0
    robust = deboom.Robust(MODEL, SPACE, draws=4)
    # designs of an experiment begin a search, and those of a front go out
    budget = {"population": 8, "generations": 2, "verified_with": 16, "polish": False}
    front = deboom.search(robust, **budget, first_population=back)
    np.testing.assert_array_equal(front.search.evaluated.designs[:16], back.doe.designs)
    given = deboom.write_designs(path, SPACE, headers, designs=front)
    np.testing.assert_array_equal(given[list(SPACE.labels)], front.values.designs)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"path": "designs.txt"}, "written as .csv or .xlsx"),
        ({"path": "nowhere/designs.csv"}, "nowhere"),
        ({"responses": []}, "name at least one response"),
        ({"responses": ["TSM x [dB]"]}, "two columns are named 'TSM x'"),
        ({"designs": [[1.0, 1.3]]}, "outside its bounds 0.85 to 1.15"),
    ],
)
def test_designs_that_cannot_go_out_are_refused(tmp_path, changes, words):
    arguments = {"path": "designs.csv", "responses": ["y [dB]"], **changes}
    with pytest.raises(InputError, match=words):
        deboom.write_designs(tmp_path / arguments.pop("path"), SPACE, **arguments)
    assert not list(tmp_path.iterdir())


def test_a_table_in_memory_is_read_like_its_file_also_with_two_units(tmp_path):
    frame = TABLE.assign(**{"z [kg]": 1.5}).drop(columns="z [dB]")
    frame.to_csv(tmp_path / "table.csv", index=False)
    read = [deboom.read_designs(each, ["y", "z"]) for each in (tmp_path / "table.csv", frame)]
    table = read[0].table
    assert table.drop(columns=["doe", "plan"]).equals(read[1].table.drop(columns=["doe", "plan"]))
    assert {"y [dB]", "z [kg]"} <= set(table)
    assert not [name for name in table if name.startswith("sum")]
    run = deboom.read_run(deboom.save_run(read[0], tmp_path))
    assert deboom.read_run(run.folder).doe.table.equals(table)


@pytest.mark.parametrize(
    ("changes", "responses", "words"),
    [
        ({}, ["w"], "w"),
        ({"b": "soft"}, ["y"], "'soft' is no finite number"),
        ({"y [Pa]": 1.0}, ["y"], "two columns are named 'y'"),
        ({"y [dB]": np.nan}, ["y"], "fill them in"),
    ],
)
def test_tables_of_others_that_cannot_be_are_refused(tmp_path, changes, responses, words):
    frame = TABLE.assign(**changes).drop(columns=[k for k, v in changes.items() if v is None])
    frame.to_csv(tmp_path / "table.csv", index=False)
    with pytest.raises(InputError, match=words):
        deboom.read_designs(tmp_path / "table.csv", responses)
