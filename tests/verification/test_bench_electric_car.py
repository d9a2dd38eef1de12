"""Electric cars: the coupled car against a second assembly and laws of mechanics."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from deboom.bench import compressor_truth, electric_car
from deboom.bench.choices import CompressorCase
from deboom.bench.compressor_rig import running, true_source
from deboom.bench.powertrain import read_data

LINES = np.array([17.0, 29.0, 57.5, 88.0, 112.0, 131.0, 150.0])
PLAN = compressor_truth.CompressorPlan(CompressorCase.TABLE11)


def _compressor():
    return compressor_truth.true_compressor(PLAN, np.random.default_rng(1))


def _again(car, compressor, hoses, line):
    """Compressor motion and pressure at one line from loads, modes and patches as unknowns."""
    omega, source = 2 * np.pi * line, true_source()
    frequency = np.array([line])
    shapes, body = car.body.shapes_at_paths, car.body
    n_mode = len(shapes)
    size = 6 + n_mode + 30
    matrix = np.zeros((size, size), dtype=complex)
    centre = np.array(compressor.centre)
    cross = np.cross(np.eye(3), centre).T
    mass = np.zeros((6, 6))
    mass[:3, :3] = compressor.mass * np.eye(3)
    mass[:3, 3:] = compressor.mass * cross
    mass[3:, :3] = mass[:3, 3:].T
    mass[3:, 3:] = compressor.inertia + compressor.mass * cross.T @ cross
    matrix[:6, :6] = -(omega**2) * mass + source.gyroscopic(frequency)[0]
    natural = 2 * np.pi * body.frequencies
    modal = natural**2 - omega**2 + 2j * body.damping_ratios * natural * omega
    modes, loads = slice(6, 6 + n_mode), slice(6 + n_mode, size)
    matrix[modes, modes] = np.diag(modal)
    matrix[modes, loads] = -shapes
    # rows of the loads: f_b + Z_bc x + Z_bb y = 0 with y = shapesᵀ q + f_b / k
    follows = np.zeros((30, size), dtype=complex)
    follows[:, modes] = shapes.T
    follows[:, loads] = np.diag(1 / body.local_stiffness)
    matrix[loads, loads] = np.eye(30)
    limit, slope, offset, loss_limit, loss_slope, loss_offset = compressor.gain
    gain = limit - 1 / (slope * line + offset)
    gain = gain + 1j * (loss_limit - 1 / (loss_slope * line + loss_offset))
    for number, place in enumerate(compressor.positions):
        turn = Rotation.from_euler("xyz", compressor.rotations[number]).as_matrix()
        stiffness = gain * turn @ np.diag(compressor.stiffness[number]) @ turn.T
        moved = np.hstack([np.eye(3), np.cross(np.eye(3), place).T])
        rows = 6 * number + np.arange(3)
        matrix[:6, :6] += moved.T @ stiffness @ moved
        matrix[:6] -= moved.T @ stiffness @ follows[rows]
        matrix[6 + n_mode + rows, :6] -= stiffness @ moved
        matrix[6 + n_mode + rows] += stiffness @ follows[rows]
    for number, hose in hoses.items():
        stiffness = hose.stiffness(frequency)[0]
        rows = 18 + 6 * number + np.arange(6)
        matrix[:6, :6] += stiffness[:6, :6]
        matrix[:6] += stiffness[:6, 6:] @ follows[rows]
        matrix[6 + n_mode + rows, :6] += stiffness[6:, :6]
        matrix[6 + n_mode + rows] += stiffness[6:, 6:] @ follows[rows]
    right = np.zeros(size, dtype=complex)
    right[:6] = source.load(frequency)[0]
    solved = np.linalg.solve(matrix, right)
    panels = body.shapes_at_panels.T @ solved[modes]
    return solved[:6], complex(car.cabin.pressure(frequency)[0] @ panels)


@pytest.mark.parametrize("with_hoses", [False, True])
def test_second_assembly_agrees(with_hoses):
    car, compressor = electric_car.draw_fleet(5)["EV-2"], _compressor()
    hoses = compressor_truth.drawn_hoses() if with_hoses else ()
    run = electric_car.run_car(car, compressor, true_source(), LINES, hoses)
    for number, line in enumerate(LINES):
        motion, pressure = _again(car, compressor, dict(enumerate(hoses)), line)
        np.testing.assert_allclose(run.displacement[number], motion, rtol=1e-8, atol=1e-16)
        assert run.pressure[number] == pytest.approx(pressure, rel=1e-8)


def test_stiff_body_is_the_rig():
    car = electric_car.frozen_fleet()["EV-1"]
    stiff = replace(
        car,
        body=replace(
            car.body,
            shapes_at_paths=1e-6 * car.body.shapes_at_paths,
            local_stiffness=1e12 * car.body.local_stiffness,
        ),
    )
    hoses, source = compressor_truth.drawn_hoses(), true_source()
    run = electric_car.run_car(stiff, _compressor(), source, LINES, hoses, 1.6)
    on_rig = running(replace(_compressor(), hoses=hoses), source, LINES, 1.6)
    np.testing.assert_allclose(run.displacement, on_rig.displacement, rtol=1e-8)
    held = (compressor_truth.end_loads(hoses, LINES) @ on_rig.displacement[:, :, None])[:, :, 0]
    np.testing.assert_allclose(
        run.body_load[:, electric_car.columns_of(electric_car.HOSES)], held, rtol=1e-7, atol=1e-12
    )
    soft = electric_car.run_car(stiff, _compressor(), source, LINES)
    np.testing.assert_allclose(
        soft.displacement, running(_compressor(), source, LINES).displacement, rtol=1e-8
    )
    assert not np.any(soft.body_load[:, electric_car.columns_of(electric_car.HOSES)])


DATA_SEED = 20261121


def test_frozen_fleet_is_one_draw_of_the_prior():
    frozen, drawn = electric_car.frozen_fleet(), electric_car.draw_fleet(DATA_SEED)
    assert tuple(frozen) == tuple(drawn) == tuple(f"EV-{k}" for k in range(1, 6))
    for name, car in frozen.items():
        for field in ("frequencies", "damping_ratios", "shapes_at_paths", "shapes_at_panels"):
            stated, again = getattr(car.body, field), getattr(drawn[name].body, field)
            np.testing.assert_allclose(stated, again, rtol=6e-9)


@pytest.mark.parametrize("seed", [1, 2, 77])
def test_every_fleet_has_the_measured_level(seed):
    lines = np.arange(30.0, 140.25, 0.5)
    transfer = electric_car.draw_fleet(seed)["EV-1"].noise_transfer(lines)
    level = np.median(np.abs(transfer[:, electric_car.columns_of(electric_car.MOUNTS, 3)]))
    assert level == pytest.approx(2.1e-3, rel=1e-12)


def test_noise_transfer_is_the_sum_over_panels_and_modes():
    data, line = read_data(electric_car.ELECTRIC_FLEET), 57.5
    car = data["vehicles"]["EV-2"]
    omega, expected = 2 * np.pi * line, 0j
    column = electric_car.POINTS.index("mount 2") * 6 + 2
    for panel, area in enumerate(data["panel_areas"]):
        stiffness = data["bulk_modulus"] / data["volume"] * area
        per_metre = complex(stiffness)
        for mode in data["modes"]:
            natural = 2 * np.pi * mode["frequency"]
            answer = omega**2 / (
                natural**2 - omega**2 + 2j * mode["damping_ratio"] * natural * omega
            )
            shapes = mode["panel_shape"][panel] * mode["ear_shape"]
            per_metre -= 2 * stiffness * shapes * answer
        for number, frequency in enumerate(car["frequencies"]):
            natural, damping = 2 * np.pi * frequency, car["damping_ratios"][number]
            receptance = 1 / (natural**2 - omega**2 + 2j * damping * natural * omega)
            expected += (
                per_metre
                * car["shapes_at_panels"][number][panel]
                * receptance
                * car["shapes_at_paths"][number][column]
            )
    transfer = electric_car.frozen_fleet()["EV-2"].noise_transfer(np.array([line]))[0, column]
    assert abs(transfer / expected - 1) < 1e-12


def test_local_flexibility_is_the_stated_one():
    car = electric_car.frozen_fleet()["EV-3"]
    static = car.receptance(np.array([1e-3]))[0].real
    shapes = car.body.shapes_at_paths
    modes = shapes.T @ np.diag((2 * np.pi * car.body.frequencies) ** -2.0) @ shapes
    local = np.diag(static - modes)
    np.testing.assert_allclose(
        1 / local[electric_car.columns_of(electric_car.POINTS, 3)], 2.5e7, rtol=1e-6
    )
    turning = np.setdiff1d(np.arange(30), electric_car.columns_of(electric_car.POINTS, 3))
    np.testing.assert_allclose(1 / local[turning], 2.5e7 * 0.05**2, rtol=1e-6)


def test_points_lie_at_mounts_and_hose_ends():
    places = electric_car.point_positions()
    np.testing.assert_allclose(places["mount 1"], [-0.15592, 0.00375, 0.01998])
    axis = np.array([-0.3, 0.5, 0.81])
    reach = 0.36 * axis / np.linalg.norm(axis)
    np.testing.assert_allclose(
        places[electric_car.HOSES[0]], np.array([-0.07, 0.035, 0.05]) + reach
    )
