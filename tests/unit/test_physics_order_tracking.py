"""Orders and order tracking: refusals."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.physics.order_tracking import (
    angular_resample,
    dominant_order,
    frequency_of_order,
    lower_rate,
    order_amplitudes,
    rpm_of_frequency,
    samples_needed,
    vold_kalman,
)

RATE = 500.0
TIME = np.arange(1000) / RATE
ANGLE = 2 * np.pi * 20 * TIME
RECORD = np.cos(1.5 * ANGLE)[:, np.newaxis]
TURNS_BACK = np.where(TIME < 1, ANGLE, 2 * ANGLE[500] - ANGLE)
NOT_FINITE = np.where(np.arange(1000) == 7, np.nan, ANGLE)


@pytest.mark.parametrize(
    ("values", "angle", "samples", "message"),
    [
        (RECORD[:, 0], ANGLE, 64, "time record: shape"),
        (RECORD, ANGLE[:-1], 64, "shaft angle: shape"),
        (RECORD[:5], ANGLE[:5], 64, "5 samples are too few"),
        (RECORD, NOT_FINITE, 64, "not finite"),
        (RECORD, TURNS_BACK, 64, "must not turn back"),
        (RECORD, ANGLE, 0, "0 samples per revolution"),
    ],
)
def test_angular_resampling_refuses(values, angle, samples, message):
    with pytest.raises(InputError, match=message):
        angular_resample(values, angle, samples)


@pytest.mark.parametrize(
    ("order", "centre", "revolutions", "message"),
    [
        (1.5, 3.9, 8, "the window of 8 revolutions about revolution 3.90 leaves the record"),
        (1.5, 36.5, 8, "leaves the record, which has 0.00 to 39.9"),
        ([1.5, 0.25], 20.0, 6, "too short for order 0.25: give at least 8"),
        ([1.5, 0.0], 20.0, 6, "order 0 is not positive"),
    ],
)
def test_computed_order_tracking_refuses(order, centre, revolutions, message):
    resampled = angular_resample(RECORD, ANGLE, 64)
    with pytest.raises(InputError, match=message):
        order_amplitudes(*resampled, order, centre, revolutions)


def test_samples_needed_keep_the_rate_above_the_order():
    assert samples_needed(1200.0, 600.0, 3.0) == 123
    assert samples_needed(1201.0, 600.0, 3.0) == 124


@pytest.mark.parametrize(
    ("values", "phase", "bandwidth", "poles", "message"),
    [
        (RECORD, ANGLE[:, np.newaxis], 2.0, 4, "1, 2 or 3 poles, not 4"),
        (RECORD[:, 0], ANGLE[:, np.newaxis], 2.0, 2, "time record: shape"),
        (RECORD, ANGLE, 2.0, 2, "phase of the orders: shape"),
        (RECORD, np.empty((1000, 0)), 2.0, 2, "too few"),
        (RECORD[:4], ANGLE[:4, np.newaxis], 2.0, 2, "too few for a filter of 2 poles"),
        (RECORD, NOT_FINITE[:, np.newaxis], 2.0, 2, "not finite"),
        (RECORD, ANGLE[:, np.newaxis], [2.0, 3.0], 2, "bandwidths of the orders: shape"),
        (RECORD, TURNS_BACK[:, np.newaxis], 2.0, 2, "must not turn back"),
        (RECORD, ANGLE[:, np.newaxis], 0.0, 2, "are not between 0 and the rate, 500 Hz"),
        (RECORD, ANGLE[:, np.newaxis], 600.0, 2, "are not between 0 and the rate"),
        (RECORD, ANGLE[:, np.newaxis], 21.0, 2, "wider than the lowest frequency of its order, 20"),
        (RECORD, ANGLE[:, np.newaxis], 0.005, 3, "too narrow for 500 Hz and 3 poles"),
    ],
)
def test_vold_kalman_refuses(values, phase, bandwidth, poles, message):
    with pytest.raises(InputError, match=message):
        vold_kalman(values, phase, RATE, bandwidth, poles)


def test_lower_rate_refuses_or_leaves_alone():
    with pytest.raises(InputError, match="500 Hz is too low for 150 Hz: it needs 600 Hz"):
        lower_rate(RECORD, RATE, 150.0)
    with pytest.raises(InputError, match="30 samples are too few to lower the rate"):
        lower_rate(RECORD[:30], RATE, 5.0)
    values, rate = lower_rate(RECORD, RATE, 40.0)
    assert rate == RATE
    np.testing.assert_array_equal(values, RECORD)


@pytest.mark.parametrize("order", [0, -1.5, np.nan, np.inf])
def test_orders_that_do_not_exist_are_refused(order):
    with pytest.raises(InputError, match="cycles per revolution"):
        frequency_of_order(1000, order)
    with pytest.raises(InputError, match="cycles per revolution"):
        rpm_of_frequency(30, order)


@pytest.mark.parametrize("cylinders", [0, -3, 2.5, np.nan])
def test_numbers_of_cylinders_that_do_not_exist_are_refused(cylinders):
    with pytest.raises(InputError, match="whole number of at least 1"):
        dominant_order(cylinders)
