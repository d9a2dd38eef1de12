"""The amplitude-dependent seam: the same promises as the coupled one, and its two tiers."""

from __future__ import annotations

import builtins
import pickle
from dataclasses import dataclass, replace

import numpy as np
import pytest

import kernel_amplitude as bench
from deboom.errors import InputError
from deboom.vehicles import kernel_numba
from deboom.vehicles.amplitude_motion import MOST_SWEEPS, solve_along_lines
from deboom.vehicles.booming_model import AmplitudeIndex
from deboom.vehicles.design_factor import DYNAMIC
from deboom.vehicles.kernel_amplitude_numba import NUMBA_AMPLITUDE
from deboom.vehicles.kernel_amplitude_numpy import NUMPY_AMPLITUDE
from deboom.vehicles.kernel_amplitude_source import LANES

SHAPE = bench.Shape("small", 4, 3, 41, 3, 2, 4)
ONE, TWO = bench.problem(SHAPE, 1), bench.problem(SHAPE, 2)
DESIGNS = bench.designs(SHAPE)


@dataclass(frozen=True)
class Tilted:
    """A factor that also changes what it scales, line by line."""

    def __call__(self, designs):
        """Tilt by up to a tenth of the change."""
        slope = np.linspace(-0.1, 0.1, 41)[:, np.newaxis] * (1 + 0.2j)
        variables = np.concatenate([ONE.coupled.variables, ONE.coupled.own_variables])
        return 1 + slope * (designs[:, np.newaxis, variables] - 1)

    def held(self, designs):
        """Ten lines of one direction."""
        beyond = np.zeros((len(designs), 41, 11), dtype=bool)
        beyond[:, :10, 6] = True
        return beyond


TILTED = replace(ONE, ratio=Tilted())


def test_splv_is_the_sum_of_the_levels_of_the_lines():
    index = AmplitudeIndex((ONE, TWO), (1.0, 3.0), NUMPY_AMPLITUDE)
    levels = [index.levels(DESIGNS, case).sum(axis=-1) for case in ("drawn 1", "drawn 2")]
    expected = 0.25 * levels[0] + 0.75 * levels[1]
    np.testing.assert_allclose(index(DESIGNS), expected, rtol=0, atol=1e-9)
    assert index.follows_amplitude
    assert index.factor is DYNAMIC


def test_gradient_agrees_with_differences_of_the_index():
    index = AmplitudeIndex((ONE,), (1.0,), NUMPY_AMPLITUDE)
    design = DESIGNS[:1]
    found = index.gradient(design)[0]
    for k in (0, 9):
        moved = np.vstack([design, design])
        moved[:, k] += (-5e-3, 5e-3)
        low, high = index(moved)
        assert found[:, k] == pytest.approx((high - low) / 1e-2, rel=0.05, abs=0.5)
    assert not found[:, 10:].any()


def test_tiers_agree_and_a_design_gives_the_same_bits_in_any_company():
    pytest.importorskip("numba")
    compiled, plain = NUMBA_AMPLITUDE.prepare(ONE), NUMPY_AMPLITUDE.prepare(ONE)
    designs = np.random.default_rng(3).uniform(0.8, 1.2, (LANES + 30, 12))
    whole = compiled(designs)
    np.testing.assert_allclose(whole, plain(designs), rtol=0, atol=1e-9)
    for size in (1, 7, LANES, LANES + 1):
        parts = [compiled(designs[i : i + size]) for i in range(0, len(designs), size)]
        np.testing.assert_array_equal(np.concatenate(parts), whole)
    np.testing.assert_array_equal(plain(designs[::-1]), plain(designs)[::-1])
    assert compiled(np.empty((0, 12))).shape == (0, 3)
    assert 1.0 < compiled.sweeps(designs) < 10.0


def test_compiled_kernel_hands_strange_designs_to_the_plain_one():
    pytest.importorskip("numba")
    compiled, plain = NUMBA_AMPLITUDE.prepare(ONE), NUMPY_AMPLITUDE.prepare(ONE)
    strange = DESIGNS[:3].copy()
    strange[1] *= 1e5
    np.testing.assert_array_equal(compiled(strange)[1], plain(strange)[1])


def test_a_process_pool_can_carry_it():
    index = AmplitudeIndex((TILTED,), (1.0,), NUMPY_AMPLITUDE)
    carried = pickle.loads(pickle.dumps(index))
    np.testing.assert_array_equal(carried(DESIGNS), index(DESIGNS))


def test_amplitudes_without_rest_are_no_result():
    """A stiffness that falls ever more with the amplitude throws the motion about."""
    cubic = np.zeros_like(ONE.cubic)
    cubic[..., 0], cubic[..., 3] = 41.0, -40.0
    wild = replace(ONE, cubic=cubic, highest=np.full(ONE.highest.shape, np.inf))
    solution = solve_along_lines(wild, DESIGNS[:2])
    assert not solution.solved.all()
    assert solution.sweeps.max() == MOST_SWEEPS + 1
    with np.errstate(invalid="ignore"):
        assert np.isnan(NUMPY_AMPLITUDE.prepare(wild)(DESIGNS[:2])).any()


def test_counts_where_designs_leave_the_measurements():
    narrow = replace(TILTED, highest=np.ones(ONE.highest.shape))
    held = AmplitudeIndex((narrow,), (1.0,), NUMPY_AMPLITUDE).held(DESIGNS)
    assert 0.1 < held.amplitude < 0.9
    assert held.preload == pytest.approx(10 / 41 / 11)
    assert held.worst.startswith("drawn 1, m")
    still = replace(ONE, cubic=np.broadcast_to([1.0, 0, 0, 0], ONE.cubic.shape))
    free = AmplitudeIndex((still,), (1.0,), NUMPY_AMPLITUDE)
    assert not free.follows_amplitude
    assert free.held(DESIGNS).worst == ""
    assert free.held(DESIGNS).amplitude == free.held(DESIGNS).preload == 0.0


def test_refuses_shapes_and_bounds_that_do_not_fit():
    with pytest.raises(InputError, match=r"drawn 1: cubic of shape \(41, 11, 3\), expected"):
        replace(ONE, cubic=ONE.cubic[..., :3])
    with pytest.raises(InputError, match="leave out the measured one"):
        replace(ONE, lowest=np.full(ONE.lowest.shape, 1.1))


def test_says_when_numba_is_missing(monkeypatch):
    real = builtins.__import__

    def refuse(name, *args, **kwargs):
        if name == "numba":
            raise ImportError(name)
        return real(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", refuse)
    with pytest.raises(InputError, match=r"needs numba, .*pip install deboom\[fast\]"):
        kernel_numba.compile_loops("", 1)
