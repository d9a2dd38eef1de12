"""Levels of vehicles as objectives and limits: loudest lines by hand, bounds in SPLV."""

from dataclasses import dataclass

import numpy as np
import pytest

import deboom
from deboom.choices import LevelStatistic
from deboom.errors import InputError
from deboom.explore.space import stiffness_factor_space
from deboom.vehicles.level_objectives import LoudestLine, level_limits, level_objective


@dataclass(frozen=True)
class TwoLines:
    """Two vehicles, two lines and two load cases; a level is a share of the one factor."""

    variable_names = ("a x",)
    response_names = ("sedan", "tourer")
    response_unit = "dB(A)"
    load_case_names = ("slow", "fast")
    n_lines = 2

    def levels(self, designs, case):
        """Return the levels, shape (n, 2, 2)."""
        shares = {"slow": [[1.0, 5.0], [2.0, 3.0]], "fast": [[4.0, 2.0], [6.0, 1.0]]}[case]
        return np.asarray(designs)[:, :, np.newaxis] * np.array(shares)

    def __call__(self, designs):
        """Return the sums over the lines of the slow case, shape (n, 2)."""
        return self.levels(designs, "slow").sum(axis=2)


MODEL = TwoLines()
SPACE = stiffness_factor_space(MODEL.variable_names, 0.2, 0.1)


def test_the_loudest_line_is_that_of_all_load_cases():
    designs = np.array([[1.0], [2.0]])
    line = LoudestLine(MODEL, MODEL.response_names)
    np.testing.assert_array_equal(line(designs), [[5.0, 6.0], [10.0, 12.0]])
    np.testing.assert_array_equal(LoudestLine(MODEL, ("tourer",))(designs), [[6.0], [12.0]])


@pytest.mark.parametrize(
    ("statistic", "vehicle", "name", "number"),
    [
        ("mean", "tourer", "mean of SPLV, tourer", 5.0),
        ("mean", None, "mean of SPLV, worst vehicle", 6.0),
        ("peak", "sedan", "mean of the loudest line, sedan", 5.0),
        ("peak", None, "mean of the loudest line, worst vehicle", 6.0),
    ],
)
def test_numbers_of_a_design_without_scatter(statistic, vehicle, name, number):
    exact = stiffness_factor_space(MODEL.variable_names, 0.2, 0.0)
    objective = level_objective(MODEL, LevelStatistic(statistic), vehicle)
    robust = deboom.Robust(MODEL, exact, draws=8, objectives=[objective, deboom.Objective("sigma")])
    assert robust([[1.0]]).objectives[0, 0] == pytest.approx(number, rel=1e-14)
    assert robust.objective_labels[0] == f"{name} [dB(A)]"


def test_bounds_are_of_the_mean_over_lines_and_todays_of_each_vehicle():
    limits = [
        *level_limits(MODEL, LevelStatistic.mean, 2.5, "tourer"),
        *level_limits(MODEL, LevelStatistic.mean, "today"),
        *level_limits(MODEL, LevelStatistic.peak, 7.0),
        *level_limits(MODEL, LevelStatistic.sigma, 0.1, "sedan"),
    ]
    robust = deboom.Robust(MODEL, SPACE, draws=64, limits=limits)
    values = robust([[1.0], [1.01], [1.25]])
    stated = robust.limits.responses(values.excess)
    np.testing.assert_allclose(stated[:, 0], values.mean[:, 1], rtol=1e-14)
    assert [limit.at_most for limit in robust.limits.limits][:1] == [5.0]
    np.testing.assert_array_equal(values.excess[0, 1:3], [0.0, 0.0])
    assert (values.excess[1, :3] > 0.0).all()
    np.testing.assert_array_equal(values.excess[:, 3] > 0.0, [False, False, True])
    assert robust.limits.limits[3].response == "mean of the loudest line, worst vehicle"
    assert (robust.limits.limits[4].at_most, robust.limits.limits[4].unit) == (0.2, "dB")


def test_a_vehicle_that_there_is_not_is_refused():
    with pytest.raises(InputError, match=r"no vehicle 'van': use one of sedan, tourer"):
        level_objective(MODEL, LevelStatistic.mean, "van")
