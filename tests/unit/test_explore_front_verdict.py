"""The verdict on two fronts: what counts as chance, and what is said when nothing is known."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.explore.front_verdict import Contestant, Verdict, difference, last_gain

NORMAL_99 = 2.5758293035489004


def contestant(name, merit, progress=np.nan):
    merit = np.atleast_2d(merit)
    return Contestant(name, merit, np.full(len(merit), progress))


def test_single_runs_are_as_sure_as_their_searches_had_come_to_rest():
    moving = [contestant(n, [level, level], 0.01) for n, level in (("a", 0.80), ("b", 0.78))]
    found = difference(*moving)
    assert found.value == pytest.approx(0.02)
    assert found.draw_error == pytest.approx(0.0)
    assert found.search_error == pytest.approx(0.01 * np.sqrt(2))
    assert found.noise == pytest.approx(NORMAL_99 * 0.01 * np.sqrt(2))
    assert found.verdict is Verdict.noise
    resting = [contestant(n, [level, level], 0.001) for n, level in (("a", 0.80), ("b", 0.78))]
    assert difference(*resting).verdict is Verdict.real


def test_what_all_fronts_have_in_common_is_no_noise():
    common = np.array([0.0, 0.1, -0.1, 0.05])
    found = difference(contestant("a", 0.80 + common, 1e-4), contestant("b", 0.79 + common, 1e-4))
    assert found.draw_error == pytest.approx(0.0, abs=1e-15)
    assert found.verdict is Verdict.real
    alone = difference(contestant("a", 0.80 + common, 1e-4), contestant("b", [0.79] * 4, 1e-4))
    assert alone.draw_error == pytest.approx(common.std(ddof=1) / 2)
    assert alone.verdict is Verdict.noise


def test_from_three_seeds_on_their_own_spread_counts_and_progress_does_not():
    seeds = np.array([0.80, 0.81, 0.82])[:, None] * np.ones(4)
    found = difference(contestant("a", seeds, 9.9), contestant("b", seeds - 0.2, 9.9))
    assert found.search_error == pytest.approx(0.01 / np.sqrt(3) * np.sqrt(2))
    assert found.noise == pytest.approx(4.604094871349992 * found.search_error)  # t, 4 degrees
    assert found.verdict is Verdict.real


def test_nothing_known_nothing_decided():
    found = difference(contestant("a", [0.9, 0.9]), contestant("b", [0.1, 0.1], 0.01))
    assert found.verdict is Verdict.open
    assert np.isnan(found.noise)


def test_last_gain_is_that_of_the_last_fifth():
    assert last_gain(np.arange(1.0, 11.0)) == pytest.approx(2.0)  # generation 8 to 10
    assert last_gain(np.array([1.0, 4.0])) == pytest.approx(3.0)
    assert np.isnan(last_gain(np.array([1.0])))


def test_contestants_that_do_not_fit_are_refused():
    with pytest.raises(InputError, match="two sets"):
        contestant("a", [[0.8]])
    with pytest.raises(InputError, match="progress"):
        Contestant("a", np.ones((2, 3)), np.ones(3))
    with pytest.raises(InputError, match="same draws"):
        difference(contestant("a", [1.0, 1.0]), contestant("b", [1.0, 1.0, 1.0]))
