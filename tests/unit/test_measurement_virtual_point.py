"""Virtual point: names, values that do not change, and bad position sheets in words."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.measurement.channels import Spectrum
from deboom.measurement.sensors import Sensor, SensorKind
from deboom.measurement.virtual_point import (
    conditioning,
    motion_at_point,
    sensor_geometry,
    virtual_point,
)

PLACES = {"A1": (0.1, 0, 0), "A2": (0, 0.1, 0), "A3": (0, 0, 0.1), "A4": (-0.1, 0.02, 0.03)}


def sensor(name, place, kind=SensorKind.ACCELEROMETER, turn=None):
    turn = np.eye(3) if turn is None else turn
    return Sensor(name, kind, "356A", "", "", np.array(place, dtype=float), turn)


def sensors(*names):
    return [sensor(name, PLACES[name]) for name in names or PLACES]


def spectrum(channels, unit="m/s^2"):
    generator = np.random.default_rng(1)
    values = generator.normal(size=(4, len(channels))) + 1j
    return Spectrum(np.arange(1.0, 5.0), values, tuple(channels), unit)


def test_switched_off_channels_are_not_looked_at():
    geometry = sensor_geometry(sensors(), switched_off=("A2 y", "A4 x"))
    assert len(geometry.channels) == 10
    assert {"A2 y", "A4 x"}.isdisjoint(geometry.channels)
    full = spectrum([c for s in sensors() for c in s.channels])
    point = virtual_point(geometry)
    found = motion_at_point(point, full)
    values = full.values.copy()
    values[:, list(full.channels).index("A2 y")] = 1e6
    spoiled = Spectrum(full.frequency, values, full.channels, full.unit)
    assert np.array_equal(motion_at_point(point, spoiled).values, found.values)
    assert found.unit == "m/s^2"
    with pytest.raises(InputError, match="no channel named"):
        motion_at_point(point, full.select(["A1 x", "A1 y"]))


def test_too_many_channels_off_is_refused_by_the_direction_that_is_gone():
    off = tuple(f"{name} z" for name in PLACES)
    state = conditioning(sensor_geometry(sensors(), switched_off=off))
    assert state.rank == 5
    assert state.worst_seen == "translation along (0, 0, 1)"
    assert not state.complete
    assert state.condition_number == np.inf
    one = conditioning(
        sensor_geometry(sensors("A1", "A2", "A3"), switched_off=("A1 x", "A2 x", "A3 x"))
    )
    assert one.rank == 5
    assert one.worst_seen == "translation along (1, 0, 0)"


def test_redundancy_of_a_symmetric_sheet():
    """Six sensors at ±a on the axes: V'V is diagonal, 6 and 4 a²."""
    a = 0.2
    places = [s * a * np.eye(3)[k] for k in range(3) for s in (1, -1)]
    geometry = sensor_geometry([sensor(f"A{k}", p) for k, p in enumerate(places)])
    state = conditioning(geometry)
    assert state.length == pytest.approx(a)
    assert state.condition_number == pytest.approx(np.sqrt(6 / 4))
    # trace of the residual projection: 18 channels minus 6 motions
    assert state.redundancy.sum() == pytest.approx(12.0)
    # a radial channel sees one translation only
    assert state.redundancy[0] == pytest.approx(1 - 1 / 6)
    assert state.redundancy[1] == pytest.approx(1 - 1 / 6 - 1 / 4)


def test_a_channel_without_redundancy_is_seen():
    geometry = sensor_geometry(sensors("A1", "A2", "A3"), switched_off=("A2 x", "A3 x", "A2 y"))
    assert conditioning(geometry).redundancy == pytest.approx(np.zeros(6), abs=1e-12)
