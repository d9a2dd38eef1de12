"""Error rates of verdicts over many simulated parts: none beyond the stated risk."""

import numpy as np
import pytest

from deboom.compressor.acceptance import Bounds, Characteristic, Decision, judge

RISK = 0.05
N_PARTS = 2000
MARGIN = 3 * np.sqrt(RISK * (1 - RISK) / N_PARTS)
"""Three standard deviations of a share counted over so many parts."""


def share(decision, values, bounds, **more):
    """Of measured values, each a part, that end so."""
    n = 0
    for value in values:
        read = np.atleast_1d(value)
        measured = Characteristic("x", read, np.ones(read.size), np.zeros(read.size), **more)
        n += judge(measured, bounds, RISK).decision is decision
    return n / len(values)


@pytest.fixture
def rng():
    return np.random.default_rng(20)


def test_a_scalar_on_its_limit(rng):
    """On the limit, the worst place, both errors are the risk itself."""
    read = 10 + rng.standard_normal(N_PARTS)
    upper = Bounds(at_most=10.0)
    assert share(Decision.PASS, read, upper) == pytest.approx(RISK, abs=MARGIN)
    assert share(Decision.FAIL, read, upper) == pytest.approx(RISK, abs=MARGIN)


def test_a_window(rng):
    read = 7 + rng.standard_normal(N_PARTS)
    window = Bounds(at_least=7.0, at_most=12.0)
    assert share(Decision.PASS, read, window) <= RISK + MARGIN
    assert share(Decision.FAIL, read, window) <= RISK + MARGIN


@pytest.mark.parametrize("radius", [0.0, 1.0, 5.0, 50.0])
@pytest.mark.parametrize("across", [0.1, 1.0])
def test_the_length_of_an_unbalance(rng, radius, across):
    """A vector whose error across is smaller than along, or as large; any length."""
    along, aside = rng.standard_normal((2, N_PARTS))
    read = np.hypot(radius + along, across * aside)
    upper = Bounds(at_most=radius)
    assert share(Decision.PASS, read, upper, is_radius=True) <= RISK + MARGIN
    assert share(Decision.FAIL, read, upper, is_radius=True) <= RISK + MARGIN


@pytest.mark.parametrize("correlation", [0.0, 0.9])
def test_a_band(rng, correlation):
    """Bad at one of nine lines: it passes with the risk at most; good at all: fails so."""
    common, own = rng.standard_normal((N_PARTS, 1)), rng.standard_normal((N_PARTS, 9))
    noise = np.sqrt(correlation) * common + np.sqrt(1 - correlation) * own
    upper = Bounds(at_most=10.0)
    bad = np.where(np.arange(9) == 4, 10.0, 8.0) + noise
    assert share(Decision.PASS, bad, upper) <= RISK + MARGIN
    assert share(Decision.FAIL, 10.0 + noise, upper) <= RISK + MARGIN


def test_a_good_part_passes_once_it_keeps_its_distance(rng):
    """Two guard bands inside the limit, 95 of 100 parts pass: the rule is not idle caution."""
    read = 10 - 2 * 1.645 + rng.standard_normal(N_PARTS)
    assert share(Decision.PASS, read, Bounds(at_most=10.0)) == pytest.approx(1 - RISK, abs=MARGIN)
