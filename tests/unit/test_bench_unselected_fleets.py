"""The rates beside the studies' figures: kept as drawn, and counted as they say."""

import numpy as np
import pytest

from deboom.bench.unselected_fleets import (
    FleetFigures,
    UnselectedFleets,
    draw_unselected,
    load_unselected,
)


def test_the_kept_fleets_are_what_the_prior_gives():
    kept = load_unselected()
    assert len(kept.fleets) >= 200
    assert [fleet.seed for fleet in kept.fleets] == list(range(1001, 1001 + len(kept.fleets)))
    again = draw_unselected([1001, 1002])
    for drawn, held in zip(again.fleets, kept.fleets, strict=False):
        for name in ("r_groups_min", "r_alike_min", "r_battery_mean"):
            assert getattr(drawn, name) == pytest.approx(getattr(held, name), abs=2e-4)
        assert drawn.strut_and_wishbone_lead == held.strut_and_wishbone_lead
        assert drawn.gearbox_leads == held.gearbox_leads
    assert (again.alike, again.battery) == (kept.alike, kept.battery)


def test_rates_count_what_they_say():
    fleets = (
        FleetFigures(1, 0.95, 0.96, 0.5, strut_and_wishbone_lead=True, gearbox_leads=True),
        FleetFigures(2, 0.95, 0.92, 0.2, strut_and_wishbone_lead=True, gearbox_leads=False),
        FleetFigures(3, 0.85, 0.99, 0.9, strut_and_wishbone_lead=False, gearbox_leads=False),
        FleetFigures(4, 0.99, 0.80, 0.7, strut_and_wishbone_lead=True, gearbox_leads=False),
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
