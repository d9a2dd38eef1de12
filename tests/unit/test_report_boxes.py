"""Pictures of acceptance boxes: drawn whole, refused when something does not fit."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.report.figures import Intervals, box_intervals, box_trade_off, levels_in_box

NAMES = ("EnM x", "EnM y", "GeM x")
COLOURS = {"EnM": "#332288", "GeM": "#CC6677"}
VEHICLES = {"A": "#0072B2", "B": "#D55E00"}
LOW, HIGH = np.full(3, 0.8), np.full(3, 1.2)


def intervals(others):
    return box_intervals(
        NAMES,
        Intervals("box", LOW, HIGH),
        others,
        Intervals("bounds", LOW - 0.2, HIGH + 0.2),
        np.ones(3),
        np.array([300.0, np.nan, 200.0]),
        [False, True, False],
        COLOURS,
    )


def test_intervals_are_drawn_with_up_to_two_others():
    other = Intervals("±10 %", LOW + 0.1, HIGH - 0.1)
    assert intervals([]) != intervals([other])
    assert intervals([other]).startswith(b"\x89PNG")
    with pytest.raises(InputError, match="at most two"):
        intervals([other] * 3)
    with pytest.raises(InputError, match="not finite"):
        intervals([Intervals("other", LOW * np.nan, HIGH)])


def trade_off(unreachable, missed):
    return box_trade_off(
        [54.0, 53.0],
        [20.0, 10.0],
        [95.0, 50.0],
        missed,
        VEHICLES,
        stated=(54.0, 20.0),
        unreachable=unreachable,
        limit_label="limit [dB(A)]",
        width_label="half width [%]",
        plain_label="share [%]",
    )


def test_a_curve_is_drawn_with_what_cannot_be_reached():
    missed = {"A": [1.0, 2.0], "B": [3.0, 4.0]}
    assert trade_off(None, missed) != trade_off(52.0, missed)
    with pytest.raises(InputError, match="different lengths"):
        trade_off(None, {"A": [1.0], "B": [2.0]})


def test_levels_are_drawn_about_their_limit():
    levels = np.random.default_rng(1).normal(53.0, 1.0, (500, 2))
    fits = (np.full(2, 54.0), np.full(2, 55.0), np.array([16.0, 15.0]), VEHICLES)
    drawn = levels_in_box(tuple(VEHICLES), levels, *fits, level_label="level [dB(A)]")
    assert drawn.startswith(b"\x89PNG")
    with pytest.raises(InputError, match="not finite"):
        levels_in_box(tuple(VEHICLES), levels * np.nan, *fits, level_label="level [dB(A)]")
