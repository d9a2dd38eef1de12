"""Consistency, reciprocity, passivity: closed forms, a peer's formulas, and what they catch."""

import numpy as np
import pytest

from deboom.measurement.channel_geometry import impact_geometry, sensor_geometry
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.coherence import CHANCE, likeness, repeat_coherence
from deboom.measurement.consistency import (
    excitation_consistency,
    geometric_consistency,
    response_consistency,
)
from deboom.measurement.fault_fits import Fault
from deboom.measurement.passivity import passivity
from deboom.measurement.reciprocity import reciprocity
from deboom.measurement.virtual_point import virtual_point, virtual_point_frf
from deboom.physics.frf import FrfForm, convert
from hammer_test import CAREFUL, draw_fault, draw_hammer_test, measure


@pytest.fixture(scope="module")
def hammer():
    generator = np.random.default_rng(11)
    test = draw_hammer_test(generator)
    response = virtual_point(sensor_geometry(test.sensors))
    excitation = virtual_point(impact_geometry(test.impacts))
    return test, response, excitation, generator


def test_likeness_of_unrelated_functions_is_one_half():
    generator = np.random.default_rng(1)
    a, b = generator.normal(size=(2, 20000)) + 1j * generator.normal(size=(2, 20000))
    assert likeness(a, b).mean() == pytest.approx(CHANCE, abs=0.01)
    assert likeness(a, a) == pytest.approx(np.ones(20000))
    assert likeness(a, -a) == pytest.approx(np.zeros(20000))
    assert likeness(a, 0 * a) == pytest.approx(np.full(20000, 0.5))


@pytest.mark.parametrize("other", [np.exp(1j * np.pi / 3), 2 + np.sqrt(3), 2 - np.sqrt(3)])
def test_halfway_means_sixty_degrees_or_a_factor_of_3_7(other):
    assert likeness(1.0, other) == pytest.approx(0.75)


def test_repeats_of_noise_have_one_nth():
    generator = np.random.default_rng(2)
    noise = generator.normal(size=(4, 20000)) + 1j * generator.normal(size=(4, 20000))
    assert repeat_coherence(noise).mean() == pytest.approx(1 / 4, abs=0.01)
    # signal to noise 10: (1 + 0.01/n) / (1 + 0.01), to first order in the noise
    noisy = 1 + 0.1 * noise / np.sqrt(2)
    assert repeat_coherence(noisy).mean() == pytest.approx(1.0025 / 1.01, abs=2e-4)


def test_geometric_consistency_by_hand(hammer):
    _, response, _, generator = hammer
    values = generator.normal(size=(5, 18)) + 1j * generator.normal(size=(5, 18))
    error = values - values @ (response.forward @ np.linalg.pinv(response.forward)).T
    largest = max(np.abs(values.real).max(), np.abs(values.imag).max())
    by_hand = (np.abs(error.real) + np.abs(error.imag)).sum(axis=0) / (largest * 2 * 5)
    spectrum = Spectrum(np.arange(1.0, 6.0), values, response.channels, "m/s^2")
    found = geometric_consistency(response, spectrum)
    assert list(found) == list(response.channels)
    assert np.array(list(found.values())) == pytest.approx(by_hand, rel=1e-10)
    # as printed, without absolute values, errors of opposite sign cancel
    printed = np.abs(error.real.sum(axis=0) + error.imag.sum(axis=0)) / (largest * 2 * 5)
    assert np.median(printed) < 0.6 * np.median(by_hand)


def test_rigid_consistency_is_the_peers_where_the_peer_is_right(hammer):
    test, response, excitation, generator = hammer
    measured = measure(test, generator, errors=CAREFUL)
    one_push = measured.select(inputs=measured.inputs[:1])
    u = one_push.values[:, :, 0]
    filtered = u @ (response.forward @ np.linalg.pinv(response.forward)).T
    found = response_consistency(response, one_push)
    overall = np.linalg.norm(filtered, axis=1) / np.linalg.norm(u, axis=1)
    coherence = np.abs(u + filtered) ** 2 / (2 * (np.abs(u) ** 2 + np.abs(filtered) ** 2))
    assert found.overall == pytest.approx(overall, rel=1e-12)
    assert found.specific == pytest.approx(coherence, rel=1e-12)
    one_channel = measured.select(outputs=measured.outputs[:1])
    y = one_channel.values[:, 0, :]
    filtered = y @ (excitation.forward @ np.linalg.pinv(excitation.forward)).T
    found = excitation_consistency(excitation, one_channel)
    assert found.overall == pytest.approx(
        np.linalg.norm(filtered, axis=1) / np.linalg.norm(y, axis=1), rel=1e-12
    )


def test_with_force_weights_the_transposed_filter_spoils_a_rigid_body(hammer):
    test, _, _, generator = hammer
    measured = measure(test, generator, noise=0.0)
    weights = dict(zip(measured.inputs, 10 ** generator.uniform(-1, 1, 18), strict=True))
    excitation = virtual_point(impact_geometry(test.impacts, weights=weights))
    forward, w = excitation.forward, np.diag(excitation.geometry.weights)
    forces = w @ forward @ np.linalg.inv(forward.T @ w @ forward)
    assert excitation.inverse == pytest.approx(forces.T, rel=1e-9, abs=1e-12)
    as_elsewhere = measured.values @ (forward @ forces.T)
    norm = np.linalg.norm(as_elsewhere, axis=2) / np.linalg.norm(measured.values, axis=2)
    assert np.abs(norm - 1).max() > 0.02
    found = excitation_consistency(excitation, measured)
    assert found.overall == pytest.approx(np.ones(measured.frequency.size), abs=1e-12)
    assert found.specific.min() > 1 - 1e-12


def test_overall_consistency_never_exceeds_one_with_weights(hammer):
    test, _, _, generator = hammer
    weights = {name: 10 ** generator.uniform(-2, 2) for s in test.sensors for name in s.channels}
    point = virtual_point(sensor_geometry(test.sensors, weights=weights))
    values = generator.normal(size=(50, 18)) + 1j * generator.normal(size=(50, 18))
    noise = Spectrum(np.arange(1.0, 51.0), values, point.channels, "m/s^2")
    overall = response_consistency(point, noise).overall
    assert overall.max() <= 1.0
    equal = response_consistency(virtual_point(sensor_geometry(test.sensors)), noise).overall
    assert np.mean(equal**2) == pytest.approx(6 / 18, abs=0.05)


@pytest.mark.parametrize(("kind", "least"), [(Fault.SIGN, 0.02), (Fault.AXES, 0.02)])
def test_geometric_consistency_flags_reversed_and_swapped_channels(kind, least):
    for seed in range(1, 9):
        generator = np.random.default_rng(seed)
        test = draw_hammer_test(generator)
        point = virtual_point(sensor_geometry(test.sensors))
        fault = draw_fault(test, kind, generator)
        clean = measure(test, generator, errors=CAREFUL)
        assert max(geometric_consistency(point, clean).values()) < 0.01
        faulty = measure(test, generator, errors=CAREFUL, fault=fault)
        assert max(geometric_consistency(point, faulty).values()) > least


def at_point(test, response, excitation, generator, **errors):
    measured = measure(test, generator, **errors)
    return virtual_point_frf(measured, response=response, excitation=excitation)


def test_reciprocity_falls_with_a_gyroscopic_pair_and_names_it(hammer):
    test, response, excitation, generator = hammer
    found = at_point(test, response, excitation, generator)
    assert reciprocity(found).worst()[1] > 0.95
    values = found.values.copy()
    values[:, 1, 3] *= -1.0
    turned = Frf(found.frequency, values, found.outputs, found.inputs, found.unit)
    pair, value = reciprocity(turned).worst(smallest=0.0)
    assert pair == "y–rx"
    assert value < 0.1


def test_power_of_every_force_is_what_the_margin_bounds(hammer):
    test, *_, generator = hammer
    names = ("x", "y", "z", "rx", "ry", "rz")
    frf = Frf(test.frequency, test.inertance, names, tuple("f" + n for n in names), "m/s^2/N")
    found = passivity(frf, FrfForm.INERTANCE, 0.1)
    mobility = convert(frf.values, frf.frequency, FrfForm.INERTANCE, FrfForm.MOBILITY)
    force = generator.normal(size=(2, 200, 6))
    force = (force[0] + 1j * force[1]) * [1, 1, 1, 0.1, 0.1, 0.1]
    power = np.einsum("ti,fij,tj->ft", force.conj(), mobility, force).real
    size = np.sum(np.abs(force / [1, 1, 1, 0.1, 0.1, 0.1]) ** 2, axis=1)
    scale = np.array([1, 1, 1, 0.1, 0.1, 0.1])
    largest = np.linalg.norm(mobility * np.outer(scale, scale), ord=2, axis=(1, 2))
    assert np.all(power / size / largest[:, np.newaxis] >= found.margin[:, np.newaxis] - 1e-12)
    assert found.margin.min() > 0
    # the apparent mass takes the same power
    inverse = Frf(frf.frequency, np.linalg.inv(frf.values), frf.inputs, names, "N s^2/m")
    loads = Frf(
        inverse.frequency,
        inverse.values,
        ("fx", "fy", "fz", "mx", "my", "mz"),
        names,
        inverse.unit,
    )
    assert passivity(loads, FrfForm.APPARENT_MASS, 0.1).margin.min() > 0


def test_one_degree_of_freedom_has_the_phase_of_its_inertance():
    frequency = np.linspace(5, 50, 40)
    omega = 2 * np.pi * frequency
    receptance = 1 / (1e5 * (1 + 0.1j) - 2.0 * omega**2)
    inertance = (-(omega**2) * receptance)[:, np.newaxis, np.newaxis]
    frf = Frf(frequency, inertance, ("x",), ("fx",), "m/s^2/N")
    found = passivity(frf, FrfForm.INERTANCE, 1.0)
    phase = np.angle(inertance[:, 0, 0])
    assert np.all((phase > 0) & (phase < np.pi))
    assert found.driving_point[:, 0] == pytest.approx(np.sin(phase), rel=1e-9)
    assert found.margin == pytest.approx(np.sin(phase), rel=1e-9)
    reversed_sensor = Frf(frequency, -inertance, ("x",), ("fx",), "m/s^2/N")
    assert passivity(reversed_sensor, FrfForm.INERTANCE, 1.0).active_share == 1.0
