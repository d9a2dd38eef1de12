"""Fleets: frozen, drawn, and changed panel by panel."""

from dataclasses import replace

import numpy as np
import pytest

from deboom.bench.fleet import draw_fleet, load_fleet, modified_body

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
