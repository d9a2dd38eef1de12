"""Fleets: frozen, drawn, changed panel by panel, and the rates of unselected ones."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from deboom.bench.fleet import draw_fleet, load_fleet, modified_body
from deboom.bench.unselected_fleets import UnselectedFleets, load_unselected
from write_fleet_rates import draw_unselected

BODY = load_fleet(1).bodies["U06-1"]
NOTHING = np.zeros(8)


def same(body, other):
    return all(map(np.array_equal, vars(body).values(), vars(other).values()))


def test_three_groups_of_five_in_every_fleet():
    names = [f"{group}-{number}" for group in ("U06", "F39", "F45") for number in range(1, 6)]
    assert list(load_fleet(1).bodies) == names
    assert list(load_fleet(7).bodies) == names


def test_one_seed_one_fleet():
    first, again, other = draw_fleet(7), draw_fleet(7), draw_fleet(8)
    assert all(same(first[name], again[name]) for name in first)
    assert not any(same(first[name], other[name]) for name in first)


def test_factors_on_local_shape_and_damping():
    factor, damping = np.linspace(0.5, 1.5, 10), np.linspace(0.5, 2.0, 8)
    changed = modified_body(BODY, NOTHING, NOTHING, factor, damping)
    assert changed.shapes_at_paths == pytest.approx(BODY.shapes_at_paths * factor)
    assert changed.damping_ratios == pytest.approx(BODY.damping_ratios * damping)
    assert changed.shapes_at_panels == pytest.approx(BODY.shapes_at_panels)


def test_a_body_that_loses_its_panels_keeps_a_lowest_frequency_and_damping():
    flimsy = replace(BODY, damping_ratios=np.zeros(8))
    changed = modified_body(flimsy, NOTHING, np.full(8, -1e7))
    assert changed.frequencies.min() == pytest.approx(8.0)
    assert np.all(changed.damping_ratios == 0.01)


def test_the_kept_fleets_are_what_the_prior_gives():
    kept = load_unselected()
    assert len(kept.figures) >= 200
    assert [*kept.figures["seed"]] == [*range(1001, 1001 + len(kept.figures))]
    again = draw_unselected([1001, 1002])
    pd.testing.assert_frame_equal(again.figures, kept.figures[:2], rtol=0, atol=2e-4)
    assert (again.alike, again.battery) == (kept.alike, kept.battery)


def test_rates_count_what_they_say():
    fleets = pd.DataFrame(
        {
            "r_groups_min": [0.95, 0.95, 0.85, 0.99],
            "r_alike_min": [0.96, 0.92, 0.99, 0.80],
            "r_battery_mean": [0.5, 0.2, 0.9, 0.7],
            "strut_and_wishbone_lead": [True, True, False, True],
            "gearbox_leads": [True, False, False, False],
        }
    )
    rates = UnselectedFleets("p", ("U06-1", "U06-4"), "U06-5", fleets).rates()
    found = {name: rate.rate for name, rate in rates.items()}
    assert found == {
        "groups": 0.75,
        "alike": 0.75,
        "alike_closely": 0.5,
        "battery": 0.5,
        "strut_and_wishbone": 0.75,
        "gearbox": 0.25,
        "correlations": 0.25,
    }
    assert rates["groups"].standard_error == pytest.approx(np.sqrt(0.75 * 0.25 / 4))
    assert rates["groups"].n_fleets == 4
