"""The file that says how parts scatter, and what a study makes of it."""

from pathlib import Path

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.explore.space import stiffness_factor_space
from deboom.files.library_export import read_library_json
from deboom.files.made_parts import made_parts
from deboom.mounts.library import open_library
from deboom.mounts.part_scatter import ENOUGH, ScatterPrior, direction_scatter
from deboom.pages.front import report_parts
from deboom.report import Report

SHIPPED = Path(__file__).parents[2] / "studies" / "data"
NAMES = tuple(f"{mount} {axis}" for mount in ("TSM", "Du") for axis in "xyz")
SPACE = stiffness_factor_space(NAMES)


def written(tmp_path, text):
    path = tmp_path / "parts.toml"
    path.write_text(f"format = 1\n{text}", encoding="utf-8")
    return path


def correlation(structure):
    return structure.loadings @ structure.loadings.T


def test_without_a_file_nothing_changes():
    made = made_parts(None, SPACE)
    assert made.space is SPACE
    assert made.structure is None
    assert made.n_draws == 6
    report = Report("Front")
    report_parts(report, made)
    assert (report.sections, report.tables) == ([], {})


def test_the_shipped_file_is_what_it_says():
    made = made_parts(SHIPPED / "u06_parts.toml", SPACE)
    correlations = correlation(made.structure)
    assert correlations[0, 1] == pytest.approx(0.6)
    np.testing.assert_allclose(np.diag(correlations), [1, 1, 1, 0.75, 0.75, 0.75])
    assert "87 % of the tolerance of one" in made.text
    assert made.inputs == (SHIPPED / "u06_parts.toml",)


def test_a_part_number_has_shares_of_its_own_and_a_variable_its_tolerance(tmp_path):
    path = written(
        tmp_path,
        """hardness_share = 0.2
[[parts]]
number = "bush"
places = ["TSM", "Du"]
hardness_share = 0.5
batch_share = 0.4
[[tolerances]]
variable = "TSM x"
tolerance = 0.09
""",
    )
    made = made_parts(path, SPACE)
    correlations = correlation(made.structure)
    assert (correlations[0, 1], correlations[0, 3], correlations[0, 4]) == pytest.approx(
        (0.5, 0.4, 0.2)
    )
    assert made.space.tolerance.tolist() == [0.09, 0.15, 0.15, 0.15, 0.15, 0.15]
    assert made.table["tolerance ± [%]"][0] == pytest.approx(9.0)


def test_the_tolerance_comes_from_a_library(tmp_path):
    """The shipped library has one part of each mount: the prior alone, three sigma of it."""
    library = SHIPPED / "u06_f39_f45" / "mounts.library.json"
    path = written(tmp_path, f'[measured]\nlibrary = "{library.as_posix()}"\nprior_sigma = 0.04\n')
    made = made_parts(path, SPACE)
    np.testing.assert_allclose(made.space.tolerance, 0.12)
    assert made.inputs == (path, library)
    note = "assumed: not identified in every part, or fewer than two parts"
    assert set(made.table["note"]) == {note}
    assert made.table["to [%]"][0] > made.table["sigma measured [%]"][0]


def test_a_library_may_be_its_database(tmp_path):
    campaigns, mounts = read_library_json(SHIPPED / "u06_f39_f45" / "mounts.library.json")
    with open_library(tmp_path / "mounts.db", create=True) as library:
        library.add(campaigns, mounts)
    path = written(tmp_path, '[measured]\nlibrary = "mounts.db"\n')
    assert made_parts(path, SPACE).scatter.direction("TSM x").sigma == pytest.approx(0.05)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("hardness_share = 1.5\n", "hardness_share"),
        ("[[parts]]\nnumber = 'a'\nplaces = []\n", "places"),
        ("[[parts]]\nnumber = 'a'\nplaces = ['Q']\n", "sits at 'Q', which no variable has"),
        (
            "[[parts]]\nnumber='a'\nplaces=['Du']\n[[parts]]\nnumber='b'\nplaces=['Du']\n",
            "part numbers 'a' and 'b'",
        ),
        (
            "[[parts]]\nnumber='a'\nplaces=['Du']\n[[parts]]\nnumber='a'\nplaces=['TSM']\n",
            "have the number 'a': keep or rename one",
        ),
        ("[[tolerances]]\nvariable = 'Q x'\ntolerance = 0.1\n", "'Q x', which is no variable"),
        ("[[tolerances]]\nvariable='Du x'\ntolerance=0.1\n" * 2, "are of the variable 'Du x'"),
        ("[measured]\nlibrary = 'gone.json'\n", "gone.json"),
    ],
)
def test_a_bad_file_is_refused_by_name(tmp_path, text, words):
    path = written(tmp_path, text)
    with pytest.raises(InputError, match=words) as error:
        made_parts(path, SPACE)
    assert str(path.parent) in str(error.value)


def test_the_variance_of_measuring_is_no_scatter_of_parts():
    """One part tells nothing: the assumption stays. Of enough parts the rest is their variance."""
    alone = direction_scatter("x", np.array([0.1]), np.array([0.07]), prior=ScatterPrior(0.05))
    np.testing.assert_allclose(alone.sigma, 0.05, rtol=1e-12)
    values = 0.05 * np.where(np.arange(ENOUGH) % 2, 1.0, -1.0)
    many = direction_scatter("x", values, np.full(ENOUGH, 0.03))
    observed = 0.05**2 * ENOUGH / (ENOUGH - 1)
    np.testing.assert_allclose([many.observed, many.measurement], [observed**0.5, 0.03], rtol=1e-12)
    np.testing.assert_allclose(many.sigma, (observed - 0.03**2) ** 0.5, rtol=1e-12)
    without_error = direction_scatter("x", values)
    np.testing.assert_allclose(without_error.sigma, observed**0.5, rtol=1e-12)
    bounds = [each**2 + 0.03**2 for each in (many.lower, many.upper)]
    np.testing.assert_allclose(bounds, [without_error.lower**2, without_error.upper**2], rtol=1e-12)
