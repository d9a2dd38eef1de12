"""The compiled kernels: the same results as numpy's, bit-stable, and a clear word without numba."""

from __future__ import annotations

import pickle
import subprocess
import sys

import numpy as np
import pytest

import kernel_coupled as bench
from deboom.errors import InputError
from deboom.vehicles import kernel_numba
from deboom.vehicles.kernel_coupled_numpy import NUMPY_COUPLED
from deboom.vehicles.kernel_numba import (
    NUMBA,
    NUMBA_COUPLED,
    NUMBA_COUPLED_FLOAT32,
    NUMBA_FLOAT32,
)
from deboom.vehicles.kernel_numpy import NUMPY
from deboom.vehicles.kernel_source import COUPLED_LANES, PRESCRIBED_LANES

SHAPE = bench.Shape("small", 40, 3, 101, 3, 2, 5)
MOTION, COUPLED_DESIGNS = bench.problem(SHAPE), bench.designs(SHAPE)

pytest.importorskip("numba", reason="the extra 'fast' is not installed")


def _contributions(n_variable=10, n_lines=101, seed=1):
    rng = np.random.default_rng(seed)
    shape = (3, n_lines, n_variable)
    return rng.normal(size=shape) + 1j * rng.normal(size=shape)


def _designs(n, n_variable=10, seed=2):
    return np.random.default_rng(seed).uniform(0.6, 1.4, (n, n_variable))


def _prepared(which):
    if which == "prescribed":
        return NUMBA.prepare(_contributions()), _designs(2 * PRESCRIBED_LANES + 13)
    return NUMBA_COUPLED.prepare(MOTION), COUPLED_DESIGNS[: 2 * COUPLED_LANES + 13]


@pytest.mark.parametrize("which", ["prescribed", "coupled"])
def test_a_design_gives_the_same_bits_in_any_company(which):
    level_sum, designs = _prepared(which)
    whole = level_sum(designs)
    for size in (1, 7, 63, 64, 65, 128):
        parts = [level_sum(designs[i : i + size]) for i in range(0, len(designs), size)]
        np.testing.assert_array_equal(np.concatenate(parts), whole)
    order = np.random.default_rng(3).permutation(len(designs))
    np.testing.assert_array_equal(level_sum(designs[order]), whole[order])
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(level_sum))(designs), whole)
    assert level_sum(designs[:0]).shape == (0, 3)


@pytest.mark.parametrize("which", ["prescribed", "coupled"])
def test_neighbours_out_of_range_change_no_bit_and_are_right_themselves(which):
    level_sum, designs = _prepared(which)
    alone = level_sum(designs)
    crowd = designs.copy()
    crowd[[3, 70]] = designs[[3, 70]] * [[1e-30], [1e30]]
    found = level_sum(crowd)
    ordinary = np.setdiff1d(np.arange(len(designs)), [3, 70])
    np.testing.assert_array_equal(found[ordinary], alone[ordinary])
    np.testing.assert_array_equal(found[[3, 70]], level_sum.careful(crowd[[3, 70]]))
    assert np.isfinite(found).all()


@pytest.mark.parametrize("kernel", [NUMBA, NUMBA_FLOAT32])
def test_quiet_and_loud_lines_leave_to_the_careful_kernel(kernel):
    """A design that switches one path off turns 40 lines down by 400 dB."""
    contributions = _contributions()
    contributions[:, :40, :9] *= 1e-20
    designs = np.ones((4, 10))
    designs[:, 9] = [0.0, 1.0, 2.0, 1.0]
    designs[3, :9] = 0.0
    found = kernel.prepare(contributions)(designs)
    exact = NUMPY.prepare(contributions)(designs)
    np.testing.assert_allclose(found[0], exact[0], rtol=1e-12)
    np.testing.assert_allclose(found[1:], exact[1:], atol=2e-3)


def test_silence_is_minus_infinity_of_that_design_only():
    contributions = _contributions()
    contributions[0, 3] = [1.0, -1.0, *np.zeros(8)]
    designs = np.ones((2, 10))
    designs[1, 1] = 0.5
    found = NUMBA.prepare(contributions)(designs)
    np.testing.assert_array_equal(np.isneginf(found), [[True, False, False], [False] * 3])
    silent = np.zeros((1, 5, 2), dtype=complex)
    assert np.isneginf(NUMBA.prepare(silent)(np.ones((3, 2)))).all()


def test_variables_without_effect_have_none():
    contributions = _contributions(12)
    contributions[:, :, [1, 4]] = 0.0
    designs = _designs(50, 12)
    level_sum = NUMBA.prepare(contributions)
    other = designs.copy()
    other[:, [1, 4]] = 1e300
    np.testing.assert_array_equal(level_sum(designs), level_sum(other))
    coupled, other = NUMBA_COUPLED.prepare(MOTION), COUPLED_DESIGNS.copy()
    other[:, 10:] = 1e300
    np.testing.assert_array_equal(coupled(COUPLED_DESIGNS), coupled(other))


def test_single_precision_is_as_good_as_it_says():
    contributions, designs = _contributions(), _designs(300)
    error = NUMBA_FLOAT32.prepare(contributions)(designs) - NUMPY.prepare(contributions)(designs)
    assert 0 < np.abs(error).max() <= 2e-3
    exact = NUMPY_COUPLED.prepare(MOTION)(COUPLED_DESIGNS)
    error = NUMBA_COUPLED_FLOAT32.prepare(MOTION)(COUPLED_DESIGNS) - exact
    assert 0 < np.abs(error).max() <= 5e-3


def test_names_are_what_a_run_records():
    kernels = (NUMBA, NUMBA_FLOAT32, NUMBA_COUPLED, NUMBA_COUPLED_FLOAT32)
    assert [k.name for k in kernels] == ["numba", "numba float32"] * 2


def test_without_numba_there_is_a_sentence(monkeypatch):
    monkeypatch.setitem(sys.modules, "numba", None)
    kernel_numba._compiled.cache_clear()
    for prepare in (lambda: NUMBA.prepare(_contributions()), lambda: NUMBA_COUPLED.prepare(MOTION)):
        with pytest.raises(InputError, match=r"pip install deboom\[fast\], or choose the numpy"):
            prepare()
    kernel_numba._compiled.cache_clear()


def test_importing_the_kernel_does_not_import_numba():
    code = "import sys, deboom.vehicles.kernel_numba; sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
