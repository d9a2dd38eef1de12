"""A roving-hammer test as a value: what does not fit together is refused."""

from dataclasses import replace

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.measurement.channels import Frf
from deboom.measurement.compressor_test import (
    ACCELERATION_PER_FORCE,
    CompressorMount,
    Drawing,
    InertanceTest,
)
from deboom.measurement.sensors import Impact, PlacementTolerances, Sensor, SensorKind

SENSORS = tuple(
    Sensor(f"A{k}", SensorKind.ACCELEROMETER, "", "", "", np.eye(3)[k], np.eye(3)) for k in range(3)
)
IMPACTS = tuple(Impact(f"I{k}", np.eye(3)[k // 2], np.eye(3)[k % 3]) for k in range(6))
CHANNELS = tuple(f"A{k} {axis}" for k in range(3) for axis in "xyz")
NAMES = tuple(impact.name for impact in IMPACTS)


def frf(lines=(10.0, 11.0)):
    values = np.ones((len(lines), len(CHANNELS), len(NAMES)))
    return Frf(np.array(lines), values, CHANNELS, NAMES, ACCELERATION_PER_FORCE)


TEST = InertanceTest(
    "test", SENSORS, IMPACTS, frf(), np.full((2, 9, 6), 0.9), 5, PlacementTolerances()
)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"frf": frf(lines=(0.0, 1.0))}, "line at 0 Hz"),
        ({"coherence": np.ones((2, 9, 5))}, r"shape \(2, 9, 5\)"),
        ({"coherence": np.full((2, 9, 6), np.nan)}, "not finite"),
        ({"coherence": np.full((2, 9, 6), 1.2)}, "between 0 and 1"),
    ],
)
def test_what_does_not_fit_is_refused(changes, words):
    with pytest.raises(InputError, match=words):
        replace(TEST, **changes)


def test_a_drawing_is_a_body_on_mounts():
    mount = CompressorMount("mount 1", np.zeros(3), np.zeros(3), np.ones(3))
    drawing = Drawing(6.8, np.zeros(3), np.eye(3), (mount,))
    assert replace(TEST, drawing=drawing).drawing.mounts[0].name == "mount 1"
    with pytest.raises(InputError, match="mount 1: a static stiffness must be positive"):
        replace(mount, stiffness=np.array([1.0, 0.0, 1.0]))
    with pytest.raises(InputError, match="mount 1: position: shape"):
        replace(mount, position=np.zeros(2))


@pytest.mark.parametrize("value", [0.0, -0.1, np.nan, np.inf])
def test_a_tolerance_is_never_nothing(value):
    with pytest.raises(InputError, match="tolerance hammer_gain"):
        PlacementTolerances(hammer_gain=value)
