"""What tolerances are verified to reach, by the formulas written out, and what parts share."""

from types import SimpleNamespace

import numpy as np
import pytest

import deboom
from deboom.explore.scatter import PartNumber, part_structure, sobol_sample
from deboom.explore.space import stiffness_factor_space
from deboom.explore.tolerance_allocation import ONE_SIDED_95, ToleranceTask
from deboom.files.made_parts import MadeParts

NAMES = ("a x", "a y")
DRAWS = 256
PURPOSE = "allocation check"


class Levels:
    """Sums over two lines of two vehicles, of which each variable moves one."""

    variable_names = NAMES
    response_names = ("sedan", "tourer")
    response_unit = "dB(A)"
    n_lines = 2

    def __call__(self, designs):
        """Return the sums, shape (n, 2)."""
        return np.column_stack([50.0 * designs[:, 0], 30.0 * designs[:, 1] + 20.0])


MODEL = Levels()


def task(limits):
    robust = deboom.Robust(MODEL, stiffness_factor_space(NAMES, 0.2, 0.15), draws=16)
    allocator = SimpleNamespace(names=("a y",), effect=SimpleNamespace(design=np.array([1.0, 1.1])))
    return ToleranceTask(
        robust=robust,
        allocator=allocator,
        limits=limits,
        sigma=None,
        share=0.95,
        draws=DRAWS,
        seed=3,
    )


def made(tolerance):
    normals = sobol_sample(2, DRAWS, seed=3, purpose=PURPOSE).values
    return MODEL(np.array([1.0, 1.1]) * (1.0 + normals * np.array([0.15, tolerance]) / 3.0))


def test_sigma_is_that_of_draws_with_the_new_tolerances():
    verified = task(None).verified(np.array([0.06]), PURPOSE)
    sigma = made(0.06).std(axis=0, ddof=1).sum() / 4.0
    assert verified.sigma == pytest.approx(sigma, rel=1e-12)
    assert np.isnan(verified.share)


def test_the_share_counts_parts_and_vehicles_and_has_a_lower_bound():
    limits = np.array([51.0, 53.5])
    verified = task(limits).verified(np.array([0.06]), PURPOSE)
    good = (made(0.06) <= limits).mean(axis=1)
    assert verified.share == good.mean()
    error = good.std(ddof=1) / np.sqrt(DRAWS)
    assert verified.share_lower == pytest.approx(good.mean() - ONE_SIDED_95 * error, rel=1e-12)


def test_only_means_of_several_pieces_are_said_to_even_out():
    space = stiffness_factor_space(("Du x", "TSM x"), 0.2, 0.15)
    parts = [PartNumber("1", ("Du",), 4), PartNumber("2", ("TSM",))]
    text = MadeParts(space, part_structure(space.names, parts, 0.0)).text
    assert "Du x: the mean of several pieces, which even out to 50 % of the tolerance" in text
    assert "TSM x" not in text


def test_the_table_counts_no_part_of_a_direction_that_was_not_measured():
    space = stiffness_factor_space(("TSM x", "TSM y"), 0.2, 0.15)
    measured = SimpleNamespace(sigma=0.04, lower=0.03, upper=0.06, n_parts=7, note="")
    scatter = SimpleNamespace(direction={"TSM x": measured}.get)
    table = MadeParts(space, None, scatter).table.set_index("variable")
    assert table["parts"].to_dict() == {"TSM x": 7, "TSM y": 0}
    assert table.loc["TSM x", "sigma measured [%]"] == pytest.approx(4.0)
    assert table.loc["TSM y"].isna()["sigma measured [%]"]
