"""Virtual point: names, values that do not change, and bad position sheets in words."""

from dataclasses import replace

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.sensors import Impact, Sensor, SensorKind
from deboom.measurement.virtual_point import (
    ChannelGeometry,
    conditioning,
    impact_geometry,
    motion_at_point,
    sensor_geometry,
    virtual_point,
    virtual_point_frf,
)
from deboom.physics.rigid_body import forward_matrices

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


def test_forward_matrix_is_that_of_the_position_sheet():
    quarter = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    sheet = [*sensors("A1", "A2", "A3"), sensor("A4", PLACES["A4"], turn=quarter)]
    geometry = sensor_geometry(sheet)
    stacked = forward_matrices([s.position for s in sheet], [s.orientation for s in sheet])
    assert geometry.forward == pytest.approx(stacked, abs=1e-16)
    assert geometry.channels[:4] == ("A1 x", "A1 y", "A1 z", "A2 x")
    assert geometry.owners[:4] == ("A1", "A1", "A1", "A2")
    assert list(geometry.rows_of("A2")) == [3, 4, 5]
    # channel x of the turned sensor looks along y
    assert geometry.directions[9] == pytest.approx([0, 1, 0])


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


def test_two_sensors_are_refused_with_the_motion_they_miss():
    with pytest.raises(InputError) as refused:
        virtual_point(sensor_geometry(sensors("A1", "A2")))
    message = str(refused.value)
    assert "A1, A2 show only 5 of 6 motions" in message
    assert "characteristic length 0.1 m" in message
    # the line through (0.1, 0, 0) and (0, 0.1, 0)
    assert "rotation about the axis (" in message
    assert "0.707" in message
    assert "three triaxial sensors" in message


def test_sensors_on_one_line_are_refused():
    sheet = [sensor(f"A{k}", (0.1 * k, 0.2, 0.0)) for k in range(4)]
    with pytest.raises(InputError, match=r"through \(0, 0.2, 0\) m"):
        virtual_point(sensor_geometry(sheet))


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


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: sensor_geometry(sensors(), switched_off=("A9 x",)), "no channels .'A9 x'."),
        (lambda: sensor_geometry(sensors("A1", "A1")), "duplicated sensor"),
        (lambda: sensor_geometry(sensors(), (0.0, 0.0)), "three coordinates"),
        (
            lambda: sensor_geometry([*sensors(), sensor("C1", (0, 0, 0), SensorKind.FORCE_CELL)]),
            "sensors of one kind",
        ),
        (lambda: conditioning(sensor_geometry([])), "all of them are switched off"),
        (lambda: conditioning(sensor_geometry([sensor("A1", (0, 0, 0))])), "at the virtual point"),
        (lambda: Impact("I1", (0, 0, 0), (0, 0, 2.0)), "length 2"),
        (lambda: Impact("I1", (0, 0), (0, 0, 1.0)), "I1: position: shape"),
    ],
)
def test_bad_sheets_are_refused_in_words(call, words):
    with pytest.raises(InputError, match=words):
        call()


def test_geometry_checks_its_own_shapes():
    geometry = sensor_geometry(sensors())
    with pytest.raises(InputError, match="directions: shape"):
        replace(geometry, levers=np.zeros((2, 3)))
    with pytest.raises(InputError, match="2 owners for 12 channels"):
        replace(geometry, owners=("A1", "A2"))
    assert isinstance(geometry, ChannelGeometry)


def test_impacts_are_channels_of_their_own():
    impacts = [
        Impact(f"I{k}", place, direction)
        for k, (place, direction) in enumerate(
            (place, direction) for place in PLACES.values() for direction in np.eye(3)
        )
    ]
    geometry = impact_geometry(impacts)
    assert geometry.channels == geometry.owners
    assert len(geometry.channels) == 12
    load = geometry.forward[1]
    assert load == pytest.approx([0, 1, 0, *np.cross(PLACES["A1"], [0, 1, 0])])


def test_a_transformation_needs_a_side():
    frf = Frf([1.0], np.ones((1, 1, 1)), ("A1 x",), ("I1",), "m/s^2/N")
    with pytest.raises(InputError, match="responses, of the excitation, or both"):
        virtual_point_frf(frf)
