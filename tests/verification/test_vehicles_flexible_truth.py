"""Coupled motion on a body that gives way, against one assembled system of equations.

The truth has powertrain, wheel end and the modes of the body as unknowns of a single matrix, with
mounts between them; it never forms a receptance at the mounts.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from deboom.arrays import derivatives
from deboom.errors import InputError
from deboom.measurement.channels import Frf, LoadCase, Spectrum
from deboom.mounts.mount import Bracket, Mount
from deboom.physics import transfer_path
from deboom.physics.vibration_level import human_weighting
from deboom.vehicles.booming_model import Motion, booming_model
from deboom.vehicles.fleet import Fleet, Vehicle
from deboom.vehicles.powertrain import Powertrain
from deboom.vehicles.receivers import Receiver

AXES = ("x", "y", "z")
LINES = np.arange(20.0, 60.5, 2.0)
SQUARED = (2 * np.pi * LINES) ** 2
PLACES = {"EnM": (0.05, 0.41, 0.2), "GeM": (-0.02, -0.47, 0.18), "TSM": (0.2, -0.05, -0.28)}
CHANNELS = (*(f"{m} {a}" for m in PLACES for a in AXES), "Du left x", "Du right x")
PATHS = (*CHANNELS[:9], "Du x")
MASS, INERTIA, WHEEL_END = 190.0, np.diag([11.0, 7.0, 10.0]), 40.0
RNG = np.random.default_rng(11)
STIFFNESS = RNG.uniform(1e5, 5e5, 11) * (1 + 0.15j)
LOAD = np.zeros(6, dtype=complex)
LOAD[[2, 3, 4]] = 20.0, 10.0, 150.0
END_LOADS = np.array([30.0 + 5j, 25.0 - 8j])
MODES = 2 * np.pi * np.array([[18.0, 27.0, 36.0, 44.0, 71.0], [19.0, 25.0, 38.0, 49.0, 75.0]])
SHAPES = 0.04 * RNG.normal(size=(2, 5, 10))
HEARD = RNG.normal(size=(2, 5)) + 1j * RNG.normal(size=(2, 5))
FELT = RNG.normal(size=(2, 5))
TURNS = {"GeM": (0.0, 30.0, 0.0), "TSM": (10.0, -5.0, 35.0)}


def axes_of(name, tilted):
    if not tilted or name not in TURNS:
        return np.eye(3)
    return Rotation.from_euler("xyz", TURNS[name], degrees=True).as_matrix()


def to_springs(tilted):
    """Return powertrain, wheel ends and paths to the deflection along the springs."""
    source = np.zeros((11, 8))
    paths = np.zeros((11, 10))
    for number, (name, (x, y, z)) in enumerate(PLACES.items()):
        rows = slice(3 * number, 3 * number + 3)
        turn = axes_of(name, tilted)
        source[rows, :6] = turn.T @ np.hstack([np.eye(3), [[0, z, -y], [-z, 0, x], [y, -x, 0]]])
        paths[rows, rows] = turn.T
    source[[9, 10], [6, 7]] = 1.0
    paths[[9, 10], 9] = 1.0
    return source, paths


def modal(vehicle):
    return MODES[vehicle] ** 2 * (1 + 0.06j) - SQUARED[:, np.newaxis]


def assembled(factor, vehicle, tilted, loss=None, heard=HEARD):
    """Solve one car as a whole: motion, forces along the springs, pressure; None: body at rest.

    - `heard` (2, 5): response of each vehicle per motion of each of its modes.
    """
    source, paths = to_springs(tilted)
    mass = np.zeros((8, 8))
    mass[:3, :3], mass[3:6, 3:6] = MASS * np.eye(3), INERTIA
    mass[6:, 6:] = WHEEL_END * np.eye(2)
    scale = np.append(factor[:9], [factor[9]] * 2)
    of_loss = np.ones(11) if loss is None else np.append(loss[:9], [loss[9]] * 2)
    springs = scale * (STIFFNESS.real + 1j * STIFFNESS.imag * of_loss)
    n = 0 if vehicle is None else 5
    relative = source if vehicle is None else np.hstack([source, -paths @ SHAPES[vehicle].T])
    force = np.empty((LINES.size, 11), dtype=complex)
    pressure = np.zeros(LINES.size, dtype=complex)
    moved = np.empty_like(force)
    for line, squared in enumerate(SQUARED):
        whole = np.zeros((8 + n, 8 + n), dtype=complex)
        whole[:8, :8] = -squared * mass
        if n:
            whole[8:, 8:] = np.diag(modal(vehicle)[line])
        whole += (relative.T * springs) @ relative
        load = np.concatenate([LOAD, END_LOADS, np.zeros(n)])
        motion = np.linalg.solve(whole, load)
        moved[line] = relative @ motion
        force[line] = springs * moved[line]
        if n:
            pressure[line] = heard[vehicle] @ motion[8:]
    return moved, force, pressure


BRACKETS = {
    "EnM": Bracket("engine", [], 1e6 * np.array([[1.2, 0.8, 2.0]])),
    "TSM": Bracket("body", LINES, np.outer(1 + 0.01 * LINES * 1j, [0.9e6, 3e6, 1.5e6])),
    "Du": Bracket("body", [], [[4e5 + 2e4j, 5e6, 5e6]]),
}
BRACKETED = (0, 1, 2, 6, 7, 8, 9, 10)
"""Springs with a bracket, each by a point without mass between rubber and bracket."""


def on_brackets(factor, vehicle, tilted):
    """Return the pressure in a car whose brackets are springs of their own."""
    source, paths = to_springs(tilted)
    of_bracket = np.hstack(
        [np.broadcast_to(BRACKETS[n].stiffness, (LINES.size, 3)) for n in ("EnM", "TSM")]
        + [np.broadcast_to(BRACKETS["Du"].stiffness[:, :1], (LINES.size, 2))]
    )
    springs = np.append(factor[:9], [factor[9]] * 2) * STIFFNESS
    nodes = np.eye(11)[:, BRACKETED]
    rubber = np.hstack([source, -paths @ SHAPES[vehicle].T, -nodes])
    rubber[np.ix_(BRACKETED, range(8, 13))] = 0.0
    bracket = np.zeros((8, rubber.shape[1]))
    bracket[:, 13:] = np.eye(8)
    bracket[:, 8:13] = -(paths @ SHAPES[vehicle].T)[list(BRACKETED)]
    pressure = np.empty(LINES.size, dtype=complex)
    for line, squared in enumerate(SQUARED):
        whole = np.zeros((rubber.shape[1],) * 2, dtype=complex)
        whole[:3, :3] = -squared * MASS * np.eye(3)
        whole[3:6, 3:6] = -squared * INERTIA
        whole[6:8, 6:8] = -squared * WHEEL_END * np.eye(2)
        whole[8:13, 8:13] = np.diag(modal(vehicle)[line])
        whole += (rubber.T * springs) @ rubber + (bracket.T * of_bracket[line]) @ bracket
        motion = np.linalg.solve(whole, np.concatenate([LOAD, END_LOADS, np.zeros(13)]))
        pressure[line] = HEARD[vehicle] @ motion[8:13]
    return pressure


def vehicles(receptance=True):
    written = []
    for number in range(2):
        answer = 1.0 / modal(number)
        transfer = (HEARD[number] * answer) @ SHAPES[number]
        of_body = (SHAPES[number].T * answer[:, np.newaxis]) @ SHAPES[number]
        heard = Frf(LINES, transfer[:, np.newaxis], ("ear",), PATHS, "Pa/N")
        given = Frf(LINES, of_body, PATHS, PATHS, "m/N") if receptance else None
        written.append(Vehicle(f"v{number}", "g", heard, given))
    return Fleet(tuple(written))


SEAT = Receiver("seat rail z", "acceleration", "Wk")
WHEEL = Receiver("wheel y", "velocity")
REAR = Receiver("rear ear", weight=0.5)


def with_receivers(fleet):
    """Add a seat rail, a wheel and a rear ear to the first vehicle, and a seat to the second."""
    changed = []
    for number, vehicle in enumerate(fleet.vehicles):
        answer = 1.0 / modal(number)
        moved = (FELT[number] * answer) @ SHAPES[number]
        omega = 2 * np.pi * LINES[:, np.newaxis]
        values = {SEAT: -(omega**2) * moved, WHEEL: 1j * omega * moved}
        values[REAR] = 0.7 * (HEARD[1 - number] * answer) @ SHAPES[number]
        kept = list(values) if number == 0 else [SEAT]
        receivers = {
            each: Frf(LINES, values[each][:, np.newaxis], ("there",), PATHS, each.transfer_unit)
            for each in kept
        }
        changed.append(replace(vehicle, receivers=receivers))
    return Fleet(tuple(changed))


def mounts(tilted):
    def turned(name):
        return (tuple(np.deg2rad(TURNS[name])),) if tilted and name in TURNS else ()

    hung = [Mount(n, "", ("",), (p,), AXES, rotations=turned(n)) for n, p in PLACES.items()]
    sides = ("left", "right"), ((0.1, -0.7, -0.3), (0.1, 0.7, -0.3))
    return (*hung, Mount("Du", "", *sides, ("x",), WHEEL_END, 1.0))


def case(tilted):
    """Return what a bench at rest measures, in vehicle axes."""
    moved, force, _ = assembled(np.ones(10), None, tilted)
    _, paths = to_springs(tilted)
    in_vehicle = np.eye(11)
    in_vehicle[:9, :9] = paths[:9, :9]
    spectra = (
        Spectrum(LINES, each @ in_vehicle, CHANNELS, u) for each, u in ((moved, "m"), (force, "N"))
    )
    return LoadCase("r", "r", 5, 4.0, 220.0, 1.5, *spectra)


def model(tilted, fleet=None, bracketed=None, **options):
    data = fleet or vehicles(), bracketed or mounts(tilted), [(case(tilted), 1.0)], (20.0, 60.0)
    chosen = {"motion": Motion.coupled, "powertrain": Powertrain(MASS, INERTIA)} | options
    return booming_model(*data, **chosen)


FACTORS = np.ones((4, 12))
FACTORS[1:, :10] = np.random.default_rng(2).uniform(0.7, 1.3, (3, 10))


@pytest.mark.parametrize("tilted", [False, True])
def test_powertrain_and_body_move_as_one_system(tilted):
    pressure = model(tilted).pressure(FACTORS)
    for vehicle in range(2):
        true = np.array([assembled(factor[:10], vehicle, tilted)[2] for factor in FACTORS])
        np.testing.assert_allclose(pressure[:, vehicle], true, rtol=1e-8)
    at_rest = model(tilted, vehicles(receptance=False)).pressure(FACTORS)
    assert np.abs(np.log(np.abs(at_rest / pressure))).max() > 0.3  # the body matters here


def test_the_rubber_is_scaled_and_the_car_has_it_in_series_with_its_brackets():
    for tilted in (False, True):
        bracketed = [
            replace(mount, brackets=(BRACKETS[mount.name],)) if mount.name in BRACKETS else mount
            for mount in mounts(tilted)
        ]
        stiff = model(tilted, bracketed=bracketed)
        for vehicle in range(2):
            truth = [on_brackets(row, vehicle, tilted) for row in FACTORS]
            np.testing.assert_allclose(stiff.pressure(FACTORS)[:, vehicle], truth, rtol=1e-10)
        # the exact derivative, against differences of the compiled levels
        differences = derivatives(stiff, FACTORS[1], np.full(12, 1e-4))
        np.testing.assert_allclose(stiff.gradient(FACTORS[1:2])[0], differences.T, rtol=1e-6)


def test_loss_factors_levels_and_gradients_follow_the_assembled_system():
    loss = np.random.default_rng(3).uniform(0.7, 1.3, 12)
    split = model(True, loss_factors=True).pressure(np.append(FACTORS[1], loss)[np.newaxis])
    true = assembled(FACTORS[1, :10], 0, True, loss)[2]
    np.testing.assert_allclose(split[0, 0], true, rtol=1e-8)
    booming = model(True)
    levels = booming.levels(FACTORS).sum(axis=-1)
    np.testing.assert_allclose(booming(FACTORS), levels, rtol=0, atol=1e-9)
    step = 1e-5 * np.eye(12)
    slopes = (booming(FACTORS[1] + step) - booming(FACTORS[1] - step)) / 2e-5
    gradient = booming.gradient(FACTORS[1:2])[0]
    np.testing.assert_allclose(gradient, slopes.T, rtol=1e-5, atol=1e-4)
    values, pull_back = booming.linearised(FACTORS[1:2])
    np.testing.assert_array_equal(values, booming(FACTORS[1:2]))
    weights = np.random.default_rng(4).standard_normal((2, 1, gradient.shape[0]))
    pulled = pull_back(weights)[:, 0]
    np.testing.assert_allclose(pulled, weights[:, 0] @ gradient, rtol=1e-9, atol=1e-9)
    paths = booming.paths(FACTORS[1], "v1").pressure
    np.testing.assert_allclose(paths, booming.pressure(FACTORS[1:2])[0, 1], rtol=1e-9)


ROWS = [(0, HEARD, 1.0), (0, FELT, -SQUARED), (0, FELT, 2j * np.pi * LINES)]
ROWS += [(0, 0.7 * HEARD[::-1], 1.0), (1, HEARD, 1.0), (1, FELT, -SQUARED)]
"""Vehicle of each response, what of its modes it is, and the factor to the receiver's quantity."""


@pytest.mark.parametrize("tilted", [False, True])
def test_receivers_of_a_vehicle_answer_the_motion_of_its_body(tilted):
    fleet = with_receivers(vehicles())
    with_all, alone = model(tilted, fleet), model(tilted)
    names = ["v0", "v0, seat rail z", "v0, wheel y", "v0, rear ear", "v1", "v1, seat rail z"]
    assert list(with_all.response_names) == names
    amplitudes, levels = with_all.pressure(FACTORS), with_all.levels(FACTORS)
    for row, (vehicle, of_modes, factor) in enumerate(ROWS):
        of_car = [assembled(f[:10], vehicle, tilted, heard=of_modes)[2] for f in FACTORS]
        true = factor * np.array(of_car)
        np.testing.assert_allclose(amplitudes[:, row], true, rtol=1e-8)
        if row == 1:  # a weighted acceleration over 1 µm/s²
            felt = human_weighting("Wk", LINES) * np.abs(true) / np.sqrt(2.0)
            np.testing.assert_allclose(levels[:, row], 20 * np.log10(felt / 1e-6), rtol=1e-9)
        if row == 2:  # over 1 nm/s
            felt = np.abs(true) / np.sqrt(2.0)
            np.testing.assert_allclose(levels[:, row], 20 * np.log10(felt / 1e-9), rtol=1e-9)
    np.testing.assert_array_equal(levels[:, [0, 4]], alone.levels(FACTORS))
    np.testing.assert_allclose(with_all(FACTORS)[:, [0, 4]], alone(FACTORS), rtol=0, atol=1e-9)


@pytest.mark.parametrize("receptance", [False, True])
def test_loops_of_several_receivers_agree_with_numpy_and_with_differences(receptance):
    booming = model(True, with_receivers(vehicles(receptance)))
    assert booming.response_unit == (
        "dB(A), dB(Wk) re 1 µm/s², dB re 1 nm/s, dB(A), dB(A), dB(Wk) re 1 µm/s²"
    )
    assert booming.response_weights.tolist() == [1.0, 0.0, 0.0, 0.5, 1.0, 0.0]
    plain = replace(booming, compiled=False)
    np.testing.assert_allclose(booming(FACTORS), plain(FACTORS), rtol=0, atol=1e-9)
    np.testing.assert_allclose(booming(FACTORS), booming.levels(FACTORS).sum(axis=-1), rtol=1e-12)
    step = 1e-5 * np.eye(12)
    slopes = (booming(FACTORS[1] + step) - booming(FACTORS[1] - step)) / 2e-5
    np.testing.assert_allclose(booming.gradient(FACTORS[1:2])[0], slopes.T, rtol=1e-5, atol=1e-4)
    if not receptance:
        return  # loops of bodies at rest have responses alike
    values, pull_back = booming.linearised(FACTORS)
    np.testing.assert_allclose(values, booming(FACTORS), rtol=0, atol=1e-9)
    weights = np.random.default_rng(4).standard_normal((2, *values.shape))
    by_row = np.einsum("onv,nvk->onk", weights, booming.gradient(FACTORS))
    np.testing.assert_allclose(pull_back(weights), by_row, rtol=1e-8, atol=1e-8)


def test_receivers_of_one_name_or_another_unit_are_refused():
    vehicle = with_receivers(vehicles()).vehicles[0]
    functions = vehicle.receivers[SEAT]
    with pytest.raises(InputError, match="duplicated receiver of v0"):
        replace(vehicle, receivers={SEAT: functions, replace(SEAT, weighting=""): functions})
    with pytest.raises(InputError, match="receiver 'wheel y' is of velocity, and its functions ar"):
        replace(vehicle, receivers={WHEEL: functions})
    with pytest.raises(InputError, match="'wheel y' is a velocity, and Wk weights accelerations"):
        replace(WHEEL, weighting="Wk")


def test_blocked_forces_become_those_on_a_receiver_of_known_mass():
    source, spring, receiver = 150.0, 4e5 * (1 + 0.1j), 60.0
    load = 10.0
    blocked = spring * load / (spring - SQUARED * source)
    # both masses joined by the spring: the closed form of two degrees of freedom
    joined = spring * (source + receiver) - SQUARED * source * receiver
    true = load * spring * receiver / joined
    inertia = [(-1.0 / (SQUARED * mass))[:, np.newaxis, np.newaxis] for mass in (source, receiver)]
    mounted = transfer_path.mounted_source(inertia[0], np.full((LINES.size, 1), spring))
    force = transfer_path.force_on_moving_receiver(mounted, inertia[1], blocked[:, np.newaxis])
    np.testing.assert_allclose(force[:, 0], true, rtol=1e-12)


def other(fleet, change):
    first, second = fleet.vehicles
    return Fleet((first, replace(second, receptance=change(second.receptance))))


def test_receptances_that_no_body_has_are_refused():
    fleet = vehicles()

    def of_values(change):
        return lambda frf: replace(frf, values=change(frf.values.copy()))

    def one_way(values):
        values[:, 0, 1:] *= -1.0
        values[:, 1:3, 4:] *= -1.0
        return values

    def mixed_up(values):
        above = np.triu_indices(10, 1)
        values[:, *above] = values[::-1, *above]
        return values

    refusals = {
        "gives energy at": of_values(np.negative),
        "gives energy": of_values(np.conj),
        "at .* has the other sign of that at": of_values(one_way),
        "differs from its transpose": of_values(mixed_up),
        "is in mm/N": lambda frf: replace(frf, unit="mm/N"),
        "has responses at": lambda frf: frf.select(outputs=PATHS[:9]),
    }
    for sentence, change in refusals.items():
        with pytest.raises(InputError, match=f"vehicle v1: its receptance {sentence}"):
            other(fleet, change)
    with pytest.raises(InputError, match=r"vehicles \['v1'\] have neither receptance nor driving"):
        model(False, other(fleet, lambda _: None))
    shifted = other(fleet, lambda frf: replace(frf, frequency=frf.frequency + 0.25))
    with pytest.raises(InputError, match="v1: its receptance has other lines than load case r"):
        model(False, shifted)


def car(loss, stiff=0.0, skew=0.0):
    """Return a vehicle with two paths, from the lossy part of its receptance (f, 2, 2)."""
    lines, paths = np.arange(1.0, 1.0 + len(loss)), ("M x", "M y")
    values = stiff * np.eye(2) - 1j * np.asarray(loss) + 1j * skew * np.array([[0, 1], [-1, 0]])
    heard = Frf(lines, np.ones((len(lines), 1, 2), dtype=complex), ("ear",), paths, "Pa/N")
    return Vehicle("v", "g", heard, Frf(lines, values, paths, paths, "m/N"))


def test_what_a_body_gives_counts_over_the_size_of_its_functions():
    """Two paths of loss 1, coupled by c: powers 1 + c and 1 - c, 5 % of the size at c = 1.72."""
    car([[[1.0, 1.7], [1.7, 1.0]]], stiff=10.0)
    with pytest.raises(InputError, match="v: its receptance gives energy, 6 % of the size of its"):
        car([[[1.0, 1.8], [1.8, 1.0]]], stiff=10.0)
    # what is not reciprocal is noise, which allows for it, and is no energy
    car([[[1.0, 1.8], [1.8, 1.0]]], stiff=10.0, skew=0.1)
    with pytest.raises(InputError, match="gives energy, 13 % of the size of its functions"):
        car([[[1.0, 3.0], [3.0, 1.0]]], stiff=10.0, skew=0.1)


def test_a_path_gives_energy_at_some_lines_only():
    """Three lines give 1 each: half of all squares are given if the fourth takes 1."""
    loss = np.zeros((4, 2, 2))
    loss[:, 0, 0], loss[:, 1, 1] = [1.02, -1.0, -1.0, -1.0], 20.0
    car(loss)
    loss[0, 0, 0] = 0.98
    with pytest.raises(InputError, match="v: its receptance gives energy at M x: check the sign"):
        car(loss)


def test_a_body_answers_as_the_mean_of_there_and_back():
    there = vehicles()
    size = np.abs(there.vehicles[1].receptance.values).mean()
    skew = 0.1 * size * np.random.default_rng(5).normal(size=(10, 10))
    unlike = other(there, lambda frf: replace(frf, values=frf.values + (skew - skew.T)))
    np.testing.assert_allclose(
        model(False, unlike).pressure(FACTORS), model(False).pressure(FACTORS), rtol=1e-9
    )
