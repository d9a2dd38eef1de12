import numpy as np
import pytest

from deboom.errors import InputError
from deboom.physics.orders import dominant_order, frequency_of_order, rpm_of_frequency


def test_order_one_and_a_half_at_the_thesis_axis_ends():
    np.testing.assert_allclose(frequency_of_order([800, 2400, 3200], 1.5), [20, 60, 80])


def test_first_order_of_the_compressor():
    assert frequency_of_order(3000, 1) == 50


@pytest.mark.parametrize("order", [0.5, 1.0, 1.5, 2.0])
def test_inverse(order):
    rpm = np.linspace(700, 8000, 50).reshape(5, 10)
    there_and_back = rpm_of_frequency(frequency_of_order(rpm, order), order)
    np.testing.assert_allclose(there_and_back, rpm, rtol=1e-14)


@pytest.mark.parametrize(("cylinders", "order"), [(1, 0.5), (2, 1.0), (3, 1.5), (4, 2.0), (6, 3.0)])
def test_dominant_order_of_four_stroke_engines(cylinders, order):
    assert dominant_order(cylinders) == order


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
