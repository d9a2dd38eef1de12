"""The face: what `import deboom` offers, and what a notebook does with it."""

from __future__ import annotations

import doctest
import inspect
import re
import subprocess
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.optimize import minimize

import deboom
from deboom import notebook


def test_every_name_is_there_and_explained():
    assert 35 <= len(deboom.__all__) <= 60
    assert set(deboom.__all__) <= set(dir(deboom))
    for name in deboom.__all__:
        text = inspect.getdoc(getattr(deboom, name)) or ""
        assert len(text.splitlines()[0]) > 20, name


def test_every_name_has_its_page():
    listed = (Path(__file__).parents[2] / "docs" / "api.md").read_text(encoding="utf-8")
    pages = re.findall(r"^   deboom\.(\w+)$", listed, flags=re.M)
    assert sorted(pages) == sorted(deboom.__all__)


def test_functions_of_a_notebook_have_units_errors_and_an_example():
    for name, function in inspect.getmembers(notebook, inspect.isfunction):
        if function.__module__ != notebook.__name__ or name.startswith("_"):
            continue
        text = inspect.getdoc(function) or ""
        for part in ("Parameters", "Raises", "Examples"):
            assert part in text, f"{name} lacks {part}"
        assert getattr(deboom, name) is function


def test_examples_of_the_face_hold():
    assert doctest.testmod(notebook).failed == 0


def test_import_loads_nothing_heavy():
    heavy = ("numpy", "pandas", "pymoo", "matplotlib", "scipy", "numba")
    code = f"import sys, deboom; print([name for name in {heavy} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.fixture(scope="module")
def model():
    return deboom.booming_model(deboom.read_platform("u06"), vehicles="U06", band=(24, 40))


def test_the_lines_of_the_readme(model):
    space = deboom.design_space(model, bounds=0.20, tolerance=0.15)
    robust = deboom.robust_response(model, space, draws=16, seed=1)
    front = deboom.search(robust, population=8, generations=3, seed=1, verified_with=32)
    assert {"SPLV mean sum [dB(A)]", "SPLV sigma sum [dB]"} <= set(front.table().columns)
    own = minimize(deboom.RobustProblem(robust), NSGA2(8), ("n_gen", 3), seed=1)
    assert own.F.min(axis=0) == pytest.approx(front.search.front.objectives.min(axis=0))


def test_doe_correlation_and_sensitivities(model):
    space = deboom.design_space(model)
    experiment = deboom.doe(model, space, n=32)
    assert experiment.table.shape[0] == 32
    assert "<table" in experiment._repr_html_()
    r = deboom.correlation(experiment, resamples=100)
    assert r.names == model.response_names
    sobol = deboom.sobol(model, space, n=32)
    assert sobol.problem["num_vars"] == space.n_variables
    assert len(sobol.table) == space.n_variables * len(model.response_names)


def test_a_regressor_of_scikit_learn_takes_the_place_of_the_model(model):
    from sklearn.linear_model import LinearRegression

    space = deboom.design_space(model)
    designs = deboom.doe(model, space, n=64).doe
    surrogate = LinearRegression().fit(designs.designs, designs.responses)
    foreign = deboom.ResponseFunction(
        surrogate.predict, model.variable_names, model.response_names, model.response_unit
    )
    robust = deboom.robust_response(foreign, space, draws=16)
    front = deboom.search(robust, population=8, generations=2, verified_with=32)
    assert np.isfinite(front.values.mean_sum).all()


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"motion": "couple"}, "motion 'couple' is unknown: did you mean 'coupled'"),
        ({"mounts": "nothing"}, "mounts 'nothing' is unknown: use one of library"),
        ({"vehicles": "U99"}, "U99"),
        ({"band": (200, 300)}, "band"),
        ({"load_cases": ["g9"]}, "g9"),
    ],
)
def test_wrong_words_get_a_sentence(changes, sentence):
    with pytest.raises(deboom.InputError, match=sentence):
        partial(deboom.booming_model, deboom.read_platform("u06"), **changes)()


def test_unknown_names_are_no_attribute():
    with pytest.raises(AttributeError, match="serach"):
        _ = deboom.serach
