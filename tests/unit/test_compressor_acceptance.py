"""Verdicts on limits: guard bands, bands of frequency, doubts."""

import numpy as np
import pytest

from deboom.compressor.acceptance import (
    Bounds,
    Characteristic,
    Decision,
    judge,
    overall,
)
from deboom.errors import InputError

Z95 = 1.6448536269514722
"""One-sided 95 % quantile of the normal distribution."""


def measured(value, deviation=1.0, **more):
    values = np.atleast_1d(np.asarray(value, dtype=float))
    lines = more.pop("lines", np.zeros(values.size))
    return Characteristic("x", values, np.full(values.size, deviation), lines, **more)


@pytest.mark.parametrize(
    ("value", "decision"),
    [
        (10 - Z95 - 1e-6, Decision.PASS),
        (10 - Z95 + 1e-6, Decision.UNDECIDED),
        (10.0, Decision.UNDECIDED),
        (10 + Z95 - 1e-6, Decision.UNDECIDED),
        (10 + Z95 + 1e-6, Decision.FAIL),
    ],
)
def test_the_guard_band_lies_on_both_sides_of_an_upper_bound(value, decision):
    assert judge(measured(value), Bounds(at_most=10.0)).decision is decision


@pytest.mark.parametrize(
    ("value", "decision"),
    [(6.0, Decision.FAIL), (8.0, Decision.UNDECIDED), (10.0, Decision.PASS)],
)
def test_a_window_has_a_lower_bound_too(value, decision):
    verdict = judge(measured(value), Bounds(at_least=8.0, at_most=12.0))
    assert verdict.decision is decision
    assert verdict.interval == pytest.approx((value - Z95, value + Z95))


def test_a_window_narrower_than_its_guard_bands_passes_nothing():
    window = Bounds(at_least=9.0, at_most=11.0)
    assert judge(measured(10.0), window).decision is Decision.UNDECIDED


def test_the_line_next_to_its_limit_decides_a_band():
    found = measured([5.0, 9.5, 7.0], lines=[10.0, 20.0, 30.0])
    verdict = judge(found, Bounds(at_most=10.0))
    assert (verdict.decision, verdict.value, verdict.line) == (Decision.UNDECIDED, 9.5, 20.0)
    assert verdict.shrinkage == pytest.approx(0.5 / Z95)


def test_the_worst_of_many_lines_needs_more_to_fail():
    alone = judge(measured(12.0), Bounds(at_most=10.0))
    among = judge(measured([12.0] + [1.0] * 8), Bounds(at_most=10.0))
    assert alone.decision is Decision.FAIL
    assert among.decision is Decision.UNDECIDED
    assert among.pass_guard == alone.pass_guard


def test_an_unbalance_fails_with_its_whole_circle():
    verdict = judge(measured(12.0, is_radius=True), Bounds(at_most=10.0))
    assert verdict.decision is Decision.UNDECIDED
    assert verdict.fail_guard == pytest.approx(np.sqrt(-2 * np.log(0.05)))


def test_a_doubt_decides_nothing():
    verdict = judge(measured(1.0, doubt="a wet compressor"), Bounds(at_most=10.0))
    assert (verdict.decision, verdict.doubt) == (Decision.UNDECIDED, "a wet compressor")
    assert verdict.shrinkage == 1.0


def test_repetitions_shrink_the_guard_to_what_is_left():
    verdict = judge(measured(10 - Z95 / 2), Bounds(at_most=10.0))
    assert verdict.shrinkage == pytest.approx(0.5)
    assert verdict.repetitions == 4


def test_a_smaller_risk_needs_a_wider_guard():
    wide = judge(measured(8.0), Bounds(at_most=10.0), risk=0.01)
    assert wide.decision is Decision.UNDECIDED
    assert judge(measured(8.0), Bounds(at_most=10.0), risk=0.05).decision is Decision.PASS


def test_the_part_is_as_good_as_its_worst_verdict():
    verdicts = [judge(measured(value), Bounds(at_most=10.0)) for value in (1.0, 10.0, 99.0)]
    assert overall(verdicts) is Decision.FAIL
    assert overall(verdicts[:2]) is Decision.UNDECIDED
    assert overall(verdicts[:1]) is Decision.PASS


def test_bad_input_is_refused():
    with pytest.raises(InputError, match="needs a bound"):
        Bounds()
    with pytest.raises(InputError, match="no part keeps both"):
        Bounds(at_least=2.0, at_most=1.0)
    with pytest.raises(InputError, match="no measurement is exact"):
        measured(1.0, deviation=0.0)
    with pytest.raises(InputError, match="a risk of"):
        judge(measured(1.0), Bounds(at_most=2.0), risk=0.5)
    with pytest.raises(InputError, match="can neither pass nor fail"):
        overall([])
