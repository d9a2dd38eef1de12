"""Levels of vehicles as objectives and limits: loudest lines by hand, bounds in SPLV."""

from dataclasses import dataclass

import numpy as np
import pytest

import deboom
from deboom.errors import InputError
from deboom.explore.descent import Gradients, gradients_of, objectives_and_gradients
from deboom.explore.moments import STATISTICS, Statistic
from deboom.explore.space import stiffness_factor_space
from deboom.files.design_limits import read_level_limits
from deboom.runs.options import AimOptions, aims
from deboom.vehicles.level_objectives import LoudestLine, level_limits, level_objective
from deboom.vehicles.receivers import Receiver


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
    objective = level_objective(MODEL, statistic, vehicle)
    robust = deboom.Robust(MODEL, exact, draws=8, objectives=[objective, deboom.Objective("sigma")])
    assert robust([[1.0]]).objectives[0, 0] == pytest.approx(number, rel=1e-14)
    assert robust.objective_labels[0] == f"{name} [dB(A)]"


def test_bounds_are_of_the_mean_over_lines_and_todays_of_each_vehicle():
    limits = [
        *level_limits(MODEL, "mean", 2.5, "tourer"),
        *level_limits(MODEL, "mean", "today"),
        *level_limits(MODEL, "peak", 7.0),
        *level_limits(MODEL, "sigma", 0.1, "sedan"),
    ]
    robust = deboom.Robust(MODEL, SPACE, draws=64, limits=limits)
    values = robust([[1.0], [1.01], [1.25]])
    stated = robust.limits.numbers(values.excess)
    np.testing.assert_allclose(stated[:, 0], values.mean[:, 1], rtol=1e-14)
    assert [limit.at_most for limit in robust.limits.limits][:1] == [5.0]
    np.testing.assert_array_equal(values.excess[0, 1:3], [0.0, 0.0])
    assert (values.excess[1, :3] > 0.0).all()
    np.testing.assert_array_equal(values.excess[:, 3] > 0.0, [False, False, True])
    assert robust.limits.limits[3].number.name == "mean of the loudest line, worst vehicle"
    assert (robust.limits.limits[4].at_most, robust.limits.limits[4].number.unit) == (0.2, "dB")


def test_a_limit_of_a_level_that_no_design_keeps_is_told_in_decibels_with_its_place(tmp_path):
    """The two lines of the tourer are 2.5 dB(A) on average at factor 1, and 2 at the lowest."""
    path = tmp_path / "limits.toml"
    path.write_text(
        "format = 1\n[[level]]\nat_most_db = 9.0\nstatistic = 'peak'\n"
        "[[level]]\nat_most_db = 1.25\nvehicle = 'tourer'\n"
    )
    exact = stiffness_factor_space(MODEL.variable_names, 0.2, 0.0)
    robust = deboom.Robust(MODEL, exact, draws=8, limits=read_level_limits(path, MODEL))
    excess = robust([[0.8], [1.0]]).excess
    np.testing.assert_allclose(excess[:, 1], [4.0 - 2.5, 5.0 - 2.5])  # of the sum, as ever
    assert robust.limits.closest(excess) == (
        "the closest one misses 'mean of SPLV over 2 lines, tourer, at most 1.25 dB(A) per line' "
        "(limits.toml, [[level]] 2) by 0.75 dB(A) (it has 2 dB(A))"
    )


def test_a_vehicle_that_there_is_not_is_refused():
    with pytest.raises(InputError, match=r"no vehicle 'van': use one of sedan, tourer"):
        level_objective(MODEL, "mean", "van")


def test_a_statistic_that_there_is_not_is_refused_wherever_one_is_written(tmp_path):
    known = "mean, sigma, quantile, tail, peak"
    with pytest.raises(InputError, match=f"'range' is no statistic: take one of {known}"):
        level_objective(MODEL, "range")
    with pytest.raises(InputError, match=f"--also range: .* one of {known}"):
        AimOptions(also=["range"]).objectives(MODEL)
    with pytest.raises(InputError, match=r"--objective sigma: .*mean, quantile, tail, worst$"):
        AimOptions(objective="sigma")
    with pytest.raises(InputError, match="no statistic 'range': take mean, sigma, quantile, tail "):
        deboom.Objective("range")
    path = tmp_path / "limits.toml"
    path.write_text("format = 1\n[[level]]\nstatistic = 'range'\nat_most_db = 2.0\n")
    with pytest.raises(InputError, match=rf"limits.toml.*'range' is no statistic.*{known}"):
        read_level_limits(path, MODEL)


class SlopedLines(TwoLines):
    """The same with exact derivatives, and the square of the factor beside it."""

    is_linearisable = True

    def __call__(self, designs):
        """Return the responses, shape (n, 2)."""
        designs = np.asarray(designs)
        return np.hstack([designs, 3.0 * designs**2])

    def linearised(self, designs):
        """Return the responses and the pull-back of weights."""

        def pull_back(weights):
            slopes = np.hstack([np.ones_like(designs), 6.0 * designs])
            return (weights * slopes).sum(axis=2, keepdims=True)

        return self(designs), pull_back


def test_a_new_statistic_is_one_entry(monkeypatch, tmp_path):
    """With it, objectives, files of limits, options and descents along gradients have it."""
    two_sigma = Statistic(
        "mean and two sigma",
        lambda draws, _: draws.mean + 2.0 * draws.sigma,
        by_draw=lambda slopes: slopes.by_mean[:, np.newaxis] + 2.0 * slopes.by_sigma,
        short="two-sigma",
    )
    monkeypatch.setitem(STATISTICS, "mean and two sigma", two_sigma)
    path = tmp_path / "limits.toml"
    path.write_text(
        "format = 1\n[[level]]\nstatistic = 'two-sigma'\nat_most_db = 'today'\nvehicle = 'sedan'\n"
    )
    model = SlopedLines()
    options = AimOptions(objective="two-sigma", also=["two-sigma=tourer"])
    robust = deboom.Robust(
        model,
        SPACE,
        draws=64,
        objectives=options.objectives(model),
        limits=read_level_limits(path, model),
    )
    design = np.array([1.02])
    values, today = robust(design[np.newaxis]), robust(SPACE.nominal[np.newaxis])
    upper = values.mean + 2.0 * values.sigma
    np.testing.assert_allclose(values.objectives[0, [0, 2]], [upper.sum(), upper[0, 1]], rtol=1e-14)
    assert robust.objective_labels[2] == "mean and two sigma of SPLV, tourer [dB(A)]"
    allowed = today.mean[0, 0] + 2.0 * today.sigma[0, 0]
    np.testing.assert_allclose(values.excess[0], upper[0, 0] - allowed, rtol=1e-12)
    smooth = deboom.Robust(model, SPACE, draws=64, objectives=aims()["two-sigma"])
    assert gradients_of(smooth) is Gradients.exact
    assert smooth.begins_with_level_and_sigma
    step = 1e-5
    around = smooth(design + np.array([[-step], [step]])).objectives
    _, gradients = objectives_and_gradients(smooth, design)
    np.testing.assert_allclose(gradients[:, 0], np.diff(around, axis=0)[0] / (2 * step), rtol=1e-7)


@dataclass(frozen=True)
class WithSeat(TwoLines):
    """The same with a seat rail that vibrates at a larger level than either vehicle is loud."""

    response_names = ("sedan", "sedan, seat rail z", "tourer")
    response_unit = "dB(A), dB(Wk) re 1 µm/s², dB(A)"
    response_weights = np.array([1.0, 0.0, 1.0])
    receivers = (
        Receiver(),
        Receiver("seat rail z", "acceleration", "Wk", target=90.0),
        Receiver(),
    )

    def levels(self, designs, case):
        """Return the levels, shape (n, 3, 2)."""
        sedan, tourer = np.moveaxis(super().levels(designs, case), 1, 0)
        return np.stack([sedan, 100.0 * sedan, tourer], axis=1)

    def __call__(self, designs):
        """Return the sums over the lines of the slow case, shape (n, 3)."""
        return self.levels(designs, "slow").sum(axis=2)


SEAT = WithSeat()


def test_a_vibration_is_in_no_sum_and_is_never_the_worst_vehicle():
    exact = stiffness_factor_space(MODEL.variable_names, 0.2, 0.0)
    worst = level_objective(SEAT, "peak")
    own = level_objective(SEAT, "mean", "sedan, seat rail z")
    objectives = [deboom.Objective("mean"), deboom.Objective("sigma"), worst, own]
    objectives.append(deboom.Objective("mean", worst=True))
    robust = deboom.Robust(SEAT, exact, draws=8, objectives=objectives)
    total, _, peak, seat, loudest = robust([[1.0]]).objectives[0]
    # weights of mean 1 over three responses: 1.5 of both vehicles
    assert total == pytest.approx(1.5 * (6.0 + 5.0))
    assert (peak, seat, loudest) == pytest.approx((6.0, 600.0, 6.0))
    assert robust.unit_of(own) == "dB(Wk) re 1 µm/s²"
    assert robust.sum_unit == "dB(A)"
    with pytest.raises(InputError, match=r"adds or compares responses in dB\(A\) and dB\(Wk\)"):
        deboom.Robust(SEAT, exact, draws=8, weights=[1.0, 1.0, 1.0])


def test_limits_without_a_vehicle_are_of_ears_and_targets_of_their_receivers():
    ears = level_limits(SEAT, "mean", "today")
    assert [limit.number.response for limit in ears] == ["sedan", "tourer"]
    (seat,) = level_limits(SEAT, "mean", "today", "sedan, seat rail z")
    assert seat.number.response == "sedan, seat rail z"
    (target,) = level_limits(SEAT, "mean", "target")
    assert (target.number.response, target.at_most, target.n_lines) == (
        "sedan, seat rail z",
        180.0,
        2,
    )
    with pytest.raises(InputError, match="tourer has no target: state its target_db"):
        level_limits(SEAT, "mean", "target", "tourer")
    with pytest.raises(InputError, match="no receiver has a target"):
        level_limits(MODEL, "mean", "target")


def test_weights_of_options_keep_those_of_the_receivers():
    assert AimOptions(weight=["tourer=3"]).weights(SEAT) == [1.0, 0.0, 3.0]
    assert AimOptions().weights(SEAT) is None
