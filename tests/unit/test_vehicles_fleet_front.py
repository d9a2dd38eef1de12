"""Cars as made: how many keep a level, and which level most of them keep."""

import numpy as np
import pytest
from scipy.stats import norm

import deboom
from deboom.errors import InputError
from deboom.measurement.booming_peaks import compare_peaks
from deboom.pages.front_answer import MOST_ROWS, peaks_sentence, vehicle_table
from deboom.runs.search import peak_rise_limits
from deboom.vehicles.fleet_front import CarLevels, FleetFront


def test_shares_and_percentiles_are_those_of_a_normal_scatter():
    places = norm.ppf((np.arange(4000) + 0.5) / 4000)
    cars = CarLevels(("a", "b"), np.stack([50.0 + places, 60.0 + 2.0 * places], axis=1))
    np.testing.assert_allclose(cars.share_within([50.0, 62.0]), [0.5, norm.cdf(1.0)], atol=5e-4)
    np.testing.assert_allclose(cars.share_within(61.0), [1.0, norm.cdf(0.5)], atol=5e-4)
    np.testing.assert_allclose(cars.percentile(), [51.645, 63.290], atol=5e-3)
    with pytest.raises(InputError, match="levels"):
        CarLevels(("a",), [[1.0, 2.0]])


@pytest.fixture(scope="module")
def fleet():
    model = deboom.ResponseFunction(lambda x: 50.0 + 10.0 * x, ("k",), ("a",), "dB(A)")
    robust = deboom.Robust(model, model.design_space(bounds=0.2, tolerance=0.15), draws=16)
    front = deboom.search(robust, generations=2, population=8, seed=1)
    return FleetFront(front, order=2.0)


def test_the_cars_are_those_of_all_draws_that_verify_and_today_is_as_drawn(fleet):
    cars = fleet.cars(np.array([1.0]))
    assert cars.levels.shape == (fleet.n_cars, 1)
    assert fleet.todays_levels == pytest.approx([60.0])
    assert cars.share_within(fleet.todays_levels)[0] == pytest.approx(0.5, abs=0.01)
    # σ of the stiffness is a third of the tolerance, the level rises by 10 dB per unit
    assert cars.percentile()[0] == pytest.approx(60.0 + norm.ppf(0.95) * 0.5, abs=0.02)


class TwoPeaks:
    """A model of one vehicle with two peaks; each variable moves one of them."""

    variable_names, response_names = ("a", "b"), ("car",)
    response_unit, n_lines, load_case_names = "dB(A)", 1, ("run",)
    frequency = np.arange(20.0, 41.0)

    def levels(self, designs, case=None):
        """Draw both peaks."""
        assert case in (None, "run")
        shape = [np.exp(-0.5 * ((self.frequency - place) / 1.5) ** 2) for place in (25.0, 35.0)]
        factor = np.asarray(designs)
        return (
            30.0
            + 20.0
            * np.stack([factor[:, k, None] * shape[k] for k in (0, 1)]).sum(axis=0)[:, np.newaxis]
        )

    def __call__(self, designs):
        """Weigh the first peak more."""
        return np.asarray(designs) @ np.array([[3.0], [1.0]])


def test_none_louder_makes_no_peak_louder():
    model = TwoPeaks()
    space = deboom.DesignSpace(
        ("a", "b"), ("1", "1"), *np.array([[1, 1], [0.8, 0.8], [1.2, 1.2], [0.1, 0.1]])
    )
    front = deboom.search(
        deboom.Robust(model, space, draws=16), generations=3, population=12, seed=1
    )
    heard = FleetFront.keeping_peaks(front)
    designs = np.array([[0.9, 0.95], [0.8, 1.1]])
    np.testing.assert_allclose(heard.peak_rise(designs), [-1.0, 2.0], atol=1e-6)
    kept = heard.front.pick_designs["none-louder"]
    assert heard.peak_rise(kept[np.newaxis])[0] <= 0.01
    (limit,) = peak_rise_limits(0.0, model, space.nominal)
    robust = deboom.Robust(model, space, draws=16, limits=[limit])
    limited = limit.number.response
    searched = deboom.search(robust, generations=3, population=12, seed=1)
    assert limited(searched.values.designs).max() <= 1e-9
    assert limited(np.array([[0.8, 1.1]])) == pytest.approx(2.0)
    told = robust.limits.closest(np.array([[2.0]]))
    assert f"'{limited.response_names[0]} at most 0 dB' (--peak-rise 0) by 2 dB" in told
    without = FleetFront(front, order=2.0).front.picks
    assert without["best-mean"] == heard.front.picks["best-mean"]


def test_means_of_some_vehicles_are_weighted_among_these():
    model = deboom.ResponseFunction(
        lambda x: x * [1.0, 2.0, 3.0, 4.0], ("k",), ("a", "b", "c", "d"), "dB(A)"
    )
    levels = np.array([[10.0, 20.0, 30.0, 50.0], [1.0, 2.0, 3.0, 5.0]])
    for weights, whole, first_three, first_two in (
        (None, [27.5, 2.75], [20.0, 2.0], [15.0, 1.5]),
        ([0, 0, 1, 3], [45.0, 4.5], [30.0, 3.0], [15.0, 1.5]),
    ):
        robust = deboom.Robust(model, model.design_space(), draws=16, weights=weights)
        front = deboom.search(robust, generations=1, population=4, verified_with=16, polish=False)
        fleet = FleetFront(front, order=2.0)
        np.testing.assert_allclose(fleet.mean(levels), whole, rtol=1e-14)
        np.testing.assert_allclose(fleet.mean(levels, [0, 1, 2]), first_three, rtol=1e-14)
        np.testing.assert_allclose(fleet.mean(levels, [0, 1]), first_two, rtol=1e-14)


class Fleet:
    """A model of flat levels, 60 dB(A) today, which rise with the one factor by a slope each."""

    variable_names, response_unit, load_case_names = ("k",), "dB(A)", ("run",)
    frequency = np.arange(20.0, 23.0)
    n_lines = frequency.size

    def __init__(self, slopes):
        self.slopes = np.array(slopes)
        self.response_names = tuple(f"car {number}" for number in range(self.slopes.size))

    def levels(self, designs, case=None):
        """Draw each vehicle alike at all lines."""
        assert case in (None, "run")
        each = 60.0 + (np.asarray(designs) - 1.0) * self.slopes
        return np.repeat(each[..., np.newaxis], self.n_lines, axis=-1)

    def __call__(self, designs):
        """Sum the lines."""
        return self.levels(designs).sum(axis=-1)


@pytest.mark.parametrize("beyond", [0, 3])
def test_the_first_screen_shows_the_vehicles_that_gain_least_and_the_mean_of_all(beyond):
    slopes = np.linspace(-2.0, 12.0, MOST_ROWS + beyond)[::-1]  # the first gain most
    model = Fleet(slopes)
    space = deboom.DesignSpace(("k",), ("1",), *np.array([[1.0], [0.8], [1.2], [0.1]]))
    robust = deboom.Robust(model, space, draws=16)
    front = deboom.search(robust, generations=1, population=4, verified_with=16, polish=False)
    table = vehicle_table(
        FleetFront(front, order=2.0), np.array([0.8]), target=np.full(slopes.size, 60.0)
    )
    assert list(table["vehicle"]) == [*model.response_names[beyond:], "mean"]
    change = table["change [dB]"].to_numpy()
    # the mean of few draws of the factor is not quite the factor
    np.testing.assert_allclose(change[:-1], -0.2 * slopes[beyond:], rtol=2e-3)
    assert change[-1] == pytest.approx(-0.2 * slopes.mean(), rel=2e-3)


def test_only_todays_peaks_and_louder_new_ones_count():
    lines = np.arange(20.0, 41.0)

    def curve(boom, right):
        return np.interp(lines, [20.0, 25.0, 30.0, 35.0, 40.0], [50.0, boom, 58.0, right, 50.0])

    today, quieter, louder = curve(70.0, 62.0), curve(66.0, 65.0), curve(66.0, 59.0)
    (only,) = compare_peaks(today, louder, lines, 2.0)
    assert only.counts
    boom, new = compare_peaks(today, quieter, lines, 2.0)
    assert (boom.change, new.before, new.change, new.counts) == (-4.0, None, 3.0, True)
    # where today is louder than the new peak, it is what remains and no boom that appeared
    high = np.where(lines > 30.0, 66.0, today)
    _, remains = compare_peaks(high, quieter, lines, 2.0)
    assert (remains.before, remains.change, remains.counts) == (None, -1.0, False)


@pytest.mark.parametrize(
    ("right", "words"),
    [
        (59.0, "today's booming peak changes by −4.0 dB"),
        (
            65.0,
            "one booming peak becomes louder than today, most of all car at 35 Hz, by 3.0 dB; "
            "today there are 1",
        ),
    ],
)
def test_the_sentence_on_peaks_counts_those_of_today(right, words):
    lines = np.arange(20.0, 41.0)
    levels = [
        np.interp(lines, [20.0, 25.0, 30.0, 35.0, 40.0], [50.0, boom, 58.0, side, 50.0])
        for boom, side in ((70.0, 62.0), (66.0, right))
    ]
    assert peaks_sentence({"car": compare_peaks(*levels, lines, 2.0)}) == words


def test_peaks_that_change_alike_are_told_by_one_number():
    lines = np.arange(20.0, 41.0)
    levels = [np.interp(lines, [20.0, 25.0, 40.0], [50.0, boom, 50.0]) for boom in (70.0, 69.5)]
    changes = dict.fromkeys(("car", "other"), compare_peaks(*levels, lines, 2.0))
    assert peaks_sentence(changes) == "today's 2 booming peaks change by −0.5 dB"
