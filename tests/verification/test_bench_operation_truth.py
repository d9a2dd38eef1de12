"""The virtual compressor in operation: the files hold what the laws of motion say.

The truth is assembled here a second time: loads and the gyroscopic moment from a rotor that turns
in time, hoses from the exact beam element, the rest by cross products. Nothing of the bench's own
matrices is used for it but its parameters.
"""

import json
from dataclasses import replace

import numpy as np
import pytest
from bench_compressor_samples import DATA, cross, mounts, rows_along, table11
from scipy.integrate import solve_ivp
from scipy.optimize import root

from deboom.bench import compressor_rig
from deboom.bench.choices import CalibrationLevel, CompressorCase, HoseCase
from deboom.bench.compressor_truth import (
    CompressorPlan,
    drawn_hoses,
    end_loads,
    held_stiffness,
    true_hoses,
)
from deboom.bench.compressor_writer import write_compressor_test, write_operating_test
from deboom.compressor.unbalance_load import RotationSense, unbalance_load
from deboom.files.operating_test import read_operating_test
from deboom.measurement.compressor_test import HoseState
from deboom.physics.viscoelastic_beam import ViscoelasticBeam, beam_stiffness

TABLE11 = CompressorPlan(CompressorCase.TABLE11)
PLAN = compressor_rig.OperationPlan(TABLE11, HoseCase.DRAWN)
C2 = CalibrationLevel.C2
MASS = table11()[0]
FEW = np.array([17.0, 28.0, 60.0, 110.0, 150.0])


def rigid(r, axes):
    """Motion of the body to that of a point along its axes, all six."""
    turn = np.kron(np.eye(2), axes.T)
    return turn @ np.block([[np.eye(3), -cross(r)], [np.zeros((3, 3)), np.eye(3)]])


def exact_beam(hose, f):
    """12 x 12 of a straight hose of the data; the element itself is held by finite elements."""
    beam = ViscoelasticBeam(
        hose["length_m"],
        hose["EA_N"],
        hose["GJ_N_m2"],
        hose["EI_N_m2"],
        hose["mass_per_length_kg_per_m"],
        hose["loss_factor"],
        np.sqrt(hose["torsion_radius_squared_m2"]),
    )
    return beam_stiffness(beam, [f])[0]


def axes_along(direction):
    """Any right-handed frame will do: a round beam does not know its transverse axes."""
    first = np.array(direction) / np.linalg.norm(direction)
    second = np.cross(first, [0.3, 0.2, 0.9])
    second /= np.linalg.norm(second)
    return np.column_stack([first, second, np.cross(first, second)])


def test_hoses_are_beams_at_their_ports():
    for f in (40.0, 105.0, 150.0):
        expected = np.zeros((6, 6), dtype=complex)
        loads = []
        for hose in DATA["hoses"]:
            axes = axes_along(hose["direction"])
            end, seen = exact_beam(hose, f), rigid(hose["port_position_m"], axes)
            expected += seen.T @ end[:6, :6] @ seen
            loads.append(-np.kron(np.eye(2), axes) @ end[6:, :6] @ seen)
        matrix = held_stiffness(drawn_hoses(), np.array([f]))[0]
        assert np.abs(matrix - expected).max() < 1e-10 * np.abs(expected).max()
        matrix, expected = end_loads(drawn_hoses(), np.array([f]))[0], np.vstack(loads)
        assert np.abs(matrix - expected).max() < 1e-10 * np.abs(expected).max()
    # near 0 Hz a hose is a spring: what goes in comes out, about any point
    stiffness = drawn_hoses()[0].stiffness(np.array([0.0]))[0]
    position, end = drawn_hoses()[0].position, drawn_hoses()[0].end
    lever = np.block([[np.eye(3), np.zeros((3, 3))], [cross(end), np.eye(3)]])
    total = stiffness[:6] + lever @ stiffness[6:]
    assert np.abs(total).max() < 1e-6 * np.abs(stiffness).max()
    assert np.linalg.norm(end - position) == pytest.approx(0.36)
    assert held_stiffness((), FEW).shape == (5, 6, 6)


def test_six_sources_leave_the_sums_of_the_data():
    operation_data = DATA["operation"]
    static = complex(*operation_data["static_unbalance_kg_m"])
    dynamic = complex(*operation_data["dynamic_unbalance_kg_m2"])
    source = compressor_rig.true_source()
    assert len(source.unbalances) == 6
    assert abs(source.static_unbalance - static) < 1e-15 * 1e-3
    assert abs(source.dynamic_unbalance - dynamic) < 1e-15 * 1e-3
    assert abs(static) == pytest.approx(20e-6, rel=1e-8)
    assert abs(dynamic) == pytest.approx(1200e-9, rel=1e-8)
    # real parts of a compressor of 7 kg
    assert all(0 < part.mass < 1 and 0 < part.radius < 0.03 for part in source.unbalances)
    # against the identification's own law, which shares no code
    for sense in (1, -1):
        source = compressor_rig.true_source(sense)
        turning = unbalance_load(
            [part.rotating for part in source.unbalances],
            [part.arm for part in source.unbalances],
            FEW,
            RotationSense(sense),
        )
        for factor in (1.0, 1.6):
            force, turns, moment = source.gas_force, source.rotating_gas_force, source.gas_moment
            gas = factor * np.array([force, turns, -1j * sense * turns, moment, 0, 0])
            load = source.load(FEW, factor)
            assert np.abs(load - turning - gas).max() < 1e-13 * np.abs(load).max()


@pytest.mark.parametrize("sense", [1, -1])
def test_the_steady_state_stays_when_it_is_integrated_over_time(sense):
    """Masses that go round, a rotor that is turned with the body, springs and dampers."""
    integrated = compressor_rig.operation(
        1, C2, replace(PLAN, sense=sense, mount_storage=0.9, mount_loss=1.1)
    )
    source, f = integrated.source, 33.0
    omega = 2 * np.pi * f
    sweep = compressor_rig.true_sweep(integrated, 13.5, soft=False, frequency=np.array([f, f + 1]))
    held = mounts(f, 0.9, 1.1) + sum(
        rigid(h["port_position_m"], axes_along(h["direction"])).T
        @ exact_beam(h, f)[:6, :6]
        @ rigid(h["port_position_m"], axes_along(h["direction"]))
        for h in DATA["hoses"]
    )
    mass, spring, damper = MASS, held.real, held.imag / omega

    def load(t):
        turned = np.exp(1j * omega * t)
        total = np.zeros(6)
        total[0] = 1.6 * (source.gas_force * turned).real
        total[3] = 1.6 * (source.gas_moment * turned).real
        push = source.rotating_gas_force
        angle = sense * (omega * t + np.angle(push))
        total[1:3] += 1.6 * abs(push) * np.array([np.cos(angle), np.sin(angle)])
        for part in source.unbalances:
            angle = sense * (omega * t + part.phase)
            force = part.mass * omega**2 * part.radius * np.array([0, np.cos(angle), np.sin(angle)])
            total[:3] += force
            total[3:] += np.cross([part.arm, 0, 0], force)
        return total

    spin = sense * source.rotor_inertia * omega * np.array([1.0, 0, 0])

    def slope(t, state):
        place, speed = state[:6], state[6:]
        net = load(t) - spring @ place - damper @ speed
        net[3:] -= np.cross(speed[3:], spin)
        return np.concatenate([speed, np.linalg.solve(mass, net)])

    moved = sweep.running.displacement[0]
    begin = np.concatenate([moved.real, (1j * omega * moved).real])
    times = np.linspace(0, 2.0 / f, 9)
    run = solve_ivp(slope, (0, times[-1]), begin, t_eval=times, rtol=1e-9, atol=1e-13)
    expected = np.real(moved[:, None] * np.exp(1j * omega * times))
    assert np.abs(run.y[:3] - expected[:3]).max() < 1e-6 * np.abs(expected[:3]).max()
    assert np.abs(run.y[3:6] - expected[3:]).max() < 1e-6 * np.abs(expected[3:]).max()
    if sense == 1:
        # and it would not without the rotor's moment
        spin = spin * 0
        run = solve_ivp(slope, (0, times[-1]), begin, t_eval=times, rtol=1e-9, atol=1e-13)
        assert np.abs(run.y[3:6] - expected[3:]).max() > 5e-4 * np.abs(expected[3:]).max()


@pytest.fixture(scope="module")
def exact(tmp_path_factory):
    folder = tmp_path_factory.mktemp("operation") / "exact"
    plan = replace(PLAN, hammer_with_hoses=True, time_record=True)
    write_operating_test(folder, 1, plan=plan, noise_free=True)
    return folder, read_operating_test(folder)


@pytest.fixture(scope="module")
def noisy(tmp_path_factory):
    folder = tmp_path_factory.mktemp("operation") / "noisy"
    plan = compressor_rig.OperationPlan(hammer_with_hoses=True, time_record=True)
    write_operating_test(folder, 3, plan=plan)
    return folder, read_operating_test(folder)


def test_exact_files_hold_the_closed_form(exact):
    folder, test = exact
    rig, source = DATA["rig"], compressor_rig.true_source()
    rows = rows_along(rig["sensor_rotation_deg"], rig["sensor_position_m"], degrees=True)
    rotor = np.zeros((6, 6), dtype=complex)
    rotor[3:, 3:] = 1j * DATA["operation"]["rotor_polar_inertia_kg_m2"] * cross([1.0, 0, 0])
    names = [sweep.name for sweep in test.sweeps]
    assert names[:4] == ["standard 7.5 bar", "standard 13.5 bar", "soft 7.5 bar", "soft 13.5 bar"]
    for number, sweep in enumerate(test.sweeps[:4]):
        assert sweep.frequency.tolist() == list(range(17, 151))
        standard = sweep.name.startswith("standard")
        assert sweep.hoses is (HoseState.STANDARD if standard else HoseState.SOFT)
        assert sweep.pressure == pytest.approx(1e5 * compressor_rig.PRESSURES[number % 2])
        load = source.load(sweep.frequency, (1.0, 1.6)[number % 2])
        truth = dict(np.load(folder / f"truth/{number}.npz"))
        hoses = held_stiffness(drawn_hoses() if standard else (), sweep.frequency)
        for line, f in enumerate(sweep.frequency):
            squared = (2 * np.pi * f) ** 2
            apparent = MASS + rotor - (mounts(f) + hoses[line]) / squared
            moved = np.linalg.solve(apparent, load[line])
            expected = rows @ moved
            size = np.abs(expected).max()
            assert np.abs(sweep.acceleration.values[line] - expected).max() < 1e-9 * size
            assert np.abs(truth["acceleration"][line] - expected).max() < 1e-9 * size
            off = np.abs(truth["apparent_mass"][line] - apparent).max()
            assert off < 1e-9 * np.abs(apparent).max()
            if standard:
                reaction = hoses[line] @ moved / squared
                assert np.abs(truth["hose_reaction"][line] - reaction).max() < 1e-9 * size
        assert ("hose_reaction" in truth) == standard
    stated = json.loads((folder / "truth/operation.json").read_text(encoding="utf-8"))
    assert stated["sweeps"] == names[:4]
    assert stated["static_unbalance_kg_m"] == pytest.approx(
        DATA["operation"]["static_unbalance_kg_m"], rel=1e-12
    )
    assert stated["hoses"][1]["bending"] == DATA["hoses"][1]["EI_N_m2"]
    assert test.hoses[0].tension == DATA["hoses"][0]["EA_N"]
    assert test.rotor_inertia == DATA["operation"]["rotor_polar_inertia_kg_m2"]


def test_the_hammer_feels_the_hoses(exact):
    _, test = exact
    frf = test.hammer_with_hoses.frf
    lines = np.isin(frf.frequency, [25.0, 105.0, 150.0])
    hoses = held_stiffness(drawn_hoses(), frf.frequency)
    rows = np.linalg.pinv(
        np.vstack([rigid(s.position, s.orientation)[:3] for s in test.hammer.sensors])
    )
    pushes = np.array(
        [[*i.direction, *np.cross(i.position, i.direction)] for i in test.hammer.impacts]
    )
    for f, values, held in zip(frf.frequency[lines], frf.values[lines], hoses[lines], strict=True):
        apparent = MASS - (mounts(f) + held) / (2 * np.pi * f) ** 2
        on_point = rows @ values @ np.linalg.pinv(pushes).T
        expected = np.linalg.inv(apparent)
        assert np.abs(on_point - expected).max() < 1e-8 * np.abs(expected).max()
    without = test.hammer.frf.values[lines]
    assert np.abs(frf.values[lines] / without - 1).max() > 0.1


def test_a_run_up_over_time_is_tracked_to_the_delivered_order_spectra(exact, noisy):
    _, clean = exact
    steady = clean.sweeps[2].acceleration.values
    tracked = clean.sweeps[4]
    assert tracked.name == "soft 7.5 bar over time"
    assert tracked.frequency.tolist() == list(range(50, 61))
    expected = steady[33:44]
    off = np.linalg.norm(tracked.acceleration.values - expected) / np.linalg.norm(expected)
    assert off < 2e-3
    # with noise, within what is stated of both
    _, test = noisy
    other, tracked = test.sweeps[2], test.sweeps[4]
    difference = tracked.acceleration.values - other.acceleration.values[33:44]
    deviation = np.hypot(tracked.deviation, other.deviation[33:44])
    parts = np.concatenate([(difference / deviation).real, (difference / deviation).imag])
    assert 0.3 < np.sqrt(np.mean(parts**2)) < 1.3


def test_noise_has_the_size_that_the_files_state(noisy):
    folder, test = noisy
    rows = np.load(folder / "truth/operation.npz")["response_matrix"]
    parts = []
    for number, sweep in enumerate(test.sweeps[:4]):
        truth = np.load(folder / f"truth/{number}.npz")
        squared = (2 * np.pi * truth["frequency"][:, None]) ** 2
        seen = -squared * truth["displacement"] @ rows.T
        np.testing.assert_allclose(truth["acceleration"], seen, rtol=1e-12)
        off = (sweep.acceleration.values - truth["acceleration"]) / sweep.deviation
        parts.append(np.concatenate([off.real.ravel(), off.imag.ravel()]))
    assert np.std(parts, axis=1) == pytest.approx(np.ones(4), abs=0.04)
    # two sweeps have noise of their own
    assert np.abs(np.corrcoef(parts) - np.eye(4)).max() < 0.06
    # 0.3 % and 4e-4 m/s², together
    operated = compressor_rig.operation(2, C2, compressor_rig.OperationPlan())
    loud = compressor_rig.true_sweep(operated, 7.5, soft=True, frequency=compressor_rig.speeds())
    silent = replace(loud, acceleration=0 * loud.acceleration)
    drawn = compressor_rig.measured(silent, np.random.default_rng(1))
    size = np.sqrt(np.mean(np.abs(drawn) ** 2, axis=1)) / compressor_rig.floor(
        compressor_rig.speeds()
    )
    assert size.mean() == pytest.approx(1, abs=0.03)
    assert compressor_rig.floor(np.array([1e6]))[0] == pytest.approx(4e-4)
    shout = replace(loud, acceleration=np.full_like(loud.acceleration, 1e6))
    drawn = compressor_rig.measured(shout, np.random.default_rng(1)) / 1e6 - 1
    assert np.sqrt(np.mean(np.abs(drawn) ** 2)) == pytest.approx(3e-3, rel=0.03)


def test_a_mount_is_as_soft_as_its_stroke_makes_it_while_it_runs():
    """Amplitudes by a root finder, strokes by looking at the orbit."""
    operated = compressor_rig.operation(1, C2, replace(PLAN, softening=True))
    frequency = np.array([18.0, 24.0, 29.0, 60.0])
    run = compressor_rig.true_sweep(operated, 7.5, soft=True, frequency=frequency).running
    law, truth = DATA["operation"]["amplitude_law"], DATA["truth"]

    def factor(stroke):
        fall = 1 / (1 + stroke / law["scale"]) - 1 / (1 + law["reference"] / law["scale"])
        return 1 + law["share"] * fall

    turns = np.exp(2j * np.pi * np.linspace(0, 1, 2001))
    bodies = operated.laboratory.compressor
    rotor = np.zeros((6, 6), dtype=complex)
    rotor[3:, 3:] = 1j * DATA["operation"]["rotor_polar_inertia_kg_m2"] * cross([1.0, 0, 0])
    points = [rigid(r, np.eye(3))[:3] for r in truth["mount_position_m"]]
    for line, f in enumerate(frequency):
        squared = (2 * np.pi * f) ** 2
        load = compressor_rig.true_source().load(np.array([f]))[0]

        def unbalanced(microns, f=f, squared=squared, load=load):
            scaled = replace(
                bodies,
                hoses=(),
                softening=None,
                stiffness=factor(1e-6 * microns)[:, None] * bodies.stiffness,
            )
            held = scaled.mount_stiffness(np.array([f]))[0]
            moved = np.linalg.solve(held - squared * (MASS + rotor), load)
            orbits = [np.real(point @ moved[:, None] * turns) for point in points]
            stroke = [np.linalg.norm(orbit, axis=0).max() for orbit in orbits]
            return 1e6 * np.array(stroke) - microns

        solved = root(unbalanced, np.full(3, 20.0), tol=1e-6)
        assert solved.success
        np.testing.assert_allclose(run.amplitudes[line], 1e-6 * solved.x, rtol=2e-5)
        np.testing.assert_allclose(run.factors[line], factor(1e-6 * solved.x), rtol=1e-5)
    assert run.factors.max() - run.factors.min() > 0.1
    orbit = np.random.default_rng(1).standard_normal((2, 6, 2)) @ [1, 1j]
    looked = np.linalg.norm(np.real(orbit.reshape(2, 2, 3, 1) * turns), axis=2).max(axis=2)
    np.testing.assert_allclose(compressor_rig.strokes(orbit), looked, rtol=1e-5)


def test_hoses_scatter_as_stated_and_the_compressor_stays():
    drawn = drawn_hoses()
    ratios = []
    for seed in range(1, 40):
        scattered = true_hoses(HoseCase.SCATTERED, np.random.default_rng(seed))
        for hose, other in zip(scattered, drawn, strict=True):
            np.testing.assert_array_equal(hose.position, other.position)
            ratios.append(
                [
                    getattr(hose.beam, name) / getattr(other.beam, name)
                    for name in ("tension", "torsion", "bending", "line_mass", "loss_factor")
                ]
            )
        displaced = true_hoses(HoseCase.DISPLACED, np.random.default_rng(seed))
        for hose, other in zip(displaced, drawn, strict=True):
            assert 0 < np.abs(hose.position - other.position).max() <= 4e-3
            assert np.degrees(np.arccos(hose.direction @ other.direction)) < 10
            assert abs(hose.beam.length / other.beam.length - 1) <= 0.04
    assert 0.75 <= np.min(ratios) < 0.8
    assert 1.25 < np.max(ratios) <= 1.3
    bodies = [
        compressor_rig.operation(5, C2, compressor_rig.OperationPlan(hoses=case)).laboratory
        for case in HoseCase
    ]
    for body in bodies[1:]:
        assert body.compressor.mass == bodies[0].compressor.mass
        np.testing.assert_array_equal(body.placed.sensor_gain, bodies[0].placed.sensor_gain)


def test_a_seed_is_one_test_and_its_hammer_is_the_known_one(noisy, tmp_path):
    again, test = noisy
    two = write_operating_test(tmp_path / "two", 3)
    # what is asked for besides changes nothing else
    mentions = ("operation.toml", "README.txt")
    for path in sorted(two.rglob("*")):
        if path.is_file() and (path.parent != two or path.name not in mentions):
            assert path.read_bytes() == (again / path.relative_to(two)).read_bytes(), path
    alone = write_compressor_test(tmp_path / "alone", 3)
    for path in sorted(alone.rglob("*")):
        if path.is_file():
            assert path.read_bytes() == (again / "hammer" / path.relative_to(alone)).read_bytes()
    # struck twice by the same hands, not with the same noise
    truths = [
        json.loads((again / name / "truth/truth.json").read_text(encoding="utf-8"))
        for name in ("hammer", "hammer_with_hoses")
    ]
    for key in ("sensor_gain", "hammer_gain", "impact_direction", "static_stiffness"):
        assert truths[0][key] == truths[1][key]
    off = []
    for name, frf in (
        ("hammer", test.hammer.frf),
        ("hammer_with_hoses", test.hammer_with_hoses.frf),
    ):
        off.append(frf.values - np.load(again / name / "truth/truth.npz")["frf"])
    noise = [np.concatenate([part[200:].real.ravel(), part[200:].imag.ravel()]) for part in off]
    assert abs(np.corrcoef(noise)[0, 1]) < 0.1
