"""Building blocks of the way from sweeps to unbalance, and what they refuse."""

from types import SimpleNamespace

import numpy as np
import pytest

from deboom.compressor.routes import (
    MEASURED,
    ONE_FACTOR,
    FactorOverFrequency,
    updated,
)
from deboom.compressor.sources import ResidualBand, unexplained_lines
from deboom.compressor.unbalance import (
    UnbalanceOptions,
    hose_alarms,
    load_alarms,
    refuse_resonant_sweep,
    sweeps_of,
    within_hammer_test,
)
from deboom.compressor.unbalance_load import (
    RotationSense,
    gas_columns,
    rotor_columns,
)
from deboom.errors import InputError
from deboom.measurement.channels import Spectrum
from deboom.measurement.compressor_test import HoseState, OperatingSweep

LINES = np.arange(17.0, 151.0)


def sweep(name="soft", hoses=HoseState.SOFT, lines=LINES):
    values = np.ones((lines.size, 2), complex)
    return OperatingSweep(
        name, hoses, 7.5e5, Spectrum(lines, values, ("a", "b"), "m/s^2"), np.abs(values)
    )


def operating_test(*sweeps):
    """Make a test as far as the choice of sweeps sees it."""
    return SimpleNamespace(
        name="test",
        with_hoses=lambda state: tuple(one for one in sweeps if one.hoses is state),
    )


@pytest.mark.parametrize("sense", RotationSense)
def test_columns_of_a_rotor_turn_with_it(sense):
    """Force in z lags force in y by a quarter turn in the sense of rotation."""
    columns = rotor_columns([20.0], sense)[0] / (2 * np.pi * 20) ** 2
    time = np.linspace(0, 1, 17)
    turning = np.exp(2j * np.pi * time)
    across = (columns[[1, 2], 0][:, None] * turning).real
    np.testing.assert_allclose(across[0], np.cos(2 * np.pi * time), atol=1e-12)
    np.testing.assert_allclose(across[1], sense.value * np.sin(2 * np.pi * time), atol=1e-12)
    # a force on an arm along x: M = x × F
    moment = (columns[3:, 1][:, None] * turning).real
    np.testing.assert_allclose(moment, np.stack([0 * time, -across[1], across[0]]), atol=1e-12)
    gas = gas_columns(sense)
    np.testing.assert_array_equal(gas[:3, 2], columns[:3, 0])
    np.testing.assert_array_equal(gas[[0, 3], [0, 1]], 1)


def test_changes_of_the_mounts():
    mounts = np.ones((LINES.size, 6, 6), complex) * (2 + 1j)
    still = np.zeros((LINES.size, 6), complex)
    one = ONE_FACTOR.matrices(LINES, mounts, still)
    np.testing.assert_allclose(np.tensordot([-0.1, 0.2], one, axes=1), (-0.1 + 0.2j) * mounts)
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
    assert [one.name for one in used] == ["soft"]
    assert notices == []
    used, notices = sweeps_of(operating_test(standard), None)
    assert [one.name for one in used] == ["standard"]
    assert "no sweep with soft hoses" in notices[0]
    used, notices = sweeps_of(operating_test(standard, soft), HoseState.STANDARD)
    assert [one.name for one in used] == ["standard"]
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


def test_a_sweep_that_never_leaves_the_resonances_is_refused():
    modes = SimpleNamespace(frequency=np.array([10.0, 11, 17, 21, 28, 30]))
    refuse_resonant_sweep((sweep(),), modes)
    with pytest.raises(InputError, match="sweep slow ends at 2400 1/min and never leaves"):
        refuse_resonant_sweep((sweep("slow", lines=np.arange(17.0, 41.0)),), modes)


def test_hoses_that_are_seen_are_reported():
    quiet = ResidualBand(60, 90, 0.005, 1.4)
    loud = ResidualBand(90, 120, 0.08, 6.0)
    low = ResidualBand(20, 40, 0.3, 9.0)
    assert hose_alarms((sweep(),), (quiet, low)) == ()
    text = hose_alarms((sweep(),), (quiet, loud))[0]
    assert text.startswith("8.0% of the load in 90-120 Hz")
    assert "reported as soft" in text
    standard = sweep(hoses=HoseState.STANDARD)
    assert "reported" not in hose_alarms((standard,), (loud,))[0]


def test_alarms_name_one_cause():
    state = SimpleNamespace(changed=True, statement="changed")
    found = SimpleNamespace(residual_bands=(), reduced_chi=1.0, remaining_chi=1.0)
    assert load_alarms((sweep(),), found, 0.0, state) == ("changed",)
    state.changed, found.reduced_chi = False, 7.0
    assert "by some 3.0% per direction" in load_alarms((sweep(),), found, 0.03, state)[0]
    found.remaining_chi = 5.0
    assert "5.0 times their noise" in load_alarms((sweep(),), found, 0.03, state)[0]
    found.residual_bands, state.changed = (ResidualBand(90, 120, 0.08, 6.0),), True
    assert len(load_alarms((sweep(),), found, 0.03, state)) == 1


def test_lines_without_noise_like_residuals():
    whitened = np.ones((40, 6), complex) * (1 + 1j)
    assert not unexplained_lines(whitened).any()
    whitened[20:30] *= 4
    whitened[:3] = np.nan
    marked = unexplained_lines(whitened)
    assert marked[20:30].all()
    assert not marked[:16].any()


def test_confidence_and_titles():
    with pytest.raises(InputError, match="confidence"):
        UnbalanceOptions(confidence=1.0)
    assert updated(MEASURED).title == "measured apparent mass (thesis), mounts updated"
