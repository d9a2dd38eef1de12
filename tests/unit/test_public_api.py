"""The public API: what `import deboom` offers, and what a notebook does with it."""

import doctest
import inspect
import pydoc
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.optimize import minimize
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.linear_model import LinearRegression

import deboom

OBJECTS = {name: getattr(deboom, name) for name in deboom.__all__}
EXPLAINED = {
    name: value
    for name, value in OBJECTS.items()
    if not inspect.ismodule(value) and value is not deboom.InputError
}


GROUPS = (Path(__file__).parents[2] / "docs" / "names").glob("*.md")
LISTED = "".join(path.read_text(encoding="utf-8") for path in GROUPS)
PAGES = [
    name
    for name in re.findall(r"^   (deboom\.\S+)$", LISTED, flags=re.M)
    if not inspect.ismodule(pydoc.locate(name))
]


def test_every_name_is_there_and_explained():
    assert set(deboom.__all__) <= set(dir(deboom))
    for name, value in OBJECTS.items():
        assert len((inspect.getdoc(value) or "").splitlines()[0]) > 20, name


def test_every_name_has_its_page():
    pages = re.findall(r"^   deboom\.(\w+)$", LISTED, flags=re.M)
    assert sorted(pages) == sorted(deboom.__all__)


@pytest.mark.parametrize("name", EXPLAINED)
def test_every_page_has_shapes_units_errors_and_an_example(name):
    text = inspect.getdoc(EXPLAINED[name]) or ""
    parts = ["Parameters", "Raises", "See Also", "Examples"]
    if inspect.isfunction(EXPLAINED[name]):
        parts.append("Returns")
    lacking = [part for part in parts if f"\n{part}\n{'-' * len(part)}\n" not in text]
    assert not lacking


@pytest.mark.parametrize("page", PAGES)
def test_every_page_leads_on_to_pages(page):
    text = inspect.getdoc(pydoc.locate(page)) or ""
    (names,) = re.findall(r"^See Also\n-+\n(.+?)(?:\n\n|\Z)", text, flags=re.M | re.S)
    linked = re.split(r",\s+|\n", names)
    assert set(linked) <= set(PAGES) - {page}


@pytest.mark.parametrize("page", PAGES)
def test_examples_of_the_public_names_hold(page, capsys):
    finder, runner = doctest.DocTestFinder(recurse=False), doctest.DocTestRunner()
    for example in finder.find(pydoc.locate(page), page):
        runner.run(example)
    assert runner.summarize(verbose=False).failed == 0, capsys.readouterr().out


def test_import_loads_nothing_heavy():
    heavy = ("numpy", "pandas", "pymoo", "matplotlib", "scipy", "numba")
    code = f"import sys, deboom; print([name for name in {heavy} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_no_name_needs_the_command_line():
    code = "import sys, deboom; [getattr(deboom, name) for name in deboom.__all__]"
    code += "; print('typer' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


@pytest.fixture(scope="module")
def platform():
    return deboom.read_platform("u06")


@pytest.fixture(scope="module")
def model(platform):
    return platform.model(vehicles="U06", band=(24, 40), motion="prescribed")


def test_the_lines_of_the_readme(model):
    space = model.design_space(bounds=0.20, tolerance=0.15)
    robust = deboom.Robust(model, space, draws=16, seed=1)
    front = deboom.search(robust, population=8, generations=3, seed=1, verified_with=32)
    optimum = minimize(deboom.RobustProblem(robust), NSGA2(8), ("n_gen", 3), seed=1)
    plain = deboom.search(
        robust, population=8, generations=3, seed=1, verified_with=32, polish=False, shown=None
    )
    assert optimum.F.min(axis=0) == pytest.approx(plain.searched.objectives.min(axis=0))
    assert np.all(front.searched.objectives.min(axis=0) < optimum.F.min(axis=0))  # by gradient
    mean = "mean per line and vehicle [dB(A)]"
    share = front.table[mean] * model.n_lines * len(model.response_names)
    assert share.to_numpy() == pytest.approx(front.table["SPLV mean sum [dB(A)]"].to_numpy())
    assert "<table" in front._repr_html_()
    assert deboom.verify(front, draws=32, seed=1).table.shape[0] == len(front.table)
    other = deboom.search(robust, population=8, generations=3, seed=2, verified_with=32)
    assert deboom.compare(front, other, draws=32).value == pytest.approx(
        -deboom.compare(other, front, draws=32).value
    )


def test_weights_of_load_cases_are_those_of_their_names(platform):
    """A mean of two load cases, 3 to 1: as text, and as a mapping."""
    first, second = (case.name for case in platform.load_cases[:2])
    band = {"vehicles": "U06", "band": (24, 26), "motion": "prescribed"}
    by_name, by_text = (
        platform.model(load_cases=cases, **band)
        for cases in ({first: 3, second: 1}, [f"{first}=3", second])
    )
    design = np.full((1, 12), 0.9)
    assert by_name.load_case_names == (first, second)
    assert by_name(design).tolist() == by_text(design).tolist()
    assert by_name(design) != pytest.approx(
        platform.model(load_cases=[first, second], **band)(design)
    )
    alone = platform.model(load_cases=first, **band)
    assert alone.load_case_names == (first,)
    with pytest.raises(deboom.InputError, match=f"load case '{first}=-1'"):
        platform.model(load_cases={first: -1}, **band)


@pytest.mark.parametrize("motion", ["prescribed", "coupled", "amplitude"])
def test_paths_add_up_to_the_pressure(platform, motion):
    model = platform.model(vehicles=["U06-2", "F39-1"], band=(24, 30), motion=motion)
    design = np.linspace(0.8, 1.2, 12)
    paths = model.paths(design, "F39-1")
    assert paths.pressure == pytest.approx(model.pressure([design])[0, 1], rel=1e-12)
    assert paths.table["share of the energy [%]"].sum() == pytest.approx(100)


def test_doe_correlation_and_sensitivities(model):
    space = model.design_space()
    experiment = deboom.doe(model, space, n=32)
    total = model(experiment.doe.designs).sum(axis=1)
    assert experiment.table["sum [dB(A)]"].to_numpy() == pytest.approx(total)
    per_line = experiment.table["mean per line [dB(A)]"].to_numpy() * 5 * model.n_lines
    assert per_line == pytest.approx(total)
    table = deboom.correlation(experiment, resamples=100).to_frame()
    assert (table["pearson from [1]"] <= table["pearson [1]"]).all()
    sobol = deboom.sobol(model, space, n=32)
    assert sobol.problem["num_vars"] == space.n_variables
    assert len(sobol.table) == space.n_variables * (len(model.response_names) + 1)  # and their sum
    effects = deboom.morris(model, space, trajectories=4).table
    assert (effects["mu* per line [dB(A)]"] * model.n_lines).to_numpy() == pytest.approx(
        effects["mu* [dB(A)]"].to_numpy()
    )


def test_a_regressor_of_scikit_learn_gives_a_front_in_twelve_lines(model):
    space = model.design_space()
    doe = deboom.doe(model, space, n=64).doe
    regressor = GaussianProcessRegressor(normalize_y=True).fit(doe.designs, doe.responses)
    foreign = deboom.ResponseFunction(
        regressor.predict, model.variable_names, model.response_names, "dB(A)", model.n_lines
    )
    robust = deboom.Robust(foreign, space, draws=16)
    front = deboom.search(robust, population=8, generations=2, verified_with=32)
    assert front.per_line == pytest.approx(1 / (5 * model.n_lines))
    assert "<table" in front.to_frame().to_html()
    front.picture()


BAD_MODELS = [
    ({"motion": "couple"}, "motion 'couple' is unknown: did you mean 'coupled'"),
    ({"mounts": "nothing"}, "mounts 'nothing' is unknown: use one of library"),
    ({"vehicles": "U99"}, "vehicle 'U99' is unknown"),
    ({"vehicles": ["U06-1", "U06-7"]}, "vehicle 'U06-7' is unknown: did you mean"),
    ({"band": (200, 300)}, "band from 200 to 300 Hz is not inside the measured 20 to 80 Hz"),
    ({"band": (10, 40)}, "band from 10 to 40 Hz is not inside"),
    ({"band": (40, 24)}, "band from 40 to 24 Hz is not inside"),
    ({"load_cases": ["g9"]}, "g9"),
]


@pytest.mark.parametrize(("changes", "sentence"), BAD_MODELS)
def test_wrong_words_get_a_sentence(platform, changes, sentence):
    with pytest.raises(deboom.InputError, match=sentence):
        platform.model(**changes)


SPACE = deboom.DesignSpace(("a", "b"), ("1", "1"), [1, 1], [0.8, 0.8], [1.2, 1.2], [0.1, 0.1])
FITTED = LinearRegression().fit(np.eye(3), np.eye(3)[:, :2])


def _foreign(function, names=("y", "z")):
    return deboom.ResponseFunction(function, SPACE.names, names, "dB")


BARE = LinearRegression().fit(np.eye(2), np.eye(2))
OF_THREE = _foreign(FITTED.predict)
WIDE = _foreign(lambda x: np.ones((len(x), 3)))
CONSTANT = _foreign(lambda x: np.ones((len(x), 2)))
NOT_A_NUMBER = _foreign(lambda x: np.full((len(x), 2), np.nan))


@pytest.mark.parametrize(
    ("model", "sentence"),
    [
        (BARE, "LinearRegression has no variable_names"),
        (lambda x: x, "function has no variable_names"),
        (OF_THREE, "LinearRegression is expecting 3 features"),
        (WIDE, r"shape \(\d+, 3\)"),
        (deboom.ResponseFunction(lambda x: x, ("a", "c"), ("y", "z"), "dB"), "'c'"),
    ],
    ids=["bare regressor", "bare function", "three features", "three responses", "other names"],
)
@pytest.mark.parametrize(
    "use",
    [
        lambda model: deboom.search(deboom.Robust(model, SPACE, draws=8), generations=1),
        lambda model: deboom.doe(model, SPACE, n=16),
        lambda model: deboom.sobol(model, SPACE, n=16),
        lambda model: deboom.morris(model, SPACE, trajectories=4),
    ],
    ids=["search", "doe", "sobol", "morris"],
)
def test_models_that_do_not_fit_get_a_sentence(model, sentence, use):
    with pytest.raises(deboom.InputError, match=sentence):
        use(model)


@pytest.mark.parametrize(
    ("use", "sentence"),
    [
        (lambda: deboom.sobol(CONSTANT, SPACE, n=16), "'y'"),
        (lambda: deboom.morris(CONSTANT, SPACE, trajectories=4), "'y'"),
        (lambda: deboom.correlation(deboom.doe(CONSTANT, SPACE, n=16)), "'y'|y "),
        (lambda: deboom.sobol(NOT_A_NUMBER, SPACE, n=16), "finite"),
        (lambda: deboom.morris(NOT_A_NUMBER, SPACE, trajectories=4), "finite"),
        (lambda: deboom.correlation(deboom.doe(NOT_A_NUMBER, SPACE, n=16)), "0 design"),
        (lambda: deboom.search(deboom.Robust(NOT_A_NUMBER, SPACE, draws=8)), "first generation"),
        (lambda: deboom.Robust(CONSTANT, SPACE, draws=100), "power of two"),
        (lambda: deboom.search(deboom.Robust(CONSTANT, SPACE), seed=0), "seed 0"),
        (lambda: deboom.allocate_tolerances(deboom.Robust(CONSTANT, SPACE), [1, 1]), "gradient"),
        (lambda: deboom.BoxQuestion(CONSTANT, [1, 1], 0.9, [0.8] * 2, [1.2] * 2), "gradient"),
    ],
)
def test_responses_that_say_nothing_get_a_sentence(use, sentence):
    with pytest.raises(deboom.InputError, match=sentence):
        use()


def test_unknown_names_are_no_attribute():
    with pytest.raises(AttributeError, match="serach"):
        _ = deboom.serach
