"""Quality and culprit on data of known faults, and on published data."""

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from deboom.measurement import quality, virtual_point
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.culprit import (
    Fault,
    culprit_of_excitation,
    culprit_of_responses,
    error_variance,
    find_culprit,
)
from deboom.measurement.quality import quality_in_operation
from deboom.measurement.sensors import Sensor, SensorKind, Tolerances
from deboom.measurement.virtual_point import sensor_geometry
from deboom.physics.frf import FrfForm, convert
from deboom.physics.rigid_body import rotation_matrix
from samples.hammer_test import CAREFUL, EXACT, OFFSET, draw_fault, draw_hammer_test, measure


@pytest.fixture(scope="module")
def hammer():
    generator = np.random.default_rng(11)
    test = draw_hammer_test(generator)
    response = virtual_point.virtual_point(virtual_point.sensor_geometry(test.sensors))
    excitation = virtual_point.virtual_point(virtual_point.impact_geometry(test.impacts))
    return test, response, excitation, generator


def test_likeness_of_unrelated_functions_is_one_half():
    generator = np.random.default_rng(1)
    a, b = generator.normal(size=(2, 20000)) + 1j * generator.normal(size=(2, 20000))
    assert quality.likeness(a, b).mean() == pytest.approx(quality.CHANCE, abs=0.01)
    assert quality.likeness(a, a) == pytest.approx(np.ones(20000))
    assert quality.likeness(a, -a) == pytest.approx(np.zeros(20000))
    assert quality.likeness(a, 0 * a) == pytest.approx(np.full(20000, 0.5))
    assert quality.likeness([0.0], [0.0]) == pytest.approx([1.0])  # silence agrees with silence


@pytest.mark.parametrize("other", [np.exp(1j * np.pi / 3), 2 + np.sqrt(3), 2 - np.sqrt(3)])
def test_halfway_means_sixty_degrees_or_a_factor_of_3_7(other):
    assert quality.likeness(1.0, other) == pytest.approx(0.75)


def test_geometric_consistency_by_hand(hammer):
    _, response, _, generator = hammer
    values = generator.normal(size=(5, 18)) + 1j * generator.normal(size=(5, 18))
    error = values - values @ (response.forward @ np.linalg.pinv(response.forward)).T
    largest = max(np.abs(values.real).max(), np.abs(values.imag).max())
    by_hand = (np.abs(error.real) + np.abs(error.imag)).sum(axis=0) / (largest * 2 * 5)
    spectrum = Spectrum(np.arange(1.0, 6.0), values, response.channels, "m/s^2")
    consistency = quality.geometric_consistency(response, spectrum)
    assert list(consistency) == list(response.channels)
    assert np.array(list(consistency.values())) == pytest.approx(by_hand, rel=1e-10)
    # as printed, without absolute values, errors of opposite sign cancel
    printed = np.abs(error.real.sum(axis=0) + error.imag.sum(axis=0)) / (largest * 2 * 5)
    assert np.median(printed) < 0.6 * np.median(by_hand)


def test_rigid_consistency_is_the_peers_where_the_peer_is_right(hammer):
    test, response, excitation, generator = hammer
    measured = measure(test, generator, errors=CAREFUL)
    one_push = measured.select(inputs=measured.inputs[:1])
    u = one_push.values[:, :, 0]
    filtered = u @ (response.forward @ np.linalg.pinv(response.forward)).T
    consistency = quality.response_consistency(response, one_push)
    overall = np.linalg.norm(filtered, axis=1) / np.linalg.norm(u, axis=1)
    coherence = np.abs(u + filtered) ** 2 / (2 * (np.abs(u) ** 2 + np.abs(filtered) ** 2))
    assert consistency.overall == pytest.approx(overall, rel=1e-12)
    assert consistency.specific == pytest.approx(coherence, rel=1e-12)
    one_channel = measured.select(outputs=measured.outputs[:1])
    y = one_channel.values[:, 0, :]
    filtered = y @ (excitation.forward @ np.linalg.pinv(excitation.forward)).T
    consistency = quality.excitation_consistency(excitation, one_channel)
    assert consistency.overall == pytest.approx(
        np.linalg.norm(filtered, axis=1) / np.linalg.norm(y, axis=1), rel=1e-12
    )


@pytest.mark.parametrize(("kind", "least"), [(Fault.SIGN, 0.02), (Fault.AXES, 0.02)])
def test_geometric_consistency_flags_reversed_and_swapped_channels(kind, least):
    for seed in range(1, 9):
        generator = np.random.default_rng(seed)
        test = draw_hammer_test(generator)
        point = virtual_point.virtual_point(virtual_point.sensor_geometry(test.sensors))
        fault = draw_fault(test, kind, generator)
        clean = measure(test, generator, errors=CAREFUL)
        assert max(quality.geometric_consistency(point, clean).values()) < 0.01
        faulty = measure(test, generator, errors=CAREFUL, fault=fault)
        assert max(quality.geometric_consistency(point, faulty).values()) > least


def at_point(test, response, excitation, generator, **errors):
    measured = measure(test, generator, **errors)
    return virtual_point.virtual_point_frf(measured, response=response, excitation=excitation)


def test_reciprocity_falls_with_a_gyroscopic_pair_and_names_it(hammer):
    test, response, excitation, generator = hammer
    frf = at_point(test, response, excitation, generator)
    assert quality.reciprocity(frf).worst()[1] > 0.95
    values = frf.values.copy()
    values[:, 1, 3] *= -1.0
    turned = Frf(frf.frequency, values, frf.outputs, frf.inputs, frf.unit)
    pair, value = quality.reciprocity(turned).worst(smallest=0.0)
    assert pair == "y–rx"
    assert value < 0.1


def test_power_of_every_force_is_what_the_margin_bounds(hammer):
    test, *_, generator = hammer
    names = ("x", "y", "z", "rx", "ry", "rz")
    frf = Frf(test.frequency, test.inertance, names, tuple("f" + n for n in names), "m/s^2/N")
    passivity = quality.passivity(frf, FrfForm.INERTANCE, 0.1)
    mobility = convert(frf.values, frf.frequency, FrfForm.INERTANCE, FrfForm.MOBILITY)
    force = generator.normal(size=(2, 200, 6))
    force = (force[0] + 1j * force[1]) * [1, 1, 1, 0.1, 0.1, 0.1]
    power = np.einsum("ti,fij,tj->ft", force.conj(), mobility, force).real
    size = np.sum(np.abs(force / [1, 1, 1, 0.1, 0.1, 0.1]) ** 2, axis=1)
    scale = np.array([1, 1, 1, 0.1, 0.1, 0.1])
    largest = np.linalg.norm(mobility * np.outer(scale, scale), ord=2, axis=(1, 2))
    assert np.all(power / size / largest[:, np.newaxis] >= passivity.margin[:, np.newaxis] - 1e-12)
    assert passivity.margin.min() > 0
    # the apparent mass takes the same power
    inverse = Frf(frf.frequency, np.linalg.inv(frf.values), frf.inputs, names, "N s^2/m")
    loads = Frf(
        inverse.frequency, inverse.values, ("fx", "fy", "fz", "mx", "my", "mz"), names, inverse.unit
    )
    assert quality.passivity(loads, FrfForm.APPARENT_MASS, 0.1).margin.min() > 0


def test_one_degree_of_freedom_has_the_phase_of_its_inertance():
    frequency = np.linspace(5, 50, 40)
    omega = 2 * np.pi * frequency
    receptance = 1 / (1e5 * (1 + 0.1j) - 2.0 * omega**2)
    inertance = (-(omega**2) * receptance)[:, np.newaxis, np.newaxis]
    frf = Frf(frequency, inertance, ("x",), ("fx",), "m/s^2/N")
    passivity = quality.passivity(frf, FrfForm.INERTANCE, 1.0)
    phase = np.angle(inertance[:, 0, 0])
    assert np.all((phase > 0) & (phase < np.pi))
    assert passivity.driving_point[:, 0] == pytest.approx(np.sin(phase), rel=1e-9)
    assert passivity.margin == pytest.approx(np.sin(phase), rel=1e-9)
    reversed_sensor = Frf(frequency, -inertance, ("x",), ("fx",), "m/s^2/N")
    assert quality.passivity(reversed_sensor, FrfForm.INERTANCE, 1.0).active_share == 1.0


SEEDS = range(1, 6)


def diagnose(seed, kind, *, n_sensor=6, errors=EXACT, noise=0.01):
    generator = np.random.default_rng(seed)
    test = draw_hammer_test(generator, n_sensor)
    fault = draw_fault(test, kind, generator) if kind else None
    measured = measure(test, generator, fault=fault, errors=errors, noise=noise)
    point = virtual_point.virtual_point(virtual_point.sensor_geometry(test.sensors))
    return culprit_of_responses(point, measured, errors), fault


@pytest.mark.parametrize("kind", [Fault.SIGN, Fault.AXES, Fault.OFFSET])
@pytest.mark.parametrize("n_sensor", [6, 4])
def test_sensor_and_fault_are_named(kind, n_sensor):
    for seed in SEEDS:
        culprit, fault = diagnose(seed, kind, n_sensor=n_sensor)
        assert culprit.named, culprit.verdict
        assert culprit.suspect.name == fault.sensor
        assert culprit.suspect.fault is kind
        if kind is not Fault.OFFSET:
            assert set(culprit.suspect.channels) == set(fault.channels)
        assert culprit.suspect.residual_undone < 0.02 < culprit.residual_of_all
        assert culprit.residual_without[fault.sensor] == min(culprit.residual_without.values())


def test_the_size_of_an_offset_is_found():
    culprit, fault = diagnose(1, Fault.OFFSET, noise=0.0)
    x, y, z = 1e3 * fault.offset
    assert f"sits {1e3 * OFFSET:.1f} mm" in culprit.suspect.detail
    assert f"({x:+.1f}, {y:+.1f}, {z:+.1f}) mm" in culprit.suspect.detail
    assert culprit.verdict.startswith(f"{fault.sensor}: wrong position")


def test_nobody_is_accused_without_a_fault():
    for seed in SEEDS:
        for errors in (EXACT, CAREFUL):
            assert not diagnose(seed, None, errors=errors)[0].named
    perfect, _ = diagnose(1, None, noise=0.0)
    assert perfect.suspect is None
    assert "agree to rounding" in perfect.verdict


def test_what_tolerances_allow_is_nobodys_fault():
    culprit, fault = diagnose(3, Fault.OFFSET)
    assert culprit.named
    generator = np.random.default_rng(3)
    test = draw_hammer_test(generator)
    measured = measure(test, generator, fault=draw_fault(test, Fault.OFFSET, generator))
    point = virtual_point.virtual_point(virtual_point.sensor_geometry(test.sensors))
    rough = culprit_of_responses(point, measured, Tolerances(sensor_position=0.02))
    assert not rough.named
    assert rough.suspect.name == fault.sensor
    assert "times what the tolerances let expect" in rough.verdict


def test_three_sensors_name_a_reversed_channel_and_accuse_nobody_of_more():
    for seed in SEEDS:
        culprit, fault = diagnose(seed, Fault.SIGN, n_sensor=3)
        assert culprit.named
        assert culprit.suspect.name == fault.channels[0]
        for kind in (Fault.AXES, Fault.OFFSET):
            assert not diagnose(seed, kind, n_sensor=3)[0].named
    swapped, _ = diagnose(1, Fault.AXES, n_sensor=3)
    assert "fourth triaxial sensor" in swapped.verdict


def dead(values, generator):
    values[:, 4] = 1e-4 * generator.normal(size=values[:, 4].shape)


def of_another_sensitivity(values, _):
    values[:, 8] *= 1.25


def turned_by_twelve_degrees(values, _):
    c, s = np.cos(np.deg2rad(12)), np.sin(np.deg2rad(12))
    values[:, [9, 10]] = np.einsum("ab,fbi->fai", [[c, s], [-s, c]], values[:, [9, 10]])


def turned_by_a_quarter(values, _):
    values[:, [15, 16]] = np.stack([values[:, 16], -values[:, 15]], axis=1)


def loose(values, generator):
    loud = np.abs(values[:, 3])
    values[:, 3] += loud * (generator.normal(size=loud.shape) + 1j)


def reversed_impact(values, _):
    values[:, :, 11] *= -1


@pytest.mark.parametrize(
    ("seed", "spoil", "fault", "name", "words"),
    [
        (1, dead, Fault.DEAD, "A2 y", "A2 y"),
        (2, of_another_sensitivity, Fault.GAIN, "A3 z", "shows 1.25 times"),
        (3, turned_by_twelve_degrees, Fault.TILT, "A4", "turned by 12.0°"),
        (4, turned_by_a_quarter, Fault.AXES, "A6", "swapped axes, A6 x carries y, A6 y carries −x"),
        (5, loose, Fault.UNEXPLAINED, "A2 x", "noise, cable or loose sensor"),
        (6, reversed_impact, Fault.SIGN, "I12", "I12"),
    ],
)
def test_what_was_done_to_a_channel_is_named(seed, spoil, fault, name, words):
    """Frequency responses of six sensors after `spoil` has changed them."""
    generator = np.random.default_rng(seed)
    test = draw_hammer_test(generator)
    measured = measure(test, generator)
    values = measured.values.copy()
    spoil(values, generator)
    judge, geometry = culprit_of_responses, virtual_point.sensor_geometry(test.sensors)
    if spoil is reversed_impact:
        judge, geometry = culprit_of_excitation, virtual_point.impact_geometry(test.impacts)
    point = virtual_point.virtual_point(geometry)
    assert not judge(point, measured, EXACT).named
    culprit = judge(point, replace(measured, values=values), EXACT)
    assert culprit.named
    assert culprit.suspect.fault is fault
    assert name in {culprit.suspect.name, " ".join(culprit.suspect.channels)}
    assert words in culprit.verdict


def test_switched_off_channels_do_not_confuse():
    generator = np.random.default_rng(7)
    test = draw_hammer_test(generator)
    fault = draw_fault(test, Fault.SIGN, generator)
    measured = measure(test, generator, fault=fault)
    healthy = [s for s in test.sensors if s.name != fault.sensor]
    off = (healthy[0].channels[1], healthy[1].channels[2])
    geometry = virtual_point.sensor_geometry(test.sensors, switched_off=off)
    culprit = culprit_of_responses(virtual_point.virtual_point(geometry), measured, EXACT)
    assert culprit.named
    assert culprit.suspect.channels == fault.channels


def test_nothing_can_be_said_without_redundancy():
    generator = np.random.default_rng(8)
    test = draw_hammer_test(generator, n_sensor=3)
    names = [c for s in test.sensors for c in s.channels]
    for off in ((names[0], names[4], names[8]), (names[1], names[5], names[6])):
        geometry = virtual_point.sensor_geometry(test.sensors, switched_off=off)
        culprit = find_culprit(geometry, generator.normal(size=(9, 6)), EXACT)
        assert not culprit.named
        assert culprit.suspect is None
        assert "no redundancy" in culprit.verdict


NOTHING = replace(EXACT, acceleration_own=0.0, acceleration_norm=0.0)
N_DRAW = 4000


def drawn_errors(sensors, motion, tolerances, generator):
    """Error of each channel in each state, shape (n_draw, n_state, n_channel)."""
    errors = []
    for s in sensors:
        placed = s.position + generator.normal(0, tolerances.sensor_position, (N_DRAW, 1, 3))
        angles = generator.normal(0, tolerances.sensor_angle, (N_DRAW, 3))
        turned = s.orientation @ Rotation.from_rotvec(angles).as_matrix()
        gain = 1 + generator.normal(0, tolerances.sensor_gain, (N_DRAW, 1, 3))
        cross = generator.normal(0, tolerances.sensor_cross_axis, (N_DRAW, 3, 3))
        cross *= 1 - np.eye(3)
        here = motion[:3].T + np.cross(motion[3:].T, placed)
        shown = here @ turned
        shown = gain * shown + np.einsum("nab,nsb->nsa", cross, shown)
        of_sensors = (
            tolerances.acceleration_own * np.abs(shown) * generator.normal(size=shown.shape)
        )
        norm = np.linalg.norm(shown, axis=2, keepdims=True)
        leaked = tolerances.acceleration_norm * norm * generator.normal(size=shown.shape)
        true = (motion[:3].T + np.cross(motion[3:].T, s.position)) @ s.orientation
        errors.append(shown + of_sensors + leaked - true)
    return np.concatenate(errors, axis=2)


@pytest.mark.parametrize(
    "tolerances",
    [
        replace(NOTHING, sensor_position=2e-3),
        replace(NOTHING, sensor_angle=0.01),
        replace(NOTHING, sensor_gain=0.01),
        replace(NOTHING, sensor_cross_axis=0.01),
        replace(NOTHING, acceleration_own=0.01),
        replace(NOTHING, acceleration_norm=0.01),
        Tolerances(),
    ],
)
def test_variance_is_that_of_the_draws(tolerances):
    generator = np.random.default_rng(31)
    test = draw_hammer_test(generator, n_sensor=3)
    motion = generator.normal(size=(6, 2)) * np.array([[1, 1, 1, 9, 9, 9]]).T
    drawn = drawn_errors(test.sensors, motion, tolerances, generator)
    variance = error_variance(virtual_point.sensor_geometry(test.sensors), motion, tolerances)
    assert variance == pytest.approx(np.sum(np.mean(drawn**2, axis=0), axis=0), rel=0.12)


def test_disagreement_is_the_noise_per_degree_of_freedom():
    generator = np.random.default_rng(32)
    test = draw_hammer_test(generator)
    geometry = virtual_point.sensor_geometry(test.sensors)
    motion = generator.normal(size=(2000, 6)) * [1, 1, 1, 9, 9, 9]
    shown = motion @ geometry.forward.T
    size = np.sqrt(np.mean(shown**2, axis=1, keepdims=True))
    noisy = shown / size + 0.02 * generator.normal(size=shown.shape)
    culprit = find_culprit(geometry, noisy, EXACT)
    assert culprit.residual_of_all == pytest.approx(0.02, rel=0.03)
    for residual in culprit.residual_without.values():
        assert residual == pytest.approx(0.02, rel=0.05)
    # six independent motions are not noise: 18 of 18 channels would have shown 0.02 √(12/18)
    assert culprit.residual_of_all > 0.018


DATA = Path(__file__).parents[1] / "data" / "pyfbs-published"


def rows(name):
    with (DATA / name).open(newline="") as file:
        return list(csv.DictReader(file))


def numbers(row, *keys):
    return np.array([float(row[key]) for key in keys])


@pytest.fixture(scope="module")
def sensors():
    return {
        row["name"]: Sensor(
            row["name"],
            SensorKind.ACCELEROMETER,
            "",
            "",
            "",
            1e-3 * numbers(row, "x_mm", "y_mm", "z_mm"),
            rotation_matrix(np.deg2rad(numbers(row, "rx_deg", "ry_deg", "rz_deg"))),
        )
        for row in rows("sensors_AB.csv")
    }


@pytest.fixture(scope="module")
def first_point(sensors):
    position = 1e-3 * numbers(rows("virtual_point_1.csv")[0], "x_mm", "y_mm", "z_mm")
    return virtual_point.sensor_geometry([sensors[name] for name in ("S3", "S4", "S5")], position)


def test_three_sensors_determine_the_published_virtual_point(first_point):
    assert first_point.forward.shape == (9, 6)
    distances = 1e3 * np.linalg.norm(first_point.levers[::3], axis=1)
    assert distances == pytest.approx([32.3, 26.0, 32.7], abs=0.05)
    assert np.linalg.matrix_rank(first_point.forward) == 6
    assert np.linalg.cond(first_point.forward) == pytest.approx(48.9, abs=0.05)


def test_the_limit_of_the_overall_consistency_lies_halfway_from_chance():
    """Of 18 channels the 6 rigid motions keep 1/3 of the energy of noise, √(1/3) of its size."""
    test = draw_hammer_test(np.random.default_rng(21))
    point = virtual_point.virtual_point(sensor_geometry(test.sensors))
    measured = measure(test, np.random.default_rng(1))
    checks = quality_in_operation(point, measured)
    (overall,) = (c for c in checks if c.name == "overall consistency of sensors, mean")
    assert overall.limit == pytest.approx((1 + np.sqrt(6 / 18)) / 2, rel=1e-12)
