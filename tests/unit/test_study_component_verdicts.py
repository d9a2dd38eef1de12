"""Verdicts in words and in the units of a drawing."""

import numpy as np
import pytest

from deboom.compressor.acceptance import Bounds, Characteristic, judge
from deboom.compressor.component_acceptance import DYNAMIC, STATIC
from deboom.study.component_verdicts import open_points, shown_verdicts, verdict_table


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
