"""Building blocks of the way from sweeps to unbalance, and what they refuse."""

from types import SimpleNamespace

import numpy as np
import pytest

from deboom.compressor.acceptance import DYNAMIC, STATIC
from deboom.compressor.operating_fit import _inverse
from deboom.compressor.routes import ONE_FACTOR, FactorOverFrequency
from deboom.compressor.sources import ResidualBand
from deboom.compressor.unbalance import UnbalanceOptions, load_alarms, sweeps_of, within_hammer_test
from deboom.errors import InputError
from deboom.measurement.channels import Spectrum
from deboom.measurement.compressor_test import HoseState, OperatingSweep
from deboom.pages.unbalance import _true_curve

LINES = np.arange(17.0, 151.0)


def sweep(name="soft", hoses=HoseState.SOFT, lines=LINES):
    values = np.ones((lines.size, 2), complex)
    return OperatingSweep(
        name, hoses, 7.5e5, Spectrum(lines, values, ("a", "b"), "m/s^2"), np.abs(values)
    )


def operating_test(*sweeps):
    """Make a test as far as the choice of sweeps sees it."""
    return SimpleNamespace(
        name="test", with_hoses=lambda state: tuple(each for each in sweeps if each.hoses is state)
    )


def test_unknowns_that_nothing_tells_apart_go_together():
    np.testing.assert_allclose(_inverse(np.full((2, 2), 4e30)) @ [4e30, 4e30], [0.5, 0.5])


def test_changes_of_the_mounts():
    mounts = np.ones((LINES.size, 6, 6), complex) * (2 + 1j)
    still = np.zeros((LINES.size, 6), complex)
    matrices = ONE_FACTOR.matrices(LINES, mounts, still)
    np.testing.assert_allclose(np.tensordot([-0.1, 0.2], matrices, axes=1), (-0.1 + 0.2j) * mounts)
    factor = FactorOverFrequency(knots=(20.0, 100.0))
    basis = factor.basis(np.array([10.0, 20.0, 60.0, 100.0, 150.0]))
    np.testing.assert_allclose(basis[0], 1)
    np.testing.assert_allclose(basis[1], 1j)
    np.testing.assert_allclose(basis[2], [1, 1, 0.5, 0, 0])
    assert factor.matrices(LINES, mounts, still).shape == (6, LINES.size, 6, 6)
    np.testing.assert_allclose(factor.deviations, [0.3, 0.3, 0.1, 0.1, 0.1, 0.1])


def test_soft_sweeps_come_first():
    soft, standard = sweep(), sweep("standard", HoseState.STANDARD)
    used, notices = sweeps_of(operating_test(standard, soft), None)
    assert [used_sweep.name for used_sweep in used] == ["soft"]
    assert notices == []
    used, notices = sweeps_of(operating_test(standard), None)
    assert [used_sweep.name for used_sweep in used] == ["standard"]
    assert "no sweep with soft hoses" in notices[0]
    used, notices = sweeps_of(operating_test(standard, soft), HoseState.STANDARD)
    assert [used_sweep.name for used_sweep in used] == ["standard"]
    assert notices == []
    with pytest.raises(InputError, match="no sweep with soft hoses"):
        sweeps_of(operating_test(standard), HoseState.SOFT)


def test_lines_outside_of_the_hammer_test_are_left_out_and_said():
    kept, notices = within_hammer_test((sweep(),), np.arange(20.0, 121.0))
    np.testing.assert_array_equal(kept[0].frequency, np.arange(20.0, 121.0))
    assert "33 lines outside" in notices[0]
    kept, notices = within_hammer_test((sweep(),), np.arange(10.0, 151.0))
    assert kept[0].frequency.size == LINES.size
    assert notices == []
    with pytest.raises(InputError, match="strike and run over the same range"):
        within_hammer_test((sweep(),), np.arange(200.0, 300.0))


def test_alarms_name_one_cause():
    state = SimpleNamespace(changed=True, statement="changed")
    solution = SimpleNamespace(residual_bands=(), reduced_chi=1.0, remaining_chi=1.0)
    assert load_alarms((sweep(),), solution, 0.0, state) == ("changed",)
    state.changed, solution.reduced_chi = False, 7.0
    assert "by some 3.0 % per direction" in load_alarms((sweep(),), solution, 0.03, state)[0]
    solution.remaining_chi = 5.0
    assert "5.0 times their noise" in load_alarms((sweep(),), solution, 0.03, state)[0]
    solution.residual_bands, state.changed = (ResidualBand(90, 120, 0.08, 6.0),), True
    assert len(load_alarms((sweep(),), solution, 0.03, state)) == 1


def test_a_confidence_is_no_certainty():
    with pytest.raises(InputError, match="confidence"):
        UnbalanceOptions(confidence=1.0)


def test_the_true_unbalance_is_the_load_over_the_square_of_the_speed():
    """25 g mm turn to 25e-6 ω² N across the shaft, 1500 g mm² to 1.5e-6 ω² N m about the point."""
    square = (2.0 * np.pi * LINES) ** 2
    load = np.zeros((LINES.size, 6), complex)
    load[:, 1], load[:, 5] = 25e-6 * square, -1.5e-6j * square
    truth = SimpleNamespace(load_of=lambda _: load)
    measured = SimpleNamespace(frequency=LINES)
    (size,) = _true_curve(truth, measured, STATIC).values()
    np.testing.assert_allclose(size, 25.0, rtol=1e-13)
    (size,) = _true_curve(truth, measured, DYNAMIC).values()
    np.testing.assert_allclose(size, 1500.0, rtol=1e-13)
    assert _true_curve(None, measured, STATIC) == {}
