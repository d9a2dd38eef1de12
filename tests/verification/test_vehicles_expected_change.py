"""Expected changes by draws: against the model where nothing is left open, and what they refuse."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from deboom.bench.layout import LOAD_CASES
from deboom.bench.platform_writer import write_platform
from deboom.errors import InputError
from deboom.files.platform import read_platform
from deboom.files.uncertain_index import uncertain_index
from deboom.mounts.mount import RubberInCar
from deboom.pages.front_answer import model_sentence, report_expected
from deboom.report import Report
from deboom.vehicles import change_prior as prior
from deboom.vehicles import expected_change as expected
from deboom.vehicles.booming_model import CatalogueModel, Motion, booming_model
from deboom.vehicles.expected_change import (
    CarMeasurement,
    Information,
    change_draws,
    expected_change,
    expected_or_why,
    half_width_of_others,
    stated,
    widths_if_measured,
)
from deboom.vehicles.fleet import Fleet
from samples.driven_cars import BAND, CASE, GROUP, coupled_model

RUN = tuple(case for case in LOAD_CASES if case.name == CASE)
PICKS = np.ones((2, 12))
PICKS[0, :10] = [0.8, 1.2, 0.9, 1.1, 0.85, 0.8, 0.9, 1.0, 1.2, 0.8]
PICKS[1, 4] = 1.05


@pytest.fixture(scope="module")
def platform(tmp_path_factory):
    path = tmp_path_factory.mktemp("cars") / "p"
    options = {"load_cases": RUN, "groups": (GROUP,), "family": "attachments", "receptance": True}
    return read_platform(write_platform(path, 11, truth_seed=12, **options))


@pytest.fixture
def certain(monkeypatch):
    """Rubber as in the test, stiffnesses that follow no amplitude."""
    for name in ("RUBBER_TEST", "RUBBER_MOUNT", "SLOPE_SPREAD"):
        monkeypatch.setattr(prior, name, 0.0)
    monkeypatch.setattr(prior, "SLOPE", (1e-12, 1e-12))
    monkeypatch.setattr(expected, "N_DRAWS", dict.fromkeys(Information, 3))


def fleet_of(platform, *, noise=0.0):
    """Return the vehicles with reciprocal receptances."""
    generator, vehicles = np.random.default_rng(1), []
    for vehicle in platform.fleet.vehicles:
        paths = vehicle.receptance.inputs
        frf = vehicle.receptance.select(outputs=paths, inputs=paths)
        values = (frf.values + frf.values.swapaxes(1, 2)) / 2
        parts = generator.standard_normal((2, *values.shape))
        values = values * (1 + noise * (parts[0] + 1j * parts[1]) / np.sqrt(2))
        vehicles.append(replace(vehicle, receptance=replace(frf, values=values)))
    return Fleet(tuple(vehicles))


@pytest.mark.usefixtures("certain")
def test_draws_of_known_bodies_and_rubber_are_the_model(platform):
    fleet = fleet_of(platform)
    model = coupled_model(platform, fleet)
    draws = change_draws(model, [model], fleet, platform.mounts, PICKS)
    levels = model.levels(np.vstack([np.ones(12), PICKS]))
    changes = levels[1:].mean(axis=-1) - levels[:1].mean(axis=-1)
    assert draws.information is Information.receptances
    np.testing.assert_allclose(draws.predicted, changes, atol=1e-9)
    for drawn in draws.drawn:
        np.testing.assert_allclose(drawn, changes, atol=1e-6)
    np.testing.assert_allclose(draws.drawn_peak[0], draws.predicted_peak, atol=1e-6)


@pytest.mark.usefixtures("certain")
def test_losses_as_variables_change_no_draw_where_they_stay(platform):
    fleet = fleet_of(platform)
    data = fleet, platform.mounts, [(platform.load_case(CASE), 1.0)], BAND
    kind = {"motion": Motion.coupled, "powertrain": platform.powertrain}
    plain, split = (booming_model(*data, **kind, loss_factors=loss) for loss in (False, True))
    same = np.hstack([PICKS, np.ones((2, 12))])
    lossy = np.hstack([np.ones((1, 12)), np.full((1, 12), 1.2)])
    of_plain = change_draws(plain, [plain], fleet, platform.mounts, PICKS)
    of_split = change_draws(split, [split], fleet, platform.mounts, np.vstack([same, lossy]))
    np.testing.assert_allclose(of_split.drawn[:, :2], of_plain.drawn, atol=1e-9)
    np.testing.assert_allclose(of_split.drawn[0, 2], of_split.predicted[2], atol=1e-6)
    assert np.all(np.abs(of_split.predicted[2]) > 0.05)


@pytest.fixture(scope="module")
def at_rest(platform):
    """Return fleet and model without receptances, and the data measured again twice."""
    fleet = Fleet(tuple(replace(vehicle, receptance=None) for vehicle in platform.fleet.vehicles))
    model = coupled_model(platform, fleet)
    again = list(uncertain_index(model, replace(platform, fleet=fleet), ()).draws(2, 1))
    return fleet, model, again


def with_stiffer_parts(mounts, model, factor):
    """Return a catalogue of today's parts and of ones that are stiffer in all directions."""
    (case,) = model.cases
    stiffer = case.with_stiffness(factor * np.hstack([body.stiffness for body in case.bodies]))
    return CatalogueModel(mounts, (model, replace(model, cases=(stiffer,))), (2,) * len(mounts))


def test_parts_of_a_catalogue_change_what_factors_of_their_stiffness_do(platform, at_rest):
    fleet, model, again = at_rest
    designs = np.hstack([np.zeros((2, 4)), PICKS])
    designs[1, 1] = 1.0  # the stiffer part at the second mount, re-tuned to 0.9
    designs[1, 4 + 3 : 4 + 6] = 0.9
    factors = designs[:, 4:].copy()
    factors[1, 3:6] *= 1.25
    catalogue, *of_again = (
        with_stiffer_parts(platform.mounts, each, 1.25) for each in (model, *again)
    )
    by_parts = change_draws(catalogue, of_again, fleet, platform.mounts, designs)
    by_factors = change_draws(model, again, fleet, platform.mounts, factors)
    np.testing.assert_allclose(by_parts.predicted, by_factors.predicted, atol=1e-9)
    np.testing.assert_allclose(by_parts.drawn, by_factors.drawn, atol=1e-9)


def test_vehicles_with_parts_of_their_own_are_told_each_its_own_change(platform, at_rest):
    fleet, model, again = at_rest
    each = np.tile(PICKS[:, np.newaxis], (1, 5, 1))
    each[1, ::2] = PICKS[0]
    own = change_draws(model, again, fleet, platform.mounts, each)
    same = change_draws(model, again, fleet, platform.mounts, PICKS)
    assert own.drawn.shape == same.drawn.shape
    np.testing.assert_allclose(own.drawn[:, 0], same.drawn[:, 0], atol=1e-9)
    np.testing.assert_allclose(own.drawn[:, 1, ::2], same.drawn[:, 0, ::2], atol=1e-9)
    np.testing.assert_allclose(own.predicted_peak[1, 1::2], same.predicted_peak[1, 1::2])


def test_drawn_bodies_keep_what_was_measured(platform):
    fleet = fleet_of(platform)
    lines = fleet.vehicles[0].receptance.frequency[::2]
    bodies = expected._Bodies.of(fleet, platform.mounts, lines, Information.driving_points)
    drawn = replace(bodies, noise=np.zeros(5)).draw(np.random.default_rng(1))
    known = expected._Bodies.of(fleet, platform.mounts, lines, Information.receptances)
    exact = replace(known, noise=np.zeros(5)).draw(np.random.default_rng(1))
    point, true = (each.diagonal(axis1=2, axis2=3) for each in (drawn, exact))
    np.testing.assert_allclose(point, true, rtol=1e-9)
    assert not np.allclose(drawn, exact, rtol=0.1)
    size = np.sqrt(np.abs(point[..., :, np.newaxis] * point[..., np.newaxis, :]))
    assert np.all(np.abs(drawn) <= size * (1 + 1e-9))


def test_vehicles_with_driving_points_alone_are_drawn_as_that(platform, at_rest):
    fleet, model, again = at_rest
    alone = []
    for vehicle in platform.fleet.vehicles:
        frf = vehicle.receptance.select(outputs=vehicle.receptance.inputs)
        values = np.eye(len(frf.inputs)) * frf.values
        alone.append(replace(vehicle, receptance=replace(frf, values=values)))
    data = model, again, Fleet(tuple(alone)), platform.mounts, PICKS
    draws = change_draws(*data)
    asked = change_draws(
        model, again, platform.fleet, *data[3:], information=Information.driving_points
    )
    assert draws.information is Information.driving_points
    np.testing.assert_array_equal(draws.drawn, asked.drawn)
    with pytest.raises(InputError, match="receptances are asked for, and 5 vehicles have none"):
        change_draws(*data, information=Information.receptances)
    # one car with less than the others: that is what is known of all
    mixed = Fleet((*alone[:-1], fleet.vehicles[-1]))
    assert change_draws(*data[:2], mixed, *data[3:]).information is Information.unknown


def test_driving_points_of_a_body_of_the_prior_are_kept(platform, at_rest):
    bodies = expected._Bodies.of(
        at_rest[0], platform.mounts, np.arange(20.0, 60.0), Information.unknown
    )
    struck = replace(
        bodies.struck(np.random.default_rng(1), expected.CarMeasurement.driving_points),
        noise=np.zeros(1),
    )
    first, second = (struck.draw(np.random.default_rng(seed)) for seed in (2, 3))
    np.testing.assert_allclose(*(y.diagonal(axis1=2, axis2=3) for y in (first, second)), rtol=1e-9)
    assert not np.allclose(first, second, rtol=0.1)


def test_what_driving_points_would_narrow_is_the_width_that_their_draws_have(platform, at_rest):
    fleet, model, again = at_rest
    draws = change_draws(model, again, fleet, platform.mounts, PICKS)
    shown = stated(draws)
    assert draws.struck.shape == (3, 48, 2, 5)
    # draws that all agree leave the floor of the interval alone, those of today's width all of it
    agreeing = stated(replace(draws, struck=np.zeros_like(draws.struck)))
    floor = 2 * prior.WIDTH["driving_points"] * prior.FLOOR
    width = np.mean(shown.cars.high - shown.cars.low, axis=-1)
    np.testing.assert_allclose(agreeing.with_points, floor / width)
    ratio = prior.WIDTH["driving_points"] / prior.WIDTH["unknown"]
    same = stated(replace(draws, struck=draws.drawn[np.newaxis]))
    np.testing.assert_allclose(same.with_points, ratio)
    narrower = replace(shown.of(0), with_points=np.array(0.62))
    assert "narrow the interval of a car by about 40 %" in model_sentence(narrower, -2.0)
    hardly = replace(narrower, with_points=np.array(1.1))
    assert "would hardly narrow the interval" in model_sentence(hardly, -2.0)


def test_noise_of_driving_points_is_seen_between_lines(platform):
    for noise in (0.03, 0.1):
        vehicle = fleet_of(platform, noise=noise).vehicles[0]
        # what the platform's own 5 % left in the mean of two functions is there as well
        both = np.hypot(noise, 0.05)
        assert expected._noise_of_lines(vehicle) == pytest.approx(both, rel=0.25)


def test_more_information_narrows_and_the_seed_decides(platform):
    group = platform.fleet
    at_rest = Fleet(tuple(replace(vehicle, receptance=None) for vehicle in group.vehicles))
    model = coupled_model(platform, at_rest)
    again = list(uncertain_index(model, replace(platform, fleet=at_rest), ()).draws(4, 1))
    widths = []
    for information in Information:
        shown = expected_change(
            model, again, group, platform.mounts, PICKS, information=information, seed=3
        )
        cars = shown.cars
        assert np.all((cars.low < cars.expected) & (cars.expected < cars.high))
        least = 2 * prior.WIDTH[information.name] * prior.FLOOR
        assert np.all(cars.high - cars.low >= least * (1 - 1e-9))
        # a mean of cars is not as uncertain as each of them, and the worst gains least
        assert np.all(shown.mean.high - shown.mean.low < (cars.high - cars.low).max(axis=1))
        assert np.all(shown.worst.expected >= shown.mean.expected)
        widths.append(np.mean(cars.high[0] - cars.low[0]))
        words, told = model_sentence(shown.of(0), -2.0), information is Information.receptances
        assert ("The loudest line of a car is expected to change by" in words) == told
        assert ("The loudest line of a car may change by" in words) != told
        points = information is Information.driving_points
        assert ("Of the bodies the driving points are known" in words) == points
        report = Report("cars", "what is expected?")
        report_expected(report, shown, ["first", "second"], group.names)
        table = report.tables["expected"].set_index(["design", "vehicle"])
        assert ("loudest line, expected [dB]" in table) == told
        row = table.loc[("second", group.names[3])]
        assert row["change, to [dB]"] == cars.high[1, 3]
        assert row["loudest line, from [dB]"] == shown.peaks.low[1, 3]
        assert row["change in the model [dB]"] == shown.predicted[1, 3]
    assert widths[0] > widths[2]
    first, other, same = (
        change_draws(model, again, at_rest, platform.mounts, PICKS, seed=seed).drawn
        for seed in (1, 2, 1)
    )
    assert np.array_equal(first, same)
    assert not np.array_equal(first, other)


def test_a_pick_that_changes_nothing_has_an_interval_about_nothing(platform):
    group = platform.fleet
    model = coupled_model(platform, group)
    shown = stated(change_draws(model, [model], group, platform.mounts, np.ones(12)))
    np.testing.assert_allclose(shown.cars.expected, 0.0, atol=1e-9)
    half = prior.WIDTH["receptances"] * prior.FLOOR
    np.testing.assert_allclose(shown.cars.high, half, atol=1e-9)
    np.testing.assert_allclose(shown.cars.low, -half, atol=1e-9)


def test_a_group_of_vehicles_tells_by_how_much_the_mean_of_others_may_differ():
    # t(0.95, 1) = 6.3138 (any table), s = 1/sqrt(2), two vehicles
    assert half_width_of_others(np.array([-3.0, -2.0])) == pytest.approx(6.3138 * 0.5, rel=1e-4)
    assert np.isnan(half_width_of_others(np.array([-3.0])))
    five = np.random.default_rng(1).normal(-2.0, 0.7, (2000, 5))
    held = [abs(each.mean() + 2.0) <= half_width_of_others(each) for each in five]
    assert np.mean(held) == pytest.approx(0.9, abs=0.02)


def test_nothing_is_expected_where_nothing_was_judged(platform, at_rest):
    fleet, model, _ = at_rest
    data = platform.mounts, PICKS
    prescribed = booming_model(
        fleet, platform.mounts, [(platform.load_case(CASE), 1.0)], BAND, motion=Motion.prescribed
    )
    with pytest.raises(InputError, match="no expected change, because the powertrain's motion is"):
        expected_change(prescribed, [prescribed], fleet, *data)
    assert expected_or_why(prescribed, lambda: None).startswith("no expected change, because")
    with pytest.raises(InputError, match="receptances are asked for, and 5 vehicles have none"):
        expected_change(model, [model], fleet, *data, information=Information.receptances)
    with pytest.raises(InputError, match="needs data measured again"):
        expected_change(model, [], fleet, *data)
    text = expected_or_why(model, lambda: expected_change(model, [], fleet, *data))
    assert text == (
        "no expected change, because an expected change needs data measured again: draw some"
    )


def test_every_measurement_is_worth_the_interval_that_is_stated_with_it(
    platform, at_rest, monkeypatch
):
    monkeypatch.setattr(expected, "BODIES_TO_RANK", 3)
    fleet, model, again = at_rest
    data = (model, again, fleet, platform.mounts, PICKS)
    widths = widths_if_measured(*data)
    now = expected_change(*data).mean
    np.testing.assert_allclose(widths[None], now.high - now.low)
    assert set(widths) == {None, *CarMeasurement}
    # what holds the other tells at least as much
    assert np.all(widths[CarMeasurement.receptances] < widths[CarMeasurement.driving_points])
    told = [replace(mount, rubber=RubberInCar()) for mount in platform.mounts]
    with_temperature = expected_change(model, again, fleet, told, PICKS).mean
    np.testing.assert_allclose(
        widths[CarMeasurement.temperature], with_temperature.high - with_temperature.low
    )
    # nothing of the rubber is left to tell
    assert CarMeasurement.temperature not in widths_if_measured(
        model, again, fleet, told, PICKS[:1]
    )


def test_with_receptances_the_rubber_alone_is_left_to_be_told(platform, at_rest):
    _, model, again = at_rest
    fleet = platform.fleet
    widths = widths_if_measured(model, again, fleet, platform.mounts, PICKS[:1])
    assert set(widths) == {None, CarMeasurement.temperature}
