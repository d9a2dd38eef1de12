import numpy as np
import pytest

from deboom.errors import InputError
from deboom.measurement.channels import Spectrum
from deboom.measurement.load_case import LoadCase

FREQUENCY = np.array([20.0, 20.5, 21.0])


def load_case(**changes):
    values = np.ones((3, 1), dtype=complex)
    content = {
        "name": "g5",
        "title": "5th gear",
        "gear": 5,
        "total_ratio": 3.4,
        "torque_limit": 220.0,
        "order": 1.5,
        "displacement": Spectrum(FREQUENCY, values, ("TSM x",), "m"),
        "force": Spectrum(FREQUENCY, values, ("TSM x",), "N"),
    }
    return LoadCase(**(content | changes))


def test_wheel_torque_is_engine_torque_times_total_ratio():
    torque = np.array([10.0, 20.0, 40.0])
    case = load_case(engine_torque=torque)
    torque[0] = -1.0  # the caller's array stays the caller's
    np.testing.assert_allclose(case.wheel_torque, [34.0, 68.0, 136.0])
    with pytest.raises(ValueError, match="read-only"):
        case.engine_torque[0] = 0.0


def test_a_run_without_torque_is_fine_until_the_torque_is_needed():
    case = load_case()
    assert case.engine_torque is None
    with pytest.raises(InputError, match="g5: its engine torque was not recorded: add its table"):
        _ = case.wheel_torque


@pytest.mark.parametrize(
    ("torque", "words"),
    [
        (np.ones(2), r"shape \(2,\), expected one value for each of 3 lines"),
        (np.ones((3, 1)), r"shape \(3, 1\)"),
        (np.array([1.0, np.nan, 1.0]), "at 20.5 Hz is not finite"),
    ],
)
def test_a_torque_that_does_not_fit_is_refused(torque, words):
    with pytest.raises(InputError, match=words):
        load_case(engine_torque=torque)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"force": Spectrum(FREQUENCY, np.ones((3, 1)), ("TSM z",), "N")},
            "displacement channels .* and force channels .* differ",
        ),
        (
            {"force": Spectrum(FREQUENCY + 1, np.ones((3, 1)), ("TSM x",), "N")},
            "frequency axes of displacement and force differ",
        ),
        (
            {"force": Spectrum(FREQUENCY, np.ones((3, 1)), ("TSM x",), "kN")},
            "force is in kN, expected N",
        ),
    ],
)
def test_spectra_that_do_not_belong_together_are_refused(changes, words):
    with pytest.raises(InputError, match=words):
        load_case(**changes)
