"""Leave-one-out names the sensor that we spoiled; the campaign over 300 set-ups is a claim."""

import numpy as np
import pytest

from deboom.measurement.channel_geometry import impact_geometry, sensor_geometry
from deboom.measurement.channels import Frf
from deboom.measurement.culprit import (
    culprit_of_excitation,
    culprit_of_responses,
    find_culprit,
)
from deboom.measurement.fault_fits import Fault
from deboom.measurement.tolerances import Tolerances
from deboom.measurement.virtual_point import virtual_point
from hammer_test import CAREFUL, EXACT, OFFSET, draw_fault, draw_hammer_test, measure

SEEDS = range(1, 6)


def diagnose(seed, kind, *, n_sensor=6, errors=EXACT, noise=0.01):
    generator = np.random.default_rng(seed)
    test = draw_hammer_test(generator, n_sensor)
    fault = draw_fault(test, kind, generator) if kind else None
    measured = measure(test, generator, fault=fault, errors=errors, noise=noise)
    point = virtual_point(sensor_geometry(test.sensors))
    return culprit_of_responses(point, measured, errors), fault


@pytest.mark.parametrize("kind", [Fault.SIGN, Fault.AXES, Fault.OFFSET])
@pytest.mark.parametrize("n_sensor", [6, 4])
def test_sensor_and_fault_are_named(kind, n_sensor):
    for seed in SEEDS:
        found, fault = diagnose(seed, kind, n_sensor=n_sensor)
        assert found.named, found.verdict
        assert found.suspect.name == fault.sensor
        assert found.suspect.fault is kind
        if kind is not Fault.OFFSET:
            assert set(found.suspect.channels) == set(fault.channels)
        assert found.suspect.residual_undone < 0.02 < found.residual_of_all
        assert found.residual_without[fault.sensor] == min(found.residual_without.values())


def test_the_size_of_an_offset_is_found():
    found, fault = diagnose(1, Fault.OFFSET, noise=0.0)
    x, y, z = 1e3 * fault.offset
    assert f"sits {1e3 * OFFSET:.1f} mm" in found.suspect.detail
    assert f"({x:+.1f}, {y:+.1f}, {z:+.1f}) mm" in found.suspect.detail
    assert found.verdict.startswith(f"{fault.sensor}: wrong position")


def test_nobody_is_accused_without_a_fault():
    for seed in SEEDS:
        for errors in (EXACT, CAREFUL):
            assert not diagnose(seed, None, errors=errors)[0].named
    perfect, _ = diagnose(1, None, noise=0.0)
    assert perfect.suspect is None
    assert "agree to rounding" in perfect.verdict


def test_what_tolerances_allow_is_nobodys_fault():
    found, fault = diagnose(3, Fault.OFFSET)
    assert found.named
    generator = np.random.default_rng(3)
    test = draw_hammer_test(generator)
    measured = measure(test, generator, fault=draw_fault(test, Fault.OFFSET, generator))
    point = virtual_point(sensor_geometry(test.sensors))
    rough = culprit_of_responses(point, measured, Tolerances(sensor_position=0.02))
    assert not rough.named
    assert rough.suspect.name == fault.sensor
    assert "times what the tolerances let expect" in rough.verdict


def test_real_sheets_hide_offsets_but_no_reversed_or_swapped_channel():
    for seed in SEEDS:
        for kind in (Fault.SIGN, Fault.AXES):
            found, fault = diagnose(seed, kind, errors=CAREFUL)
            assert (found.named, found.suspect.name, found.suspect.fault) == (
                True,
                fault.sensor,
                kind,
            )


def test_three_sensors_name_a_reversed_channel_and_accuse_nobody_of_more():
    for seed in SEEDS:
        found, fault = diagnose(seed, Fault.SIGN, n_sensor=3)
        assert found.named
        assert found.suspect.name == fault.channels[0]
        for kind in (Fault.AXES, Fault.OFFSET):
            assert not diagnose(seed, kind, n_sensor=3)[0].named
    swapped, _ = diagnose(1, Fault.AXES, n_sensor=3)
    assert "fourth triaxial sensor" in swapped.verdict


def spoiled(seed, spoil):
    """Frequency responses of six sensors after `spoil` has changed them."""
    generator = np.random.default_rng(seed)
    test = draw_hammer_test(generator)
    measured = measure(test, generator)
    values = measured.values.copy()
    spoil(values, generator)
    point = virtual_point(sensor_geometry(test.sensors))
    again = Frf(measured.frequency, values, measured.outputs, measured.inputs, measured.unit)
    return culprit_of_responses(point, again, EXACT)


def test_dead_channel():
    def spoil(values, generator):
        values[:, 4] = 1e-4 * generator.normal(size=values[:, 4].shape)

    found = spoiled(1, spoil)
    assert found.named
    assert found.suspect.fault is Fault.DEAD
    assert found.suspect.channels == ("A2 y",)


def test_wrong_sensitivity():
    def spoil(values, generator):
        values[:, 8] *= 1.25

    found = spoiled(2, spoil)
    assert found.named
    assert found.suspect.fault is Fault.GAIN
    assert found.suspect.channels == ("A3 z",)
    assert "shows 1.25 times" in found.verdict


def test_sensor_turned_by_twelve_degrees():
    def spoil(values, generator):
        c, s = np.cos(np.deg2rad(12)), np.sin(np.deg2rad(12))
        values[:, [9, 10]] = np.einsum("ab,fbi->fai", [[c, s], [-s, c]], values[:, [9, 10]])

    found = spoiled(3, spoil)
    assert found.named
    assert found.suspect.name == "A4"
    assert found.suspect.fault is Fault.TILT
    assert "turned by 12.0°" in found.verdict


def test_sensor_turned_by_a_quarter():
    def spoil(values, generator):
        values[:, [15, 16]] = np.stack([values[:, 16], -values[:, 15]], axis=1)

    found = spoiled(4, spoil)
    assert found.suspect.fault is Fault.AXES
    assert found.verdict == "A6: swapped axes, A6 x carries y, A6 y carries −x"


def test_loose_channel_is_named_without_an_explanation():
    def spoil(values, generator):
        loud = np.abs(values[:, 3])
        values[:, 3] += loud * (generator.normal(size=loud.shape) + 1j)

    found = spoiled(5, spoil)
    assert found.named
    assert found.suspect.fault is Fault.UNEXPLAINED
    assert found.suspect.channels == ("A2 x",)
    assert "noise, cable or loose sensor" in found.verdict


def test_reversed_impact():
    generator = np.random.default_rng(6)
    test = draw_hammer_test(generator)
    measured = measure(test, generator)
    values = measured.values.copy()
    values[:, :, 11] *= -1
    again = Frf(measured.frequency, values, measured.outputs, measured.inputs, measured.unit)
    point = virtual_point(impact_geometry(test.impacts))
    found = culprit_of_excitation(point, again, EXACT)
    assert (found.named, found.suspect.name, found.suspect.fault) == (True, "I12", Fault.SIGN)
    clean = culprit_of_excitation(point, measured, EXACT)
    assert not clean.named


def test_weights_and_switched_off_channels_do_not_confuse():
    generator = np.random.default_rng(7)
    test = draw_hammer_test(generator)
    fault = draw_fault(test, Fault.SIGN, generator)
    measured = measure(test, generator, fault=fault)
    healthy = [s for s in test.sensors if s.name != fault.sensor]
    off = (healthy[0].channels[1], healthy[1].channels[2])
    weights = {healthy[2].channels[0]: 0.2}
    geometry = sensor_geometry(test.sensors, switched_off=off, weights=weights)
    found = culprit_of_responses(virtual_point(geometry), measured, EXACT)
    assert found.named
    assert found.suspect.channels == fault.channels


def test_nothing_can_be_said_without_redundancy():
    generator = np.random.default_rng(8)
    test = draw_hammer_test(generator, n_sensor=3)
    names = [c for s in test.sensors for c in s.channels]
    for off in ((names[0], names[4], names[8]), (names[1], names[5], names[6])):
        geometry = sensor_geometry(test.sensors, switched_off=off)
        found = find_culprit(geometry, generator.normal(size=(9, 6)), EXACT)
        assert not found.named
        assert found.suspect is None
        assert "no redundancy" in found.verdict
