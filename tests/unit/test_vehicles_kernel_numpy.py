from __future__ import annotations

import itertools
import pickle

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from deboom.vehicles.kernel_numpy import LINES, NUMPY, ROWS


def _contributions(n_vehicle, n_lines, n_variable, seed=1):
    rng = np.random.default_rng(seed)
    shape = (n_vehicle, n_lines, n_variable)
    return rng.normal(size=shape) + 1j * rng.normal(size=shape)


def _designs(n, n_variable, seed=2):
    return np.random.default_rng(seed).uniform(0.6, 1.4, (n, n_variable))


def _blas_threads():
    return [lib["num_threads"] for lib in threadpool_info() if lib["user_api"] == "blas"]


@pytest.mark.parametrize(
    ("n_vehicle", "n_lines", "n_variable"),
    [(5, 161, 12), (1, 1, 1), (2, 3, 2), (3, 97, 13), (2, LINES + 1, 7), (1, 2 * LINES, 31)],
)
def test_a_design_gives_the_same_bits_in_any_company(n_vehicle, n_lines, n_variable):
    level_sum = NUMPY.prepare(_contributions(n_vehicle, n_lines, n_variable))
    designs = _designs(2 * ROWS + 61, n_variable)
    whole = level_sum(designs)
    for size in (1, 7, 100, ROWS - 1, ROWS, ROWS + 1):
        parts = [level_sum(designs[i : i + size]) for i in range(0, len(designs), size)]
        np.testing.assert_array_equal(np.concatenate(parts), whole)
    for seed in range(5):
        order = np.random.default_rng(seed).permutation(len(designs))
        np.testing.assert_array_equal(level_sum(designs[order]), whole[order])


def test_a_design_gives_the_same_bits_beside_one_that_overflows_and_one_that_is_silent():
    contributions = _contributions(3, 161, 4)
    contributions[:, 20, 1:] = 0.0  # the first factor alone rules this line
    level_sum = NUMPY.prepare(contributions)
    designs = _designs(60, 4)
    alone = level_sum(designs)
    assert np.isfinite(alone).all()
    for i, factor in itertools.product((0, 31, 60), (1e-30, 1e30)):
        crowd = np.insert(designs, i, designs[5] * factor, axis=0)
        crowd = np.insert(crowd, 17, [0.0, 1.0, 1.0, 1.0], axis=0)
        found = level_sum(crowd)
        assert np.isneginf(found[17]).all()
        ordinary = np.delete(found, [17, i if i < 17 else i + 1], axis=0)
        np.testing.assert_array_equal(ordinary, alone)


def test_silence_is_minus_infinity_of_that_design_and_vehicle_only():
    contributions = np.ones((2, 5, 2), dtype=complex)
    contributions[0, 3] = [1.0, -1.0]
    contributions[1, :, 1] = 2.0
    found = NUMPY.prepare(contributions)(np.array([[1.0, 1.0], [1.0, 0.5], [2.0, 2.0]]))
    np.testing.assert_array_equal(
        np.isneginf(found), [[True, False], [False, False], [True, False]]
    )
    assert found[1, 1] == pytest.approx(5 * 20 * np.log10(2.0))


def test_contributions_of_nothing_at_all_are_silent():
    assert np.isneginf(NUMPY.prepare(np.zeros((1, 5, 2), dtype=complex))(np.ones((3, 2)))).all()


def test_a_factor_too_large_for_a_double_is_not_finite():
    contributions = np.tile([1.0 + 0.0j, -0.9], (1, 9, 1))
    found = NUMPY.prepare(contributions)(np.array([[1.7e308, -1.7e308], [1.0, 1.0]]))
    assert not np.isfinite(found[0]).any()
    assert np.isfinite(found[1]).all()


def test_variables_without_effect_are_left_out_and_have_none():
    contributions = _contributions(2, 161, 12)
    contributions[:, :, 10:] = 0.0
    designs = _designs(50, 12)
    level_sum = NUMPY.prepare(contributions)
    other = designs.copy()
    other[:, 10:] = 1e300
    np.testing.assert_array_equal(level_sum(designs), level_sum(other))
    assert level_sum.tables[0].shape[-1] == 10


def test_designs_may_be_views_and_stay_as_they_are():
    level_sum = NUMPY.prepare(_contributions(2, 30, 3))
    designs = _designs(40, 6)
    before = designs.copy()
    strided = level_sum(designs[::2, ::2])
    np.testing.assert_array_equal(strided, level_sum(designs[::2, ::2].copy()))
    np.testing.assert_array_equal(designs, before)
    assert level_sum(np.empty((0, 3))).shape == (0, 2)


def test_layout_of_the_contributions_in_memory_does_not_matter():
    contributions = _contributions(5, 161, 12)
    designs = _designs(20, 12)
    turned = np.asfortranarray(contributions)
    found = NUMPY.prepare(contributions)(designs)
    np.testing.assert_array_equal(NUMPY.prepare(turned)(designs), found)
    carried = pickle.loads(pickle.dumps(NUMPY.prepare(turned)))
    np.testing.assert_array_equal(carried(designs), found)


def test_blas_threads_do_not_matter_and_are_given_back():
    level_sum = NUMPY.prepare(_contributions(5, 161, 12))
    designs = _designs(300, 12)
    found = []
    for n_threads in (1, 2, 3):
        with threadpool_limits(n_threads, user_api="blas"):
            before = _blas_threads()
            found.append(level_sum(designs))
            assert _blas_threads() == before
    np.testing.assert_array_equal(found[0], found[1])
    np.testing.assert_array_equal(found[0], found[2])


def test_name_is_what_a_run_records():
    assert NUMPY.name == "numpy"
