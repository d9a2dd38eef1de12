"""Virtual point transformation against rigid bodies whose motion and load are known exactly."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from deboom.errors import InputError
from deboom.measurement import quality, virtual_point
from deboom.measurement.channels import Spectrum
from deboom.measurement.path_forces import blocked_forces_in_situ
from deboom.measurement.sensors import Sensor, SensorKind
from deboom.physics.force_inversion import Inversion, Regularisation
from deboom.physics.frf import FrfForm
from deboom.physics.rigid_body import shift_matrix
from samples.hammer_test import draw_hammer_test, measure

SEEDS = (1,)


@pytest.fixture(scope="module", params=SEEDS)
def perfect(request):
    """Hammer test without noise."""
    generator = np.random.default_rng(request.param)
    test = draw_hammer_test(generator)
    return test, measure(test, generator, noise=0.0)


def points(test, position=(0.0, 0.0, 0.0)):
    return (
        virtual_point.virtual_point(virtual_point.sensor_geometry(test.sensors, position)),
        virtual_point.virtual_point(virtual_point.impact_geometry(test.impacts, position)),
    )


def spectrum(sensors, values, unit="m/s^2"):
    names = tuple(c for s in sensors for c in s.channels)
    return Spectrum(np.arange(20.0, 20.0 + len(values)), values, names, unit)


def relative_error(estimated, truth):
    return np.max(np.abs(estimated - truth)) / np.max(np.abs(truth))


def test_the_rigid_body_comes_back_from_both_sides(perfect):
    test, measured = perfect
    response, excitation = points(test)
    at_point = virtual_point.virtual_point_frf(measured, response=response, excitation=excitation)
    assert relative_error(at_point.values, test.inertance) < 1e-12
    assert at_point.outputs == ("x", "y", "z", "rx", "ry", "rz")
    assert at_point.inputs == ("fx", "fy", "fz", "mx", "my", "mz")
    # 1/m and 1/J: an angular acceleration per moment, each with its unit
    headers = at_point.table.columns
    assert "x per fx [(m/s^2)/N]" in headers
    assert "rx per mx [(rad/s^2)/(N m)]" in headers
    assert "x per my [(m/s^2)/(N m)]" in headers
    forces = at_point.select(("x", "y", "z"), ("fx", "fy", "fz"))
    assert forces.unit == "(m/s^2)/N"
    assert at_point.select(("rx", "ry"), ("mz",)).unit == "(rad/s^2)/(N m)"


def test_blocked_moments_are_in_newton_metres(perfect):
    """Forces and moments at the virtual point come back from what they make, each in its unit."""
    test, measured = perfect
    response, excitation = points(test)
    at_point = virtual_point.virtual_point_frf(measured, response=response, excitation=excitation)
    load = np.outer(np.exp(0.1j * at_point.frequency), [3.0, -2.0, 5.0, 0.2, 0.7, -0.4])
    units = ("N", "N", "N", "N m", "N m", "N m")
    motion = at_point @ Spectrum(at_point.frequency, load, at_point.inputs, units)
    assert motion.units == ("m/s^2",) * 3 + ("rad/s^2",) * 3
    blocked = blocked_forces_in_situ(at_point, motion, Inversion(Regularisation.NONE)).force
    assert blocked.units == units
    assert blocked.table.columns[-1] == "mz [N m]"
    assert relative_error(blocked.values, load) < 1e-9
    with pytest.raises(InputError, match=r"inputs of 'x' add up in .*: their units N, N, N, N"):
        at_point @ Spectrum(at_point.frequency, load, at_point.inputs, "N")
    wrong = Spectrum(at_point.frequency, load, at_point.outputs, ("m/s^2",) * 3 + ("N m",) * 3)
    with pytest.raises(InputError, match=r"the responses of the indicators are in m/s\^2, N m"):
        blocked_forces_in_situ(at_point, wrong)


def test_any_point_of_the_body_can_be_the_virtual_point(perfect):
    test, measured = perfect
    position = np.array([0.3, -0.2, 0.15])
    response, excitation = points(test, position)
    at_point = virtual_point.virtual_point_frf(measured, response=response, excitation=excitation)
    # motion of the point P: δ_P = χ(O − P) δ_O, loads with the transpose
    chi = shift_matrix(-position)
    assert relative_error(at_point.values, chi @ test.inertance @ chi.T) < 1e-11


def test_perfect_data_have_perfect_quality(perfect):
    test, measured = perfect
    response, excitation = points(test)
    assert max(quality.geometric_consistency(response, measured).values()) < 1e-14
    for consistency in (
        quality.response_consistency(response, measured),
        quality.excitation_consistency(excitation, measured),
    ):
        assert consistency.overall == pytest.approx(np.ones(measured.frequency.size), abs=1e-12)
        assert consistency.specific == pytest.approx(
            np.ones((measured.frequency.size, 18)), abs=1e-12
        )
    at_point = virtual_point.virtual_point_frf(measured, response=response, excitation=excitation)
    assert quality.reciprocity(at_point).likeness == pytest.approx(np.ones((6, 6)), abs=1e-9)
    power = quality.passivity(at_point, FrfForm.INERTANCE, 0.1)
    assert power.active_share == 0.0
    assert power.margin.min() > 0  # 15 % loss in every mount


def test_least_squares_is_the_least_of_all_sums():
    generator = np.random.default_rng(4)
    test = draw_hammer_test(generator, n_sensor=4)
    values = generator.normal(size=(1, 12)) + 1j * generator.normal(size=(1, 12))
    point = virtual_point.virtual_point(virtual_point.sensor_geometry(test.sensors))
    motion = virtual_point.motion_at_point(point, spectrum(test.sensors, values)).values[0]
    for part in (np.real, np.imag):
        # an iterative solver of bounded problems, without any bounds
        best = lsq_linear(point.forward, part(values[0]), tol=1e-14)
        assert part(motion) == pytest.approx(best.x, rel=1e-7, abs=1e-9)


PLACES = {"A1": (0.1, 0, 0), "A2": (0, 0.1, 0), "A3": (0, 0, 0.1), "A4": (-0.1, 0.02, 0.03)}


def sensor(name, place):
    kind = SensorKind.ACCELEROMETER
    return Sensor(name, kind, "", "", "", np.array(place, dtype=float), np.eye(3))


def sensors(*names):
    return [sensor(name, PLACES[name]) for name in names or PLACES]


def test_switched_off_channels_are_not_looked_at():
    geometry = virtual_point.sensor_geometry(sensors(), switched_off=("A2 y", "A4 x"))
    assert len(geometry.channels) == 10
    assert {"A2 y", "A4 x"}.isdisjoint(geometry.channels)
    full = spectrum(sensors(), np.random.default_rng(1).normal(size=(4, 12)) + 1j)
    point = virtual_point.virtual_point(geometry)
    motion = virtual_point.motion_at_point(point, full)
    values = full.values.copy()
    values[:, list(full.channels).index("A2 y")] = 1e6
    spoiled = Spectrum(full.frequency, values, full.channels, full.unit)
    assert np.array_equal(virtual_point.motion_at_point(point, spoiled).values, motion.values)
    assert motion.unit == ("m/s^2",) * 3 + ("rad/s^2",) * 3
    with pytest.raises(InputError, match="no channel named"):
        virtual_point.motion_at_point(point, full.select(["A1 x", "A1 y"]))


def test_too_many_channels_off_is_refused_by_the_direction_that_is_gone():
    off = tuple(f"{name} z" for name in PLACES)
    state = virtual_point.conditioning(virtual_point.sensor_geometry(sensors(), switched_off=off))
    assert state.rank == 5
    assert state.worst_seen == "translation along (0, 0, 1)"
    assert not state.complete
    assert state.condition_number == np.inf
    single = virtual_point.conditioning(
        virtual_point.sensor_geometry(
            sensors("A1", "A2", "A3"), switched_off=("A1 x", "A2 x", "A3 x")
        )
    )
    assert single.rank == 5
    assert single.worst_seen == "translation along (1, 0, 0)"


def test_redundancy_of_a_symmetric_sheet():
    """Six sensors at ±a on the axes: V'V is diagonal, 6 and 4 a²."""
    a = 0.2
    places = [s * a * np.eye(3)[k] for k in range(3) for s in (1, -1)]
    geometry = virtual_point.sensor_geometry([sensor(f"A{k}", p) for k, p in enumerate(places)])
    state = virtual_point.conditioning(geometry)
    assert state.length == pytest.approx(a)
    assert state.condition_number == pytest.approx(np.sqrt(6 / 4))
    # trace of the residual projection: 18 channels minus 6 motions
    assert state.redundancy.sum() == pytest.approx(12.0)
    # a radial channel sees one translation only
    assert state.redundancy[0] == pytest.approx(1 - 1 / 6)
    assert state.redundancy[1] == pytest.approx(1 - 1 / 6 - 1 / 4)


def test_a_channel_without_redundancy_is_seen():
    geometry = virtual_point.sensor_geometry(
        sensors("A1", "A2", "A3"), switched_off=("A2 x", "A3 x", "A2 y")
    )
    assert virtual_point.conditioning(geometry).redundancy == pytest.approx(np.zeros(6), abs=1e-12)


def test_weights_are_those_of_generalised_least_squares(perfect):
    """Noise of unlike channels: the weighted point is the least squares of whitened channels."""
    test, _ = perfect
    geometry = virtual_point.sensor_geometry(test.sensors)
    generator = np.random.default_rng(5)
    deviation = np.exp(generator.normal(0.0, 1.0, len(geometry.channels)))
    motion = generator.standard_normal(6)
    seen = geometry.forward @ motion + deviation * generator.standard_normal(deviation.size)
    point = virtual_point.virtual_point(geometry, weight=1.0 / deviation**2)
    whitened = lsq_linear(geometry.forward / deviation[:, None], seen / deviation, method="bvls")
    assert np.allclose(point.inverse @ seen, whitened.x, atol=1e-6)
    assert np.allclose(point.inverse @ point.forward, np.eye(6))
    alike = virtual_point.virtual_point(geometry, weight=np.full(deviation.size, 7.0))
    assert np.allclose(alike.inverse, virtual_point.virtual_point(geometry).inverse)
    # one channel that hardly counts is one that is switched off
    hardly = np.where(np.arange(deviation.size) == 4, 1e-12, 1.0)
    off = virtual_point.sensor_geometry(test.sensors, switched_off=[geometry.channels[4]])
    without = virtual_point.virtual_point(off).inverse
    kept = np.delete(virtual_point.virtual_point(geometry, weight=hardly).inverse, 4, axis=1)
    assert np.allclose(kept, without, atol=1e-6)
    with pytest.raises(InputError, match="is 0: a weight is above 0; switch off"):
        virtual_point.virtual_point(geometry, weight=np.where(hardly < 1, 0.0, 1.0))


def test_translations_alone_need_three_channels_anywhere():
    """A single accelerometer, even right at the point, where a length would be 0."""
    turned = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    kind = SensorKind.ACCELEROMETER
    sensor = Sensor("S1", kind, "", "", "", np.array([0.1, 0.2, 0.3]), turned)
    geometry = virtual_point.sensor_geometry([sensor], sensor.position)
    point = virtual_point.virtual_point(geometry, motions=("x", "y", "z"))
    assert np.allclose(point.inverse, turned)
    assert point.conditioning.condition_number == pytest.approx(1.0)
    with pytest.raises(InputError, match="show only 2 of 3 motions"):
        virtual_point.virtual_point(
            virtual_point.sensor_geometry([sensor], sensor.position, switched_off=["S1 z"]),
            motions=("x", "y", "z"),
        )
    with pytest.raises(InputError, match="or x, y, z alone"):
        virtual_point.virtual_point(geometry, motions=("x", "y"))
