"""Free bodies: the truth comes back from mass lines, printed results from real swing tests."""

from pathlib import Path

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.measurement.free_body import free_body, pendulum_inertia, torsion_inertia
from deboom.physics.rigid_body import forward_matrices, mass_matrix

LINES = np.arange(20.0, 160.1, 1.0)
BICYCLES = Path(__file__).parents[1] / "data" / "bicycle-inertia"


def drawn_body(rng):
    """Mass from 5 to 200 kg, its size that of a machine, the virtual point anywhere inside."""
    mass = rng.uniform(5.0, 200.0)
    size = (mass / 2000.0) ** (1 / 3)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    inertia = mass * size**2 * turn @ np.diag(rng.uniform(0.12, 0.38, 3)) @ turn.T
    return mass, rng.uniform(-0.3, 0.3, 3) * size, inertia


def accelerance(body, rng, noise=0.002, hung=0.0, lines=LINES):
    """Rigid body, three flexible modes far above the band, and noise of each entry's own size."""
    matrix = mass_matrix(body[0], body[2], body[1])
    square = (2 * np.pi * lines[:, None, None]) ** 2
    springs = (2 * np.pi * hung) ** 2 * np.diag(np.diag(matrix)) * (1 + 0.05j)
    values = np.linalg.inv(matrix - springs / square)
    compliance = np.sqrt(np.diag(np.linalg.inv(matrix)))
    for natural in (2 * np.pi * rng.uniform(250.0, 500.0, 3)) ** 2:
        shape = 0.6 * rng.normal(size=6) * compliance
        values = values - square * np.outer(shape, shape) / (natural * (1 + 0.02j) - square)
    errors = rng.normal(size=(2, *values.shape)) / np.sqrt(2)
    return values + noise * np.abs(values) * (errors[0] + 1j * errors[1])


def scores(identified, body):
    mass, centre, inertia = body
    products = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]
    truth = np.array([mass, *centre, *(inertia[i, j] for i, j in products)])
    value = np.array(
        [
            identified.body.mass,
            *identified.body.centre,
            *(identified.body.inertia[i, j] for i, j in products),
        ]
    )
    return (value - truth) / identified.deviation


def test_twenty_free_bodies_with_flexible_modes():
    """Asked: 0.5 % of mass, 0.3 mm of the centre, 95 % intervals that hold in 90 to 98 %."""
    rng, inside = np.random.default_rng(5), []
    for _ in range(20):
        body = drawn_body(rng)
        identified = free_body(LINES, accelerance(body, rng))
        assert identified.body.mass == pytest.approx(body[0], rel=0.005)
        assert identified.body.centre == pytest.approx(body[1], abs=0.3e-3)
        inside.extend(np.abs(scores(identified, body)) < 1.96)
    assert 0.90 <= np.mean(inside) <= 0.98


def test_a_softly_hung_body():
    """On elastic ropes of 2 to 3 Hz the mass comes back with the suspension's term alone."""
    rng = np.random.default_rng(6)
    for _ in range(5):
        body = drawn_body(rng)
        values = accelerance(body, rng, hung=rng.uniform(2.0, 3.0))
        assert free_body(LINES, values, hung=True).body.mass == pytest.approx(body[0], rel=0.005)


def test_a_weighed_mass_takes_a_common_gain_out():
    rng = np.random.default_rng(7)
    body = drawn_body(rng)
    values = 1.03 * accelerance(body, rng)
    assert free_body(LINES, values).body.mass == pytest.approx(body[0] / 1.03, rel=0.005)
    weighed = free_body(LINES, values, weighed=(body[0], 1e-3 * body[0]))
    assert weighed.gain == pytest.approx(1.03, rel=0.005)
    assert np.all(np.abs(scores(weighed, body)) < 4)


def test_channels_of_other_gains_widen_the_intervals():
    """1 % of gain from channel to channel: the mass may err by as much, and says so."""
    rng, inside, widths = np.random.default_rng(8), [], []
    for _ in range(20):
        body = drawn_body(rng)
        gains = 1 + 0.01 * rng.normal(size=(2, 6))
        values = gains[0][:, None] * accelerance(body, rng) * gains[1]
        identified = free_body(LINES, values, gain_deviation=0.01)
        inside.append(np.abs(scores(identified, body)) < 1.96)
        widths.append(identified.deviation[0] / body[0])
    assert 0.90 <= np.mean(inside) <= 0.99
    assert np.median(widths) == pytest.approx(0.01 * np.sqrt(2 / 3), rel=0.3)


def test_raw_sensors_and_impacts_give_the_body_at_the_virtual_point():
    rng = np.random.default_rng(9)
    body = drawn_body(rng)
    sensors = forward_matrices(rng.uniform(-0.2, 0.2, (4, 3)))
    impacts = forward_matrices(rng.uniform(-0.2, 0.2, (4, 3)))
    raw = sensors @ accelerance(body, rng, noise=0.0) @ impacts.T
    identified = free_body(LINES, raw, sensors=sensors, impacts=impacts)
    assert identified.body.mass == pytest.approx(body[0], rel=0.002)
    assert identified.body.centre == pytest.approx(body[1], abs=0.3e-3)


def test_sensors_and_impacts_at_one_height_state_the_error_of_the_centre():
    """Entries at the virtual point share the noise of raw channels: 1.3 σ without that, over 40."""
    rng, errors = np.random.default_rng(17), []
    for _ in range(40):
        body = drawn_body(rng)
        size = 2 * (body[0] / 2000.0) ** (1 / 3)
        points = rng.uniform(-0.5, 0.5, (2, 4, 3)) * size
        points[..., 2] = (0.4 + 0.03 * rng.normal(size=(2, 4))) * size
        sensors, impacts = (forward_matrices(p) for p in points)
        raw = sensors @ accelerance(body, rng, noise=0.0) @ impacts.T
        noise = (rng.normal(size=raw.shape) + 1j * rng.normal(size=raw.shape)) / np.sqrt(2)
        raw = raw + 0.02 * np.abs(raw) * noise
        errors.append(scores(free_body(LINES, raw, sensors=sensors, impacts=impacts), body)[3])
    assert 0.8 <= np.sqrt(np.mean(np.square(errors))) <= 1.15


@pytest.mark.parametrize(
    ("lines", "shape", "options", "words"),
    [
        (np.arange(0.0, 20.0), (20, 6, 6), {}, "leave the line at 0 Hz out"),
        (np.arange(20.0, 40.0), (20, 6, 5), {}, r"has shape \(20, 6, 6\)"),
        (np.arange(20.0, 40.0), (20, 6, 6), {"band": (20, 24)}, "5 lines from 20 to 24 Hz"),
        (np.arange(20.0, 40.0), (20, 6, 6), {"band": (10, 30)}, "nothing is extrapolated"),
        (np.arange(20.0, 40.0), (20, 6, 6), {"band": (20, 39)}, "is not that of a body"),
    ],
)
def test_what_is_no_mass_line_is_refused(lines, shape, options, words):
    with pytest.raises(InputError, match=words):
        free_body(lines, -np.ones(shape), **options)


def read(name):
    pairs = (line.partition("=") for line in (BICYCLES / name).read_text().splitlines())
    sheet = {}
    for key, _, text in pairs:
        value, _, deviation = text.partition("+/-")
        sheet[key.strip()] = (float(value), float(deviation or 0))
    return sheet


@pytest.mark.parametrize("bicycle", ["Browser", "Pista"])
def test_the_front_wheel_of_a_measured_bicycle(bicycle):
    """Axle by its pendulum, diameter by the torsion wire: the printed inertias and deviations."""
    m, printed = read(f"{bicycle}Measured.txt"), read(f"{bicycle}Benchmark.txt")
    axle, deviation = pendulum_inertia(m["mF"], m["lF"], m["TcF1"], m["g"])
    assert axle == pytest.approx(printed["IFyy"][0], rel=1e-9)
    assert deviation == pytest.approx(printed["IFyy"][1], rel=1e-4)
    rod = m["mP"][0] / 12 * (3 * (m["dP"][0] / 2) ** 2 + m["lP"][0] ** 2)
    diameter, _ = torsion_inertia(m["TtF1"], m["TtP1"], (rod, 0.0))
    assert diameter == pytest.approx(printed["IFxx"][0], rel=1e-9)


@pytest.mark.parametrize("which", range(3))
def test_deviations_of_a_torsion_pendulum_are_those_of_differences(which):
    """Each of the period, the reference's and the reference inertia, by itself."""
    pairs = [(2.0, 0.0), (1.3, 0.0), (0.1, 0.0)]
    pairs[which] = (pairs[which][0], 1e-6)
    value, deviation = torsion_inertia(*pairs)
    pairs[which] = (pairs[which][0] + 1e-6, 0.0)
    assert deviation == pytest.approx(abs(torsion_inertia(*pairs)[0] - value), rel=1e-5)


def test_impossible_swings_are_refused():
    with pytest.raises(InputError, match=r"point mass on 0\.5 m"):
        pendulum_inertia((2.0, 0.0), (0.5, 0.0), (1.0, 0.0))
    with pytest.raises(InputError, match="above 0"):
        torsion_inertia((1.0, 0.0), (0.0, 0.0), (1.0, 0.0))
    with pytest.raises(InputError, match="above 0"):
        torsion_inertia((1.0, 0.1), (1.0, 0.1), (0.0, 0.1))


def test_what_moves_like_no_rigid_body_is_refused():
    values = np.tile(np.diag([0.2, 0.2, 0.2, 50.0, 50.0, 40.0]), (LINES.size, 1, 1))
    values[:, 0, 1], values[:, 1, 0] = 5.0, -5.0
    with pytest.raises(InputError, match="no rigid body moves like this"):
        free_body(LINES, values)
