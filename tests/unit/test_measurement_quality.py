"""The quality report: order, limits, culprits, what is not checked, and bad input in words."""

import numpy as np
import pytest

from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.culprit import Fault
from deboom.measurement.quality import (
    quality_in_operation,
    quality_of_frf,
    quality_of_sheet,
    quality_table,
    reciprocity,
)
from deboom.measurement.virtual_point import impact_geometry, sensor_geometry, virtual_point
from deboom.physics.frf import FrfForm
from hammer_test import EXACT, InjectedFault, draw_hammer_test, measure

ORDER = [
    "conditioning",
    "redundancy",
    "geometric consistency",
    "specific consistency",
    "overall consistency",
    "reciprocity",
    "passivity",
    "leave-one-out",
]


@pytest.fixture(scope="module")
def hammer():
    generator = np.random.default_rng(21)
    test = draw_hammer_test(generator)
    response = virtual_point(sensor_geometry(test.sensors))
    return test, response, virtual_point(impact_geometry(test.impacts)), generator


def reversed_channel(test, generator):
    fault = InjectedFault(Fault.SIGN, "A2", ("A2 y",), np.zeros(3))
    return measure(test, generator, fault=fault)


def by_name(checks):
    return {check.name.split(",")[0].split(" (")[0]: check for check in checks}


def report(hammer, measured, **options):
    _, response, excitation, _ = hammer
    return quality_of_frf(
        response, excitation, measured, FrfForm.INERTANCE, tolerances=EXACT, **options
    )


def test_a_good_measurement_keeps_all_limits_in_the_stated_order(hammer):
    test, _, _, generator = hammer
    measured = measure(test, generator)
    checks = report(hammer, measured)
    assert [check.passed for check in checks] == [True] * len(checks)
    ranks = [next(k for k, word in enumerate(ORDER) if c.name.startswith(word)) for c in checks]
    assert sorted(set(ranks)) == list(range(len(ORDER)))
    firsts = [ranks.index(rank) for rank in range(len(ORDER))]
    assert firsts == sorted(firsts)
    assert all(check.culprit for check in checks)


def test_a_reversed_channel_is_flagged_and_named(hammer):
    test, _, _, generator = hammer
    checks = by_name(report(hammer, reversed_channel(test, generator)))
    for name in ("geometric consistency", "specific consistency of sensors"):
        assert checks[name].passed is False
        assert checks[name].culprit == "A2 y"
    assert checks["passivity"].passed is False
    named = checks["leave-one-out of sensors"]
    assert named.passed is False
    assert named.culprit.startswith("A2 y: reversed sign")
    assert checks["leave-one-out of impacts"].passed is True
    assert checks["conditioning of sensors"].passed is True


def test_operation_lists_what_it_cannot_check(hammer):
    test, response, _, generator = hammer
    push = measure(test, generator).select(inputs=["I01"])
    run = Spectrum(push.frequency, push.values[:, :, 0], push.outputs, "m/s^2")
    checks = by_name(quality_in_operation(response, run, tolerances=EXACT))
    unchecked = {name: c.culprit for name, c in checks.items() if c.passed is None}
    assert unchecked == {
        "reciprocity": "needs frequency response functions",
        "passivity": "needs frequency response functions",
    }


def test_points_apart_have_no_driving_point(hammer):
    test, response, _, generator = hammer
    elsewhere = virtual_point(impact_geometry(test.impacts, (0.1, 0.0, 0.0)))
    checks = quality_of_frf(response, elsewhere, measure(test, generator), FrfForm.INERTANCE)
    assert [c.passed for c in checks if c.name in ("reciprocity", "passivity")] == [None, None]


def test_a_poor_sheet_is_reported_before_measuring(hammer):
    two = sensor_geometry(hammer[0].sensors[:2])
    conditioning, redundancy = quality_of_sheet(two)
    assert conditioning.number == np.inf
    assert conditioning.passed is False
    assert conditioning.culprit.startswith("rotation about the axis")
    assert "mm" in conditioning.name
    assert redundancy.passed is False or redundancy.number > 0


def test_the_table_has_a_row_per_check(hammer):
    test, _, _, generator = hammer
    _, response, _, _ = hammer
    apart = virtual_point(impact_geometry(test.impacts, (0.1, 0.0, 0.0)))
    faulty = reversed_channel(test, generator)
    checks = quality_of_frf(response, apart, faulty, FrfForm.INERTANCE)
    table = quality_table(checks)
    assert [row["check"] for row in table] == [check.name for check in checks]
    assert set(table[0]) == {"check", "number [1]", "limit", "verdict", "worst"}
    verdicts = {row["check"]: row["verdict"] for row in table}
    assert verdicts["passivity"] == "not checked"
    assert verdicts["geometric consistency (error)"] == "look here"
    limits = {row["check"]: row["limit"] for row in table}
    assert limits["geometric consistency (error)"] == "≤ 0.02"
    assert limits["specific consistency of sensors"] == "≥ 0.75"
    assert limits["passivity"] == ""


def test_small_pairs_are_not_accused():
    values = np.tile(np.diag([1.0, 2.0]).astype(complex), (3, 1, 1))
    values[:, 0, 1], values[:, 1, 0] = 0.01, -0.01
    small = reciprocity(Frf([1.0, 2.0, 3.0], values, ("x", "y"), ("fx", "fy"), "m/N"))
    assert small.worst() == ("", 1.0)
    assert small.worst(smallest=0.0) == ("x–y", 0.0)
