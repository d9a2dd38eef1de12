"""Verdicts, routes and truths of a running compressor."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from deboom.compressor.acceptance import DYNAMIC, STATIC, Bounds, Characteristic, judge
from deboom.compressor.routes import CALIBRATED_MEASUREMENT, UPDATED
from deboom.compressor.sources import ResidualBand
from deboom.compressor.unbalance import Unbalance, UnbalanceOptions
from deboom.errors import InputError
from deboom.measurement.compressor_test import HoseState
from deboom.study.component_sheet import open_points, shown_verdicts, verdict_table
from deboom.study.compressor_unbalance import (
    AUTOMATIC,
    MeasuredUnbalance,
    UnbalanceTruth,
    with_route,
)


def verdict(name, value, deviation, bounds, **more):
    lines = np.array([more.pop("line", 0.0)])
    measured = Characteristic(name, np.array([value]), np.array([deviation]), lines, **more)
    return judge(measured, bounds)


VERDICTS = (
    verdict(STATIC, 20e-6, 0.1e-6, Bounds(at_most=22e-6), is_radius=True),
    verdict(DYNAMIC, 1.2e-6, 8e-9, Bounds(at_most=1.207e-6), is_radius=True),
    verdict(
        "dynamic stiffness x, 10–30 Hz", 8e4, 100.0, Bounds(at_least=6e4, at_most=7e4), line=30.0
    ),
    verdict("dynamic stiffness rz, 20 Hz", 685.0, 6.0, Bounds(at_most=684.9), line=20.0),
    verdict(
        "dynamic stiffness y, 20 Hz", 8e4, 50.0, Bounds(at_most=9e4), line=20.0, doubt="hoses on."
    ),
)


def test_values_have_the_units_of_a_drawing():
    table = verdict_table(VERDICTS).set_index("characteristic")
    assert table["unit"].tolist() == ["g mm", "g mm²", "N/mm", "N m/rad", "N/mm"]
    assert table["measured"].tolist() == pytest.approx([20.0, 1200.0, 80.0, 685.0, 80.0])
    assert table["guard band ±"].tolist() == pytest.approx(
        [0.1645, 13.16, 0.1645, 9.869, 0.0822], rel=1e-3
    )
    assert np.isnan(table.loc[STATIC, "at least"])
    assert table["verdict"].tolist() == ["pass", "undecided", "fail", "undecided", "undecided"]


def test_a_page_shows_two_digits_of_the_guard_band():
    table = shown_verdicts(VERDICTS)
    assert table["measured ± guard band"].tolist()[:3] == [
        "20.00 ± 0.16 g mm",
        "1200 ± 13 g mm²",
        "80.00 ± 0.16 N/mm",
    ]
    assert table["limit"][2] == "≥ 60, ≤ 70 N/mm"
    assert table["characteristic"][2] == "dynamic stiffness x, 10–30 Hz; decided at 30 Hz"
    assert table["characteristic"][3] == "dynamic stiffness rz, 20 Hz"


def test_what_is_open_comes_with_what_would_decide_it():
    table = open_points(VERDICTS).set_index("not decided")["what would decide it"]
    assert list(table.index) == [DYNAMIC, *(one.name for one in VERDICTS[3:])]
    # the guard band of 13.2 must shrink to the 7 that are left, by the mean of (13.2/7)² set-ups
    assert table[DYNAMIC].startswith("A guard band of ± 7 g mm² instead of ± 13")
    assert "mean of 4 set-ups" in table[DYNAMIC]
    assert table["dynamic stiffness rz, 20 Hz"].startswith("The value lies on its limit")
    assert table["dynamic stiffness y, 20 Hz"] == "Hoses on."
    assert open_points(VERDICTS[:1]).empty


def found(*, changed=True, hoses=HoseState.SOFT, share=0.0, alarms=()):
    """Build what `with_route` reads of an evaluation by route d."""
    band = ResidualBand(90.0, 120.0, share, 5.0 if share else 1.0)
    results = tuple(
        SimpleNamespace(
            route=route,
            sweeps=(SimpleNamespace(sweep="one"),),
            sources=SimpleNamespace(residual_bands=(band,)),
        )
        for route in (CALIBRATED_MEASUREMENT, UPDATED)
    )
    return Unbalance(
        test=SimpleNamespace(sweeps=(SimpleNamespace(name="one", hoses=hoses),)),
        identification=SimpleNamespace(alarms=alarms),
        options=UnbalanceOptions(),
        motions=(),
        sense=None,
        routes=results,
        state=SimpleNamespace(changed=changed),
        alarms=(),
        notices=(),
    )


@pytest.mark.parametrize(
    ("state", "letter"),
    [
        ({}, "e"),
        ({"changed": False}, "d"),
        ({"alarms": ("a subframe",)}, "d"),
        ({"hoses": HoseState.STANDARD}, "d"),
        ({"share": 0.08}, "d"),
    ],
)
def test_mounts_are_updated_only_where_nothing_else_can_look_like_them(state, letter):
    assert with_route(found(**state), AUTOMATIC).chosen.route.letter == letter


def test_a_route_that_is_asked_for_is_taken_and_an_unknown_one_refused():
    assert with_route(found(changed=False), "e").chosen.route.letter == "e"
    with pytest.raises(InputError, match="there is no route 'a': choose auto, d, e"):
        with_route(found(), "a")


@pytest.mark.parametrize(
    ("state", "changed"),
    [({}, "yes"), ({"changed": False}, "no"), ({"share": 0.08}, "unknown")],
)
def test_mounts_are_not_judged_with_hoses_in_the_data(state, changed):
    measured = MeasuredUnbalance(
        with_route(found(**state), "d"), None, None, (), None, (), None, 0.0
    )
    assert measured.mounts_changed == changed
    if changed == "unknown":
        assert "cannot be told" in measured.mount_state


LINES = np.arange(17.0, 151.0)
SQUARE = (2 * np.pi * LINES) ** 2
TRUTH = UnbalanceTruth(
    Path("operation.json"),
    2e-5 + 0j,
    1e-6 + 0j,
    {"soft": np.outer(SQUARE, [0, 2e-5, -2e-5j, 0, 1e-6j, 1e-6])},
    {"soft": LINES},
)


def sweep(frequency, name="soft"):
    return SimpleNamespace(sweep=name, frequency=frequency)


def test_loads_are_taken_at_the_lines_of_the_sweep():
    some = LINES[10:100:7]
    np.testing.assert_array_equal(TRUTH.load_of(sweep(some)), TRUTH.loads["soft"][10:100:7])
    assert TRUTH.load_of(sweep(some + 0.1)) is None
    assert TRUTH.load_of(sweep(some, name="over time")) is None
