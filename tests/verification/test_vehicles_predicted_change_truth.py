"""Intervals of predicted changes against cars that are solved with the modes of their bodies."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.stats import norm

from deboom.errors import InputError
from deboom.vehicles.predicted_change import (
    BODY_AT_REST,
    BODY_MOVES,
    change_interval,
    change_parts,
)
from samples.driven_cars import stated_interval

DATA = Path(__file__).parents[1] / "data/predicted-changes"
CHOSEN_ON = [pd.read_csv(DATA / f"fleets_{fleets}.csv") for fleets in ("7001_7044", "8001_8044")]
CARS = pd.read_csv(DATA / "fleets_9001_9044.csv")
"""Fleets that took no part in any choice."""


def columns(receptance):
    rows = CARS[CARS["receptance"] == receptance]
    return (rows[f"{name} [dB]"].to_numpy() for name in ("predicted", "true", "deviation"))


def interval(receptance, share=0.9):
    return stated_interval(
        CARS[CARS["receptance"] == receptance], receptance=receptance, share=share
    )


def share_held(receptance):
    """Share of the true changes inside the 90 % intervals."""
    (_, true, _), stated = columns(receptance), interval(receptance)
    return np.mean((stated.low <= true) & (true <= stated.high))


@pytest.mark.parametrize("receptance", [False, True])
def test_intervals_hold_the_changes_of_cars_that_nothing_was_tuned_on(receptance):
    predicted, true, deviation = columns(receptance)
    assert len(true) == 220
    assert share_held(receptance) >= 0.80
    half = norm.ppf(0.95) * deviation
    alone = np.mean(np.abs(true - predicted) <= half)
    assert alone < share_held(receptance)  # errors of measurement alone state too much


@pytest.mark.parametrize("receptance", [False, True])
def test_intervals_are_no_wider_than_they_have_to_be(receptance):
    assert share_held(receptance) <= 0.97


@pytest.mark.parametrize("error", [BODY_AT_REST, BODY_MOVES])
def test_constants_follow_from_the_fleets_they_were_chosen_on_by_one_rule(error):
    """The mean that cars bring, and the least spread that holds 90 % in both sets of fleets."""
    sets = [cars[cars["receptance"] == (error is BODY_MOVES)] for cars in CHOSEN_ON]
    cars = pd.concat(sets)
    assert error.brought == round(cars["true [dB]"].sum() / cars["predicted [dB]"].sum(), 2)

    def least_share(spread):
        held = []
        for rows in sets:
            change, true, deviation = (
                rows[f"{name} [dB]"] for name in ("predicted", "true", "deviation")
            )
            half = norm.ppf(0.95) * np.hypot(deviation, spread * change)
            held.append(np.mean(np.abs(true - error.brought * change) <= half))
        return min(held)

    assert least_share(error.deviation) >= 0.9
    assert least_share(error.deviation - 0.001) < 0.9


def test_receptances_take_most_of_the_error_of_the_model_away():
    """Of predictions themselves, which no constant changes, in all 660 cars."""
    cars = pd.concat([*CHOSEN_ON, CARS])
    error = (cars["true [dB]"] - cars["predicted [dB]"]).to_numpy()
    at_rest, moving = error[~cars["receptance"]], error[cars["receptance"]]
    # 0.06 of 0.22 dB, rms 0.18 of 0.30 dB
    assert abs(moving.mean()) < 0.3 * abs(at_rest.mean())
    assert np.sqrt(np.mean(moving**2)) < 0.7 * np.sqrt(np.mean(at_rest**2))


def test_half_widths_join_in_squares_and_the_sentence_names_the_term():
    stated = change_interval([-4.0, -1.0], [[-4.3, -1.0], [-3.7, -1.0]], receptance=False)
    quantile = norm.ppf(0.95)
    half = quantile * np.array(
        [np.hypot(0.3 * np.sqrt(2.0), 4.0 * BODY_AT_REST.deviation), BODY_AT_REST.deviation]
    )
    np.testing.assert_allclose((stated.high - stated.low) / 2, half)
    middle = BODY_AT_REST.brought * np.array([-4.0, -1.0])
    np.testing.assert_allclose((stated.high + stated.low) / 2, middle)
    assert "receptances of the bodies" in stated.sentence
    assert (
        change_interval([-4.0], [[-4.3], [-3.7]], receptance=True).sentence == BODY_MOVES.sentence
    )


def test_bad_intervals_are_refused():
    with pytest.raises(InputError, match="at least two draws"):
        change_interval([-4.0], [[-4.3]], receptance=True)
    with pytest.raises(InputError, match="a probability of 1"):
        change_interval([-4.0], [[-4.3], [-4.0]], receptance=True, share=1.0)
    with pytest.raises(InputError, match="drawn changes"):
        change_interval([-4.0], [[-4.3, 1.0], [-4.0, 1.0]], receptance=True)


def test_the_mean_has_its_own_draws_and_further_vehicles_their_spread():
    predicted, drawn = [-3.0, -2.0], [[-3.2, -1.8], [-2.8, -2.2]]
    parts = change_parts(predicted, drawn, receptance=False, prescribed=-2.5)
    # errors of the two vehicles cancel in their mean, those of the model do not
    assert parts.mean.measurement[0] == pytest.approx(0.0, abs=1e-12)
    assert parts.cars.measurement[0] > 0.4
    assert parts.mean.model[0] == pytest.approx(parts.cars.model.mean())
    # t(0.95, 1) = 6.3138 (any table), s = 1/sqrt(2), two vehicles
    assert parts.unseen == pytest.approx(6.3138 * 0.5, rel=1e-4)
    assert (parts.prescribed, np.isnan(parts.old_stops)) == (-2.5, True)
    single = change_parts([-3.0], [[-3.2], [-2.8]], receptance=True)
    assert np.isnan(single.unseen)


def test_five_drawn_cars_of_a_group_hold_the_mean_of_all_others():
    """The half width for further vehicles, over groups of five of the drawn cars."""
    true = CARS[CARS["receptance"]]["true [dB]"].to_numpy()
    generator, held = np.random.default_rng(1), []
    for _ in range(400):
        five = generator.choice(len(true), 5, replace=False)
        parts = change_parts(true[five], np.tile(true[five], (2, 1)), receptance=True)
        others = np.delete(true, five).mean()
        held.append(abs(true[five].mean() - others) <= parts.unseen)
    assert 0.84 <= np.mean(held) <= 0.96
